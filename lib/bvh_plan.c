/* bvh_plan.c -- which nodes of the binary tree become wide ones, at the least expected cost.
 *
 * Dynamic programming after Ylitie, Karras & Laine 2017 (section 3.2), from the leaves up. A leaf costs by its 8-wide
 * blocks. Compared with opening the largest child first this fills 7 of 8 children instead of 4 and needs half as many
 * blocks. Of what is computed only the choices stay, 3 bits each: how many of i children, i = 2 ... 8, the left side
 * gets; 0: the same plan as with i - 1.
 */
#include "bvh_tree.h"

#include <math.h>

enum { WIDE = BVH_WIDE, LEAF_TRIANGLES = 32, LEAF_QUADRICS = 8 };

/* What visiting costs, per unit of surface area: one node of eight boxes, one block of eight triangles, one quadric. */
static const double cost_node = 1, cost_block = 1, cost_quadric = 0.4;

static double area(const brume_bvh_binary *n) {
    double x = (double)n->hi[0] - n->lo[0], y = (double)n->hi[1] - n->lo[1], z = (double)n->hi[2] - n->lo[2];
    return x * y + y * z + z * x;
}

static double leaf_cost(const brume_bvh_binary *n, double size) {
    if (n->kind == BVH_TRIANGLES && n->count <= LEAF_TRIANGLES) return size * cost_block * ((n->count + 7) / 8);
    if (n->kind == BVH_QUADRICS && n->count <= LEAF_QUADRICS) return size * cost_quadric * n->count;
    return INFINITY;
}

static unsigned split_of(const brume_bvh_binary *n, int slots) { return n->plan >> (3 * (slots - 2)) & 7; }

void brume_bvh_plan(brume_bvh_binary *node, const brume_bvh_forest *left, const brume_bvh_forest *right, double unit,
                    brume_bvh_forest *own) {
    double size = area(node) * unit, leaf = leaf_cost(node, size);
    node->plan = 0;
    if (!left) {
        node->leaf = 1;
        for (int i = 0; i < WIDE - 1; i++) own->cost[i] = (float)leaf;
        return;
    }
    float shared[WIDE + 1];
    unsigned split[WIDE + 1];
    for (int i = 2; i <= WIDE; i++) {
        shared[i] = INFINITY;
        split[i] = 0;
        for (int k = 1; k < i; k++) {
            float cost = left->cost[k - 1] + right->cost[i - k - 1];
            if (cost < shared[i]) {
                shared[i] = cost;
                split[i] = (unsigned)k;
            }
        }
    }
    double wide = shared[WIDE] + size * cost_node;
    unsigned plan = split[WIDE] << (3 * (WIDE - 2));
    node->leaf = leaf <= wide;
    own->cost[0] = (float)(node->leaf ? leaf : wide);
    for (int i = 2; i < WIDE; i++) {
        /* With equal cost fewer children: their slots may serve others. */
        int better = shared[i] < own->cost[i - 2];
        own->cost[i - 1] = better ? shared[i] : own->cost[i - 2];
        plan |= better ? split[i] << (3 * (i - 2)) : 0;
    }
    node->plan = plan & ((1u << 21) - 1);
}

int brume_bvh_children(const brume_bvh_tree *tree, uint32_t number, uint32_t out[WIDE]) {
    struct { uint32_t node; int slots; } stack[WIDE + 1];
    int top = 0, count = 0;
    if (brume_bvh_at(tree, number)->leaf) { /* only the root: a scene of one leaf still needs a node above it */
        out[0] = number;
        return 1;
    }
    stack[top].node = number, stack[top++].slots = WIDE;
    while (top > 0) {
        uint32_t at = stack[--top].node;
        const brume_bvh_binary *n = brume_bvh_at(tree, at);
        int slots = stack[top].slots;
        if (n->children == 0) slots = 1;
        while (slots > 1 && split_of(n, slots) == 0) slots--;
        if (slots == 1) {
            out[count++] = at;
            continue;
        }
        int left = (int)split_of(n, slots);
        stack[top].node = n->children + 1, stack[top++].slots = slots - left;
        stack[top].node = n->children, stack[top++].slots = left;
    }
    return count;
}

/* bvh_collapse.c -- from the binary tree to 8-wide nodes, at the least expected cost.
 *
 * Dynamic programming after Ylitie, Karras & Laine 2017 (section 3.2): forest[n][i - 1] is the least cost of showing
 * the subtree under binary node n as at most i children of some wide node. A leaf costs by its 8-wide blocks. Compared
 * with opening the largest child first this fills 7 of 8 children instead of 4 and needs half as many blocks.
 */
#include "bvh_tree.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { WIDE = 8, LEAF_TRIANGLES = 32, LEAF_QUADRICS = 8 };

/* What visiting costs, per unit of surface area: one node of eight boxes, one block of eight triangles, one quadric. */
static const double cost_node = 1, cost_block = 1, cost_quadric = 0.4;

/* A plan per binary node. split[i - 1]: how many of i children the left side gets; 0: the same plan as with i - 1. */
typedef struct plan {
    float forest[WIDE - 1];
    uint8_t split[WIDE];
    uint8_t leaf; /* as one child it is a leaf */
} plan;

static double area(const brume_bvh_binary *n) {
    double x = (double)n->hi[0] - n->lo[0], y = (double)n->hi[1] - n->lo[1], z = (double)n->hi[2] - n->lo[2];
    return x * y + y * z + z * x;
}

static double leaf_cost(const brume_bvh_binary *n) {
    if (n->quadrics == 0 && n->count <= LEAF_TRIANGLES) return area(n) * cost_block * ((n->count + 7) / 8);
    if (n->quadrics == n->count && n->count <= LEAF_QUADRICS) return area(n) * cost_quadric * n->count;
    return INFINITY;
}

/* `unit` scales areas so that costs stay floats at any scene size. */
static void plan_node(const brume_bvh_binary *nodes, plan *plans, uint32_t at, double unit) {
    const brume_bvh_binary *n = &nodes[at];
    plan *p = &plans[at];
    double leaf = leaf_cost(n) * unit;
    memset(p, 0, sizeof *p);
    if (n->right == 0) {
        p->leaf = 1;
        for (int i = 0; i < WIDE - 1; i++) p->forest[i] = (float)leaf;
        return;
    }
    const plan *left = &plans[at + 1], *right = &plans[n->right];
    double shared[WIDE + 1];
    for (int i = 2; i <= WIDE; i++) {
        shared[i] = INFINITY;
        for (int k = 1; k < i; k++) {
            double cost = (double)left->forest[k - 1] + right->forest[i - k - 1];
            if (cost < shared[i]) {
                shared[i] = cost;
                p->split[i - 1] = (uint8_t)k;
            }
        }
    }
    double node = shared[WIDE] + area(n) * unit * cost_node;
    p->leaf = leaf <= node;
    p->forest[0] = (float)(p->leaf ? leaf : node);
    for (int i = 2; i < WIDE; i++) {
        /* With equal cost fewer children: their slots may serve others. */
        if (shared[i] < p->forest[i - 2]) {
            p->forest[i - 1] = (float)shared[i];
        } else {
            p->forest[i - 1] = p->forest[i - 2];
            p->split[i - 1] = 0;
        }
    }
}

/* The binary nodes that become the children of the wide node for `at`: at most 8, each a leaf or a wide node. */
static int children_of(const brume_bvh_binary *nodes, const plan *plans, uint32_t at, uint32_t out[WIDE]) {
    struct { uint32_t node; int slots; } stack[WIDE + 1];
    int top = 0, count = 0;
    if (plans[at].leaf) { /* only the root: a scene of one leaf still needs a node above it */
        out[0] = at;
        return 1;
    }
    stack[top].node = at, stack[top++].slots = WIDE;
    while (top > 0) {
        uint32_t node = stack[--top].node;
        int slots = stack[top].slots;
        if (nodes[node].right == 0) slots = 1;
        while (slots > 1 && plans[node].split[slots - 1] == 0) slots--;
        if (slots == 1) {
            out[count++] = node;
            continue;
        }
        int left = plans[node].split[slots - 1];
        stack[top].node = nodes[node].right, stack[top++].slots = slots - left;
        stack[top].node = node + 1, stack[top++].slots = left;
    }
    return count;
}

/* How many wide nodes and blocks there will be. */
static void count_output(const brume_bvh_tree *tree, const plan *plans, uint8_t *is_wide, brume_bvh *out) {
    uint64_t wide = 1, blocks = 0, quadric_blocks = 0;
    is_wide[0] = 1;
    for (uint32_t n = 0; n < tree->node_count; n++) {
        if (!is_wide[n]) continue;
        uint32_t child[WIDE];
        int children = children_of(tree->nodes, plans, n, child);
        for (int k = 0; k < children; k++) {
            const brume_bvh_binary *c = &tree->nodes[child[k]];
            if (!plans[child[k]].leaf) {
                is_wide[child[k]] = 1;
                wide++;
            } else if (c->quadrics) {
                quadric_blocks += (c->count + 7) / 8;
            } else {
                blocks += (c->count + 7) / 8;
            }
        }
    }
    out->node_count = (uint32_t)wide;
    out->block_count = (uint32_t)blocks;
    out->quadric_block_count = (uint32_t)quadric_blocks;
}

static void clear_node(b_node *node) {
    memset(node, 0, sizeof *node);
    for (int k = 0; k < WIDE; k++) {
        node->lo_x[k] = node->lo_y[k] = node->lo_z[k] = 1e30f;
        node->hi_x[k] = node->hi_y[k] = node->hi_z[k] = -1e30f;
    }
}

static void fill_block(b_triangle_block *block, const brume_bvh_item *items, uint32_t count, const float *positions,
                       const b_triangle *triangles) {
    for (uint32_t k = 0; k < WIDE; k++) {
        int used = k < count;
        const b_triangle *t = used ? &triangles[items[k].prim] : NULL;
        block->prim[k] = used ? (int)items[k].prim : -1;
        for (int a = 0; a < 3; a++) {
            block->v0[a][k] = used ? positions[3 * (size_t)t->v[0] + a] : NAN;
            block->v1[a][k] = used ? positions[3 * (size_t)t->v[1] + a] : NAN;
            block->v2[a][k] = used ? positions[3 * (size_t)t->v[2] + a] : NAN;
        }
    }
}

typedef struct writer {
    const brume_bvh_tree *tree;
    const float *positions;
    const b_triangle *triangles;
    brume_bvh *out;
    uint32_t blocks, quadric_blocks;
} writer;

static int write_leaf(writer *w, const brume_bvh_binary *leaf) {
    uint32_t n = (leaf->count + 7) / 8, code;
    const brume_bvh_item *items = &w->tree->items[leaf->first];
    if (leaf->quadrics) {
        code = w->quadric_blocks << 4 | 8 | (n - 1);
        for (uint32_t k = 0; k < n * 8; k++)
            w->out->quadric_ids[8 * (size_t)w->quadric_blocks + k] =
                k < leaf->count ? (int32_t)(items[k].prim - w->tree->triangle_count) : -1;
        w->quadric_blocks += n;
    } else {
        code = w->blocks << 4 | (n - 1);
        for (uint32_t k = 0; k < n; k++)
            fill_block(&w->out->blocks[w->blocks + k], items + 8 * k, leaf->count - 8 * k, w->positions, w->triangles);
        w->blocks += n;
    }
    return ~(int)code;
}

/* Wide nodes in the preorder of the binary tree, numbered first because a parent names its children's places. */
static void write_nodes(writer *w, const plan *plans, const uint8_t *is_wide, uint32_t *number) {
    const brume_bvh_binary *nodes = w->tree->nodes;
    uint32_t next = 0;
    for (uint32_t n = 0; n < w->tree->node_count; n++)
        if (is_wide[n]) number[n] = next++;
    for (uint32_t n = 0; n < w->tree->node_count; n++) {
        if (!is_wide[n]) continue;
        uint32_t child[WIDE];
        int children = children_of(nodes, plans, n, child);
        b_node *node = &w->out->nodes[number[n]];
        clear_node(node);
        for (int k = 0; k < children; k++) {
            const brume_bvh_binary *c = &nodes[child[k]];
            node->lo_x[k] = c->lo[0], node->lo_y[k] = c->lo[1], node->lo_z[k] = c->lo[2];
            node->hi_x[k] = c->hi[0], node->hi_y[k] = c->hi[1], node->hi_z[k] = c->hi[2];
            node->child[k] = plans[child[k]].leaf ? write_leaf(w, c) : (int)number[child[k]];
        }
    }
}

/* Levels, and the most entries a walk's stack can hold: pushing k children and going on with one leaves k - 1. */
static brume_result measure(brume_context *context, brume_bvh *bvh) {
    struct levels { uint32_t depth, stack; } *below = malloc(bvh->node_count * sizeof *below);
    if (!below) return brume_fail(context, BRUME_ERROR_MEMORY, "no memory for %u nodes", bvh->node_count);
    for (uint32_t n = bvh->node_count; n-- > 0;) { /* children have larger numbers */
        const b_node *node = &bvh->nodes[n];
        uint32_t children = 0, depth = 0, stack = 0;
        for (int k = 0; k < WIDE; k++) {
            if (node->lo_x[k] > node->hi_x[k]) continue;
            children++;
            if (node->child[k] < 0) continue;
            const struct levels *b = &below[node->child[k]];
            depth = b->depth > depth ? b->depth : depth;
            stack = b->stack > stack ? b->stack : stack;
        }
        below[n].depth = depth + 1;
        below[n].stack = stack + children;
        if (stack > 0) below[n].stack--;
    }
    bvh->depth = below[0].depth;
    bvh->stack_size = below[0].stack > 0 ? below[0].stack : 1;
    free(below);
    return BRUME_OK;
}

brume_result brume_bvh_collapse(brume_context *context, const brume_bvh_tree *tree, const float *positions,
                                const b_triangle *triangles, brume_bvh *out) {
    brume_bvh bvh = {0};
    brume_result result = BRUME_ERROR_MEMORY;
    plan *plans = NULL;
    uint8_t *is_wide = NULL;
    uint32_t *number = NULL;

    bvh.node_count = 1;
    if (tree->node_count) {
        double root = area(&tree->nodes[0]), unit = root > 0 ? 1 / root : 1;
        plans = malloc(tree->node_count * sizeof *plans);
        is_wide = calloc(tree->node_count, 1);
        number = malloc(tree->node_count * sizeof *number);
        if (!plans || !is_wide || !number) goto cleanup;
        for (uint32_t n = tree->node_count; n-- > 0;) plan_node(tree->nodes, plans, n, unit);
        count_output(tree, plans, is_wide, &bvh);
    }
    bvh.nodes = malloc(bvh.node_count * sizeof *bvh.nodes);
    bvh.blocks = malloc(bvh.block_count * sizeof *bvh.blocks + 1);
    bvh.quadric_ids = malloc(bvh.quadric_block_count * 8 * sizeof *bvh.quadric_ids + 1);
    if (!bvh.nodes || !bvh.blocks || !bvh.quadric_ids) goto cleanup;
    if (tree->node_count) {
        writer w = {tree, positions, triangles, &bvh, 0, 0};
        write_nodes(&w, plans, is_wide, number);
    } else {
        clear_node(&bvh.nodes[0]);
    }
    result = measure(context, &bvh);
    if (result == BRUME_OK) *out = bvh;

cleanup:
    free(plans);
    free(is_wide);
    free(number);
    if (result != BRUME_OK) {
        brume_bvh_free(&bvh);
        return brume_fail(context, result, "no memory for a hierarchy over %u primitives", tree->item_count);
    }
    return BRUME_OK;
}

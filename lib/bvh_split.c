/* bvh_split.c -- a binary tree by the binned surface area heuristic (Wald 2007).
 *
 * 16 bins an axis over the boxes' centres; a leaf costs by the number of 8-wide blocks it would fill, because a block
 * costs the same however many of its lanes are used. Leaves hold at most 4 items: the collapse to 8-wide nodes merges
 * them again where that is cheaper. Below DEPTH_SAH levels halves are taken without looking, so the depth is bounded by
 * DEPTH_SAH + 33 whatever the input. One thread, no hashing, no pointers compared: the same input gives the same tree.
 */
#include "bvh_tree.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>

enum { BINS = 16, LEAF_ITEMS = 4, DEPTH_SAH = 64, DEPTH_LIMIT = DEPTH_SAH + 33 };

typedef struct bounds {
    float lo[3], hi[3];
} bounds;

static const bounds empty_bounds = {{FLT_MAX, FLT_MAX, FLT_MAX}, {-FLT_MAX, -FLT_MAX, -FLT_MAX}};

static void grow(bounds *b, const float lo[3], const float hi[3]) {
    for (int a = 0; a < 3; a++) {
        b->lo[a] = lo[a] < b->lo[a] ? lo[a] : b->lo[a];
        b->hi[a] = hi[a] > b->hi[a] ? hi[a] : b->hi[a];
    }
}

/* Half the surface area; in double, because 1e20 squared is not a float. */
static double area(const bounds *b) {
    double x = (double)b->hi[0] - b->lo[0], y = (double)b->hi[1] - b->lo[1], z = (double)b->hi[2] - b->lo[2];
    return x * y + y * z + z * x;
}

static uint32_t blocks_of(uint32_t count) {
    return (count + 7) / 8;
}

/* Twice the centre of an item's box: only compared. */
static float center(const brume_bvh_item *item, int axis) {
    return item->lo[axis] + item->hi[axis];
}

typedef struct binning {
    float origin[3], scale[3]; /* bin = (center - origin) * scale; scale 0: all centres are equal along this axis */
} binning;

static int bin_of(const binning *b, const brume_bvh_item *item, int axis) {
    int bin = (int)((center(item, axis) - b->origin[axis]) * b->scale[axis]);
    return bin < BINS - 1 ? bin : BINS - 1;
}

static binning bin_centers(const brume_bvh_item *items, uint32_t count) {
    binning b;
    for (int a = 0; a < 3; a++) {
        float low = FLT_MAX, high = -FLT_MAX;
        for (uint32_t i = 0; i < count; i++) {
            float c = center(&items[i], a);
            low = c < low ? c : low;
            high = c > high ? c : high;
        }
        /* Spans too small or too large for the quotient to be a normal number count as equal. */
        float scale = BINS * 0.999999f / (high - low);
        b.origin[a] = low;
        b.scale[a] = high > low && scale >= FLT_MIN && scale <= FLT_MAX ? scale : 0;
    }
    return b;
}

/* The best axis and the last bin of its left side; 0 if no axis splits. */
static int choose_split(const brume_bvh_item *items, uint32_t count, const binning *b, int *out_axis, int *out_bin) {
    bounds bin_bounds[3][BINS];
    uint32_t bin_count[3][BINS] = {{0}};
    for (int a = 0; a < 3; a++)
        for (int k = 0; k < BINS; k++) bin_bounds[a][k] = empty_bounds;
    for (uint32_t i = 0; i < count; i++)
        for (int a = 0; a < 3; a++) {
            int k = bin_of(b, &items[i], a);
            bin_count[a][k]++;
            grow(&bin_bounds[a][k], items[i].lo, items[i].hi);
        }

    double best = INFINITY;
    for (int a = 0; a < 3; a++) {
        if (b->scale[a] == 0) continue;
        double right_cost[BINS];
        bounds box = empty_bounds;
        uint32_t n = 0;
        for (int k = BINS - 1; k > 0; k--) {
            n += bin_count[a][k];
            if (bin_count[a][k]) grow(&box, bin_bounds[a][k].lo, bin_bounds[a][k].hi);
            right_cost[k] = n ? area(&box) * blocks_of(n) : 0;
        }
        box = empty_bounds;
        n = 0;
        for (int k = 0; k < BINS - 1; k++) {
            n += bin_count[a][k];
            if (bin_count[a][k]) grow(&box, bin_bounds[a][k].lo, bin_bounds[a][k].hi);
            if (n == 0 || n == count) continue;
            double cost = area(&box) * blocks_of(n) + right_cost[k + 1];
            if (cost < best) {
                best = cost;
                *out_axis = a;
                *out_bin = k;
            }
        }
    }
    return best < INFINITY;
}

static void swap_items(brume_bvh_item *a, brume_bvh_item *b) {
    brume_bvh_item t = *a;
    *a = *b;
    *b = t;
}

/* How many go left. Triangles and quadrics never share a leaf, so where centres can't part them, their kind does. */
static uint32_t split_items(const brume_bvh_tree *tree, brume_bvh_item *items, uint32_t count, uint32_t quadrics,
                            uint32_t depth) {
    uint32_t i = 0, j = count;
    int axis = 0, bin = 0;
    if (depth < DEPTH_SAH) {
        binning b = bin_centers(items, count);
        if (choose_split(items, count, &b, &axis, &bin)) {
            while (i < j) {
                if (bin_of(&b, &items[i], axis) <= bin)
                    i++;
                else
                    swap_items(&items[i], &items[--j]);
            }
            return i;
        }
    }
    if (quadrics == 0 || quadrics == count) return count / 2;
    while (i < j) {
        if (items[i].prim < tree->triangle_count)
            i++;
        else
            swap_items(&items[i], &items[--j]);
    }
    return i;
}

static void describe_node(const brume_bvh_tree *tree, brume_bvh_binary *node) {
    bounds box = empty_bounds;
    uint32_t quadrics = 0;
    for (uint32_t i = node->first; i < node->first + node->count; i++) {
        grow(&box, tree->items[i].lo, tree->items[i].hi);
        quadrics += tree->items[i].prim >= tree->triangle_count;
    }
    for (int a = 0; a < 3; a++) node->lo[a] = box.lo[a], node->hi[a] = box.hi[a];
    node->quadrics = quadrics;
}

brume_result brume_bvh_split(brume_context *context, brume_bvh_tree *tree) {
    struct { uint32_t first, count, depth, parent; } stack[DEPTH_LIMIT + 2], now;
    const uint32_t no_parent = UINT32_MAX;
    uint32_t capacity = tree->item_count / 2 + 16, used = 0;
    int top = 0;

    if (tree->item_count == 0) return BRUME_OK;
    brume_bvh_binary *nodes = malloc(capacity * sizeof *nodes);
    if (!nodes) return brume_fail(context, BRUME_ERROR_MEMORY, "no memory for the tree of %u items", tree->item_count);

    stack[top].first = 0, stack[top].count = tree->item_count, stack[top].depth = 0, stack[top++].parent = no_parent;
    while (top > 0) {
        now = stack[--top];
        if (used == capacity) {
            brume_bvh_binary *more = realloc(nodes, (size_t)capacity * 2 * sizeof *nodes);
            if (!more) {
                free(nodes);
                return brume_fail(context, BRUME_ERROR_MEMORY, "no memory for the tree of %u items", tree->item_count);
            }
            nodes = more;
            capacity *= 2;
        }
        if (now.parent != no_parent) nodes[now.parent].right = used;
        brume_bvh_binary *node = &nodes[used];
        node->first = now.first;
        node->count = now.count;
        node->right = 0;
        describe_node(tree, node);
        if (node->count > LEAF_ITEMS || (node->quadrics != 0 && node->quadrics != node->count)) {
            uint32_t left = split_items(tree, tree->items + now.first, now.count, node->quadrics, now.depth);
            stack[top].first = now.first + left, stack[top].count = now.count - left;
            stack[top].depth = now.depth + 1, stack[top++].parent = used;
            stack[top].first = now.first, stack[top].count = left;
            stack[top].depth = now.depth + 1, stack[top++].parent = no_parent; /* the left child needs no link */
        }
        used++;
    }
    tree->nodes = nodes;
    tree->node_count = used;
    return BRUME_OK;
}

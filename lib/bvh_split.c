/* bvh_split.c -- the binary tree, from the root down, and the plan for the wide one on the way back.
 *
 * Leaves hold at most 4 items: the plan merges them again where that is cheaper. Items are copied from one array to a
 * second and back as they are parted, in their order. Below BVH_DEPTH_SAH levels halves are taken without looking, so
 * the depth is bounded by BVH_DEPTH_SAH + 33 whatever the input.
 */
#include "bvh_bins.h"
#include "bvh_split.h"

#include <stdlib.h>
#include <string.h>

enum { LEAF_ITEMS = 4 };

/* ---- nodes ------------------------------------------------------------------------------------------------------ */

uint32_t brume_bvh_take_pair(brume_bvh_splitter *s, brume_bvh_arena *arena) {
    brume_bvh_tree *tree = s->tree;
    if (arena->next == arena->end) {
        uint32_t chunk = __atomic_fetch_add(&tree->chunk_count, 1, __ATOMIC_RELAXED);
        uint32_t size = arena->most < BVH_CHUNK ? arena->most : BVH_CHUNK;
        brume_bvh_binary *nodes = chunk < tree->chunk_room ? malloc(size * sizeof *nodes) : NULL;
        if (!nodes) {
            __atomic_store_n(&s->failed, 1, __ATOMIC_RELAXED);
            return 0;
        }
        tree->chunks[chunk] = nodes;
        arena->next = (chunk << BVH_CHUNK_BITS) + (chunk == 0 ? 2 : 0);
        arena->end = (chunk << BVH_CHUNK_BITS) + size;
    }
    arena->next += 2;
    return arena->next - 2;
}

void brume_bvh_start_node(brume_bvh_splitter *s, const brume_bvh_range *r, const brume_bounds *box) {
    brume_bvh_binary *node = brume_bvh_at(s->tree, r->node);
    for (int a = 0; a < 3; a++) node->lo[a] = box->lo[a], node->hi[a] = box->hi[a];
    node->first = r->first;
    node->count = r->count;
    node->children = 0;
    node->kind = r->quadrics == 0 ? BVH_TRIANGLES : r->quadrics == r->count ? BVH_QUADRICS : BVH_BOTH;
}

int brume_bvh_is_leaf(const brume_bvh_range *r) {
    return r->count <= LEAF_ITEMS && (r->quadrics == 0 || r->quadrics == r->count);
}

/* ---- parting ---------------------------------------------------------------------------------------------------- */

uint32_t brume_bvh_quadrics(const brume_bvh_tree *tree, const brume_bvh_item *items, uint32_t count) {
    uint32_t quadrics = 0;
    for (uint32_t i = 0; i < count; i++) quadrics += items[i].prim >= tree->triangle_count;
    return quadrics;
}

void brume_bvh_children_of(const brume_bvh_range *r, uint32_t left, uint32_t left_quadrics,
                           brume_bvh_range child[2]) {
    child[0] = child[1] = *r;
    child[0].count = left;
    child[1].first += left;
    child[1].count -= left;
    child[0].quadrics = left_quadrics;
    child[1].quadrics -= left_quadrics;
    child[0].depth = child[1].depth = r->depth + 1;
}

/* Where centres can't part them: triangles and quadrics never share a leaf, so their kind does, else any halves. */
static void take_halves(brume_bvh_splitter *s, const brume_bvh_range *r, brume_bvh_range child[2],
                        brume_bounds box[2]) {
    brume_bvh_item *items = s->items[r->side] + r->first;
    if (r->quadrics == 0 || r->quadrics == r->count) {
        brume_bvh_children_of(r, r->count / 2, r->quadrics ? r->count / 2 : 0, child);
    } else {
        brume_bvh_item *to = s->items[!r->side] + r->first;
        uint32_t triangles = r->count - r->quadrics, next[2] = {0, triangles};
        for (uint32_t i = 0; i < r->count; i++) to[next[items[i].prim >= s->tree->triangle_count]++] = items[i];
        brume_bvh_children_of(r, triangles, 0, child);
        child[0].side = child[1].side = !r->side;
    }
    for (int k = 0; k < 2; k++) {
        box[k] = child[k].centers = brume_bounds_empty();
        brume_bvh_bound(s->items[child[k].side] + child[k].first, child[k].count, &box[k], &child[k].centers);
    }
}

/* Not inlined: its bins would lie on the stack once for each level. */
__attribute__((noinline)) static void part(brume_bvh_splitter *s, const brume_bvh_range *r, brume_bvh_range child[2],
                                           brume_bounds box[2]) {
    brume_bins bins;
    brume_split split;
    if (r->depth >= BVH_DEPTH_SAH) {
        take_halves(s, r, child, box);
        return;
    }
    const brume_bvh_item *items = s->items[r->side] + r->first;
    brume_bvh_item *to = s->items[!r->side] + r->first;
    brume_binning binning = brume_bvh_binning(&r->centers, r->count);
    brume_bins_clear(&bins, &binning);
    brume_bins_add(&bins, &binning, items, r->count);
    if (!brume_bins_split(&bins, &split)) {
        take_halves(s, r, child, box);
        return;
    }
    brume_bounds centers[2] = {brume_bounds_empty(), brume_bounds_empty()};
    brume_bvh_partition(items, r->count, &binning, &split, to, to + split.left, centers);
    brume_bvh_children_of(r, split.left, r->quadrics ? brume_bvh_quadrics(s->tree, to, split.left) : 0, child);
    for (int k = 0; k < 2; k++) {
        child[k].side = !r->side;
        child[k].centers = centers[k];
        box[k] = split.box[k];
    }
}

int brume_bvh_grow(brume_bvh_splitter *s, brume_bvh_arena *arena, const brume_bvh_range *r, brume_bvh_forest *forest) {
    brume_bvh_binary *node = brume_bvh_at(s->tree, r->node);
    if (brume_bvh_is_leaf(r)) {
        if (r->side) memcpy(s->items[0] + r->first, s->items[1] + r->first, r->count * sizeof *s->items[0]);
        brume_bvh_plan(node, NULL, NULL, s->unit, forest);
        return 1;
    }
    brume_bvh_range child[2];
    brume_bvh_forest below[2];
    brume_bounds box[2];
    uint32_t pair = brume_bvh_take_pair(s, arena);
    if (pair == 0) return 0;
    part(s, r, child, box);
    node->children = pair;
    for (uint32_t k = 0; k < 2; k++) {
        child[k].node = pair + k;
        brume_bvh_start_node(s, &child[k], &box[k]);
    }
    for (int k = 0; k < 2; k++)
        if (!brume_bvh_grow(s, arena, &child[k], &below[k])) return 0;
    brume_bvh_plan(node, &below[0], &below[1], s->unit, forest);
    return 1;
}

/* ---- all of it -------------------------------------------------------------------------------------------------- */

static int split_all(brume_bvh_splitter *s) {
    brume_bvh_tree *tree = s->tree;
    brume_bvh_range root = {0, 0, tree->item_count, 0, 0, 0, tree->centers};
    brume_bvh_arena arena = {0, 0, 2 * tree->item_count};
    brume_bvh_forest forest;
    brume_bounds box = tree->box;
    double size[3];
    for (int a = 0; a < 3; a++) size[a] = (double)box.hi[a] - box.lo[a];
    double area = size[0] * size[1] + size[1] * size[2] + size[2] * size[0];
    s->unit = area > 0 ? 1 / area : 1;
    tree->chunk_room = 2 * (tree->item_count / BVH_CHUNK + 1);
    tree->chunks = calloc(tree->chunk_room, sizeof *tree->chunks);
    s->items[0] = tree->items;
    s->items[1] = malloc(tree->item_count * sizeof *tree->items);
    if (!tree->chunks || !s->items[1]) return 0;
    arena.next = brume_bvh_take_pair(s, &arena);
    if (s->failed) return 0;
    root.quadrics = tree->item_count - tree->triangle_count;
    brume_bvh_start_node(s, &root, &box);
    if (tree->threads > 1) return brume_bvh_grow_threaded(s, &arena, &root);
    return brume_bvh_grow(s, &arena, &root, &forest);
}

brume_result brume_bvh_split(brume_context *context, brume_bvh_tree *tree) {
    brume_bvh_splitter s = {.tree = tree};
    int done = split_all(&s);
    free(s.items[1]);
    if (!done) return brume_fail(context, BRUME_ERROR_MEMORY, "no memory for the tree of %u items", tree->item_count);
    return BRUME_OK;
}

void brume_bvh_tree_free(brume_bvh_tree *tree) {
    for (uint32_t i = 0; tree->chunks && i < tree->chunk_count && i < tree->chunk_room; i++) free(tree->chunks[i]);
    free(tree->chunks);
    tree->chunks = NULL;
}

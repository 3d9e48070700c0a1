/* bvh_collapse.c -- writes the 8-wide nodes and the leaves' blocks, as lib/bvh_plan.c has them.
 *
 * Nodes are numbered in preorder, and so are blocks, a node's own leaves first. What lies below a node is counted
 * before, so that its place is known, and who writes it needs nobody else.
 */
#include "bvh_tree.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { WIDE = BVH_WIDE };

/* Of a wide node and all below it. */
typedef struct totals {
    uint32_t nodes, blocks, quadric_blocks;
    uint32_t depth; /* levels of nodes */
    uint32_t stack; /* the most entries that a walk's stack can hold */
} totals;

/* Pushing k children and going on with one leaves k - 1. */
static totals count_below(const brume_bvh_tree *tree, uint32_t number) {
    uint32_t child[WIDE];
    totals sum = {1, 0, 0, 0, 0};
    int children = brume_bvh_children(tree, number, child);
    for (int k = 0; k < children; k++) {
        const brume_bvh_binary *c = brume_bvh_at(tree, child[k]);
        if (c->leaf) {
            uint32_t blocks = (c->count + 7) / 8;
            if (c->kind == BVH_QUADRICS) sum.quadric_blocks += blocks;
            else sum.blocks += blocks;
            continue;
        }
        totals t = count_below(tree, child[k]);
        sum.nodes += t.nodes;
        sum.blocks += t.blocks;
        sum.quadric_blocks += t.quadric_blocks;
        sum.depth = t.depth > sum.depth ? t.depth : sum.depth;
        sum.stack = t.stack > sum.stack ? t.stack : sum.stack;
    }
    sum.depth++;
    sum.stack += (uint32_t)children - (sum.stack > 0);
    return sum;
}

static void clear_node(b_node *node) {
    memset(node, 0, sizeof *node);
    for (int k = 0; k < WIDE; k++) {
        node->lo_x[k] = node->lo_y[k] = node->lo_z[k] = 1e30f;
        node->hi_x[k] = node->hi_y[k] = node->hi_z[k] = -1e30f;
    }
}

typedef struct writer {
    const brume_bvh_tree *tree;
    const float *positions;
    const b_triangle *triangles;
    brume_bvh *out;
    uint32_t nodes, blocks, quadric_blocks; /* which come next */
} writer;

static void fill_block(const writer *w, b_triangle_block *block, const brume_bvh_item *items, uint32_t count) {
    for (uint32_t k = 0; k < WIDE; k++) {
        if (k >= count) {
            block->prim[k] = -1;
            for (int a = 0; a < 3; a++) block->v0[a][k] = block->v1[a][k] = block->v2[a][k] = NAN;
            continue;
        }
        const int *v = w->triangles[items[k].prim].v;
        const float *p = w->positions + 3 * (size_t)v[0], *q = w->positions + 3 * (size_t)v[1];
        const float *r = w->positions + 3 * (size_t)v[2];
        block->prim[k] = (int)items[k].prim;
        for (int a = 0; a < 3; a++) block->v0[a][k] = p[a], block->v1[a][k] = q[a], block->v2[a][k] = r[a];
    }
}

static int write_leaf(writer *w, const brume_bvh_binary *leaf) {
    uint32_t n = (leaf->count + 7) / 8, code;
    const brume_bvh_item *items = &w->tree->items[leaf->first];
    if (leaf->kind == BVH_QUADRICS) {
        code = w->quadric_blocks << 4 | 8 | (n - 1);
        for (uint32_t k = 0; k < n * 8; k++)
            w->out->quadric_ids[8 * (size_t)w->quadric_blocks + k] =
                k < leaf->count ? (int32_t)(items[k].prim - w->tree->triangle_count) : -1;
        w->quadric_blocks += n;
    } else {
        code = w->blocks << 4 | (n - 1);
        for (uint32_t k = 0; k < n; k++)
            fill_block(w, &w->out->blocks[w->blocks + k], items + 8 * k, leaf->count - 8 * k);
        w->blocks += n;
    }
    return ~(int)code;
}

static void write_below(writer *w, uint32_t number) {
    uint32_t child[WIDE];
    b_node *node = &w->out->nodes[w->nodes++];
    int children = brume_bvh_children(w->tree, number, child);
    clear_node(node);
    for (int k = 0; k < children; k++) {
        const brume_bvh_binary *c = brume_bvh_at(w->tree, child[k]);
        node->lo_x[k] = c->lo[0], node->lo_y[k] = c->lo[1], node->lo_z[k] = c->lo[2];
        node->hi_x[k] = c->hi[0], node->hi_y[k] = c->hi[1], node->hi_z[k] = c->hi[2];
        if (c->leaf) node->child[k] = write_leaf(w, c);
    }
    for (int k = 0; k < children; k++) {
        if (brume_bvh_at(w->tree, child[k])->leaf) continue;
        node->child[k] = (int)w->nodes;
        write_below(w, child[k]);
    }
}

brume_result brume_bvh_collapse(brume_context *context, const brume_bvh_tree *tree, const float *positions,
                                const b_triangle *triangles, brume_bvh *out) {
    brume_bvh bvh = {0};
    totals all = {1, 0, 0, 1, 0};
    if (tree->item_count) all = count_below(tree, 0);
    bvh.node_count = all.nodes;
    bvh.block_count = all.blocks;
    bvh.quadric_block_count = all.quadric_blocks;
    bvh.depth = all.depth;
    bvh.stack_size = all.stack > 0 ? all.stack : 1;
    bvh.nodes = malloc(bvh.node_count * sizeof *bvh.nodes);
    bvh.blocks = malloc(bvh.block_count * sizeof *bvh.blocks + 1);
    bvh.quadric_ids = malloc(bvh.quadric_block_count * 8 * sizeof *bvh.quadric_ids + 1);
    if (!bvh.nodes || !bvh.blocks || !bvh.quadric_ids) {
        brume_bvh_free(&bvh);
        return brume_fail(context, BRUME_ERROR_MEMORY, "no memory for a hierarchy over %u primitives",
                          tree->item_count);
    }
    writer w = {tree, positions, triangles, &bvh, 0, 0, 0};
    if (tree->item_count) write_below(&w, 0);
    else clear_node(&bvh.nodes[0]);
    *out = bvh;
    return BRUME_OK;
}

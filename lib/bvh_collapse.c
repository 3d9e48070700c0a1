/* bvh_collapse.c -- writes the 8-wide nodes and the leaves' blocks, as lib/bvh_plan.c has them.
 *
 * Nodes are numbered in preorder, and so are blocks, a node's own leaves first. What lies below a node is counted
 * before, so that its place is known: several threads write, each a subtree after the other, what one would.
 */
#include "bvh_tree.h"
#include "parallel.h"

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

/* A subtree that a thread counts and writes. */
typedef struct subtree {
    uint32_t number; /* of its binary node */
    totals below;
    totals before;   /* nodes and blocks: where it starts */
} subtree;

/* All nodes of more than `most` items lie above the subtrees, which are in preorder. */
typedef struct cut {
    const brume_bvh_tree *tree;
    subtree *subtrees;
    uint32_t count, room, next;
    uint32_t most;
} cut;

/* Adds the subtrees; 0 when memory ran out. */
static int cut_below(cut *c, uint32_t number) {
    uint32_t child[WIDE];
    if (brume_bvh_at(c->tree, number)->count <= c->most) {
        if (c->count == c->room) {
            uint32_t room = 2 * c->room + 64;
            subtree *more = realloc(c->subtrees, room * sizeof *more);
            if (!more) return 0;
            c->subtrees = more;
            c->room = room;
        }
        c->subtrees[c->count++].number = number;
        return 1;
    }
    int children = brume_bvh_children(c->tree, number, child);
    for (int k = 0; k < children; k++)
        if (!brume_bvh_at(c->tree, child[k])->leaf && !cut_below(c, child[k])) return 0;
    return 1;
}

/* Pushing k children and going on with one leaves k - 1. */
static totals count_below(const brume_bvh_tree *tree, uint32_t number, cut *c) {
    uint32_t child[WIDE];
    if (c && brume_bvh_at(tree, number)->count <= c->most) return c->subtrees[c->next++].below;
    totals sum = {1, 0, 0, 0, 0};
    int children = brume_bvh_children(tree, number, child);
    for (int k = 0; k < children; k++) {
        const brume_bvh_binary *n = brume_bvh_at(tree, child[k]);
        if (n->leaf) {
            uint32_t blocks = (n->count + 7) / 8;
            if (n->kind == BVH_QUADRICS) sum.quadric_blocks += blocks;
            else sum.blocks += blocks;
            continue;
        }
        totals t = count_below(tree, child[k], c);
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

static void count_subtree(void *user, uint32_t i) {
    cut *c = user;
    c->subtrees[i].below = count_below(c->tree, c->subtrees[i].number, NULL);
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
    cut *cut;
    totals next; /* nodes and blocks */
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
        code = w->next.quadric_blocks << 4 | 8 | (n - 1);
        for (uint32_t k = 0; k < n * 8; k++)
            w->out->quadric_ids[8 * (size_t)w->next.quadric_blocks + k] =
                k < leaf->count ? (int32_t)(items[k].prim - w->tree->triangle_count) : -1;
        w->next.quadric_blocks += n;
    } else {
        code = w->next.blocks << 4 | (n - 1);
        for (uint32_t k = 0; k < n; k++)
            fill_block(w, &w->out->blocks[w->next.blocks + k], items + 8 * k, leaf->count - 8 * k);
        w->next.blocks += n;
    }
    return ~(int)code;
}

static void write_below(writer *w, uint32_t number) {
    uint32_t child[WIDE];
    cut *c = w->cut;
    if (c && brume_bvh_at(w->tree, number)->count <= c->most) {
        subtree *s = &c->subtrees[c->next++];
        s->before = w->next;
        w->next.nodes += s->below.nodes;
        w->next.blocks += s->below.blocks;
        w->next.quadric_blocks += s->below.quadric_blocks;
        return;
    }
    b_node *node = &w->out->nodes[w->next.nodes++];
    int children = brume_bvh_children(w->tree, number, child);
    clear_node(node);
    for (int k = 0; k < children; k++) {
        const brume_bvh_binary *n = brume_bvh_at(w->tree, child[k]);
        node->lo_x[k] = n->lo[0], node->lo_y[k] = n->lo[1], node->lo_z[k] = n->lo[2];
        node->hi_x[k] = n->hi[0], node->hi_y[k] = n->hi[1], node->hi_z[k] = n->hi[2];
        if (n->leaf) node->child[k] = write_leaf(w, n);
    }
    for (int k = 0; k < children; k++) {
        if (brume_bvh_at(w->tree, child[k])->leaf) continue;
        node->child[k] = (int)w->next.nodes;
        write_below(w, child[k]);
    }
}

static void write_subtree(void *user, uint32_t i) {
    const writer *all = user;
    const subtree *s = &all->cut->subtrees[i];
    writer own = *all;
    own.cut = NULL;
    own.next = s->before;
    write_below(&own, s->number);
}

/* 0 when memory ran out. */
static int collapse(const brume_bvh_tree *tree, cut *c, writer *w) {
    brume_bvh *bvh = w->out;
    totals all = {1, 0, 0, 1, 0};
    if (tree->item_count == 0) w->cut = NULL;
    if (w->cut) {
        if (!cut_below(c, 0)) return 0;
        brume_parallel(tree->threads, c->count, count_subtree, c);
    }
    if (tree->item_count) all = count_below(tree, 0, w->cut);
    bvh->node_count = all.nodes;
    bvh->block_count = all.blocks;
    bvh->quadric_block_count = all.quadric_blocks;
    bvh->depth = all.depth;
    bvh->stack_size = all.stack > 0 ? all.stack : 1;
    bvh->nodes = malloc(bvh->node_count * sizeof *bvh->nodes);
    bvh->blocks = malloc(bvh->block_count * sizeof *bvh->blocks + 1);
    bvh->quadric_ids = malloc(bvh->quadric_block_count * 8 * sizeof *bvh->quadric_ids + 1);
    if (!bvh->nodes || !bvh->blocks || !bvh->quadric_ids) return 0;
    c->next = 0;
    if (tree->item_count) write_below(w, 0);
    else clear_node(&bvh->nodes[0]);
    if (w->cut) brume_parallel(tree->threads, c->count, write_subtree, w);
    return 1;
}

brume_result brume_bvh_collapse(brume_context *context, const brume_bvh_tree *tree, const float *positions,
                                const b_triangle *triangles, brume_bvh *out) {
    brume_bvh bvh = {0};
    cut c = {.tree = tree, .most = tree->threads > 1 ? tree->item_count / (8 * tree->threads) : 0};
    writer w = {tree, positions, triangles, &bvh, tree->threads > 1 ? &c : NULL, {0}};
    int done = collapse(tree, &c, &w);
    free(c.subtrees);
    if (!done) {
        brume_bvh_free(&bvh);
        return brume_fail(context, BRUME_ERROR_MEMORY, "no memory for a hierarchy over %u primitives",
                          tree->item_count);
    }
    *out = bvh;
    return BRUME_OK;
}

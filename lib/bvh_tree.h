/* bvh_tree.h -- the binary tree between the two halves of the build: lib/bvh_split.c makes it, lib/bvh_plan.c says
 * which of its nodes become wide ones, lib/bvh_collapse.c writes them.
 */
#ifndef BRUME_BVH_TREE_H
#define BRUME_BVH_TREE_H

#include "bvh.h"
#include "float4.h"

enum { BVH_WIDE = 8, BVH_CHUNK_BITS = 10, BVH_CHUNK = 1 << BVH_CHUNK_BITS };

/* A primitive while the tree is built: padded bounds and its id (quadrics count on from the triangles). */
typedef struct brume_bvh_item {
    float lo[3];
    uint32_t prim;
    float hi[3];
    uint32_t pad;
} brume_bvh_item;

/* What a node is over. */
typedef enum brume_bvh_kind { BVH_TRIANGLES, BVH_QUADRICS, BVH_BOTH } brume_bvh_kind;

/* Covers items first ... first + count - 1. */
typedef struct brume_bvh_binary {
    float lo[3], hi[3];
    uint32_t first, count;
    uint32_t children;      /* node number of the left child, the right one's is the next; 0: none */
    unsigned plan : 21;     /* lib/bvh_plan.c */
    unsigned leaf : 1;      /* as a child of a wide node it is a leaf, which is all triangles or all quadrics */
    unsigned kind : 2;      /* brume_bvh_kind */
} brume_bvh_binary;

/* Nodes lie in chunks, which are taken when they are needed, by whatever thread; node 0 is the root. So their numbers
 * say nothing, and nothing that stays may depend on them. */
typedef struct brume_bvh_tree {
    brume_bvh_item *items;
    brume_bounds box, centers; /* of all items: their boxes, and the doubled centres of these */
    brume_bvh_binary **chunks;
    uint32_t item_count, triangle_count;
    uint32_t chunk_room, chunk_count; /* the count atomically */
    uint32_t threads;
} brume_bvh_tree;

static inline brume_bvh_binary *brume_bvh_at(const brume_bvh_tree *tree, uint32_t number) {
    return &tree->chunks[number >> BVH_CHUNK_BITS][number & (BVH_CHUNK - 1)];
}

/* All but the chunks is filled in by the caller, and the items, one at least, are sorted. Adds the chunks, on failure,
 * too. */
brume_result brume_bvh_split(brume_context *context, brume_bvh_tree *tree);
void brume_bvh_tree_free(brume_bvh_tree *tree);

/* cost[i - 1]: the least cost of showing a subtree as at most i children of some wide node. */
typedef struct brume_bvh_forest {
    float cost[BVH_WIDE - 1];
} brume_bvh_forest;

/* Sets `plan` and `leaf`, and the node's own forest; left and right are NULL for a node without children. Areas are
 * multiplied by `unit`, so that costs stay floats at any scene size. */
void brume_bvh_plan(brume_bvh_binary *node, const brume_bvh_forest *left, const brume_bvh_forest *right, double unit,
                    brume_bvh_forest *own);

/* The binary nodes that become the children of the wide node for `number`, in order: at most 8, each a leaf or a wide
 * node itself. Returns how many. */
int brume_bvh_children(const brume_bvh_tree *tree, uint32_t number, uint32_t out[BVH_WIDE]);

/* Adds nodes, blocks and quadric ids to `out`; the vertices come from the same arrays as brume_bvh_build's. */
brume_result brume_bvh_collapse(brume_context *context, const brume_bvh_tree *tree, const float *positions,
                                const b_triangle *triangles, brume_bvh *out);

#endif

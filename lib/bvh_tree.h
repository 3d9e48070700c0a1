/* bvh_tree.h -- the binary tree between the two halves of the build: lib/bvh_split.c makes it, lib/bvh_collapse.c turns
 * it into 8-wide nodes.
 */
#ifndef BRUME_BVH_TREE_H
#define BRUME_BVH_TREE_H

#include "bvh.h"

/* A primitive while the tree is built: padded bounds and its id (quadrics count on from the triangles). */
typedef struct brume_bvh_item {
    float lo[3];
    uint32_t prim;
    float hi[3];
    uint32_t pad;
} brume_bvh_item;

/* Covers items first ... first + count - 1. Nodes are in preorder: the left child is the next one, so that a walk from
 * the last to the first sees children before their parent. */
typedef struct brume_bvh_binary {
    float lo[3], hi[3];
    uint32_t first, count;
    uint32_t quadrics; /* how many of the items are quadrics */
    uint32_t right;    /* node number of the right child, 0: a leaf, which is all triangles or all quadrics */
} brume_bvh_binary;

typedef struct brume_bvh_tree {
    brume_bvh_item *items;
    brume_bvh_binary *nodes; /* [0] is the root; none for an empty scene */
    uint32_t item_count, node_count, triangle_count;
} brume_bvh_tree;

/* `items` is filled in by the caller and sorted in place. Adds `nodes`. */
brume_result brume_bvh_split(brume_context *context, brume_bvh_tree *tree);

/* Adds nodes, blocks and quadric ids to `out`; the vertices come from the same arrays as brume_bvh_build's. */
brume_result brume_bvh_collapse(brume_context *context, const brume_bvh_tree *tree, const float *positions,
                                const b_triangle *triangles, brume_bvh *out);

#endif

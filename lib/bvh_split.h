/* bvh_split.h -- the binary tree while it grows: what lib/bvh_split.c and lib/bvh_top.c share. */
#ifndef BRUME_BVH_SPLIT_H
#define BRUME_BVH_SPLIT_H

#include "bvh_tree.h"

enum { BVH_DEPTH_SAH = 64 };

typedef struct brume_bvh_splitter {
    brume_bvh_tree *tree;
    brume_bvh_item *items[2];
    double unit; /* brume_bvh_plan's */
    int failed;  /* atomically: there was no memory for a chunk */
} brume_bvh_splitter;

/* Items first ... first + count - 1 of one of the two arrays, for a node. */
typedef struct brume_bvh_range {
    uint32_t node, first, count;
    uint32_t quadrics; /* how many of the items are quadrics */
    uint32_t depth;
    int side;
    brume_bounds centers; /* doubled */
} brume_bvh_range;

/* Nodes that are taken one pair after the other by one thread. Zero, but for `most`: chunks need not be larger. */
typedef struct brume_bvh_arena {
    uint32_t next, end, most;
} brume_bvh_arena;

/* The first of two nodes, 0 when memory ran out. */
uint32_t brume_bvh_take_pair(brume_bvh_splitter *s, brume_bvh_arena *arena);
void brume_bvh_start_node(brume_bvh_splitter *s, const brume_bvh_range *r, const brume_bounds *box);

int brume_bvh_is_leaf(const brume_bvh_range *r);
uint32_t brume_bvh_quadrics(const brume_bvh_tree *tree, const brume_bvh_item *items, uint32_t count);
/* Sets all but the nodes, the centres and the side. */
void brume_bvh_children_of(const brume_bvh_range *r, uint32_t left, uint32_t left_quadrics, brume_bvh_range child[2]);

/* The whole tree below a started node; 0 when memory ran out. */
int brume_bvh_grow(brume_bvh_splitter *s, brume_bvh_arena *arena, const brume_bvh_range *r, brume_bvh_forest *forest);
/* The same by several threads, in lib/bvh_top.c. */
int brume_bvh_grow_threaded(brume_bvh_splitter *s, brume_bvh_arena *arena, const brume_bvh_range *root);

#endif

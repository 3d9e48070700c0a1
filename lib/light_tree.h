/* light_tree.h -- a tree over lamps with a place, by which kernels choose one of many (cl/light_tree.h). */
#ifndef BRUME_LIGHT_TREE_H
#define BRUME_LIGHT_TREE_H

#include "context.h"
#include "../cl/shared.h"

/* So many lamps have a tree; fewer are all looked at. */
enum { BRUME_LIGHT_TREE_LEAST = 128 };

typedef struct brume_light_tree {
    b_light_block *blocks; /* [0] is the root; none where no lamp has a place */
    uint32_t block_count;
    uint32_t placed;       /* lamps in the tree: the first ones */
    double flux;           /* luminance of all of them together, which clusters hold shares of */
} brume_light_tree;

/* Sorts `lights` so that each leaf's stand together, and those without a place, which no leaf has, at the end. */
brume_result brume_light_tree_build(brume_context *context, b_light *lights, uint32_t count, brume_light_tree *out);
/* 1 / flux as a float that is neither 0 nor infinite. */
float brume_light_tree_scale(const brume_light_tree *tree);
void brume_light_tree_free(brume_light_tree *tree);

#endif

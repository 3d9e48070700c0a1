/* light_tree.h -- a tree over lamps with a place, by which kernels choose one of many (cl/light_tree.h). */
#ifndef BRUME_LIGHT_TREE_H
#define BRUME_LIGHT_TREE_H

#include "context.h"
#include "../cl/shared.h"

/* So many lamps have a tree, or so many where one leaf holds them all; fewer are all looked at.
 *
 * Measured by test/measure_light_tree, 16 lanes on two cores: nanoseconds per choice for a segment, and the relative
 * variance of one estimate of all that lamps without shadows scatter to the eye.
 *                    lamps    30    100    300   1000   3000  10000
 *   narrow   loop       ns   413   1373   3963  13162  41639 142900
 *   spots    tree       ns   334    423    682    996   1416   2349
 *            loop       variance  0.001 0.006  0.02  0.03  0.03   0.03
 *            tree       variance  0.001 0.006  0.02  0.82   1.4    2.1
 *            by power   variance      9    37    76    73    99    152
 *   points   loop       ns   597   1798   5375  19392  59312 188832
 *            tree       ns  1194   1217   1068   1541   1540   1966
 *            loop       variance   0.37  0.30  0.31  0.19  0.30   0.33
 *            tree       variance   0.37  0.47  0.55    19    15      7
 * Up to hundreds of narrow spots the tree is one leaf, which chooses as well as the loop. In whole pictures of such a
 * stage in fog, variance times time falls by 2.6 at 100 spots, 5 at 1000 and 17 at 10000. */
enum { BRUME_LIGHT_TREE_LEAST = 128, BRUME_LIGHT_TREE_LEAST_LEAF = 32 };

typedef struct brume_light_tree {
    b_light_block *blocks; /* [0] is the root; none where no lamp has a place */
    uint32_t block_count, leaves;
    uint32_t placed;       /* lamps in the tree: the first ones */
    double flux;           /* luminance of all of them together, which clusters hold shares of */
} brume_light_tree;

/* Sorts `lights` so that each leaf's stand together, and those without a place, which no leaf has, at the end. */
brume_result brume_light_tree_build(brume_context *context, b_light *lights, uint32_t count, brume_light_tree *out);
/* 1 / flux as a float that is neither 0 nor infinite. */
float brume_light_tree_scale(const brume_light_tree *tree);
void brume_light_tree_free(brume_light_tree *tree);

#endif

/* bvh.h -- the 8-wide bounding volume hierarchy over triangles and quadrics. */
#ifndef BRUME_BVH_H
#define BRUME_BVH_H

#include "context.h"
#include "../cl/shared.h"

typedef struct brume_bvh {
    b_node *nodes;            /* [0] is the root; there is always one, empty for an empty scene */
    b_triangle_block *blocks; /* of 8 triangles; leaves of quadrics index quadric_ids instead */
    int32_t *quadric_ids;     /* leaf code: first block * 8 .. in groups of 8, -1 padding */
    uint32_t node_count, block_count, quadric_block_count;
    uint32_t depth;           /* levels of nodes; at most 98 */
    uint32_t stack_size;      /* entries a walk can need; kernels are built with -DBVH_STACK=stack_size */
} brume_bvh;

/* positions: world space, 3 floats a vertex, finite. All arrays stay the caller's. With as many threads as the system
 * has processors, where there are 32768 primitives or more. At the peak some 120 bytes a primitive are in use besides
 * these arrays, of which 55 stay (measured on meshes of 100 k to 10 M triangles: `make bench-build`). */
brume_result brume_bvh_build(brume_context *context, const float *positions, const b_triangle *triangles,
                             uint32_t triangle_count, const b_quadric *quadrics, uint32_t quadric_count,
                             brume_bvh *out);
/* With up to so many threads, at most BRUME_PARALLEL_MOST: the same to the bit with any number of them. */
brume_result brume_bvh_build_threaded(brume_context *context, uint32_t threads, const float *positions,
                                      const b_triangle *triangles, uint32_t triangle_count, const b_quadric *quadrics,
                                      uint32_t quadric_count, brume_bvh *out);
void brume_bvh_free(brume_bvh *bvh);

#endif

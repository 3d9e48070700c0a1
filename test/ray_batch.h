/* ray_batch.h -- rays sent through the hierarchy on the device, and back: what tests of traversal share. */
#ifndef RAY_BATCH_H
#define RAY_BATCH_H

#include <math.h>

#include "bvh.h"
#include "device.h"
#include "meshes.h"
#include "open_device.h"

/* One ray a lane; arrays hold x of all rays, then y, then z. */
#define RAY_KERNEL                                                                                                    \
    "__kernel void trace(__global const b_node *nodes, __global const b_triangle_block *blocks,\n"                    \
    "                    __global const b_quadric *quadrics, __global const int *ids, int triangles, int n,\n"        \
    "                    __global const float *o, __global const float *d, __global const float *range,\n"            \
    "                    __global real1 *t, __global int *prim, __global real1 *uv, __global int *dark) {\n"          \
    "    int at = get_global_id(0) * LANES;\n"                                                                        \
    "    geometry g = {nodes, blocks, quadrics, ids, triangles};\n"                                                   \
    "    vec from = vmake(load_lanes(o + at), load_lanes(o + n + at), load_lanes(o + 2 * n + at));\n"                 \
    "    vec to = vmake(load_lanes(d + at), load_lanes(d + n + at), load_lanes(d + 2 * n + at));\n"                   \
    "    real low = load_lanes(range + at), high = load_lanes(range + n + at);\n"                                     \
    "    mask live = low >= R(0);\n"                                                                                  \
    "    hit h = closest(&g, from, to, low, high, live);\n"                                                           \
    "    lanes_of_real ts, us, vs; lanes_of_ireal prims, darks;\n"                                                    \
    "    ts.all = h.t; us.all = h.u; vs.all = h.v; prims.all = h.prim;\n"                                             \
    "    darks.all = occluded(&g, from, to, low, high, live) ? I(1) : I(0);\n"                                        \
    "    for (int k = 0; k < LANES; k++) {\n"                                                                         \
    "        t[at + k] = ts.one[k]; prim[at + k] = (int)prims.one[k]; dark[at + k] = (int)darks.one[k];\n"            \
    "        uv[at + k] = us.one[k]; uv[n + at + k] = vs.one[k];\n"                                                   \
    "    }\n"                                                                                                         \
    "}\n"

/* The kernels' own traversal; a test may put another text before RAY_KERNEL. */
extern const char ray_text[];

/* Rays and what came back. n is a multiple of 16; the first ray's lanes beyond the last real one have range -1. */
typedef struct ray_batch {
    uint32_t n;
    float *o, *d, *range; /* 3 n, 3 n, 2 n; a first range below 0: a dead lane */
    double *t, *uv;       /* as computed: floats widened */
    int *prim, *dark;
} ray_batch;

ray_batch ray_batch_make(uint32_t n);
void ray_batch_free(ray_batch *b);

/* Of the mesh's surfaces. brume_bvh_free it. */
brume_bvh ray_batch_build(const test_mesh *mesh);

/* Sends the rays. Programs are kept by the address of their text: most of a test's time would be their compilation. */
void ray_batch_trace(const char *text, const test_mesh *mesh, const brume_bvh *bvh, uint32_t lanes,
                     brume_precision precision, ray_batch *b);

/* Fails unless both came back with the same bits. */
void ray_batch_same(const ray_batch *a, const ray_batch *b);

/* ---- rays in double ------------------------------------------------------------------------------------------- */

typedef struct vec3 { double x, y, z; } vec3;
static inline vec3 vec3_sub(vec3 a, vec3 b) { return (vec3){a.x - b.x, a.y - b.y, a.z - b.z}; }
static inline double vec3_dot(vec3 a, vec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
static inline double vec3_length(vec3 a) { return sqrt(vec3_dot(a, a)); }
static inline vec3 vec3_cross(vec3 a, vec3 b) {
    return (vec3){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
static inline vec3 vec3_from(const float *p) { return (vec3){p[0], p[1], p[2]}; }

void ray_batch_set(ray_batch *b, uint32_t i, vec3 o, vec3 d);

/* In the cube of half the edge `size` about the origin. */
vec3 ray_random_point(uint64_t *seed, double size);

/* A point of the mesh: a vertex, on an edge, or inside a triangle; exactly so only for vertices. */
vec3 ray_random_target(const test_mesh *m, uint64_t *seed);

/* Rays of all sorts: anywhere, at vertices and edges, along axes, with limits, dead ones. */
ray_batch ray_batch_random(const test_mesh *m, uint32_t n, uint64_t seed);

#endif

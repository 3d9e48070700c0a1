/* meshes.h -- geometry for tests of the hierarchy and of traversal, made from a seed. */
#ifndef BRUME_TEST_MESHES_H
#define BRUME_TEST_MESHES_H

#include <stdint.h>

#include "../cl/shared.h"

typedef struct test_mesh {
    float *positions; /* 3 floats a vertex */
    b_triangle *triangles;
    b_quadric *quadrics;
    uint32_t vertex_count, triangle_count, quadric_count;
} test_mesh;

/* Uniform in [0, 1). */
double test_uniform(uint64_t *state);

/* Loose triangles with centres in a cube of half size `spread` and corners up to `size` from them; vertices 3 i .. 3 i
 * + 2. */
test_mesh test_mesh_soup(uint32_t count, double spread, double size, uint64_t seed);

/* A closed surface around 0, radius 1 +- bumps; shared vertices; outward winding. */
test_mesh test_mesh_sphere(uint32_t rings, uint32_t sectors, double bumps);

/* A closed sphere of radius 1: an icosahedron, each triangle cut into 4 `levels` times; shared vertices. */
test_mesh test_mesh_icosphere(uint32_t levels);

/* A height field over [-1, 1]^2 with x, y on an exact grid. */
test_mesh test_mesh_terrain(uint32_t cells);

/* Needles and slivers, down to aspects of 1e-6. */
test_mesh test_mesh_slivers(uint32_t count);

/* A closed cube from -1 to 1 of cells x cells squares a side, as loose triangles; corners at multiples of 2 / cells. */
test_mesh test_mesh_cube(uint32_t cells);

/* Thin parallel slats across z = 0, x from -1 to 1. */
test_mesh test_mesh_slats(uint32_t count);

/* Cones of 12 sides that stand on y = -1, closed. */
test_mesh test_mesh_cones(uint32_t count, uint64_t seed);

/* Spheres and elliptic disks of all sizes. */
test_mesh test_mesh_quadrics(uint32_t count, uint64_t seed);

void test_mesh_free(test_mesh *mesh);

#endif

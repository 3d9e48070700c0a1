/* traversal_meshes.h -- what test/bench/traversal.c sends rays through, and from where. */
#ifndef TRAVERSAL_MESHES_H
#define TRAVERSAL_MESHES_H

#include <stdint.h>

#include "../../cl/shared.h"

typedef struct traversal_mesh {
    const char *name;
    float *positions; /* 3 floats a vertex; NULL: memory ran out */
    b_triangle *triangles;
    uint32_t vertex_count, triangle_count;
    float eye[3], forward[3], right[3], up[3];
    float panel[3]; /* centre of a horizontal square of edge 2, for shadow rays */
} traversal_mesh;

/* A closed room, 10 x 6 x 10, of finely divided walls, full of tessellated balls: 1000 triangles for each of `parts`,
 * more or less. */
traversal_mesh traversal_room(uint32_t parts);

/* Hills of cells x cells squares over [-10, 10]^2, y upwards, seen from above at a slant. */
traversal_mesh traversal_terrain(uint32_t cells);

void traversal_mesh_free(traversal_mesh *mesh);

/* Of triangle i, of length 1; 0 where it has no area. */
void traversal_normal(const traversal_mesh *mesh, int i, double out[3]);

/* In [0, 1) (splitmix64: Steele, Lea & Flood 2014). */
double traversal_uniform(uint64_t *state);

#endif

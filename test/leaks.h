/* leaks.h -- rays from within closed meshes, made, sent and counted on the device: as many as one has time for.
 *
 * They are aimed at vertices (three eighths), at edges (a half) and at triangles, from random places and from a grid's,
 * some along an axis; half of their directions have length 1. In half of the rounds all lanes of a work-item aim at one
 * triangle, from one place.
 */
#ifndef LEAKS_H
#define LEAKS_H

#include <stdint.h>

#include "device_test.h"
#include "meshes.h"

/* A closed mesh about 0: everything nearer to 0 than `inside`, along each axis, is within it, everything farther off
 * than `outside` beyond it. It and its rays are scaled, then moved. */
typedef struct leak_mesh {
    const char *name;
    test_mesh mesh;
    float inside, outside, scale[3], shift[3];
} leak_mesh;

/* A traversal: the device's program. `wedges`: instead of rays, planes through a lamp within and a line beyond the
 * mesh, or the other way about; what counts are points of the line, at the very ends of what single triangles hide. */
typedef struct leak_way {
    const char *name;
    uint32_t lanes;
    brume_precision precision;
    const char *options;
    int wedges;
} leak_way;

typedef struct leak_tally {
    uint64_t rays, leaks;
    uint64_t first; /* number of a ray that leaked */
} leak_tally;

enum { LEAK_WAYS = 6, LEAK_MESHES = 6 };
extern const leak_way leak_ways[LEAK_WAYS];

/* test_mesh_free() its mesh. */
leak_mesh leak_mesh_make(int which);

/* The kernels, before which a planted bug may be put. */
extern const char leak_ray_text[], leak_wedge_text[];

/* Adds to the tally `rays` rays or a few more, from the first on; the same numbers are the same rays. */
void leaks_count(const char *text, const leak_way *way, const leak_mesh *mesh, uint64_t rays, leak_tally *tally);

#endif

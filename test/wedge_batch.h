/* wedge_batch.h -- wedges of lamp and ray by the thousand, as cl/traverse_wedge.h sees them and as shadow rays do: what
 * test_wedge and test_wedge_leaks share.
 */
#ifndef WEDGE_BATCH_H
#define WEDGE_BATCH_H

#include "device_test.h"
#include "meshes.h"

enum { WEDGES = 4096, POSITIONS = 64, PLANES = 6 };
enum { T0, T1, D, DELTA, OPEN, COUNT };

/* The kernel; its planted variants are changes to the text of traverse_wedge.h (device_test_plant). */
extern const char wedge_text[];

extern double wedge_scene_radius; /* 2 */
/* Of each wedge: x, y, z of the lamp, of the ray's origin and direction; its length; the offset of the positions;
 * whether it ends at what it hits. */
extern double wedge_in[12][WEDGES];
/* T0 to COUNT, and the positions along the ray. */
extern double wedge_out[PLANES][WEDGES], wedge_positions[POSITIONS][WEDGES];
/* One bit a position that is dark: two words by the wedge, two by shadow rays. */
extern uint32_t wedge_bits[4][WEDGES];

/* more: further options. ends: whether positions are the very ends of the ranges that the triangles hide, as many as
 * there is room for, instead of evenly spaced. */
void wedge_compute(const char *text, const char *more, uint32_t lanes, int ends, const test_mesh *mesh);

/* Nearer, lamp and ray span no plane: scatter_interval sends rays. */
int wedge_is_planar(int i);
int wedge_dark_at(int i, int j);
int ray_dark_at(int i, int j);

#endif

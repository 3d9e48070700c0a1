/* wide.h -- eight boxes or eight triangles against one ray: the types of traversal, at any LANES. */
#ifndef BRUME_WIDE_H
#define BRUME_WIDE_H

#include "lane.h"

#ifdef BRUME_DOUBLE
typedef double8 wide;
typedef long8 wide_mask;
FN wide wide_load(__global const float *row) { return convert_double8(vload8(0, row)); }
#else
typedef float8 wide;
typedef int8 wide_mask;
FN wide wide_load(__global const float *row) { return vload8(0, row); }
#endif

/* Which of a row of eight are not x. */
#ifdef BRUME_DOUBLE
FN wide_mask wide_unlike(__global const int *row, int x) { return convert_long8(vload8(0, row) != (int8)x); }
#else
FN wide_mask wide_unlike(__global const int *row, int x) { return vload8(0, row) != (int8)x; }
#endif

typedef union { wide all; real1 one[8]; } lanes_of_wide;

/* Ternaries, not fmin and fmax, whose rules for NaN cost 3 to 9 %. The second argument is returned where one is NaN. */
FN wide wmin(wide a, wide b) { return a < b ? a : b; }
FN wide wmax(wide a, wide b) { return a > b ? a : b; }

/* As in vec.h: a b - c d with an error below 1.5 ulp, so its sign is exact (short of underflow). */
FN wide wide_difference(wide a, wide b, wide c, wide d) {
    wide cd = c * d;
    return fma(a, b, -cd) + fma(-c, d, cd);
}

/* A set of the eight as one bit a byte: cheaper than any(), and walked by wide_last (OpenCL C 1.2 has no ctz). */
FN ulong wide_set(wide_mask m) { return as_ulong(convert_char8(m)) & 0x0101010101010101ul; }
FN int wide_last(ulong set) { return 7 - (int)(clz(set) >> 3); }
FN ulong wide_without(ulong set, int k) { return set ^ (1ul << (8 * k)); }

/* A ray as the tests want it. Rows are counted in floats from the start of a b_node or b_triangle_block. */
typedef struct {
    real1 o[3];       /* origin */
    real1 inverse[3]; /* 1 / direction, finite */
    int near_row[3];  /* of a node's nearer bounds; the farther ones are at far_row */
    int far_row[3];
    int x, y, z;      /* rows of a vertex's coordinates: z along the direction's largest component */
    real1 ox, oy, oz; /* the origin in that order */
    real1 sx, sy, sz; /* shear */
    real1 d[3];
    real1 tmin;
    int own; /* the triangle that it starts on, which it can't meet again; -1 for none */
} ray;

/* Hits among eight triangles: `set` as in wide.h, and per triangle the distance and the weights of v1 and v2 times
 * det. */
typedef struct {
    ulong set;
    lanes_of_wide t, v, w, det;
} block_hits;

#endif

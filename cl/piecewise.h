/* piecewise.h -- a density on [0, 1] that is linear between PIECES + 1 evenly spaced nodes: made from rough values of
 * an integrand, it says where to sample it.
 *
 * A floor keeps the density away from 0, against what the values don't know (occluders above all) and for integrands
 * that happen to vanish at a node. One inversion warps a uniform variate, which keeps the structure of low-discrepancy
 * points.
 */
#ifndef BRUME_PIECEWISE_H
#define BRUME_PIECEWISE_H

#include "vec.h"

#define PIECES 16

/* The floor's share; 0.1 to 0.3 measured alike. */
#define PIECEWISE_FLOOR R(0.15)

typedef struct {
    real node[PIECES + 1];  /* the density */
    real below[PIECES + 1]; /* its integral from 0 to the node; the last is 1 */
} piecewise;

/* From values >= 0 in node[]. */
FN void piecewise_finish(piecewise *p) {
    real sum = R(0.5) * (p->node[0] + p->node[PIECES]);
    for (int k = 1; k < PIECES; k++) sum = sum + p->node[k];
    /* Next to nothing anywhere, or not a number: evenly. */
    mask some = (sum > R(1e-30)) & (sum < R(1e30));
    real scale = some ? (R(1) - PIECEWISE_FLOOR) * R(PIECES) / sum : R(0);
    for (int k = 0; k <= PIECES; k++) p->node[k] = some ? fma(p->node[k], scale, PIECEWISE_FLOOR) : R(1);
    p->below[0] = R(0);
    for (int k = 0; k < PIECES; k++)
        p->below[k + 1] = fma(p->node[k] + p->node[k + 1], R(0.5 / PIECES), p->below[k]);
}

/* A variate with that density from u in [0, 1), and the density there. Its integral up to there is u within 3.4e-7. */
FN real piecewise_warp(const piecewise *p, real u, real *density) {
    real below = R(0), q0 = p->node[0], q1 = p->node[1], cell = R(0);
    for (int k = 1; k < PIECES; k++) {
        mask beyond = u >= p->below[k];
        below = beyond ? p->below[k] : below;
        q0 = beyond ? p->node[k] : q0;
        q1 = beyond ? p->node[k + 1] : q1;
        cell = beyond ? R(k) : cell;
    }
    /* z (q0 + z (q1 - q0) / 2) = r */
    real r = lmax((u - below) * R(PIECES), R(0));
    real slope = q1 - q0;
    real z = R(2) * r / (q0 + sqrt(lmax(fma(R(2) * slope, r, square(q0)), R(0))));
    z = lclamp(z, R(0), R(1));
    *density = fma(slope, z, q0);
    return (cell + z) * R(1.0 / PIECES);
}

#endif

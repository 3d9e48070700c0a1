/* beam_table.h -- sampling a lit interval in proportion to everything but visibility: 1/distance^2, transmittance, phase
 * function and the lamp's falloff.
 *
 * The interval's angle is cut into BEAM_CELLS equal cells. At their edges the integrand is evaluated and, mixed with a
 * constant, taken as a density that is linear in between. It warps the equiangular variate u to another u', so whatever
 * samples equiangularly samples the product by sampling at u' and dividing by the density. One inversion keeps the
 * structure of low-discrepancy points. The integrand only shapes the density: that it is computed roughly here costs
 * noise at most.
 */
#ifndef BRUME_BEAM_TABLE_H
#define BRUME_BEAM_TABLE_H

#include "beam.h"

#define BEAM_CELLS 16

/* The constant's share: against what the table can't know, occluders above all (0.1 to 0.3 measured alike). */
#define BEAM_FLOOR R(0.15)

typedef struct {
    real node[BEAM_CELLS + 1];       /* density of u', 1 on average */
    real below[BEAM_CELLS + 1];      /* its integral from 0 to the cell's edge; the last is 1 */
} beam_table;

/* The falloff, roughly: linear in the versine instead of the angle, whose sine is cut short. */
FN real beam_table_falloff(const beam *g, const lamp *l, real x) {
    real h = R(0.5) * x, h2 = square(h);
    real s = h * fma(h2, fma(h2, R(1.0 / 120), R(-1.0 / 6)), R(1));
    real v = g->versine_out_of_plane + R(2) * g->rho * square(s);
    real fading = lclamp((l->v_cutoff - v) / lmax(l->v_cutoff - l->v_beam, R(1e-30)), R(0), R(1));
    fading = l->cosine ? lmax(R(1) - v, R(0)) : fading;
    return l->cone ? fading : R(1);
}

FN beam_table beam_table_of(const beam *g, const lamp *l, beam_interval i, real sigma, real phase_g) {
    beam_table table;
    real step = i.width * R(1.0 / BEAM_CELLS), sine[BEAM_CELLS + 1], cosine[BEAM_CELLS + 1];
    real turn_s, turn_c;
    lsincos(step, &turn_s, &turn_c);
    sine[0] = R(0);
    cosine[0] = R(1);
    for (int k = 0; k < BEAM_CELLS; k++) {
        sine[k + 1] = fma(sine[k], turn_c, cosine[k] * turn_s);
        cosine[k + 1] = fma(cosine[k], turn_c, -sine[k] * turn_s);
    }
    /* Optical depths first: the smallest is subtracted, or a thick medium would leave nothing to compare. */
    real thinnest = R(1e30), a = fabs(phase_g);
    for (int k = 0; k <= BEAM_CELLS; k++) {
        int from_left = k <= BEAM_CELLS / 2, q = from_left ? k : BEAM_CELLS - k;
        real end = from_left ? i.t0 : -i.t1;
        real t = g->D * (fma(end, cosine[q], g->D * sine[q]) / fma(g->D, cosine[q], -end * sine[q]));
        t = lclamp(from_left ? t : -t, i.t0, i.t1);
        real distance = sqrt(fma(t, t, square(g->D)));
        real depth = sigma * beam_path(g, t, distance);
        table.below[k] = depth;
        thinnest = lmin(thinnest, depth);
        table.node[k] = hg_density(beam_turn(g, t, distance, phase_g), a);
    }
    mask cone = l->cone;
    int any_cone = ANY(cone);
    for (int k = 0; k <= BEAM_CELLS; k++) {
        table.node[k] = table.node[k] * lexp(thinnest - table.below[k]);
        if (any_cone) table.node[k] = table.node[k] * beam_table_falloff(g, l, fma(step, R(k), i.x0));
    }
    real sum = R(0.5) * (table.node[0] + table.node[BEAM_CELLS]);
    for (int k = 1; k < BEAM_CELLS; k++) sum = sum + table.node[k];
    /* Next to nothing anywhere, or not a number: evenly. */
    mask some = (sum > R(1e-30)) & (sum < R(1e30));
    real scale = some ? (R(1) - BEAM_FLOOR) * R(BEAM_CELLS) / sum : R(0);
    real floor_ = some ? BEAM_FLOOR : R(1);
    for (int k = 0; k <= BEAM_CELLS; k++) table.node[k] = some ? fma(table.node[k], scale, floor_) : floor_;
    table.below[0] = R(0);
    for (int k = 0; k < BEAM_CELLS; k++)
        table.below[k + 1] = fma(table.node[k] + table.node[k + 1], R(0.5 / BEAM_CELLS), table.below[k]);
    return table;
}

/* u' for u in [0, 1), and its density. */
FN real beam_table_warp(const beam_table *table, real u, real *density) {
    real below = R(0), q0 = table->node[0], q1 = table->node[1], cell = R(0);
    for (int k = 1; k < BEAM_CELLS; k++) {
        mask beyond = u >= table->below[k];
        below = beyond ? table->below[k] : below;
        q0 = beyond ? table->node[k] : q0;
        q1 = beyond ? table->node[k + 1] : q1;
        cell = beyond ? R(k) : cell;
    }
    /* z (q0 + z (q1 - q0) / 2) = r */
    real r = lmax((u - below) * R(BEAM_CELLS), R(0));
    real slope = q1 - q0;
    real z = R(2) * r / (q0 + sqrt(lmax(fma(R(2) * slope, r, square(q0)), R(0))));
    z = lclamp(z, R(0), R(1));
    *density = fma(slope, z, q0);
    return (cell + z) * R(1.0 / BEAM_CELLS);
}

#endif

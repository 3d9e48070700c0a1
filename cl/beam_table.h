/* beam_table.h -- sampling a lit interval in proportion to everything but visibility: 1/distance^2, transmittance,
 * phase function and the lamp's falloff.
 *
 * The interval's angle is cut into equal cells; the integrand at their edges makes a density (piecewise.h).
 * It warps the equiangular variate u to another u', so whatever samples equiangularly samples the product by sampling
 * at u' and dividing by the density. The integrand only shapes the density: that it is computed roughly here costs
 * noise at most.
 */
#ifndef BRUME_BEAM_TABLE_H
#define BRUME_BEAM_TABLE_H

#include "beam.h"
#include "piecewise.h"

/* The falloff, roughly: linear in the versine instead of the angle, whose sine is cut short. */
FN real beam_table_falloff(const beam *g, const lamp *l, real x) {
    real h = R(0.5) * x, h2 = square(h);
    real s = h * fma(h2, fma(h2, R(1.0 / 120), R(-1.0 / 6)), R(1));
    real v = g->versine_out_of_plane + R(2) * g->rho * square(s);
    real fading = lclamp((l->v_cutoff - v) / lmax(l->v_cutoff - l->v_beam, R(1e-30)), R(0), R(1));
    fading = l->cosine ? lmax(R(1) - v, R(0)) : fading;
    return l->cone ? fading : R(1);
}

FN piecewise beam_table_of(const beam *g, const lamp *l, beam_interval i, real sigma, real phase_g) {
    piecewise table;
    real t[PIECES + 1], depth[PIECES + 1], thinnest = R(1e30), a = fabs(phase_g);
    equiangular_range range;
    range.D = g->D;
    range.t0 = i.t0;
    range.t1 = i.t1;
    range.width = i.width;
    equiangular_nodes(&range, PIECES, t);
    /* The smallest optical depth is subtracted, or a thick medium would leave nothing to compare. */
    for (int k = 0; k <= PIECES; k++) {
        real distance = sqrt(fma(t[k], t[k], square(g->D)));
        depth[k] = sigma * beam_path(g, t[k], distance);
        thinnest = lmin(thinnest, depth[k]);
        table.node[k] = hg_density(beam_turn(g, t[k], distance, phase_g), a);
    }
    int any_cone = ANY(l->cone);
    for (int k = 0; k <= PIECES; k++) {
        table.node[k] = table.node[k] * lexp(thinnest - depth[k]);
        real x = fma(i.width, R(k / (float)PIECES), i.x0);
        if (any_cone) table.node[k] = table.node[k] * beam_table_falloff(g, l, x);
    }
    piecewise_finish(&table);
    return table;
}

#endif

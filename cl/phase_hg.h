/* phase_hg.h -- the phase function of Henyey & Greenstein 1941, any mean cosine g in (-1, 1); g > 0 is forward.
 *
 * Written in v = 1 - cos of the angle between the directions of travel before and after: v = 0 is straight on.
 * (1-g)^2 + 2 g v equals 1 + g^2 - 2 g cos without the cancellation near g = 1, and the inverse below is free of the one
 * near g = 0; g < 0 is |g| seen from behind.
 */
#ifndef BRUME_PHASE_HG_H
#define BRUME_PHASE_HG_H

#include "math.h"
#include "vec.h"

/* Density per steradian at v in [0, 2]. */
FN real phase_hg_versine(real v, real g) {
    real forward = g < R(0) ? R(2) - v : v, a = fabs(g);
    real x = fma(R(2) * a, forward, square(R(1) - a));
    return (R(1) - a) * (R(1) + a) * R(0.25 / PI) / (x * sqrt(x));
}

/* The same between two unit directions of travel. |a - b|^2 / 2 keeps the digits of small angles, |a + b|^2 / 2 those of
 * angles near pi. */
FN real phase_hg(vec before, vec after, real g) {
    vec apart = vsub(after, before), together = vadd(after, before);
    real v = R(0.5) * vdot(apart, apart), w = R(0.5) * vdot(together, together);
    return phase_hg_versine(v < R(1) ? v : R(2) - w, g);
}

/* A direction after scattering, and its density. */
FN vec phase_hg_sample(vec before, real g, real u, real v_turn, real *density) {
    real a = fabs(g);
    real below = R(1) - a + R(2) * a * u;
    real v = R(2) * square(R(1) - a) * (R(1) - u) * fma(a, u, R(1)) / square(below);
    v = lclamp(v, R(0), R(2));
    *density = phase_hg_versine(g < R(0) ? R(2) - v : v, g);
    vec axis = vselect(g < R(0), vneg(before), before), t, s;
    orthonormal_basis(axis, &t, &s);
    real sine = sqrt(v * (R(2) - v)), sp, cp;
    lsincos(v_turn * R(2 * PI), &sp, &cp);
    return vnormalize(vmad(t, sine * cp, vmad(s, sine * sp, vscale(axis, R(1) - v))));
}

#endif

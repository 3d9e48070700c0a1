/* phase_hg.h -- the phase function of Henyey & Greenstein 1941, any mean cosine g in (-1, 1); g > 0 is forward.
 *
 * Written in v = 1 - cos of the angle between the directions of travel before and after: v = 0 is straight on.
 * (1-g)^2 + 2 g v equals 1 + g^2 - 2 g cos without the cancellation near g = 1, and the inverse below is free of the
 * one near g = 0; g < 0 is |g| seen from behind.
 */
#ifndef BRUME_PHASE_HG_H
#define BRUME_PHASE_HG_H

#include "features.h"
#include "math.h"
#include "vec.h"

/* Density per steradian for mean cosine a >= 0, v counted from the peak. Within 4.9 ulp up to a = 1 - 2^-24. */
FN real hg_density(real v, real a) {
    if (!HAS(ANISOTROPY)) return R(0.25 / PI); /* what comes out for a = 0, to the bit */
    real x = fma(R(2) * a, v, square(R(1) - a));
    return (R(1) - a) * (R(1) + a) * R(0.25 / PI) / (x * sqrt(x));
}

/* Density per steradian at v in [0, 2]. */
FN real phase_hg_versine(real v, real g) { return hg_density(g < R(0) ? R(2) - v : v, fabs(g)); }

/* The same between two unit directions of travel. Half the squared distance to the peak keeps the digits of small
 * angles, where the density is steep. */
FN real phase_hg(vec before, vec after, real g) {
    if (!HAS(ANISOTROPY)) return R(0.25 / PI);
    vec from_peak = vmad(before, g < R(0) ? R(1) : R(-1), after);
    return hg_density(R(0.5) * vdot(from_peak, from_peak), fabs(g));
}

/* A direction after scattering, and its density. The tangent of half its angle is within 8.5 ulp of that of u. */
FN vec phase_hg_sample(vec before, real g, real u, real v_turn, real *density) {
    real sp, cp;
    vec t, s;
    if (!HAS(ANISOTROPY)) { /* the same for g = 0, to the bit */
        *density = R(0.25 / PI);
        orthonormal_basis(before, &t, &s);
        lsincos_turns(v_turn, &sp, &cp);
        real sine = sqrt(R(2) * (R(1) - u) * (R(2) * u));
        return vnormalize(vmad(t, sine * cp, vmad(s, sine * sp, vscale(before, R(1) - R(2) * (R(1) - u)))));
    }
    real a = fabs(g), narrow = R(1) - a;
    real q = fma(R(2) * a, u, narrow), inverse = R(1) / q;
    /* u to 1 - u and a to -a mirror the distribution: 2 - v has the same form, and sin^2 = v (2 - v) its digits */
    real v = R(2) * square(narrow * inverse) * (R(1) - u) * fma(a, u, R(1));
    real w = R(2) * square((R(1) + a) * inverse) * u * fma(a, u, narrow);
    real product = narrow * (R(1) + a);
    *density = q * q * q * R(0.25 / PI) / square(product);
    vec axis = vselect(g < R(0), vneg(before), before);
    orthonormal_basis(axis, &t, &s);
    real sine = sqrt(v * w);
    lsincos_turns(v_turn, &sp, &cp);
    return vnormalize(vmad(t, sine * cp, vmad(s, sine * sp, vscale(axis, R(1) - v))));
}

#endif

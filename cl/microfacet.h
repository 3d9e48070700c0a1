/* microfacet.h -- rough surfaces as heights of mirrors: Beckmann's and the GGX distribution, stretched along x and y.
 *
 * Two functions say everything: D(m), facet area per steradian of normals m, and A(w) = cos w (1 + Lambda(w)), the
 * area that the facets facing w show it, per unit of macroscopic area. Smith's masking is G1(w) = cos w / A(w), the
 * density of visible normals D(m) (w.m) / A(w). Stretching the plane by alpha reduces both to roughness 1 (Heitz 2014,
 * section 5): with r^2 = alpha_u^2 x^2 + alpha_v^2 y^2, w looks at the stretched surface along (r, z).
 *
 * Beckmann & Spizzichino 1963; Walter et al. 2007 (GGX); Heitz, "Understanding the Masking-Shadowing Function", 2014;
 * Heitz & d'Eon, "Importance Sampling Microfacet-Based BSDFs using the Distribution of Visible Normals", 2014;
 * Dupuy & Benyoub, "Sampling Visible GGX Normals with Spherical Caps", 2023.
 */
#ifndef BRUME_MICROFACET_H
#define BRUME_MICROFACET_H

#include "math.h"
#include "vec.h"

#define SQRT_PI 1.7724538509055160

typedef struct {
    real alpha_u, alpha_v; /* roughness along x and y */
    mask beckmann;         /* else GGX */
} microfacets;

/* ---- the Gaussian integral --------------------------------------------------------------------------------------- */

/* erfc(y) for y >= 0, where gauss = exp(-y^2). (1 + 2 y) exp(y^2) erfc(y) is smooth in (y - 3) / (y + 3) (the form of
 * Shepherd & Laframboise 1981). The polynomials, by Sollya's fpminimax, are off by 6e-8 (float) and 2.4e-16 (double)
 * of the value (with rounding, by 5 ulp of float) up to y = 7, beyond which erfc is 0 next to anything it is added to
 * here. */
FN real erfc_of(real y, real gauss) {
    y = lmin(y, R(7));
    real z = (y - R(3)) / (y + R(3));
#ifdef BRUME_DOUBLE
    real p = R(-5.3029651591032952e-8);
    HORNER(p, -7.7318555921204280e-8);
    HORNER(p, 1.0671156077485570e-6);
    HORNER(p, 3.7666843220441845e-6);
    HORNER(p, -9.2041430794258909e-7);
    HORNER(p, -2.0333445266047679e-5);
    HORNER(p, 4.9118031582618222e-6);
    HORNER(p, 1.2514678875892831e-4);
    HORNER(p, -1.0514002260486997e-4);
    HORNER(p, -7.7983579370890957e-4);
    HORNER(p, 1.8886874328456617e-3);
    HORNER(p, 2.5293918150734664e-3);
    HORNER(p, -2.3770514715507668e-2);
    HORNER(p, 6.8308027355418133e-2);
    HORNER(p, -0.11927366342209630);
    HORNER(p, 0.12964515870235041);
    HORNER(p, -4.7562294353358771e-2);
    HORNER(p, -0.13562110612457804);
    HORNER(p, 1.2530080582697294);
#else
    real p = R(2.65557272e-3);
    HORNER(p, 2.51497794e-3);
    HORNER(p, -2.40725111e-2);
    HORNER(p, 6.82494864e-2);
    HORNER(p, -0.119229019);
    HORNER(p, 0.129653737);
    HORNER(p, -4.75653410e-2);
    HORNER(p, -0.135621384);
    HORNER(p, 1.25300813);
#endif
    return gauss * p / fma(R(2), y, R(1));
}

/* Integral over t > x of (t - a) exp(-t^2) / sqrt(pi), x >= a >= 0; *gauss = exp(-x^2). */
FN real gaussian_moment(real x, real a, real *gauss) {
    *gauss = lexp(-x * x);
    return lmax(R(0.5) * (*gauss * R(1 / SQRT_PI) - a * erfc_of(x, *gauss)), R(0));
}

/* ---- D and A ----------------------------------------------------------------------------------------------------- */

/* D of a unit normal, m.z > 0, per steradian. */
FN real microfacet_density(const microfacets *d, vec m) {
    real z2 = m.z * m.z;
    real slope2 = square(m.x / d->alpha_u) + square(m.y / d->alpha_v); /* times z2, in units of the roughness */
    real per_slope = z2 + slope2;
    real density = R(1) / (per_slope * per_slope);
    if (ANY(d->beckmann)) {
        real z4 = lmax(z2 * z2, R(1e-30));
        density = d->beckmann ? lexp(-slope2 / lmax(z2, R(1e-30))) / z4 : density;
    }
    return density / (R(PI) * d->alpha_u * d->alpha_v);
}

FN real microfacet_area(const microfacets *d, vec w) {
    real r2 = fma(square(d->alpha_u), w.x * w.x, square(d->alpha_v) * (w.y * w.y));
    real area = R(0.5) * (w.z + sqrt(fma(w.z, w.z, r2)));
    if (ANY(d->beckmann)) {
        real gauss, r = lmax(sqrt(r2), R(1e-15));
        real a = w.z / r;
        area = d->beckmann ? fma(r, gaussian_moment(a, a, &gauss), w.z) : area;
    }
    return area;
}

/* ---- sampling ---------------------------------------------------------------------------------------------------- */

/* The normal of slopes that are given in units of the roughness. */
FN vec microfacet_normal(const microfacets *d, real x, real y) {
    return vnormalize(vmake(d->alpha_u * x, d->alpha_v * y, R(1)));
}

/* Normals by D(m) cos m, whoever looks. */
FN vec microfacet_sample_all(const microfacets *d, real u, real v) {
    real s, c, rest = R(1) - u;
    real tan2 = u / rest;
    if (ANY(d->beckmann)) tan2 = d->beckmann ? -llog(rest) : tan2;
    lsincos_turns(v, &s, &c);
    real slope = sqrt(tan2);
    return microfacet_normal(d, slope * c, slope * s);
}

/* Visible normals of GGX: the stretched surface shows w what a sphere does, so they lie halfway between the stretched w
 * and the directions that a sphere mirrors it into, which fill evenly the cap above z = -w.z. */
FN vec ggx_sample_visible(const microfacets *d, vec w, real u, real v) {
    vec stretched = vnormalize(vmake(d->alpha_u * w.x, d->alpha_v * w.y, w.z));
    real s, c;
    lsincos_turns(u, &s, &c);
    real height = (R(1) - v) * (R(1) + stretched.z); /* above the cap's rim */
    real z = height - stretched.z;
    real sine = sqrt(lmax((R(1) - z) * (R(1) + z), R(0)));
    return vnormalize(vmake(d->alpha_u * fma(sine, c, stretched.x), d->alpha_v * fma(sine, s, stretched.y), height));
}

/* Visible slopes of Beckmann's distribution: towards w, looking down at a = z / r, they go as (a + x)+ exp(-x^2),
 * across as exp(-y^2). The cumulative distribution in x, which Heitz & d'Eon invert, is flat where x -> -a and where
 * x -> infinity, which makes the inversion ill-conditioned. Folding x to |x| splits the density into
 *   2 a exp(-x^2) for x > 0: a normal variate, given the sign - with probability (a - x)+ / (2 a);
 *   (x - a)+ exp(-x^2): a remainder, of which a w near normal sees next to nothing.
 * The remainder is inverted by Newton's method: -log of its tail integral is convex, so that steps from above never
 * overshoot. Starting at the lesser of its solution for a = 0 and a bound for large a, 4 steps leave a relative error
 * below 1e-7 at most, 1e-10 on average. */
#define BECKMANN_STEPS 4

FN vec beckmann_sample_visible(const microfacets *d, vec w, real u_lobe, real u, real v) {
    real wx = d->alpha_u * w.x, wy = d->alpha_v * w.y;
    real r = lmax(sqrt(fma(wx, wx, wy * wy)), R(1e-15));
    real a = w.z / r;
    real gauss, remainder = gaussian_moment(a, a, &gauss);

    real s, c, radius = sqrt(-llog(R(1) - u)); /* a pair of normal variates (Box & Muller 1958) */
    lsincos_turns(v, &s, &c);
    real x = fabs(radius * c), y = radius * s;

    real chosen = u_lobe * (a + remainder);
    mask in_remainder = chosen >= a;
    real towards = R(2) * chosen < a + x ? x : -x;
    if (ANY(d->beckmann & in_remainder)) {
        /* how far into the tail: exponential, from the normal variate that the remainder doesn't use */
        real depth = -llog(lmax(erfc_of(x, lexp(-x * x)), R(1e-30)));
        real beyond = lmin(sqrt(depth), (depth + sqrt(R(2) * depth)) / (R(2) * a));
        real log_all = llog(remainder);
        for (int k = 0; k < BECKMANN_STEPS; k++) {
            real density, tail = lmax(gaussian_moment(a + beyond, a, &density), R(1e-37));
            real short_of = depth - (log_all - llog(tail));
            beyond = lmax(beyond + short_of * tail / lmax(beyond * density * R(1 / SQRT_PI), R(1e-37)), R(0));
        }
        towards = in_remainder ? a + beyond : towards;
    }
    real cx = wx / r, cy = wy / r;
    mask upright = (wx == R(0)) & (wy == R(0));
    cx = upright ? R(1) : cx;
    return microfacet_normal(d, difference_of_products(cx, towards, cy, y), fma(cy, towards, cx * y));
}

/* Normals by D(m) (w.m)+ / A(w). */
FN vec microfacet_sample_visible(const microfacets *d, vec w, real u_lobe, real u, real v) {
    vec m = vmake(R(0), R(0), R(1));
    if (ANY(!d->beckmann)) m = ggx_sample_visible(d, w, u, v);
    if (ANY(d->beckmann)) m = vselect(d->beckmann, beckmann_sample_visible(d, w, u_lobe, u, v), m);
    return m;
}

#endif

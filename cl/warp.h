/* warp.h -- points of the unit square moved onto disks, spheres, hemispheres and triangles, evenly or by cosine. */
#ifndef BRUME_WARP_H
#define BRUME_WARP_H

#include "math.h"
#include "vec.h"

/* The unit disk, evenly (Shirley & Chiu 1997: concentric, so that strata stay compact). Returns the radius, which is
 * exact where x^2 + y^2 would be rounded; x and y are within 1.2e-7. */
FN real warp_disk(real u, real v, real *x, real *y) {
    real a = fma(R(2), u, R(-1)), b = fma(R(2), v, R(-1));
    mask wide = fabs(a) > fabs(b);
    real r = wide ? a : b;
    real ratio = (wide ? b : a) / (r == R(0) ? R(1) : r);
    real s, c;
    sincos_reduced(R(PI / 4) * ratio, R(0), I(0), &s, &c);
    *x = r * (wide ? c : s);
    *y = r * (wide ? s : c);
    return fabs(r);
}

/* The hemisphere z > 0, by cosine / pi. z is never 0, which a density could not stand. */
FN vec warp_cosine(real u, real v) {
    real x, y, r = warp_disk(u, v, &x, &y);
    return vmake(x, y, sqrt(lmax((R(1) - r) * (R(1) + r), R(1e-10))));
}

/* The unit sphere, evenly: 1 / (4 pi). */
FN vec warp_sphere(real u, real v) {
    real s, c, sine = R(2) * sqrt(lmax(u * (R(1) - u), R(0)));
    lsincos_turns(v, &s, &c);
    return vmake(sine * c, sine * s, fma(R(-2), u, R(1)));
}

/* Weights of a triangle's second and third vertex, evenly over its area: the square's two halves, each squeezed onto
 * the triangle so that no pair of neighbours is torn apart (Heitz 2019). */
FN void warp_triangle(real u, real v, real *b1, real *b2) {
    mask above = v > u;
    real half_of = R(0.5) * (above ? u : v);
    *b1 = above ? half_of : u - half_of;
    *b2 = above ? v - half_of : half_of;
}

#endif

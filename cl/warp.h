/* warp.h -- points of the unit square moved onto disks, spheres, hemispheres and triangles, evenly or by cosine. */
#ifndef BRUME_WARP_H
#define BRUME_WARP_H

#include "math.h"
#include "vec.h"

/* The unit disk, evenly (Shirley & Chiu 1997: concentric, so that strata stay compact). */
FN void warp_disk(real u, real v, real *x, real *y) {
    real a = fma(R(2), u, R(-1)), b = fma(R(2), v, R(-1));
    mask wide = fabs(a) > fabs(b);
    real r = wide ? a : b;
    real ratio = (wide ? b : a) / (r == R(0) ? R(1) : r);
    real s, c;
    lsincos(R(PI / 4) * ratio, &s, &c);
    *x = r * (wide ? c : s);
    *y = r * (wide ? s : c);
}

/* The hemisphere z > 0, by cosine / pi. */
FN vec warp_cosine(real u, real v) {
    real x, y;
    warp_disk(u, v, &x, &y);
    return vmake(x, y, sqrt(lmax(R(1) - x * x - y * y, R(0))));
}

/* The unit sphere, evenly: 1 / (4 pi). */
FN vec warp_sphere(real u, real v) {
    real s, c, sine = R(2) * sqrt(u * (R(1) - u));
    lsincos(R(2 * PI) * v, &s, &c);
    return vmake(sine * c, sine * s, fma(R(-2), u, R(1)));
}

/* Weights of a triangle's second and third vertex, evenly over its area (the square folded along its diagonal). */
FN void warp_triangle(real u, real v, real *b1, real *b2) {
    real root = sqrt(u);
    *b1 = root * (R(1) - v);
    *b2 = root * v;
}

#endif

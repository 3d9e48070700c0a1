/* equiangular.h -- points of a line, evenly spaced in the angle at which a point beside it sees them: density
 * proportional to 1/distance^2 (Kulla & Fajardo 2012).
 *
 * Positions count from the line's closest point, D away from the point beside it.
 */
#ifndef BRUME_EQUIANGULAR_H
#define BRUME_EQUIANGULAR_H

#include "math.h"
#include "vec.h"

typedef struct {
    real D, t0, t1, width; /* width: the angle between t0 and t1, t0 <= t1 */
} equiangular_range;

/* The difference of two nearly equal angles has no digits left; its tangent has. */
FN equiangular_range equiangular_range_of(real D, real t0, real t1) {
    equiangular_range r;
    r.D = D;
    r.t0 = t0;
    r.t1 = t1;
    r.width = latan2(D * (t1 - t0), fma(t0, t1, square(D)));
    return r;
}

/* At the share u of the angle; within the range for every u in [0, 1]. Density D / (width distance^2). By the addition
 * theorem of the tangent from the nearer end, where nothing cancels:
 * within 2.4 ulp, or exact for a u that is off by 2.4 2^-24. */
FN real equiangular_sample(const equiangular_range *r, real u) {
    real y = u * r->width, z = (R(1) - u) * r->width;
    mask left = y < z;
    real end = left ? r->t0 : -r->t1, s, c;
    lsincos(left ? y : z, &s, &c);
    real t = r->D * (fma(end, c, r->D * s) / difference_of_products(r->D, c, end, s));
    return lclamp(left ? t : -t, r->t0, r->t1);
}

/* The points at shares k / n of the angle, k = 0 ... n, roughly: for tables. By one rotation after the other. */
FN void equiangular_nodes(const equiangular_range *r, int n, real *t) {
    real turn_s, turn_c, sine = R(0), cosine = R(1);
    lsincos(r->width * R(1.0f / n), &turn_s, &turn_c);
    for (int k = 0; 2 * k <= n; k++) {
        real left = r->D * (fma(r->t0, cosine, r->D * sine) / fma(r->D, cosine, -r->t0 * sine));
        real right = r->D * (fma(r->t1, cosine, -r->D * sine) / fma(r->D, cosine, r->t1 * sine));
        t[k] = lclamp(left, r->t0, r->t1);
        t[n - k] = lclamp(right, r->t0, r->t1);
        real next = fma(sine, turn_c, cosine * turn_s);
        cosine = fma(cosine, turn_c, -sine * turn_s);
        sine = next;
    }
}

#endif

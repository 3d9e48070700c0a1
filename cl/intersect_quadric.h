/* intersect_quadric.h -- one ray against one sphere or elliptic disk.
 *
 * Sphere: with w from the origin to the centre, b = w.d and c = w.w - r^2 are summed in twice the precision, so that c
 * has the right sign for an origin just off the surface of a huge sphere. The discriminant b^2 - d.d c cancels where
 * the sphere is far compared with its radius; there it is r^2 - |e|^2 with e = w - (w.d) d, the vector from the line
 * to the centre (Haines et al. 2019, Ray Tracing Gems, ch. 7). The roots are q / d.d and c / q, neither of which
 * subtracts. Squares must be finite: distances below 1e18.
 */
#ifndef BRUME_INTERSECT_QUADRIC_H
#define BRUME_INTERSECT_QUADRIC_H

#include "intersect_triangle.h"

/* Distances along the ray; near <= far. Returns 0 for a miss. */
FN int intersect_sphere(__global const b_quadric *q, const ray *r, real1 *near, real1 *far) {
    real1 radius = q->radius, w[3], dd = 0;
    pair1 b = one_of(0), c = one_neg(one_mul(one_of(radius), one_of(radius)));
    for (int a = 0; a < 3; a++) {
        pair1 exact = one_sum(q->center[a], -r->o[a]);
        w[a] = exact.high;
        b = one_add(b, one_mul(exact, one_of(r->d[a])));
        c = one_add(c, one_mul(exact, exact));
        dd = fma(r->d[a], r->d[a], dd);
    }
    real1 bb = one_value(b), cc = one_value(c), discriminant = fma(bb, bb, -dd * cc);
    if (bb * bb > radius * radius) {
        real1 square_e = 0;
        for (int a = 0; a < 3; a++) {
            real1 component = fma(-bb / dd, r->d[a], w[a]);
            square_e = fma(component, component, square_e);
        }
        real1 e = sqrt(square_e);
        discriminant = dd * (radius - e) * (radius + e);
    }
    if (!(discriminant >= 0)) return 0;
    real1 s = bb + copysign(sqrt(discriminant), bb);
    real1 t0 = s / dd, t1 = s == 0 ? 0 : cc / s;
    *near = t0 < t1 ? t0 : t1;
    *far = t0 < t1 ? t1 : t0;
    return 1;
}

/* x, y: the point is center + x du + y dv. The axes need not be perpendicular. The plane is that of du and dv, in twice
 * the precision, not that of the rounded normal: a ray that leaves a large disk must not meet it again. */
FN int intersect_disk(__global const b_quadric *q, const ray *r, real1 *t, real1 *x, real1 *y) {
    real1 du[3], dv[3], normal[3], along = 0, p[3], by_x = 0, by_y = 0, xx = 0, xy = 0, yy = 0;
    pair1 height = one_of(0);
    for (int a = 0; a < 3; a++) {
        du[a] = q->du[a];
        dv[a] = q->dv[a];
    }
    for (int a = 0; a < 3; a++) {
        int i = a == 2 ? 0 : a + 1, j = a == 0 ? 2 : a - 1;
        pair1 cross = one_add(one_mul(one_of(du[i]), one_of(dv[j])), one_mul(one_of(-du[j]), one_of(dv[i])));
        height = one_add(height, one_mul(cross, one_sum(q->center[a], -r->o[a])));
        normal[a] = one_value(cross);
        along = fma(normal[a], r->d[a], along);
    }
    if (along == 0) return 0;
    *t = one_value(height) / along;
    for (int a = 0; a < 3; a++) {
        p[a] = fma(*t, r->d[a], r->o[a] - (real1)q->center[a]);
        by_x = fma(p[a], du[a], by_x);
        by_y = fma(p[a], dv[a], by_y);
        xx = fma(du[a], du[a], xx);
        xy = fma(du[a], dv[a], xy);
        yy = fma(dv[a], dv[a], yy);
    }
    real1 det = fma(xx, yy, -xy * xy);
    *x = fma(by_x, yy, -by_y * xy) / det;
    *y = fma(by_y, xx, -by_x * xy) / det;
    return *x * *x + *y * *y <= 1;
}

/* The nearest hit with tmin < t; x and y place it on a disk. */
FN int intersect_quadric(__global const b_quadric *q, const ray *r, real1 *t, real1 *x, real1 *y) {
    if (q->kind != QUADRIC_SPHERE) return intersect_disk(q, r, t, x, y) && *t > r->tmin;
    real1 near, far;
    if (!intersect_sphere(q, r, &near, &far)) return 0;
    *t = near > r->tmin ? near : far;
    *x = *y = 0;
    return *t > r->tmin;
}

#endif

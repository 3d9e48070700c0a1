/* intersect_triangle.h -- one ray against blocks of eight triangles, watertight.
 *
 * Woo, Benthin & Wald 2013, "Watertight ray/triangle intersection": vertices move with the ray's origin to 0 and are
 * sheared so that the ray is the z axis; then the signs of three 2D edge functions decide. A vertex gets the same
 * rounded 2D place in every triangle that shares it, so only wrong signs could open a crack. The paper recomputes
 * zeros in double; here each edge function is a compensated difference of products (Kahan; Jeannerod, Louvet & Muller
 * 2013), whose relative error is below 1: its sign is that of the exact value, and zero only for zero. Zero counts as
 * inside, so an edge or a vertex belongs to every triangle around it. Holds while products neither underflow nor
 * overflow: distances from about 1e-15 to 1e18 scene units.
 */
#ifndef BRUME_INTERSECT_TRIANGLE_H
#define BRUME_INTERSECT_TRIANGLE_H

#include "shared.h"
#include "exact.h"
#include "wide.h"

#ifdef BRUME_DOUBLE
#define DISTANCE_ERROR 0x1p-49
#else
#define DISTANCE_ERROR 0x1p-20f
#endif

/* The paper's distance is a mean of the vertices' z by weights u, v, w. Rounding moves vertices across the ray by
 * 2^-22 of their distance at most, which changes weights by that times the triangle's reach, over det: at a grazing
 * angle a ray that leaves a large triangle would hit it again. Closer to tmin than (four times) that, or 65536 times
 * closer than the vertices, the volume of the tetrahedron of origin and vertices is computed in twice the precision:
 * t = -volume / (det d.z). */
#define LARGE_REACH 0x1p-16f
FN real1 refine_distance(__global const b_triangle_block *block, const ray *r, int k, real1 det) {
    pair1 a[3], b[3], c[3], volume = one_of(0);
    for (int i = 0; i < 3; i++) {
        a[i] = one_sum(block->v0[i][k], -r->o[i]);
        b[i] = one_sum(block->v1[i][k], -r->o[i]);
        c[i] = one_sum(block->v2[i][k], -r->o[i]);
    }
    for (int i = 0; i < 3; i++) {
        int j = i == 2 ? 0 : i + 1, l = i == 0 ? 2 : i - 1;
        pair1 cross = one_add(one_mul(b[j], c[l]), one_neg(one_mul(b[l], c[j])));
        volume = one_add(volume, one_mul(a[i], cross));
    }
    return -one_value(volume) / det * r->sz;
}

/* Within the error of the rough distance, because det has an error, too, which for a needle is all of it. */
FN real1 refined_within(__global const b_triangle_block *block, const ray *r, int k, real1 det, real1 rough,
                        real1 error) {
    real1 exact = refine_distance(block, r, k, det);
    exact = exact > rough - error ? exact : rough - error;
    return exact < rough + error ? exact : rough + error;
}

/* Padding has NaN vertices, and every comparison with NaN is false. `near` is where the ray enters the leaf's box: see
 * traverse.h. */
FN void intersect_block(__global const b_triangle_block *block, const ray *r, real1 near, real1 tmax, block_hits *out) {
    __global const float *v0 = (__global const float *)block, *v1 = v0 + 24, *v2 = v0 + 48;
    wide az = wide_load(v0 + r->z) - (wide)r->oz;
    wide bz = wide_load(v1 + r->z) - (wide)r->oz;
    wide cz = wide_load(v2 + r->z) - (wide)r->oz;
    wide sx = (wide)-r->sx, sy = (wide)-r->sy;
    wide ax = fma(sx, az, wide_load(v0 + r->x) - (wide)r->ox);
    wide ay = fma(sy, az, wide_load(v0 + r->y) - (wide)r->oy);
    wide bx = fma(sx, bz, wide_load(v1 + r->x) - (wide)r->ox);
    wide by = fma(sy, bz, wide_load(v1 + r->y) - (wide)r->oy);
    wide cx = fma(sx, cz, wide_load(v2 + r->x) - (wide)r->ox);
    wide cy = fma(sy, cz, wide_load(v2 + r->y) - (wide)r->oy);
    wide u = wide_difference(cx, by, cy, bx);
    wide v = wide_difference(ax, cy, ay, cx);
    wide w = wide_difference(bx, ay, by, ax);
    wide low = wmin(u, wmin(v, w)), high = wmax(u, wmax(v, w)), det = u + v + w;
    wide_mask inside = ((low >= (wide)0) | (high <= (wide)0)) & (det != (wide)0) & wide_unlike(block->prim, r->own);
    out->set = wide_set(inside);
    if (out->set == 0) return;

    wide t = fma(u, az, fma(v, bz, w * cz)) / det * (wide)r->sz;
    wide reach = wmax(fabs(az), wmax(fabs(bz), fabs(cz)));
    wide across = wmax(wmax(fabs(ax), wmax(fabs(bx), fabs(cx))), wmax(fabs(ay), wmax(fabs(by), fabs(cy))));
    wide error = (reach + across) * across * reach * fabs((wide)(r->sz * DISTANCE_ERROR) / det);
    wide_mask near_start = (fabs(t - (wide)r->tmin) <= error) | (fabs(t) < reach * (wide)LARGE_REACH);
    wide_mask missed = (t + error <= (wide)r->tmin) | (t - error > (wide)tmax); /* however refined */
    ulong doubtful = wide_set(inside & near_start & !missed);
    if (doubtful) {
        lanes_of_wide refined, dets, errors;
        refined.all = t;
        dets.all = det;
        errors.all = error;
        while (doubtful) {
            int k = wide_last(doubtful);
            doubtful = wide_without(doubtful, k);
            refined.one[k] = refined_within(block, r, k, dets.one[k], refined.one[k], errors.one[k]);
        }
        t = refined.all;
    }
    wide entered = wmax(t, (wide)near);
    out->set = wide_set(inside & (t > (wide)r->tmin) & (entered <= (wide)tmax));
    out->t.all = entered;
    out->v.all = v;
    out->w.all = w;
    out->det.all = det;
}

#endif

/* traverse.h -- closest hit and occlusion: rays through the hierarchy.
 *
 * The layout is b_node and b_triangle_block of shared.h; build with -DBVH_STACK=n, brume_bvh's stack_size or more.
 *
 * Watertight as a whole. intersect_triangle.h accepts a hit as if each vertex were moved by its rounding: along axis i
 * by less than 4 2^-24 (t |d_i| + the triangle's extent). The box test must find what that test would accept. The
 * builder pads boxes by 2^-22 of the triangle's extent; the rest scales every plane's distance by 1 +- 4 2^-24, to
 * which each rounded (plane - origin) * inverse adds 2 ulp, or 3.5 with the 2.5 ulp division that OpenCL allows. WIDEN
 * covers both, on the side where it costs one multiplication (Ize 2013). The form plane * inverse - origin * inverse
 * would save a subtraction a plane, but its error grows with the distance of the origin from 0.
 *
 * The same hit whatever the order of the visits, thus at every LANES. A hit's t is at least the distance at which the
 * ray enters its leaf, computed from the box; boxes nest and rounding is monotonic, so no box on the way down begins
 * behind the hit, and culling boxes that begin behind the best hit so far can't lose a nearer one. Of equal distances
 * the lower prim wins.
 */
#ifndef BRUME_TRAVERSE_H
#define BRUME_TRAVERSE_H

#include "traverse_single.h"

/* Lanes travel together where that pays: measured at 8 and 16 lanes. */
#ifndef BVH_PACKET
#define BVH_PACKET (LANES >= 8)
#endif
#if BVH_PACKET
#include "traverse_packet.h"
#endif

/* A miss has prim -1 and t = tmax. u, v: the weights of a triangle's v1 and v2; on a disk the point is
 * center + u du + v dv. */
typedef struct {
    real t;
    ireal prim;
    real u, v;
} hit;

#if BVH_PACKET

/* The nearest surface with tmin < t < tmax for the living lanes, tmin >= 0. d need not be unit: t counts in its
 * lengths. `own`: the triangle that a ray has been moved off to the side that it goes to (offset_origin), -1 for none:
 * it lies in a plane, which such a ray leaves, and need not be tested at the cost of twice the precision. */
FN hit closest_from(const geometry *g, vec o, vec d, real tmin, real tmax, ireal own, mask live) {
    rays all;
    packet_best best;
    rays_store(&all, o, d, tmin, tmax, own, live);
    best.t.all = tmax;
    best.u.all = R(0);
    best.v.all = R(0);
    best.prim.all = I(-1);
    packet_closest(g, &all, &best);
    hit h;
    h.t = best.t.all;
    h.prim = best.prim.all;
    h.u = best.u.all;
    h.v = best.v.all;
    return h;
}

/* Whether closest_from() would find something, null surfaces included. */
FN mask occluded_from(const geometry *g, vec o, vec d, real tmin, real tmax, ireal own, mask live) {
    rays all;
    rays_store(&all, o, d, tmin, tmax, own, live);
    return packet_occluded(g, &all);
}

#else

FN hit closest_from(const geometry *g, vec o, vec d, real tmin, real tmax, ireal own, mask live) {
    rays all;
    lanes_of_real t, u, v;
    lanes_of_ireal prim;
    rays_store(&all, o, d, tmin, tmax, own, live);
    t.all = tmax;
    u.all = R(0);
    v.all = R(0);
    prim.all = I(-1);
    for (int k = 0; k < LANES; k++) {
        if (!all.live.one[k]) continue;
        ray r = rays_take(&all, k);
        hit1 best = {all.tmax.one[k], 0, 0, -1};
        walk_closest(g, &r, ENTRY(r.tmin, 0), &best);
        t.one[k] = best.t;
        u.one[k] = best.u;
        v.one[k] = best.v;
        prim.one[k] = best.prim;
    }
    hit h;
    h.t = t.all;
    h.prim = prim.all;
    h.u = u.all;
    h.v = v.all;
    return h;
}

FN mask occluded_from(const geometry *g, vec o, vec d, real tmin, real tmax, ireal own, mask live) {
    rays all;
    lanes_of_ireal found;
    rays_store(&all, o, d, tmin, tmax, own, live);
    found.all = I(0);
    for (int k = 0; k < LANES; k++) {
        if (!all.live.one[k]) continue;
        ray r = rays_take(&all, k);
        found.one[k] = walk_occluded(g, &r, 0, REAL_BEFORE(all.tmax.one[k]));
    }
    return found.all != I(0);
}

#endif

/* Of rays that start anywhere. */
FN hit closest(const geometry *g, vec o, vec d, real tmin, real tmax, mask live) {
    return closest_from(g, o, d, tmin, tmax, I(-1), live);
}

FN mask occluded(const geometry *g, vec o, vec d, real tmin, real tmax, mask live) {
    return occluded_from(g, o, d, tmin, tmax, I(-1), live);
}

#endif

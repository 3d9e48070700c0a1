/* beam.h -- a ray segment and a point-like light: the geometry of single scattering, and how to sample it.
 *
 * With the light at distance D from the line and t' the signed distance along the ray from the closest point,
 * everything is a function of the angle theta, t' = D tan theta, and 1/distance^2 cancels (equiangular sampling, Kulla
 * & Fajardo 2012). A spot lights the angles within `half` of theta*, where the line passes closest to its axis
 * direction; clipping to them is exact for every cone angle. Angles are kept relative to theta* (called x), so that
 * narrow cones lose no digits:
 *     cos(angle to the spot's axis) = rho cos x.
 */
#ifndef BRUME_BEAM_H
#define BRUME_BEAM_H

#include "light_delta.h"
#include "phase_hg.h"

/* Angles x0..x1 (relative to theta*) between the points t0..t1 (relative to the closest point), t0 <= t1. */
typedef struct {
    real x0, t0, t1, width; /* width = x1 - x0, 0 for none */
} beam_interval;

typedef struct {
    real delta;  /* distance along the ray to the closest point */
    real D;      /* distance of the light from the line there */
    vec n;       /* unit, from the light to the closest point */
    real cs, sn; /* cosine and sine of theta* */
    real rho, versine_out_of_plane; /* 1 - rho, without cancellation */
    beam_interval a, b; /* what is lit: up to two pieces */
} beam;

/* Between the angles, whose ends are the segment's own (at_start, at_end) or the cone's. */
FN beam_interval beam_clip(const beam *g, real start, real end, real xa, real xb, real low, real high) {
    beam_interval i;
    mask from_start = xa >= low, to_end = xb <= high;
    i.x0 = from_start ? xa : low;
    real x1 = to_end ? xb : high;
    real s0, c0, s1, c1;
    lsincos(i.x0, &s0, &c0);
    lsincos(x1, &s1, &c1);
    /* tan(theta* + x) by the sum formulas; an edge beyond the segment's ends is clamped to them. */
    real edge0 = g->D * (g->sn * c0 + g->cs * s0) / lmax(g->cs * c0 - g->sn * s0, R(1e-18));
    real edge1 = g->D * (g->sn * c1 + g->cs * s1) / lmax(g->cs * c1 - g->sn * s1, R(1e-18));
    i.t0 = from_start ? start : lclamp(edge0, start, end);
    i.t1 = to_end ? end : lclamp(edge1, i.t0, end);
    /* Far and narrow segments: the difference of two nearly equal angles has no digits left; its tangent has. */
    real whole = latan2(g->D * (i.t1 - i.t0), fma(i.t0, i.t1, square(g->D)));
    mask is_whole = from_start & to_end;
    i.width = is_whole ? whole : x1 - i.x0;
    i.width = i.width > R(0) ? i.width : R(0);
    return i;
}

FN beam_interval beam_nothing(void) {
    beam_interval i;
    i.x0 = i.t0 = i.t1 = i.width = R(0);
    return i;
}

/* The segment o + t d, t in [0, t_end], and a point or spot light. */
FN beam beam_of(__global const b_light *light, vec o, vec d, real t_end) {
    beam g;
    vec position = vuniform(light->position);
    vec w = vsub(position, o);
    g.delta = vdot(w, d);
    vec e = vmad(d, -g.delta, w);
    real again = vdot(e, d);
    e = vmad(d, -again, e);
    g.delta = g.delta + again;
    real distance = vlength(e);
    /* Below the rounding of the two positions the distance means nothing; the floor keeps width / D finite. */
    real extent = lmax(lmax(fabs(o.x), fabs(o.y)), fabs(o.z)) +
                  R(light_extent(light));
    g.D = lmax(distance, lmax(extent * R(0x1p-21f), R(1e-18)));
    vec across, unused;
    orthonormal_basis(d, &across, &unused);
    g.n = vselect(distance > R(0), vscale(e, R(-1) / lmax(distance, R(1e-30))), across);

    real start = -g.delta, end = t_end - g.delta;
    mask dark = FALSE_MASK, all = TRUE_MASK; /* a point light reaches the whole line */
    real half_width = R(4);
    if (light->kind == LIGHT_SPOT) {
        vec axis = vuniform(light->axis);
        real along_n = vdot(axis, g.n), along_d = vdot(axis, d);
        real out_of_plane = vdot(axis, vcross(g.n, d));
        g.rho = sqrt(square(along_n) + square(along_d));
        mask some = g.rho > R(1e-12);
        g.cs = some ? along_n / lmax(g.rho, R(1e-12)) : R(1);
        g.sn = some ? along_d / lmax(g.rho, R(1e-12)) : R(0);
        g.versine_out_of_plane = square(out_of_plane) / (R(1) + g.rho);
        real v_room = R(light->v_cutoff) - g.versine_out_of_plane;
        dark = v_room < R(0);
        all = v_room >= R(2) * g.rho;
        real k = lclamp(v_room / lmax(R(2) * g.rho, R(1e-24)), R(0), R(1));
        half_width = R(2) * latan2(sqrt(k), sqrt(R(1) - k));
    } else {
        g.rho = R(1);
        g.cs = R(1);
        g.sn = R(0);
        g.versine_out_of_plane = R(0);
    }
    real xa = latan2(difference_of_products(start, g.cs, g.D, g.sn), fma(g.D, g.cs, start * g.sn));
    real xb = latan2(difference_of_products(end, g.cs, g.D, g.sn), fma(g.D, g.cs, end * g.sn));
    mask turned = (xb < R(0)) & (xa > R(0)) & (end > start);
    xb = turned ? xb + R(2 * PI) : xb;
    real reach = all ? R(8) : half_width;
    g.a = beam_clip(&g, start, end, xa, xb, -reach, reach);
    mask none = dark | (t_end <= R(0));
    g.a.width = none ? R(0) : g.a.width;
    g.b = beam_nothing();
    /* A cone wider than a half space can light the far end too, one turn on. */
    mask wraps = (!all) & (!none) & (xb > R(2 * PI) - half_width);
    if (ANY(wraps)) {
        beam_interval b = beam_clip(&g, start, end, xa, xb, R(2 * PI) - half_width, R(2 * PI) + half_width);
        g.b.x0 = wraps ? b.x0 : R(0);
        g.b.t0 = wraps ? b.t0 : R(0);
        g.b.t1 = wraps ? b.t1 : R(0);
        g.b.width = wraps ? b.width : R(0);
    }
    return g;
}

/* t' at the share u of an interval's angle; within it for every u in [0, 1]. */
FN real beam_equiangular(const beam *g, beam_interval i, real u) {
    real y = u * i.width, z = (R(1) - u) * i.width;
    /* From whichever side of the closest point: tan of the angle to the infinite end keeps the digits. */
    real right = latan2(g->D, i.t1) + z, left = latan2(g->D, -i.t0) + y;
    real sr, cr, sl, cl, sy, cy, sz, cz;
    lsincos(right, &sr, &cr);
    lsincos(left, &sl, &cl);
    real t = right < left ? g->D * cr / sr : -g->D * cl / sl;
    /* Far and narrow: increments from the nearer end. */
    lsincos(y, &sy, &cy);
    lsincos(z, &sz, &cz);
    real far = lmax(fabs(i.t0), fabs(i.t1));
    real D2 = square(g->D);
    real from0 = i.t0 + (D2 + square(i.t0)) * sy / fma(g->D, cy, -i.t0 * sy);
    real from1 = i.t1 - (D2 + square(i.t1)) * sz / fma(g->D, cz, i.t1 * sz);
    mask narrow = (i.width < R(0.02)) & (far * i.width < R(0.25) * g->D);
    t = narrow ? (fabs(i.t1) < fabs(i.t0) ? from1 : from0) : t;
    return lclamp(t, i.t0, i.t1);
}

/* 1 - cos of the angle to the spot's axis, at t'. */
FN real beam_versine(const beam *g, real t) {
    real x = latan2(difference_of_products(t, g->cs, g->D, g->sn), fma(g->D, g->cs, t * g->sn));
    real s, c;
    lsincos(R(0.5) * x, &s, &c);
    return g->versine_out_of_plane + R(2) * g->rho * square(s);
}

/* What the medium and the light do at t', without transmittance: falloff, phase. */
FN real beam_response(const beam *g, __global const b_light *light, real t, real distance, real phase_g) {
    /* Directions of travel: along d, then from the point to the eye is -d; light arrives along (D n + t' d) / distance,
     * so 1 - cos of the scattering angle is 1 + t'/distance = 1 + sin theta. For g < 0 seen from behind, where 2 - v
     * would lose the digits near the peak. */
    real s = t / distance;
    s = phase_g < R(0) ? -s : s;
    real v = s > R(0) ? R(1) + s : square(g->D / distance) / (R(1) - s);
    real f = hg_density(v, fabs(phase_g));
    if (light->kind == LIGHT_SPOT) f = f * spot_falloff(light, beam_versine(g, t));
    return f;
}

#endif

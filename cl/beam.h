/* beam.h -- a ray segment and a lamp with a place: the geometry of single scattering, and how to sample it.
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

#include "equiangular.h"
#include "lamp.h"
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
    i.width = x1 - i.x0;
    mask is_whole = from_start & to_end;
    if (ANY(is_whole)) {
        /* Far and narrow segments: the difference of two nearly equal angles has no digits left; its tangent has. */
        real whole = latan2(g->D * (i.t1 - i.t0), fma(i.t0, i.t1, square(g->D)));
        i.width = is_whole ? whole : i.width;
    }
    i.width = i.width > R(0) ? i.width : R(0);
    return i;
}

FN beam_interval beam_interval_select(mask m, beam_interval a, beam_interval b) {
    beam_interval i;
    i.x0 = m ? a.x0 : b.x0;
    i.t0 = m ? a.t0 : b.t0;
    i.t1 = m ? a.t1 : b.t1;
    i.width = m ? a.width : b.width;
    return i;
}

FN beam_interval beam_nothing(void) {
    beam_interval i;
    i.x0 = i.t0 = i.t1 = i.width = R(0);
    return i;
}

/* The segment o + t d, t in [0, t_end], and a lamp with a place. */
FN beam beam_of(const lamp *l, vec o, vec d, real t_end) {
    beam g;
    vec w = vsub(l->position, o);
    g.delta = vdot(w, d);
    vec e = vmad(d, -g.delta, w);
    real again = vdot(e, d);
    e = vmad(d, -again, e);
    g.delta = g.delta + again;
    real distance = vlength(e);
    /* The floor keeps width / D finite. */
    g.D = lmax(distance, lmax(lamp_resolution(l, o), R(1e-18)));
    vec across, unused;
    orthonormal_basis(d, &across, &unused);
    g.n = vselect(distance > R(0), vscale(e, R(-1) / lmax(distance, R(1e-30))), across);

    real start = -g.delta, end = t_end - g.delta;
    real along_n = vdot(l->axis, g.n), along_d = vdot(l->axis, d);
    real out_of_plane = vdot(l->axis, vcross(g.n, d));
    g.rho = sqrt(square(along_n) + square(along_d));
    mask some = g.rho > R(1e-12);
    g.cs = some ? along_n / lmax(g.rho, R(1e-12)) : R(1);
    g.sn = some ? along_d / lmax(g.rho, R(1e-12)) : R(0);
    g.versine_out_of_plane = square(out_of_plane) / (R(1) + g.rho);
    real v_room = l->v_cutoff - g.versine_out_of_plane;
    mask dark = l->cone & (v_room < R(0));
    mask all = v_room >= R(2) * g.rho;
    real k = lclamp(v_room / lmax(R(2) * g.rho, R(1e-24)), R(0), R(1));
    /* A point light reaches the whole line. */
    all = all | !l->cone;
    g.rho = l->cone ? g.rho : R(1);
    g.cs = l->cone ? g.cs : R(1);
    g.sn = l->cone ? g.sn : R(0);
    g.versine_out_of_plane = l->cone ? g.versine_out_of_plane : R(0);
    mask none = dark | (t_end <= R(0));
    g.a = g.b = beam_nothing();
    if (ALL(none)) return g;
    real half_width = R(2) * latan2(sqrt(k), sqrt(R(1) - k));
    half_width = l->cone ? half_width : R(4);

    real xa = latan2(difference_of_products(start, g.cs, g.D, g.sn), fma(g.D, g.cs, start * g.sn));
    real xb = latan2(difference_of_products(end, g.cs, g.D, g.sn), fma(g.D, g.cs, end * g.sn));
    mask turned = (xb < R(0)) & (xa > R(0)) & (end > start);
    xb = turned ? xb + R(2 * PI) : xb;
    real reach = all ? R(8) : half_width;
    beam_interval a = beam_clip(&g, start, end, xa, xb, -reach, reach);
    g.a = beam_interval_select(none, g.a, a);
    /* A cone wider than a half space can light the far end too, one turn on. */
    mask wraps = (!all) & (!none) & (xb > R(2 * PI) - half_width);
    if (ANY(wraps)) {
        beam_interval b = beam_clip(&g, start, end, xa, xb, R(2 * PI) - half_width, R(2 * PI) + half_width);
        g.b = beam_interval_select(wraps, b, g.b);
    }
    return g;
}

/* The whole segment as one interval, lit or not. */
FN beam_interval beam_whole(const beam *g, real t_end) {
    beam_interval i;
    i.t0 = -g->delta;
    i.t1 = t_end - g->delta;
    i.x0 = latan2(difference_of_products(i.t0, g->cs, g->D, g->sn), fma(g->D, g->cs, i.t0 * g->sn));
    i.width = latan2(g->D * t_end, fma(i.t0, i.t1, square(g->D)));
    return i;
}

/* t' at the share u of an interval's angle; within it for every u in [0, 1]. */
FN real beam_equiangular(const beam *g, beam_interval i, real u) {
    equiangular_range r;
    r.D = g->D;
    r.t0 = i.t0;
    r.t1 = i.t1;
    r.width = i.width;
    return equiangular_sample(&r, u);
}

/* A point of the ray, and the angle at which the lamp sees it. */
typedef struct {
    real t;        /* from the closest point */
    real distance; /* of the lamp */
    real x;        /* relative to theta* */
} beam_point;

FN beam_point beam_point_at(const beam *g, real t) {
    beam_point p;
    p.t = t;
    p.distance = sqrt(fma(t, t, square(g->D)));
    p.x = latan2(difference_of_products(t, g->cs, g->D, g->sn), fma(g->D, g->cs, t * g->sn));
    return p;
}

/* Equiangularly, as beam_equiangular. */
FN beam_point beam_point_of(const beam *g, beam_interval i, real u) {
    beam_point p;
    p.t = beam_equiangular(g, i, u);
    p.distance = sqrt(fma(p.t, p.t, square(g->D)));
    p.x = fma(u, i.width, i.x0);
    return p;
}

/* 1 - cos of the angle to the lamp's axis. */
FN real beam_versine(const beam *g, real x) {
    real s, c;
    lsincos(R(0.5) * x, &s, &c);
    return g->versine_out_of_plane + R(2) * g->rho * square(s);
}

/* The way from the eye to the point and on to the lamp, less the way from the eye to the point closest to it:
 * t' + distance, within 2.1 ulp. */
FN real beam_path(const beam *g, real t, real distance) {
    return t < R(0) ? square(g->D) / (distance - t) : t + distance;
}

/* 1 - cos of the scattering angle, counted from the phase function's peak. Directions of travel: light arrives along (D
 * n + t' d) / distance, and leaves for the eye along -d; so it is 1 + t'/distance, or 1 - t'/distance for g < 0, where
 * 2 - v would lose the digits near the peak. Within 3.3 ulp. */
FN real beam_turn(const beam *g, real t, real distance, real phase_g) {
    real s = t / distance;
    s = phase_g < R(0) ? -s : s;
    return s > R(0) ? R(1) + s : square(g->D / distance) / (R(1) - s);
}

/* What the medium and the lamp do at a point, without transmittance: falloff, phase. */
FN real beam_response(const beam *g, const lamp *l, beam_point p, real phase_g) {
    real f = hg_density(beam_turn(g, p.t, p.distance, phase_g), fabs(phase_g));
    if (ANY(l->cone)) f = f * lamp_falloff(l, beam_versine(g, p.x));
    return f;
}

/* Towards the lamp. */
FN vec beam_wi(const beam *g, vec d, beam_point p) {
    return vscale(vmad(d, p.t, vscale(g->n, g->D)), R(-1) / p.distance);
}

#endif

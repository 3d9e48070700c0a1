/* scatter_segment.h -- light of lamps without extent, scattered once towards the eye along a segment through a medium.
 *
 * The integral over the whole segment is estimated with one point: a light is chosen by what it would give at the
 * middle of its lit interval; a point, half the time equiangularly over the lit interval, half the time in proportion
 * to transmittance there, combined by the balance heuristic (Veach 1995; Georgiev et al. 2013; Kulla & Fajardo 2012).
 */
#ifndef BRUME_SCATTER_SEGMENT_H
#define BRUME_SCATTER_SEGMENT_H

#include "beam.h"
#include "medium.h"
#include "reservoir.h"

/* A point on the segment and the light that it scatters to the eye, if nothing hides it: `value` lacks the
 * transmittance from the light to the point. */
typedef struct {
    mask some;
    real t; /* along the segment */
    vec wi; /* towards the light */
    real distance;
    rgb value;
} in_scatter;

/* Transmittance-weighted density of scattering, as one number for choosing. */
FN real grey_extinction(const medium *m) { return cmean(m->sigma_t); }

/* What a light contributes at the middle of an interval, times the interval's width. */
FN real beam_node(const beam *g, __global const b_light *light, beam_interval i, real sigma, real phase_g) {
    real t = beam_equiangular(g, i, R(0.5));
    real distance = sqrt(fma(t, t, square(g->D)));
    real f = beam_response(g, light, t, distance, phase_g);
    return i.width / g->D * f * lexp(-sigma * (lmax(g->delta + t, R(0)) + distance));
}

/* The weight of a light for a segment: positive wherever it contributes anything that float can hold. */
FN real light_weight(__global const b_light *light, vec o, vec d, real t_end, const medium *m) {
    real sigma = grey_extinction(m);
    real strength = R(0.2126f * light->intensity[0] + 0.7152f * light->intensity[1] + 0.0722f * light->intensity[2]);
    if (light->kind == LIGHT_DIRECTIONAL) {
        return strength * phase_hg(vuniform(light->axis), vneg(d), m->g) * transmittance_integral(sigma, t_end);
    }
    beam g = beam_of(light, o, d, t_end);
    real w = R(0);
    if (ANY(g.a.width > R(0))) w = beam_node(&g, light, g.a, sigma, m->g);
    if (ANY(g.b.width > R(0))) w = w + (g.b.width > R(0) ? beam_node(&g, light, g.b, sigma, m->g) : R(0));
    /* The node can be dark (a falloff's zero, a far tail) where the interval isn't: any lit one keeps a little. */
    real least = (g.a.width + g.b.width) / g.D * R(1e-12);
    return strength * (w > least ? w : least);
}

/* The point for one light of which this is `chosen` by the mask, with probability `share`. */
FN void scatter_from(const scene *s, __global const b_light *light, vec o, vec d, real t_end, const medium *m,
                     real u_technique, real u_position, real share, mask chosen, in_scatter *out) {
    real sigma = grey_extinction(m);
    rgb sigma_s = cmul(m->sigma_t, m->albedo);
    real t, distance, f;
    vec wi;
    mask some;
    if (light->kind == LIGHT_DIRECTIONAL) {
        real tau = sigma * t_end;
        real bend = tau < R(1e-5) ? u_position : -llog1p(u_position * lexpm1(-tau)) / tau;
        t = lmin(bend * t_end, t_end);
        real density = lexp(-sigma * t) / transmittance_integral(sigma, t_end);
        some = chosen & (density > R(0));
        distance = FAR_AWAY;
        wi = vneg(vuniform(light->axis));
        f = phase_hg(vuniform(light->axis), vneg(d), m->g) / density;
    } else {
        beam g = beam_of(light, o, d, t_end);
        some = chosen & (g.a.width + g.b.width > R(0));
        real share_a = g.a.width / lmax(g.a.width + g.b.width, R(1e-37));
        mask in_a = split(&u_technique, share_a);
        real share_i = in_a ? share_a : R(1) - share_a;
        beam_interval i;
        i.x0 = in_a ? g.a.x0 : g.b.x0;
        i.t0 = in_a ? g.a.t0 : g.b.t0;
        i.t1 = in_a ? g.a.t1 : g.b.t1;
        i.width = in_a ? g.a.width : g.b.width;
        mask equiangular = u_technique < R(0.5);
        real length = i.t1 - i.t0;
        real tau = sigma * length;
        real bend = tau < R(1e-5) ? u_position : -llog1p(u_position * lexpm1(-tau)) / lmax(tau, R(1e-37));
        real along = equiangular ? beam_equiangular(&g, i, u_position) : lclamp(fma(bend, length, i.t0), i.t0, i.t1);
        real d2 = fma(along, along, square(g.D));
        distance = sqrt(d2);
        /* Densities times distance^2, which cancels the light's own 1/distance^2. */
        real by_angle = g.D / lmax(i.width, R(1e-37));
        real by_length = d2 * lexp(-sigma * (along - i.t0)) / lmax(transmittance_integral(sigma, length), R(1e-37));
        real density = share_i * R(0.5) * (by_angle + by_length);
        t = lclamp(along + g.delta, R(0), t_end);
        wi = vscale(vmad(d, along, vscale(g.n, g.D)), R(-1) / distance);
        f = beam_response(&g, light, along, distance, m->g) / density;
    }
    rgb value = cmul(cscale(cuniform(light->intensity), f / share), cmul(sigma_s, medium_transmittance(m->sigma_t, t)));
    if (light->kind == LIGHT_SPOT) value = cmul(value, spot_gobo(s, light, vneg(wi)));
    out->t = some ? t : out->t;
    out->distance = some ? distance : out->distance;
    out->wi = vselect(some, wi, out->wi);
    out->value = cselect(some, value, out->value);
    out->some = out->some | (some & !is_black(value));
}

/* One estimate for the segment o + t d, t in [0, t_end], of each lane. u: light, technique, position; in [0, 1). */
FN in_scatter scatter_along(const scene *s, vec o, vec d, real t_end, const medium *m, real u_light, real u_technique,
                            real u_position, mask live) {
    in_scatter out;
    out.some = FALSE_MASK;
    out.t = out.distance = R(0);
    out.wi = d;
    out.value = cgrey(R(0));
    int count = s->params->light_count;
    ireal choice = I(0);
    real share = R(1);
    if (count > 1) {
        reservoir r = reservoir_start(u_light);
        for (int k = 0; k < count; k++)
            reservoir_offer(&r, I(k), light_weight(&s->lights[k], o, d, t_end, m), live);
        choice = r.choice;
        share = reservoir_share(&r);
    }
    for (int k = 0; k < count; k++) {
        mask chosen = live & (choice == I(k));
        if (ANY(chosen))
            scatter_from(s, &s->lights[k], o, d, t_end, m, u_technique, u_position, share, chosen, &out);
    }
    return out;
}

#endif

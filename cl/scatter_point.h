/* scatter_point.h -- single scattering along a segment, estimated with one point of it: the lower rungs.
 *
 * STRATEGY_EQUIANGULAR takes the point equiangularly about the lamp over the whole segment (Kulla & Fajardo 2012),
 * EQUIANGULAR_CONE over what the lamp's cone lights of it; MIS does so half the time, and half the time in proportion
 * to transmittance there, combined by the balance heuristic (Veach 1995; Georgiev et al. 2013).
 */
#ifndef BRUME_SCATTER_POINT_H
#define BRUME_SCATTER_POINT_H

#include "light_choice.h"

/* A point on the segment and the light that it scatters to the eye, if nothing hides it: `value` lacks the
 * transmittance from the lamp to the point. */
typedef struct {
    mask some;
    real t; /* along the segment */
    vec wi; /* towards the lamp */
    real distance;
    rgb value;
    real rays; /* of the lamp, as lamp_rays has it */
} in_scatter;

/* The share u of what a medium scatters within t_end, by transmittance. In a thin one to second order in
 * tau. Within 3.3 ulp, or exact for a u that is off by 3.3 2^-24. */
FN real transmittance_quantile(real sigma, real t_end, real u) {
    real tau = sigma * t_end;
    real thin = u * fma(R(-0.5) * tau, R(1) - u, R(1));
    real bend = tau < R(1e-7) ? thin : -llog1p(u * lexpm1(-tau)) / lmax(tau, R(1e-37));
    return lclamp(bend * t_end, R(0), t_end);
}

/* Directional light: in proportion to transmittance. */
FN in_scatter scatter_directional(const lamp *l, vec d, real t_end, const medium *m, real u) {
    real sigma = grey_extinction(m);
    in_scatter p;
    p.t = transmittance_quantile(sigma, t_end, u);
    real density = lexp(-sigma * p.t) / transmittance_integral(sigma, t_end);
    p.some = density > R(0);
    p.distance = FAR_AWAY;
    p.wi = vneg(l->axis);
    p.value = cscale(l->intensity, phase_hg(l->axis, vneg(d), m->g) / density);
    return p;
}

FN in_scatter scatter_from_lamp(const lamp *l, vec o, vec d, real t_end, const medium *m, real u_technique,
                                real u_position) {
    real sigma = grey_extinction(m);
    in_scatter out;
    beam g = beam_of(l, o, d, t_end);
    beam_interval i;
    real share_i = R(1);
    if (STRATEGY == STRATEGY_EQUIANGULAR) {
        i = beam_whole(&g, t_end);
        out.some = g.a.width + g.b.width > R(0);
    } else {
        out.some = g.a.width + g.b.width > R(0);
        real share_a = g.a.width / lmax(g.a.width + g.b.width, R(1e-37));
        mask in_a = split(&u_technique, share_a);
        share_i = in_a ? share_a : R(1) - share_a;
        i = beam_interval_select(in_a, g.a, g.b);
    }
    beam_point p = beam_point_of(&g, i, u_position);
    if (STRATEGY == STRATEGY_MIS) {
        mask equiangular = u_technique < R(0.5);
        real t = lmin(i.t0 + transmittance_quantile(sigma, i.t1 - i.t0, u_position), i.t1);
        if (ANY(!equiangular)) {
            beam_point q = beam_point_at(&g, t);
            p.t = equiangular ? p.t : q.t;
            p.distance = equiangular ? p.distance : q.distance;
            p.x = equiangular ? p.x : q.x;
        }
    }
    /* Densities times distance^2, which cancels the lamp's own 1/distance^2. */
    real density = g.D / lmax(i.width, R(1e-37));
    if (STRATEGY == STRATEGY_MIS) {
        real by_length = square(p.distance) * lexp(-sigma * (p.t - i.t0)) /
                         lmax(transmittance_integral(sigma, i.t1 - i.t0), R(1e-37));
        density = R(0.5) * (density + by_length);
    }
    out.t = lclamp(p.t + g.delta, R(0), t_end);
    out.distance = p.distance;
    out.wi = beam_wi(&g, d, p);
    out.value = cscale(l->intensity, beam_response(&g, l, p, m->g) / (share_i * density));
    return out;
}

/* One estimate for the segment o + t d, t in [0, t_end], of each lane. u: lamp, technique, position; in [0, 1). */
FN in_scatter scatter_along(const scene *s, vec o, vec d, real t_end, const medium *m, real u_light, real u_technique,
                            real u_position, mask live) {
    real share;
    ireal choice = lamp_choose_for_segment(s, o, d, t_end, m, u_light, live, &share);
    mask chosen = live & (choice >= I(0));
    lamp l = lamp_gather(s, chosen ? choice : I(0));
    in_scatter p = scatter_from_lamp(&l, o, d, t_end, m, u_technique, u_position);
    if (ANY(l.directional)) {
        in_scatter q = scatter_directional(&l, d, t_end, m, u_position);
        p.some = (l.directional & q.some) | (p.some & !l.directional);
        p.t = l.directional ? q.t : p.t;
        p.distance = l.directional ? q.distance : p.distance;
        p.wi = vselect(l.directional, q.wi, p.wi);
        p.value = cselect(l.directional, q.value, p.value);
    }
    rgb sigma_s = cmul(m->sigma_t, m->albedo);
    p.value = cmul(cscale(p.value, R(1) / share), cmul(sigma_s, medium_transmittance(m->sigma_t, p.t)));
    if (ANY(l.cone)) p.value = cmul(p.value, lamp_gobo(s, &l, vneg(p.wi)));
    p.rays = INDIRECT_IS_RAYS ? lamp_rays(s, chosen ? choice : I(0)) : R(0);
    p.some = chosen & p.some & !is_black(p.value);
    return p;
}

#endif

/* light_choice.h -- which lamp a segment of a ray, or a point of a surface, gets its light sample from.
 *
 * A segment: each lamp in proportion to what it would scatter to the eye at the middle of its lit interval, times the
 * interval's angle. The selection's variance is then that of the integrands' shapes and of visibility alone.
 */
#ifndef BRUME_LIGHT_CHOICE_H
#define BRUME_LIGHT_CHOICE_H

#include "beam.h"
#include "medium.h"
#include "reservoir.h"

/* Transmittance-weighted density of scattering, as one number for choosing. */
FN real grey_extinction(const medium *m) { return cmean(m->sigma_t); }

/* What a lamp contributes at the middle of an interval, times the interval's width. */
FN real beam_node(const beam *g, const lamp *l, beam_interval i, real sigma, real phase_g) {
    beam_point p = beam_point_of(g, i, R(0.5));
    real f = beam_response(g, l, p, phase_g);
    return i.width / g->D * f * lexp(-sigma * lmax(g->delta + beam_path(g, p.t, p.distance), R(0)));
}

/* The weight of a lamp for a segment: positive wherever it contributes anything that float can hold. */
FN real lamp_segment_weight(const lamp *l, vec o, vec d, real t_end, const medium *m) {
    real sigma = grey_extinction(m), strength = luminance(l->intensity);
    beam g = beam_of(l, o, d, t_end);
    real w = R(0);
    if (ANY(g.a.width > R(0))) w = g.a.width > R(0) ? beam_node(&g, l, g.a, sigma, m->g) : R(0);
    if (ANY(g.b.width > R(0))) w = w + (g.b.width > R(0) ? beam_node(&g, l, g.b, sigma, m->g) : R(0));
    /* The node can be dark (a falloff's zero, a far tail) where the interval isn't: any lit one keeps a little. */
    real least = (g.a.width + g.b.width) / g.D * R(1e-12);
    w = w > least ? w : least;
    if (ANY(l->directional)) {
        real parallel = phase_hg(l->axis, vneg(d), m->g) * transmittance_integral(sigma, t_end);
        w = l->directional ? parallel : w;
    }
    return strength * w;
}

/* -1 where no lamp reaches the segment. `share`: with what probability it was chosen. */
FN ireal lamp_choose_for_segment(const scene *s, vec o, vec d, real t_end, const medium *m, real u, mask live,
                                 real *share) {
    int count = s->params->light_count;
    *share = R(1);
    if (count == 1) return I(0);
    reservoir r = reservoir_start(u);
    for (int k = 0; k < count; k++) {
        lamp l = lamp_uniform(s, k);
        reservoir_offer(&r, I(k), lamp_segment_weight(&l, o, d, t_end, m), live);
    }
    *share = reservoir_share(&r);
    return r.choice;
}

/* For a surface point p with normal n, seen from the side that `front` says (1 or -1): every surface that is not specular
 * only reflects, and a lamp on the other side gives it nothing. n of length 0: a point in a medium. */
FN ireal lamp_choose_for_point(const scene *s, vec p, vec n, real front, mask in_medium, real u, mask live,
                               real *share) {
    reservoir r = reservoir_start(u);
    int count = s->params->light_count;
    for (int k = 0; k < count; k++) {
        lamp l = lamp_uniform(s, k);
        lamp_arrival a = lamp_at(s, &l, p);
        real cosine = vdot(a.wi, n);
        mask reaches = live & (in_medium | (cosine * front > R(0)));
        real w = in_medium ? R(1) : lmax(fabs(cosine), R(1e-3));
        reservoir_offer(&r, I(k), luminance(a.irradiance) * w, reaches);
    }
    *share = reservoir_share(&r);
    return r.choice;
}

#endif

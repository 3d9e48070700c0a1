/* light_choice.h -- which lamp a segment of a ray, or a point of a surface, gets its light sample from.
 *
 * A segment: each lamp in proportion to what it would scatter to the eye at the middle of its lit interval, times the
 * interval's angle. The selection's variance is then that of the integrands' shapes and of visibility alone.
 */
#ifndef BRUME_LIGHT_CHOICE_H
#define BRUME_LIGHT_CHOICE_H

#include "beam.h"
#include "light_tree.h"
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

/* Of a lamp for a point, as lamp_choose_for_point has it; 0 where nothing reaches. */
FN real lamp_point_weight(const scene *s, const lamp *l, vec p, vec n, real front, mask in_medium) {
    lamp_arrival a = lamp_at(s, l, p);
    real cosine = vdot(a.wi, n);
    real w = in_medium ? R(1) : lmax(fabs(cosine), R(1e-3));
    mask reaches = in_medium | (cosine * front > R(0));
    return reaches ? luminance(a.irradiance) * w : R(0);
}

FN real lamp_weight(const scene *s, const lamp *l, const light_query *q) {
    if (q->is_point) return lamp_point_weight(s, l, q->o, q->d, q->front, q->in_medium);
    return lamp_segment_weight(l, q->o, q->d, q->t_end, q->m);
}

/* Lamps to look at, per lane: those of a leaf that reach. */
typedef struct {
    ushort bits[LIGHT_LEAF_BLOCKS][LANES];
    int at[LANES], first[LANES], count[LANES]; /* blocks */
} light_list;

/* The next lamp of each lane, -1 where there is none. */
FN ireal light_list_next(const scene *s, light_list *list) {
    lanes_of_ireal next;
    for (int k = 0; k < LANES; k++) {
        int at = list->at[k];
        while (at < list->count[k] && list->bits[at][k] == 0) at++;
        list->at[k] = at;
        next.one[k] = -1;
        if (at == list->count[k]) continue;
        uint bits = list->bits[at][k], lowest = bits & (0u - bits);
        list->bits[at][k] = (ushort)(bits ^ lowest);
        next.one[k] = s->light_tree[list->first[k] + at].child[31 - clz(lowest)];
    }
    return next.all;
}

/* A leaf of the light tree, and of its lamps one. */
FN ireal lamp_choose_by_tree(const scene *s, const light_query *q, real u, mask live, real *share) {
    int placed = s->params->light_tree_lamps, count = s->params->light_count;
    lanes_of_real other, left, leaf_share;
    lanes_of_ireal in, placeless;
    other.all = R(0);
    for (int k = placed; k < count; k++) {
        lamp l = lamp_uniform(s, k);
        real w = lamp_weight(s, &l, q);
        other.all = w > R(0) ? fma(w, R(s->params->light_tree_scale), other.all) : other.all;
    }
    light_asks asks = light_asks_of(q);
    light_list list;
    in.all = live;
    left.all = u;
    leaf_share.all = R(1);
    placeless.all = I(0);
    for (int k = 0; k < LANES; k++) {
        list.at[k] = list.count[k] = list.first[k] = 0;
        if (!in.one[k]) continue;
        light_ask a = light_ask_take(&asks, k);
        light_leaf leaf = light_tree_descend(s, &a, q->is_point, other.one[k], left.one[k]);
        left.one[k] = leaf.u;
        leaf_share.one[k] = leaf.share;
        placeless.one[k] = leaf.placeless;
        list.first[k] = leaf.first;
        list.count[k] = leaf.count;
        for (int j = 0; j < leaf.count; j++)
            list.bits[j][k] = (ushort)light_block_reaches(s->light_tree + leaf.first + j, &a, q->is_point);
    }
    reservoir r = reservoir_start(left.all);
    mask flat = live & (placeless.all != I(0));
    for (int k = placed; ANY(flat) && k < count; k++) {
        lamp l = lamp_uniform(s, k);
        reservoir_offer(&r, I(k), lamp_weight(s, &l, q), flat);
    }
    for (;;) {
        ireal next = light_list_next(s, &list);
        mask some = next >= I(0);
        if (!ANY(some)) break;
        ireal i = some ? next : I(0);
        lamp l = lamp_gather(s, i);
        reservoir_offer(&r, i, lamp_weight(s, &l, q), some);
    }
    *share = leaf_share.all * reservoir_share(&r);
    return r.choice;
}

/* -1 where no lamp reaches the segment, or the tree led to none that does. `share`: with what probability it was
 * chosen. */
FN ireal lamp_choose_for_segment(const scene *s, vec o, vec d, real t_end, const medium *m, real u, mask live,
                                 real *share) {
    int count = s->params->light_count;
    *share = R(1);
    if (count == 1) return I(0);
    light_query q;
    q.is_point = 0;
    q.o = o, q.d = d, q.t_end = t_end, q.m = m;
    q.front = R(1), q.in_medium = FALSE_MASK;
    if (HAS(MANY_LIGHTS) && s->params->light_tree_blocks > 0) return lamp_choose_by_tree(s, &q, u, live, share);
    reservoir r = reservoir_start(u);
    for (int k = 0; k < count; k++) {
        lamp l = lamp_uniform(s, k);
        reservoir_offer(&r, I(k), lamp_weight(s, &l, &q), live);
    }
    *share = reservoir_share(&r);
    return r.choice;
}

/* For a surface point p with normal n, seen from the side that `front` says (1 or -1): every surface that is not
 * specular only reflects, and a lamp on the other side gives it nothing. n of length 0: a point in a medium. */
FN ireal lamp_choose_for_point(const scene *s, vec p, vec n, real front, mask in_medium, real u, mask live,
                               real *share) {
    light_query q;
    q.is_point = 1;
    q.o = p, q.d = n, q.t_end = R(0), q.m = 0;
    q.front = front, q.in_medium = in_medium;
    if (HAS(MANY_LIGHTS) && s->params->light_tree_blocks > 0) return lamp_choose_by_tree(s, &q, u, live, share);
    reservoir r = reservoir_start(u);
    int count = s->params->light_count;
    for (int k = 0; k < count; k++) {
        lamp l = lamp_uniform(s, k);
        reservoir_offer(&r, I(k), lamp_weight(s, &l, &q), live);
    }
    *share = reservoir_share(&r);
    return r.choice;
}

#endif

/* path_medium.h -- what happens to a path between two surfaces: emission, in-scattered light of lamps, free flight. */
#ifndef BRUME_PATH_MEDIUM_H
#define BRUME_PATH_MEDIUM_H

#include "path_indirect.h"
#include "scatter_segment.h"
#include "visibility.h"

/* Everything that the medium does along the segment up to t; returns which lanes scatter, and moves `t` there. */
FN mask path_medium(const scene *s, path *p, const medium *m, real *t) {
    mask in = p->alive & (p->medium >= I(0));
    ireal max_depth = I(s->params->max_depth);
    mask glows = in & !is_black(m->emission);
    if (ANY(glows)) path_add(p, glows, medium_emission(m, *t), TRUE_MASK, 0);

    rgb sigma_s = cmul(m->sigma_t, m->albedo);
    mask scattering = HAS(SCATTERING) ? in & !is_black(sigma_s) : FALSE_MASK;
    if (!HAS(SCATTERING) || !ANY(scattering)) { /* the short way: nothing is random */
        p->throughput = cselect(in, cmul(p->throughput, medium_transmittance(m->sigma_t, *t)), p->throughput);
        p->alive = p->alive & !(in & is_black(p->throughput));
        return FALSE_MASK;
    }
    mask camera = p->segments == I(0);
    /* Along the first segment, of one lamp, nothing else is drawn. */
    int more = s->params->light_count > 1 || ANY(scattering & !camera);
    more = FLIES ? 1 : STRATEGY_IS_PRODUCT ? more : 1;
    random4 u = random_none();
    if (more) u = random_set(&p->random, random_bounce_set(p->segments, SET_MEDIUM));
    /* The distance along the first segment shares its set with the pixel position: padding it loses up to 10 x. */
    u.z = select32(camera, p->pixel_z, u.z);
    u.w = select32(camera, p->pixel_w, u.w);
    mask gathers = scattering & (p->depth + I(2) <= max_depth), by_lamps = gathers;
    if (INDIRECT_IS_RAYS) {
        if (RAYS_ALONE(s)) by_lamps = gathers & !p->from_medium;
        mask connects = scattering & (p->depth + I(3) <= max_depth);
        if (ANY(connects)) path_connect(s, p, m, *t, connects);
    }
    if (!HAS(DELTA_LIGHTS) || s->params->light_count == 0) by_lamps = FALSE_MASK;
    mask by_emitters = SCATTERS_EMITTERS ? gathers : FALSE_MASK;
    if (STRATEGY_GATHERS && ANY(by_lamps | by_emitters)) {
        segment at;
        random4 place = u;
        if (SCATTERS_EMITTERS) place = random_set(&p->random, random_bounce_set(p->segments, SET_EMITTER));
        at.o = p->o;
        at.d = p->d;
        at.t_end = *t;
        at.m = *m;
        at.inside = p->medium;
        at.primary = p->depth == I(0);
        at.throughput = p->throughput;
        at.pdf = INDIRECT_IS_RAYS ? p->pdf : R(-1);
        if (RAYS_SHARE(s)) at.pdf = path_density(p);
        at.before = R(0);
        if (INDIRECT_IS_RAYS && RAYS_CROSS(s)) at.before = vlength(vsub(p->o, p->from));
        rgb gathered = scatter_gather(s, &at, unit(u.x), unit(u.y), unit(u.z), place, by_lamps, by_emitters);
        path_add(p, gathers, gathered, TRUE_MASK, 1);
    }

    /* A scattering event is worth having if what follows can still reach light within max_depth: one more segment for
     * light that a ray can meet, one more scattering event for lamps. Otherwise the segment only attenuates. */
    int edges = s->params->surfaces_emit ? 2 : STRATEGY_GATHERS ? 3 : 2;
    /* What the next one would find has been connected. */
    if (RAYS_ALONE(s)) edges = edges == 3 && !s->params->has_specular ? 4 : edges;
    ireal needed = p->depth + I(edges);
    mask may = FLIES ? scattering & (needed <= max_depth) : FALSE_MASK;
    /* What has been scattered would have to scatter again: not with single scattering. */
    if (s->params->single_scattering && edges > 2) may = FALSE_MASK;
    rgb through = medium_transmittance(m->sigma_t, *t), before = p->throughput;
    mask scatters = FALSE_MASK;
    flight f;
    f.t = *t;
    if (ANY(may)) {
        real t_end = may ? *t : R(0);
        f = STRATEGY == STRATEGY_SPHERICAL ? medium_flight_uniform(m, before, t_end, u)
                                           : medium_flight(m, before, t_end, unit(u.y), unit_positive(u.w));
        through = cselect(may, f.weight, through);
        scatters = may & f.scatters;
    }
    p->throughput = cselect(in, cmul(before, through), before);
    mask flew = scatters & p->alive;
    if (SCATTERS_EMITTERS && ANY(flew)) {
        flight_record r;
        r.before = p->d;
        r.back = f.t;
        r.ahead = *t - f.t;
        r.flight = medium_flight_density(m, before, f.t);
        r.sigma = grey_extinction(m);
        r.g = m->g;
        p->flew = flight_record_select(flew, r, p->flew);
    }
    if (RAYS_SHARE(s)) p->flown = flew ? connect_flown(m, before, f.t, *t) : p->flown;
    *t = scatters ? f.t : *t;
    p->alive = p->alive & !(in & is_black(p->throughput));
    return scatters & p->alive;
}

#endif

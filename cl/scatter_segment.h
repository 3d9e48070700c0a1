/* scatter_segment.h -- light of lamps scattered once towards the eye along a segment through a medium: the strategies.
 *
 * The lower rungs take one point (scatter_point.h). From STRATEGY_PRODUCT on, a lamp whose way to the segment is clear
 * is integrated without noise (beam_integral.h); else points are taken in proportion to all but visibility
 * (beam_table.h): one for PRODUCT, several with one common offset for SYSTEMATIC, and RASTER finds the visibility of
 * all by one walk (traverse_wedge.h). Systematic points share their offset because it is one dimension of a
 * low-discrepancy set.
 *
 * STRATEGY_AUTO goes by a plan (PLAN_... in shared.h) that a pilot ray of each pixel has made for each lamp, if they
 * are few: the integral less what one shadow ray finds hidden, which can come out below 0; or points with a ray each.
 * What scattered before has more noise than one more point would remove: one lamp, one point.
 */
#ifndef BRUME_SCATTER_SEGMENT_H
#define BRUME_SCATTER_SEGMENT_H

#include "beam_integral.h"
#include "heuristic.h"
#include "scatter_emitter.h"
#include "scatter_plan.h"
#include "scatter_point.h"
#include "visibility.h"

/* On a camera ray, towards a directional lamp: what more of them gain they cost (measured by make ladder). */
#define PARALLEL_POSITIONS 2

#define STRATEGY_HAS_RASTER (STRATEGY == STRATEGY_AUTO || STRATEGY == STRATEGY_RASTER)

/* Points of a lamp that nothing hides, where beam_integral doesn't suffice. */
#define OPEN_POSITIONS 32

/* Lanes to whose segment nothing hides the lamp. */
FN mask wedge_open(const scene *s, const lanes_of_real *rows, mask live) {
    lanes_of_ireal in, open;
    in.all = live;
    open.all = I(0);
    for (int k = 0; k < LANES; k++) {
        if (!in.one[k]) continue;
        wedge w = wedge_between_ends(wedge_take(rows, k));
        open.one[k] = w.t1 > w.t0 ? wedge_is_empty(&s->geometry, &w) : 0;
    }
    return open.all != I(0);
}

/* On a segment, where some are primary. */
FN int scatter_positions(const scene *s, mask primary) {
    return STRATEGY == STRATEGY_PRODUCT || !ANY(primary) ? 1 : s->params->positions;
}

/* All that a lamp scatters to the eye along its lit interval i, over the lamp's intensity. plan: the lamp's row, or
 * NULL. */
FN rgb scatter_interval(const scene *s, const lamp *l, const segment *at, const beam *g, beam_interval i, real u,
                        __global uchar *plan, mask live) {
    lanes_of_real rows[16], t[WEDGE_POSITIONS];
    real share[WEDGE_POSITIONS], density[WEDGE_POSITIONS];
    rgb sum = cgrey(R(0));
    mask open = FALSE_MASK, planar = FALSE_MASK, rest = live;
    /* A walk of the plane sees occluders only: not through null surfaces, and no media beyond them. */
    int nulls = HAS(NULL) && s->params->has_null;
    mask several = several_points(l, at, g);
    /* With null surfaces there was no pilot, and the plan has no memory to be read from (needs_pilot in lib/render.c).
     */
    int planned = STRATEGY == STRATEGY_AUTO && plan && !nulls;
    ireal way = planned ? plan_read(s, plan) : I(PLAN_UNKNOWN);
    mask controlled = FALSE_MASK;
    if (!nulls) {
        planar = live & several & spans_plane(s, g);
        mask smooth = planar & (l->light < I(0)) & !l->met, tried = planar & (way == I(PLAN_INTEGRAL)) & smooth;
        mask now = tried;
        /* First what the plan says is open; then what a walk finds open: where there was no plan, or no exact integral.
         */
        for (int round = 0; round < 2; round++) {
            if (ANY(now)) {
                integral all = beam_integral(g, l, i, &at->m);
                now = now & all.exact;
                sum = cselect(now, cscale(all.value, R(1) / g->D), sum);
                controlled = round == 0 ? now : controlled;
                rest = round == 0 ? rest : rest & !now;
            }
            mask surveyed = planar & !controlled & (tried | (way == I(PLAN_UNKNOWN)));
            if (round > 0 || !ANY(surveyed)) break;
            wedge_store(s, l, g, at->d, i, rows);
            open = wedge_open(s, rows, surveyed);
            now = open & smooth & !tried;
        }
    }
    if (!ANY(rest)) return sum;

    real sigma = grey_extinction(&at->m);
    int most = scatter_positions(s, rest & several);
    ireal count = several ? I(most) : I(1);
    /* A pixel that is chosen for its error has an edge in it that the pilot's ray missed. */
    mask dark_by_plan = way == I(PLAN_ONE);
    mask plain = s->is_chosen ? controlled : controlled | dark_by_plan; /* equiangular: a table would not pay */
    if (STRATEGY == STRATEGY_AUTO) {
        mask rayed = (way == I(PLAN_RAYS_2)) | (way == I(PLAN_RAYS_4)) | (way == I(PLAN_RAYS_8));
        /* Measured by make ladder. Where dark_by_plan counts, it is of a chosen pixel. */
        ireal rays = rayed ? I(1) << (way - I(PLAN_RAYS_2 - 1)) : (l->met | dark_by_plan) ? I(4) : I(2);
        count = (several & (way != I(PLAN_RASTER)) & (rays < count)) ? rays : count;
    }
    count = plain ? I(1) : count;
    if (ANY(rest & open) && most < OPEN_POSITIONS) { /* no rays: they cost little */
        most = OPEN_POSITIONS;
        count = open ? I(most) : count;
    }
    piecewise table;
    int shaped = ANY(rest & !plain);
    if (shaped) table = beam_table_of(g, l, i, sigma, at->m.g);
    while (most > 1 && !ANY(rest & (count > I(most / 2)))) most /= 2;
    real per_count = R(1) / to_real(count);
    for (int j = 0; j < most; j++) {
        share[j] = (R(j) + u) * per_count;
        density[j] = R(1);
        if (shaped) {
            real warped = piecewise_warp(&table, share[j], &density[j]);
            share[j] = plain ? share[j] : warped;
            density[j] = plain ? R(1) : density[j];
        }
        t[j].all = beam_equiangular(g, i, share[j]);
    }
    lanes_of_u32 low, high;
    low.all = high.all = U32(0);
    mask rasters = FALSE_MASK;
    if (STRATEGY_HAS_RASTER) {
        int wanted = STRATEGY == STRATEGY_RASTER;
        rasters = rest & planar & !open & (wanted ? TRUE_MASK : way == I(PLAN_RASTER));
        if (!wanted && ANY(rasters)) wedge_store(s, l, g, at->d, i, rows);
        if (ANY(rasters)) wedge_rasterize(s, rows, t, count, rasters, &low, &high);
    }
    real angle = SCATTERS_EMITTERS && ANY(l->met) ? beam_whole(g, at->t_end).width : R(0);
    int chromatic = HAS(CHROMATIC) ? ANY(rest & !medium_is_grey(&at->m)) : 0;
    for (int j = 0; j < most; j++) {
        mask dark = to_ireal(((j < 32 ? low.all >> U32(j) : high.all >> U32(j - 32))) & U32(1)) != I(0);
        mask lit = rest & (I(j) < count) & !dark;
        if (!ANY(lit)) continue;
        beam_point p;
        p.t = t[j].all;
        p.distance = sqrt(fma(p.t, p.t, square(g->D)));
        p.x = fma(share[j], i.width, i.x0);
        vec wi = beam_wi(g, at->d, p);
        real along = lclamp(p.t + g->delta, R(0), at->t_end);
        rgb seen;
        mask rays = lit & !rasters & !open;
        if (nulls) {
            seen = visibility(s, vmad(at->d, along, at->o), wi, p.distance * SHORT_OF_LIGHT, at->inside, lit);
            seen = cmul(seen, medium_transmittance(at->m.sigma_t, along));
        } else {
            if (ANY(rays)) {
                mask hidden = occluded(&s->geometry, vmad(at->d, along, at->o), wi, R(0), p.distance * SHORT_OF_LIGHT,
                                       rays);
                /* Where all has been counted already, what is hidden is taken off again. */
                lit = (lit & hidden & controlled) | (lit & !hidden & !controlled);
                if (!ANY(lit)) continue;
            }
            real way = along + p.distance;
            seen = chromatic ? medium_transmittance(at->m.sigma_t, way) : cgrey(lexp(-at->m.sigma_t.r * way));
        }
        real f = beam_response(g, l, p, at->m.g);
        real weight = R(1);
        if (SCATTERS_EMITTERS && ANY(l->met)) {
            real by_light = l->density * g->D;
            real by_path = medium_flight_density(&at->m, at->throughput, along) * f * angle;
            weight = l->met ? by_light / lmax(by_light + by_path, R(1e-37)) : R(1);
        }
        if (INDIRECT_IS_RAYS) {
            mask shared = (at->pdf >= R(0)) & !l->met;
            weight = shared ? shared_with_rays(at->pdf, p.distance, l->rays, along + at->before) : weight;
        }
        f = f * weight * i.width / (g->D * density[j]) * per_count;
        f = controlled ? -f : f;
        rgb value = cscale(seen, f);
        if (HAS(TEXTURES) && ANY(l->light >= I(0))) value = cmul(value, lamp_gobo(s, l, vneg(wi)));
        sum = cselect(lit, cadd(sum, value), sum);
    }
    return sum;
}

/* The same for directional light, over its irradiance. */
FN rgb scatter_parallel(const scene *s, const lamp *l, const segment *at, real u, mask live) {
    int most = scatter_positions(s, live & at->primary);
    mask several = at->primary;
    if (STRATEGY == STRATEGY_AUTO) {
        most = most < PARALLEL_POSITIONS ? most : PARALLEL_POSITIONS;
        several = several & !l->met; /* which part of the sky it is, is noise that more points don't remove */
        if (!ANY(live & several)) most = 1;
    }
    ireal count = several ? I(most) : I(1);
    real sigma = grey_extinction(&at->m), per_count = R(1) / to_real(count);
    real phase = phase_hg(l->axis, vneg(at->d), at->m.g);
    rgb sum = cgrey(R(0));
    for (int j = 0; j < most; j++) {
        real along = transmittance_quantile(sigma, at->t_end, (R(j) + u) * per_count);
        real weight = transmittance_integral(sigma, at->t_end) / lexp(-sigma * along);
        mask lit = live & (I(j) < count) & (weight < R(1e30));
        if (!ANY(lit)) continue;
        if (SCATTERS_EMITTERS && ANY(l->met)) {
            real by_light = l->density / weight;
            real by_path = medium_flight_density(&at->m, at->throughput, along) * phase;
            weight = l->met ? weight * (by_light / lmax(by_light + by_path, R(1e-37))) : weight;
        }
        rgb seen = visibility(s, vmad(at->d, along, at->o), vneg(l->axis), FAR_AWAY, at->inside, lit);
        rgb value = cmul(seen, medium_transmittance(at->m.sigma_t, along));
        sum = cselect(lit, cadd(sum, cscale(value, phase * weight * per_count)), sum);
    }
    return sum;
}

/* What lamps and emitters scatter to the eye along the segment. u: lamp, technique, position; in [0, 1). `by_lamps`,
 * `by_emitters`: which lanes ask for what. */
FN rgb scatter_gather(const scene *s, const segment *at, real u_light, real u_technique, real u_position,
                      random4 u_emitter, mask by_lamps, mask by_emitters) {
    int count = s->params->light_count;
    if (!STRATEGY_IS_PRODUCT) {
        if (count == 0) return cgrey(R(0));
        in_scatter g = scatter_along(s, at->o, at->d, at->t_end, &at->m, u_light, u_technique, u_position, by_lamps);
        mask some = by_lamps & g.some;
        if (!ANY(some)) return cgrey(R(0));
        rgb seen = visibility(s, vmad(at->d, g.t, at->o), g.wi, g.distance * SHORT_OF_LIGHT, at->inside, some);
        if (INDIRECT_IS_RAYS) {
            real weight = shared_with_rays(at->pdf, g.distance, g.rays, g.t + at->before);
            seen = cscale(seen, at->pdf >= R(0) ? weight : R(1));
        }
        return cselect(some, cmul(g.value, seen), cgrey(R(0)));
    }
    mask every = STRATEGY != STRATEGY_PRODUCT && count <= EVERY_LAMP ? at->primary : FALSE_MASK;
    real share = R(1);
    ireal choice = I(0);
    int rounds = 0;
    if (HAS(DELTA_LIGHTS) && count > 0 && ANY(by_lamps)) {
        mask chooses = by_lamps & !every;
        if (ANY(chooses))
            choice = lamp_choose_for_segment(s, at->o, at->d, at->t_end, &at->m, u_light, chooses, &share);
        rounds = ANY(by_lamps & every) ? count : 1;
    }
    int emitters = SCATTERS_EMITTERS && ANY(by_emitters);
    rgb sum = cgrey(R(0));
    for (int k = 0; k < rounds + emitters; k++) {
        mask wants = by_emitters;
        lamp l;
        real scale = R(1);
        __global uchar *plan = NULL;
        if (k < rounds) {
            ireal which = every ? I(k) : choice;
            wants = by_lamps & (which >= I(0)) & (every | (I(k) == I(0)));
            if (!ANY(wants)) continue;
            l = lamp_gather(s, wants ? which : I(0));
            scale = every ? R(1) : R(1) / share;
            if (INDIRECT_IS_RAYS && ANY(at->pdf >= R(0))) l.rays = lamp_rays(s, wants ? which : I(0));
            if (s->plan && count <= EVERY_LAMP) plan = s->plan + s->plan_stride * (size_t)k;
        } else {
            l = emitter_lamp(s, at->o, at->d, at->t_end, u_emitter, wants);
        }
        rgb value = cgrey(R(0));
        mask parallel = wants & l.directional;
        if (ANY(parallel) && !s->is_pilot) value = scatter_parallel(s, &l, at, u_position, parallel);
        if (ANY(wants & !l.directional)) {
            beam g = beam_of(&l, at->o, at->d, at->t_end);
            for (int part = 0; part < 2; part++) {
                beam_interval i = part ? g.b : g.a;
                mask lit = wants & !l.directional & (i.width > R(0));
                if (!ANY(lit)) continue;
                if (STRATEGY == STRATEGY_AUTO && s->is_pilot) {
                    if (plan && !part) plan_interval(s, &l, at, &g, i, u_position, plan, lit);
                    continue;
                }
                value = cadd(value, scatter_interval(s, &l, at, &g, i, u_position, part ? NULL : plan, lit));
            }
        }
        sum = cselect(wants, cadd(sum, cscale(cmul(value, l.intensity), scale)), sum);
    }
    return cmul(sum, cmul(at->m.sigma_t, at->m.albedo));
}

#endif

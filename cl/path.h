/* path.h -- one path per lane, one segment at a time.
 *
 * On each segment: what the medium emits, and what lamps without extent scatter towards the eye there, both as
 * integrals over the whole segment (path_medium.h); then the path either scatters in the medium or reaches the
 * segment's end. At a surface: its emission; at a surface or a scattering event: light sampling (path_light.h), and
 * the next direction.
 *
 * Depth counts scattering events; a path that has scattered k times and then meets a light has k + 1 edges and counts
 * while k + 1 <= max_depth. Null surfaces don't count.
 */
#ifndef BRUME_PATH_H
#define BRUME_PATH_H

#include "film.h"
#include "path_bounce.h"
#include "path_medium.h"
#include "trace.h"

/* A path that has crossed so many surfaces ends; with roulette only stacked null boundaries get there. */
#define MAX_SEGMENTS 4096

/* Survival in roulette is at most this, so that closed scenes of albedo 1 end too. Not less: each event multiplies the
 * weight by its inverse, and at 0.95 the variance of a thick white medium of hundreds of events is unbounded. */
#define MAX_SURVIVAL R(0.995)

/* Else light is found by chance alone. */
#define PATH_SAMPLES_LIGHT \
    ((HAS(DELTA_LIGHTS) || HAS(AREA_LIGHTS) || HAS(ENVIRONMENT)) ? STRATEGY != STRATEGY_SPHERICAL : 0)

/* Light from beyond the scene, for lanes that left it. */
FN void path_leave(const scene *s, path *p, mask left) {
    mask sees = left & !((p->depth == I(0)) & (I(s->params->hide_emitters) != I(0)));
    if (HAS(ENVIRONMENT) && s->params->environment != ENVIRONMENT_NONE && ANY(sees)) {
        real pdf = environment_pdf(s, p->d) * environment_share(s);
        p->met = p->met | sees;
        real weight = met_weight(p, pdf);
        if (SCATTERS_EMITTERS && ANY(sees & p->from_medium)) {
            real flown = environment_met_weight(s, &p->flew, p->d);
            weight = p->from_medium ? flown : weight;
        }
        path_add(p, sees, cscale(environment_radiance(s, p->d), weight), FALSE_MASK, 0);
    }
    p->alive = p->alive & !left;
}

/* Emission of a surface that the path met. */
FN void path_meet(const scene *s, path *p, const surface *at, ireal prim, mask met) {
    mask hidden = (p->depth == I(0)) & (I(s->params->hide_emitters) != I(0));
    mask emits = met & !hidden & (GATHER_INT(s->shapes, emits, at->shape) != I(0)) & (vdot(at->ng, p->d) < R(0));
    if (!HAS(AREA_LIGHTS) || !ANY(emits)) return;
    real pdf = emitter_pdf(s, p->from, prim, at->shape, at->p, at->ng, emits);
    real weight = met_weight(p, pdf);
    if (SCATTERS_EMITTERS && ANY(emits & p->from_medium)) {
        real flown = emitter_met_weight(s, &p->flew, p->from, p->d, prim, at->shape, at->p, at->ng, emits);
        weight = p->from_medium ? flown : weight;
    }
    path_add(p, emits, cscale(CGATHER(s->shapes, radiance, at->shape), weight), FALSE_MASK, 0);
}

/* Russian roulette on what the path can still carry. Where it survives as seldom as its throughput says, the first to
 * play, at depth 5 of a grey room, is one in 32 and carries 32 times as much: without fog a quarter of the noise is of
 * that, and letting more of them live (arrays.c) costs less. In fog, where segments cost more than they find, it doesn't
 * pay. */
FN void path_roulette(const scene *s, path *p, real u, mask live) {
    mask plays = live & (p->depth >= I(s->params->rr_depth));
    real survival = lmin(cmax(p->throughput) * square(p->eta) * R(s->params->survival), MAX_SURVIVAL);
    mask ends = plays & (u >= survival);
    p->throughput = cselect(plays & !ends, cscale(p->throughput, R(1) / lmax(survival, R(1e-30))), p->throughput);
    p->alive = p->alive & !ends;
}

/* The film's first-hit channels: found at the first surface that is neither null nor specular, whether or not the fog
 * scatters before it: the guides of a denoiser should have no noise of their own. The film gets them with the sample,
 * or not at all if that is dropped. */
FN void path_guides(path *p, const surface *at, real t, rgb albedo, mask plain, mask ends) {
    mask record = p->first & plain;
    if (ANY(record)) {
        vec n = vselect(vdot(at->ns, p->d) > R(0), vneg(at->ns), at->ns);
        mask broken = is_bad(albedo.r) | is_bad(albedo.g) | is_bad(albedo.b) | is_bad(n.x) | is_bad(n.y) | is_bad(n.z) |
                      is_bad(p->travelled + t);
        path_break(p, record & broken);
        first_hit found;
        found.albedo = albedo;
        found.n = n;
        found.depth = p->travelled + t;
        found.hit = TRUE_MASK;
        p->guide = first_hit_select(record & !broken, found, p->guide);
    }
    p->first = p->first & !plain & !ends;
}

/* How often INDIRECT_MIXTURE turns towards a lamp. */
#define LAMPWARD R(0.35)

/* Instead of the phase function's direction `turned`, sometimes one about a lamp, evenly in the angle psi to it:
 * density 1 / (2 pi^2 sin psi). Which lamp is chosen first; then the two densities mix. Returns the direction, its
 * density and, in `weight`, the phase function over it. */
FN vec path_turn_to_lamp(const scene *s, const path *p, const vertex *v, vec turned, real u_choice, real u, real v_turn,
                         real *density, rgb *weight) {
    real share;
    mask aims = split(&u_choice, LAMPWARD);
    ireal k = lamp_choose_for_point(s, v->p, v->p, R(1), TRUE_MASK, u_choice, v->in_medium, &share);
    mask some = v->in_medium & (k >= I(0));
    lamp l = lamp_gather(s, some ? k : I(0));
    vec axis = lamp_at(s, &l, v->p).wi, t, b;
    real sp, cp, ss, cs;
    orthonormal_basis(axis, &t, &b);
    lsincos_turns(v_turn, &sp, &cp);
    lsincos(u * R(PI), &ss, &cs);
    vec d = vselect(some & aims, vmad(t, ss * cp, vmad(b, ss * sp, vscale(axis, cs))), turned);
    vec across = vcross(axis, d);
    real phase = phase_hg(p->d, d, v->g), about = R(1 / (2 * PI * PI)) / lmax(vlength(across), R(1e-9));
    real mixed = some ? fma(LAMPWARD, about, (R(1) - LAMPWARD) * phase) : phase;
    *density = mixed;
    *weight = cselect(v->in_medium, cgrey(phase / mixed), *weight);
    return vnormalize(d);
}

/* The next direction: a surface's BSDF, the medium's phase function, or straight on through a null surface. Everyone
 * else ends. */
FN void path_turn(const scene *s, path *p, const vertex *v, real t, mask through) {
    /* The last surface lights nothing further unless a ray from it can meet light; see path_medium. */
    ireal needed = p->depth + I(s->params->surfaces_emit ? 2 : 3), segment = p->segments;
    mask at_surface = v->at_surface & (needed <= I(s->params->max_depth));
    mask turns = at_surface | v->in_medium;
    p->segments = segment + I(1);
    p->alive = p->alive & (turns | through);
    if (!ANY(p->alive)) return;
    random4 u = random_set(&p->random, random_bounce_set(segment, SET_SURFACE));
    vec d = p->d;
    real pdf = R(-1);
    rgb weight = cgrey(R(1));
    if (ANY(at_surface)) {
        bsdf_sampled b = bsdf_sample(&v->b, v->wo, unit(u.x), unit(u.y), unit(u.z));
        d = vselect(at_surface, to_world(&v->frame, b.wi), d);
        weight = cselect(at_surface, b.weight, weight);
        mask spread = at_surface & !b.is_delta & (STRATEGY == STRATEGY_SPHERICAL ? FALSE_MASK : TRUE_MASK);
        pdf = spread ? b.pdf : pdf;
        p->eta = at_surface ? p->eta * b.eta : p->eta;
    }
    if (FLIES && ANY(v->in_medium)) {
        real phase;
        vec turned = phase_hg_sample(p->d, v->g, unit(u.y), unit(u.z), &phase);
        if (HAS(DELTA_LIGHTS) ? INDIRECT == INDIRECT_MIXTURE : 0)
            turned = path_turn_to_lamp(s, p, v, turned, unit(u.x), unit(u.y), unit(u.z), &phase, &weight);
        if (STRATEGY == STRATEGY_SPHERICAL) {
            turned = warp_sphere(unit(u.y), unit(u.z));
            weight = cselect(v->in_medium, cgrey(phase_hg(p->d, turned, v->g) * R(4 * PI)), weight);
            phase = R(-1); /* nothing competes */
        }
        d = vselect(v->in_medium, turned, d);
        pdf = v->in_medium ? phase : pdf;
    }
    mask on_surface = at_surface | through;
    if (HAS(LIGHT_LAYERS))
        light_layers_turn(&p->layers, turns, HAS(SPECULAR) ? at_surface & bsdf_is_specular(&v->b) : FALSE_MASK,
                          v->in_medium);
    p->throughput = cselect(turns, cmul(p->throughput, weight), p->throughput);
    p->t_max = through ? p->t_max - t : FAR_AWAY;
    p->travelled = p->travelled + t;
    p->o = vselect(on_surface, offset_origin(v->p, v->ng, d), v->p);
    p->own = v->own;
    p->d = d;
    p->from = vselect(turns, v->p, p->from);
    p->pdf = turns ? pdf : p->pdf;
    p->depth = turns ? p->depth + I(1) : p->depth;
    p->from_medium = turns ? v->in_medium : p->from_medium;
    p->alive = p->alive & !is_black(p->throughput) & (p->segments < I(MAX_SEGMENTS)) & (p->t_max > R(0));
    if (HAS(MEDIA)) p->medium = on_surface ? medium_beyond(s, v->shape, v->ng, d, p->medium) : p->medium;
    path_roulette(s, p, unit(u.w), turns & p->alive);
    /* One more edge, for light that it meets. */
    if (FLIES && s->params->single_scattering) p->depth = v->in_medium ? I(s->params->max_depth - 1) : p->depth;
}

/* One segment for every living lane. */
FN void path_step(const scene *s, path *p) {
    ireal max_depth = I(s->params->max_depth);
    mask looking = p->alive & p->first;
    if (HAS(LIGHT_LAYERS)) p->layers.segments = p->alive ? p->layers.segments + R(1) : p->layers.segments;
    hit h = closest_from(&s->geometry, p->o, p->d, R(0), p->t_max, p->own, p->alive);
    mask met = h.prim >= I(0);
    real t = h.t;
    trace_segment(s, p);

    medium m = medium_none();
    mask scatters = FALSE_MASK;
    if (HAS(MEDIA) && ANY(p->alive & (p->medium >= I(0)))) {
        m = medium_of(s, p->medium);
        scatters = path_medium(s, p, &m, &t);
    }
    if (s->is_pilot) return; /* the plan is made */
    trace_radiance(s, p, TRACE_ALONG);
    mask left = p->alive & !scatters & !met;
    if (ANY(left)) path_leave(s, p, left);
    trace_radiance(s, p, TRACE_MET);
    trace_place(s, p, vmad(p->d, t, p->o), t, left ? TRACE_ESCAPED : TRACE_ABSORBED, -1);

    mask reached = p->alive & !scatters & met;
    mask looked_at = HAS(GUIDES) ? reached | (looking & met) : reached;
    if (!ANY(looked_at | scatters)) return;

    vertex v;
    surface at = surface_of(s, p->o, p->d, h, looked_at);
    v.frame = shading_frame_of(at.ns, at.tangent);
    v.wo = to_local(&v.frame, vneg(p->d));
    v.b = bsdf_of(s, GATHER_INT(s->shapes, bsdf, at.shape), v.wo, at.u, at.v, looked_at);
    v.p = vselect(scatters, vmad(p->d, t, p->o), at.p);
    v.ng = at.ng;
    v.own = scatters ? I(-1) : h.prim;
    v.shape = at.shape;
    v.g = m.g;
    mask null = HAS(NULL) ? v.b.kind == I(BSDF_NULL) : FALSE_MASK;
    if (HAS(AREA_LIGHTS) && s->params->hide_emitters) /* camera rays go through them, as in Mitsuba 3 */
        null = null | ((p->depth == I(0)) & (GATHER_INT(s->shapes, emits, at.shape) != I(0)));
    mask specular = HAS(SPECULAR) ? bsdf_is_specular(&v.b) : FALSE_MASK;

    p->met = p->met | scatters | (reached & !null);
    if (HAS(GUIDES) && !s->is_pilot)
        path_guides(p, &at, h.t, bsdf_albedo(&v.b), looked_at & !null & !specular, scatters);
    if (ANY(reached)) path_meet(s, p, &at, h.prim, reached);
    trace_radiance(s, p, TRACE_MET);

    v.at_surface = reached & !null & (p->depth + I(2) <= max_depth);
    v.in_medium = scatters;
    mask lit = v.at_surface & !specular;
    mask counted = FALSE_MASK;
    if (RAYS_ALONE(s)) counted = p->from_medium & (v.b.kind == I(BSDF_DIFFUSE));
    if (STRATEGY == STRATEGY_DISTANCE) lit = lit | (v.in_medium & (p->depth + I(2) <= max_depth));
    if (PATH_SAMPLES_LIGHT) {
        mask by_lamps = HAS(DELTA_LIGHTS) && s->params->light_count > 0 ? lit & !counted : FALSE_MASK;
        mask by_emitters = FALSE_MASK;
        if (HAS(AREA_LIGHTS) || HAS(ENVIRONMENT)) by_emitters = SCATTERS_EMITTERS ? lit : lit | v.in_medium;
        int lamps = ANY(by_lamps), emitters = ANY(by_emitters);
        random4 u = random_none();
        if (emitters || (lamps && s->params->light_count > 1))
            u = random_set(&p->random, random_bounce_set(p->segments, SET_LIGHT));
        if (HAS(DELTA_LIGHTS) && lamps) path_sample_lamps(s, p, &v, unit(u.w), by_lamps);
        if (INDIRECT_IS_RAYS) {
            mask bounces = lit & (p->depth + I(3) <= max_depth);
            if (ANY(bounces)) path_sample_bounce(s, p, &v, bounces);
        }
        if ((HAS(AREA_LIGHTS) || HAS(ENVIRONMENT)) && emitters) path_sample_emitters(s, p, &v, u, by_emitters);
    }
    trace_radiance(s, p, TRACE_LIT);
    trace_place(s, p, v.p, t, scatters ? TRACE_SCATTERED : null ? TRACE_PASSED : TRACE_SURFACE,
                scatters ? -1 : at.shape);
    path_turn(s, p, &v, t, reached & null);
    trace_turn(s, p);
}

#endif

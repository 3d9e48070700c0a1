/* path_light.h -- light sampling where a path scatters: lamps without extent, emitters, environment.
 *
 * Lamps are sampled here at surfaces only: what they scatter in a medium has been gathered along the whole segment
 * already (path_medium.h); but with STRATEGY_DISTANCE here, too. Emitters and the environment can also be met by the
 * path itself, so that light sampling and path share the work by the power heuristic (Veach 1997).
 */
#ifndef BRUME_PATH_LIGHT_H
#define BRUME_PATH_LIGHT_H

#include "bsdf.h"
#include "emitter.h"
#include "heuristic.h"
#include "light_choice.h"
#include "path_state.h"
#include "phase_hg.h"
#include "reservoir.h"
#include "visibility.h"

/* Where a path scatters: at a surface (frame, bsdf, wo) or in the medium (phase function). */
typedef struct {
    vec p;             /* what leaves a surface starts at an offset from it, see vertex_origin */
    vec ng;
    ireal own;         /* the triangle or quadric that it lies on, -1 in a medium */
    ireal shape;
    shading_frame frame;
    bsdf b;
    vec wo;            /* local, towards where the path came from */
    real g;
    mask at_surface, in_medium;
} vertex;

/* The medium that a ray towards wi runs through first. */
FN ireal vertex_medium(const scene *s, const path *p, const vertex *v, vec wi) {
    if (!HAS(MEDIA) || !ANY(v->at_surface)) return p->medium;
    return v->at_surface ? medium_beyond(s, v->shape, v->ng, wi, p->medium) : p->medium;
}

/* Where a ray towards wi starts. */
FN vec vertex_origin(const vertex *v, vec wi) { return vselect(v->at_surface, offset_origin(v->p, v->ng, wi), v->p); }

/* Weight of lamp k at a diffuse surface that the path has come to from another, or from a medium: where rays of light
 * find that, too (path_bounce.h, path_indirect.h). */
FN real lamp_weight_after_surface(const scene *s, const path *p, const vertex *v, const lamp *l, ireal k,
                                  lamp_arrival a) {
    mask shared = (v->b.kind == I(BSDF_DIFFUSE)) & (p->depth > I(0)) & (p->pdf >= R(0));
    if (RAYS_ALONE(s)) shared = shared & !p->from_medium;
    if (!ANY(shared)) return R(1);
    vec way = vsub(v->p, p->from);
    real pdf = RAYS_SHARE(s) ? path_density(p) : p->pdf;
    real by_path = pdf * fabs(vdot(v->ng, p->d)) / lmax(vdot(way, way), R(1e-36));
    real by_light = light_ray_density(s, l, k, a.wi, a.distance, v->ng);
    return shared ? power_heuristic(by_path, by_light) : R(1);
}

FN void path_sample_lamps(const scene *s, path *p, const vertex *v, real u_light, mask live) {
    real share = R(1);
    ireal choice = I(0);
    if (s->params->light_count > 1)
        choice = lamp_choose_for_point(s, v->p, v->frame.n, v->wo.z, v->in_medium, u_light, live, &share);
    live = live & (choice >= I(0));
    if (!ANY(live)) return;
    lamp l = lamp_gather(s, live ? choice : I(0));
    lamp_arrival a = lamp_at(s, &l, v->p);
    rgb f = bsdf_eval(&v->b, v->wo, to_local(&v->frame, a.wi)).f;
    if (STRATEGY == STRATEGY_DISTANCE && FLIES) f = cselect(v->in_medium, cgrey(phase_hg(p->d, a.wi, v->g)), f);
    rgb value = cscale(cmul(f, a.irradiance), R(1) / lmax(share, R(1e-30)));
    if (INDIRECT_IS_RAYS)
        value = cscale(value, lamp_weight_after_surface(s, p, v, &l, live ? choice : I(0), a));
    live = live & !is_black(value);
    if (!ANY(live)) return;
    rgb seen = visibility_from(s, vertex_origin(v, a.wi), a.wi, a.distance * SHORT_OF_LIGHT,
                               vertex_medium(s, p, v, a.wi), v->own, live);
    path_add(p, live, cmul(value, seen), v->in_medium, 1);
}

FN void path_sample_emitters(const scene *s, path *p, const vertex *v, random4 u, mask live) {
    emitted_light e = emitter_sample(s, v->p, unit(u.x), unit(u.y), unit(u.z), live);
    live = live & !is_black(e.radiance) & (e.pdf > R(0));
    if (!ANY(live)) return;
    rgb f = cgrey(R(0));
    real pdf = R(0);
    if (ANY(live & v->at_surface)) {
        bsdf_value value = bsdf_eval(&v->b, v->wo, to_local(&v->frame, e.wi));
        f = value.f;
        pdf = value.pdf;
    }
    if (FLIES && ANY(live & v->in_medium)) {
        real phase = phase_hg(p->d, e.wi, v->g);
        f = cselect(v->in_medium, cgrey(phase), f);
        pdf = v->in_medium ? phase : pdf;
    }
    live = live & !is_black(f);
    if (!ANY(live)) return;
    rgb value = cscale(cmul(f, e.radiance), power_heuristic(e.pdf, pdf) / e.pdf);
    /* Aimed anew from where the ray starts: its offset, which grows with the distance from the world's origin, can
     * carry the old direction's end through an emitter close to that origin, whose own offset is smaller. */
    vec origin = vertex_origin(v, e.wi), to = vsub(e.target, origin);
    real length = lmax(vlength(to), R(1e-18));
    mask far = e.distance >= FAR_AWAY;
    vec d = vselect(far, e.wi, vscale(to, R(1) / length));
    real reach = far ? FAR_AWAY : length * SHORT_OF_LIGHT;
    rgb seen = visibility_from(s, origin, d, reach, vertex_medium(s, p, v, d), v->own, live);
    path_add(p, live, cmul(value, seen), v->in_medium, 1);
}

/* Weight of light that the path itself met, which light sampling from the last scattering event could have found with
 * this density. */
FN real met_weight(const path *p, real light_pdf) {
    return p->pdf < R(0) ? R(1) : power_heuristic(p->pdf, light_pdf);
}

#endif

/* path_bounce.h -- light that comes to a surface by way of one more scattering event: the path's vertex there is connected
 * to its ray of light (light_ray.h), at a point of it or where it ends on a diffuse surface. One of the two, in
 * proportion to what they would give if nothing stood between.
 *
 * A spot lights a small part of a room, which then lights the rest, and next to a lamp fog is bright without bound: by
 * chance a path seldom meets either. The path that does counts the same light, by the lamp's light sampled at the other
 * surface (path_light.h) or gathered along the segment (scatter_segment.h); it shares the work by the power heuristic,
 * as in bidirectional path tracing (Veach 1997, ch. 10; in media: Krivanek et al. 2014, "Unifying points, beams, and
 * paths in volumetric light transport simulation"). Densities are rough where that makes them cheap: of the lamp the
 * path is taken to choose the right one. Any weights that add up to one are right.
 */
#ifndef BRUME_PATH_BOUNCE_H
#define BRUME_PATH_BOUNCE_H

#include "path_indirect.h"
#include "path_light.h"

/* To a point of the ray of light on the vertex's side. What stands between apart. */
FN connection bounce_off_ray(const scene *s, const path *p, const vertex *v, const medium *m, real u, mask live) {
    const light_ray *r = &p->light;
    connection out;
    vec to_x = vsub(v->p, r->o);
    real begin = light_ray_begin(s, r), length = light_ray_reach(s, r, m);
    /* Where the ray of light goes through the plane of the surface. */
    real side = v->wo.z < R(0) ? R(-1) : R(1), above = -side * vdot(v->frame.n, to_x);
    real rises = side * vdot(v->frame.n, r->d), crosses = -above / (fabs(rises) > R(1e-12) ? rises : R(1e-12));
    real s0 = rises > R(0) ? lclamp(crosses, begin, length) : begin;
    real s1 = rises > R(0) ? length : lclamp(crosses, begin, length);
    real along = vdot(to_x, r->d);
    vec across = vmad(r->d, -along, to_x);
    real D = lmax(vlength(across), R(0x1p-18f) * (vlength(to_x) + R(1e-18)));
    equiangular_range range = equiangular_range_of(D, s0 - along, s1 - along);
    real at = lclamp(along + equiangular_sample(&range, u), s0, s1);
    out.y = vmad(r->d, at, r->o);
    vec y_to_x = vsub(v->p, out.y);
    out.distance = lmax(vlength(y_to_x), D);
    out.wi = vscale(y_to_x, R(-1) / out.distance);
    bsdf_value f = bsdf_eval(&v->b, v->wo, to_local(&v->frame, out.wi));
    real weight = shared_with_rays(r->rays, out.distance, lmax(f.pdf, R(0)), at);
    rgb through;
    out.inside = I(-1);
    medium fog = light_ray_at(s, r, m, at, R(0), &out.inside, &through, live);
    out.value = cmul(cmul(f.f, r->flux), cmul(cmul(fog.sigma_t, fog.albedo), through));
    out.value = cscale(out.value, weight * phase_hg(r->d, vneg(out.wi), fog.g) * lmax(range.width, R(0)) / D);
    return out;
}

/* To the surface at its end. */
FN connection bounce_off_end(const scene *s, const path *p, const vertex *v, const medium *m) {
    const light_ray *r = &p->light;
    connection out;
    vec to = vsub(r->end, v->p);
    out.y = r->end;
    out.distance = lmax(vlength(to), R(1e-18));
    out.wi = vscale(to, R(1) / out.distance);
    mask faces = vdot(r->ns, out.wi) < R(0);
    real cosine = faces ? fabs(vdot(r->ng, out.wi)) / square(out.distance) : R(0);
    bsdf_value f = bsdf_eval(&v->b, v->wo, to_local(&v->frame, out.wi));
    out.inside = I(-1);
    out.value = cmul(cmul(f.f, r->bounce), light_ray_through(s, r, m, R(0)));
    out.value = cscale(out.value, cosine * power_heuristic(r->density, f.pdf * cosine));
    return out;
}

/* From a surface that isn't specular. */
FN void path_sample_bounce(const scene *s, path *p, const vertex *v, mask live) {
    const light_ray *r = &p->light;
    live = live & r->some;
    if (!ANY(live)) return;
    ireal inside = vertex_medium(s, p, v, vselect(vdot(v->ng, p->d) > R(0), vneg(v->ng), v->ng));
    mask foggy = HAS(MEDIA) ? live & ((RAYS_CROSS(s) ? r->way.fog : inside) >= I(0)) : FALSE_MASK;
    medium m = HAS(MEDIA) ? medium_of(s, live ? inside : I(-1)) : medium_none();
    random4 u = random_set(&p->random, random_bounce_set(p->segments, SET_BOUNCE));
    real choice = unit(u.y), a = R(0), share = R(1);
    connection c = connection_none();
    if (HAS(MEDIA) && ANY(foggy)) {
        c = bounce_off_ray(s, p, v, &m, unit(u.x), foggy);
        c.value = cselect(foggy, c.value, cgrey(R(0)));
        a = luminance(c.value) * connection_transmittance(s, &m, c.distance);
        path_break(p, foggy & is_bad(a));
    }
    mask reflects = live & r->diffuse & !is_black(r->bounce);
    if (ANY(reflects)) {
        connection e = bounce_off_end(s, p, v, &m);
        real b = luminance(e.value) * connection_transmittance(s, &m, e.distance);
        path_break(p, reflects & is_bad(b));
        b = (reflects & (b > R(0))) ? b : R(0);
        share = a / lmax(a + b, R(1e-37));
        mask end = reflects & (choice >= share);
        share = end ? R(1) - share : share;
        share = reflects ? share : R(1);
        c = connection_select(end, e, c);
    }
    live = live & !is_black(c.value) & (share > R(0));
    if (!ANY(live)) return;
    /* Aimed anew from where the ray starts, as at emitters (path_light.h). */
    vec origin = vertex_origin(v, c.wi), to = vsub(c.y, origin);
    real length = lmax(vlength(to), R(1e-18));
    rgb seen = visibility_from(s, origin, vscale(to, R(1) / length), length * SHORT_OF_LIGHT, inside, v->own, live);
    path_add(p, live, cscale(cmul(c.value, seen), R(1) / lmax(share, R(1e-30))), FALSE_MASK, 2);
}

#endif

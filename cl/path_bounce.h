/* path_bounce.h -- light of a lamp that one surface reflects onto another: a path's surface is connected to where its ray
 * of light (light_ray.h) has ended.
 *
 * A spot lights a small part of a room, which then lights the rest; a path that leaves a surface by chance seldom meets
 * that part. The path that does, and samples the lamp there, counts the same light; the two share the work by the power
 * heuristic (bidirectional path tracing's strategy of two vertices from the light: Veach 1997, ch. 10). Both take it
 * that the path, there, chooses the lamp for certain: any weights that add up to one are right.
 */
#ifndef BRUME_PATH_BOUNCE_H
#define BRUME_PATH_BOUNCE_H

#include "path_light.h"

FN void path_sample_bounce(const scene *s, path *p, const vertex *v, mask live) {
    const light_ray *r = &p->light;
    live = live & r->some & r->diffuse & !is_black(r->bounce);
    if (!ANY(live)) return;
    vec to = vsub(r->end, v->p);
    real distance = lmax(vlength(to), R(1e-18));
    vec wi = vscale(to, R(1) / distance);
    mask faces = vdot(r->ns, wi) < R(0);
    real cosine = faces ? fabs(vdot(r->ng, wi)) / square(distance) : R(0);
    bsdf_value f = bsdf_eval(&v->b, v->wo, to_local(&v->frame, wi));
    rgb value = cscale(cmul(f.f, r->bounce), cosine * power_heuristic(r->density, f.pdf * cosine));
    live = live & !is_black(value);
    if (!ANY(live)) return;
    /* From where one ray starts to where the other does: off both surfaces. */
    vec back = vsub(vertex_origin(v, wi), r->end);
    real length = lmax(vlength(back), R(1e-18));
    ireal inside = vertex_medium(s, p, v, wi);
    rgb seen = visibility(s, r->end, vscale(back, R(1) / length), length * SHORT_OF_LIGHT, inside, live);
    if (HAS(MEDIA) && ANY(live & (inside >= I(0)))) {
        medium m = medium_of(s, inside);
        seen = cmul(seen, medium_transmittance(m.sigma_t, r->length));
    }
    path_add(p, live, cmul(value, seen), FALSE_MASK, 2);
}

#endif

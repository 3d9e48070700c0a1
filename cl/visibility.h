/* visibility.h -- how much light comes through between two points: surfaces, null boundaries, media. */
#ifndef BRUME_VISIBILITY_H
#define BRUME_VISIBILITY_H

#include "medium.h"
#include "geometry.h"

/* Null boundaries crossed by one shadow ray; light behind more of them is not seen. */
#define MAX_BOUNDARIES 256

/* The share of the way to a light that a shadow ray looks along: the light may sit on a surface, and be one. */
#define SHORT_OF_LIGHT R(0.999999)

/* The medium on the other side of a surface that a path or shadow ray along d crosses. */
FN ireal medium_beyond(const scene *s, ireal shape, vec ng, vec d, ireal current) {
    mask boundary = (GATHER_INT(s->shapes, flags, shape) & I(SHAPE_BOUNDARY)) != I(0);
    if (!ANY(boundary)) return current;
    mask entering = vdot(ng, d) < R(0);
    ireal inside = GATHER_INT(s->shapes, interior, shape), outside = GATHER_INT(s->shapes, exterior, shape);
    return boundary ? (entering ? inside : outside) : current;
}

/* Transmittance from p along the unit direction d over `distance`, starting in medium *inside and on the triangle `own`
 * (as of closest_from); 0 where occluded. Leaves in *inside the medium at the end of what is not. */
FN rgb visibility_into(const scene *s, vec p, vec d, real distance, ireal *inside, ireal own, mask live) {
    rgb t = cselect(live, cgrey(R(1)), cgrey(R(0)));
    if (!HAS(NULL)) {
        if (HAS(MEDIA) && ANY(live & (*inside >= I(0)))) {
            medium m = medium_of(s, *inside);
            t = cmul(t, medium_transmittance(m.sigma_t, distance));
            live = live & !is_black(t);
        }
        if (ANY(live)) {
            mask dark = occluded_from(&s->geometry, p, d, R(0), distance, own, live);
            t = cselect(live & !dark, t, cgrey(R(0)));
        }
        return t;
    }
    for (int crossed = 0; crossed < MAX_BOUNDARIES && ANY(live); crossed++) {
        hit h = closest_from(&s->geometry, p, d, R(0), distance, own, live);
        mask met = live & (h.prim >= I(0));
        if (HAS(MEDIA) && ANY(live & (*inside >= I(0)))) {
            medium m = medium_of(s, *inside);
            t = cselect(live, cmul(t, medium_transmittance(m.sigma_t, h.t)), t);
        }
        live = met & !is_black(t);
        if (!ANY(met)) break;
        surface at = surface_of(s, p, d, h, met);
        ireal bsdf = GATHER_INT(s->shapes, bsdf, at.shape);
        mask passes = met & (GATHER_INT(s->bsdfs, kind, bsdf) == I(BSDF_NULL));
        t = cselect(met & !passes, cgrey(R(0)), t);
        live = live & passes;
        *inside = live ? medium_beyond(s, at.shape, at.ng, d, *inside) : *inside;
        own = live ? h.prim : own;
        p = vselect(live, offset_origin(at.p, at.ng, d), p);
        distance = live ? distance - h.t : distance;
        live = live & (distance > R(0));
    }
    return cselect(live, cgrey(R(0)), t);
}

FN rgb visibility_from(const scene *s, vec p, vec d, real distance, ireal inside, ireal own, mask live) {
    return visibility_into(s, p, d, distance, &inside, own, live);
}

/* From a point of no surface. */
FN rgb visibility(const scene *s, vec p, vec d, real distance, ireal inside, mask live) {
    return visibility_from(s, p, d, distance, inside, I(-1), live);
}

#endif

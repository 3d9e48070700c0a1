/* light_way.h -- the media that a ray of light runs through.
 *
 * Without null surfaces it is one, from the lamp to the surface where the ray ends, and a point of the ray that a path
 * can see lies in the medium that the path is in. With them the ray remembers where its first two boundaries are and
 * between which points any of its media scatter; beyond the second boundary the way is looked for again.
 */
#ifndef BRUME_LIGHT_WAY_H
#define BRUME_LIGHT_WAY_H

#include "visibility.h"

/* Whether rays of light go on through null surfaces: where the scene has none, all programs compute the same. */
#define RAYS_CROSS(s) (HAS(NULL) ? (s)->params->has_null : 0)

/* Whether paths, too, count what they, having come from a medium, see of a medium or a diffuse surface
 * (path_indirect.h); else rays of light alone do. */
#define RAYS_SHARE(s) (INDIRECT_IS_RAYS ? (s)->params->rays_share : 0)
#define RAYS_ALONE(s) (INDIRECT_IS_RAYS ? !(s)->params->rays_share : 0)

/* Nothing comes through more optical depth than this. */
#define CONNECT_DEPTH R(60)

/* With null surfaces; the media are ids, -1 for none. */
typedef struct {
    real clear;       /* so far from the lamp begin hits: it may sit on a surface */
    ireal first, second; /* the medium up to `crosses`, where the first boundary is, and the one up to `again`, where */
    real crosses, again; /* the second is; FAR_AWAY: there is none */
    real begin, end;  /* what scatters lies between these points */
    ireal fog;        /* the first medium that does */
    ireal last;       /* the medium where the ray ends */
    rgb through;      /* transmittance of all of it */
} light_way;

FN light_way light_way_none(void) {
    light_way w;
    w.first = w.second = w.fog = w.last = I(-1);
    w.crosses = w.again = FAR_AWAY;
    w.clear = w.begin = w.end = R(0);
    w.through = cgrey(R(1));
    return w;
}

FN light_way light_way_select(mask m, light_way a, light_way b) {
    light_way w;
    w.clear = m ? a.clear : b.clear;
    w.first = m ? a.first : b.first;
    w.second = m ? a.second : b.second;
    w.crosses = m ? a.crosses : b.crosses;
    w.again = m ? a.again : b.again;
    w.begin = m ? a.begin : b.begin;
    w.end = m ? a.end : b.end;
    w.fog = m ? a.fog : b.fog;
    w.last = m ? a.last : b.last;
    w.through = cselect(m, a.through, b.through);
    return w;
}

/* As far as light comes through the medium. */
FN real connect_reach(const medium *m, real length) {
    return lmin(length, CONNECT_DEPTH / lmax(cmin(m->sigma_t), R(1e-12)));
}

/* Follows a ray from the lamp at *o, in the medium `inside`, along d to the first surface that isn't null, leaving out
 * the first `clear` of it. Returns that hit, and leaves in *o the point that it counts from; in *length the whole way,
 * FAR_AWAY if there is none. */
FN hit light_way_trace(const scene *s, vec *o, vec d, real clear, ireal inside, light_way *w, real *length, mask live) {
    hit h, last;
    ireal own = I(-1);
    real travelled = R(0), depth = R(0), tmin = clear;
    *w = light_way_none();
    w->clear = clear;
    w->first = inside;
    last.prim = I(-1);
    last.t = FAR_AWAY;
    last.u = last.v = R(0);
    for (int crossed = 0; crossed < MAX_BOUNDARIES && ANY(live); crossed++) {
        h = closest_from(&s->geometry, *o, d, tmin, FAR_AWAY, own, live);
        mask met = live & (h.prim >= I(0));
        real step = met ? h.t : FAR_AWAY;
        if (HAS(MEDIA) && ANY(live & (inside >= I(0)))) {
            medium m = medium_of(s, inside);
            mask scatters = live & !is_black(cmul(m.sigma_t, m.albedo)), starts = scatters & (w->fog < I(0));
            real thinnest = cmin(m.sigma_t);
            w->begin = starts ? travelled : w->begin;
            w->end = scatters ? travelled + lmin(step, (CONNECT_DEPTH - depth) / lmax(thinnest, R(1e-12))) : w->end;
            w->fog = starts ? inside : w->fog;
            w->through = cselect(live, cmul(w->through, medium_transmittance(m.sigma_t, step)), w->through);
            depth = live ? fma(thinnest, step, depth) : depth;
        }
        travelled = live ? travelled + step : travelled;
        w->last = live ? inside : w->last;
        live = met & (depth < CONNECT_DEPTH);
        if (!ANY(live)) break;
        surface at = surface_of(s, *o, d, h, live);
        mask null = live & (GATHER_INT(s->bsdfs, kind, GATHER_INT(s->shapes, bsdf, at.shape)) == I(BSDF_NULL));
        mask ends = live & !null;
        last.prim = ends ? h.prim : last.prim;
        last.t = ends ? h.t : last.t;
        last.u = ends ? h.u : last.u;
        last.v = ends ? h.v : last.v;
        inside = null ? medium_beyond(s, at.shape, at.ng, d, inside) : inside;
        if (crossed == 0) {
            w->crosses = null ? travelled : w->crosses;
            w->second = null ? inside : w->second;
        } else if (crossed == 1)
            w->again = null ? travelled : w->again;
        own = null ? h.prim : own;
        *o = vselect(null, offset_origin(at.p, at.ng, d), *o);
        tmin = R(0);
        live = null;
    }
    *length = last.prim >= I(0) ? travelled : FAR_AWAY;
    return last;
}

/* The medium at the point `along` a ray from o along d, its id, and what comes that far. */
FN medium light_way_medium(const scene *s, const light_way *w, vec o, vec d, real along, ireal *inside, rgb *through,
                           mask live) {
    mask second = along > w->crosses, beyond = live & (along > w->again);
    medium first = medium_of(s, w->first), m = first;
    *inside = second ? w->second : w->first;
    *through = medium_transmittance(first.sigma_t, second ? w->crosses : along);
    if (ANY(live & second)) {
        m = medium_of(s, *inside);
        *through = cselect(second, cmul(*through, medium_transmittance(m.sigma_t, along - w->crosses)), *through);
    }
    if (ANY(beyond)) {
        ireal there = w->first;
        rgb rest = visibility_into(s, vmad(d, w->clear, o), d, along - w->clear, &there, I(-1), beyond);
        *inside = beyond ? there : *inside;
        *through = cselect(beyond, cmul(medium_transmittance(first.sigma_t, w->clear), rest), *through);
        m = medium_of(s, *inside);
    }
    return m;
}

#endif

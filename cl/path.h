/* path.h -- one path per lane, one segment at a time.
 *
 * A path is traced from the camera. On each segment: what the medium emits, and what lamps without extent scatter towards
 * the eye there (scatter_segment.h), both as integrals over the whole segment; then the path either scatters in the
 * medium or reaches the segment's end. At a surface: its emission; at a surface or a scattering event: lamps, emitters
 * and the environment by light sampling, combined with where the path goes next by the power heuristic (Veach 1997).
 *
 * Depth counts scattering events; a path that has scattered k times and then meets a light has k + 1 edges and counts
 * while k + 1 <= max_depth. Null surfaces don't count.
 */
#ifndef BRUME_PATH_H
#define BRUME_PATH_H

#include "bsdf.h"
#include "camera.h"
#include "emitter.h"
#include "filter.h"
#include "random.h"
#include "scatter_segment.h"
#include "visibility.h"

/* A path that has crossed so many surfaces ends; with roulette only endless total reflection or stacked boundaries do. */
#define MAX_SEGMENTS 4096

typedef struct {
    vec o, d;
    real t_max;        /* the segment ends here at the latest */
    rgb throughput, radiance;
    real sign;         /* of the reconstruction filter at the sample */
    ireal medium;      /* that the segment runs through, -1 none */
    ireal depth;
    ireal segments;
    real eta;          /* product of relative indices of refraction, for roulette */
    vec from;          /* the last scattering event, and the density per steradian with which it chose d; */
    real pdf;          /* negative where no light sampling competes: the camera, a specular surface */
    mask first;        /* nothing but null and specular surfaces so far: the guides' hit is still to come */
    mask alive;
    rng random;
} path;

FN real power_heuristic(real a, real b) {
    real r = b / lmax(a, R(1e-37));
    return R(1) / fma(r, r, R(1));
}

/* Light met by the path itself: weight against the light sampling that could have found it too. */
FN real met_weight(const path *p, real light_pdf) {
    return p->pdf < R(0) ? R(1) : power_heuristic(p->pdf, light_pdf);
}

FN void path_add(path *p, mask m, rgb value) {
    p->radiance = cselect(m, cmad(p->throughput, value, p->radiance), p->radiance);
}

FN path path_start(const scene *s, ireal x, ireal y, ureal32 sample, mask live) {
    path p;
    p.random = random_start(s->params, to_ureal32(x), to_ureal32(y), sample);
    random4 u = random_set(&p.random, SET_PIXEL);
    film_offset at_x = filter_sample(s, unit(u.x)), at_y = filter_sample(s, unit(u.y));
    p.sign = at_x.sign * at_y.sign;
    random4 lens;
    lens.x = lens.y = U32(0);
    if (s->params->aperture_radius > 0) lens = random_set(&p.random, SET_LENS);
    camera_ray ray = camera_ray_at(s->params, to_real(x) + R(0.5) + at_x.offset, to_real(y) + R(0.5) + at_y.offset,
                                   unit(lens.x), unit(lens.y));
    p.o = ray.o;
    p.d = ray.d;
    p.t_max = ray.t_max;
    p.throughput = cgrey(R(1));
    p.radiance = cgrey(R(0));
    p.medium = I(HAS(MEDIA) ? s->params->sensor_medium : -1);
    p.depth = p.segments = I(0);
    p.eta = R(1);
    p.from = ray.o;
    p.pdf = R(-1);
    p.first = TRUE_MASK;
    p.alive = live;
    return p;
}

FN path path_select(mask m, path a, path b) {
    path p;
    p.o = vselect(m, a.o, b.o);
    p.d = vselect(m, a.d, b.d);
    p.t_max = m ? a.t_max : b.t_max;
    p.throughput = cselect(m, a.throughput, b.throughput);
    p.radiance = cselect(m, a.radiance, b.radiance);
    p.sign = m ? a.sign : b.sign;
    p.medium = m ? a.medium : b.medium;
    p.depth = m ? a.depth : b.depth;
    p.segments = m ? a.segments : b.segments;
    p.eta = m ? a.eta : b.eta;
    p.from = vselect(m, a.from, b.from);
    p.pdf = m ? a.pdf : b.pdf;
    p.first = (m & a.first) | (!m & b.first);
    p.alive = (m & a.alive) | (!m & b.alive);
    p.random = random_select(m, a.random, b.random);
    return p;
}

/* Everything that the medium does along the segment up to t; returns which lanes scatter, and moves `t` there. */
FN mask path_medium(const scene *s, path *p, const medium *m, real *t) {
    mask in = p->alive & (p->medium >= I(0));
    ireal max_depth = I(s->params->max_depth);
    path_add(p, in, medium_emission(m, *t));

    mask scattering = in & ((m->sigma_t.r * m->albedo.r > R(0)) | (m->sigma_t.g * m->albedo.g > R(0)) |
                            (m->sigma_t.b * m->albedo.b > R(0)));
    random4 u = random_set(&p->random, random_medium_set(p->depth));
    mask gathers = scattering & (p->depth + I(2) <= max_depth);
    if (HAS(DELTA_LIGHTS) && ANY(gathers)) {
        in_scatter g = scatter_along(s, p->o, p->d, *t, m, unit(u.x), unit(u.y), unit(u.z), gathers);
        mask some = gathers & g.some;
        if (ANY(some)) {
            rgb seen = visibility(s, vmad(p->d, g.t, p->o), g.wi, g.distance, p->medium, some);
            path_add(p, some, cmul(g.value, seen));
        }
    }

    /* A scattering event is worth having if what follows can still reach light within max_depth: one more segment for
     * light that a ray can meet, one more scattering event for lamps. Otherwise the segment only attenuates. */
    ireal needed = p->depth + I(s->params->surfaces_emit ? 2 : 3);
    mask may = scattering & (needed <= max_depth);
    flight f = medium_flight(m, p->throughput, may ? *t : R(0), unit(u.w), unit_positive(u.w));
    rgb through = cselect(may, f.weight, medium_transmittance(m->sigma_t, *t));
    p->throughput = cselect(in, cmul(p->throughput, through), p->throughput);
    mask scatters = may & f.scatters;
    *t = scatters ? f.t : *t;
    p->alive = p->alive & !(in & is_black(p->throughput));
    return scatters & p->alive;
}

/* Light of emitters and the environment by light sampling, at a surface (bsdf) or in a medium (phase function). */
FN void path_sample_emitters(const scene *s, path *p, vec o, const surface_frame *frame, const bsdf *b, const medium *m,
                             mask at_surface, mask in_medium, random4 u) {
    mask live = at_surface | in_medium;
    emitted_light e = emitter_sample(s, o, unit(u.x), unit(u.y), unit(u.z), live);
    mask lit = live & !is_black(e.radiance) & (e.pdf > R(0));
    if (!ANY(lit)) return;
    rgb f = cgrey(R(0));
    real pdf = R(0);
    if (ANY(lit & at_surface)) {
        bsdf_value v = bsdf_eval(b, to_local(frame, vneg(p->d)), to_local(frame, e.wi));
        f = cselect(at_surface, v.f, f);
        pdf = at_surface ? v.pdf : pdf;
    }
    if (HAS(MEDIA) && ANY(lit & in_medium)) {
        real phase = phase_hg(p->d, e.wi, m->g);
        f = cselect(in_medium, cgrey(phase), f);
        pdf = in_medium ? phase : pdf;
    }
    lit = lit & !is_black(f);
    if (!ANY(lit)) return;
    rgb value = cscale(cmul(f, e.radiance), power_heuristic(e.pdf, pdf) / e.pdf);
    path_add(p, lit, cmul(value, visibility(s, o, e.wi, e.distance, p->medium, lit)));
}
#endif

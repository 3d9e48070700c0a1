/* path_state.h -- what one path per lane carries from segment to segment, and how it starts. */
#ifndef BRUME_PATH_STATE_H
#define BRUME_PATH_STATE_H

#include "camera.h"
#include "filter.h"
#include "light_layers.h"
#include "light_ray.h"
#include "random.h"
#include "scatter_emitter.h"
#include "scene.h"

/* For the film's first-hit channels, once `hit`. */
typedef struct {
    rgb albedo;
    vec n;
    real depth;
    mask hit;
} first_hit;

typedef struct {
    vec o, d;
    ireal own;         /* the triangle or quadric that o lies on, -1 for none */
    real t_max;        /* the segment ends here at the latest */
    rgb throughput, radiance;
    real sign;         /* of the reconstruction filter at the sample */
    ireal medium;      /* that the segment runs through, -1 none */
    ireal depth;
    ireal segments;
    real eta;          /* product of relative indices of refraction, for roulette */
    vec from;          /* the last scattering event, and the density per steradian with which it chose d; */
    real pdf;          /* negative where no light sampling competes: the camera, a specular surface */
    real travelled;    /* from the camera, while `first` */
    mask first;        /* nothing but null and specular surfaces so far: the guides' hit is still to come */
    mask met;          /* anything but null surfaces, for the film's alpha */
    mask from_medium;  /* the segment starts where the path scattered in a medium, */
    real flown;        /* with this density of the event along the segment before, times its length; where RAYS_SHARE */
    mask alive;
    rng random;
    ureal32 pixel_z, pixel_w; /* of SET_PIXEL, for the first segment; with DRAWS_FIRST */
    light_ray light;   /* with INDIRECT_RAY_LIGHTS */
    first_hit guide;   /* with GUIDES */
    light_layers layers; /* with LIGHT_LAYERS */
    flight_record flew; /* with SCATTERS_EMITTERS, where from_medium */
} path;

/* Media in which something is drawn along the first segment. */
#define DRAWS_FIRST (HAS(MEDIA) && HAS(SCATTERING))

/* Light that is found behind `more` scattering events beyond those of the path; where the first of them lies, or its
 * source if there are none: in a medium or not. */
FN void path_add(path *p, mask m, rgb value, mask in_medium, int more) {
    if (HAS(LIGHT_LAYERS)) light_layers_add(&p->layers, m, p->throughput, value, in_medium, more);
    p->radiance = cselect(m, cmad(p->throughput, value, p->radiance), p->radiance);
}

/* For what came out NaN and would be lost in a comparison: the whole sample is dropped and counted. */
FN void path_break(path *p, mask m) { p->radiance.r = m ? REAL_NAN : p->radiance.r; }

FN first_hit first_hit_none(void) {
    first_hit g;
    g.albedo = cgrey(R(0));
    g.n = vmake(R(0), R(0), R(0));
    g.depth = R(0);
    g.hit = FALSE_MASK;
    return g;
}

FN first_hit first_hit_select(mask m, first_hit a, first_hit b) {
    first_hit g;
    g.albedo = cselect(m, a.albedo, b.albedo);
    g.n = vselect(m, a.n, b.n);
    g.depth = m ? a.depth : b.depth;
    g.hit = m ? a.hit : b.hit;
    return g;
}

/* With which the path came from its last scattering event, per steradian; in a medium, over that of an event that is
 * anywhere on its segment. Where RAYS_SHARE, and pdf isn't negative. */
FN real path_density(const path *p) { return p->from_medium ? p->pdf * p->flown : p->pdf; }

/* A lane without a path. */
FN path path_none(void) {
    path p;
    p.o = p.d = p.from = vmake(R(0), R(0), R(1));
    p.t_max = p.sign = p.eta = p.pdf = p.travelled = R(0);
    p.throughput = p.radiance = cgrey(R(0));
    p.medium = p.own = I(-1);
    p.depth = p.segments = I(0);
    p.first = p.met = p.from_medium = p.alive = FALSE_MASK;
    if (INDIRECT_IS_RAYS) p.light = light_ray_none();
    p.flown = R(0);
    if (HAS(GUIDES)) p.guide = first_hit_none();
    if (HAS(LIGHT_LAYERS)) p.layers = light_layers_none();
    if (SCATTERS_EMITTERS) p.flew = flight_record_none();
    if (DRAWS_FIRST) p.pixel_z = p.pixel_w = U32(0);
    p.random.key = p.random.index = U32(0);
    p.random.sampler = SAMPLER_SOBOL;
    return p;
}

FN path path_start(const scene *s, ireal x, ireal y, ureal32 sample, mask live) {
    path p;
    p.random = random_start(s->params, to_ureal32(x), to_ureal32(y), sample);
    random4 u = random_set(&p.random, SET_PIXEL);
    if (DRAWS_FIRST) p.pixel_z = u.z, p.pixel_w = u.w;
    filter_offset at_x = filter_sample(s, unit(u.x)), at_y = filter_sample(s, unit(u.y));
    p.sign = at_x.sign * at_y.sign;
    random4 lens;
    lens.x = lens.y = U32(0);
    if (s->params->aperture_radius > 0) lens = random_set(&p.random, SET_LENS);
    camera_ray ray = camera_ray_at(s->params, to_real(x) + R(0.5) + at_x.offset, to_real(y) + R(0.5) + at_y.offset,
                                   unit(lens.x), unit(lens.y));
    p.o = ray.o;
    p.d = ray.d;
    p.own = I(-1);
    p.t_max = ray.t_max;
    p.throughput = cgrey(R(s->params->max_depth > 0 ? 1 : 0));
    p.radiance = cgrey(R(0));
    p.medium = I(HAS(MEDIA) ? s->params->sensor_medium : -1);
    p.depth = p.segments = I(0);
    p.eta = R(1);
    p.from = ray.o;
    p.pdf = R(-1);
    p.travelled = ray.skipped;
    p.flown = R(0);
    p.first = TRUE_MASK;
    p.met = p.from_medium = FALSE_MASK;
    p.alive = live;
    if (HAS(GUIDES)) p.guide = first_hit_none();
    if (HAS(LIGHT_LAYERS)) p.layers = light_layers_none();
    if (SCATTERS_EMITTERS) p.flew = flight_record_none();
    if (INDIRECT_IS_RAYS) {
        random4 v = random_set(&p.random, SET_LIGHT_RAY);
        p.light = light_ray_sample(s, unit(v.x), unit(v.y), unit(v.z), live);
    }
    return p;
}

FN path path_select(mask m, path a, path b) {
    path p;
    p.o = vselect(m, a.o, b.o);
    p.d = vselect(m, a.d, b.d);
    p.own = m ? a.own : b.own;
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
    p.travelled = m ? a.travelled : b.travelled;
    p.first = m ? a.first : b.first;
    p.met = m ? a.met : b.met;
    p.from_medium = m ? a.from_medium : b.from_medium;
    if (INDIRECT_IS_RAYS) p.light = light_ray_select(m, a.light, b.light);
    if (INDIRECT_IS_RAYS) p.flown = m ? a.flown : b.flown;
    if (HAS(GUIDES)) p.guide = first_hit_select(m, a.guide, b.guide);
    if (HAS(LIGHT_LAYERS)) p.layers = light_layers_select(m, a.layers, b.layers);
    if (SCATTERS_EMITTERS) p.flew = flight_record_select(m, a.flew, b.flew);
    p.alive = m ? a.alive : b.alive;
    p.random = random_select(m, a.random, b.random);
    if (DRAWS_FIRST) {
        p.pixel_z = select32(m, a.pixel_z, b.pixel_z);
        p.pixel_w = select32(m, a.pixel_w, b.pixel_w);
    }
    return p;
}

#endif

/* lamp.h -- lamps without extent, and how they shine on a point: point, spot, directional, or one point of an emitting
 * surface.
 *
 * A `lamp` holds one per lane: loops over all lights load the same into each (lamp_uniform), a lane that has chosen one
 * fetches its own (lamp_gather).
 */
#ifndef BRUME_LAMP_H
#define BRUME_LAMP_H

#include "scene.h"
#include "math.h"
#include "texture.h"

typedef struct {
    vec position;
    vec axis;         /* unit: where it points, where directional light travels */
    rgb intensity;    /* W/sr along the axis; directional: irradiance on a surface that faces it */
    real cutoff, inv_fade, v_cutoff, v_beam; /* as in b_light */
    mask directional;
    mask cone;        /* shines within `cutoff` of its axis; else everywhere alike */
    mask cosine;      /* a point of an emitting surface: falls with the cosine */
    mask met;         /* a path can meet it, too: light of an emitting surface or the environment, chosen with */
    real density;     /* this density, per area or per steradian; `intensity` is over it */
    ireal light;      /* whose gobo it has: index into lights, or -1 */
    real rays;        /* of light that leave it (light_ray.h), per steradian, where somebody has asked */
} lamp;

FN lamp lamp_uniform(const scene *s, int k) {
    __global const b_light *light = &s->lights[k];
    lamp l;
    l.position = vuniform(light->position);
    l.axis = vuniform(light->axis);
    l.intensity = cuniform(light->intensity);
    l.cutoff = R(light->cutoff);
    l.inv_fade = R(light->inv_fade);
    l.v_cutoff = R(light->v_cutoff);
    l.v_beam = R(light->v_beam);
    l.directional = light->kind == LIGHT_DIRECTIONAL ? TRUE_MASK : FALSE_MASK;
    l.cone = light->kind == LIGHT_SPOT ? TRUE_MASK : FALSE_MASK;
    l.cosine = l.met = FALSE_MASK;
    l.density = R(1);
    l.light = I(HAS(TEXTURES) && light->texture >= 0 ? k : -1);
    l.rays = R(0);
    return l;
}

FN lamp lamp_gather(const scene *s, ireal k) {
    if (s->params->light_count == 1) return lamp_uniform(s, 0);
    ireal kind = GATHER_INT(s->lights, kind, k);
    lamp l;
    l.position = VGATHER(s->lights, position, k);
    l.axis = VGATHER(s->lights, axis, k);
    l.intensity = CGATHER(s->lights, intensity, k);
    l.cutoff = GATHER(s->lights, cutoff, k);
    l.inv_fade = GATHER(s->lights, inv_fade, k);
    l.v_cutoff = GATHER(s->lights, v_cutoff, k);
    l.v_beam = GATHER(s->lights, v_beam, k);
    l.directional = kind == I(LIGHT_DIRECTIONAL);
    l.cone = kind == I(LIGHT_SPOT);
    l.cosine = l.met = FALSE_MASK;
    l.density = R(1);
    l.light = I(-1);
    l.rays = R(0);
    if (HAS(TEXTURES)) l.light = GATHER_INT(s->lights, texture, k) >= I(0) ? k : I(-1);
    return l;
}

/* The density with which a ray of light is one of lamp k in full beam, per steradian. */
FN real lamp_rays(const scene *s, ireal k) {
    ireal at = I(s->params->lamp_cdf) + k;
    real share = gather(s->cdf, at + I(1)) - gather(s->cdf, at), solid_angle = GATHER(s->lights, solid_angle, k);
    return solid_angle > R(0) ? share / solid_angle : R(0);
}

/* The angle whose 1 - cos is v, for v in [0, 2]: 2 asin sqrt(v/2), within 3.1 ulp at both ends, too. */
FN real angle_of_versine(real v) { return R(2) * latan2(sqrt(v), sqrt(lmax(R(2) - v, R(0)))); }

/* Falloff at 1 - cos(angle to the axis) = v. A spot: 1 in the beam, then linear in the angle, 0 from the cutoff
 * on. Within 8e-7, for a beam of 3/4 of the cutoff, 0.01 to 179.9 degrees. */
FN real lamp_falloff(const lamp *l, real v) {
    real f = v <= l->v_beam ? R(1) : R(0);
    mask fades = l->cone & !l->cosine & (v > l->v_beam) & (v < l->v_cutoff);
    if (ANY(fades)) {
        real fading = lclamp((l->cutoff - angle_of_versine(v)) * l->inv_fade, R(0), R(1));
        f = fades ? fading : f;
    }
    f = v < l->v_cutoff ? f : R(0);
    f = l->cosine ? lmax(R(1) - v, R(0)) : f;
    return l->cone ? f : R(1);
}

/* What a gobo lets through towards the unit direction `out` (away from the lamp). */
FN rgb lamp_gobo(const scene *s, const lamp *l, vec out) {
    rgb c = cgrey(R(1));
    mask has = l->light >= I(0);
    if (HAS(TEXTURES) && ANY(has)) {
        ireal k = has ? l->light : I(0);
        real z = vdot(out, l->axis);
        real scale = R(0.5) / (lmax(z, R(1e-6)) * GATHER(s->lights, tan_cutoff, k));
        real u = fma(vdot(out, VGATHER(s->lights, frame_x, k)), scale, R(0.5));
        real v = fma(vdot(out, VGATHER(s->lights, frame_y, k)), scale, R(0.5));
        ireal texture = has ? GATHER_INT(s->lights, texture, k) : I(0);
        c = cselect(has, texture_lookup(s->textures, s->texels, texture, u, v), c);
    }
    return c;
}

/* Below this distance from the lamp, which is of the order of both positions' rounding, a point's place relative to it
 * means nothing. */
FN real lamp_resolution(const lamp *l, vec p) {
    real extent = lmax(lmax(fabs(p.x), fabs(p.y)), fabs(p.z)) +
                  lmax(lmax(fabs(l->position.x), fabs(l->position.y)), fabs(l->position.z));
    return extent * R(0x1p-21f);
}

/* Light arriving at a point. */
typedef struct {
    vec wi;        /* towards the lamp, unit */
    real distance; /* FAR_AWAY for directional light */
    rgb irradiance; /* on a surface that faces the lamp; no visibility, no medium */
} lamp_arrival;

FN lamp_arrival lamp_at(const scene *s, const lamp *l, vec p) {
    lamp_arrival a;
    vec to = vsub(l->position, p);
    /* A lamp on the very point: no nearer than the rounding of the two positions. */
    real d2 = lmax(vdot(to, to), square(lmax(lamp_resolution(l, p), R(1e-15))));
    a.distance = sqrt(d2);
    a.wi = vscale(to, R(1) / a.distance);
    a.irradiance = cscale(l->intensity, R(1) / d2);
    if (ANY(l->cone)) {
        vec out = vneg(a.wi), off = vsub(out, l->axis);
        a.irradiance = cscale(a.irradiance, lamp_falloff(l, R(0.5) * vdot(off, off)));
        a.irradiance = cmul(a.irradiance, lamp_gobo(s, l, out));
    }
    if (ANY(l->directional)) {
        a.wi = vselect(l->directional, vneg(l->axis), a.wi);
        a.distance = l->directional ? FAR_AWAY : a.distance;
        a.irradiance = cselect(l->directional, l->intensity, a.irradiance);
    }
    return a;
}

#endif

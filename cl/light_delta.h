/* light_delta.h -- lights without extent, seen from one point: point, spot, directional.
 *
 * The light is the same for all lanes; the point that it lights is not.
 */
#ifndef BRUME_LIGHT_DELTA_H
#define BRUME_LIGHT_DELTA_H

#include "scene.h"
#include "math.h"
#include "texture.h"

/* The angle whose 1 - cos is v, for v in [0, 2]: 2 asin sqrt(v/2), accurate at both ends. */
FN real angle_of_versine(real v) { return R(2) * latan2(sqrt(v), sqrt(lmax(R(2) - v, R(0)))); }

/* Spot falloff at 1 - cos(angle to the axis) = v: 1 in the beam, then linear in the angle, 0 from the cutoff on. */
FN real spot_falloff(__global const b_light *light, real v) {
    real angle = angle_of_versine(v);
    real fading = lclamp((R(light->cutoff) - angle) * R(light->inv_fade), R(0), R(1));
    real inside = v <= R(light->v_beam) ? R(1) : fading;
    return v < R(light->v_cutoff) ? inside : R(0);
}

/* What a gobo lets through towards the unit direction `out` (away from the light). */
FN rgb spot_gobo(const scene *s, __global const b_light *light, vec out) {
    rgb c = cgrey(R(1));
    if (HAS(TEXTURES) && light->texture >= 0) {
        real z = vdot(out, vuniform(light->axis));
        real scale = R(0.5) / (lmax(z, R(1e-6)) * R(light->tan_cutoff));
        real u = fma(vdot(out, vuniform(light->frame_x)), scale, R(0.5));
        real v = fma(vdot(out, vuniform(light->frame_y)), scale, R(0.5));
        c = texture_lookup(s->textures, s->texels, I(light->texture), u, v);
    }
    return c;
}

/* The largest coordinate of its position. */
FN float light_extent(__global const b_light *light) {
    return fmax(fmax(fabs(light->position[0]), fabs(light->position[1])), fabs(light->position[2]));
}

/* Light arriving at a point. */
typedef struct {
    vec wi;        /* towards the light, unit */
    real distance; /* FAR_AWAY for directional light */
    rgb irradiance; /* on a surface that faces the light; no visibility, no medium */
} delta_arrival;

FN delta_arrival delta_light_at(const scene *s, __global const b_light *light, vec p) {
    delta_arrival a;
    if (light->kind == LIGHT_DIRECTIONAL) {
        a.wi = vneg(vuniform(light->axis));
        a.distance = FAR_AWAY;
        a.irradiance = cuniform(light->intensity);
        return a;
    }
    vec to = vsub(vuniform(light->position), p);
    /* A lamp on the very point: no nearer than the rounding of the two positions. */
    real extent = lmax(lmax(fabs(p.x), fabs(p.y)), fabs(p.z)) + R(light_extent(light));
    real d2 = lmax(vdot(to, to), square(lmax(extent * R(0x1p-21f), R(1e-15))));
    a.distance = sqrt(d2);
    a.wi = vscale(to, R(1) / a.distance);
    a.irradiance = cscale(cuniform(light->intensity), R(1) / d2);
    if (light->kind == LIGHT_SPOT) {
        vec out = vneg(a.wi);
        vec off = vsub(out, vuniform(light->axis));
        a.irradiance = cscale(a.irradiance, spot_falloff(light, R(0.5) * vdot(off, off)));
        a.irradiance = cmul(a.irradiance, spot_gobo(s, light, out));
    }
    return a;
}

#endif

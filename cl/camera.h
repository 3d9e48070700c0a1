/* camera.h -- rays from the film: a pinhole or a thin lens. */
#ifndef BRUME_CAMERA_H
#define BRUME_CAMERA_H

#include "shared.h"
#include "vec.h"
#include "warp.h"

typedef struct {
    vec o, d;   /* o on the near plane, d unit */
    real t_max; /* to the far plane */
    real skipped; /* from the lens to o */
} camera_ray;

/* x, y: film position in pixels from the top left of the full picture; u, v: on the lens. */
FN camera_ray camera_ray_at(__global const b_params *p, real x, real y, real u, real v) {
    real across = R(1) - R(2) * x / R(p->width), up = R(1) - R(2) * y / R(p->height);
    vec forward = vuniform(p->camera_z), left = vuniform(p->camera_x), above = vuniform(p->camera_y);
    vec through = vmad(left, across * R(p->tan_x), vmad(above, up * R(p->tan_y), forward)); /* at depth 1 */
    vec o = vuniform(p->camera_o);
    if (p->aperture_radius > 0) {
        real lx, ly;
        warp_disk(u, v, &lx, &ly);
        vec lens = vadd(vscale(left, lx * R(p->aperture_radius)), vscale(above, ly * R(p->aperture_radius)));
        through = vsub(through, vscale(lens, R(1) / R(p->focus_distance)));
        o = vadd(o, lens);
    }
    real length = vlength(through);
    camera_ray r;
    r.o = vmad(through, R(p->near_clip), o);
    r.d = vscale(through, R(1) / length);
    r.skipped = R(p->near_clip) * length;
    r.t_max = R(p->far_clip - p->near_clip) * length;
    return r;
}

#endif

/* bsdf_diffuse.h -- the Lambertian reflector: f = reflectance / pi on the side of its normal, black from behind. */
#ifndef BRUME_BSDF_DIFFUSE_H
#define BRUME_BSDF_DIFFUSE_H

#include "bsdf_types.h"
#include "warp.h"

FN bsdf_value diffuse_eval(const bsdf *b, vec wo, vec wi) {
    bsdf_value v;
    mask above = (wo.z > R(0)) & (wi.z > R(0));
    v.pdf = above ? wi.z * R(1 / PI) : R(0);
    v.f = cscale(b->reflectance, v.pdf);
    return v;
}

FN bsdf_sampled diffuse_sample(const bsdf *b, vec wo, real u, real v) {
    bsdf_sampled s;
    mask front = wo.z > R(0);
    s.wi = warp_cosine(u, v);
    s.pdf = front ? s.wi.z * R(1 / PI) : R(0);
    s.weight = cselect(front, b->reflectance, cgrey(R(0)));
    s.eta = R(1);
    s.is_delta = FALSE_MASK;
    return s;
}

#endif

/* bsdf_conductor.h -- a smooth metal: mirrors on the side of its normal, black from behind. */
#ifndef BRUME_BSDF_CONDUCTOR_H
#define BRUME_BSDF_CONDUCTOR_H

#include "bsdf_types.h"
#include "fresnel.h"

FN bsdf_sampled conductor_sample(const bsdf *b, vec wo) {
    bsdf_sampled s;
    mask front = wo.z > R(0);
    s.wi = vmake(-wo.x, -wo.y, wo.z);
    s.weight = cselect(front, cmul(b->reflectance, fresnel_conductor_rgb(wo.z, b->eta, b->k)), cgrey(R(0)));
    s.pdf = front ? R(1) : R(0);
    s.eta = R(1);
    s.is_delta = TRUE_MASK;
    return s;
}

#endif

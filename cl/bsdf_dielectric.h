/* bsdf_dielectric.h -- a smooth interface between two transparent media, met from either side.
 *
 * What is carried is radiance: light that leaves a medium of relative index eta spreads, so that a path from the eye
 * that enters one is scaled by 1 / eta^2 (Veach 1997, section 5.2). The way is drawn by what each lobe carries.
 */
#ifndef BRUME_BSDF_DIELECTRIC_H
#define BRUME_BSDF_DIELECTRIC_H

#include "bsdf_types.h"
#include "fresnel.h"

FN bsdf_sampled dielectric_sample(const bsdf *b, vec wo, real u_lobe) {
    mask enters = wo.z >= R(0);
    interface_split split = fresnel_dielectric(fabs(wo.z), b->ior, enters);
    /* a black lobe costs no samples */
    real reflected = split.reflected * cmax(b->reflectance);
    real refracted = (R(1) - split.reflected) * cmax(b->transmittance);
    real both = reflected + refracted;
    real share = both > R(0) ? reflected / both : split.reflected;
    mask reflects = u_lobe < share;

    bsdf_sampled s;
    vec back = vmake(-wo.x, -wo.y, wo.z);
    vec through = vmake(-wo.x * split.inverse_eta, -wo.y * split.inverse_eta, copysign(split.cos_t, -wo.z));
    s.wi = vselect(reflects, back, through);
    s.pdf = reflects ? share : R(1) - share;
    real chosen = reflects ? split.reflected : (R(1) - split.reflected) * square(split.inverse_eta);
    s.weight = cscale(cselect(reflects, b->reflectance, b->transmittance), s.pdf > R(0) ? chosen / s.pdf : R(0));
    s.eta = reflects ? R(1) : (enters ? b->ior : R(1) / b->ior);
    s.is_delta = TRUE_MASK;
    return s;
}

#endif

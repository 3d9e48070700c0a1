/* bsdf_thin_dielectric.h -- a pane of a transparent medium, too thin to shift what is seen through it.
 *
 * Of what is not reflected at the first of its two parallel faces, all of the reflections back and forth between them
 * add up, as a geometric series: with R of one face, R + (1 - R)^2 R / (1 - R^2) = 2 R / (1 + R) is reflected in all,
 * and the rest goes straight on (Born & Wolf, "Principles of Optics", 7.6, without interference). Both sides are alike.
 */
#ifndef BRUME_BSDF_THIN_DIELECTRIC_H
#define BRUME_BSDF_THIN_DIELECTRIC_H

#include "bsdf_types.h"
#include "fresnel.h"

FN bsdf_sampled thin_dielectric_sample(const bsdf *b, vec wo, real u_lobe) {
    real face = fresnel_dielectric(fabs(wo.z), b->ior, TRUE_MASK).reflected;
    real back = R(2) * face / (R(1) + face), through = (R(1) - face) / (R(1) + face);
    /* a black lobe costs no samples */
    real reflected = back * cmax(b->reflectance), passed = through * cmax(b->transmittance);
    real both = reflected + passed;
    real share = both > R(0) ? reflected / both : back;
    mask reflects = u_lobe < share;

    bsdf_sampled s;
    s.wi = vselect(reflects, vmake(-wo.x, -wo.y, wo.z), vneg(wo));
    s.pdf = reflects ? share : both > R(0) ? passed / both : R(1) - share; /* 1 - share would cancel */
    real chosen = reflects ? back : through;
    s.weight = cscale(cselect(reflects, b->reflectance, b->transmittance), s.pdf > R(0) ? chosen / s.pdf : R(0));
    s.eta = R(1);
    s.is_delta = TRUE_MASK;
    return s;
}

#endif

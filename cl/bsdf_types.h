/* bsdf_types.h -- what a surface's scattering is made of, and what evaluating and sampling it return.
 *
 * Directions are unit vectors of the shading frame and point away from the surface: wo towards the eye, wi towards
 * where the light comes from. z is the normal, x the tangent.
 */
#ifndef BRUME_BSDF_TYPES_H
#define BRUME_BSDF_TYPES_H

#include "shared.h"
#include "vec.h"

/* Of each lane, textures looked up. Fields that a kind doesn't use hold anything finite. */
typedef struct {
    ireal kind, flags;           /* BSDF_... of shared.h */
    mask mirrored;               /* the back of a two-sided one: acts as if z pointed the other way */
    rgb reflectance, transmittance;
    real alpha_u, alpha_v;       /* roughness along x and y */
    real ior;                    /* of a dielectric: inside (z < 0) / outside; of a thin one: pane / outside */
    rgb eta, k;                  /* complex index of a conductor */
} bsdf;

typedef struct {
    rgb f;                       /* f |cos wi| */
    real pdf;                    /* of sampling wi, per steradian */
} bsdf_value;

typedef struct {
    vec wi;
    rgb weight;                  /* f |cos wi| / pdf; 0 where nothing leaves the surface */
    real pdf;                    /* per steradian; of one of finitely many directions: its probability */
    real eta;                    /* index of the side of wi / index of the side of wo; 1 unless refracted */
    mask is_delta;
} bsdf_sampled;

FN bsdf_value bsdf_no_value(void) {
    bsdf_value v;
    v.f = cgrey(R(0));
    v.pdf = R(0);
    return v;
}

FN bsdf_value bsdf_value_select(mask m, bsdf_value a, bsdf_value b) {
    bsdf_value v;
    v.f = cselect(m, a.f, b.f);
    v.pdf = m ? a.pdf : b.pdf;
    return v;
}

FN bsdf_sampled bsdf_sampled_select(mask m, bsdf_sampled a, bsdf_sampled b) {
    bsdf_sampled s;
    s.wi = vselect(m, a.wi, b.wi);
    s.weight = cselect(m, a.weight, b.weight);
    s.pdf = m ? a.pdf : b.pdf;
    s.eta = m ? a.eta : b.eta;
    s.is_delta = m ? a.is_delta : b.is_delta;
    return s;
}

#endif

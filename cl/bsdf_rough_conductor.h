/* bsdf_rough_conductor.h -- metal with a rough surface: a mirror in each microfacet.
 *
 * With m the facet that mirrors wo into wi, F its Fresnel reflectance, D the distribution of facets and A(w) the
 * projected area of the surface seen from w (microfacet.h), Torrance & Sparrow 1967 in Walter et al. 2007's form with
 * separable masking G = G1(wo) G1(wi), G1(w) = cos w / A(w), reads
 *     f |cos wi| = F D(m) G / (4 cos wo)           = F D(m) cos wi / (4 A(wo) A(wi))
 *     pdf(wi)    = D(m) G1(wo) / (4 cos wo)        = D(m) / (4 A(wo))                  sampling visible facets,
 *                  D(m) cos m / (4 wo.m)                                               sampling all facets.
 * The right-hand forms are finite at grazing angles.
 */
#ifndef BRUME_BSDF_ROUGH_CONDUCTOR_H
#define BRUME_BSDF_ROUGH_CONDUCTOR_H

#include "bsdf_types.h"
#include "fresnel.h"
#include "microfacet.h"

/* Directions closer to the horizon than this neither send nor receive, so that a facet between two is well defined. */
#define ROUGH_HORIZON R(1e-9)

FN microfacets rough_conductor_facets(const bsdf *b) {
    microfacets d;
    d.alpha_u = b->alpha_u;
    d.alpha_v = b->alpha_v;
    d.beckmann = (b->flags & I(BSDF_BECKMANN)) != I(0);
    return d;
}

FN real rough_conductor_pdf(const bsdf *b, real density, real area_o, real cos_m, real cos_om) {
    mask sample_all = (b->flags & I(BSDF_SAMPLE_ALL)) != I(0);
    return R(0.25) * density * (sample_all ? cos_m / cos_om : R(1) / area_o);
}

FN bsdf_value rough_conductor_eval(const bsdf *b, vec wo, vec wi) {
    mask lit = (wo.z > ROUGH_HORIZON) & (wi.z > ROUGH_HORIZON);
    vec sum = vadd(wo, wi);
    real length = vlength(sum);
    vec m = vscale(sum, R(1) / length);
    real cos_om = lmin(R(0.5) * length, R(1)); /* wo.m, without adding products of opposite sign */
    microfacets d = rough_conductor_facets(b);
    real density = microfacet_density(&d, m);
    real area_o = microfacet_area(&d, wo), area_i = microfacet_area(&d, wi);
    rgb f = cmul(b->reflectance, fresnel_conductor_rgb(cos_om, b->eta, b->k));
    bsdf_value v;
    v.f = cscale(f, R(0.25) * density * wi.z / (area_o * area_i));
    v.pdf = rough_conductor_pdf(b, density, area_o, m.z, cos_om);
    return bsdf_value_select(lit, v, bsdf_no_value());
}

FN bsdf_sampled rough_conductor_sample(const bsdf *b, vec wo, real u_lobe, real u, real v) {
    microfacets d = rough_conductor_facets(b);
    mask sample_all = (b->flags & I(BSDF_SAMPLE_ALL)) != I(0);
    mask front = wo.z > ROUGH_HORIZON;
    wo = vselect(front, wo, vmake(R(0), R(0), R(1))); /* from below there is no visible facet to compute with */
    vec m = vmake(R(0), R(0), R(1));
    if (ANY(sample_all)) m = microfacet_sample_all(&d, u, v);
    if (ANY(!sample_all)) m = vselect(sample_all, m, microfacet_sample_visible(&d, wo, u_lobe, u, v));

    real cos_om = lmin(vdot(wo, m), R(1));
    bsdf_sampled s;
    s.wi = vmad(m, R(2) * cos_om, vneg(wo));
    mask lit = front & (s.wi.z > ROUGH_HORIZON) & (cos_om > R(0));
    real area_o = microfacet_area(&d, wo), area_i = microfacet_area(&d, s.wi);
    real share = s.wi.z / area_i * (sample_all ? cos_om / (area_o * m.z) : R(1)); /* f |cos wi| / (F pdf) */
    rgb f = cmul(b->reflectance, fresnel_conductor_rgb(cos_om, b->eta, b->k));
    s.weight = cselect(lit, cscale(f, share), cgrey(R(0)));
    s.pdf = lit ? rough_conductor_pdf(b, microfacet_density(&d, m), area_o, m.z, cos_om) : R(0);
    s.eta = R(1);
    s.is_delta = FALSE_MASK;
    return s;
}

#endif

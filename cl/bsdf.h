/* bsdf.h -- scattering at surfaces: the frame, what a surface is made of at a point, its value and its samples.
 *
 * Each kind lives in its own file and is met here only. Directions: see bsdf_types.h. A two-sided surface shows its
 * back where wo.z < 0, as if its normal pointed there.
 */
#ifndef BRUME_BSDF_H
#define BRUME_BSDF_H

#include "bsdf_conductor.h"
#include "bsdf_dielectric.h"
#include "bsdf_diffuse.h"
#include "bsdf_rough_conductor.h"
#include "bsdf_thin_dielectric.h"
#include "scene.h"
#include "texture.h"

/* Roughness below this is taken for it, as in Mitsuba 3: float directions tell no smoother surface from a mirror. */
#define MIN_ROUGHNESS R(1e-4)

/* ---- the frame --------------------------------------------------------------------------------------------------- */

typedef struct { vec s, t, n; } shading_frame; /* right-handed and orthonormal; s lies along the tangent */

/* `tangent`, of any length, is made orthogonal to the unit vector n; along n or zero it says nothing. */
FN shading_frame shading_frame_of(vec n, vec tangent) {
    shading_frame f;
    f.n = n;
    orthonormal_basis(n, &f.s, &f.t);
    vec across = vcross(n, tangent);
    real length2 = vdot(across, across);
    mask given = length2 > R(1e-12) * vdot(tangent, tangent);
    if (ANY(given)) {
        vec t = vscale(across, R(1) / sqrt(length2));
        f.s = vselect(given, vcross(t, n), f.s);
        f.t = vselect(given, t, f.t);
    }
    return f;
}

FN vec to_local(const shading_frame *f, vec d) { return vmake(vdot(f->s, d), vdot(f->t, d), vdot(f->n, d)); }
FN vec to_world(const shading_frame *f, vec d) { return vmad(f->s, d.x, vmad(f->t, d.y, vscale(f->n, d.z))); }

/* ---- what the surface is made of --------------------------------------------------------------------------------- */

FN mask bsdf_is_glass(const bsdf *b) {
    return (b->kind == I(BSDF_DIELECTRIC)) | (b->kind == I(BSDF_THIN_DIELECTRIC));
}

/* BSDF `id` seen from wo at texture coordinates (u, v); lanes not live get one, too. */
FN bsdf bsdf_of(const scene *s, ireal id, vec wo, real u, real v, mask live) {
    bsdf b;
    id = live ? id : I(0);
    b.mirrored = ((GATHER_INT(s->bsdfs, flags, id) & I(BSDF_TWO_SIDED)) != I(0)) & (wo.z < R(0));
    if (ANY(b.mirrored)) id = b.mirrored ? GATHER_INT(s->bsdfs, back, id) : id;
    b.kind = GATHER_INT(s->bsdfs, kind, id);
    b.flags = GATHER_INT(s->bsdfs, flags, id);
    b.reflectance = CGATHER(s->bsdfs, reflectance, id);
    if (HAS(TEXTURES)) {
        ireal texture = GATHER_INT(s->bsdfs, texture, id);
        mask textured = live & (texture >= I(0));
        if (ANY(textured)) {
            rgb c = texture_lookup(s->textures, s->texels, textured ? texture : I(0), u, v);
            b.reflectance = cselect(textured, c, b.reflectance);
        }
    }
    b.transmittance = cgrey(R(1));
    b.alpha_u = b.alpha_v = R(1);
    b.ior = R(1);
    b.eta = cgrey(R(0));
    b.k = cgrey(R(1));
    if (HAS(SPECULAR) && ANY(bsdf_is_glass(&b))) {
        b.transmittance = CGATHER(s->bsdfs, transmittance, id);
        b.ior = GATHER(s->bsdfs, ior, id);
    }
    if (HAS(SPECULAR) && ANY((b.kind == I(BSDF_CONDUCTOR)) | (b.kind == I(BSDF_ROUGH_CONDUCTOR)))) {
        b.eta = CGATHER(s->bsdfs, eta, id);
        b.k = CGATHER(s->bsdfs, k, id);
        b.alpha_u = lmax(GATHER(s->bsdfs, alpha_u, id), MIN_ROUGHNESS);
        b.alpha_v = lmax(GATHER(s->bsdfs, alpha_v, id), MIN_ROUGHNESS);
    }
    return b;
}

/* Scatters into finitely many directions only: light sampling cannot find them. */
FN mask bsdf_is_specular(const bsdf *b) {
    return HAS(SPECULAR) ? bsdf_is_glass(b) | (b->kind == I(BSDF_CONDUCTOR)) : FALSE_MASK;
}

/* The surface's colour for denoisers, in [0, 1]: of a metal, head-on. */
FN rgb bsdf_albedo(const bsdf *b) {
    rgb c = b->reflectance;
    if (HAS(SPECULAR)) {
        mask metal = (b->kind == I(BSDF_CONDUCTOR)) | (b->kind == I(BSDF_ROUGH_CONDUCTOR));
        if (ANY(metal)) c = cselect(metal, cmul(c, fresnel_conductor_rgb(R(1), b->eta, b->k)), c);
        c = cselect(bsdf_is_glass(b), cgrey(R(1)), c);
    }
    c = cselect(b->kind == I(BSDF_NULL), cgrey(R(1)), c);
    return cmake(lclamp(c.r, R(0), R(1)), lclamp(c.g, R(0), R(1)), lclamp(c.b, R(0), R(1)));
}

/* ---- value and sample -------------------------------------------------------------------------------------------- */

FN vec bsdf_side(const bsdf *b, vec w) {
    w.z = b->mirrored ? -w.z : w.z;
    return w;
}

/* f |cos wi| and the density of bsdf_sample; both 0 for specular and null surfaces. */
FN bsdf_value bsdf_eval(const bsdf *b, vec wo, vec wi) {
    wo = bsdf_side(b, wo);
    wi = bsdf_side(b, wi);
    bsdf_value value = bsdf_no_value();
    mask diffuse = b->kind == I(BSDF_DIFFUSE);
    if (ANY(diffuse)) value = bsdf_value_select(diffuse, diffuse_eval(b, wo, wi), value);
    if (HAS(SPECULAR)) {
        mask rough = b->kind == I(BSDF_ROUGH_CONDUCTOR);
        if (ANY(rough)) value = bsdf_value_select(rough, rough_conductor_eval(b, wo, wi), value);
    }
    return value;
}

/* A direction by the BSDF; null surfaces are passed straight on. u_lobe, u, v are uniform in [0, 1). */
FN bsdf_sampled bsdf_sample(const bsdf *b, vec wo, real u_lobe, real u, real v) {
    wo = bsdf_side(b, wo);
    bsdf_sampled s;
    s.wi = vneg(wo);
    s.weight = cgrey(R(1));
    s.pdf = R(1);
    s.eta = R(1);
    s.is_delta = TRUE_MASK;
    mask diffuse = b->kind == I(BSDF_DIFFUSE);
    if (ANY(diffuse)) s = bsdf_sampled_select(diffuse, diffuse_sample(b, wo, u, v), s);
    if (HAS(SPECULAR)) {
        mask dielectric = b->kind == I(BSDF_DIELECTRIC);
        if (ANY(dielectric)) s = bsdf_sampled_select(dielectric, dielectric_sample(b, wo, u_lobe), s);
        mask pane = b->kind == I(BSDF_THIN_DIELECTRIC);
        if (ANY(pane)) s = bsdf_sampled_select(pane, thin_dielectric_sample(b, wo, u_lobe), s);
        mask conductor = b->kind == I(BSDF_CONDUCTOR);
        if (ANY(conductor)) s = bsdf_sampled_select(conductor, conductor_sample(b, wo), s);
        mask rough = b->kind == I(BSDF_ROUGH_CONDUCTOR);
        if (ANY(rough)) s = bsdf_sampled_select(rough, rough_conductor_sample(b, wo, u_lobe, u, v), s);
    }
    s.wi = bsdf_side(b, s.wi);
    return s;
}

#endif

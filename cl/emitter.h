/* emitter.h -- light that a scattered ray can also meet: emitting surfaces and the environment.
 *
 * Surfaces are cut into pieces (triangles, spheres, disks), chosen in proportion to area times luminance, so that the
 * density of choosing a point is luminance / b_params.emitter_weight per area, whichever piece it lies on. A sphere
 * seen from outside is sampled over the cone that it fills instead. With both surfaces and an environment,
 * each gets half.
 */
#ifndef BRUME_EMITTER_H
#define BRUME_EMITTER_H

#include "environment.h"
#include "geometry.h"

/* Light offered to a point by a sampled emitter. */
typedef struct {
    vec wi;        /* towards it, unit */
    real distance; /* to it; FAR_AWAY for the environment */
    vec target;    /* on an emitting surface, moved off it to this side: where a shadow ray should end */
    rgb radiance;  /* emitted towards the point */
    real pdf;      /* per steradian, of this direction over all emitters */
} emitted_light;

FN real environment_share(const scene *s) {
    if (!HAS(ENVIRONMENT) || s->params->environment == ENVIRONMENT_NONE) return R(0);
    return R(HAS(AREA_LIGHTS) && s->params->emitter_count > 0 ? 0.5f : 1.0f);
}

/* 1 - cos of the half angle under which a sphere of radius r is seen from a distance d > r of its centre.
 * Within 15 ulp from SPHERE_NEAR on. */
FN real sphere_versine(real r, real d) {
    real sine2 = square(r / d);
    return sine2 / (R(1) + sqrt(lmax(R(1) - sine2, R(0))));
}

/* Below this distance from the centre, in radii, a sphere is sampled by area: the cone is the hemisphere there. */
#define SPHERE_NEAR R(1.0001)

/* Density per steradian with which emitter_sample, from p, picks the direction to a point of an emitting surface. */
FN real emitter_pdf(const scene *s, vec p, ireal prim, ireal shape, vec point, vec normal, mask live) {
    vec to = vsub(point, p);
    real d2 = vdot(to, to);
    rgb radiance = CGATHER(s->shapes, radiance, shape);
    real per_area = luminance(radiance) / R(s->params->emitter_weight);
    real cosine = fabs(vdot(to, normal)) / sqrt(lmax(d2, R(1e-36)));
    real pdf = per_area * d2 / lmax(cosine, R(1e-18));
    if (HAS(QUADRICS)) {
        mask quadric = live & (prim >= I(s->params->triangle_count));
        if (ANY(quadric)) {
            ireal q = quadric ? prim - I(s->params->triangle_count) : I(0);
            mask sphere = quadric & (GATHER_INT(s->geometry.quadrics, kind, q) == I(QUADRIC_SPHERE));
            real r = GATHER(s->geometry.quadrics, radius, q);
            vec center = VGATHER(s->geometry.quadrics, center, q);
            real d = vlength(vsub(center, p));
            real area = R(4 * PI) * square(r);
            real cone = per_area * area / (R(2 * PI) * sphere_versine(r, lmax(d, r)));
            mask from_outside = sphere & (d > SPHERE_NEAR * r);
            /* The far side, seen through a null surface that glows inwards, is never picked from outside. */
            mask far_side = vdot(vsub(point, center), to) > R(0);
            pdf = from_outside ? (far_side ? R(0) : cone) : pdf;
        }
    }
    return pdf * (R(1) - environment_share(s));
}

/* The outward normal at a sphere's point chosen evenly over the cone under which p sees the sphere, or over all of it
 * where p is inside or touches it. */
FN vec sphere_normal(vec p, vec center, real r, real u, real v) {
    vec to = vsub(center, p);
    real d = lmax(vlength(to), R(1e-30));
    vec axis = vscale(to, R(1) / d), t, b;
    orthonormal_basis(axis, &t, &b);
    real versine = u * sphere_versine(r, lmax(d, r));
    real sine = sqrt(versine * (R(2) - versine)), cosine = R(1) - versine;
    real sp, cp;
    lsincos(v * R(2 * PI), &sp, &cp);
    vec w = vmad(t, sine * cp, vmad(b, sine * sp, vscale(axis, cosine)));
    real nearest = d * cosine - sqrt(lmax(square(r) - square(d * sine), R(0)));
    vec from_outside = vnormalize(vsub(vscale(w, nearest), to));
    return vselect(d > SPHERE_NEAR * r, from_outside, warp_sphere(u, v));
}

/* A point of an emitting surface. */
typedef struct {
    vec point, normal; /* unit normal: of the winding's side, or outwards */
    vec facing;        /* of the side that emits */
    ireal prim, shape;
    rgb radiance;
    real density;      /* with which it was chosen, relative to evenly over its piece */
} emitter_place;

/* The point of the segment o + t d, t in [0, t_end], that is closest to c. */
FN vec segment_nearest(vec o, vec d, real t_end, vec c) {
    return vmad(d, lclamp(vdot(vsub(c, o), d), R(0), t_end), o);
}

/* How densely the point of a sphere with outward normal n is chosen for the segment o + t d, relative to evenly. Points
 * that face away from both ends of the segment are seen from nowhere on it; those opposite are chosen instead. That
 * leaves no point that the segment sees to be found by paths alone: a small sphere they find too rarely. */
FN real sphere_density(vec n, vec center, vec o, vec d, real t_end) {
    vec start = vsub(o, center);
    mask a = vdot(n, start) >= R(0), b = vdot(n, vmad(d, t_end, start)) >= R(0);
    return (a & b) ? R(2) : (a | b) ? R(1) : R(0);
}

/* On piece `at`. A sphere's point is chosen over the cone under which o sees it; or, `by_area`, as sphere_density says.
 */
FN emitter_place emitter_place_of(const scene *s, ireal at, vec o, vec d, real t_end, mask by_area, real u, real v,
                                  mask live) {
    emitter_place e;
    ireal kind = GATHER_INT(s->emitters, kind, at);
    e.prim = GATHER_INT(s->emitters, prim, at);
    e.shape = GATHER_INT(s->emitters, shape, at);
    e.point = o;
    e.normal = vmake(R(0), R(0), R(1));
    e.density = R(1);
    mask triangle = live & (kind == I(EMITTER_TRIANGLE));
    if (ANY(triangle)) {
        ireal i = triangle ? e.prim : I(0);
        vec a = vgather(s->positions, GATHER_INT(s->triangles, v[0], i));
        vec b = vgather(s->positions, GATHER_INT(s->triangles, v[1], i));
        vec c = vgather(s->positions, GATHER_INT(s->triangles, v[2], i));
        real b1, b2;
        warp_triangle(u, v, &b1, &b2);
        e.point = vselect(triangle, vexact_mix(a, b, c, b1, b2), e.point);
        e.normal = vselect(triangle, edges_normal(vsub(b, a), vsub(c, a)), e.normal);
    }
    mask quadric = live & !triangle;
    if (HAS(QUADRICS) && ANY(quadric)) {
        __global const b_quadric *quadrics = s->geometry.quadrics;
        ireal q = quadric ? e.prim - I(s->params->triangle_count) : I(0);
        vec center = VGATHER(quadrics, center, q);
        mask sphere = quadric & (kind == I(EMITTER_SPHERE));
        if (ANY(sphere)) {
            real r = GATHER(quadrics, radius, q);
            vec n = sphere_normal(o, center, r, u, v);
            if (ANY(by_area)) {
                vec even = warp_sphere(u, v);
                even = vselect(sphere_density(even, center, o, d, t_end) > R(0), even, vneg(even));
                n = vselect(by_area, even, n);
                e.density = (sphere & by_area) ? sphere_density(n, center, o, d, t_end) : e.density;
            }
            e.point = vselect(sphere, sphere_project(vmad(n, r, center), center, r), e.point);
            e.normal = vselect(sphere, n, e.normal);
        }
        mask disk = quadric & !sphere;
        if (ANY(disk)) {
            real x, y;
            warp_disk(u, v, &x, &y);
            vec du = VGATHER(quadrics, du, q), dv = VGATHER(quadrics, dv, q);
            vec on = vmake(exact_along(center.x, du.x, dv.x, x, y), exact_along(center.y, du.y, dv.y, x, y),
                           exact_along(center.z, du.z, dv.z, x, y));
            e.point = vselect(disk, on, e.point);
            e.normal = vselect(disk, VGATHER(quadrics, n, q), e.normal);
        }
    }
    mask flipped = (GATHER_INT(s->shapes, flags, e.shape) & I(SHAPE_FLIP_NORMALS)) != I(0);
    e.facing = vselect(flipped, vneg(e.normal), e.normal);
    e.radiance = CGATHER(s->shapes, radiance, e.shape);
    return e;
}

/* Which piece, by u, of which share u < `skip` is spent on something else. */
FN ireal emitter_choose(const scene *s, real u, real skip, mask live) {
    real c = lclamp((u - skip) / (R(1) - skip), R(0), R(0.99999994));
    return live ? cdf_find(s->cdf, I(s->params->emitter_cdf), s->params->emitter_count, c) : I(0);
}

FN emitted_light emitter_nothing(void) {
    emitted_light e;
    e.wi = vmake(R(0), R(0), R(1));
    e.distance = R(0);
    e.target = e.wi;
    e.radiance = cgrey(R(0));
    e.pdf = R(1);
    return e;
}

/* From p. u_choice, u, v in [0, 1). */
FN emitted_light emitter_sample(const scene *s, vec p, real u_choice, real u, real v, mask live) {
    emitted_light e = emitter_nothing();
    real share = environment_share(s);
    mask far = live & (u_choice < share);
    if (HAS(ENVIRONMENT) && ANY(far)) {
        real pdf;
        vec d = environment_sample(s, u, v, &pdf);
        rgb radiance = environment_radiance(s, d);
        e.wi = vselect(far, d, e.wi);
        e.distance = far ? FAR_AWAY : e.distance;
        e.radiance = cselect(far, radiance, e.radiance);
        e.pdf = far ? pdf * share : e.pdf;
    }
    mask near = live & !far;
    if (HAS(AREA_LIGHTS) && s->params->emitter_count > 0 && ANY(near)) {
        ireal at = emitter_choose(s, u_choice, share, near);
        emitter_place on = emitter_place_of(s, at, p, p, R(0), FALSE_MASK, u, v, near);
        vec target = offset_origin(on.point, on.normal, vsub(p, on.point));
        vec to = vsub(target, p);
        real d = sqrt(lmax(vdot(to, to), R(1e-36)));
        vec wi = vscale(to, R(1) / d);
        mask lit = near & (vdot(on.facing, wi) < R(0));
        e.wi = vselect(near, wi, e.wi);
        e.distance = near ? d : e.distance;
        e.target = vselect(near, target, e.target);
        e.radiance = cselect(near, cselect(lit, on.radiance, cgrey(R(0))), e.radiance);
        e.pdf = near ? emitter_pdf(s, p, on.prim, on.shape, on.point, on.normal, near) : e.pdf;
    }
    return e;
}

#endif

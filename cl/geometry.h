/* geometry.h -- from a hit to the surface around it, and where rays leave it.
 *
 * Conventions are Mitsuba 3's: flipped normals turn both normals and leave uv alone; a mesh without uv has a
 * triangle's barycentric weights of v1, v2; a sphere has (longitude / 2 pi, angle from its z axis / pi), a disk
 * (radius, angle / 2 pi).
 */
#ifndef BRUME_GEOMETRY_H
#define BRUME_GEOMETRY_H

#include "exact.h"
#include "math.h"
#include "scene.h"

typedef struct {
    vec p;        /* on the surface to the last bit or so, however large the surface and far the ray's origin */
    vec ng;       /* unit; the winding's side, or outwards from a sphere, unless flipped */
    vec ns;       /* unit, interpolated from vertex normals where there are any; not turned towards the ray either */
    vec tangent;  /* unit, perpendicular to ns, along growing u */
    real u, v;    /* texture coordinates */
    ireal shape;
} surface;

/* a + u (b - a) + v (c - a): exactly in the plane but for one rounding, which a float sum misses by the triangle's
 * extent. */
FN real exact_mix_of(real a, real b, real c, pair u, pair v) {
    pair sum = pair_add(pair_mul(pair_sum(b, -a), u), pair_mul(pair_sum(c, -a), v));
    return pair_value_from(a, sum);
}

FN real exact_mix(real a, real b, real c, real u, real v) {
    pair sum = pair_add(pair_scale(pair_sum(b, -a), u), pair_scale(pair_sum(c, -a), v));
    return pair_value_from(a, sum);
}

/* a + u e + v f, with one rounding. */
FN real exact_along(real a, real e, real f, real u, real v) {
    pair sum = pair_add(pair_scale(pair_of(e), u), pair_scale(pair_of(f), v));
    return pair_value_from(a, sum);
}

FN vec vexact_mix(vec a, vec b, vec c, real u, real v) {
    return vmake(exact_mix(a.x, b.x, c.x, u, v), exact_mix(a.y, b.y, c.y, u, v), exact_mix(a.z, b.z, c.z, u, v));
}

FN real edges_size(vec e1, vec e2) {
    return lmax(lmax(fabs(e1.x), lmax(fabs(e1.y), fabs(e1.z))), lmax(fabs(e2.x), lmax(fabs(e2.y), fabs(e2.z))));
}

/* Unit normal of a triangle with edges e1, e2 of any size whose squares may not be floats. */
FN vec edges_normal(vec e1, vec e2) {
    real scale = R(1) / lclamp(edges_size(e1, e2), R(1e-36), R(1e36));
    vec n = vcross(vscale(e1, scale), vscale(e2, scale));
    real length = sqrt(vdot(n, n));
    return vscale(n, R(1) / lmax(length, R(1e-18)));
}

/* The unit vector along t - (t . n) n, anything perpendicular where t has no such part. */
FN vec tangent_of(vec n, vec t) {
    vec along, other;
    orthonormal_basis(n, &along, &other);
    real size = lmax(fabs(t.x), lmax(fabs(t.y), fabs(t.z)));
    t = vscale(t, R(1) / lclamp(size, R(1e-36), R(1e36)));
    t = vmad(n, -vdot(n, t), t);
    real square_length = vdot(t, t);
    return vselect(square_length > R(1e-12), vscale(t, R(1) / sqrt(square_length)), along);
}

/* Angle of (x, y) in turns, [0, 1). */
FN real turns_of(real y, real x) {
    real turns = latan2(y, x) * R(0.15915494309189533);
    turns = turns < R(0) ? turns + R(1) : turns;
    return turns < R(1) ? turns : R(0);
}

/* A float's step in the weights u, v is a step of 2^-24 of the triangle's edges: from so many times the distances
 * involved on, it is to be seen. */
#define LARGE_TRIANGLE R(4096)

/* The point at weights u, v of the triangle a, a + e1, a + e2, that o + t d hit. Of a large triangle, the weights are
 * first corrected by what the ray's own point is away along the plane. */
FN vec triangle_point(vec a, vec b, vec c, vec e1, vec e2, vec o, vec d, hit h, mask live) {
    vec p = vexact_mix(a, b, c, h.u, h.v);
    real size = edges_size(e1, e2), from = lmax(h.t, lmax(fabs(o.x), lmax(fabs(o.y), fabs(o.z))));
    mask large = live & (size > LARGE_TRIANGLE * from);
    if (!ANY(large)) return p;
    real scale = R(1) / lclamp(size, R(1e-36), R(1e36));
    vec f1 = vscale(e1, scale), f2 = vscale(e2, scale), n = vcross(f1, f2);
    vec off = vscale(vsub(vmad(d, h.t, o), p), scale / lmax(vdot(n, n), R(1e-36)));
    pair u = pair_sum(h.u, vdot(vcross(off, f2), n)), v = pair_sum(h.v, vdot(vcross(f1, off), n));
    vec corrected = vmake(exact_mix_of(a.x, b.x, c.x, u, v), exact_mix_of(a.y, b.y, c.y, u, v),
                          exact_mix_of(a.z, b.z, c.z, u, v));
    return vselect(large, corrected, p);
}

/* `tangent` comes out as dp/du of any length. */
FN void triangle_surface(const scene *s, vec o, vec d, hit h, mask live, surface *at, vec *tangent) {
    ireal prim = live ? h.prim : I(0);
    ireal i0 = GATHER_INT(s->triangles, v[0], prim), i1 = GATHER_INT(s->triangles, v[1], prim);
    ireal i2 = GATHER_INT(s->triangles, v[2], prim), shape = GATHER_INT(s->triangles, shape, prim);
    vec a = vgather(s->positions, i0), b = vgather(s->positions, i1), c = vgather(s->positions, i2);
    vec e1 = vsub(b, a), e2 = vsub(c, a), ng = edges_normal(e1, e2), ns = ng, along = e1;
    real u = h.u, v = h.v, w = R(1) - h.u - h.v;

    ireal base = GATHER_INT(s->shapes, normal_base, shape);
    mask has = live & (base != I(NO_BASE));
    if (ANY(has)) {
        vec n0 = vgather(s->normals, has ? i0 + base : I(0));
        vec n1 = vgather(s->normals, has ? i1 + base : I(0));
        vec n2 = vgather(s->normals, has ? i2 + base : I(0));
        vec n = vmad(n0, w, vmad(n1, h.u, vscale(n2, h.v)));
        real length = vlength(n);
        ns = vselect(has & (length > R(1e-6)), vscale(n, R(1) / length), ns);
    }
    base = GATHER_INT(s->shapes, uv_base, shape);
    has = live & (base != I(NO_BASE));
    if (ANY(has)) {
        ireal j0 = has ? (i0 + base) * I(2) : I(0), j1 = has ? (i1 + base) * I(2) : I(0);
        ireal j2 = has ? (i2 + base) * I(2) : I(0);
        real u0 = gather(s->uvs, j0), v0 = gather(s->uvs, j0 + I(1));
        real u1 = gather(s->uvs, j1), v1 = gather(s->uvs, j1 + I(1));
        real u2 = gather(s->uvs, j2), v2 = gather(s->uvs, j2 + I(1));
        u = has ? fma(u0, w, fma(u1, h.u, u2 * h.v)) : u;
        v = has ? fma(v0, w, fma(v1, h.u, v2 * h.v)) : v;
        real det = difference_of_products(u1 - u0, v2 - v0, u2 - u0, v1 - v0);
        vec dpdu = vscale(vsub(vscale(e1, v2 - v0), vscale(e2, v1 - v0)), copysign(R(1), det));
        along = vselect(has, vselect(det != R(0), dpdu, vmake(R(0), R(0), R(0))), along);
    }
    at->p = vselect(live, triangle_point(a, b, c, e1, e2, o, d, h, live), at->p);
    at->ng = vselect(live, ng, at->ng);
    at->ns = vselect(live, ns, at->ns);
    at->u = live ? u : at->u;
    at->v = live ? v : at->v;
    at->shape = live ? shape : at->shape;
    *tangent = vselect(live, along, *tangent);
}

/* One Newton step from p to |p - center| = radius, the residue in twice the precision. */
FN vec sphere_project(vec p, vec center, real radius) {
    pair x = pair_sum(p.x, -center.x), y = pair_sum(p.y, -center.y), z = pair_sum(p.z, -center.z);
    pair residue = pair_neg(pair_mul(pair_of(radius), pair_of(radius)));
    residue = pair_add(residue, pair_mul(x, x));
    residue = pair_add(residue, pair_mul(y, y));
    residue = pair_add(residue, pair_mul(z, z));
    real step = pair_value(residue) / (R(-2) * square(radius));
    return vmad(vmake(x.high, y.high, z.high), step, p);
}

FN void quadric_surface(const scene *s, vec o, vec d, hit h, mask live, surface *at, vec *tangent) {
    __global const b_quadric *quadrics = s->geometry.quadrics;
    ireal q = live ? h.prim - I(s->geometry.triangle_count) : I(0);
    mask sphere = GATHER_INT(quadrics, kind, q) == I(QUADRIC_SPHERE);
    vec center = VGATHER(quadrics, center, q), n = VGATHER(quadrics, n, q);
    vec du = VGATHER(quadrics, du, q), dv = VGATHER(quadrics, dv, q);
    real radius = GATHER(quadrics, radius, q);

    /* A disk, by its axes; du and dv are half axes, so the tangent below keeps its shape. */
    vec p = vmake(exact_along(center.x, du.x, dv.x, h.u, h.v), exact_along(center.y, du.y, dv.y, h.u, h.v),
                  exact_along(center.z, du.z, dv.z, h.u, h.v));
    real rho = sqrt(fma(h.u, h.u, h.v * h.v)), per_rho = R(1) / lmax(rho, R(1e-30));
    vec along = vmad(du, h.u * per_rho, vscale(dv, h.v * per_rho)), ng = n;
    along = vselect(rho > R(0), along, du);
    real u = rho, v = turns_of(h.v, h.u);

    if (ANY(live & sphere)) {
        vec on = sphere_project(vmad(d, h.t, o), center, radius);
        vec out = vnormalize(vsub(on, center));
        real x = vdot(out, du), y = vdot(out, dv), z = vdot(out, n);
        p = vselect(sphere, on, p);
        ng = vselect(sphere, out, ng);
        along = vselect(sphere, vsub(vscale(dv, x), vscale(du, y)), along);
        u = sphere ? turns_of(y, x) : u;
        v = sphere ? latan2(sqrt(fma(x, x, y * y)), z) * R(0.3183098861837907) : v;
    }
    at->p = vselect(live, p, at->p);
    at->ng = vselect(live, ng, at->ng);
    at->ns = vselect(live, ng, at->ns);
    at->u = live ? u : at->u;
    at->v = live ? v : at->v;
    at->shape = live ? GATHER_INT(quadrics, shape, q) : at->shape;
    *tangent = vselect(live, along, *tangent);
}

/* The surface that the ray o + t d hit. Other lanes than the living ones that hit something get shape 0 and unit
 * normals. */
FN surface surface_of(const scene *s, vec o, vec d, hit h, mask live) {
    surface at;
    vec tangent = vmake(R(1), R(0), R(0));
    at.p = o;
    at.ng = at.ns = vmake(R(0), R(0), R(1));
    at.tangent = tangent;
    at.u = at.v = R(0);
    at.shape = I(0);
    live = live & (h.prim >= I(0));
    if (!ANY(live)) return at;

    mask triangle = live & (h.prim < I(s->geometry.triangle_count));
    if (ANY(triangle)) triangle_surface(s, o, d, h, triangle, &at, &tangent);
    mask quadric = live & !triangle;
    if (HAS(QUADRICS) && ANY(quadric)) quadric_surface(s, o, d, h, quadric, &at, &tangent);
    mask flip = live & ((GATHER_INT(s->shapes, flags, at.shape) & I(SHAPE_FLIP_NORMALS)) != I(0));
    at.ng = vselect(flip, vneg(at.ng), at.ng);
    at.ns = vselect(flip, vneg(at.ns), at.ns);
    at.tangent = tangent_of(at.ns, tangent);
    return at;
}

/* An origin for rays from the surface point p along d: p moved to d's side of the surface by 8 to 16 ulp of its largest
 * coordinate. That clears the rounding of p and of the sum (together below 2 ulp); the intersection tests need no more,
 * since they tell sides exactly. Relative at every scale, unlike Waechter & Binder 2019 (Ray Tracing Gems, ch. 6), who
 * fall back to a fixed length near 0 to cover the error of less exact points. */
FN vec offset_origin(vec p, vec ng, vec d) {
#ifdef BRUME_DOUBLE
    real step = R(0x1p-49);
#else
    real step = R(0x1p-20f);
#endif
    real size = lmax(fabs(p.x), lmax(fabs(p.y), fabs(p.z))) * step;
    return vmad(ng, copysign(size, vdot(ng, d)), p);
}

#endif

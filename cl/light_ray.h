/* light_ray.h -- a ray of light that leaves a lamp: where it goes, what it carries, and the surface that it ends at.
 *
 * A lamp is chosen in proportion to its power, a direction in proportion to its falloff or nearly so, so that all rays
 * carry about the same flux.
 */
#ifndef BRUME_LIGHT_RAY_H
#define BRUME_LIGHT_RAY_H

#include "bsdf.h"
#include "cdf.h"
#include "geometry.h"
#include "lamp.h"
#include "light_way.h"
#include "reservoir.h"
#include "warp.h"

typedef struct {
    mask some;
    vec o, d;
    real length;  /* to the first surface; FAR_AWAY without one */
    rgb flux;     /* carried, W over the probability of the ray; before any extinction */
    mask diffuse; /* that surface is, and reflects: */
    vec end;      /* on it, moved off it to the lit side: where a shadow ray should start */
    vec ng, ns;   /* unit; ns on the lit side */
    rgb bounce;   /* flux reflected there, per steradian and cosine at ng */
    real density; /* of such ends there, per area */
    real rays;    /* like it that leave its lamp, per steradian of full beam */
    light_way way; /* with null surfaces, through which it goes on */
} light_ray;

FN light_ray light_ray_none(void) {
    light_ray r;
    r.some = r.diffuse = FALSE_MASK;
    r.o = r.d = r.end = r.ng = r.ns = vmake(R(0), R(0), R(1));
    r.length = r.density = r.rays = R(0);
    r.flux = r.bounce = cgrey(R(0));
    if (HAS(NULL)) r.way = light_way_none();
    return r;
}

FN light_ray light_ray_select(mask m, light_ray a, light_ray b) {
    light_ray r;
    r.some = m ? a.some : b.some;
    r.o = vselect(m, a.o, b.o);
    r.d = vselect(m, a.d, b.d);
    r.length = m ? a.length : b.length;
    r.flux = cselect(m, a.flux, b.flux);
    r.diffuse = m ? a.diffuse : b.diffuse;
    r.end = vselect(m, a.end, b.end);
    r.ng = vselect(m, a.ng, b.ng);
    r.ns = vselect(m, a.ns, b.ns);
    r.bounce = cselect(m, a.bounce, b.bounce);
    r.density = m ? a.density : b.density;
    r.rays = m ? a.rays : b.rays;
    if (HAS(NULL)) r.way = light_way_select(m, a.way, b.way);
    return r;
}

/* A direction of the lamp's light, and falloff over its density: the lamp's solid angle, on average. */
FN vec lamp_sample(const lamp *l, real solid_angle, real u, real v_turn, real *weight) {
    /* In full beam: evenly. Beyond: the angle in proportion to the falloff, which is linear in it. */
    real core = R(2 * PI) * l->v_beam / solid_angle;
    mask full = split(&u, lmin(core, R(1))) | (R(1) - core < R(1e-6));
    real v = u * l->v_beam, falls = R(1) / l->inv_fade;
    real angle = l->cutoff - falls * sqrt(u), s, c;
    lsincos(R(0.5) * angle, &s, &c);
    *weight = full ? solid_angle : R(2 * PI) * s * c * falls / lmax(R(1) - core, R(1e-6));
    v = full ? v : R(2) * square(s);
    *weight = l->cone ? *weight : R(4 * PI);
    v = l->cone ? v : R(2) * u;
    vec t, b;
    real sp, cp, sine = sqrt(lmax(v * (R(2) - v), R(0)));
    orthonormal_basis(l->axis, &t, &b);
    lsincos_turns(v_turn, &sp, &cp);
    return vmad(t, sine * cp, vmad(b, sine * sp, vscale(l->axis, R(1) - v)));
}

/* The density of such directions at 1 - cos(angle to the axis) = v, over that of full beam, which is 1 / solid_angle. */
FN real lamp_density(const lamp *l, real solid_angle, real v) {
    real rest = R(1) - R(2 * PI) * l->v_beam / solid_angle, half_sine2 = R(0.5) * v;
    real sine = R(2) * sqrt(half_sine2 * lmax(R(1) - half_sine2, R(0)));
    real fading = rest < R(1e-6) ? R(0) : lamp_falloff(l, v) * rest * l->inv_fade / lmax(R(PI) * sine, R(1e-30));
    return ((v <= l->v_beam) | !l->cone) ? R(1) : fading * solid_angle;
}

/* How densely rays of light of lamp k end about a point of a surface with normal ng, if nothing is in their way; per
 * area. wi: towards the lamp. */
FN real light_ray_density(const scene *s, const lamp *l, ireal k, vec wi, real distance, vec ng) {
    vec off = vadd(wi, l->axis);
    real density = lamp_density(l, GATHER(s->lights, solid_angle, k), R(0.5) * vdot(off, off));
    density = lamp_rays(s, k) * density * fabs(vdot(ng, wi)) / square(distance);
    return l->directional ? R(0) : density;
}

FN light_ray light_ray_sample(const scene *s, real u_lamp, real u, real v, mask live) {
    light_ray r = light_ray_none();
    ireal first = I(s->params->lamp_cdf);
    ireal k = live ? cdf_find(s->cdf, first, s->params->light_count, u_lamp) : I(0);
    real share = gather(s->cdf, first + k + I(1)) - gather(s->cdf, first + k);
    lamp l = lamp_gather(s, k);
    live = live & !l.directional & (share > R(0));
    if (!ANY(live)) return r;
    real weight;
    vec d = lamp_sample(&l, GATHER(s->lights, solid_angle, k), u, v, &weight);
    r.some = live;
    r.o = l.position;
    r.d = d;
    r.rays = lamp_rays(s, k);
    r.flux = cscale(cmul(l.intensity, lamp_gobo(s, &l, d)), weight / lmax(share, R(1e-30)));
    /* A lamp may sit on a surface. */
    real clear = R(8) * lamp_resolution(&l, l.position);
    vec from = r.o;
    hit h;
    if (RAYS_CROSS(s))
        h = light_way_trace(s, &from, d, clear, GATHER_INT(s->lights, medium, k), &r.way, &r.length, live);
    else
        h = closest(&s->geometry, r.o, d, clear, FAR_AWAY, live);
    mask met = live & (h.prim >= I(0));
    if (!RAYS_CROSS(s)) r.length = met ? h.t : FAR_AWAY;
    if (!ANY(met)) return r;
    surface at = surface_of(s, from, d, h, met);
    shading_frame frame = shading_frame_of(at.ns, at.tangent);
    vec wi = to_local(&frame, vneg(d));
    bsdf b = bsdf_of(s, GATHER_INT(s->shapes, bsdf, at.shape), wi, at.u, at.v, met);
    real side = b.mirrored ? R(-1) : R(1);
    real cosine = wi.z * side;
    r.diffuse = met & (b.kind == I(BSDF_DIFFUSE));
    mask reflects = r.diffuse & (cosine > R(0));
    r.end = offset_origin(at.p, at.ng, vneg(d));
    r.ng = at.ng;
    r.ns = vscale(at.ns, side);
    r.density = light_ray_density(s, &l, k, vneg(d), lmax(r.length, R(1e-18)), at.ng);
    /* What arrives per area goes with the true normal, what is reflected with the shading normal. */
    real per_flux = cosine / lmax(fabs(vdot(at.ng, d)), R(1e-6)) * R(1 / PI);
    r.bounce = cselect(reflects, cscale(cmul(r.flux, b.reflectance), per_flux), cgrey(R(0)));
    return r;
}

/* Where along it there is a medium: m, without null surfaces. */
FN real light_ray_begin(const scene *s, const light_ray *r) { return RAYS_CROSS(s) ? r->way.begin : R(0); }
FN real light_ray_reach(const scene *s, const light_ray *r, const medium *m) {
    return RAYS_CROSS(s) ? r->way.end : connect_reach(m, r->length);
}

/* The medium there; of several, the one that light is to be expected from. */
FN medium light_ray_fog(const scene *s, const light_ray *r, const medium *m) {
    return RAYS_CROSS(s) ? medium_of(s, r->way.fog) : *m;
}

/* The medium at the point `along` it, its id, and what comes that far and `more` of m. */
FN medium light_ray_at(const scene *s, const light_ray *r, const medium *m, real along, real more, ireal *inside,
                       rgb *through, mask live) {
    if (!RAYS_CROSS(s)) {
        *through = medium_transmittance(m->sigma_t, more + along);
        return *m;
    }
    medium there = light_way_medium(s, &r->way, r->o, r->d, along, inside, through, live);
    *through = cmul(*through, medium_transmittance(m->sigma_t, more));
    return there;
}

/* What comes to its end, and `more` of m. */
FN rgb light_ray_through(const scene *s, const light_ray *r, const medium *m, real more) {
    if (!RAYS_CROSS(s)) return medium_transmittance(m->sigma_t, more + r->length);
    return cmul(r->way.through, medium_transmittance(m->sigma_t, more));
}

#endif

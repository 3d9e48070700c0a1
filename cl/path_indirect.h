/* path_indirect.h -- light that scatters at least twice, the second to last time in a medium: the segment of a path is
 * connected to a ray of light from a lamp.
 *
 * Along that ray light scatters everywhere (a virtual ray light: Novak, Nowrouzezahrai, Dachsbacher & Jarosz 2012,
 * "Virtual ray lights for rendering scenes with participating media"); and where it ends, a diffuse surface reflects it
 * (an instant radiosity light: Keller 1997, with the segment's point chosen equiangularly about it). One of the two is
 * connected to, in proportion to what they would give if nothing stood between.
 *
 * Who counts what: let the vertex next to the lamp be y and the one before it, seen from the lamp, x. If x lies in a
 * medium, and y in a medium or on a diffuse surface, the path is counted here, at the segment that holds x; and so
 * neither where a segment that starts in a medium gathers from lamps (path_medium.h), nor where a diffuse surface that
 * was reached from a medium samples them (path.h). All other paths are counted there; where x lies
 * on a surface they share with path_bounce.h.
 *
 * But where fog ends at null surfaces few rays of light may find it, and a path that is in it is; and directional lamps
 * have no rays. There (RAYS_SHARE) paths count what they see of y from x in a medium, too, weighted as at surfaces.
 *
 * Points on the two rays: t on the segment by the inverse hyperbolic sine of the distance from where the rays are
 * closest, which cancels the distance between x and the ray of light; then s on the ray of light equiangularly about x,
 * which cancels the squared distance between x and y.
 */
#ifndef BRUME_PATH_INDIRECT_H
#define BRUME_PATH_INDIRECT_H

#include "equiangular.h"
#include "heuristic.h"
#include "path_state.h"
#include "phase_hg.h"
#include "piecewise.h"
#include "reservoir.h"
#include "visibility.h"

/* Angles per point of the segment in the first table. */
#ifndef CONNECT_COARSE
#define CONNECT_COARSE 4
#endif

/* Mean cosines beyond this make the connection follow the phase functions: at g = 0.5 half the variance, at 0.9 a
 * seventh of it, for twice the time. On the first segment alone it would be a tenth of that gain. */
#ifndef CONNECT_PEAKED
#define CONNECT_PEAKED 0.3
#endif

typedef struct {
    rgb value; /* without what lies between x and y */
    vec y;
    vec wi;    /* from x to y, unit */
    real distance;
    ireal inside; /* the medium at y */
} connection;

FN connection connection_none(void) {
    connection c;
    c.value = cgrey(R(0));
    c.y = c.wi = vmake(R(0), R(0), R(1));
    c.distance = R(1);
    c.inside = I(-1);
    return c;
}

FN connection connection_select(mask m, connection a, connection b) {
    connection c;
    c.value = cselect(m, a.value, b.value);
    c.y = vselect(m, a.y, b.y);
    c.wi = vselect(m, a.wi, b.wi);
    c.distance = m ? a.distance : b.distance;
    c.inside = m ? a.inside : b.inside;
    return c;
}

/* About what comes through between x, in medium m, and y: what to choose one of two connections by. There may be
 * another medium between, or none: then nothing is known. */
FN real connection_transmittance(const scene *s, const medium *m, real distance) {
    return RAYS_CROSS(s) ? R(1) : lexp(-cmean(m->sigma_t) * distance);
}

/* Within 1.8 ulp. From where the square is too large for a float on, the logarithm of 2 |x|. */
FN real lasinh(real x) {
    real a = fabs(x);
    mask huge = a > R(1e18);
    real y = llog1p(huge ? a : a + square(a) / (R(1) + sqrt(fma(a, a, R(1)))));
    return copysign(huge ? y + R(LN2_HIGH) : y, x);
}

/* What scatters at y on the ray of light, in a medium of mean cosine g_y, towards x on the segment, over
 * 1/distance^2. */
FN real connect_turns(vec light_d, vec eye_d, vec y_to_x, real distance, real g_y, real g_x) {
    vec w = vscale(y_to_x, R(1) / distance);
    return phase_hg(light_d, w, g_y) * phase_hg(w, vneg(eye_d), g_x);
}

/* The same for x at distance D from the ray of light, whose closest point is `along` it, with extinction: at n + 1
 * points of the ray, evenly spaced in the angle from x. Returns about its integral over the angle. */
FN real connect_table(const scene *s, const light_ray *r, vec d, vec across, const equiangular_range *range, real along,
                      const medium *fog, const medium *m, int n, real *f) {
    real t[PIECES + 1], sigma = cmean(fog->sigma_t), sum = R(0);
    equiangular_nodes(range, n, t);
    for (int k = 0; k <= n; k++) {
        real distance = sqrt(fma(t[k], t[k], square(range->D)));
        vec y_to_x = vmad(r->d, -t[k], across);
        real way = along + t[k] + distance;
        if (RAYS_CROSS(s)) way = way - r->way.begin;
        f[k] = connect_turns(r->d, d, y_to_x, distance, fog->g, m->g) * lexp(-sigma * way);
        sum = sum + f[k];
    }
    return sum * range->width;
}

/* A density from values at every other node. */
FN void connect_finish(piecewise *p, const real *f) {
    for (int k = 0; k < PIECES; k += 2) {
        p->node[k] = f[k / 2];
        p->node[k + 1] = R(0.5) * (f[k / 2] + f[k / 2 + 1]);
    }
    p->node[PIECES] = f[PIECES / 2];
    piecewise_finish(p);
}

/* How likely a path's next event is at t of a segment that ends at t_end, over the same for one that is anywhere. */
FN real connect_flown(const medium *m, rgb throughput, real t, real t_end) {
    return medium_flight_density(m, throughput, t) * connect_reach(m, t_end);
}

/* To a point of the ray of light. */
FN connection connect_ray(const scene *s, const light_ray *r, vec o, vec d, real t_end, const medium *m, real u, real v,
                          rgb throughput, mask shaped, mask live) {
    connection out;
    medium fog = light_ray_fog(s, r, m);
    real begin = light_ray_begin(s, r), length = light_ray_reach(s, r, m);
    vec w = vsub(r->o, o), c = vcross(d, r->d);
    real sine2 = vdot(c, c), sine = sqrt(sine2);
    mask skew = sine > R(1e-3);
    real per_sine2 = R(1) / lmax(sine2, R(1e-12));
    real closest_t = vdot(vcross(w, r->d), c) * per_sine2;
    real size = sqrt(vdot(w, w)), reach = connect_reach(m, t_end);
    /* A floor: below it the rays' distance is rounding. */
    real h = lmax(fabs(vdot(w, c)) / lmax(sine, R(1e-6)), R(0x1p-18f) * (size + R(1e-18)));
    real scale = sine / h;
    real z0 = lasinh(-closest_t * scale), z1 = lasinh((reach - closest_t) * scale);
    /* A peaked phase function makes most of both rays dark: tables of where it is not. */
    int any_shaped = ANY(shaped);
    piecewise table;
    real density = R(1), f[PIECES / 2 + 1];
    if (any_shaped) {
        real sigma = cmean(m->sigma_t), g[CONNECT_COARSE + 1];
        for (int k = 0; k <= PIECES / 2; k++) {
            real share = R(2 * k / (float)PIECES), z = fma(share, z1 - z0, z0), e = lexp(z);
            real t = closest_t + R(0.5) * (e - R(1) / e) / lmax(scale, R(1e-12));
            t = lclamp(skew ? t : share * reach, R(0), reach);
            vec to_x = vsub(vmad(d, t, o), r->o);
            real along = vdot(to_x, r->d);
            vec across = vmad(r->d, -along, to_x);
            real D = lmax(vlength(across), R(0x1p-18f) * (vlength(to_x) + R(1e-18)));
            equiangular_range range = equiangular_range_of(D, RAYS_CROSS(s) ? begin - along : -along, length - along);
            f[k] = connect_table(s, r, d, across, &range, along, &fog, m, CONNECT_COARSE, g) * lexp(-sigma * t);
        }
        connect_finish(&table, f);
        real warped = piecewise_warp(&table, v, &density);
        v = shaped ? warped : v;
        density = shaped ? density : R(1);
    }
    real z = fma(v, z1 - z0, z0), e = lexp(z), cosh_z = R(0.5) * (e + R(1) / e);
    real t = closest_t + R(0.5) * (e - R(1) / e) / lmax(scale, R(1e-12));
    real per_density = cosh_z * (z1 - z0) / lmax(scale, R(1e-12));
    t = lclamp(skew ? t : v * reach, R(0), reach);
    per_density = (skew ? per_density : reach) / density;

    vec x = vmad(d, t, o), to_x = vsub(x, r->o);
    real along = vdot(to_x, r->d);
    vec across = vmad(r->d, -along, to_x);
    real D = lmax(vlength(across), R(0x1p-18f) * (vlength(to_x) + R(1e-18)));
    equiangular_range range = equiangular_range_of(D, RAYS_CROSS(s) ? begin - along : -along, length - along);
    if (any_shaped) {
        connect_table(s, r, d, across, &range, along, &fog, m, PIECES / 2, f);
        connect_finish(&table, f);
        real warped = piecewise_warp(&table, u, &density);
        u = shaped ? warped : u;
        per_density = shaped ? per_density / density : per_density;
    }
    real at = lclamp(along + equiangular_sample(&range, u), begin, length);
    out.y = vmad(r->d, at, r->o);
    vec y_to_x = vsub(x, out.y);
    out.distance = lmax(vlength(y_to_x), D);
    out.wi = vscale(y_to_x, R(-1) / out.distance);
    out.inside = I(-1);
    rgb through;
    fog = light_ray_at(s, r, m, at, t, &out.inside, &through, live);
    real phases = connect_turns(r->d, d, y_to_x, out.distance, fog.g, m->g);
    out.value = cscale(cmul(r->flux, through), phases * per_density * range.width / D);
    out.value = cmul(out.value, cmul(cmul(fog.sigma_t, fog.albedo), cmul(m->sigma_t, m->albedo)));
    if (RAYS_SHARE(s)) {
        real pdf = phase_hg(d, out.wi, m->g) * connect_flown(m, throughput, t, t_end);
        out.value = cscale(out.value, shared_with_rays(r->rays, out.distance, pdf, at));
    }
    return out;
}

/* To the surface at its end. */
FN connection connect_end(const scene *s, const light_ray *r, vec o, vec d, real t_end, const medium *m, real u,
                          rgb throughput, mask shaped) {
    connection out;
    vec w = vsub(r->end, o);
    real along = vdot(w, d), reach = connect_reach(m, t_end);
    real D = lmax(vlength(vmad(d, -along, w)), R(0x1p-18f) * (vlength(w) + R(1e-18)));
    equiangular_range range = equiangular_range_of(D, -along, reach - along);
    real density = R(1);
    if (ANY(shaped)) {
        real t[PIECES + 1], sigma = cmean(m->sigma_t);
        piecewise table;
        equiangular_nodes(&range, PIECES, t);
        for (int k = 0; k <= PIECES; k++) {
            vec y_to_x = vsub(vmad(d, along + t[k], o), r->end);
            real distance = lmax(vlength(y_to_x), D);
            table.node[k] = phase_hg(vscale(y_to_x, R(1) / distance), vneg(d), m->g) *
                            lexp(-sigma * (along + t[k] + distance));
        }
        piecewise_finish(&table);
        real warped = piecewise_warp(&table, u, &density);
        u = shaped ? warped : u;
        density = shaped ? density : R(1);
    }
    real t = lclamp(along + equiangular_sample(&range, u), R(0), reach);
    vec from_y = vsub(vmad(d, t, o), r->end);
    out.y = r->end;
    out.distance = lmax(vlength(from_y), D);
    out.wi = vscale(from_y, R(-1) / out.distance);
    real cosine = vdot(r->ns, out.wi) < R(0) ? fabs(vdot(r->ng, out.wi)) : R(0);
    out.inside = RAYS_CROSS(s) ? r->way.last : I(-1);
    out.value = cscale(cmul(r->bounce, light_ray_through(s, r, m, t)),
                       cosine * phase_hg(vneg(out.wi), vneg(d), m->g) * range.width / (D * density));
    out.value = cmul(out.value, cmul(m->sigma_t, m->albedo));
    if (RAYS_SHARE(s)) {
        real pdf = phase_hg(d, out.wi, m->g) * connect_flown(m, throughput, t, t_end);
        out.value = cscale(out.value, power_heuristic(r->density, pdf * cosine / square(out.distance)));
    }
    return out;
}

/* Adds what the segment of length t_end gets from the path's ray of light. */
FN void path_connect(const scene *s, path *p, const medium *m, real t_end, mask live) {
    const light_ray *r = &p->light;
    live = live & r->some;
    if (!ANY(live)) return;
    random4 u = random_set(&p->random, random_bounce_set(p->segments, SET_INDIRECT));
    real choice = unit(u.w), peaked = fabs(m->g);
    if (RAYS_CROSS(s)) peaked = lmax(peaked, fabs(light_ray_fog(s, r, m).g));
    mask shaped = HAS(ANISOTROPY) ? live & (peaked > R(CONNECT_PEAKED)) : FALSE_MASK;
    connection c = connect_ray(s, r, p->o, p->d, t_end, m, unit(u.x), unit(u.y), p->throughput, shaped, live);
    real a = luminance(cmul(c.value, p->throughput)) * connection_transmittance(s, m, c.distance), share = R(1);
    path_break(p, live & is_bad(a));
    mask reflects = live & r->diffuse & !is_black(r->bounce);
    if (ANY(reflects)) {
        connection e = connect_end(s, r, p->o, p->d, t_end, m, unit(u.z), p->throughput, shaped);
        real b = luminance(cmul(e.value, p->throughput)) * connection_transmittance(s, m, e.distance);
        path_break(p, reflects & is_bad(b)); /* which would just not be chosen */
        b = (reflects & (b > R(0))) ? b : R(0);
        share = a / lmax(a + b, R(1e-37));
        mask end = reflects & (choice >= share);
        share = end ? R(1) - share : share;
        share = reflects ? share : R(1);
        c = connection_select(end, e, c);
    }
    live = live & !is_black(c.value) & (share > R(0));
    if (!ANY(live)) return;
    /* From y: rays that leave a surface don't meet it again however large it is, those that end on it may. */
    ireal inside = RAYS_CROSS(s) ? c.inside : p->medium;
    rgb seen = visibility(s, c.y, vneg(c.wi), c.distance * SHORT_OF_LIGHT, inside, live);
    path_add(p, live, cscale(cmul(c.value, seen), R(1) / lmax(share, R(1e-30))), TRUE_MASK, 2);
}

#endif

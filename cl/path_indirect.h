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
 * Points on the two rays: t on the segment by the inverse hyperbolic sine of the distance from where the rays are
 * closest, which cancels the distance between x and the ray of light; then s on the ray of light equiangularly about x,
 * which cancels the squared distance between x and y.
 */
#ifndef BRUME_PATH_INDIRECT_H
#define BRUME_PATH_INDIRECT_H

#include "equiangular.h"
#include "path_state.h"
#include "phase_hg.h"
#include "piecewise.h"
#include "reservoir.h"
#include "visibility.h"

/* Nothing comes through more optical depth than this. */
#define CONNECT_DEPTH R(60)

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
} connection;

FN connection connection_none(void) {
    connection c;
    c.value = cgrey(R(0));
    c.y = c.wi = vmake(R(0), R(0), R(1));
    c.distance = R(1);
    return c;
}

/* Within 1.8 ulp. From where the square is too large for a float on, the logarithm of 2 |x|. */
FN real lasinh(real x) {
    real a = fabs(x);
    mask huge = a > R(1e18);
    real y = llog1p(huge ? a : a + square(a) / (R(1) + sqrt(fma(a, a, R(1)))));
    return copysign(huge ? y + R(LN2_HIGH) : y, x);
}

/* As far as light comes through the medium. */
FN real connect_reach(const medium *m, real length) {
    return lmin(length, CONNECT_DEPTH / lmax(cmin(m->sigma_t), R(1e-12)));
}

/* What scatters at y on the ray of light, s along it, towards x on the segment, over 1/distance^2. */
FN real connect_turns(vec light_d, vec eye_d, vec y_to_x, real distance, real g) {
    vec w = vscale(y_to_x, R(1) / distance);
    return phase_hg(light_d, w, g) * phase_hg(w, vneg(eye_d), g);
}

/* The same for x at distance D from the ray of light, whose closest point is `along` it, with extinction: at n + 1
 * points of the ray, evenly spaced in the angle from x. Returns about its integral over the angle. */
FN real connect_table(const light_ray *r, vec d, vec across, const equiangular_range *range, real along,
                      const medium *m, int n, real *f) {
    real t[PIECES + 1], sigma = cmean(m->sigma_t), sum = R(0);
    equiangular_nodes(range, n, t);
    for (int k = 0; k <= n; k++) {
        real distance = sqrt(fma(t[k], t[k], square(range->D)));
        vec y_to_x = vmad(r->d, -t[k], across);
        f[k] = connect_turns(r->d, d, y_to_x, distance, m->g) * lexp(-sigma * (along + t[k] + distance));
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

/* To a point of the ray of light. */
FN connection connect_ray(const light_ray *r, vec o, vec d, real t_end, const medium *m, real u, real v, mask shaped) {
    connection out;
    vec w = vsub(r->o, o), c = vcross(d, r->d);
    real sine2 = vdot(c, c), sine = sqrt(sine2);
    mask skew = sine > R(1e-3);
    real per_sine2 = R(1) / lmax(sine2, R(1e-12));
    real closest_t = vdot(vcross(w, r->d), c) * per_sine2;
    real size = sqrt(vdot(w, w)), reach = connect_reach(m, t_end), length = connect_reach(m, r->length);
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
            equiangular_range range = equiangular_range_of(D, -along, length - along);
            f[k] = connect_table(r, d, across, &range, along, m, CONNECT_COARSE, g) * lexp(-sigma * t);
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
    equiangular_range range = equiangular_range_of(D, -along, length - along);
    if (any_shaped) {
        connect_table(r, d, across, &range, along, m, PIECES / 2, f);
        connect_finish(&table, f);
        real warped = piecewise_warp(&table, u, &density);
        u = shaped ? warped : u;
        per_density = shaped ? per_density / density : per_density;
    }
    real s = along + equiangular_sample(&range, u);
    s = lclamp(s, R(0), length);
    out.y = vmad(r->d, s, r->o);
    vec y_to_x = vsub(x, out.y);
    out.distance = lmax(vlength(y_to_x), D);
    out.wi = vscale(y_to_x, R(-1) / out.distance);
    real phases = connect_turns(r->d, d, y_to_x, out.distance, m->g);
    rgb sigma_s = cmul(m->sigma_t, m->albedo);
    out.value = cscale(cmul(r->flux, medium_transmittance(m->sigma_t, t + s)),
                       phases * per_density * range.width / D);
    out.value = cmul(out.value, cmul(sigma_s, sigma_s));
    return out;
}

/* To the surface at its end. */
FN connection connect_end(const light_ray *r, vec o, vec d, real t_end, const medium *m, real u, mask shaped) {
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
    out.value = cscale(cmul(r->bounce, medium_transmittance(m->sigma_t, t + r->length)),
                       cosine * phase_hg(vneg(out.wi), vneg(d), m->g) * range.width / (D * density));
    out.value = cmul(out.value, cmul(m->sigma_t, m->albedo));
    return out;
}

/* Adds what the segment of length t_end gets from the path's ray of light. */
FN void path_connect(const scene *s, path *p, const medium *m, real t_end, mask live) {
    const light_ray *r = &p->light;
    live = live & r->some;
    if (!ANY(live)) return;
    random4 u = random_set(&p->random, random_bounce_set(p->segments, SET_INDIRECT));
    real sigma = cmean(m->sigma_t), choice = unit(u.w);
    mask shaped = HAS(ANISOTROPY) ? live & (fabs(m->g) > R(CONNECT_PEAKED)) : FALSE_MASK;
    connection c = connect_ray(r, p->o, p->d, t_end, m, unit(u.x), unit(u.y), shaped);
    real a = luminance(cmul(c.value, p->throughput)) * lexp(-sigma * c.distance), share = R(1);
    path_break(p, live & is_bad(a));
    mask reflects = live & r->diffuse & !is_black(r->bounce);
    if (ANY(reflects)) {
        connection e = connect_end(r, p->o, p->d, t_end, m, unit(u.z), shaped);
        real b = luminance(cmul(e.value, p->throughput)) * lexp(-sigma * e.distance);
        path_break(p, reflects & is_bad(b)); /* which would just not be chosen */
        b = (reflects & (b > R(0))) ? b : R(0);
        share = a / lmax(a + b, R(1e-37));
        mask end = reflects & (choice >= share);
        share = end ? R(1) - share : share;
        share = reflects ? share : R(1);
        c.value = cselect(end, e.value, c.value);
        c.y = vselect(end, e.y, c.y);
        c.wi = vselect(end, e.wi, c.wi);
        c.distance = end ? e.distance : c.distance;
    }
    live = live & !is_black(c.value) & (share > R(0));
    if (!ANY(live)) return;
    /* From y: rays that leave a surface don't meet it again however large it is, those that end on it may. */
    rgb seen = visibility(s, c.y, vneg(c.wi), c.distance * SHORT_OF_LIGHT, p->medium, live);
    path_add(p, live, cscale(cmul(c.value, seen), R(1) / lmax(share, R(1e-30))), TRUE_MASK, 2);
}

#endif

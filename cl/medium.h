/* medium.h -- homogeneous participating media: transmittance, emission, free flight.
 *
 * Chromatic extinction: a flight is drawn in one colour channel, chosen in proportion to the throughput, and weighted
 * by the mixture of all channels' densities (Wilkie et al. 2014, "Hero wavelength spectral sampling"), so that no
 * weight exceeds the sum of the throughput's channels.
 */
#ifndef BRUME_MEDIUM_H
#define BRUME_MEDIUM_H

#include "math.h"
#include "random.h"
#include "scene.h"

typedef struct {
    rgb sigma_t, albedo, emission;
    real g;
} medium;

FN medium medium_none(void) {
    medium m;
    m.sigma_t = m.albedo = m.emission = cgrey(R(0));
    m.g = R(0);
    return m;
}

/* The medium of each lane; where `id` is -1 nothing that absorbs, scatters or emits. */
FN medium medium_of(const scene *s, ireal id) {
    mask some = id >= I(0);
    ireal i = some ? id : I(0);
    rgb black = cgrey(R(0));
    medium m;
    if (s->params->medium_count == 1) {
        m.sigma_t = cselect(some, cuniform(s->media[0].sigma_t), black);
        m.albedo = cselect(some, cuniform(s->media[0].albedo), black);
        m.emission = cselect(some, cuniform(s->media[0].emission), black);
        m.g = some ? R(s->media[0].g) : R(0);
        return m;
    }
    m.sigma_t = cselect(some, CGATHER(s->media, sigma_t, i), black);
    m.albedo = cselect(some, CGATHER(s->media, albedo, i), black);
    m.emission = cselect(some, CGATHER(s->media, emission, i), black);
    m.g = some ? GATHER(s->media, g, i) : R(0);
    return m;
}

/* exp(-sigma t), 1 for sigma = 0 however long the way. */
FN rgb medium_transmittance(rgb sigma_t, real t) {
    if (!HAS(CHROMATIC)) return cgrey(lexp(-sigma_t.r * t));
    return cmake(lexp(-sigma_t.r * t), lexp(-sigma_t.g * t), lexp(-sigma_t.b * t));
}

/* Integral of exp(-sigma s) over s in [0, t]: (1 - exp(-sigma t)) / sigma, t for sigma -> 0. Within 1.8 ulp. */
FN real transmittance_integral(real sigma, real t) {
    real tau = sigma * t;
    real thin = t * (R(1) - R(0.5) * tau);
    return tau < R(1e-7) ? thin : -lexpm1(-tau) / sigma;
}

FN rgb medium_emission(const medium *m, real t) {
    if (!HAS(CHROMATIC)) return cscale(m->emission, transmittance_integral(m->sigma_t.r, t));
    return cmul(m->emission, cmake(transmittance_integral(m->sigma_t.r, t), transmittance_integral(m->sigma_t.g, t),
                                   transmittance_integral(m->sigma_t.b, t)));
}

typedef struct {
    mask scatters; /* else the flight reaches the end of the segment */
    real t;
    rgb weight; /* to multiply the throughput with: albedo and transmittance over the density */
} flight;

FN mask medium_is_grey(const medium *m) {
    return (m->sigma_t.r == m->sigma_t.g) & (m->sigma_t.g == m->sigma_t.b);
}

FN flight medium_flight(const medium *m, rgb throughput, real t_end, real u_channel, real u_flight) {
    flight f;
    real sigma = m->sigma_t.r;
    rgb q = cgrey(R(0));
    int chromatic = HAS(CHROMATIC) ? ANY(!medium_is_grey(m)) : 0;
    if (chromatic) {
        real sum = throughput.r + throughput.g + throughput.b;
        sum = sum > R(0) ? sum : R(1);
        q = cscale(throughput, R(1) / sum);
        sigma = u_channel < q.r ? m->sigma_t.r : u_channel < q.r + q.g ? m->sigma_t.g : m->sigma_t.b;
    }
    real t = sigma > R(0) ? -llog(u_flight) / lmax(sigma, R(1e-30)) : R(1e30);
    f.scatters = t < t_end;
    f.t = f.scatters ? t : t_end;
    /* Grey: the density cancels all but the albedo. */
    f.weight = cselect(f.scatters, m->albedo, cgrey(R(1)));
    if (chromatic) {
        /* Relative to the thinnest channel, so that no optical depth underflows in all of them. */
        real thinnest = cmin(m->sigma_t);
        rgb relative = medium_transmittance(csub(m->sigma_t, cgrey(thinnest)), f.t);
        rgb collide = cmul(m->sigma_t, relative);
        real density_collide = q.r * collide.r + q.g * collide.g + q.b * collide.b;
        real density_pass = q.r * relative.r + q.g * relative.g + q.b * relative.b;
        rgb scattered = cscale(cmul(m->albedo, collide), R(1) / lmax(density_collide, R(1e-37)));
        rgb passed = cscale(relative, R(1) / lmax(density_pass, R(1e-37)));
        f.weight = cselect(medium_is_grey(m), f.weight, cselect(f.scatters, scattered, passed));
    }
    return f;
}

/* Density per length with which medium_flight scatters at t. */
FN real medium_flight_density(const medium *m, rgb throughput, real t) {
    real sum = throughput.r + throughput.g + throughput.b;
    rgb collide = cmul(m->sigma_t, medium_transmittance(m->sigma_t, t));
    return (throughput.r * collide.r + throughput.g * collide.g + throughput.b * collide.b) /
           (sum > R(0) ? sum : R(1));
}

/* STRATEGY_SPHERICAL's: every other flight scatters, at a point uniform over the segment; an infinite one, over which
 * nothing is uniform, is flown as ever. */
FN flight medium_flight_uniform(const medium *m, rgb throughput, real t_end, random4 u) {
    flight f = medium_flight(m, throughput, t_end, unit(u.y), unit_positive(u.w));
    mask finite = (t_end > R(0)) & (t_end < R(1e17));
    real w = unit(u.w);
    mask scatters = w < R(0.5);
    real t = scatters ? lmin(R(2) * w * t_end, t_end) : t_end;
    rgb through = cscale(medium_transmittance(m->sigma_t, t), R(2));
    rgb weight = cselect(scatters, cscale(cmul(cmul(m->sigma_t, m->albedo), through), t_end), through);
    f.scatters = (finite & scatters) | (f.scatters & !finite);
    f.t = finite ? t : f.t;
    f.weight = cselect(finite, weight, f.weight);
    return f;
}

#endif

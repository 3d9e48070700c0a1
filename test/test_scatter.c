/* test_scatter.c -- what a segment through a medium gathers from lamps (cl/scatter_segment.h), free flight
 * (cl/medium.h) and the choice among lamps (cl/reservoir.h), against quadrature and closed forms.
 *
 * The estimate of light scattered along a segment is compared with the integral, as a whole and over eight pieces of
 * the segment, by t-tests; flights and choices by chi-square against their distributions. All statistical tests of
 * this file are one family at CONFIDENCE (stats.h), counted by TESTS.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "arrays.h"
#include "device_test.h"
#include "stats.h"

#define PI 3.14159265358979323846

enum { SEGMENTS = 60, SAMPLES = 1 << 15, COUNT = SEGMENTS * SAMPLES, LIGHTS = 4, PIECES = 8, PLANES = 9 };
enum { FLIGHTS = 16, CELLS = 32, CANDIDATES = 6 };
enum { TESTS = SEGMENTS * (3 + PIECES) + FLIGHTS * 8 };

static const char scatter_text[] =
    "#include \"scatter_point.h\"\n"
    "__kernel void test(__global const b_params *params, __global const b_light *lights,\n"
    "                   __global const b_medium *media, __global const real1 *ray, __global const real1 *u,\n"
    "                   __global real1 *out) {\n"
    "    uint n = get_global_size(0) * LANES, segment = AT / SAMPLES;\n"
    "    scene s;\n"
    "    s.params = params + segment;\n"
    "    s.lights = lights + segment * LIGHTS;\n"
    "    s.media = media + segment;\n"
    "    ray += 7 * segment, u += AT, out += AT;\n"
    "    medium m = medium_of(&s, I(0));\n"
    "    vec o = vmake(R(ray[0]), R(ray[1]), R(ray[2])), d = vmake(R(ray[3]), R(ray[4]), R(ray[5]));\n"
    "    in_scatter g = scatter_along(&s, o, d, R(ray[6]), &m, LOAD(u), LOAD(u + n), LOAD(u + 2 * n), TRUE_MASK);\n"
    "    STORE(out, g.some ? R(1) : R(0));\n"
    "    STORE(out + n, g.t);\n"
    "    STORE(out + 2 * n, g.wi.x); STORE(out + 3 * n, g.wi.y); STORE(out + 4 * n, g.wi.z);\n"
    "    STORE(out + 5 * n, g.distance);\n"
    "    STORE(out + 6 * n, g.value.r); STORE(out + 7 * n, g.value.g); STORE(out + 8 * n, g.value.b);\n"
    "}\n";

static b_params params[SEGMENTS];
static b_light lights[SEGMENTS][LIGHTS];
static b_medium media[SEGMENTS];
static double ray[SEGMENTS][7], u[3][COUNT], out[PLANES][COUNT];

/* ---- cases ------------------------------------------------------------------------------------------------------ */

static double random_in(uint64_t *seed, double low, double high) { return low + (high - low) * test_random_unit(seed); }

static void random_direction(uint64_t *seed, double direction[3]) {
    double z = random_in(seed, -1, 1), phi = random_in(seed, 0, 2 * PI), r = sqrt(1 - z * z);
    direction[0] = r * cos(phi), direction[1] = r * sin(phi), direction[2] = z;
}

/* Around the segment, spots aimed at some point of it. */
static void make_light(uint64_t *seed, int segment, int k, double scale) {
    static const double cutoffs[] = {5, 30, 89, 120, 150, 179};
    b_light *light = &lights[segment][k];
    double axis[3], length = 0, along = random_in(seed, 0, 1), cutoff = cutoffs[(segment + k) % 6] * PI / 180;
    double beam = cutoff * ((segment + k) % 2 ? 0.75 : 1);
    int kind = (segment / 3 + k) % 5;
    light->kind = kind == 0 ? LIGHT_POINT : kind == 1 ? LIGHT_DIRECTIONAL : LIGHT_SPOT;
    light->texture = -1;
    for (int i = 0; i < 3; i++) {
        light->position[i] = (float)(scale * random_in(seed, -1, 1));
        light->intensity[i] = (float)random_in(seed, 0.5, 5);
        axis[i] = ray[segment][i] + along * ray[segment][6] * ray[segment][3 + i] - light->position[i];
        length += axis[i] * axis[i];
    }
    for (int i = 0; i < 3; i++) light->axis[i] = (float)(axis[i] / sqrt(length) * (cutoff > 2 && k == 0 ? -1 : 1));
    light->cutoff = (float)cutoff;
    light->beam = (float)beam;
    light->inv_fade = cutoff > beam ? (float)(1 / (cutoff - beam)) : 1e30f;
    light->v_cutoff = (float)(2 * pow(sin(cutoff / 2), 2));
    light->v_beam = (float)(2 * pow(sin(beam / 2), 2));
}

static void make_segment(uint64_t *seed, int segment) {
    static const double sigmas[] = {1e-6, 0.01, 0.3, 2, 50}, means[] = {-0.7, 0, 0.9, 0.3};
    static const double tints[2][3] = {{1, 1, 1}, {0.6, 1, 1.5}};
    double sigma = sigmas[segment % 5], scale = sigma > 10 ? 0.1 : 1, d[3];
    random_direction(seed, d);
    for (int i = 0; i < 3; i++) {
        ray[segment][3 + i] = (float)d[i];
        ray[segment][i] = (float)(scale * (random_in(seed, -0.7, 0.7) - 1.5 * d[i]));
        media[segment].sigma_t[i] = (float)(sigma * tints[segment % 2][i]);
        media[segment].albedo[i] = (float)random_in(seed, 0.3, 1);
    }
    ray[segment][6] = (float)(scale * pow(10, random_in(seed, -0.5, 1)));
    media[segment].g = (float)means[segment % 4];
    params[segment].light_count = 1 + segment % LIGHTS;
    params[segment].medium_count = 1;
    for (int k = 0; k < LIGHTS; k++) make_light(seed, segment, k, scale);
}

static void gather_light(uint32_t lanes, brume_precision precision) {
    uint64_t seed = 11;
    memset(lights, 0, sizeof lights);
    for (int i = 0; i < SEGMENTS; i++) make_segment(&seed, i);
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < COUNT; i++) u[k][i] = test_random_unit(&seed);
    const device_array arrays[] = {{READ_RAW, params, sizeof params}, {READ_RAW, lights, sizeof lights},
                                   {READ_RAW, media, sizeof media}, {READ_REAL, ray, 7 * SEGMENTS},
                                   {READ_REAL, u, 3 * (size_t)COUNT}, {WRITE_REAL, out, (size_t)PLANES * COUNT}};
    char options[300];
    snprintf(options, sizeof options, FEATURES_ARE(BEAM_FEATURES) " -DSTRATEGY=5 -DSAMPLES=%d -DLIGHTS=%d", SAMPLES,
             LIGHTS);
    device_test_run(scatter_text, options, lanes, precision, COUNT, arrays, 6);
}

/* ---- the integral ----------------------------------------------------------------------------------------------- */

/* (1 - g^2) / (4 pi (1 + g^2 - 2 g cos)^(3/2)) */
static double phase(double cosine, double g) {
    return (1 - g * g) / (4 * PI * pow(1 + g * g - 2 * g * cosine, 1.5));
}

/* Light of one lamp scattered to the segment's start per length at t. */
static double scattered(int segment, const b_light *light, int channel, double t) {
    const double *o = ray[segment], *d = ray[segment] + 3;
    const b_medium *m = &media[segment];
    double sigma = m->sigma_t[channel], arriving = light->intensity[channel], w[3], r2 = 0, cosine = 0, axial = 0;
    for (int i = 0; i < 3; i++) w[i] = o[i] + t * d[i] - light->position[i], r2 += w[i] * w[i];
    for (int i = 0; i < 3; i++) {
        w[i] = light->kind == LIGHT_DIRECTIONAL ? light->axis[i] : w[i] / sqrt(r2);
        cosine -= w[i] * d[i];
        axial += w[i] * light->axis[i];
    }
    if (light->kind != LIGHT_DIRECTIONAL) arriving *= exp(-sigma * sqrt(r2)) / r2;
    if (light->kind == LIGHT_SPOT) {
        double angle = acos(fmax(-1, fmin(1, axial)));
        if (angle >= light->cutoff) arriving = 0;
        else if (angle > light->beam) arriving *= (light->cutoff - angle) / (light->cutoff - light->beam);
    }
    return sigma * m->albedo[channel] * exp(-sigma * t) * arriving * phase(cosine, m->g);
}

/* Over the angle x, t = t_closest + D tan x, for lamps with a place, t itself for directional light. */
typedef struct {
    int segment, channel;
    const b_light *light;
    double closest, D;
} integrand;

static double at(const integrand *f, double x) {
    if (f->light->kind == LIGHT_DIRECTIONAL) return scattered(f->segment, f->light, f->channel, x);
    double c = cos(x);
    return scattered(f->segment, f->light, f->channel, f->closest + f->D * tan(x)) * f->D / (c * c);
}

static double gauss(const integrand *f, double a, double b) {
    static const double nodes[4] = {0.1834346424956498, 0.5255324099163290, 0.7966664774136267, 0.9602898564975363};
    static const double weights[4] = {0.3626837833783620, 0.3137066458778873, 0.2223810344533745, 0.1012285362903763};
    double sum = 0, half = (b - a) / 2, middle = (a + b) / 2;
    for (int i = 0; i < 4; i++)
        sum += weights[i] * (at(f, middle - half * nodes[i]) + at(f, middle + half * nodes[i]));
    return sum * half;
}

static double refine(const integrand *f, double a, double b, double whole, double tolerance, int levels) {
    double middle = (a + b) / 2, left = gauss(f, a, middle), right = gauss(f, middle, b);
    if (levels == 0 || fabs(left + right - whole) <= tolerance + 1e-13 * fabs(whole)) return left + right;
    return refine(f, a, middle, left, tolerance / 2, levels - 1) +
           refine(f, middle, b, right, tolerance / 2, levels - 1);
}

/* Over t in [t0, t1]: parts of 1/64 each so that no narrow cone is missed, halved down to its edges. */
static double integral_of(int segment, const b_light *light, int channel, double t0, double t1) {
    integrand f = {segment, channel, light, 0, 0};
    double a = t0, b = t1, D2 = 0, sum = 0, rough[64];
    if (light->kind != LIGHT_DIRECTIONAL) {
        for (int i = 0; i < 3; i++) f.closest += (light->position[i] - ray[segment][i]) * ray[segment][3 + i];
        for (int i = 0; i < 3; i++)
            D2 += pow(light->position[i] - ray[segment][i] - f.closest * ray[segment][3 + i], 2);
        f.D = sqrt(D2);
        a = atan((t0 - f.closest) / f.D);
        b = atan((t1 - f.closest) / f.D);
    }
    for (int i = 0; i < 64; i++) sum += rough[i] = gauss(&f, a + (b - a) * i / 64, a + (b - a) * (i + 1) / 64);
    double tolerance = 1e-7 * sum / 64;
    sum = 0;
    for (int i = 0; i < 64; i++)
        sum += refine(&f, a + (b - a) * i / 64, a + (b - a) * (i + 1) / 64, rough[i], tolerance, 30);
    return sum;
}

static double expected_light(int segment, int channel, double t0, double t1) {
    double sum = 0;
    for (int k = 0; k < params[segment].light_count; k++)
        sum += integral_of(segment, &lights[segment][k], channel, t0, t1);
    return sum;
}

/* ---- tests of the estimate --------------------------------------------------------------------------------------- */

static int by_size(const void *a, const void *b) {
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* One sample's contribution: light that arrives from a lamp with a place crosses the medium to get there. */
static double contribution(int segment, int i, int channel) {
    if (out[0][i] == 0) return 0;
    double distance = out[5][i], sigma = media[segment].sigma_t[channel];
    return out[6 + channel][i] * (distance > 1e17 ? 1 : exp(-sigma * distance));
}

/* p of a mean, 1 where it is right to float's rounding: one directional light has no other error. */
static double mean_p(const double *values, size_t count, double expected) {
    double mean = 0;
    for (size_t i = 0; i < count; i++) mean += values[i] / (double)count;
    return fabs(mean - expected) <= 2e-6 * fabs(expected) ? 1 : stats_mean(values, count, expected);
}

/* Smallest p over the channels of the whole segment and PIECES pieces of it, all samples scaled by `bias`. Pieces hold
 * equal numbers of the first half of the samples, and are tested with the second half. */
static double segment_p(int segment, double bias) {
    static double values[SAMPLES], sorted[SAMPLES / 2];
    int first = segment * SAMPLES;
    double p = 1, t_end = ray[segment][6], from = 0;
    for (int c = 0; c < 3; c++) {
        for (int i = 0; i < SAMPLES; i++) values[i] = bias * contribution(segment, first + i, c);
        p = fmin(p, mean_p(values, SAMPLES, expected_light(segment, c, 0, t_end)));
    }
    memcpy(sorted, out[1] + first, sizeof sorted);
    qsort(sorted, SAMPLES / 2, sizeof *sorted, by_size);
    for (int k = 0; k < PIECES; k++) {
        double to = k == PIECES - 1 ? t_end : sorted[SAMPLES / 2 / PIECES * (k + 1)];
        int half = first + SAMPLES / 2;
        for (int i = 0; i < SAMPLES / 2; i++)
            values[i] = out[1][half + i] >= from && (out[1][half + i] < to || k == PIECES - 1)
                            ? bias * contribution(segment, half + i, 1) : 0;
        p = fmin(p, mean_p(values, SAMPLES / 2, expected_light(segment, 1, from, to)));
        from = to;
    }
    return p;
}

static void the_integral_is_met(void **state) {
    (void)state;
    if (!device_test_offers(BRUME_PRECISION_FLOAT)) skip();
    gather_light(16, BRUME_PRECISION_FLOAT);
    int noticed = 0;
    for (int segment = 0; segment < SEGMENTS; segment++) {
        double p = segment_p(segment, 1);
        if (p < stats_level(CONFIDENCE, TESTS)) fail_msg("segment %d: p = %g", segment, p);
        /* planted: 3 % too much light */
        noticed += segment_p(segment, 1.03) < stats_level(CONFIDENCE, TESTS);
    }
    if (noticed < SEGMENTS / 2) fail_msg("a bias of 3 %% was noticed for %d of %d segments", noticed, SEGMENTS);
}

/* Samples lie on the segment, and the light is where they say. */
static void points_and_directions_agree(void **state) {
    (void)state;
    if (!device_test_offers(BRUME_PRECISION_FLOAT)) skip();
    for (int i = 0; i < COUNT; i++) {
        const double *r = ray[i / SAMPLES];
        if (out[0][i] == 0) continue;
        double nearest = 1e30;
        assert_true(out[1][i] >= 0 && out[1][i] <= r[6]);
        for (int k = 0; k < params[i / SAMPLES].light_count; k++) {
            const b_light *light = &lights[i / SAMPLES][k];
            double off = 0;
            for (int c = 0; c < 3; c++) {
                double to = light->position[c] - (r[c] + out[1][i] * r[3 + c]);
                off += light->kind == LIGHT_DIRECTIONAL ? pow(out[2 + c][i] + light->axis[c], 2)
                                                        : pow(out[2 + c][i] * out[5][i] - to, 2);
            }
            nearest = fmin(nearest, sqrt(off));
        }
        /* coordinates are below 12 */
        if (!(nearest < 4e-6)) fail_msg("segment %d, sample %d: no light there, by %g", i / SAMPLES, i, nearest);
    }
}

static void every_width_gives_the_same_bits(void **state) {
    (void)state;
    if (!device_test_offers(BRUME_PRECISION_FLOAT)) skip();
    static double first[PLANES][COUNT];
    gather_light(16, BRUME_PRECISION_FLOAT);
    memcpy(first, out, sizeof out);
    gather_light(1, BRUME_PRECISION_FLOAT);
    assert_memory_equal(first, out, sizeof out);
}

/* ---- flights and choices ----------------------------------------------------------------------------------------- */

static const char flight_text[] =
    "#include \"medium.h\"\n"
    "#include \"reservoir.h\"\n"
    "__kernel void test(__global const real1 *cases, __global const real1 *u, __global real1 *out) {\n"
    "    uint n = get_global_size(0) * LANES;\n"
    "    __global const real1 *c = cases + AT / SAMPLES * 16;\n"
    "    u += AT, out += AT;\n"
    "    medium m = medium_none();\n"
    "    m.sigma_t = cmake(R(c[0]), R(c[1]), R(c[2]));\n"
    "    m.albedo = cmake(R(c[3]), R(c[4]), R(c[5]));\n"
    "    flight f = medium_flight(&m, cmake(R(c[6]), R(c[7]), R(c[8])), R(c[9]), LOAD(u), R(1) - LOAD(u + n));\n"
    "    STORE(out, f.scatters ? R(1) : R(0));\n"
    "    STORE(out + n, f.t);\n"
    "    STORE(out + 2 * n, f.weight.r); STORE(out + 3 * n, f.weight.g); STORE(out + 4 * n, f.weight.b);\n"
    "    reservoir r = reservoir_start(LOAD(u + 2 * n));\n"
    "    for (int k = 0; k < CANDIDATES; k++) reservoir_offer(&r, I(k), R(c[10 + k]), TRUE_MASK);\n"
    "    STORE(out + 5 * n, to_real(r.choice));\n"
    "    STORE(out + 6 * n, reservoir_share(&r));\n"
    "}\n";

/* extinction, albedo, throughput, length, then the weights of CANDIDATES lamps */
static double cases[FLIGHTS][16] = {
    {0.5, 0.5, 0.5, 0.9, 0.8, 0.7, 1, 1, 1, 2, 1, 1, 1, 1, 1, 1},
    {1e-6, 1e-6, 1e-6, 0.9, 0.8, 0.7, 1, 1, 1, 1e3, 1, 2, 3, 4, 5, 6},
    {50, 50, 50, 1, 1, 1, 1, 0.5, 0.2, 0.01, 0, 0, 3, 0, 0, 0},
    {0.2, 1, 3, 0.9, 0.9, 0.5, 1, 1, 1, 1, 0, 1, 0, 1e-3, 0, 1},
    {0.2, 1, 3, 0.9, 0.9, 0.5, 0.1, 2, 0.7, 1e18, 1e-20, 1e20, 1e10, 1, 0, 1e19},
    {3, 0.01, 1, 0.5, 1, 1, 1, 0.05, 0, 5, 1e-30, 3e-30, 0, 2e-30, 2e-30, 2e-30},
    {0, 1, 2, 0.5, 0.5, 0.5, 1, 1, 1, 0.7, 1, 0, 0, 0, 0, 9},
    {0, 0, 1, 1, 1, 1, 2, 1, 1, 1e18, 6, 5, 4, 3, 2, 1},
};

static void fly(uint32_t lanes) {
    uint64_t seed = 23;
    for (int f = 8; f < FLIGHTS; f++) { /* the rest at random */
        double sigma = pow(10, random_in(&seed, -3, 1.5));
        for (int k = 0; k < 3; k++) {
            cases[f][k] = (float)(sigma * random_in(&seed, 0.1, 1));
            cases[f][3 + k] = (float)random_in(&seed, 0.1, 1);
            cases[f][6 + k] = (float)random_in(&seed, 0.01, 1);
        }
        cases[f][9] = (float)(random_in(&seed, 0.1, 5) / sigma);
        for (int k = 0; k < CANDIDATES; k++) cases[f][10 + k] = (float)pow(10, random_in(&seed, -2, 2));
    }
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < FLIGHTS * SAMPLES; i++) u[k][i] = test_random_unit(&seed);
    enum { ALL = FLIGHTS * SAMPLES };
    /* planes of `out` are ALL long here, one after another */
    static double variates[3 * ALL];
    for (int k = 0; k < 3; k++) memcpy(variates + k * ALL, u[k], ALL * sizeof(double));
    const device_array arrays[] = {{READ_REAL, cases, FLIGHTS * 16}, {READ_REAL, variates, 3 * ALL},
                                   {WRITE_REAL, out, 7 * (size_t)ALL}};
    char options[300];
    snprintf(options, sizeof options, FEATURES_ARE(FOG_FEATURES) " -DSAMPLES=%d -DCANDIDATES=%d", SAMPLES, CANDIDATES);
    device_test_run(flight_text, options, lanes, BRUME_PRECISION_FLOAT, ALL, arrays, 3);
}

static double flown(int plane, int flight, int i) { return (&out[0][0])[(plane * FLIGHTS + flight) * SAMPLES + i]; }

/* Share of flights that scatter before t: the mean over the channels that throughput chooses from. */
static double scattered_share(const double *c, const double *sigma, double t) {
    double sum = c[6] + c[7] + c[8], share = 0;
    for (int k = 0; k < 3; k++) share -= c[6 + k] / sum * expm1(-sigma[k] * t);
    return share;
}

static double flight_p(int f, double extinction_scale) {
    const double *c = cases[f];
    double observed[CELLS + 1] = {0}, expected[CELLS + 1], sigma[3], largest = 0;
    for (int k = 0; k < 3; k++) sigma[k] = c[k] * extinction_scale, largest = fmax(largest, sigma[k]);
    double reach = fmin(c[9], 8 / largest);
    for (int i = 0; i < SAMPLES; i++) {
        int cell = (int)(flown(1, f, i) / reach * (CELLS - 1));
        observed[flown(0, f, i) == 0 ? CELLS : cell < CELLS ? cell : CELLS - 1]++;
    }
    for (int k = 0; k < CELLS; k++) {
        double to = k == CELLS - 1 ? c[9] : reach * (k + 1) / (CELLS - 1), from = reach * k / (CELLS - 1);
        expected[k] = SAMPLES * (scattered_share(c, sigma, to) - scattered_share(c, sigma, from));
    }
    expected[CELLS] = SAMPLES * (1 - scattered_share(c, sigma, c[9]));
    return stats_chi_square(observed, expected, CELLS + 1);
}

static void flights_follow_the_mixture(void **state) {
    (void)state;
    if (!device_test_offers(BRUME_PRECISION_FLOAT)) skip();
    fly(16);
    int noticed = 0;
    for (int f = 0; f < FLIGHTS; f++) {
        double p = flight_p(f, 1);
        if (p < stats_level(CONFIDENCE, TESTS)) fail_msg("flight %d: p = %g", f, p);
        noticed += flight_p(f, 1.15) < stats_level(CONFIDENCE, TESTS); /* planted */
    }
    assert_true(noticed > FLIGHTS / 2);
}

/* Weights make each channel's mean what passes, exp(-sigma t), and what scatters, albedo times the rest. */
static void flights_are_unbiased(void **state) {
    (void)state;
    if (!device_test_offers(BRUME_PRECISION_FLOAT)) skip();
    static double values[SAMPLES];
    fly(16);
    for (int f = 0; f < FLIGHTS; f++)
        for (int k = 0; k < 3; k++) {
            const double *c = cases[f];
            if (c[6 + k] == 0) continue; /* there is no throughput to weight */
            for (int scatters = 0; scatters < 2; scatters++) {
                double passes = exp(-c[k] * c[9]), expected = scatters ? -expm1(-c[k] * c[9]) * c[3 + k] : passes;
                double sum = c[6] + c[7] + c[8];
                for (int i = 0; i < SAMPLES; i++) {
                    double weight = flown(2 + k, f, i);
                    /* what the mixture promises: no more than the sum of the throughput's channels */
                    assert_true(weight >= 0 && weight * c[6 + k] <= sum * (1 + 1e-5));
                    values[i] = flown(0, f, i) == scatters ? weight : 0;
                }
                double p = stats_mean(values, SAMPLES, expected);
                /* flights so long or so short that all end alike have an exact answer instead of a spread */
                double spread = 0;
                for (int i = 0; i < SAMPLES; i++) spread = fmax(spread, fabs(values[i] - values[0]));
                if (spread < 1e-5) p = fabs(values[0] - expected) < 1e-5 + 40.0 / SAMPLES * sum / c[6 + k];
                if (p < stats_level(CONFIDENCE, TESTS))
                    fail_msg("flight %d, channel %d, scatters %d: p = %g", f, k, scatters, p);
            }
        }
}

/* Choices are made as often as reservoir_share says, which is a tenth even and nine tenths in proportion. */
static void choices_follow_their_share(void **state) {
    (void)state;
    if (!device_test_offers(BRUME_PRECISION_FLOAT)) skip();
    fly(16);
    for (int f = 0; f < FLIGHTS; f++) {
        const double *weights = cases[f] + 10;
        double observed[CANDIDATES] = {0}, expected[CANDIDATES], biased[CANDIDATES], total = 0, positive = 0;
        for (int k = 0; k < CANDIDATES; k++) total += weights[k], positive += weights[k] > 0;
        for (int k = 0; k < CANDIDATES; k++) {
            double share = weights[k] > 0 ? 0.1 / positive + 0.9 * weights[k] / total : 0;
            expected[k] = SAMPLES * share;
            biased[k] = SAMPLES * (0.95 * share + (weights[k] > 0 ? 0.05 / positive : 0));
        }
        for (int i = 0; i < SAMPLES; i++) {
            int choice = (int)flown(5, f, i);
            assert_true(choice >= 0 && choice < CANDIDATES);
            assert_true(fabs(flown(6, f, i) * SAMPLES - expected[choice]) < 1e-5 * expected[choice]);
            observed[choice]++;
        }
        double p = stats_chi_square(observed, expected, CANDIDATES);
        if (p < stats_level(CONFIDENCE, TESTS)) fail_msg("choices %d: p = %g", f, p);
        /* planted: one in twenty more is chosen evenly */
        if (f == 4) assert_true(stats_chi_square(observed, biased, CANDIDATES) < stats_level(CONFIDENCE, TESTS));
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_integral_is_met),
        cmocka_unit_test(points_and_directions_agree),
        cmocka_unit_test(every_width_gives_the_same_bits),
        cmocka_unit_test(flights_follow_the_mixture),
        cmocka_unit_test(flights_are_unbiased),
        cmocka_unit_test(choices_follow_their_share),
    };
    return cmocka_run_group_tests(tests, device_test_setup, device_test_teardown);
}

/* test_scatter.c -- what a segment through a medium gathers from lamps (cl/scatter_segment.h), against
 * quadrature. Free flight and the choice among lamps: test_flight.c.
 *
 * The estimate of light scattered along a segment is compared with the integral, as a whole and over eight pieces of
 * the segment, by t-tests. All statistical tests of this file are one family at CONFIDENCE (stats.h), counted by TESTS.
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
enum { TESTS = SEGMENTS * (3 + PIECES) };

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

static void random_direction(uint64_t *seed, double direction[3]) {
    double z = test_random_in(seed, -1, 1), phi = test_random_in(seed, 0, 2 * PI), r = sqrt(1 - z * z);
    direction[0] = r * cos(phi), direction[1] = r * sin(phi), direction[2] = z;
}

/* Around the segment, spots aimed at some point of it. */
static void make_light(uint64_t *seed, int segment, int k, double scale) {
    static const double cutoffs[] = {5, 30, 89, 120, 150, 179};
    b_light *light = &lights[segment][k];
    double axis[3], length = 0, along = test_random_in(seed, 0, 1), cutoff = cutoffs[(segment + k) % 6] * PI / 180;
    double beam = cutoff * ((segment + k) % 2 ? 0.75 : 1);
    int kind = (segment / 3 + k) % 5;
    light->kind = kind == 0 ? LIGHT_POINT : kind == 1 ? LIGHT_DIRECTIONAL : LIGHT_SPOT;
    light->texture = -1;
    for (int i = 0; i < 3; i++) {
        light->position[i] = (float)(scale * test_random_in(seed, -1, 1));
        light->intensity[i] = (float)test_random_in(seed, 0.5, 5);
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
        ray[segment][i] = (float)(scale * (test_random_in(seed, -0.7, 0.7) - 1.5 * d[i]));
        media[segment].sigma_t[i] = (float)(sigma * tints[segment % 2][i]);
        media[segment].albedo[i] = (float)test_random_in(seed, 0.3, 1);
    }
    ray[segment][6] = (float)(scale * pow(10, test_random_in(seed, -0.5, 1)));
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

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_integral_is_met),
        cmocka_unit_test(points_and_directions_agree),
        cmocka_unit_test(every_width_gives_the_same_bits),
    };
    return cmocka_run_group_tests(tests, device_test_setup, device_test_teardown);
}

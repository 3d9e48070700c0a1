/* test_flight.c -- free flight (cl/medium.h) and the choice among lamps (cl/reservoir.h): by chi-square against their
 * distributions, and weights by t-tests against their means. All statistical tests of this file are one family at
 * CONFIDENCE (stats.h), counted by TESTS.
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

enum { FLIGHTS = 16, SAMPLES = 1 << 15, COUNT = FLIGHTS * SAMPLES, PLANES = 7, CELLS = 32, CANDIDATES = 6 };
enum { TESTS = FLIGHTS * 8 };

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

static double u[3 * COUNT], out[PLANES][FLIGHTS][SAMPLES];

static void fly(uint32_t lanes) {
    uint64_t seed = 23;
    for (int f = 8; f < FLIGHTS; f++) { /* the rest at random */
        double sigma = pow(10, test_random_in(&seed, -3, 1.5));
        for (int k = 0; k < 3; k++) {
            cases[f][k] = (float)(sigma * test_random_in(&seed, 0.1, 1));
            cases[f][3 + k] = (float)test_random_in(&seed, 0.1, 1);
            cases[f][6 + k] = (float)test_random_in(&seed, 0.01, 1);
        }
        cases[f][9] = (float)(test_random_in(&seed, 0.1, 5) / sigma);
        for (int k = 0; k < CANDIDATES; k++) cases[f][10 + k] = (float)pow(10, test_random_in(&seed, -2, 2));
    }
    for (int i = 0; i < 3 * COUNT; i++) u[i] = test_random_unit(&seed);
    const device_array arrays[] = {{READ_REAL, cases, FLIGHTS * 16}, {READ_REAL, u, 3 * COUNT},
                                   {WRITE_REAL, out, PLANES * COUNT}};
    char options[300];
    snprintf(options, sizeof options, FEATURES_ARE(FOG_FEATURES) " -DSAMPLES=%d -DCANDIDATES=%d", SAMPLES, CANDIDATES);
    device_test_run(flight_text, options, lanes, BRUME_PRECISION_FLOAT, COUNT, arrays, 3);
}

static double flown(int plane, int flight, int i) { return out[plane][flight][i]; }

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
        cmocka_unit_test(flights_follow_the_mixture),
        cmocka_unit_test(flights_are_unbiased),
        cmocka_unit_test(choices_follow_their_share),
    };
    return cmocka_run_group_tests(tests, device_test_setup, device_test_teardown);
}

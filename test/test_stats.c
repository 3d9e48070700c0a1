/* test_stats.c -- the statistical machinery: tails against tables, and planted biases that must be noticed. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>

#include <cmocka.h>

#include "device_test.h"
#include "stats.h"

#define PI 3.14159265358979323846
enum { COUNT = 1 << 20 };

#define assert_near(x, y, tolerance) assert_true(fabs((x) - (y)) <= (tolerance))

/* Quantiles from Abramowitz & Stegun, tables 26.8 and 26.10; the last by the exact tail of 2 degrees, exp(-x / 2). */
static void tails_agree_with_tables(void **state) {
    (void)state;
    assert_near(stats_chi_square_tail(3.84146, 1), 0.05, 1e-6);
    assert_near(stats_chi_square_tail(18.3070, 10), 0.05, 1e-6);
    assert_near(stats_chi_square_tail(149.449, 100), 0.001, 1e-7);
    assert_near(stats_chi_square_tail(3.94030, 10), 0.95, 1e-6);
    assert_true(fabs(stats_chi_square_tail(60, 2) / exp(-30) - 1) < 1e-12);
    assert_near(stats_z_tail(1.959964), 0.05, 1e-7);
    assert_near(stats_t_tail(2.228139, 10), 0.05, 1e-7);
    assert_near(stats_t_tail(12.7062, 1), 0.05, 1e-6);
    assert_near(stats_t_tail(4.0, 1e9), stats_z_tail(4.0), 1e-9);
    assert_near(1 - pow(1 - stats_level(1e-3, 57), 57), 1e-3, 1e-12);
}

static double wave(const void *user, double x, double y) { return *(const double *)user * exp(-x * x) * sin(y); }
static double step(const void *user, double x, double y) { return (void)user, x + y < 0.9 ? 1 : 0; }

static void integrals_agree_with_closed_forms(void **state) {
    (void)state;
    double scale = 3;
    double exact = 3 * sqrt(PI) / 2 * erf(2) * (1 - cos(1.5));
    assert_near(stats_integrate(wave, &scale, 0, 2, 0, 1.5, 1e-10), exact, 1e-9);
    assert_near(stats_integrate(step, NULL, 0, 1, 0, 1, 1e-6), 0.405, 1e-4);
}

/* p-values of right samples are uniform themselves: not one of 200 below 1e-4 (right code fails 2 % of seeds), and
 * their mean is 1/2 within 4 standard errors. */
static void right_samples_pass(void **state) {
    (void)state;
    uint64_t seed = 3;
    double observed[64], expected[64], sum = 0;
    for (int test = 0; test < 200; test++) {
        for (int i = 0; i < 64; i++) observed[i] = 0, expected[i] = 4096 / 64.0;
        for (int i = 0; i < 4096; i++) observed[(int)(64 * test_random_unit(&seed))]++;
        double p = stats_chi_square(observed, expected, 64);
        assert_true(p > 1e-4);
        sum += p;
    }
    assert_near(sum / 200, 0.5, 4 * sqrt(1.0 / 12 / 200));
}

static double cosine_density(const void *user, double z, double phi) {
    (void)phi;
    double exponent = 1 + *(const double *)user;
    return (exponent + 1) / (2 * PI) * pow(z, exponent);
}

/* Directions by cosine around +z, with a share of them pulled to one side. */
static double sample_p(double bias, double tilt_pdf) {
    uint64_t seed = 4;
    double *x = malloc(3 * COUNT * sizeof *x), *y = x + COUNT, *z = y + COUNT;
    assert_non_null(x);
    for (int i = 0; i < COUNT; i++) {
        double u = test_random_unit(&seed), phi = 2 * PI * test_random_unit(&seed);
        phi += bias * sin(phi); /* density of phi: 1 / (1 + bias cos), 3 % too much at one side */
        x[i] = sqrt(u) * cos(phi);
        y[i] = sqrt(u) * sin(phi);
        z[i] = sqrt(1 - u);
    }
    const direction_grid grid = {16, 32, 0};
    double p = stats_directions(&grid, x, y, z, NULL, COUNT, cosine_density, &tilt_pdf);
    free(x);
    return p;
}

static void planted_biases_are_noticed(void **state) {
    (void)state;
    assert_true(sample_p(0, 0) > 1e-3);                        /* right: passes */
    assert_true(sample_p(0.03, 0) < stats_level(CONFIDENCE, 100)); /* samples off by 3 % */
    assert_true(sample_p(0, 0.03) < stats_level(CONFIDENCE, 100)); /* density off by 3 % of its exponent */
}

static void a_missing_factor_is_noticed(void **state) {
    (void)state;
    uint64_t seed = 5;
    static double values[COUNT];
    for (int i = 0; i < COUNT; i++) values[i] = 2 * test_random_unit(&seed);
    assert_true(stats_mean(values, COUNT, 1) > 1e-3);
    for (int i = 0; i < COUNT; i++) values[i] *= 1.01;
    assert_true(stats_mean(values, COUNT, 1) < CONFIDENCE);
}

static void impossible_outcomes_are_rejected(void **state) {
    (void)state;
    const double observed[] = {50, 50, 1}, expected[] = {50, 51, 0};
    assert_true(stats_chi_square(observed, expected, 3) == 0);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(tails_agree_with_tables),   cmocka_unit_test(integrals_agree_with_closed_forms),
        cmocka_unit_test(right_samples_pass),        cmocka_unit_test(planted_biases_are_noticed),
        cmocka_unit_test(a_missing_factor_is_noticed), cmocka_unit_test(impossible_outcomes_are_rejected),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

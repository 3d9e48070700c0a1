/* test_ladder.c -- the numbers that `ladder` judges pictures by, against values computed by hand, and planted errors
 * that they must show. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>

#include <cmocka.h>

#include "../apps/error_metrics.h"
#include "device_test.h"

#define assert_near(x, y, tolerance) assert_true(fabs((x) - (y)) <= (tolerance))

enum { COUNT = 4096 };

/* Two pixels: mean(R) = 2, so 0.04 is added to R^2. */
static void relative_error_agrees_with_hand(void **state)
{
    (void)state;
    const float reference[6] = {1, 1, 1, 3, 3, 3}, picture[6] = {1.5f, 1, 1, 3, 3, 1};
    double first = 0.25 / 1.04 / 3, second = 4 / 9.04 / 3;
    error_metrics m;
    assert_true(error_metrics_compute(picture, reference, 2, 0.5, &m));
    assert_near(m.mse, (first + second) / 2, 1e-15);
    assert_near(m.trimmed, first, 1e-15); /* the second pixel is the worse one */
    assert_near(m.ratio, 10.5 / 12, 1e-15);
    assert_near(m.deviates, (0.5 - 2) / sqrt(0.25 + 4), 1e-15);

    assert_true(error_metrics_compute(reference, reference, 2, 0, &m));
    assert_true(m.mse == 0 && m.trimmed == 0 && m.ratio == 1 && m.deviates == 0);
}

/* What finds no light at all is wrong by R^2 / (R^2 + 0.01 mean(R)^2). */
static void black_pictures_are_wrong_by_1(void **state)
{
    (void)state;
    const float black[6] = {0}, reference[6] = {2, 2, 2, 0, 0, 0};
    error_metrics m;
    assert_true(error_metrics_compute(black, reference, 2, 0, &m));
    assert_near(m.mse, 0.5 * 4 / 4.01, 1e-15);
    assert_true(m.ratio == 0);
    assert_true(error_metrics_compute(black, black, 2, 0, &m));
    assert_true(m.mse == 0);
}

static void trimming_drops_the_worst_pixels_only(void **state)
{
    (void)state;
    static float reference[3 * 2000], picture[3 * 2000];
    error_metrics m;
    for (int i = 0; i < 3 * 2000; i++)
        reference[i] = 1, picture[i] = 1.1f;
    picture[3 * 700] = 1001;
    picture[3 * 1999 + 2] = 501;
    double plain = 0.01 / 1.01;
    /* 0.1 % of 2000 are two pixels; 0.05 % are one, and the lesser firefly stays. */
    assert_true(error_metrics_compute(picture, reference, 2000, 0.001, &m));
    assert_near(m.trimmed, plain, 1e-8);
    assert_near(m.mse, (1998 * plain + 4 * plain / 3 + (1e6 + 2.5e5) / 1.01 / 3) / 2000, 1e-4);
    assert_true(error_metrics_compute(picture, reference, 2000, 0.0005, &m));
    assert_near(m.trimmed, (1998 * plain + 2 * plain / 3 + 2.5e5 / 1.01 / 3) / 1999, 1e-4);
}

/* Pixels of 1 with uniform noise, whose variance is width^2 / 12. */
static void add_noise(float *picture, double width, uint64_t *seed)
{
    for (int i = 0; i < 3 * COUNT; i += 3)
        picture[i] = picture[i + 1] = picture[i + 2] = (float)(1 + width * (test_random_unit(seed) - 0.5));
}

/* The standard error of the mean is 0.2 / sqrt(12 x 4096) = 0.0009: honest noise stays within 5 (all but once in two
 * million), a picture 1 % too bright or too dark is beyond that. */
static void a_planted_bias_shows(void **state)
{
    (void)state;
    static float reference[3 * COUNT], picture[3 * COUNT];
    uint64_t seed = 11;
    error_metrics m;
    for (int i = 0; i < 3 * COUNT; i++)
        reference[i] = 1;
    add_noise(picture, 0.2, &seed);
    assert_true(error_metrics_compute(picture, reference, COUNT, 0.001, &m));
    assert_true(fabs(m.deviates) < 5);
    for (int i = 0; i < 3 * COUNT; i++)
        picture[i] *= 1.01f;
    assert_true(error_metrics_compute(picture, reference, COUNT, 0.001, &m));
    assert_true(m.deviates > 5);
    for (int i = 0; i < 3 * COUNT; i++)
        picture[i] *= 0.98f;
    assert_true(error_metrics_compute(picture, reference, COUNT, 0.001, &m));
    assert_true(m.deviates < -5);
}

/* Without the truth, a pair tells the same error as the truth does: 0.04 / 12 / 1.01 = 0.0033. The spread of 4096
 * squares (kurtosis of the pair's triangle: 2.4, of the single: 1.8) makes 5 standard errors about 10 %. */
static void pairs_tell_the_error_of_each(void **state)
{
    (void)state;
    static float reference[3 * COUNT], a[3 * COUNT], b[3 * COUNT];
    uint64_t seed = 12;
    error_metrics m;
    for (int i = 0; i < 3 * COUNT; i++)
        reference[i] = 1;
    add_noise(a, 0.2, &seed);
    add_noise(b, 0.2, &seed);
    double expected = 0.04 / 12 / 1.01;
    assert_near(error_metrics_of_pair(a, b, reference, COUNT), expected, 0.1 * expected);
    assert_true(error_metrics_compute(a, reference, COUNT, 0, &m));
    assert_near(m.mse, expected, 0.1 * expected);

    const float r[3] = {1, 1, 2}, x[3] = {1.5f, 1, 2}, y[3] = {0.5f, 1, 4};
    double floor = 0.01 * 16 / 9;
    assert_near(error_metrics_of_pair(x, y, r, 1), (0.5 / (1 + floor) + 2 / (4 + floor)) / 3, 1e-15);
    const float variance[3] = {0.5f, 0, 2};
    assert_near(error_metrics_of_variance(variance, r, 1), (0.5 / (1 + floor) + 2 / (4 + floor)) / 3, 1e-15);
}

static void slopes_agree_with_hand(void **state)
{
    (void)state;
    const double x[5] = {4, 16, 64, 256, 1024}, e = exp(1);
    double y[5];
    for (int i = 0; i < 5; i++)
        y[i] = 3 * pow(x[i], -1.5);
    assert_near(error_metrics_slope(x, y, 5), -1.5, 1e-12);
    y[2] = 0; /* no error at all has no logarithm */
    assert_near(error_metrics_slope(x, y, 5), -1.5, 1e-12);
    /* Logarithms 0, 1, 2 and 0, 1, 3: 3 / 2. */
    const double u[3] = {1, e, e * e}, v[3] = {1, e, e * e * e};
    assert_near(error_metrics_slope(u, v, 3), 1.5, 1e-12);
    const double same[2] = {7, 7};
    assert_true(isnan(error_metrics_slope(same, v, 2)));
    assert_true(isnan(error_metrics_slope(x, y, 1)));
    assert_true(isnan(error_metrics_slope(x, y, 0)));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(relative_error_agrees_with_hand),
        cmocka_unit_test(black_pictures_are_wrong_by_1),
        cmocka_unit_test(trimming_drops_the_worst_pixels_only),
        cmocka_unit_test(a_planted_bias_shows),
        cmocka_unit_test(pairs_tell_the_error_of_each),
        cmocka_unit_test(slopes_agree_with_hand),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

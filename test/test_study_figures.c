/* test_study_figures.c -- the figures of `render-cli study` against values computed by hand, and planted errors that
 * they must tell apart. The same figures of whole pictures are held against numpy by test_study.c. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include "../apps/curves.h"
#include "../apps/error_metrics.h"
#include "../apps/flip.h"
#include "../apps/picture_file.h"
#include "device_test.h"

#define assert_near(x, y, tolerance) assert_true(fabs((x) - (y)) <= (tolerance))

enum { SIDE = 64, COUNT = SIDE * SIDE };

/* Two pixels: mean(R) = 2, so e = 0.2. */
static void percentages_agree_with_hand(void **state)
{
    (void)state;
    const float reference[6] = {1, 1, 1, 3, 3, 3}, picture[6] = {1.5f, 1, 1, 3, 3, -1};
    error_figures f;
    error_figures_compute(picture, reference, 2, 1, &f);
    assert_near(f.mape, (0.5 / 1.2 + 4 / 3.2) / 6, 1e-15);
    assert_near(f.smape, (0.5 / 2.7 + 4 / 4.2) / 6, 1e-15);
    error_figures_compute(reference, reference, 2, 1, &f);
    assert_true(f.mape == 0 && f.smape == 0 && f.fireflies == 0);
    const float black[6] = {0};
    error_figures_compute(black, black, 2, 1, &f);
    assert_true(f.mape == 0 && f.smape == 0 && f.fireflies == 0);
}

/* Grey 1 with one bright pixel of 9: beside it 8 is no firefly, elsewhere it is. */
static void fireflies_are_brighter_than_all_about_them(void **state)
{
    (void)state;
    static float reference[3 * COUNT], picture[3 * COUNT];
    error_figures f;
    for (int i = 0; i < 3 * COUNT; i++)
        reference[i] = picture[i] = 1;
    for (int c = 0; c < 3; c++) {
        reference[3 * (10 * SIDE + 10) + c] = 9;
        picture[3 * (11 * SIDE + 11) + c] = 8;
        picture[3 * (0 * SIDE + 0) + c] = 8;
        picture[3 * (40 * SIDE + 63) + c] = 8;
        picture[3 * (50 * SIDE + 50) + c] = 4.3f; /* 4 (1 + 0.1 x 1.002) = 4.4008 */
        picture[3 * (20 * SIDE + 50) + c] = 4.5f;
    }
    error_figures_compute(picture, reference, SIDE, SIDE, &f);
    assert_int_equal(f.fireflies, 3);
}

static void fill(float *picture, double value, double width, uint64_t *seed)
{
    for (int i = 0; i < 3 * COUNT; i++)
        picture[i] = (float)(value + width * (test_random_unit(seed) - 0.5));
}

/* A reference with noise of its own, a pair 5 % too bright with more noise: the pair's noise says nothing of the 5 %,
 * and the bias nothing of the noise. Of 4096 pixels the standard error is 0.00006, the bias squared 0.0025. Four
 * standard errors: once in 16,000. */
static void bias_and_noise_are_told_apart(void **state)
{
    (void)state;
    static float half[3 * COUNT], other[3 * COUNT], reference[3 * COUNT], a[3 * COUNT], b[3 * COUNT];
    uint64_t seed = 5;
    double sigma;
    fill(half, 1, 0.2, &seed);
    fill(other, 1, 0.2, &seed);
    for (int i = 0; i < 3 * COUNT; i++)
        reference[i] = 0.5f * (half[i] + other[i]);
    double own = 0.5 * error_metrics_of_pair(half, other, reference, COUNT);
    for (int biased = 0; biased < 2; biased++) {
        fill(a, biased ? 1.05 : 1, 0.4, &seed);
        fill(b, biased ? 1.05 : 1, 0.4, &seed);
        double expected = biased ? 0.0025 / 1.01 : 0;
        double bias = error_metrics_bias(a, b, reference, COUNT, own, &sigma);
        assert_true(sigma > 0 && sigma < 2e-4);
        assert_near(bias, expected, 4 * sigma + 0.03 * own);
        assert_near(error_metrics_of_pair(a, b, reference, COUNT), 0.16 / 12 / 1.01, 0.03 * 0.16 / 12);
    }
}

static void times_to_a_target_agree_with_hand(void **state)
{
    (void)state;
    const double times[3] = {1, 2, 4}, errors[3] = {0.8, 0.4, 0.2};
    curves_kind kind;
    assert_near(curves_time_to(times, errors, 3, 0.8 / 3, -1, 0, &kind), 3, 1e-12);
    assert_int_equal(kind, CURVES_BETWEEN);
    assert_near(curves_time_to(times, errors, 3, 1, -1, 0, &kind), 1, 0);
    assert_int_equal(kind, CURVES_AT_MOST);
    assert_near(curves_time_to(times, errors, 3, 0.05, -1, 0, &kind), 16, 1e-12);
    assert_int_equal(kind, CURVES_BEYOND);
    /* Of 0.2, 0.1 is bias: the noise has to fall to a tenth, with the square root of time. */
    assert_near(curves_time_to(times, errors, 3, 0.11, -0.5, 0.1, &kind), 400, 1e-9);
    assert_int_equal(kind, CURVES_BEYOND);
    assert_true(isinf(curves_time_to(times, errors, 3, 0.1, -1, 0.1, &kind)));
    assert_int_equal(kind, CURVES_NEVER);
    assert_true(isinf(curves_time_to(times, errors, 3, 0.1, NAN, 0, &kind)));
    assert_true(isinf(curves_time_to(times, errors, 0, 0.1, -1, 0, &kind)));

    assert_near(curves_error_at(times, errors, 3, 3), 0.8 / 3, 1e-12);
    assert_near(curves_error_at(times, errors, 3, 4), 0.2, 1e-12);
    assert_true(isnan(curves_error_at(times, errors, 3, 4.1)) && isnan(curves_error_at(times, errors, 3, 0.9)));
    assert_true(isnan(curves_error_at(times, errors, 0, 1)));
}

static void halving_agrees_with_hand(void **state)
{
    (void)state;
    assert_near(curves_halving(0.2, 0, -1), 2, 1e-12);
    assert_near(curves_halving(0.2, 0, -0.5), 4, 1e-12);
    assert_near(curves_halving(0.2, 0.05, -1), 3, 1e-12); /* noise 0.15 to 0.05 */
    assert_true(isinf(curves_halving(0.2, 0.1, -1)));
    assert_true(isinf(curves_halving(0.2, 0, 0.1)) && isinf(curves_halving(0.2, 0, NAN)));
}

static void the_front_is_what_nothing_beats(void **state)
{
    (void)state;
    const double times[7] = {1, 2, 2, 3, 4, 0, 5}, errors[7] = {8, 4, 5, 4, 1, 2, NAN};
    const int expected[7] = {1, 1, 0, 0, 1, 0, 0};
    int front[7];
    curves_front(times, errors, 7, front);
    assert_memory_equal(front, expected, sizeof front);
}

static void it_stops_before_the_limit(void **state)
{
    (void)state;
    assert_true(curves_goes_on(1, 2, 8, 1 << 20));
    assert_false(curves_goes_on(1.01, 2, 8, 1 << 20));
    assert_false(curves_goes_on(0.001, 2, 8, 8));
    assert_false(curves_goes_on(0.001, 2, 8, 15));
    assert_true(curves_goes_on(0.001, 2, 8, 16));
}

/* Black against white is a difference in lightness of 100 alone. The largest difference there is, of green and blue, is
 * 41.276 to the power of 0.7 (the paper's own constants); spread as the paper does: 0.967. */
static void flip_of_black_and_white(void **state)
{
    (void)state;
    static float black[3 * COUNT], white[3 * COUNT], map[COUNT];
    for (int i = 0; i < 3 * COUNT; i++)
        white[i] = 1;
    double colour = pow(100, 0.7), most = 41.276;
    double expected = 0.95 + (colour - 0.4 * most) / (0.6 * most) * 0.05;
    assert_near(flip_compute(black, white, SIDE, SIDE, 1, FLIP_PIXELS_PER_DEGREE, map), expected, 1e-5);
    assert_near(map[5], expected, 1e-5);
    assert_near(flip_compute(white, white, SIDE, SIDE, 1, FLIP_PIXELS_PER_DEGREE, NULL), 0, 0);
    /* Above white nothing is brighter. */
    for (int i = 0; i < 3 * COUNT; i++)
        black[i] = 7;
    assert_near(flip_compute(black, white, SIDE, SIDE, 1, FLIP_PIXELS_PER_DEGREE, NULL), 0, 0);
}

static void pictures_come_back_bit_by_bit(void **state)
{
    (void)state;
    static float picture[3 * 6 * 5];
    char path[] = "/tmp/test-study-XXXXXX";
    uint64_t seed = 3;
    for (int i = 0; i < 3 * 6 * 5; i++)
        picture[i] = (float)(1e3 * test_random_unit(&seed) - 5);
    int file = mkstemp(path);
    assert_true(file >= 0);
    close(file);
    assert_int_equal(picture_write_pfm(path, picture, 6, 5), 0);
    float *read = picture_read_pfm(path, 6, 5);
    assert_non_null(read);
    assert_memory_equal(read, picture, sizeof picture);
    free(read);
    assert_null(picture_read_pfm(path, 5, 6));
    assert_int_equal(truncate(path, 50), 0);
    assert_null(picture_read_pfm(path, 6, 5));
    unlink(path);
    assert_null(picture_read_pfm(path, 6, 5));
    assert_int_not_equal(picture_write_pfm("/no/such/folder/a.pfm", picture, 6, 5), 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(percentages_agree_with_hand),
        cmocka_unit_test(fireflies_are_brighter_than_all_about_them),
        cmocka_unit_test(bias_and_noise_are_told_apart),
        cmocka_unit_test(times_to_a_target_agree_with_hand),
        cmocka_unit_test(halving_agrees_with_hand),
        cmocka_unit_test(the_front_is_what_nothing_beats),
        cmocka_unit_test(it_stops_before_the_limit),
        cmocka_unit_test(flip_of_black_and_white),
        cmocka_unit_test(pictures_come_back_bit_by_bit),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

/* test_error_estimate.c -- the error that a picture tells of itself, against the one it has: on made-up pictures whose
 * pixels are integrals with a known answer, sampled by points made here. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "device_test.h"
#include "error_estimate.h"
#include "open_device.h"

enum { WIDTH = 72, HEIGHT = 56, PIXELS = WIDTH * HEIGHT, LEVELS = 7, MOST = 1 << LEVELS };

/* The first MOST points of a van der Corput sequence in base 2 with nested random scrambling (Owen 1995): every digit
 * is flipped or not by a coin of its own for each of the prefixes before it. */
static void scrambled_points(uint64_t *random, double points[MOST]) {
    uint8_t coins[2 * MOST];
    for (int i = 0; i < 2 * MOST; i++) coins[i] = test_random_bits(random) >> 63;
    for (int i = 0; i < MOST; i++) {
        double x = 0;
        int node = 1;
        for (int digit = 0; digit < LEVELS; digit++) {
            int bit = (i >> digit & 1) ^ coins[node];
            x += ldexp(bit, -digit - 1);
            node = 2 * node + (i >> digit & 1);
        }
        points[i] = x + ldexp(test_random_unit(random), -LEVELS);
    }
}

typedef enum kind { NOISE, SMOOTH, EDGE, DARK_EDGE, GLINT } kind;

/* What a pixel integrates over [0, 1); *mean is its integral. The picture is dark on the left. */
static double integrand(kind k, int x, int y, double u, double *mean) {
    double level = 0.05 + 0.03 * x;
    if (k == EDGE || k == DARK_EDGE) { /* 0 up to a place that differs from pixel to pixel */
        double most = k == EDGE ? 0.55 : 0.95, place = 0.05 + (most - 0.05) * fmod(0.754877666 * (x + WIDTH * y), 1.0);
        *mean = level * (1 - place);
        return u < place ? 0 : level;
    }
    if (k == GLINT) { /* bright fields, dark ones, and between them pixels that one sample in 128 finds light in */
        int column = x % 12;
        *mean = column < 5 ? 0 : column > 5 ? 1 : 1.0 / 128;
        return column < 5 ? 0 : column > 5 ? 0.9 + 0.2 * u : u < 1.0 / 128 ? 1 : 0;
    }
    *mean = level;
    return level * 2 * u;
}

typedef struct picture {
    float mean[3 * PIXELS], count[PIXELS];
    double truth[3 * PIXELS];
} picture;

/* Renders `samples`, showing the estimate each power of two on the way. */
static void render(kind k, uint64_t seed, int samples, brume_error_estimate *e, picture *p) {
    static double values[3 * PIXELS][MOST];
    uint64_t random = seed;
    for (int i = 0; i < 3 * PIXELS; i++) {
        double points[MOST];
        scrambled_points(&random, points);
        for (int j = 0; j < samples; j++) {
            double u = k == NOISE ? test_random_unit(&random) : points[j];
            values[i][j] = integrand(k, i / 3 % WIDTH, i / 3 / WIDTH, u, &p->truth[i]);
        }
    }
    for (int level = 0; 1 << level <= samples; level++) {
        for (int i = 0; i < 3 * PIXELS; i++) {
            double sum = 0;
            for (int j = 0; j < 1 << level; j++) sum += values[i][j];
            p->mean[i] = (float)ldexp(sum, -level);
        }
        for (int i = 0; i < PIXELS; i++) p->count[i] = (float)(1 << level);
        brume_error_estimate_update(e, p->mean, p->count, level);
    }
    for (int i = 0; i < 3 * PIXELS; i++) {
        double sum = 0;
        for (int j = 0; j < samples; j++) sum += values[i][j];
        p->mean[i] = (float)(sum / samples);
    }
    for (int i = 0; i < PIXELS; i++) p->count[i] = (float)samples;
}

static double true_relmse(const picture *p) {
    double sum = 0, error = 0;
    for (int i = 0; i < 3 * PIXELS; i++) sum += p->truth[i];
    double floor = 0.01 * pow(sum / (3.0 * PIXELS), 2);
    for (int i = 0; i < 3 * PIXELS; i++) {
        double d = p->mean[i] - p->truth[i];
        error += d * d / (p->truth[i] * p->truth[i] + floor);
    }
    return error / (3.0 * PIXELS);
}

static brume_error_result estimate_of(kind k, uint64_t seed, int samples, picture *p) {
    brume_error_estimate e;
    assert_int_equal(brume_error_estimate_create(context, WIDTH, HEIGHT, k == NOISE, &e), BRUME_OK);
    render(k, seed, samples, &e, p);
    brume_error_result r = brume_error_estimate_picture(&e, p->count);
    brume_error_estimate_free(&e);
    assert_true(r.known);
    return r;
}

/* With 4032 pixels of three channels the true error of a picture is within 2 % of its expectation (one standard
 * deviation), and the estimate within 5: a sixth is three of them. The order is what theory has: 1 for noise, 2 for an
 * edge in one dimension, 3 for a smooth integrand (Owen 1997). */
static void check(kind k, int samples, double order, double tolerance) {
    static picture p;
    brume_error_result r = estimate_of(k, 1000 + (uint64_t)samples, samples, &p);
    double truth = true_relmse(&p);
    if (fabs(log(r.relmse / truth)) > tolerance || fabs(r.order - order) > 0.25 ||
        r.low > truth * exp(tolerance) || r.high < truth * exp(-tolerance))
        fail_msg("kind %d, %d samples: relMSE %g (%g to %g), order %g; it is %g, order %g", (int)k, samples, r.relmse,
                 r.low, r.high, r.order, truth, order);
}

static void independent_samples(void **state) {
    (void)state;
    check(NOISE, 16, 1, 1.0 / 6);
    check(NOISE, 128, 1, 1.0 / 6);
}

static void smooth_integrands(void **state) {
    (void)state;
    check(SMOOTH, 16, 3, 1.0 / 6);
    check(SMOOTH, 128, 3, 1.0 / 6);
}

static void edges(void **state) {
    (void)state;
    check(EDGE, 32, 2, 1.0 / 6);
    check(EDGE, 128, 2, 1.0 / 6);
}

/* Where few samples of a pixel find any light, its R is as uncertain as its error, and so is what they are to each
 * other: a factor of two. */
static void edges_of_what_is_nearly_dark(void **state) {
    (void)state;
    static picture p;
    for (int samples = 16; samples <= 128; samples *= 2) {
        brume_error_result r = estimate_of(DARK_EDGE, (uint64_t)samples, samples, &p);
        double ratio = true_relmse(&p) / r.relmse;
        if (ratio < 0.5 || ratio > 2) fail_msg("%d samples: true over estimated relMSE is %g", samples, ratio);
    }
}

/* The edge of a beam: most of the error is in few dark pixels beside bright ones, which the light has met once. Of 1008
 * values 63 have by 8 samples, so that the true error has a standard deviation of an eighth. Planted: weights by what
 * pixels are, which is large where their error is. */
static void light_met_once(void **state) {
    (void)state;
    static picture p;
    for (int samples = 8; samples <= 16; samples *= 2) {
        brume_error_estimate e;
        assert_int_equal(brume_error_estimate_create(context, WIDTH, HEIGHT, 0, &e), BRUME_OK);
        render(GLINT, 40 + (uint64_t)samples, samples, &e, &p);
        double truth = true_relmse(&p), own = 0, mean = 0;
        brume_error_result r = brume_error_estimate_picture(&e, p.count);
        for (int i = 0; i < 3 * PIXELS; i++) mean += p.mean[i] / (3.0 * PIXELS);
        for (int i = 0; i < 3 * PIXELS; i++) {
            double square = (double)p.mean[i] * p.mean[i] + 0.01 * mean * mean;
            own += e.last[i] / square / (3.0 * PIXELS) / (pow(2, r.order) - 1);
        }
        brume_error_estimate_free(&e);
        print_message("%d samples: true over estimated %.2f, by the pixels' own weights %.2f\n", samples,
                      truth / r.relmse, truth / own);
        assert_true(truth / r.relmse > 0.5 && truth / r.relmse < 2);
        assert_true(truth / own > 2);
    }
}

/* Between powers of two the newest points count as a block of their own; in truth they fill the gaps of the others,
 * which is better: by up to a half here. */
static void any_number_of_samples(void **state) {
    (void)state;
    check(NOISE, 48, 1, 1.0 / 6);
    check(SMOOTH, 96, 3, 0.5);
    check(EDGE, 80, 2, 0.5);
}

/* Planted: that the difference of two doublings were the variance itself (true of independent samples alone), or that
 * it fell by 2^p and not by 2^p - 1 of it. */
static void wrong_formulas_are_seen(void **state) {
    (void)state;
    static picture p;
    brume_error_result r = estimate_of(SMOOTH, 7, 64, &p);
    double truth = true_relmse(&p), difference = r.relmse * (pow(2, r.order) - 1);
    assert_true(fabs(log(r.relmse / truth)) < 1.0 / 6);
    assert_true(log(difference / truth) > 1.0 / 6);
    r = estimate_of(NOISE, 7, 64, &p);
    truth = true_relmse(&p);
    assert_true(fabs(log(r.relmse / truth)) < 1.0 / 6);
    assert_true(log(truth / (r.relmse * (pow(2, r.order) - 1) * pow(2, -r.order))) > 1.0 / 6);
}

/* Without noise, none is claimed; without light, neither. */
static void no_error(void **state) {
    (void)state;
    static picture p;
    brume_error_estimate e;
    assert_int_equal(brume_error_estimate_create(context, WIDTH, HEIGHT, 0, &e), BRUME_OK);
    for (int shade = 0; shade < 2; shade++) {
        for (int level = 0; level <= 4; level++) {
            for (int i = 0; i < 3 * PIXELS; i++) p.mean[i] = (float)shade;
            for (int i = 0; i < PIXELS; i++) p.count[i] = (float)(1 << level);
            brume_error_estimate_update(&e, p.mean, p.count, level + 5 * shade);
        }
        brume_error_result r = brume_error_estimate_picture(&e, p.count);
        assert_true(r.known);
        if (shade == 0) assert_true(r.relmse == 0);
        assert_false(isnan(r.relmse) || isnan(r.low) || isnan(r.high) || isnan(r.order));
    }
    brume_error_estimate_free(&e);
}

/* A level comes again when other pixels reach it later: those that were there stay as they are. */
static void pixels_are_seen_once_a_level(void **state) {
    (void)state;
    static picture p;
    brume_error_estimate e;
    assert_int_equal(brume_error_estimate_create(context, WIDTH, HEIGHT, 0, &e), BRUME_OK);
    render(SMOOTH, 5, 16, &e, &p);
    double before = brume_error_estimate_picture(&e, p.count).relmse;
    brume_error_estimate_update(&e, p.mean, p.count, 4);
    assert_true(before > 0 && brume_error_estimate_picture(&e, p.count).relmse == before);
    brume_error_estimate_free(&e);
}

static void too_few_samples(void **state) {
    (void)state;
    static picture p;
    brume_error_estimate e;
    assert_int_equal(brume_error_estimate_create(context, WIDTH, HEIGHT, 0, &e), BRUME_OK);
    assert_false(brume_error_estimate_picture(&e, p.count).known);
    render(SMOOTH, 3, 4, &e, &p);
    assert_false(brume_error_estimate_picture(&e, p.count).known);
    brume_error_estimate_free(&e);
}

/* The variance of each pixel's mean, over a row of pixels alike. */
static void variance_of_pixels(void **state) {
    (void)state;
    static picture p;
    static float variance[3 * PIXELS];
    brume_error_estimate e;
    assert_int_equal(brume_error_estimate_create(context, WIDTH, HEIGHT, 0, &e), BRUME_OK);
    render(SMOOTH, 11, 32, &e, &p);
    assert_true(brume_error_estimate_variance(&e, p.count, variance));
    for (int x = 8; x < WIDTH; x += 16) {
        double told = 0, is = 0;
        for (int y = 0; y < HEIGHT; y++)
            for (int c = 0; c < 3; c++) {
                int i = 3 * (WIDTH * y + x) + c;
                told += variance[i];
                is += pow(p.mean[i] - p.truth[i], 2);
            }
        /* 168 values: their mean square has a standard deviation of 11 %. */
        assert_true(fabs(log(told / is)) < 0.5);
    }
    brume_error_estimate_free(&e);
}

/* V(n) = V(2^k) times this, from the blocks by hand: of order 1 it is 2^k / n. */
static void growth_between_powers(void **state) {
    (void)state;
    assert_true(fabs(brume_error_estimate_growth(64, 6, 1.7) - 1) < 1e-15);
    assert_true(fabs(brume_error_estimate_growth(48, 5, 1) - 32.0 / 48) < 1e-15);
    assert_true(fabs(brume_error_estimate_growth(1000, 9, 1) - 512.0 / 1000) < 1e-14);
    assert_true(fabs(brume_error_estimate_growth(3, 1, 2) - (4.0 / 9 + 4.0 / 9)) < 1e-15);
    assert_true(brume_error_estimate_growth(0, 0, 2) == 0);
    /* of a pixel whose last sample was dropped, and of one that has had more than were looked at */
    assert_true(fabs(brume_error_estimate_growth(31, 5, 1) - 32.0 / 31) < 1e-14);
    assert_true(fabs(brume_error_estimate_growth(64, 3, 2) - 1.0 / 64) < 1e-15);
}

/* Near a bright field a dark pixel has met one bright path: the worst error of the picture. By its own value it would
 * hardly count. */
static void a_bright_path_in_the_dark(void **state) {
    (void)state;
    enum { EDGE_X = WIDTH / 2, X = EDGE_X - 5, Y = HEIGHT / 2, HIT = X + WIDTH * Y, CALM = HIT - 3 * WIDTH };
    const double dark = 0.02, light = 2, hit = 0.5;
    brume_error_estimate e;
    assert_int_equal(brume_error_estimate_create(context, WIDTH, HEIGHT, 0, &e), BRUME_OK);
    for (int i = 0; i < PIXELS; i++)
        for (int c = 3 * i; c < 3 * i + 3; c++) {
            double value = i % WIDTH < EDGE_X ? dark : light, noise = 0.05 * value;
            e.mean[c] = (float)(i == HIT ? hit : value);
            e.last[c] = (float)(i == HIT ? (hit - dark) * (hit - dark) : noise * noise);
        }
    const float *weights = brume_error_estimate_weights(&e);
    assert_non_null(weights);
    double all = 0.5 * (dark + light), right = 1 / (dark * dark + 0.01 * all * all);
    assert_true(weights[3 * HIT] > 0.8 * right && weights[3 * HIT] < 1.1 * right);
    assert_true(weights[3 * CALM] > 0.9 * right && weights[3 * CALM] < 1.1 * right);
    assert_true(1 / (hit * hit + 0.01 * all * all) < 0.05 * right); /* what its own value says */
    brume_error_estimate_free(&e);
}

/* In fewer threads than there are pieces of work, as many, or more: the same bits. */
static void threads_change_nothing(void **state) {
    (void)state;
    enum { WIDE = 200, HIGH = 100, VALUES = 3 * WIDE * HIGH };
    static float count[WIDE * HIGH], variance[VALUES], alone_variance[VALUES], alone_weights[VALUES];
    brume_error_estimate e;
    uint64_t random = 31;
    assert_int_equal(brume_error_estimate_create(context, WIDE, HIGH, 0, &e), BRUME_OK);
    for (int i = 0; i < VALUES; i++) {
        e.mean[i] = (float)test_random_in(&random, 0.5, 1.5);
        e.last[i] = (float)test_random_in(&random, 0, 0.01);
        e.before[i] = (float)test_random_in(&random, 0, 0.03);
    }
    for (int i = 0; i < WIDE * HIGH; i++) {
        e.level[i] = (uint8_t)(4 + i / 3 % 3);
        count[i] = ldexpf(1, e.level[i]);
    }
    e.threads = 1;
    brume_error_result alone = brume_error_estimate_picture(&e, count);
    assert_true(alone.known);
    assert_true(brume_error_estimate_variance(&e, count, alone_variance));
    memcpy(alone_weights, e.weights, sizeof alone_weights);
    for (e.threads = 2; e.threads <= 16; e.threads *= 2) {
        free(e.weights);
        e.weights = NULL;
        brume_error_result r = brume_error_estimate_picture(&e, count);
        assert_true(r.relmse == alone.relmse && r.low == alone.low && r.high == alone.high && r.order == alone.order);
        assert_true(brume_error_estimate_variance(&e, count, variance));
        assert_memory_equal(variance, alone_variance, sizeof variance);
        assert_memory_equal(e.weights, alone_weights, sizeof alone_weights);
    }
    brume_error_estimate_free(&e);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(independent_samples),
        cmocka_unit_test(smooth_integrands),
        cmocka_unit_test(edges),
        cmocka_unit_test(edges_of_what_is_nearly_dark),
        cmocka_unit_test(light_met_once),
        cmocka_unit_test(any_number_of_samples),
        cmocka_unit_test(wrong_formulas_are_seen),
        cmocka_unit_test(no_error),
        cmocka_unit_test(pixels_are_seen_once_a_level),
        cmocka_unit_test(too_few_samples),
        cmocka_unit_test(variance_of_pixels),
        cmocka_unit_test(growth_between_powers),
        cmocka_unit_test(a_bright_path_in_the_dark),
        cmocka_unit_test(threads_change_nothing),
    };
    return cmocka_run_group_tests(tests, open_context, close_device);
}

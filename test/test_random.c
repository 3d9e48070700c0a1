/* test_random.c -- cl/random.h and cl/sobol.h: the points against Joe & Kuo's recurrence, nets stay nets through
 * scrambling and shuffling, and what should be independent is.
 *
 * Statistical tests: chi-square of pairs of numbers over a CELLS x CELLS grid, one family at CONFIDENCE (stats.h).
 * a_weak_hash_is_noticed plants a weak hash and a correlation of 3 %, and demands that they are seen.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "../cl/shared.h"
#include "device_test.h"
#include "stability.h"
#include "stats.h"

enum { COUNT = 1 << 18, CELLS = 16, PAIR_TESTS = 60 };

static const char text[] =
    "#include \"random.h\"\n"
    "__kernel void test(__global const b_params *p, __global const uint *x, __global const uint *y,\n"
    "                   __global const uint *sample, __global const uint *set, __global uint *out) {\n"
    "    rng r = random_start(p, LOAD_BITS(x + AT), LOAD_BITS(y + AT), LOAD_BITS(sample + AT));\n"
    "    random4 u = random_set(&r, LOAD_BITS(set + AT));\n"
    "    uint n = get_global_size(0) * LANES;\n"
    "    STORE_BITS(out + AT, u.x);\n"
    "    STORE_BITS(out + n + AT, u.y);\n"
    "    STORE_BITS(out + 2 * n + AT, u.z);\n"
    "    STORE_BITS(out + 3 * n + AT, u.w);\n"
    "    STORE_BITS(out + 4 * n + AT, r.key);\n"
    "}\n";

/* One number per element for each of x, y, sample and set; out: planes of four dimensions and the key. */
typedef struct numbers {
    uint32_t x[COUNT], y[COUNT], sample[COUNT], set[COUNT], out[5][COUNT];
} numbers;

static numbers a, b;

static void draw_by(const char *kernel, numbers *n, int sampler, uint32_t seed, uint32_t lanes,
                    brume_precision precision) {
    b_params params;
    memset(&params, 0, sizeof params);
    params.sampler = sampler;
    params.seed = seed;
    const device_array arrays[] = {{READ_RAW, &params, sizeof params}, {READ_BITS, n->x, COUNT},
                                   {READ_BITS, n->y, COUNT},           {READ_BITS, n->sample, COUNT},
                                   {READ_BITS, n->set, COUNT},         {WRITE_BITS, n->out, 5 * (size_t)COUNT}};
    device_test_run(kernel, NULL, lanes, precision, COUNT, arrays, 6);
}

static void draw(numbers *n, int sampler, uint32_t seed, uint32_t lanes, brume_precision precision) {
    draw_by(text, n, sampler, seed, lanes, precision);
}

/* Pixels of a 512 x 512 picture, one sample and set. */
static void choose_pixels(numbers *n, uint32_t sample, uint32_t set) {
    for (uint32_t i = 0; i < COUNT; i++) {
        n->x[i] = i % 512;
        n->y[i] = i / 512;
        n->sample[i] = sample;
        n->set[i] = set;
    }
}

/* p of pairs (u, v) being independent and uniform. */
static double pair_p(const uint32_t *u, const uint32_t *v, size_t count) {
    double observed[CELLS * CELLS] = {0}, expected[CELLS * CELLS];
    for (size_t i = 0; i < count; i++) observed[(u[i] >> 28) * CELLS + (v[i] >> 28)]++;
    for (int i = 0; i < CELLS * CELLS; i++) expected[i] = (double)count / (CELLS * CELLS);
    return stats_chi_square(observed, expected, CELLS * CELLS);
}

static int pairs_tested;

static void independent(const char *what, const uint32_t *u, const uint32_t *v) {
    double p = pair_p(u, v, COUNT);
    if (p < stats_level(CONFIDENCE, PAIR_TESTS)) fail_msg("%s are not independent: p = %g", what, p);
    assert_true(++pairs_tested <= PAIR_TESTS);
}

/* ---- the points -------------------------------------------------------------------------------------------------- */

/* Dimension d of the Sobol' sequence at index i, straight from the recurrence over a primitive polynomial of degree
 * `degree` with inner coefficients `inner` (Bratley & Fox 1988), 16 digits. */
static uint32_t sobol(int d, uint32_t i) {
    static const int degrees[4] = {0, 1, 2, 3}, inners[4] = {0, 0, 1, 1};
    static const uint32_t starts[4][3] = {{0}, {1}, {1, 3}, {1, 3, 1}};
    uint32_t m[16], x = 0;
    for (int k = 0; k < 16; k++) {
        if (d == 0) {
            m[k] = 1;
        } else if (k < degrees[d]) {
            m[k] = starts[d][k];
        } else {
            m[k] = m[k - degrees[d]] ^ (m[k - degrees[d]] << degrees[d]);
            for (int j = 1; j < degrees[d]; j++)
                if (inners[d] >> (degrees[d] - 1 - j) & 1) m[k] ^= m[k - j] << j;
        }
        if (i >> k & 1) x ^= m[k] << (31 - k);
    }
    return x;
}

static void points_follow_the_recurrence(void **state) {
    (void)state;
    if (!device_test_offers(BRUME_PRECISION_FLOAT)) skip();
    static const char points[] =
        "#include \"sobol.h\"\n"
        "__kernel void test(__global const uint *index, __global uint *out) {\n"
        "    ureal32 x0, x1, x2, x3;\n"
        "    sobol_reversed(LOAD_BITS(index + AT), &x0, &x1, &x2, &x3);\n"
        "    STORE_BITS(out + AT, reverse_bits(x0));\n"
        "    STORE_BITS(out + 65536 + AT, reverse_bits(x1));\n"
        "    STORE_BITS(out + 2 * 65536 + AT, reverse_bits(x2));\n"
        "    STORE_BITS(out + 3 * 65536 + AT, reverse_bits(x3));\n"
        "}\n";
    for (uint32_t i = 0; i < 65536; i++) a.x[i] = i;
    const device_array arrays[] = {{READ_BITS, a.x, 65536}, {WRITE_BITS, a.out, 4 * 65536}};
    device_test_run(points, NULL, 16, BRUME_PRECISION_FLOAT, 65536, arrays, 2);
    const uint32_t *out = &a.out[0][0];
    for (int d = 0; d < 4; d++)
        for (uint32_t i = 0; i < 65536; i++) assert_int_equal(out[d * 65536 + i], sobol(d, i));
}

/* 1 if the first 2^m points put one in each of the 2^m boxes of 2^-k by 2^-(m-k). */
static int is_net(const uint32_t *u, const uint32_t *v, int m, int k) {
    static unsigned char seen[1 << 16];
    memset(seen, 0, sizeof seen);
    for (uint32_t i = 0; i < 1u << m; i++) {
        uint64_t row = (uint64_t)u[i] << k >> 32, column = (uint64_t)v[i] << (m - k) >> 32;
        if (seen[row << (m - k) | column]++) return 0;
    }
    return 1;
}

/* (0, m, 2)-nets in dimensions 0 and 1, every dimension stratified by itself: for any prefix, pixel, set and block. */
static void scrambled_points_are_nets(void **state) {
    (void)state;
    if (!device_test_offers(BRUME_PRECISION_FLOAT)) skip();
    for (uint32_t i = 0; i < COUNT; i++) { /* four series of 2^16 */
        uint32_t series = i >> 16;
        a.x[i] = 17 * series;
        a.y[i] = 3;
        a.sample[i] = (i & 0xffff) + (series == 3 ? 7u << 16 : 0);
        a.set[i] = 5 * series;
    }
    draw(&a, SAMPLER_SOBOL, 1, 16, BRUME_PRECISION_FLOAT);
    for (int series = 0; series < 4; series++) {
        const uint32_t *u[4];
        for (int d = 0; d < 4; d++) u[d] = a.out[d] + (series << 16);
        for (int m = 1; m <= 16; m++) {
            for (int k = 0; k <= m; k++) assert_true(is_net(u[0], u[1], m, k));
            assert_true(is_net(u[2], u[2], m, m));
            assert_true(is_net(u[3], u[3], m, m));
        }
    }
}

/* Owen scrambling makes the variance of smooth integrands fall as n^-3: with 256 points its standard error must be far
 * below that of independent numbers. The bound, 1/8, is 8 x worse than the theory's order of magnitude. */
static void smooth_integrals_converge_fast(void **state) {
    (void)state;
    if (!device_test_offers(BRUME_PRECISION_FLOAT)) skip();
    double error[2] = {0};
    for (uint32_t i = 0; i < COUNT; i++) {
        a.x[i] = i >> 8;
        a.y[i] = a.set[i] = 9;
        a.sample[i] = i & 255;
    }
    for (int sampler = 0; sampler < 2; sampler++) {
        draw(&a, sampler, 2, 16, BRUME_PRECISION_FLOAT);
        double mean_of_means = 0;
        for (int pixel = 0; pixel < COUNT >> 8; pixel++) {
            double sum = 0;
            for (int i = 0; i < 256; i++) {
                double product = 1;
                for (int d = 0; d < 4; d++) product *= 1 + a.out[d][pixel << 8 | i] * 0x1p-32;
                sum += product;
            }
            double off = sum / 256 - 81.0 / 16;
            error[sampler] += off * off;
            mean_of_means += off;
        }
        error[sampler] = sqrt(error[sampler] / (COUNT >> 8));
        /* unbiased: the mean over 1024 pixels within 4 standard errors */
        assert_true(fabs(mean_of_means / (COUNT >> 8)) < 4 * error[sampler] / 32);
    }
    assert_int_equal(SAMPLER_INDEPENDENT, 1);
    assert_true(error[SAMPLER_SOBOL] < error[SAMPLER_INDEPENDENT] / 8);
    /* the independent one has the variance of the integrand, (7/3)^4 - (81/16)^2, within 10 % */
    double sigma = sqrt((pow(7.0 / 3, 4) - pow(81.0 / 16, 2)) / 256);
    assert_true(fabs(error[SAMPLER_INDEPENDENT] / sigma - 1) < 0.1);
}

/* ---- independence ------------------------------------------------------------------------------------------------ */

/* Between dimensions, neighbouring pixels, sets, samples, blocks and seeds, over the pixels of a picture. */
static void check_independence(int sampler) {
    choose_pixels(&a, 0, 0);
    draw(&a, sampler, 0, 16, BRUME_PRECISION_FLOAT);
    for (int d = 0; d < 4; d++) {
        independent("dimensions of a set", a.out[d], a.out[(d + 1) % 4]);
        memcpy(b.out[d], a.out[d] + 1, (COUNT - 1) * sizeof(uint32_t));
        b.out[d][COUNT - 1] = a.out[d][0];
        independent("neighbours in a row", a.out[d], b.out[d]);
        memcpy(b.out[d], a.out[d] + 512, (COUNT - 512) * sizeof(uint32_t));
        memcpy(b.out[d] + COUNT - 512, a.out[d], 512 * sizeof(uint32_t));
        independent("neighbours in a column", a.out[d], b.out[d]);
    }
    static const struct {
        const char *what;
        uint32_t sample, set, seed;
    } others[] = {{"set 0 and set 1", 0, 1, 0},
                  {"set 0 and set 3 of another bounce", 0, 11, 0},
                  {"seeds 0 and 1", 0, 0, 1},
                  {"blocks 0 and 1", 1 << 16, 0, 0},
                  {"blocks 0 and 2^15", 1u << 31, 0, 0}};
    for (size_t k = 0; k < sizeof others / sizeof others[0]; k++) {
        choose_pixels(&b, others[k].sample, others[k].set);
        draw(&b, sampler, others[k].seed, 16, BRUME_PRECISION_FLOAT);
        for (int d = 0; d < 4; d += 3) independent(others[k].what, a.out[d], b.out[d]);
    }
    if (sampler == SAMPLER_INDEPENDENT) {
        choose_pixels(&b, 1, 0);
        draw(&b, sampler, 0, 16, BRUME_PRECISION_FLOAT);
        independent("samples 0 and 1", a.out[0], b.out[0]);
    }
    /* one pixel, many samples: two sets are shuffled apart */
    for (uint32_t i = 0; i < COUNT; i++) {
        a.x[i] = a.y[i] = b.x[i] = b.y[i] = 100;
        a.sample[i] = b.sample[i] = i;
        a.set[i] = 3;
        b.set[i] = 4;
    }
    draw(&a, sampler, 0, 16, BRUME_PRECISION_FLOAT);
    draw(&b, sampler, 0, 16, BRUME_PRECISION_FLOAT);
    independent("two sets of one pixel", a.out[0], b.out[0]);
    independent("two sets of one pixel, other dimensions", a.out[2], b.out[1]);
}

static void sobol_numbers_are_independent(void **state) {
    (void)state;
    if (!device_test_offers(BRUME_PRECISION_FLOAT)) skip();
    check_independence(SAMPLER_SOBOL);
}

static void hashed_numbers_are_independent(void **state) {
    (void)state;
    if (!device_test_offers(BRUME_PRECISION_FLOAT)) skip();
    check_independence(SAMPLER_INDEPENDENT);
}

/* A pixel's points of the first block, and those of three later ones up to the last sample that there can be. */
static uint32_t count_repeats(const char *kernel) {
    static const uint32_t blocks[4] = {0, 1, 1000, 65535};
    uint32_t repeats = 0;
    for (uint32_t i = 0; i < COUNT; i++) {
        a.x[i] = a.y[i] = 100;
        a.set[i] = 3;
        a.sample[i] = (i & 65535) + (blocks[i >> 16] << 16);
    }
    draw_by(kernel, &a, SAMPLER_SOBOL, 0, 16, BRUME_PRECISION_FLOAT);
    for (uint32_t i = 65536; i < COUNT; i++) repeats += a.out[0][i] == a.out[0][i & 65535];
    return repeats;
}

/* Of 3 2^16 pairs of 32-bit numbers one in 20 000 has an equal pair by chance. */
static void later_blocks_of_samples_are_new(void **state) {
    (void)state;
    if (!device_test_offers(BRUME_PRECISION_FLOAT)) skip();
    uint32_t repeats = count_repeats(text);
    uint32_t naive = count_repeats(device_test_plant(
        "random.h", "seed = hash32(seed + (sample >> U32(16)));", "",
        strstr(text, "\n") + 1)); /* the planted header is there already */
    stability_row("hazard", "points beyond 2^16 samples of a pixel", "none comes again", "of 196 608", 0, repeats,
                  "naive %u", naive);
    assert_int_equal(naive, 3 * 65536);
}

/* Planted: one multiplication in place of the hash, then a share of 3 % of pairs that move together. */
static void a_weak_hash_is_noticed(void **state) {
    (void)state;
    uint64_t seed = 9;
    for (uint32_t i = 0; i < COUNT; i++) a.out[0][i] = (i ^ i >> 16) * 0x21f0aaadu;
    for (uint32_t i = 0; i < COUNT; i++) a.out[1][i] = a.out[0][(i + 1) % COUNT];
    assert_true(pair_p(a.out[0], a.out[1], COUNT) < stats_level(CONFIDENCE, PAIR_TESTS));
    for (uint32_t i = 0; i < COUNT; i++) {
        a.out[0][i] = (uint32_t)test_random_bits(&seed);
        a.out[1][i] = test_random_unit(&seed) < 0.03 ? a.out[0][i] : (uint32_t)test_random_bits(&seed);
    }
    assert_true(pair_p(a.out[0], a.out[1], COUNT) < stats_level(CONFIDENCE, PAIR_TESTS));
}

/* ---- bits and numbers -------------------------------------------------------------------------------------------- */

static int order(const void *x, const void *y) {
    uint32_t u = *(const uint32_t *)x, v = *(const uint32_t *)y;
    return (u > v) - (u < v);
}

static void pixels_have_keys_of_their_own(void **state) {
    (void)state;
    if (!device_test_offers(BRUME_PRECISION_FLOAT)) skip();
    choose_pixels(&a, 0, 0);
    for (int i = 0; i < COUNT; i++) a.x[i] += 65536 - 512, a.y[i] += 1000;
    draw(&a, SAMPLER_SOBOL, 0, 16, BRUME_PRECISION_FLOAT);
    qsort(a.out[4], COUNT, sizeof(uint32_t), order);
    for (int i = 1; i < COUNT; i++) assert_true(a.out[4][i] != a.out[4][i - 1]);
}

static void every_width_gives_the_same_bits(void **state) {
    (void)state;
    if (!device_test_offers(BRUME_PRECISION_FLOAT)) skip();
    uint64_t seed = 6;
    for (int i = 0; i < COUNT; i++) {
        a.x[i] = b.x[i] = (uint32_t)test_random_bits(&seed) & 0xffff;
        a.y[i] = b.y[i] = (uint32_t)test_random_bits(&seed) & 0xffff;
        a.sample[i] = b.sample[i] = (uint32_t)test_random_bits(&seed);
        a.set[i] = b.set[i] = (uint32_t)test_random_bits(&seed) & 0xfff;
    }
    static const uint32_t widths[] = {1, 4, 8};
    for (int sampler = 0; sampler < 2; sampler++) {
        draw(&a, sampler, 77, 16, BRUME_PRECISION_FLOAT);
        for (int w = 0; w < 3; w++) {
            draw(&b, sampler, 77, widths[w], BRUME_PRECISION_FLOAT);
            assert_memory_equal(a.out, b.out, sizeof a.out);
        }
        if (device_test_offers(BRUME_PRECISION_DOUBLE)) {
            draw(&b, sampler, 77, 8, BRUME_PRECISION_DOUBLE);
            assert_memory_equal(a.out, b.out, sizeof a.out);
        }
    }
}

static void check_conversions(brume_precision precision) {
    if (!device_test_offers(precision)) skip();
    static const char conversions[] =
        "#include \"random.h\"\n"
        "__kernel void test(__global const uint *bits, __global real1 *half_open, __global real1 *positive) {\n"
        "    STORE(half_open + AT, unit(LOAD_BITS(bits + AT)));\n"
        "    STORE(positive + AT, unit_positive(LOAD_BITS(bits + AT)));\n"
        "}\n";
    enum { N = 65536 };
    static double half_open[N], positive[N];
    uint64_t seed = 8;
    for (int i = 0; i < N; i++) a.x[i] = (uint32_t)test_random_bits(&seed) >> i % 32;
    a.x[0] = 0;
    a.x[1] = UINT32_MAX;
    a.x[2] = 0x80000000u;
    const device_array arrays[] = {{READ_BITS, a.x, N}, {WRITE_REAL, half_open, N}, {WRITE_REAL, positive, N}};
    device_test_run(conversions, NULL, 8, precision, N, arrays, 3);
    for (int i = 0; i < N; i++) {
        int wide = precision == BRUME_PRECISION_DOUBLE;
        assert_true(half_open[i] == (wide ? a.x[i] * 0x1p-32 : (a.x[i] >> 8) * 0x1p-24));
        assert_true(half_open[i] < 1 && positive[i] > 0 && positive[i] <= 1);
        double exact = (a.x[i] + 1.0) * 0x1p-32;
        assert_true(fabs(positive[i] / exact - 1) <= (wide ? 0 : 0x1p-23));
    }
    assert_true(positive[0] == 0x1p-32 && positive[1] == 1 && half_open[2] == 0.5);
}

static void conversions_in_float(void **state) {
    (void)state;
    check_conversions(BRUME_PRECISION_FLOAT);
}

static void conversions_in_double(void **state) {
    (void)state;
    check_conversions(BRUME_PRECISION_DOUBLE);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(points_follow_the_recurrence),
        cmocka_unit_test(scrambled_points_are_nets),
        cmocka_unit_test(smooth_integrals_converge_fast),
        cmocka_unit_test(sobol_numbers_are_independent),
        cmocka_unit_test(hashed_numbers_are_independent),
        cmocka_unit_test(later_blocks_of_samples_are_new),
        cmocka_unit_test(a_weak_hash_is_noticed),
        cmocka_unit_test(pixels_have_keys_of_their_own),
        cmocka_unit_test(every_width_gives_the_same_bits),
        cmocka_unit_test(conversions_in_float),
        cmocka_unit_test(conversions_in_double),
    };
    return cmocka_run_group_tests(tests, device_test_setup, device_test_teardown);
}

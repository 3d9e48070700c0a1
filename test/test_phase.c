/* test_phase.c -- cl/phase_hg.h against double twins: density, samples, mean cosine, from isotropic to nearly a mirror.
 *
 * Chi-square tests: one family at CONFIDENCE (stats.h) over TESTS, 2^18 samples each.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "device_test.h"
#include "stats.h"

#define PI 3.14159265358979323846

enum { COUNT = 1 << 18, CELLS = 16, MEANS = 9, AXES = 4, TESTS = 2 * MEANS * AXES };

static const double means[MEANS] = {0, 1e-6, 0.3, -0.5, 0.9, -0.9, 0.99, 0.999, -0.9999};
static const double axes[AXES][3] = {{0, 0, 1}, {0, 0, -1}, {0.6, -0.8, 0}, {-0.48, 0.6, 0.64}};

/* (1 - g^2) / (4 pi (1 + g^2 - 2 g cos)^(3/2)) with v = 1 - cos, which keeps the digits near a peak at v = 0 */
static double twin(double v, double g) {
    double x = (1 - g) * (1 - g) + 2 * g * v;
    return (1 - g * g) / (4 * PI * x * sqrt(x));
}

/* Share of directions within v of straight on. */
static double twin_share(double v, double g) {
    if (fabs(g) < 1e-4) return v / 2 + g / 2 * v * (1 - v / 2); /* to first order in g */
    double x = (1 - g) * (1 - g) + 2 * g * v;
    return (1 - g * g) / (2 * g) * (1 / (1 - g) - 1 / sqrt(x));
}

static double v_of(const double a[3], const double b[3]) {
    double dot = 0, aa = 0, bb = 0, apart = 0;
    for (int i = 0; i < 3; i++) dot += a[i] * b[i], aa += a[i] * a[i], bb += b[i] * b[i];
    if (dot < 0) return 1 - dot / sqrt(aa * bb);
    for (int i = 0; i < 3; i++) apart += pow(a[i] / sqrt(aa) - b[i] / sqrt(bb), 2);
    return apart / 2;
}

static double round_to(double x, brume_precision precision) {
    return precision == BRUME_PRECISION_DOUBLE ? x : (double)(float)x;
}

static double *array(size_t count) {
    double *a = malloc(count * sizeof *a);
    assert_non_null(a);
    return a;
}

static double *before, *after, *g, *u, *turn, *density, *length;

static int setup(void **state) {
    before = array(3 * COUNT), after = array(3 * COUNT);
    g = array(COUNT), u = array(COUNT), turn = array(COUNT), density = array(COUNT), length = array(COUNT);
    return device_test_setup(state);
}

static int teardown(void **state) {
    free(before), free(after), free(g), free(u), free(turn), free(density), free(length);
    return device_test_teardown(state);
}

/* ---- density ---- */

static void check_density(brume_precision precision) {
    if (!device_test_offers(precision)) skip();
    static const char text[] =
        "#include \"phase_hg.h\"\n"
        "FN vec load3(__global const real1 *p, uint n) {\n"
        "    return vmake(LOAD(p + AT), LOAD(p + n + AT), LOAD(p + 2 * n + AT));\n"
        "}\n"
        "__kernel void test(__global const real1 *a, __global const real1 *b, __global const real1 *g,\n"
        "                   __global real1 *out) {\n"
        "    uint n = get_global_size(0) * LANES;\n"
        "    STORE(out + AT, phase_hg(load3(a, n), load3(b, n), LOAD(g + AT)));\n"
        "}\n";
    uint64_t seed = 1;
    for (int i = 0; i < COUNT; i++) {
        double a[3], b[3], side[3], aa = 0, bb = 0;
        /* angles of all sizes around straight on and straight back */
        double angle = pow(10, -5 * test_random_unit(&seed)), to = i & 1 ? 1 : -1;
        for (int k = 0; k < 3; k++) {
            a[k] = test_random_unit(&seed) - 0.5;
            side[k] = test_random_unit(&seed) - 0.5;
            aa += a[k] * a[k];
        }
        for (int k = 0; k < 3; k++) {
            a[k] /= sqrt(aa);
            b[k] = to * a[k] + angle * side[k];
            bb += b[k] * b[k];
        }
        for (int k = 0; k < 3; k++) {
            before[k * COUNT + i] = round_to(a[k], precision);
            after[k * COUNT + i] = round_to(b[k] / sqrt(bb), precision);
        }
        g[i] = round_to(means[i / 2 % MEANS], precision);
    }
    const device_array arrays[] = {{READ_REAL, before, 3 * COUNT}, {READ_REAL, after, 3 * COUNT},
                                   {READ_REAL, g, COUNT}, {WRITE_REAL, density, COUNT}};
    device_test_run(text, NULL, 16, precision, COUNT, arrays, 4);
    /* the twin has double's digits too: angles of 1e-5 keep 11 of them */
    double tolerance = precision == BRUME_PRECISION_DOUBLE ? 1e-11 : 2e-6;
    for (int i = 0; i < COUNT; i++) {
        double a[3], b[3];
        for (int k = 0; k < 3; k++) {
            a[k] = before[k * COUNT + i] * (g[i] < 0 ? -1 : 1);
            b[k] = after[k * COUNT + i];
        }
        double exact = twin(v_of(a, b), fabs(g[i]));
        if (!(fabs(density[i] / exact - 1) < tolerance))
            fail_msg("g = %g, v = %g: %.9g instead of %.9g", g[i], v_of(a, b), density[i], exact);
    }
}

static void density_in_float(void **state) {
    (void)state;
    check_density(BRUME_PRECISION_FLOAT);
}

static void density_in_double(void **state) {
    (void)state;
    check_density(BRUME_PRECISION_DOUBLE);
}

/* Heights of the peak, (1 + g) / (4 pi (1 - g)^2), and of its opposite, (1 - g) / (4 pi (1 + g)^2); isotropic. */
static void known_heights(void **state) {
    (void)state;
    if (!device_test_offers(BRUME_PRECISION_FLOAT)) skip();
    static const char text[] =
        "#include \"phase_hg.h\"\n"
        "__kernel void test(__global const real1 *v, __global const real1 *g, __global real1 *out) {\n"
        "    STORE(out + AT, phase_hg_versine(LOAD(v + AT), LOAD(g + AT)));\n"
        "}\n";
    static const double expected[][3] = {
        {0, 0.99, 1583.58}, {0, 0.999, 159075.7}, {2, -0.99, 1583.58}, {1, 0, 0.0795774715},
        {2, 0.5, 0.0176838826}, {0, -0.5, 0.0176838826}, {1, 0.5, 0.0427058},
    };
    for (int i = 0; i < 16; i++) {
        u[i] = expected[i % 7][0];
        g[i] = expected[i % 7][1];
    }
    const device_array arrays[] = {{READ_REAL, u, 16}, {READ_REAL, g, 16}, {WRITE_REAL, density, 16}};
    device_test_run(text, NULL, 4, BRUME_PRECISION_FLOAT, 16, arrays, 3);
    /* g itself is rounded: (1 - 0.999f) is off by 1.3e-5 */
    for (int i = 0; i < 7; i++) assert_true(fabs(density[i] / expected[i][2] - 1) < 1e-4);
}

/* ---- samples ---- */

static const char sample_text[] =
    "#include \"phase_hg.h\"\n"
    "__kernel void test(__global const real1 *axis, __global const real1 *g, __global const real1 *u,\n"
    "                   __global const real1 *turn, __global real1 *after, __global real1 *density) {\n"
    "    uint n = get_global_size(0) * LANES;\n"
    "    vec d = vmake(R(axis[0]), R(axis[1]), R(axis[2]));\n"
    "    real p;\n"
    "    vec w = phase_hg_sample(d, LOAD(g + AT), LOAD(u + AT), LOAD(turn + AT), &p);\n"
    "    STORE(after + AT, w.x);\n"
    "    STORE(after + n + AT, w.y);\n"
    "    STORE(after + 2 * n + AT, w.z);\n"
    "    STORE(density + AT, p);\n"
    "}\n";

static void draw(const double axis[3], double mean, uint32_t lanes, brume_precision precision) {
    uint64_t seed = 7;
    for (int i = 0; i < COUNT; i++) {
        g[i] = mean;
        u[i] = test_random_unit(&seed);
        turn[i] = test_random_unit(&seed);
    }
    u[0] = turn[1] = 0; /* the ends of what a variate can be */
    u[2] = turn[3] = 1 - 0x1p-24;
    u[4] = 1;
    const device_array arrays[] = {{READ_REAL, (void *)(uintptr_t)axis, 3}, {READ_REAL, g, COUNT},
                                   {READ_REAL, u, COUNT}, {READ_REAL, turn, COUNT},
                                   {WRITE_REAL, after, 3 * COUNT}, {WRITE_REAL, density, COUNT}};
    device_test_run(sample_text, NULL, lanes, precision, COUNT, arrays, 6);
}

/* p of the samples being distributed as mean `claimed` says: share of v and angle about the axis are uniform. */
static double sample_p(const double axis[3], double claimed) {
    double observed[CELLS * CELLS] = {0}, expected[CELLS * CELLS];
    double t[3], s[3], away[3] = {fabs(axis[0]) < 0.5, fabs(axis[0]) >= 0.5, 0};
    t[0] = axis[1] * away[2] - axis[2] * away[1];
    t[1] = axis[2] * away[0] - axis[0] * away[2];
    t[2] = axis[0] * away[1] - axis[1] * away[0];
    s[0] = axis[1] * t[2] - axis[2] * t[1];
    s[1] = axis[2] * t[0] - axis[0] * t[2];
    s[2] = axis[0] * t[1] - axis[1] * t[0];
    for (int i = 0; i < CELLS * CELLS; i++) expected[i] = (double)COUNT / (CELLS * CELLS);
    for (int i = 0; i < COUNT; i++) {
        double w[3], peak[3], x = 0, y = 0;
        for (int k = 0; k < 3; k++) {
            w[k] = after[k * COUNT + i];
            peak[k] = axis[k] * (claimed < 0 ? -1 : 1);
            x += w[k] * t[k];
            y += w[k] * s[k];
        }
        int row = (int)(CELLS * twin_share(v_of(peak, w), fabs(claimed)));
        int column = (int)(CELLS * (atan2(y, x) / (2 * PI) + 0.5));
        row = row < 0 ? 0 : row < CELLS ? row : CELLS - 1;
        column = column < CELLS ? column : CELLS - 1;
        observed[row * CELLS + column]++;
    }
    return stats_chi_square(observed, expected, CELLS * CELLS);
}

static void samples_follow_the_density(void **state) {
    (void)state;
    if (!device_test_offers(BRUME_PRECISION_FLOAT)) skip();
    for (int m = 0; m < MEANS; m++)
        for (int a = 0; a < AXES; a++) {
            draw(axes[a], means[m], 16, BRUME_PRECISION_FLOAT);
            double worst_length = 0, worst_density = 0;
            for (int i = 0; i < COUNT; i++) {
                double square = 0, mean = (float)means[m], q = 1 - fabs(mean) + 2 * fabs(mean) * u[i];
                for (int k = 0; k < 3; k++) square += after[k * COUNT + i] * after[k * COUNT + i];
                worst_length = fmax(worst_length, fabs(sqrt(square) - 1));
                double exact = q * q * q / (4 * PI * pow(1 - mean * mean, 2));
                worst_density = fmax(worst_density, fabs(density[i] / exact - 1));
            }
            if (!(worst_length < 2e-7)) fail_msg("g = %g: a direction's length is off by %g", means[m], worst_length);
            if (!(worst_density < 2e-6)) fail_msg("g = %g: a density is off by %g", means[m], worst_density);
            double p = sample_p(axes[a], means[m]);
            if (p < stats_level(CONFIDENCE, TESTS)) fail_msg("g = %g, axis %d: p = %g", means[m], a, p);
        }
}

/* <cos> = g: a t-test for each mean. */
static void mean_cosine_is_g(void **state) {
    (void)state;
    if (!device_test_offers(BRUME_PRECISION_FLOAT)) skip();
    for (int m = 0; m < MEANS; m++) {
        draw(axes[3], means[m], 8, BRUME_PRECISION_FLOAT);
        for (int i = 0; i < COUNT; i++) {
            length[i] = 0;
            for (int k = 0; k < 3; k++) length[i] += after[k * COUNT + i] * axes[3][k];
        }
        double p = stats_mean(length, COUNT, (float)means[m]);
        if (p < stats_level(CONFIDENCE, TESTS)) fail_msg("g = %g: p = %g", means[m], p);
    }
}

/* Planted: samples of g = 0.3 are not those of g = 0.32. */
static void another_mean_is_noticed(void **state) {
    (void)state;
    if (!device_test_offers(BRUME_PRECISION_FLOAT)) skip();
    draw(axes[3], 0.3, 16, BRUME_PRECISION_FLOAT);
    assert_true(sample_p(axes[3], 0.32) < stats_level(CONFIDENCE, TESTS));
}

static void every_width_gives_the_same_bits(void **state) {
    (void)state;
    if (!device_test_offers(BRUME_PRECISION_FLOAT)) skip();
    static const uint32_t widths[] = {1, 4, 8};
    double *first = array(4 * (size_t)COUNT);
    draw(axes[3], 0.9, 16, BRUME_PRECISION_FLOAT);
    memcpy(first, after, 3 * COUNT * sizeof *first);
    memcpy(first + 3 * COUNT, density, COUNT * sizeof *first);
    for (int w = 0; w < 3; w++) {
        draw(axes[3], 0.9, widths[w], BRUME_PRECISION_FLOAT);
        assert_memory_equal(after, first, 3 * COUNT * sizeof *first);
        assert_memory_equal(density, first + 3 * COUNT, COUNT * sizeof *first);
    }
    free(first);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(density_in_float),
        cmocka_unit_test(density_in_double),
        cmocka_unit_test(known_heights),
        cmocka_unit_test(samples_follow_the_density),
        cmocka_unit_test(mean_cosine_is_g),
        cmocka_unit_test(another_mean_is_noticed),
        cmocka_unit_test(every_width_gives_the_same_bits),
    };
    return cmocka_run_group_tests(tests, setup, teardown);
}

/* test_warp.c -- cl/warp.h: evenly means evenly, edges included.
 *
 * Chi-square tests: one family at CONFIDENCE (stats.h), 2^20 samples each.
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

enum { COUNT = 1 << 20, PLANES = 10, CELLS = 16, TESTS = 8 };

static const char text[] =
    "#include \"warp.h\"\n"
    "#define PUT(x) STORE(out + AT, x); out += n\n"
    "__kernel void test(__global const real1 *u, __global const real1 *v, __global real1 *out) {\n"
    "    uint n = get_global_size(0) * LANES;\n"
    "    real x, y, r = warp_disk(LOAD(u + AT), LOAD(v + AT), &x, &y);\n"
    "    PUT(x); PUT(y);\n"
    "    vec w = warp_cosine(LOAD(u + AT), LOAD(v + AT));\n"
    "    PUT(w.x); PUT(w.y); PUT(w.z);\n"
    "    w = warp_sphere(LOAD(u + AT), LOAD(v + AT));\n"
    "    PUT(w.x); PUT(w.y); PUT(w.z);\n"
    "    warp_triangle(LOAD(u + AT), LOAD(v + AT), &x, &y);\n"
    "    PUT(x); PUT(y);\n"
    "}\n";

static double u[COUNT], v[COUNT], out[PLANES][COUNT];

static void draw(uint32_t lanes, brume_precision precision) {
    static const double edges[] = {0, 0x1p-24, 0.25, 0.5, 0.75, 1 - 0x1p-24, 1};
    uint64_t seed = 1;
    for (int i = 0; i < COUNT; i++) {
        u[i] = i < 49 ? edges[i / 7] : test_random_unit(&seed);
        v[i] = i < 49 ? edges[i % 7] : test_random_unit(&seed);
    }
    const device_array arrays[] = {{READ_REAL, u, COUNT}, {READ_REAL, v, COUNT},
                                   {WRITE_REAL, out, (size_t)PLANES * COUNT}};
    device_test_run(text, NULL, lanes, precision, COUNT, arrays, 3);
}

static int group_setup(void **state) {
    int result = device_test_setup(state);
    if (result == 0 && device_test_offers(BRUME_PRECISION_FLOAT)) draw(16, BRUME_PRECISION_FLOAT);
    return result;
}

/* p of pairs in the unit square being uniform. */
static double square_p(double (*x)(int), double (*y)(int)) {
    double observed[CELLS * CELLS] = {0}, expected[CELLS * CELLS];
    for (int i = 0; i < COUNT; i++) {
        int row = (int)(CELLS * x(i)), column = (int)(CELLS * y(i));
        row = row < CELLS ? row : CELLS - 1;
        column = column < CELLS ? column : CELLS - 1;
        observed[row * CELLS + column]++;
    }
    for (int i = 0; i < CELLS * CELLS; i++) expected[i] = (double)COUNT / (CELLS * CELLS);
    return stats_chi_square(observed, expected, CELLS * CELLS);
}

static double disk_area(int i) { return out[0][i] * out[0][i] + out[1][i] * out[1][i]; }
static double disk_turn(int i) { return atan2(out[1][i], out[0][i]) / (2 * PI) + 0.5; }
static double triangle_area(int i) { return pow(out[8][i] + out[9][i], 2); }
static double triangle_side(int i) { return out[8][i] / fmax(out[8][i] + out[9][i], 1e-30); }

static void disk_is_even(void **state) {
    (void)state;
    if (!device_test_offers(BRUME_PRECISION_FLOAT)) skip();
    for (int i = 0; i < COUNT; i++) assert_true(disk_area(i) <= 1 + 3e-7);
    assert_true(square_p(disk_area, disk_turn) > stats_level(CONFIDENCE, TESTS));
}

static void triangle_is_even(void **state) {
    (void)state;
    if (!device_test_offers(BRUME_PRECISION_FLOAT)) skip();
    for (int i = 0; i < COUNT; i++) assert_true(out[8][i] >= 0 && out[9][i] >= 0 && out[8][i] + out[9][i] <= 1 + 1e-7);
    assert_true(square_p(triangle_area, triangle_side) > stats_level(CONFIDENCE, TESTS));
}

static double even(const void *user, double z, double phi) { return (void)user, (void)z, (void)phi, 1 / (4 * PI); }
static double cosine(const void *user, double z, double phi) { return (void)user, (void)phi, z / PI; }
static double tilted(const void *user, double z, double phi) { return (void)user, z / PI * (1 + 0.03 * cos(phi)); }

static void sphere_is_even(void **state) {
    (void)state;
    if (!device_test_offers(BRUME_PRECISION_FLOAT)) skip();
    for (int i = 0; i < COUNT; i++)
        assert_true(fabs(sqrt(out[5][i] * out[5][i] + out[6][i] * out[6][i] + out[7][i] * out[7][i]) - 1) < 4e-7);
    const direction_grid grid = {16, 16, -1};
    double p = stats_directions(&grid, out[5], out[6], out[7], NULL, COUNT, even, NULL);
    assert_true(p > stats_level(CONFIDENCE, TESTS));
}

static void hemisphere_goes_by_cosine(void **state) {
    (void)state;
    if (!device_test_offers(BRUME_PRECISION_FLOAT)) skip();
    for (int i = 0; i < COUNT; i++) {
        assert_true(out[4][i] > 0);
        assert_true(fabs(sqrt(out[2][i] * out[2][i] + out[3][i] * out[3][i] + out[4][i] * out[4][i]) - 1) < 4e-7);
    }
    const direction_grid grid = {16, 16, 0};
    double p = stats_directions(&grid, out[2], out[3], out[4], NULL, COUNT, cosine, NULL);
    assert_true(p > stats_level(CONFIDENCE, TESTS));
    /* planted: a density that is 3 % off to one side must be refused */
    p = stats_directions(&grid, out[2], out[3], out[4], NULL, COUNT, tilted, NULL);
    assert_true(p < stats_level(CONFIDENCE, TESTS));
}

/* Neighbours stay neighbours: moving u or v by a step never moves the image by more than a few steps. It is what
 * keeps well-spread points well spread (not so for the sphere at its poles). */
static void disk_and_triangle_are_continuous(void **state) {
    (void)state;
    if (!device_test_offers(BRUME_PRECISION_FLOAT)) skip();
    static double kept_u[COUNT], kept_v[COUNT];
    for (int i = 0; i < COUNT; i++) {
        kept_u[i] = u[i], kept_v[i] = v[i];
        u[i] = (i >> 1) % 1024 / 1024.0 + (i & 1) / 4096.0;
        v[i] = (i >> 11) / 512.0;
    }
    const device_array arrays[] = {{READ_REAL, u, COUNT}, {READ_REAL, v, COUNT},
                                   {WRITE_REAL, out, (size_t)PLANES * COUNT}};
    device_test_run(text, NULL, 8, BRUME_PRECISION_FLOAT, COUNT, arrays, 3);
    for (int i = 0; i < COUNT; i += 2) {
        assert_true(hypot(out[0][i] - out[0][i + 1], out[1][i] - out[1][i + 1]) < 3.5 / 4096);
        assert_true(hypot(out[8][i] - out[8][i + 1], out[9][i] - out[9][i + 1]) < 1.5 / 4096);
    }
    memcpy(u, kept_u, sizeof u);
    memcpy(v, kept_v, sizeof v);
}

static void every_width_gives_the_same_bits(void **state) {
    (void)state;
    if (!device_test_offers(BRUME_PRECISION_FLOAT)) skip();
    static double first[PLANES][COUNT];
    static const uint32_t widths[] = {1, 4, 8};
    draw(16, BRUME_PRECISION_FLOAT);
    memcpy(first, out, sizeof out);
    for (int w = 0; w < 3; w++) {
        draw(widths[w], BRUME_PRECISION_FLOAT);
        assert_memory_equal(first, out, sizeof out);
    }
    if (!device_test_offers(BRUME_PRECISION_DOUBLE)) return;
    draw(8, BRUME_PRECISION_DOUBLE);
    for (int p = 0; p < PLANES; p++)
        for (int i = 0; i < COUNT; i++) assert_true(fabs(out[p][i] - first[p][i]) < 2e-6 + (p == 4 ? 1e-3 : 0));
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(disk_is_even),
        cmocka_unit_test(triangle_is_even),
        cmocka_unit_test(sphere_is_even),
        cmocka_unit_test(hemisphere_goes_by_cosine),
        cmocka_unit_test(disk_and_triangle_are_continuous),
        cmocka_unit_test(every_width_gives_the_same_bits),
    };
    return cmocka_run_group_tests(tests, group_setup, device_test_teardown);
}

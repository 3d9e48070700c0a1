/* test_film.c -- adding up: ten million samples of a pixel, against exact sums, within the bound that cl/film.h states.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "../cl/shared.h"
#include "device_test.h"
#include "known_answer.h"
#include "stability.h"

enum { PIXEL_COUNT = 16, TABLE = 1024, ROUNDS = 9766, CHUNKS = 8 }; /* 10,000,384 samples each */

/* Each lane's samples, `range` of them, by ADD. */
#define KERNEL(ADD) \
    "#include \"film.h\"\n" \
    "__kernel void test(__global const LANE_REAL *table, __global const uint *range, __global float *planes) {\n" \
    "    film f;\n" \
    "    f.planes = planes; f.slots = 16; f.slot = I(AT) + lane_index();\n" \
    "    film_load(&f);\n" \
    "    for (uint i = range[0]; i < range[1]; i++) {\n" \
    "        " ADD "LOAD(table + (i % 1024) * 16 + AT), TRUE_MASK); }\n" \
    "    film_store(&f);\n" \
    "}\n"

static const char text[] = KERNEL("film_add(&f, 0, 1, ");

/* The sums behind VARIANCE, guides and layers. */
static const char dithered[] =
    KERNEL("film_dither(&f, hash32(U32(i * 16) + to_ureal32(I(AT) + lane_index()))); film_add_dithered(&f, 0, ");

/* What the pixels get, again and again: constants, of which most rounding errors have one sign; exponentially
 * distributed, with fireflies, of both signs, of all magnitudes. */
static void fill(double table[TABLE][PIXEL_COUNT]) {
    static const double constants[] = {1, 0.1, 1.0 / 3, PI, 0.7, 0.123456, 1e-20, 1e20, 1.0000001, 0.9};
    uint64_t state = 1;
    for (int i = 0; i < TABLE; i++) {
        double u = test_random_unit(&state), e = -log(u + 0x1p-25);
        for (int k = 0; k < 10; k++) table[i][k] = constants[k];
        table[i][10] = e;
        table[i][11] = 1e-3 * e * e;
        table[i][12] = i == 77 ? 1e6 : 0.01 * e;
        table[i][13] = i % 3 ? e : -0.9 * e;
        table[i][14] = ldexp(1 + u, i % 40 - 20);
        table[i][15] = i % 2 ? 4096 : 1e-4 * u;
        for (int k = 0; k < PIXEL_COUNT; k++) table[i][k] = (float)table[i][k];
    }
}

/* sum + rest of each pixel after the samples first ... end - 1. */
static void add_up(const char *kernel, brume_precision precision, double table[TABLE][PIXEL_COUNT], uint32_t first,
                   uint32_t end, double out[PIXEL_COUNT]) {
    uint32_t range[16] = {first, end}, planes[FILM_LAYER_PLANES * PIXEL_COUNT];
    float values[FILM_LAYER_PLANES * PIXEL_COUNT];
    const device_array arrays[] = {{READ_REAL, table, TABLE * PIXEL_COUNT}, {READ_BITS, range, 16},
                                   {WRITE_BITS, planes, FILM_LAYER_PLANES * PIXEL_COUNT}};
    device_test_run(kernel, NULL, 16, precision, PIXEL_COUNT, arrays, 3);
    memcpy(values, planes, sizeof values);
    for (int k = 0; k < PIXEL_COUNT; k++) out[k] = (double)values[k] + values[PIXEL_COUNT + k];
}

/* The largest error of `got` over the sum of absolute values, and whose it is. */
static double worst_of(double table[TABLE][PIXEL_COUNT], const double got[PIXEL_COUNT], int *where) {
    double worst = 0;
    for (int k = 0; k < PIXEL_COUNT; k++) {
        long double exact = 0, size = 0;
        for (int i = 0; i < TABLE; i++) {
            exact += table[i][k];
            size += fabs(table[i][k]);
        }
        double error = (double)(fabsl(got[k] - ROUNDS * exact) / (ROUNDS * size));
        if (!(error <= worst)) worst = error, *where = k;
    }
    return worst;
}

static void ten_million_samples(void **state) {
    (void)state;
    static double table[TABLE][PIXEL_COUNT];
    const double bound = (double)TABLE * ROUNDS * 0x1p-47;
    double got[PIXEL_COUNT];
    int where = 0;
    fill(table);
    for (int p = 0; p < 2; p++) {
        if (!device_test_offers((brume_precision)p)) skip();
        add_up(text, (brume_precision)p, table, 0, TABLE * ROUNDS, got);
        double worst = worst_of(table, got, &where);
        stability_row("film", p ? "10^7 samples of a pixel, in double" : "10^7 samples of a pixel", "exact sum",
                      "of the sum of |x|", bound, worst, "pixel %d of the test", where);
    }
    /* What it is there for: a compensation that is only added up. */
    const char *planted = device_test_plant(
        "film.h", "= m ? high : sum;\n    f->values[rest_plane] = m ? film_precision(low - (high - next))",
        "= m ? next : sum;\n    f->values[rest_plane] = m ? film_precision(low)", text);
    add_up(planted, BRUME_PRECISION_FLOAT, table, 0, TABLE * ROUNDS, got);
    double naive = worst_of(table, got, &where);
    print_message("as Neumaier: %.3g in pixel %d\n", naive, where);
    assert_true(naive > 1e-3);
}

/* One plane each, rounded at random: the bound is 5 of the largest standard errors there are. */
static void ten_million_dithered_samples(void **state) {
    (void)state;
    static const char constant[] = KERNEL("film_dither(&f, U32(123456789)); film_add_dithered(&f, 0, ");
    static const char naive[] = KERNEL("film_add_plain(&f, 0, ");
    static double table[TABLE][PIXEL_COUNT];
    const double bound = 5 * sqrt((double)TABLE * ROUNDS) * 0x1p-24;
    double got[PIXEL_COUNT];
    int where = 0;
    fill(table);
    for (int p = 0; p < 2; p++) {
        if (!device_test_offers((brume_precision)p)) skip();
        add_up(dithered, (brume_precision)p, table, 0, TABLE * ROUNDS, got);
        double worst = worst_of(table, got, &where);
        stability_row("film", p ? "10^7 squares or guides of a pixel, in double" : "10^7 squares or guides of a pixel",
                      "exact sum", "of the sum of |x|", bound, worst, "pixel %d of the test", where);
    }
    /* Planted: no dither, the same for all samples. */
    add_up(naive, BRUME_PRECISION_FLOAT, table, 0, TABLE * ROUNDS, got);
    double plain = worst_of(table, got, &where);
    add_up(constant, BRUME_PRECISION_FLOAT, table, 0, TABLE * ROUNDS, got);
    double same = worst_of(table, got, &where);
    print_message("plain sums: %.3g, one dither: %.3g\n", plain, same);
    assert_true(plain > bound && same > bound);
}

/* Films of parts of the samples, added up in different orders. */
static void parts_in_any_order(void **state) {
    (void)state;
    if (!device_test_offers(BRUME_PRECISION_FLOAT)) skip();
    static double table[TABLE][PIXEL_COUNT];
    double parts[CHUNKS][PIXEL_COUNT], forward[PIXEL_COUNT] = {0}, backward[PIXEL_COUNT] = {0};
    const uint32_t all = TABLE * ROUNDS;
    fill(table);
    for (uint32_t c = 0; c < CHUNKS; c++) /* of unequal length */
        add_up(text, BRUME_PRECISION_FLOAT, table, all / (CHUNKS * CHUNKS) * c * c,
               c + 1 < CHUNKS ? all / (CHUNKS * CHUNKS) * (c + 1) * (c + 1) : all, parts[c]);
    for (int c = 0; c < CHUNKS; c++)
        for (int k = 0; k < PIXEL_COUNT; k++) {
            forward[k] += parts[c][k];
            backward[k] += parts[CHUNKS - 1 - c][k];
        }
    int where = 0;
    double worst = fmax(worst_of(table, forward, &where), worst_of(table, backward, &where));
    stability_row("film", "10^7 samples in 8 parts, in either order", "exact sum", "of the sum of |x|", all * 0x1p-47,
                  worst, "pixel %d of the test", where);
}

/* The whole way, from the kernel to the channel: uniform light. */
static void a_pixel_of_one_radiance(void **state) {
    (void)state;
    NEEDS_DEVICE();
    const uint32_t samples = 10000000;
    const view ahead = {{0, 0, 0}, {0, 0, 1}, {0, 1, 0}, NARROW};
    brume_scene *scene = new_scene(4, samples);
    brume_film_desc film;
    brume_render *render;
    brume_render_desc desc = brume_render_desc_default();
    float pixel[3], count;
    must(brume_scene_get_film(scene, &film));
    film.width = film.height = 1;
    must(brume_scene_set_film(scene, &film));
    set_camera(scene, &ahead, BRUME_NONE);
    add_constant(scene, 0.1);
    desc.guides = 0;
    desc.error_estimate = 0;
    must(brume_render_create(device, scene, &desc, &render));
    must(brume_render_run(render, NULL, NULL));
    must(brume_render_read(render, BRUME_CHANNEL_RADIANCE, pixel, 3));
    must(brume_render_read(render, BRUME_CHANNEL_SAMPLE_COUNT, &count, 1));
    brume_render_destroy(render);
    brume_scene_destroy(scene);
    assert_true(count == (float)samples);
    stability_row("film", "10^7 samples of radiance 0.1, rendered", "0.1f", "relative", samples * 0x1p-47 + 0x1p-24,
                  fabs((double)pixel[0] / 0.1f - 1), "the only pixel");
}

static int setup(void **state) { return open_device(state) != 0 ? -1 : device_test_setup(state); }

static int teardown(void **state) {
    device_test_teardown(state);
    return close_device(state);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(ten_million_samples),
        cmocka_unit_test(ten_million_dithered_samples),
        cmocka_unit_test(parts_in_any_order),
        cmocka_unit_test(a_pixel_of_one_radiance),
    };
    return cmocka_run_group_tests(tests, setup, teardown);
}

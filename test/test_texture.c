/* test_texture.c -- cl/texture.h against Mitsuba 3's values for the same picture, and against a plain double twin. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "../cl/shared.h"
#include "device_test.h"

enum { COUNT = 1 << 16, TEXTURES = 9, TEXELS = 4 * 4 + 7 * 3 + 1 };

static const char text[] =
    "#include \"texture.h\"\n"
    "__kernel void test(__global const b_texture *textures, __global const float *texels, __global const uint *id,\n"
    "                   __global const real1 *u, __global const real1 *v, __global real1 *out) {\n"
    "    uint n = get_global_size(0) * LANES;\n"
    "    rgb c = texture_lookup(textures, texels, to_ireal(LOAD_BITS(id + AT)), LOAD(u + AT), LOAD(v + AT));\n"
    "    STORE(out + AT, c.r);\n"
    "    STORE(out + n + AT, c.g);\n"
    "    STORE(out + 2 * n + AT, c.b);\n"
    "}\n";

static b_texture textures[TEXTURES];
static float texels[3 * TEXELS];
static uint32_t id[COUNT];
static double u[COUNT], v[COUNT], out[3][COUNT], first[3][COUNT];

/* 0-5: 4 x 4 texels (row, column, 1), bilinear then nearest, by wrap mode; 6: 7 x 3 noise, transformed;
 * 7: checkerboard; 8: a single texel. */
static void make_textures(void) {
    static const float identity[6] = {1, 0, 0, 0, 1, 0}, skewed[6] = {2, -0.5f, 0.25f, 0.125f, 1.5f, -3};
    memset(textures, 0, sizeof textures);
    for (int i = 0; i < TEXTURES; i++) {
        b_texture *t = &textures[i];
        t->kind = i == 7 ? TEXTURE_CHECKERBOARD : TEXTURE_BITMAP;
        t->filter = i >= 3 && i < 6 ? TEXTURE_NEAREST : 0;
        t->wrap = i < 6 ? i % 3 : TEXTURE_WRAP_MIRROR;
        t->width = i < 6 ? 4 : i == 6 ? 7 : i == 8 ? 1 : 0;
        t->height = i < 6 ? 4 : i == 6 ? 3 : i == 8 ? 1 : 0;
        t->first = i < 6 ? 0 : i == 6 ? 16 : i == 8 ? 37 : 0;
        memcpy(t->to_uv, i == 6 ? skewed : identity, sizeof identity);
        for (int c = 0; c < 3; c++) t->color0[c] = 0.4f, t->color1[c] = 0.2f;
    }
    uint64_t seed = 1;
    for (int i = 0; i < 3 * TEXELS; i++) texels[i] = (float)test_random_unit(&seed);
    for (int i = 0; i < 16; i++) {
        texels[3 * i] = (float)(i / 4);
        texels[3 * i + 1] = (float)(i % 4);
        texels[3 * i + 2] = 1;
    }
}

static void look_up(uint32_t lanes, brume_precision precision) {
    const device_array arrays[] = {{READ_RAW, textures, sizeof textures}, {READ_RAW, texels, sizeof texels},
                                   {READ_BITS, id, COUNT},                {READ_REAL, u, COUNT},
                                   {READ_REAL, v, COUNT},                 {WRITE_REAL, out, 3 * (size_t)COUNT}};
    device_test_run(text, NULL, lanes, precision, COUNT, arrays, 6);
}

/* Mitsuba 3.9.1, bitmap and checkerboard eval() with raw = true. */
static void values_are_mitsubas(void **state) {
    (void)state;
    if (!device_test_offers(BRUME_PRECISION_FLOAT)) skip();
    static const double at[8][2] = {{0.125, 0.125}, {0.5, 0.1}, {0.1, 0.9}, {0, 0},
                                    {1, 1}, {1.3, -0.2}, {0.25, 0.5}, {-1.05, 2.05}};
    static const double bitmap[6][8][2] = {
        {{0, 0}, {0.3, 1.5}, {2.7, 0.3}, {1.5, 1.5}, {1.5, 1.5}, {2.7, 0.7}, {1.5, 0.5}, {0.9, 2.1}},
        {{0, 0}, {0, 1.5}, {3, 0}, {0, 0}, {3, 3}, {0, 3}, {1.5, 0.5}, {3, 0}},
        {{0, 0}, {0, 1.5}, {3, 0}, {0, 0}, {3, 3}, {0.3, 2.3}, {1.5, 0.5}, {0, 3}},
        {{0, 0}, {0, 2}, {3, 0}, {0, 0}, {0, 0}, {3, 1}, {2, 1}, {0, 3}},
        {{0, 0}, {0, 2}, {3, 0}, {0, 0}, {3, 3}, {0, 3}, {2, 1}, {3, 0}},
        {{0, 0}, {0, 2}, {3, 0}, {0, 0}, {3, 3}, {0, 2}, {2, 1}, {0, 3}},
    };
    static const double checker[8][3] = {{0.1, 0.1, 0.4}, {0.6, 0.1, 0.2}, {0.1, 0.6, 0.2}, {0.6, 0.6, 0.4},
                                         {-0.1, 0.1, 0.2}, {1.1, 0.1, 0.4}, {0.5, 0.1, 0.4}, {0, 0.5, 0.4}};
    for (int i = 0; i < COUNT; i++) {
        id[i] = i % 56 < 48 ? i % 56 / 8 : 7;
        u[i] = id[i] == 7 ? checker[i % 56 - 48][0] : at[i % 56 % 8][0];
        v[i] = id[i] == 7 ? checker[i % 56 - 48][1] : at[i % 56 % 8][1];
    }
    look_up(16, BRUME_PRECISION_FLOAT);
    for (int i = 0; i < COUNT; i++) {
        int k = i % 56;
        if (id[i] == 7) {
            for (int c = 0; c < 3; c++) assert_true(fabs(out[c][i] - checker[k - 48][2]) < 1e-7);
        } else {
            assert_true(fabs(out[0][i] - bitmap[k / 8][k % 8][0]) < 2e-6);
            assert_true(fabs(out[1][i] - bitmap[k / 8][k % 8][1]) < 2e-6);
            assert_true(out[2][i] == 1);
        }
    }
}

/* ---- twin ---- */

static long wrapped(long i, long n, int mode) {
    if (mode == TEXTURE_WRAP_CLAMP) return i < 0 ? 0 : i < n ? i : n - 1;
    long period = mode == TEXTURE_WRAP_MIRROR ? 2 * n : n, within = (i % period + period) % period;
    return within < n ? within : 2 * n - 1 - within;
}

static double twin(const b_texture *t, int channel, double at_u, double at_v) {
    const float *m = t->to_uv;
    double x = (m[0] * at_u + m[1] * at_v + m[2]) * t->width - 0.5;
    double y = (m[3] * at_u + m[4] * at_v + m[5]) * t->height - 0.5;
    double sum = 0, fx = x - floor(x), fy = y - floor(y);
    for (int k = 0; k < 4; k++) {
        long i = wrapped((long)floor(x) + (k & 1), t->width, t->wrap);
        long j = wrapped((long)floor(y) + (k >> 1), t->height, t->wrap);
        sum += (k & 1 ? fx : 1 - fx) * (k >> 1 ? fy : 1 - fy) * texels[3 * (t->first + j * t->width + i) + channel];
    }
    return sum;
}

/* Bilinear lookups far around the picture, several textures within one packet; the same bits at every width. */
static void bilinear_follows_its_twin(void **state) {
    (void)state;
    if (!device_test_offers(BRUME_PRECISION_FLOAT)) skip();
    static const uint32_t bilinear[] = {0, 1, 2, 6, 8}, widths[] = {1, 4, 8};
    uint64_t seed = 2;
    for (int i = 0; i < COUNT; i++) {
        id[i] = bilinear[test_random_bits(&seed) % 5];
        u[i] = (float)(10 * test_random_unit(&seed) - 5);
        v[i] = (float)(10 * test_random_unit(&seed) - 5);
    }
    look_up(16, BRUME_PRECISION_FLOAT);
    memcpy(first, out, sizeof out);
    for (int c = 0; c < 3; c++)
        for (int i = 0; i < COUNT; i++) {
            /* coordinates up to 20 repeats of 7 texels: their rounding, 2e-6, times 7 texels */
            double exact = twin(&textures[id[i]], c, u[i], v[i]);
            if (!(fabs(out[c][i] - exact) < 5e-5))
                fail_msg("texture %u at (%.9g, %.9g): %.9g instead of %.9g", id[i], u[i], v[i], out[c][i], exact);
        }
    for (int w = 0; w < 3; w++) {
        look_up(widths[w], BRUME_PRECISION_FLOAT);
        assert_memory_equal(first, out, sizeof out);
    }
}

static void bilinear_in_double(void **state) {
    (void)state;
    if (!device_test_offers(BRUME_PRECISION_DOUBLE)) skip();
    look_up(8, BRUME_PRECISION_DOUBLE);
    for (int c = 0; c < 3; c++)
        for (int i = 0; i < COUNT; i++) assert_true(fabs(out[c][i] - twin(&textures[id[i]], c, u[i], v[i])) < 1e-13);
}

/* Nonsense coordinates read no foreign memory: whatever finite ones give lies within the texels. */
static void wild_coordinates_stay_inside(void **state) {
    (void)state;
    if (!device_test_offers(BRUME_PRECISION_FLOAT)) skip();
    static const double wild[] = {1e9, -1e9, 1e30, -1e30, -1e-30, 3e38, INFINITY, NAN, 16777217, -0.0};
    for (int i = 0; i < COUNT; i++) {
        id[i] = i % 7;
        u[i] = wild[i % 10];
        v[i] = wild[i / 10 % 10];
    }
    look_up(16, BRUME_PRECISION_FLOAT);
    for (int i = 0; i < COUNT; i++)
        if (fabs(u[i]) < 1e31 && fabs(v[i]) < 1e31)
            for (int c = 0; c < 3; c++) assert_true(out[c][i] >= 0 && out[c][i] <= 3);
}

static int setup(void **state) {
    make_textures();
    return device_test_setup(state);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(values_are_mitsubas),
        cmocka_unit_test(bilinear_follows_its_twin),
        cmocka_unit_test(bilinear_in_double),
        cmocka_unit_test(wild_coordinates_stay_inside),
    };
    return cmocka_run_group_tests(tests, setup, device_test_teardown);
}

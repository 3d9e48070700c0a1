/* test_camera.c -- cl/camera.h against rays of Mitsuba 3, cl/filter.h against the table it draws from. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "../cl/shared.h"
#include "device_test.h"

enum { RAYS = 16, COUNT = 1 << 16, FILTER_SIZE = 64 };

/* look_at from (1, 2, 3) to (4, 1, -2), up +y; fov 40 degrees along x, 320 x 200 pixels, clipped at 0.5 and 20. */
static b_params example(int lens) {
    b_params p;
    memset(&p, 0, sizeof p);
    double z[3] = {3, -1, -5}, length = sqrt(35), x[3], y[3];
    for (int k = 0; k < 3; k++) z[k] /= length;
    /* left = up x forward */
    x[0] = z[2], x[1] = 0, x[2] = -z[0];
    length = hypot(x[0], x[2]);
    for (int k = 0; k < 3; k++) x[k] /= length;
    y[0] = z[1] * x[2] - z[2] * x[1], y[1] = z[2] * x[0] - z[0] * x[2], y[2] = z[0] * x[1] - z[1] * x[0];
    for (int k = 0; k < 3; k++) {
        p.camera_x[k] = (float)x[k];
        p.camera_y[k] = (float)y[k];
        p.camera_z[k] = (float)z[k];
        p.camera_o[k] = (float)(k + 1);
    }
    p.width = 320;
    p.height = 200;
    p.tan_x = (float)tan(20 * 3.14159265358979323846 / 180);
    p.tan_y = p.tan_x * 200 / 320;
    p.near_clip = 0.5f;
    p.far_clip = 20;
    p.aperture_radius = lens ? 0.25f : 0;
    p.focus_distance = 4;
    return p;
}

typedef struct ray {
    double at[4]; /* film x, y in pixels; lens u, v */
    double o[3], d[3], t_max;
} ray;

/* sample_ray() of Mitsuba 3.9.1's perspective and thinlens. */
static const ray pinhole[3] = {
    {{0, 0, 0.5, 0.5}, {1.107387, 2.027589, 2.467306}, {0.1973625, 0.05070416, -0.9790184}, 21.22028},
    {{320, 200, 0.1, 0.9}, {1.399706, 1.80338, 2.687539}, {0.7346047, -0.3613599, -0.5742603}, 21.22028},
    {{100.25, 33.5, 0.75, 0.3}, {1.201849, 1.990034, 2.531495}, {0.3955999, -0.01953261, -0.9182152}, 19.89916}};
static const ray thin_lens[3] = {
    {{0, 0, 0.5, 0.5}, {1.107387, 2.027589, 2.467306}, {0.1973625, 0.05070416, -0.9790184}, 21.22028},
    {{320, 200, 0.1, 0.9}, {1.516576, 1.925344, 2.733269}, {0.7060551, -0.3945747, -0.5880449}, 21.15611},
    {{100.25, 33.5, 0.75, 0.3}, {1.120382, 1.92667, 2.495287}, {0.4184774, -0.00179207, -0.9082254}, 19.89592}};

static void check_rays(int lens, const ray *expected, uint32_t lanes, brume_precision precision) {
    static const char text[] =
        "#include \"camera.h\"\n"
        "#define PUT(x) STORE(out + AT, x); out += 16\n"
        "__kernel void test(__global const b_params *p, __global const real1 *in, __global real1 *out) {\n"
        "    real x = LOAD(in + AT), y = LOAD(in + 16 + AT), u = LOAD(in + 32 + AT), v = LOAD(in + 48 + AT);\n"
        "    camera_ray r = camera_ray_at(p, x, y, u, v);\n"
        "    PUT(r.o.x); PUT(r.o.y); PUT(r.o.z); PUT(r.d.x); PUT(r.d.y); PUT(r.d.z); PUT(r.t_max);\n"
        "}\n";
    b_params p = example(lens);
    double in[4][RAYS], out[7][RAYS];
    for (int i = 0; i < RAYS; i++)
        for (int k = 0; k < 4; k++) in[k][i] = expected[i % 3].at[k];
    const device_array arrays[] = {{READ_RAW, &p, sizeof p}, {READ_REAL, in, 4 * RAYS}, {WRITE_REAL, out, 7 * RAYS}};
    device_test_run(text, NULL, lanes, precision, RAYS, arrays, 3);
    for (int i = 0; i < RAYS; i++) {
        for (int k = 0; k < 3; k++) {
            assert_true(fabs(out[k][i] - expected[i % 3].o[k]) < 2e-6);
            assert_true(fabs(out[3 + k][i] - expected[i % 3].d[k]) < 2e-6);
        }
        assert_true(fabs(out[6][i] / expected[i % 3].t_max - 1) < 1e-6);
        assert_true(fabs(out[3][i] * out[3][i] + out[4][i] * out[4][i] + out[5][i] * out[5][i] - 1) < 4e-7);
    }
}

static void rays_are_mitsubas(void **state) {
    (void)state;
    if (!device_test_offers(BRUME_PRECISION_FLOAT)) skip();
    check_rays(0, pinhole, 16, BRUME_PRECISION_FLOAT);
    check_rays(0, pinhole, 1, BRUME_PRECISION_FLOAT);
    check_rays(1, thin_lens, 16, BRUME_PRECISION_FLOAT);
    check_rays(1, thin_lens, 1, BRUME_PRECISION_FLOAT);
    if (device_test_offers(BRUME_PRECISION_DOUBLE)) check_rays(1, thin_lens, 8, BRUME_PRECISION_DOUBLE);
}

/* A table of a filter on [-2, 2] with zeros at 0.5 and 1.5: its offsets come back, piecewise linear, with the signs
 * + - + outwards. */
static void offsets_come_from_the_table(void **state) {
    (void)state;
    if (!device_test_offers(BRUME_PRECISION_FLOAT)) skip();
    static const char text[] =
        "#include \"filter.h\"\n"
        "__kernel void test(__global const b_params *p, __global const float *table, __global const real1 *u,\n"
        "                   __global real1 *offset, __global real1 *sign) {\n"
        "    scene s;\n"
        "    s.params = p;\n"
        "    s.filter = table;\n"
        "    filter_offset f = filter_sample(&s, LOAD(u + AT));\n"
        "    STORE(offset + AT, f.offset);\n"
        "    STORE(sign + AT, f.sign);\n"
        "}\n";
    static double u[COUNT], offset[COUNT], sign[COUNT];
    float table[FILTER_SIZE + 4];
    b_params p = example(0);
    for (int i = 0; i <= FILTER_SIZE; i++)
        table[i] = (float)(2 * sin(3.14159265358979 * i / FILTER_SIZE - 1.570796327));
    table[FILTER_SIZE + 1] = 2;
    table[FILTER_SIZE + 2] = 0.5f;
    table[FILTER_SIZE + 3] = 1.5f;
    for (int i = 0; i < COUNT; i++) u[i] = i * (1.0 / COUNT);
    u[COUNT - 1] = 1 - 0x1p-24;
    for (int box = 0; box < 2; box++) {
        p.filter_size = box ? 0 : FILTER_SIZE;
        p.filter_radius = box ? 0.5f : 2;
        const device_array arrays[] = {{READ_RAW, &p, sizeof p}, {READ_RAW, table, sizeof table}, {READ_REAL, u, COUNT},
                                       {WRITE_REAL, offset, COUNT}, {WRITE_REAL, sign, COUNT}};
        device_test_run(text, NULL, 16, BRUME_PRECISION_FLOAT, COUNT, arrays, 5);
        for (int i = 0; i < COUNT; i++) {
            int cell = (int)(u[i] * FILTER_SIZE);
            double share = u[i] * FILTER_SIZE - cell;
            double exact = box ? u[i] - 0.5 : table[cell] + share * (table[cell + 1] - table[cell]);
            assert_true(fabs(offset[i] - exact) < 1e-6);
            double size = fabs(offset[i]);
            assert_true(sign[i] == (box || size <= 0.5 || size > 1.5 ? 1 : -1));
        }
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(rays_are_mitsubas),
        cmocka_unit_test(offsets_come_from_the_table),
    };
    return cmocka_run_group_tests(tests, device_test_setup, device_test_teardown);
}

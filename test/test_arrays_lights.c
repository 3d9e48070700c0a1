/* test_arrays_lights.c -- the kernels' lights: cones, emitters, and environments' tables against integrals in double.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "built_arrays.h"

#define PI 3.14159265358979323846

static void test_spots(void **state) {
    (void)state;
    static const float cutoffs[] = {0.01f, 20, 90, 179.9f, 180};
    for (size_t i = 0; i < sizeof cutoffs / sizeof *cutoffs; i++)
        for (int hard = 0; hard < 2; hard++) {
            brume_scene *scene = scene_with_sensor();
            brume_light_desc spot = brume_light_desc_default(BRUME_LIGHT_SPOT);
            brume_arrays a;
            /* Along -x, and twice as large: the angles stay. */
            static const float m[16] = {0, 0, -2, 1, 0, 2, 0, 2, 2, 0, 0, 3, 0, 0, 0, 1};
            memcpy(spot.to_world, m, sizeof m);
            spot.cutoff_angle = cutoffs[i];
            spot.beam_width = hard ? cutoffs[i] : 0.5f * cutoffs[i];
            assert_int_equal(brume_scene_add_light(scene, &spot, NULL), BRUME_OK);
            build_arrays(scene, &a);
            const b_light *light = &a.lights[0];
            double cutoff = cutoffs[i] * (PI / 180);
            /* 1 - cos t = t^2/2 - t^4/24 + ... where the difference has no digits left */
            double v = cutoff < 1e-3 ? cutoff * cutoff / 2 * (1 - cutoff * cutoff / 12) : 1 - cos(cutoff);
            assert_close(light->v_cutoff, v, 2e-7);
            assert_close(light->cutoff, cutoff, 1e-7);
            assert_true(isfinite(light->inv_fade));
            if (hard)
                assert_true(light->inv_fade >= 1e30f);
            else
                assert_close(light->inv_fade, 2 / cutoff, 1e-6);
            assert_float_equal(light->position[1], 2, 0);
            assert_float_equal(light->axis[0], -1, 0);
            assert_float_equal(light->frame_x[2], 1, 0);
            assert_float_equal(light->frame_y[1], 1, 0);
            brume_arrays_free(&a);
            brume_scene_destroy(scene);
        }
}

static void test_emitters(void **state) {
    (void)state;
    brume_scene *scene = scene_with_sensor();
    brume_shape_desc rectangle = brume_shape_desc_default(BRUME_SHAPE_RECTANGLE);
    brume_shape_desc sphere = brume_shape_desc_default(BRUME_SHAPE_SPHERE);
    brume_shape_desc disk = brume_shape_desc_default(BRUME_SHAPE_DISK);
    brume_shape_desc dark = brume_shape_desc_default(BRUME_SHAPE_CUBE);
    brume_arrays a;
    rectangle.to_world[0] = 3, rectangle.to_world[5] = 0.5f;
    rectangle.radiance[0] = 2;
    sphere.radius = 0.25f;
    sphere.radiance[1] = 5;
    disk.to_world[0] = 2;
    disk.radiance[2] = 1;
    assert_int_equal(brume_scene_add_shape(scene, &sphere, NULL), BRUME_OK);
    assert_int_equal(brume_scene_add_shape(scene, &dark, NULL), BRUME_OK);
    assert_int_equal(brume_scene_add_shape(scene, &rectangle, NULL), BRUME_OK);
    assert_int_equal(brume_scene_add_shape(scene, &disk, NULL), BRUME_OK);
    build_arrays(scene, &a);
    /* Areas: half of 6 x 1 each; 4 pi r^2; pi times the half axes. */
    const double areas[4] = {3, 3, 4 * PI / 16, 2 * PI};
    const double luminances[4] = {2 * 0.2126, 2 * 0.2126, 5 * 0.7152, 0.0722};
    const int prims[4] = {12, 13, 14, 15}, shapes[4] = {2, 2, 0, 3};
    const int kinds[4] = {EMITTER_TRIANGLE, EMITTER_TRIANGLE, EMITTER_SPHERE, EMITTER_DISK};
    double total = 0;
    for (int i = 0; i < 4; i++)
        total += areas[i] * luminances[i];
    assert_int_equal(a.emitter_count, 4);
    assert_close(a.params.emitter_weight, total, 1e-6);
    const float *cdf = a.cdf + a.params.emitter_cdf;
    for (int i = 0; i < 4; i++) {
        assert_close(a.emitters[i].area, areas[i], 1e-6);
        assert_close(cdf[i + 1] - (double)cdf[i], areas[i] * luminances[i] / total, 1e-5);
        assert_int_equal(a.emitters[i].prim, prims[i]);
        assert_int_equal(a.emitters[i].shape, shapes[i]);
        assert_int_equal(a.emitters[i].kind, kinds[i]);
    }
    assert_float_equal(cdf[0], 0, 0);
    assert_float_equal(cdf[4], 1, 0);
    /* A shape without a bsdf is grey, and black if it emits. */
    assert_float_equal(a.bsdfs[a.shapes[1].bsdf].reflectance[0], 0.5f, 0);
    assert_float_equal(a.bsdfs[a.shapes[2].bsdf].reflectance[0], 0, 0);
    brume_arrays_free(&a);
    brume_scene_destroy(scene);
}

/* Luminance of the map as brume.h and cl/environment.h define it, at any (u, v). */
static double map_luminance(const float *texels, int width, int height, double u, double v) {
    double x = u * width - 0.5, y = v * (height - 1), sum = 0;
    for (int j = 0; j < height; j++)
        for (int i = -1; i <= width; i++) {
            double share = fmax(0, 1 - fabs(x - i)) * fmax(0, 1 - fabs(y - j));
            const float *t = texels + 3 * (j * width + (i + width) % width);
            sum += share * (0.2126 * t[0] + 0.7152 * t[1] + 0.0722 * t[2]);
        }
    return sum;
}

static void test_environment_tables(void **state) {
    (void)state;
    enum { WIDTH = 6, HEIGHT = 5, STEPS = 60 };
    float texels[3 * WIDTH * HEIGHT];
    for (int i = 0; i < 3 * WIDTH * HEIGHT; i++)
        texels[i] = (float)((i * 37) % 11) * (i % 7 == 0 ? 30.0f : 1.0f);
    for (int i = 0; i < 3 * WIDTH; i++)
        texels[3 * WIDTH * 3 + i] = 0; /* a black row between others */
    brume_scene *scene = scene_with_sensor();
    brume_light_desc sky = brume_light_desc_default(BRUME_LIGHT_ENVMAP);
    brume_arrays a;
    sky.width = WIDTH, sky.height = HEIGHT, sky.texels = texels, sky.scale = 0.5f;
    assert_int_equal(brume_scene_add_light(scene, &sky, NULL), BRUME_OK);
    build_arrays(scene, &a);
    double cells[HEIGHT][WIDTH], total = 0;
    for (int y = 0; y < HEIGHT; y++)
        for (int x = 0; x < WIDTH; x++) {
            cells[y][x] = 0;
            for (int j = 0; j < STEPS; j++)
                for (int i = 0; i < STEPS; i++) {
                    double u = (x + (i + 0.5) / STEPS) / WIDTH, v = (y + (j + 0.5) / STEPS) / HEIGHT;
                    cells[y][x] += map_luminance(texels, WIDTH, HEIGHT, u, v) * sin(PI * v);
                }
            total += cells[y][x];
        }
    const float *rows = a.cdf + a.params.environment_cdf, *columns = rows + HEIGHT + 1;
    assert_float_equal(rows[HEIGHT], 1, 0);
    for (int y = 0; y < HEIGHT; y++) {
        const float *row = columns + y * (WIDTH + 1);
        assert_float_equal(row[0], 0, 0);
        assert_float_equal(row[WIDTH], 1, 0);
        for (int x = 0; x < WIDTH; x++) {
            double p = ((double)rows[y + 1] - rows[y]) * ((double)row[x + 1] - row[x]);
            assert_close(p, cells[y][x] / total, 5e-4); /* the midpoint rule's error with 60 x 60 points */
        }
    }
    assert_float_equal(a.texels[3 * a.params.environment_first], 0.5f * texels[0], 0);
    brume_arrays_free(&a);
    brume_scene_destroy(scene);
}

/* A black map is no environment; a black row's conditional is still a table. */
static void test_dark_environments(void **state) {
    (void)state;
    static const float black[12] = {0};
    brume_scene *scene = scene_with_sensor();
    brume_light_desc sky = brume_light_desc_default(BRUME_LIGHT_ENVMAP);
    brume_arrays a;
    sky.width = sky.height = 2, sky.texels = black;
    assert_int_equal(brume_scene_add_light(scene, &sky, NULL), BRUME_OK);
    build_arrays(scene, &a);
    assert_int_equal(a.params.environment, ENVIRONMENT_NONE);
    assert_int_equal(a.features, 0);
    brume_arrays_free(&a);
    brume_scene_destroy(scene);
}

static void test_environment_rotation(void **state) {
    (void)state;
    static const float texel[3] = {1, 1, 1};
    brume_scene *scene = scene_with_sensor();
    brume_light_desc sky = brume_light_desc_default(BRUME_LIGHT_ENVMAP);
    brume_arrays a;
    sky.width = sky.height = 1, sky.texels = texel;
    /* 3, 4, 5: a turn about z, then one about x, scaled by 2 */
    static const float m[16] = {1.2f, -1.6f, 0, 9, 0.96f, 0.72f, -1.6f, 9, 1.28f, 0.96f, 1.2f, 9, 0, 0, 0, 1};
    memcpy(sky.to_world, m, sizeof m);
    assert_int_equal(brume_scene_add_light(scene, &sky, NULL), BRUME_OK);
    build_arrays(scene, &a);
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            assert_float_equal(a.params.environment_to_world[3 * i + j], m[4 * i + j] / 2, 2e-7);
            assert_float_equal(a.params.environment_to_local[3 * j + i], m[4 * i + j] / 2, 2e-7);
        }
    brume_arrays_free(&a);
    brume_scene_destroy(scene);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_spots),
        cmocka_unit_test(test_emitters),
        cmocka_unit_test(test_environment_tables),
        cmocka_unit_test(test_dark_environments),
        cmocka_unit_test(test_environment_rotation),
    };
    return cmocka_run_group_tests(tests, open_context, close_device);
}

/* test_film_extremes.c -- films of one pixel and of one row of 16384: crops are pieces of them, bit by bit, and they
 * show what a square lamp makes of them.
 *
 * The lamp's edges lie at known fractions of the image plane: pixels on one side of them are lit, on the other dark,
 * and one pixel alone holds the lamp's share of the view.
 */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "known_answer.h"
#include "planted.h"
#include "stability.h"

enum { LONG = 16384, PIECE = 37 };

#define FOV 120
#define EDGE 0.3337 /* of the half width, to the left and to the right */

/* At distance 1, of radiance 2, as wide as EDGE says and as high. */
static brume_scene *lamp_scene(uint32_t width, uint32_t height, uint32_t samples, double sigma) {
    view v = along_z;
    brume_scene *scene = new_scene(DEPTH_ANY, samples);
    brume_film_desc film = brume_film_desc_default();
    brume_shape_desc lamp = brume_shape_desc_default(BRUME_SHAPE_RECTANGLE);
    double half = EDGE * tan(FOV * PI / 360);
    film.width = width;
    film.height = height;
    film.rfilter = BRUME_RFILTER_BOX;
    must(brume_scene_set_film(scene, &film));
    v.fov = FOV;
    set_camera(scene, &v, sigma > 0 ? add_medium(scene, sigma, 0.8, 0.3, 0.1) : BRUME_NONE);
    scale_and_move(lamp.to_world, half, half, -1, 0, 0, 1);
    set_all(lamp.radiance, 2);
    must(brume_scene_add_shape(scene, &lamp, NULL));
    if (sigma > 0) {
        brume_integrator_desc integrator;
        must(brume_scene_get_integrator(scene, &integrator));
        integrator.max_depth = 3;
        must(brume_scene_set_integrator(scene, &integrator));
        add_constant(scene, 0.5);
    }
    return scene;
}

/* Of the whole film, or of a crop of it; malloc'ed. */
static float *rendered(const brume_scene *scene, const uint32_t crop[4], size_t pixels) {
    brume_render_desc desc = brume_render_desc_default();
    brume_render *render = NULL;
    brume_render_stats stats;
    float *radiance = calloc(pixels, 3 * sizeof *radiance);
    assert_non_null(radiance);
    if (crop) {
        desc.use_crop = 1;
        desc.crop_x = crop[0];
        desc.crop_y = crop[1];
        desc.crop_width = crop[2];
        desc.crop_height = crop[3];
    }
    must(brume_render_create(device, scene, &desc, &render));
    must(brume_render_run(render, NULL, NULL));
    must(brume_render_read(render, BRUME_CHANNEL_RADIANCE, radiance, 3 * pixels));
    must(brume_render_get_stats(render, &stats));
    assert_true(stats.bad_samples == 0 && stats.complete);
    brume_render_destroy(render);
    return radiance;
}

/* Off by how many pixels the lamp's edges are, or how many others are wrong, along the row or column. */
static double edges_off(int column) {
    brume_scene *scene = lamp_scene(column ? 1 : LONG, column ? LONG : 1, 4, 0);
    double lit = 0, wrong = 0;
    if (column) { /* the angle is that of the height */
        brume_sensor_desc sensor = brume_sensor_desc_default();
        sensor.fov = FOV;
        sensor.fov_axis = BRUME_FOV_Y;
        must(brume_scene_set_sensor(scene, &sensor));
    }
    float *radiance = rendered(scene, NULL, LONG);
    for (int i = 0; i < LONG; i++) {
        double at = (i + 0.5) / LONG * 2 - 1, from_edge = (EDGE - fabs(at)) * LONG / 2;
        if (fabs(from_edge) > 0.5 + 1e-3)
            wrong += radiance[3 * i] != (from_edge > 0 ? 2 : 0);
        lit += radiance[3 * i] / 2;
    }
    free(radiance);
    brume_scene_destroy(scene);
    return fmax(fabs(lit - EDGE * LONG), 2 * wrong);
}

/* Two pixels hold an edge, and 4 samples tell each of them within one. */
#define MOST_PIXELS 2

static void rows_and_columns(void **state) {
    (void)state;
    NEEDS_DEVICE();
    stability_row("film", "a lamp's edges on films of 16384 x 1 and 1 x 16384", "projection in double", "pixels",
                  MOST_PIXELS, fmax(edges_off(0), edges_off(1)), "the sum over both edges");
}

/* How many crops are not pieces of the whole. */
static int crops_wrong(uint32_t width, uint32_t height) {
    uint32_t most = width > height ? width : height, piece = most < PIECE ? most : PIECE;
    const uint32_t starts[] = {0, most / 3, most - piece};
    brume_scene *scene = lamp_scene(width, height, 4, 0.5);
    float *whole = rendered(scene, NULL, most);
    int wrong = 0;
    for (size_t k = 0; k < sizeof starts / sizeof starts[0]; k++) {
        uint32_t at = starts[k], crop[4] = {0, 0, 1, 1};
        crop[width > 1 ? 0 : 1] = at;
        crop[width > 1 ? 2 : 3] = piece;
        float *part = rendered(scene, crop, piece);
        wrong += memcmp(part, whole + 3 * at, piece * 3 * sizeof *part) != 0;
        free(part);
    }
    free(whole);
    brume_scene_destroy(scene);
    return wrong;
}

static void crops_are_pieces(void **state) {
    (void)state;
    NEEDS_DEVICE();
    assert_int_equal(crops_wrong(LONG, 1), 0);
    assert_int_equal(crops_wrong(1, LONG), 0);
    assert_int_equal(crops_wrong(1, 1), 0);
}

/* Samples are independent, and each sees the lamp or doesn't. */
static void one_pixel_sees_all(void **state) {
    enum { SAMPLES = 1 << 14 };
    double share = EDGE * EDGE, error = sqrt(share * (1 - share) / SAMPLES);
    (void)state;
    NEEDS_DEVICE();
    brume_scene *scene = lamp_scene(1, 1, SAMPLES, 0);
    float *radiance = rendered(scene, NULL, 1);
    double seen = radiance[0] / 2;
    free(radiance);
    brume_scene_destroy(scene);
    print_message("%.6f of one pixel, expected %.6f\n", seen, share);
    stability_row("film", "a lamp's share of a film of 1 x 1", "its area on the image plane", "standard errors", 5,
                  fabs(seen - share) / error, "one pixel");
}

static void planted_errors_are_noticed(void **state) {
    (void)state;
    NEEDS_DEVICE();
    planted_bug("camera.h", "across * R(p->tan_x)", "across * R(p->tan_x * 1.001f)");
    double off = edges_off(0);
    planted_bug("path.cl", "x = in_x + I(params->crop_x)", "x = in_x + I(params->crop_x & 4095)");
    int wrong = crops_wrong(LONG, 1);
    planted_remove();
    print_message("edges %g pixels off, %d crops wrong\n", off, wrong);
    assert_true(off > MOST_PIXELS && wrong > 0);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(rows_and_columns),
        cmocka_unit_test(crops_are_pieces),
        cmocka_unit_test(one_pixel_sees_all),
        cmocka_unit_test(planted_errors_are_noticed),
    };
    return cmocka_run_group_tests(tests, open_device, close_device);
}

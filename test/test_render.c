/* test_render.c -- renders as a whole: the smallest, the empty and the clamped picture, filters, guides, misuse of the
 * API, what is destroyed before what. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "spot_scene.h"

static void the_smallest_pictures(void **state) {
    (void)state;
    NEEDS_DEVICE();
    brume_scene *scene = spot_scene(context, PART_FOG);
    brume_film_desc film = brume_film_desc_default();
    film.width = film.height = 1;
    must(brume_scene_set_film(scene, &film));
    brume_render_desc desc = brume_render_desc_default();
    brume_render *render;
    must(brume_render_create(device, scene, &desc, &render));
    must(brume_render_run(render, NULL, NULL));
    float pixel[3], count;
    must(brume_render_read(render, BRUME_CHANNEL_RADIANCE, pixel, 3));
    must(brume_render_read(render, BRUME_CHANNEL_SAMPLE_COUNT, &count, 1));
    assert_true(pixel[0] > 0 && isfinite(pixel[0]));
    assert_true(count == 8);
    brume_render_destroy(render);
    film.width = 0;
    assert_int_equal(brume_scene_set_film(scene, &film), BRUME_ERROR_ARGUMENT);
    brume_scene_destroy(scene);
}

static void an_empty_scene_is_black(void **state) {
    (void)state;
    NEEDS_DEVICE();
    brume_scene *scene;
    must(brume_scene_create(context, &scene));
    brume_render_desc desc = brume_render_desc_default();
    brume_render *render = NULL;
    assert_int_equal(brume_render_create(device, scene, &desc, &render), BRUME_ERROR_SCENE);
    assert_null(render);
    assert_non_null(strstr(brume_context_message(context), "sensor"));
    brume_sensor_desc sensor = brume_sensor_desc_default();
    must(brume_scene_set_sensor(scene, &sensor));
    brume_film_desc film = brume_film_desc_default();
    film.width = WIDTH;
    film.height = HEIGHT;
    must(brume_scene_set_film(scene, &film));
    static float radiance[PIXELS * 3];
    spot_render(scene, &desc, radiance);
    for (size_t i = 0; i < PIXELS * 3; i++) assert_true(radiance[i] == 0);
    brume_scene_destroy(scene);
}

static void misuse_is_an_error_not_a_crash(void **state) {
    (void)state;
    NEEDS_DEVICE();
    brume_render *render = NULL;
    brume_render_stats stats;
    float x[3];
    brume_scene *scene = spot_scene(context, 0);
    brume_render_desc desc = brume_render_desc_default(), zero;
    memset(&zero, 0, sizeof zero);
    assert_int_equal(brume_render_create(NULL, scene, &desc, &render), BRUME_ERROR_ARGUMENT);
    assert_int_equal(brume_render_create(device, NULL, &desc, &render), BRUME_ERROR_ARGUMENT);
    assert_int_equal(brume_render_create(device, scene, &zero, &render), BRUME_ERROR_ARGUMENT);
    assert_int_equal(brume_render_create(device, scene, &desc, NULL), BRUME_ERROR_ARGUMENT);
    desc.lanes = 3;
    assert_int_equal(brume_render_create(device, scene, &desc, &render), BRUME_ERROR_ARGUMENT);
    desc = brume_render_desc_default();
    desc.first_sample = UINT32_MAX;
    assert_int_equal(brume_render_create(device, scene, &desc, &render), BRUME_ERROR_ARGUMENT);
    desc = brume_render_desc_default();
    desc.use_strategy = 1;
    desc.strategy = (brume_strategy)9;
    assert_int_equal(brume_render_create(device, scene, &desc, &render), BRUME_ERROR_ARGUMENT);
    desc.strategy = BRUME_STRATEGY_RASTER;
    desc.positions = 65;
    assert_int_equal(brume_render_create(device, scene, &desc, &render), BRUME_ERROR_ARGUMENT);
    desc = brume_render_desc_default();
    desc.use_indirect = 1;
    desc.indirect = (brume_indirect)4;
    assert_int_equal(brume_render_create(device, scene, &desc, &render), BRUME_ERROR_ARGUMENT);
    desc = brume_render_desc_default();
    desc.use_crop = 1;
    desc.crop_x = WIDTH;
    desc.crop_width = desc.crop_height = 1;
    assert_int_equal(brume_render_create(device, scene, &desc, &render), BRUME_ERROR_ARGUMENT);
    assert_null(render);
    assert_int_equal(brume_render_run(NULL, NULL, NULL), BRUME_ERROR_ARGUMENT);
    assert_int_equal(brume_render_read(NULL, BRUME_CHANNEL_DEPTH, x, 1), BRUME_ERROR_ARGUMENT);
    assert_int_equal(brume_render_write(NULL, "x.exr", NULL), BRUME_ERROR_ARGUMENT);
    assert_int_equal(brume_render_get_stats(NULL, &stats), BRUME_ERROR_ARGUMENT);
    brume_render_cancel(NULL);
    brume_render_destroy(NULL);
    brume_scene_destroy(NULL);
    brume_device_destroy(NULL);
    brume_context_destroy(NULL);
    assert_int_equal(brume_device_open(context, 12345, (brume_device **)&render), BRUME_ERROR_NO_DEVICE);

    desc = brume_render_desc_default();
    desc.guides = 0;
    must(brume_render_create(device, scene, &desc, &render));
    assert_int_equal(brume_render_read(render, BRUME_CHANNEL_DEPTH, x, 3), BRUME_ERROR_ARGUMENT);
    assert_int_equal(brume_render_read(render, BRUME_CHANNEL_RADIANCE, x, 3), BRUME_ERROR_ARGUMENT);
    assert_int_equal(brume_render_read(render, BRUME_CHANNEL_RADIANCE, NULL, PIXELS * 3), BRUME_ERROR_ARGUMENT);
    assert_int_equal(brume_render_read(render, (brume_channel)99, x, 3), BRUME_ERROR_ARGUMENT);
    assert_int_equal(brume_render_write(render, "picture.gif", NULL), BRUME_ERROR_ARGUMENT);
    assert_int_equal(brume_render_write(render, "/nonexistent/folder/picture.exr", NULL), BRUME_ERROR_OUTPUT);
    brume_render_destroy(render);
    brume_scene_destroy(scene);
}

/* Everything that a render was made from may go before it. */
static void destroyed_in_any_order(void **state) {
    (void)state;
    NEEDS_DEVICE();
    brume_context *own;
    brume_device *opened;
    must(brume_context_create(&own));
    must(brume_device_open(own, BRUME_DEVICE_ANY, &opened));
    brume_scene *scene = spot_scene(own, PART_FOG);
    brume_render_desc desc = brume_render_desc_default();
    brume_render *render;
    must(brume_render_create(opened, scene, &desc, &render));
    brume_context_destroy(own);
    brume_device_destroy(opened);
    brume_scene_destroy(scene);
    must(brume_render_run(render, NULL, NULL));
    static float radiance[PIXELS * 3];
    must(brume_render_read(render, BRUME_CHANNEL_RADIANCE, radiance, PIXELS * 3));
    assert_true(spot_mean(radiance, PIXELS * 3) > 0);
    brume_render_destroy(render);
}

/* A sky of 1 stays 1 through every reconstruction filter, those with negative lobes included: 4 standard errors of the
 * mean of 64 signed samples in each of 693 pixels, were they independent; a weight of one axis only is off by
 * 6 to 26 %. */
static void filters_keep_the_brightness(void **state) {
    (void)state;
    NEEDS_DEVICE();
    static float radiance[PIXELS * 3];
    for (int filter = BRUME_RFILTER_BOX; filter <= BRUME_RFILTER_LANCZOS; filter++) {
        brume_scene *scene;
        must(brume_scene_create(context, &scene));
        brume_sensor_desc sensor = brume_sensor_desc_default();
        must(brume_scene_set_sensor(scene, &sensor));
        brume_light_desc sky = brume_light_desc_default(BRUME_LIGHT_CONSTANT);
        must(brume_scene_add_light(scene, &sky, NULL));
        brume_film_desc film = brume_film_desc_default();
        film.width = WIDTH;
        film.height = HEIGHT;
        film.rfilter = (brume_rfilter)filter;
        must(brume_scene_set_film(scene, &film));
        brume_render_desc desc = brume_render_desc_default();
        desc.sample_count = 64;
        spot_render(scene, &desc, radiance);
        assert_true(fabs(spot_mean(radiance, PIXELS * 3) - 1) < 4 * 0.9 / sqrt(64.0 * PIXELS));
        brume_scene_destroy(scene);
    }
}

static void guides_show_the_first_surface(void **state) {
    (void)state;
    NEEDS_DEVICE();
    static float normal[PIXELS * 3], albedo[PIXELS * 3], depth[PIXELS];
    brume_scene *scene = spot_scene(context, PART_FOG);
    brume_render *render;
    must(brume_render_create(device, scene, NULL, &render));
    must(brume_render_run(render, NULL, NULL));
    must(brume_render_read(render, BRUME_CHANNEL_NORMAL, normal, PIXELS * 3));
    must(brume_render_read(render, BRUME_CHANNEL_ALBEDO, albedo, PIXELS * 3));
    must(brume_render_read(render, BRUME_CHANNEL_DEPTH, depth, PIXELS));
    /* The middle of the bottom row sees the floor, y = -1: normal +y, albedo 0.5, as far as the view is steep. The
     * camera is 1.5 above it; the gaussian filter smears by up to two pixels. */
    size_t i = (size_t)WIDTH * (HEIGHT - 1) + WIDTH / 2;
    double tan_y = tan(30 * 3.14159265358979 / 180) * HEIGHT / WIDTH, slope = tan_y * (1 - 1.0 / HEIGHT);
    double distance = 1.5 * sqrt(1 + slope * slope) / slope;
    assert_true(fabs(normal[3 * i + 1] - 1) < 1e-5);
    assert_true(fabs(albedo[3 * i] - 0.5) < 1e-5);
    assert_true(fabs(depth[i] - distance) < 0.1 * distance);
    brume_render_destroy(render);
    brume_scene_destroy(scene);
}

/* No pixel of positive samples is brighter than the clamp, light is only ever taken away, and a clamp that nothing
 * reaches changes no bit. */
static void a_clamp_takes_what_is_above_it(void **state) {
    (void)state;
    NEEDS_DEVICE();
    static float open[PIXELS * 3], clamped[PIXELS * 3];
    brume_scene *scene = spot_scene(context, PART_FOG | PART_AREA);
    brume_film_desc film;
    must(brume_scene_get_film(scene, &film));
    film.rfilter = BRUME_RFILTER_BOX;
    must(brume_scene_set_film(scene, &film));
    brume_render_desc desc = brume_render_desc_default();
    desc.use_strategy = 1;
    desc.strategy = BRUME_STRATEGY_MIS; /* auto takes away what is hidden: below 0 is possible there */
    desc.sample_count = 4;
    spot_render(scene, &desc, open);
    desc.clamp = 1e30f;
    spot_render(scene, &desc, clamped);
    assert_memory_equal(open, clamped, sizeof open);
    desc.clamp = 0.25f * (float)spot_mean(open, PIXELS * 3);
    spot_render(scene, &desc, clamped);
    int darker = 0;
    for (size_t i = 0; i < PIXELS * 3; i++) {
        assert_true(clamped[i] <= open[i] && clamped[i] <= desc.clamp * (1 + 1e-6f));
        darker += clamped[i] < open[i];
    }
    assert_true(darker > 0);
    brume_render *render = NULL;
    desc.clamp = -1;
    assert_int_equal(brume_render_create(device, scene, &desc, &render), BRUME_ERROR_ARGUMENT);
    desc.clamp = NAN;
    assert_int_equal(brume_render_create(device, scene, &desc, &render), BRUME_ERROR_ARGUMENT);
    brume_scene_destroy(scene);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_smallest_pictures),
        cmocka_unit_test(an_empty_scene_is_black),
        cmocka_unit_test(misuse_is_an_error_not_a_crash),
        cmocka_unit_test(destroyed_in_any_order),
        cmocka_unit_test(filters_keep_the_brightness),
        cmocka_unit_test(guides_show_the_first_surface),
        cmocka_unit_test(a_clamp_takes_what_is_above_it),
    };
    return cmocka_run_group_tests(tests, open_device, close_device);
}

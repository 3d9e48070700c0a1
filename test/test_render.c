/* test_render.c -- renders as a whole: the same bits whatever the width, the cut of the work and the features compiled;
 * cancelling, continuing and asking for more; a clamp; misuse of the API. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "brume.h"
#include "../cl/shared.h"

enum { WIDTH = 33, HEIGHT = 21, PIXELS = WIDTH * HEIGHT };

typedef struct fixture {
    brume_context *context;
    brume_device *device;
} fixture;

static int open_device(void **state) {
    static fixture f;
    if (brume_context_create(&f.context) != BRUME_OK) return -1;
    if (brume_device_open(f.context, BRUME_DEVICE_ANY, &f.device) != BRUME_OK) return -1;
    *state = &f;
    return 0;
}

static int close_device(void **state) {
    fixture *f = *state;
    brume_device_destroy(f->device);
    brume_context_destroy(f->context);
    return 0;
}

#define OK(call) assert_int_equal((call), BRUME_OK)

static void translate(float m[16], float x, float y, float z) {
    const float t[16] = {1, 0, 0, x, 0, 1, 0, y, 0, 0, 1, z, 0, 0, 0, 1};
    memcpy(m, t, sizeof t);
}

/* Scaled by s, turned so that the object's +z points along +y, moved. */
static void lay_flat(float m[16], float s, float x, float y, float z) {
    const float t[16] = {s, 0, 0, x, 0, 0, s, y, 0, -s, 0, z, 0, 0, 0, 1};
    memcpy(m, t, sizeof t);
}

typedef enum stage { STAGE_FOG = 1, STAGE_AREA = 2, STAGE_GLASS = 4, STAGE_CLOUD = 8, STAGE_SKY = 16 } stage;

/* A floor, a ball and a spotlight above; and what `parts` adds. The camera stands at z = -6 and looks along +z. */
static brume_scene *build_scene(fixture *f, unsigned parts) {
    brume_scene *scene;
    OK(brume_scene_create(f->context, &scene));
    uint32_t id, fog = BRUME_NONE, matt, glass, null;

    if (parts & STAGE_FOG) {
        brume_medium_desc m = brume_medium_desc_default();
        const float sigma[3] = {0.10f, 0.12f, 0.15f};
        memcpy(m.sigma_t, sigma, sizeof sigma);
        m.g = 0.4f;
        OK(brume_scene_add_medium(scene, &m, &fog));
    }
    brume_bsdf_desc b = brume_bsdf_desc_default(BRUME_BSDF_DIFFUSE);
    OK(brume_scene_add_bsdf(scene, &b, &matt));
    brume_shape_desc floor_desc = brume_shape_desc_default(BRUME_SHAPE_RECTANGLE);
    lay_flat(floor_desc.to_world, 10, 0, -1, 0);
    floor_desc.bsdf = matt;
    OK(brume_scene_add_shape(scene, &floor_desc, &id));

    brume_shape_desc ball = brume_shape_desc_default(BRUME_SHAPE_SPHERE);
    ball.bsdf = matt;
    if (parts & STAGE_GLASS) {
        b = brume_bsdf_desc_default(BRUME_BSDF_DIELECTRIC);
        OK(brume_scene_add_bsdf(scene, &b, &glass));
        ball.bsdf = glass;
        ball.exterior = fog;
    }
    OK(brume_scene_add_shape(scene, &ball, &id));

    if (parts & STAGE_CLOUD) {
        brume_medium_desc m = brume_medium_desc_default();
        uint32_t cloud;
        m.g = -0.3f;
        m.emission[0] = 0.1f;
        OK(brume_scene_add_medium(scene, &m, &cloud));
        b = brume_bsdf_desc_default(BRUME_BSDF_NULL);
        OK(brume_scene_add_bsdf(scene, &b, &null));
        brume_shape_desc box = brume_shape_desc_default(BRUME_SHAPE_CUBE);
        translate(box.to_world, 2.2f, 0.1f, 0);
        box.bsdf = null;
        box.interior = cloud;
        box.exterior = fog;
        OK(brume_scene_add_shape(scene, &box, &id));
    }
    if (parts & STAGE_AREA) {
        brume_shape_desc lamp = brume_shape_desc_default(BRUME_SHAPE_RECTANGLE);
        lay_flat(lamp.to_world, 0.5f, -2, 3, 0);
        lamp.to_world[6] = -lamp.to_world[6]; /* facing down */
        lamp.to_world[9] = -lamp.to_world[9];
        lamp.radiance[0] = lamp.radiance[1] = lamp.radiance[2] = 4;
        OK(brume_scene_add_shape(scene, &lamp, &id));
    }
    if (parts & STAGE_SKY) {
        brume_light_desc sky = brume_light_desc_default(BRUME_LIGHT_CONSTANT);
        sky.intensity[0] = 0.2f;
        OK(brume_scene_add_light(scene, &sky, &id));
    }
    brume_light_desc spot = brume_light_desc_default(BRUME_LIGHT_SPOT);
    const float down[16] = {1, 0, 0, 0.5f, 0, 0, -1, 4, 0, 1, 0, 0, 0, 0, 0, 1};
    memcpy(spot.to_world, down, sizeof down);
    spot.intensity[0] = spot.intensity[1] = spot.intensity[2] = 30;
    OK(brume_scene_add_light(scene, &spot, &id));

    brume_sensor_desc sensor = brume_sensor_desc_default();
    translate(sensor.to_world, 0, 0.5f, -6);
    sensor.fov = 60;
    sensor.medium = fog;
    OK(brume_scene_set_sensor(scene, &sensor));
    brume_film_desc film = brume_film_desc_default();
    film.width = WIDTH;
    film.height = HEIGHT;
    OK(brume_scene_set_film(scene, &film));
    brume_integrator_desc integrator = brume_integrator_desc_default();
    integrator.max_depth = 6;
    integrator.sample_count = 8;
    OK(brume_scene_set_integrator(scene, &integrator));
    return scene;
}

static void render_with(fixture *f, const brume_scene *scene, const brume_render_desc *desc, float *radiance) {
    brume_render *render;
    brume_render_stats stats;
    OK(brume_render_create(f->device, scene, desc, &render));
    OK(brume_render_run(render, NULL, NULL));
    OK(brume_render_read(render, BRUME_CHANNEL_RADIANCE, radiance, PIXELS * 3));
    OK(brume_render_get_stats(render, &stats));
    assert_int_equal(stats.bad_samples, 0);
    assert_int_equal(stats.complete, 1);
    assert_int_equal(stats.samples, (uint64_t)PIXELS * stats.sample_count);
    brume_render_destroy(render);
}

static double mean_of(const float *x, size_t count) {
    double sum = 0;
    for (size_t i = 0; i < count; i++) {
        assert_true(isfinite(x[i]));
        sum += x[i];
    }
    return sum / (double)count;
}

static const unsigned stages[] = {0, STAGE_FOG, STAGE_FOG | STAGE_AREA | STAGE_CLOUD,
                                  STAGE_FOG | STAGE_GLASS | STAGE_SKY | STAGE_AREA | STAGE_CLOUD};

static void same_bits_at_every_width(void **state) {
    fixture *f = *state;
    static float reference[PIXELS * 3], other[PIXELS * 3];
    for (size_t i = 0; i < sizeof stages / sizeof *stages; i++) {
        brume_scene *scene = build_scene(f, stages[i]);
        brume_render_desc desc = brume_render_desc_default();
        desc.lanes = 1;
        render_with(f, scene, &desc, reference);
        assert_true(mean_of(reference, PIXELS * 3) > 1e-3);
        /* A kernel takes seconds to build: the widths between are tried on the richest stage only. */
        static const uint32_t widths[] = {16, 8, 4};
        size_t count = i + 1 < sizeof stages / sizeof *stages ? 1 : 3;
        for (size_t w = 0; w < count; w++) {
            desc.lanes = widths[w];
            render_with(f, scene, &desc, other);
            assert_memory_equal(reference, other, sizeof reference);
        }
        brume_scene_destroy(scene);
    }
}

/* Left-out code must not change the picture: the generic program, which has every feature, gives the same bits. */
static void same_bits_from_the_generic_program(void **state) {
    fixture *f = *state;
    static float special[PIXELS * 3], generic[PIXELS * 3];
    for (size_t i = 1; i < 3; i++) {
        brume_scene *scene = build_scene(f, stages[i]);
        brume_render_desc desc = brume_render_desc_default();
        desc.guides = 0;
        render_with(f, scene, &desc, special);
        desc.generic = 1;
        desc.guides = 1;
        render_with(f, scene, &desc, generic);
        assert_memory_equal(special, generic, sizeof special);
        brume_scene_destroy(scene);
    }
}

static int cancel_at_once(void *user, const brume_progress *progress) {
    assert_true(progress->fraction >= 0 && progress->fraction <= 1);
    ++*(int *)user;
    return 1;
}

static void cancelled_and_continued_is_the_same(void **state) {
    fixture *f = *state;
    static float whole[PIXELS * 3], parts[PIXELS * 3];
    brume_scene *scene = build_scene(f, STAGE_FOG);
    brume_render_desc desc = brume_render_desc_default();
    desc.sample_count = 37;
    render_with(f, scene, &desc, whole);

    brume_render *render;
    brume_render_stats stats;
    OK(brume_render_create(f->device, scene, &desc, &render));
    int calls = 0, cancels = 0;
    brume_render_cancel(render);
    assert_int_equal(brume_render_run(render, cancel_at_once, &calls), BRUME_CANCELLED);
    OK(brume_render_get_stats(render, &stats));
    assert_int_equal(stats.complete, 0);
    assert_int_equal(stats.samples, 0);
    assert_int_equal(calls, 1);
    brume_result result;
    while ((result = brume_render_run(render, cancel_at_once, &calls)) == BRUME_CANCELLED)
        assert_true(++cancels < 1000);
    OK(result);
    OK(brume_render_read(render, BRUME_CHANNEL_RADIANCE, parts, PIXELS * 3));
    assert_memory_equal(whole, parts, sizeof whole);
    brume_render_destroy(render);
    brume_scene_destroy(scene);
}

/* Two halves of a sample range average to the whole: the samples are functions of their index alone. */
static void sample_ranges_add_up(void **state) {
    fixture *f = *state;
    static float whole[PIXELS * 3], low[PIXELS * 3], high[PIXELS * 3];
    brume_scene *scene = build_scene(f, STAGE_FOG | STAGE_AREA);
    brume_render_desc desc = brume_render_desc_default();
    desc.sample_count = 8;
    render_with(f, scene, &desc, whole);
    desc.sample_count = 4;
    render_with(f, scene, &desc, low);
    desc.first_sample = 4;
    render_with(f, scene, &desc, high);
    for (size_t i = 0; i < PIXELS * 3; i++) {
        double both = 0.5 * ((double)low[i] + high[i]);
        assert_true(fabs(both - whole[i]) <= 1e-6 * (fabs(both) + 1e-6));
    }
    brume_scene_destroy(scene);
}

static void a_crop_is_a_piece_of_the_whole(void **state) {
    fixture *f = *state;
    static float whole[PIXELS * 3], crop[7 * 5 * 3];
    brume_scene *scene = build_scene(f, STAGE_FOG);
    brume_render_desc desc = brume_render_desc_default();
    render_with(f, scene, &desc, whole);
    desc.use_crop = 1;
    desc.crop_x = 11;
    desc.crop_y = 6;
    desc.crop_width = 7;
    desc.crop_height = 5;
    brume_render *render;
    OK(brume_render_create(f->device, scene, &desc, &render));
    OK(brume_render_run(render, NULL, NULL));
    OK(brume_render_read(render, BRUME_CHANNEL_RADIANCE, crop, 7 * 5 * 3));
    for (int y = 0; y < 5; y++)
        assert_memory_equal(crop + 7 * 3 * y, whole + 3 * (WIDTH * (6 + y) + 11), 7 * 3 * sizeof(float));
    brume_render_destroy(render);
    brume_scene_destroy(scene);
}

static void another_seed_is_another_noise(void **state) {
    fixture *f = *state;
    static float a[PIXELS * 3], b[PIXELS * 3], again[PIXELS * 3];
    brume_scene *scene = build_scene(f, STAGE_FOG);
    brume_render_desc desc = brume_render_desc_default();
    render_with(f, scene, &desc, a);
    render_with(f, scene, &desc, again);
    assert_memory_equal(a, again, sizeof a);
    desc.use_seed = 1;
    desc.seed = 7;
    render_with(f, scene, &desc, b);
    assert_memory_not_equal(a, b, sizeof a);
    brume_scene_destroy(scene);
}

static void double_precision_agrees(void **state) {
    fixture *f = *state;
    brume_device_info info;
    OK(brume_device_describe(f->context, BRUME_DEVICE_ANY, &info));
    if (!info.has_double) skip();
    static float single[PIXELS * 3], twice[PIXELS * 3];
    brume_scene *scene = build_scene(f, STAGE_FOG | STAGE_AREA);
    brume_render_desc desc = brume_render_desc_default();
    desc.sample_count = 64;
    render_with(f, scene, &desc, single);
    desc.precision = BRUME_PRECISION_DOUBLE;
    desc.lanes = 8;
    render_with(f, scene, &desc, twice);
    /* The same random numbers: a few paths take another branch, the mean hardly moves. */
    double a = mean_of(single, PIXELS * 3), b = mean_of(twice, PIXELS * 3);
    assert_true(fabs(a - b) < 2e-3 * a);
    brume_scene_destroy(scene);
}

static void the_smallest_pictures(void **state) {
    fixture *f = *state;
    brume_scene *scene = build_scene(f, STAGE_FOG);
    brume_film_desc film = brume_film_desc_default();
    film.width = film.height = 1;
    OK(brume_scene_set_film(scene, &film));
    brume_render_desc desc = brume_render_desc_default();
    brume_render *render;
    OK(brume_render_create(f->device, scene, &desc, &render));
    OK(brume_render_run(render, NULL, NULL));
    float pixel[3], count;
    OK(brume_render_read(render, BRUME_CHANNEL_RADIANCE, pixel, 3));
    OK(brume_render_read(render, BRUME_CHANNEL_SAMPLE_COUNT, &count, 1));
    assert_true(pixel[0] > 0 && isfinite(pixel[0]));
    assert_true(count == 8);
    brume_render_destroy(render);
    film.width = 0;
    assert_int_equal(brume_scene_set_film(scene, &film), BRUME_ERROR_ARGUMENT);
    brume_scene_destroy(scene);
}

static void an_empty_scene_is_black(void **state) {
    fixture *f = *state;
    brume_scene *scene;
    OK(brume_scene_create(f->context, &scene));
    brume_render_desc desc = brume_render_desc_default();
    brume_render *render = NULL;
    assert_int_equal(brume_render_create(f->device, scene, &desc, &render), BRUME_ERROR_SCENE);
    assert_null(render);
    assert_non_null(strstr(brume_context_message(f->context), "sensor"));
    brume_sensor_desc sensor = brume_sensor_desc_default();
    OK(brume_scene_set_sensor(scene, &sensor));
    brume_film_desc film = brume_film_desc_default();
    film.width = WIDTH;
    film.height = HEIGHT;
    OK(brume_scene_set_film(scene, &film));
    static float radiance[PIXELS * 3];
    render_with(f, scene, &desc, radiance);
    for (size_t i = 0; i < PIXELS * 3; i++) assert_true(radiance[i] == 0);
    brume_scene_destroy(scene);
}

static void misuse_is_an_error_not_a_crash(void **state) {
    fixture *f = *state;
    brume_render *render = NULL;
    brume_render_stats stats;
    float x[3];
    brume_scene *scene = build_scene(f, 0);
    brume_render_desc desc = brume_render_desc_default(), zero;
    memset(&zero, 0, sizeof zero);
    assert_int_equal(brume_render_create(NULL, scene, &desc, &render), BRUME_ERROR_ARGUMENT);
    assert_int_equal(brume_render_create(f->device, NULL, &desc, &render), BRUME_ERROR_ARGUMENT);
    assert_int_equal(brume_render_create(f->device, scene, &zero, &render), BRUME_ERROR_ARGUMENT);
    assert_int_equal(brume_render_create(f->device, scene, &desc, NULL), BRUME_ERROR_ARGUMENT);
    desc.lanes = 3;
    assert_int_equal(brume_render_create(f->device, scene, &desc, &render), BRUME_ERROR_ARGUMENT);
    desc = brume_render_desc_default();
    desc.first_sample = UINT32_MAX;
    assert_int_equal(brume_render_create(f->device, scene, &desc, &render), BRUME_ERROR_ARGUMENT);
    desc = brume_render_desc_default();
    desc.use_strategy = 1;
    desc.strategy = (brume_strategy)9;
    assert_int_equal(brume_render_create(f->device, scene, &desc, &render), BRUME_ERROR_ARGUMENT);
    desc.strategy = BRUME_STRATEGY_RASTER;
    desc.positions = 65;
    assert_int_equal(brume_render_create(f->device, scene, &desc, &render), BRUME_ERROR_ARGUMENT);
    desc = brume_render_desc_default();
    desc.use_indirect = 1;
    desc.indirect = (brume_indirect)4;
    assert_int_equal(brume_render_create(f->device, scene, &desc, &render), BRUME_ERROR_ARGUMENT);
    desc = brume_render_desc_default();
    desc.use_crop = 1;
    desc.crop_x = WIDTH;
    desc.crop_width = desc.crop_height = 1;
    assert_int_equal(brume_render_create(f->device, scene, &desc, &render), BRUME_ERROR_ARGUMENT);
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
    assert_int_equal(brume_device_open(f->context, 12345, (brume_device **)&render), BRUME_ERROR_NO_DEVICE);

    desc = brume_render_desc_default();
    desc.guides = 0;
    OK(brume_render_create(f->device, scene, &desc, &render));
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
    brume_context *context;
    brume_device *device;
    OK(brume_context_create(&context));
    OK(brume_device_open(context, BRUME_DEVICE_ANY, &device));
    fixture f = {context, device};
    brume_scene *scene = build_scene(&f, STAGE_FOG);
    brume_render_desc desc = brume_render_desc_default();
    brume_render *render;
    OK(brume_render_create(device, scene, &desc, &render));
    brume_context_destroy(context);
    brume_device_destroy(device);
    brume_scene_destroy(scene);
    OK(brume_render_run(render, NULL, NULL));
    static float radiance[PIXELS * 3];
    OK(brume_render_read(render, BRUME_CHANNEL_RADIANCE, radiance, PIXELS * 3));
    assert_true(mean_of(radiance, PIXELS * 3) > 0);
    brume_render_destroy(render);
}

/* A sky of 1 stays 1 through every reconstruction filter, those with negative lobes included: 4 standard errors of the
 * mean of 64 signed samples in each of 693 pixels, were they independent; a weight of one axis only is off by
 * 6 to 26 %. */
static void filters_keep_the_brightness(void **state) {
    fixture *f = *state;
    static float radiance[PIXELS * 3];
    for (int filter = BRUME_RFILTER_BOX; filter <= BRUME_RFILTER_LANCZOS; filter++) {
        brume_scene *scene;
        OK(brume_scene_create(f->context, &scene));
        brume_sensor_desc sensor = brume_sensor_desc_default();
        OK(brume_scene_set_sensor(scene, &sensor));
        brume_light_desc sky = brume_light_desc_default(BRUME_LIGHT_CONSTANT);
        OK(brume_scene_add_light(scene, &sky, NULL));
        brume_film_desc film = brume_film_desc_default();
        film.width = WIDTH;
        film.height = HEIGHT;
        film.rfilter = (brume_rfilter)filter;
        OK(brume_scene_set_film(scene, &film));
        brume_render_desc desc = brume_render_desc_default();
        desc.sample_count = 64;
        render_with(f, scene, &desc, radiance);
        assert_true(fabs(mean_of(radiance, PIXELS * 3) - 1) < 4 * 0.9 / sqrt(64.0 * PIXELS));
        brume_scene_destroy(scene);
    }
}

/* One render passes through the pictures of fewer samples, and ends in the one asked for at once. */
static void more_samples_later_are_the_same(void **state) {
    fixture *f = *state;
    static float at_once[PIXELS * 3], grown[PIXELS * 3];
    brume_scene *scene = build_scene(f, STAGE_FOG | STAGE_AREA);
    brume_render_desc desc = brume_render_desc_default();
    brume_render *render;
    brume_render_stats stats;
    desc.guides = 0;
    desc.sample_count = 1;
    OK(brume_render_create(f->device, scene, &desc, &render));
    static const uint32_t counts[] = {1, 2, 4, 7, 24};
    for (size_t i = 0; i < sizeof counts / sizeof counts[0]; i++) {
        OK(brume_render_set_sample_count(render, counts[i]));
        OK(brume_render_run(render, NULL, NULL));
        OK(brume_render_get_stats(render, &stats));
        assert_int_equal(stats.complete, 1);
        assert_int_equal(stats.samples, (uint64_t)counts[i] * PIXELS);
        OK(brume_render_read(render, BRUME_CHANNEL_RADIANCE, grown, PIXELS * 3));
        desc.sample_count = counts[i];
        render_with(f, scene, &desc, at_once);
        assert_memory_equal(grown, at_once, sizeof grown);
    }
    assert_int_equal(brume_render_set_sample_count(render, 23), BRUME_ERROR_ARGUMENT);
    assert_int_equal(brume_render_set_sample_count(render, 0), BRUME_ERROR_ARGUMENT);
    assert_int_equal(brume_render_set_sample_count(NULL, 32), BRUME_ERROR_ARGUMENT);
    brume_render_destroy(render);
    brume_scene_destroy(scene);
}

/* No pixel of positive samples is brighter than the clamp, light is only ever taken away, and a clamp that nothing
 * reaches changes no bit. */
static void a_clamp_takes_what_is_above_it(void **state) {
    fixture *f = *state;
    static float open[PIXELS * 3], clamped[PIXELS * 3];
    brume_scene *scene = build_scene(f, STAGE_FOG | STAGE_AREA);
    brume_film_desc film;
    OK(brume_scene_get_film(scene, &film));
    film.rfilter = BRUME_RFILTER_BOX;
    OK(brume_scene_set_film(scene, &film));
    brume_render_desc desc = brume_render_desc_default();
    desc.use_strategy = 1;
    desc.strategy = BRUME_STRATEGY_MIS; /* auto takes away what is hidden: below 0 is possible there */
    desc.sample_count = 4;
    render_with(f, scene, &desc, open);
    desc.clamp = 1e30f;
    render_with(f, scene, &desc, clamped);
    assert_memory_equal(open, clamped, sizeof open);
    desc.clamp = 0.25f * (float)mean_of(open, PIXELS * 3);
    render_with(f, scene, &desc, clamped);
    int darker = 0;
    for (size_t i = 0; i < PIXELS * 3; i++) {
        assert_true(clamped[i] <= open[i] && clamped[i] <= desc.clamp * (1 + 1e-6f));
        darker += clamped[i] < open[i];
    }
    assert_true(darker > 0);
    brume_render *render = NULL;
    desc.clamp = -1;
    assert_int_equal(brume_render_create(f->device, scene, &desc, &render), BRUME_ERROR_ARGUMENT);
    desc.clamp = NAN;
    assert_int_equal(brume_render_create(f->device, scene, &desc, &render), BRUME_ERROR_ARGUMENT);
    brume_scene_destroy(scene);
}

static void guides_show_the_first_surface(void **state) {
    fixture *f = *state;
    static float normal[PIXELS * 3], albedo[PIXELS * 3], depth[PIXELS];
    brume_scene *scene = build_scene(f, STAGE_FOG);
    brume_render *render;
    OK(brume_render_create(f->device, scene, NULL, &render));
    OK(brume_render_run(render, NULL, NULL));
    OK(brume_render_read(render, BRUME_CHANNEL_NORMAL, normal, PIXELS * 3));
    OK(brume_render_read(render, BRUME_CHANNEL_ALBEDO, albedo, PIXELS * 3));
    OK(brume_render_read(render, BRUME_CHANNEL_DEPTH, depth, PIXELS));
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

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(same_bits_at_every_width),
        cmocka_unit_test(same_bits_from_the_generic_program),
        cmocka_unit_test(cancelled_and_continued_is_the_same),
        cmocka_unit_test(sample_ranges_add_up),
        cmocka_unit_test(a_crop_is_a_piece_of_the_whole),
        cmocka_unit_test(another_seed_is_another_noise),
        cmocka_unit_test(double_precision_agrees),
        cmocka_unit_test(the_smallest_pictures),
        cmocka_unit_test(an_empty_scene_is_black),
        cmocka_unit_test(misuse_is_an_error_not_a_crash),
        cmocka_unit_test(destroyed_in_any_order),
        cmocka_unit_test(filters_keep_the_brightness),
        cmocka_unit_test(guides_show_the_first_surface),
        cmocka_unit_test(more_samples_later_are_the_same),
        cmocka_unit_test(a_clamp_takes_what_is_above_it),
    };
    return cmocka_run_group_tests(tests, open_device, close_device);
}

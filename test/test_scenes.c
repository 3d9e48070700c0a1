/* The scenes that the project ships: each loads, renders without a bad sample, and shows its known answer, if any. */
#include <math.h>
#include <string.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

#include <cmocka.h>

#include "brume.h"

static brume_context *context;
static brume_device *device;

/* Renders a window in the middle of the picture; fails the test if anything does. The caller destroys it. */
static brume_render *render_middle(const char *path, uint32_t size, uint32_t samples)
{
    brume_scene *scene;
    brume_render *render;
    brume_film_desc film;
    brume_render_stats stats;
    if (brume_scene_load(context, path, NULL, 0, &scene) != BRUME_OK)
        fail_msg("%s", brume_context_message(context));
    assert_int_equal(brume_scene_get_film(scene, &film), BRUME_OK);
    brume_render_desc desc = brume_render_desc_default();
    desc.guides = 0; /* less to compile */
    desc.sample_count = samples;
    desc.use_crop = 1;
    desc.crop_x = (film.width - size) / 2;
    desc.crop_y = (film.height - size) / 2;
    desc.crop_width = desc.crop_height = size;
    if (brume_render_create(device, scene, &desc, &render) != BRUME_OK ||
        brume_render_run(render, NULL, NULL) != BRUME_OK)
        fail_msg("%s: %s", path, brume_context_message(context));
    brume_scene_destroy(scene);
    assert_int_equal(brume_render_get_stats(render, &stats), BRUME_OK);
    assert_int_equal(stats.bad_samples, 0);
    return render;
}

static void every_scene_renders(void **state)
{
    (void)state;
    static const char *const paths[] = {
        "scenes/three-spots.xml",         "scenes/one-spot.xml",           "scenes/bunny-fog.xml",
        "scenes/forest.xml",              "scenes/glass-in-fog.xml",       "scenes/furnace.xml",
        "scenes/emission-slab.xml",       "scenes/ladder/open-beam.xml",   "scenes/ladder/half-hidden.xml",
        "scenes/ladder/slats.xml",        "scenes/ladder/bunny-beam.xml",  "scenes/ladder/forest-beam.xml",
        "scenes/ladder/thin-fog.xml",     "scenes/ladder/thick-fog.xml",   "scenes/ladder/forward-fog.xml",
        "scenes/ladder/three-spots.xml",  "scenes/ladder/area-light.xml",  "scenes/ladder/hundred-spots.xml",
        "scenes/ladder/soft-lamp.xml",    "scenes/ladder/environment-fog.xml", "scenes/ladder/fog-box.xml"};
    enum { SIZE = 16 };
    if (!device)
        skip();
    for (size_t i = 0; i < sizeof paths / sizeof paths[0]; i++) {
        float pixels[SIZE * SIZE * 3], sum = 0;
        brume_render *render = render_middle(paths[i], SIZE, 2);
        assert_int_equal(brume_render_read(render, BRUME_CHANNEL_RADIANCE, pixels, SIZE * SIZE * 3), BRUME_OK);
        int below = 0;
        for (int k = 0; k < SIZE * SIZE * 3; k++) {
            assert_true(isfinite(pixels[k]));
            below += pixels[k] < 0;
            sum += pixels[k];
        }
        /* At a shadow's edge two samples can take off more than there is (BRUME_STRATEGY_AUTO): among twelve slats, in
         * few pixels, and nowhere else. */
        if (below > (strstr(paths[i], "slats") ? SIZE * SIZE * 3 / 20 : 0))
            fail_msg("%s: %d values below 0", paths[i], below);
        assert_true(sum > 0);
        brume_render_destroy(render);
    }
}

/* The mean over SIZE x SIZE pixels, whose samples are independent (box filter), must be within 5 of its own standard
 * errors of `expected` (an honest renderer fails once in two million runs), and `slack`, what the scene's geometry
 * leaves open. The standard error comes from the spread of the pixels, not from the renderer's own estimate. A renderer
 * with no noise at all is to be within slack. */
static int mean_agrees(const float *pixels, int count, double expected, double slack)
{
    double sum = 0, squares = 0;
    for (int i = 0; i < count; i++) {
        sum += pixels[3 * i];
        squares += (double)pixels[3 * i] * pixels[3 * i];
    }
    double mean = sum / count, variance = fmax(0, squares / count - mean * mean);
    return fabs(mean - expected) <= 5 * sqrt(variance / (count - 1)) + slack;
}

static void known_answer(const char *path, double expected, double slack)
{
    enum { SIZE = 32, COUNT = SIZE * SIZE };
    static float pixels[COUNT * 3];
    brume_render *render = render_middle(path, SIZE, 64);
    assert_int_equal(brume_render_read(render, BRUME_CHANNEL_RADIANCE, pixels, COUNT * 3), BRUME_OK);
    brume_render_destroy(render);
    if (!mean_agrees(pixels, COUNT, expected, slack))
        fail_msg("%s: the mean is not %g", path, expected);
    /* The test is sharp enough to find a picture that is 1 % too bright. */
    for (int i = 0; i < 3 * COUNT; i++)
        pixels[i] *= 1.01f;
    assert_false(mean_agrees(pixels, COUNT, expected, slack));
}

static void furnace_is_1(void **state)
{
    (void)state;
    if (!device)
        skip();
    known_answer("scenes/furnace.xml", 1, 1e-5);
}

static void emission_slab_has_its_closed_form(void **state)
{
    (void)state;
    if (!device)
        skip();
    /* Rays are up to 0.25 degrees off the axis: 1e-5 longer within the slab. */
    known_answer("scenes/emission-slab.xml", 2 * -expm1(-2.1), 3e-5);
}

static int setup(void **state)
{
    (void)state;
    if (brume_context_create(&context) != BRUME_OK)
        return 1;
    brume_result result = brume_device_open(context, BRUME_DEVICE_ANY, &device);
    return result != BRUME_OK && result != BRUME_ERROR_NO_DEVICE;
}

static int teardown(void **state)
{
    (void)state;
    brume_device_destroy(device);
    brume_context_destroy(context);
    return 0;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_scene_renders),
        cmocka_unit_test(furnace_is_1),
        cmocka_unit_test(emission_slab_has_its_closed_form),
    };
    return cmocka_run_group_tests(tests, setup, teardown);
}

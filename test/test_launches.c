/* test_launches.c -- how the work is cut: launches stay short however slow the device is, smaller ones are tried where
 * larger ones find no resources, and a scene that the device has no room for is refused with figures. The devices are
 * made up (faults/cl_shim.h): nothing here depends on how long anything takes.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "ball.h"
#include "faults/cl_shim.h"
#include "open_device.h"
#include "render.h"

enum { WIDTH = 31, HEIGHT = 17, PIXELS = WIDTH * HEIGHT, SAMPLES = 64 };

static brume_scene *scene;
static float right[3 * PIXELS];

static int setup(void **state) {
    cl_shim_reset();
    if (open_device(state) != 0) return -1;
    if (!device) return 0;
    scene = ball_scene(context, WIDTH, HEIGHT);
    return 0;
}

static int teardown(void **state) {
    brume_scene_destroy(scene);
    return close_device(state);
}

static brume_render_desc narrow(void) {
    brume_render_desc desc = brume_render_desc_default();
    desc.lanes = 1;
    desc.sample_count = SAMPLES;
    desc.guides = 0;
    desc.error_estimate = 0;
    return desc;
}

static brume_render *create(void) {
    brume_render_desc desc = narrow();
    brume_render *made;
    must(brume_render_create(device, scene, &desc, &made));
    return made;
}

static void render(float *radiance) {
    brume_render *made = create();
    must(brume_render_run(made, NULL, NULL));
    must(brume_render_read(made, BRUME_CHANNEL_RADIANCE, radiance, 3 * PIXELS));
    brume_render_destroy(made);
}

/* From a device that does the picture in one launch to one that takes 40 ms for a sample of one pixel. No launch takes
 * more than 50 ms, or than what keeps all units busy with one sample; and the film is the same. */
static void test_launches_are_short(void **state) {
    (void)state;
    NEEDS_DEVICE();
    static float film[3 * PIXELS];
    const double speeds[] = {1e-9, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 4e-2}; /* seconds per sample */
    render(right);
    unsigned before = 0;
    for (size_t i = 0; i < sizeof speeds / sizeof speeds[0]; i++) {
        brume_render *made = create();
        unsigned launches = cl_shim_calls(CL_ENQUEUE_ND_RANGE_KERNEL, 0);
        cl_shim_set_speed(speeds[i]);
        must(brume_render_run(made, NULL, NULL));
        double longest = cl_shim_longest_launch(), least = speeds[i] * device->info.compute_units;
        launches = cl_shim_calls(CL_ENQUEUE_ND_RANGE_KERNEL, 0) - launches;
        cl_shim_set_speed(0);
        must(brume_render_read(made, BRUME_CHANNEL_RADIANCE, film, 3 * PIXELS));
        brume_render_destroy(made);
        print_message("%g s per sample: %u launches, the longest of %g s\n", speeds[i], launches, longest);
        assert_memory_equal(film, right, sizeof film);
        assert_true(longest <= (least > 0.05 ? least : 0.05) * 1.001);
        assert_true(launches >= before);
        before = launches;
        /* Short, but not shorter than needed: what a thousandth of the launches could do is not cut. */
        double all = speeds[i] * PIXELS * SAMPLES;
        assert_true(launches <= 40 + 4 * all / 0.05);
    }
}

/* A device that fails launches of more work-items than it has resources for. */
static void test_smaller_launches_are_tried(void **state) {
    (void)state;
    NEEDS_DEVICE();
    static float film[3 * PIXELS];
    render(right);
    for (size_t most = 1; most <= 64; most *= 4) {
        brume_render *made = create();
        cl_shim_set_most_items(most);
        brume_result result = brume_render_run(made, NULL, NULL);
        cl_shim_set_most_items(0);
        must(result);
        must(brume_render_read(made, BRUME_CHANNEL_RADIANCE, film, 3 * PIXELS));
        assert_memory_equal(film, right, sizeof film);
        brume_render_destroy(made);
    }
}

static void refuses(cl_ulong all, cl_ulong at_once, const char *need, const char *have) {
    brume_device *small = NULL;
    brume_render *made = NULL;
    brume_render_desc desc = narrow();
    cl_shim_set_memory(all, at_once);
    must(brume_device_open(context, BRUME_DEVICE_ANY, &small));
    unsigned buffers = cl_shim_calls(CL_CREATE_BUFFER, 0);
    brume_result result = brume_render_create(small, scene, &desc, &made);
    cl_shim_set_memory(0, 0);
    print_message("%s\n", brume_context_message(context));
    assert_int_equal(result, BRUME_ERROR_MEMORY);
    assert_null(made);
    assert_int_equal(cl_shim_calls(CL_CREATE_BUFFER, 0), buffers); /* nothing has been uploaded */
    assert_non_null(strstr(brume_context_message(context), need));
    assert_non_null(strstr(brume_context_message(context), have));
    brume_device_destroy(small);
}

/* The film alone takes 10 planes of 31 x 17 floats: 20.6 KiB. */
static void test_devices_too_small_are_told_from_others(void **state) {
    (void)state;
    NEEDS_DEVICE();
    refuses(16 << 10, 1 << 30, "20.6 KiB of it for the film", "has 16.0 KiB");
    refuses(1 << 30, 20 << 10, "20.6 KiB of it in one piece for the film", "at most 20.0 KiB at once");
    brume_device *enough = NULL;
    cl_shim_set_memory(1 << 20, 21 << 10);
    must(brume_device_open(context, BRUME_DEVICE_ANY, &enough));
    cl_shim_set_memory(0, 0);
    brume_render *made;
    brume_render_desc desc = narrow();
    must(brume_render_create(enough, scene, &desc, &made));
    brume_render_destroy(made);
    brume_device_destroy(enough);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_launches_are_short),
        cmocka_unit_test(test_smaller_launches_are_tried),
        cmocka_unit_test(test_devices_too_small_are_told_from_others),
    };
    return cmocka_run_group_tests_name("launches", tests, setup, teardown);
}

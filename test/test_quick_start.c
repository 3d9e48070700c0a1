/* test_quick_start.c -- a narrow program begins, the wide one takes over: wherever that happens, the film is the same
 * bits; and a render may be stopped or destroyed while the wide one is being built. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include "ball.h"
#include "break_off.h"

/* No multiple of a tile's sides; with a lamp in fog, so that there is a pilot, whose plan is laid out like the film. */
enum { WIDTH = 97, HEIGHT = 70, PIXELS = WIDTH * HEIGHT, NEVER = 1000000 };

static brume_context *context;
static brume_device *device;
static brume_scene *scene;
static float exact[7][PIXELS * 3];

#define OK(call) assert_int_equal((call), BRUME_OK)

static size_t channel_size(int channel) {
    return channel <= BRUME_CHANNEL_NORMAL ? PIXELS * 3 : PIXELS;
}

static brume_render *create(uint32_t quick_start, uint32_t lanes) {
    brume_render_desc desc = brume_render_desc_default();
    brume_render *render;
    desc.quick_start = quick_start;
    desc.lanes = lanes;
    desc.sample_count = 8;
    OK(brume_render_create(device, scene, &desc, &render));
    return render;
}

static int setup(void **state) {
    (void)state;
    setenv("BRUME_CACHE_DIR", "", 1); /* what is in the cache has no quick start */
    if (brume_context_create(&context) || brume_device_open(context, BRUME_DEVICE_ANY, &device)) return -1;
    OK(ball_in_fog(context, BRUME_LIGHT_POINT, WIDTH, HEIGHT, &scene));
    brume_render *render = create(0, 0);
    OK(brume_render_run(render, NULL, NULL));
    assert_int_equal(render->stats.quick_lanes, 0);
    for (int channel = 0; channel < 7; channel++)
        OK(brume_render_read(render, (brume_channel)channel, exact[channel], channel_size(channel)));
    brume_render_destroy(render);
    return 0;
}

static int teardown(void **state) {
    (void)state;
    brume_scene_destroy(scene);
    brume_device_destroy(device);
    brume_context_destroy(context);
    return 0;
}

static void expect_exact_film(brume_render *render) {
    static float film[PIXELS * 3];
    for (int channel = 0; channel < 7; channel++) {
        OK(brume_render_read(render, (brume_channel)channel, film, channel_size(channel)));
        assert_memory_equal(film, exact[channel], channel_size(channel) * sizeof *film);
    }
}

/* Within the pilot, whose first launch is a few groups, after it, within the passes, and not at all. */
static void the_swap_leaves_no_trace(void **state) {
    (void)state;
    static const uint32_t launches[] = {1, 2, 4, 6, NEVER};
    if (device->info.lanes == 1) skip();
    for (size_t i = 0; i < sizeof launches / sizeof *launches; i++) {
        brume_render *render = create(1, 0);
        assert_int_equal(render->stats.quick_lanes, 1);
        render->program.swap_at = launches[i];
        OK(brume_render_run(render, NULL, NULL));
        assert_true(render->program.launches >= 6);
        int swapped = launches[i] != NEVER;
        assert_int_equal(render->program.lanes, swapped ? render->stats.lanes : 1);
        assert_int_equal(render->stats.swap_seconds > 0, swapped);
        expect_exact_film(render);
        brume_render_destroy(render);
    }
}

/* Whenever the thread is ready. */
static void a_quick_start_gives_the_same_film(void **state) {
    (void)state;
    brume_render *render = create(1, 0);
    OK(brume_render_run(render, NULL, NULL));
    expect_exact_film(render);
    brume_render_destroy(render);
}

static void a_width_asked_for_is_waited_for(void **state) {
    (void)state;
    brume_render *render = create(1, 8);
    assert_int_equal(render->stats.quick_lanes, 0);
    assert_int_equal(render->program.lanes, 8);
    brume_render_destroy(render);
}

static void a_render_may_end_before_its_program(void **state) {
    (void)state;
    for (int ran = 0; ran < 2; ran++) {
        brume_render *render = create(1, 0);
        render->program.swap_at = NEVER;
        if (ran) {
            brume_render_cancel(render);
            assert_int_equal(brume_render_run(render, NULL, NULL), BRUME_CANCELLED);
        }
        brume_render_destroy(render);
    }
}

/* What the wide program's failure would do: the narrow one goes on. */
static void a_failed_program_is_done_without(void **state) {
    (void)state;
    if (device->info.lanes == 1) skip();
    brume_render *render = create(1, 0);
    brume_thread_join(render->program.thread);
    render->program.thread = NULL;
    render->program.state = 2;
    OK(brume_render_run(render, NULL, NULL));
    assert_int_equal(render->program.lanes, 1);
    expect_exact_film(render);
    brume_render_destroy(render);
}

/* A launch of the narrow program broke off between two of its pixels, in the middle of a wide tile; the state goes to a
 * file, and the wide program does what is missing, and nothing twice. */
static void the_wide_one_settles_what_the_narrow_one_left(void **state) {
    (void)state;
    if (device->info.lanes == 1) skip();
    char path[] = "/tmp/brume-quick-XXXXXX";
    int file = mkstemp(path);
    assert_true(file >= 0);
    close(file);
    brume_render *render = create(1, 0);
    render->program.swap_at = NEVER;
    while (!render->pass.groups_done || render->pass.samples < 2)
        assert_int_equal(break_off_after(render, 50, 1), BRUME_CANCELLED);
    size_t lanes = render->stats.lanes;
    assert_int_equal(render->program.lanes, 1);
    render->pass.doubtful = 5;
    render->pass.doubtful_lanes = 1;
    assert_int_equal(brume_render_launch_units(render, render->pass.groups_done * lanes + 1, 2 * lanes + lanes / 2,
                                               render->samples_done, render->pass.samples, 0), CL_SUCCESS);
    OK(brume_render_save(render, path));
    brume_render_destroy(render);
    for (int smaller = 0; smaller < 2; smaller++) {
        render = create(0, 0);
        OK(brume_render_load(render, path));
        assert_int_equal(render->program.lanes, lanes);
        render->most_groups = (uint32_t)smaller;
        OK(brume_render_run(render, NULL, NULL));
        expect_exact_film(render);
        brume_render_destroy(render);
    }
    remove(path);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_swap_leaves_no_trace),
        cmocka_unit_test(a_quick_start_gives_the_same_film),
        cmocka_unit_test(the_wide_one_settles_what_the_narrow_one_left),
        cmocka_unit_test(a_width_asked_for_is_waited_for),
        cmocka_unit_test(a_render_may_end_before_its_program),
        cmocka_unit_test(a_failed_program_is_done_without),
    };
    return cmocka_run_group_tests(tests, setup, teardown);
}

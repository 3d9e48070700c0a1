/* test_devices.c -- several devices share a render: the two halves of a split CPU give the whole one's film, to the bit,
 * whatever the goal, in one go or broken off, saved and gone on with.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "break_off.h"
#include "checkpoints.h"
#include "crew_member.h"
#include "device_parts.h"

static brume_device *halves;

static int setup(void **state) {
    if (open_checkpoints(state) != 0) return -1;
    halves = device ? open_halves() : NULL;
    return 0;
}

static int teardown(void **state) {
    brume_device_destroy(halves);
    return close_checkpoints(state);
}

#define NEEDS_HALVES() do { if (halves == NULL) skip(); } while (0)

static brume_render *create_on(brume_device *on, const brume_scene *scene, const brume_render_desc *desc) {
    brume_render *render;
    must(brume_render_create(on, scene, desc, &render));
    return render;
}

/* ---- parts, and what is no such thing ---- */

static void parts_have_all_cores(void **state) {
    (void)state;
    NEEDS_HALVES();
    brume_device_info whole, part, both;
    uint32_t units = 0;
    must(brume_device_get_info(device, &whole));
    must(brume_device_get_info(halves, &both));
    assert_int_equal(both.compute_units, whole.compute_units);
    assert_string_equal(both.name, whole.name);
    assert_int_equal(both.lanes, whole.lanes);
    uint32_t parts = whole.compute_units < 3 ? whole.compute_units : 3;
    for (uint32_t i = 0; i < parts; i++) {
        brume_device *one;
        must(brume_device_open_part(context, BRUME_DEVICE_ANY, i, parts, &one));
        must(brume_device_get_info(one, &part));
        assert_in_range(part.compute_units, whole.compute_units / parts, whole.compute_units / parts + 1);
        units += part.compute_units;
        brume_device_destroy(one);
    }
    assert_int_equal(units, whole.compute_units);
}

static void what_is_no_part_is_refused(void **state) {
    (void)state;
    NEEDS_DEVICE();
    brume_device *none = NULL;
    uint32_t cores = device->info.compute_units;
    assert_int_equal(brume_device_open_part(context, BRUME_DEVICE_ANY, 2, 2, &none), BRUME_ERROR_ARGUMENT);
    assert_int_equal(brume_device_open_part(context, BRUME_DEVICE_ANY, 0, 0, &none), BRUME_ERROR_ARGUMENT);
    assert_int_equal(brume_device_open_part(context, BRUME_DEVICE_ANY, 0, cores + 1, &none), BRUME_ERROR_ARGUMENT);
    assert_int_equal(brume_device_open_part(context, 1000, 0, 2, &none), BRUME_ERROR_NO_DEVICE);
    assert_int_equal(brume_device_join(NULL, 1, &none), BRUME_ERROR_ARGUMENT);
    assert_int_equal(brume_device_join(&device, 0, &none), BRUME_ERROR_ARGUMENT);
    brume_device *twice[2] = {device, device}, *hole[2] = {device, NULL};
    assert_int_equal(brume_device_join(twice, 2, &none), BRUME_ERROR_ARGUMENT);
    assert_int_equal(brume_device_join(hole, 2, &none), BRUME_ERROR_ARGUMENT);
    if (halves) assert_int_equal(brume_device_join(&halves, 1, &none), BRUME_ERROR_ARGUMENT);
    assert_null(none);
}

/* ---- the same film ---- */

/* So many groups at a time: many launches, and chunks of one group where they end. */
enum { GROUPS = 29 };

/* A render that has begun: on several devices each of them has done something. */
static brume_render *begin_on(brume_device *on, const brume_scene *scene, const brume_render_desc *desc) {
    brume_render *render = create_on(on, scene, desc);
    while (render->crew && !(brume_crew_work(render->crew, 0) > 0 && brume_crew_work(render->crew, 1) > 0))
        assert_int_equal(break_off_after(render, GROUPS, 1), BRUME_CANCELLED); /* it would be done with one alone */
    return render;
}

static void finish_on(brume_device *on, const brume_scene *scene, const brume_render_desc *desc, whole_film *out) {
    finish(begin_on(on, scene, desc), out);
}

static void expect_same_film(const brume_render_desc *desc) {
    static whole_film one, both;
    brume_scene *scene = slats();
    finish_on(device, scene, desc, &one);
    finish_on(halves, scene, desc, &both);
    expect_same(&one, &both);
    brume_scene_destroy(scene);
}

static void same_film(void **state) {
    (void)state;
    NEEDS_HALVES();
    brume_render_desc desc = checkpoint_desc();
    desc.sample_count = 21;
    expect_same_film(&desc);
}

/* Tiles that lie partly outside, and all planes that there are. */
static void same_layers_of_a_crop(void **state) {
    (void)state;
    NEEDS_HALVES();
    enum { CROP_WIDTH = 31, CROP_HEIGHT = 23, CROP = CROP_WIDTH * CROP_HEIGHT };
    static const brume_channel channels[] = {BRUME_CHANNEL_RADIANCE, BRUME_CHANNEL_ALBEDO, BRUME_CHANNEL_NORMAL,
                                             BRUME_CHANNEL_INDIRECT, BRUME_CHANNEL_VOLUME};
    static float film[2][5][3 * CROP], segments[2][CROP];
    brume_scene *scene = slats();
    brume_render_desc desc = checkpoint_desc();
    desc.use_crop = 1;
    desc.crop_x = 3;
    desc.crop_y = 2;
    desc.crop_width = CROP_WIDTH;
    desc.crop_height = CROP_HEIGHT;
    desc.light_layers = 1;
    for (int i = 0; i < 2; i++) {
        brume_render *render = begin_on(i ? halves : device, scene, &desc);
        must(brume_render_run(render, NULL, NULL));
        for (int k = 0; k < 5; k++) must(brume_render_read(render, channels[k], film[i][k], 3 * CROP));
        must(brume_render_read(render, BRUME_CHANNEL_SEGMENTS, segments[i], CROP));
        brume_render_destroy(render);
    }
    assert_memory_equal(film[0], film[1], sizeof film[0]);
    assert_memory_equal(segments[0], segments[1], sizeof segments[0]);
    brume_scene_destroy(scene);
}

static void same_film_with_a_goal(void **state) {
    (void)state;
    NEEDS_HALVES();
    brume_render_desc desc = checkpoint_desc();
    desc.noise_threshold = 0.005;
    desc.adaptive = BRUME_ADAPTIVE_ON;
    expect_same_film(&desc);
    desc.noise_threshold = 0;
    desc.sample_count = 40;
    expect_same_film(&desc);
}

/* One is said to be a thousand times as slow, and to need a thousand groups at once: it is left alone, but for a try now
 * and then, by which it is found out to be no such thing. */
static void a_slow_one_is_tried_again(void **state) {
    (void)state;
    NEEDS_HALVES();
    static whole_film one, both;
    brume_scene *scene = slats();
    brume_render_desc desc = checkpoint_desc();
    desc.sample_count = 21;
    finish_on(device, scene, &desc, &one);
    brume_render *render = begin_on(halves, scene, &desc);
    brume_crew_member *fast = &render->crew->members[0], *slow = &render->crew->members[1];
    double before = slow->work;
    slow->speed = fast->speed / 1000;
    slow->device.info.compute_units = 1000;
    slow->declined = 0;
    slow->patience = 8;
    assert_int_equal(break_off_after(render, GROUPS, 4), BRUME_CANCELLED);
    assert_true(slow->work == before);
    assert_int_equal(break_off_after(render, GROUPS, 6), BRUME_CANCELLED);
    assert_true(slow->work > before);
    assert_true(slow->speed > fast->speed / 1000);
    finish(render, &both);
    expect_same(&one, &both);
    brume_scene_destroy(scene);
}

/* One lane on one, four on the other: as a GPU and a CPU would. */
static void same_film_from_two_widths(void **state) {
    (void)state;
    NEEDS_HALVES();
    static whole_film one, both;
    brume_scene *scene = slats();
    brume_render_desc desc = checkpoint_desc();
    desc.sample_count = 13;
    desc.lanes = 0;
    uint32_t own[3] = {device->info.lanes, halves->members[0]->info.lanes, halves->info.lanes};
    device->info.lanes = halves->members[0]->info.lanes = halves->info.lanes = 4;
    halves->members[1]->info.lanes = 1;
    finish_on(device, scene, &desc, &one);
    finish_on(halves, scene, &desc, &both);
    device->info.lanes = halves->members[1]->info.lanes = own[0];
    halves->members[0]->info.lanes = own[1];
    halves->info.lanes = own[2];
    expect_same(&one, &both);
    brume_scene_destroy(scene);
}

/* While a thread of each half builds the wide program. */
static void same_film_begun_quickly(void **state) {
    (void)state;
    NEEDS_HALVES();
    static whole_film one, both;
    brume_scene *scene = slats();
    brume_render_desc desc = brume_render_desc_default();
    desc.sample_count = 16;
    desc.guides = 0;
    finish_on(device, scene, &desc, &one);
    assert_int_equal(setenv("BRUME_CACHE_DIR", "", 1), 0);
    desc.quick_start = 1;
    brume_render *render = create_on(halves, scene, &desc);
    assert_int_equal(setenv("BRUME_CACHE_DIR", path_of(""), 1), 0);
    assert_int_equal(render->stats.quick_lanes, 1);
    render->launch_groups = GROUPS;
    finish(render, &both);
    expect_same(&one, &both);
    brume_scene_destroy(scene);
}

/* ---- broken off ---- */

/* Saved in the middle of a pass by one, and gone on with by the other. */
static void expect_same_resumed(brume_device *first, brume_device *then, const brume_render_desc *desc) {
    static whole_film whole, resumed;
    char path[128];
    snprintf(path, sizeof path, "%s", path_of("state"));
    brume_scene *scene = slats();
    finish_on(device, scene, desc, &whole);
    brume_render *begun = create_on(first, scene, desc);
    if (desc->adaptive == BRUME_ADAPTIVE_ON)
        must(break_off_in_a_pass(begun, GROUPS));
    else
        assert_int_equal(break_off_after(begun, GROUPS, 37), BRUME_CANCELLED);
    assert_true(begun->pass.groups_done > 0);
    must(brume_render_save(begun, path));
    brume_render_destroy(begun);
    brume_render *render = create_on(then, scene, desc);
    must(brume_render_load(render, path));
    finish(render, &resumed);
    expect_same(&whole, &resumed);
    brume_scene_destroy(scene);
}

static void same_film_resumed(void **state) {
    (void)state;
    NEEDS_HALVES();
    brume_render_desc desc = checkpoint_desc();
    desc.sample_count = 24;
    expect_same_resumed(halves, halves, &desc);
    desc.adaptive = BRUME_ADAPTIVE_ON;
    expect_same_resumed(halves, device, &desc);
    expect_same_resumed(device, halves, &desc);
}

/* Before it has begun, in its middle, and while the device and the context's owner are gone. */
static void same_film_cancelled(void **state) {
    (void)state;
    NEEDS_HALVES();
    static whole_film one, both;
    brume_scene *scene = slats();
    brume_render_desc desc = checkpoint_desc();
    desc.sample_count = 20;
    finish_on(device, scene, &desc, &one);
    brume_device *own = open_halves();
    brume_render *render = create_on(own, scene, &desc);
    brume_device_destroy(own);
    brume_render_cancel(render);
    assert_int_equal(brume_render_run(render, NULL, NULL), BRUME_CANCELLED);
    for (int i = 0; i < 5; i++) assert_int_equal(break_off_after(render, GROUPS, 3), BRUME_CANCELLED);
    finish(render, &both);
    expect_same(&one, &both);
    brume_scene_destroy(scene);
}

/* A sample explained comes from the first of them. */
static void a_sample_is_traced(void **state) {
    (void)state;
    NEEDS_HALVES();
    brume_scene *scene = slats();
    brume_trace one, both;
    must(brume_sample_trace(device, scene, NULL, 20, 14, 3, &one));
    must(brume_sample_trace(halves, scene, NULL, 20, 14, 3, &both));
    assert_int_equal(one.count, both.count);
    assert_memory_equal(one.radiance, both.radiance, sizeof one.radiance);
    brume_trace_free(&one);
    brume_trace_free(&both);
    brume_scene_destroy(scene);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(parts_have_all_cores),
        cmocka_unit_test(what_is_no_part_is_refused),
        cmocka_unit_test(same_film),
        cmocka_unit_test(same_layers_of_a_crop),
        cmocka_unit_test(same_film_with_a_goal),
        cmocka_unit_test(a_slow_one_is_tried_again),
        cmocka_unit_test(same_film_from_two_widths),
        cmocka_unit_test(same_film_begun_quickly),
        cmocka_unit_test(same_film_resumed),
        cmocka_unit_test(same_film_cancelled),
        cmocka_unit_test(a_sample_is_traced),
    };
    return cmocka_run_group_tests_name("devices", tests, setup, teardown);
}

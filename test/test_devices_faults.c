/* test_devices_faults.c -- of several devices that share a render one fails, or all do, or one is slow: the film is the
 * one of a device that didn't, bad samples and all, and the faster device has done more of it.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "device_parts.h"
#include "faults/cl_shim.h"
#include "known_answer.h"
#include "planted.h"
#include "render.h"

enum { COUNT = PIXELS * PIXELS, SAMPLES = 8, LANES = 4, GROUPS = COUNT / LANES / 4 };

typedef struct film {
    float radiance[3 * COUNT], counts[COUNT], bad[COUNT];
    uint64_t bad_samples;
} film;

static char folder[] = "/tmp/brume-devices-XXXXXX";
static brume_scene *scene;
static brume_device *halves;
static film right;
static unsigned warnings;
static char last_warning[512];

static void keep_warning(void *user, brume_log_level level, const char *message) {
    (void)user;
    if (level != BRUME_LOG_WARNING || strstr(message, "NaN")) return;
    warnings++;
    snprintf(last_warning, sizeof last_warning, "%s", message);
}

static brume_render *create_on(brume_device *on) {
    brume_render_desc desc = brume_render_desc_default();
    brume_render *render;
    desc.lanes = LANES;
    desc.guides = 0;
    must(brume_render_create(on, scene, &desc, &render));
    render->launch_groups = GROUPS;
    return render;
}

static void look(brume_render *render, film *out) {
    brume_render_stats stats;
    must(brume_render_read(render, BRUME_CHANNEL_RADIANCE, out->radiance, 3 * COUNT));
    must(brume_render_read(render, BRUME_CHANNEL_SAMPLE_COUNT, out->counts, COUNT));
    must(brume_render_read(render, BRUME_CHANNEL_BAD_SAMPLES, out->bad, COUNT));
    must(brume_render_get_stats(render, &stats));
    out->bad_samples = stats.bad_samples;
}

static void expect_right(brume_render *render) {
    static film found;
    look(render, &found);
    assert_memory_equal(found.radiance, right.radiance, sizeof right.radiance);
    assert_memory_equal(found.counts, right.counts, sizeof right.counts);
    assert_memory_equal(found.bad, right.bad, sizeof right.bad);
    assert_int_equal(found.bad_samples, right.bad_samples);
}

static int setup(void **state) {
    cl_shim_reset();
    if (!mkdtemp(folder) || setenv("BRUME_CACHE_DIR", folder, 1) != 0 || open_device(state) != 0) return -1;
    if (!device) return 0;
    halves = open_halves();
    scene = new_scene(3, SAMPLES);
    set_camera(scene, &along_z, add_medium(scene, 0.2, 0.9, 0.5, 0));
    add_point(scene, 0.5, 1.5, 2);
    planted_bug("path_state.h", "    p.radiance = cgrey(R(0));",
                "    p.radiance = cgrey(((x & I(3)) == I(1)) & (to_ireal(sample) == I(2)) ? REAL_NAN : R(0));");
    brume_render *render = create_on(device);
    must(brume_render_run(render, NULL, NULL));
    look(render, &right);
    brume_render_destroy(render);
    brume_context_set_log(context, keep_warning, NULL);
    return right.bad_samples == COUNT / 4 ? 0 : -1;
}

static int teardown(void **state) {
    char command[128];
    planted_remove();
    brume_device_destroy(halves);
    brume_scene_destroy(scene);
    snprintf(command, sizeof command, "rm -rf '%s'", folder);
    return close_device(state) == 0 && system(command) == 0 ? 0 : -1;
}

#define NEEDS_HALVES() do { if (halves == NULL) skip(); } while (0)

static void bad_samples_add_up(void **state) {
    (void)state;
    NEEDS_HALVES();
    brume_render *render = create_on(halves);
    must(brume_render_run(render, NULL, NULL));
    assert_true(brume_crew_work(render->crew, 0) > 0 && brume_crew_work(render->crew, 1) > 0);
    expect_right(render);
    brume_render_destroy(render);
}

/* Whichever call of a launch fails, and whatever has been done by then. */
static void the_other_goes_on(void **state) {
    (void)state;
    NEEDS_HALVES();
    static const struct { cl_function function; cl_manner manner; } ways[] = {
        {CL_ENQUEUE_ND_RANGE_KERNEL, CL_FAILS}, {CL_ENQUEUE_ND_RANGE_KERNEL, CL_HALF}, {CL_FINISH, CL_FAILS},
        {CL_FINISH, CL_DONE}, {CL_SET_KERNEL_ARG, CL_FAILS}, {CL_ENQUEUE_WRITE_BUFFER_RECT, CL_FAILS},
        {CL_ENQUEUE_READ_BUFFER_RECT, CL_FAILS}, {CL_ENQUEUE_READ_BUFFER, CL_FAILS},
        {CL_ENQUEUE_WRITE_BUFFER, CL_FAILS}};
    unsigned fired = 0;
    brume_render *first = create_on(halves);
    brume_render_destroy(first); /* which leaves the program in the cache */
    for (size_t w = 0; w < sizeof ways / sizeof *ways; w++)
        for (unsigned n = 3; n <= 23; n += 10) { /* in the pilot, and in passes */
            const cl_fault fault = {ways[w].function, 0, n, CL_INVALID_COMMAND_QUEUE, ways[w].manner};
            brume_render *render = create_on(halves);
            warnings = 0;
            cl_shim_reset();
            cl_shim_arm(&fault);
            brume_result result = brume_render_run(render, NULL, NULL);
            int failed = cl_shim_disarm();
            /* What the end of a run reads is the film of the host's. */
            must(result);
            fired += (unsigned)failed;
            assert_int_equal(warnings, failed);
            if (failed) assert_non_null(strstr(last_warning, "failed with CL_INVALID_COMMAND_QUEUE (-36): the other goes on"));
            expect_right(render);
            brume_render_destroy(render);
        }
    print_message("%u faults\n", fired);
    assert_true(fired >= 20);
}

/* All of them, and back again; the film in between is there, and so is a file of it. */
static void all_fail_and_come_back(void **state) {
    (void)state;
    NEEDS_HALVES();
    char path[64];
    snprintf(path, sizeof path, "%s/state", folder);
    for (unsigned n = 1; n <= 41; n += 8) {
        const cl_fault fault = {CL_ENQUEUE_ND_RANGE_KERNEL, 0, n, CL_INVALID_COMMAND_QUEUE, CL_LOST};
        brume_render *render = create_on(halves), *other = create_on(halves);
        cl_shim_reset();
        cl_shim_arm(&fault);
        brume_result result = brume_render_run(render, NULL, NULL);
        static film broken;
        if (cl_shim_fired()) {
            assert_int_equal(result, BRUME_ERROR_DEVICE);
            look(render, &broken); /* the device is gone, the film is here */
        }
        cl_shim_disarm();
        must(brume_render_save(render, path));
        must(brume_render_run(render, NULL, NULL));
        expect_right(render);
        brume_render_destroy(render);
        brume_render_destroy(other);
    }
}

/* Without bad samples a doubt that was saved can be settled, by another render. */
static void a_doubt_is_settled_from_a_file(void **state) {
    (void)state;
    NEEDS_HALVES();
    static film whole, resumed;
    char path[64];
    snprintf(path, sizeof path, "%s/state", folder);
    planted_remove();
    brume_render *render = create_on(device);
    must(brume_render_run(render, NULL, NULL));
    look(render, &whole);
    brume_render_destroy(render);
    unsigned doubts = 0;
    for (unsigned n = 5; n <= 29; n += 4) {
        const cl_fault fault = {CL_ENQUEUE_ND_RANGE_KERNEL, 0, n, CL_INVALID_COMMAND_QUEUE, CL_LOST};
        render = create_on(halves);
        cl_shim_reset();
        cl_shim_arm(&fault);
        brume_result result = brume_render_run(render, NULL, NULL);
        if (!cl_shim_disarm()) must(result);
        doubts += render->pass.doubtful > 0;
        must(brume_render_save(render, path));
        brume_render_destroy(render);
        render = create_on(halves);
        must(brume_render_load(render, path));
        must(brume_render_run(render, NULL, NULL));
        look(render, &resumed);
        assert_memory_equal(&whole, &resumed, sizeof whole);
        brume_render_destroy(render);
    }
    print_message("%u doubts\n", doubts);
    assert_true(doubts > 0);
}

/* Launches that are too large for what resources there are. */
static void smaller_launches_are_tried(void **state) {
    (void)state;
    NEEDS_HALVES();
    for (size_t most = 1; most <= 3; most++) {
        brume_render *render = create_on(halves);
        render->launch_groups = 0; /* all at once, if time allows */
        cl_shim_set_most_items(most);
        brume_result result = brume_render_run(render, NULL, NULL);
        cl_shim_set_most_items(0);
        must(result);
        assert_true(brume_crew_work(render->crew, 0) > 0 && brume_crew_work(render->crew, 1) > 0);
        brume_render_destroy(render);
    }
}

/* Of two made-up devices one is four times as fast: what their work takes besides is little against 50 and 200
 * microseconds a sample of a group. */
static void the_faster_one_does_more(void **state) {
    (void)state;
    NEEDS_HALVES();
    for (uint32_t slow = 0; slow < 2; slow++) {
        brume_render *render = create_on(halves);
        must(brume_render_set_sample_count(render, 128));
        render->launch_groups = 0;
        cl_shim_set_drag(0, halves->members[slow]->queue, 2e-4);
        cl_shim_set_drag(1, halves->members[1 - slow]->queue, 5e-5);
        brume_result result = brume_render_run(render, NULL, NULL);
        cl_shim_set_drag(0, NULL, 0);
        cl_shim_set_drag(1, NULL, 0);
        must(result);
        double ratio = brume_crew_work(render->crew, 1 - slow) / brume_crew_work(render->crew, slow);
        print_message("the faster one has done %.2f times as much\n", ratio);
        assert_true(ratio > 2 && ratio < 8);
        brume_render_destroy(render);
    }
}

/* One that has no room for the scene is left out; if none has, that is the error. */
static void who_cannot_begin_is_left_out(void **state) {
    (void)state;
    NEEDS_HALVES();
    brume_render_desc desc = brume_render_desc_default();
    desc.lanes = LANES;
    brume_render *render = NULL;
    for (unsigned n = 1; n <= 40; n += 13) {
        const cl_fault fault = {CL_CREATE_BUFFER, 0, n, CL_MEM_OBJECT_ALLOCATION_FAILURE, CL_FAILS};
        int before = cl_shim_outstanding();
        warnings = 0;
        cl_shim_reset();
        cl_shim_arm(&fault);
        must(brume_render_create(halves, scene, &desc, &render));
        assert_true(cl_shim_disarm());
        assert_int_equal(warnings, 1);
        assert_non_null(strstr(last_warning, "takes no part: the scene and its picture need"));
        must(brume_render_run(render, NULL, NULL));
        brume_render_destroy(render);
        assert_int_equal(cl_shim_outstanding(), before);
    }
    const cl_fault all = {CL_CREATE_BUFFER, 0, 1, CL_MEM_OBJECT_ALLOCATION_FAILURE, CL_FULL};
    int before = cl_shim_outstanding();
    render = NULL;
    cl_shim_reset();
    cl_shim_arm(&all);
    assert_int_equal(brume_render_create(halves, scene, &desc, &render), BRUME_ERROR_MEMORY);
    cl_shim_disarm();
    assert_null(render);
    assert_int_equal(cl_shim_outstanding(), before);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(bad_samples_add_up),
        cmocka_unit_test(the_other_goes_on),
        cmocka_unit_test(all_fail_and_come_back),
        cmocka_unit_test(a_doubt_is_settled_from_a_file),
        cmocka_unit_test(smaller_launches_are_tried),
        cmocka_unit_test(the_faster_one_does_more),
        cmocka_unit_test(who_cannot_begin_is_left_out),
    };
    return cmocka_run_group_tests_name("devices that fail", tests, setup, teardown);
}

/* test_bad_launches.c -- launches that fail where samples come out NaN: what is missing of the counts is not taken for
 * work that is missing, so that the film is the one that there is without the failure.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "faults/cl_shim.h"
#include "known_answer.h"
#include "planted.h"
#include "render.h"

enum { COUNT = PIXELS * PIXELS, SAMPLES = 8, LAUNCHES = 4, LANES = 4, GROUPS = COUNT / LANES / LAUNCHES };

typedef struct film {
    float radiance[3 * COUNT], counts[COUNT], bad[COUNT];
    uint64_t bad_samples;
} film;

static char folder[] = "/tmp/brume-bad-launches-XXXXXX";
static brume_scene *scene;

static int setup(void **state) {
    cl_shim_reset();
    if (!mkdtemp(folder) || setenv("BRUME_CACHE_DIR", folder, 1) != 0 || open_device(state) != 0) return -1;
    if (!device) return 0;
    scene = new_scene(3, SAMPLES);
    set_camera(scene, &along_z, add_medium(scene, 0.2, 0.9, 0.5, 0));
    add_point(scene, 0.5, 1.5, 2);
    /* In some pixels the first samples are dropped; in one all of the second half. */
    planted_bug("path_state.h", "    p.radiance = cgrey(R(0));",
                "    ireal n = to_ireal(sample);\n"
                "    mask first = ((x & I(3)) == I(1)) & (n < I(3));\n"
                "    mask last = (x == I(2)) & (y == I(5)) & (n >= I(4));\n"
                "    p.radiance = cgrey(first | last ? REAL_NAN : R(0));");
    return 0;
}

static int teardown(void **state) {
    char command[128];
    planted_remove();
    brume_scene_destroy(scene);
    snprintf(command, sizeof command, "rm -rf '%s'", folder);
    return close_device(state) == 0 && system(command) == 0 ? 0 : -1;
}

static brume_render *create(void) {
    brume_render_desc desc = brume_render_desc_default();
    brume_render *render;
    desc.lanes = LANES;
    desc.guides = 0;
    must(brume_render_create(device, scene, &desc, &render));
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

/* A render whose n-th launch fails, which goes on; `broken` is its film in between. */
static void interrupted(unsigned n, cl_manner manner, film *broken, film *whole) {
    const cl_fault fault = {manner == CL_HALF ? CL_ENQUEUE_ND_RANGE_KERNEL : CL_FINISH, 0, n, CL_INVALID_COMMAND_QUEUE,
                            manner};
    brume_render *render = create();
    cl_shim_reset();
    cl_shim_arm(&fault);
    brume_result result = brume_render_run(render, NULL, NULL);
    assert_true(cl_shim_disarm());
    assert_int_equal(result, BRUME_ERROR_DEVICE);
    assert_int_equal(render->pass.doubtful, GROUPS);
    look(render, broken);
    must(brume_render_run(render, NULL, NULL));
    look(render, whole);
    brume_render_destroy(render);
}

/* After the pilot, in passes of 1, 1, 2 and 4 samples, when 0, 1, 2 and 3 have been dropped of some pixels. */
static void nothing_is_rendered_twice(void **state) {
    static film right, broken, whole;
    static const cl_manner manners[] = {CL_DONE, CL_FAILS, CL_HALF};
    (void)state;
    NEEDS_DEVICE();
    brume_render *render = create();
    must(brume_render_run(render, NULL, NULL));
    look(render, &right);
    brume_render_destroy(render);
    for (int i = 0; i < COUNT; i++)
        assert_true(right.bad[i] == (i % PIXELS % 4 == 1 ? 3 : i == 5 * PIXELS + 2 ? 4 : 0) &&
                    right.counts[i] == SAMPLES - right.bad[i]);
    for (unsigned pass = 0; pass < 4; pass++)
        for (int m = 0; m < 3; m++) {
            interrupted((1 + pass) * LAUNCHES + 2, manners[m], &broken, &whole);
            assert_memory_equal(whole.counts, right.counts, sizeof right.counts);
            assert_memory_equal(whole.radiance, right.radiance, sizeof right.radiance);
            assert_memory_equal(whole.bad, right.bad, sizeof right.bad);
            assert_int_equal(whole.bad_samples, right.bad_samples);
            for (int i = 0; i < COUNT; i++) assert_true(broken.bad[i] >= 0 && broken.bad[i] <= right.bad[i]);
        }
}

/* From a checkpoint the counts of before the pass are not known. */
static void a_doubt_in_a_file_is_told(void **state) {
    static film broken;
    char path[64];
    (void)state;
    NEEDS_DEVICE();
    snprintf(path, sizeof path, "%s/state", folder);
    const cl_fault fault = {CL_FINISH, 0, 2 * LAUNCHES + 2, CL_INVALID_COMMAND_QUEUE, CL_DONE};
    brume_render *render = create();
    cl_shim_reset();
    cl_shim_arm(&fault);
    assert_int_equal(brume_render_run(render, NULL, NULL), BRUME_ERROR_DEVICE);
    assert_true(cl_shim_disarm());
    must(brume_render_save(render, path));
    brume_render_destroy(render);
    render = create();
    must(brume_render_load(render, path));
    assert_int_equal(brume_render_run(render, NULL, NULL), BRUME_ERROR_DEVICE);
    assert_non_null(strstr(brume_context_message(context), "can be read, but not continued"));
    look(render, &broken);
    brume_render_destroy(render);
}

/* From one of the middle of a pass without a doubt they are. */
static int stop_at_twelfth(void *user, const brume_progress *progress) {
    (void)progress;
    return ++*(int *)user >= 12;
}

static void failures_after_a_file(void **state) {
    static film right, whole;
    char path[64];
    int reports = 0;
    (void)state;
    NEEDS_DEVICE();
    snprintf(path, sizeof path, "%s/state", folder);
    brume_render *render = create();
    render->report_seconds = -1;
    assert_int_equal(brume_render_run(render, stop_at_twelfth, &reports), BRUME_CANCELLED);
    assert_true(render->pass.groups_done > 0 && render->samples_done > 0);
    must(brume_render_save(render, path));
    must(brume_render_run(render, NULL, NULL));
    look(render, &right);
    brume_render_destroy(render);
    render = create();
    must(brume_render_load(render, path));
    const cl_fault fault = {CL_FINISH, 0, 1, CL_INVALID_COMMAND_QUEUE, CL_DONE};
    cl_shim_reset();
    cl_shim_arm(&fault);
    assert_int_equal(brume_render_run(render, NULL, NULL), BRUME_ERROR_DEVICE);
    assert_true(cl_shim_disarm());
    must(brume_render_run(render, NULL, NULL));
    look(render, &whole);
    assert_memory_equal(&whole, &right, sizeof whole);
    brume_render_destroy(render);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(nothing_is_rendered_twice),
        cmocka_unit_test(a_doubt_in_a_file_is_told),
        cmocka_unit_test(failures_after_a_file),
    };
    return cmocka_run_group_tests_name("bad_launches", tests, setup, teardown);
}

/* test_checkpoint_memory.c -- memory that runs out while a render takes over a state: BRUME_ERROR_MEMORY comes before
 * anything has changed, so that the render goes on as if nobody had asked. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "break_off.h"
#include "checkpoints.h"
#include "faults/host_shim.h"

/* Goes on for some launches. */
static void run_a_little(brume_render *render, int reports) {
    assert_int_equal(break_off_after(render, 50, reports), BRUME_CANCELLED);
}

/* The state is of the middle of an adaptive pass, which calls for all there is to be made of it. */
static void nothing_has_changed(void **state) {
    (void)state;
    NEEDS_DEVICE();
    if (!host_shim_works()) skip();
    static whole_film whole, after;
    brume_scene *scene = slats();
    brume_render_desc desc = checkpoint_desc();
    desc.adaptive = BRUME_ADAPTIVE_ON;
    desc.sample_count = 32;
    finish(create(scene, &desc), &whole);
    brume_render *render = create(scene, &desc);
    must(break_off_in_a_pass(render, 50));
    must(brume_render_save(render, path_of("state")));
    brume_render_destroy(render);

    brume_context_set_log(context, NULL, NULL);
    render = create(scene, &desc);
    run_a_little(render, 9);
    brume_render_stats stats;
    must(brume_render_get_stats(render, &stats));
    float *before, *now;
    size_t planes = brume_film_plane_count(brume_render_recorded(render));
    must(brume_render_read_planes(render, planes, &before));
    char path[128];
    strcpy(path, path_of("state"));
    must(brume_render_save(render, path_of("own"))); /* hashes are made once and kept */
    unsigned failures = 0, last = 0;
    for (unsigned n = 1;; n++) {
        host_shim_begin(n, 0);
        brume_result result = brume_render_load(render, path);
        int fired = host_shim_fired();
        host_shim_end();
        if (!fired) {
            must(result);
            break;
        }
        if (result == BRUME_OK) { /* stdio does without its buffer */
            must(brume_render_load(render, path_of("own")));
            continue;
        }
        failures++;
        last = n;
        assert_int_equal(result, BRUME_ERROR_MEMORY);
        brume_render_stats still;
        must(brume_render_get_stats(render, &still));
        assert_int_equal(still.samples, stats.samples);
        must(brume_render_read_planes(render, planes, &now));
        assert_memory_equal(now, before, planes * brume_film_slot_count(&render->layout) * sizeof *now);
        free(now);
    }
    assert_true(failures >= 10);
    free(before);
    finish(render, &after);
    expect_same(&whole, &after);

    /* Where it failed last, the render's own way goes on. */
    render = create(scene, &desc);
    run_a_little(render, 9);
    must(brume_render_save(render, path_of("own")));
    host_shim_begin(last, 0);
    brume_result result = brume_render_load(render, path);
    host_shim_end();
    assert_int_equal(result, BRUME_ERROR_MEMORY);
    finish(render, &after);
    expect_same(&whole, &after);
    brume_scene_destroy(scene);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(nothing_has_changed)};
    return cmocka_run_group_tests(tests, open_checkpoints, close_checkpoints);
}

/* test_checkpoint.c -- brume_render_save and brume_render_load: a render that was broken off, anywhere, and goes on in
 * another one comes out the same to the last bit; what doesn't fit is refused and does no harm. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "checkpoint.h"
#include "break_off.h"
#include "checkpoints.h"

/* ---- broken off and gone on ---- */

/* Breaks a render off at its n-th report, after it has been saved there or before. */
typedef struct breaker {
    brume_render *render;
    int reports_left, save_within;
} breaker;

/* Where the breaks came. */
typedef struct places {
    int breaks, in_pass, adaptive, in_adaptive_pass;
} places;

static int on_report(void *user, const brume_progress *progress) {
    breaker *b = user;
    if (progress->fraction >= 1 || --b->reports_left != 0) return 0;
    if (b->save_within) must(brume_render_save(b->render, path_of("state")));
    return 1;
}

/* A render in pieces of `reports` launches each. `groups`: of a launch. */
static void in_pieces(const brume_scene *scene, const brume_render_desc *desc, int reports, uint32_t groups,
                      whole_film *out, places *seen) {
    memset(seen, 0, sizeof *seen);
    for (;;) {
        brume_render *render = create(scene, desc);
        if (seen->breaks) must(brume_render_load(render, path_of("state")));
        render->launch_groups = groups;
        render->report_seconds = -1;
        breaker b = {render, reports, seen->breaks % 2};
        brume_result result = brume_render_run(render, on_report, &b);
        if (result == BRUME_OK) {
            finish(render, out);
            return;
        }
        assert_int_equal(result, BRUME_CANCELLED);
        seen->breaks++;
        seen->in_pass += render->pass.groups_done > 0;
        seen->adaptive += render->ends != NULL;
        seen->in_adaptive_pass += render->ends && render->pass.groups_done > 0;
        if (!b.save_within) must(brume_render_save(render, path_of("state")));
        brume_render_destroy(render);
    }
}

static void broken_renders_come_out_the_same(void **state) {
    (void)state;
    NEEDS_DEVICE();
    static const struct { uint32_t first, count; brume_adaptive adaptive; double threshold; int recorded; } cases[] = {
        {0, 37, BRUME_ADAPTIVE_AUTO, 0, 2},    {16, 21, BRUME_ADAPTIVE_AUTO, 0, 1}, {0, 32, BRUME_ADAPTIVE_ON, 0, 1},
        {0, 0, BRUME_ADAPTIVE_AUTO, 4e-3, 0},  {0, 0, BRUME_ADAPTIVE_OFF, 8e-3, 1},
        {0, 100, BRUME_ADAPTIVE_ON, 1e-9, 0}};
    static whole_film whole, pieces;
    brume_scene *scene = slats();
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        brume_render_desc desc = checkpoint_desc();
        desc.first_sample = cases[i].first;
        desc.sample_count = cases[i].count;
        desc.adaptive = cases[i].adaptive;
        desc.noise_threshold = cases[i].threshold;
        desc.guides = cases[i].recorded > 0;
        desc.light_layers = cases[i].recorded > 1;
        finish(create(scene, &desc), &whole);
        assert_true(whole.complete);
        places seen;
        in_pieces(scene, &desc, 13, 130, &pieces, &seen); /* of 24 x 15 groups: passes of three launches */
        expect_same(&whole, &pieces);
        assert_true(seen.breaks >= 1);
        in_pieces(scene, &desc, 7, 50, &pieces, &seen);
        expect_same(&whole, &pieces);
        assert_true(seen.breaks >= 4 && seen.in_pass >= 2);
        assert_true(!whole.adaptive || seen.in_adaptive_pass >= 1);
    }
    brume_scene_destroy(scene);
}

/* A finished render gets more samples from its file; fewer than it has it can't get. */
static void more_samples_from_a_file(void **state) {
    (void)state;
    NEEDS_DEVICE();
    static whole_film whole, later;
    brume_scene *scene = slats();
    brume_render_desc desc = checkpoint_desc();
    desc.sample_count = 24;
    brume_render *render = create(scene, &desc);
    must(brume_render_run(render, NULL, NULL));
    must(brume_render_save(render, path_of("state")));
    brume_render_destroy(render);
    desc.sample_count = 50;
    finish(create(scene, &desc), &whole);
    render = create(scene, &desc);
    must(brume_render_load(render, path_of("state")));
    finish(render, &later);
    expect_same(&whole, &later);
    desc.sample_count = 23;
    render = create(scene, &desc);
    assert_int_equal(brume_render_load(render, path_of("state")), BRUME_ERROR_CHECKPOINT);
    assert_non_null(strstr(brume_context_message(context), "has 24 samples already, and 23 are asked for"));
    brume_render_destroy(render);
    brume_scene_destroy(scene);
}

/* Another width goes on from the end of a pass, and is refused in the middle of one. */
static void other_widths(void **state) {
    (void)state;
    NEEDS_DEVICE();
    static float wide[3 * COUNT], narrow[3 * COUNT];
    brume_scene *scene = slats();
    for (uint32_t groups = 360; groups >= 180; groups -= 180) {
        brume_render_desc desc = checkpoint_desc();
        desc.noise_threshold = 8e-3;
        desc.guides = 0;
        brume_render *render = create(scene, &desc);
        assert_int_equal(break_off_after(render, groups, 7), BRUME_CANCELLED);
        assert_int_equal(render->pass.samples > 0, groups == 180);
        must(brume_render_save(render, path_of("state")));
        must(brume_render_run(render, NULL, NULL));
        must(brume_render_read(render, BRUME_CHANNEL_RADIANCE, wide, 3 * COUNT));
        brume_render_destroy(render);
        desc.lanes = 1;
        render = create(scene, &desc);
        brume_result result = brume_render_load(render, path_of("state"));
        if (groups == 360) {
            must(result);
            must(brume_render_run(render, NULL, NULL));
            must(brume_render_read(render, BRUME_CHANNEL_RADIANCE, narrow, 3 * COUNT));
            assert_memory_equal(wide, narrow, sizeof wide);
        } else {
            assert_int_equal(result, BRUME_ERROR_CHECKPOINT);
            assert_non_null(strstr(brume_context_message(context), "in the middle of a pass 4 lanes wide"));
        }
        brume_render_destroy(render);
    }
    brume_scene_destroy(scene);
}

static int stop_when_it_grows(void *user, const brume_progress *progress) {
    return progress->samples > *(const uint64_t *)user;
}

/* From the state under a limit, until it grows: whether it did. Without one, from the start to the end. */
static int grows(const brume_scene *scene, double limit, int from_state) {
    brume_render_desc desc = checkpoint_desc();
    brume_render_stats before, after;
    desc.time_limit = limit;
    desc.guides = 0;
    brume_render *render = create(scene, &desc);
    render->report_seconds = -1;
    if (from_state) must(brume_render_load(render, path_of("state")));
    must(brume_render_get_stats(render, &before));
    brume_result result = brume_render_run(render, from_state ? stop_when_it_grows : NULL, &before.samples);
    must(brume_render_get_stats(render, &after));
    assert_true(result == BRUME_OK || result == BRUME_CANCELLED);
    assert_int_equal(after.complete, result == BRUME_OK);
    assert_true(after.render_seconds >= before.render_seconds);
    if (!from_state) must(brume_render_save(render, path_of("state")));
    brume_render_destroy(render);
    return after.samples > before.samples;
}

/* The seconds before count for the limit: a render that had its time ends at once, a longer limit gives it the rest. */
static void time_goes_on(void **state) {
    (void)state;
    NEEDS_DEVICE();
    brume_scene *scene = slats();
    /* Long enough for some samples on any machine. */
    double limit = 0.5;
    while (!grows(scene, limit, 0)) limit *= 2;
    assert_false(grows(scene, limit, 1));
    assert_false(grows(scene, 1e-3, 1));
    assert_true(grows(scene, 1e6, 1));
    brume_scene_destroy(scene);
}

/* ---- what is refused ---- */

static brume_scene *base_scene;
static brume_render_desc base;

static void expect_refused(const brume_scene *scene, const brume_render_desc *desc, const char *part) {
    brume_render *render = create(scene, desc);
    if (brume_render_load(render, path_of("state")) != BRUME_ERROR_CHECKPOINT ||
        !strstr(brume_context_message(context), part))
        fail_msg("expected \"...%s\", got: %s", part, brume_context_message(context));
    brume_render_destroy(render);
}

static void other_renders_are_refused(void **state) {
    (void)state;
    NEEDS_DEVICE();
    base_scene = slats();
    base = checkpoint_desc();
    base.guides = 0;
    base.sample_count = 8;
    brume_render *render = create(base_scene, &base);
    must(brume_render_run(render, NULL, NULL));
    must(brume_render_save(render, path_of("state")));
    brume_render_destroy(render);

    brume_render_desc desc = base;
    desc.use_seed = 1;
    desc.seed = 99;
    expect_refused(base_scene, &desc, "seed");
    desc = base;
    desc.first_sample = 8;
    expect_refused(base_scene, &desc, "first sample is 0, and not 8");
    desc = base;
    desc.noise_threshold = 0.1;
    expect_refused(base_scene, &desc, "noise threshold is 0, and not 0.1");
    desc = base;
    desc.time_limit = 100;
    expect_refused(base_scene, &desc, "time limit");
    desc = base;
    desc.adaptive = BRUME_ADAPTIVE_ON;
    expect_refused(base_scene, &desc, "adaptive");
    desc = base;
    desc.clamp = 3;
    expect_refused(base_scene, &desc, "clamp");
    desc = base;
    desc.error_estimate = 0;
    expect_refused(base_scene, &desc, "error estimate");
    desc = base;
    desc.use_crop = 1;
    desc.crop_x = 4;
    desc.crop_width = WIDTH - 4;
    desc.crop_height = HEIGHT;
    expect_refused(base_scene, &desc, "crop's left edge is 0, and not 4");
    desc = base;
    desc.use_indirect = 1;
    desc.indirect = BRUME_INDIRECT_MIXTURE;
    expect_refused(base_scene, &desc, "indirect");

    /* One number of the scene is another one. */
    brume_scene *scene = slats();
    brume_light_desc light = brume_light_desc_default(BRUME_LIGHT_POINT);
    uint32_t id;
    must(brume_scene_add_light(scene, &light, &id));
    expect_refused(scene, &base, "scene is another one");
    brume_scene_destroy(scene);

    render = create(base_scene, &base);
    assert_int_equal(brume_render_load(render, path_of("nothing")), BRUME_ERROR_CHECKPOINT);
    assert_non_null(strstr(brume_context_message(context), "No such file"));
    assert_int_equal(brume_render_load(render, NULL), BRUME_ERROR_ARGUMENT);
    assert_int_equal(brume_render_save(render, NULL), BRUME_ERROR_ARGUMENT);
    brume_render_destroy(render);
    brume_scene_destroy(base_scene);
}

/* Any one bit, and any length: the file is refused, and the render then is as good as new. */
static void damage_is_noticed(void **state) {
    (void)state;
    NEEDS_DEVICE();
    static whole_film whole, after;
    brume_scene *scene = slats();
    brume_render_desc desc = checkpoint_desc();
    desc.sample_count = 32;
    desc.adaptive = BRUME_ADAPTIVE_ON;
    desc.guides = 0;
    finish(create(scene, &desc), &whole);
    brume_render *render = create(scene, &desc);
    must(brume_render_run(render, NULL, NULL));
    must(brume_render_save(render, path_of("state")));
    brume_render_destroy(render);

    size_t size;
    brume_context_set_log(context, NULL, NULL); /* hundreds of lines */
    unsigned char *bytes = read_whole(path_of("state"), &size);
    render = create(scene, &desc);
    for (size_t at = 0; at < size; at += at < 64 + sizeof(brume_checkpoint_head) ? 5 : size / 41) {
        if (at >= 56 && at < 64) continue; /* nothing is kept there */
        bytes[at] ^= (unsigned char)(1 << at % 8);
        write_whole(path_of("damaged"), bytes, size);
        bytes[at] ^= (unsigned char)(1 << at % 8);
        if (brume_render_load(render, path_of("damaged")) != BRUME_ERROR_CHECKPOINT)
            fail_msg("byte %zu of %zu may be anything", at, size);
    }
    for (size_t length = 0; length < size; length += 1 + length / 3) {
        write_whole(path_of("damaged"), bytes, length);
        assert_int_equal(brume_render_load(render, path_of("damaged")), BRUME_ERROR_CHECKPOINT);
    }
    /* One byte too many is as wrong. */
    bytes[size] = 0;
    write_whole(path_of("damaged"), bytes, size + 1);
    assert_int_equal(brume_render_load(render, path_of("damaged")), BRUME_ERROR_CHECKPOINT);
    finish(render, &after);
    expect_same(&whole, &after);
    free(bytes);
    brume_scene_destroy(scene);
}

/* ---- numbers that no render has ---- */

/* The state with a part of it changed, and the checksum that goes with that: by a number in the head, or one of what
 * lies behind the film. */
static void write_changed(const brume_checkpoint *c) {
    brume_checkpoint_writer writer;
    size_t planes = brume_film_plane_count(c->head.recorded) * COUNT * sizeof(float);
    must(brume_checkpoint_begin(context, path_of("changed"), &writer));
    brume_checkpoint_append(&writer, &c->head, sizeof c->head);
    brume_checkpoint_append(&writer, c->planes, planes);
    brume_checkpoint_append(&writer, c->rest, c->rest_size);
    must(brume_checkpoint_end(context, &writer, 1));
}

static void expect_damaged(brume_render *render, const char *what) {
    if (brume_render_load(render, path_of("changed")) != BRUME_ERROR_CHECKPOINT ||
        !strstr(brume_context_message(context), "is damaged"))
        fail_msg("%s may be anything: %s", what, brume_context_message(context));
}

static void impossible_numbers_are_refused(void **state) {
    (void)state;
    NEEDS_DEVICE();
#define IN_HEAD(member, value) {#member, offsetof(brume_checkpoint_head, member), value}
    static const struct { const char *name; size_t at; uint32_t value; } numbers[] = {
        IN_HEAD(lanes, 0), IN_HEAD(lanes, 3), IN_HEAD(group_count, 361), IN_HEAD(group_count, 0),
        IN_HEAD(groups_done, 359), IN_HEAD(groups_done, UINT32_MAX), IN_HEAD(doubtful, 359),
        IN_HEAD(doubtful, UINT32_MAX), IN_HEAD(samples_done, 1u << 25), IN_HEAD(stage_end, UINT32_MAX),
        IN_HEAD(stage_end, 0), IN_HEAD(pass_samples, UINT32_MAX), IN_HEAD(pass_samples, 0), IN_HEAD(look_at, 3),
        IN_HEAD(look_at, 1u << 31), IN_HEAD(pilot_done, 361), IN_HEAD(has_counts, 2), IN_HEAD(finished, 7),
        IN_HEAD(full_width, 0)};
    static whole_film whole, after;
    brume_scene *scene = slats();
    brume_render_desc desc = checkpoint_desc();
    desc.adaptive = BRUME_ADAPTIVE_ON;
    desc.sample_count = 32;
    finish(create(scene, &desc), &whole);
    brume_render *render = create(scene, &desc);
    while (!render->ends || !render->pass.groups_done || render->pass.groups == 360)
        assert_int_equal(break_off_after(render, 20, 1), BRUME_CANCELLED);
    uint32_t pass_groups = render->pass.groups, groups_done = render->pass.groups_done;
    must(brume_render_save(render, path_of("state")));
    brume_render_destroy(render);

    brume_checkpoint saved;
    must(brume_checkpoint_read(context, path_of("state"), &saved));
    render = create(scene, &desc);
    render->launch_groups = 20;
    brume_context_set_log(context, NULL, NULL);
    write_changed(&saved);
    must(brume_render_load(render, path_of("changed")));
    for (size_t i = 0; i < sizeof numbers / sizeof numbers[0]; i++) {
        brume_checkpoint changed = saved;
        memcpy((char *)&changed.head + numbers[i].at, &numbers[i].value, sizeof numbers[i].value);
        write_changed(&changed);
        expect_damaged(render, numbers[i].name);
    }
    /* The pass has fewer groups than the film: known only from the counts. */
    brume_checkpoint changed = saved;
    changed.head.groups_done = pass_groups;
    write_changed(&changed);
    expect_damaged(render, "groups_done");
    changed.head.groups_done = groups_done;
    changed.head.doubtful = pass_groups - groups_done + 1;
    write_changed(&changed);
    expect_damaged(render, "doubtful");
    /* Behind the film: levels, samples done and to be done, an allocation. */
    size_t levels = (size_t)COUNT * (saved.head.has_plan ? EVERY_LAMP : 0) + 9 * sizeof(float) * COUNT;
    size_t done = levels + COUNT, ends = done + COUNT * sizeof(uint32_t), most = ends + COUNT * sizeof(uint32_t);
    const struct { const char *name; size_t at; uint32_t value, size; } behind[] = {
        {"level", levels + 7, 31, 1},        {"level", levels + 7, 200, 1},   {"done", done + 4 * 7, 1u << 20, 4},
        {"done", done + 4 * 7, 0, 4},        {"ends", ends + 4 * 7, 1u << 30, 4}, {"ends", ends + 4 * 7, 0, 4},
        {"most", most, 30, 4},               {"bin", saved.rest_size - COUNT - 2, 0xffff, 2},
        {"level of it", saved.rest_size - 1, 32, 1}};
    uint8_t *rest = malloc(saved.rest_size);
    assert_non_null(rest);
    changed = saved;
    changed.rest = rest;
    for (size_t i = 0; i < sizeof behind / sizeof behind[0]; i++) {
        memcpy(rest, saved.rest, saved.rest_size);
        memcpy(rest + behind[i].at, &behind[i].value, behind[i].size);
        write_changed(&changed);
        expect_damaged(render, behind[i].name);
    }
    free(rest);
    brume_checkpoint_free(&saved);
    finish(render, &after);
    expect_same(&whole, &after);
    brume_scene_destroy(scene);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(broken_renders_come_out_the_same),
        cmocka_unit_test(more_samples_from_a_file),
        cmocka_unit_test(other_widths),
        cmocka_unit_test(time_goes_on),
        cmocka_unit_test(other_renders_are_refused),
        cmocka_unit_test(damage_is_noticed),
        cmocka_unit_test(impossible_numbers_are_refused),
    };
    return cmocka_run_group_tests(tests, open_checkpoints, close_checkpoints);
}

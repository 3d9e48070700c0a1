/* test_merge.c -- ranges of samples, rendered apart and added up, against one render of all of them; and what doesn't
 * add up. */
#include <math.h>
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

enum { PARTS = 4 };
/* No power of two in all: what a sum loses then shows in the mean. */
static const uint32_t firsts[PARTS + 1] = {0, 16, 37, 38, 61};
static char names[PARTS][64];
static const char *paths[PARTS];

/* A part in a file; with `reports`, broken off after so many. */
static void save_part(const brume_scene *scene, brume_render_desc desc, uint32_t first, uint32_t end, int reports,
                      const char *path) {
    desc.first_sample = first;
    desc.sample_count = end - first;
    brume_render *render = create(scene, &desc);
    if (reports) {
        assert_int_equal(break_off_after(render, 130, reports), BRUME_CANCELLED);
    } else {
        must(brume_render_run(render, NULL, NULL));
    }
    must(brume_render_save(render, path));
    brume_render_destroy(render);
}

static void save_parts(const brume_scene *scene, const brume_render_desc *desc) {
    for (int i = 0; i < PARTS; i++) {
        char name[16];
        snprintf(name, sizeof name, "part-%d", i);
        snprintf(names[i], sizeof names[i], "%s", path_of(name));
        paths[i] = names[i];
        save_part(scene, *desc, firsts[i], firsts[i + 1], 0, paths[i]);
    }
}

/* Units in the last place between two positive floats. */
static int ulps(float a, float b) {
    int32_t x, y;
    memcpy(&x, &a, sizeof x);
    memcpy(&y, &b, sizeof y);
    return abs(x - y);
}

static void read_merged(brume_merged *merged, brume_channel channel, int size, float *out) {
    must(brume_merged_read(merged, channel, out, (size_t)size * COUNT));
}

static void parts_are_the_whole(void **state) {
    (void)state;
    NEEDS_DEVICE();
    enum { PLAIN = 7 };
    static const struct { brume_channel channel; int size, has_signs; } plain[PLAIN] = {
        {BRUME_CHANNEL_ALBEDO, 3, 0}, {BRUME_CHANNEL_NORMAL, 3, 1},  {BRUME_CHANNEL_DEPTH, 1, 0},
        {BRUME_CHANNEL_ALPHA, 1, 0},  {BRUME_CHANNEL_DIRECT, 3, 0},  {BRUME_CHANNEL_VOLUME, 3, 0},
        {BRUME_CHANNEL_SEGMENTS, 1, 0}};
    static float one[3 * COUNT], added[3 * COUNT], other[3 * COUNT];
    brume_scene *scene = slats();
    brume_render_desc desc = checkpoint_desc();
    desc.light_layers = 1;
    save_parts(scene, &desc);
    desc.sample_count = firsts[PARTS];
    brume_render *render = create(scene, &desc);
    must(brume_render_run(render, NULL, NULL));
    brume_merged *merged, *turned;
    const char *const back[] = {paths[2], paths[0], paths[3], paths[1]};
    must(brume_merge(context, paths, PARTS, NULL, &merged));
    must(brume_merge(context, back, PARTS, NULL, &turned));

    must(brume_render_read(render, BRUME_CHANNEL_RADIANCE, one, 3 * COUNT));
    read_merged(merged, BRUME_CHANNEL_RADIANCE, 3, added);
    read_merged(turned, BRUME_CHANNEL_RADIANCE, 3, other);
    assert_memory_equal(added, other, sizeof added);
    int different = 0;
    for (int i = 0; i < 3 * COUNT; i++) {
        assert_true(ulps(one[i], added[i]) <= 1);
        different += one[i] != added[i];
    }
    assert_true(different < 3 * COUNT / 20); /* sums would be off everywhere if compensations were left out */
    must(brume_render_read(render, BRUME_CHANNEL_SAMPLE_COUNT, one, COUNT));
    read_merged(merged, BRUME_CHANNEL_SAMPLE_COUNT, 1, added);
    assert_memory_equal(one, added, COUNT * sizeof *one);
    read_merged(merged, BRUME_CHANNEL_BAD_SAMPLES, 1, added);
    for (int i = 0; i < COUNT; i++) assert_true(added[i] == 0);
    /* Either is off by n 2^-24 of the mean of the absolute values: of the mean, or of 1 for components. */
    for (int k = 0; k < PLAIN; k++) {
        must(brume_render_read(render, plain[k].channel, one, (size_t)plain[k].size * COUNT));
        read_merged(merged, plain[k].channel, plain[k].size, added);
        for (int i = 0; i < plain[k].size * COUNT; i++)
            assert_true(fabs((double)one[i] - added[i]) <= 64 * 0x1p-23 * (plain[k].has_signs ? 1 : one[i]));
    }
    must(brume_render_read(render, BRUME_CHANNEL_VARIANCE, one, 3 * COUNT));
    read_merged(merged, BRUME_CHANNEL_ERROR, 3, added);
    must(brume_render_read(render, BRUME_CHANNEL_RADIANCE, other, 3 * COUNT));
    for (int i = 0; i < 3 * COUNT; i++) /* a difference of squares: their size, over n, and their roundings */
        assert_true(fabs((double)one[i] - added[i]) <=
                    64 * 0x1p-23 * (one[i] + (double)other[i] * other[i] / 64));

    brume_render_stats a, b;
    must(brume_render_get_stats(render, &a));
    must(brume_merged_get_stats(merged, &b));
    assert_int_equal(a.samples, b.samples);
    assert_int_equal(b.first_sample, 0);
    assert_int_equal(b.sample_count, firsts[PARTS]);
    assert_true(b.complete && b.relmse < 0 && b.render_seconds > 0);
    brume_render_destroy(render);
    brume_merged_destroy(merged);
    brume_merged_destroy(turned);
    brume_scene_destroy(scene);
}

static void expect_refused(const char *const *list, size_t count, const brume_merge_desc *desc, const char *part) {
    brume_merged *merged = NULL;
    if (brume_merge(context, list, count, desc, &merged) != BRUME_ERROR_CHECKPOINT ||
        !strstr(brume_context_message(context), part))
        fail_msg("expected \"...%s\", got: %s", part, brume_context_message(context));
    assert_null(merged);
}

static void what_does_not_add_up(void **state) {
    (void)state;
    NEEDS_DEVICE();
    char other[128], same[128], short_one[128], goal[128];
    brume_scene *scene = slats();
    brume_render_desc desc = checkpoint_desc(), changed = desc;
    save_parts(scene, &desc);
    snprintf(other, sizeof other, "%s", path_of("other"));
    snprintf(same, sizeof same, "%s", path_of("same"));
    snprintf(short_one, sizeof short_one, "%s", path_of("short"));
    snprintf(goal, sizeof goal, "%s", path_of("goal"));

    const char *two[] = {paths[0], other};
    changed.use_seed = 1;
    changed.seed = 5;
    save_part(scene, changed, 16, 64, 0, other);
    expect_refused(two, 2, NULL, "its seed is 5, and not 0");
    changed = desc;
    changed.use_crop = 1;
    changed.crop_width = WIDTH - 4;
    changed.crop_height = HEIGHT;
    save_part(scene, changed, 16, 64, 0, other);
    expect_refused(two, 2, NULL, "crop's width");
    changed = desc;
    changed.without = 1u << BRUME_EFFECT_ANISOTROPY;
    save_part(scene, changed, 16, 64, 0, other);
    expect_refused(two, 2, NULL, "choice of effects");
    changed = desc;
    changed.noise_threshold = 0.05;
    save_part(scene, changed, 0, 64, 0, goal);
    const char *with_goal[] = {goal, paths[3]};
    expect_refused(with_goal, 2, NULL, "with a goal");
    brume_scene *scene_of_more = slats();
    brume_light_desc light = brume_light_desc_default(BRUME_LIGHT_POINT);
    uint32_t id;
    must(brume_scene_add_light(scene_of_more, &light, &id));
    save_part(scene_of_more, desc, 16, 64, 0, other);
    expect_refused(two, 2, NULL, "its scene is another one");
    brume_scene_destroy(scene_of_more);

    /* The same samples twice. */
    const char *twice[] = {paths[0], paths[1], paths[0]};
    expect_refused(twice, 3, NULL, "both hold samples 0 to 15");
    save_part(scene, desc, 30, 64, 0, same);
    const char *overlap[] = {same, paths[0], paths[1]};
    expect_refused(overlap, 3, NULL, "both hold samples 30 to 36");

    /* Samples that are missing: between, at the start, at the end that was asked for, in a part. */
    const char *gap[] = {paths[3], paths[0]};
    expect_refused(gap, 2, NULL, "samples are missing: 16 to 37");
    expect_refused(paths + 1, 3, NULL, "samples are missing: 0 to 15");
    const char *single[] = {paths[0], paths[1], paths[3]};
    expect_refused(single, 3, NULL, "samples are missing: 37");
    brume_merge_desc wanted = brume_merge_desc_default();
    wanted.sample_count = 100;
    expect_refused(paths, PARTS, &wanted, "samples are missing: 61 to 99");
    wanted.sample_count = 60;
    expect_refused(paths, PARTS, &wanted, "holds samples 38 to 60, and 0 to 59 are wanted");
    save_part(scene, desc, 16, 64, 13, short_one); /* the pilot's three, then three for each pass: in the fourth */
    const char *unfinished[] = {paths[0], short_one};
    expect_refused(unfinished, 2, NULL, "short holds ");

    /* All the same, what there is can be had: each pixel's mean over what it has. */
    static float count[COUNT], rgb[3 * COUNT];
    brume_merged *merged;
    brume_render_stats stats;
    wanted = brume_merge_desc_default();
    wanted.partial = 1;
    must(brume_merge(context, unfinished, 2, &wanted, &merged));
    must(brume_merged_get_stats(merged, &stats));
    assert_false(stats.complete);
    read_merged(merged, BRUME_CHANNEL_SAMPLE_COUNT, 1, count);
    double sum = 0, least = 64, most = 0;
    for (int i = 0; i < COUNT; i++) {
        sum += count[i];
        least = fmin(least, count[i]);
        most = fmax(most, count[i]);
    }
    assert_true(sum == (double)stats.samples && least > 16 && most < 64 && least < most); /* in a pass */
    read_merged(merged, BRUME_CHANNEL_BAD_SAMPLES, 1, count);
    for (int i = 0; i < COUNT; i++) assert_true(count[i] == 0);
    read_merged(merged, BRUME_CHANNEL_RADIANCE, 3, rgb);
    brume_merged_destroy(merged);

    brume_merged *none = NULL;
    assert_int_equal(brume_merge(context, NULL, 1, NULL, &none), BRUME_ERROR_ARGUMENT);
    assert_int_equal(brume_merge(context, paths, 0, NULL, &none), BRUME_ERROR_ARGUMENT);
    assert_int_equal(brume_merge(NULL, paths, 1, NULL, &none), BRUME_ERROR_ARGUMENT);
    brume_merge_desc wrong = {0};
    assert_int_equal(brume_merge(context, paths, 1, &wrong, &none), BRUME_ERROR_ARGUMENT);
    brume_scene_destroy(scene);
}

/* Parts rendered without guides, at two widths; the picture is written and read. */
static void parts_of_two_widths(void **state) {
    (void)state;
    NEEDS_DEVICE();
    static float one[3 * COUNT], added[3 * COUNT];
    brume_scene *scene = slats();
    brume_render_desc desc = checkpoint_desc();
    desc.guides = 0;
    char a[128], b[128], exr[128];
    snprintf(a, sizeof a, "%s", path_of("a"));
    snprintf(b, sizeof b, "%s", path_of("b"));
    snprintf(exr, sizeof exr, "%s", path_of("both.exr"));
    save_part(scene, desc, 0, 8, 0, a);
    desc.lanes = 1;
    save_part(scene, desc, 8, 16, 0, b);
    const char *both[] = {a, b};
    brume_merged *merged;
    must(brume_merge(context, both, 2, NULL, &merged));
    assert_int_equal(brume_merged_read(merged, BRUME_CHANNEL_ALBEDO, one, 3 * COUNT), BRUME_ERROR_ARGUMENT);
    assert_int_equal(brume_merged_read(merged, BRUME_CHANNEL_RADIANCE, one, COUNT), BRUME_ERROR_ARGUMENT);
    read_merged(merged, BRUME_CHANNEL_RADIANCE, 3, added);
    brume_picture_desc picture = brume_picture_desc_default();
    picture.half = 0;
    must(brume_merged_write(merged, exr, &picture));
    assert_int_equal(brume_merged_write(merged, path_of("both.jpg"), NULL), BRUME_ERROR_ARGUMENT);
    brume_merged_destroy(merged);
    uint32_t width, height;
    float *read;
    must(brume_picture_read(context, exr, &width, &height, &read));
    assert_memory_equal(read, added, sizeof added);
    brume_picture_free(read);
    desc.sample_count = 16;
    brume_render *render = create(scene, &desc);
    must(brume_render_run(render, NULL, NULL));
    must(brume_render_read(render, BRUME_CHANNEL_RADIANCE, one, 3 * COUNT));
    for (int i = 0; i < 3 * COUNT; i++) assert_true(ulps(one[i], added[i]) <= 1);
    brume_render_destroy(render);
    brume_scene_destroy(scene);
}

/* A beam whose lamp is so strong or so weak that light has a unit of its own on the device, or that is so far away that
 * places have an origin of their own. */
static brume_scene *beam_of(double power, double away) {
    static const char xml[] =
        "<scene version='3.0.0'><default name='power' value='1'/><default name='away' value='0'/>"
        "<integrator type='volpath'/>"
        "<medium type='homogeneous' id='fog'><float name='sigma_t' value='0.2'/></medium><sensor type='perspective'>"
        "<transform name='to_world'><lookat origin='0,1,5' target='0,1,0' up='0,1,0'/><translate x='$away'/>"
        "</transform><ref id='fog'/><film type='hdrfilm'><integer name='width' value='48'/>"
        "<integer name='height' value='30'/>"
        "</film></sensor><emitter type='spot'><transform name='to_world'>"
        "<lookat origin='-2,3,1' target='0,1,0' up='0,1,0'/><translate x='$away'/></transform>"
        "<rgb name='intensity' value='$power'/></emitter></scene>";
    char texts[2][32];
    const brume_parameter parameters[] = {{"power", texts[0]}, {"away", texts[1]}};
    brume_scene *scene;
    snprintf(texts[0], sizeof texts[0], "%.17g", power);
    snprintf(texts[1], sizeof texts[1], "%.17g", away);
    write_whole(path_of("beam.xml"), xml, strlen(xml));
    must(brume_scene_load(context, path_of("beam.xml"), parameters, 2, &scene));
    return scene;
}

/* The channels come out in the scene's unit of light. */
static void light_has_a_unit(void **state) {
    (void)state;
    NEEDS_DEVICE();
    static const double powers[] = {60, 6e7, 6e-7};
    static float one[3 * COUNT], added[3 * COUNT];
    char a[128], b[128];
    snprintf(a, sizeof a, "%s", path_of("a"));
    snprintf(b, sizeof b, "%s", path_of("b"));
    const char *both[] = {a, b};
    brume_render_desc desc = checkpoint_desc();
    for (int i = 0; i < 3; i++) {
        brume_scene *scene = beam_of(powers[i], 0);
        brume_merged *merged;
        save_part(scene, desc, 0, 8, 0, a);
        save_part(scene, desc, 8, 16, 0, b);
        must(brume_merge(context, both, 2, NULL, &merged));
        desc.sample_count = 16;
        brume_render *render = create(scene, &desc);
        must(brume_render_run(render, NULL, NULL));
        must(brume_render_read(render, BRUME_CHANNEL_RADIANCE, one, 3 * COUNT));
        read_merged(merged, BRUME_CHANNEL_RADIANCE, 3, added);
        double sum = 0;
        for (int k = 0; k < 3 * COUNT; k++) {
            assert_true(ulps(one[k], added[k]) <= 1);
            sum += one[k];
        }
        assert_true(sum > 1e-5 * powers[i] * 3 * COUNT);
        must(brume_render_read(render, BRUME_CHANNEL_VARIANCE, one, 3 * COUNT));
        read_merged(merged, BRUME_CHANNEL_VARIANCE, 3, added);
        double variances[2] = {0, 0};
        for (int k = 0; k < 3 * COUNT; k++) {
            variances[0] += one[k];
            variances[1] += added[k];
        }
        assert_true(variances[0] > 0 && fabs(variances[1] / variances[0] - 1) < 1e-4);
        brume_render_destroy(render);
        brume_merged_destroy(merged);
        brume_scene_destroy(scene);
    }
}

/* Parts whose arrays are the same, but in units of light or from origins that are not, don't add up, and don't go on.
 */
static void the_same_numbers_of_other_scenes(void **state) {
    (void)state;
    NEEDS_DEVICE();
    static const double scenes[][2][2] = {{{0x1p25, 0}, {0x1p26, 0}}, {{60, 0x1p20}, {60, 0x1p21}}};
    char a[128], b[128];
    snprintf(a, sizeof a, "%s", path_of("a"));
    snprintf(b, sizeof b, "%s", path_of("b"));
    const char *both[] = {a, b};
    for (int i = 0; i < 2; i++) {
        brume_render_desc desc = checkpoint_desc();
        brume_scene *one = beam_of(scenes[i][0][0], scenes[i][0][1]);
        brume_scene *other = beam_of(scenes[i][1][0], scenes[i][1][1]);
        save_part(one, desc, 0, 8, 0, a);
        save_part(other, desc, 8, 16, 0, b);
        expect_refused(both, 2, NULL, "its scene is another one");
        desc.sample_count = 16;
        brume_render *render = create(other, &desc);
        assert_int_equal(brume_render_load(render, a), BRUME_ERROR_CHECKPOINT);
        assert_non_null(strstr(brume_context_message(context), "its scene is another one"));
        brume_render_destroy(render);
        brume_scene_destroy(one);
        brume_scene_destroy(other);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(parts_are_the_whole),
        cmocka_unit_test(what_does_not_add_up),
        cmocka_unit_test(parts_of_two_widths),
        cmocka_unit_test(light_has_a_unit),
        cmocka_unit_test(the_same_numbers_of_other_scenes),
    };
    return cmocka_run_group_tests(tests, open_checkpoints, close_checkpoints);
}

/* test_render_same.c -- one picture however it is made: the same bits whatever the width, the cut of the work and the
 * features compiled; cancelled and gone on with, in ranges, in a crop, with more asked for later. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "spot_scene.h"

static const unsigned stages[] = {0, PART_FOG, PART_FOG | PART_AREA | PART_CLOUD,
                                  PART_FOG | PART_GLASS | PART_SKY | PART_AREA | PART_CLOUD};

static void same_bits_at_every_width(void **state) {
    (void)state;
    NEEDS_DEVICE();
    static float reference[PIXELS * 3], other[PIXELS * 3];
    for (size_t i = 0; i < sizeof stages / sizeof *stages; i++) {
        brume_scene *scene = spot_scene(context, stages[i]);
        brume_render_desc desc = brume_render_desc_default();
        desc.lanes = 1;
        spot_render(scene, &desc, reference);
        assert_true(spot_mean(reference, PIXELS * 3) > 1e-3);
        /* A kernel takes seconds to build: the widths between are tried on the richest stage only. */
        static const uint32_t widths[] = {16, 8, 4};
        size_t count = i + 1 < sizeof stages / sizeof *stages ? 1 : 3;
        for (size_t w = 0; w < count; w++) {
            desc.lanes = widths[w];
            spot_render(scene, &desc, other);
            assert_memory_equal(reference, other, sizeof reference);
        }
        brume_scene_destroy(scene);
    }
}

/* Left-out code must not change the picture: the generic program, which has every feature, gives the same bits. */
static void same_bits_from_the_generic_program(void **state) {
    (void)state;
    NEEDS_DEVICE();
    static float special[PIXELS * 3], generic[PIXELS * 3];
    for (size_t i = 1; i < 3; i++) {
        brume_scene *scene = spot_scene(context, stages[i]);
        brume_render_desc desc = brume_render_desc_default();
        desc.guides = 0;
        spot_render(scene, &desc, special);
        desc.generic = 1;
        desc.guides = 1;
        spot_render(scene, &desc, generic);
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
    (void)state;
    NEEDS_DEVICE();
    static float whole[PIXELS * 3], parts[PIXELS * 3];
    brume_scene *scene = spot_scene(context, PART_FOG);
    brume_render_desc desc = brume_render_desc_default();
    desc.sample_count = 37;
    spot_render(scene, &desc, whole);

    brume_render *render;
    brume_render_stats stats;
    must(brume_render_create(device, scene, &desc, &render));
    int calls = 0, cancels = 0;
    brume_render_cancel(render);
    assert_int_equal(brume_render_run(render, cancel_at_once, &calls), BRUME_CANCELLED);
    must(brume_render_get_stats(render, &stats));
    assert_int_equal(stats.complete, 0);
    assert_int_equal(stats.samples, 0);
    assert_int_equal(calls, 1);
    brume_result result;
    while ((result = brume_render_run(render, cancel_at_once, &calls)) == BRUME_CANCELLED)
        assert_true(++cancels < 1000);
    must(result);
    must(brume_render_read(render, BRUME_CHANNEL_RADIANCE, parts, PIXELS * 3));
    assert_memory_equal(whole, parts, sizeof whole);
    brume_render_destroy(render);
    brume_scene_destroy(scene);
}

/* Two halves of a sample range average to the whole: the samples are functions of their index alone. */
static void sample_ranges_add_up(void **state) {
    (void)state;
    NEEDS_DEVICE();
    static float whole[PIXELS * 3], low[PIXELS * 3], high[PIXELS * 3];
    brume_scene *scene = spot_scene(context, PART_FOG | PART_AREA);
    brume_render_desc desc = brume_render_desc_default();
    desc.sample_count = 8;
    spot_render(scene, &desc, whole);
    desc.sample_count = 4;
    spot_render(scene, &desc, low);
    desc.first_sample = 4;
    spot_render(scene, &desc, high);
    for (size_t i = 0; i < PIXELS * 3; i++) {
        double both = 0.5 * ((double)low[i] + high[i]);
        assert_true(fabs(both - whole[i]) <= 1e-6 * (fabs(both) + 1e-6));
    }
    brume_scene_destroy(scene);
}

static void a_crop_is_a_piece_of_the_whole(void **state) {
    (void)state;
    NEEDS_DEVICE();
    static float whole[PIXELS * 3], crop[7 * 5 * 3];
    brume_scene *scene = spot_scene(context, PART_FOG);
    brume_render_desc desc = brume_render_desc_default();
    spot_render(scene, &desc, whole);
    desc.use_crop = 1;
    desc.crop_x = 11;
    desc.crop_y = 6;
    desc.crop_width = 7;
    desc.crop_height = 5;
    brume_render *render;
    must(brume_render_create(device, scene, &desc, &render));
    must(brume_render_run(render, NULL, NULL));
    must(brume_render_read(render, BRUME_CHANNEL_RADIANCE, crop, 7 * 5 * 3));
    for (int y = 0; y < 5; y++)
        assert_memory_equal(crop + 7 * 3 * y, whole + 3 * (WIDTH * (6 + y) + 11), 7 * 3 * sizeof(float));
    brume_render_destroy(render);
    brume_scene_destroy(scene);
}

static void another_seed_is_another_noise(void **state) {
    (void)state;
    NEEDS_DEVICE();
    static float a[PIXELS * 3], b[PIXELS * 3], again[PIXELS * 3];
    brume_scene *scene = spot_scene(context, PART_FOG);
    brume_render_desc desc = brume_render_desc_default();
    spot_render(scene, &desc, a);
    spot_render(scene, &desc, again);
    assert_memory_equal(a, again, sizeof a);
    desc.use_seed = 1;
    desc.seed = 7;
    spot_render(scene, &desc, b);
    assert_memory_not_equal(a, b, sizeof a);
    brume_scene_destroy(scene);
}

static void double_precision_agrees(void **state) {
    (void)state;
    NEEDS_DEVICE();
    brume_device_info info;
    must(brume_device_describe(context, BRUME_DEVICE_ANY, &info));
    if (!info.has_double) skip();
    static float single[PIXELS * 3], twice[PIXELS * 3];
    brume_scene *scene = spot_scene(context, PART_FOG | PART_AREA);
    brume_render_desc desc = brume_render_desc_default();
    desc.sample_count = 64;
    spot_render(scene, &desc, single);
    desc.precision = BRUME_PRECISION_DOUBLE;
    desc.lanes = 8;
    spot_render(scene, &desc, twice);
    /* The same random numbers: a few paths take another branch, the mean hardly moves. */
    double a = spot_mean(single, PIXELS * 3), b = spot_mean(twice, PIXELS * 3);
    assert_true(fabs(a - b) < 2e-3 * a);
    brume_scene_destroy(scene);
}

/* One render passes through the pictures of fewer samples, and ends in the one asked for at once. */
static void more_samples_later_are_the_same(void **state) {
    (void)state;
    NEEDS_DEVICE();
    static float at_once[PIXELS * 3], grown[PIXELS * 3];
    brume_scene *scene = spot_scene(context, PART_FOG | PART_AREA);
    brume_render_desc desc = brume_render_desc_default();
    brume_render *render;
    brume_render_stats stats;
    desc.guides = 0;
    desc.sample_count = 1;
    must(brume_render_create(device, scene, &desc, &render));
    static const uint32_t counts[] = {1, 2, 4, 7, 24};
    for (size_t i = 0; i < sizeof counts / sizeof counts[0]; i++) {
        must(brume_render_set_sample_count(render, counts[i]));
        must(brume_render_run(render, NULL, NULL));
        must(brume_render_get_stats(render, &stats));
        assert_int_equal(stats.complete, 1);
        assert_int_equal(stats.samples, (uint64_t)counts[i] * PIXELS);
        must(brume_render_read(render, BRUME_CHANNEL_RADIANCE, grown, PIXELS * 3));
        desc.sample_count = counts[i];
        spot_render(scene, &desc, at_once);
        assert_memory_equal(grown, at_once, sizeof grown);
    }
    assert_int_equal(brume_render_set_sample_count(render, 23), BRUME_ERROR_ARGUMENT);
    assert_int_equal(brume_render_set_sample_count(render, 0), BRUME_ERROR_ARGUMENT);
    assert_int_equal(brume_render_set_sample_count(NULL, 32), BRUME_ERROR_ARGUMENT);
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
        cmocka_unit_test(more_samples_later_are_the_same),
    };
    return cmocka_run_group_tests(tests, open_device, close_device);
}

/* test_goal.c -- renders with a goal: they stop where they should, their film is the same however the work is cut, and
 * adaptive sampling changes the error and nothing else. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "known_answer.h"
#include "stats.h"

enum { WIDTH = 64, HEIGHT = 40, COUNT = WIDTH * HEIGHT };

typedef struct film {
    float rgb[3 * COUNT], samples[COUNT];
    brume_render_stats stats;
} film;

/* The beam between slats: shadows with many edges. */
static brume_scene *slats(void) {
    static const brume_parameter parameters[] = {{"width", "64"}, {"height", "40"}};
    brume_scene *scene;
    must(brume_scene_load(context, "scenes/ladder/slats.xml", parameters, 2, &scene));
    return scene;
}

static int cancel_at_once(void *user, const brume_progress *progress) {
    (void)user;
    (void)progress;
    return 1;
}

/* `pieces`: cancelled and continued all the time. */
static void render_film(const brume_scene *scene, const brume_render_desc *desc, int pieces, film *out) {
    brume_render *render;
    brume_result result;
    must(brume_render_create(device, scene, desc, &render));
    do {
        result = brume_render_run(render, pieces ? cancel_at_once : NULL, NULL);
    } while (result == BRUME_CANCELLED);
    must(result);
    must(brume_render_read(render, BRUME_CHANNEL_RADIANCE, out->rgb, 3 * COUNT));
    must(brume_render_read(render, BRUME_CHANNEL_SAMPLE_COUNT, out->samples, COUNT));
    must(brume_render_get_stats(render, &out->stats));
    assert_int_equal(out->stats.bad_samples, 0);
    brume_render_destroy(render);
    assert_true(out->stats.complete);
    double sum = 0;
    for (int i = 0; i < COUNT; i++) sum += out->samples[i];
    assert_true(sum == (double)out->stats.samples);
}

static void expect_same_film(const film *a, const film *b) {
    assert_memory_equal(a->rgb, b->rgb, sizeof a->rgb);
    assert_memory_equal(a->samples, b->samples, sizeof a->samples);
}

/* Of a render of which nothing else matters. */
static brume_render_stats stats_of(const brume_scene *scene, const brume_render_desc *desc) {
    brume_render_stats stats;
    brume_render *render;
    must(brume_render_create(device, scene, desc, &render));
    must(brume_render_run(render, NULL, NULL));
    must(brume_render_get_stats(render, &stats));
    brume_render_destroy(render);
    assert_true(stats.complete);
    return stats;
}

static void threshold_is_reached(void **state) {
    (void)state;
    NEEDS_DEVICE();
    static film f;
    brume_scene *scene = slats();
    for (int adaptive = BRUME_ADAPTIVE_AUTO; adaptive <= BRUME_ADAPTIVE_ON; adaptive++) {
        brume_render_desc desc = brume_render_desc_default();
        desc.adaptive = (brume_adaptive)adaptive;
        desc.noise_threshold = 5e-3;
        render_film(scene, &desc, 0, &f);
        assert_true(f.stats.relmse > 0 && f.stats.relmse <= 5e-3);
        assert_true(f.stats.relmse_low < f.stats.relmse && f.stats.relmse_high > f.stats.relmse);
        assert_true(f.stats.adaptive == (adaptive != BRUME_ADAPTIVE_OFF));
        /* and not a day later: half as many samples would not have done */
        double enough = f.stats.relmse * pow(2, f.stats.order) * 2;
        assert_true(enough > 5e-3);
    }
    brume_scene_destroy(scene);
}

static void most_samples_come_first(void **state) {
    (void)state;
    NEEDS_DEVICE();
    static film f;
    brume_scene *scene = slats();
    for (int adaptive = BRUME_ADAPTIVE_AUTO; adaptive <= BRUME_ADAPTIVE_ON; adaptive++) {
        brume_render_desc desc = brume_render_desc_default();
        desc.adaptive = (brume_adaptive)adaptive;
        desc.noise_threshold = 1e-9;
        desc.sample_count = 40;
        render_film(scene, &desc, 0, &f);
        assert_true(f.stats.relmse > 1e-9);
        assert_true(f.stats.samples <= 40ull * COUNT && f.stats.samples > 28ull * COUNT);
    }
    brume_scene_destroy(scene);
}

/* Decisions are made by the film, and the film is the same bits at any width and in any number of pieces. */
static void same_bits_however_it_is_cut(void **state) {
    (void)state;
    NEEDS_DEVICE();
    static film one, other;
    brume_scene *scene = slats();
    brume_render_desc desc = brume_render_desc_default();
    desc.noise_threshold = 1e-2;
    desc.adaptive = BRUME_ADAPTIVE_ON;
    render_film(scene, &desc, 0, &one);
    assert_true(one.stats.adaptive);
    render_film(scene, &desc, 1, &other);
    expect_same_film(&one, &other);
    for (uint32_t lanes = 1; lanes <= 8; lanes += 7) {
        desc.lanes = lanes;
        render_film(scene, &desc, 0, &other);
        expect_same_film(&one, &other);
    }
    brume_scene_destroy(scene);
}

/* A pixel with n samples holds what a render of n samples holds; but for STRATEGY_AUTO, which looks closer at pixels that
 * were chosen for their error. */
static void a_pixel_is_its_samples_mean(void **state) {
    (void)state;
    NEEDS_DEVICE();
    static film adapted, even;
    brume_scene *scene = slats();
    brume_render_desc desc = brume_render_desc_default();
    desc.adaptive = BRUME_ADAPTIVE_ON;
    desc.sample_count = 64;
    desc.use_strategy = 1;
    desc.strategy = BRUME_STRATEGY_SYSTEMATIC;
    render_film(scene, &desc, 0, &adapted);
    assert_true(adapted.stats.adaptive);
    int different = 0;
    for (uint32_t n = 8; n <= 1024; n *= 2) {
        brume_render_desc plain = desc;
        plain.adaptive = BRUME_ADAPTIVE_OFF;
        plain.sample_count = n;
        render_film(scene, &plain, 0, &even);
        int some = 0;
        for (int i = 0; i < COUNT; i++) {
            if (adapted.samples[i] != (float)n) continue;
            some = 1;
            assert_memory_equal(&adapted.rgb[3 * i], &even.rgb[3 * i], 3 * sizeof(float));
        }
        different += some;
    }
    assert_true(different >= 4);
    brume_scene_destroy(scene);
}

/* Adaptive and even pictures of as many samples have the same mean, and the adaptive ones less error: against the mean
 * of all. */
static void adaptive_pictures_are_unbiased(void **state) {
    (void)state;
    NEEDS_DEVICE();
    enum { SEEDS = 12 };
    static film f[2][SEEDS];
    static double truth[3 * COUNT];
    brume_scene *scene = slats();
    double difference[SEEDS], error[2] = {0, 0}, mean = 0;
    for (int s = 0; s < SEEDS; s++) {
        double sums[2] = {0, 0};
        for (int k = 0; k < 2; k++) {
            brume_render_desc desc = brume_render_desc_default();
            desc.use_seed = 1;
            desc.seed = (uint32_t)(100 + s + SEEDS * k);
            desc.sample_count = 64;
            desc.adaptive = k ? BRUME_ADAPTIVE_ON : BRUME_ADAPTIVE_OFF;
            render_film(scene, &desc, 0, &f[k][s]);
            for (int i = 0; i < 3 * COUNT; i++) {
                truth[i] += f[k][s].rgb[i] / (2 * SEEDS);
                sums[k] += f[k][s].rgb[i];
            }
        }
        difference[s] = sums[1] / sums[0];
    }
    assert_true(stats_mean(difference, SEEDS, 1) > 1e-4);
    for (int i = 0; i < 3 * COUNT; i++) mean += truth[i] / (3 * COUNT);
    for (int s = 0; s < SEEDS; s++)
        for (int k = 0; k < 2; k++)
            for (int i = 0; i < 3 * COUNT; i++)
                error[k] += pow(f[k][s].rgb[i] - truth[i], 2) / (truth[i] * truth[i] + 0.01 * mean * mean);
    assert_true(error[1] < 0.67 * error[0]); /* in a picture as small as this, edges are nearly everywhere */
    brume_scene_destroy(scene);
}

/* Between what the picture tells of its error and what it is, over seeds, a factor of two either way; but now and then
 * a single pixel is most of the error, and has not been seen. */
static void told_error_is_the_error(void **state) {
    (void)state;
    NEEDS_DEVICE();
    enum { SEEDS = 8 };
    static film reference, f;
    brume_scene *scene = slats();
    brume_render_desc desc = brume_render_desc_default();
    desc.sample_count = 8192;
    desc.use_seed = 1;
    desc.seed = 1;
    render_film(scene, &desc, 0, &reference);
    double mean = 0, product = 1;
    int outside = 0;
    for (int i = 0; i < 3 * COUNT; i++) mean += reference.rgb[i] / (3.0 * COUNT);
    for (int s = 0; s < SEEDS; s++) {
        desc.seed = (uint32_t)(2 + s);
        desc.sample_count = 64;
        render_film(scene, &desc, 0, &f);
        double error = 0;
        for (int i = 0; i < 3 * COUNT; i++) {
            double r = reference.rgb[i];
            error += pow(f.rgb[i] - r, 2) / (r * r + 0.01 * mean * mean) / (3.0 * COUNT);
        }
        double ratio = error / f.stats.relmse;
        outside += ratio < 0.5 || ratio > 2;
        product *= ratio;
    }
    double typical = pow(product, 1.0 / SEEDS);
    assert_true(outside <= 1 && typical > 0.7 && typical < 1.4);
    brume_scene_destroy(scene);
}

/* A black picture has reached any target, and is not looked at for ever; nor is one pixel. */
static void nothing_to_see_is_soon_seen(void **state) {
    (void)state;
    NEEDS_DEVICE();
    brume_scene *scene = new_scene(2, 16);
    set_camera(scene, &along_z, BRUME_NONE);
    add_wall(scene, 5, 1, 0.5);
    brume_render_desc desc = brume_render_desc_default();
    desc.noise_threshold = 1e-3;
    for (int adaptive = BRUME_ADAPTIVE_AUTO; adaptive <= BRUME_ADAPTIVE_ON; adaptive++) {
        desc.adaptive = (brume_adaptive)adaptive;
        brume_render_stats stats = stats_of(scene, &desc);
        assert_true(stats.relmse == 0);
        assert_int_equal(stats.samples, 16 * PIXELS * PIXELS);
    }
    brume_scene_destroy(scene);
    scene = slats();
    desc.use_crop = 1;
    desc.crop_x = 30;
    desc.crop_y = 20;
    desc.crop_width = desc.crop_height = 1;
    desc.sample_count = 1 << 14;
    brume_render_stats stats = stats_of(scene, &desc);
    assert_true(stats.relmse <= 1e-3 || stats.samples == 1 << 14);
    brume_scene_destroy(scene);
}

/* Eight samples may look like enough; they are not believed, and then all pixels get sixteen. */
static void easy_targets_take_sixteen_samples(void **state) {
    (void)state;
    NEEDS_DEVICE();
    brume_scene *scene = slats();
    for (int adaptive = BRUME_ADAPTIVE_AUTO; adaptive <= BRUME_ADAPTIVE_ON; adaptive++) {
        brume_render_desc desc = brume_render_desc_default();
        desc.adaptive = (brume_adaptive)adaptive;
        desc.noise_threshold = 10;
        assert_int_equal(stats_of(scene, &desc).samples, 16 * COUNT);
    }
    brume_scene_destroy(scene);
}

/* A range that is not a net of Sobol' points tells no error; one that is does. */
static void ranges_that_are_no_nets(void **state) {
    (void)state;
    NEEDS_DEVICE();
    brume_scene *scene = slats();
    for (uint32_t first = 64; first <= 72; first += 8) {
        brume_render_desc desc = brume_render_desc_default();
        desc.first_sample = first;
        desc.sample_count = 50;
        double relmse = stats_of(scene, &desc).relmse;
        assert_true(first == 64 ? relmse > 0 : relmse < 0);
    }
    brume_scene_destroy(scene);
}

/* More samples than were asked for first, from a number that is no power of two. */
static void more_samples_afterwards(void **state) {
    (void)state;
    NEEDS_DEVICE();
    static film f;
    brume_scene *scene = slats();
    brume_render_desc desc = brume_render_desc_default();
    brume_render *render;
    desc.noise_threshold = 1e-6;
    desc.sample_count = 20;
    must(brume_render_create(device, scene, &desc, &render));
    must(brume_render_run(render, NULL, NULL));
    must(brume_render_get_stats(render, &f.stats));
    assert_true(f.stats.samples <= 20ull * COUNT);
    must(brume_render_set_sample_count(render, 100));
    must(brume_render_run(render, NULL, NULL));
    must(brume_render_get_stats(render, &f.stats));
    must(brume_render_read(render, BRUME_CHANNEL_SAMPLE_COUNT, f.samples, COUNT));
    assert_true(f.stats.samples > 60ull * COUNT && f.stats.samples <= 100ull * COUNT);
    for (int i = 0; i < COUNT; i++) {
        uint32_t n = (uint32_t)f.samples[i];
        assert_true((n & (n - 1)) == 0 || !f.stats.adaptive);
    }
    brume_render_destroy(render);
    brume_scene_destroy(scene);
}

static void time_limit_ends_it(void **state) {
    (void)state;
    NEEDS_DEVICE();
    static film f;
    brume_scene *scene = slats();
    brume_render_desc desc = brume_render_desc_default();
    desc.time_limit = 0.5;
    render_film(scene, &desc, 0, &f);
    assert_true(f.stats.samples > 0 && f.stats.samples < 1000000ull * COUNT);
    brume_scene_destroy(scene);
}

static void wrong_goals_are_refused(void **state) {
    (void)state;
    NEEDS_DEVICE();
    brume_scene *scene = slats();
    brume_render *render = NULL;
    static const double wrong[] = {-1, NAN, INFINITY};
    for (int i = 0; i < 3; i++) {
        brume_render_desc desc = brume_render_desc_default();
        desc.noise_threshold = wrong[i];
        assert_int_equal(brume_render_create(device, scene, &desc, &render), BRUME_ERROR_ARGUMENT);
        desc = brume_render_desc_default();
        desc.time_limit = wrong[i];
        assert_int_equal(brume_render_create(device, scene, &desc, &render), BRUME_ERROR_ARGUMENT);
    }
    brume_render_desc desc = brume_render_desc_default();
    desc.adaptive = (brume_adaptive)3;
    assert_int_equal(brume_render_create(device, scene, &desc, &render), BRUME_ERROR_ARGUMENT);
    desc = brume_render_desc_default();
    desc.first_sample = 16;
    desc.noise_threshold = 0.1;
    assert_int_equal(brume_render_create(device, scene, &desc, &render), BRUME_ERROR_ARGUMENT);
    assert_null(render);
    brume_scene_destroy(scene);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(threshold_is_reached),
        cmocka_unit_test(most_samples_come_first),
        cmocka_unit_test(same_bits_however_it_is_cut),
        cmocka_unit_test(a_pixel_is_its_samples_mean),
        cmocka_unit_test(adaptive_pictures_are_unbiased),
        cmocka_unit_test(told_error_is_the_error),
        cmocka_unit_test(nothing_to_see_is_soon_seen),
        cmocka_unit_test(easy_targets_take_sixteen_samples),
        cmocka_unit_test(ranges_that_are_no_nets),
        cmocka_unit_test(more_samples_afterwards),
        cmocka_unit_test(time_limit_ends_it),
        cmocka_unit_test(wrong_goals_are_refused),
    };
    return cmocka_run_group_tests(tests, open_device, close_device);
}

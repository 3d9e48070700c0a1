/* test_gobo.c -- spots that shine through a texture into fog: every strategy against quadrature in double, texel by
 * texel (airlight.h), with and without something in the light; and light that scatters twice, by rays of light against
 * paths.
 *
 * One family at CONFIDENCE (stats.h), counted by TESTS. Errors planted in the kernels must be noticed at the same
 * level, and it is counted how many comparisons would notice 5 %.
 */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>

#include <math.h>
#include <stdio.h>

#include "airlight.h"
#include "device_test.h"
#include "known_answer.h"
#include "planted.h"
#include "stats.h"

enum { TEXELS = 5 };
static float texels[TEXELS * TEXELS * 3];
static const air_gobo panes = {TEXELS, 1, texels}, blurred = {TEXELS, 0, texels};
static const float blade[18] = {0.1f, -1, 1, 2, -1, 1, 2, 1, 1, 0.1f, -1, 1, 2, 1, 1, 0.1f, 1, 1};

#define ACROSS .eye = {-5, 0.5f, 4}, .length = 10, .sigma_t = GREY(0.3f), .albedo = 0.9f
#define WIDE .lamps = {SPOT(0, 0, 0, 1, 40, 30)}

static const airlight cases[] = {
    {.name = "panes", ACROSS, .g = 0.3f, WIDE, .gobo = &panes},
    {.name = "panes, blade", ACROSS, .g = 0.3f, WIDE, .gobo = &panes, .triangles = blade, .triangle_count = 2},
    {.name = "blurred", ACROSS, .g = -0.5f, WIDE, .gobo = &blurred},
    {.name = "blurred, g 0.9, blade", ACROSS, .g = 0.9f, WIDE, .gobo = &blurred, .triangles = blade,
     .triangle_count = 2},
    {.name = "two spots and a point", ACROSS, .g = 0.5f, .gobo = &blurred,
     .lamps = {SPOT(-1, 0, 0, 2, 25, 15), SPOT(2, 1, 1, 1, 60, 50), POINT(-1, 2, 5, 0.0625f)}},
    {.name = "from above", .eye = {-5, 0, 1}, .length = 10, .sigma_t = GREY(0.2f), .albedo = 0.9f, .gobo = &panes,
     .lamps = {{BRUME_LIGHT_SPOT, {0.5f, 3, 0.5f}, {0, -1, 0}, 1, 50, 50}}},
};
enum { CASES = sizeof cases / sizeof cases[0], PLAIN = 0, CHANNELS = 3 };

/* Samples per pixel. */
static const struct { brume_strategy strategy; uint32_t samples; } rungs[] = {
    {BRUME_STRATEGY_DISTANCE, 2048}, {BRUME_STRATEGY_PRODUCT, 512}, {BRUME_STRATEGY_SYSTEMATIC, 128},
    {BRUME_STRATEGY_RASTER, 64}, {BRUME_STRATEGY_AUTO, 128}};
enum { RUNGS = sizeof rungs / sizeof rungs[0], TESTS = (CASES * RUNGS + 2) * CHANNELS };

static int make_texels(void **state) {
    uint64_t seed = 3;
    for (int i = 0; i < TEXELS * TEXELS * 3; i++)
        texels[i] = (float)(test_random_unit(&seed) < 0.4 ? 0 : test_random_unit(&seed));
    return open_device(state);
}

/* The first channel's p, scaled; in `worst` the least of all channels. */
static double p_of(const estimate *e, double scale, const double *expected, const double *its_error, double *worst) {
    double p[CHANNELS];
    *worst = 1;
    for (int c = 0; c < CHANNELS; c++) {
        double error = hypot(hypot(scale * e->error[c], its_error[c]), FLOAT_ERROR * expected[c]);
        p[c] = stats_z_tail((scale * e->mean[c] - expected[c]) / error);
        *worst = fmin(*worst, p[c]);
    }
    return p[0];
}

static estimate see(const airlight *a, brume_strategy strategy, brume_indirect indirect, uint32_t samples,
                    int max_depth) {
    brume_scene *scene = airlight_scene(a, 1);
    brume_integrator_desc integrator;
    brume_render_desc desc = climb(strategy, samples);
    must(brume_scene_get_integrator(scene, &integrator));
    integrator.max_depth = max_depth;
    must(brume_scene_set_integrator(scene, &integrator));
    desc.lanes = 8; /* kernels of 16 take longer to build than these renders last */
    desc.use_indirect = 1;
    desc.indirect = indirect;
    desc.use_seed = 1;
    desc.seed = (uint32_t)(strategy + 10 * indirect);
    estimate e = render_as(scene, &desc);
    brume_scene_destroy(scene);
    return e;
}

static const double exactly[CHANNELS] = {0, 0, 0};

static void every_rung_meets_the_integral(void **state) {
    int wrong = 0, noticed = 0, checks = 0;
    double level = stats_level(CONFIDENCE, TESTS), expected[CHANNELS], worst;
    (void)state;
    NEEDS_DEVICE();
    for (int i = 0; i < CASES; i++) {
        for (int c = 0; c < CHANNELS; c++)
            expected[c] = airlight_expected(&cases[i], c);
        for (int k = 0; k < RUNGS; k++) {
            estimate e = see(&cases[i], rungs[k].strategy, BRUME_INDIRECT_PHASE, rungs[k].samples, 2);
            p_of(&e, 1, expected, exactly, &worst);
            print_message("%-22s %-10s %.5g: %+.2f %%, standard error %.2f %%%s\n", cases[i].name,
                          brume_strategy_name(rungs[k].strategy), e.mean[0], 100 * (e.mean[0] / expected[0] - 1),
                          100 * e.error[0] / expected[0], worst < level ? ": wrong" : "");
            wrong += worst < level;
            noticed += p_of(&e, 1.05, expected, exactly, &worst) < level;
            checks++;
        }
    }
    print_message("5 %% more would be noticed by %d of %d checks\n", noticed, checks);
    assert_int_equal(wrong, 0);
    assert_true(noticed > checks * 3 / 4);
}

/* Scattered once and twice. */
static void rays_of_light_agree_with_paths(void **state) {
    double worst;
    (void)state;
    NEEDS_DEVICE();
    estimate paths = see(&cases[PLAIN], BRUME_STRATEGY_AUTO, BRUME_INDIRECT_PHASE, 4096, 3);
    estimate rays = see(&cases[PLAIN], BRUME_STRATEGY_AUTO, BRUME_INDIRECT_RAY_LIGHTS, 1024, 3);
    p_of(&paths, 1, rays.mean, rays.error, &worst);
    print_message("paths %.5g, rays of light %.5g, standard error of the difference %.2f %%\n", paths.mean[0],
                  rays.mean[0], 100 * hypot(paths.error[0], rays.error[0]) / rays.mean[0]);
    assert_true(worst > stats_level(CONFIDENCE, TESTS));

    planted_bug("light_ray.h", "cmul(l.intensity, lamp_gobo(s, &l, d))", "l.intensity");
    rays = see(&cases[PLAIN], BRUME_STRATEGY_AUTO, BRUME_INDIRECT_RAY_LIGHTS, 1024, 3);
    planted_remove();
    p_of(&paths, 1, rays.mean, rays.error, &worst);
    print_message("rays of light past the gobo %.5g: p = %.1g\n", rays.mean[0], worst);
    assert_true(worst < stats_level(CONFIDENCE, TESTS));
}

static void planted_errors_are_noticed(void **state) {
    static const struct { const char *what, *file, *right, *wrong; } bugs[] = {
        {"segments gather past the gobo", "scatter_segment.h", "value = cmul(value, lamp_gobo(s, l, vneg(wi)));", ";"},
        {"the gobo is mirrored", "lamp.h", "frame_x, k)), scale, R(0.5))", "frame_x, k)), -scale, R(0.5))"},
    };
    double expected[CHANNELS], worst;
    (void)state;
    NEEDS_DEVICE();
    for (int c = 0; c < CHANNELS; c++)
        expected[c] = airlight_expected(&cases[PLAIN], c);
    for (size_t i = 0; i < sizeof bugs / sizeof bugs[0]; i++) {
        planted_bug(bugs[i].file, bugs[i].right, bugs[i].wrong);
        estimate e = see(&cases[PLAIN], BRUME_STRATEGY_PRODUCT, BRUME_INDIRECT_PHASE, 256, 2);
        planted_remove();
        p_of(&e, 1, expected, exactly, &worst);
        print_message("%-32s %+.0f %%: p = %.1g\n", bugs[i].what, 100 * (e.mean[0] / expected[0] - 1), worst);
        assert_true(worst < stats_level(CONFIDENCE, TESTS));
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_rung_meets_the_integral),
        cmocka_unit_test(rays_of_light_agree_with_paths),
        cmocka_unit_test(planted_errors_are_noticed),
    };
    return cmocka_run_group_tests(tests, make_texels, close_device);
}

/* test_ladder_answers.c -- every strategy against the light that a ray in clear view of its lamps scatters once, as
 * whole renders. test_ladder_shadows does so where something hides a lamp.
 *
 * Expected values: airlight.h, itself checked here against values of 20-digit quadrature. A strategy with noise must
 * agree within four standard errors, which must be small enough for an error of 2 % to be noticed (planted: most are);
 * each check fails right code once in 16,000 draws of the seed, all together once in 50. Where an interval is
 * integrated there is no noise to allow for: such cases must be right to FLOAT_ERROR.
 */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "airlight.h"
#include "known_answer.h"

/* A point light 1 from the ray, 2 ahead of the eye. */
#define AIRLIGHT(title, sigma, mean, far) \
    {.name = title, .eye = {-2, 0, 0}, .length = far, .sigma_t = GREY(sigma), .albedo = 1, .g = mean, \
     .lamps = {POINT(0, 1, 0, 1)}}
/* A spot that shines across the ray. */
#define BEAM(title, sigma, mean, height, cutoff, beam) \
    {.name = title, .eye = {-5, 0, height}, .length = 10, .sigma_t = GREY(sigma), .albedo = 1, .g = mean, \
     .lamps = {SPOT(0, 0, 0, 1, cutoff, beam)}}

/* INTEGRATED: the upper rungs have no noise. The others are left to sampling,
      by beam_integral.h's own rules: steep phase
 * functions, thick fog, rays that go on for ever or pass close to the lamp, full beams that end at the spot's axis,
      many
 * lamps, null boundaries. TOO_RARE: so few flights end in the light that no number of samples for a test tells DISTANCE
 * from right or wrong: one in a million scatters at all; or, in thick fog,
      a seventh of the light comes from where one in a
 * million gets. */
enum { NOISY, INTEGRATED, TOO_RARE };

static const struct { airlight air; int flags; } cases[] = {
    {AIRLIGHT("point, g 0", 0.5f, 0, 5), INTEGRATED},
    {AIRLIGHT("point, g 0.5", 0.5f, 0.5f, 5), INTEGRATED},
    {AIRLIGHT("point, g 0.9", 0.5f, 0.9f, 5), INTEGRATED},
    {AIRLIGHT("point, g -0.5", 0.5f, -0.5f, 5), INTEGRATED},
    {AIRLIGHT("point, g -0.9", 0.5f, -0.9f, 5), NOISY},
    {AIRLIGHT("point, g 0.99", 0.5f, 0.99f, 5), INTEGRATED},
    {AIRLIGHT("point, no end", 0.5f, 0, 0), NOISY},
    {AIRLIGHT("point, no end, g 0.5", 0.5f, 0.5f, 0), NOISY},
    {AIRLIGHT("point, sigma 1e-6", 1e-6f, 0, 5), INTEGRATED | TOO_RARE},
    {AIRLIGHT("point, depth 1e-4", 2e-5f, 0.3f, 5), INTEGRATED | TOO_RARE},
    {AIRLIGHT("point, depth 0.01", 2e-3f, 0.3f, 5), INTEGRATED},
    {AIRLIGHT("point, depth 10", 2, 0.3f, 5), NOISY},
    {AIRLIGHT("point, depth 100", 20, 0.3f, 5), NOISY | TOO_RARE},
    {{.name = "forward peak g 0.99", .eye = {-20, 0, 0}, .length = 25, .sigma_t = GREY(0.05f), .albedo = 0.9f,
      .g = 0.99f,
      .lamps = {POINT(0, 0.25f, 0, 1)}}, NOISY},
    {{.name = "lamp on the ray", .eye = {1, 0, 0}, .length = 2, .sigma_t = GREY(0.5f), .albedo = 1,
      .lamps = {POINT(0, 0, 0, 1)}},
     NOISY},
    {{.name = "lamp beside the ray", .eye = {-2, 0, 0}, .length = 4, .sigma_t = GREY(0.5f), .albedo = 1,
      .lamps = {POINT(0, 0.001f, 0, 1)}}, NOISY | TOO_RARE},
    {{.name = "lamp behind the eye", .eye = {1, 0, 0}, .length = 8, .sigma_t = GREY(0.3f), .albedo = 0.5f, .g = -0.7f,
      .lamps = {POINT(0, 0.25f, 0.5f, 4)}}, INTEGRATED},
    {{.name = "point, chromatic", .eye = {-2, 0, 0}, .length = 5, .sigma_t = {0.2f, 0.7f, 2.5f}, .albedo = 0.8f,
      .g = 0.4f,
      .lamps = {POINT(0, 1, 0, 1)}}, NOISY},
    {BEAM("spot 15/12", 0.3f, 0, 4, 15, 12), INTEGRATED},
    {BEAM("spot 15/12, g 0.5", 0.3f, 0.5f, 4, 15, 12), INTEGRATED},
    {BEAM("spot 15/12, g 0.9", 0.3f, 0.9f, 4, 15, 12), INTEGRATED},
    {BEAM("spot 15/12, g -0.9", 0.3f, -0.9f, 4, 15, 12), INTEGRATED},
    {BEAM("spot 15/12, sigma 2", 2, 0, 4, 15, 12), INTEGRATED | TOO_RARE},
    {BEAM("spot 15/15", 0.3f, 0, 4, 15, 15), INTEGRATED},
    {BEAM("spot 15/0", 0.3f, 0.3f, 4, 15, 0), NOISY},
    {BEAM("spot 0.5/0.4", 0.3f, 0, 4, 0.5f, 0.4f), INTEGRATED},
    {BEAM("spot 90/20", 0.2f, 0.5f, 1, 90, 20), NOISY},
    {BEAM("spot 120/100 from behind", 0.2f, 0.5f, -1, 120, 100), INTEGRATED},
    {BEAM("spot 120/100, g -0.5", 0.2f, -0.5f, 1, 120, 100), NOISY},
    {BEAM("spot 170/150 from behind", 0.2f, 0, -0.5f, 170, 150), NOISY},
    {BEAM("spot 180/180", 0.2f, 0.6f, -0.5f, 180, 180), NOISY},
    {{.name = "spot off the plane", .eye = {-5, 0.5f, 4}, .length = 10, .sigma_t = {0.1f, 0.3f, 0.9f}, .albedo = 0.9f,
      .g = 0.7f, .lamps = {SPOT(0, 0, 0, 2, 15, 12)}}, INTEGRATED},
    {{.name = "spot along the ray", .eye = {-5, 0, 1}, .length = 20, .sigma_t = GREY(0.2f), .albedo = 0.9f, .g = -0.3f,
      .lamps = {{BRUME_LIGHT_SPOT, {-6, 0, 0}, {1, 0, 0}, 2, 30, 20}}}, NOISY},
    {{.name = "three lamps", .eye = {-5, 0, 4}, .length = 10, .sigma_t = GREY(0.2f), .albedo = 0.9f, .g = 0.4f,
      .lamps = {SPOT(0, 0, 0, 2, 15, 12), SPOT(2, 1, 1, 1, 40, 30), POINT(-1, 2, 5, 0.25f)}}, INTEGRATED},
    {{.name = "ten lamps", .eye = {-5, 0, 4}, .length = 10, .sigma_t = GREY(0.2f), .albedo = 0.9f, .g = 0.4f,
      .lamps = {SPOT(0, 0, 0, 2, 15, 12), SPOT(2, 1, 1, 1, 40, 30), POINT(-1, 2, 5, 0.25f), POINT(-4, 3, 5, 0.5f),
                POINT(4, -3, 5, 0.5f), SPOT(-3, 0, 2, 1, 20, 10), SPOT(3, 0, 2, 1, 25, 10), POINT(1, 2, 2, 0.1f),
                POINT(0, -2, 4, 0.1f), SPOT(1, 0.5f, 1, 3, 10, 9)}}, NOISY},
    /* behind null boundaries visibility is found point by point, so nothing is integrated */
    {{.name = "bounded, eye inside", .eye = {-2, 0, 0}, .sigma_t = GREY(0.5f), .albedo = 1, .g = 0.5f,
      .lamps = {POINT(0, 1, 0, 1)}, .bounded = 1, .box = {-3, -1.5f, -2, 2, 2, 2}}, NOISY},
    {{.name = "bounded, eye and lamp outside", .eye = {-5, 0, 0.5f}, .sigma_t = {0.3f, 0.6f, 1.2f}, .albedo = 0.8f,
      .g = 0.3f,
      .lamps = {SPOT(0, 0, -3, 1, 30, 20)}, .bounded = 1, .box = {-2, -1, -1, 1.5f, 1, 1.25f}}, NOISY},
    {{.name = "directional", .eye = {-5, 0, 0}, .sigma_t = {0.3f, 0.6f, 1.2f}, .albedo = 0.8f, .g = 0.6f,
      .lamps = {{BRUME_LIGHT_DIRECTIONAL, {0, 0, 0}, {0, -1, 0}, 2, 0, 0}}, .bounded = 1,
      .box = {-2, -1, -1, 2, 1, 1}}, NOISY},
    {{.name = "directional, point and spot", .eye = {-5, 0, 0}, .sigma_t = GREY(0.4f), .albedo = 0.8f, .g = -0.6f,
      .lamps = {{BRUME_LIGHT_DIRECTIONAL, {0, 0, 0}, {0, 0, 1}, 2, 0, 0}, POINT(0.5f, 0.5f, 0, 0.5f), SPOT(-1, 0, -2,
      3, 25, 15)},
      .bounded = 1, .box = {-2, -1, -1, 2, 1, 1}}, NOISY},
};
enum { CASES = sizeof cases / sizeof cases[0] };

/* Samples per pixel, and the largest relative standard error. */
static const struct { brume_strategy strategy; uint32_t samples; double precision; } rungs[] = {
    {BRUME_STRATEGY_DISTANCE, 1024, 0.04},         {BRUME_STRATEGY_EQUIANGULAR, 1024, 0.03},
    {BRUME_STRATEGY_EQUIANGULAR_CONE, 1024, 0.03}, {BRUME_STRATEGY_MIS, 512, 0.01},
    {BRUME_STRATEGY_PRODUCT, 256, 0.005},          {BRUME_STRATEGY_SYSTEMATIC, 64, 0.005},
    {BRUME_STRATEGY_RASTER, 32, 0.005},            {BRUME_STRATEGY_AUTO, 32, 0.005}};
enum { RUNGS = sizeof rungs / sizeof rungs[0] };

/* The quadrature behind all expectations, against 20-digit values of a point light's airlight (Sun, Ramamoorthi,
 * Narasimhan & Nayar 2005), and a closed form for a lamp on the ray:
 * sigma/(4 pi) e^sigma (E2(2 sigma) - E2(6 sigma)/3). */
static void the_expected_values(void **state) {
    static const struct { const char *name; double value, tolerance; } known[] = {
        {"point, g 0", 0.018742118921, 1e-10},       {"point, g 0.5", 0.0215424090764, 1e-10},
        {"point, g 0.9", 0.00620507892948, 3e-7}, /* 0.9 is not a float */
        {"point, g -0.5", 0.0122907614359, 1e-10},   {"point, no end", 0.018787040858, 1e-10},
        {"lamp on the ray", 0.00950867936371, 1e-10}};
    size_t found = 0;
    (void)state;
    for (int i = 0; i < CASES; i++) {
        const airlight *a = &cases[i].air;
        for (size_t k = 0; k < sizeof known / sizeof known[0]; k++)
            if (strcmp(a->name, known[k].name) == 0) {
                found++;
                assert_true(fabs(airlight_expected(a, 0) / known[k].value - 1) < known[k].tolerance);
            }
        /* parts add up: nothing depends on where the scan's steps lie */
        double middle = a->bounded ? 4.1 : 2.3, end = 25, whole = airlight_between(a, 0, 0, end);
        double parts = airlight_between(a, 0, 0, middle) + airlight_between(a, 0, middle, end);
        if (!(fabs(parts / whole - 1) < 1e-9))
            fail_msg("%s: %.12g is not %.12g", a->name, parts, whole);
    }
    assert_int_equal(found, sizeof known / sizeof known[0]);
}

/* ---- the rungs --------------------------------------------------------------------------------------------------- */

/* Whether the strategy has no noise. PRODUCT chooses one of several lamps. */
static int is_exact(int i, brume_strategy strategy) {
    int whole = strategy == BRUME_STRATEGY_AUTO || strategy >= BRUME_STRATEGY_PRODUCT;
    return whole && (cases[i].flags & INTEGRATED) &&
           (strategy != BRUME_STRATEGY_PRODUCT || cases[i].air.lamps[1].intensity == 0);
}

/* Counts what is wrong, and whether 2 % more or less would be noticed. */
static void check_rung(int i, int rung, const estimate *e, int *wrong, int *noticed) {
    const airlight *a = &cases[i].air;
    int chromatic = a->sigma_t[0] != a->sigma_t[1], more = 1, less = 1;
    for (int c = 0; c < (chromatic ? 3 : 1); c++) {
        double expected = airlight_expected(a, c), mean = e->mean[c], error = e->error[c];
        const char *what = NULL;
        if (!agrees(mean, error, expected))
            what = "wrong";
        else if (!(error <= rungs[rung].precision * expected))
            what = "too noisy to tell";
        else if (is_exact(i, rungs[rung].strategy) &&
                 !(error < 5e-7 * expected && fabs(mean / expected - 1) < FLOAT_ERROR))
            what = "not exact";
        if (what) {
            print_error("%s, %s, channel %d: %.9g, expected %.9g: %+.2g, standard error %.2g: %s\n", a->name,
                        brume_strategy_name(rungs[rung].strategy), c, mean, expected, mean / expected - 1,
                        error / expected, what);
            ++*wrong;
        }
        more &= !agrees(1.02 * mean, 1.02 * error, expected);
        less &= !agrees(0.98 * mean, 0.98 * error, expected);
    }
    *noticed += more + less;
}

static void climb_all(brume_sampler sampler, int stride, int *checks, int *wrong, int *noticed) {
    for (int i = 0; i < CASES; i += stride) {
        brume_scene *scene = airlight_scene(&cases[i].air, 1);
        brume_integrator_desc integrator;
        must(brume_scene_get_integrator(scene, &integrator));
        integrator.sampler = sampler;
        must(brume_scene_set_integrator(scene, &integrator));
        for (int k = 0; k < RUNGS; k++) {
            if (rungs[k].strategy == BRUME_STRATEGY_DISTANCE && (cases[i].flags & TOO_RARE))
                continue;
            brume_render_desc desc = climb(rungs[k].strategy, rungs[k].samples);
            estimate e = render_as(scene, &desc);
            check_rung(i, k, &e, wrong, noticed);
            *checks += 2;
        }
        brume_scene_destroy(scene);
    }
}

static void every_rung_meets_the_integral(void **state) {
    int checks = 0, wrong = 0, noticed = 0;
    (void)state;
    NEEDS_DEVICE();
    climb_all(BRUME_SAMPLER_INDEPENDENT, 1, &checks, &wrong, &noticed);
    print_message("2 %% more or less would be noticed by %d of %d checks\n", noticed, checks);
    assert_int_equal(wrong, 0);
    assert_true(noticed > checks * 3 / 4);
}

/* Points of low discrepancy, scrambled anew for each pixel, have the same means; and less noise, so that 2 % are
 * noticed more often. */
static void with_low_discrepancy_too(void **state) {
    int checks = 0, wrong = 0, noticed = 0;
    (void)state;
    NEEDS_DEVICE();
    climb_all(BRUME_SAMPLER_SOBOL, 4, &checks, &wrong, &noticed);
    print_message("2 %% more or less would be noticed by %d of %d checks\n", noticed, checks);
    assert_int_equal(wrong, 0);
    assert_true(noticed > checks * 7 / 8);
}

/* ---- the lowest rung --------------------------------------------------------------------------------------------- */

/* It meets a light by chance, and a lamp without extent never. */
static void spherical_is_black_for_lamps(void **state) {
    (void)state;
    NEEDS_DEVICE();
    for (int i = 0; i < CASES; i++) {
        brume_scene *scene = airlight_scene(&cases[i].air, 1);
        brume_render_desc desc = climb(BRUME_STRATEGY_SPHERICAL, 16);
        estimate e = render_as(scene, &desc);
        for (int c = 0; c < 3; c++)
            if (e.mean[c] != 0)
                fail_msg("%s: %g", cases[i].air.name, e.mean[c]);
        brume_scene_destroy(scene);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_expected_values),
        cmocka_unit_test(every_rung_meets_the_integral),
        cmocka_unit_test(with_low_discrepancy_too),
        cmocka_unit_test(spherical_is_black_for_lamps),
    };
    return cmocka_run_group_tests(tests, open_device, close_device);
}

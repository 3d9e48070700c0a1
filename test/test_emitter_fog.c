/* test_emitter_fog.c -- what fog scatters once of the light of emitting surfaces and of the environment, by every
 * strategy that finds them: by chance, by light sampling at points, and along rays with weights that light and path
 * share (scatter_emitter.h).
 *
 * Expected values: quadrature in double along one ray; where something hides an emitter, the estimate by
 * BRUME_STRATEGY_DISTANCE, whose weights are others. One family at CONFIDENCE (stats.h), counted by TESTS; errors
 * planted in the kernels must be noticed at the same level, and it is counted how many comparisons would notice 5 %.
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
#include "planted.h"
#include "stats.h"

/* A square over the ray that shines down, red, and a ball under it, green: each has a channel to itself. */
typedef struct glow {
    airlight air;
    float x, y, half;              /* the square's middle and half its side */
    float ball_x, ball_y, radius;
} glow;

/* The ray goes from x = -2 to a black wall at x = 2. */
#define ROOM(title, s, mean) .name = title, .eye = {-2, 0, 0}, .length = 4, .sigma_t = s, .albedo = 0.9f, .g = mean

static const glow glows[] = {
    {{ROOM("square and ball", GREY(0.5f), 0.375f)}, 0, 0.75f, 0.5f, 0, -1, 0.5f},
    {{ROOM("backwards", GREY(0.5f), -0.6f)}, 0.5f, 0.75f, 0.5f, -0.5f, -1, 0.5f},
    {{ROOM("peaked", GREY(0.25f), 0.9f)}, 1, 0.75f, 0.5f, 1, -0.75f, 0.25f},
    {{ROOM("near", GREY(0.5f), 0)}, 0, 0.125f, 0.5f, 0.5f, -0.5625f, 0.5f},
    {{ROOM("small", GREY(0.5f), 0.375f)}, 0, 1, 0.015625f, 0, -1, 0.015625f},
    {{ROOM("thick", GREY(4), 0.3f)}, -1, 0.5f, 0.5f, -1.5f, -0.5f, 0.25f},
    {{ROOM("half hidden", GREY(0.5f), 0.375f), .balls = {{1, {0.25f, 0.375f, 0.125f}, 0.25f},
     {0, {-0.25f, -0.25f, 0}, 0.125f}}}, 0, 0.75f, 0.5f, 0, -1, 0.5f},
    {{ROOM("small, half hidden", GREY(0.5f), 0.375f), .balls = {{1, {0.25f, 0.5f, 0}, 0.25f},
     {0, {-0.25f, -0.5f, 0}, 0.125f}}}, 0, 1, 0.015625f, 0, -1, 0.015625f},
};
enum { GLOWS = sizeof glows / sizeof glows[0], FIRST = 0, NEAR_RAY = 3, CHANNELS = 2 };

/* Samples per pixel. */
static const struct { brume_strategy strategy; uint32_t samples; } rungs[] = {
    {BRUME_STRATEGY_DISTANCE, 1024}, {BRUME_STRATEGY_PRODUCT, 1024}, {BRUME_STRATEGY_SYSTEMATIC, 512},
    {BRUME_STRATEGY_RASTER, 512}, {BRUME_STRATEGY_AUTO, 512}};
enum { RUNGS = sizeof rungs / sizeof rungs[0] };

/* A ball of fog about the origin, behind a null boundary, in the same light from all around; the eye looks through its
 * middle. */
typedef struct cloud {
    const char *name;
    float sigma_t, albedo, g, eye; /* eye: its z; the ball's radius is 1 */
} cloud;

static const cloud clouds[] = {{"cloud", 1, 0.8f, 0, -3}, {"cloud, g 0.7", 1, 0.8f, 0.7f, -3},
                               {"cloud, g -0.5", 3, 0.9f, -0.5f, -3}, {"inside a cloud", 0.5f, 0.7f, 0.4f, -0.5f}};
enum { CLOUDS = sizeof clouds / sizeof clouds[0], IN_CLOUD = 1 };

static const struct { brume_strategy strategy; uint32_t samples; } sky_rungs[] = {
    {BRUME_STRATEGY_PRODUCT, 1024}, {BRUME_STRATEGY_SYSTEMATIC, 512}, {BRUME_STRATEGY_AUTO, 512}};
enum { SKY_RUNGS = sizeof sky_rungs / sizeof sky_rungs[0] };
enum { TESTS = GLOWS * RUNGS * CHANNELS + CHANNELS + CLOUDS * SKY_RUNGS };

#define RADIANCE 3
#define SKY 0.5

/* ---- scenes ------------------------------------------------------------------------------------------------------ */

static brume_scene *glow_scene(const glow *w) {
    brume_scene *scene = airlight_scene(&w->air, 1);
    brume_shape_desc square = brume_shape_desc_default(BRUME_SHAPE_RECTANGLE);
    brume_shape_desc ball = brume_shape_desc_default(BRUME_SHAPE_SPHERE);
    const float down[16] = {w->half, 0, 0, w->x, 0, 0, -1, w->y, 0, w->half, 0, 0, 0, 0, 0, 1};
    memcpy(square.to_world, down, sizeof down);
    square.radiance[0] = RADIANCE;
    must(brume_scene_add_shape(scene, &square, NULL));
    ball.center[0] = w->ball_x;
    ball.center[1] = w->ball_y;
    ball.radius = w->radius;
    ball.radiance[1] = RADIANCE;
    must(brume_scene_add_shape(scene, &ball, NULL));
    return scene;
}

static brume_scene *cloud_scene(const cloud *c, int max_depth) {
    brume_scene *scene = new_scene(max_depth, 1);
    brume_shape_desc ball = brume_shape_desc_default(BRUME_SHAPE_SPHERE);
    brume_bsdf_desc null = brume_bsdf_desc_default(BRUME_BSDF_NULL);
    view v = along_z;
    uint32_t fog = add_medium(scene, c->sigma_t, c->albedo, c->g, 0);
    v.origin[2] = c->eye;
    set_camera(scene, &v, c->eye > -1 ? fog : BRUME_NONE);
    must(brume_scene_add_bsdf(scene, &null, &ball.bsdf));
    ball.interior = fog;
    ball.is_boundary = 1;
    must(brume_scene_add_shape(scene, &ball, NULL));
    add_constant(scene, SKY);
    return scene;
}

/* ---- quadrature -------------------------------------------------------------------------------------------------- */

static double phase(double cosine, double g) {
    double v = 1 + g * g - 2 * g * cosine;
    return (1 - g * g) / (4 * PI * v * sqrt(v));
}

/* Of the square, per area of it, to the point of the ray at x. */
static double from_square(const glow *w, double x, double sigma, double sx, double sz) {
    double dx = x - sx, y = w->y, r2 = dx * dx + y * y + sz * sz, r = sqrt(r2);
    return exp(-sigma * r) * phase(-dx / r, w->air.g) * y / (r2 * r);
}

static double square_at(const glow *w, double x, double sigma, int n) {
    double sum = 0, dx, dz, side = 2.0 * w->half;
    for (int i = 0; i < 8 * n; i++)
        for (int j = 0; j < 8 * n; j++) {
            double sx = w->x - w->half + stats_gauss_node(i, n, side, &dx);
            double sz = -w->half + stats_gauss_node(j, n, side, &dz);
            sum += dx * dz * from_square(w, x, sigma, sx, sz);
        }
    return sum;
}

/* Over the cone under which the ball is seen from x: angles to its middle grow as a sine, whose end smooths the rim. */
static double ball_at(const glow *w, double x, double sigma, int n) {
    double tx = (double)w->ball_x - x, ty = w->ball_y, d = hypot(tx, ty), r = w->radius, rim = asin(r / d), sum = 0, du;
    for (int i = 0; i < 8 * n; i++) {
        double u = stats_gauss_node(i, n, PI / 2, &du), angle = rim * sin(u), s = sin(angle), c = cos(angle);
        double near = d * c - sqrt(fmax(r * r - d * d * s * s, 0)), turns = 0;
        for (int k = 0; k < 16 * n; k++) /* light travels towards x: against the direction to the ball */
            turns += phase((tx * c + ty * s * cos(2 * PI * (k + 0.5) / (16 * n))) / d, w->air.g);
        sum += du * rim * cos(u) * s * exp(-sigma * near) * turns * 2 * PI / (16 * n);
    }
    return sum;
}

static double glow_expected(const glow *w, int channel, int n) {
    double sigma = w->air.sigma_t[channel], sum = 0, dt;
    for (int i = 0; i < 32 * n; i++) {
        double t = stats_gauss_node(i, 4 * n, w->air.length, &dt), x = w->air.eye[0] + t;
        sum += dt * exp(-sigma * t) * (channel ? ball_at(w, x, sigma, n) : square_at(w, x, sigma, n));
    }
    return RADIANCE * sigma * w->air.albedo * sum;
}

/* All around the point at z; both the phase function and the way out depend on the cosine with the ray alone. */
static double sky_at(const cloud *c, double z) {
    double sum = 0, weight;
    for (int i = 0; i < 64; i++) {
        double cosine = -1 + stats_gauss_node(i, 8, 2, &weight);
        double out = -z * cosine + sqrt(fmax(1 - z * z * (1 - cosine * cosine), 0));
        sum += weight * phase(cosine, c->g) * exp(-c->sigma_t * out);
    }
    return 2 * PI * sum;
}

static double cloud_expected(const cloud *c) {
    double start = fmax(c->eye, -1), length = 1 - start, sum = exp(-c->sigma_t * length), dt;
    for (int i = 0; i < 64; i++) {
        double t = stats_gauss_node(i, 8, length, &dt);
        sum += dt * c->sigma_t * c->albedo * exp(-c->sigma_t * t) * sky_at(c, start + t);
    }
    return SKY * sum;
}

/* ---- emitting surfaces ------------------------------------------------------------------------------------------- */

static double p_of(double mean, double error, double expected, double expected_error) {
    return stats_z_tail((mean - expected) / hypot(error, expected_error));
}

typedef struct tally {
    int checks, wrong, noticed;
} tally;

static void hold(tally *all, const char *name, brume_strategy strategy, const estimate *e, int c, double expected,
                 double its_error) {
    double level = stats_level(CONFIDENCE, TESTS), mean = e->mean[c], error = e->error[c];
    int wrong = p_of(mean, error, expected, its_error) < level;
    print_message("%-20s %-10s channel %d: %.6g, %+.2f %%, standard error %.2f %%%s\n", name,
                  brume_strategy_name(strategy), c, mean, 100 * (mean / expected - 1),
                  100 * hypot(error, its_error) / expected, wrong ? ": wrong" : "");
    all->checks++;
    all->wrong += wrong;
    all->noticed += p_of(1.05 * mean, 1.05 * error, expected, its_error) < level;
}

static estimate see(brume_scene *scene, brume_strategy strategy, uint32_t samples, uint32_t seed) {
    brume_render_desc desc = climb(strategy, samples);
    desc.lanes = 8; /* kernels of 16 take longer to build than these renders last */
    desc.use_seed = 1;
    desc.seed = seed;
    return render_as(scene, &desc);
}

static void the_rules_have_converged(void **state) {
    (void)state;
    for (int i = 0; i < GLOWS; i++)
        for (int c = 0; c < CHANNELS; c++)
            if (!(fabs(glow_expected(&glows[i], c, 2) / glow_expected(&glows[i], c, 3) - 1) < 1e-3))
                fail_msg("%s, channel %d: %g", glows[i].air.name, c, glow_expected(&glows[i], c, 2));
}

static void every_rung_finds_what_glows(void **state) {
    tally all = {0, 0, 0};
    (void)state;
    NEEDS_DEVICE();
    for (int i = 0; i < GLOWS; i++) {
        const glow *w = &glows[i];
        brume_scene *scene = glow_scene(w);
        int hidden = w->air.balls[0].radius > 0;
        double expected[CHANNELS], its_error[CHANNELS] = {0, 0};
        for (int c = 0; c < CHANNELS && !hidden; c++)
            expected[c] = glow_expected(w, c, 2);
        for (int k = 0; k < RUNGS; k++) {
            estimate e = see(scene, rungs[k].strategy, rungs[k].samples * (hidden && k == 0 ? 4 : 1), (uint32_t)k);
            for (int c = 0; c < CHANNELS; c++) {
                if (hidden && k == 0) {
                    expected[c] = e.mean[c];
                    its_error[c] = e.error[c];
                    assert_true(p_of(e.mean[c], e.error[c], glow_expected(w, c, 2), 0) < CONFIDENCE);
                } else {
                    hold(&all, w->air.name, rungs[k].strategy, &e, c, expected[c], its_error[c]);
                }
            }
        }
        brume_scene_destroy(scene);
    }
    /* by chance alone */
    brume_scene *scene = glow_scene(&glows[FIRST]);
    estimate e = see(scene, BRUME_STRATEGY_SPHERICAL, 8192, 1);
    for (int c = 0; c < CHANNELS; c++)
        hold(&all, glows[FIRST].air.name, BRUME_STRATEGY_SPHERICAL, &e, c, glow_expected(&glows[FIRST], c, 2), 0);
    brume_scene_destroy(scene);
    print_message("5 %% more would be noticed by %d of %d checks\n", all.noticed, all.checks);
    assert_int_equal(all.wrong, 0);
    assert_true(all.noticed > all.checks / 2);
}

/* ---- the environment --------------------------------------------------------------------------------------------- */

static void every_rung_finds_the_sky(void **state) {
    tally all = {0, 0, 0};
    (void)state;
    NEEDS_DEVICE();
    for (int i = 0; i < CLOUDS; i++) {
        brume_scene *scene = cloud_scene(&clouds[i], 2);
        for (int k = 0; k < SKY_RUNGS; k++) {
            estimate e = see(scene, sky_rungs[k].strategy, sky_rungs[k].samples, (uint32_t)k);
            hold(&all, clouds[i].name, sky_rungs[k].strategy, &e, 0, cloud_expected(&clouds[i]), 0);
        }
        brume_scene_destroy(scene);
    }
    print_message("5 %% more would be noticed by %d of %d checks\n", all.noticed, all.checks);
    assert_int_equal(all.wrong, 0);
    assert_int_equal(all.noticed, all.checks);
}

/* Fog that absorbs nothing can't be seen in it. */
static void white_fog_is_invisible(void **state) {
    static const cloud white = {"white", 2, 1, 0.6f, -3};
    (void)state;
    NEEDS_DEVICE();
    for (int k = 0; k < SKY_RUNGS; k++) {
        brume_scene *scene = cloud_scene(&white, DEPTH_ANY);
        brume_integrator_desc integrator;
        must(brume_scene_get_integrator(scene, &integrator));
        integrator.rr_depth = 1 << 20; /* roulette would be an error too rare to be seen in the spread */
        must(brume_scene_set_integrator(scene, &integrator));
        estimate e = see(scene, sky_rungs[k].strategy, 256, 3);
        check(brume_strategy_name(sky_rungs[k].strategy), &e, 0, SKY, 0.01);
        brume_scene_destroy(scene);
    }
}

/* ---- errors planted ---------------------------------------------------------------------------------------------- */

static const struct {
    const char *what, *file, *right, *wrong;
    int sky, at, channel;
} bugs[] = {
    {"light counts surfaces in full", "scatter_segment.h",
     "weight = l->met ? by_light / lmax(by_light + by_path, R(1e-37)) : R(1);", "", 0, FIRST, 0},
    {"paths count surfaces in full", "scatter_emitter.h",
     "* cosine * angle;\n    return by_path / lmax(by_path + by_light, R(1e-37));",
     "* cosine * angle;\n    return R(1);", 0, FIRST, 1},
    {"one side forgets the angle in its density", "scatter_segment.h", "* f * angle;", "* f;", 0, NEAR_RAY, 0},
    {"a ball's points count as chosen evenly", "scatter_emitter.h", " * on.density", "", 0, FIRST, 1},
    {"light counts the sky in full", "scatter_segment.h", "weight * (by_light / lmax(by_light + by_path, R(1e-37)))",
     "weight", 1, IN_CLOUD, 0},
};

static void planted_errors_are_noticed(void **state) {
    (void)state;
    NEEDS_DEVICE();
    for (size_t i = 0; i < sizeof bugs / sizeof bugs[0]; i++) {
        const cloud *c = &clouds[bugs[i].at];
        const glow *w = &glows[bugs[i].at];
        brume_scene *scene = bugs[i].sky ? cloud_scene(c, 2) : glow_scene(w);
        double right = bugs[i].sky ? cloud_expected(c) : glow_expected(w, bugs[i].channel, 2);
        planted_bug(bugs[i].file, bugs[i].right, bugs[i].wrong);
        estimate e = see(scene, BRUME_STRATEGY_PRODUCT, 1024, 1);
        planted_remove();
        brume_scene_destroy(scene);
        double mean = e.mean[bugs[i].channel], error = e.error[bugs[i].channel];
        print_message("%-45s %+.0f %%, %.0f standard errors\n", bugs[i].what, 100 * (mean / right - 1),
                      fabs(mean - right) / error);
        if (!(p_of(mean, error, right, 0) < stats_level(CONFIDENCE, TESTS)))
            fail_msg("not noticed: %s: %.6g, expected %.6g", bugs[i].what, mean, right);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_rules_have_converged),   cmocka_unit_test(every_rung_finds_what_glows),
        cmocka_unit_test(every_rung_finds_the_sky),   cmocka_unit_test(white_fog_is_invisible),
        cmocka_unit_test(planted_errors_are_noticed),
    };
    return cmocka_run_group_tests(tests, open_device, close_device);
}

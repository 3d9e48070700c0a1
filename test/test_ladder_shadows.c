/* test_ladder_shadows.c -- every strategy where something hides the lamp from a part of the ray, against quadrature in
 * double with shadows found by brute force (airlight.h). Otherwise as test_ladder_answers: agreement within four
 * standard errors, which are small enough for 2 % to be noticed mostly; right code fails once in 60 draws of the seeds.
 * Planted: the light without the shadow, which none may take for right.
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
#include "meshes.h"

/* A blade before the spot hides half of its beam and more; another, tilted, crosses no plane squarely. */
static const float blade[18] = {0.1f, -1, 1, 2, -1, 1, 2, 1, 1, 0.1f, -1, 1, 2, 1, 1, 0.1f, 1, 1};
static const float tilted[18] = {-0.3f, -1, 1.5f, 0.1f, -1, 1.25f, 0.2f, 1, 2, -0.3f, -1, 1.5f, 0.2f, 1, 2, -0.4f, 1,
     1.75f};
/* Under a lamp at (0, 1, 0), over a ray on the x axis. */
static const float roof[18] = {-0.5f, 0.5f, -1, 0.25f, 0.5f, -1, 0.25f, 0.625f, 1, -0.5f, 0.5f, -1, 0.25f, 0.625f, 1,
     -0.5f, 0.5f, 1};

static float slats[9 * 24], ball[9 * 36];

/* The meshes of meshes.h as loose triangles, scaled and moved. */
static void loosen(float *out, const test_mesh *m, double scale, double x, double y, double z) {
    for (uint32_t i = 0; i < m->triangle_count; i++)
        for (int k = 0; k < 3; k++) {
            const float *p = m->positions + 3 * m->triangles[i].v[k];
            float *q = out + 9 * i + 3 * k;
            q[0] = (float)(scale * p[0] + x);
            q[1] = (float)(scale * p[1] + y);
            q[2] = (float)(scale * p[2] + z);
        }
}

static int make_meshes(void **state) {
    test_mesh m = test_mesh_slats(12);
    loosen(slats, &m, 1, 0, 0, 1.25);
    test_mesh_free(&m);
    m = test_mesh_sphere(4, 6, 0);
    loosen(ball, &m, 0.25, 0.125, 0.03125, 2);
    test_mesh_free(&m);
    return open_device(state);
}

#define BEAM .eye = {-5, 0, 4}, .length = 10, .sigma_t = GREY(0.3f), .albedo = 1
#define WIDE_SPOT .lamps = {SPOT(0, 0, 0, 1, 30, 20)}
#define AIR .eye = {-2, 0, 0}, .length = 5, .sigma_t = GREY(0.5f), .albedo = 1, .lamps = {POINT(0, 1, 0, 1)}
#define MESH(array, count) .triangles = array, .triangle_count = count

static const airlight cases[] = {
    {.name = "blade", BEAM, WIDE_SPOT, MESH(blade, 2)},
    {.name = "blade, g 0.9", BEAM, .g = 0.9f, WIDE_SPOT, MESH(blade, 2)},
    {.name = "blade, g -0.9", BEAM, .g = -0.9f, WIDE_SPOT, MESH(blade, 2)},
    {.name = "tilted blade", BEAM, .g = 0.3f, WIDE_SPOT, MESH(tilted, 2)},
    {.name = "blade, chromatic", .eye = {-5, 0, 4}, .length = 10, .sigma_t = {0.1f, 0.3f, 0.9f}, .albedo = 0.75f,
     .g = 0.5f,
     WIDE_SPOT, MESH(blade, 2)},
    {.name = "blade, ray off the axis", .eye = {-5, 0.5f, 4}, .length = 10, .sigma_t = GREY(0.3f), .albedo = 1,
     .g = 0.5f,
     WIDE_SPOT, MESH(blade, 2)},
    {.name = "slats", BEAM, .g = 0.5f, WIDE_SPOT, MESH(slats, 24)},
    {.name = "tessellated ball", BEAM, .g = 0.5f, WIDE_SPOT, MESH(ball, 36)},
    {.name = "roof under a point light", AIR, MESH(roof, 2)},
    {.name = "roof, g 0.9", AIR, .g = 0.9f, MESH(roof, 2)},
    {.name = "roof, no end", .eye = {-2, 0, 0}, .sigma_t = GREY(0.5f), .albedo = 1, .g = 0.5f,
     .lamps = {POINT(0, 1, 0, 1)},
     MESH(roof, 2)},
    {.name = "roof, thin", .eye = {-2, 0, 0}, .length = 5, .sigma_t = GREY(2e-3f), .albedo = 1,
     .lamps = {POINT(0, 1, 0, 1)},
     MESH(roof, 2)},
    {.name = "roof, depth 50", .eye = {-2, 0, 0}, .length = 5, .sigma_t = GREY(10), .albedo = 1,
     .lamps = {POINT(-1.5f, 0.5f, 0, 1)},
     .balls = {{0, {-1.75f, 0.25f, 0}, 0.0625f}}},
    {.name = "sphere", BEAM, .g = 0.5f, WIDE_SPOT, .balls = {{0, {0.25f, 0.1f, 2}, 0.3f}}},
    {.name = "disk", AIR, .g = -0.5f, .balls = {{1, {-0.25f, 0.5f, 0.125f}, 0.375f}}},
    {.name = "spheres and a disk", AIR, .g = 0.3f,
     .balls = {{0, {-1, 0.375f, 0}, 0.125f}, {0, {1, 0.5f, 0.125f}, 0.25f}, {1, {0, 0.625f, 0}, 0.0625f}}},
    {.name = "from behind a wide spot", .eye = {-5, 0, -1}, .length = 10, .sigma_t = GREY(0.2f), .albedo = 1, .g = 0.5f,
     .lamps = {SPOT(0, 0, 0, 1, 120, 100)}, .balls = {{0, {1, 0, -0.25f}, 0.25f}, {0, {-2, 0.0625f, -0.5f}, 0.125f}}},
    {.name = "three lamps", .eye = {-5, 0, 4}, .length = 10, .sigma_t = GREY(0.2f), .albedo = 0.9f, .g = 0.4f,
     .lamps = {SPOT(0, 0, 0, 2, 15, 12), SPOT(2, 1, 1, 1, 40, 30), POINT(-1, 2, 5, 0.25f)},
     .balls = {{0, {-0.5f, 0.75f, 4.5f}, 0.25f}, {0, {2, 0.5f, 2.5f}, 0.5f}}, MESH(blade, 2)},
    {.name = "ten lamps", .eye = {-5, 0, 4}, .length = 10, .sigma_t = GREY(0.2f), .albedo = 0.9f, .g = 0.4f,
     .lamps = {SPOT(0, 0, 0, 2, 15, 12), SPOT(2, 1, 1, 1, 40, 30), POINT(-1, 2, 5, 0.25f), POINT(-4, 3, 5, 0.5f),
               POINT(4, -3, 5, 0.5f), SPOT(-3, 0, 2, 1, 20, 10), SPOT(3, 0, 2, 1, 25, 10), POINT(1, 2, 2, 0.1f),
               POINT(0, -2, 4, 0.1f), SPOT(1, 0.5f, 1, 3, 10, 9)}, MESH(slats, 24)},
    {.name = "bounded, blade", .eye = {-5, 0, 2}, .sigma_t = {0.3f, 0.6f, 1.2f}, .albedo = 0.8f, .g = 0.3f, WIDE_SPOT,
     MESH(blade, 2), .bounded = 1, .box = {-2, -1, -1, 1.5f, 1, 2.5f}},
    {.name = "bounded, blade outside", .eye = {-1, 0, 2}, .sigma_t = GREY(0.5f), .albedo = 0.8f, .g = 0.3f, WIDE_SPOT,
     MESH(blade, 2), .bounded = 1, .box = {-2, -1, 1.25f, 1.5f, 1, 2.5f}},
    {.name = "bounded, directional, slats", .eye = {-5, 0, 2}, .sigma_t = GREY(0.5f), .albedo = 0.8f, .g = -0.3f,
     .lamps = {{BRUME_LIGHT_DIRECTIONAL, {0, 0, 0}, {0, 0, 1}, 2, 0, 0}}, MESH(slats, 24), .bounded = 1,
     .box = {-2, -1, 1.75f, 1.5f, 1, 2.5f}},
};
enum { CASES = sizeof cases / sizeof cases[0] };

/* Samples per pixel, and the largest relative standard error. */
static const struct { brume_strategy strategy; uint32_t positions, samples; double precision; } rungs[] = {
    {BRUME_STRATEGY_DISTANCE, 0, 1024, 0.05},        {BRUME_STRATEGY_EQUIANGULAR, 0, 1024, 0.03},
    {BRUME_STRATEGY_EQUIANGULAR_CONE, 0, 512, 0.02}, {BRUME_STRATEGY_MIS, 0, 512, 0.02},
    {BRUME_STRATEGY_PRODUCT, 0, 512, 0.01},          {BRUME_STRATEGY_SYSTEMATIC, 0, 256, 0.005},
    {BRUME_STRATEGY_RASTER, 0, 64, 0.005},           {BRUME_STRATEGY_RASTER, 8, 64, 0.01},
    {BRUME_STRATEGY_AUTO, 0, 64, 0.005}};
enum { RUNGS = sizeof rungs / sizeof rungs[0] };

static void every_rung_sees_the_shadows(void **state) {
    int wrong = 0, noticed = 0, checks = 0, without = 0;
    (void)state;
    NEEDS_DEVICE();
    for (int i = 0; i < CASES; i++) {
        const airlight *a = &cases[i];
        airlight open = *a;
        brume_scene *scene = airlight_scene(a, 1);
        open.triangle_count = 0;
        memset(open.balls, 0, sizeof open.balls);
        int channels = a->sigma_t[0] != a->sigma_t[1] ? 3 : 1;
        for (int k = 0; k < RUNGS; k++) {
            brume_render_desc desc = climb(rungs[k].strategy, rungs[k].samples);
            desc.positions = rungs[k].positions;
            estimate e = render_as(scene, &desc);
            for (int c = 0; c < channels; c++) {
                double expected = airlight_expected(a, c), mean = e.mean[c], error = e.error[c];
                const char *what = !agrees(mean, error, expected) ? "wrong"
                                   : !(error <= rungs[k].precision * expected) ? "too noisy to tell" : NULL;
                wrong += what != NULL;
                if (what)
                    print_error("%s, %s, channel %d: %.9g, expected %.9g: %+.2g, standard error %.2g: %s\n", a->name,
                                brume_strategy_name(rungs[k].strategy), c, mean, expected, mean / expected - 1,
                                error / expected, what);
                checks += 2;
                noticed += !agrees(1.02 * mean, 1.02 * error, expected) + !agrees(0.98 * mean, 0.98 * error, expected);
                without += 2 * !agrees(mean, error, airlight_expected(&open, c));
            }
        }
        brume_scene_destroy(scene);
    }
    print_message("2 %% more or less would be noticed by %d of %d checks, no shadow by %d\n", noticed, checks, without);
    assert_int_equal(wrong, 0);
    assert_true(noticed > checks * 3 / 4);
    assert_int_equal(without, checks);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_rung_sees_the_shadows),
    };
    return cmocka_run_group_tests(tests, make_meshes, close_device);
}

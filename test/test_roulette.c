/* test_roulette.c -- Russian roulette leaves the mean as it is, and adds as much noise as its probabilities say.
 *
 * In a sphere whose wall reflects half of the light and glows with radiance 1/2, all paths are alike but for the roulette:
 * of EDGES edges they find 1 - 2^-EDGES. First and second moments of what they find follow by recursion. From 256 pixels of
 * independent samples a standard error is known to 4.5 %; six times that is allowed, which chance exceeds once in 10^8.
 */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>

#include <math.h>

#include "known_answer.h"
#include "planted.h"

enum { EDGES = 14, FROM = 5, SAMPLES = 256 };
#define HALF 0.5
#define SPREAD_ALLOWED 0.27

/* Mean and mean square of what a path finds from its `depth`-th wall on, times its throughput there. */
typedef struct moments { double mean, square; } moments;

static moments from_wall(int depth, double throughput, double kept) {
    moments here = {HALF * throughput, HALF * throughput * HALF * throughput};
    if (depth + 1 >= EDGES) return here;
    double next = HALF * throughput, survives = 1;
    if (depth + 1 >= FROM) survives = fmin(kept * next, 0.995);
    moments rest = from_wall(depth + 1, next / survives, kept);
    moments all = {here.mean + survives * rest.mean,
                   here.square + survives * (2 * here.mean * rest.mean + rest.square)};
    return all;
}

static double standard_error(double kept) {
    moments m = from_wall(0, 1, kept);
    return sqrt((m.square - m.mean * m.mean) / (SAMPLES * PIXELS * PIXELS));
}

/* thin: the sphere is full of a medium that does nothing that could be seen. */
static estimate grey_sphere(int thin) {
    view v = along_z;
    brume_integrator_desc integrator;
    brume_shape_desc wall = brume_shape_desc_default(BRUME_SHAPE_SPHERE);
    brume_render_desc desc = climb(BRUME_STRATEGY_SPHERICAL, SAMPLES); /* the wall is not sampled */
    brume_scene *scene = new_scene(EDGES, SAMPLES);
    must(brume_scene_get_integrator(scene, &integrator));
    integrator.rr_depth = FROM;
    must(brume_scene_set_integrator(scene, &integrator));
    v.origin[2] = -0.4;
    set_camera(scene, &v, thin ? add_medium(scene, 1e-9, 0, 0, 0) : BRUME_NONE);
    wall.flip_normals = 1;
    wall.bsdf = add_diffuse(scene, HALF);
    set_all(wall.radiance, HALF);
    must(brume_scene_add_shape(scene, &wall, NULL));
    estimate e = render_as(scene, &desc);
    brume_scene_destroy(scene);
    return e;
}

/* As it should be: mean and standard error. */
static int holds(estimate e, double kept) {
    double right = standard_error(kept), mean = 1 - pow(HALF, EDGES);
    print_message("mean %.6g, expected %.6g; standard error %.3g, expected %.3g\n", e.mean[0], mean, e.error[0], right);
    return fabs(e.mean[0] - mean) < 6 * right + FLOAT_ERROR && fabs(e.error[0] / right - 1) < SPREAD_ALLOWED;
}

/* Without a medium paths of four times as little survive as in one: see cl/path.h. */
static void spread_is_that_of_its_probabilities(void **state) {
    (void)state;
    NEEDS_DEVICE();
    assert_true(holds(grey_sphere(0), 4));
    assert_true(holds(grey_sphere(1), 1));
}

static void planted_errors_are_noticed(void **state) {
    static const struct { const char *right, *wrong; } bugs[] = {
        {"* R(s->params->survival)", ""},
        {"cscale(p->throughput, R(1) / lmax(survival, R(1e-30)))", "p->throughput"},
        {"p->depth >= I(s->params->rr_depth)", "p->depth >= I(2)"},
    };
    (void)state;
    NEEDS_DEVICE();
    for (size_t i = 0; i < sizeof bugs / sizeof bugs[0]; i++) {
        planted_bug("path.h", bugs[i].right, bugs[i].wrong);
        int unnoticed = holds(grey_sphere(0), 4);
        planted_remove();
        if (unnoticed) fail_msg("not noticed: %s", bugs[i].wrong);
    }
}

static int remove_planted(void **state) {
    (void)state;
    planted_remove();
    return 0;
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(spread_is_that_of_its_probabilities),
        cmocka_unit_test_teardown(planted_errors_are_noticed, remove_planted),
    };
    return cmocka_run_group_tests(tests, open_device, close_device);
}

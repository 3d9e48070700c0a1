/* test_furnace_strategies.c -- the radiance in a furnace full of fog, by every way to look for light that scatters more
 * than once and by the strategies that differ where walls glow, whatever the phase function: the same everywhere.
 *
 * The room's wall glows, and so does the fog, as much as each absorbs. A lamp of a 1e-20th of the radiance gives rays
 * of light something to start from: paths are then split between them and the rest, of which nothing may be lost or
 * counted twice. Without light from lamps the equiangular strategies and MIS are DISTANCE, the others PRODUCT, to the
 * bit; what they make of lamps is in test_extreme_lamps. SPHERICAL, whose weights double at every flight, has no finite
 * variance here.
 */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "known_answer.h"
#include "planted.h"
#include "stability.h"

#define RADIANCE 2.5
#define MOST_ERRORS 5.0 /* p = 6e-7 for each */
#define PRECISION 0.006 /* a standard error beyond it says too little */

enum { SAMPLES = 128, BALL, CUBE };

typedef struct way {
    brume_strategy strategy;
    brume_indirect indirect;
    double g;
    int room;
} way;

static brume_scene *furnace_scene(const way *w) {
    const double sigma = 1, albedo = 0.8, reflectance = 0.5;
    view v = along_z;
    brume_scene *scene = new_scene(DEPTH_ANY, SAMPLES);
    brume_shape_desc wall = brume_shape_desc_default(w->room == BALL ? BRUME_SHAPE_SPHERE : BRUME_SHAPE_CUBE);
    brume_light_desc lamp = brume_light_desc_default(BRUME_LIGHT_POINT);
    v.fov = 80;
    v.origin[2] = -0.4;
    set_camera(scene, &v, add_medium(scene, sigma, albedo, w->g, RADIANCE * sigma * (1 - albedo)));
    wall.flip_normals = 1;
    wall.bsdf = add_diffuse(scene, reflectance);
    set_all(wall.radiance, RADIANCE * (1 - reflectance));
    must(brume_scene_add_shape(scene, &wall, NULL));
    set_all(lamp.intensity, 1e-20 * RADIANCE);
    scale_and_move(lamp.to_world, 1, 1, 1, 0.3, -0.2, 0.1);
    must(brume_scene_add_light(scene, &lamp, NULL));
    return scene;
}

/* In standard errors, beyond FLOAT_ERROR. */
static double off_by(const way *w, estimate *e) {
    brume_scene *scene = furnace_scene(w);
    brume_render_desc desc = climb(w->strategy, SAMPLES);
    desc.generic = 1; /* of one strategy one program for all, and one that builds in little time */
    desc.lanes = 1;
    desc.use_indirect = 1;
    desc.indirect = w->indirect;
    *e = render_as(scene, &desc);
    brume_scene_destroy(scene);
    return fmax(fabs(e->mean[0] - RADIANCE) - FLOAT_ERROR * RADIANCE, 0) / e->error[0];
}

/* The worst of a strategy, or of a way to look for light that scatters more than once, over all phase functions. */
static void hold(brume_strategy strategy, brume_indirect indirect) {
    static const double gs[] = {-0.9, 0, 0.9, 0.99};
    double worst = -1, where = 0;
    char name[96];
    for (int i = 0; i < 4; i++) {
        const way w = {strategy, indirect, gs[i], i % 2 ? BALL : CUBE};
        estimate e;
        double off = off_by(&w, &e);
        print_message("%-17s %-10s g %4g: %.5f, standard error %.1e: %.2f\n", brume_strategy_name(strategy),
                      brume_indirect_name(indirect), w.g, e.mean[0] / RADIANCE, e.error[0] / RADIANCE, off);
        if (!(e.error[0] <= PRECISION * RADIANCE))
            fail_msg("%s, %s, g %g: a standard error of %.2g says too little", brume_strategy_name(strategy),
                     brume_indirect_name(indirect), w.g, e.error[0]);
        if (off > worst) {
            worst = off;
            where = w.g;
        }
    }
    snprintf(name, sizeof name, "fog by strategy %s, indirect %s", brume_strategy_name(strategy),
             brume_indirect_name(indirect));
    stability_row("furnace", name, "the walls' radiance everywhere", "standard errors", MOST_ERRORS, worst, "g = %g",
                  where);
}

static void every_strategy(void **state) {
    (void)state;
    NEEDS_DEVICE();
    hold(BRUME_STRATEGY_DISTANCE, BRUME_INDIRECT_PHASE);
    hold(BRUME_STRATEGY_PRODUCT, BRUME_INDIRECT_PHASE);
}

static void every_indirect(void **state) {
    (void)state;
    NEEDS_DEVICE();
    hold(BRUME_STRATEGY_AUTO, BRUME_INDIRECT_MIXTURE);
    hold(BRUME_STRATEGY_AUTO, BRUME_INDIRECT_RAY_LIGHTS);
}

static void planted_errors_are_noticed(void **state) {
    static const struct { const char *file, *right, *wrong; way w; } plants[] = {
        {"heuristic.h", "fma(r, r, R(1))", "fma(r, r, R(1.5))",
         {BRUME_STRATEGY_AUTO, BRUME_INDIRECT_PHASE, 0.9, BALL}},
        {"path.h", "fma(LAMPWARD, about, (R(1) - LAMPWARD) * phase)", "fma(LAMPWARD, about, phase)",
         {BRUME_STRATEGY_AUTO, BRUME_INDIRECT_MIXTURE, 0, BALL}},
    };
    (void)state;
    NEEDS_DEVICE();
    for (size_t i = 0; i < sizeof plants / sizeof plants[0]; i++) {
        estimate e;
        planted_bug(plants[i].file, plants[i].right, plants[i].wrong);
        double off = off_by(&plants[i].w, &e);
        planted_remove();
        print_message("%s: %.5f, %.2f standard errors\n", plants[i].wrong, e.mean[0] / RADIANCE, off);
        if (!(off > MOST_ERRORS)) fail_msg("%s was not noticed", plants[i].wrong);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_strategy),
        cmocka_unit_test(every_indirect),
        cmocka_unit_test(planted_errors_are_noticed),
    };
    return cmocka_run_group_tests(tests, open_device, close_device);
}

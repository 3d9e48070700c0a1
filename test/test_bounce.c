/* test_bounce.c -- what rays of light add at surfaces (cl/path_bounce.h), and what paths leave to them: light by way of
 * another surface, and by way of the fog between.
 *
 * In a sphere of radius 1 and reflectance rho each point of the wall sends the same light to every other one: of lamps
 * of total flux F, what has been reflected k > 1 times is rho^k F / (4 pi^2) everywhere, in fog so thin that it takes
 * nothing. Fog that only scatters takes nothing either, however thick, and from the sphere's centre a lamp lights all of
 * the wall alike, rho / (4 pi^2 (1 - rho)) F in all. What goes by fog is told by a rule in double (orders.h), for each
 * strategy that gathers light along segments.
 *
 * All comparisons are one family at CONFIDENCE (stats.h).
 */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>

#include <math.h>

#include "known_answer.h"
#include "orders.h"
#include "planted.h"
#include "stability.h"
#include "stats.h"

#define RHO 0.7
#define THIN 1e-6 /* sigma_t */
#define CUTOFF 50
#define BEAM 20
#define INTENSITY 3
#define POINT_X 0.6

/* CENTRE: a point in fog of sigma_t 1, seen from next to the wall. CLEAR: without any fog. */
enum { SPOT = 1, POINT = 2, CENTRE = 4, CLEAR = 8 };
static const struct { int lamps, depth; } rooms[] = {
    {SPOT, 3}, {SPOT, 7}, {POINT, 3}, {SPOT | POINT, 5}, {CENTRE, DEPTH_ANY}, {SPOT | CLEAR, 5},
    {SPOT | POINT | CLEAR, 4}};
static const brume_strategy strategies[] = {BRUME_STRATEGY_EQUIANGULAR, BRUME_STRATEGY_EQUIANGULAR_CONE,
                                            BRUME_STRATEGY_MIS, BRUME_STRATEGY_PRODUCT, BRUME_STRATEGY_SYSTEMATIC,
                                            BRUME_STRATEGY_RASTER, BRUME_STRATEGY_AUTO};
enum {
    ROOMS = sizeof rooms / sizeof rooms[0],
    STRATEGIES = sizeof strategies / sizeof strategies[0],
    TESTS = ROOMS + STRATEGIES
};

/* Beside the pool of a spot's light, on the floor. */
static const orders beside = {"beside a spot", 0.25f, 0.9f, 0.3f, {0, 0, 3}, 40, 30, {4.5f, 0.25f, 2.5f},
                              {-0.5f, 0, -1}, 0.7f};

/* Of the spot, whose falloff is linear in the angle: integrated in closed form. */
static double flux_of(int lamps) {
    double a = BEAM * PI / 180, b = CUTOFF * PI / 180;
    double fading = (cos(a) * (b - a) - sin(b) + sin(a)) / (b - a);
    double spot = 2 * PI * INTENSITY * (1 - cos(a) + fading);
    return (lamps & SPOT ? spot : 0) + (lamps & POINT ? 4 * PI : 0);
}

/* Of the wall at (0, 0, 1), which the spot points away from. */
static double room_radiance(int lamps, int depth) {
    if (lamps & CENTRE)
        return RHO / (1 - RHO) / PI;
    double sum = lamps & POINT ? RHO / PI * pow(1 + POINT_X * POINT_X, -1.5) : 0;
    for (int k = 2; k < depth; k++)
        sum += pow(RHO, k) * flux_of(lamps) / (4 * PI * PI);
    return sum;
}

static estimate room(int lamps, int depth) {
    brume_scene *scene = new_scene(depth, 1);
    view down = {{0.3, -0.2, 0.1}, {0.2, 0.1, -1}, {0, 1, 0}, 0};
    brume_shape_desc wall = brume_shape_desc_default(BRUME_SHAPE_SPHERE);
    brume_render_desc desc = climb_by_rays(BRUME_STRATEGY_AUTO, 1024);
    view eye = along_z;
    eye.origin[2] = lamps & CENTRE ? 1 - 1e-5 : 0;
    set_camera(scene, &eye, lamps & CLEAR ? BRUME_NONE : add_medium(scene, lamps & CENTRE ? 1 : THIN, 1, 0, 0));
    wall.flip_normals = 1;
    wall.bsdf = add_diffuse(scene, RHO);
    must(brume_scene_add_shape(scene, &wall, NULL));
    if (lamps & SPOT)
        add_spot(scene, &down, INTENSITY, CUTOFF, BEAM);
    if (lamps & (POINT | CENTRE))
        add_point(scene, lamps & POINT ? POINT_X : 0, 0, 0);
    estimate e = render_as(scene, &desc);
    brume_scene_destroy(scene);
    return e;
}

/* Light that scatters twice on its way from the lamp. What the depths share is drawn alike, so that it cancels. */
static estimate second_order(brume_strategy strategy) {
    static float once[PIXELS * PIXELS * 3], twice[PIXELS * PIXELS * 3];
    brume_render_desc desc = climb_by_rays(strategy, 1024);
    for (int depth = 2; depth <= 3; depth++) {
        brume_scene *scene = orders_scene(&beside, depth);
        render_pixels(scene, &desc, depth == 2 ? once : twice);
        brume_scene_destroy(scene);
    }
    for (int k = 0; k < PIXELS * PIXELS * 3; k++)
        twice[k] -= once[k];
    return estimate_of(twice);
}

static int is_wrong(double off) { return !(stats_z_tail(off) > stats_level(CONFIDENCE, TESTS)); }

static double room_off(int i) {
    double right = room_radiance(rooms[i].lamps, rooms[i].depth);
    return estimate_off("a room", room(rooms[i].lamps, rooms[i].depth), right);
}

static double fog_off(brume_strategy strategy) {
    return estimate_off(beside.name, second_order(strategy), orders_second(&beside, 3));
}

static void walls_light_each_other(void **state) {
    double worst = 0;
    int where = 0;
    (void)state;
    NEEDS_DEVICE();
    for (int i = 0; i < ROOMS; i++) {
        double right = room_radiance(rooms[i].lamps, rooms[i].depth);
        estimate e = room(rooms[i].lamps, rooms[i].depth);
        double off = estimate_off("a room", e, right);
        assert_true(e.error[0] < 0.005 * right);
        assert_false(is_wrong(off));
        where = off > worst ? i : where;
        worst = fmax(worst, off);
    }
    stability_row("extreme", "walls that light each other, by rays of light", "the integrating sphere",
                  "standard errors", 5, worst, "depth %d", rooms[where].depth);
}

static void fog_lights_a_floor(void **state) {
    double right = orders_second(&beside, 3);
    (void)state;
    NEEDS_DEVICE();
    for (int i = 0; i < STRATEGIES; i++) {
        estimate e = second_order(strategies[i]);
        double off = estimate_off(beside.name, e, right);
        assert_true(e.error[0] < 0.005 * right);
        assert_false(is_wrong(off));
    }
}

static void planted_errors_are_noticed(void **state) {
    static const struct { const char *file, *right, *wrong; int where; /* a strategy, or -1 - a room */ } bugs[] = {
        /* What a path finds is counted in full beside what rays of light find. */
        {"path_light.h", "shared ? power_heuristic(by_path, by_light) : R(1)", "R(1)", -1},
        {"scatter_segment.h",
         "weight = shared ? shared_with_rays(at->pdf, p.distance, l->rays, along + at->before) : weight;",
         "weight = R(1);", BRUME_STRATEGY_AUTO},
        {"scatter_segment.h", "at->pdf >= R(0) ? weight : R(1)", "R(1)", BRUME_STRATEGY_MIS},
        /* The weight of the path given to the connection: they don't add up to one. */
        {"path_bounce.h", "shared_with_rays(r->rays, out.distance, lmax(f.pdf, R(0)), at)",
         "shared_with_rays(lmax(f.pdf, R(0)), at, r->rays, out.distance)", BRUME_STRATEGY_AUTO},
        /* The choice between the ray and its end. */
        {"path_bounce.h", "share = end ? R(1) - share : share;", "share = end ? R(1) : share;", -5},
        /* The lit surface's cosine. */
        {"path_bounce.h", "fabs(vdot(r->ng, out.wi)) / square(out.distance)", "R(1) / square(out.distance)", -1},
        /* The large floor hides what it reflects. */
        {"path_bounce.h",
         "visibility_from(s, origin, vscale(to, R(1) / length), length * SHORT_OF_LIGHT, inside, v->own, live)",
         "visibility(s, c.y, vscale(to, R(-1) / length), length * SHORT_OF_LIGHT, inside, live)",
         BRUME_STRATEGY_AUTO},
    };
    (void)state;
    NEEDS_DEVICE();
    for (size_t i = 0; i < sizeof bugs / sizeof bugs[0]; i++) {
        planted_bug(bugs[i].file, bugs[i].right, bugs[i].wrong);
        int k = -1 - bugs[i].where;
        double off = k >= 0 ? room_off(k) : fog_off((brume_strategy)bugs[i].where);
        planted_remove();
        if (!is_wrong(off)) fail_msg("not noticed: %s", bugs[i].wrong);
    }
}

static int remove_planted(void **state) {
    (void)state;
    planted_remove();
    return 0;
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(walls_light_each_other),
        cmocka_unit_test(fog_lights_a_floor),
        cmocka_unit_test_teardown(planted_errors_are_noticed, remove_planted),
    };
    return cmocka_run_group_tests(tests, open_device, close_device);
}

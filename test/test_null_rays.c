/* test_null_rays.c -- rays of light that go on through null surfaces (cl/light_way.h): fog that ends somewhere, lamp and
 * camera in it or not. And directional lamps beside others: both have paths and rays of light share what they find.
 *
 * Null surfaces with the same fog on both sides change nothing: what scatters twice and three times is known in double
 * (orders.h). In a sphere whose wall reflects rho, a lamp in the centre of as much fog as you like that takes nothing, in
 * whatever concentric shells, lights the wall alike: rho / (4 pi^2 (1 - rho)) of its flux is seen everywhere.
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

/* Beside the pool of a spot's light, and past a point light. */
static const orders beside = {"beside a spot", 0.25f, 0.9f, 0.3f, {0, 0, 3}, 40, 30, {4.5f, 0.25f, 2.5f},
                              {-0.5f, 0, -1}, 0.7f};
static const orders past = {"past a point", 0.5f, 0.9f, 0, {0, 1, 2}, 180, 0, {-2, 0, 2}, {1, 0, 0}, 0};

/* BALLS cut the fog; a SUN comes to nothing through fog without end, but rays of light are not alone then. */
enum { BALLS = 1, SUN = 2 };
static const struct { const orders *o; int order, with; brume_strategy strategy; } cuts[] = {
    {&beside, 2, BALLS, BRUME_STRATEGY_AUTO},       {&beside, 2, BALLS, BRUME_STRATEGY_MIS},
    {&beside, 2, BALLS, BRUME_STRATEGY_SYSTEMATIC}, {&past, 2, BALLS, BRUME_STRATEGY_AUTO},
    {&past, 2, BALLS, BRUME_STRATEGY_EQUIANGULAR},  {&past, 3, BALLS, BRUME_STRATEGY_AUTO},
    {&beside, 2, SUN, BRUME_STRATEGY_AUTO},         {&past, 3, SUN, BRUME_STRATEGY_MIS},
};

/* In the sphere of radius 1 there is fog up to the radius `core`, and between the other two. */
static const struct { double core, from, to; } rooms[] = {{0, 0, 0.5}, {0, 0.5, 1}, {0.15, 0.3, 0.6}};

enum { CUTS = sizeof cuts / sizeof cuts[0], ROOMS = sizeof rooms / sizeof rooms[0], TESTS = CUTS + ROOMS };

static void add_ball(brume_scene *scene, double x, double y, double z, double radius, uint32_t interior,
                     uint32_t exterior) {
    brume_shape_desc ball = brume_shape_desc_default(BRUME_SHAPE_SPHERE);
    brume_bsdf_desc null = brume_bsdf_desc_default(BRUME_BSDF_NULL);
    must(brume_scene_add_bsdf(scene, &null, &ball.bsdf));
    ball.center[0] = (float)x;
    ball.center[1] = (float)y;
    ball.center[2] = (float)z;
    ball.radius = (float)radius;
    ball.interior = interior;
    ball.exterior = exterior;
    must(brume_scene_add_shape(scene, &ball, NULL));
}

/* About the lamp, about the camera, in the light and across the ray. */
static void add_balls(brume_scene *scene, const orders *o) {
    add_ball(scene, o->lamp[0], o->lamp[1], o->lamp[2], 0.4, 0, 0);
    add_ball(scene, o->eye[0], o->eye[1], o->eye[2], 0.5, 0, 0);
    add_ball(scene, 0.4, 0.3, 1, 0.6, 0, 0);
    if (o == &beside)
        add_ball(scene, 3.6, 0.1, 0.7, 0.5, 0, 0);
    else
        add_ball(scene, 2, 0.2, 2, 0.8, 0, 0);
}

/* What the depths share is drawn alike, so that it cancels. */
static estimate order_of(int cut) {
    const orders *o = cuts[cut].o;
    const int order = cuts[cut].order;
    const brume_light_desc sun = brume_light_desc_default(BRUME_LIGHT_DIRECTIONAL);
    static float less[PIXELS * PIXELS * 3], more[PIXELS * PIXELS * 3];
    brume_render_desc desc = climb_by_rays(cuts[cut].strategy, 1024);
    for (int depth = order; depth <= order + 1; depth++) {
        brume_scene *scene = orders_scene(o, depth);
        if (cuts[cut].with & BALLS)
            add_balls(scene, o);
        if (cuts[cut].with & SUN)
            must(brume_scene_add_light(scene, &sun, NULL));
        render_pixels(scene, &desc, depth == order ? less : more);
        brume_scene_destroy(scene);
    }
    for (int k = 0; k < PIXELS * PIXELS * 3; k++)
        more[k] -= less[k];
    return estimate_of(more);
}

static double right_order(const orders *o, int order) {
    return o == &beside ? orders_second(o, 3) : orders_isotropic(o, order);
}

/* Seen from next to the wall. */
static estimate room(double core, double from, double to) {
    brume_scene *scene = new_scene(DEPTH_ANY, 1);
    brume_shape_desc wall = brume_shape_desc_default(BRUME_SHAPE_SPHERE);
    brume_render_desc desc = climb_by_rays(BRUME_STRATEGY_AUTO, 512);
    view eye = along_z;
    uint32_t fog = add_medium(scene, 2, 1, 0.4, 0), outside = to < 1 ? BRUME_NONE : fog;
    eye.origin[2] = 1 - 1e-5;
    set_camera(scene, &eye, outside);
    wall.flip_normals = 1;
    wall.bsdf = add_diffuse(scene, RHO);
    must(brume_scene_add_shape(scene, &wall, NULL));
    if (to < 1)
        add_ball(scene, 0, 0, 0, to, fog, BRUME_NONE);
    if (from > 0)
        add_ball(scene, 0, 0, 0, from, BRUME_NONE, fog);
    if (core > 0)
        add_ball(scene, 0, 0, 0, core, fog, BRUME_NONE);
    add_point(scene, 0, 0, 0);
    estimate e = render_as(scene, &desc);
    brume_scene_destroy(scene);
    return e;
}

static int is_wrong(double off) { return !(stats_z_tail(off) > stats_level(CONFIDENCE, TESTS)); }

static double cut_off(int i) {
    double right = right_order(cuts[i].o, cuts[i].order);
    estimate e = order_of(i);
    assert_true(e.error[0] < 0.02 * right);
    return estimate_off(cuts[i].o->name, e, right);
}

static double room_off(int i) {
    double right = RHO / (1 - RHO) / PI;
    estimate e = room(rooms[i].core, rooms[i].from, rooms[i].to);
    assert_true(e.error[0] < 0.01 * right);
    return estimate_off("a room", e, right);
}

static void fog_cut_in_two_is_the_same(void **state) {
    double worst = 0;
    int where = 0;
    (void)state;
    NEEDS_DEVICE();
    for (int i = 0; i < CUTS; i++) {
        double off = cut_off(i);
        assert_false(is_wrong(off));
        where = off > worst ? i : where;
        worst = fmax(worst, off);
    }
    stability_row("extreme", "rays of light through null surfaces in fog", "a rule and an integral equation in double",
                  "standard errors", 5, worst, "%s, order %d", cuts[where].o->name, cuts[where].order);
}

static void fog_that_ends_lights_a_room(void **state) {
    double worst = 0;
    int where = 0;
    (void)state;
    NEEDS_DEVICE();
    for (int i = 0; i < ROOMS; i++) {
        double off = room_off(i);
        assert_false(is_wrong(off));
        where = off > worst ? i : where;
        worst = fmax(worst, off);
    }
    stability_row("extreme", "rays of light from and into fog that ends", "the integrating sphere", "standard errors", 5,
                  worst, "fog from radius %g to %g", rooms[where].from, rooms[where].to);
}

static void planted_errors_are_noticed(void **state) {
    static const struct { const char *file, *right, *wrong; int cut, room; } bugs[] = {
        /* The medium at the lamp: the camera's. */
        {"light_ray.h", "GATHER_INT(s->lights, medium, k)", "I(s->params->sensor_medium)", -1, 0},
        /* Beyond the first boundary it goes on as before it. */
        {"light_way.h", "*inside = second ? w->second : w->first;", "*inside = w->first;", -1, 1},
        /* From the second boundary on. */
        {"light_way.h", "*inside = beyond ? there : *inside;", ";", -1, 2},
        /* What comes to the end. */
        {"light_way.h", "w->through = cselect(live,", "w->through = cselect(FALSE_MASK,", 0, -1},
        /* Weights that don't add up to one: behind a null surface the way is forgotten; one of the two counts in full. */
        {"path_medium.h", "at.before = vlength(vsub(p->o, p->from));", ";", 0, -1},
        {"path_indirect.h", "shared_with_rays(r->rays, out.distance, pdf, at)", "R(1)", 3, -1},
        {"path_indirect.h", "power_heuristic(r->density, pdf * cosine / square(out.distance))", "R(1)", -1, 1},
        {"path_state.h", "p->from_medium ? p->pdf * p->flown : p->pdf", "p->pdf", 3, -1},
    };
    (void)state;
    NEEDS_DEVICE();
    for (size_t i = 0; i < sizeof bugs / sizeof bugs[0]; i++) {
        planted_bug(bugs[i].file, bugs[i].right, bugs[i].wrong);
        double off = bugs[i].cut >= 0 ? cut_off(bugs[i].cut) : room_off(bugs[i].room);
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
        cmocka_unit_test(fog_cut_in_two_is_the_same),
        cmocka_unit_test(fog_that_ends_lights_a_room),
        cmocka_unit_test_teardown(planted_errors_are_noticed, remove_planted),
    };
    return cmocka_run_group_tests(tests, open_device, close_device);
}

/* test_energy_balance.c -- a closed room with one lamp of power P: what its walls and its fog absorb is P.
 *
 * In a sphere of area A and reflectance rho each point of the wall sends the same light to every other one. With a lamp
 * at its centre, in no fog or in fog that doesn't absorb, whatever it scatters, the irradiance is P / (A (1 - rho)).
 * The camera stands before the wall and shows rho / pi of that. (A point in fog has no finite variance: rays pass it by
 * as closely as they like. There is a clear pocket around it, or the lamp is a white ball that glows.) Grey fog has no
 * closed form, but the share that it takes of the lamp's light is, by reciprocity, what a camera in the lamp's place
 * sees of that fog when it glows like a black body of radiance 1, and what the walls take adds up to 1.
 */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>

#include <math.h>
#include <stdio.h>

#include "known_answer.h"
#include "planted.h"
#include "stability.h"

#define MOST_ERRORS 5.0 /* p = 6e-7 for each */
#define BEFORE_WALL 1e-5 /* of the radius 1 */

typedef enum lamp { CENTRE, ASIDE, BLACK_BALL, WHITE_BALL, POCKET } lamp;

typedef struct room {
    const char *name;
    double reflectance, sigma, albedo, g;
    lamp lamp;
} room;

#define BALL_RADIUS 0.5 /* of the pocket, too */
#define ASIDE_X 0.6

/* The radiance of the wall at (0, 0, 1), of a lamp of 1 W/sr, or a ball of radiance 1; NAN if not known. */
static double wall_radiance(const room *r) {
    double rho = r->reflectance, seen = BALL_RADIUS * BALL_RADIUS;
    if (r->lamp == WHITE_BALL)
        return rho * seen / (1 - rho);
    if (r->lamp == BLACK_BALL) /* it sees the wall alone; `seen` is its share of what the wall sees */
        return rho * seen / (1 - rho * (1 - seen));
    if (r->lamp == ASIDE) { /* what is reflected once is the same everywhere */
        double direct = pow(1 + ASIDE_X * ASIDE_X, -1.5);
        return rho / PI * (direct + rho / (1 - rho));
    }
    if (r->sigma == 0 || r->albedo == 1)
        return rho / PI / (1 - rho);
    return NAN;
}

/* The room, lit by its lamp and seen from close to the wall, or lit by its fog and seen from the lamp. */
static brume_scene *room_scene(const room *r, int by_fog, uint32_t samples) {
    view v = along_z;
    brume_scene *scene = new_scene(DEPTH_ANY, samples);
    brume_shape_desc wall = brume_shape_desc_default(BRUME_SHAPE_SPHERE);
    uint32_t fog = BRUME_NONE;
    if (r->sigma > 0)
        fog = add_medium(scene, r->sigma, r->albedo, r->g, by_fog ? r->sigma * (1 - r->albedo) : 0);
    v.origin[2] = by_fog ? 0 : 1 - BEFORE_WALL;
    set_camera(scene, &v, by_fog && r->lamp == POCKET ? BRUME_NONE : fog);
    wall.flip_normals = 1;
    wall.bsdf = add_diffuse(scene, r->reflectance);
    must(brume_scene_add_shape(scene, &wall, NULL));
    if (r->lamp == POCKET) {
        brume_bsdf_desc null = brume_bsdf_desc_default(BRUME_BSDF_NULL);
        brume_shape_desc pocket = brume_shape_desc_default(BRUME_SHAPE_SPHERE);
        pocket.radius = (float)BALL_RADIUS;
        pocket.exterior = fog;
        pocket.is_boundary = 1;
        must(brume_scene_add_bsdf(scene, &null, &pocket.bsdf));
        must(brume_scene_add_shape(scene, &pocket, NULL));
    }
    if (by_fog)
        return scene;
    if (r->lamp == BLACK_BALL || r->lamp == WHITE_BALL) {
        brume_shape_desc ball = brume_shape_desc_default(BRUME_SHAPE_SPHERE);
        ball.radius = (float)BALL_RADIUS;
        ball.bsdf = add_diffuse(scene, r->lamp == WHITE_BALL);
        set_all(ball.radiance, 1);
        must(brume_scene_add_shape(scene, &ball, NULL));
    } else
        add_point(scene, r->lamp == ASIDE ? ASIDE_X : 0, 0, 0);
    return scene;
}

static estimate seen(const room *r, int by_fog, uint32_t samples) {
    brume_render_desc desc = brume_render_desc_default();
    brume_scene *scene = room_scene(r, by_fog, samples);
    desc.guides = 0;
    estimate e = render_as(scene, &desc);
    brume_scene_destroy(scene);
    return e;
}

/* What is absorbed over what is sent out, less 1, in standard errors. */
static double off_by(const room *r, uint32_t samples) {
    estimate e = seen(r, 0, samples);
    double expected = wall_radiance(r), sum, error;
    if (!isnan(expected)) {
        sum = e.mean[0] / expected;
        error = e.error[0] / expected;
    } else {
        /* irradiance pi L / rho, of which the walls take 1 - rho, over 4 pi, of 4 pi watts */
        double per_radiance = PI / r->reflectance * (1 - r->reflectance);
        estimate fog = seen(r, 1, samples);
        sum = e.mean[0] * per_radiance + fog.mean[0];
        error = hypot(e.error[0] * per_radiance, fog.error[0]);
    }
    double off = fmax(fabs(sum - 1) - FLOAT_ERROR - BEFORE_WALL * (1 + r->sigma), 0) / error;
    print_message("%-58s %.6f, standard error %.1e: %.2f\n", r->name, sum, error, off);
    if (!(error < 0.01))
        fail_msg("%s: a standard error of %.2g says too little", r->name, error);
    return off;
}

static void what_is_absorbed_is_what_was_sent_out(void **state) {
    static const room rooms[] = {
        {"no fog, rho 0.5", 0.5, 0, 0, 0, CENTRE},
        {"no fog, rho 0.9", 0.9, 0, 0, 0, CENTRE},
        {"no fog, rho 0.5, the lamp aside", 0.5, 0, 0, 0, ASIDE},
        {"no fog, rho 0.7, a black ball that glows", 0.7, 0, 0, 0, BLACK_BALL},
        {"no fog, rho 0.7, a white ball that glows", 0.7, 0, 0, 0, WHITE_BALL},
        {"white fog 3, g 0.7, rho 0.5, a white ball that glows", 0.5, 3, 1, 0.7, WHITE_BALL},
        {"white fog 3, g -0.4, rho 0.5, around a pocket", 0.5, 3, 1, -0.4, POCKET},
        {"grey fog 2, albedo 0.9, g 0.6, rho 0.5, around a pocket", 0.5, 2, 0.9, 0.6, POCKET},
    };
    double worst = -1;
    const char *where = "";
    (void)state;
    NEEDS_DEVICE();
    for (size_t i = 0; i < sizeof rooms / sizeof rooms[0]; i++) {
        double off = off_by(&rooms[i], rooms[i].sigma > 0 ? 512 : 256);
        if (off > worst) {
            worst = off;
            where = rooms[i].name;
        }
    }
    stability_row("furnace", "a closed room absorbs what its lamp sends out",
                  "closed forms of the sphere; reciprocity in grey fog", "standard errors", MOST_ERRORS, worst,
                  "%s", where);
}

static void planted_errors_are_noticed(void **state) {
    static const struct { const char *file, *right, *wrong; room room; } plants[] = {
        {"bsdf_diffuse.h", "s.weight = cselect(front, b->reflectance,",
         "s.weight = cselect(front, cscale(b->reflectance, R(0.98)),",
         {"2 % too little reflected", 0.8, 0, 0, 0, CENTRE}},
        {"medium.h", "cselect(f.scatters, m->albedo, cgrey(R(1)))", "cselect(f.scatters, m->albedo, cgrey(R(1.02)))",
         {"2 % too much after no event", 0.5, 3, 1, 0.7, WHITE_BALL}},
    };
    (void)state;
    NEEDS_DEVICE();
    for (size_t i = 0; i < sizeof plants / sizeof plants[0]; i++) {
        planted_bug(plants[i].file, plants[i].right, plants[i].wrong);
        double wrong = off_by(&plants[i].room, 512);
        planted_remove();
        if (!(wrong > MOST_ERRORS))
            fail_msg("%s was not noticed", plants[i].wrong);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_is_absorbed_is_what_was_sent_out),
        cmocka_unit_test(planted_errors_are_noticed),
    };
    return cmocka_run_group_tests(tests, open_device, close_device);
}

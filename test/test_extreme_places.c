/* test_extreme_places.c -- lamps in odd places (at the camera, on its ray, on a surface, in a ball, in another medium)
 * and walls of any size, without noise: against reflectance / pi * intensity * cosine / distance^2, in fog against
 * integrals along the ray.
 */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>

#include <math.h>

#include "known_answer.h"
#include "planted.h"
#include "stability.h"

#define REFLECTANCE 0.75
#define TOLERANCE 1e-5

static brume_scene *wall_scene(double camera_z, double angle, double half_size) {
    view v = along_z;
    brume_scene *scene = new_scene(2, 4);
    v.origin[2] = camera_z;
    v.forward[0] = 0.6 * sin(angle);
    v.forward[1] = 0.8 * sin(angle);
    v.forward[2] = cos(angle);
    set_camera(scene, &v, BRUME_NONE);
    add_wall(scene, 2, half_size, REFLECTANCE);
    return scene;
}

static double look(brume_scene *scene) {
    brume_render_desc desc = brume_render_desc_default();
    desc.guides = 0;
    desc.generic = 1; /* one program for all */
    estimate e = render_as(scene, &desc);
    brume_scene_destroy(scene);
    return e.mean[1];
}

static void hold(const char *name, double mean, double cosine, double distance, double factor) {
    double right = factor * REFLECTANCE / PI * cosine / (distance * distance);
    stability_row("extreme", name, "closed form", "relative", TOLERANCE, fabs(mean / right - 1), "%.7g", mean);
}

/* What a ray hits of the wall, 2 to 100 units away, told from where a lamp stands with the camera. */
static double wall_off_by(double half_size, double angle) {
    brume_scene *scene = wall_scene(0, angle, half_size);
    add_point(scene, 0, 0, 0);
    return fabs(look(scene) / (REFLECTANCE / PI * pow(cos(angle), 3) / 4) - 1);
}

static void lamp_at_the_camera_before_walls_of_any_size(void **state) {
    static const double sizes[] = {1e3, 1e6, 1e8}, degrees[] = {0, 30, 60, 88};
    (void)state;
    NEEDS_DEVICE();
    for (int i = 0; i < 12; i++) {
        /* Triangles up to 65536 times as large as they are far: places and distances are off by a float's step of the
         * triangle, and light falls with the fourth power of them here. Of larger ones both are exact. */
        double angle = degrees[i % 4] * (PI / 180), ratio = 2 * sizes[i / 4] * cos(angle) / 2;
        double bound = TOLERANCE + (ratio < 0x1p16 ? 4 * ratio * 0x1p-24 : 0);
        stability_row("extreme", "a wall lit from the camera", "closed form", "relative", bound,
                      wall_off_by(sizes[i / 4], angle), "half size %g, at %g degrees", sizes[i / 4], degrees[i % 4]);
    }
    planted_bug("geometry.h", "(size > LARGE_TRIANGLE * from)", "(size > R(1e30) * from)");
    double wrong = wall_off_by(1e8, PI / 6);
    planted_remove();
    print_message("weights as they are: off by %.2e\n", wrong);
    assert_true(wrong > TOLERANCE);
}

/* A ball of radius 1 on a plain of 1e8 units, and what one ray straight down sees of the plain: the point in which the
 * line from the lamp ends that passes the ball's centre at a distance of 1 + by. */
static double ball_on_a_plain(double by, double *lit) {
    const double lamp_x = -3, lamp_height = 4, away = hypot(lamp_x, lamp_height - 1);
    const double down = atan2(lamp_height - 1, -lamp_x) - asin((1 + by) / away), x = lamp_x + lamp_height / tan(down);
    view v = along_z;
    brume_scene *scene = new_scene(2, 4);
    brume_shape_desc ball = brume_shape_desc_default(BRUME_SHAPE_SPHERE);
    v.origin[0] = x;
    v.origin[2] = -3;
    set_camera(scene, &v, BRUME_NONE);
    add_wall(scene, 0, 1e8, REFLECTANCE);
    ball.center[2] = -1;
    must(brume_scene_add_shape(scene, &ball, NULL));
    add_point(scene, lamp_x, 0, -lamp_height);
    double far = hypot(x - lamp_x, lamp_height);
    *lit = REFLECTANCE / PI * lamp_height / (far * far * far);
    return look(scene);
}

static void shadow_on_a_plain(void **state) {
    double lit, beside, within;
    (void)state;
    NEEDS_DEVICE();
    beside = ball_on_a_plain(1e-5, &lit);
    stability_row("extreme", "beside a ball's shadow on a plain of 1e8 units", "closed form", "relative", TOLERANCE,
                  fabs(beside / lit - 1), "1e-5 off the silhouette");
    within = ball_on_a_plain(-1e-5, &lit);
    stability_row("extreme", "in a ball's shadow on a plain of 1e8 units", "nothing", "radiance", 0, within,
                  "1e-5 within the silhouette");
    planted_bug("geometry.h", "(size > LARGE_TRIANGLE * from)", "(size > R(1e30) * from)");
    double wrong = fabs(ball_on_a_plain(1e-5, &lit) / lit - 1);
    planted_remove();
    print_message("weights as they are: off by %.2e\n", wrong);
    assert_true(wrong > TOLERANCE);
}

static void lamp_on_a_surface(void **state) {
    brume_scene *scene;
    (void)state;
    NEEDS_DEVICE();
    scene = wall_scene(1, 0, 3);
    add_wall(scene, 0, 1, 0.5);
    add_point(scene, 0.5, 0, 0);
    hold("lamp on a surface", look(scene), 2 / sqrt(4.25), sqrt(4.25), 1);
}

static void lamp_in_a_ball(void **state) {
    brume_shape_desc ball = brume_shape_desc_default(BRUME_SHAPE_SPHERE);
    brume_scene *scene;
    (void)state;
    NEEDS_DEVICE();
    scene = wall_scene(1, 0, 3);
    ball.radius = 0.5f;
    must(brume_scene_add_shape(scene, &ball, NULL));
    add_point(scene, 0.125, 0, 0);
    stability_row("extreme", "lamp in a closed ball", "nothing comes out", "radiance", 0, look(scene), "outside");
}

static void lamp_in_another_medium(void **state) {
    brume_scene *scene;
    (void)state;
    NEEDS_DEVICE();
    scene = wall_scene(0, 0, 3);
    add_null_box(scene, add_medium(scene, 0.75, 0.5, 0, 0), 1, 1, -4, -2);
    add_point(scene, 0, 0, -3);
    hold("lamp in another medium", look(scene), 1, 5, exp(-0.75));
}

/* Fog that scatters once only: it is seen from near_clip on. In this much of it, 1e-12 per unit, nothing is attenuated,
 * and rays of light, which start at the camera, have 1e21 times the length of their distance from its ray. */
#define THIN 1e-12f
#define NEAR 0.01f

static estimate fog_around_the_camera(uint64_t *bad) {
    brume_scene *scene = new_scene(6, 16);
    brume_sensor_desc sensor = brume_sensor_desc_default();
    brume_render_desc desc = climb(BRUME_STRATEGY_AUTO, 16);
    brume_render *render;
    brume_render_stats stats;
    float pixels[PIXELS * PIXELS * 3];
    view_matrix(&along_z, sensor.to_world);
    sensor.fov = NARROW;
    sensor.near_clip = NEAR;
    sensor.far_clip = 1e16f;
    sensor.medium = add_medium(scene, THIN, 0.5, 0, 0);
    must(brume_scene_set_sensor(scene, &sensor));
    add_point(scene, 0, 0, 0);
    must(brume_render_create(device, scene, &desc, &render));
    must(brume_render_run(render, NULL, NULL));
    must(brume_render_read(render, BRUME_CHANNEL_RADIANCE, pixels, PIXELS * PIXELS * 3));
    must(brume_render_get_stats(render, &stats));
    *bad = stats.bad_samples;
    brume_render_destroy(render);
    brume_scene_destroy(scene);
    return estimate_of(pixels);
}

static void lamp_at_the_camera_in_the_thinnest_fog(void **state) {
    const double right = 0.5 * THIN / (4 * PI) / NEAR;
    uint64_t bad;
    (void)state;
    NEEDS_DEVICE();
    estimate e = fog_around_the_camera(&bad);
    stability_row("extreme", "lamp at the camera, in fog of 1e-12", "closed form", "standard errors", 5,
                  bad ? (double)INFINITY : fmax(fabs(e.mean[1] - right) - TOLERANCE * right, 0) / e.error[1], "%.7g",
                  e.mean[1]);
    assert_true(e.error[1] < 0.01 * right);
    planted_bug("path_indirect.h", "a > R(1e18)", "a > R(1e38)");
    fog_around_the_camera(&bad);
    planted_remove();
    print_message("with squares beyond a float's range: %u samples lost\n", (unsigned)bad);
    assert_true(bad > 0);
}

/* sigma / (4 pi) e^sigma (E2(2 sigma) - E2(6 sigma) / 3) for albedo 1: the lamp stands a unit behind the camera, the
 * wall two before it. By quadrature in 20 digits. */
static void lamp_on_the_ray(void **state) {
    const view v = along_z;
    brume_scene *scene = new_scene(2, 64);
    const double right = 0.00950867936371;
    (void)state;
    NEEDS_DEVICE();
    set_camera(scene, &v, add_medium(scene, 0.5, 1, 0, 0));
    add_point(scene, 0, 0, -1);
    add_wall(scene, 2, 1, 0);
    estimate e = render(scene);
    stability_row("extreme", "lamp on the ray, behind the camera", "integral in 20 digits", "standard errors", 5,
                  fmax(fabs(e.mean[1] - right) - TOLERANCE * right, 0) / e.error[1], "%.7g", e.mean[1]);
    assert_true(e.error[1] < 1e-3 * right);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(lamp_at_the_camera_before_walls_of_any_size),
        cmocka_unit_test(shadow_on_a_plain),
        cmocka_unit_test(lamp_on_a_surface),
        cmocka_unit_test(lamp_in_a_ball),
        cmocka_unit_test(lamp_in_another_medium),
        cmocka_unit_test(lamp_at_the_camera_in_the_thinnest_fog),
        cmocka_unit_test(lamp_on_the_ray),
    };
    return cmocka_run_group_tests(tests, open_device, close_device);
}

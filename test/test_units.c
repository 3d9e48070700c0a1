/* test_units.c -- one scene file in metres, the same in other units of length: the same picture.
 *
 * What the author of a file converts: lengths, extinction and the fog's own light by their inverse, powers of point and
 * spot lamps (watts per steradian give radiance by the square of a distance) by their square; radiance and irradiance
 * stay. Rounding is another, so pictures are the same within their noise (same_picture.h). Each of these that is
 * forgotten must be noticed.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include <cmocka.h>

#include "same_picture.h"
#include "scene_files.h"
#include "stability.h"

/* By what each kind of number is multiplied. */
typedef struct units {
    double length, radius, lens, extinction, glow, power;
} units;

static units units_of(double per_metre) {
    units u = {per_metre, per_metre, per_metre, 1 / per_metre, 1 / per_metre, per_metre * per_metre};
    return u;
}

static const char text[] = SCENE(
    "<integrator type=\"volpath\"><integer name=\"max_depth\" value=\"4\"/></integrator>\n"
    "<medium type=\"homogeneous\" id=\"fog\">\n"
    "  <float name=\"sigma_t\" value=\"0.11\"/><float name=\"scale\" value=\"%.9g\"/>\n"
    "  <rgb name=\"albedo\" value=\"0.8, 0.7, 0.9\"/><rgb name=\"emission\" value=\"%.9g\"/>\n"
    "  <phase type=\"hg\"><float name=\"g\" value=\"0.6\"/></phase>\n"
    "</medium>\n"
    "<sensor type=\"thinlens\">\n"
    "  <float name=\"fov\" value=\"50\"/><float name=\"near_clip\" value=\"%.9g\"/>\n"
    "  <float name=\"far_clip\" value=\"%.9g\"/><float name=\"aperture_radius\" value=\"%.9g\"/>\n"
    "  <float name=\"focus_distance\" value=\"%.9g\"/>\n"
    "  <transform name=\"to_world\"><translate x=\"%.9g\" y=\"%.9g\" z=\"%.9g\"/></transform>\n"
    "  <ref id=\"fog\"/>\n"
    "  <sampler type=\"independent\"><integer name=\"sample_count\" value=\"256\"/></sampler>\n"
    "  <film type=\"hdrfilm\"><integer name=\"width\" value=\"16\"/><integer name=\"height\" value=\"16\"/>\n"
    "    <rfilter type=\"box\"/></film>\n"
    "</sensor>\n"
    "<emitter type=\"point\"><point name=\"position\" x=\"%.9g\" y=\"%.9g\" z=\"%.9g\"/>\n"
    "  <rgb name=\"intensity\" value=\"%.9g\"/></emitter>\n"
    "<emitter type=\"spot\"><transform name=\"to_world\">\n"
    "  <lookat origin=\"%.9g, %.9g, %.9g\" target=\"%.9g, %.9g, %.9g\" up=\"1, 0, 0\"/></transform>\n"
    "  <rgb name=\"intensity\" value=\"%.9g\"/><float name=\"cutoff_angle\" value=\"20\"/></emitter>\n"
    "<shape type=\"sphere\"><point name=\"center\" x=\"%.9g\" y=\"%.9g\" z=\"%.9g\"/>\n"
    "  <float name=\"radius\" value=\"%.9g\"/></shape>\n"
    "<shape type=\"rectangle\"><transform name=\"to_world\">\n"
    "  <rotate x=\"1\" angle=\"-90\"/><scale value=\"%.9g\"/><translate x=\"%.9g\" y=\"%.9g\" z=\"%.9g\"/>\n"
    "  </transform></shape>\n"
    "<shape type=\"rectangle\"><transform name=\"to_world\">\n"
    "  <rotate x=\"1\" angle=\"90\"/><scale value=\"%.9g\"/><translate x=\"%.9g\" y=\"%.9g\" z=\"%.9g\"/>\n"
    "  </transform><emitter type=\"area\"><rgb name=\"radiance\" value=\"2\"/></emitter></shape>\n");

static void see(const units *u, picture *out) {
    static char file[sizeof text + 1024];
    const double m = u->length;
    brume_scene *scene = NULL;
    int size = snprintf(file, sizeof file, text, u->extinction, 0.01 * u->glow, 0.05 * m, 100 * m, 0.75 * u->lens,
                        1.5 * m, 0.3 * m, 1.7 * m, -2.0 * m, -2.2 * m, 2.3 * m, 3.1 * m, 11 * u->power, 1.9 * m,
                        3.4 * m, 1.3 * m, 0.2 * m, 0.1 * m, 3.3 * m, 90 * u->power, 0.4 * m, 0.9 * m, 2.6 * m, 0.8 * u->radius,
                        6 * m, 0.1 * m, 0.0, 3 * m, 0.7 * m, -1.1 * m, 3.9 * m, 4.2 * m);
    assert_true(size > 0 && size < (int)sizeof file);
    if (scene_files_load(context, file, &scene) != BRUME_OK) fail_msg("%s", brume_context_message(context));
    picture_render(scene, out);
}

static void a_scene_in_other_units(void **state) {
    static const struct { const char *name; double per_metre; } cases[] = {
        {"a scene in millimetres", 1000}, {"a scene in inches", 1 / 0.0254}, {"a scene in kilometres", 1e-3}};
    static picture metres, other;
    const units plain = units_of(1);
    (void)state;
    NEEDS_DEVICE();
    see(&plain, &metres);
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        const units told = units_of(cases[i].per_metre);
        see(&told, &other);
        stability_row("invariance", cases[i].name, "the same in metres", "standard errors", PICTURE_MOST_ERRORS,
                      picture_errors_apart(&metres, &other), "%d of %d values have other bits",
                      picture_differing(&metres, &other, 1), PICTURE_VALUES);
    }
}

static void what_is_not_converted_is_noticed(void **state) {
    static const char *const names[] = {"radius", "lens", "extinction", "glow", "power"};
    static picture metres, other;
    const units plain = units_of(1);
    (void)state;
    NEEDS_DEVICE();
    see(&plain, &metres);
    for (int i = 0; i < 5; i++) {
        units told = units_of(3);
        *(&told.radius + i) = 1;
        see(&told, &other);
        double apart = picture_errors_apart(&metres, &other);
        print_message("%s as it was: %.1f standard errors\n", names[i], apart);
        if (!(apart > PICTURE_MOST_ERRORS)) fail_msg("%s as it was is not noticed", names[i]);
    }
}

static int setup(void **state) { return open_device(state) != 0 ? -1 : scene_files_enter(state); }

static int teardown(void **state) {
    int left = scene_files_leave(state);
    return close_device(state) != 0 ? -1 : left;
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_scene_in_other_units),
        cmocka_unit_test(what_is_not_converted_is_noticed),
    };
    return cmocka_run_group_tests(tests, setup, teardown);
}

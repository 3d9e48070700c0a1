/* test_reference.c -- whole renders against values known from elsewhere: light that scatters once, absorption and
 * emission in fog, spots on a wall. Closed forms, and quadrature in double that shares nothing with the kernels. How
 * the checks work: known_answer.h; check_plants proves that a wrong factor of 2 % would be seen.
 *
 * Airlight of a point light: Sun, Ramamoorthi, Narasimhan & Nayar 2005, "A Practical Analytic Single Scattering Model".
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

/* ---- quadrature -------------------------------------------------------------------------------------------------- */

typedef double (*integrand)(double x, const double *parameters);

static double simpson_step(integrand f, const double *p, double a, double fa, double m, double fm, double b, double fb,
                           double whole, double tolerance, int depth) {
    double l = (a + m) / 2, r = (m + b) / 2, fl = f(l, p), fr = f(r, p);
    double left = (m - a) / 6 * (fa + 4 * fl + fm), right = (b - m) / 6 * (fm + 4 * fr + fb);
    double rest = left + right - whole;
    if (depth <= 0 || fabs(rest) <= 15 * tolerance)
        return left + right + rest / 15;
    return simpson_step(f, p, a, fa, l, fl, m, fm, left, tolerance / 2, depth - 1) +
           simpson_step(f, p, m, fm, r, fr, b, fb, right, tolerance / 2, depth - 1);
}

static double integrate(integrand f, const double *p, double a, double b) {
    const int pieces = 64;
    double sum = 0;
    for (int i = 0; i < pieces; i++) {
        double x0 = a + (b - a) * i / pieces, x1 = a + (b - a) * (i + 1) / pieces, m = (x0 + x1) / 2;
        double f0 = f(x0, p), fm = f(m, p), f1 = f(x1, p);
        sum += simpson_step(f, p, x0, f0, m, fm, x1, f1, (x1 - x0) / 6 * (f0 + 4 * fm + f1), 1e-16, 30);
    }
    return sum;
}

static double henyey_greenstein(double cosine, double g) {
    double d = 1 + g * g - 2 * g * cosine;
    return (1 - g * g) / (4 * PI * d * sqrt(d));
}

/* parameters: sigma, D, g, camera t. Scattered to the camera at t of a line that passes the light at distance D. */
static double airlight_at(double t, const double *p) {
    double r = sqrt(p[1] * p[1] + t * t);
    /* light travels along (t, -D) / r and leaves along -t */
    return p[0] * exp(-p[0] * (t - p[3] + r)) / (r * r) * henyey_greenstein(-t / r, p[2]);
}

/* parameters: sigma, height, g, camera x, cutoff, beam (radians). The spot is at the origin and shines along +z; the
 * ray runs along +x at that height. */
static double spot_at(double x, const double *p) {
    double r = sqrt(p[1] * p[1] + x * x), angle = atan2(fabs(x), p[1]);
    double falloff = angle <= p[5] ? 1 : angle >= p[4] ? 0 : (p[4] - angle) / (p[4] - p[5]);
    return falloff * p[0] * exp(-p[0] * (x - p[3] + r)) / (r * r) * henyey_greenstein(-x / r, p[2]);
}

/* ---- single scattering ------------------------------------------------------------------------------------------- */

static estimate render_airlight(double sigma, double g, double distance, double a, double b) {
    view v = along_z;
    brume_scene *scene;
    v.origin[2] = a;
    scene = new_scene(2, 1024);
    set_camera(scene, &v, add_medium(scene, sigma, 1, g, 0));
    add_point(scene, distance, 0, 0);
    if (b < 1e6)
        add_wall(scene, b, 1, 0);
    return render(scene);
}

/* The values are of 20-digit quadrature; the one written here must find them too. */
static void airlight_of_a_point_light(void **state) {
    static const struct { double g, b, expected; } cases[] = {
        {0, 3, 0.018742118921}, {0.5, 3, 0.0215424090764}, {0.9, 3, 0.00620507892948},
        {-0.5, 3, 0.0122907614359}, {0, 1e9, 0.018787040858}};
    (void)state;
    NEEDS_DEVICE();
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        double p[4] = {0.5, 1, cases[i].g, -2};
        char name[96];
        estimate e = render_airlight(0.5, cases[i].g, 1, -2, cases[i].b);
        assert_true(fabs(integrate(airlight_at, p, -2, fmin(cases[i].b, 60)) / cases[i].expected - 1) < 1e-9);
        snprintf(name, sizeof name, "airlight g = %g, b = %g", cases[i].g, cases[i].b);
        check(name, &e, 0, cases[i].expected, 0.01);
    }
}

static void airlight_of_thin_fog(void **state) {
    estimate e;
    (void)state;
    NEEDS_DEVICE();
    e = render_airlight(1e-6, 0, 1, -2, 3);
    check("airlight sigma = 1e-6", &e, 1, 1.874993e-7, 0.005);
}

/* From 1 to 3 units of a light that lies on the ray, behind the camera:
 * sigma/(4 pi) e^sigma (E2(2 sigma) - E2(6 sigma)/3). */
static void airlight_of_a_light_on_the_ray(void **state) {
    estimate e;
    (void)state;
    NEEDS_DEVICE();
    e = render_airlight(0.5, 0, 0, 1, 3);
    check("airlight D = 0", &e, 2, 0.00950867936371, 0.01);
}

/* Sums the pieces between the edges of cone and beam, where the integrand has its kinks. */
static double spot_airlight(const double *p, double x0, double x1) {
    double inner = fabs(p[1] * tan(p[5])), outer = fabs(p[1] * tan(p[4]));
    double edges[7] = {x0, -inner, -outer, 0, inner, outer, x1}, sum = 0;
    for (int i = 0; i < 7; i++) {
        edges[i] = fmin(fmax(edges[i], x0), x1);
        for (int j = i; j > 0 && edges[j] < edges[j - 1]; j--) {
            double swap = edges[j];
            edges[j] = edges[j - 1];
            edges[j - 1] = swap;
        }
    }
    for (int i = 0; i < 6; i++)
        sum += integrate(spot_at, p, edges[i], edges[i + 1]);
    return sum;
}

/* Narrow and wide cones: past 90 degrees a ray behind the spot is lit at both ends and dark between. */
static void airlight_of_a_spot(void **state) {
    static const struct { double sigma, g, height, cutoff, beam; } cases[] = {
        {0.3, 0, 4, 15, 12}, {0.3, 0.5, 4, 15, 12}, {0.3, 0.9, 4, 15, 12}, {2, 0, 4, 15, 12}, {0.3, 0, 4, 15, 15},
        {0.3, 0, 4, 0.5, 0.4}, {0.2, 0.5, 1, 90, 20}, {0.2, 0.5, -1, 120, 100}, {0.2, -0.5, 1, 120, 100},
        {0.2, 0, -0.5, 170, 150}};
    const double degree = PI / 180;
    (void)state;
    NEEDS_DEVICE();
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        double p[6] = {cases[i].sigma, cases[i].height, cases[i].g, -5, cases[i].cutoff * degree,
                       cases[i].beam * degree};
        const view ray = {{-5, 0, cases[i].height}, {1, 0, 0}, {0, 1, 0}, NARROW};
        char name[96];
        estimate e;
        brume_shape_desc wall = brume_shape_desc_default(BRUME_SHAPE_CUBE);
        uint32_t id;
        brume_scene *scene = new_scene(2, 1024);
        set_camera(scene, &ray, add_medium(scene, cases[i].sigma, 1, cases[i].g, 0));
        add_spot(scene, &along_z, 1, cases[i].cutoff, cases[i].beam);
        scale_and_move(wall.to_world, 1, 1, 1, 6, 0, cases[i].height);
        wall.bsdf = add_diffuse(scene, 0);
        must(brume_scene_add_shape(scene, &wall, &id));
        e = render(scene);
        snprintf(name, sizeof name, "spot %g/%g at %g, sigma %g, g %g", cases[i].cutoff, cases[i].beam, cases[i].height,
                 cases[i].sigma, cases[i].g);
        check(name, &e, 0, spot_airlight(p, -5, 5), 0.01);
    }
}

/* ---- absorption and emission ------------------------------------------------------------------------------------- */

/* Camera, slab of absorbing medium, light: L exp(-sigma d) in each channel, also without a medium. */
static void absorbing_slab(void **state) {
    static const float sigma[3] = {0, 0.7f, 4};
    const double radiance = 3, thickness = 1.5;
    estimate e;
    uint32_t id, medium;
    brume_medium_desc absorber = brume_medium_desc_default();
    brume_shape_desc lamp = brume_shape_desc_default(BRUME_SHAPE_RECTANGLE);
    brume_scene *scene;
    (void)state;
    NEEDS_DEVICE();
    scene = new_scene(DEPTH_ANY, 256);
    set_camera(scene, &along_z, BRUME_NONE);
    memcpy(absorber.sigma_t, sigma, sizeof sigma);
    set_all(absorber.albedo, 0);
    must(brume_scene_add_medium(scene, &absorber, &medium));
    add_null_box(scene, medium, 1, 1, 1, 1 + thickness);
    scale_and_move(lamp.to_world, 1, 1, -1, 0, 0, 4); /* faces the camera */
    lamp.to_world[0] = -1;
    set_all(lamp.radiance, radiance);
    must(brume_scene_add_shape(scene, &lamp, &id));
    e = render(scene);
    check("absorbing slab, sigma = 0", &e, 0, radiance, 0.02);
    check("absorbing slab, sigma = 0.7", &e, 1, radiance * exp(-(double)sigma[1] * thickness), 0.02);
    check("absorbing slab, sigma = 4", &e, 2, radiance * exp(-(double)sigma[2] * thickness), 0.05);
}

/* epsilon / sigma (1 - exp(-sigma d)) before a black wall; and in a box, seen from outside. */
static void emitting_slab(void **state) {
    const double expected = 1.755087143; /* 2 (1 - e^-2.1) */
    estimate e;
    brume_scene *scene;
    (void)state;
    NEEDS_DEVICE();
    scene = new_scene(2, 1024);
    set_camera(scene, &along_z, add_medium(scene, 0.7, 0, 0, 2 * 0.7));
    add_wall(scene, 3, 1, 0);
    e = render(scene);
    check("emitting slab, camera inside", &e, 0, expected, 0.01);

    scene = new_scene(2, 1024);
    set_camera(scene, &along_z, BRUME_NONE);
    add_null_box(scene, add_medium(scene, 0.7, 0, 0, 2 * 0.7), 1, 1, 2, 5);
    e = render(scene);
    check("emitting slab in a box", &e, 0, expected, 0.01);

    scene = new_scene(2, 1024);
    set_camera(scene, &along_z, add_medium(scene, 1e-7, 0, 0, 1e-7));
    add_wall(scene, 1, 1, 0);
    e = render(scene);
    check("emitting slab, sigma d = 1e-7", &e, 0, 9.9999995e-8, 0.01);
}

/* ---- delta lights on a wall -------------------------------------------------------------------------------------- */

/* The camera stands with the spot and looks at a wall 2 units ahead, more and more aside: reflectance / pi * I *
 * falloff(angle) * cos(angle) / distance^2, linear in the angle between the beam and the cutoff. */
static void spot_on_a_wall(void **state) {
    static const double angles[] = {0, 5, 11.9, 12.5, 14, 18, 19, 20.1};
    const double cutoff = 20, beam = 12, reflectance = 0.6, intensity = 7;
    (void)state;
    NEEDS_DEVICE();
    for (size_t i = 0; i < sizeof angles / sizeof angles[0]; i++) {
        double angle = angles[i] * PI / 180, cosine = cos(angle);
        double falloff = angles[i] <= beam ? 1 : angles[i] >= cutoff ? 0 : (cutoff - angles[i]) / (cutoff - beam);
        double expected = reflectance / PI * intensity * falloff * cosine * cosine * cosine / 4;
        view v = along_z;
        estimate e;
        char name[96];
        brume_scene *scene;
        v.forward[0] = sin(angle) * 0.6;
        v.forward[1] = sin(angle) * 0.8;
        v.forward[2] = cosine;
        scene = new_scene(2, 4);
        set_camera(scene, &v, BRUME_NONE);
        add_spot(scene, &along_z, intensity, cutoff, beam);
        add_wall(scene, 2, 2, reflectance);
        e = render(scene);
        snprintf(name, sizeof name, "spot on a wall at %g degrees", angles[i]);
        if (expected > 0)
            check(name, &e, 0, expected, 1e-4);
        else
            assert_true(e.mean[0] == 0);
    }
}

/* ---- the checks themselves --------------------------------------------------------------------------------------- */

/* A renderer with 2 % too much light, or without the 1/(4 pi) of the phase function, would be found out. */
static void check_plants(void **state) {
    const double expected = 0.018742118921;
    estimate e;
    (void)state;
    NEEDS_DEVICE();
    e = render_airlight(0.5, 0, 1, -2, 3);
    assert_true(agrees(e.mean[0], e.error[0], expected));
    assert_false(agrees(e.mean[0], e.error[0], expected / 1.02));
    assert_false(agrees(e.mean[0], e.error[0], expected * 1.02));
    assert_false(agrees(e.mean[0], e.error[0], expected * 4 * PI));
    assert_false(agrees(e.mean[0], e.error[0], 0));
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(spot_on_a_wall),
        cmocka_unit_test(airlight_of_a_point_light),
        cmocka_unit_test(airlight_of_thin_fog),
        cmocka_unit_test(airlight_of_a_light_on_the_ray),
        cmocka_unit_test(airlight_of_a_spot),
        cmocka_unit_test(absorbing_slab),
        cmocka_unit_test(emitting_slab),
        cmocka_unit_test(check_plants),
    };
    return cmocka_run_group_tests(tests, open_device, close_device);
}

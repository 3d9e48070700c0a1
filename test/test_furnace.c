/* test_furnace.c -- whole renders of multiple scattering against values known from elsewhere: furnaces, where the
 * radiance is the same everywhere whatever is inside, and plane slabs. How the checks work: known_answer.h.
 *
 * Chandrasekhar 1950, Radiative Transfer (H functions, isotropic slabs); van de Hulst 1980, Multiple Light Scattering.
 */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "known_answer.h"
#include "stability.h"

/* Of some checks the one that is furthest off. */
typedef struct worst {
    double off;
    char where[96];
} worst;

static void check_and_note(worst *w, const char *name, const estimate *e, double expected, double precision) {
    check(name, e, 0, expected, precision);
    double off = errors_off(e->mean[0], e->error[0], expected);
    if (off < w->off) return;
    w->off = off;
    snprintf(w->where, sizeof w->where, "%s", name);
}

static void report(const worst *w, const char *name, const char *reference) {
    stability_row("furnace", name, reference, "standard errors", ERRORS_ALLOWED, w->off, "%s", w->where);
}

/* ---- furnaces: the same radiance everywhere ---------------------------------------------------------------------- */

static void medium_furnace(void **state) {
    static const struct { double sigma, albedo, g, reflectance; } cases[] = {
        {0.5, 0, 0, 0}, {1, 0.7, 0, 0.5}, {2, 0.9, 0.9, 0.3}, {1, 0.8, -0.6, 0.8}};
    const double radiance = 2.5;
    worst w = {0, ""};
    (void)state;
    NEEDS_DEVICE();
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        view v = along_z;
        char name[96];
        uint32_t id;
        estimate e;
        brume_scene *scene;
        brume_shape_desc wall = brume_shape_desc_default(i % 2 ? BRUME_SHAPE_SPHERE : BRUME_SHAPE_CUBE);
        v.fov = 80;
        v.origin[2] = -0.4;
        scene = new_scene(DEPTH_ANY, 256);
        set_camera(scene, &v, add_medium(scene, cases[i].sigma, cases[i].albedo, cases[i].g,
                                         radiance * cases[i].sigma * (1 - cases[i].albedo)));
        wall.flip_normals = 1;
        wall.bsdf = add_diffuse(scene, cases[i].reflectance);
        set_all(wall.radiance, radiance * (1 - cases[i].reflectance));
        must(brume_scene_add_shape(scene, &wall, &id));
        e = render(scene);
        snprintf(name, sizeof name, "furnace sigma %g albedo %g g %g wall %g", cases[i].sigma, cases[i].albedo,
                 cases[i].g, cases[i].reflectance);
        check_and_note(&w, name, &e, radiance, 0.01);
    }
    report(&w, "fog between walls of one radiance", "that radiance");
}

/* A medium without absorption in the midst of uniform light can't be seen, nor can white or perfectly clear things. */
static void white_things_in_uniform_light(void **state) {
    static const char *const names[] = {"white diffuse ball", "mirror ball", "glass ball", "white cloud",
                                        "white cloud in glass"};
    worst w = {0, ""};
    (void)state;
    NEEDS_DEVICE();
    for (int i = 0; i < 5; i++) {
        view v = along_z;
        estimate e;
        uint32_t id;
        brume_scene *scene;
        brume_shape_desc ball = brume_shape_desc_default(BRUME_SHAPE_SPHERE);
        brume_bsdf_desc bsdf = brume_bsdf_desc_default(i == 0 ? BRUME_BSDF_DIFFUSE : i == 1 ? BRUME_BSDF_CONDUCTOR
                                                       : i == 3 ? BRUME_BSDF_NULL : BRUME_BSDF_DIELECTRIC);
        v.fov = 40;
        v.origin[2] = -3;
        scene = new_scene(DEPTH_ANY, 256);
        /* These paths end by leaving. Roulette would end one in a million early and weigh the others up for it: an
         * error too rare to be seen in the spread of the samples, and larger than that spread. */
        brume_integrator_desc integrator;
        must(brume_scene_get_integrator(scene, &integrator));
        integrator.rr_depth = 1 << 20;
        must(brume_scene_set_integrator(scene, &integrator));
        set_camera(scene, &v, BRUME_NONE);
        if (i == 0)
            set_all(bsdf.reflectance, 1);
        must(brume_scene_add_bsdf(scene, &bsdf, &ball.bsdf));
        if (i >= 3) {
            ball.interior = add_medium(scene, 2, 1, 0.6, 0);
            ball.is_boundary = 1;
        }
        must(brume_scene_add_shape(scene, &ball, &id));
        add_constant(scene, 0.75);
        e = render(scene);
        check_and_note(&w, names[i], &e, 0.75, 0.01);
    }
    report(&w, "white and clear things under a white sky", "the sky's radiance");
}

/* ---- slabs ------------------------------------------------------------------------------------------------------- */

/* By reciprocity, a slab in uniform light from one half space shows at normal incidence its reflectance R on the lit
 * side and its transmittance T on the other, for light at normal incidence. The half space is an envmap, white above
 * and black below, fine enough that the blurred row at the horizon holds no light that matters (cos < 0.002). The slab
 * is 4000 thicknesses wide. */
static estimate render_slab(double albedo, double g, double thickness, int from_below, uint32_t samples) {
    enum { ROWS = 1024, COLUMNS = 4 };
    const view above = {{0, 3, 0}, {0, -1, 0}, {0, 0, 1}, NARROW}, below = {{0, -3, 0}, {0, 1, 0}, {0, 0, 1}, NARROW};
    float *texels = calloc(ROWS * COLUMNS * 3, sizeof texels[0]);
    brume_light_desc sky = brume_light_desc_default(BRUME_LIGHT_ENVMAP);
    brume_shape_desc slab = brume_shape_desc_default(BRUME_SHAPE_CUBE);
    brume_bsdf_desc null = brume_bsdf_desc_default(BRUME_BSDF_NULL);
    uint32_t id;
    brume_scene *scene = new_scene(DEPTH_ANY, samples);
    set_camera(scene, from_below ? &below : &above, BRUME_NONE);
    assert_non_null(texels);
    if (albedo == 1) {
        /* Roulette that ends 5 % of the paths at every event has no finite variance where fewer leave the slab. */
        brume_integrator_desc integrator;
        must(brume_scene_get_integrator(scene, &integrator));
        integrator.rr_depth = 500;
        must(brume_scene_set_integrator(scene, &integrator));
    }
    for (int i = 0; i < ROWS / 2 * COLUMNS * 3; i++)
        texels[i] = 1;
    sky.width = COLUMNS;
    sky.height = ROWS;
    sky.texels = texels;
    must(brume_scene_add_light(scene, &sky, &id));
    free(texels);
    must(brume_scene_add_bsdf(scene, &null, &slab.bsdf));
    slab.interior = add_medium(scene, thickness, albedo, g, 0); /* 1 unit thick */
    slab.is_boundary = 1;
    scale_and_move(slab.to_world, 2000, 0.5, 2000, 0, 0, 0);
    must(brume_scene_add_shape(scene, &slab, &id));
    return render(scene);
}

static void slabs(void **state) {
    static const struct { double albedo, g, thickness, reflectance, transmittance; } cases[] = {
        {1, 0, 1, 0.341329, 0.658671}, {0.9, 0, 1, 0.267410, 0.591625}, {0.9, 0, 2, 0.361649, 0.356501},
        {1, 0, 10, 0.853005, 0.146995}, {0.9, 0.75, 2, 0.09739, 0.66096}};
    worst w = {0, ""};
    (void)state;
    NEEDS_DEVICE();
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        char name[96];
        estimate e = render_slab(cases[i].albedo, cases[i].g, cases[i].thickness, 0, 256);
        snprintf(name, sizeof name, "slab albedo %g g %g thickness %g: R", cases[i].albedo, cases[i].g,
                 cases[i].thickness);
        check_and_note(&w, name, &e, cases[i].reflectance, 0.02);
        e = render_slab(cases[i].albedo, cases[i].g, cases[i].thickness, 1, 256);
        name[strlen(name) - 1] = 'T';
        check_and_note(&w, name, &e, cases[i].transmittance, 0.02);
    }
    report(&w, "slabs of fog, reflectance and transmittance", "Chandrasekhar 1950, van de Hulst 1980");
}

/* 1 - sqrt(1 - albedo) H(1); 60 mean free paths are without end for these. */
static void semi_infinite_medium(void **state) {
    static const struct { double albedo, reflectance; } cases[] = {
        {0.5, 0.115226}, {0.9, 0.414947}, {0.99, 0.752721}};
    worst w = {0, ""};
    (void)state;
    NEEDS_DEVICE();
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        char name[96];
        estimate e = render_slab(cases[i].albedo, 0, 60, 0, 256);
        snprintf(name, sizeof name, "semi-infinite, albedo %g", cases[i].albedo);
        check_and_note(&w, name, &e, cases[i].reflectance, 0.02);
    }
    report(&w, "fog without end, reflectance", "Chandrasekhar 1950");
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(medium_furnace),
        cmocka_unit_test(white_things_in_uniform_light),
        cmocka_unit_test(slabs),
        cmocka_unit_test(semi_infinite_medium),
    };
    return cmocka_run_group_tests(tests, open_device, close_device);
}

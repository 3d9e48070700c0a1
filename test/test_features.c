/* test_features.c -- which code a scene calls for, thing by thing. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "built_arrays.h"

/* One letter adds one thing to a scene that has a sensor only; what an upper case letter adds, nothing refers to.
 * Rectangles: r plain, n of null, g of glass, e emitting, t textured, 2 two-sided with a metal back. Spheres: s plain,
 * i of null with fog inside, z the same with fog that glows. Lights: p point, c constant environment, d textured spot.
 * f puts the sensor into fog, j ignores media. M medium, G glass, T texture. */
static void add_thing(brume_scene *scene, char thing) {
    uint32_t fog, bsdf, texture = BRUME_NONE, ignored;
    brume_medium_desc medium = brume_medium_desc_default();
    brume_texture_desc checker = brume_texture_desc_default();
    brume_shape_desc shape =
        brume_shape_desc_default(strchr("siz", thing) ? BRUME_SHAPE_SPHERE : BRUME_SHAPE_RECTANGLE);
    brume_bsdf_desc desc = brume_bsdf_desc_default(strchr("niz", thing)    ? BRUME_BSDF_NULL
                                                   : strchr("gG", thing)   ? BRUME_BSDF_DIELECTRIC
                                                   : strchr("2", thing)    ? BRUME_BSDF_CONDUCTOR
                                                                           : BRUME_BSDF_DIFFUSE);
    checker.kind = BRUME_TEXTURE_CHECKERBOARD;
    if (thing == 'z')
        medium.emission[0] = 1;
    if (strchr("fizM", thing))
        assert_int_equal(brume_scene_add_medium(scene, &medium, &fog), BRUME_OK);
    if (strchr("tdT", thing))
        assert_int_equal(brume_scene_add_texture(scene, &checker, &texture), BRUME_OK);
    desc.reflectance_texture = thing == 't' ? texture : BRUME_NONE;
    if (strchr("nigGt2z", thing))
        assert_int_equal(brume_scene_add_bsdf(scene, &desc, &bsdf), BRUME_OK);
    if (thing == '2') {
        desc = brume_bsdf_desc_default(BRUME_BSDF_DIFFUSE);
        desc.two_sided = 1;
        desc.back = bsdf;
        assert_int_equal(brume_scene_add_bsdf(scene, &desc, &bsdf), BRUME_OK);
    }
    if (strchr("nigt2z", thing))
        shape.bsdf = bsdf;
    if (strchr("iz", thing))
        shape.interior = fog;
    if (thing == 'e')
        shape.radiance[0] = 1;
    if (strchr("rsngiet2z", thing))
        assert_int_equal(brume_scene_add_shape(scene, &shape, &ignored), BRUME_OK);
    if (strchr("pcd", thing)) {
        brume_light_desc light = brume_light_desc_default(thing == 'p'   ? BRUME_LIGHT_POINT
                                                          : thing == 'c' ? BRUME_LIGHT_CONSTANT
                                                                         : BRUME_LIGHT_SPOT);
        light.texture = thing == 'd' ? texture : BRUME_NONE;
        assert_int_equal(brume_scene_add_light(scene, &light, &ignored), BRUME_OK);
    }
    if (thing == 'f') {
        brume_sensor_desc sensor = brume_sensor_desc_default();
        sensor.medium = fog;
        assert_int_equal(brume_scene_set_sensor(scene, &sensor), BRUME_OK);
    }
    if (thing == 'j') {
        brume_integrator_desc integrator = brume_integrator_desc_default();
        integrator.ignore_media = 1;
        assert_int_equal(brume_scene_set_integrator(scene, &integrator), BRUME_OK);
    }
}

static void test_features(void **state) {
    (void)state;
    static const struct {
        const char *things;
        uint32_t features;
        int surfaces_emit;
    } rows[] = {
#define FOG (FEATURE_MEDIA | FEATURE_SCATTERING | FEATURE_FLIGHTS)
        {"", 0, 0},
        {"r", 0, 0},
        {"rMGT", 0, 0},
        {"s", FEATURE_QUADRICS, 0},
        {"n", FEATURE_NULL, 0},
        {"g", FEATURE_SPECULAR, 0},
        {"2", FEATURE_SPECULAR, 0},
        {"i", FEATURE_NULL | FEATURE_QUADRICS | FOG, 0},
        {"z", FEATURE_NULL | FEATURE_QUADRICS | FOG, 1},
        {"zj", FEATURE_NULL | FEATURE_QUADRICS, 0},
        {"f", FOG, 0},
        {"fj", 0, 0},
        {"e", FEATURE_AREA_LIGHTS, 1},
        {"t", FEATURE_TEXTURES, 0},
        {"p", FEATURE_DELTA_LIGHTS, 0},
        {"d", FEATURE_DELTA_LIGHTS | FEATURE_TEXTURES, 0},
        {"c", FEATURE_ENVIRONMENT, 1},
        {"rsngi2zetpcdf", 
         FEATURE_ALL & ~(FEATURE_GUIDES | FEATURE_LIGHT_LAYERS | FEATURE_MANY_LIGHTS | FEATURE_CHROMATIC |
                         FEATURE_ANISOTROPY), 1},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        brume_scene *scene = scene_with_sensor();
        brume_arrays a;
        for (const char *thing = rows[i].things; *thing; thing++)
            add_thing(scene, *thing);
        build_arrays(scene, &a);
        if (a.features != rows[i].features || a.params.surfaces_emit != rows[i].surfaces_emit)
            fail_msg("scene \"%s\": features %u, surfaces_emit %d", rows[i].things, a.features,
                     a.params.surfaces_emit);
        brume_arrays_free(&a);
        brume_scene_destroy(scene);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_features),
    };
    return cmocka_run_group_tests(tests, open_context, close_device);
}

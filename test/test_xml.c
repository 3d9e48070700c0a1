/* Scene files that are right: parameters, includes, references, numbers, transforms, colours.
 *
 * Colours and look-at matrices marked (M) are Mitsuba 3.9.1's, variant scalar_rgb: the same XML given to
 * mitsuba.load_string, the value read back with mitsuba.traverse. The other numbers are worked out by hand. */
#include "scene_files.h"

#include <locale.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

/* The matrix of a spot with this transform. */
static void transform_is(const char *elements, const double expected[16]) {
    char text[1024];
    snprintf(text, sizeof text, SCENE("<emitter type='spot'><transform name='to_world'>%s</transform></emitter>"),
             elements);
    brume_scene *scene = scene_files_good(text);
    scene_files_near(scene->lights[0].desc.to_world, expected, 16, 1e-6);
    brume_scene_destroy(scene);
}

/* ---- the file --------------------------------------------------------------------------------------------------- */

static void test_empty(void **state) {
    (void)state;
    brume_scene *scene = scene_files_good("<scene version='3.0.0'/>");
    assert_int_equal(scene->shape_count + scene->light_count + scene->bsdf_count, 0);
    assert_false(scene->has_sensor);
    assert_int_equal(scene->integrator.max_depth, -1);
    assert_string_equal(scene_files_warnings,
                        "scene.xml:1:1: the scene has no <integrator>: volpath without a limit of depth is used\n");
    brume_scene_destroy(scene);
}

static void test_parameters(void **state) {
    (void)state;
    const char *text = SCENE(
        "<default name='a' value='0.1'/>"
        "<default name='ab' value='0.2'/>"
        "<default name='sum' value='$a $ab'/>"
        "<bsdf type='diffuse'><rgb name='reflectance' value='$sum,0.3'/></bsdf>"
        "<bsdf type='diffuse' id='\\$a'/>"
        "<shape type='cube'><ref id='\\$a'/></shape>");
    brume_scene *scene = scene_files_good(text); /* the referenced one comes first */
    NEAR(scene->bsdfs[1].reflectance, 1e-6, 0.1, 0.2, 0.3);
    brume_scene_destroy(scene);

    brume_parameter given[] = {{"ab", "0.7"}, {"a", ".5"}};
    scene = scene_files_good_with(text, given, 2);
    NEAR(scene->bsdfs[1].reflectance, 1e-6, 0.5, 0.7, 0.3);
    brume_scene_destroy(scene);
}

static void test_includes(void **state) {
    (void)state;
    scene_files_write_text("parts/list.xml",
                           "<scene version='3.0.0'><include filename='gold.xml'/>\n"
                           "<default name='late' value='0.4'/>\n"
                           "<texture type='bitmap'><string name='filename' value='p.ppm'/></texture>"
                           "</scene>");
    scene_files_write_text("parts/gold.xml", "<bsdf version='3.0.0' type='conductor' id='gold'>"
                                             "<string name='material' value='Au'/></bsdf>");
    scene_files_write_text("parts/check.xml", "<texture version='0.6.0' type='checkerboard' name='wrong'/>");
    scene_files_write("parts/p.ppm", "P6 1 1 255\n\xff\x00\x33", 14);
    scene_files_write("q.ppm", "P6 1 1 255\n\x00\x00\xff", 14);
    /* Paths are relative to the file that names them; ids and defaults reach across; a single object goes where it is
     * included, under the name given there. */
    brume_scene *scene = scene_files_good(SCENE(
        "<shape type='cube'><ref id='gold'/></shape>"
        "<include filename='parts/list.xml'/>"
        "<bsdf type='diffuse'><float name='reflectance' value='$late'/></bsdf>"
        "<bsdf type='diffuse'><include name='reflectance' filename='parts/check.xml'/></bsdf>"
        "<path value='parts'/>"
        "<texture type='bitmap'><string name='filename' value='p.ppm'/></texture>"
        "<texture type='bitmap'><string name='filename' value='q.ppm'/></texture>"));
    assert_int_equal(scene->bsdf_count, 3);
    assert_int_equal(scene->bsdfs[0].kind, BRUME_BSDF_CONDUCTOR);
    assert_int_equal(scene->shapes[0].desc.bsdf, 0);
    NEAR(scene->bsdfs[1].reflectance, 1e-6, 0.4, 0.4, 0.4);
    assert_int_equal(scene->texture_count, 4);
    assert_int_equal(scene->textures[scene->bsdfs[2].reflectance_texture].desc.kind, BRUME_TEXTURE_CHECKERBOARD);
    brume_scene_destroy(scene);
}

static void test_references(void **state) {
    (void)state;
    brume_scene *scene =
        scene_files_good(SCENE(
            "<shape type='cube'><ref id='late'/><ref id='fog' name='interior'/></shape>"
            "<shape type='cube'><ref id='other'/><ref id='fog' name='exterior'/></shape>"
            "<bsdf type='null' id='late'/>"
            "<medium type='homogeneous' id='fog'/>"
            "<alias id='late' as='other'/>"));
    assert_int_equal(scene->bsdf_count, 1); /* read once */
    assert_int_equal(scene->medium_count, 1);
    assert_int_equal(scene->shapes[0].desc.bsdf, 0);
    assert_int_equal(scene->shapes[1].desc.bsdf, 0);
    assert_int_equal(scene->shapes[0].desc.interior, 0);
    assert_int_equal(scene->shapes[0].desc.exterior, BRUME_NONE);
    assert_int_equal(scene->shapes[1].desc.exterior, 0);
    assert_int_equal(scene->shapes[1].desc.is_boundary, 1);
    brume_scene_destroy(scene);
}

static void test_old_versions(void **state) {
    (void)state;
    brume_scene *scene = scene_files_good(
        "<scene version='0.6.0'><sensor type='perspective'><float name='fov' value='30'/>\n"
        "<string name='fovAxis' value='y'/><transform name='toWorld'><translate x='1'/></transform></sensor>\n"
        "<bsdf type='diffuse'><rgb name='diffuseReflectance' value='0.25'/></bsdf>\n"
        "<bsdf type='dielectric'><float name='intIOR' value='1.7'/></bsdf>\n"
        "<texture type='checkerboard'><float name='uscale' value='2'/><float name='voffset' value='3'/>"
        "<float name='vscale' value='4'/></texture></scene>");
    assert_int_equal(scene->sensor.fov_axis, BRUME_FOV_Y);
    assert_float_equal(scene->sensor.to_world[3], 1, 0);
    NEAR(scene->bsdfs[0].reflectance, 1e-6, 0.25, 0.25, 0.25);
    NEAR(&scene->bsdfs[1].int_ior, 1e-6, 1.7);
    NEAR(scene->textures[0].desc.to_uv, 1e-6, 2, 0, 0, 0, 4, 12);
    brume_scene_destroy(scene);
}

/* Numbers are read alike where the user writes a comma in them. */
static void test_locale(void **state) {
    (void)state;
    const char *names[] = {"de_DE.UTF-8", "de_DE", "fr_FR.UTF-8", "fr_FR"};
    const char *found = NULL;
    for (int i = 0; i < 4 && !found; i++) found = setlocale(LC_NUMERIC, names[i]);
    if (!found) skip();
    brume_scene *scene =
        scene_files_good(SCENE("<bsdf type='diffuse'><float name='reflectance' value='0.25'/></bsdf>"));
    setlocale(LC_NUMERIC, "C");
    NEAR(scene->bsdfs[0].reflectance, 1e-6, 0.25, 0.25, 0.25);
    brume_scene_destroy(scene);
}

/* ---- values ----------------------------------------------------------------------------------------------------- */

static void test_transforms(void **state) {
    (void)state;
    transform_is("", (double[]){1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1});
    transform_is("<translate x='1' z='3'/>", (double[]){1, 0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 3, 0, 0, 0, 1});
    transform_is("<scale value='2'/>", (double[]){2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 1});
    transform_is("<scale x='-1'/>", (double[]){-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1});
    /* A quarter turn takes x to y about z, y to z about x, z to x about y. */
    transform_is("<rotate z='2' angle='90'/>", (double[]){0, -1, 0, 0, 1, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1});
    transform_is("<rotate x='1' angle='90'/>", (double[]){1, 0, 0, 0, 0, 0, -1, 0, 0, 1, 0, 0, 0, 0, 0, 1});
    transform_is("<rotate value='0,1,0' angle='90'/>", (double[]){0, 0, 1, 0, 0, 1, 0, 0, -1, 0, 0, 0, 0, 0, 0, 1});
    /* A third of a turn about the diagonal permutes the axes. */
    transform_is("<rotate x='1' y='1' z='1' angle='120'/>",
                 (double[]){0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 1});
    transform_is("<matrix value='0 -2 0 5, 2 0 0 6, 0 0 2 7, 0 0 0 1'/>",
                 (double[]){0, -2, 0, 5, 2, 0, 0, 6, 0, 0, 2, 7, 0, 0, 0, 1});
    transform_is(
        "<matrix value='0 -2 0 2 0 0 0 0 2'/>", (double[]){0, -2, 0, 0, 2, 0, 0, 0, 0, 0, 2, 0, 0, 0, 0, 1});
    /* The file's order is the order of application: x -> x + 1 -> 2 x + 2, and the other way 2 x + 1. */
    transform_is("<translate x='1'/><scale value='2'/>",
                 (double[]){2, 0, 0, 2, 0, 2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 1});
    transform_is("<scale value='2'/><translate x='1'/>",
                 (double[]){2, 0, 0, 1, 0, 2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 1});
    transform_is("<lookat origin='0 0 5' target='0 0 0' up='0 1 0'/>",
                 (double[]){-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, 5, 0, 0, 0, 1});
    /* (M), five digits; up left out in the last two */
    const double looking[] = {0.894427,  -0.229039, 0.384111, 1, 0, 0.858898, 0.512148, 2,
                              -0.447214, -0.458079, 0.768221, 3, 0, 0,        0,        1};
    const double upless[] = {0.111254, 0.91656,   0.384111, 1, -0.851662, -0.111254, 0.512148, 2,
                             0.512148, -0.384111, 0.768221, 3, 0,         0,         0,        1};
    brume_scene *scene = scene_files_good(SCENE(
        "<emitter type='spot'><transform name='to_world'><lookat origin='1,2,3' target='4,6,9' up='0,1,0'/>"
        "</transform></emitter>"
        "<emitter type='spot'><transform name='to_world'><lookat origin='1,2,3' target='4,6,9'/></transform>"
        "</emitter>"));
    scene_files_near(scene->lights[0].desc.to_world, looking, 16, 1e-5);
    scene_files_near(scene->lights[1].desc.to_world, upless, 16, 1e-5);
    brume_scene_destroy(scene);
    transform_is("<lookat origin='0,0,0' target='0,0,-1'/>",
                 (double[]){0, 1, 0, 0, 1, 0, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1});
}

static void test_colours(void **state) {
    (void)state;
    brume_scene *scene = scene_files_good(SCENE(
        "<bsdf type='diffuse'><rgb name='reflectance' value='0.1, 0.2 0.3'/></bsdf>"
        "<bsdf type='diffuse'><float name='reflectance' value=' +25e-2 '/></bsdf>"
        "<bsdf type='diffuse'><spectrum name='reflectance' value='.5'/></bsdf>"
        "<bsdf type='diffuse'><spectrum name='reflectance' value='400:0.1, 500:0.5, 600:0.9, 700:.2'/></bsdf>"
        "<bsdf type='diffuse'><spectrum name='reflectance' value='500:.8 510:.8'/></bsdf>"
        "<bsdf type='conductor'><spectrum name='eta' value='400:2,700:2'/>"
        "<spectrum name='k' value='400:1, 700:3'/></bsdf>"
        "<emitter type='point'><spectrum name='intensity' value='2'/></emitter>"
        "<emitter type='point'><spectrum name='intensity' value='400:0.1, 500:0.5, 600:0.9, 700:.2'/></emitter>"
        "<emitter type='point'><spectrum name='intensity' value='600:10, 620:10'/></emitter>"
        "<emitter type='point'><float name='intensity' value='2'/></emitter>"));
    NEAR(scene->bsdfs[0].reflectance, 1e-6, 0.1, 0.2, 0.3);
    NEAR(scene->bsdfs[1].reflectance, 1e-6, 0.25, 0.25, 0.25);
    NEAR(scene->bsdfs[2].reflectance, 1e-6, 0.5, 0.5, 0.5);
    NEAR(scene->bsdfs[3].reflectance, 5e-3, 0.833826, 0.689122, 0.265243);     /* (M) */
    NEAR(scene->bsdfs[4].reflectance, 5e-3, 0, 0.0624887, 0.0116985);          /* (M), clamped there too */
    NEAR(scene->bsdfs[5].eta, 5e-3, 1.99068, 1.99951, 1.98982);                /* (M) */
    NEAR(scene->bsdfs[5].k, 5e-3, 2.60364, 1.95267, 1.26699);                  /* (M) */
    NEAR(scene->lights[0].desc.intensity, 5e-3, 2.40959, 1.89658, 1.81783);    /* (M) */
    NEAR(scene->lights[1].desc.intensity, 5e-3, 0.974324, 0.661608, 0.229711); /* (M) */
    NEAR(scene->lights[2].desc.intensity, 5e-3, 4.47665, 0, 0);                /* (M), clamped there too */
    NEAR(scene->lights[3].desc.intensity, 1e-6, 2, 2, 2);
    assert_non_null(strstr(scene_files_warnings, "scene.xml:2:"));
    assert_non_null(strstr(scene_files_warnings, "which was clamped"));
    brume_scene_destroy(scene);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_empty),
        cmocka_unit_test(test_parameters),
        cmocka_unit_test(test_includes),
        cmocka_unit_test(test_references),
        cmocka_unit_test(test_old_versions),
        cmocka_unit_test(test_locale),
        cmocka_unit_test(test_transforms),
        cmocka_unit_test(test_colours),
    };
    return cmocka_run_group_tests(tests, scene_files_enter, scene_files_leave);
}

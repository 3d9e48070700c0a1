/* Scene files that are right: each plugin, property and default in the description that it becomes.
 *
 * Numbers marked (M) are Mitsuba 3.9.1's, variant scalar_rgb: the same XML given to
 * mitsuba.load_string, the value read back with mitsuba.traverse. The other numbers are worked out by hand. */
#include "scene_files.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

static void test_bsdfs(void **state) {
    (void)state;
    brume_scene *scene = scene_files_good(SCENE(
        "<bsdf type='diffuse'/><bsdf type='dielectric'/>"
        "<bsdf type='dielectric'><string name='int_ior' value='Water'/><float name='ext_ior' value='1.1'/>"
        "<rgb name='specular_reflectance' value='.1 .2 .3'/>"
        "<rgb name='specular_transmittance' value='.4 .5 .6'/></bsdf>"
        "<bsdf type='conductor'/>"
        "<bsdf type='conductor'><string name='material' value='Au'/></bsdf>"
        "<bsdf type='roughconductor'/>"
        "<bsdf type='roughconductor'><string name='distribution' value='ggx'/>"
        "<float name='alpha_u' value='.2'/><float name='alpha_v' value='.3'/>"
        "<boolean name='sample_visible' value='false'/><string name='material' value='none'/></bsdf>"
        "<bsdf type='null'/>"
        "<bsdf type='roughconductor'><float name='alpha' value='0.25'/></bsdf>"
        "<bsdf type='thindielectric'><string name='int_ior' value='water'/></bsdf>"));
    assert_int_equal(scene->bsdf_count, 10);
    const brume_bsdf_desc *b = scene->bsdfs;
    assert_int_equal(b[0].kind, BRUME_BSDF_DIFFUSE);
    NEAR(b[0].reflectance, 1e-6, 0.5, 0.5, 0.5);
    assert_int_equal(b[0].reflectance_texture, BRUME_NONE);
    assert_int_equal(b[0].two_sided, 0);
    assert_int_equal(b[1].kind, BRUME_BSDF_DIELECTRIC);
    NEAR(&b[1].int_ior, 1e-6, 1.5046);
    NEAR(&b[1].ext_ior, 1e-6, 1.000277);
    NEAR(&b[2].int_ior, 1e-6, 1.333);
    NEAR(&b[2].ext_ior, 1e-6, 1.1);
    NEAR(b[2].reflectance, 1e-6, .1, .2, .3);
    NEAR(b[2].transmittance, 1e-6, .4, .5, .6);
    assert_int_equal(b[3].kind, BRUME_BSDF_CONDUCTOR);
    NEAR(b[3].eta, 1e-6, 0, 0, 0);
    NEAR(b[3].k, 1e-6, 1, 1, 1);
    NEAR(b[4].eta, 1e-5, 0.143036, 0.375307, 1.44205); /* (M) */
    NEAR(b[4].k, 1e-5, 3.983, 2.38556, 1.60336);       /* (M) */
    assert_int_equal(b[5].kind, BRUME_BSDF_ROUGH_CONDUCTOR);
    assert_int_equal(b[5].distribution, BRUME_DISTRIBUTION_BECKMANN);
    assert_int_equal(b[5].sample_visible, 1);
    NEAR(&b[5].alpha_u, 1e-6, .1, .1);
    assert_int_equal(b[6].distribution, BRUME_DISTRIBUTION_GGX);
    assert_int_equal(b[6].sample_visible, 0);
    NEAR(&b[6].alpha_u, 1e-6, .2, .3);
    assert_int_equal(b[7].kind, BRUME_BSDF_NULL);
    NEAR(&b[8].alpha_u, 1e-6, .25, .25);
    assert_int_equal(b[9].kind, BRUME_BSDF_THIN_DIELECTRIC);
    NEAR(&b[9].int_ior, 1e-6, 1.333);
    NEAR(&b[9].ext_ior, 1e-6, 1.000277);
    brume_scene_destroy(scene);
}

static void test_twosided(void **state) {
    (void)state;
    brume_scene *scene = scene_files_good(SCENE(
        "<bsdf type='twosided'><bsdf type='diffuse'><rgb name='reflectance' value='.9 0 0'/></bsdf></bsdf>"
        "<bsdf type='twosided'><ref id='blue'/><bsdf type='conductor'/></bsdf>"
        "<bsdf type='diffuse' id='blue'><rgb name='reflectance' value='0 0 .9'/></bsdf>"));
    const brume_bsdf_desc *b = scene->bsdfs;
    assert_int_equal(scene->bsdf_count, 4);
    assert_int_equal(b[0].two_sided, 1);
    assert_int_equal(b[0].back, BRUME_NONE);
    NEAR(b[0].reflectance, 1e-6, .9, 0, 0);
    assert_int_equal(b[1].kind, BRUME_BSDF_CONDUCTOR); /* the back is added first */
    assert_int_equal(b[2].two_sided, 1);
    assert_int_equal(b[2].back, 1);
    NEAR(b[2].reflectance, 1e-6, 0, 0, .9);
    assert_int_equal(b[3].two_sided, 0); /* blue by itself */
    brume_scene_destroy(scene);
}

static void test_textures(void **state) {
    (void)state;
    scene_files_write("p.ppm", "P6 2 1 255\n\xff\x00\x33\x00\xff\x00", 17);
    brume_scene *scene = scene_files_good(SCENE(
        "<texture type='checkerboard' id='t'/>"
        "<bsdf type='diffuse'><ref id='t' name='reflectance'/></bsdf>"
        "<bsdf type='diffuse'><texture name='reflectance' type='checkerboard'>"
        "<rgb name='color0' value='1 0 0'/><float name='color1' value='0'/><transform name='to_uv'>"
        "<scale x='2' y='5'/><translate x='3' y='4'/></transform></texture></bsdf>"
        "<bsdf type='diffuse'><texture name='reflectance' type='bitmap'><string name='filename' value='p.ppm'/>"
        "<string name='filter_type' value='nearest'/><string name='wrap_mode' value='mirror'/>"
        "<boolean name='raw' value='true'/></texture></bsdf>"
        "<bsdf type='roughconductor'><ref id='t' name='specular_reflectance'/></bsdf>"));
    assert_int_equal(scene->texture_count, 3);
    assert_int_equal(scene->bsdfs[0].reflectance_texture, 0);
    assert_int_equal(scene->bsdfs[3].reflectance_texture, 0);
    const brume_texture_desc *t = &scene->textures[0].desc;
    assert_int_equal(t->kind, BRUME_TEXTURE_CHECKERBOARD);
    NEAR(t->color0, 1e-6, .4, .4, .4, .2, .2, .2);
    NEAR(t->to_uv, 1e-6, 1, 0, 0, 0, 1, 0);
    t = &scene->textures[scene->bsdfs[1].reflectance_texture].desc;
    NEAR(t->color0, 1e-6, 1, 0, 0, 0, 0, 0);
    NEAR(t->to_uv, 1e-6, 2, 0, 3, 0, 5, 4);
    t = &scene->textures[scene->bsdfs[2].reflectance_texture].desc;
    assert_int_equal(t->kind, BRUME_TEXTURE_BITMAP);
    assert_int_equal(t->width, 2);
    assert_int_equal(t->height, 1);
    assert_int_equal(t->filter, BRUME_FILTER_NEAREST);
    assert_int_equal(t->wrap, BRUME_WRAP_MIRROR);
    NEAR(scene->textures[scene->bsdfs[2].reflectance_texture].texels, 1e-6, 1, 0, 0.2, 0, 1, 0);
    brume_scene_destroy(scene);
}

static void test_media(void **state) {
    (void)state;
    brume_scene *scene = scene_files_good(SCENE(
        "<medium type='homogeneous'/>"
        "<medium type='homogeneous'><rgb name='sigma_t' value='1 2 3'/><float name='scale' value='0.5'/>"
        "<rgb name='albedo' value='.1 .2 .3'/><rgb name='emission' value='4 5 6'/><phase type='hg'/></medium>"
        "<phase type='hg' id='p'><float name='g' value='-0.25'/></phase>"
        "<medium type='homogeneous'><ref id='p'/></medium>"
        "<medium type='homogeneous'><phase type='isotropic'/></medium>"));
    NEAR(scene->media[0].sigma_t, 1e-6, 1, 1, 1);
    NEAR(scene->media[0].albedo, 1e-6, .75, .75, .75);
    NEAR(scene->media[0].emission, 1e-6, 0, 0, 0);
    NEAR(&scene->media[0].g, 1e-6, 0);
    NEAR(scene->media[1].sigma_t, 1e-6, .5, 1, 1.5);
    NEAR(scene->media[1].albedo, 1e-6, .1, .2, .3);
    NEAR(scene->media[1].emission, 1e-6, 4, 5, 6); /* ours; the factor is for sigma_t */
    NEAR(&scene->media[1].g, 1e-6, .8);
    NEAR(&scene->media[2].g, 1e-6, -.25);
    NEAR(&scene->media[3].g, 1e-6, 0);
    brume_scene_destroy(scene);
}

static void test_emitters(void **state) {
    (void)state;
    scene_files_write("p.ppm", "P6 2 1 255\n\xff\x00\xff\x00\xff\x00", 17);
    brume_scene *scene = scene_files_good(SCENE(
        "<emitter type='point'><point name='position' value='1 2 3'/></emitter>"
        "<emitter type='point'><transform name='to_world'><translate z='4'/></transform>"
        "<rgb name='intensity' value='5'/></emitter>"
        "<emitter type='spot'/>"
        "<emitter type='spot'><rgb name='intensity' value='7 8 9'/><float name='cutoff_angle' value='40'/>"
        "<float name='beam_width' value='10'/><texture name='texture' type='checkerboard'/>"
        "<medium type='homogeneous'/></emitter>"
        "<emitter type='directional'/>"
        "<emitter type='directional'><vector name='direction' value='0 0 -2'/>"
        "<rgb name='irradiance' value='3'/></emitter>"
        "<emitter type='envmap'><string name='filename' value='p.ppm'/><float name='scale' value='2'/>"
        "</emitter>"));
    assert_int_equal(scene->light_count, 7);
    const brume_light_desc *l[7];
    for (int i = 0; i < 7; i++) l[i] = &scene->lights[i].desc;
    assert_int_equal(l[0]->kind, BRUME_LIGHT_POINT);
    NEAR(l[0]->to_world, 1e-6, 1, 0, 0, 1, 0, 1, 0, 2, 0, 0, 1, 3, 0, 0, 0, 1);
    NEAR(l[0]->intensity, 1e-6, 1, 1, 1);
    NEAR(l[1]->to_world, 1e-6, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 4, 0, 0, 0, 1);
    NEAR(l[1]->intensity, 1e-6, 5, 5, 5);
    assert_int_equal(l[2]->kind, BRUME_LIGHT_SPOT);
    NEAR(&l[2]->cutoff_angle, 1e-6, 20);
    NEAR(&l[2]->beam_width, 1e-6, 15);
    assert_int_equal(l[2]->texture, BRUME_NONE);
    NEAR(l[3]->intensity, 1e-6, 7, 8, 9);
    NEAR(&l[3]->cutoff_angle, 1e-6, 40);
    NEAR(&l[3]->beam_width, 1e-6, 10);
    assert_int_equal(l[3]->texture, 0);
    assert_int_equal(scene->medium_count, 1);
    assert_int_equal(l[4]->kind, BRUME_LIGHT_DIRECTIONAL);
    NEAR(&l[4]->to_world[10], 1e-6, 1);
    NEAR(l[5]->intensity, 1e-6, 3, 3, 3);
    NEAR(&l[5]->to_world[2], 1e-6, 0);
    NEAR(&l[5]->to_world[6], 1e-6, 0);
    NEAR(&l[5]->to_world[10], 1e-6, -1);
    assert_int_equal(l[6]->kind, BRUME_LIGHT_ENVMAP);
    assert_int_equal(l[6]->width, 2);
    NEAR(&l[6]->scale, 1e-6, 2);
    brume_scene_destroy(scene);

    scene = scene_files_good(SCENE(
        "<emitter type='constant'><rgb name='radiance' value='1 2 3'/><float name='sampling_weight' value='2'/>"
        "</emitter>"));
    assert_int_equal(scene->lights[0].desc.kind, BRUME_LIGHT_CONSTANT);
    NEAR(scene->lights[0].desc.intensity, 1e-6, 1, 2, 3);
    assert_non_null(strstr(scene_files_warnings, "scene.xml:2:1: sampling_weight is ignored"));
    brume_scene_destroy(scene);
}

static void test_shapes(void **state) {
    (void)state;
    scene_files_write_text("m.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    scene_files_write_text(
        "m.ply", "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
                 "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n");
    brume_scene *scene = scene_files_good(SCENE(
        "<shape type='rectangle'/>"
        "<shape type='cube'><boolean name='flip_normals' value='true'/></shape>"
        "<shape type='sphere'/>"
        "<shape type='sphere'><point name='center' value='1 2 3'/><float name='radius' value='4'/>"
        "<emitter type='area'/></shape>"
        "<shape type='disk'><transform name='to_world'><translate x='5'/></transform><emitter type='area'>"
        "<rgb name='radiance' value='1 2 3'/></emitter><bsdf type='null'/></shape>"
        "<shape type='obj'><string name='filename' value='m.obj'/><boolean name='face_normals' value='true'/>"
        "</shape>"
        "<shape type='ply'><string name='filename' value='m.ply'/></shape>"
        "<shape type='cube'><medium type='homogeneous' name='interior'/></shape>"));
    assert_int_equal(scene->shape_count, 8);
    const brume_shape_desc *s[8];
    for (int i = 0; i < 8; i++) s[i] = &scene->shapes[i].desc;
    assert_int_equal(s[0]->kind, BRUME_SHAPE_MESH); /* as scene.h says */
    assert_int_equal(s[0]->triangle_count, 2);
    assert_int_equal(s[0]->bsdf, BRUME_NONE);
    assert_int_equal(s[0]->interior, BRUME_NONE);
    assert_int_equal(s[0]->is_boundary, 0);
    assert_int_equal(s[1]->triangle_count, 12);
    assert_int_equal(s[1]->flip_normals, 1);
    assert_int_equal(s[2]->kind, BRUME_SHAPE_SPHERE);
    NEAR(&s[2]->radius, 1e-6, 1);
    NEAR(s[2]->radiance, 1e-6, 0, 0, 0);
    NEAR(s[3]->center, 1e-6, 1, 2, 3);
    NEAR(&s[3]->radius, 1e-6, 4);
    NEAR(s[3]->radiance, 1e-6, 1, 1, 1);
    assert_int_equal(s[4]->kind, BRUME_SHAPE_DISK);
    NEAR(s[4]->radiance, 1e-6, 1, 2, 3);
    NEAR(&s[4]->to_world[3], 1e-6, 5);
    assert_int_equal(scene->bsdfs[s[4]->bsdf].kind, BRUME_BSDF_NULL);
    assert_int_equal(s[5]->triangle_count, 1);
    assert_int_equal(s[6]->triangle_count, 1);
    assert_int_equal(s[7]->interior, 0);
    assert_int_equal(s[7]->is_boundary, 1);
    brume_scene_destroy(scene);
}

static void test_sensor(void **state) {
    (void)state;
    brume_scene *scene = scene_files_good(SCENE("<sensor type='perspective'/>"));
    assert_true(scene->has_sensor);
    /* 2 atan(sqrt(36^2 + 24^2) / 100) over the diagonal; Mitsuba's x_fov of it at 4:3 is 38.1848 (M): tan of its half
     * is 0.8 of the diagonal's. */
    NEAR(&scene->sensor.fov, 1e-6, 46.792997);
    NEAR(&scene->sensor.fov, 1e-5, 2 * atan(tan(38.18484115600586 * acos(-1.0) / 360) / 0.8) * 180 / acos(-1.0));
    assert_int_equal(scene->sensor.fov_axis, BRUME_FOV_DIAGONAL);
    NEAR(&scene->sensor.near_clip, 1e-6, 0.01);
    NEAR(&scene->sensor.far_clip, 1e-6, 1e4);
    assert_true(scene->sensor.aperture_radius == 0);
    assert_int_equal(scene->sensor.medium, BRUME_NONE);
    assert_int_equal(scene->film.width, 768);
    assert_int_equal(scene->film.height, 576);
    assert_int_equal(scene->film.rfilter, BRUME_RFILTER_GAUSSIAN);
    assert_int_equal(scene->film.half, 1);
    assert_int_equal(scene->film.alpha, 0);
    brume_scene_destroy(scene);

    scene =
        scene_files_good(SCENE(
            "<medium type='homogeneous' id='fog'/>"
            "<sensor type='thinlens'><float name='fov' value='50'/><string name='fov_axis' value='larger'/>"
            "<float name='near_clip' value='1'/><float name='far_clip' value='50'/>"
            "<float name='aperture_radius' value='0.5'/><float name='focus_distance' value='7'/><ref id='fog'/>"
            "<transform name='to_world'><lookat origin='0 0 5' target='0 0 0' up='0 1 0'/></transform></sensor>"));
    NEAR(&scene->sensor.fov, 1e-6, 50);
    assert_int_equal(scene->sensor.fov_axis, BRUME_FOV_LARGER);
    NEAR(&scene->sensor.near_clip, 1e-6, 1, 50, 0.5, 7);
    assert_int_equal(scene->sensor.medium, 0);
    brume_scene_destroy(scene);

    scene = scene_files_good(SCENE("<sensor type='perspective'><string name='focal_length' value='35mm'/></sensor>"));
    NEAR(&scene->sensor.fov, 1e-6, 63.439968); /* 2 atan(43.2666 / 70) */
    brume_scene_destroy(scene);
}

static void test_film(void **state) {
    (void)state;
    static const struct {
        const char *xml;
        brume_rfilter filter;
    } filters[] = {{"<rfilter type='box'/>", BRUME_RFILTER_BOX},
                   {"<rfilter type='tent'><float name='radius' value='2'/></rfilter>", BRUME_RFILTER_TENT},
                   {
                       "<rfilter type='gaussian'><float name='stddev' value='0.75'/></rfilter>",
                        BRUME_RFILTER_GAUSSIAN},
                   {
                       "<rfilter type='mitchell'><float name='B' value='0.25'/><float name='C' value='0.5'/>"
                       "</rfilter>",
                    BRUME_RFILTER_MITCHELL},
                   {"<rfilter type='catmullrom'/>", BRUME_RFILTER_CATMULLROM},
                   {"<rfilter type='lanczos'><integer name='lobes' value='4'/></rfilter>", BRUME_RFILTER_LANCZOS}};
    for (int i = 0; i < 6; i++) {
        char text[1024];
        snprintf(text, sizeof text,
                 SCENE(
                     "<sensor type='perspective'><film type='hdrfilm'><integer name='width' value='640'/>"
                     "<integer name='height' value='480'/><integer name='crop_offset_x' value='10'/>"
                     "<integer name='crop_offset_y' value='20'/><integer name='crop_width' value='30'/>"
                     "<integer name='crop_height' value='40'/><string name='pixel_format' value='rgba'/>"
                     "<string name='component_format' value='float32'/>%s</film></sensor>"),
                 filters[i].xml);
        brume_scene *scene = scene_files_good(text);
        assert_int_equal(scene->film.rfilter, filters[i].filter);
        assert_int_equal(scene->film.width, 640);
        assert_int_equal(scene->film.height, 480);
        assert_int_equal(scene->film.crop_x, 10);
        assert_int_equal(scene->film.crop_y, 20);
        assert_int_equal(scene->film.crop_width, 30);
        assert_int_equal(scene->film.crop_height, 40);
        assert_int_equal(scene->film.alpha, 1);
        assert_int_equal(scene->film.half, 0);
        if (i == 1) NEAR(&scene->film.filter_radius, 1e-6, 2);
        if (i == 2) NEAR(&scene->film.filter_stddev, 1e-6, 0.75);
        if (i == 3) NEAR(&scene->film.filter_b, 1e-6, 0.25, 0.5);
        if (i == 5) assert_int_equal(scene->film.filter_lobes, 4);
        brume_scene_destroy(scene);
    }
}

static void test_samplers(void **state) {
    (void)state;
    const char *types[] = {"independent", "stratified", "multijitter", "orthogonal", "ldsampler"};
    for (int i = 0; i < 5; i++) {
        char text[512];
        snprintf(text, sizeof text,
                 SCENE(
                     "<sensor type='perspective'><sampler type='%s'><integer name='sample_count' value='100'/>"
                     "<integer name='seed' value='7'/></sampler></sensor>"),
                 types[i]);
        brume_scene *scene = scene_files_good(text);
        assert_int_equal(scene->integrator.sampler, BRUME_SAMPLER_SOBOL);
        assert_int_equal(scene->integrator.sample_count, 100);
        assert_int_equal(scene->integrator.seed, 7);
        brume_scene_destroy(scene);
    }
}

static void test_integrators(void **state) {
    (void)state;
    const char *types[] = {"volpath", "volpathmis", "path"};
    for (int i = 0; i < 3; i++) {
        char text[512];
        snprintf(text, sizeof text,
                 SCENE(
                     "<medium type='homogeneous'/>"
                     "<integrator type='%s'><integer name='max_depth' value='9'/>"
                     "<integer name='rr_depth' value='3'/><boolean name='hide_emitters' value='true'/>"
                     "</integrator>"),
                 types[i]);
        brume_scene *scene = scene_files_good(text);
        assert_int_equal(scene->integrator.max_depth, 9);
        assert_int_equal(scene->integrator.rr_depth, 3);
        assert_int_equal(scene->integrator.hide_emitters, 1);
        assert_int_equal(scene->integrator.ignore_media, i == 2);
        assert_string_equal(
            scene_files_warnings,
            i == 2 ? "scene.xml:1:1: the scene has media, which its integrator ignores; volpath does not\n" : "");
        brume_scene_destroy(scene);
    }
    brume_scene *scene = scene_files_good(
        SCENE("<integrator type='volpath'><string name='strategy' value='systematic'/>"
              "<integer name='positions' value='8'/><string name='indirect' value='ray-lights'/></integrator>"));
    assert_int_equal(scene->integrator.strategy, BRUME_STRATEGY_SYSTEMATIC);
    assert_int_equal(scene->integrator.positions, 8);
    assert_int_equal(scene->integrator.indirect, BRUME_INDIRECT_RAY_LIGHTS);
    brume_scene_destroy(scene);
    scene = scene_files_good(SCENE("<integrator type='volpath'/>"));
    assert_int_equal(scene->integrator.strategy, BRUME_STRATEGY_AUTO);
    assert_int_equal(scene->integrator.positions, 0);
    assert_int_equal(scene->integrator.indirect, BRUME_INDIRECT_AUTO);
    assert_int_equal(scene->integrator.max_depth, -1);
    assert_int_equal(scene->integrator.rr_depth, 5);
    assert_int_equal(scene->integrator.hide_emitters, 0);
    brume_scene_destroy(scene);
    scene = scene_files_good(SCENE(
        "<integrator type='direct'><integer name='shading_samples' value='4'/><float name='timeout' value='9'/>"
        "</integrator>"));
    assert_int_equal(scene->integrator.max_depth, 2);
    assert_int_equal(scene->integrator.ignore_media, 1);
    assert_non_null(strstr(scene_files_warnings, "shading_samples is ignored"));
    assert_non_null(strstr(scene_files_warnings, "timeout is ignored"));
    brume_scene_destroy(scene);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_bsdfs),
        cmocka_unit_test(test_twosided),
        cmocka_unit_test(test_textures),
        cmocka_unit_test(test_media),
        cmocka_unit_test(test_emitters),
        cmocka_unit_test(test_shapes),
        cmocka_unit_test(test_sensor),
        cmocka_unit_test(test_film),
        cmocka_unit_test(test_samplers),
        cmocka_unit_test(test_integrators),
    };
    return cmocka_run_group_tests(tests, scene_files_enter, scene_files_leave);
}

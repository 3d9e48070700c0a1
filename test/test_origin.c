/* test_origin.c -- scenes far out, which the kernels see from the camera: when, what comes of it, and what a picture's
 * file says of the camera's place.
 */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>

#include <math.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include <OpenEXR/openexr.h>

#include "arrays.h"
#include "stability.h"
#include "stage.h"

typedef struct picture {
    float radiance[3 * PIXELS * PIXELS], depth[PIXELS * PIXELS];
} picture;

/* The camera 1.625 above a ground of +-20000 under a lamp as high as that, seen to the horizon. */
static void see_ground(brume_shape_kind kind, double move, picture *out) {
    const view v = {{move, move, -move}, {0, -0.6, 0.8}, {0, 0.8, 0.6}, 60};
    const float lie[16] = {20000, 0, 0, (float)move, 0, 0, 1, (float)(move - 1.625), 0, -20000, 0, (float)-move,
                           0, 0, 0, 1};
    brume_shape_desc ground = brume_shape_desc_default(kind);
    brume_render_desc desc = brume_render_desc_default();
    brume_scene *scene = new_scene(3, 4);
    brume_render *render;
    set_camera(scene, &v, BRUME_NONE);
    memcpy(ground.to_world, lie, sizeof lie);
    ground.bsdf = add_diffuse(scene, 0.5);
    must(brume_scene_add_shape(scene, &ground, NULL));
    add_point(scene, move, move + 20000, -move);
    must(brume_render_create(device, scene, &desc, &render));
    must(brume_render_run(render, NULL, NULL));
    must(brume_render_read(render, BRUME_CHANNEL_RADIANCE, out->radiance, 3 * PIXELS * PIXELS));
    must(brume_render_read(render, BRUME_CHANNEL_DEPTH, out->depth, PIXELS * PIXELS));
    brume_render_destroy(render);
    brume_scene_destroy(scene);
}

static void over_a_large_face(void **state) {
    static picture here, there;
    (void)state;
    NEEDS_DEVICE();
    for (int disk = 0; disk < 2; disk++) {
        int differ = 0;
        see_ground(disk ? BRUME_SHAPE_DISK : BRUME_SHAPE_RECTANGLE, 0, &here);
        see_ground(disk ? BRUME_SHAPE_DISK : BRUME_SHAPE_RECTANGLE, 1e6, &there);
        for (int i = 0; i < PIXELS * PIXELS; i++)
            differ += here.depth[i] != there.depth[i] || here.radiance[3 * i] != there.radiance[3 * i];
        stability_row("invariance", disk ? "over a large disk" : "over a large face",
                      "the scene at its origin, bit for bit", "pixels that differ", 0, differ, "moved by 1e6");
    }
}

static int is_rebased(brume_scene *scene) {
    brume_arrays arrays;
    must(brume_arrays_build(scene, NULL, &arrays));
    int is = arrays.origin[0] != 0;
    brume_arrays_free(&arrays);
    brume_scene_destroy(scene);
    return is;
}

/* A camera at (100, 0, 0), whose limit is 100 / 64 = 1.56, and a triangle in the plane at `height`. */
static int rebased_by(const float corners[9]) {
    static const view there = {{100, 0, 0}, {0, 0, 1}, {0, 1, 0}, 60};
    static const uint32_t triangle[3] = {0, 1, 2};
    brume_scene *scene = new_scene(2, 1);
    brume_shape_desc desc = brume_shape_desc_default(BRUME_SHAPE_MESH);
    set_camera(scene, &there, BRUME_NONE);
    desc.positions = corners;
    desc.vertex_count = 3;
    desc.triangles = triangle;
    desc.triangle_count = 1;
    must(brume_scene_add_shape(scene, &desc, NULL));
    return is_rebased(scene);
}

static void the_nearest_point_of_a_triangle_counts(void **state) {
    static const struct { float corners[9]; int near; const char *what; } cases[] = {
        {{90, -1.5f, -10, 110, -1.5f, -10, 100, -1.5f, 20}, 1, "over its face"},
        {{90, -1.6f, -10, 110, -1.6f, -10, 100, -1.6f, 20}, 0, "high over its face"},
        {{101.5f, -10, 0, 101.5f, 10, 0, 120, 0, 0}, 1, "beside its side"},
        {{101.6f, -10, 0, 101.6f, 10, 0, 120, 0, 0}, 0, "far beside its side"},
        {{101, 1, 0, 120, 1, 5, 120, 1, -5}, 1, "off its corner"},
        {{101.2f, 1.2f, 0, 120, 1.2f, 5, 120, 1.2f, -5}, 0, "far off its corner"},
        {{80, 0, 0, 110, 30, 5, 110, 30, -5}, 0, "in its box alone"},
        {{90, 1, 0, 100, 1, 0, 110, 1, 0}, 1, "by one without an area"},
    };
    (void)state;
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++)
        if (rebased_by(cases[i].corners) != cases[i].near) fail_msg("%s", cases[i].what);
}

/* What the EXR says of the camera's place: composite programs put things there by it. */
static void the_file_knows_the_camera(void **state) {
    static const double move[3] = {1e6, -2e6, 1e6};
    const stage told = {.fog = 0, .move = {move[0], move[1], move[2]}};
    (void)state;
    NEEDS_DEVICE();
    char path[64];
    brume_scene *scene = stage_scene(&told, 1);
    brume_render_desc desc = brume_render_desc_default();
    brume_render *render;
    snprintf(path, sizeof path, "/tmp/brume-invariance-%ld.exr", (long)getpid());
    must(brume_render_create(device, scene, &desc, &render));
    must(brume_render_write(render, path, NULL));
    brume_render_destroy(render);
    brume_scene_destroy(scene);

    exr_context_t exr;
    exr_context_initializer_t start = EXR_DEFAULT_CONTEXT_INITIALIZER;
    exr_attr_m44f_t camera, ndc;
    assert_int_equal(exr_start_read(&exr, path, &start), EXR_ERR_SUCCESS);
    assert_int_equal(exr_attr_get_m44f(exr, 0, "worldToCamera", &camera), EXR_ERR_SUCCESS);
    assert_int_equal(exr_attr_get_m44f(exr, 0, "worldToNDC", &ndc), EXR_ERR_SUCCESS);
    exr_finish(&exr);
    unlink(path);
    /* A point 4 before the camera; row vectors. */
    const double p[4] = {move[0], move[1], move[2] + 4, 1};
    const double seen[4] = {0, 0, 4, 1}, screen[4] = {0, 0, 4, 4};
    for (int c = 0; c < 4; c++) {
        double by_camera = 0, by_ndc = 0;
        for (int r = 0; r < 4; r++) {
            by_camera += p[r] * camera.m[4 * r + c];
            by_ndc += p[r] * ndc.m[4 * r + c];
        }
        /* The screen's factor is not exact in a float. */
        assert_true(by_camera == seen[c]);
        assert_true(fabs(by_ndc - screen[c]) <= 2e6 * 0x1p-23 * 4);
    }
}

/* The scenes that come with the program are seen from where nothing is rounded: theirs is the origin that they have. */
static void scenes_near_the_origin_keep_it(void **state) {
    static const char *const paths[] = {
        "scenes/one-spot.xml", "scenes/furnace.xml", "scenes/emission-slab.xml", "scenes/glass-in-fog.xml",
        "scenes/ladder/open-beam.xml", "scenes/ladder/slats.xml", "scenes/ladder/hundred-spots.xml",
        "scenes/ladder/room.xml"};
    (void)state;
    for (size_t i = 0; i < sizeof paths / sizeof paths[0]; i++) {
        brume_scene *scene;
        brume_arrays arrays;
        must(brume_scene_load(context, paths[i], NULL, 0, &scene));
        must(brume_arrays_build(scene, NULL, &arrays));
        for (int k = 0; k < 3; k++)
            assert_true(arrays.origin[k] == 0);
        brume_arrays_free(&arrays);
        brume_scene_destroy(scene);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(over_a_large_face),
        cmocka_unit_test(the_nearest_point_of_a_triangle_counts),
        cmocka_unit_test(the_file_knows_the_camera),
        cmocka_unit_test(scenes_near_the_origin_keep_it),
    };
    return cmocka_run_group_tests(tests, open_device, close_device);
}

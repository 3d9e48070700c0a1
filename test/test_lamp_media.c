/* test_lamp_media.c -- the medium that each lamp is found to stand in (lib/arrays_lamp_media.c), where it follows from
 * the shapes: spheres, meshes, disks, nested, flipped, and seen along edges. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "built_arrays.h"

enum { AIR = 0, FOG = 1, SMOKE = 2, MEDIA = 3 };

/* The camera stands at the origin in AIR. */
static brume_scene *new_scene(void) {
    brume_scene *scene = scene_with_sensor();
    brume_sensor_desc sensor = brume_sensor_desc_default();
    brume_medium_desc medium = brume_medium_desc_default();
    for (int i = 0; i < MEDIA; i++) must(brume_scene_add_medium(scene, &medium, NULL));
    sensor.medium = AIR;
    must(brume_scene_set_sensor(scene, &sensor));
    return scene;
}

static void add_boundary(brume_scene *scene, brume_shape_kind kind, double size, double z, uint32_t interior,
                         uint32_t exterior, int flipped) {
    brume_bsdf_desc null = brume_bsdf_desc_default(BRUME_BSDF_NULL);
    brume_shape_desc shape = brume_shape_desc_default(kind);
    must(brume_scene_add_bsdf(scene, &null, &shape.bsdf));
    for (int i = 0; i < 3; i++) shape.to_world[5 * i] = (float)size;
    shape.to_world[11] = (float)z;
    shape.interior = interior;
    shape.exterior = exterior;
    shape.flip_normals = (uint32_t)flipped;
    must(brume_scene_add_shape(scene, &shape, NULL));
}

static void add_lamp(brume_scene *scene, double x, double y, double z) {
    brume_light_desc lamp = brume_light_desc_default(BRUME_LIGHT_POINT);
    lamp.to_world[3] = (float)x;
    lamp.to_world[7] = (float)y;
    lamp.to_world[11] = (float)z;
    must(brume_scene_add_light(scene, &lamp, NULL));
}

/* Of the scene's lamps, in their order; destroys it. */
static void expect_media(brume_scene *scene, int count, const int *media) {
    brume_arrays arrays;
    build_arrays(scene, &arrays);
    assert_int_equal(arrays.light_count, count);
    for (int i = 0; i < count; i++) {
        if (arrays.lights[i].medium != media[i])
            fail_msg("lamp %d at z = %g: medium %d, expected %d", i, arrays.lights[i].position[2],
                     arrays.lights[i].medium, media[i]);
    }
    brume_arrays_free(&arrays);
    brume_scene_destroy(scene);
}

/* Smoke within fog within air. */
static void nested(void **state) {
    static const brume_shape_kind kinds[] = {BRUME_SHAPE_SPHERE, BRUME_SHAPE_CUBE};
    static const int media[] = {AIR, FOG, SMOKE, FOG, AIR, FOG, AIR};
    (void)state;
    for (int k = 0; k < 2; k++)
        for (int flipped = 0; flipped < 2; flipped++) {
            brume_scene *scene = new_scene();
            uint32_t in[2] = {FOG, SMOKE}, out[2] = {AIR, FOG};
            for (int i = 0; i < 2; i++)
                add_boundary(scene, kinds[k], i ? 1 : 2, 5, flipped ? out[i] : in[i], flipped ? in[i] : out[i], flipped);
            add_lamp(scene, 0, 0, 2.9);
            add_lamp(scene, 0, 0, 3.5);
            add_lamp(scene, 0, 0, 5);
            add_lamp(scene, 0, 0, 6.5);
            add_lamp(scene, 0, 0, 7.5);
            add_lamp(scene, 1.4, 0, 5.5);
            add_lamp(scene, 1.4, 2.1, 5.5);
            expect_media(scene, 7, media);
        }
}

/* From within: the camera's medium is the ball's. */
static void from_within(void **state) {
    static const int media[] = {AIR, FOG, AIR};
    (void)state;
    brume_scene *scene = new_scene();
    add_boundary(scene, BRUME_SHAPE_SPHERE, 3, 0, AIR, FOG, 0);
    add_lamp(scene, 1, 2, 1);
    add_lamp(scene, 1, 3, 1);
    add_lamp(scene, 0, 0, 0);
    expect_media(scene, 3, media);
}

/* Other surfaces, and boundaries that the line passes by, say nothing; a disk's sides are those of its normal. */
static void what_stands_between(void **state) {
    static const int media[] = {AIR, SMOKE, SMOKE, AIR};
    (void)state;
    brume_scene *scene = new_scene();
    brume_shape_desc wall = brume_shape_desc_default(BRUME_SHAPE_SPHERE);
    wall.center[2] = 3;
    must(brume_scene_add_shape(scene, &wall, NULL));
    add_boundary(scene, BRUME_SHAPE_SPHERE, 1, -5, FOG, AIR, 0);
    add_boundary(scene, BRUME_SHAPE_DISK, 2, 6, AIR, SMOKE, 0);
    add_lamp(scene, 0, 0, 5);
    add_lamp(scene, 0, 0, 7);
    add_lamp(scene, 1.5, 1.5, 7);
    add_lamp(scene, 3, 3, 7);
    expect_media(scene, 4, media);
}

/* Through the corners and edges of a cube, whose faces are cut along diagonals. */
static void along_edges(void **state) {
    int media[64], count = 0;
    (void)state;
    brume_scene *scene = new_scene();
    add_boundary(scene, BRUME_SHAPE_CUBE, 1, 8, FOG, AIR, 0);
    for (int i = -3; i <= 3; i++)
        for (int j = -3; j <= 3; j++) {
            /* On the line from the camera through a point of the near face, behind it; diagonals among them. */
            double x = i / 3.5, y = j / 3.5;
            add_lamp(scene, x * 8 / 7, y * 8 / 7, 8);
            media[count++] = FOG;
        }
    expect_media(scene, count, media);
}

/* The nearest of many triangles, in whatever order the hierarchy has them. */
static void among_many(void **state) {
    int media[24]; /* more lamps would be sorted for their tree */
    (void)state;
    brume_scene *scene = new_scene();
    for (int i = 0; i < 12; i++)
        add_boundary(scene, BRUME_SHAPE_CUBE, 1, 4 * (i + 1), i % 2 ? FOG : SMOKE, AIR, 0);
    for (int i = 0; i < 12; i++) {
        add_lamp(scene, 0.1, 0.2, 4 * (i + 1));
        add_lamp(scene, 0.1, 0.2, 4 * (i + 1) + 2);
        media[2 * i] = i % 2 ? FOG : SMOKE;
        media[2 * i + 1] = AIR;
    }
    expect_media(scene, 24, media);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(nested),      cmocka_unit_test(from_within), cmocka_unit_test(what_stands_between),
        cmocka_unit_test(along_edges), cmocka_unit_test(among_many),
    };
    return cmocka_run_group_tests(tests, open_context, close_device);
}

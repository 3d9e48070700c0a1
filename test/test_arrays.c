/* test_arrays.c -- the kernels' camera, crop and surfaces against closed forms of what they stand for. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "built_arrays.h"

#define PI 3.14159265358979323846

static void test_field_of_view(void **state) {
    (void)state;
    static const uint32_t sizes[3][2] = {{768, 576}, {300, 700}, {64, 64}};
    for (int size = 0; size < 3; size++)
        for (int axis = BRUME_FOV_X; axis <= BRUME_FOV_LARGER; axis++) {
            brume_scene *scene = scene_with_sensor();
            brume_sensor_desc sensor = brume_sensor_desc_default();
            brume_film_desc film = brume_film_desc_default();
            brume_arrays a;
            sensor.fov = 50;
            sensor.fov_axis = (brume_fov_axis)axis;
            film.width = sizes[size][0], film.height = sizes[size][1];
            film.crop_x = 3, film.crop_width = 5; /* the crop must not matter */
            assert_int_equal(brume_scene_set_sensor(scene, &sensor), BRUME_OK);
            assert_int_equal(brume_scene_set_film(scene, &film), BRUME_OK);
            build_arrays(scene, &a);
            double x = a.params.tan_x, y = a.params.tan_y, wanted = tan(25 * PI / 180);
            double along = axis == BRUME_FOV_X          ? x
                           : axis == BRUME_FOV_Y        ? y
                           : axis == BRUME_FOV_DIAGONAL ? hypot(x, y)
                           : axis == BRUME_FOV_SMALLER  ? fmin(x, y)
                                                        : fmax(x, y);
            assert_close(along, wanted, 2e-7);
            assert_close(x / y, (double)film.width / film.height, 2e-7); /* square pixels */
            assert_int_equal(a.params.crop_width, 5);
            assert_int_equal(a.params.crop_height, film.height);
            brume_arrays_free(&a);
            brume_scene_destroy(scene);
        }
}

static void test_crop(void **state) {
    (void)state;
    brume_scene *scene = scene_with_sensor();
    brume_arrays a;
    static const uint32_t inside[4] = {700, 10, 0, 5}, outside[4] = {700, 10, 69, 5}, beyond[4] = {768, 0, 0, 0};
    memset(&a, 0x5a, sizeof a);
    brume_arrays before = a;
    assert_int_equal(brume_arrays_build(scene, outside, &a), BRUME_ERROR_ARGUMENT);
    assert_int_equal(brume_arrays_build(scene, beyond, &a), BRUME_ERROR_ARGUMENT);
    assert_memory_equal(&a, &before, sizeof a);
    assert_int_equal(brume_arrays_build(scene, inside, &a), BRUME_OK);
    assert_int_equal(a.params.crop_x, 700);
    assert_int_equal(a.params.crop_width, 68);
    assert_int_equal(a.params.crop_height, 5);
    brume_arrays_free(&a);
    brume_scene_destroy(scene);
}

static void test_no_sensor(void **state) {
    (void)state;
    brume_scene *scene;
    brume_arrays a;
    assert_int_equal(brume_scene_create(context, &scene), BRUME_OK);
    assert_int_equal(brume_arrays_build(scene, NULL, &a), BRUME_ERROR_SCENE);
    brume_scene_destroy(scene);
}

/* ---- geometry ------------------------------------------------------------------------------------------------- */

static void geometric_normal(const brume_arrays *a, int i, double out[3]) {
    const int *v = a->triangles[i].v;
    double e[2][3];
    for (int k = 0; k < 2; k++)
        for (int c = 0; c < 3; c++)
            e[k][c] = a->positions[3 * v[k + 1] + c] - (double)a->positions[3 * v[0] + c];
    for (int c = 0; c < 3; c++)
        out[c] = e[0][(c + 1) % 3] * e[1][(c + 2) % 3] - e[0][(c + 2) % 3] * e[1][(c + 1) % 3];
}

/* Sheared, scaled unevenly, moved, and mirrored if `side` is -1. */
static void skewed(float m[16], float side) {
    static const float rows[16] = {2, 0.5f, 0, 3, 0, 1, 0.25f, -1, 0.3f, 0, 0.5f, 7, 0, 0, 0, 1};
    memcpy(m, rows, sizeof rows);
    for (int i = 0; i < 3; i++)
        m[4 * i] *= side;
}

/* A cube's normals point outwards whatever is done to it; the mean of its vertices is inside. */
static void test_cube_faces_outwards(void **state) {
    (void)state;
    for (int side = -1; side <= 1; side += 2) {
        brume_scene *scene = scene_with_sensor();
        brume_shape_desc cube = brume_shape_desc_default(BRUME_SHAPE_CUBE);
        brume_arrays a;
        skewed(cube.to_world, (float)side);
        assert_int_equal(brume_scene_add_shape(scene, &cube, NULL), BRUME_OK);
        build_arrays(scene, &a);
        assert_int_equal(a.params.triangle_count, 12);
        assert_int_equal(a.dropped_triangles, 0);
        for (int i = 0; i < 12; i++) {
            double n[3], outwards = 0;
            geometric_normal(&a, i, n);
            for (int c = 0; c < 3; c++)
                outwards += n[c] * (a.positions[3 * a.triangles[i].v[0] + c] - cube.to_world[4 * c + 3]);
            assert_true(outwards > 0);
        }
        brume_arrays_free(&a);
        brume_scene_destroy(scene);
    }
}

/* Mitsuba 3.9: a rectangle's texture coordinates are (x + 1) / 2, (y + 1) / 2; on a cube's +z face (0.2, 0.3, 1) has
 * (0.65, 0.6). */
static void test_texture_coordinates(void **state) {
    (void)state;
    brume_scene *scene = scene_with_sensor();
    brume_shape_desc rectangle = brume_shape_desc_default(BRUME_SHAPE_RECTANGLE);
    brume_shape_desc cube = brume_shape_desc_default(BRUME_SHAPE_CUBE);
    brume_arrays a;
    assert_int_equal(brume_scene_add_shape(scene, &cube, NULL), BRUME_OK);
    assert_int_equal(brume_scene_add_shape(scene, &rectangle, NULL), BRUME_OK);
    build_arrays(scene, &a);
    for (int t = 0; t < a.params.triangle_count; t++) {
        const b_triangle *triangle = &a.triangles[t];
        for (int k = 0; k < 3; k++) {
            const float *p = a.positions + 3 * triangle->v[k];
            const float *uv = a.uvs + 2 * (triangle->v[k] + a.shapes[triangle->shape].uv_base);
            double n[3];
            geometric_normal(&a, t, n);
            if (triangle->shape == 1 || n[2] > 0) {
                int swap = triangle->shape == 0;
                assert_float_equal(uv[0], 0.5 * (p[swap ? 1 : 0] + 1), 0);
                assert_float_equal(uv[1], 0.5 * (p[swap ? 0 : 1] + 1), 0);
            }
        }
    }
    brume_arrays_free(&a);
    brume_scene_destroy(scene);
}

/* Vertex normals of a sheared and mirrored mesh stay at right angles to the surface and on its side; geometric normals
 * agree with them. A mesh without them turns around when mirrored (Mitsuba 3.9). */
static void test_normals(void **state) {
    (void)state;
    static const float positions[12] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0};
    static const float normals[12] = {0, 0, 2, 0, 0, 1, 0, 0, 0.5f, 0, 0, 0}; /* the last one is missing */
    static const uint32_t triangles[6] = {0, 1, 2, 2, 1, 3};
    for (int side = -1; side <= 1; side += 2)
        for (int smooth = 0; smooth < 2; smooth++) {
            brume_scene *scene = scene_with_sensor();
            brume_shape_desc other = brume_shape_desc_default(BRUME_SHAPE_CUBE);
            brume_shape_desc mesh = brume_shape_desc_default(BRUME_SHAPE_MESH);
            brume_arrays a;
            mesh.vertex_count = 4, mesh.triangle_count = 2;
            mesh.positions = positions, mesh.triangles = triangles, mesh.normals = smooth ? normals : NULL;
            skewed(mesh.to_world, (float)side);
            assert_int_equal(brume_scene_add_shape(scene, &other, NULL), BRUME_OK);
            assert_int_equal(brume_scene_add_shape(scene, &mesh, NULL), BRUME_OK);
            build_arrays(scene, &a);
            /* The image of +z under the map: on which side a vertex normal must point. */
            double up[3] = {mesh.to_world[2], mesh.to_world[6], mesh.to_world[10]};
            for (int t = 12; t < 14; t++) {
                double n[3], length = 0, along = 0;
                geometric_normal(&a, t, n);
                for (int c = 0; c < 3; c++) {
                    length += n[c] * n[c];
                    along += n[c] * up[c];
                }
                assert_true(along * (smooth ? 1 : side) > 0);
                if (!smooth) {
                    assert_int_equal(a.shapes[1].normal_base, NO_BASE);
                    continue;
                }
                for (int k = 0; k < 3; k++)
                    for (int c = 0; c < 3; c++)
                        assert_float_equal(a.normals[3 * (a.triangles[t].v[k] + a.shapes[1].normal_base) + c],
                                           n[c] / sqrt(length), 2e-7);
            }
            brume_arrays_free(&a);
            brume_scene_destroy(scene);
        }
}

static void test_degenerate_triangles(void **state) {
    (void)state;
    static const float positions[15] = {0, 0, 0, 1, 0, 0, 2, 0, 0, 0, 1e-20f, 0, 1, 1, 0};
    static const uint32_t triangles[12] = {0, 1, 2, 0, 0, 4, 0, 1, 3, 0, 1, 4};
    brume_scene *scene = scene_with_sensor();
    brume_shape_desc mesh = brume_shape_desc_default(BRUME_SHAPE_MESH);
    brume_arrays a;
    mesh.vertex_count = 5, mesh.triangle_count = 4;
    mesh.positions = positions, mesh.triangles = triangles;
    assert_int_equal(brume_scene_add_shape(scene, &mesh, NULL), BRUME_OK);
    build_arrays(scene, &a);
    assert_int_equal(a.dropped_triangles, 2); /* a thin one is kept */
    assert_int_equal(a.params.triangle_count, 2);
    brume_arrays_free(&a);
    brume_scene_destroy(scene);
}

static void test_quadrics(void **state) {
    (void)state;
    brume_scene *scene = scene_with_sensor();
    brume_shape_desc sphere = brume_shape_desc_default(BRUME_SHAPE_SPHERE);
    brume_shape_desc disk = brume_shape_desc_default(BRUME_SHAPE_DISK);
    brume_arrays a;
    sphere.radius = 0.5f;
    sphere.center[0] = 1;
    sphere.to_world[0] = -4, sphere.to_world[5] = sphere.to_world[10] = 4; /* mirrored: its normals turn inwards */
    sphere.to_world[3] = 10;
    skewed(disk.to_world, 1);
    disk.flip_normals = 1;
    assert_int_equal(brume_scene_add_shape(scene, &sphere, NULL), BRUME_OK);
    assert_int_equal(brume_scene_add_shape(scene, &disk, NULL), BRUME_OK);
    build_arrays(scene, &a);
    assert_int_equal(a.params.quadric_count, 2);
    assert_float_equal(a.quadrics[0].center[0], 6, 0);
    assert_float_equal(a.quadrics[0].radius, 2, 1e-6);
    assert_int_equal(a.shapes[0].flags, SHAPE_FLIP_NORMALS);
    assert_int_equal(a.shapes[1].flags, SHAPE_FLIP_NORMALS);
    const b_quadric *q = &a.quadrics[1];
    double u = 0, v = 0, n = 0;
    for (int c = 0; c < 3; c++) {
        u += q->n[c] * (double)q->du[c];
        v += q->n[c] * (double)q->dv[c];
        n += q->n[c] * (double)q->n[c];
    }
    assert_float_equal(u, 0, 1e-6);
    assert_float_equal(v, 0, 1e-6);
    assert_float_equal(n, 1, 1e-6);
    /* Every point of both must lie within the extent. */
    for (int i = 0; i < 1000; i++) {
        double t = i * 2 * PI / 1000, d2 = 0;
        for (int c = 0; c < 3; c++) {
            double p = q->center[c] + cos(t) * q->du[c] + sin(t) * q->dv[c] - a.params.scene_center[c];
            d2 += p * p;
        }
        assert_true(sqrt(d2) <= a.params.scene_radius * 1.000001);
    }
    brume_arrays_free(&a);
    brume_scene_destroy(scene);
}

static void test_too_far(void **state) {
    (void)state;
    brume_scene *scene = scene_with_sensor();
    brume_shape_desc cube = brume_shape_desc_default(BRUME_SHAPE_CUBE);
    brume_arrays a;
    cube.to_world[0] = cube.to_world[5] = cube.to_world[10] = 1e30f;
    assert_int_equal(brume_scene_add_shape(scene, &cube, NULL), BRUME_OK);
    assert_int_equal(brume_arrays_build(scene, NULL, &a), BRUME_ERROR_SCENE);
    assert_non_null(strstr(brume_context_message(context), "shape 0"));
    brume_scene_destroy(scene);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_field_of_view),
        cmocka_unit_test(test_crop),
        cmocka_unit_test(test_no_sensor),
        cmocka_unit_test(test_cube_faces_outwards),
        cmocka_unit_test(test_texture_coordinates),
        cmocka_unit_test(test_normals),
        cmocka_unit_test(test_degenerate_triangles),
        cmocka_unit_test(test_quadrics),
        cmocka_unit_test(test_too_far),
    };
    return cmocka_run_group_tests(tests, open_context, close_device);
}

/* test_arrays.c -- the kernels' arrays against closed forms and double-precision integrals of what they stand for. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "arrays.h"

#define PI 3.14159265358979323846

static brume_context *context;

static int open_context(void **state) {
    (void)state;
    return brume_context_create(&context) != BRUME_OK;
}

static int close_context(void **state) {
    (void)state;
    brume_context_destroy(context);
    return 0;
}

static brume_scene *new_scene(void) {
    brume_scene *scene;
    brume_sensor_desc sensor = brume_sensor_desc_default();
    assert_int_equal(brume_scene_create(context, &scene), BRUME_OK);
    assert_int_equal(brume_scene_set_sensor(scene, &sensor), BRUME_OK);
    return scene;
}

static void build(const brume_scene *scene, brume_arrays *arrays) {
    if (brume_arrays_build(scene, NULL, arrays) != BRUME_OK)
        fail_msg("%s", brume_context_message(context));
}

static void assert_close(double value, double wanted, double relative) {
    if (!(fabs(value - wanted) <= relative * fabs(wanted)))
        fail_msg("%.9g instead of %.9g", value, wanted);
}

/* ---- camera and film ------------------------------------------------------------------------------------------ */

static void test_field_of_view(void **state) {
    (void)state;
    static const uint32_t sizes[3][2] = {{768, 576}, {300, 700}, {64, 64}};
    for (int size = 0; size < 3; size++)
        for (int axis = BRUME_FOV_X; axis <= BRUME_FOV_LARGER; axis++) {
            brume_scene *scene = new_scene();
            brume_sensor_desc sensor = brume_sensor_desc_default();
            brume_film_desc film = brume_film_desc_default();
            brume_arrays a;
            sensor.fov = 50;
            sensor.fov_axis = (brume_fov_axis)axis;
            film.width = sizes[size][0], film.height = sizes[size][1];
            film.crop_x = 3, film.crop_width = 5; /* the crop must not matter */
            assert_int_equal(brume_scene_set_sensor(scene, &sensor), BRUME_OK);
            assert_int_equal(brume_scene_set_film(scene, &film), BRUME_OK);
            build(scene, &a);
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
    brume_scene *scene = new_scene();
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
        brume_scene *scene = new_scene();
        brume_shape_desc cube = brume_shape_desc_default(BRUME_SHAPE_CUBE);
        brume_arrays a;
        skewed(cube.to_world, (float)side);
        assert_int_equal(brume_scene_add_shape(scene, &cube, NULL), BRUME_OK);
        build(scene, &a);
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
    brume_scene *scene = new_scene();
    brume_shape_desc rectangle = brume_shape_desc_default(BRUME_SHAPE_RECTANGLE);
    brume_shape_desc cube = brume_shape_desc_default(BRUME_SHAPE_CUBE);
    brume_arrays a;
    assert_int_equal(brume_scene_add_shape(scene, &cube, NULL), BRUME_OK);
    assert_int_equal(brume_scene_add_shape(scene, &rectangle, NULL), BRUME_OK);
    build(scene, &a);
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
            brume_scene *scene = new_scene();
            brume_shape_desc other = brume_shape_desc_default(BRUME_SHAPE_CUBE);
            brume_shape_desc mesh = brume_shape_desc_default(BRUME_SHAPE_MESH);
            brume_arrays a;
            mesh.vertex_count = 4, mesh.triangle_count = 2;
            mesh.positions = positions, mesh.triangles = triangles, mesh.normals = smooth ? normals : NULL;
            skewed(mesh.to_world, (float)side);
            assert_int_equal(brume_scene_add_shape(scene, &other, NULL), BRUME_OK);
            assert_int_equal(brume_scene_add_shape(scene, &mesh, NULL), BRUME_OK);
            build(scene, &a);
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
    brume_scene *scene = new_scene();
    brume_shape_desc mesh = brume_shape_desc_default(BRUME_SHAPE_MESH);
    brume_arrays a;
    mesh.vertex_count = 5, mesh.triangle_count = 4;
    mesh.positions = positions, mesh.triangles = triangles;
    assert_int_equal(brume_scene_add_shape(scene, &mesh, NULL), BRUME_OK);
    build(scene, &a);
    assert_int_equal(a.dropped_triangles, 2); /* a thin one is kept */
    assert_int_equal(a.params.triangle_count, 2);
    brume_arrays_free(&a);
    brume_scene_destroy(scene);
}

static void test_quadrics(void **state) {
    (void)state;
    brume_scene *scene = new_scene();
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
    build(scene, &a);
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
    brume_scene *scene = new_scene();
    brume_shape_desc cube = brume_shape_desc_default(BRUME_SHAPE_CUBE);
    brume_arrays a;
    cube.to_world[0] = cube.to_world[5] = cube.to_world[10] = 1e30f;
    assert_int_equal(brume_scene_add_shape(scene, &cube, NULL), BRUME_OK);
    assert_int_equal(brume_arrays_build(scene, NULL, &a), BRUME_ERROR_SCENE);
    assert_non_null(strstr(brume_context_message(context), "shape 0"));
    brume_scene_destroy(scene);
}

/* ---- lights --------------------------------------------------------------------------------------------------- */

static void test_spots(void **state) {
    (void)state;
    static const float cutoffs[] = {0.01f, 20, 90, 179.9f, 180};
    for (size_t i = 0; i < sizeof cutoffs / sizeof *cutoffs; i++)
        for (int hard = 0; hard < 2; hard++) {
            brume_scene *scene = new_scene();
            brume_light_desc spot = brume_light_desc_default(BRUME_LIGHT_SPOT);
            brume_arrays a;
            /* Along -x, and twice as large: the angles stay. */
            static const float m[16] = {0, 0, -2, 1, 0, 2, 0, 2, 2, 0, 0, 3, 0, 0, 0, 1};
            memcpy(spot.to_world, m, sizeof m);
            spot.cutoff_angle = cutoffs[i];
            spot.beam_width = hard ? cutoffs[i] : 0.5f * cutoffs[i];
            assert_int_equal(brume_scene_add_light(scene, &spot, NULL), BRUME_OK);
            build(scene, &a);
            const b_light *light = &a.lights[0];
            double cutoff = cutoffs[i] * (PI / 180);
            /* 1 - cos t = t^2/2 - t^4/24 + ... where the difference has no digits left */
            double v = cutoff < 1e-3 ? cutoff * cutoff / 2 * (1 - cutoff * cutoff / 12) : 1 - cos(cutoff);
            assert_close(light->v_cutoff, v, 2e-7);
            assert_close(light->cutoff, cutoff, 1e-7);
            assert_true(isfinite(light->inv_fade));
            if (hard)
                assert_true(light->inv_fade >= 1e30f);
            else
                assert_close(light->inv_fade, 2 / cutoff, 1e-6);
            assert_float_equal(light->position[1], 2, 0);
            assert_float_equal(light->axis[0], -1, 0);
            assert_float_equal(light->frame_x[2], 1, 0);
            assert_float_equal(light->frame_y[1], 1, 0);
            brume_arrays_free(&a);
            brume_scene_destroy(scene);
        }
}

static void test_emitters(void **state) {
    (void)state;
    brume_scene *scene = new_scene();
    brume_shape_desc rectangle = brume_shape_desc_default(BRUME_SHAPE_RECTANGLE);
    brume_shape_desc sphere = brume_shape_desc_default(BRUME_SHAPE_SPHERE);
    brume_shape_desc disk = brume_shape_desc_default(BRUME_SHAPE_DISK);
    brume_shape_desc dark = brume_shape_desc_default(BRUME_SHAPE_CUBE);
    brume_arrays a;
    rectangle.to_world[0] = 3, rectangle.to_world[5] = 0.5f;
    rectangle.radiance[0] = 2;
    sphere.radius = 0.25f;
    sphere.radiance[1] = 5;
    disk.to_world[0] = 2;
    disk.radiance[2] = 1;
    assert_int_equal(brume_scene_add_shape(scene, &sphere, NULL), BRUME_OK);
    assert_int_equal(brume_scene_add_shape(scene, &dark, NULL), BRUME_OK);
    assert_int_equal(brume_scene_add_shape(scene, &rectangle, NULL), BRUME_OK);
    assert_int_equal(brume_scene_add_shape(scene, &disk, NULL), BRUME_OK);
    build(scene, &a);
    /* Areas: half of 6 x 1 each; 4 pi r^2; pi times the half axes. */
    const double areas[4] = {3, 3, 4 * PI / 16, 2 * PI};
    const double luminances[4] = {2 * 0.2126, 2 * 0.2126, 5 * 0.7152, 0.0722};
    const int prims[4] = {12, 13, 14, 15}, shapes[4] = {2, 2, 0, 3};
    const int kinds[4] = {EMITTER_TRIANGLE, EMITTER_TRIANGLE, EMITTER_SPHERE, EMITTER_DISK};
    double total = 0;
    for (int i = 0; i < 4; i++)
        total += areas[i] * luminances[i];
    assert_int_equal(a.emitter_count, 4);
    assert_close(a.params.emitter_weight, total, 1e-6);
    const float *cdf = a.cdf + a.params.emitter_cdf;
    for (int i = 0; i < 4; i++) {
        assert_close(a.emitters[i].area, areas[i], 1e-6);
        assert_close(cdf[i + 1] - (double)cdf[i], areas[i] * luminances[i] / total, 1e-5);
        assert_int_equal(a.emitters[i].prim, prims[i]);
        assert_int_equal(a.emitters[i].shape, shapes[i]);
        assert_int_equal(a.emitters[i].kind, kinds[i]);
    }
    assert_float_equal(cdf[0], 0, 0);
    assert_float_equal(cdf[4], 1, 0);
    /* A shape without a bsdf is grey, and black if it emits. */
    assert_float_equal(a.bsdfs[a.shapes[1].bsdf].reflectance[0], 0.5f, 0);
    assert_float_equal(a.bsdfs[a.shapes[2].bsdf].reflectance[0], 0, 0);
    brume_arrays_free(&a);
    brume_scene_destroy(scene);
}

/* Luminance of the map as brume.h and cl/environment.h define it, at any (u, v). */
static double map_luminance(const float *texels, int width, int height, double u, double v) {
    double x = u * width - 0.5, y = v * (height - 1), sum = 0;
    for (int j = 0; j < height; j++)
        for (int i = -1; i <= width; i++) {
            double share = fmax(0, 1 - fabs(x - i)) * fmax(0, 1 - fabs(y - j));
            const float *t = texels + 3 * (j * width + (i + width) % width);
            sum += share * (0.2126 * t[0] + 0.7152 * t[1] + 0.0722 * t[2]);
        }
    return sum;
}

static void test_environment_tables(void **state) {
    (void)state;
    enum { WIDTH = 6, HEIGHT = 5, STEPS = 60 };
    float texels[3 * WIDTH * HEIGHT];
    for (int i = 0; i < 3 * WIDTH * HEIGHT; i++)
        texels[i] = (float)((i * 37) % 11) * (i % 7 == 0 ? 30.0f : 1.0f);
    for (int i = 0; i < 3 * WIDTH; i++)
        texels[3 * WIDTH * 3 + i] = 0; /* a black row between others */
    brume_scene *scene = new_scene();
    brume_light_desc sky = brume_light_desc_default(BRUME_LIGHT_ENVMAP);
    brume_arrays a;
    sky.width = WIDTH, sky.height = HEIGHT, sky.texels = texels, sky.scale = 0.5f;
    assert_int_equal(brume_scene_add_light(scene, &sky, NULL), BRUME_OK);
    build(scene, &a);
    double cells[HEIGHT][WIDTH], total = 0;
    for (int y = 0; y < HEIGHT; y++)
        for (int x = 0; x < WIDTH; x++) {
            cells[y][x] = 0;
            for (int j = 0; j < STEPS; j++)
                for (int i = 0; i < STEPS; i++) {
                    double u = (x + (i + 0.5) / STEPS) / WIDTH, v = (y + (j + 0.5) / STEPS) / HEIGHT;
                    cells[y][x] += map_luminance(texels, WIDTH, HEIGHT, u, v) * sin(PI * v);
                }
            total += cells[y][x];
        }
    const float *rows = a.cdf + a.params.environment_cdf, *columns = rows + HEIGHT + 1;
    assert_float_equal(rows[HEIGHT], 1, 0);
    for (int y = 0; y < HEIGHT; y++) {
        const float *row = columns + y * (WIDTH + 1);
        assert_float_equal(row[0], 0, 0);
        assert_float_equal(row[WIDTH], 1, 0);
        for (int x = 0; x < WIDTH; x++) {
            double p = ((double)rows[y + 1] - rows[y]) * ((double)row[x + 1] - row[x]);
            assert_close(p, cells[y][x] / total, 5e-4); /* the midpoint rule's error with 60 x 60 points */
        }
    }
    assert_float_equal(a.texels[3 * a.params.environment_first], 0.5f * texels[0], 0);
    brume_arrays_free(&a);
    brume_scene_destroy(scene);
}

/* A black map is no environment; a black row's conditional is still a table. */
static void test_dark_environments(void **state) {
    (void)state;
    static const float black[12] = {0};
    brume_scene *scene = new_scene();
    brume_light_desc sky = brume_light_desc_default(BRUME_LIGHT_ENVMAP);
    brume_arrays a;
    sky.width = sky.height = 2, sky.texels = black;
    assert_int_equal(brume_scene_add_light(scene, &sky, NULL), BRUME_OK);
    build(scene, &a);
    assert_int_equal(a.params.environment, ENVIRONMENT_NONE);
    assert_int_equal(a.features, 0);
    brume_arrays_free(&a);
    brume_scene_destroy(scene);
}

static void test_environment_rotation(void **state) {
    (void)state;
    static const float texel[3] = {1, 1, 1};
    brume_scene *scene = new_scene();
    brume_light_desc sky = brume_light_desc_default(BRUME_LIGHT_ENVMAP);
    brume_arrays a;
    sky.width = sky.height = 1, sky.texels = texel;
    /* 3, 4, 5: a turn about z, then one about x, scaled by 2 */
    static const float m[16] = {1.2f, -1.6f, 0, 9, 0.96f, 0.72f, -1.6f, 9, 1.28f, 0.96f, 1.2f, 9, 0, 0, 0, 1};
    memcpy(sky.to_world, m, sizeof m);
    assert_int_equal(brume_scene_add_light(scene, &sky, NULL), BRUME_OK);
    build(scene, &a);
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            assert_float_equal(a.params.environment_to_world[3 * i + j], m[4 * i + j] / 2, 2e-7);
            assert_float_equal(a.params.environment_to_local[3 * j + i], m[4 * i + j] / 2, 2e-7);
        }
    brume_arrays_free(&a);
    brume_scene_destroy(scene);
}

/* ---- reconstruction filters ----------------------------------------------------------------------------------- */

/* The filters as published, for any x; written from the papers, not from the library. */
static double published(const brume_film_desc *film, double x) {
    double t = fabs(x), b = 1.0 / 3, c = 1.0 / 3;
    switch (film->rfilter) {
    case BRUME_RFILTER_BOX: return t <= film->filter_radius;
    case BRUME_RFILTER_TENT: return fmax(0, 1 - t);
    case BRUME_RFILTER_GAUSSIAN: return t >= 2 ? 0 : exp(-2 * t * t) - exp(-8.0);
    case BRUME_RFILTER_LANCZOS:
        if (t >= 3) return 0;
        return t < 1e-9 ? 1 : sin(PI * t) / (PI * t) * sin(PI * t / 3) / (PI * t / 3);
    case BRUME_RFILTER_CATMULLROM: b = 0, c = 0.5; break;
    case BRUME_RFILTER_MITCHELL: break;
    }
    if (t < 1)
        return ((12 - 9 * b - 6 * c) * t * t * t + (-18 + 12 * b + 6 * c) * t * t + (6 - 2 * b)) / 6;
    if (t < 2)
        return ((-b - 6 * c) * t * t * t + (6 * b + 30 * c) * t * t + (-12 * b - 48 * c) * t + (8 * b + 24 * c)) / 6;
    return 0;
}

static void test_filters(void **state) {
    (void)state;
    static const double radii[6] = {0.75, 1, 2, 2, 2, 3};
    enum { FINE = 600000 };
    for (int kind = BRUME_RFILTER_BOX; kind <= BRUME_RFILTER_LANCZOS; kind++) {
        brume_scene *scene = new_scene();
        brume_film_desc film = brume_film_desc_default();
        brume_arrays a;
        film.rfilter = (brume_rfilter)kind;
        film.filter_radius = kind == BRUME_RFILTER_BOX ? 0.75f : 0;
        assert_int_equal(brume_scene_set_film(scene, &film), BRUME_OK);
        build(scene, &a);
        const int size = a.params.filter_size, zeros = (int)a.filter[size + 1];
        const float *zero = a.filter + size + 2;
        assert_int_equal(a.filter_count, size + 2 + zeros);
        assert_float_equal(a.params.filter_radius, radii[kind], 0);
        assert_float_equal(a.filter[0], -radii[kind], 0);
        assert_float_equal(a.filter[size], radii[kind], 0);

        /* Exact: masses of |f| and f, and the second moment. The table: its cumulative at every entry. */
        double h = 2 * radii[kind] / FINE, mass = 0, signed_mass = 0, moment = 0, below = 0, worst = 0;
        for (int i = 0; i < FINE; i++) {
            double x = -radii[kind] + (i + 0.5) * h, f = published(&film, x);
            mass += fabs(f) * h;
            signed_mass += f * h;
            moment += f * x * x * h;
        }
        int entry = 1;
        for (int i = 0; i < FINE; i++) {
            double x = -radii[kind] + (i + 1) * h;
            below += fabs(published(&film, x - 0.5 * h)) * h;
            while (entry < size && a.filter[entry] <= x) {
                worst = fmax(worst, fabs(below / mass - (double)entry / size));
                entry++;
            }
        }
        assert_true(worst < 1e-5); /* one step of the fine sum: at most 2 / FINE of the mass, times the peak */

        /* What the kernel gets: the mean of sign times weight is 1, and offsets spread as f does. */
        double mean = 0, spread = 0, weight = sqrt(a.params.filter_weight); /* of one axis */
        const int draws = 1 << 20;
        for (int i = 0; i < draws; i++) {
            double at = (i + 0.5) / draws * size;
            int k = (int)at;
            double x = a.filter[k] + (at - k) * ((double)a.filter[k + 1] - a.filter[k]);
            int sign = 1;
            for (int z = 0; z < zeros; z++)
                sign = fabs(x) > zero[z] ? -sign : sign;
            if (fabs(published(&film, x)) > 1e-6)
                assert_int_equal(sign, published(&film, x) > 0 ? 1 : -1);
            mean += sign * weight / draws;
            spread += sign * weight * x * x / draws;
        }
        assert_close(mean, 1, 1e-5); /* 2^20 points see a zero's place to 1e-6 of the mass, a few zeros */
        assert_close(weight, mass / signed_mass, 1e-3);
        /* Catmull and Rom's filter has no second moment: compare absolutely, in squared pixels. */
        assert_float_equal(spread, moment / signed_mass, 2e-3);
        brume_arrays_free(&a);
        brume_scene_destroy(scene);
    }
    brume_scene *scene = new_scene();
    brume_film_desc film = brume_film_desc_default();
    brume_arrays a;
    film.rfilter = BRUME_RFILTER_BOX;
    assert_int_equal(brume_scene_set_film(scene, &film), BRUME_OK);
    build(scene, &a);
    assert_int_equal(a.params.filter_size, 0);
    assert_float_equal(a.params.filter_weight, 1, 0);
    brume_arrays_free(&a);
    brume_scene_destroy(scene);
}

/* ---- features ------------------------------------------------------------------------------------------------- */

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
         FEATURE_ALL & ~(FEATURE_GUIDES | FEATURE_MANY_LIGHTS | FEATURE_CHROMATIC | FEATURE_ANISOTROPY), 1},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        brume_scene *scene = new_scene();
        brume_arrays a;
        for (const char *thing = rows[i].things; *thing; thing++)
            add_thing(scene, *thing);
        build(scene, &a);
        if (a.features != rows[i].features || a.params.surfaces_emit != rows[i].surfaces_emit)
            fail_msg("scene \"%s\": features %u, surfaces_emit %d", rows[i].things, a.features,
                     a.params.surfaces_emit);
        brume_arrays_free(&a);
        brume_scene_destroy(scene);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_field_of_view),        cmocka_unit_test(test_crop),
        cmocka_unit_test(test_no_sensor),            cmocka_unit_test(test_cube_faces_outwards),
        cmocka_unit_test(test_texture_coordinates),  cmocka_unit_test(test_normals),
        cmocka_unit_test(test_degenerate_triangles), cmocka_unit_test(test_quadrics),
        cmocka_unit_test(test_too_far),              cmocka_unit_test(test_spots),
        cmocka_unit_test(test_emitters),             cmocka_unit_test(test_environment_tables),
        cmocka_unit_test(test_dark_environments),    cmocka_unit_test(test_environment_rotation),
        cmocka_unit_test(test_filters),              cmocka_unit_test(test_features),
    };
    return cmocka_run_group_tests(tests, open_context, close_context);
}

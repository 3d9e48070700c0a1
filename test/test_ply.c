/* test_ply.c -- PLY files as they come: either byte order, elements and properties that mean nothing to us, polygons of
 * any form; and files that are cut off or promise what they don't hold. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include "device_test.h"
#include "mesh.h"
#include "mesh_polygon.h"
#include "scene_files.h"

static brume_context *context;

static int setup(void **state) {
    return brume_context_create(&context) == BRUME_OK ? scene_files_enter(state) : -1;
}

static int teardown(void **state) {
    brume_context_destroy(context);
    return scene_files_leave(state);
}

static brume_result read_bytes(const char *bytes, size_t size, brume_mesh *out) {
    const brume_mesh_options plain = {1, 0};
    scene_files_write("m.ply", bytes, size);
    return brume_mesh_read_ply(context, "m.ply", &plain, NULL, out);
}

static double area_of(const float *positions, const uint32_t *triangles, size_t count) {
    double sum = 0;
    for (size_t t = 0; t < count; t++, triangles += 3) {
        const float *a = positions + 3 * triangles[0], *b = positions + 3 * triangles[1];
        const float *c = positions + 3 * triangles[2];
        sum += 0.5 * (((double)b[0] - a[0]) * ((double)c[1] - a[1]) - ((double)b[1] - a[1]) * ((double)c[0] - a[0]));
    }
    return sum;
}

#define HEADER(format)                                                                                                 \
    "ply\nformat " format " 1.0\ncomment of no use\nobj_info neither\nelement camera 1\nproperty float fov\n"         \
    "property list uchar short notes\nelement vertex 3\nproperty uchar red\nproperty double x\nproperty float y\n"    \
    "property short z\nelement face 1\nproperty uchar flags\nproperty list ushort uint vertex_indices\nend_header\n"

/* The same triangle three times. */
static void test_formats(void **state) {
    (void)state;
    static const char ascii[] = HEADER("ascii") "50 2 7 -8\n255 0 0 3\n1 2 0 3\r\n0 0 4 3\n9 3 0 1 2";
    static const char little[] = HEADER("binary_little_endian")
        "\0\0\110\102" "\2\7\0\370\377"
        "\377" "\0\0\0\0\0\0\0\0" "\0\0\0\0" "\3\0"
        "\1" "\0\0\0\0\0\0\0\100" "\0\0\0\0" "\3\0"
        "\0" "\0\0\0\0\0\0\0\0" "\0\0\200\100" "\3\0"
        "\11" "\3\0" "\0\0\0\0\1\0\0\0\2\0\0\0";
    static const char big[] = HEADER("binary_big_endian")
        "\102\110\0\0" "\2\0\7\377\370"
        "\377" "\0\0\0\0\0\0\0\0" "\0\0\0\0" "\0\3"
        "\1" "\100\0\0\0\0\0\0\0" "\0\0\0\0" "\0\3"
        "\0" "\0\0\0\0\0\0\0\0" "\100\200\0\0" "\0\3"
        "\11" "\0\3" "\0\0\0\0\0\0\0\1\0\0\0\2";
    const struct { const char *bytes; size_t size; } files[] = {
        {ascii, sizeof ascii - 1}, {little, sizeof little - 1}, {big, sizeof big - 1}};
    static const float wanted[9] = {0, 0, 3, 2, 0, 3, 0, 4, 3};
    for (int i = 0; i < 3; i++) {
        brume_mesh mesh;
        if (read_bytes(files[i].bytes, files[i].size, &mesh) != BRUME_OK)
            fail_msg("file %d: %s", i, brume_context_message(context));
        assert_int_equal(mesh.vertex_count, 3);
        assert_int_equal(mesh.triangle_count, 1);
        assert_memory_equal(mesh.positions, wanted, sizeof wanted);
        brume_mesh_free(&mesh);
        /* No beginning of it is a file. */
        for (size_t size = 0; size < files[i].size - (i == 0); size++)
            assert_int_equal(read_bytes(files[i].bytes, size, &mesh), BRUME_ERROR_SCENE);
    }
}

/* Random polygons around the origin, most of them with corners that turn inwards: triangles that turn their way, and
 * as much area in all as by the shoelace formula. */
static void test_polygons(void **state) {
    (void)state;
    uint64_t random = 7;
    int concave = 0;
    for (int i = 0; i < 2000; i++) {
        float positions[3 * 60];
        uint32_t corners[60], triangles[3 * 60];
        size_t count = 3 + test_random_bits(&random) % 58;
        double area = 0;
        for (size_t k = 0; k < count; k++) {
            double angle = 6.283185307179586 * (double)k / (double)count, radius = 0.2 + test_random_unit(&random);
            positions[3 * k] = (float)(radius * cos(angle));
            positions[3 * k + 1] = (float)(radius * sin(angle));
            positions[3 * k + 2] = 5;
            corners[k] = (uint32_t)k;
        }
        for (size_t k = 0; k < count; k++) {
            const float *a = positions + 3 * k, *b = positions + 3 * ((k + 1) % count);
            area += 0.5 * ((double)a[0] * b[1] - (double)a[1] * b[0]);
        }
        assert_int_equal(brume_polygon_cut(corners, count, positions, triangles), count - 2);
        for (size_t t = 0; t < count - 2; t++) {
            double one = area_of(positions, triangles + 3 * t, 1);
            if (one < -1e-6) fail_msg("polygon %d, triangle %zu: area %g", i, t, one);
        }
        double sum = area_of(positions, triangles, count - 2);
        if (fabs(sum - area) > 1e-5 * area) fail_msg("polygon %d of %zu corners: %g; expected %g", i, count, sum, area);
        concave += triangles[0] != 0 || triangles[1] != 1;
    }
    assert_true(concave > 1000);
}

#define XYZ "property float x\nproperty float y\nproperty float z\n"
#define FACES "property list uchar int vertex_indices\n"

static void test_wrong_files(void **state) {
    (void)state;
    static const struct { const char *text, *words; } rows[] = {
        {"ply\nformat ascii 1.0\nelement vertex 600000000\n" XYZ "element face 1\n" FACES "end_header\n0 0 0\n",
         "cut off"},
        {"ply\nformat ascii 1.0\nelement vertex 99999999999999999999\n" XYZ "end_header\n", "cut off"},
        {"ply\nformat ascii 1.0\nelement vertex -1\n" XYZ "end_header\n", "line 3: expected a count"},
        {"ply\nformat ascii 1.0\nelement vertex 1\nproperty long x\nend_header\n", "line 4: expected a property"},
        {"ply\nformat ascii 1.0\nelement vertex 1\n" XYZ "property list float int a\nend_header\n", "line 7: expected"},
        {"ply\nformat ascii 2.0\nelement vertex 0\n" XYZ "end_header\n", "unknown format"},
        {"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n0\n", "x, y and z"},
        {"ply\nformat ascii 1.0\nelement vertex 1\n" XYZ "element face 1\n" FACES "end_header\n0 0 up\n3 0 0 0\n",
         "line 9: expected a number"},
        {"ply\nformat ascii 1.0\nelement face 1\n" FACES "element vertex 1\n" XYZ "end_header\n3 0 0 0\n0 0 0\n",
         "doesn't have"},
        {"ply\nformat ascii 1.0\nelement vertex 1\n" XYZ "element face 1\n" FACES "end_header\n0 0 0\n3 0 0 1e3\n",
         "doesn't have"},
        {"ply\nformat ascii 1.0\nelement vertex 1\n" XYZ "element face 1\n" FACES "end_header\n0 0 0\n3.7 0 0 0 0\n",
         "line 10: expected a whole number for the length of a list"},
        {"ply\nformat ascii 1.0\nelement vertex 1\n" XYZ "element face 1\n" FACES "end_header\n0 0 0\n3 0 .5 0\n",
         "line 10: expected a whole number for a vertex"},
        {"ply\nformat ascii 1.0\nelement vertex 1\n" XYZ "element face 1\nproperty list uchar float vertex_indices\n"
         "end_header\n0 0 0\n3 0 0 0.25\n", "line 10: expected a whole number for a vertex"},
        {"ply\nformat ascii 1.0\nelement vertex 1\n" XYZ "element notes 1\nproperty list uchar float a\nend_header\n"
         "0 0 0\n1.5 0 0\n", "line 10: expected a whole number for the length of a list"},
        {"ply\nfrmat ascii 1.0\nend_header\n", "'frmat' is not part of a PLY header"},
        {"{\"asset\":{\"version\":\"2.0\"}}\n", "begins with the line 'ply'"},
    };
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        brume_mesh mesh;
        assert_int_equal(read_bytes(rows[i].text, strlen(rows[i].text), &mesh), BRUME_ERROR_SCENE);
        if (!strstr(brume_context_message(context), rows[i].words))
            fail_msg("'%s' lacks '%s'", brume_context_message(context), rows[i].words);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_formats),
        cmocka_unit_test(test_polygons),
        cmocka_unit_test(test_wrong_files),
    };
    return cmocka_run_group_tests_name("ply", tests, setup, teardown);
}

/* test_mesh.c -- OBJ and PLY files written here and read back: polygons, indices, normals, seams, wrong files. */
#include <dirent.h>
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

#include "mesh.h"

static brume_context *context;
static char folder[] = "/tmp/brume-mesh-XXXXXX";
static char path[512];

static int open_all(void **state) {
    (void)state;
    return brume_context_create(&context) != BRUME_OK || !mkdtemp(folder);
}

static int close_all(void **state) {
    (void)state;
    DIR *dir = opendir(folder);
    for (struct dirent *entry; dir && (entry = readdir(dir));)
        if (entry->d_name[0] != '.') {
            snprintf(path, sizeof path, "%s/%s", folder, entry->d_name);
            remove(path);
        }
    closedir(dir);
    rmdir(folder);
    brume_context_destroy(context);
    return 0;
}

static void put(const char *name, const char *bytes, size_t size) {
    snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(bytes, 1, size, file), size);
    fclose(file);
}

static const brume_mesh_options plain = {1, 0}, smooth = {0, 0}, flipped = {1, 1};

static brume_mesh read_text(const char *name, const char *text, const brume_mesh_options *options) {
    brume_mesh mesh;
    put(name, text, strlen(text));
    int is_obj = strstr(name, ".obj") != NULL;
    if ((is_obj ? brume_mesh_read_obj : brume_mesh_read_ply)(context, path, options, NULL, &mesh) != BRUME_OK)
        fail_msg("%s", brume_context_message(context));
    return mesh;
}

static double area(const brume_mesh *mesh) {
    double sum = 0;
    for (uint32_t t = 0; t < mesh->triangle_count; t++) {
        double e[2][3], n2 = 0;
        const uint32_t *v = mesh->triangles + 3 * t;
        for (int k = 0; k < 2; k++)
            for (int i = 0; i < 3; i++)
                e[k][i] = mesh->positions[3 * v[k + 1] + i] - (double)mesh->positions[3 * v[0] + i];
        for (int i = 0; i < 3; i++) {
            double n = e[0][(i + 1) % 3] * e[1][(i + 2) % 3] - e[0][(i + 2) % 3] * e[1][(i + 1) % 3];
            n2 += n * n;
        }
        sum += 0.5 * sqrt(n2);
    }
    return sum;
}

/* ---- OBJ -------------------------------------------------------------------------------------------------------- */

#define SQUARE "v 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\n"

static void test_obj_faces(void **state) {
    (void)state;
    static const struct {
        const char *text;
        uint32_t vertices, triangles;
        double area;
    } rows[] = {
        {SQUARE "f 1 2 3\n", 3, 1, 2},
        {SQUARE "f 1 2 3 4\n", 4, 2, 4},
        {SQUARE "f -4 -3 -2 -1\n", 4, 2, 4},
        {SQUARE "f 1 2 3\nv 4 0 0\nf -1 -3 -4\n", 4, 2, 4},                 /* relative to what came before */
        {SQUARE "o a\ng x y\ns 1\nusemtl m\nf 1 2 3\ng z\nf 1 3 4\n", 4, 2, 4}, /* groups share vertices */
        {"v 0 0 0\nv 4 0 0\nv 4 4 0\nv 3 1 0\nf 1 2 3 4\n", 4, 2, 4},       /* concave: shoelace formula */
        {"v 0 0 0\nv 2 0 0\nv 3 1 0\nv 2 2 0\nv 0 2 0\nf 1 2 3 4 5\n", 5, 3, 5},
        {"# a comment\r\nmtllib none.mtl\r\nv 0 0 0\r\nv 1 0 0\r\nv 0 1 0\r\nf 1 2 3\r\n", 3, 1, 0.5},
        {"v +1e0 .0 -0.0 1 # w\nv 2. 0 0 0.5 0.5 0.5\n  v 1 1E+0 0\nf 1 2 3", 3, 1, 0.5},
        {SQUARE "f 1 2 3\nl 1 2\np 1\n", 3, 1, 2},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        brume_mesh mesh = read_text("a.obj", rows[i].text, &plain);
        if (mesh.vertex_count != rows[i].vertices || mesh.triangle_count != rows[i].triangles ||
            fabs(area(&mesh) - rows[i].area) > 1e-6)
            fail_msg("row %zu: %u vertices, %u triangles, area %g", i, mesh.vertex_count, mesh.triangle_count,
                     area(&mesh));
        assert_null(mesh.normals);
        assert_null(mesh.uvs);
        brume_mesh_free(&mesh);
        assert_null(mesh.positions);
    }
}

/* A vertex with two texture coordinates is two; the same triple twice is one. */
static void test_obj_seams(void **state) {
    (void)state;
    static const char text[] = SQUARE "vt 0 0\nvt 1 0.25\nvn 0 0 1\nvn 0 1 0\n"
                                      "f 1/1/1 2/1/1 3/1/1\nf 1/1/1 3/2/1 4/1/2\n";
    for (int flip = 0; flip < 2; flip++) {
        const brume_mesh_options options = {0, flip};
        brume_mesh mesh = read_text("s.obj", text, &options);
        assert_int_equal(mesh.vertex_count, 5);
        assert_int_equal(mesh.triangles[0], mesh.triangles[3]);
        uint32_t seam = mesh.triangles[4], turned = mesh.triangles[5];
        assert_int_not_equal(seam, mesh.triangles[2]);
        assert_float_equal(mesh.uvs[2 * seam], 1, 0);
        assert_float_equal(mesh.uvs[2 * seam + 1], flip ? 0.75 : 0.25, 0);
        assert_float_equal(mesh.normals[3 * turned + 1], 1, 0);
        brume_mesh_free(&mesh);
    }
}

/* Without normals in the file they are smooth, weighted by angle: at the given point Mitsuba 3.9 shades this roof by
 * (0.194305, -0.194305, 0.961504), interpolated over the first triangle with weights 0.35, 0.15 and 0.5. */
static void test_smooth_normals(void **state) {
    (void)state;
    static const char *const files[2][2] = {
        {"b.obj", "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 1\nf 1 2 3\nf 1 3 4\n"},
        {"b.ply", "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
                  "element face 2\nproperty list uchar int vertex_indices\nend_header\n"
                  "-1 -1 0\n1 -1 0\n1 1 0\n-1 1 1\n3 0 1 2\n3 0 2 3\n"},
    };
    for (int i = 0; i < 2; i++) {
        brume_mesh mesh = read_text(files[i][0], files[i][1], &smooth);
        static const double weights[3] = {0.35, 0.15, 0.5}, wanted[3] = {0.194305, -0.194305, 0.961504};
        double n[3] = {0}, length = 0;
        assert_int_equal(mesh.vertex_count, 4);
        assert_non_null(mesh.normals);
        for (int c = 0; c < 3; c++) {
            for (int k = 0; k < 3; k++)
                n[c] += weights[k] * mesh.normals[3 * mesh.triangles[k] + c];
            length += n[c] * n[c];
        }
        for (int c = 0; c < 3; c++)
            assert_float_equal(n[c] / sqrt(length), wanted[c], 2e-6);
        brume_mesh_free(&mesh);
        mesh = read_text(files[i][0], files[i][1], &plain);
        assert_null(mesh.normals);
        brume_mesh_free(&mesh);
    }
}

/* ---- PLY ----------------------------------------------------------------------------------------------------------
 */

#define PLY_XYZ "property float x\nproperty float y\nproperty float z\n"

static void test_ply(void **state) {
    (void)state;
    static const char text[] = "ply\nformat ascii 1.0\nelement vertex 4\n" PLY_XYZ
                               "property float nx\nproperty float ny\nproperty float nz\nproperty float u\n"
                               "property float v\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
                               "0 0 0 0 0 1 0 0\n2 0 0 0 0 1 1 0\n2 2 0 0 0 1 1 1\n0 2 0 0 0 1 0 0.25\n4 0 1 2 3\n";
    brume_mesh mesh = read_text("q.ply", text, &smooth);
    assert_int_equal(mesh.vertex_count, 4);
    assert_int_equal(mesh.triangle_count, 2);
    assert_float_equal(area(&mesh), 4, 1e-6);
    for (int i = 0; i < 4; i++) {
        assert_float_equal(mesh.normals[3 * i + 2], 1, 0);
        if (mesh.positions[3 * i] == 0 && mesh.positions[3 * i + 1] == 2)
            assert_float_equal(mesh.uvs[2 * i + 1], 0.25, 0);
    }
    brume_mesh_free(&mesh);
    mesh = read_text("q.ply", text, &flipped);
    assert_null(mesh.normals);
    for (int i = 0; i < 4; i++)
        if (mesh.positions[3 * i] == 0 && mesh.positions[3 * i + 1] == 2)
            assert_float_equal(mesh.uvs[2 * i + 1], 0.75, 0);
    brume_mesh_free(&mesh);
}

static void test_binary_ply(void **state) {
    (void)state;
    static const char header[] = "ply\nformat binary_little_endian 1.0\nelement vertex 3\n" PLY_XYZ
                                 "element face 1\nproperty list uchar int vertex_indices\nend_header\n";
    static const unsigned char body[] = {0, 0, 0, 0, 0, 0,    0,    0, 0, 0, 0, 0, /* 0 0 0 */
                                         0, 0, 0, 0x40, 0, 0, 0,    0, 0, 0, 0, 0, /* 2 0 0 */
                                         0, 0, 0, 0, 0, 0,    0x80, 0x3f, 0, 0, 0, 0, /* 0 1 0 */
                                         3, 0, 0, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0};
    char bytes[sizeof header - 1 + sizeof body];
    memcpy(bytes, header, sizeof header - 1);
    memcpy(bytes + sizeof header - 1, body, sizeof body);
    put("b.ply", bytes, sizeof bytes);
    brume_mesh mesh;
    assert_int_equal(brume_mesh_read_ply(context, path, &plain, NULL, &mesh), BRUME_OK);
    assert_int_equal(mesh.vertex_count, 3);
    assert_int_equal(mesh.triangle_count, 1);
    assert_float_equal(area(&mesh), 1, 1e-6);
    brume_mesh_free(&mesh);
}

/* ---- files that are wrong --------------------------------------------------------------------------------------- */

static void test_bad_files(void **state) {
    (void)state;
#define PLY_TRIANGLE(first, face)                                                                    \
    "ply\nformat ascii 1.0\nelement vertex 3\n" PLY_XYZ                                              \
    "element face 1\nproperty list uchar int vertex_indices\nend_header\n" first "\n1 0 0\n0 1 0\n" face "\n"
    static const struct {
        const char *name, *text, *words;
    } rows[] = {
        {"a.obj", "", "the file is empty"},
        {"a.obj", "# nothing\n", "no triangles"},
        {"a.obj", SQUARE, "no triangles"},
        {"a.obj", SQUARE "f 1 2\n", "no triangles"},
        {"a.obj", SQUARE "f 1 2 9\n", "doesn't have"},
        {"a.obj", SQUARE "f 1 2 3\nf 1 2 3 9\n", "doesn't have"},
        {"a.obj", SQUARE "f 1/1 2/2 3/3\n", "doesn't have"},
        {"a.obj", SQUARE "f 1//1 2//1 3//1\n", "doesn't have"},
        {"a.obj", SQUARE "f 0 1 2\n", "a.obj:5: "},
        {"a.obj", SQUARE "f -9 -8 -7\n", "a.obj"},
        {"a.obj", "v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n", "a.obj:2: expected three numbers after v"},
        {"a.obj", "v 0 0 0\r\nv 1 0 0\rv 0 up 0\rf 1 2 3\r", "a.obj:3: expected three numbers after v"},
        {"a.obj", "v 0 0 0\nv 0 1\nv 0 1 0\nf 1 2 3\n", "a.obj:2: "},
        {"a.obj", SQUARE "vn 0 0 up\nf 1 2 3\n", "a.obj:5: expected three numbers after vn"},
        {"a.obj", SQUARE "vt inf\nf 1 2 3\n", "a.obj:5: expected numbers after vt"},
        {"a.obj", "v 1e999 0 0\nv 0 1 0\nv 1 0 0\nf 1 2 3\n", "a.obj"},
        {"a.ply", "", "the file is empty"},
        {"a.ply", "ply\n", "a.ply: "},
        {"a.ply", "not a mesh at all", "not a readable mesh"},
        {"a.ply", PLY_TRIANGLE("nan 0 0", "3 0 1 2"), "a.ply: "},
        {"a.ply", PLY_TRIANGLE("0 0 0", "3 0 1 7"), "a.ply: "},
        {"a.ply", PLY_TRIANGLE("0 0 0", "3 0 1 -1"), "a.ply: "},
        {"a.ply", PLY_TRIANGLE("0 0 0", "2 0 1"), "a.ply: "},
        {"a.ply", "ply\nformat ascii 1.0\nelement vertex 1\n" PLY_XYZ "end_header\n0 0 0\n", "a.ply: "},
        {"a.unknown", "what is this", "not a readable mesh"},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        brume_mesh mesh = {.vertex_count = 77};
        put(rows[i].name, rows[i].text, strlen(rows[i].text));
        int is_obj = strstr(rows[i].name, ".obj") != NULL;
        brume_result result = (is_obj ? brume_mesh_read_obj : brume_mesh_read_ply)(context, path, &smooth, "s.xml:1:2",
                                                                                   &mesh);
        const char *said = brume_context_message(context);
        if (result != BRUME_ERROR_SCENE || !strstr(said, rows[i].words) || strncmp(said, "s.xml:1:2: ", 11) != 0 ||
            strchr(said, '\n') || mesh.vertex_count != 77)
            fail_msg("row %zu: result %d, \"%s\" instead of \"%s\"", i, result, said, rows[i].words);
    }
}

static void test_missing_files(void **state) {
    (void)state;
    brume_mesh mesh;
    assert_int_equal(brume_mesh_read_obj(context, "/nowhere/a.obj", &plain, NULL, &mesh), BRUME_ERROR_SCENE);
    assert_non_null(strstr(brume_context_message(context), "/nowhere/a.obj: No such file"));
    /* What has no end is not read. */
    assert_int_equal(brume_mesh_read_obj(context, "/dev/zero", &plain, NULL, &mesh), BRUME_ERROR_SCENE);
    assert_non_null(strstr(brume_context_message(context), "/dev/zero: Operation not supported"));
    assert_int_equal(brume_mesh_read_ply(context, "/nowhere/a.ply", &plain, NULL, &mesh), BRUME_ERROR_SCENE);
    assert_non_null(strstr(brume_context_message(context), "/nowhere/a.ply: No such file"));
    assert_int_equal(brume_mesh_read_obj(context, NULL, &plain, NULL, &mesh), BRUME_ERROR_ARGUMENT);
    assert_int_equal(brume_mesh_read_ply(context, "a", NULL, NULL, &mesh), BRUME_ERROR_ARGUMENT);
    brume_mesh_free(NULL);
}

/* Lines that end as those of old Macs did, as those of Windows do, and a word of bones on one of them. */
static void test_line_ends(void **state) {
    (void)state;
    static const char *const files[] = {"v 0 0 0\rv 1 0 0\rv 0 1 0\rvw 0 1e30 1\rf 1 2 3\r",
                                        "v 0 0 0\r\nv 1 0 0\r\nv 0 1 0\r\nvw 0 1e30 1\r\nf 1 2 3",
                                        "v 0 0 0\r\rv 1 0 0\n\rv 0 1 0\r\n\r\n\tvw 0 1e30 1\rf 1 2 3"};
    for (int i = 0; i < 3; i++) {
        brume_mesh mesh = read_text("lines.obj", files[i], &plain);
        assert_int_equal(mesh.triangle_count, 1);
        assert_float_equal(area(&mesh), 0.5, 1e-7);
        brume_mesh_free(&mesh);
    }
}

/* Every cut and many damaged bytes: read or refused, but never worse (this one is for the sanitizers). */
static void test_damaged_obj(void **state) {
    (void)state;
    static const char text[] = SQUARE "vt 0 0\nvn 0 0 1\nf 1/1/1 2/1/1 3/1/1 4/1/1\nf -1//-1 -2//-1 -3//-1\n";
    char damaged[sizeof text];
    for (size_t i = 1; i < sizeof text; i++)
        for (int how = 0; how < 5; how++) {
            brume_mesh mesh;
            memcpy(damaged, text, sizeof text);
            damaged[i - 1] = how == 0 ? damaged[i - 1] : "-/9\n"[how - 1];
            put("d.obj", damaged, how == 0 ? i : sizeof text - 1);
            if (brume_mesh_read_obj(context, path, &smooth, NULL, &mesh) == BRUME_OK)
                brume_mesh_free(&mesh);
        }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_obj_faces), cmocka_unit_test(test_obj_seams),   cmocka_unit_test(test_smooth_normals),
        cmocka_unit_test(test_ply),       cmocka_unit_test(test_binary_ply),
        cmocka_unit_test(test_bad_files), cmocka_unit_test(test_missing_files), cmocka_unit_test(test_damaged_obj),
        cmocka_unit_test(test_line_ends),
    };
    return cmocka_run_group_tests(tests, open_all, close_all);
}

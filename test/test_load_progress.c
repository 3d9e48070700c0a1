/* test_load_progress.c -- whoever waits for a long mesh is told how far it is, and can end the reading; the mesh is the
 * same, told or not. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "mesh.h"
#include "scene_files.h"

enum { SIDE = 200, VERTICES = (SIDE + 1) * (SIDE + 1), FACES = SIDE * SIDE };

static brume_context *context;

/* What the callback was told. */
typedef struct told {
    const char *path;
    double last;
    int count, stop_at, wrong;
} told;

static int tell(void *user, const brume_load_progress *progress) {
    told *t = user;
    t->wrong += strcmp(progress->path, t->path) != 0 || !(progress->fraction >= t->last && progress->fraction <= 1);
    t->last = progress->fraction;
    return ++t->count == t->stop_at;
}

/* A grid, in text that both formats have in common: vertices, then faces. */
static void write_grid(const char *path, int is_obj) {
    FILE *file = fopen(path, "w");
    assert_non_null(file);
    if (!is_obj)
        fprintf(file, "ply\nformat ascii 1.0\nelement vertex %d\nproperty float x\nproperty float y\nproperty float z\n"
                "element face %d\nproperty list uchar int vertex_indices\nend_header\n", VERTICES, FACES);
    for (int y = 0; y <= SIDE; y++)
        for (int x = 0; x <= SIDE; x++) fprintf(file, "%s%d %d %d\n", is_obj ? "v " : "", x, y, (x * y) % 7);
    for (int y = 0; y < SIDE; y++)
        for (int x = 0; x < SIDE; x++) {
            int at = y * (SIDE + 1) + x + is_obj;
            fprintf(file, "%s %d %d %d %d\n", is_obj ? "f" : "4", at, at + 1, at + SIDE + 2, at + SIDE + 1);
        }
    assert_int_equal(fclose(file), 0);
}

static int setup(void **state) {
    if (brume_context_create(&context) != BRUME_OK || scene_files_enter(state) != 0) return -1;
    write_grid("grid.obj", 1);
    write_grid("grid.ply", 0);
    return 0;
}

static int teardown(void **state) {
    brume_context_destroy(context);
    remove("grid.obj");
    remove("grid.ply");
    return scene_files_leave(state);
}

static brume_result read_grid(int is_obj, told *t, brume_mesh *out) {
    const brume_mesh_options plain = {1, 0};
    t->path = is_obj ? "grid.obj" : "grid.ply";
    return (is_obj ? brume_mesh_read_obj : brume_mesh_read_ply)(context, t->path, &plain, NULL, out);
}

static void it_comes_nearer(void **state) {
    (void)state;
    for (int is_obj = 0; is_obj < 2; is_obj++) {
        told silent = {0}, t = {0};
        brume_mesh before, mesh;
        assert_int_equal(read_grid(is_obj, &silent, &before), BRUME_OK);
        assert_int_equal(silent.count, 0);
        context->load_interval = -1; /* whenever it could */
        brume_context_set_load_progress(context, tell, &t);
        assert_int_equal(read_grid(is_obj, &t, &mesh), BRUME_OK);
        brume_context_set_load_progress(context, NULL, NULL);
        print_message("told %d times, at last %.2f\n", t.count, t.last);
        assert_int_equal(t.wrong, 0);
        assert_true(t.count >= 4 && t.last > 0.5);
        assert_int_equal(mesh.triangle_count, 2 * FACES);
        assert_int_equal(mesh.triangle_count, before.triangle_count);
        assert_int_equal(mesh.vertex_count, before.vertex_count);
        assert_memory_equal(mesh.positions, before.positions, 3 * VERTICES * sizeof(float));
        assert_memory_equal(mesh.triangles, before.triangles, 6 * FACES * sizeof(uint32_t));
        brume_mesh_free(&mesh);
        brume_mesh_free(&before);
    }
}

/* Wherever it is told to stop. */
static void it_can_be_ended(void **state) {
    (void)state;
    context->load_interval = -1;
    for (int is_obj = 0; is_obj < 2; is_obj++) {
        told all = {0};
        brume_mesh mesh;
        brume_context_set_load_progress(context, tell, &all);
        assert_int_equal(read_grid(is_obj, &all, &mesh), BRUME_OK);
        brume_mesh_free(&mesh);
        for (int stop_at = 1; stop_at <= all.count; stop_at++) {
            told t = {0};
            t.stop_at = stop_at;
            brume_context_set_load_progress(context, tell, &t);
            assert_int_equal(read_grid(is_obj, &t, &mesh), BRUME_CANCELLED);
            assert_int_equal(t.count, stop_at);
            assert_non_null(strstr(brume_context_message(context), "reading was cancelled"));
        }
    }
    brume_context_set_load_progress(context, NULL, NULL);
}

/* By the public calls: nothing of the scene is left; and no one is asked again. */
static void a_scene_is_given_up(void **state) {
    (void)state;
    static const char text[] = "<scene version='3.0.0'><shape type='ply'><string name='filename' value='grid.ply'/>"
                               "</shape><shape type='ply'><string name='filename' value='grid.ply'/></shape></scene>";
    brume_scene *scene = NULL;
    told t = {0};
    t.path = "grid.ply";
    t.stop_at = 2;
    scene_files_write("grid.xml", text, sizeof text - 1);
    context->load_interval = -1;
    brume_context_set_load_progress(context, tell, &t);
    assert_int_equal(brume_scene_load(context, "grid.xml", NULL, 0, &scene), BRUME_CANCELLED);
    brume_context_set_load_progress(context, NULL, NULL);
    assert_null(scene);
    assert_int_equal(t.count, 2);
    assert_int_equal(t.wrong, 0);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(it_comes_nearer),
        cmocka_unit_test(it_can_be_ended),
        cmocka_unit_test(a_scene_is_given_up),
    };
    return cmocka_run_group_tests_name("progress of reading", tests, setup, teardown);
}

/* test_threads.c -- contexts in several threads are independent: films to the bit, error messages, and a render that
 * another thread cancels; a hierarchy that several threads build, and a film that several devices share. `make
 * check-threads` runs it under ThreadSanitizer. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "ball.h"
#include "bvh.h"
#include "meshes.h"
#include "open_device.h"
#include "platform.h"
#include "render.h"

enum { WIDTH = 61, HEIGHT = 47, FLOATS = 3 * WIDTH * HEIGHT, LOADS = 60 };

/* What one thread does with a context of its own, from its first call to its last. */
typedef struct job {
    int kind;
    uint32_t samples, lanes, quick_start;
    int in_halves;              /* of the device, which share the render */
    int cancelled; /* how often run came back so: it is then called again */
    brume_render *render;
    int awaits;                 /* somebody who has cancelled once */
    int running, asked, done;   /* atomically */
    brume_result result;
    char message[256];
    float film[FLOATS];
} job;

static brume_result open_in_halves(brume_context *own, brume_device **out) {
    brume_device *halves[2] = {NULL, NULL};
    brume_result result = brume_device_open_part(own, BRUME_DEVICE_ANY, 0, 2, &halves[0]);
    if (!result) result = brume_device_open_part(own, BRUME_DEVICE_ANY, 1, 2, &halves[1]);
    if (!result) result = brume_device_join(halves, 2, out);
    brume_device_destroy(halves[0]);
    brume_device_destroy(halves[1]);
    return result;
}

static brume_result run(job *j, brume_context *own) {
    brume_device *opened = NULL;
    brume_scene *scene = NULL;
    brume_render_desc desc = brume_render_desc_default();
    desc.sample_count = j->samples;
    desc.lanes = j->lanes;
    desc.quick_start = j->quick_start;
    brume_result result = j->in_halves ? open_in_halves(own, &opened)
                                       : brume_device_open(own, BRUME_DEVICE_ANY, &opened);
    if (!result)
        result = ball_in_fog(own, j->kind ? BRUME_LIGHT_CONSTANT : BRUME_LIGHT_POINT, WIDTH, HEIGHT, &scene);
    if (!result) result = brume_render_create(opened, scene, &desc, &j->render);
    /* The film is small: else it may be done before anybody looks for the program that takes over. */
    if (!result && j->render->program.awaited) j->render->program.swap_at = 2;
    if (!result) {
        __atomic_store_n(&j->running, 1, __ATOMIC_RELEASE);
        while (j->awaits && !__atomic_load_n(&j->asked, __ATOMIC_ACQUIRE)) brume_sleep(0.001);
        while ((result = brume_render_run(j->render, NULL, NULL)) == BRUME_CANCELLED) j->cancelled++;
    }
    if (!result) result = brume_render_read(j->render, BRUME_CHANNEL_RADIANCE, j->film, FLOATS);
    brume_scene_destroy(scene);
    brume_device_destroy(opened);
    return result;
}

static void work(void *argument) {
    job *j = argument;
    brume_context *own = NULL;
    j->result = brume_context_create(&own);
    if (!j->result) j->result = run(j, own);
    snprintf(j->message, sizeof j->message, "%s", own ? brume_context_message(own) : "");
    brume_context_destroy(own);
    __atomic_store_n(&j->done, 1, __ATOMIC_RELEASE);
}

/* The render stays until here: whoever cancels it may do so until then. */
static void finish(job *j) {
    brume_render_destroy(j->render);
    if (j->result) fail_msg("%s: %s", brume_result_name(j->result), j->message);
}

static void start(job *j, int kind, uint32_t samples, uint32_t lanes, uint32_t quick_start) {
    memset(j, 0, sizeof *j);
    j->kind = kind;
    j->samples = samples;
    j->lanes = lanes;
    j->quick_start = quick_start;
}

static job alone, first, second;

static void at_once(uint32_t lanes, uint32_t quick_start) {
    start(&first, 0, 8, lanes, quick_start);
    start(&second, 1, 8, lanes, quick_start);
    brume_thread *a = brume_thread_start(work, &first), *b = brume_thread_start(work, &second);
    assert_non_null(a);
    assert_non_null(b);
    brume_thread_join(a);
    brume_thread_join(b);
    finish(&first);
    finish(&second);
}

static void two_threads_give_the_films_of_one(void **state) {
    (void)state;
    NEEDS_DEVICE();
    static float expected[2][FLOATS];
    for (int kind = 0; kind < 2; kind++) {
        start(&alone, kind, 8, 1, 0);
        work(&alone);
        memcpy(expected[kind], alone.film, sizeof alone.film);
        finish(&alone);
    }
    assert_memory_not_equal(expected[0], expected[1], sizeof expected[0]);
    at_once(1, 0);
    assert_memory_equal(first.film, expected[0], sizeof first.film);
    assert_memory_equal(second.film, expected[1], sizeof second.film);
    /* And with threads of the library's own below them, which build what takes over. */
    at_once(0, 1);
    assert_memory_equal(first.film, expected[0], sizeof first.film);
    assert_memory_equal(second.film, expected[1], sizeof second.film);
}

/* ---- several devices ------------------------------------------------------------------------------------------- */

/* Each has a thread while a launch lasts. */
static void two_devices_give_the_film_of_one(void **state) {
    (void)state;
    brume_device *none = NULL;
    if (!device || open_in_halves(context, &none) != BRUME_OK) skip();
    brume_device_destroy(none);
    start(&alone, 0, 64, 1, 0);
    work(&alone);
    finish(&alone);
    start(&first, 0, 64, 1, 0);
    first.in_halves = 1;
    work(&first);
    finish(&first);
    assert_memory_equal(first.film, alone.film, sizeof alone.film);
}

/* ---- cancelling ------------------------------------------------------------------------------------------------ */

/* A third thread, which cancels a render again and again while it runs. */
static void cancel(void *argument) {
    job *j = argument;
    while (!__atomic_load_n(&j->running, __ATOMIC_ACQUIRE) && !__atomic_load_n(&j->done, __ATOMIC_ACQUIRE))
        brume_sleep(0.001);
    for (int i = 0; i < 20 && !__atomic_load_n(&j->done, __ATOMIC_ACQUIRE); i++) {
        brume_render_cancel(j->render);
        __atomic_store_n(&j->asked, 1, __ATOMIC_RELEASE);
        brume_sleep(0.02);
    }
}

static void a_third_thread_may_cancel(void **state) {
    (void)state;
    NEEDS_DEVICE();
    start(&alone, 0, 64, 1, 0);
    work(&alone);
    assert_int_equal(alone.cancelled, 0);
    finish(&alone);
    start(&first, 0, 64, 1, 0);
    start(&second, 0, 64, 1, 0);
    first.awaits = 1;
    brume_thread *a = brume_thread_start(work, &first), *b = brume_thread_start(work, &second);
    brume_thread *c = brume_thread_start(cancel, &first);
    assert_non_null(a);
    assert_non_null(b);
    assert_non_null(c);
    brume_thread_join(a);
    brume_thread_join(b);
    brume_thread_join(c);
    finish(&first);
    finish(&second);
    assert_true(first.cancelled > 0);
    assert_int_equal(second.cancelled, 0);
    /* However often it was stopped and went on. */
    assert_memory_equal(first.film, alone.film, sizeof alone.film);
    assert_memory_equal(second.film, alone.film, sizeof alone.film);
}

/* ---- reading --------------------------------------------------------------------------------------------------- */

/* Loads a file that can't be read again and again: the message is always the one for it. */
typedef struct reader {
    char path[256], expected[256];
    int wrong, failed;
} reader;

static void read_wrong_scene(void *argument) {
    reader *r = argument;
    for (int i = 0; i < LOADS; i++) {
        brume_context *own = NULL;
        brume_scene *scene = NULL;
        if (brume_context_create(&own)) {
            r->failed = 1;
            return;
        }
        r->wrong += brume_scene_load(own, r->path, NULL, 0, &scene) != BRUME_ERROR_SCENE ||
                    !strstr(brume_context_message(own), r->expected);
        brume_scene_destroy(scene);
        brume_context_destroy(own);
    }
}

static void write_text(const char *path, const char *text) {
    FILE *file = fopen(path, "w");
    assert_non_null(file);
    assert_true(fputs(text, file) >= 0);
    assert_int_equal(fclose(file), 0);
}

static void messages_stay_in_their_thread(void **state) {
    (void)state;
    static const char *const meshes[2] = {"ply\nformat nonsense 1.0\nend_header\n", "none at all\n"};
    static reader readers[2];
    const char *build = getenv("BRUME_BUILD") ? getenv("BRUME_BUILD") : "build";
    char mesh[2][256], text[512];
    for (int i = 0; i < 2; i++) {
        reader *r = &readers[i];
        memset(r, 0, sizeof *r);
        snprintf(mesh[i], sizeof mesh[i], "%s/test_threads-%d.ply", build, i);
        snprintf(r->path, sizeof r->path, "%s/test_threads-%d.xml", build, i);
        snprintf(text, sizeof text,
                 "<scene version='3.0.0'>\n%s<shape type='ply'><string name='filename' value='test_threads-%d.ply'/>"
                 "</shape></scene>\n", i ? "\n" : "", i);
        write_text(mesh[i], meshes[i]);
        write_text(r->path, text);
        /* What one thread says alone. */
        brume_context *own = NULL;
        brume_scene *scene = NULL;
        assert_int_equal(brume_context_create(&own), BRUME_OK);
        assert_int_equal(brume_scene_load(own, r->path, NULL, 0, &scene), BRUME_ERROR_SCENE);
        snprintf(r->expected, sizeof r->expected, "%s", brume_context_message(own));
        brume_context_destroy(own);
    }
    assert_string_not_equal(readers[0].expected, readers[1].expected);
    brume_thread *a = brume_thread_start(read_wrong_scene, &readers[0]);
    brume_thread *b = brume_thread_start(read_wrong_scene, &readers[1]);
    assert_non_null(a);
    assert_non_null(b);
    brume_thread_join(a);
    brume_thread_join(b);
    for (int i = 0; i < 2; i++) {
        remove(mesh[i]);
        remove(readers[i].path);
        assert_int_equal(readers[i].failed, 0);
        assert_int_equal(readers[i].wrong, 0);
    }
}

/* ---- the hierarchy, which the library builds in threads of its own --------------------------------------------- */

static void a_hierarchy_by_several_threads(void **state) {
    (void)state;
    test_mesh m = test_mesh_terrain(260);
    brume_bvh one, three;
    brume_result by_one = brume_bvh_build_threaded(NULL, 1, m.positions, m.triangles, m.triangle_count, NULL, 0, &one);
    brume_result by_three = brume_bvh_build_threaded(NULL, 3, m.positions, m.triangles, m.triangle_count, NULL, 0,
                                                     &three);
    assert_int_equal(by_one, BRUME_OK);
    assert_int_equal(by_three, BRUME_OK);
    assert_int_equal(one.node_count, three.node_count);
    assert_memory_equal(one.nodes, three.nodes, one.node_count * sizeof *one.nodes);
    brume_bvh_free(&one);
    brume_bvh_free(&three);
    test_mesh_free(&m);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(two_threads_give_the_films_of_one),
        cmocka_unit_test(two_devices_give_the_film_of_one),
        cmocka_unit_test(a_third_thread_may_cancel),
        cmocka_unit_test(messages_stay_in_their_thread),
        cmocka_unit_test(a_hierarchy_by_several_threads),
    };
    return cmocka_run_group_tests(tests, open_device, close_device);
}

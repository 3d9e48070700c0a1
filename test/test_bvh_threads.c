/* test_bvh_threads.c -- the hierarchy built by several threads: the same bits as by one, with fewer threads where some
 * don't start, and an error where one of them finds no memory. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <pthread.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "bvh.h"
#include "faults/host_shim.h"
#include "meshes.h"
#include "parallel.h"

/* ---- threads that don't start ----------------------------------------------------------------------------------- */

static int most_threads = -1; /* how many may start from now on; < 0: all */
static int started;

/* Sanitizers have a pthread_create of their own. */
#if defined(__SANITIZE_THREAD__) || defined(__SANITIZE_ADDRESS__)
#define SANITIZED 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define SANITIZED 1
#endif
#endif

#if defined(__GLIBC__) && !defined(SANITIZED)
enum { CAN_REFUSE = 1 };

__attribute__((visibility("default"))) int pthread_create(pthread_t *thread, const pthread_attr_t *attributes,
                                                          void *(*work)(void *), void *argument) {
    int (*next)(pthread_t *, const pthread_attr_t *, void *(*)(void *), void *);
    void *found = dlsym(RTLD_NEXT, "pthread_create");
    memcpy(&next, &found, sizeof next);
    if (most_threads >= 0 && started >= most_threads) return EAGAIN;
    started++;
    return next(thread, attributes, work, argument);
}
#else
enum { CAN_REFUSE = 0 };
#endif

/* ---- parallel.h ------------------------------------------------------------------------------------------------- */

enum { PIECES = 1000 };

static int taken[PIECES];
static int in_order;

static void take(void *user, uint32_t i) {
    if (user) in_order &= i == 0 || __atomic_load_n(&taken[i - 1], __ATOMIC_RELAXED) == 1;
    __atomic_fetch_add(&taken[i], 1, __ATOMIC_RELAXED);
}

static void every_piece_once(void **state) {
    (void)state;
    static const uint32_t threads[] = {0, 1, 2, 3, 16, 1000};
    for (size_t t = 0; t < sizeof threads / sizeof *threads; t++) {
        memset(taken, 0, sizeof taken);
        brume_parallel(threads[t], PIECES, take, NULL);
        for (int i = 0; i < PIECES; i++) assert_int_equal(taken[i], 1);
    }
    brume_parallel(4, 0, take, NULL);
    assert_int_equal(taken[0], 1);
    memset(taken, 0, sizeof taken);
    in_order = 1;
    brume_parallel(1, PIECES, take, &in_order);
    assert_true(in_order);
}

/* ---- the same bits ---------------------------------------------------------------------------------------------- */

static brume_result build(const test_mesh *m, uint32_t threads, brume_bvh *out) {
    return brume_bvh_build_threaded(NULL, threads, m->positions, m->triangles, m->triangle_count, m->quadrics,
                                    m->quadric_count, out);
}

static void assert_same(const brume_bvh *a, const brume_bvh *b) {
    assert_int_equal(a->node_count, b->node_count);
    assert_int_equal(a->block_count, b->block_count);
    assert_int_equal(a->quadric_block_count, b->quadric_block_count);
    assert_int_equal(a->depth, b->depth);
    assert_int_equal(a->stack_size, b->stack_size);
    assert_memory_equal(a->nodes, b->nodes, a->node_count * sizeof *a->nodes);
    if (a->block_count) assert_memory_equal(a->blocks, b->blocks, a->block_count * sizeof *a->blocks);
    if (a->quadric_block_count)
        assert_memory_equal(a->quadric_ids, b->quadric_ids, a->quadric_block_count * 8 * sizeof *a->quadric_ids);
}

static void check(test_mesh *m) {
    static const uint32_t threads[] = {2, 3, 7};
    brume_bvh one, more;
    assert_int_equal(build(m, 1, &one), BRUME_OK);
    for (int i = 0; i < 3; i++) {
        started = 0;
        assert_int_equal(build(m, threads[i], &more), BRUME_OK);
        if (CAN_REFUSE) assert_true(started > 0);
        assert_same(&one, &more);
        brume_bvh_free(&more);
    }
    brume_bvh_free(&one);
    test_mesh_free(m);
}

/* Triangles and spheres together, some of them in one place, others on all scales. */
static test_mesh mixed(void) {
    test_mesh m = test_mesh_quadrics(40000, 3), soup = test_mesh_soup(90000, 1, 0.01, 4);
    free(m.positions);
    free(m.triangles);
    m.positions = soup.positions, m.triangles = soup.triangles, m.triangle_count = soup.triangle_count;
    for (uint32_t i = 0; i < 10000; i++)
        for (int a = 0; a < 3; a++) m.quadrics[i].center[a] = 0.5f;
    for (uint32_t i = 0; i < 9 * 30000; i++) m.positions[i] = (float)(i % 9 < 3 ? 0.5 : 0.5 + 0.01 * (i % 9));
    return m;
}

static void the_same_bits(void **state) {
    (void)state;
    test_mesh meshes[] = {test_mesh_terrain(400), test_mesh_soup(150000, 1, 0.05, 1), test_mesh_slivers(120000),
                          mixed()};
    for (int i = 0; i < 4; i++) check(&meshes[i]);
    /* Nothing parts them: one thread does it all. */
    test_mesh m = test_mesh_soup(120000, 1, 1, 5);
    for (uint32_t i = 1; i < m.triangle_count; i++) m.triangles[i] = m.triangles[0];
    check(&m);
    /* The heuristic peels off one size after the other, down to the depth where it gives up. */
    m = test_mesh_soup(120000, 1, 0.1, 6);
    for (uint32_t i = 0; i < m.triangle_count; i++)
        for (int k = 0; k < 9; k++) m.positions[9 * i + k] *= (float)(1e-18 + 1e18 / (1 + (double)i * i * i));
    check(&m);
}

static void few_primitives_start_no_thread(void **state) {
    (void)state;
    if (!CAN_REFUSE) skip();
    test_mesh m = test_mesh_soup(20000, 1, 0.05, 1);
    brume_bvh bvh;
    started = 0;
    assert_int_equal(build(&m, 64, &bvh), BRUME_OK);
    assert_int_equal(started, 0);
    brume_bvh_free(&bvh);
    test_mesh_free(&m);
}

/* ---- faults ----------------------------------------------------------------------------------------------------- */

static void threads_that_do_not_start(void **state) {
    (void)state;
    if (!CAN_REFUSE) skip();
    test_mesh m = test_mesh_terrain(300);
    brume_bvh one, more;
    assert_int_equal(build(&m, 1, &one), BRUME_OK);
    for (int most = 0; most < 12; most++) {
        most_threads = most;
        started = 0;
        assert_int_equal(build(&m, 4, &more), BRUME_OK);
        most_threads = -1;
        assert_int_equal(started, most);
        assert_same(&one, &more);
        brume_bvh_free(&more);
    }
    brume_bvh_free(&one);
    test_mesh_free(&m);
}

/* The n-th allocation of this thread, or of the others, fails. Returns 0 if there was none, 1 if the build went on, as
 * it does without the thread that was to be started, 2 if it ended in an error. */
static int fail_allocation(const test_mesh *m, const brume_bvh *expected, unsigned n, int of_others) {
    char who[256];
    brume_bvh bvh = {0};
    host_shim_begin(n, 0);
    host_shim_of_others(of_others);
    brume_result result = build(m, 4, &bvh);
    int fired = host_shim_fired();
    host_shim_end();
    if (result == BRUME_OK) assert_same(expected, &bvh);
    else assert_int_equal(result, BRUME_ERROR_MEMORY);
    assert_true(fired || result == BRUME_OK);
    brume_bvh_free(&bvh);
    if (host_shim_left(who)) fail_msg("after allocation %u failed something is left of %s", n, who);
    return fired + (result != BRUME_OK);
}

static void memory_runs_out(void **state) {
    (void)state;
    if (!host_shim_works()) skip();
    test_mesh m = test_mesh_terrain(200);
    brume_bvh one;
    unsigned ends[3] = {0}, others[3] = {0};
    assert_int_equal(build(&m, 1, &one), BRUME_OK);
    for (unsigned n = 1; ends[0] < 5 && n < 1000; n++) ends[fail_allocation(&m, &one, n, 0)]++;
    assert_int_equal(ends[0], 5); /* there are not always as many: threads take chunks as it comes */
    assert_true(ends[1] > 0);
    assert_true(ends[2] > 8);
    /* Whether another thread gets to an allocation is chance, too. */
    for (int k = 0; k < 200 && others[2] < 10; k++) others[fail_allocation(&m, &one, 1, 1)]++;
    assert_int_equal(others[1], 0);
    assert_true(others[2] > 0);
    print_message("%u failures went on, %u were reported; in other threads %u\n", ends[1], ends[2], others[2]);
    brume_bvh_free(&one);
    test_mesh_free(&m);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_piece_once),
        cmocka_unit_test(the_same_bits),
        cmocka_unit_test(few_primitives_start_no_thread),
        cmocka_unit_test(threads_that_do_not_start),
        cmocka_unit_test(memory_runs_out),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

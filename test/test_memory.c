/* test_memory.c -- memory that runs out: on the host, at some allocation of loading, rendering, checkpoints or
 * merging, which must end in BRUME_ERROR_MEMORY with nothing left behind; on the device, which is asked before whether
 * there is enough.
 *
 * Allocations of loading are tried in steps here, and all of them by `make trust`.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "faults/memory.h"

static int works;

static int setup(void **state) {
    (void)state;
    works = memory_begin();
    return works < 0 ? -1 : 0;
}

static int teardown(void **state) {
    (void)state;
    if (works) memory_end();
    return 0;
}

static void sweep(memory_work work, unsigned tries) {
    unsigned count = works ? memory_allocations(work) : 0;
    if (!count) skip();
    memory_sweep s = {0};
    unsigned step = count / tries + 1;
    for (unsigned n = 1; n <= count; n += n < tries / 4 ? 1 : step) {
        memory_try(work, n, 0, &s);
        memory_try(work, n, 1, &s);
    }
    print_message("%u allocations, %u failures: %u reported, %u went on, %u lost\n", count, s.tried, s.reported,
                  s.went_on, s.lost);
    assert_int_equal(s.lost, 0);
    assert_true(s.reported > 0);
}

static void test_loading(void **state) {
    (void)state;
    sweep(MEMORY_LOAD, 60);
}

static void test_rendering(void **state) {
    (void)state;
    sweep(MEMORY_RENDER, 20);
}

static void test_checkpoints(void **state) {
    (void)state;
    sweep(MEMORY_SAVE, 40);
}

static void test_merging(void **state) {
    (void)state;
    sweep(MEMORY_MERGE, 100);
}

static void test_rendering_on_two_devices(void **state) {
    (void)state;
    sweep(MEMORY_SHARED, 20);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_loading), cmocka_unit_test(test_rendering),
                                       cmocka_unit_test(test_checkpoints), cmocka_unit_test(test_merging), cmocka_unit_test(test_rendering_on_two_devices)};
    return cmocka_run_group_tests_name("memory", tests, setup, teardown);
}

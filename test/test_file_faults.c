/* test_file_faults.c -- a disk that fails at any call while a picture, a checkpoint or the sum of parts is written: the
 * file is the one before or the new one, whole, nothing is left beside it, and the next attempt succeeds. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "faults/files.h"

static int has_device;

static int setup(void **state) {
    (void)state;
    has_device = files_begin_works();
    return has_device < 0 ? -1 : 0;
}

static int teardown(void **state) {
    (void)state;
    files_end_works();
    return 0;
}

static void sweep(files_work work, unsigned least) {
    if (!has_device) skip();
    files_sweep s = {0};
    files_sweep_all(work, &s);
    print_message("%s: %u failures: %u reported, %u went on, %u lost\n", files_names[work], s.tried, s.reported,
                  s.went_on, s.lost);
    assert_int_equal(s.lost, 0);
    assert_true(s.tried >= least && s.reported > s.tried / 2);
}

static void test_exr(void **state) { (void)state; sweep(FILES_EXR, 60); }
static void test_png(void **state) { (void)state; sweep(FILES_PNG, 18); }
static void test_checkpoint(void **state) { (void)state; sweep(FILES_CHECKPOINT, 200); }
static void test_merged_exr(void **state) { (void)state; sweep(FILES_MERGED_EXR, 60); }
static void test_merged_png(void **state) { (void)state; sweep(FILES_MERGED_PNG, 18); }

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_exr),        cmocka_unit_test(test_png),        cmocka_unit_test(test_checkpoint),
        cmocka_unit_test(test_merged_exr), cmocka_unit_test(test_merged_png),
    };
    return cmocka_run_group_tests_name("file_faults", tests, setup, teardown);
}

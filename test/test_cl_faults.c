/* test_cl_faults.c -- OpenCL calls that fail, wherever one is made from finding a device to writing the picture: each
 * failure is reported with OpenCL's name for it or gone around, nothing leaks, and what is asked for again comes out as
 * if nothing had been. A few of each function here; `make trust` has them all (measure_cl_faults.c).
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "faults/sweep.h"

static int has_device;

static int setup(void **state) {
    (void)state;
    has_device = sessions_begin();
    return has_device < 0 ? -1 : 0;
}

static int teardown(void **state) {
    (void)state;
    sessions_end();
    return 0;
}

static void expect_nothing_lost(const sweep *s, unsigned least) {
    print_message("%u faults: %u reported, %u went on, %u untouched, %u lost\n", s->tried, s->reported, s->went_on,
                  s->untouched, s->lost);
    assert_int_equal(s->lost, 0);
    assert_int_equal(s->untouched, 0);
    assert_true(s->tried >= least);
    assert_true(s->reported > s->tried / 4);
}

static void test_a_render_survives(void **state) {
    (void)state;
    if (!has_device) skip();
    sweep s = {0};
    sweep_some(SESSION_CACHED, &s);
    expect_nothing_lost(&s, 40);
}

static void test_an_adaptive_render_survives(void **state) {
    (void)state;
    if (!has_device) skip();
    sweep s = {0};
    sweep_some(SESSION_ADAPTIVE, &s);
    expect_nothing_lost(&s, 40);
}

static void test_a_saved_render_survives(void **state) {
    (void)state;
    if (!has_device) skip();
    sweep s = {0};
    sweep_some(SESSION_SAVED, &s);
    /* What goes into the file, and what comes from it. */
    const cl_function moves[2] = {CL_ENQUEUE_READ_BUFFER, CL_ENQUEUE_WRITE_BUFFER};
    for (int i = 0; i < 2; i++)
        for (unsigned n = 2; n <= session_calls(SESSION_SAVED, moves[i], 0); n += 6) {
            const cl_fault fault = {moves[i], 0, n, CL_OUT_OF_RESOURCES, CL_FAILS};
            sweep_one(SESSION_SAVED, &fault, &s);
        }
    expect_nothing_lost(&s, 40);
}

/* Whatever of a launch has run when the driver reports an error: all, a part, nothing. */
static void test_launches_are_neither_lost_nor_done_twice(void **state) {
    (void)state;
    if (!has_device) skip();
    sweep s = {0};
    for (int i = 0; i < 2; i++) {
        session_kind kind = i ? SESSION_ADAPTIVE : SESSION_CACHED;
        unsigned finishes = session_calls(kind, CL_FINISH, 0);
        unsigned launches = session_calls(kind, CL_ENQUEUE_ND_RANGE_KERNEL, 0);
        for (unsigned n = 3; n <= finishes; n += finishes / 3)
            for (int code = 0; code < 2; code++) {
                const cl_int codes[2] = {CL_INVALID_COMMAND_QUEUE, CL_OUT_OF_RESOURCES};
                const cl_fault fault[3] = {{CL_FINISH, 0, n, codes[code], CL_DONE},
                                           {CL_FINISH, 0, n, codes[code], CL_FAILS},
                                           {CL_ENQUEUE_ND_RANGE_KERNEL, 0, n < launches ? n : 2, codes[code], CL_HALF}};
                for (int f = 0; f < 3; f++) sweep_one(kind, &fault[f], &s);
            }
    }
    expect_nothing_lost(&s, 24);
}

/* In the middle of a render; what was made on it goes with it, and nothing else. */
static void test_a_device_may_go_and_come_back(void **state) {
    (void)state;
    if (!has_device) skip();
    sweep s = {0};
    const cl_fault faults[] = {
        {CL_CREATE_BUFFER, 0, 3, CL_MEM_OBJECT_ALLOCATION_FAILURE, CL_LOST},
        {CL_ENQUEUE_ND_RANGE_KERNEL, 0, 9, CL_OUT_OF_RESOURCES, CL_LOST},
        {CL_FINISH, 0, 12, CL_INVALID_COMMAND_QUEUE, CL_LOST},
        {CL_ENQUEUE_READ_BUFFER, 0, 8, CL_OUT_OF_RESOURCES, CL_LOST},
    };
    for (size_t i = 0; i < sizeof faults / sizeof faults[0]; i++) sweep_one(SESSION_CACHED, &faults[i], &s);
    /* While a state is saved, and while a render takes it over. */
    const cl_fault saving[] = {{CL_GET_MEM_OBJECT_INFO, 0, 1, CL_OUT_OF_RESOURCES, CL_LOST},
                               {CL_ENQUEUE_WRITE_BUFFER, 0, session_calls(SESSION_SAVED, CL_ENQUEUE_WRITE_BUFFER, 0) / 2,
                                CL_OUT_OF_RESOURCES, CL_LOST}};
    for (size_t i = 0; i < sizeof saving / sizeof saving[0]; i++) sweep_one(SESSION_SAVED, &saving[i], &s);
    expect_nothing_lost(&s, 6);
    assert_int_equal(s.reported, s.tried);
}

/* The compiler, which is asked for a program from source, and in a thread of its own for a quick start. */
static void test_builds_survive(void **state) {
    (void)state;
    if (!has_device) skip();
    sweep s = {0};
    const cl_fault faults[] = {
        {CL_BUILD_PROGRAM, 0, 1, CL_BUILD_PROGRAM_FAILURE, CL_FAILS},
        {CL_CREATE_PROGRAM_WITH_SOURCE, 0, 1, CL_OUT_OF_HOST_MEMORY, CL_FAILS},
        {CL_GET_PROGRAM_INFO, 0, 2, CL_OUT_OF_RESOURCES, CL_FAILS},
    };
    const cl_fault in_thread[] = {
        {CL_BUILD_PROGRAM, 1, 1, CL_OUT_OF_RESOURCES, CL_FAILS},
        {CL_ENQUEUE_ND_RANGE_KERNEL, 1, 1, CL_OUT_OF_RESOURCES, CL_FAILS},
        {CL_ENQUEUE_ND_RANGE_KERNEL, 0, 3, CL_INVALID_KERNEL_ARGS, CL_HALF},
    };
    for (int i = 0; i < 3; i++) sweep_one(SESSION_SOURCE, &faults[i], &s);
    for (int i = 0; i < 3; i++) sweep_one(SESSION_QUICK, &in_thread[i], &s);
    expect_nothing_lost(&s, 6);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_launches_are_neither_lost_nor_done_twice),
        cmocka_unit_test(test_a_device_may_go_and_come_back),
        cmocka_unit_test(test_builds_survive),
        cmocka_unit_test(test_a_render_survives),
        cmocka_unit_test(test_an_adaptive_render_survives),
        cmocka_unit_test(test_a_saved_render_survives),
    };
    return cmocka_run_group_tests_name("cl_faults", tests, setup, teardown);
}

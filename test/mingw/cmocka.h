/* cmocka.h -- as much of cmocka as test_platform.c needs, for MinGW, where Debian has none: the first failed assertion
 * ends the program. */
#ifndef MINGW_CMOCKA_H
#define MINGW_CMOCKA_H

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct CMUnitTest {
    const char *name;
    void (*run)(void **state);
};

#define print_message printf
#define cmocka_unit_test(function) {#function, function}
#define assert_true(holds) \
    ((holds) ? (void)0 : (printf("%s:%d: not true: %s\n", __FILE__, __LINE__, #holds), fflush(stdout), exit(1)))
#define assert_false(holds) assert_true(!(holds))
#define assert_null(pointer) assert_true((pointer) == NULL)
#define assert_non_null(pointer) assert_true((pointer) != NULL)
#define assert_int_equal(a, b) assert_true((long long)(a) == (long long)(b))
#define assert_memory_equal(a, b, size) assert_true(memcmp(a, b, size) == 0)

#define cmocka_run_group_tests(tests, setup, teardown) \
    cmocka_run(tests, (int)(sizeof(tests) / sizeof((tests)[0])), setup, teardown)

static int cmocka_run(const struct CMUnitTest *tests, int count, int (*setup)(void **), int (*teardown)(void **))
{
    void *state = NULL;
    int wrong = setup(&state);
    for (int i = 0; i < count && !wrong; i++) {
        tests[i].run(&state);
        printf("%s: ok\n", tests[i].name);
    }
    return wrong || teardown(&state);
}

#endif

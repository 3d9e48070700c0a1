/* test_cli_duration.c -- lengths of time as people say them, at the ends of each unit. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "../apps/cli_duration.h"

static void in_words(void **state)
{
    (void)state;
    static const struct { double seconds; const char *words; } cases[] = {
        {0, "0 s"},          {0.0432, "0.043 s"}, {3.24, "3.2 s"},      {9.96, "10 s"},          {41.3, "41 s"},
        {99.4, "99 s"},      {99.6, "1.7 min"},   {420, "7 min"},       {5960, "99 min"},        {5971, "1.7 h"},
        {9000, "2.5 h"},     {257399, "71 h"},    {257401, "3 days"},   {1036800, "12 days"},    {8.63e7, "999 days"},
        {8.65e7, "2.7 years"}, {1.26e9, "40 years"}, {3e15, "ages"}, {INFINITY, "ages"}, {NAN, "ages"},
    };
    char words[CLI_DURATION_SIZE];
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++)
        assert_string_equal(cli_duration(cases[i].seconds, words), cases[i].words);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(in_words)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}

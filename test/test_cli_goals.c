/* test_cli_goals.c -- what render-cli was asked to reach, and what it says on the way. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "json_text.h"
#include "render_cli.h"

static void progress_lines(void **state)
{
    (void)state;
    if (!cli_has_device())
        skip();
    assert_int_equal(cli_run("scene.xml -o a.exr --progress=json --stats=json"), 0);
    int lines = 0;
    for (char *line = strtok(cli.out, "\n"); line; line = strtok(NULL, "\n"), lines++) {
        assert_true(json_valid(line));
        assert_non_null(json_member(line, "event"));
    }
    assert_true(lines >= 3);
    /* not a terminal: no bar, unless asked for nothing is printed */
    assert_int_equal(cli_run("scene.xml -o a.exr"), 0);
    assert_string_equal(cli.out, "");
    assert_string_equal(cli.err, "");
    assert_int_equal(cli_run("scene.xml -o a.exr -v"), 0);
    assert_non_null(strstr(cli.err, "Rendering"));
    assert_null(strchr(cli.err, '\r'));
}

static double member_of(const char *json, const char *name)
{
    const char *found = json_member(json, name);
    if (!found || strncmp(found, "null", 4) == 0)
        return -1;
    return strtod(found, NULL);
}

/* What was asked for is what the statistics say was reached. */
static void goals(void **state)
{
    (void)state;
    if (!cli_has_device())
        skip();
    static const struct { const char *line, *adaptive; } cases[] = {
        {"scene.xml -o a.exr --noise-threshold 0.01 --stats=json --adaptive off", "false"},
        {"scene.xml -o a.exr --noise-threshold 0.01 --stats=json --adaptive on", "true"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        assert_int_equal(cli_run(cases[i].line), 0);
        assert_true(json_valid(cli.out));
        double relmse = member_of(cli.out, "relmse");
        assert_true(relmse > 0 && relmse <= 0.01);
        assert_true(member_of(cli.out, "relmse_low") <= relmse && relmse <= member_of(cli.out, "relmse_high"));
        cli_expect_member("adaptive", cases[i].adaptive);
        cli_expect_member("complete", "true");
    }
    /* The number of samples is the most that a goal may take, and a mean with --adaptive on alone. */
    assert_int_equal(cli_run("scene.xml -o a.exr --noise-threshold 1e-9 --spp 16 --adaptive off --stats=json"), 0);
    assert_true(member_of(cli.out, "relmse") > 1e-9);
    cli_expect_member("samples", "6144");
    assert_int_equal(cli_run("scene.xml -o a.exr --time-limit 600 --spp 4 --stats=json"), 0);
    cli_expect_member("samples", "1536");
    assert_int_equal(cli_run("scene.xml -o a.exr --spp 64 --adaptive on --stats=json"), 0);
    cli_expect_member("adaptive", "true");
    assert_true(member_of(cli.out, "samples") > 16 * 384 && member_of(cli.out, "samples") <= 64 * 384);
    /* a time that is over too soon is a picture with a warning, a range with "off" a range */
    assert_int_equal(cli_run("scene.xml -o a.exr --time-limit 1e-6"), 0);
    assert_non_null(strstr(cli.err, "warning: --time-limit"));
    assert_int_equal(cli_run("scene.xml -o a.exr --sample-range 0:4 --adaptive off --stats=json"), 0);
    cli_expect_member("samples", "1536");
    cli_expect_member("adaptive", "false");
}

/* Error and prediction come with the progress as soon as they are known, and don't go away again. */
static void progress_tells_the_error(void **state)
{
    (void)state;
    if (!cli_has_device())
        skip();
    static const char *const names[] = {"relmse",        "relmse_low",     "relmse_high",     "predicted_seconds",
                                        "predicted_low", "predicted_high", "predicted_relmse"};
    enum { NAMES = sizeof names / sizeof names[0] };
    int known[NAMES] = {0}, lines = 0;
    assert_int_equal(cli_run("scene.xml -o a.exr --noise-threshold 0.003 --progress=json"), 0);
    for (char *line = strtok(cli.out, "\n"); line; line = strtok(NULL, "\n")) {
        assert_true(json_valid(line));
        if (strncmp(json_member(line, "event"), "\"progress\"", 10) != 0)
            continue;
        lines++;
        for (int i = 0; i < NAMES; i++) {
            int here = json_member(line, names[i]) != NULL;
            assert_true(here || !known[i]);
            assert_true(!here || member_of(line, names[i]) > 0);
            known[i] |= here;
        }
        if (known[0])
            assert_true(member_of(line, "relmse_low") <= member_of(line, "relmse") &&
                        member_of(line, "relmse") <= member_of(line, "relmse_high"));
        if (known[3])
            assert_true(member_of(line, "predicted_low") <= member_of(line, "predicted_seconds") &&
                        member_of(line, "predicted_seconds") <= member_of(line, "predicted_high"));
    }
    assert_true(lines >= 1);
    for (int i = 0; i < NAMES; i++)
        assert_true(known[i]);
}

static void json_checker_rejects(void **state)
{
    (void)state;
    static const char *const wrong[] = {"",   "{",   "{\"a\":}", "{\"a\":1,}", "[1 2]",     "\"\\x\"", "01",
                                        "1.", "nan", "{} {}",    "\"a\nb\"",   "{\"a\" 1}", "-",       "1e"};
    for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; i++)
        assert_false(json_valid(wrong[i]));
    assert_true(json_valid(" {\"a\":[1,-2.5e+3,true,null,\"\\u00e9\\n\"],\"b\":{}} "));
}

static int setup(void **state)
{
    (void)state;
    return cli_open(cli_scene);
}

static int teardown(void **state)
{
    (void)state;
    static const char *const files[] = {"scene.xml", "a.exr"};
    return cli_close(files, sizeof files / sizeof files[0]);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(json_checker_rejects),
        cmocka_unit_test(progress_lines),
        cmocka_unit_test(goals),
        cmocka_unit_test(progress_tells_the_error),
    };
    return cmocka_run_group_tests(tests, setup, teardown);
}

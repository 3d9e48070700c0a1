/* render-cli's info, effects and --without as a user meets them. Runs the program itself, from the build folder that
 * the environment names (BRUME_BUILD). One lane, whose kernels are built soonest. */
#include <limits.h>
#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include "brume.h"
#include "json_text.h"
#include "render_cli.h"

/* A ball under a spotlight in fog that glows and scatters forwards. */
static const char scene[] =
    "<scene version='3.0.0'>\n"
    "<integrator type='volpath'/>\n"
    "<medium type='homogeneous' id='fog'><float name='sigma_t' value='0.2'/>\n"
    "<rgb name='emission' value='0, 0.01, 0'/><phase type='hg'><float name='g' value='0.4'/></phase></medium>\n"
    "<sensor type='perspective'>\n"
    "<transform name='to_world'><lookat origin='0,1,5' target='0,1,0' up='0,1,0'/></transform><ref id='fog'/>\n"
    "<sampler type='independent'><integer name='sample_count' value='8'/></sampler>\n"
    "<film type='hdrfilm'><integer name='width' value='24'/><integer name='height' value='16'/></film></sensor>\n"
    "<emitter type='spot'><transform name='to_world'><lookat origin='-2,3,1' target='0,1,0' up='0,1,0'/></transform>\n"
    "<rgb name='intensity' value='60'/></emitter>\n"
    "<shape type='sphere'><point name='center' x='0' y='1' z='0'/></shape>\n"
    "</scene>\n";

static void expect_text(const char *text, const char *part)
{
    if (!strstr(text, part))
        fail_msg("expected \"%s\" in:\n%s", part, text);
}

static void skip_without_device(void)
{
    if (cli_run("--list-devices") != 0)
        skip();
}

/* Whether the file, which is a short one, has that in it. */
static int has(const char *name, const char *part)
{
    char bytes[65536];
    long size = cli_read(name, bytes, sizeof bytes), length = (long)strlen(part);
    assert_in_range(size, 1, sizeof bytes);
    for (long i = 0; i + length <= size; i++)
        if (memcmp(bytes + i, part, (size_t)length) == 0)
            return 1;
    return 0;
}

static void unknown_effects_are_usage_errors(void **state)
{
    (void)state;
    static const struct { const char *line, *part; } cases[] = {
        {"scene.xml --without emision", "did you mean emission?"},
        {"scene.xml --without=lens,multiple-scatering", "did you mean multiple-scattering?"},
        {"scene.xml --without zzz", "unknown effect zzz; --help lists them"},
        {"scene.xml --without emission,", "unknown effect"},
        {"scene.xml --without quadrics", "quadrics can't be taken away"},
        {"effects scene.xml -o a -o b", "one folder"},
        {"effects scene.xml --exposure 1", "takes no --exposure"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        if (cli_run(cases[i].line) != 2)
            fail_msg("\"%s\": exit code %d, expected 2", cases[i].line, cli.status);
        expect_text(cli.err, cases[i].part);
        assert_ptr_equal(strchr(cli.err, '\n'), cli.err + strlen(cli.err) - 1);
    }
    assert_int_equal(cli_run("effects --help"), 0);
    expect_text(cli.out, "--without");
}

static void info_says_why(void **state)
{
    (void)state;
    skip_without_device();
    assert_int_equal(cli_run("info scene.xml --lanes 1"), 0);
    expect_text(cli.out, "medium \"fog\" (scene.xml:3): g 0.4");
    expect_text(cli.out, "multiple-scattering   integrator (scene.xml:2): max_depth has no limit");
    expect_text(cli.out, "not there      chromatic-extinction");
    expect_text(cli.out, "code left out");
    expect_text(cli.out, "KiB, 1 lanes wide, built in ");
    expect_text(cli.out, "on the device  ");

    assert_int_equal(cli_run("info scene.xml --lanes 1 --without multiple-scattering,emission --stats=json"), 0);
    assert_true(json_valid(cli.out));
    expect_text(cli.out, "\"without\":[\"emission\",\"multiple-scattering\"]");
    expect_text(cli.out, "\"features_left_out\":[\"null\"");
    expect_text(cli.out, "\"effect\":\"anisotropy\",\"object\":\"medium\",\"index\":0,\"count\":1,\"id\":\"fog\"");
    assert_null(strstr(cli.out, "\"effect\":\"emission\""));
    assert_true(strtol(json_member(cli.out, "program_bytes"), NULL, 10) > 0);
    assert_true(strtol(json_member(cli.out, "device_bytes"), NULL, 10) > 0);
    assert_true(strtod(json_member(cli.out, "build_seconds"), NULL) > 0);
}

/* Whoever has the picture can tell that something was left out. */
static void files_say_what_is_missing(void **state)
{
    (void)state;
    skip_without_device();
    assert_int_equal(cli_run("scene.xml --lanes 1 -q -o a.exr -o a.png --without anisotropy,multiple-scattering "
                             "--stats=json"), 0);
    assert_true(json_valid(cli.out));
    expect_text(cli.out, "\"without\":[\"multiple-scattering\",\"anisotropy\"]");
    expect_text(cli.out, "\"effects\":[\"media\",\"absorption\",\"emission\",\"scattering\",");
    assert_true(has("a.exr", "without"));
    assert_true(has("a.exr", "multiple-scattering,anisotropy"));
    assert_true(has("a.png", "without multiple-scattering,anisotropy"));
    assert_int_equal(cli_run("scene.xml --lanes 1 -q -o a.exr -o a.png"), 0);
    assert_false(has("a.png", "without"));
    assert_false(has("a.exr", "without"));
}

static void effects_are_measured(void **state)
{
    (void)state;
    static char bytes[65536];
    skip_without_device();
    assert_int_equal(cli_run("effects scene.xml --lanes 1 --spp 64 -o fx -q"), 0);
    assert_string_equal(cli.err, "");
    expect_text(cli.out, "24 x 16 pixels, 64 samples each in 4 rounds");
    expect_text(cli.out, "\nmultiple-scattering ");
    assert_null(strstr(cli.out, "\nquadrics"));
    expect_text(cli.out, "\nspot-lights ");
    assert_true(cli_read("fx/effects.json", bytes, sizeof bytes) > 0);
    assert_true(json_valid(bytes));
    const char *lamp = strstr(bytes, "{\"effect\":\"spot-lights\"");
    assert_non_null(lamp);
    assert_true(strtod(json_member(lamp, "mean_change"), NULL) < -0.1);
    double difference = strtod(json_member(lamp, "relmse"), NULL);
    assert_true(difference > 3 * strtod(json_member(lamp, "relmse_standard_error"), NULL));
    assert_true(cli_read("fx/multiple-scattering.png", bytes, sizeof bytes) > 3 * 3 * 24 * 16);
    assert_memory_equal(bytes, "\x89PNG\r\n\x1a\n", 8);
    assert_int_equal(cli_run("effects scene.xml --spp 4 -o scene.xml"), 6);
}

static void effects_can_be_stopped(void **state)
{
    (void)state;
    skip_without_device();
    static const char line[] = "effects scene.xml --lanes 1 --spp 4000000 --progress=json";
    assert_int_equal(cli_run_until(line, "\"event\":\"progress\"", SIGINT), 130);
}

static int setup(void **state)
{
    (void)state;
    return cli_open(scene);
}

static int teardown(void **state)
{
    (void)state;
    static const char *const files[] = {
        "fx/media.png",      "fx/absorption.png",          "fx/emission.png",    "fx/scattering.png", "fx/effects.json",
        "fx/anisotropy.png", "fx/multiple-scattering.png", "fx/spot-lights.png", "scene.xml",         "a.exr",
        "a.png",
    };
    char path[PATH_MAX];
    cli_path(path, "fx");
    for (size_t i = 0; i < sizeof files / sizeof files[0]; i++)
        cli_remove(files[i]);
    return rmdir(path) != 0 ? -1 : cli_close(NULL, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(unknown_effects_are_usage_errors),
        cmocka_unit_test(info_says_why),
        cmocka_unit_test(files_say_what_is_missing),
        cmocka_unit_test(effects_are_measured),
        cmocka_unit_test(effects_can_be_stopped),
    };
    return cmocka_run_group_tests(tests, setup, teardown);
}

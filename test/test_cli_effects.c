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
#include "child.h"

static char program[2 * PATH_MAX];
static char folder[] = "/tmp/test-cli-effects-XXXXXX"; /* every child's current folder */
static child_result result;

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

static void path_of(char path[PATH_MAX], const char *name)
{
    snprintf(path, PATH_MAX, "%s/%s", folder, name);
}

/* A file of the folder with a 0 behind it; its size, -1 if it isn't there. */
static long read_file(const char *name, char *bytes, size_t room)
{
    char path[PATH_MAX];
    path_of(path, name);
    FILE *file = fopen(path, "rb");
    if (!file)
        return -1;
    size_t count = fread(bytes, 1, room - 1, file);
    bytes[count] = 0;
    fclose(file);
    return (long)count;
}

static void remove_file(const char *name)
{
    char path[PATH_MAX];
    path_of(path, name);
    unlink(path);
}

static int run_until(const char *line, const char *signal_after, int number)
{
    const char *const first[] = {program, NULL};
    return child_run_line(&result, folder, first, line, signal_after, number);
}

static int run(const char *line)
{
    return run_until(line, NULL, 0);
}

static void expect_text(const char *text, const char *part)
{
    if (!strstr(text, part))
        fail_msg("expected \"%s\" in:\n%s", part, text);
}

static void skip_without_device(void)
{
    if (run("--list-devices") != 0)
        skip();
}

static int contains(const char *bytes, long size, const char *part)
{
    long length = (long)strlen(part);
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
        if (run(cases[i].line) != 2)
            fail_msg("\"%s\": exit code %d, expected 2", cases[i].line, result.status);
        expect_text(result.err, cases[i].part);
        assert_ptr_equal(strchr(result.err, '\n'), result.err + strlen(result.err) - 1);
    }
    assert_int_equal(run("effects --help"), 0);
    expect_text(result.out, "--without");
}

static void info_says_why(void **state)
{
    (void)state;
    skip_without_device();
    assert_int_equal(run("info scene.xml --lanes 1"), 0);
    expect_text(result.out, "medium \"fog\" (scene.xml:3): g 0.4");
    expect_text(result.out, "multiple-scattering   integrator (scene.xml:2): max_depth has no limit");
    expect_text(result.out, "not there      chromatic-extinction");
    expect_text(result.out, "code left out");
    expect_text(result.out, "KiB, ");

    assert_int_equal(run("info scene.xml --lanes 1 --without multiple-scattering,emission --stats=json"), 0);
    assert_true(json_valid(result.out));
    expect_text(result.out, "\"without\":[\"emission\",\"multiple-scattering\"]");
    expect_text(result.out, "\"features_left_out\":[\"null\"");
    expect_text(result.out, "\"effect\":\"anisotropy\",\"object\":\"medium\",\"index\":0,\"count\":1,\"id\":\"fog\"");
    assert_null(strstr(result.out, "\"effect\":\"emission\""));
    assert_true(strtol(json_member(result.out, "program_bytes"), NULL, 10) > 0);
}

/* Whoever has the picture can tell that something was left out. */
static void files_say_what_is_missing(void **state)
{
    (void)state;
    static char bytes[65536];
    skip_without_device();
    assert_int_equal(run("scene.xml --lanes 1 -q -o a.exr -o a.png --without anisotropy,multiple-scattering "
                         "--stats=json"), 0);
    assert_true(json_valid(result.out));
    expect_text(result.out, "\"without\":[\"multiple-scattering\",\"anisotropy\"]");
    expect_text(result.out, "\"effects\":[\"media\",\"absorption\",\"emission\",\"scattering\",");
    long size = read_file("a.exr", bytes, sizeof bytes);
    assert_true(contains(bytes, size, "without"));
    assert_true(contains(bytes, size, "multiple-scattering,anisotropy"));
    size = read_file("a.png", bytes, sizeof bytes);
    assert_true(contains(bytes, size, "without multiple-scattering,anisotropy"));
    assert_int_equal(run("scene.xml --lanes 1 -q -o a.exr -o a.png"), 0);
    size = read_file("a.png", bytes, sizeof bytes);
    assert_false(contains(bytes, size, "without"));
    size = read_file("a.exr", bytes, sizeof bytes);
    assert_false(contains(bytes, size, "without"));
}

static void effects_are_measured(void **state)
{
    (void)state;
    static char bytes[65536];
    skip_without_device();
    assert_int_equal(run("effects scene.xml --lanes 1 --spp 64 -o fx -q"), 0);
    assert_string_equal(result.err, "");
    expect_text(result.out, "24 x 16 pixels, 64 samples each in 4 rounds");
    expect_text(result.out, "\nmultiple-scattering ");
    assert_null(strstr(result.out, "\nquadrics"));
    expect_text(result.out, "\nspot-lights ");
    assert_true(read_file("fx/effects.json", bytes, sizeof bytes) > 0);
    assert_true(json_valid(bytes));
    const char *lamp = strstr(bytes, "{\"effect\":\"spot-lights\"");
    assert_non_null(lamp);
    assert_true(strtod(json_member(lamp, "mean_change"), NULL) < -0.1);
    double difference = strtod(json_member(lamp, "relmse"), NULL);
    assert_true(difference > 3 * strtod(json_member(lamp, "relmse_standard_error"), NULL));
    assert_true(read_file("fx/multiple-scattering.png", bytes, sizeof bytes) > 3 * 3 * 24 * 16);
    assert_memory_equal(bytes, "\x89PNG\r\n\x1a\n", 8);
    assert_int_equal(run("effects scene.xml --spp 4 -o scene.xml"), 6);
}

static void effects_can_be_stopped(void **state)
{
    (void)state;
    skip_without_device();
    static const char line[] = "effects scene.xml --lanes 1 --spp 4000000 --progress=json";
    assert_int_equal(run_until(line, "\"event\":\"progress\"", SIGINT), 130);
}

static int setup(void **state)
{
    (void)state;
    const char *build = getenv("BRUME_BUILD");
    char here[PATH_MAX], path[PATH_MAX];
    if (!build)
        build = "build";
    if (!getcwd(here, sizeof here))
        return -1;
    /* absolute, because children run elsewhere */
    snprintf(program, sizeof program, "%s%s%s/render-cli", build[0] == '/' ? "" : here, build[0] == '/' ? "" : "/",
             build);
    if (!mkdtemp(folder))
        return -1;
    path_of(path, "scene.xml");
    FILE *file = fopen(path, "w");
    if (!file)
        return -1;
    fputs(scene, file);
    return fclose(file);
}

static int teardown(void **state)
{
    (void)state;
    static const char *const names[] = {"media",      "absorption",           "emission",    "scattering",
                                        "anisotropy", "multiple-scattering", "spot-lights"};
    char name[64], path[PATH_MAX];
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++) {
        snprintf(name, sizeof name, "fx/%s.png", names[i]);
        remove_file(name);
    }
    remove_file("fx/effects.json");
    remove_file("scene.xml");
    remove_file("a.exr");
    remove_file("a.png");
    path_of(path, "fx");
    if (rmdir(path) != 0)
        return -1;
    /* Fails if anything else is there. */
    return rmdir(folder);
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

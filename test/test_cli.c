/* render-cli as a user meets it: exit codes, what it prints, what it leaves on disk. Runs the program itself, from the
 * build folder that the environment names (BRUME_BUILD). */
#include <limits.h>
#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmocka.h>

#include "brume.h"
#include "child.h"

static char program[2 * PATH_MAX];
static char folder[] = "/tmp/test-cli-XXXXXX"; /* every child's current folder */
static child_result result;

/* A ball under a spotlight in fog, with parameters that have defaults. */
static const char scene[] =
    "<scene version='3.0.0'>\n"
    "<default name='width' value='24'/><default name='spp' value='2'/>\n"
    "<integrator type='volpath'/>\n"
    "<medium type='homogeneous' id='fog'><float name='sigma_t' value='0.2'/></medium>\n"
    "<sensor type='perspective'>\n"
    "<transform name='to_world'><lookat origin='0,1,5' target='0,1,0' up='0,1,0'/></transform><ref id='fog'/>\n"
    "<sampler type='independent'><integer name='sample_count' value='$spp'/></sampler>\n"
    "<film type='hdrfilm'><integer name='width' value='$width'/><integer name='height' value='16'/></film></sensor>\n"
    "<emitter type='spot'><transform name='to_world'><lookat origin='-2,3,1' target='0,1,0' up='0,1,0'/></transform>\n"
    "<rgb name='intensity' value='60'/></emitter>\n"
    "<shape type='sphere'><point name='center' x='0' y='1' z='0'/></shape>\n"
    "</scene>\n";

static void write_file(const char *name, const char *text)
{
    char path[PATH_MAX];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *file = fopen(path, "w");
    assert_non_null(file);
    fputs(text, file);
    assert_int_equal(fclose(file), 0);
}

/* Up to `room` bytes of a file of the folder; its size, or -1 if it isn't there. */
static long read_file(const char *name, char *bytes, size_t room)
{
    char path[PATH_MAX];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *file = fopen(path, "rb");
    if (!file)
        return -1;
    size_t count = fread(bytes, 1, room, file);
    fseek(file, 0, SEEK_END);
    long size = ftell(file);
    fclose(file);
    if (count < room)
        bytes[count] = 0;
    return size;
}

static void remove_file(const char *name)
{
    char path[PATH_MAX];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    unlink(path);
}

/* Runs render-cli with the words of `line` as arguments; what it printed is in `result`. */
static int run_until(const char *line, const char *signal_after, int number)
{
    const char *const first[] = {program, NULL};
    return child_run_line(&result, folder, first, line, signal_after, number);
}

static int run(const char *line)
{
    return run_until(line, NULL, 0);
}

static void expect_member(const char *name, const char *value)
{
    const char *found = json_member(result.out, name);
    if (!found || strncmp(found, value, strlen(value)) != 0 || !strchr(",}\n", found[strlen(value)]))
        fail_msg("expected \"%s\":%s in %s", name, value, result.out);
}

static int has_device(void)
{
    return run("--list-devices") == 0;
}

static void usage_errors(void **state)
{
    (void)state;
    static const struct { const char *line, *part; } cases[] = {
        {"", "no scene"},
        {"a.xml b.xml", "more than one scene"},
        {"a.xml --sppp 4", "did you mean --spp?"},
        {"a.xml --expsoure=1", "did you mean --exposure?"},
        {"a.xml --zzz", "unknown option --zzz"},
        {"a.xml --layers albedo,depht", "unknown layer depht"},
        {"a.xml --layers varience", "did you mean variance?"},
        {"a.xml --layers", "--layers needs"},
        {"a.xml --tonemap aces", "--tonemap"},
        {"a.xml --denoise yes", "--denoise"},
        {"a.xml -z", "unknown option -z"},
        {"a.xml --spp 0", "--spp"},
        {"a.xml --spp -4", "--spp"},
        {"a.xml --spp 4x", "--spp"},
        {"a.xml --spp 4294967296", "--spp"},
        {"a.xml --spp", "needs N"},
        {"a.xml --seed 1.5", "--seed"},
        {"a.xml --crop 0,4,0", "--crop"},
        {"a.xml --crop 4,4,0,4", "--crop"},
        {"a.xml --sample-range 8:8", "--sample-range"},
        {"a.xml --sample-range 8", "--sample-range"},
        {"a.xml --spp 4 --sample-range 0:4", "exclude"},
        {"a.xml --noise-threshold 0", "--noise-threshold"},
        {"a.xml --noise-threshold -1", "--noise-threshold"},
        {"a.xml --noise-threshold 1%", "--noise-threshold"},
        {"a.xml --noise-threshold nan", "--noise-threshold"},
        {"a.xml --noise-threshold", "needs E"},
        {"a.xml --time-limit 0", "--time-limit"},
        {"a.xml --time-limit 5s", "--time-limit"},
        {"a.xml --time-limit inf", "--time-limit"},
        {"a.xml --time-limit", "needs S"},
        {"a.xml --adaptive yes", "--adaptive"},
        {"a.xml --adaptive=", "--adaptive"},
        {"a.xml --adaptive", "needs auto|on|off"},
        {"a.xml --sample-range 0:4 --noise-threshold 0.1", "goes with no --noise-threshold"},
        {"a.xml --time-limit 5 --sample-range 0:4", "goes with no --noise-threshold, --time-limit"},
        {"a.xml --sample-range 0:4 --adaptive on", "goes with no --noise-threshold, --time-limit or --adaptive"},
        {"a.xml --lanes 3", "--lanes"},
        {"a.xml --precision half", "--precision"},
        {"a.xml --strategy fast", "--strategy"},
        {"a.xml --strategy equiangular-", "--strategy"},
        {"a.xml --strategy raster:", "--strategy"},
        {"a.xml --strategy raster:0", "--strategy"},
        {"a.xml --strategy raster:3", "--strategy"},
        {"a.xml --strategy raster:128", "--strategy"},
        {"a.xml --strategy raster:8x", "--strategy"},
        {"a.xml --strategy :8", "--strategy"},
        {"a.xml --strategy", "needs NAME"},
        {"a.xml --indirect fast", "--indirect"},
        {"a.xml --indirect ray-lights:4", "--indirect"},
        {"a.xml --exposure bright", "--exposure"},
        {"a.xml --exposure nan", "--exposure"},
        {"a.xml --clamp 0", "--clamp"},
        {"a.xml --clamp inf", "--clamp"},
        {"a.xml --debug-sample 3,4", "--debug-sample"},
        {"a.xml --debug-sample 3,4,5x", "--debug-sample"},
        {"a.xml --stats=xml", "--stats"},
        {"a.xml --progress=loud", "--progress"},
        {"a.xml -D width", "--define"},
        {"a.xml -D =5", "--define"},
        {"a.xml -o picture.jpg", ".exr or .png"},
        {"a.xml -o picture", ".exr or .png"},
        {"a.xml --verbose=3", "takes no value"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        int status = run(cases[i].line);
        if (status != 2)
            fail_msg("\"%s\": exit code %d, expected 2", cases[i].line, status);
        child_expect_error_line(&result, cases[i].part);
    }
}

static void help_and_version(void **state)
{
    (void)state;
    assert_int_equal(run("--help"), 0);
    assert_non_null(strstr(result.out, "--sample-range"));
    assert_int_equal(run("-h"), 0);
    assert_int_equal(run("--version"), 0);
    assert_non_null(strstr(result.out, BRUME_VERSION));
}

static void scene_errors(void **state)
{
    (void)state;
    assert_int_equal(run("missing.xml"), 3);
    child_expect_error_line(&result, "missing.xml");
    write_file("wrong.xml", "<scene version='3.0.0'>\n<shape type='spere'/>\n</scene>\n");
    assert_int_equal(run("wrong.xml"), 3);
    child_expect_error_line(&result, "wrong.xml:2:");
    assert_int_equal(run("scene.xml -D heigth=8"), 3);
    child_expect_error_line(&result, "heigth");
}

static void devices(void **state)
{
    (void)state;
    if (!has_device()) {
        assert_int_equal(result.status, 4);
        skip();
    }
    assert_int_equal(strncmp(result.out, "0: ", 3), 0);
    assert_int_equal(run("scene.xml --device no-such-device"), 4);
    child_expect_error_line(&result, "no-such-device");
    assert_int_equal(run("scene.xml --device 999"), 4);
    child_expect_error_line(&result, "999");
}

static void unwritable_outputs_are_refused_first(void **state)
{
    (void)state;
    /* The scene doesn't exist, which would be exit code 3: outputs are looked at before anything else is done. */
    assert_int_equal(run("missing.xml -o no/such/folder/a.exr"), 6);
    child_expect_error_line(&result, "no/such/folder/a.exr");
    assert_int_equal(run("missing.xml -o good.exr -o no/such/folder/a.png"), 6);
    assert_int_equal(run("missing.xml -o scene.xml/a.png"), 6);
    assert_int_equal(run("missing.xml --stats=json:no/such/folder/stats"), 6);
    char path[PATH_MAX];
    snprintf(path, sizeof path, "%s/folder.exr", folder);
    assert_int_equal(mkdir(path, 0777), 0);
    assert_int_equal(run("missing.xml -o folder.exr"), 6);
    child_expect_error_line(&result, "folder");
    assert_int_equal(rmdir(path), 0);
    char bytes[4];
    assert_int_equal(read_file("good.exr", bytes, sizeof bytes), -1);
}

static void pictures_and_statistics(void **state)
{
    (void)state;
    if (!has_device())
        skip();
    char bytes[8];
    assert_int_equal(run("scene.xml -o a.exr -oa.png --spp=3 --seed 7 -Dwidth=20 --stats=json"), 0);
    assert_string_equal(result.err, "");
    assert_true(json_valid(result.out));
    assert_ptr_equal(strchr(result.out, '\n'), result.out + strlen(result.out) - 1);
    expect_member("scene", "\"scene.xml\"");
    expect_member("outputs", "[\"a.exr\",\"a.png\"]");
    expect_member("width", "20");
    expect_member("height", "16");
    expect_member("samples", "960");
    expect_member("seed", "7");
    expect_member("complete", "true");
    expect_member("bad_samples", "0");
    expect_member("exit_code", "0");
    assert_true(read_file("a.exr", bytes, sizeof bytes) > 100);
    assert_memory_equal(bytes, "\x76\x2f\x31\x01", 4);
    assert_true(read_file("a.png", bytes, sizeof bytes) > 50);
    assert_memory_equal(bytes, "\x89PNG\r\n\x1a\n", 8);

    /* without -o: the scene's name, here */
    assert_int_equal(run("./scene.xml -q"), 0);
    assert_string_equal(result.out, "");
    assert_string_equal(result.err, "");
    assert_true(read_file("scene.exr", bytes, sizeof bytes) > 100);
}

static void crop_and_sample_range(void **state)
{
    (void)state;
    if (!has_device())
        skip();
    assert_int_equal(run("scene.xml -o crop.exr --crop 3,10,2,16 --sample-range 5:9 --stats=json:stats.json"), 0);
    assert_string_equal(result.out, "");
    char text[8192];
    long size = read_file("stats.json", text, sizeof text);
    assert_in_range(size, 1, sizeof text - 1);
    memcpy(result.out, text, sizeof text);
    assert_true(json_valid(result.out));
    expect_member("width", "7");
    expect_member("height", "14");
    expect_member("full_width", "24");
    expect_member("crop_x", "3");
    expect_member("crop_y", "2");
    expect_member("first_sample", "5");
    expect_member("sample_count", "4");
    expect_member("samples", "392");

    assert_int_equal(run("scene.xml -o crop.exr --crop 0,25,0,16"), 2);
    child_expect_error_line(&result, "crop");
}

/* What is asked for comes back by its name, with the scene's where nothing is. */
static void strategies(void **state)
{
    (void)state;
    if (!has_device())
        skip();
    assert_int_equal(run("scene.xml -o a.exr --spp 1 --stats=json --strategy systematic:8 --indirect phase"), 0);
    expect_member("strategy", "\"systematic\"");
    expect_member("positions", "8");
    expect_member("indirect", "\"phase\"");
    assert_int_equal(run("scene.xml -o a.exr --spp 1 --stats=json --strategy=equiangular-cone --indirect phase"), 0);
    expect_member("strategy", "\"equiangular-cone\"");
    assert_int_equal(run("scene.xml -o a.exr --spp 1 --stats=json"), 0);
    expect_member("strategy", "\"auto\"");
}

static void progress_lines(void **state)
{
    (void)state;
    if (!has_device())
        skip();
    assert_int_equal(run("scene.xml -o a.exr --progress=json --stats=json"), 0);
    int lines = 0;
    for (char *line = strtok(result.out, "\n"); line; line = strtok(NULL, "\n"), lines++) {
        assert_true(json_valid(line));
        assert_non_null(json_member(line, "event"));
    }
    assert_true(lines >= 3);
    /* not a terminal: no bar, unless asked for nothing is printed */
    assert_int_equal(run("scene.xml -o a.exr"), 0);
    assert_string_equal(result.out, "");
    assert_string_equal(result.err, "");
    assert_int_equal(run("scene.xml -o a.exr -v"), 0);
    assert_non_null(strstr(result.err, "Rendering"));
    assert_null(strchr(result.err, '\r'));
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
    if (!has_device())
        skip();
    static const struct { const char *line, *adaptive; } cases[] = {
        {"scene.xml -o a.exr --noise-threshold 0.01 --stats=json --adaptive off", "false"},
        {"scene.xml -o a.exr --noise-threshold 0.01 --stats=json --adaptive on", "true"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        assert_int_equal(run(cases[i].line), 0);
        assert_true(json_valid(result.out));
        double relmse = member_of(result.out, "relmse");
        assert_true(relmse > 0 && relmse <= 0.01);
        assert_true(member_of(result.out, "relmse_low") <= relmse && relmse <= member_of(result.out, "relmse_high"));
        expect_member("adaptive", cases[i].adaptive);
        expect_member("complete", "true");
    }
    /* The number of samples is the most that a goal may take, and a mean with --adaptive on alone. */
    assert_int_equal(run("scene.xml -o a.exr --noise-threshold 1e-9 --spp 16 --adaptive off --stats=json"), 0);
    assert_true(member_of(result.out, "relmse") > 1e-9);
    expect_member("samples", "6144");
    assert_int_equal(run("scene.xml -o a.exr --time-limit 600 --spp 4 --stats=json"), 0);
    expect_member("samples", "1536");
    assert_int_equal(run("scene.xml -o a.exr --spp 64 --adaptive on --stats=json"), 0);
    expect_member("adaptive", "true");
    assert_true(member_of(result.out, "samples") > 16 * 384 && member_of(result.out, "samples") <= 64 * 384);
    /* a time that is over too soon is a picture with a warning, a range with "off" a range */
    assert_int_equal(run("scene.xml -o a.exr --time-limit 1e-6"), 0);
    assert_non_null(strstr(result.err, "warning: --time-limit"));
    assert_int_equal(run("scene.xml -o a.exr --sample-range 0:4 --adaptive off --stats=json"), 0);
    expect_member("samples", "1536");
    expect_member("adaptive", "false");
}

/* Error and prediction come with the progress as soon as they are known, and don't go away again. */
static void progress_tells_the_error(void **state)
{
    (void)state;
    if (!has_device())
        skip();
    static const char *const names[] = {"relmse",        "relmse_low",     "relmse_high",     "predicted_seconds",
                                        "predicted_low", "predicted_high", "predicted_relmse"};
    enum { NAMES = sizeof names / sizeof names[0] };
    int known[NAMES] = {0}, lines = 0;
    assert_int_equal(run("scene.xml -o a.exr --noise-threshold 0.003 --progress=json"), 0);
    for (char *line = strtok(result.out, "\n"); line; line = strtok(NULL, "\n")) {
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

/* A number of samples that no test machine gets through, stopped after the first report. */
static void stopped_by(int number)
{
    char bytes[4];
    remove_file("long.exr");
    remove_file("long.png");
    int status = run_until("scene.xml -o long.exr -o long.png --spp 4000000 --progress=json --stats=json",
                           "\"event\":\"progress\"", number);
    assert_int_equal(status, 128 + number);
    assert_true(read_file("long.exr", bytes, sizeof bytes) > 100);
    assert_true(read_file("long.png", bytes, sizeof bytes) > 50);
    const char *stats = strstr(result.out, "{\"event\":\"stats\"");
    assert_non_null(stats);
    assert_true(json_valid(stats));
    assert_int_equal(strncmp(json_member(stats, "complete"), "false", 5), 0);
    assert_int_not_equal(strtol(json_member(stats, "samples"), NULL, 10), 0);
    assert_non_null(strstr(result.err, "stopped at"));
}

static void interrupt_writes_the_picture(void **state)
{
    (void)state;
    if (!has_device())
        skip();
    stopped_by(SIGINT);
    stopped_by(SIGTERM);
}

static void interrupt_before_the_render_ends_at_once(void **state)
{
    (void)state;
    /* A quick machine may be rendering already when the signal comes: the picture is optional, the code is not. */
    static const char line[] = "scene.xml -o early.exr --spp 4000000 --progress=json";
    assert_int_equal(run_until(line, "\"event\":\"step\"", SIGINT), 130);
}

/* Said before anything is rendered. */
static void no_denoiser(void **state)
{
    (void)state;
    setenv("BRUME_OIDN", "/nonexistent", 1);
    remove_file("a.exr");
    int code = run("scene.xml -o a.exr --denoise beauty");
    unsetenv("BRUME_OIDN");
    assert_int_equal(code, 1);
    assert_non_null(strstr(result.err, "error: denoising: $BRUME_OIDN is /nonexistent"));
    assert_int_equal(read_file("a.exr", (char[4]){0}, 4), -1);
}

/* One seed, one picture, on one thread of PoCL's (other drivers ignore the variable) as on all. */
static void same_seed_same_bytes(void **state)
{
    (void)state;
    if (!has_device())
        skip();
    static char first[65536], second[65536], other[65536];
    assert_int_equal(run("scene.xml -o one.png --seed 3"), 0);
    setenv("POCL_MAX_PTHREAD_COUNT", "1", 1);
    assert_int_equal(run("scene.xml -o two.png --seed 3"), 0);
    unsetenv("POCL_MAX_PTHREAD_COUNT");
    assert_int_equal(run("scene.xml -o three.png --seed 4"), 0);
    long a = read_file("one.png", first, sizeof first), b = read_file("two.png", second, sizeof second);
    long c = read_file("three.png", other, sizeof other);
    assert_in_range(a, 1, sizeof first);
    assert_int_equal(a, b);
    assert_memory_equal(first, second, (size_t)a);
    assert_true(c != a || memcmp(first, other, (size_t)a) != 0);
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
    const char *build = getenv("BRUME_BUILD");
    char here[PATH_MAX];
    if (!build)
        build = "build";
    if (!getcwd(here, sizeof here))
        return 1;
    /* absolute, because children run elsewhere */
    if (snprintf(program, sizeof program, "%s%s%s/render-cli", build[0] == '/' ? "" : here, build[0] == '/' ? "" : "/",
                 build) >= (int)sizeof program)
        return 1;
    if (access(program, X_OK) != 0 || !mkdtemp(folder))
        return 1;
    write_file("scene.xml", scene);
    return 0;
}

static int teardown(void **state)
{
    (void)state;
    static const char *const files[] = {"scene.xml", "wrong.xml",  "a.exr",    "a.png",    "scene.exr", "crop.exr",
                                        "one.png",   "stats.json", "long.exr", "long.png", "early.exr", "two.png",
                                        "three.png"};
    for (size_t i = 0; i < sizeof files / sizeof files[0]; i++)
        remove_file(files[i]);
    /* Fails if anything else is there: temporary files are not to be left behind. */
    return rmdir(folder);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(json_checker_rejects),
        cmocka_unit_test(usage_errors),
        cmocka_unit_test(help_and_version),
        cmocka_unit_test(scene_errors),
        cmocka_unit_test(devices),
        cmocka_unit_test(unwritable_outputs_are_refused_first),
        cmocka_unit_test(pictures_and_statistics),
        cmocka_unit_test(crop_and_sample_range),
        cmocka_unit_test(strategies),
        cmocka_unit_test(progress_lines),
        cmocka_unit_test(goals),
        cmocka_unit_test(progress_tells_the_error),
        cmocka_unit_test(interrupt_writes_the_picture),
        cmocka_unit_test(interrupt_before_the_render_ends_at_once),
        cmocka_unit_test(no_denoiser),
        cmocka_unit_test(same_seed_same_bytes),
    };
    return cmocka_run_group_tests(tests, setup, teardown);
}

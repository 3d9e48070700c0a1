/* test_cli_refusals.c -- what render-cli says, with which exit code, before anything is rendered: wrong usage, wrong
 * scenes, no such device, files that can't be written. */
#include <limits.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmocka.h>

#include "brume.h"
#include "render_cli.h"

static void usage_errors(void **state)
{
    (void)state;
    static const struct { const char *line, *part; } cases[] = {
        {"", "no scene; usage: render-cli SCENE.xml"},
        {"study", "no scene; usage: render-cli study SCENE.xml"},
        {"efects a.xml", "unknown command efects; did you mean effects?"},
        {"sutdy a.xml", "did you mean study?"},
        {"a.xml b.xml", "more than one scene: a.xml and b.xml"},
        {"a.xml --sppp 4", "did you mean --spp?"},
        {"a.xml --expsoure=1", "did you mean --exposure?"},
        {"a.xml --zzz", "unknown option --zzz"},
        {"a.xml --layers albedo,depht", "unknown layer depht"},
        {"a.xml --layers varience", "did you mean variance?"},
        {"a.xml --layers", "--layers needs"},
        {"a.xml --tonemap aces", "--tonemap"},
        {"a.xml --denoise yes", "--denoise"},
        {"a.xml -z", "unknown option -z"},
        {"a.xml --spp 0", "--spp: expected a whole number above 0, not \"0\""},
        {"a.xml --spp -4", "--spp"},
        {"a.xml --spp 4x", "--spp"},
        {"a.xml --spp 4294967296", "--spp"},
        {"a.xml --spp", "needs N"},
        {"a.xml --seed 1.5", "--seed: expected a whole number"},
        {"a.xml --crop 0,4,0", "--crop"},
        {"a.xml --crop 4,4,0,4", "X0 below X1"},
        {"a.xml --sample-range 8:8", "A below B"},
        {"a.xml --sample-range 8", "--sample-range"},
        {"a.xml --spp 4 --sample-range 0:4", "exclude"},
        {"a.xml --noise-threshold 0", "--noise-threshold"},
        {"a.xml --noise-threshold -1", "--noise-threshold"},
        {"a.xml --noise-threshold 1%", "--noise-threshold: expected a number above 0"},
        {"a.xml --noise-threshold nan", "--noise-threshold"},
        {"a.xml --noise-threshold", "needs E"},
        {"a.xml --time-limit 0", "--time-limit"},
        {"a.xml --time-limit 5s", "--time-limit: expected a number above 0"},
        {"a.xml --time-limit inf", "--time-limit"},
        {"a.xml --time-limit", "needs S"},
        {"a.xml --adaptive yes", "--adaptive"},
        {"a.xml --adaptive=", "--adaptive"},
        {"a.xml --adaptive", "needs auto|on|off"},
        {"a.xml --sample-range 0:4 --noise-threshold 0.1", "goes with no --noise-threshold"},
        {"a.xml --time-limit 5 --sample-range 0:4", "goes with no --noise-threshold, --time-limit"},
        {"a.xml --sample-range 0:4 --adaptive on", "goes with no --noise-threshold, --time-limit or --adaptive"},
        {"a.xml --lanes 3", "1, 4, 8 or 16"},
        {"a.xml --precision half", "--precision"},
        {"a.xml --strategy fast", "expected auto, spherical, distance, equiangular, equiangular-cone, mis, product, "
                                  "systematic or raster, not \"fast\""},
        {"a.xml --strategy equiangular-", "--strategy"},
        {"a.xml --strategy raster:", "--strategy"},
        {"a.xml --strategy raster:0", "--strategy"},
        {"a.xml --strategy raster:3", "a power of two up to 64"},
        {"a.xml --strategy raster:128", "--strategy"},
        {"a.xml --strategy raster:8x", "--strategy"},
        {"a.xml --strategy :8", "--strategy"},
        {"a.xml --strategy", "needs NAME"},
        {"a.xml --indirect fast", "expected auto, phase, mixture or ray-lights"},
        {"a.xml --indirect ray-lights:4", "--indirect"},
        {"a.xml --exposure bright", "--exposure: expected a number,"},
        {"a.xml --exposure nan", "--exposure"},
        {"a.xml --clamp 0", "--clamp: expected a number above 0"},
        {"a.xml --clamp inf", "--clamp"},
        {"a.xml --debug-sample 3,4", "three whole numbers"},
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
        int status = cli_run(cases[i].line);
        if (status != 2)
            fail_msg("\"%s\": exit code %d, expected 2", cases[i].line, status);
        cli_expect_error_line(cases[i].part);
    }
}

static void help_and_version(void **state)
{
    (void)state;
    assert_int_equal(cli_run("--help"), 0);
    assert_non_null(strstr(cli.out, "--sample-range"));
    assert_int_equal(cli_run("-h"), 0);
    assert_int_equal(cli_run("--version"), 0);
    assert_non_null(strstr(cli.out, BRUME_VERSION));
}

static void scene_errors(void **state)
{
    (void)state;
    assert_int_equal(cli_run("missing.xml"), 3);
    cli_expect_error_line("missing.xml");
    cli_write("wrong.xml", "<scene version='3.0.0'>\n<shape type='spere'/>\n</scene>\n");
    assert_int_equal(cli_run("wrong.xml"), 3);
    cli_expect_error_line("wrong.xml:2:");
    assert_int_equal(cli_run("scene.xml -D heigth=8"), 3);
    cli_expect_error_line("heigth");
}

static void devices(void **state)
{
    (void)state;
    if (!cli_has_device()) {
        assert_int_equal(cli.status, 4);
        skip();
    }
    assert_int_equal(strncmp(cli.out, "0: ", 3), 0);
    assert_int_equal(cli_run("scene.xml --device no-such-device"), 4);
    cli_expect_error_line("no-such-device");
    assert_int_equal(cli_run("scene.xml --device 999"), 4);
    cli_expect_error_line("999");
    assert_int_equal(cli_run("scene.xml --device 0,999"), 4);
    cli_expect_error_line("no device 999");
    assert_int_equal(cli_run("scene.xml --device 0,"), 4);
    cli_expect_error_line("no device is called \"\"");
    assert_int_equal(cli_run("scene.xml --device 0,0"), 2);
    cli_expect_error_line("names device 0 twice");
    assert_int_equal(cli_run("scene.xml --device 0/0"), 2);
    cli_expect_error_line("no 0 parts");
    assert_int_equal(cli_run("scene.xml --device 0/65"), 2);
    cli_expect_error_line("--device names more than 64 devices");
}

static void unwritable_outputs_are_refused_first(void **state)
{
    (void)state;
    /* The scene doesn't exist, which would be exit code 3: outputs are looked at before anything else is done. */
    assert_int_equal(cli_run("missing.xml -o no/such/folder/a.exr"), 6);
    cli_expect_error_line("no/such/folder/a.exr");
    assert_int_equal(cli_run("missing.xml -o good.exr -o no/such/folder/a.png"), 6);
    assert_int_equal(cli_run("missing.xml -o scene.xml/a.png"), 6);
    assert_int_equal(cli_run("missing.xml --stats=json:no/such/folder/stats"), 6);
    char path[PATH_MAX];
    cli_path(path, "folder.exr");
    assert_int_equal(mkdir(path, 0777), 0);
    assert_int_equal(cli_run("missing.xml -o folder.exr"), 6);
    cli_expect_error_line("folder");
    assert_int_equal(rmdir(path), 0);
    char bytes[4];
    assert_int_equal(cli_read("good.exr", bytes, sizeof bytes), -1);
}

/* Said before anything is rendered. */
static void no_denoiser(void **state)
{
    (void)state;
    setenv("BRUME_OIDN", "/nonexistent", 1);
    cli_remove("a.exr");
    int code = cli_run("scene.xml -o a.exr --denoise beauty");
    unsetenv("BRUME_OIDN");
    assert_int_equal(code, 1);
    assert_non_null(strstr(cli.err, "error: denoising: $BRUME_OIDN is /nonexistent"));
    assert_int_equal(cli_read("a.exr", (char[4]){0}, 4), -1);
}

static int setup(void **state)
{
    (void)state;
    return cli_open(cli_scene);
}

static int teardown(void **state)
{
    (void)state;
    static const char *const files[] = {"scene.xml", "wrong.xml", "a.exr"};
    return cli_close(files, sizeof files / sizeof files[0]);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(usage_errors),
        cmocka_unit_test(help_and_version),
        cmocka_unit_test(scene_errors),
        cmocka_unit_test(devices),
        cmocka_unit_test(unwritable_outputs_are_refused_first),
        cmocka_unit_test(no_denoiser),
    };
    return cmocka_run_group_tests(tests, setup, teardown);
}

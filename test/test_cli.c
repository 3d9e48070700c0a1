/* test_cli.c -- what render-cli leaves on disk and says of it: pictures, statistics, exit codes after signals. */
#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "json_text.h"
#include "render_cli.h"

static void pictures_and_statistics(void **state)
{
    (void)state;
    if (!cli_has_device())
        skip();
    char bytes[8];
    assert_int_equal(cli_run("scene.xml -o a.exr -oa.png --spp=3 --seed 7 -Dwidth=20 --stats=json"), 0);
    assert_string_equal(cli.err, "");
    assert_true(json_valid(cli.out));
    assert_ptr_equal(strchr(cli.out, '\n'), cli.out + strlen(cli.out) - 1);
    cli_expect_member("scene", "\"scene.xml\"");
    cli_expect_member("outputs", "[\"a.exr\",\"a.png\"]");
    cli_expect_member("width", "20");
    cli_expect_member("height", "16");
    cli_expect_member("samples", "960");
    cli_expect_member("seed", "7");
    cli_expect_member("complete", "true");
    cli_expect_member("bad_samples", "0");
    cli_expect_member("exit_code", "0");
    assert_true(cli_read("a.exr", bytes, sizeof bytes) > 100);
    assert_memory_equal(bytes, "\x76\x2f\x31\x01", 4);
    assert_true(cli_read("a.png", bytes, sizeof bytes) > 50);
    assert_memory_equal(bytes, "\x89PNG\r\n\x1a\n", 8);

    /* without -o: the scene's name, here */
    assert_int_equal(cli_run("./scene.xml -q"), 0);
    assert_string_equal(cli.out, "");
    assert_string_equal(cli.err, "");
    assert_true(cli_read("scene.exr", bytes, sizeof bytes) > 100);
}

static void crop_and_sample_range(void **state)
{
    (void)state;
    if (!cli_has_device())
        skip();
    assert_int_equal(cli_run("scene.xml -o crop.exr --crop 3,10,2,16 --sample-range 5:9 --stats=json:stats.json"), 0);
    assert_string_equal(cli.out, "");
    char text[8192];
    long size = cli_read("stats.json", text, sizeof text);
    assert_in_range(size, 1, sizeof text - 1);
    memcpy(cli.out, text, sizeof text);
    assert_true(json_valid(cli.out));
    cli_expect_member("width", "7");
    cli_expect_member("height", "14");
    cli_expect_member("full_width", "24");
    cli_expect_member("crop_x", "3");
    cli_expect_member("crop_y", "2");
    cli_expect_member("first_sample", "5");
    cli_expect_member("sample_count", "4");
    cli_expect_member("samples", "392");

    assert_int_equal(cli_run("scene.xml -o crop.exr --crop 0,25,0,16"), 2);
    cli_expect_error_line("crop");
}

/* What is asked for comes back by its name, with the scene's where nothing is. */
static void strategies(void **state)
{
    (void)state;
    if (!cli_has_device())
        skip();
    assert_int_equal(cli_run("scene.xml -o a.exr --spp 1 --stats=json --strategy systematic:8 --indirect phase"), 0);
    cli_expect_member("strategy", "\"systematic\"");
    cli_expect_member("positions", "8");
    cli_expect_member("indirect", "\"phase\"");
    assert_int_equal(cli_run("scene.xml -o a.exr --spp 1 --stats=json --strategy=equiangular-cone --indirect phase"),
                     0);
    cli_expect_member("strategy", "\"equiangular-cone\"");
    assert_int_equal(cli_run("scene.xml -o a.exr --spp 1 --stats=json"), 0);
    cli_expect_member("strategy", "\"auto\"");
}

/* A number of samples that no test machine gets through, stopped after the first report. */
static void stopped_by(int number)
{
    char bytes[4];
    cli_remove("long.exr");
    cli_remove("long.png");
    int status = cli_run_until("scene.xml -o long.exr -o long.png --spp 4000000 --progress=json --stats=json",
                           "\"event\":\"progress\"", number);
    assert_int_equal(status, 128 + number);
    assert_true(cli_read("long.exr", bytes, sizeof bytes) > 100);
    assert_true(cli_read("long.png", bytes, sizeof bytes) > 50);
    const char *stats = strstr(cli.out, "{\"event\":\"stats\"");
    assert_non_null(stats);
    assert_true(json_valid(stats));
    assert_int_equal(strncmp(json_member(stats, "complete"), "false", 5), 0);
    assert_int_not_equal(strtol(json_member(stats, "samples"), NULL, 10), 0);
    assert_non_null(strstr(cli.err, "stopped at"));
}

static void interrupt_writes_the_picture(void **state)
{
    (void)state;
    if (!cli_has_device())
        skip();
    stopped_by(SIGINT);
    stopped_by(SIGTERM);
}

static void interrupt_before_the_render_ends_at_once(void **state)
{
    (void)state;
    /* A quick machine may be rendering already when the signal comes: the picture is optional, the code is not. */
    static const char line[] = "scene.xml -o early.exr --spp 4000000 --progress=json";
    assert_int_equal(cli_run_until(line, "\"event\":\"step\"", SIGINT), 130);
}

/* One seed, one picture, on one thread of PoCL's (other drivers ignore the variable) as on all. */
static void same_seed_same_bytes(void **state)
{
    (void)state;
    if (!cli_has_device())
        skip();
    static char first[65536], second[65536], other[65536];
    assert_int_equal(cli_run("scene.xml -o one.png --seed 3"), 0);
    setenv("POCL_MAX_PTHREAD_COUNT", "1", 1);
    assert_int_equal(cli_run("scene.xml -o two.png --seed 3"), 0);
    unsetenv("POCL_MAX_PTHREAD_COUNT");
    assert_int_equal(cli_run("scene.xml -o three.png --seed 4"), 0);
    long a = cli_read("one.png", first, sizeof first), b = cli_read("two.png", second, sizeof second);
    long c = cli_read("three.png", other, sizeof other);
    assert_in_range(a, 1, sizeof first);
    assert_int_equal(a, b);
    assert_memory_equal(first, second, (size_t)a);
    assert_true(c != a || memcmp(first, other, (size_t)a) != 0);
}

static int setup(void **state)
{
    (void)state;
    return cli_open(cli_scene);
}

static int teardown(void **state)
{
    (void)state;
    static const char *const files[] = {"scene.xml", "a.exr", "a.png", "scene.exr", "crop.exr", "one.png",
                                        "stats.json", "long.exr", "long.png", "early.exr", "two.png", "three.png"};
    return cli_close(files, sizeof files / sizeof files[0]);
}

/* The halves of a device give its picture, where it can be split. */
static void several_devices_same_bytes(void **state)
{
    (void)state;
    static char whole[65536], shared[65536];
    if (!cli_has_device() || cli_run("scene.xml -o two.png --spp 16 --device 0/2 --stats=json -v") != 0)
        skip();
    cli_expect_member("complete", "true");
    assert_non_null(strstr(cli.err, "% of the work"));
    assert_int_equal(cli_run("scene.xml -o one.png --spp 16 --device 0"), 0);
    long a = cli_read("one.png", whole, sizeof whole), b = cli_read("two.png", shared, sizeof shared);
    assert_in_range(a, 1, sizeof whole);
    assert_int_equal(a, b);
    assert_memory_equal(whole, shared, (size_t)a);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(pictures_and_statistics),
        cmocka_unit_test(crop_and_sample_range),
        cmocka_unit_test(strategies),
        cmocka_unit_test(interrupt_writes_the_picture),
        cmocka_unit_test(interrupt_before_the_render_ends_at_once),
        cmocka_unit_test(same_seed_same_bytes),
        cmocka_unit_test(several_devices_same_bytes),
    };
    return cmocka_run_group_tests(tests, setup, teardown);
}

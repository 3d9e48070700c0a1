/* render-cli --checkpoint and --resume as a user meets them: killed and gone on, refused, on a full disk. Runs the
 * program itself, from the build folder that the environment names (BRUME_BUILD). */
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
#include "checkpoints.h"
#include "json_text.h"
#include "render_cli.h"

/* With a limit of 512 bytes times `blocks` for every file that it writes. */
static int run_limited(int blocks, const char *line)
{
    char command[4 * PATH_MAX];
    snprintf(command, sizeof command, "ulimit -f %d; exec '%s' %s", blocks, cli_program, line);
    const char *const argv[] = {"/bin/sh", "-c", command, NULL};
    assert_true(child_run(&cli, cli_folder, argv, NULL, 0));
    return cli.status;
}

static void expect_same_file(const char *a, const char *b)
{
    size_t a_size, b_size;
    unsigned char *a_bytes = read_whole(path_of(a), &a_size), *b_bytes = read_whole(path_of(b), &b_size);
    assert_int_equal(a_size, b_size);
    assert_memory_equal(a_bytes, b_bytes, a_size);
    free(a_bytes);
    free(b_bytes);
}

/* The radiance of two EXRs: their headers tell how long each took. */
static void expect_same_picture(const char *a, const char *b)
{
    uint32_t width[2], height[2];
    float *rgb[2];
    must(brume_picture_read(context, path_of(a), &width[0], &height[0], &rgb[0]));
    must(brume_picture_read(context, path_of(b), &width[1], &height[1], &rgb[1]));
    assert_int_equal(width[0], width[1]);
    assert_int_equal(height[0], height[1]);
    assert_memory_equal(rgb[0], rgb[1], (size_t)width[0] * height[0] * 3 * sizeof(float));
    brume_picture_free(rgb[0]);
    brume_picture_free(rgb[1]);
}

static int exists(const char *name)
{
    return access(path_of(name), F_OK) == 0;
}

static void usage_errors(void **state)
{
    (void)state;
    assert_int_equal(cli_run("scene.xml --resume"), 2);
    cli_expect_error_line("--resume needs --checkpoint");
    assert_int_equal(cli_run("scene.xml --checkpoint-interval 5"), 2);
    cli_expect_error_line("--checkpoint-interval needs --checkpoint");
    assert_int_equal(cli_run("scene.xml --checkpoint a.exr -o a.exr"), 2);
    cli_expect_error_line("both");
    assert_int_equal(cli_run("scene.xml --checkpoint state --checkpoint-interval 0"), 2);
    /* Where it can't be written is found out before the scene is read, which isn't there. */
    assert_int_equal(cli_run("missing.xml --checkpoint no/such/folder/state"), 6);
    cli_expect_error_line("no/such/folder/state");
}

/* What a run is asked for: as much work as the machine can't do before its first report. */
typedef struct goal {
    const char *option;
    double value, harder; /* times this, it takes longer */
    const char *adaptive;
} goal;

/* kill -9 after each checkpoint, until a run gets to the end or has been killed often enough. How often it was. */
static int kill_and_go_on(const goal *g, double value)
{
    enum { MOST_KILLS = 2 };
    char line[512];
    int kills = 0;
    snprintf(line, sizeof line, "scene.xml %s %.15g %s -o parts.exr -o parts.png --checkpoint state --resume "
             "--checkpoint-interval 0.01 --progress=json", g->option, value, g->adaptive);
    while (kills < MOST_KILLS && cli_run_until(line, "\"event\":\"checkpoint\"", SIGKILL) == 1000 + SIGKILL) {
        kills++;
        assert_true(exists("state"));
        assert_false(exists("parts.exr"));
    }
    if (kills == MOST_KILLS)
        assert_int_equal(cli_run(line), 0);
    else
        assert_int_equal(cli.status, 0);
    return kills;
}

static void killed_and_gone_on(void **state)
{
    (void)state;
    NEEDS_DEVICE();
    static const goal goals[] = {{"--spp", 300, 8, "--adaptive off"},
                                 {"--spp", 300, 8, "--adaptive on"},
                                 {"--noise-threshold", 0.005, 0.1, ""}};
    char line[512];
    for (int i = 0; i < 3; i++) {
        double value = goals[i].value;
        while (kill_and_go_on(&goals[i], value) == 0) {
            remove(path_of("parts.exr"));
            remove(path_of("state"));
            value *= goals[i].harder;
        }
        snprintf(line, sizeof line, "scene.xml %s %.15g %s -o whole.exr -o whole.png", goals[i].option, value,
                 goals[i].adaptive);
        assert_int_equal(cli_run(line), 0);
        expect_same_picture("whole.exr", "parts.exr");
        expect_same_file("whole.png", "parts.png");
        remove(path_of("parts.exr"));
        remove(path_of("parts.png"));
        remove(path_of("state"));
    }
}

/* Ctrl-C keeps a checkpoint, which is in no later run's way: it needs --resume, and the same scene and settings. */
static void stopped_and_refused(void **state)
{
    (void)state;
    NEEDS_DEVICE();
    assert_int_equal(cli_run_until("scene.xml --spp 4000000 -o a.exr --checkpoint state --progress=json",
                                   "\"event\":\"progress\"", SIGINT), 130);
    assert_true(exists("state"));
    size_t size;
    unsigned char *bytes = read_whole(path_of("state"), &size);

    assert_int_equal(cli_run("scene.xml --spp 4000000 -o a.exr --checkpoint state"), 2);
    cli_expect_error_line("--resume goes on from it");
    assert_int_equal(cli_run("scene.xml --spp 4000000 -o a.exr --checkpoint state --resume --seed 8"), 7);
    cli_expect_error_line("seed");
    assert_int_equal(cli_run("scene.xml --spp 4000000 -o a.exr --checkpoint state --resume -D fog=0.3"), 7);
    cli_expect_error_line("scene is another one");
    assert_int_equal(cli_run("gone.xml --spp 4000000 -o a.exr --checkpoint state --resume"), 3);
    cli_expect_error_line("gone.xml");
    size_t now;
    unsigned char *still = read_whole(path_of("state"), &now);
    assert_int_equal(now, size);
    assert_memory_equal(still, bytes, size);
    free(still);

    bytes[size / 2] ^= 1;
    write_whole(path_of("state"), bytes, size);
    assert_int_equal(cli_run("scene.xml --spp 4000000 -o a.exr --checkpoint state --resume"), 7);
    cli_expect_error_line("damaged");
    free(bytes);
    remove(path_of("state"));
}

/* No room for checkpoints: the render goes on, its picture is written, the checkpoint before stays; one line each. */
static void full_disk(void **state)
{
    (void)state;
    NEEDS_DEVICE();
    assert_int_equal(cli_run("scene.xml --spp 8 -o before.exr --checkpoint state"), 0);
    size_t size, now;
    unsigned char *bytes = read_whole(path_of("state"), &size);
    assert_true(size > 60000);
    remove(path_of("a.png"));
    assert_int_equal(run_limited(60, "scene.xml --spp 32 -o a.png --checkpoint state --resume"), 6);
    cli_expect_error_line("state: File too large");
    assert_true(exists("a.png"));
    unsigned char *still = read_whole(path_of("state"), &now);
    assert_int_equal(now, size);
    assert_memory_equal(still, bytes, size);
    free(still);
    free(bytes);
    /* While it renders: one warning, however often it is tried. */
    const char *warning = NULL;
    for (int spp = 700; !warning; spp *= 8) {
        char line[512];
        assert_true(spp < 1 << 24);
        snprintf(line, sizeof line, "scene.xml --spp %d -o a.png --checkpoint state --resume "
                 "--checkpoint-interval 0.01", spp);
        assert_int_equal(run_limited(60, line), 6);
        warning = strstr(cli.err, "warning: state: File too large");
    }
    assert_null(strstr(warning + 1, "warning"));
    remove(path_of("state"));
}

/* The device fails in the middle: what it has rendered is written, and goes on from there to the same picture. */
static void failed_and_gone_on(void **state)
{
    (void)state;
    NEEDS_DEVICE();
    char shim[2 * PATH_MAX];
    snprintf(shim, sizeof shim, "%.*s/fail_launches.so", (int)(strrchr(cli_program, '/') - cli_program),
             cli_program);
    if (access(shim, R_OK) != 0)
        skip();
    assert_int_equal(cli_run("scene.xml --spp 64 --lanes 1 -o whole.exr"), 0);
    remove(path_of("parts.exr"));
    setenv("LD_PRELOAD", shim, 1);
    setenv("FAIL_LAUNCHES_FROM", "6", 1);
    int code = cli_run("scene.xml --spp 64 --lanes 1 -o parts.exr --checkpoint state");
    setenv("FAIL_LAUNCHES_FROM", "1", 1);
    int at_once = cli_run("scene.xml --spp 64 --lanes 1 -o none.exr");
    unsetenv("FAIL_LAUNCHES_FROM");
    unsetenv("LD_PRELOAD");
    assert_int_equal(at_once, 1);
    assert_false(exists("none.exr")); /* nothing has been rendered */
    assert_int_equal(code, 1);
    assert_true(exists("parts.exr") && exists("state"));
    assert_int_equal(cli_run("scene.xml --spp 64 --lanes 1 -o parts.exr --checkpoint state --resume"), 0);
    expect_same_picture("whole.exr", "parts.exr");
    remove(path_of("state"));
}

/* Ranges rendered apart, each with its checkpoint, come together; what is wrong with them is said in a line. */
static void merging(void **state)
{
    (void)state;
    NEEDS_DEVICE();
    assert_int_equal(cli_run("merge"), 2);
    cli_expect_error_line("no checkpoints");
    assert_int_equal(cli_run("merge a"), 2);
    cli_expect_error_line("no -o FILE");
    assert_int_equal(cli_run("merge a -o a.jpg"), 2);
    assert_int_equal(cli_run("merge a -o a.exr --spp 4"), 2);
    assert_int_equal(cli_run("merge a -o no/such/folder/a.exr"), 6);
    assert_int_equal(cli_run("merge a -o a.exr"), 7);
    cli_expect_error_line("a: No such file");
    assert_int_equal(cli_run("merge scene.xml -o a.exr"), 7);
    cli_expect_error_line("is not a checkpoint");

    assert_int_equal(cli_run("scene.xml --spp 24 -o whole.png"), 0);
    assert_int_equal(cli_run("scene.xml --sample-range 0:8 -o part.png --checkpoint a"), 0);
    assert_int_equal(cli_run("scene.xml --sample-range 8:24 -o part.png --checkpoint b"), 0);
    assert_int_equal(cli_run("merge b a -o a.png -o a.exr --stats=json"), 0);
    assert_string_equal(cli.err, "");
    assert_true(json_valid(cli.out));
    assert_int_equal(strtol(json_member(cli.out, "samples"), NULL, 10), 24 * COUNT);
    expect_same_file("whole.png", "a.png"); /* 8 bits: what differs by a last bit is the same */
    if (access("/dev/full", W_OK) == 0) {
        assert_int_equal(cli_run("merge b a -o a.png --stats=json:/dev/full"), 6);
        cli_expect_error_line("statistics could not be written");
    }
    /* What has been added up. */
    assert_int_equal(cli_run("merge a.exr b -o b.png"), 7);
    cli_expect_error_line("a.exr: is a picture, which lacks");
    assert_int_equal(cli_run("merge a.png b -o b.png"), 7);
    cli_expect_error_line("a.png: is a picture, which lacks");
    assert_int_equal(cli_run("merge a a -o a.png"), 7);
    cli_expect_error_line("both hold samples 0 to 7");
    assert_int_equal(cli_run("merge b -o a.png"), 7);
    cli_expect_error_line("samples are missing: 0 to 7");
    assert_int_equal(cli_run("merge b -o a.png --sample-range 8:24"), 0);
    assert_int_equal(cli_run("merge a -o a.png --sample-range 0:24"), 7);
    cli_expect_error_line("samples are missing: 8 to 23");
    assert_int_equal(cli_run("merge a -o a.png --sample-range 0:24 --partial"), 0);
    assert_non_null(strstr(cli.err, "warning: samples are missing: 8 to 23"));
    remove(path_of("a"));
    remove(path_of("b"));
}

static int setup(void **state)
{
    static const char *const scene =
        "<scene version='3.0.0'>\n"
        "<default name='width' value='48'/><default name='height' value='30'/><default name='fog' value='0.2'/>\n"
        "<integrator type='volpath'/>\n"
        "<medium type='homogeneous' id='fog'><float name='sigma_t' value='$fog'/></medium>\n"
        "<sensor type='perspective'>\n"
        "<transform name='to_world'><lookat origin='0,1,5' target='0,1,0' up='0,1,0'/></transform><ref id='fog'/>\n"
        "<film type='hdrfilm'><integer name='width' value='$width'/><integer name='height' value='$height'/></film>\n"
        "</sensor>\n"
        "<emitter type='spot'><transform name='to_world'><lookat origin='-2,3,1' target='0,1,0' up='0,1,0'/>"
        "</transform><rgb name='intensity' value='60'/></emitter>\n"
        "<shape type='sphere'><point name='center' x='0' y='1' z='0'/></shape>\n"
        "</scene>\n";
    if (open_checkpoints(state) != 0 || cli_find() != 0)
        return -1;
    snprintf(cli_folder, sizeof cli_folder, "%s", path_of(""));
    write_whole(path_of("scene.xml"), scene, strlen(scene));
    return 0;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(usage_errors),
        cmocka_unit_test(killed_and_gone_on),
        cmocka_unit_test(stopped_and_refused),
        cmocka_unit_test(full_disk),
        cmocka_unit_test(failed_and_gone_on),
        cmocka_unit_test(merging),
    };
    return cmocka_run_group_tests(tests, setup, close_checkpoints);
}

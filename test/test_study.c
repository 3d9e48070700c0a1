/* render-cli study as a user meets it: what it writes, how it is stopped and goes on, what it refuses; and its figures
 * against numpy, where python3 has that. */
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

#include "json_text.h"
#include "render_cli.h"

static char checker[2 * PATH_MAX];

/* A ball under a spotlight in fog; the file's name is one that HTML has to escape. */
#define SCENE "a&b<c>.xml"
static const char scene[] =
    "<scene version='3.0.0'>\n"
    "<default name='sigma' value='0.2'/>\n"
    "<integrator type='volpath'/>\n"
    "<medium type='homogeneous' id='fog'><float name='sigma_t' value='$sigma'/></medium>\n"
    "<sensor type='perspective'>\n"
    "<transform name='to_world'><lookat origin='0,1,5' target='0,1,0' up='0,1,0'/></transform><ref id='fog'/>\n"
    "<sampler type='ldsampler'/>\n"
    "<film type='hdrfilm'><integer name='width' value='24'/><integer name='height' value='16'/></film></sensor>\n"
    "<emitter type='spot'><transform name='to_world'><lookat origin='-2,3,1' target='0,1,0' up='0,1,0'/></transform>\n"
    "<rgb name='intensity' value='60'/></emitter>\n"
    "<shape type='sphere'><point name='center' x='0' y='1' z='0'/></shape>\n"
    "</scene>\n";

/* The whole file, to be freed; NULL if it isn't there. */
static char *read_file(const char *name)
{
    char path[PATH_MAX];
    cli_path(path, name);
    FILE *file = fopen(path, "rb");
    if (!file)
        return NULL;
    fseek(file, 0, SEEK_END);
    size_t size = (size_t)ftell(file);
    rewind(file);
    char *text = calloc(size + 1, 1);
    assert_non_null(text);
    assert_int_equal(fread(text, 1, size, file), size);
    fclose(file);
    return text;
}

static int run_until(const char *line, const char *signal_after, int number)
{
    const char *const first[] = {cli_program, "study", SCENE, NULL};
    return child_run_line(&cli, cli_folder, first, line, signal_after, number);
}

static int run(const char *line)
{
    return run_until(line, NULL, 0);
}

static int count_of(const char *text, const char *part)
{
    int count = 0;
    for (const char *at = text; (at = strstr(at, part)) != NULL; at += strlen(part))
        count++;
    return count;
}

static void usage_errors(void **state)
{
    (void)state;
    static const struct { const char *line, *part; } cases[] = {
        {"--settings fast", "--settings"},
        {"--settings auto,", "--settings"},
        {"--settings auto+", "--settings"},
        {"--settings auto,mis,auto", "auto twice"},
        {"--settings depth-", "--settings"},
        {"--settings depth-0", "--settings"},
        {"--settings depth-2.5", "--settings"},
        {"--settings clamp-2", "--settings"},
        {"--settings raster:3", "--settings"},
        {"--settings adaptive-2", "--settings"},
        {"--settings auto+adaptiv", "--settings"},
        {"--settings auto,auto+adaptive,auto+adaptive", "auto+adaptive twice"},
        {"--settings without", "--settings"},
        {"--settings without-", "no effect that can be taken away"},
        {"--settings auto+without-fog", "without-fog names no effect that can be taken away"},
        {"--settings without-multiple-scatterin", "no effect that can be taken away"},
        {"--settings without-many-lights+mis", "without-many-lights names no effect"}, /* known, but stays */
        {"--budget 0", "--budget"},
        {"--budget nan", "--budget"},
        {"--target -1", "--target"},
        {"--time-target x", "--time-target"},
        {"--clock sun", "--clock"},
        {"--width 0", "--width"},
        {"--spp 4", "takes no --spp"},
        {"--strategy mis", "takes no --strategy"},
        {"--reference", "needs FILE"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        if (run(cases[i].line) != 2)
            fail_msg("\"%s\": exit code %d, expected 2", cases[i].line, cli.status);
        cli_expect_error_line(cases[i].part);
    }
    assert_int_equal(run("--help"), 0);
    assert_non_null(strstr(cli.out, "--time-target"));
}

/* Exact, cut, clamped and in double; enough to fill every section of the page. */
#define SETTINGS "--settings auto,mis,independent+equiangular,auto+depth-2,auto+clamp-4x,auto+double"
#define PLAIN SETTINGS " --budget 3"

static void what_it_writes(void **state)
{
    (void)state;
    if (!cli_has_device())
        skip();
    assert_int_equal(run(PLAIN " -o plain --progress=json --target 0.01"), 0);
    assert_non_null(strstr(cli.out, "\"event\":\"progress\""));
    char *json = read_file("plain/study.json"), *csv = read_file("plain/study.csv");
    char *page = read_file("plain/study.html"), *journal = read_file("plain/study.journal");
    assert_true(json && csv && page && journal);
    assert_true(json_valid(json));
    assert_int_equal(count_of(json, "\"points\":[{"), 6);
    assert_int_equal(count_of(json, "\"time_factor\":"), 1);
    assert_int_equal(count_of(csv, "\n") - 1, 2 * count_of(json, "\"pair_deviates\":"));
    assert_int_equal(count_of(journal, "\nrun "), 14);

    /* one file, nothing from elsewhere, names escaped, nothing unclosed */
    assert_null(strstr(page, "<script"));
    assert_null(strstr(page, "<link rel=stylesheet"));
    assert_null(strstr(page, "src='http"));
    assert_null(strstr(page, SCENE));
    assert_non_null(strstr(page, "a&amp;b&lt;c&gt;.xml"));
    assert_non_null(strstr(page, "prefers-color-scheme:dark"));
    /* the reference, and each setting with its errors */
    assert_int_equal(count_of(page, "data:image/png;base64,"), 13);
    assert_int_equal(count_of(page, "<table"), count_of(page, "</table>"));
    assert_int_equal(count_of(page, "<figure"), count_of(page, "</figure>"));
    assert_int_equal(count_of(page, "<th scope=row><b>"), 6 + 2 + 1); /* prices, approximations, rounding */
    assert_int_equal(count_of(page, "<th scope=row>") - 9, 6 + count_of(json, "\"pair_deviates\":"));
    assert_non_null(strstr(page, "id=approximations"));
    assert_non_null(strstr(page, "id=precision"));
    assert_non_null(strstr(page, "</html>"));

    /* again: nothing is rendered, and the same is written */
    assert_int_equal(run(PLAIN " -o plain --target 0.01"), 0);
    char *again = read_file("plain/study.json"), *same = read_file("plain/study.journal");
    assert_string_equal(again, json);
    assert_string_equal(same, journal);
    free(again);
    free(same);
    free(json);
    free(csv);
    free(page);
    free(journal);
}

static void figures_agree_with_numpy(void **state)
{
    (void)state;
    char path[PATH_MAX];
    cli_path(path, "plain/study.csv");
    if (access(path, R_OK) != 0)
        skip();
    const char *argv[] = {"/usr/bin/env", "python3", checker, "plain", NULL};
    assert_true(child_run(&cli, cli_folder, argv, NULL, 0));
    if (cli.status == 77 || cli.status == 127) {
        print_message("no numpy: make check-study installs it\n");
        skip();
    }
    if (cli.status != 0)
        fail_msg("%s%s", cli.out, cli.err);
}

/* Every value of `key` between the setting's name and the next setting; how many there are. */
static int points_of(const char *json, const char *name, const char *key, double values[64])
{
    char what[96], member[64];
    int count = 0;
    snprintf(what, sizeof what, "{\"name\":\"%s\"", name);
    snprintf(member, sizeof member, "\"%s\":", key);
    const char *at = strstr(json, what);
    assert_non_null(at);
    const char *end = strstr(at + 1, "{\"name\":");
    while ((at = strstr(at, member)) != NULL && (!end || at < end) && count < 64) {
        at += strlen(member);
        values[count++] = strncmp(at, "null", 4) == 0 ? -1 : strtod(at, NULL);
    }
    return count;
}

/* Each point of an adaptive curve is a render of its own: they go up by powers of two all the same, as far as those of
 * a render that climbs, begin with the same pictures, and know their error. Single scattering is told as what it is:
 * an approximation that loses light. */
static void adaptive_and_without(void **state)
{
    (void)state;
    if (!cli_has_device())
        skip();
    static const char line[] = "--settings auto,auto+adaptive,auto+without-multiple-scattering --budget 8 -o placed";
    assert_int_equal(run(line), 0);
    char *json = read_file("placed/study.json"), *page = read_file("placed/study.html");
    assert_true(json && page);
    assert_true(json_valid(json));
    double plain[64], samples[64], values[64], estimates[64];
    int uniform = points_of(json, "auto", "relmse", plain);
    int count = points_of(json, "auto+adaptive", "samples", samples);
    assert_true(count >= 5 && uniform >= 5);
    for (int i = 0; i < count; i++)
        assert_true(samples[i] == (double)(1 << i));
    assert_int_equal(points_of(json, "auto+adaptive", "relmse", values), count);
    assert_int_equal(points_of(json, "auto+adaptive", "estimated_relmse", estimates), count);
    for (int i = 0; i < 4; i++)
        assert_true(values[i] == plain[i]);
    assert_true(values[4] != plain[4]);
    assert_true(estimates[0] < 0 && estimates[4] > 0);
    assert_int_equal(points_of(json, "auto+adaptive", "approximate", values), 1);
    assert_int_equal(count_of(json, "\"approximate\":true"), 1);
    assert_non_null(strstr(strstr(json, "auto+without-multiple-scattering"), "\"approximate\":true"));
    count = points_of(json, "auto+without-multiple-scattering", "mean_ratio", values);
    assert_true(count >= 5 && values[count - 1] < 0.95);
    assert_non_null(strstr(page, "<th scope=row><b>auto+without-multiple-scattering</b>"));
    free(page);

    /* again: nothing is rendered, the estimates come from the journal */
    assert_int_equal(run(line), 0);
    char *again = read_file("placed/study.json");
    assert_string_equal(again, json);
    free(again);
    free(json);
    assert_int_equal(run("--settings auto,auto+adaptive,auto+without-multiple-scattering --budget 8 -o placed "
                         "--without absorption"), 2);
    cli_expect_error_line("without");
}

static void another_study_is_refused(void **state)
{
    (void)state;
    if (!cli_has_device())
        skip();
    char *before = read_file("plain/study.journal");
    assert_non_null(before);
    static const char *const others[] = {SETTINGS " --budget 4 -o plain", "--settings auto --budget 3 -o plain",
                                         PLAIN " --width 12 -o plain", PLAIN " --seed 5 -o plain",
                                         PLAIN " -D sigma=0.3 -o plain"};
    static const char *const parts[] = {"budget", "settings", "size", "seed", "content"};
    for (size_t i = 0; i < sizeof others / sizeof others[0]; i++) {
        assert_int_equal(run(others[i]), 2);
        cli_expect_error_line(parts[i]);
        cli_expect_error_line("--fresh");
    }
    char *after = read_file("plain/study.journal");
    assert_string_equal(before, after);
    free(before);
    free(after);
    cli_write("plain/study.journal", "something else\n");
    assert_int_equal(run(PLAIN " -o plain"), 2);
    cli_expect_error_line("no journal");
    assert_int_equal(run("--settings auto --budget 0.2 -o plain --fresh"), 0);
    assert_int_equal(run("-o " SCENE "/x"), 6);
    cli_expect_error_line(SCENE "/x");
}

/* Stopped in the middle, and once more in the middle of a line of its journal: what was finished stays as it was, the
 * rest is made up for. */
static void stopped_and_resumed(void **state)
{
    (void)state;
    if (!cli_has_device())
        skip();
    static const char line[] = SETTINGS " --budget 6 -o stopped --progress=json";
    assert_int_equal(run_until(line, "\"detail\":\"mis (2 of 6)", SIGINT), 130);
    assert_non_null(strstr(cli.err, "goes on"));
    char *journal = read_file("stopped/study.journal"), *page = read_file("stopped/study.html");
    char *json = read_file("stopped/study.json");
    assert_true(journal && page && json);
    assert_true(json_valid(json));
    int finished = count_of(journal, "\nrun ");
    assert_in_range(finished, 4, 13);
    assert_non_null(strstr(page, "Unfinished"));
    assert_non_null(strstr(page, "</html>"));
    free(page);
    free(json);

    char path[PATH_MAX];
    cli_path(path, "stopped/study.journal");
    assert_int_equal(truncate(path, (long)strlen(journal) - 9), 0);
    assert_int_equal(run(line), 0);
    char *whole = read_file("stopped/study.journal");
    page = read_file("stopped/study.html");
    assert_int_equal(count_of(whole, "\nrun "), 14);
    char *last = strrchr(journal, 'r'); /* of the last line's "run": that run was made again */
    while (strncmp(last, "run ", 4) != 0)
        last--;
    assert_memory_equal(whole, journal, (size_t)(last - journal));
    assert_null(strstr(page, "Unfinished"));
    free(journal);
    free(whole);
    free(page);
}

/* Before the reference is there, there is nothing to show, and the page says so. */
static void stopped_in_the_reference(void **state)
{
    (void)state;
    if (!cli_has_device())
        skip();
    assert_int_equal(run_until("--budget 60 -o early --progress=json", "\"event\":\"progress\"", SIGTERM), 143);
    char *page = read_file("early/study.html"), *json = read_file("early/study.json");
    assert_true(page && json);
    assert_non_null(strstr(page, "Nothing to compare yet"));
    assert_true(json_valid(json));
    free(page);
    free(json);
}

static void somebody_elses_reference(void **state)
{
    (void)state;
    if (!cli_has_device())
        skip();
    const char *render[] = {cli_program, SCENE, "-o", "theirs.exr", "--spp", "64", "--seed", "9", NULL};
    assert_true(child_run(&cli, cli_folder, render, NULL, 0));
    assert_int_equal(cli.status, 0);
    assert_int_equal(run("--settings auto --budget 0.5 -o other --reference theirs.exr"), 0);
    char *json = read_file("other/study.json");
    assert_non_null(json);
    const char *other = json_member(json, "other");
    assert_non_null(other);
    /* the same scene: as far off as 64 samples are */
    double error = strtod(json_member(other, "relmse"), NULL), light = strtod(json_member(other, "mean_ratio"), NULL);
    assert_true(error > 0 && error < 1 && light > 0.9 && light < 1.1);
    free(json);
    assert_int_equal(run("--settings auto -o other --reference missing.exr"), 3);
    cli_expect_error_line("missing.exr");
    assert_int_equal(run("--settings auto -o other --reference theirs.exr --width 12"), 2);
    cli_expect_error_line("theirs.exr");
    const char *square[] = {cli_program, SCENE, "-o", "theirs.exr", "--spp", "1", "--crop", "0,16,0,16", NULL};
    assert_true(child_run(&cli, cli_folder, square, NULL, 0));
    assert_int_equal(run("--settings auto -o other --reference theirs.exr"), 2);
    cli_expect_error_line("16 x 16");
}

static int setup(void **state)
{
    (void)state;
    char here[PATH_MAX];
    if (!getcwd(here, sizeof here) || cli_open(NULL) != 0)
        return 1;
    cli_write(SCENE, scene);
    return snprintf(checker, sizeof checker, "%s/test/study/check_figures.py", here) >= (int)sizeof checker;
}

static int teardown(void **state)
{
    (void)state;
    const char *argv[] = {"/usr/bin/env", "rm", "-rf", cli_folder, NULL};
    return !child_run(&cli, "/tmp", argv, NULL, 0) || cli.status != 0;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(usage_errors),
        cmocka_unit_test(what_it_writes),
        cmocka_unit_test(figures_agree_with_numpy),
        cmocka_unit_test(adaptive_and_without),
        cmocka_unit_test(another_study_is_refused),
        cmocka_unit_test(stopped_and_resumed),
        cmocka_unit_test(stopped_in_the_reference),
        cmocka_unit_test(somebody_elses_reference),
    };
    return cmocka_run_group_tests(tests, setup, teardown);
}

/* test_full_disk.c -- render-cli where files can't be written: a disk that fills up at any byte, for every kind of file
 * that it writes; folders that aren't there, or are read-only; devices and pipes in the place of files. One line each,
 * the right exit code, what was there stays whole, and nothing is left over. Runs the program itself, from the build
 * folder that the environment names (BRUME_BUILD).
 */
#include <dirent.h>
#include <limits.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmocka.h>

#include "checkpoints.h"
#include "json_text.h"
#include "render_cli.h"

/* With a limit of 512 bytes times `blocks` for every file that it writes; < 0: none. */
static int run(int blocks, const char *line) {
    char command[4 * PATH_MAX], limit[32] = "";
    if (blocks >= 0) snprintf(limit, sizeof limit, "ulimit -f %d; ", blocks);
    snprintf(command, sizeof command, "%sexec '%s' %s", limit, cli_program, line);
    const char *const argv[] = {"/bin/sh", "-c", command, NULL};
    assert_true(child_run(&cli, cli_folder, argv, NULL, 0));
    return cli.status;
}

/* How many files of the folder hold `part` in their names. */
static int files_with(const char *folder, const char *part) {
    DIR *directory = opendir(folder);
    int count = 0;
    assert_non_null(directory);
    for (struct dirent *d; (d = readdir(directory));) count += strstr(d->d_name, part) != NULL;
    closedir(directory);
    return count;
}

/* Whether the file holds these bytes and no others. */
static int holds(const char *path, const unsigned char *bytes, size_t size) {
    size_t now;
    unsigned char *held = read_whole(path, &now);
    int same = now == size && memcmp(held, bytes, size) == 0;
    free(held);
    return same;
}

/* What render-cli writes: a command, the file that is too large for the disk, what the error names, and the most blocks
 * to try, if not all that it takes: a page for which there was no room for the plot goes without. The parts a and b lie
 * in the folder. */
static const struct { const char *line, *file, *named; int most; } outputs[] = {
    {"scene.xml --spp 1 --lanes 1 -o out.exr", "out.exr", "out.exr", 0},
    {"scene.xml --spp 1 --lanes 1 -o out.png", "out.png", "out.png", 0},
    {"scene.xml --spp 1 --lanes 1 -o small.png --crop 0,1,0,1 --stats=json:out.json", "out.json", "out.json", 0},
    {"scene.xml --spp 1 --lanes 1 -o small.png --checkpoint out.state --resume", "out.state", "out.state", 0},
    {"merge a b -o out.exr", "out.exr", "out.exr", 0},
    {"merge a b -o out.png", "out.png", "out.png", 0},
    {"effects plain.xml --spp 1 --lanes 1 -o effects", "effects/effects.json", "effects/", 0},
    {"study scene.xml --settings auto --budget 0.5 --width 8 -o study", "study/study.html", "study/", 17},
};
enum { OUTPUTS = sizeof outputs / sizeof outputs[0] };

static void no_leftovers(void) {
    static const char *const folders[] = {"", "effects", "study", "study/pictures"};
    for (int i = 0; i < 4; i++)
        if (i == 0 || access(path_of(folders[i]), F_OK) == 0) assert_int_equal(files_with(path_of(folders[i]), ".tmp"), 0);
}

static void every_file(void **state) {
    (void)state;
    NEEDS_DEVICE();
    static const unsigned char before[] = "before";
    for (int i = 0; i < OUTPUTS; i++) {
        char path[128];
        size_t size;
        snprintf(path, sizeof path, "%s", path_of(outputs[i].file));
        if (run(-1, outputs[i].line) != 0) fail_msg("%s: %s", outputs[i].line, cli.err);
        free(read_whole(path, &size));
        /* Nothing fits, half does, all but the end does. */
        int needed = (int)((size + 511) / 512), step;
        if (outputs[i].most) needed = outputs[i].most;
        step = needed < 3 ? 1 : (needed - 1) / 2;
        for (int blocks = 0; blocks < needed; blocks += step) {
            int is_state = strstr(outputs[i].file, ".state") != NULL; /* which would be read */
            if (is_state)
                remove(path);
            else
                write_whole(path, before, sizeof before);
            int code = run(blocks, outputs[i].line);
            if (code != 6) fail_msg("%s, %d blocks: exit code %d: %s", outputs[i].line, blocks, code, cli.err);
            const char *error = strstr(cli.err, "error: "); /* of the other picture, too, where nothing fits */
            if (!error || !strstr(error, outputs[i].named) || !strstr(error, "File too large"))
                fail_msg("%s, %d blocks: %s", outputs[i].line, blocks, cli.err);
            if (is_state ? access(path, F_OK) == 0 : !holds(path, before, sizeof before))
                fail_msg("%s, %d blocks: %s is not what was there", outputs[i].line, blocks, outputs[i].file);
            no_leftovers();
        }
        if (run(-1, outputs[i].line) != 0) fail_msg("%s, with room again: %s", outputs[i].line, cli.err);
        remove(path);
    }
}

/* The system's own words on a disk that is really full. The picture fits and the checkpoint doesn't, or the other way
 * round: one is written though the other can't be. */
static void a_small_disk(void **state) {
    (void)state;
    NEEDS_DEVICE();
    static const char script[] =
        "mkdir disk && mount -t tmpfs -o size=16k,mode=700 none disk || exit 99; r='%s scene.xml -D width=240 --lanes 1 --spp 1'; "
        "$r -o disk/a.png --checkpoint disk/state; echo code $?; $r -o disk/a.exr -o b.png; echo code $?; ls disk; "
        "mount -o remount,ro disk && $r -o disk/a.png; echo code $?; umount disk";
    char command[8 * PATH_MAX];
    snprintf(command, sizeof command, script, cli_program);
    const char *const argv[] = {"/usr/bin/env", "unshare", "-m", "/bin/sh", "-c", command, NULL};
    if (!child_run(&cli, cli_folder, argv, NULL, 0) || cli.status != 0) skip();
    assert_string_equal(cli.out, "code 6\ncode 6\na.png\ncode 6\n");
    const char *first = strstr(cli.err, "disk/state: No space left on device");
    assert_non_null(first);
    assert_non_null(strstr(first, "disk/a.exr: No space left on device"));
    assert_non_null(strstr(first, "disk/a.png: cannot be written: Read-only file system"));
    assert_int_equal(access(path_of("b.png"), F_OK), 0);
}

/* Before anything is rendered, or the scene, which isn't there, is read. */
static void folders_that_take_no_files(void **state) {
    (void)state;
    static const char *const lines[] = {
        "missing.xml -o %s/a.exr",          "missing.xml -o %s/a.png",       "missing.xml --stats=json:%s/a.json",
        "missing.xml --checkpoint %s/state", "merge missing -o %s/a.exr",     "effects missing.xml -o %s/effects",
        "study scene.xml -o %s/study",    "merge missing -o a.exr --stats=json:%s/a.json"};
    static const char *const folders[] = {"/proc", "gone", "scene.xml"};
    for (size_t i = 0; i < sizeof lines / sizeof lines[0]; i++)
        for (int k = 0; k < 3; k++) {
            char line[200];
            if (k == 1 && strncmp(lines[i], "study", 5) == 0) continue; /* which makes folders */
            snprintf(line, sizeof line, lines[i], folders[k]);
            if (run(-1, line) != 6) fail_msg("%s: exit code %d: %s", line, cli.status, cli.err);
            cli_expect_error_line(folders[k]);
        }
}

/* What is no file is written to as it is, and stays what it is. */
static void devices_and_pipes(void **state) {
    (void)state;
    NEEDS_DEVICE();
    struct stat info;
    if (stat("/dev/full", &info) == 0 && S_ISCHR(info.st_mode)) {
        /* By a link, so that whoever replaces it replaces that. */
        assert_int_equal(symlink("/dev/full", path_of("full")), 0);
        assert_int_equal(run(-1, "scene.xml --spp 1 --lanes 1 -o b.png --stats=json:full"), 6);
        cli_expect_error_line("full: statistics could not be written: No space left on device");
        assert_true(stat(path_of("full"), &info) == 0 && S_ISCHR(info.st_mode));
    }
    assert_int_equal(run(-1, "scene.xml --spp 1 --lanes 1 -o b.png --stats=json:/dev/stdout"), 0);
    assert_true(json_valid(cli.out));
    assert_int_equal(mkfifo(path_of("pipe"), 0600), 0);
    assert_int_equal(run(-1, "scene.xml --spp 1 --lanes 1 -o b.png --stats=json:pipe & cat pipe"), 0);
    assert_true(json_valid(cli.out));
    assert_true(stat(path_of("pipe"), &info) == 0 && S_ISFIFO(info.st_mode));
}

/* ---- what a scene file names --------------------------------------------------------------------------------------- */

/* Each path that a scene file may have, to a file that isn't there, to one that is, and to a folder: all are read at
 * most. */
static void scene_files_write_nowhere(void **state) {
    (void)state;
    NEEDS_DEVICE();
    static const char *const elements[] = {
        "<include filename='%s'/>",
        "<shape type='obj'><string name='filename' value='%s'/></shape>",
        "<shape type='ply'><string name='filename' value='%s'/></shape>",
        "<emitter type='envmap'><string name='filename' value='%s'/></emitter>",
        "<shape type='sphere'><bsdf type='diffuse'><texture type='bitmap' name='reflectance'>"
        "<string name='filename' value='%s'/></texture></bsdf></shape>",
        "<path value='%s'/>",
        "<sensor type='perspective'><film type='hdrfilm'><string name='filename' value='%s'/></film></sensor>",
        "<string name='output' value='%s'/>",
    };
    static const char *const places[] = {"held/new", "held/old", "held", "../held/new", "%s/held/new", "/dev/full"};
    static const unsigned char old[] = "an old file";
    assert_int_equal(mkdir(path_of("held"), 0700), 0);
    write_whole(path_of("held/old"), old, sizeof old);
    struct stat before, after;
    assert_int_equal(stat(path_of("held/old"), &before), 0);
    int refused = 0;
    for (size_t i = 0; i < sizeof elements / sizeof elements[0]; i++)
        for (size_t k = 0; k < sizeof places / sizeof places[0]; k++) {
            char place[256], element[512], scene[1024];
            snprintf(place, sizeof place, places[k], path_of(""));
            snprintf(element, sizeof element, elements[i], place);
            snprintf(scene, sizeof scene, "<scene version='3.0.0'>%s</scene>", element);
            write_whole(path_of("names.xml"), scene, strlen(scene));
            int files = files_with(path_of(""), "");
            int code = run(-1, "names.xml --spp 1 --lanes 1 -o b.png");
            if (code != 0 && code != 3) fail_msg("%s: exit code %d: %s", scene, code, cli.err);
            refused += code == 3;
            assert_int_equal(files_with(path_of(""), ""), files);
            assert_int_equal(files_with(path_of("held"), ""), 3); /* with . and .. */
            assert_true(holds(path_of("held/old"), old, sizeof old));
            assert_int_equal(stat(path_of("held/old"), &after), 0);
            assert_true(before.st_ino == after.st_ino && before.st_mtim.tv_sec == after.st_mtim.tv_sec &&
                        before.st_mtim.tv_nsec == after.st_mtim.tv_nsec);
        }
    assert_true(refused >= 5 * 6); /* files that have to be read */
}

static int setup(void **state) {
    if (open_checkpoints(state) != 0 || cli_find() != 0) return -1;
    snprintf(cli_folder, sizeof cli_folder, "%s", path_of(""));
    cli_write("scene.xml", cli_scene);
    cli_write("plain.xml", "<scene version='3.0.0'><emitter type='constant'/><sensor type='perspective'>"
                           "<film type='hdrfilm'><integer name='width' value='8'/><integer name='height' value='8'/>"
                           "</film></sensor></scene>");
    if (device && (run(-1, "scene.xml --lanes 1 --sample-range 0:1 -o b.png --checkpoint a") != 0 ||
                   run(-1, "scene.xml --lanes 1 --sample-range 1:3 -o b.png --checkpoint b") != 0))
        return -1;
    return 0;
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_file),        cmocka_unit_test(a_small_disk),
        cmocka_unit_test(folders_that_take_no_files), cmocka_unit_test(devices_and_pipes),
        cmocka_unit_test(scene_files_write_nowhere),
    };
    return cmocka_run_group_tests_name("full_disk", tests, setup, close_checkpoints);
}

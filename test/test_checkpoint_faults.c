/* test_checkpoint_faults.c -- a checkpoint is a whole one whatever happens while it is written: a call to the system
 * that fails, a process that ends between any two of them, kill -9 at any of them. */
#include <errno.h>
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

#include "break_off.h"
#include "checkpoints.h"
#include "child.h"
#include "faults/file_shim.h"

static brume_result save_failing(brume_render *render, const char *path, file_fault fault, int at, int error) {
    file_shim_begin(fault, at, error);
    brume_result result = brume_render_save(render, path);
    file_shim_end();
    return result;
}

static brume_result save_watched(brume_render *render, const char *path, file_fault fault, int at) {
    return save_failing(render, path, fault, at, ENOSPC);
}

/* ---- a render with two states ---- */

static brume_render_desc adaptive_desc(void) {
    brume_render_desc desc = checkpoint_desc();
    desc.sample_count = 32;
    desc.adaptive = BRUME_ADAPTIVE_ON;
    desc.guides = 0;
    return desc;
}

/* Goes on for some launches. */
static void run_a_little(brume_render *render, int reports) {
    assert_int_equal(break_off_after(render, 130, reports), BRUME_CANCELLED);
}

static int same_bytes(const char *path, const unsigned char *bytes, size_t size) {
    size_t now;
    unsigned char *held = read_whole(path, &now);
    int same = now == size && memcmp(held, bytes, size) == 0;
    free(held);
    return same;
}

/* Temporary files in the folder. */
static int leftovers(void) {
    char command[192], line[16] = "";
    snprintf(command, sizeof command, "ls '%s' | grep -c 'tmp$'", path_of(""));
    FILE *list = popen(command, "r");
    assert_non_null(list);
    assert_non_null(fgets(line, sizeof line, list));
    pclose(list);
    return atoi(line);
}

static void whole_old_or_whole_new(void **state) {
    (void)state;
    NEEDS_DEVICE();
    static whole_film whole, later;
    char path[128];
    snprintf(path, sizeof path, "%s", path_of("state"));
    size_t old_size, new_size;
    brume_scene *scene = slats();
    brume_render_desc desc = adaptive_desc();
    finish(create(scene, &desc), &whole);

    brume_render *render = create(scene, &desc);
    run_a_little(render, 9);
    must(brume_render_save(render, path));
    unsigned char *old = read_whole(path, &old_size);
    run_a_little(render, 11);
    must(save_watched(render, path, FILE_NONE, 0));
    unsigned char *new = read_whole(path, &new_size);
    assert_true(old_size != new_size || memcmp(old, new, new_size) != 0);

    /* First all of the file to the disk, then the name, then that to the disk. */
    size_t calls = strlen(file_shim_log()), writes = strspn(file_shim_log() + 1, "w");
    assert_int_equal(file_shim_log()[0], 'o');
    assert_true(writes > 10);
    assert_string_equal(file_shim_log() + 1 + writes, "fcrOFC");

    brume_context_set_log(context, NULL, NULL);
    for (size_t at = 0; at < calls; at++) {
        size_t renamed = 1 + writes + 2;
        write_whole(path, old, old_size);
        assert_int_equal(save_watched(render, path, FILE_FAILS, (int)at),
                         at + 1 == calls ? BRUME_OK : BRUME_ERROR_OUTPUT);
        if (at + 1 < calls) assert_non_null(strstr(brume_context_message(context), "No space left on device"));
        assert_true(at <= renamed ? same_bytes(path, old, old_size) : same_bytes(path, new, new_size));
        assert_int_equal(leftovers(), 0);

        write_whole(path, old, old_size);
        save_watched(render, path, FILE_ENDS, (int)at);
        assert_true(at <= renamed ? same_bytes(path, old, old_size) : same_bytes(path, new, new_size));
        assert_int_equal(leftovers(), at > 0 && at <= renamed);
        must(brume_render_save(render, path)); /* clears away what that left */
        assert_int_equal(leftovers(), 0);
    }
    /* A folder that may be written to, and not be read: the file is there, and only when its name is on the disk can't
     * be known. */
    write_whole(path, old, old_size);
    must(save_failing(render, path, FILE_FAILS, (int)(1 + writes + 3), EACCES));
    assert_true(same_bytes(path, new, new_size));
    render->launch_groups = 0;
    finish(render, &later);
    expect_same(&whole, &later);
    free(old);
    free(new);
    brume_scene_destroy(scene);
}

/* ---- kill -9 ---- */

/* What the killed process does: goes on from the file for a while, saves, and is killed at a call of that. */
static int be_killed(const char *path, int at) {
    if (open_device(NULL) != 0) return 1;
    brume_scene *scene = slats();
    brume_render_desc desc = adaptive_desc();
    brume_render *render = create(scene, &desc);
    if (brume_render_load(render, path) != BRUME_OK) return 1;
    run_a_little(render, 5);
    save_watched(render, path, FILE_KILLS, at);
    return 1; /* not reached, or else */
}

static void killed_at_any_call(void **state) {
    (void)state;
    NEEDS_DEVICE();
    static whole_film whole, after;
    static child_result result;
    char self[1024], path[128], number[16], here[1024];
    ssize_t length = readlink("/proc/self/exe", self, sizeof self - 1);
    assert_true(length > 0 && getcwd(here, sizeof here));
    self[length] = 0;
    snprintf(path, sizeof path, "%s", path_of("state"));
    brume_scene *scene = slats();
    brume_render_desc desc = adaptive_desc();
    finish(create(scene, &desc), &whole);
    brume_render *render = create(scene, &desc);
    run_a_little(render, 9);
    must(save_watched(render, path, FILE_NONE, 0));
    int calls = file_shim_calls();
    brume_render_destroy(render);
    /* The first calls, some of the many writes, all that follow them. */
    for (int at = 0, at_end = calls - 14; at < calls; at += at < 2 || at >= at_end ? 1 : 6) {
        snprintf(number, sizeof number, "%d", at);
        const char *const argv[] = {self, path, number, NULL};
        assert_true(child_run(&result, here, argv, NULL, 0));
        assert_int_equal(result.status, 1000 + SIGKILL);
        render = create(scene, &desc);
        must(brume_render_load(render, path));
        assert_true(!render->finished);
        finish(render, &after);
        expect_same(&whole, &after);
    }
    brume_scene_destroy(scene);
}

int main(int argc, char **argv) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(whole_old_or_whole_new),
        cmocka_unit_test(killed_at_any_call),
    };
    if (argc == 3) return be_killed(argv[1], atoi(argv[2]));
    return cmocka_run_group_tests(tests, open_checkpoints, close_checkpoints);
}

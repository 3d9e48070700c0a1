/* test_output.c -- what is left of files that were never finished: the temporary ones of processes that have ended go,
 * those that somebody may be writing stay. */
#include <dirent.h>
#include <fcntl.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include <cmocka.h>

#include "output.h"
#include "platform.h"

static char folder[] = "/tmp/brume-output-XXXXXX";
static char path[64];

static int setup(void **state) {
    (void)state;
    if (!mkdtemp(folder)) return -1;
    snprintf(path, sizeof path, "%s/state", folder);
    return 0;
}

static int teardown(void **state) {
    (void)state;
    char command[64];
    snprintf(command, sizeof command, "rm -rf '%s'", folder);
    return system(command);
}

/* The files of the folder, and one of them. */
static int count_files(char name[512]) {
    int count = 0;
    DIR *directory = opendir(folder);
    assert_non_null(directory);
    for (struct dirent *d; (d = readdir(directory)) != NULL;)
        if (d->d_name[0] != '.') {
            count++;
            if (name) snprintf(name, 512, "%s/%s", folder, d->d_name);
        }
    closedir(directory);
    return count;
}

/* Another process that begins the file and goes on when told to: by a byte to *out_go, after which it gives the file
 * its name and exits with the result. At once it ends in the middle if out_go is NULL. */
static pid_t begin_elsewhere(int *out_go) {
    int begun[2], go[2];
    char byte = 0;
    assert_true(pipe(begun) == 0 && pipe(go) == 0);
    pid_t child = fork();
    assert_true(child >= 0);
    if (child == 0) {
        brume_output output;
        if (brume_output_open(NULL, path, &output) != BRUME_OK) _exit(100);
        brume_output_append(&output, "abc", 3);
        if (!out_go) _exit(0);
        if (write(begun[1], &byte, 1) != 1 || read(go[0], &byte, 1) != 1) _exit(101);
        _exit((int)brume_output_close(NULL, &output, 1));
    }
    if (out_go) {
        assert_int_equal(read(begun[0], &byte, 1), 1);
        *out_go = go[1];
    } else {
        int status;
        assert_int_equal(waitpid(child, &status, 0), child);
        assert_true(WIFEXITED(status) && WEXITSTATUS(status) == 0);
        close(go[1]);
    }
    close(begun[0]);
    close(begun[1]);
    close(go[0]);
    return child;
}

static void who_has_ended_loses_it(void **state) {
    (void)state;
    brume_output output;
    begin_elsewhere(NULL);
    assert_int_equal(count_files(NULL), 1);
    brume_file_remove_stale(path);
    assert_int_equal(count_files(NULL), 0);
    /* And this process itself, which saves once at a time. */
    assert_int_equal(brume_output_open(NULL, path, &output), BRUME_OK);
    brume_file_remove_stale(path);
    assert_int_equal(count_files(NULL), 0);
    brume_output_close(NULL, &output, 0);
}

static void who_still_writes_keeps_it(void **state) {
    (void)state;
    int go, status;
    pid_t child = begin_elsewhere(&go);
    brume_file_remove_stale(path);
    assert_int_equal(count_files(NULL), 1);
    assert_int_equal(write(go, "", 1), 1);
    close(go);
    assert_int_equal(waitpid(child, &status, 0), child);
    assert_true(WIFEXITED(status));
    assert_int_equal(WEXITSTATUS(status), BRUME_OK);
    assert_int_equal(access(path, F_OK), 0);
    remove(path);
}

/* Of other hosts nobody knows who lives there: a day without a write is enough. */
static void other_hosts(void **state) {
    (void)state;
    char name[512], other[512];
    begin_elsewhere(NULL);
    assert_int_equal(count_files(name), 1);
    strcpy(other, name);
    char *digit = strchr(strrchr(other, '/'), '-') + 1; /* state.4711-0badcafe-0.tmp */
    *digit = *digit == '0' ? '1' : '0';
    assert_int_equal(rename(name, other), 0);
    brume_file_remove_stale(path);
    assert_int_equal(access(other, F_OK), 0);
    time_t then = time(NULL) - 2 * 86400;
    const struct timespec days_ago[2] = {{then, 0}, {then, 0}};
    assert_int_equal(utimensat(AT_FDCWD, other, days_ago, 0), 0);
    brume_file_remove_stale(path);
    assert_int_equal(count_files(NULL), 0);
}

static void what_only_looks_like_it(void **state) {
    (void)state;
    static const char *const names[] = {"state.1-2.tmp", "state.tmp", "state.999999-00000000-0.tmp.old", "state",
                                        "state2.999999-00000000-0.tmp", "state.+99999-00000000-0.tmp"};
    enum { COUNT = sizeof names / sizeof names[0] };
    const struct timespec long_ago[2] = {{1, 0}, {1, 0}};
    char name[256];
    for (int i = 0; i < COUNT; i++) {
        snprintf(name, sizeof name, "%s/%s", folder, names[i]);
        FILE *file = fopen(name, "w");
        assert_non_null(file);
        fclose(file);
        assert_int_equal(utimensat(AT_FDCWD, name, long_ago, 0), 0);
    }
    brume_file_remove_stale(path);
    assert_int_equal(count_files(NULL), COUNT);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(who_has_ended_loses_it),
        cmocka_unit_test(who_still_writes_keeps_it),
        cmocka_unit_test(other_hosts),
        cmocka_unit_test(what_only_looks_like_it),
    };
    return cmocka_run_group_tests(tests, setup, teardown);
}

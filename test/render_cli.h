/* render_cli.h -- render-cli in a temporary folder, for tests of what its users meet. The program is that of the build
 * folder which the environment names (BRUME_BUILD). All of it fails the running test where it can't be done. */
#ifndef TEST_RENDER_CLI_H
#define TEST_RENDER_CLI_H

#include <limits.h>
#include <stddef.h>

#include "child.h"

extern char cli_program[2 * PATH_MAX]; /* absolute */
extern char cli_folder[512];           /* the current folder of every run */
extern child_result cli;               /* of the last run */

/* A ball under a spotlight in fog, 24 x 16 pixels, with the parameters width (24) and spp (2). */
extern const char cli_scene[];

/* Finds the program: 0, or -1 if it isn't there. */
int cli_find(void);

/* The same and a new folder, with `scene` in it as scene.xml unless that is NULL. */
int cli_open(const char *scene);

/* Removes the `count` files and then the folder: 0, or not 0 if anything else is in it, since render-cli is to leave
 * nothing behind that it wasn't asked for. Names of files that aren't there do no harm. */
int cli_close(const char *const *files, size_t count);

/* Runs render-cli with the words of `line` as arguments; its exit code. And with the signal `number` as soon as a line
 * of its output contains `signal_after`: 1000 + signal, if that ended it. */
int cli_run(const char *line);
int cli_run_until(const char *line, const char *signal_after, int number);

int cli_has_device(void);

/* Fails the test unless the last run printed one line of error, and nothing else on its standard error, with `part` in
 * it. */
void cli_expect_error_line(const char *part);

/* Fails the test unless the JSON that the last run printed has "name":value. */
void cli_expect_member(const char *name, const char *value);

/* Files of the folder. Reading: up to `room` bytes, with a 0 behind where it fits; the size, -1 if it is not there. */
void cli_path(char out[PATH_MAX], const char *name);
void cli_write(const char *name, const char *text);
long cli_read(const char *name, char *bytes, size_t room);
void cli_remove(const char *name);

#endif

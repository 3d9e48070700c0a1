/* child.h -- runs a program as a child process and keeps what it printed, for tests of command line tools. */
#ifndef TEST_CHILD_H
#define TEST_CHILD_H

typedef struct child_result {
    int status;   /* exit code; 1000 + signal if a signal ended it */
    char out[65536], err[65536]; /* the first 64 KB of its standard output and error */
} child_result;

/* Runs `argv` (NULL at the end) in the folder `folder`. If `signal_after` isn't NULL, `number` is sent to the child as
 * soon as a line of its standard output contains that text. Returns 0 if the child could not be run. */
int child_run(child_result *result, const char *folder, const char *const *argv, const char *signal_after, int number);

/* The same with the words of `line` behind those of `first` (NULL at the end), up to 31 in all. Fails the running test
 * if the child could not be run; returns its status. */
int child_run_line(child_result *result, const char *folder, const char *const *first, const char *line,
                   const char *signal_after, int number);

#endif

/* Child processes. */
#include "child.h"

#include <poll.h>
#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <sys/types.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmocka.h>

/* Reads what there is, keeps what fits; 0 at the end. */
static int drain(int pipe, char *text, size_t room, size_t *length)
{
    char bytes[4096];
    ssize_t count = read(pipe, bytes, sizeof bytes);
    if (count <= 0)
        return 0;
    size_t kept = (size_t)count < room - 1 - *length ? (size_t)count : room - 1 - *length;
    memcpy(text + *length, bytes, kept);
    *length += kept;
    text[*length] = 0;
    return 1;
}

int child_run(child_result *result, const char *folder, const char *const *argv, const char *signal_after, int number)
{
    int out[2], err[2];
    size_t out_length = 0, err_length = 0;
    memset(result, 0, sizeof *result);
    if (pipe(out) != 0)
        return 0;
    if (pipe(err) != 0) {
        close(out[0]);
        close(out[1]);
        return 0;
    }
    fflush(NULL);
    pid_t child = fork();
    if (child == 0) {
        dup2(out[1], STDOUT_FILENO);
        dup2(err[1], STDERR_FILENO);
        close(out[0]);
        close(out[1]);
        close(err[0]);
        close(err[1]);
        /* The runner may have been started in the background, where SIGINT is ignored. */
        signal(SIGINT, SIG_DFL);
        if (chdir(folder) != 0)
            _exit(127);
        union { const char *const *in; char *const *out; } arguments = {argv};
        execv(argv[0], arguments.out);
        _exit(127);
    }
    close(out[1]);
    close(err[1]);
    int out_open = child > 0, err_open = child > 0;
    while (out_open || err_open) {
        struct pollfd polls[2] = {{out_open ? out[0] : -1, POLLIN, 0}, {err_open ? err[0] : -1, POLLIN, 0}};
        if (poll(polls, 2, -1) < 0)
            break;
        if (polls[0].revents)
            out_open = drain(out[0], result->out, sizeof result->out, &out_length);
        if (polls[1].revents)
            err_open = drain(err[0], result->err, sizeof result->err, &err_length);
        if (signal_after && strstr(result->out, signal_after)) {
            kill(child, number);
            signal_after = NULL;
        }
    }
    close(out[0]);
    close(err[0]);
    int status;
    if (child < 0 || waitpid(child, &status, 0) != child)
        return 0;
    result->status = WIFEXITED(status) ? WEXITSTATUS(status) : 1000 + WTERMSIG(status);
    return result->status != 127;
}

int child_run_line(child_result *result, const char *folder, const char *const *first, const char *line,
                   const char *signal_after, int number)
{
    enum { MOST = 31 };
    char words[1024];
    const char *argv[MOST + 1] = {NULL};
    int count = 0;
    for (; first[count] && count < MOST; count++)
        argv[count] = first[count];
    snprintf(words, sizeof words, "%s", line);
    for (char *word = strtok(words, " "); word && count < MOST; word = strtok(NULL, " "))
        argv[count++] = word;
    assert_true(child_run(result, folder, argv, signal_after, number));
    return result->status;
}

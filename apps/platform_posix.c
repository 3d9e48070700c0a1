/* platform_posix.c -- platform.h by POSIX.1-2008. */
#include "platform.h"

#include <errno.h>
#include <fcntl.h>
#include <netdb.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <unistd.h>

double platform_cpu_seconds(void)
{
    struct rusage usage;
    if (getrusage(RUSAGE_SELF, &usage) != 0)
        return 0;
    return (double)(usage.ru_utime.tv_sec + usage.ru_stime.tv_sec) +
           1e-6 * (double)(usage.ru_utime.tv_usec + usage.ru_stime.tv_usec);
}

/* ---- files ---- */

int platform_make_folder(const char *path)
{
    return mkdir(path, 0777) != 0 ? errno : 0;
}

int platform_make_temporary_folder(char *path)
{
    return mkdtemp(path) ? 0 : errno;
}

int platform_probe(const char *path)
{
    static const char name[] = ".render-cli-XXXXXX";
    size_t folder = brume_path_folder(path);
    char *trial = malloc(folder + sizeof name);
    if (!trial)
        return ENOMEM;
    memcpy(trial, path, folder);
    memcpy(trial + folder, name, sizeof name);
    int file = mkstemp(trial), error = file < 0 ? errno : 0;
    if (file >= 0) {
        close(file);
        unlink(trial);
    }
    free(trial);
    return error;
}

int platform_is_readable(const char *path)
{
    return access(path, R_OK) == 0;
}

int platform_is_special(const char *path)
{
    struct stat info;
    return stat(path, &info) == 0 && !S_ISREG(info.st_mode) && !S_ISDIR(info.st_mode);
}

int platform_sync(FILE *file)
{
    return fflush(file) != 0 || fsync(fileno(file)) != 0 ? errno : 0;
}

int platform_truncate(FILE *file, long size)
{
    return ftruncate(fileno(file), size) != 0 ? errno : 0;
}

/* ---- surroundings ---- */

int platform_has_terminal(void)
{
    return isatty(STDERR_FILENO);
}

void platform_set_environment(const char *name, const char *value)
{
    if (value)
        setenv(name, value, 1);
    else
        unsetenv(name);
}

/* In the child. The parent hears by `report`, which a successful exec closes, what went wrong. */
static void become(char *const *arguments, const char *folder, int report)
{
    setpgid(0, 0);
    if (!folder || chdir(folder) == 0)
        execvp(arguments[0], arguments);
    int error = errno;
    ssize_t sent = write(report, &error, sizeof error);
    (void)sent;
    _exit(127);
}

int platform_run(char *const *arguments, const char *folder)
{
    int report[2], status, error = 0;
    if (pipe(report) != 0)
        return errno;
    fcntl(report[1], F_SETFD, FD_CLOEXEC);
    pid_t child = fork();
    if (child == 0)
        become(arguments, folder, report[1]);
    if (child < 0)
        error = errno;
    close(report[1]);
    if (child > 0 && read(report[0], &error, sizeof error) != sizeof error)
        error = 0;
    close(report[0]);
    if (child < 0)
        return error;
    pid_t ended;
    while ((ended = waitpid(child, &status, 0)) < 0 && errno == EINTR)
        ;
    if (error)
        return error;
    return ended == child && WIFEXITED(status) && WEXITSTATUS(status) == 0 ? 0 : -1;
}

/* ---- signals ---- */

static void watch(int number, void (*handler)(int number))
{
    struct sigaction action, before;
    memset(&action, 0, sizeof action);
    action.sa_handler = handler;
    action.sa_flags = SA_RESTART;
    sigemptyset(&action.sa_mask);
    if (sigaction(number, NULL, &before) == 0 && before.sa_handler != SIG_IGN)
        sigaction(number, &action, NULL);
}

void platform_watch_signals(void (*handler)(int number))
{
    watch(SIGINT, handler);
    watch(SIGTERM, handler);
    signal(SIGXFSZ, SIG_IGN); /* a file that may not grow is an error to be reported, not the end */
}

void platform_quit(int code)
{
    _exit(code);
}

/* ---- connections ---- */

#ifndef MSG_NOSIGNAL /* macOS has an option of the socket instead */
#define MSG_NOSIGNAL 0
#endif

static void set_patience(int connection, double patience)
{
    struct timeval time = {(time_t)patience, (suseconds_t)(1e6 * (patience - (double)(time_t)patience))};
    setsockopt(connection, SOL_SOCKET, SO_SNDTIMEO, &time, sizeof time);
#ifdef SO_NOSIGPIPE
    int on = 1;
    setsockopt(connection, SOL_SOCKET, SO_NOSIGPIPE, &on, sizeof on);
#endif
}

int platform_connect(const char *host, const char *port, double patience)
{
    struct addrinfo wanted = {.ai_family = AF_UNSPEC, .ai_socktype = SOCK_STREAM}, *found = NULL;
    int connection = -1;
    if (getaddrinfo(host, port, &wanted, &found) != 0) return -1;
    for (struct addrinfo *a = found; a && connection < 0; a = a->ai_next) {
        connection = socket(a->ai_family, a->ai_socktype, a->ai_protocol);
        if (connection < 0) continue;
        set_patience(connection, patience);
        if (connect(connection, a->ai_addr, a->ai_addrlen) == 0) continue;
        close(connection);
        connection = -1;
    }
    freeaddrinfo(found);
    return connection;
}

int platform_send(int connection, const void *bytes, size_t size, double patience)
{
    const char *from = bytes;
    set_patience(connection, patience);
    while (size > 0) {
        ssize_t sent = send(connection, from, size, MSG_NOSIGNAL);
        if (sent < 0 && errno == EINTR) continue;
        if (sent <= 0) return -1;
        from += sent;
        size -= (size_t)sent;
    }
    return 0;
}

void platform_disconnect(int connection)
{
    if (connection >= 0) close(connection);
}

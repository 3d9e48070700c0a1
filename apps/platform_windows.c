/* platform_windows.c -- platform.h by the Windows API and Microsoft's C runtime, as MinGW-w64 has them. */
#define WIN32_LEAN_AND_MEAN
#include "platform.h"

#include <winsock2.h>
#include <ws2tcpip.h>
#include <windows.h>

#include <direct.h>
#include <errno.h>
#include <io.h>
#include <process.h>
#include <signal.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/types.h>

/* In units of 100 ns. */
static double seconds_of(FILETIME time)
{
    return 1e-7 * (double)((uint64_t)time.dwHighDateTime << 32 | time.dwLowDateTime);
}

double platform_cpu_seconds(void)
{
    FILETIME created, ended, kernel, user;
    if (!GetProcessTimes(GetCurrentProcess(), &created, &ended, &kernel, &user))
        return 0;
    return seconds_of(kernel) + seconds_of(user);
}

/* ---- files ---- */

int platform_make_folder(const char *path)
{
    return _mkdir(path) != 0 ? errno : 0;
}

int platform_make_temporary_folder(char *path)
{
    return _mktemp(path) && _mkdir(path) == 0 ? 0 : errno;
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
    int file = _mktemp(trial) ? brume_file_create(trial, 0) : -1, error = file < 0 ? errno : 0;
    if (file >= 0) {
        _close(file);
        remove(trial);
    }
    free(trial);
    return error;
}

int platform_is_special(const char *path)
{
    struct _stat64 info;
    return _stat64(path, &info) == 0 && !(info.st_mode & (_S_IFREG | _S_IFDIR));
}

int platform_is_readable(const char *path)
{
    return _access(path, 4) == 0;
}

int platform_sync(FILE *file)
{
    return fflush(file) != 0 || _commit(_fileno(file)) != 0 ? errno : 0;
}

int platform_truncate(FILE *file, long size)
{
    return _chsize_s(_fileno(file), size);
}

/* ---- surroundings ---- */

int platform_has_terminal(void)
{
    return _isatty(_fileno(stderr));
}

void platform_set_environment(const char *name, const char *value)
{
    _putenv_s(name, value ? value : "");
}

/* The runtime joins the arguments by spaces: those with spaces in them need the quotes here. */
static char *quoted(const char *argument)
{
    size_t size = strlen(argument);
    char *text = malloc(size + 3);
    if (text)
        snprintf(text, size + 3, strchr(argument, ' ') || !*argument ? "\"%s\"" : "%s", argument);
    return text;
}

int platform_run(char *const *arguments, const char *folder)
{
    enum { PATH = 32768 };
    char *before = folder ? malloc(PATH) : NULL;
    size_t count = 0;
    while (arguments[count])
        count++;
    char **words = calloc(count + 1, sizeof *words);
    int error = words && (!folder || before) ? 0 : ENOMEM;
    for (size_t i = 0; i < count && !error; i++)
        if (!(words[i] = quoted(arguments[i])))
            error = ENOMEM;
    if (!error && folder && (!_getcwd(before, PATH) || _chdir(folder) != 0))
        error = errno;
    if (!error) {
        intptr_t status = _spawnvp(_P_WAIT, arguments[0], (const char *const *)words);
        error = status < 0 ? errno : status > 0 ? -1 : 0;
        if (folder && _chdir(before) != 0 && !error)
            error = errno;
    }
    for (size_t i = 0; words && i < count; i++)
        free(words[i]);
    free(words);
    free(before);
    return error;
}

/* ---- signals ---- */

static void (*watcher)(int number);

/* The runtime forgets a handler once it has called it. */
static void on_signal(int number)
{
    signal(number, on_signal);
    watcher(number);
}

void platform_watch_signals(void (*handler)(int number))
{
    watcher = handler;
    signal(SIGINT, on_signal);
    signal(SIGTERM, on_signal);
}

void platform_quit(int code)
{
    _exit(code);
}

/* ---- connections ---- */

static void set_patience(SOCKET connection, double patience)
{
    DWORD milliseconds = (DWORD)(1000 * patience);
    setsockopt(connection, SOL_SOCKET, SO_SNDTIMEO, (const char *)&milliseconds, sizeof milliseconds);
}

int platform_connect(const char *host, const char *port, double patience)
{
    struct addrinfo wanted, *found = NULL;
    WSADATA data;
    SOCKET connection = INVALID_SOCKET;
    memset(&wanted, 0, sizeof wanted);
    wanted.ai_socktype = SOCK_STREAM;
    if (WSAStartup(MAKEWORD(2, 2), &data) != 0 || getaddrinfo(host, port, &wanted, &found) != 0) return -1;
    for (struct addrinfo *a = found; a && connection == INVALID_SOCKET; a = a->ai_next) {
        connection = socket(a->ai_family, a->ai_socktype, a->ai_protocol);
        if (connection == INVALID_SOCKET) continue;
        set_patience(connection, patience);
        if (connect(connection, a->ai_addr, (int)a->ai_addrlen) == 0) continue;
        closesocket(connection);
        connection = INVALID_SOCKET;
    }
    freeaddrinfo(found);
    return connection == INVALID_SOCKET ? -1 : (int)connection; /* handles of the system fit into 32 bits */
}

int platform_send(int connection, const void *bytes, size_t size, double patience)
{
    const char *from = bytes;
    set_patience((SOCKET)connection, patience);
    while (size > 0) {
        int sent = send((SOCKET)connection, from, size > 1 << 20 ? 1 << 20 : (int)size, 0);
        if (sent <= 0) return -1;
        from += sent;
        size -= (size_t)sent;
    }
    return 0;
}

void platform_disconnect(int connection)
{
    if (connection >= 0) closesocket((SOCKET)connection);
}

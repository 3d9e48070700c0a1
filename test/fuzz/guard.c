/* guard.c -- see guard.h. The C library's functions, defined in the program itself, where every library finds them
 * first. */
#define _GNU_SOURCE
#include "guard.h"

#include <dlfcn.h>
#include <fcntl.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static __thread int guarding;

void guard_begin(void) { guarding = 1; }
void guard_end(void) { guarding = 0; }

/* What libFuzzer saves when it has found something. */
static int is_finding(const char *path) {
    return strstr(path, "/crash-") || strstr(path, "/leak-") || strstr(path, "/timeout-") || strstr(path, "/oom-");
}

static void refuse(const char *what, const char *path) {
    if (!guarding || is_finding(path)) return;
    guarding = 0;
    fprintf(stderr, "a reader calls %s(\"%s\")\n", what, path);
    abort();
}

#define REAL(name) dlsym(RTLD_NEXT, name)
#define WRITES(flags) (((flags) & O_ACCMODE) != O_RDONLY || ((flags) & (O_CREAT | O_TRUNC)))
#define EXPORT __attribute__((visibility("default")))

/* clang and gcc know these by heart, with attributes of their own. */
#pragma GCC diagnostic ignored "-Wmissing-prototypes"

#define OPEN(name)                                                                                                     \
    EXPORT int name(const char *path, int flags, ...) {                                                                \
        int (*call)(const char *, int, mode_t);                                                                        \
        *(void **)&call = REAL(#name);                                                                                 \
        va_list rest;                                                                                                  \
        va_start(rest, flags);                                                                                         \
        mode_t mode = flags & O_CREAT ? (mode_t)va_arg(rest, int) : 0;                                                 \
        va_end(rest);                                                                                                  \
        if (WRITES(flags)) refuse(#name, path);                                                                        \
        return call(path, flags, mode);                                                                                \
    }
OPEN(open)
OPEN(open64)

#define FOPEN(name)                                                                                                    \
    EXPORT FILE *name(const char *path, const char *mode) {                                                            \
        FILE *(*call)(const char *, const char *);                                                                     \
        *(void **)&call = REAL(#name);                                                                                 \
        if (mode[0] != 'r' || strchr(mode, '+')) refuse(#name, path);                                                  \
        return call(path, mode);                                                                                       \
    }
FOPEN(fopen)
FOPEN(fopen64)

#define CHANGE(name, parameters, arguments, path)                                                                      \
    EXPORT int name parameters {                                                                                       \
        int(*call) parameters;                                                                                         \
        *(void **)&call = REAL(#name);                                                                                 \
        refuse(#name, path);                                                                                           \
        return call arguments;                                                                                         \
    }
CHANGE(rename, (const char *from, const char *to), (from, to), to)
CHANGE(unlink, (const char *path), (path), path)
CHANGE(remove, (const char *path), (path), path)
CHANGE(rmdir, (const char *path), (path), path)
CHANGE(mkdir, (const char *path, mode_t mode), (path, mode), path)
CHANGE(symlink, (const char *to, const char *path), (to, path), path)
CHANGE(link, (const char *from, const char *path), (from, path), path)
CHANGE(truncate, (const char *path, off_t size), (path, size), path)
CHANGE(mkstemp, (char *path), (path), path)
CHANGE(system, (const char *command), (command), command)

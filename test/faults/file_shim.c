/* file_shim.c -- see file_shim.h. */
#define _DEFAULT_SOURCE /* syscall */
#include "file_shim.h"

#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <sys/syscall.h>
#include <unistd.h>

static struct {
    int calls, at, error;
    file_fault fault;
    char log[1024];
    int folder; /* its descriptor */
} watch = {.folder = -1};
static __thread int watching;

/* Whether the call is not to be made. `letter` goes to the log. */
static int stopped(char letter) {
    if (!watching) return 0;
    int call = watch.calls++;
    if (call < (int)sizeof watch.log - 1) watch.log[call] = letter;
    if (watch.fault == FILE_KILLS && call == watch.at) raise(SIGKILL);
    if ((watch.fault == FILE_FAILS && call == watch.at) || (watch.fault == FILE_ENDS && call >= watch.at) ||
        (watch.fault == FILE_FULL && (call == watch.at || (call > watch.at && strchr("owf", letter))))) {
        errno = watch.error;
        return 1;
    }
    return 0;
}

int open(const char *path, int flags, ...) {
    va_list arguments;
    va_start(arguments, flags);
    unsigned mode = flags & O_CREAT ? va_arg(arguments, unsigned) : 0;
    va_end(arguments);
    if ((flags & (O_CREAT | O_DIRECTORY)) && stopped(flags & O_CREAT ? 'o' : 'O')) return -1;
    int descriptor = (int)syscall(SYS_openat, AT_FDCWD, path, flags, mode);
    if (watching && (flags & O_DIRECTORY)) watch.folder = descriptor;
    return descriptor;
}

/* A write that is broken off has written half. */
ssize_t pwrite(int descriptor, const void *bytes, size_t size, off_t offset) {
    if (watching && watch.fault != FILE_NONE && watch.calls == watch.at)
        syscall(SYS_pwrite64, descriptor, bytes, size / 2, offset);
    return stopped('w') ? -1 : (ssize_t)syscall(SYS_pwrite64, descriptor, bytes, size, offset);
}

int fsync(int descriptor) {
    return stopped(descriptor == watch.folder ? 'F' : 'f') ? -1 : (int)syscall(SYS_fsync, descriptor);
}

int close(int descriptor) {
    int stop = stopped(descriptor == watch.folder ? 'C' : 'c'), result = (int)syscall(SYS_close, descriptor);
    if (watching && descriptor == watch.folder) watch.folder = -1;
    return stop ? -1 : result;
}

int rename(const char *from, const char *to) {
    return stopped('r') ? -1 : (int)syscall(SYS_renameat, AT_FDCWD, from, AT_FDCWD, to);
}

int remove(const char *path) {
    if (watching && watch.fault == FILE_ENDS && watch.calls > watch.at) return -1;
    int result = (int)syscall(SYS_unlinkat, AT_FDCWD, path, 0);
    return result != 0 && errno == EISDIR ? (int)syscall(SYS_unlinkat, AT_FDCWD, path, AT_REMOVEDIR) : result;
}

void file_shim_begin(file_fault fault, int at, int error) {
    memset(&watch, 0, sizeof watch);
    watch.folder = -1;
    watch.fault = fault;
    watch.at = at;
    watch.error = error;
    watching = 1;
}

void file_shim_end(void) { watching = 0; }
int file_shim_calls(void) { return watch.calls; }
const char *file_shim_log(void) { return watch.log; }

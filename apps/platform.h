/* platform.h -- what the programs ask of the operating system beyond what the library does (lib/platform.h, included
 * here). platform_posix.c and platform_windows.c implement it, and no other file of apps/ may call POSIX, GNU or
 * Windows (`make check-platform`). */
#ifndef APPS_PLATFORM_H
#define APPS_PLATFORM_H

#include <stdio.h>

#include "../lib/platform.h"

/* Processor time of the process and its threads, in seconds; 0 if the system doesn't tell. */
double platform_cpu_seconds(void);

/* Makes one folder. 0, or errno: EEXIST if there is anything of that name. */
int platform_make_folder(const char *path);
/* Makes a folder with a name of its own from one that ends in XXXXXX. 0, or errno. */
int platform_make_temporary_folder(char *path);
/* Tries whether a file can be made in the folder that `path` lies in; permissions alone don't tell for root, read-only
 * or special file systems. 0, or errno. */
int platform_probe(const char *path);
int platform_is_readable(const char *path);
/* Whether there is something of that name that is no file and no folder: a device, a pipe. */
int platform_is_special(const char *path);

/* What was written to the file, to the disk itself. 0, or errno. */
int platform_sync(FILE *file);
/* Cuts an open file to `size` bytes. 0, or errno. */
int platform_truncate(FILE *file, long size);

/* Whether a person is likely to see what goes to standard error. */
int platform_has_terminal(void);

/* NULL for value: unset. */
void platform_set_environment(const char *name, const char *value);

/* Runs a program found by the PATH, in a folder (NULL: this one), and waits for it; Ctrl-C does not reach it. 0 if it
 * ended well, -1 if not, errno if it could not be run. */
int platform_run(char *const *arguments, const char *folder);

/* TCP. A socket, or -1; `patience` in seconds, for the connection. */
int platform_connect(const char *host, const char *port, double patience);
/* All bytes; a peer that takes none of them for `patience` seconds has gone. 0, or -1; never a signal. */
int platform_send(int connection, const void *bytes, size_t size, double patience);
void platform_disconnect(int connection); /* -1 is accepted */

/* Has SIGINT and SIGTERM handled, except where they are ignored: a shell starts background jobs so. */
void platform_watch_signals(void (*handler)(int number));
/* Ends the process at once; for signal handlers. */
void platform_quit(int code);

#endif

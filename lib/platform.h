/* platform.h -- what the library asks of the operating system beyond C99 and OpenCL: time, threads, files, the user's
 * folders. platform_posix.c and platform_windows.c implement it, and no other file of the library may call POSIX, GNU
 * or Windows (`make check-platform`).
 *
 * Paths are bytes as fopen takes them. What fails says so by its value and leaves the reason in errno.
 */
#ifndef BRUME_PLATFORM_H
#define BRUME_PLATFORM_H

#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#ifdef _WIN32
typedef struct brume_lock { void *word; } brume_lock; /* an SRWLOCK */
#define BRUME_LOCK_INIT {0}
#else
#include <pthread.h>
typedef struct brume_lock { pthread_rwlock_t word; pthread_mutex_t door; } brume_lock;
#define BRUME_LOCK_INIT {PTHREAD_RWLOCK_INITIALIZER, PTHREAD_MUTEX_INITIALIZER}
#endif

/* ---- time ------------------------------------------------------------------------------------------------------ */

/* Time that never runs backwards, from some moment on. */
double brume_seconds(void);
void brume_sleep(double seconds);

/* ---- threads --------------------------------------------------------------------------------------------------- */

/* For static storage, with BRUME_LOCK_INIT. Many may hold it shared, or one exclusively, who waits for no one that
 * comes later. Not to be taken twice by a thread. */
void brume_lock_shared(brume_lock *lock);
void brume_unlock_shared(brume_lock *lock);
void brume_lock_exclusive(brume_lock *lock);
void brume_unlock_exclusive(brume_lock *lock);

typedef struct brume_thread brume_thread;

/* NULL if it could not be started. */
brume_thread *brume_thread_start(void (*work)(void *argument), void *argument);
/* Waits for its end and releases it; NULL is accepted. */
void brume_thread_join(brume_thread *thread);
/* How many threads can run at once; 1 where nobody knows. */
uint32_t brume_processors(void);

/* ---- libraries, loaded at run time ------------------------------------------------------------------------------- */

typedef struct brume_library brume_library;

/* By its path, or by a name that the system looks up where libraries are. NULL if there is none. It stays loaded. */
brume_library *brume_library_open(const char *name);
/* NULL if it has none of that name. */
void (*brume_library_function(brume_library *library, const char *name))(void);

/* ---- text ------------------------------------------------------------------------------------------------------ */

/* The C locale, in which numbers have a point whatever the user's language. NULL when memory ran out. */
typedef struct brume_c_locale brume_c_locale;
brume_c_locale *brume_c_locale_create(void);
void brume_c_locale_destroy(brume_c_locale *locale);
/* strtod in it. */
double brume_c_locale_strtod(brume_c_locale *locale, const char *text);

/* Whether they are the same but for the case of ASCII letters. */
int brume_same_letters(const char *a, const char *b);

/* ---- paths ----------------------------------------------------------------------------------------------------- */

int brume_path_is_absolute(const char *path);
/* How many bytes of it name the folder, with the separator: 0 for a bare file name. */
size_t brume_path_folder(const char *path);
int brume_path_exists(const char *path);
int brume_path_is_folder(const char *path);
/* What isn't a file, and need not have an end: such as /dev/zero, or a pipe that nobody writes into, which already to
 * open would wait for. */
int brume_path_is_endless(const char *path);

/* Where programs keep what can be made again: $XDG_CACHE_HOME if absolute, else ~/.cache; %LOCALAPPDATA%. malloc'ed;
 * NULL if the environment names none. */
char *brume_path_user_cache(void);

/* ---- files ----------------------------------------------------------------------------------------------------- */

/* Opens a file for writing that must not exist yet, with the permissions that the user asks for, or with `own` for
 * their eyes alone. A descriptor, or < 0: EEXIST if there is one. */
int brume_file_create(const char *path, int own);
/* All bytes at an offset. 0, or errno: EFBIG beyond what the process may write, never a signal. */
int brume_file_write_at(int descriptor, const void *bytes, size_t size, uint64_t offset);
/* Waits until the disk has what was written; and, where the system asks for that, the entry of `path` in its folder.
 * 0, or errno; of a folder that may be written to, but not be read, nobody can ask it. */
int brume_file_sync(int descriptor);
int brume_file_sync_name(const char *path);
/* 0, or errno: some file systems report a full disk only here. */
int brume_file_close(int descriptor);
/* Renames, over what has that name now. 0, or errno. */
int brume_file_rename(const char *from, const char *to);
/* How many bytes an open file holds, which a long can't tell everywhere. 0, or errno. */
int brume_file_length(FILE *file, uint64_t *out);
/* A number that no other process of this host has at this time: for temporary names. And whether the process of that
 * number has ended. */
long brume_process_number(void);
int brume_process_is_gone(long number);
/* What the network calls this machine, cut off at `size` bytes with the zero at the end; empty if it has no name. */
void brume_host_name(char *out, size_t size);

/* The whole of a file of `least` to `most` bytes, which then counts as used now (brume_folder_visit). malloc'ed. */
unsigned char *brume_file_read_used(const char *path, size_t least, uint64_t most, size_t *out_size);

/* In file_replace.c, by the above. A number made of the host's name: */
uint32_t brume_host_number(void);
/* A new file beside `path`, PATH.PROCESS-HOST-N.tmp, whatever other processes and threads make there. A descriptor, or
 * < 0; *out_name is malloc'ed, NULL on failure. */
int brume_file_create_beside(const char *path, int own, char **out_name);
/* Writes a file under such a name, to the disk itself, and then gives it its own: a crash leaves no file or a whole
 * one. 0, or errno. */
int brume_file_replace(const char *path, const void *bytes, size_t size, int own);
/* Removes the temporary files of `path` that killed processes left: those of processes of this host that have ended, of
 * this one (which writes a file once at a time), and those of any host that nobody has written to for a day. Another
 * process that writes the same file now, such as a task that was queued again while it still ran, keeps its own. */
void brume_file_remove_stale(const char *path);

/* ---- folders --------------------------------------------------------------------------------------------------- */

/* The folder and those above it, for the user's eyes alone where they have to be made. */
void brume_folder_make(const char *path);

/* A regular file of a folder. */
typedef struct brume_folder_entry {
    const char *name; /* valid during the visit */
    uint64_t size;
    double age;       /* seconds since it was written, or read by brume_file_read_used */
} brume_folder_entry;

/* Calls `visit` for each regular file until it returns 0. The visit may remove files. */
void brume_folder_visit(const char *path, int (*visit)(void *user, const brume_folder_entry *entry), void *user);
void brume_folder_remove(const char *path, const char *name);

#endif

/* platform_posix.c -- platform.h by POSIX.1-2008: Linux (glibc, musl), macOS. */
#ifdef __APPLE__
#define _DARWIN_C_SOURCE /* _SC_NPROCESSORS_ONLN, which POSIX has since 2024 */
#endif
#include "platform.h"

#include <dirent.h>
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <locale.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>
#ifdef __APPLE__
#include <xlocale.h>
#endif

/* ---- time ------------------------------------------------------------------------------------------------------ */

double brume_seconds(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

void brume_sleep(double seconds) {
    const struct timespec time = {(time_t)seconds, (long)(1e9 * (seconds - (double)(time_t)seconds))};
    nanosleep(&time, NULL);
}

/* ---- threads --------------------------------------------------------------------------------------------------- */

/* glibc lets readers pass a writer that waits, for ever if they overlap: so who waits keeps the door. */
void brume_lock_shared(brume_lock *lock) {
    pthread_mutex_lock(&lock->door);
    pthread_rwlock_rdlock(&lock->word);
    pthread_mutex_unlock(&lock->door);
}

void brume_lock_exclusive(brume_lock *lock) {
    pthread_mutex_lock(&lock->door);
    pthread_rwlock_wrlock(&lock->word);
    pthread_mutex_unlock(&lock->door);
}

void brume_unlock_shared(brume_lock *lock) { pthread_rwlock_unlock(&lock->word); }
void brume_unlock_exclusive(brume_lock *lock) { pthread_rwlock_unlock(&lock->word); }

struct brume_thread {
    pthread_t handle;
    void (*work)(void *argument);
    void *argument;
};

static void *run(void *thread) {
    brume_thread *t = thread;
    t->work(t->argument);
    return NULL;
}

brume_thread *brume_thread_start(void (*work)(void *argument), void *argument) {
    brume_thread *thread = malloc(sizeof *thread);
    if (!thread) return NULL;
    thread->work = work;
    thread->argument = argument;
    if (pthread_create(&thread->handle, NULL, run, thread) == 0) return thread;
    free(thread);
    return NULL;
}

void brume_thread_join(brume_thread *thread) {
    if (thread) pthread_join(thread->handle, NULL);
    free(thread);
}

uint32_t brume_processors(void) {
#ifdef _SC_NPROCESSORS_ONLN
    long count = sysconf(_SC_NPROCESSORS_ONLN);
#else
    long count = 1;
#endif
    return count > 1 ? (uint32_t)count : 1;
}

/* ---- libraries ------------------------------------------------------------------------------------------------- */

brume_library *brume_library_open(const char *name) { return dlopen(name, RTLD_NOW | RTLD_LOCAL); }

void (*brume_library_function(brume_library *library, const char *name))(void) {
    void *found = dlsym(library, name);
    void (*function)(void);
    memcpy(&function, &found, sizeof function); /* C99 has no cast between the two, POSIX says that they are alike */
    return function;
}

/* ---- text ------------------------------------------------------------------------------------------------------ */

struct brume_c_locale { locale_t handle; };

brume_c_locale *brume_c_locale_create(void) {
    brume_c_locale *locale = malloc(sizeof *locale);
    if (!locale) return NULL;
    locale->handle = newlocale(LC_ALL_MASK, "C", (locale_t)0);
    if (locale->handle) return locale;
    free(locale);
    return NULL;
}

void brume_c_locale_destroy(brume_c_locale *locale) {
    if (locale) freelocale(locale->handle);
    free(locale);
}

double brume_c_locale_strtod(brume_c_locale *locale, const char *text) {
    locale_t before = uselocale(locale->handle);
    double value = strtod(text, NULL);
    uselocale(before);
    return value;
}

int brume_same_letters(const char *a, const char *b) { return strcasecmp(a, b) == 0; }

/* ---- paths ----------------------------------------------------------------------------------------------------- */

int brume_path_is_absolute(const char *path) { return path[0] == '/'; }

size_t brume_path_folder(const char *path) {
    const char *slash = strrchr(path, '/');
    return slash ? (size_t)(slash - path) + 1 : 0;
}

int brume_path_exists(const char *path) {
    struct stat info;
    return stat(path, &info) == 0;
}

int brume_path_is_folder(const char *path) {
    struct stat info;
    return stat(path, &info) == 0 && S_ISDIR(info.st_mode);
}

int brume_path_is_endless(const char *path) {
    struct stat info;
    mode_t mode = stat(path, &info) == 0 ? info.st_mode : 0;
    return S_ISCHR(mode) || S_ISBLK(mode) || S_ISFIFO(mode) || S_ISSOCK(mode);
}

/* a, then b; malloc'ed, NULL when memory ran out. */
static char *join(const char *a, const char *b) {
    size_t x = strlen(a), y = strlen(b);
    char *text = malloc(x + y + 1);
    if (!text) return NULL;
    memcpy(text, a, x);
    memcpy(text + x, b, y + 1);
    return text;
}

char *brume_path_user_cache(void) {
    const char *shared = getenv("XDG_CACHE_HOME"), *home = getenv("HOME");
    if (shared && brume_path_is_absolute(shared)) return join(shared, ""); /* the specification: else invalid */
    return home && *home ? join(home, "/.cache") : NULL;
}

/* ---- files ----------------------------------------------------------------------------------------------------- */

/* O_EXCL and not mkstemp: the file gets the permissions that the umask asks for. */
int brume_file_create(const char *path, int own) {
    return open(path, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, own ? 0600 : 0666);
}

/* A signal that is blocked and pending, taken away. */
static void take_pending(const sigset_t *signals) {
#ifdef __APPLE__
    int number;
    sigwait(signals, &number);
#else
    const struct timespec now = {0, 0};
    sigtimedwait(signals, NULL, &now);
#endif
}

static int write_all(int descriptor, const char *from, size_t size, uint64_t offset) {
    while (size > 0) {
        ssize_t written = pwrite(descriptor, from, size, (off_t)offset);
        if (written < 0 && errno == EINTR) continue;
        if (written <= 0) return written < 0 ? errno : ENOSPC;
        from += written;
        offset += (uint64_t)written;
        size -= (size_t)written;
    }
    return 0;
}

/* A file that may not grow further (RLIMIT_FSIZE) would end the process by a signal: the write is to fail instead. */
int brume_file_write_at(int descriptor, const void *bytes, size_t size, uint64_t offset) {
    sigset_t limit, before, pending;
    if (size > INT64_MAX || offset > INT64_MAX - size) return EFBIG;
    sigemptyset(&limit);
    sigaddset(&limit, SIGXFSZ);
    int blocked = pthread_sigmask(SIG_BLOCK, &limit, &before);
    if (blocked != 0) return blocked;
    int error = write_all(descriptor, bytes, size, offset);
    if (error == EFBIG && !sigismember(&before, SIGXFSZ) && sigpending(&pending) == 0 &&
        sigismember(&pending, SIGXFSZ))
        take_pending(&limit);
    pthread_sigmask(SIG_SETMASK, &before, NULL);
    return error;
}

int brume_file_sync(int descriptor) { return fsync(descriptor) != 0 ? errno : 0; }

/* Some file systems have no way to wait for that, and some folders (drop boxes) may not be opened. */
int brume_file_sync_name(const char *path) {
    size_t length = brume_path_folder(path);
    char *folder = join(length ? path : ".", "");
    if (!folder) return ENOMEM;
    folder[length ? length : 1] = 0;
    int error = 0, descriptor = open(folder, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (descriptor < 0)
        error = errno != EACCES ? errno : 0;
    else if (fsync(descriptor) != 0 && errno != EINVAL)
        error = errno;
    if (descriptor >= 0) close(descriptor);
    free(folder);
    return error;
}

int brume_file_close(int descriptor) { return close(descriptor) != 0 && errno != EINTR ? errno : 0; }

int brume_file_rename(const char *from, const char *to) { return rename(from, to) != 0 ? errno : 0; }

int brume_file_length(FILE *file, uint64_t *out) {
    struct stat info;
    if (fstat(fileno(file), &info) != 0) return errno;
    *out = (uint64_t)info.st_size;
    return 0;
}

long brume_process_number(void) { return (long)getpid(); }

int brume_process_is_gone(long number) { return kill((pid_t)number, 0) != 0 && errno == ESRCH; }

void brume_host_name(char *out, size_t size) {
    if (gethostname(out, size) != 0) out[0] = 0;
    out[size - 1] = 0;
}

unsigned char *brume_file_read_used(const char *path, size_t least, uint64_t most, size_t *out_size) {
    int file = open(path, O_RDONLY | O_CLOEXEC);
    if (file < 0) return NULL;
    struct stat info;
    unsigned char *data = NULL;
    if (fstat(file, &info) == 0 && S_ISREG(info.st_mode) && info.st_size > 0 && (uint64_t)info.st_size >= least &&
        (uint64_t)info.st_size <= most)
        data = malloc((size_t)info.st_size);
    size_t got = 0;
    while (data && got < (size_t)info.st_size) {
        ssize_t n = read(file, data + got, (size_t)info.st_size - got);
        if (n < 0 && errno == EINTR) continue;
        if (n <= 0) {
            free(data);
            data = NULL;
            break;
        }
        got += (size_t)n;
    }
    if (data) futimens(file, NULL);
    close(file);
    *out_size = got;
    return data;
}

/* ---- folders --------------------------------------------------------------------------------------------------- */

void brume_folder_make(const char *path) {
    char *text = join(path, "");
    if (!text) return;
    for (char *c = text + 1; *text && *c; c++) {
        if (*c != '/') continue;
        *c = 0;
        mkdir(text, 0700);
        *c = '/';
    }
    mkdir(text, 0700);
    free(text);
}

void brume_folder_visit(const char *path, int (*visit)(void *user, const brume_folder_entry *entry), void *user) {
    DIR *directory = opendir(path);
    if (!directory) return;
    time_t now = time(NULL);
    for (struct dirent *d; (d = readdir(directory)) != NULL;) {
        struct stat info;
        if (fstatat(dirfd(directory), d->d_name, &info, AT_SYMLINK_NOFOLLOW) != 0 || !S_ISREG(info.st_mode)) continue;
        const brume_folder_entry entry = {d->d_name, (uint64_t)info.st_size, difftime(now, info.st_mtime)};
        if (!visit(user, &entry)) break;
    }
    closedir(directory);
}

void brume_folder_remove(const char *path, const char *name) {
    char *folder = join(path, "/"), *file = folder ? join(folder, name) : NULL;
    if (file) unlink(file);
    free(file);
    free(folder);
}

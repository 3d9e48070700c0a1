/* platform_windows.c -- platform.h by the Windows API and Microsoft's C runtime, as MinGW-w64 has them. */
#define WIN32_LEAN_AND_MEAN
#include "platform.h"

#include <windows.h>

#include <ctype.h>
#include <errno.h>
#include <fcntl.h>
#include <io.h>
#include <locale.h>
#include <process.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

/* ---- time ------------------------------------------------------------------------------------------------------ */

double brume_seconds(void) {
    LARGE_INTEGER count, frequency;
    QueryPerformanceFrequency(&frequency);
    QueryPerformanceCounter(&count);
    return (double)count.QuadPart / (double)frequency.QuadPart;
}

void brume_sleep(double seconds) { Sleep((DWORD)(1000 * seconds)); }

/* ---- threads --------------------------------------------------------------------------------------------------- */

/* An SRWLOCK is one pointer, and zero when free. */
static SRWLOCK *word_of(brume_lock *lock) { return (SRWLOCK *)(void *)&lock->word; }

void brume_lock_shared(brume_lock *lock) { AcquireSRWLockShared(word_of(lock)); }
void brume_unlock_shared(brume_lock *lock) { ReleaseSRWLockShared(word_of(lock)); }
void brume_lock_exclusive(brume_lock *lock) { AcquireSRWLockExclusive(word_of(lock)); }
void brume_unlock_exclusive(brume_lock *lock) { ReleaseSRWLockExclusive(word_of(lock)); }

struct brume_thread {
    HANDLE handle;
    void (*work)(void *argument);
    void *argument;
};

static unsigned __stdcall run(void *thread) {
    brume_thread *t = thread;
    t->work(t->argument);
    return 0;
}

brume_thread *brume_thread_start(void (*work)(void *argument), void *argument) {
    brume_thread *thread = malloc(sizeof *thread);
    if (!thread) return NULL;
    thread->work = work;
    thread->argument = argument;
    thread->handle = (HANDLE)_beginthreadex(NULL, 0, run, thread, 0, NULL);
    if (thread->handle) return thread;
    free(thread);
    return NULL;
}

void brume_thread_join(brume_thread *thread) {
    if (!thread) return;
    WaitForSingleObject(thread->handle, INFINITE);
    CloseHandle(thread->handle);
    free(thread);
}

uint32_t brume_processors(void) {
    SYSTEM_INFO info;
    GetSystemInfo(&info);
    return info.dwNumberOfProcessors > 1 ? (uint32_t)info.dwNumberOfProcessors : 1;
}

/* ---- libraries ------------------------------------------------------------------------------------------------- */

brume_library *brume_library_open(const char *name) { return (brume_library *)LoadLibraryA(name); }

void (*brume_library_function(brume_library *library, const char *name))(void) {
    return (void (*)(void))GetProcAddress((HMODULE)library, name);
}

/* ---- text ------------------------------------------------------------------------------------------------------ */

struct brume_c_locale { _locale_t handle; };

brume_c_locale *brume_c_locale_create(void) {
    brume_c_locale *locale = malloc(sizeof *locale);
    if (!locale) return NULL;
    locale->handle = _create_locale(LC_ALL, "C");
    if (locale->handle) return locale;
    free(locale);
    return NULL;
}

void brume_c_locale_destroy(brume_c_locale *locale) {
    if (locale) _free_locale(locale->handle);
    free(locale);
}

double brume_c_locale_strtod(brume_c_locale *locale, const char *text) {
    return _strtod_l(text, NULL, locale->handle);
}

int brume_same_letters(const char *a, const char *b) { return _stricmp(a, b) == 0; }

/* ---- paths ----------------------------------------------------------------------------------------------------- */

static int is_separator(char c) { return c == '/' || c == '\\'; }

/* With a drive, or from the root of the current one. */
int brume_path_is_absolute(const char *path) {
    return is_separator(path[0]) || (isalpha((unsigned char)path[0]) && path[1] == ':');
}

size_t brume_path_folder(const char *path) {
    size_t size = strlen(path);
    while (size > 0 && !is_separator(path[size - 1]) && !(size == 2 && path[1] == ':')) size--;
    return size;
}

int brume_path_exists(const char *path) { return GetFileAttributesA(path) != INVALID_FILE_ATTRIBUTES; }

int brume_path_is_folder(const char *path) {
    DWORD attributes = GetFileAttributesA(path);
    return attributes != INVALID_FILE_ATTRIBUTES && (attributes & FILE_ATTRIBUTE_DIRECTORY);
}

int brume_path_is_endless(const char *path) {
    struct _stat64 info;
    int kind = _stat64(path, &info) == 0 ? info.st_mode & _S_IFMT : 0;
    return kind == _S_IFCHR || kind == _S_IFIFO;
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
    const char *shared = getenv("XDG_CACHE_HOME"), *local = getenv("LOCALAPPDATA");
    if (shared && brume_path_is_absolute(shared)) return join(shared, "");
    return local && *local ? join(local, "") : NULL;
}

/* ---- files ----------------------------------------------------------------------------------------------------- */

/* What GetLastError says, in errno's words as far as these functions meet them. */
static int error_number(void) {
    switch (GetLastError()) {
    case ERROR_FILE_NOT_FOUND:
    case ERROR_PATH_NOT_FOUND: return ENOENT;
    case ERROR_ACCESS_DENIED:
    case ERROR_SHARING_VIOLATION: return EACCES;
    case ERROR_FILE_EXISTS:
    case ERROR_ALREADY_EXISTS: return EEXIST;
    case ERROR_DISK_FULL: return ENOSPC;
    }
    return EIO;
}

/* What lies in the user's own folders is for their eyes alone without being told. */
int brume_file_create(const char *path, int own) {
    (void)own;
    return _open(path, _O_WRONLY | _O_CREAT | _O_EXCL | _O_BINARY | _O_NOINHERIT, _S_IREAD | _S_IWRITE);
}

int brume_file_write_at(int descriptor, const void *bytes, size_t size, uint64_t offset) {
    const char *from = bytes;
    if (size > INT64_MAX || offset > INT64_MAX - size) return EFBIG;
    if (size > 0 && _lseeki64(descriptor, (int64_t)offset, SEEK_SET) < 0) return errno;
    while (size > 0) {
        int written = _write(descriptor, from, size < (1u << 30) ? (unsigned)size : 1u << 30);
        if (written <= 0) return written < 0 ? errno : ENOSPC;
        from += written;
        size -= (size_t)written;
    }
    return 0;
}

int brume_file_sync(int descriptor) { return _commit(descriptor) != 0 ? errno : 0; }

/* MoveFileEx has seen to it. */
int brume_file_sync_name(const char *path) {
    (void)path;
    return 0;
}

int brume_file_close(int descriptor) { return _close(descriptor) != 0 ? errno : 0; }

int brume_file_rename(const char *from, const char *to) {
    return MoveFileExA(from, to, MOVEFILE_REPLACE_EXISTING | MOVEFILE_WRITE_THROUGH) ? 0 : error_number();
}

int brume_file_length(FILE *file, uint64_t *out) {
    int64_t length = _filelengthi64(_fileno(file));
    if (length < 0) return errno;
    *out = (uint64_t)length;
    return 0;
}

long brume_process_number(void) { return (long)GetCurrentProcessId(); }

int brume_process_is_gone(long number) {
    HANDLE process = OpenProcess(SYNCHRONIZE, FALSE, (DWORD)number);
    if (!process) return GetLastError() == ERROR_INVALID_PARAMETER;
    int gone = WaitForSingleObject(process, 0) == WAIT_OBJECT_0;
    CloseHandle(process);
    return gone;
}

void brume_host_name(char *out, size_t size) {
    DWORD length = (DWORD)size;
    if (!GetComputerNameA(out, &length)) out[0] = 0;
}

unsigned char *brume_file_read_used(const char *path, size_t least, uint64_t most, size_t *out_size) {
    HANDLE file = CreateFileA(path, GENERIC_READ | FILE_WRITE_ATTRIBUTES,
                              FILE_SHARE_READ | FILE_SHARE_WRITE | FILE_SHARE_DELETE, NULL, OPEN_EXISTING, 0, NULL);
    if (file == INVALID_HANDLE_VALUE) return NULL;
    LARGE_INTEGER length;
    unsigned char *data = NULL;
    DWORD got = 0;
    if (GetFileSizeEx(file, &length) && length.QuadPart > 0 && (uint64_t)length.QuadPart >= least &&
        (uint64_t)length.QuadPart <= most && length.QuadPart < (1 << 30))
        data = malloc((size_t)length.QuadPart);
    if (data && (!ReadFile(file, data, (DWORD)length.QuadPart, &got, NULL) || got != (DWORD)length.QuadPart)) {
        free(data);
        data = NULL;
    }
    if (data) {
        FILETIME now;
        GetSystemTimeAsFileTime(&now);
        SetFileTime(file, NULL, NULL, &now);
    }
    CloseHandle(file);
    *out_size = got;
    return data;
}

/* ---- folders --------------------------------------------------------------------------------------------------- */

void brume_folder_make(const char *path) {
    char *text = join(path, "");
    if (!text) return;
    for (char *c = text + 1; *text && *c; c++) {
        if (!is_separator(*c)) continue;
        char kept = *c;
        *c = 0;
        CreateDirectoryA(text, NULL);
        *c = kept;
    }
    CreateDirectoryA(text, NULL);
    free(text);
}

static double seconds_of(FILETIME time) {
    return 1e-7 * (double)((uint64_t)time.dwHighDateTime << 32 | time.dwLowDateTime);
}

void brume_folder_visit(const char *path, int (*visit)(void *user, const brume_folder_entry *entry), void *user) {
    WIN32_FIND_DATAA found;
    FILETIME now;
    char *pattern = join(path, "/*");
    HANDLE search = pattern ? FindFirstFileA(pattern, &found) : INVALID_HANDLE_VALUE;
    free(pattern);
    if (search == INVALID_HANDLE_VALUE) return;
    GetSystemTimeAsFileTime(&now);
    do {
        if (found.dwFileAttributes & (FILE_ATTRIBUTE_DIRECTORY | FILE_ATTRIBUTE_REPARSE_POINT)) continue;
        const brume_folder_entry entry = {found.cFileName,
                                          (uint64_t)found.nFileSizeHigh << 32 | found.nFileSizeLow,
                                          seconds_of(now) - seconds_of(found.ftLastWriteTime)};
        if (!visit(user, &entry)) break;
    } while (FindNextFileA(search, &found));
    FindClose(search);
}

void brume_folder_remove(const char *path, const char *name) {
    char *folder = join(path, "/"), *file = folder ? join(folder, name) : NULL;
    if (file) DeleteFileA(file);
    free(file);
    free(folder);
}

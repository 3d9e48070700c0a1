/* program_cache.c -- see program_cache.h.
 *
 * An entry, in the machine's own byte order: a header, the facts, the binary, and the SHA-256 of all of it. The digest
 * guards against damage, not against an enemy: whoever can write to the folder can write what they like.
 */
#include "program_cache.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include "sha256.h"
#include "text.h"

enum {
    FORMAT = 1,
    NAME_DIGITS = 32,             /* 128 bits: with a million entries two meet with probability 1e-27 */
    ABANDONED_SECONDS = 60 * 60,  /* a temporary file so old is one that a process died over */
    MAX_ENTRIES = 65536           /* of a folder are looked at when room is made */
};

typedef struct entry_header {
    char magic[8];
    uint32_t format, facts_size;
    uint64_t binary_size;
} entry_header;

static const char magic[8] = "brumePG";

/* ---- names ----------------------------------------------------------------------------------------------------- */

static char *finish_text(brume_text *text) {
    if (!text->failed) return text->data;
    free(text->data);
    return NULL;
}

static void add_string(brume_text *text, const char *string) { brume_text_add(text, string, strlen(string)); }

char *brume_program_cache_folder(void) {
    const char *own = getenv("BRUME_CACHE_DIR"), *shared = getenv("XDG_CACHE_HOME"), *home = getenv("HOME");
    brume_text path = {0};
    if (own) {
        if (!*own) return NULL;
        add_string(&path, own);
    } else if (shared && *shared == '/') { /* the specification: relative ones are invalid */
        add_string(&path, shared);
        add_string(&path, "/brume");
    } else if (home && *home) {
        add_string(&path, home);
        add_string(&path, "/.cache/brume");
    } else {
        return NULL;
    }
    return finish_text(&path);
}

static void add_hex(brume_text *text, const uint8_t *digest, int digits) {
    for (int i = 0; i < digits / 2; i++) brume_text_format(text, "%02x", digest[i]);
}

static void add_device_fact(brume_text *text, brume_device *device, const char *label, cl_device_info what) {
    char value[512] = "";
    if (clGetDeviceInfo(device->id, what, sizeof value - 1, value, NULL) != CL_SUCCESS) value[0] = 0;
    brume_text_format(text, "%s: %s\n", label, value);
}

char *brume_program_cache_facts(brume_device *device, const brume_program_source *source) {
    brume_text text = {0};
    char platform_version[512] = "";
    cl_platform_id platform = NULL;
    clGetDeviceInfo(device->id, CL_DEVICE_PLATFORM, sizeof platform, &platform, NULL);
    if (clGetPlatformInfo(platform, CL_PLATFORM_VERSION, sizeof platform_version - 1, platform_version, NULL))
        platform_version[0] = 0;
    brume_text_format(&text, "brume: " BRUME_VERSION "\nplatform: %s\nplatform version: %s\n", device->info.platform,
                      platform_version);
    add_device_fact(&text, device, "device", CL_DEVICE_NAME);
    add_device_fact(&text, device, "device version", CL_DEVICE_VERSION);
    add_device_fact(&text, device, "driver", CL_DRIVER_VERSION);
    add_string(&text, "options: ");
    add_string(&text, source->options);
    uint8_t digest[SHA256_SIZE];
    brume_sha256(source->text, strlen(source->text), digest);
    add_string(&text, "\nsource: ");
    add_hex(&text, digest, 2 * SHA256_SIZE);
    add_string(&text, "\n");
    return finish_text(&text);
}

char *brume_program_cache_path(const char *folder, const char *facts) {
    uint8_t digest[SHA256_SIZE];
    brume_sha256(facts, strlen(facts), digest);
    brume_text path = {0};
    add_string(&path, folder);
    add_string(&path, "/");
    add_hex(&path, digest, NAME_DIGITS);
    add_string(&path, ".program");
    return finish_text(&path);
}

/* Of ours: an entry, or with `suffix` a temporary name of one. */
static int is_entry_name(const char *name, int *is_temporary) {
    for (int i = 0; i < NAME_DIGITS; i++)
        if (!strchr("0123456789abcdef", name[i]) || !name[i]) return 0;
    *is_temporary = strncmp(name + NAME_DIGITS, ".program.", 9) == 0;
    return *is_temporary || strcmp(name + NAME_DIGITS, ".program") == 0;
}

/* ---- reading --------------------------------------------------------------------------------------------------- */

/* The whole file, with its size; NULL if it can't be read or can't be an entry by its size. */
static unsigned char *read_entry(const char *path, size_t *size) {
    int file = open(path, O_RDONLY | O_CLOEXEC);
    if (file < 0) return NULL;
    struct stat info;
    unsigned char *data = NULL;
    if (fstat(file, &info) == 0 && S_ISREG(info.st_mode) && info.st_size > (off_t)sizeof(entry_header) &&
        (uint64_t)info.st_size <= PROGRAM_CACHE_LIMIT)
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
    if (data) futimens(file, NULL); /* used now: not to be removed soon */
    close(file);
    *size = got;
    return data;
}

unsigned char *brume_program_cache_load(const char *folder, const char *facts, size_t *out_size) {
    char *path = brume_program_cache_path(folder, facts);
    size_t size = 0;
    unsigned char *data = path ? read_entry(path, &size) : NULL, *binary = NULL;
    free(path);
    if (!data) return NULL;
    entry_header header;
    uint8_t digest[SHA256_SIZE];
    memcpy(&header, data, sizeof header);
    uint64_t facts_size = strlen(facts), overhead = sizeof header + SHA256_SIZE;
    int right = memcmp(header.magic, magic, sizeof magic) == 0 && header.format == FORMAT &&
                header.facts_size == facts_size && header.binary_size > 0 && size > overhead + facts_size &&
                header.binary_size == size - overhead - facts_size &&
                memcmp(data + sizeof header, facts, facts_size) == 0;
    if (right) {
        brume_sha256(data, size - SHA256_SIZE, digest);
        right = memcmp(data + size - SHA256_SIZE, digest, SHA256_SIZE) == 0;
    }
    if (right) binary = malloc((size_t)header.binary_size);
    if (binary) {
        memcpy(binary, data + sizeof header + facts_size, (size_t)header.binary_size);
        *out_size = (size_t)header.binary_size;
    }
    free(data);
    return binary;
}

/* ---- writing --------------------------------------------------------------------------------------------------- */

static void make_folder(const char *folder) {
    brume_text path = {0};
    add_string(&path, folder);
    char *text = finish_text(&path);
    if (!text) return;
    for (char *c = text + 1; *c; c++) {
        if (*c != '/') continue;
        *c = 0;
        mkdir(text, 0700);
        *c = '/';
    }
    mkdir(text, 0700);
    free(text);
}

static int write_all(int file, const void *data, size_t size) {
    const char *at = data;
    while (size > 0) {
        ssize_t n = write(file, at, size);
        if (n < 0 && errno == EINTR) continue;
        if (n <= 0) return 0;
        at += n;
        size -= (size_t)n;
    }
    return 1;
}

/* A file that may not grow further (RLIMIT_FSIZE) would end the process by a signal: the write is to fail instead. */
static int write_quietly(int file, const void *data, size_t size) {
    sigset_t limit, before, pending;
    sigemptyset(&limit);
    sigaddset(&limit, SIGXFSZ);
    if (pthread_sigmask(SIG_BLOCK, &limit, &before) != 0) return 0;
    int written = write_all(file, data, size);
    if (!written && errno == EFBIG && !sigismember(&before, SIGXFSZ) && sigpending(&pending) == 0 &&
        sigismember(&pending, SIGXFSZ)) {
        const struct timespec now = {0, 0};
        sigtimedwait(&limit, NULL, &now);
    }
    pthread_sigmask(SIG_SETMASK, &before, NULL);
    return written;
}

typedef struct entry_file { char name[NAME_DIGITS + 64]; time_t used; uint64_t size; } entry_file;

static int older_first(const void *a, const void *b) {
    time_t x = ((const entry_file *)a)->used, y = ((const entry_file *)b)->used;
    return (x > y) - (x < y);
}

/* Removes entries until the rest fits, and what processes that died left behind. */
static void make_room(const char *folder, uint64_t limit) {
    DIR *directory = opendir(folder);
    if (!directory) return;
    entry_file *files = NULL;
    size_t count = 0, capacity = 0;
    uint64_t total = 0;
    time_t now = time(NULL);
    for (struct dirent *d; count < MAX_ENTRIES && (d = readdir(directory));) {
        int is_temporary;
        struct stat info;
        if (!is_entry_name(d->d_name, &is_temporary) || strlen(d->d_name) >= sizeof files->name ||
            fstatat(dirfd(directory), d->d_name, &info, AT_SYMLINK_NOFOLLOW) != 0 || !S_ISREG(info.st_mode))
            continue;
        if (is_temporary) {
            if (now - info.st_mtime > ABANDONED_SECONDS) unlinkat(dirfd(directory), d->d_name, 0);
            continue;
        }
        if (count == capacity) {
            size_t larger = capacity ? 2 * capacity : 64;
            entry_file *moved = realloc(files, larger * sizeof *files);
            if (!moved) break;
            files = moved;
            capacity = larger;
        }
        strcpy(files[count].name, d->d_name);
        files[count].used = info.st_mtime;
        files[count].size = (uint64_t)info.st_size;
        total += files[count++].size;
    }
    if (count > 0) qsort(files, count, sizeof *files, older_first);
    for (size_t i = 0; i < count && total > limit; i++) {
        unlinkat(dirfd(directory), files[i].name, 0); /* where another process was faster, it is gone all the same */
        total -= files[i].size;
    }
    free(files);
    closedir(directory);
}

/* malloc'ed bytes of an entry. */
static unsigned char *make_entry(const char *facts, const unsigned char *binary, size_t binary_size, size_t *size) {
    entry_header header = {.format = FORMAT, .facts_size = (uint32_t)strlen(facts), .binary_size = binary_size};
    memcpy(header.magic, magic, sizeof magic);
    *size = sizeof header + header.facts_size + binary_size + SHA256_SIZE;
    unsigned char *data = malloc(*size);
    if (!data) return NULL;
    memcpy(data, &header, sizeof header);
    memcpy(data + sizeof header, facts, header.facts_size);
    memcpy(data + sizeof header + header.facts_size, binary, binary_size);
    brume_sha256(data, *size - SHA256_SIZE, data + *size - SHA256_SIZE);
    return data;
}

int brume_program_cache_store(const char *folder, const char *facts, const unsigned char *binary, size_t binary_size,
                              uint64_t limit) {
    if (binary_size == 0 || binary_size > limit / 2) return 0;
    size_t size = 0;
    int kept = 0, file = -1;
    char *path = brume_program_cache_path(folder, facts);
    unsigned char *entry = make_entry(facts, binary, binary_size, &size);
    brume_text text = {0};
    add_string(&text, path ? path : "");
    add_string(&text, ".XXXXXX");
    char *temporary = finish_text(&text);
    if (!path || !entry || !temporary) goto cleanup;
    make_folder(folder);
    file = mkstemp(temporary); /* mode 0600 */
    if (file < 0) goto cleanup;
    /* Flushed before it gets its name, so that a crash leaves no entry or a whole one. */
    kept = write_quietly(file, entry, size) && fsync(file) == 0;
    kept = close(file) == 0 && kept;
    kept = kept && rename(temporary, path) == 0;
    if (!kept) unlink(temporary);
    make_room(folder, limit);

cleanup:
    free(path);
    free(entry);
    free(temporary);
    return kept;
}

/* ---- programs -------------------------------------------------------------------------------------------------- */

static cl_program program_of(brume_device *device, const char *options, const unsigned char *binary, size_t size) {
    cl_int code, status = CL_SUCCESS;
    cl_uint kernels = 0;
    cl_program program = clCreateProgramWithBinary(device->cl, 1, &device->id, &size, &binary, &status, &code);
    if (code != CL_SUCCESS) return NULL;
    if (status == CL_SUCCESS && clBuildProgram(program, 1, &device->id, options, NULL, NULL) == CL_SUCCESS &&
        clCreateKernelsInProgram(program, 0, NULL, &kernels) == CL_SUCCESS && kernels > 0)
        return program;
    clReleaseProgram(program);
    return NULL;
}

cl_program brume_program_cache_open(brume_device *device, const char *folder, const brume_program_source *source,
                                    uint64_t *bytes) {
    size_t size = 0;
    char *facts = brume_program_cache_facts(device, source);
    unsigned char *binary = facts ? brume_program_cache_load(folder, facts, &size) : NULL;
    cl_program program = binary ? program_of(device, source->options, binary, size) : NULL;
    if (program) *bytes = size;
    free(binary);
    free(facts);
    return program;
}

int brume_program_cache_keep(brume_device *device, const char *folder, const brume_program_source *source,
                             cl_program program) {
    size_t size = 0;
    int kept = 0;
    if (clGetProgramInfo(program, CL_PROGRAM_BINARY_SIZES, sizeof size, &size, NULL) != CL_SUCCESS || size == 0 ||
        size > PROGRAM_CACHE_LIMIT)
        return 0;
    char *facts = brume_program_cache_facts(device, source);
    unsigned char *binary = malloc(size);
    if (facts && binary && clGetProgramInfo(program, CL_PROGRAM_BINARIES, sizeof binary, &binary, NULL) == CL_SUCCESS)
        kept = brume_program_cache_store(folder, facts, binary, size, PROGRAM_CACHE_LIMIT);
    free(binary);
    free(facts);
    return kept;
}

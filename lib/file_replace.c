/* file_replace.c -- files that appear whole: the part of platform.h that is the same everywhere. */
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "platform.h"

enum { MOST_ATTEMPTS = 100 };
#define OLD_SECONDS 86400.0

/* FNV-1a (Fowler, Noll & Vo) of the host's name: names differ by their numbers, and may be too long for a file's. */
uint32_t brume_host_number(void) {
    char name[256];
    uint32_t hash = 2166136261u;
    brume_host_name(name, sizeof name);
    for (const char *c = name; *c; c++) hash = (hash ^ (unsigned char)*c) * 16777619u;
    return hash;
}

int brume_file_create_beside(const char *path, int own, char **out) {
    size_t room = strlen(path) + 64;
    char *name = malloc(room);
    int descriptor = -1;
    *out = NULL;
    if (!name) {
        errno = ENOMEM;
        return -1;
    }
    for (int i = 0; i < MOST_ATTEMPTS && descriptor < 0; i++) {
        snprintf(name, room, "%s.%ld-%08x-%d.tmp", path, brume_process_number(), (unsigned)brume_host_number(), i);
        descriptor = brume_file_create(name, own);
        if (descriptor < 0 && errno != EEXIST) break;
    }
    if (descriptor >= 0) {
        *out = name;
        return descriptor;
    }
    int error = errno;
    free(name);
    errno = error;
    return -1;
}

int brume_file_replace(const char *path, const void *bytes, size_t size, int own) {
    char *temporary;
    int file = brume_file_create_beside(path, own, &temporary);
    if (file < 0) return errno;
    int error = brume_file_write_at(file, bytes, size, 0);
    if (!error) error = brume_file_sync(file);
    int closed = brume_file_close(file);
    if (!error) error = closed;
    if (!error) error = brume_file_rename(temporary, path);
    if (error) remove(temporary);
    free(temporary);
    return error;
}

typedef struct stale {
    const char *folder, *name; /* "." or with its separator; of the file */
    uint32_t host;
} stale;

/* NAME.4711-0badcafe-0.tmp */
static int remove_if_stale(void *user, const brume_folder_entry *entry) {
    const stale *s = user;
    size_t length = strlen(s->name);
    long process;
    unsigned host, attempt;
    char rebuilt[64];
    if (strncmp(entry->name, s->name, length) != 0) return 1;
    const char *rest = entry->name + length;
    if (sscanf(rest, ".%9ld-%8x-%3u.tmp", &process, &host, &attempt) != 3) return 1;
    snprintf(rebuilt, sizeof rebuilt, ".%ld-%08x-%u.tmp", process, host, attempt);
    if (strcmp(rebuilt, rest) != 0) return 1;
    int ended = host == s->host && (process == brume_process_number() || brume_process_is_gone(process));
    if (ended || entry->age > OLD_SECONDS) brume_folder_remove(s->folder, entry->name);
    return 1;
}

void brume_file_remove_stale(const char *path) {
    size_t length = brume_path_folder(path), room = length ? length : 1;
    char *folder = malloc(room + 1);
    if (!folder) return;
    memcpy(folder, length ? path : ".", room);
    folder[room] = 0;
    stale s = {folder, path + length, brume_host_number()};
    brume_folder_visit(folder, remove_if_stale, &s);
    free(folder);
}

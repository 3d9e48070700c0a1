/* file_replace.c -- files that appear whole: the part of platform.h that is the same everywhere. */
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "platform.h"

enum { MOST_ATTEMPTS = 100 };

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

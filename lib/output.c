/* output.c -- files that appear whole or not at all. */
#include "output.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "platform.h"

enum { MOST_ATTEMPTS = 100 };

brume_result brume_output_open(brume_context *context, const char *path, brume_output *out) {
    brume_output output = {.path = path, .descriptor = -1};
    size_t room = strlen(path) + 48;
    output.temporary = malloc(room);
    if (!output.temporary)
        return brume_fail(context, BRUME_ERROR_MEMORY, "%s: out of memory", path);
    for (int i = 0; i < MOST_ATTEMPTS && output.descriptor < 0; i++) {
        snprintf(output.temporary, room, "%s.%ld-%d.tmp", path, brume_process_number(), i);
        output.descriptor = brume_file_create(output.temporary);
        if (output.descriptor < 0 && errno != EEXIST)
            break;
    }
    if (output.descriptor < 0) {
        int error = errno;
        free(output.temporary);
        return brume_fail(context, BRUME_ERROR_OUTPUT, "%s: %s", path, strerror(error));
    }
    *out = output;
    return BRUME_OK;
}

typedef struct stale {
    const char *folder, *name; /* "." or with its separator; of the file */
} stale;

/* NAME.4711-0.tmp */
static int remove_if_stale(void *user, const brume_folder_entry *entry) {
    const stale *s = user;
    size_t length = strlen(s->name), digits;
    const char *at = entry->name;
    if (strncmp(at, s->name, length) != 0 || at[length] != '.') return 1;
    at += length + 1;
    digits = strspn(at, "0123456789");
    if (digits == 0 || at[digits] != '-') return 1;
    at += digits + 1;
    digits = strspn(at, "0123456789");
    if (digits > 0 && strcmp(at + digits, ".tmp") == 0) brume_folder_remove(s->folder, entry->name);
    return 1;
}

void brume_output_remove_stale(const char *path) {
    size_t length = brume_path_folder(path), room = length ? length : 1;
    char *folder = malloc(room + 1);
    if (!folder) return;
    memcpy(folder, length ? path : ".", room);
    folder[room] = 0;
    stale s = {folder, path + length};
    brume_folder_visit(folder, remove_if_stale, &s);
    free(folder);
}

int brume_output_write(brume_output *output, const void *bytes, size_t size, uint64_t offset) {
    if (!output->error)
        output->error = brume_file_write_at(output->descriptor, bytes, size, offset);
    return !output->error;
}

int brume_output_append(brume_output *output, const void *bytes, size_t size) {
    int done = brume_output_write(output, bytes, size, output->end);
    output->end += size;
    return done;
}

brume_result brume_output_close(brume_context *context, brume_output *output, int keep) {
    if (keep && output->durable && !output->error)
        output->error = brume_file_sync(output->descriptor);
    int error = brume_file_close(output->descriptor);
    if (!output->error)
        output->error = error;
    if (keep && !output->error)
        output->error = brume_file_rename(output->temporary, output->path);
    if (!keep || output->error)
        remove(output->temporary);
    else if (output->durable)
        output->error = brume_file_sync_name(output->path);
    free(output->temporary);
    output->temporary = NULL;
    output->descriptor = -1;
    if (output->error)
        return brume_fail(context, BRUME_ERROR_OUTPUT, "%s: %s", output->path, strerror(output->error));
    return BRUME_OK;
}

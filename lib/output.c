/* output.c -- files that appear whole or not at all. */
#include "output.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "platform.h"

#define OLD_SECONDS 86400.0

brume_result brume_output_open(brume_context *context, const char *path, brume_output *out) {
    brume_output output = {.path = path, .descriptor = -1};
    output.descriptor = brume_file_create_beside(path, 0, &output.temporary);
    if (output.descriptor < 0 && errno == ENOMEM)
        return brume_fail(context, BRUME_ERROR_MEMORY, "%s: out of memory", path);
    if (output.descriptor < 0)
        return brume_fail(context, BRUME_ERROR_OUTPUT, "%s: %s", path, strerror(errno));
    *out = output;
    return BRUME_OK;
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

void brume_output_remove_stale(const char *path) {
    size_t length = brume_path_folder(path), room = length ? length : 1;
    char *folder = malloc(room + 1);
    if (!folder) return;
    memcpy(folder, length ? path : ".", room);
    folder[room] = 0;
    stale s = {folder, path + length, brume_host_number()};
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
        return brume_fail(context, output->error == ENOMEM ? BRUME_ERROR_MEMORY : BRUME_ERROR_OUTPUT, "%s: %s",
                          output->path, strerror(output->error));
    return BRUME_OK;
}

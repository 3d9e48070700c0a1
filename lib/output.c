/* output.c -- files that appear whole or not at all. */
#include "output.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "platform.h"

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

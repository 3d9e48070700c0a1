/* output.c -- files that appear whole or not at all. */
#include "output.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { MOST_ATTEMPTS = 100 };

brume_result brume_output_open(brume_context *context, const char *path, brume_output *out) {
    brume_output output = {.path = path, .descriptor = -1};
    size_t room = strlen(path) + 48;
    output.temporary = malloc(room);
    if (!output.temporary)
        return brume_fail(context, BRUME_ERROR_MEMORY, "%s: out of memory", path);
    /* O_EXCL and not mkstemp: the file keeps the permissions that the umask asks for. */
    for (int i = 0; i < MOST_ATTEMPTS && output.descriptor < 0; i++) {
        snprintf(output.temporary, room, "%s.%ld-%d.tmp", path, (long)getpid(), i);
        output.descriptor = open(output.temporary, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
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

int brume_output_write(brume_output *output, const void *bytes, size_t size, uint64_t offset) {
    const char *from = bytes;
    if (size > INT64_MAX || offset > INT64_MAX - size)
        output->error = output->error ? output->error : EFBIG;
    while (size > 0 && !output->error) {
        ssize_t written = pwrite(output->descriptor, from, size, (off_t)offset);
        if (written < 0 && errno != EINTR)
            output->error = errno;
        if (written == 0)
            output->error = ENOSPC;
        if (written > 0) {
            from += written;
            offset += (uint64_t)written;
            size -= (size_t)written;
        }
    }
    return !output->error;
}

int brume_output_append(brume_output *output, const void *bytes, size_t size) {
    int done = brume_output_write(output, bytes, size, output->end);
    output->end += size;
    return done;
}

brume_result brume_output_close(brume_context *context, brume_output *output, int keep) {
    /* Some file systems report a full disk at close only. */
    if (close(output->descriptor) != 0 && !output->error && errno != EINTR)
        output->error = errno;
    if (keep && !output->error && rename(output->temporary, output->path) != 0)
        output->error = errno;
    if (!keep || output->error)
        unlink(output->temporary);
    free(output->temporary);
    output->temporary = NULL;
    output->descriptor = -1;
    if (output->error)
        return brume_fail(context, BRUME_ERROR_OUTPUT, "%s: %s", output->path, strerror(output->error));
    return BRUME_OK;
}

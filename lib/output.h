/* output.h -- a file that appears whole or not at all: written beside its final name, then renamed. */
#ifndef BRUME_OUTPUT_H
#define BRUME_OUTPUT_H

#include "context.h"

typedef struct brume_output {
    const char *path; /* the caller's, valid until close */
    char *temporary;
    int descriptor;
    int error;        /* errno of the first failed write; later writes do nothing */
    uint64_t end;     /* where brume_output_append goes on */
    int durable;      /* set after open: close returns when the file and its name have reached the disk */
} brume_output;

brume_result brume_output_open(brume_context *context, const char *path, brume_output *out);

/* Non-zero if all `size` bytes were taken. */
int brume_output_write(brume_output *output, const void *bytes, size_t size, uint64_t offset);
int brume_output_append(brume_output *output, const void *bytes, size_t size);

/* With `keep`, and if every write succeeded, the file gets its name; else the temporary file is removed, and a failed
 * write is reported as BRUME_ERROR_OUTPUT, or BRUME_ERROR_MEMORY if that is what it lacked. Releases everything in any
 * case. */
brume_result brume_output_close(brume_context *context, brume_output *output, int keep);

#endif

/* program.h -- kernels from source: expansion of #include, build options, build errors.
 *
 * Sources are embedded in the library; the environment variable BRUME_CL_DIR reads them from a folder instead.
 */
#ifndef BRUME_PROGRAM_H
#define BRUME_PROGRAM_H

#include "device.h"

/* The files of cl/ as embedded by the Makefile; ends with a NULL name. */
typedef struct brume_source { const char *name, *text; } brume_source;
extern const brume_source brume_sources[];

/* The entry file with every #include "x" of cl/ replaced, each file once, with #line marks. malloc'ed. */
brume_result brume_program_expand(brume_context *context, const char *entry, char **out);

/* What a program is made from: all that its binary depends on besides the device. */
typedef struct brume_program_source {
    const char *entry;    /* not copied; for messages */
    char *text, *options; /* malloc'ed */
} brume_program_source;

/* An entry file of cl/ expanded. `options` is appended to -cl-std=CL1.2 and the lane options. */
brume_result brume_program_source_make(brume_device *device, const char *entry, uint32_t lanes,
                                       brume_precision precision, const char *options, brume_program_source *out);
void brume_program_source_free(brume_program_source *source);

brume_result brume_program_compile(brume_device *device, const brume_program_source *source, cl_program *out);

/* Both at once, from text that may #include files of cl/ (tests of device functions). */
brume_result brume_program_build_text(brume_device *device, const char *text, uint32_t lanes, brume_precision precision,
                                      const char *options, cl_program *out);

#endif

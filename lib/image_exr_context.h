/* image_exr_context.h -- what reading and writing EXR share: OpenEXRCore's messages caught instead of printed. */
#ifndef BRUME_IMAGE_EXR_CONTEXT_H
#define BRUME_IMAGE_EXR_CONTEXT_H

#include <OpenEXR/openexr.h>
#include <stdio.h>

typedef struct brume_exr_errors {
    char first[256]; /* the first message, "" for none */
} brume_exr_errors;

/* Where this thread's messages go; NULL for nowhere. Not through the context: OpenEXRCore 3.1.5 calls the handler with
 * its lock held when memory runs out, and asking it for the context's user data then waits for ever. */
extern __thread brume_exr_errors *brume_exr_listener;

static inline void brume_exr_on_error(exr_const_context_t exr, exr_result_t code, const char *message) {
    brume_exr_errors *errors = brume_exr_listener;
    (void)exr;
    if (errors && !errors->first[0])
        snprintf(errors->first, sizeof errors->first, "%s", message ? message : exr_get_default_error_message(code));
}

#endif

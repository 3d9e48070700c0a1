/* image_exr_context.h -- what reading and writing EXR share: OpenEXRCore's messages caught instead of printed. */
#ifndef BRUME_IMAGE_EXR_CONTEXT_H
#define BRUME_IMAGE_EXR_CONTEXT_H

#include <OpenEXR/openexr.h>
#include <stdio.h>

/* First member of what user_data points to: the handler finds it through the context. */
typedef struct brume_exr_errors {
    char first[256]; /* the first message, "" for none */
} brume_exr_errors;

static inline void brume_exr_on_error(exr_const_context_t exr, exr_result_t code, const char *message) {
    void *user = NULL;
    brume_exr_errors *errors;
    if (exr && exr_get_user_data(exr, &user) == EXR_ERR_SUCCESS && user) {
        errors = user;
        if (!errors->first[0])
            snprintf(errors->first, sizeof errors->first, "%s",
                     message ? message : exr_get_default_error_message(code));
    }
}

#endif

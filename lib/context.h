/* context.h -- errors and log lines: how every internal function reports.
 *
 * Internal functions return brume_result like the public ones and end in
 *     return brume_fail(context, BRUME_ERROR_SCENE, "%s:%d:%d: expected ...", file, line, column);
 * which keeps the message and logs it.
 */
#ifndef BRUME_CONTEXT_H
#define BRUME_CONTEXT_H

#include "brume.h"

struct brume_context {
    int references; /* the creator's plus one for each object made from it */
    brume_log_callback log;
    void *log_user;
    brume_load_callback load;
    void *load_user;
    double load_interval, load_reported; /* seconds between two reports, at least; and when the last one was */
    char *message;  /* NULL: none, or no memory to keep it */
    const char *speechless; /* for the latter case: what is said instead */
};

/* Keeps and logs the message, returns `result`. context may be NULL. */
brume_result brume_fail(brume_context *context, brume_result result, const char *format, ...)
    __attribute__((format(printf, 3, 4)));
void brume_warn(brume_context *context, const char *format, ...) __attribute__((format(printf, 2, 3)));
void brume_info(brume_context *context, const char *format, ...) __attribute__((format(printf, 2, 3)));

/* What a file that can't be read comes to, by errno: BRUME_ERROR_MEMORY or _SCENE. */
brume_result brume_read_error(int error);

/* For functions that hold nothing to be released: passes a failure on. */
#define BRUME_TRY(call)              \
    do {                             \
        brume_result tried = (call); \
        if (tried != BRUME_OK)       \
            return tried;            \
    } while (0)

brume_context *brume_context_retain(brume_context *context);
void brume_context_release(brume_context *context);

#endif

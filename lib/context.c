/* context.c -- brume_context: the last error message and the log callback. */
#include "context.h"

#include <errno.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

const char *brume_result_name(brume_result result) {
    switch (result) {
    case BRUME_OK: return "ok";
    case BRUME_ERROR_ARGUMENT: return "invalid argument";
    case BRUME_ERROR_MEMORY: return "out of memory";
    case BRUME_ERROR_SCENE: return "scene error";
    case BRUME_ERROR_NO_DEVICE: return "no device";
    case BRUME_ERROR_DEVICE: return "device error";
    case BRUME_ERROR_BUILD: return "kernel build error";
    case BRUME_ERROR_OUTPUT: return "output error";
    case BRUME_CANCELLED: return "cancelled";
    case BRUME_ERROR_CHECKPOINT: return "checkpoint error";
    case BRUME_ERROR_DENOISER: return "denoiser error";
    }
    return "unknown result";
}

brume_result brume_context_create(brume_context **out) {
    if (!out) return BRUME_ERROR_ARGUMENT;
    brume_context *context = calloc(1, sizeof *context);
    if (!context) return BRUME_ERROR_MEMORY;
    context->references = 1;
    context->load_interval = 0.1;
    *out = context;
    return BRUME_OK;
}

brume_context *brume_context_retain(brume_context *context) {
    context->references++;
    return context;
}

void brume_context_release(brume_context *context) {
    if (!context || --context->references > 0) return;
    free(context->message);
    free(context);
}

void brume_context_destroy(brume_context *context) { brume_context_release(context); }

void brume_context_set_log(brume_context *context, brume_log_callback callback, void *user) {
    if (!context) return;
    context->log = callback;
    context->log_user = user;
}

const char *brume_context_message(const brume_context *context) {
    if (!context) return "";
    return context->message ? context->message : context->speechless ? context->speechless : "";
}

/* NULL when there is no memory for it. */
static char *format_message(const char *format, va_list arguments) {
    va_list again;
    va_copy(again, arguments);
    int length = vsnprintf(NULL, 0, format, arguments);
    char *text = length < 0 ? NULL : malloc((size_t)length + 1);
    if (text) vsnprintf(text, (size_t)length + 1, format, again);
    va_end(again);
    return text;
}

static void log_line(brume_context *context, brume_log_level level, const char *text) {
    if (text && context->log) context->log(context->log_user, level, text);
}

brume_result brume_fail(brume_context *context, brume_result result, const char *format, ...) {
    if (!context) return result;
    va_list arguments;
    va_start(arguments, format);
    char *text = format_message(format, arguments);
    va_end(arguments);
    free(context->message);
    context->message = text;
    context->speechless = text ? NULL : brume_result_name(result);
    log_line(context, BRUME_LOG_ERROR, text ? text : context->speechless);
    return result;
}

brume_result brume_read_error(int error) { return error == ENOMEM ? BRUME_ERROR_MEMORY : BRUME_ERROR_SCENE; }

#define LOG_FORMATTED(level)                              \
    do {                                                  \
        if (!context || !context->log) return;            \
        va_list arguments;                                \
        va_start(arguments, format);                      \
        char *text = format_message(format, arguments);   \
        va_end(arguments);                                \
        log_line(context, level, text);                   \
        free(text);                                       \
    } while (0)

void brume_warn(brume_context *context, const char *format, ...) { LOG_FORMATTED(BRUME_LOG_WARNING); }
void brume_info(brume_context *context, const char *format, ...) { LOG_FORMATTED(BRUME_LOG_INFO); }

/* load_progress.c -- see load_progress.h. */
#include "load_progress.h"

#include "platform.h"

void brume_context_set_load_progress(brume_context *context, brume_load_callback callback, void *user) {
    if (!context) return;
    context->load = callback;
    context->load_user = user;
}

void brume_load_begin(brume_context *context) {
    if (context->load) context->load_reported = brume_seconds();
}

int brume_load_goes_on(brume_context *context, const char *path, double fraction) {
    if (!context->load) return 1;
    double now = brume_seconds();
    if (now - context->load_reported < context->load_interval) return 1;
    context->load_reported = now;
    brume_load_progress progress = {path, fraction < 1 ? fraction : 1};
    return context->load(context->load_user, &progress) == 0;
}

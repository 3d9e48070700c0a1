/* session.c -- see session.h. */
#include "session.h"

#include <dirent.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "../ball.h"
#include "../break_off.h"

enum { WIDTH = 23, HEIGHT = 14, PIXELS = WIDTH * HEIGHT, CHANNELS = 9, SAMPLES = 8, SWAP_AT = 3 };
/* Seconds per sample of a work-item: several launches a pass, and the same ones every time. */
static const double speeds[SESSION_KINDS] = {2e-4, 1e-5, 1e-5, 2e-4, 2e-4};

const char *const session_names[SESSION_KINDS] = {"cached", "adaptive", "saved", "source", "quick"};

typedef struct pictures {
    float channels[CHANNELS][3 * PIXELS];
    uint64_t samples;
    double relmse;
    brume_device_info device;
} pictures;

static char folder[] = "/tmp/brume-faults-XXXXXX";
static char exr[64], png[64], saved[64], kept[64], fresh[64];
static pictures right[SESSION_KINDS];
static unsigned calls[SESSION_KINDS][CL_FUNCTION_COUNT][2];

static size_t channel_floats(int channel) {
    return channel <= BRUME_CHANNEL_NORMAL || channel == BRUME_CHANNEL_ERROR ? 3 * PIXELS : PIXELS;
}

/* A pilot, several passes, edges for samples to go to. */
static brume_result make_scene(brume_context *context, brume_scene **out) {
    brume_film_desc film = brume_film_desc_default();
    brume_integrator_desc integrator = brume_integrator_desc_default();
    film.width = WIDTH;
    film.height = HEIGHT;
    film.alpha = 1;
    integrator.max_depth = 3;
    BRUME_TRY(ball_in_fog(context, BRUME_LIGHT_SPOT, WIDTH, HEIGHT, out));
    brume_result result = brume_scene_set_film(*out, &film);
    if (result == BRUME_OK) result = brume_scene_set_integrator(*out, &integrator);
    if (result != BRUME_OK) brume_scene_destroy(*out);
    return result;
}

static void remove_files(const char *where) {
    DIR *directory = opendir(where);
    char path[512];
    for (struct dirent *d; directory && (d = readdir(directory));) {
        snprintf(path, sizeof path, "%s/%s", where, d->d_name);
        if (d->d_name[0] != '.') remove(path);
    }
    if (directory) closedir(directory);
}

/* ---- a session ------------------------------------------------------------------------------------------------- */

typedef struct session {
    session_kind kind;
    const cl_fault *fault; /* NULL: none */
    brume_context *context;
    brume_device *device;
    brume_scene *scene;
    brume_render *render;
    int reported;
    int spoilt;            /* the render is neither here nor there: loading failed on its device */
    char *loss;            /* 256; "" while nothing is lost */
} session;

static void lose(session *s, const char *format, ...) {
    if (s->loss[0]) return;
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(s->loss, 256, format, arguments);
    va_end(arguments);
    for (char *c = s->loss; *c; c++)
        if (*c == '\n') *c = ' ';
}

/* Kinds of errors that an OpenCL error may come out as. */
static int suits(const session *s, brume_result result) {
    if (s->spoilt) return result == BRUME_ERROR_DEVICE;
    switch (s->fault->code) {
    case CL_MEM_OBJECT_ALLOCATION_FAILURE:
    case CL_OUT_OF_HOST_MEMORY:
    case CL_INVALID_BUFFER_SIZE: return result == BRUME_ERROR_MEMORY;
    case -1001:
    case CL_DEVICE_NOT_FOUND: return result == BRUME_ERROR_NO_DEVICE;
    }
    if (s->fault->function == CL_GET_PLATFORM_IDS || s->fault->function == CL_GET_DEVICE_IDS)
        return result == BRUME_ERROR_NO_DEVICE || result == BRUME_ERROR_DEVICE;
    if (s->fault->function == CL_BUILD_PROGRAM) return result == BRUME_ERROR_BUILD || result == BRUME_ERROR_DEVICE;
    return result == BRUME_ERROR_DEVICE;
}

/* Whether the step is to be tried (again). Called with what it returned, BRUME_OK before the first time. */
static int failed(session *s, const char *step, brume_result result) {
    if (result == BRUME_OK || s->loss[0]) return 0;
    const char *message = brume_context_message(s->context);
    if (!s->fault || !cl_shim_fired() || s->reported)
        lose(s, "%s: %s: %s", step, brume_result_name(result), message);
    else if (!suits(s, result))
        lose(s, "%s: %s is not what it is: %s", step, brume_result_name(result), message);
    else if (!strstr(message, cl_shim_error_name(s->fault->code)))
        lose(s, "%s: the message does not name it: %s", step, message);
    s->reported = 1;
    if (s->fault && s->fault->manner == CL_LOST) return 0;
    cl_shim_disarm();
    return s->loss[0] == 0;
}

/* Tries once, and if that fails, and is meant to, once more. */
#define STEP(what, call)                                                     \
    do {                                                                     \
        brume_result got = (call);                                           \
        if (failed(s, what, got)) got = (call), failed(s, what, got);        \
        if (got != BRUME_OK) return;                                         \
    } while (0)

static void prepare_cache(session_kind kind) {
    if (kind == SESSION_SOURCE) remove_files(fresh);
    setenv("BRUME_CACHE_DIR", kind == SESSION_SOURCE ? fresh : kind == SESSION_QUICK ? "" : kept, 1);
}

/* Where it failed on the device it takes another render. */
static brume_result load(session *s, const brume_render_desc *desc) {
    brume_result result = BRUME_OK;
    if (s->spoilt) {
        brume_render_destroy(s->render);
        s->render = NULL;
        result = brume_render_create(s->device, s->scene, desc, &s->render);
    }
    if (result == BRUME_OK) result = brume_render_load(s->render, saved);
    s->spoilt = result == BRUME_ERROR_DEVICE;
    return result;
}

static void work(session *s, pictures *out) {
    brume_render_desc desc = brume_render_desc_default();
    brume_device_info info;
    brume_render_stats stats;
    uint32_t count = 0;
    desc.sample_count = SAMPLES;
    if (s->kind == SESSION_ADAPTIVE || s->kind == SESSION_SAVED) {
        desc.sample_count = 256;
        desc.noise_threshold = 2e-3;
        desc.adaptive = BRUME_ADAPTIVE_ON;
    }
    desc.lanes = s->kind == SESSION_QUICK ? 0 : 1;
    desc.quick_start = s->kind == SESSION_QUICK;
    STEP("brume_device_count", brume_device_count(s->context, &count));
    STEP("brume_device_describe", brume_device_describe(s->context, BRUME_DEVICE_ANY, &info));
    STEP("brume_device_open", brume_device_open(s->context, BRUME_DEVICE_ANY, &s->device));
    STEP("brume_render_create", brume_render_create(s->device, s->scene, &desc, &s->render));
    if (s->kind == SESSION_QUICK && s->render->program.awaited) s->render->program.swap_at = SWAP_AT;
    if (s->kind == SESSION_SAVED) {
        if (access(saved, F_OK) != 0) {
            STEP("brume_render_run", break_off_in_a_pass(s->render, 64));
            STEP("brume_render_save", brume_render_save(s->render, saved));
        }
        brume_render_destroy(s->render);
        s->render = NULL;
        STEP("brume_render_create", brume_render_create(s->device, s->scene, &desc, &s->render));
        STEP("brume_render_load", load(s, &desc));
    }
    STEP("brume_render_run", brume_render_run(s->render, NULL, NULL));
    for (int channel = 0; channel < CHANNELS; channel++)
        STEP("brume_render_read", brume_render_read(s->render, (brume_channel)channel, out->channels[channel],
                                                    channel_floats(channel)));
    STEP("brume_render_write", brume_render_write(s->render, exr, NULL));
    STEP("brume_render_write", brume_render_write(s->render, png, NULL));
    STEP("brume_render_get_stats", brume_render_get_stats(s->render, &stats));
    if (!stats.complete) lose(s, "the statistics don't say that it is complete");
    out->samples = stats.samples;
    out->relmse = stats.relmse;
    out->device = info;
}

/* What is left in the folder that should not be. */
static void look_for_files(session *s) {
    DIR *directory = opendir(folder);
    for (struct dirent *d; directory && (d = readdir(directory));)
        if (strstr(d->d_name, ".tmp")) lose(s, "%s is left", d->d_name);
    if (directory) closedir(directory);
}

static void run_session(session *s, pictures *out) {
    prepare_cache(s->kind);
    if (brume_context_create(&s->context) != BRUME_OK || make_scene(s->context, &s->scene) != BRUME_OK) {
        lose(s, "the scene can't be made");
        brume_context_destroy(s->context);
        return;
    }
    cl_shim_reset();
    cl_shim_set_speed(speeds[s->kind]);
    if (s->fault) cl_shim_arm(s->fault);
    memset(out, 0, sizeof *out);
    work(s, out);
    brume_render_destroy(s->render);
    brume_scene_destroy(s->scene);
    brume_device_destroy(s->device);
    brume_context_destroy(s->context);
    cl_shim_set_speed(0);
    s->render = NULL;
    s->scene = NULL;
    s->device = NULL;
    s->context = NULL;
    if (cl_shim_outstanding()) lose(s, "%d OpenCL objects are left", cl_shim_outstanding());
    look_for_files(s);
}

static void compare(session *s, const pictures *got) {
    const pictures *want = &right[s->kind];
    for (int channel = 0; channel < CHANNELS; channel++)
        if (memcmp(got->channels[channel], want->channels[channel], channel_floats(channel) * sizeof(float)) != 0)
            lose(s, "channel %d is not what it should be", channel);
    if (got->samples != want->samples)
        lose(s, "%llu samples; %llu expected", (unsigned long long)got->samples, (unsigned long long)want->samples);
    if (got->relmse != want->relmse) lose(s, "relMSE %g; %g expected", got->relmse, want->relmse);
    if (memcmp(&got->device, &want->device, sizeof got->device) != 0)
        lose(s, "the device is described as another: %s, %u units", got->device.name, got->device.compute_units);
}

session_end session_with(session_kind kind, const cl_fault *fault, char loss[256]) {
    static pictures got;
    session s = {.kind = kind, .fault = fault, .loss = loss};
    loss[0] = 0;
    remove(saved);
    run_session(&s, &got);
    int fired = cl_shim_disarm(), reported = s.reported;
    if (fault->manner == CL_LOST && reported && !loss[0]) { /* the device is back, and what has been saved is there */
        s = (session){.kind = kind, .loss = loss};
        run_session(&s, &got);
    }
    if (!loss[0]) compare(&s, &got);
    return loss[0] ? SESSION_LOST : reported ? SESSION_REPORTED : fired ? SESSION_WENT_ON : SESSION_UNTOUCHED;
}

void session_describe(session_kind kind, const cl_fault *fault, char *out, size_t size) {
    static const char *const manners[] = {"", ", done all the same", ", half of it", ", and all else from then on",
                                          ", and so on"};
    snprintf(out, size, "%s: %s no. %u%s, %s%s", session_names[kind], cl_shim_name(fault->function), fault->n,
             fault->in_thread ? " of the thread" : "", cl_shim_error_name(fault->code), manners[fault->manner]);
}

unsigned session_calls(session_kind kind, cl_function function, int in_thread) {
    return calls[kind][function][in_thread];
}

/* ---- before and after ------------------------------------------------------------------------------------------ */

int sessions_begin(void) {
    static const session_kind order[SESSION_KINDS] = {SESSION_SOURCE, SESSION_QUICK, SESSION_CACHED, SESSION_ADAPTIVE,
                                                      SESSION_SAVED};
    char loss[256] = "";
    brume_context *context = NULL;
    uint32_t devices = 0;
    if (!mkdtemp(folder)) return -1;
    snprintf(exr, sizeof exr, "%s/picture.exr", folder);
    snprintf(png, sizeof png, "%s/picture.png", folder);
    snprintf(saved, sizeof saved, "%s/state", folder);
    snprintf(kept, sizeof kept, "%s/kept", folder);
    snprintf(fresh, sizeof fresh, "%s/fresh", folder);
    if (brume_context_create(&context) == BRUME_OK) brume_device_count(context, &devices);
    brume_context_destroy(context);
    if (!devices) return 0;
    session prime = {.kind = SESSION_CACHED, .loss = loss};
    run_session(&prime, &right[SESSION_CACHED]);
    for (int i = 0; i < SESSION_KINDS && !loss[0]; i++) {
        session s = {.kind = order[i], .loss = loss};
        run_session(&s, &right[order[i]]);
        for (int f = 0; f < CL_FUNCTION_COUNT; f++)
            for (int t = 0; t < 2; t++) calls[order[i]][f][t] = cl_shim_calls((cl_function)f, t);
        if (order[i] == SESSION_SAVED) { /* broken off, or not */
            static pictures both;
            both = right[SESSION_SAVED];
            right[SESSION_SAVED] = right[SESSION_ADAPTIVE];
            if (!loss[0]) compare(&s, &both);
        }
    }
    if (loss[0]) fprintf(stderr, "without faults: %s\n", loss);
    return loss[0] ? -1 : 1;
}

void sessions_end(void) {
    remove_files(kept);
    remove_files(fresh);
    remove_files(folder);
    rmdir(folder);
}

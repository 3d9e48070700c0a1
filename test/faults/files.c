/* files.c -- see files.h. */
#include "files.h"

#include <dirent.h>
#include <errno.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "../ball.h"
#include "file_shim.h"
#include "render.h"

enum { SIDE = 20, MOST_BYTES = 1 << 20 };

const char *const files_names[FILES_WORKS] = {"an EXR", "a PNG", "a checkpoint", "an EXR of added parts",
                                              "a PNG of added parts"};

static char folder[] = "/tmp/brume-files-XXXXXX";
static char paths[FILES_WORKS][64], parts[2][64];
static brume_context *context;
static brume_device *device;
static brume_scene *scene;
static brume_render *render;
static brume_merged *merged;

typedef struct contents {
    unsigned char bytes[MOST_BYTES];
    size_t size;
} contents;

static contents before = {"what was there before", 21}, whole, now;

static void read_file(const char *path, contents *out) {
    FILE *file = fopen(path, "rb");
    out->size = file ? fread(out->bytes, 1, MOST_BYTES, file) : 0;
    if (file) fclose(file);
}

static int same(const contents *a, const contents *b) {
    return a->size == b->size && memcmp(a->bytes, b->bytes, a->size) == 0;
}

static int put_back(const char *path) {
    FILE *file = fopen(path, "wb");
    int done = file && fwrite(before.bytes, 1, before.size, file) == before.size;
    return file && fclose(file) == 0 && done;
}

static int leftovers(void) {
    DIR *directory = opendir(folder);
    int count = 0;
    for (struct dirent *d; directory && (d = readdir(directory));) count += strstr(d->d_name, ".tmp") != NULL;
    if (directory) closedir(directory);
    return count;
}

static brume_result do_work(files_work work) {
    switch (work) {
    case FILES_EXR:
    case FILES_PNG: return brume_render_write(render, paths[work], NULL);
    case FILES_CHECKPOINT: return brume_render_save(render, paths[work]);
    default: return brume_merged_write(merged, paths[work], NULL);
    }
}

/* ---- one failure ----------------------------------------------------------------------------------------------- */

static void lose(files_sweep *s, files_work work, int at, int error, const char *format, ...) {
    va_list arguments;
    s->lost++;
    printf("# %s, call %d of %s, %s: ", files_names[work], at, file_shim_log(), strerror(error));
    va_start(arguments, format);
    vprintf(format, arguments);
    va_end(arguments);
    printf("\n");
    fflush(stdout);
}

static void try_one(files_work work, file_fault fault, int at, int error, files_sweep *s) {
    const char *path = paths[work];
    s->tried++;
    if (!put_back(path)) {
        lose(s, work, at, error, "the folder is not to be written to");
        return;
    }
    file_shim_begin(fault, at, error);
    brume_result result = do_work(work);
    file_shim_end();
    read_file(path, &now);
    if (result == BRUME_OK) {
        s->went_on++;
        if (!same(&now, &whole)) lose(s, work, at, error, "it is said to be written, and is not");
    } else {
        const char *message = brume_context_message(context);
        s->reported++;
        if (result != BRUME_ERROR_OUTPUT || !strstr(message, strerror(error)) || !strstr(message, path))
            lose(s, work, at, error, "%s: %s", brume_result_name(result), message);
        if (!same(&now, &before) && !same(&now, &whole))
            lose(s, work, at, error, "%zu bytes are neither what was there nor the whole", now.size);
    }
    if (leftovers()) lose(s, work, at, error, "a temporary file is left");
    result = do_work(work);
    read_file(path, &now);
    if (result != BRUME_OK || !same(&now, &whole))
        lose(s, work, at, error, "asked again: %s: %s", brume_result_name(result), brume_context_message(context));
}

void files_sweep_all(files_work work, files_sweep *s) {
    static const int errors[] = {ENOSPC, EIO, EDQUOT};
    file_shim_begin(FILE_NONE, 0, 0);
    do_work(work);
    file_shim_end();
    int calls = file_shim_calls();
    read_file(paths[work], &whole);
    for (int at = 0; at < calls; at++)
        for (int e = 0; e < 3; e++) {
            try_one(work, FILE_FAILS, at, errors[e], s);
            try_one(work, FILE_FULL, at, errors[e], s);
        }
}

/* ---- before and after ------------------------------------------------------------------------------------------ */

static brume_result prepare(void) {
    brume_render_desc desc = brume_render_desc_default();
    const char *const both[] = {parts[0], parts[1]};
    brume_result result = ball_in_fog(context, BRUME_LIGHT_SPOT, SIDE, SIDE, &scene);
    desc.lanes = 1;
    desc.sample_count = 2;
    for (int i = 0; i < 2 && result == BRUME_OK; i++, desc.first_sample += 2) {
        brume_render_destroy(render);
        render = NULL;
        result = brume_render_create(device, scene, &desc, &render);
        if (result == BRUME_OK) result = brume_render_run(render, NULL, NULL);
        if (result == BRUME_OK) result = brume_render_save(render, parts[i]);
    }
    return result == BRUME_OK ? brume_merge(context, both, 2, NULL, &merged) : result;
}

int files_begin_works(void) {
    static const char *const names[FILES_WORKS] = {"a.exr", "a.png", "state", "both.exr", "both.png"};
    uint32_t devices = 0;
    if (!mkdtemp(folder)) return -1;
    for (int i = 0; i < FILES_WORKS; i++) snprintf(paths[i], sizeof paths[i], "%s/%s", folder, names[i]);
    for (int i = 0; i < 2; i++) snprintf(parts[i], sizeof parts[i], "%s/part-%d", folder, i);
    if (brume_context_create(&context) != BRUME_OK) return -1;
    if (brume_device_count(context, &devices) != BRUME_OK || !devices) return 0;
    brume_result result = brume_device_open(context, BRUME_DEVICE_ANY, &device);
    if (result == BRUME_OK) result = prepare();
    for (int work = 0; work < FILES_WORKS && result == BRUME_OK; work++) result = do_work((files_work)work);
    if (result != BRUME_OK) fprintf(stderr, "without faults: %s\n", brume_context_message(context));
    return result == BRUME_OK ? 1 : -1;
}

void files_end_works(void) {
    for (int i = 0; i < FILES_WORKS; i++) remove(paths[i]);
    for (int i = 0; i < 2; i++) remove(parts[i]);
    rmdir(folder);
    brume_merged_destroy(merged);
    brume_render_destroy(render);
    brume_scene_destroy(scene);
    brume_device_destroy(device);
    brume_context_destroy(context);
}

/* targets.c -- see targets.h. */
#define _GNU_SOURCE
#include "targets.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "checkpoint_state.h"
#include "guard.h"
#include "image.h"
#include "mesh.h"

const fuzz_target fuzz_targets[FUZZ_TARGETS] = {
    {"scene", fuzz_scene}, {"obj", fuzz_obj}, {"ply", fuzz_ply}, {"picture", fuzz_picture},
    {"checkpoint", fuzz_checkpoint}};

/* In memory, where the system has that. */
static const char *folder(void) {
    static char path[64];
    if (path[0]) return path;
    strcpy(path, "/dev/shm/brume-fuzz-XXXXXX");
    if (mkdtemp(path)) return path;
    strcpy(path, "/tmp/brume-fuzz-XXXXXX");
    if (!mkdtemp(path)) abort();
    return path;
}

static void remove_folder(void) {
    char command[128];
    snprintf(command, sizeof command, "rm -rf '%s'", folder());
    if (system(command) != 0) abort();
}

static void write_bytes(const char *name, const uint8_t *bytes, size_t size, char path[192]) {
    static int registered;
    if (!registered) atexit(remove_folder);
    registered = 1;
    snprintf(path, 192, "%s/%s", folder(), name);
    FILE *file = fopen(path, "wb");
    if (!file || fwrite(bytes, 1, size, file) != size || fclose(file) != 0) abort();
}

static brume_context *new_context(void) {
    brume_context *context = NULL;
    if (brume_context_create(&context) != BRUME_OK) abort();
    return context;
}

/* Errors come with words. */
static void check(brume_context *context, brume_result result) {
    if (result != BRUME_OK && !*brume_context_message(context)) abort();
}

/* ---- scenes ---------------------------------------------------------------------------------------------------- */

enum { MOST_PARTS = 8 };

/* A name that is safe to write under: a few letters and an extension. */
static int read_name(const uint8_t *bytes, size_t size, char name[32]) {
    size_t n = 0;
    while (n < size && n < 31 && bytes[n] != '\n') n++;
    if (n == 0 || n == size || bytes[n] != '\n') return 0;
    memcpy(name, bytes, n);
    name[n] = 0;
    return strspn(name, "abcdefghijklmnopqrstuvwxyz.0123456789") == n && name[0] != '.' &&
           strcmp(name, "scene.xml") != 0;
}

void fuzz_scene(const uint8_t *bytes, size_t size) {
    char path[192], names[MOST_PARTS][192], name[32] = "scene.xml";
    int count = 0;
    while (count < MOST_PARTS) {
        const uint8_t *mark = memmem(bytes, size, "\n%% ", 4);
        write_bytes(name, bytes, mark ? (size_t)(mark - bytes) + 1 : size, names[count++]);
        if (!mark) break;
        size -= (size_t)(mark - bytes) + 4;
        bytes = mark + 4;
        if (!read_name(bytes, size, name)) break;
        size -= strlen(name) + 1;
        bytes += strlen(name) + 1;
    }
    snprintf(path, sizeof path, "%s", names[0]);
    brume_context *context = new_context();
    brume_scene *scene = NULL;
    const brume_parameter parameter = {"given", "3"};
    guard_begin();
    brume_result result = brume_scene_load(context, path, &parameter, 1, &scene);
    if (result == BRUME_OK) {
        uint32_t effects;
        brume_effect_report reports[BRUME_EFFECT_COUNT];
        result = brume_scene_effects(scene, 0, &effects, reports);
    }
    check(context, result);
    brume_scene_destroy(scene);
    guard_end();
    brume_context_destroy(context);
    for (int i = 0; i < count; i++) remove(names[i]);
}

/* ---- meshes ---------------------------------------------------------------------------------------------------- */

static void read_mesh(const char *name, const uint8_t *bytes, size_t size, int is_obj) {
    char path[192];
    write_bytes(name, bytes, size, path);
    brume_context *context = new_context();
    const brume_mesh_options options = {0, (int)(size & 1)};
    brume_mesh mesh;
    guard_begin();
    brume_result result = is_obj ? brume_mesh_read_obj(context, path, &options, NULL, &mesh)
                                 : brume_mesh_read_ply(context, path, &options, NULL, &mesh);
    check(context, result);
    if (result == BRUME_OK) {
        for (size_t i = 0; i < 3 * (size_t)mesh.triangle_count; i++)
            if (mesh.triangles[i] >= mesh.vertex_count) abort();
        brume_mesh_free(&mesh);
    }
    guard_end();
    brume_context_destroy(context);
}

void fuzz_obj(const uint8_t *bytes, size_t size) { read_mesh("mesh.obj", bytes, size, 1); }
void fuzz_ply(const uint8_t *bytes, size_t size) { read_mesh("mesh.ply", bytes, size, 0); }

/* ---- pictures -------------------------------------------------------------------------------------------------- */

void fuzz_picture(const uint8_t *bytes, size_t size) {
    char path[192];
    write_bytes("picture", bytes, size, path);
    brume_context *context = new_context();
    brume_image image;
    guard_begin();
    brume_result result = brume_image_read(context, path, 0, NULL, &image);
    check(context, result);
    if (result == BRUME_OK) {
        size_t last = 3 * (size_t)image.width * image.height;
        volatile float corner = image.texels[last - 1]; /* it is there */
        (void)corner;
        free(image.texels);
    }
    guard_end();
    brume_context_destroy(context);
}

/* ---- checkpoints ----------------------------------------------------------------------------------------------- */

enum { PRELUDE = 64, SIZE_AT = 16, SUM_AT = 24 };

/* What a state is used for when a render goes on: counts that are shifts, groups of a pass, places in the film. */
static void read_state(brume_context *context, const char *path, const brume_checkpoint *c) {
    const brume_checkpoint_head *h = &c->head;
    brume_checkpoint_state s;
    brume_result result = brume_checkpoint_state_make(context, path, c, 0, &s);
    check(context, result);
    if (result != BRUME_OK) return;
    brume_film_layout layout = brume_film_layout_make(h->width, h->height, h->lanes);
    size_t slots = brume_film_slot_count(&layout);
    if (h->pass_samples && (h->groups_done >= s.pass_groups || h->doubtful > s.pass_groups - h->groups_done)) abort();
    if (s.schedule_size > slots * sizeof *s.schedule) abort();
    for (size_t i = 0; i < s.schedule_size / sizeof *s.schedule; i++)
        if (s.schedule[i] < -1 || (s.schedule[i] >= 0 && (size_t)s.schedule[i] >= slots)) abort();
    for (size_t i = 0; h->error_estimate && i < (size_t)h->width * h->height; i++)
        if (1ull << s.estimate.level[i] > 1ull << 24) abort();
    if (s.allocation) {
        uint32_t *counts = malloc((size_t)h->width * h->height * sizeof *counts);
        double samples, relmse;
        if (!counts) abort();
        brume_allocation_counts(s.allocation, brume_allocation_for_samples(s.allocation, 64), counts);
        brume_allocation_predict(s.allocation, brume_allocation_for_error(s.allocation, 1e-3), &samples, &relmse);
        free(counts);
    }
    brume_checkpoint_state_free(&s);
}

void fuzz_checkpoint(const uint8_t *bytes, size_t size) {
    char path[192];
    uint8_t *file = malloc(size + PRELUDE);
    if (!file) abort();
    memcpy(file, bytes, size);
    if (size >= PRELUDE) {
        uint64_t rest = size - PRELUDE;
        memcpy(file + SIZE_AT, &rest, sizeof rest);
        brume_sha256(file + PRELUDE, rest, file + SUM_AT);
    }
    write_bytes("checkpoint", file, size, path);
    free(file);
    brume_context *context = new_context();
    brume_checkpoint c;
    guard_begin();
    brume_result result = brume_checkpoint_read(context, path, &c);
    check(context, result);
    if (result == BRUME_OK) {
        const brume_checkpoint_head none = {.width = 1};
        check(context, brume_checkpoint_same_render(context, path, &c.head, &none, "another"));
        size_t floats = (size_t)c.head.width * c.head.height * 10;
        volatile float last = c.planes[floats - 1];
        volatile uint8_t end = c.rest_size ? c.rest[c.rest_size - 1] : 0;
        (void)last;
        (void)end;
        read_state(context, path, &c);
        brume_checkpoint_free(&c);
    }
    guard_end();
    brume_context_destroy(context);
}

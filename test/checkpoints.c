/* checkpoints.c -- see checkpoints.h. */
#include "checkpoints.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

static char folder[] = "/tmp/brume-checkpoint-XXXXXX";

int open_checkpoints(void **state) {
    if (!mkdtemp(folder) || setenv("BRUME_CACHE_DIR", folder, 1) != 0) return -1;
    return open_device(state);
}

int close_checkpoints(void **state) {
    char command[128];
    snprintf(command, sizeof command, "rm -rf '%s'", folder);
    return close_device(state) == 0 && system(command) == 0 ? 0 : -1;
}

const char *path_of(const char *name) {
    static char paths[4][128];
    static int next;
    next = (next + 1) % 4;
    snprintf(paths[next], sizeof paths[next], "%s/%s", folder, name);
    return paths[next];
}

brume_scene *slats(void) {
    static const brume_parameter parameters[] = {{"width", "48"}, {"height", "30"}};
    brume_scene *scene;
    must(brume_scene_load(context, "scenes/ladder/slats.xml", parameters, 2, &scene));
    return scene;
}

brume_render_desc checkpoint_desc(void) {
    brume_render_desc desc = brume_render_desc_default();
    desc.lanes = 4;
    return desc;
}

brume_render *create(const brume_scene *scene, const brume_render_desc *desc) {
    brume_render *render;
    must(brume_render_create(device, scene, desc, &render));
    return render;
}

void finish(brume_render *render, whole_film *out) {
    brume_render_stats stats;
    float *planes;
    size_t count = brume_film_plane_count(brume_render_recorded(render));
    must(brume_render_run(render, NULL, NULL));
    must(brume_render_get_stats(render, &stats));
    memset(out, 0, sizeof *out);
    out->used = count * brume_film_slot_count(&render->layout);
    assert_true(out->used <= sizeof out->planes / sizeof *out->planes);
    must(brume_render_read_planes(render, count, &planes));
    memcpy(out->planes, planes, out->used * sizeof *planes);
    free(planes);
    must(brume_render_read(render, BRUME_CHANNEL_ERROR, out->error, 3 * COUNT));
    out->samples = stats.samples;
    out->relmse = stats.relmse;
    out->relmse_low = stats.relmse_low;
    out->relmse_high = stats.relmse_high;
    out->order = stats.order;
    out->adaptive = stats.adaptive;
    out->complete = stats.complete;
    brume_render_destroy(render);
}

void expect_same(const whole_film *a, const whole_film *b) {
    assert_int_equal(a->used, b->used);
    assert_memory_equal(a->planes, b->planes, a->used * sizeof *a->planes);
    assert_memory_equal(a->error, b->error, sizeof a->error);
    assert_int_equal(a->samples, b->samples);
    assert_true(a->relmse == b->relmse && a->relmse_low == b->relmse_low && a->relmse_high == b->relmse_high);
    assert_true(a->order == b->order);
    assert_int_equal(a->adaptive, b->adaptive);
    assert_int_equal(a->complete, b->complete);
}

unsigned char *read_whole(const char *path, size_t *size) {
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    assert_int_equal(fseek(file, 0, SEEK_END), 0);
    *size = (size_t)ftell(file);
    rewind(file);
    unsigned char *bytes = malloc(*size + 1);
    assert_non_null(bytes);
    assert_int_equal(fread(bytes, 1, *size, file), *size);
    fclose(file);
    return bytes;
}

void write_whole(const char *path, const void *bytes, size_t size) {
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(bytes, 1, size, file), size);
    assert_int_equal(fclose(file), 0);
}

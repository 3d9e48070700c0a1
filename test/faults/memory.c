/* memory.c -- see memory.h. */
#include "memory.h"

#include <fcntl.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "../break_off.h"
#include "cl_shim.h"
#include "host_shim.h"
#include "image.h"
#include "render.h"
#include "scene.h"

enum { SIZE = 12, FLOATS = SIZE * SIZE * 3 };

const char *const memory_names[MEMORY_WORKS] = {"loading a scene", "rendering", "saving and loading a checkpoint",
                                                "adding up parts", "rendering on two devices"};

static const char *const files[] = {"scene.xml", "part.xml", "tetrahedron.obj", "square.ply", "texture.png", "sky.exr",
                                    "out.exr", "out.png", "state", "again", "a", "b"};
enum { OUT_EXR = 6, OUT_PNG, STATE, AGAIN, PART_A, PART_B };
enum { FILES = sizeof files / sizeof files[0] };

static char folder[] = "/tmp/brume-memory-XXXXXX";
static char paths[FILES][64], cache[64];

/* What comes of the work. */
typedef struct answer {
    brume_effect_report effects[BRUME_EFFECT_COUNT];
    brume_film_desc film;
    double shapes, bytes; /* checksums: of the scene, of a file */
    float pixels[FLOATS], errors[FLOATS];
} answer;

static answer right[MEMORY_WORKS];
static unsigned allocations[MEMORY_WORKS];

static const char scene_text[] =
    "<scene version='3.0.0'><default name='size' value='12'/><include filename='part.xml'/>"
    "<integrator type='volpath'><integer name='max_depth' value='4'/></integrator>"
    "<sensor type='perspective'><ref id='fog'/><film type='hdrfilm'><integer name='width' value='$size'/>"
    "<integer name='height' value='$size'/></film><sampler type='independent'>"
    "<integer name='sample_count' value='8'/></sampler></sensor>"
    "<shape type='obj'><string name='filename' value='tetrahedron.obj'/><ref id='paint'/></shape>"
    "<shape type='ply'><string name='filename' value='square.ply'/></shape>"
    "<emitter type='envmap'><string name='filename' value='sky.exr'/></emitter>"
    "<emitter type='spot'><transform name='to_world'><translate y='2'/></transform></emitter></scene>";
static const char part_text[] =
    "<scene version='3.0.0'><medium type='homogeneous' id='fog'><float name='sigma_t' value='0.1'/></medium>"
    "<bsdf type='diffuse' id='paint'><texture type='bitmap' name='reflectance'>"
    "<string name='filename' value='texture.png'/></texture></bsdf></scene>";
static const char obj_text[] =
    "v -1 -1 3\nv 1 -1 3\nv 0 1 3\nv 0 0 4\nvt 0 0\nvt 1 0\nvt 0 1\n"
    "f 1/1 2/2 3/3\nf 1/1 2/2 4/3\nf 2/1 3/2 4/3\nf 3/1 1/2 4/3\n";
static const char ply_text[] =
    "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
    "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
    "-3 -1 2\n3 -1 2\n3 -1 9\n-3 -1 9\n4 0 1 2 3\n";

static int write_text(const char *path, const char *text) {
    FILE *file = fopen(path, "w");
    int done = file && fputs(text, file) >= 0;
    return file && fclose(file) == 0 && done;
}

static int write_files(void) {
    float sky[8 * 4 * 3];
    for (int i = 0; i < 8 * 4 * 3; i++) sky[i] = 0.1f + 0.01f * (float)i;
    const brume_exr_channel channels[3] = {{"R", sky, 3, 0}, {"G", sky + 1, 3, 0}, {"B", sky + 2, 3, 0}};
    return write_text(paths[0], scene_text) && write_text(paths[1], part_text) && write_text(paths[2], obj_text) &&
           write_text(paths[3], ply_text) &&
           brume_png_write(NULL, paths[4], 8, 4, sky, 0, BRUME_TONEMAP_NONE, NULL) == BRUME_OK &&
           brume_exr_write(NULL, paths[5], 0, 0, 8, 4, 8, 4, channels, 3, NULL, 0) == BRUME_OK;
}

/* ---- the work -------------------------------------------------------------------------------------------------- */

static brume_result load(brume_context *context, answer *out) {
    brume_scene *scene = NULL;
    uint32_t effects;
    BRUME_TRY(brume_scene_load(context, paths[0], NULL, 0, &scene));
    brume_result result = brume_scene_effects(scene, 0, &effects, out->effects);
    if (result == BRUME_OK) result = brume_scene_get_film(scene, &out->film);
    out->shapes = scene->texture_count + scene->light_count;
    for (uint32_t i = 0; i < scene->shape_count; i++) {
        const brume_scene_shape *shape = &scene->shapes[i];
        for (uint32_t k = 0; shape->positions && k < 3 * shape->desc.vertex_count; k++)
            out->shapes = out->shapes * 1.25 + shape->positions[k];
        for (uint32_t k = 0; shape->triangles && k < 3 * shape->desc.triangle_count; k++)
            out->shapes = out->shapes * 1.25 + shape->triangles[k];
    }
    for (uint32_t i = 0; i < scene->texture_count; i++) out->shapes += scene->textures[i].texels[5];
    brume_scene_destroy(scene);
    return result;
}

static brume_device *device; /* of `rendering`, and its scene: made while nothing fails */
static brume_device *halves; /* NULL where it can't be split */
static brume_scene *scene_to_render;

static brume_result render(brume_device *on, answer *out) {
    brume_render *made = NULL;
    brume_render_desc desc = brume_render_desc_default();
    desc.lanes = 1;
    desc.sample_count = 64;
    desc.noise_threshold = 1e-2;
    desc.adaptive = BRUME_ADAPTIVE_ON;
    BRUME_TRY(brume_render_create(on, scene_to_render, &desc, &made));
    brume_result result = brume_render_run(made, NULL, NULL);
    /* What fails may be asked for again: half of the film's worth is in that. */
    if (result == BRUME_ERROR_MEMORY) {
        host_shim_relent();
        result = brume_render_run(made, NULL, NULL);
        if (result == BRUME_OK) result = brume_render_read(made, BRUME_CHANNEL_RADIANCE, out->pixels, FLOATS);
        if (result == BRUME_OK && memcmp(out->pixels, right[MEMORY_RENDER].pixels, sizeof out->pixels) == 0)
            result = BRUME_ERROR_MEMORY; /* as it was */
        else if (result == BRUME_OK)
            result = BRUME_ERROR_ARGUMENT;
    }
    if (result == BRUME_OK) result = brume_render_read(made, BRUME_CHANNEL_RADIANCE, out->pixels, FLOATS);
    if (result == BRUME_OK) result = brume_render_read(made, BRUME_CHANNEL_ERROR, out->errors, FLOATS);
    if (result == BRUME_OK) result = brume_render_write(made, paths[OUT_EXR], NULL);
    if (result == BRUME_OK) result = brume_render_write(made, paths[OUT_PNG], NULL);
    brume_render_destroy(made);
    return result;
}

/* Without memory of its own. */
static double checksum_of(const char *path) {
    unsigned char bytes[512];
    double sum = 1;
    int file = open(path, O_RDONLY);
    for (ssize_t got; file >= 0 && (got = read(file, bytes, sizeof bytes)) > 0;)
        for (ssize_t i = 0; i < got; i++) sum = fmod(sum * 257 + bytes[i], 1e9 + 7);
    if (file >= 0) close(file);
    return sum;
}

static brume_render_desc desc_of_states(void) {
    brume_render_desc desc = brume_render_desc_default();
    desc.lanes = 1;
    desc.sample_count = 64;
    desc.adaptive = BRUME_ADAPTIVE_ON;
    return desc;
}

/* A render takes over a state and saves what it has then: the same bytes. */
static brume_result save(answer *out) {
    brume_render *made = NULL;
    brume_render_desc desc = desc_of_states();
    BRUME_TRY(brume_render_create(device, scene_to_render, &desc, &made));
    brume_result result = brume_render_load(made, paths[STATE]);
    if (result == BRUME_OK) result = brume_render_save(made, paths[AGAIN]);
    if (result == BRUME_OK) result = brume_render_read(made, BRUME_CHANNEL_RADIANCE, out->pixels, FLOATS);
    if (result == BRUME_OK) out->bytes = checksum_of(paths[AGAIN]);
    brume_render_destroy(made);
    return result;
}

static brume_result merge(brume_context *context, answer *out) {
    const char *const both[] = {paths[PART_A], paths[PART_B]};
    brume_merged *merged = NULL;
    BRUME_TRY(brume_merge(context, both, 2, NULL, &merged));
    brume_result result = brume_merged_read(merged, BRUME_CHANNEL_RADIANCE, out->pixels, FLOATS);
    if (result == BRUME_OK) result = brume_merged_write(merged, paths[OUT_EXR], NULL);
    if (result == BRUME_OK) result = brume_merged_write(merged, paths[OUT_PNG], NULL);
    if (result == BRUME_OK) out->bytes = checksum_of(paths[OUT_PNG]); /* the EXR tells how long it took */
    brume_merged_destroy(merged);
    return result;
}

/* Works without a device have a context of their own. */
static int is_hosts(memory_work work) { return work == MEMORY_LOAD || work == MEMORY_MERGE; }

static brume_result do_work(memory_work work, brume_context *context, answer *out) {
    memset(out, 0, sizeof *out);
    switch (work) {
    case MEMORY_LOAD: return load(context, out);
    case MEMORY_SAVE: return save(out);
    case MEMORY_MERGE: return merge(context, out);
    case MEMORY_SHARED: return render(halves, out);
    default: return render(device, out);
    }
}

/* A state of the middle of an adaptive pass, and two ranges of samples. */
static brume_result write_states(void) {
    brume_render *made = NULL;
    brume_render_desc desc = desc_of_states();
    brume_result result = brume_render_create(device, scene_to_render, &desc, &made);
    if (result == BRUME_OK) {
        result = break_off_in_a_pass(made, 50);
        if (result == BRUME_OK) result = brume_render_save(made, paths[STATE]);
        brume_render_destroy(made);
    }
    desc.adaptive = BRUME_ADAPTIVE_OFF;
    desc.sample_count = 8;
    for (int i = 0; i < 2 && result == BRUME_OK; i++, desc.first_sample += 8) {
        result = brume_render_create(device, scene_to_render, &desc, &made);
        if (result == BRUME_OK) result = brume_render_run(made, NULL, NULL);
        if (result == BRUME_OK) result = brume_render_save(made, paths[PART_A + i]);
        brume_render_destroy(made);
    }
    return result;
}

/* ---- one failure ----------------------------------------------------------------------------------------------- */

static void lose(memory_sweep *s, memory_work work, unsigned n, int forever, const char *format, ...) {
    va_list arguments;
    s->lost++;
    printf("# %s, allocation %u%s: ", memory_names[work], n, forever ? " and all later ones" : "");
    va_start(arguments, format);
    vprintf(format, arguments);
    va_end(arguments);
    printf("\n");
    fflush(stdout);
}

void memory_try(memory_work work, unsigned n, int forever, memory_sweep *s) {
    static answer got;
    char who[256];
    brume_context *context = NULL;
    s->tried++;
    if (is_hosts(work) && brume_context_create(&context) != BRUME_OK) return;
    brume_context *speaker = is_hosts(work) ? context : device->context;
    host_shim_begin(n, forever);
    brume_result result = do_work(work, context, &got);
    host_shim_relent();
    int fired = host_shim_fired();
    char message[512];
    snprintf(message, sizeof message, "%s", brume_context_message(speaker));
    if (result == BRUME_OK && memcmp(&got, &right[work], sizeof got) != 0)
        lose(s, work, n, forever, "went on to something else");
    else if (result != BRUME_OK && (result != BRUME_ERROR_MEMORY || !fired || !message[0]))
        lose(s, work, n, forever, "%s: %s", brume_result_name(result), message);
    else if (result != BRUME_OK)
        s->reported++;
    else
        s->went_on++;
    if (result != BRUME_OK) {
        result = do_work(work, context, &got);
        if (result != BRUME_OK || memcmp(&got, &right[work], sizeof got) != 0)
            lose(s, work, n, forever, "asked again: %s: %s", brume_result_name(result),
                 brume_context_message(speaker));
    }
    if (!is_hosts(work)) brume_fail(speaker, BRUME_OK, "%s", ""); /* its message is in the books */
    brume_context_destroy(context);
    size_t left = host_shim_left(who), own = is_hosts(work) ? 0 : 1;
    host_shim_end();
    if (left > own) lose(s, work, n, forever, "%zu allocations are left, one of %s", left - own, who);
}

/* ---- before and after ------------------------------------------------------------------------------------------ */

unsigned memory_allocations(memory_work work) { return allocations[work]; }

static int measure(memory_work work, brume_context *context) {
    char who[256];
    static answer again;
    for (int i = 0; i < 3; i++) { /* what libraries make once and keep is made by then */
        host_shim_begin(0, 0);
        if (do_work(work, context, i < 2 ? &right[work] : &again) != BRUME_OK) {
            fprintf(stderr, "%s: %s\n", memory_names[work], brume_context_message(context));
            return 0;
        }
        allocations[work] = host_shim_count();
        size_t left = host_shim_left(who);
        host_shim_end();
        if (i == 2 && left) fprintf(stderr, "%s leaves %zu allocations of %s\n", memory_names[work], left, who);
    }
    if (memcmp(&again, &right[work], sizeof again) == 0) return 1;
    fprintf(stderr, "%s twice comes out as two things\n", memory_names[work]);
    return 0;
}

/* A device that can't be split is no failure. */
static int open_both(brume_context *context) {
    brume_device *parts[2] = {NULL, NULL};
    if (brume_device_open_part(context, BRUME_DEVICE_ANY, 0, 2, &parts[0]) != BRUME_OK) return 1;
    brume_result result = brume_device_open_part(context, BRUME_DEVICE_ANY, 1, 2, &parts[1]);
    if (result == BRUME_OK) result = brume_device_join(parts, 2, &halves);
    brume_device_destroy(parts[0]);
    brume_device_destroy(parts[1]);
    return result == BRUME_OK;
}

int memory_begin(void) {
    brume_context *context = NULL;
    uint32_t devices = 0;
    if (!host_shim_works()) return 0;
    if (!mkdtemp(folder)) return -1;
    for (int i = 0; i < FILES; i++) snprintf(paths[i], sizeof paths[i], "%s/%s", folder, files[i]);
    snprintf(cache, sizeof cache, "%s/cache", folder);
    setenv("BRUME_CACHE_DIR", cache, 1);
    cl_shim_reset();
    if (!write_files() || brume_context_create(&context) != BRUME_OK || !measure(MEMORY_LOAD, context)) return -1;
    if (brume_device_count(context, &devices) == BRUME_OK && devices) {
        if (brume_device_open(context, BRUME_DEVICE_ANY, &device) != BRUME_OK ||
            brume_scene_load(context, paths[0], NULL, 0, &scene_to_render) != BRUME_OK ||
            !measure(MEMORY_RENDER, context) || write_states() != BRUME_OK || !measure(MEMORY_SAVE, context) ||
            !measure(MEMORY_MERGE, context) || !open_both(context) || (halves && !measure(MEMORY_SHARED, context)))
            return -1;
    }
    brume_context_destroy(context);
    return 1;
}

void memory_end(void) {
    char command[128];
    brume_scene_destroy(scene_to_render);
    brume_device_destroy(halves);
    brume_device_destroy(device);
    snprintf(command, sizeof command, "rm -rf '%s'", folder);
    if (system(command) != 0) fprintf(stderr, "%s is left\n", folder);
}

/* References: long renders, each the mean of two halves with seeds of their own, whose difference says how far it can
 * be trusted. They are kept in a folder, under a name made of all that they depend on except the renderer. */
#include <stdlib.h>
#include <string.h>

#include "error_metrics.h"
#include "files.h"
#include "ladder.h"
#include "scene_hash.h"

/* Far from the seeds of what is compared with it. */
enum { REFERENCE_SEED = 1000003 };

/* ---- the file: a line that tells the settings, then the picture's floats as they lie in memory ---- */

typedef struct header {
    double samples, seconds, error;
    uint64_t pixel_count;
} header;

static int load(const char *path, const char *settings, size_t pixel_count, ladder_reference *out)
{
    char line[512];
    header h;
    FILE *file = fopen(path, "rb");
    float *radiance = malloc(3 * pixel_count * sizeof *radiance);
    int ok = file && radiance && fgets(line, sizeof line, file) && strcmp(line, settings) == 0 &&
             fread(&h, sizeof h, 1, file) == 1 && h.pixel_count == pixel_count &&
             fread(radiance, sizeof *radiance, 3 * pixel_count, file) == 3 * pixel_count;
    if (file)
        fclose(file);
    if (!ok) {
        free(radiance);
        return 0;
    }
    out->pixel_count = pixel_count;
    out->samples = h.samples;
    out->seconds = h.seconds;
    out->error = h.error;
    out->radiance = radiance;
    return 1;
}

static int save(const char *path, const char *settings, const ladder_reference *reference)
{
    files_draft draft;
    header h = {reference->samples, reference->seconds, reference->error, reference->pixel_count};
    int error = files_begin(&draft, path);
    if (!error) {
        fputs(settings, draft.file);
        fwrite(&h, sizeof h, 1, draft.file);
        fwrite(reference->radiance, sizeof(float), 3 * h.pixel_count, draft.file);
        error = files_end(&draft, 1);
    }
    if (!error)
        return LADDER_EXIT_OK;
    ladder_error("%s: cannot be written: %s", path, strerror(error));
    return LADDER_EXIT_OUTPUT;
}

/* ---- both ---- */

static int render(const ladder *l, const brume_scene *scene, ladder_reference *out)
{
    const ladder_options *o = l->options;
    ladder_shot halves[2] = {{0}, {0}};
    /* One sample first, which builds the program: a time limit counts that, too. */
    int code = ladder_shoot(l, scene, &o->reference, REFERENCE_SEED, 1, 0, NULL, &halves[0]);
    for (uint32_t i = 0; i < 2 && !code; i++)
        code = ladder_shoot(l, scene, &o->reference, REFERENCE_SEED + i, o->reference_spp / 2,
                            o->reference_seconds / 2, i == 0 ? out->png : NULL, &halves[i]);
    if (!code && (halves[0].samples < 1 || halves[1].samples < 1)) {
        ladder_error("the reference: not one sample per pixel in %g s", o->reference_seconds);
        code = LADDER_EXIT_RUNTIME;
    }
    if (!code) {
        size_t count = halves[0].pixel_count;
        out->pixel_count = count;
        out->samples = halves[0].samples + halves[1].samples;
        out->seconds = halves[0].seconds + halves[1].seconds;
        out->radiance = malloc(3 * count * sizeof *out->radiance);
        if (out->radiance) {
            for (size_t i = 0; i < 3 * count; i++)
                out->radiance[i] = 0.5f * (halves[0].radiance[i] + halves[1].radiance[i]);
            /* The mean of two has half the error of each. */
            out->error = 0.5 * error_metrics_of_pair(halves[0].radiance, halves[1].radiance, out->radiance, count);
        } else {
            ladder_error("out of memory");
            code = LADDER_EXIT_RUNTIME;
        }
    }
    ladder_shot_free(&halves[0]);
    ladder_shot_free(&halves[1]);
    return code;
}

int ladder_reference_get(const ladder *l, const ladder_scene *from, const brume_scene *scene, ladder_reference *out)
{
    const ladder_options *o = l->options;
    char settings[512], path[LADDER_PATH];
    memset(out, 0, sizeof *out);
    snprintf(settings, sizeof settings, "brume reference: %s, %ux%u, depth %s, %s, %u samples or %g s\n", from->name,
             o->width, o->height, o->depth ? o->depth : "of the scene", o->reference.name, o->reference_spp,
             o->reference_seconds);
    uint64_t hash = SCENE_HASH_START;
    scene_hash_bytes(&hash, settings, strlen(settings));
    scene_hash_file(&hash, from->path);
    snprintf(path, sizeof path, "%s/%s-%016llx.raw", o->cache, from->name, (unsigned long long)hash);
    snprintf(out->png, sizeof out->png, "%s/%s-%016llx.png", o->cache, from->name, (unsigned long long)hash);
    int code = ladder_make_folder(o->cache);
    if (code)
        return code;
    if (load(path, settings, (size_t)o->width * o->height, out)) {
        ladder_say("  reference of %.0f samples per pixel from %s", out->samples, path);
        return LADDER_EXIT_OK;
    }
    ladder_say("  rendering the reference, %u samples per pixel or %g s", o->reference_spp, o->reference_seconds);
    code = render(l, scene, out);
    if (!code)
        code = save(path, settings, out);
    if (!code)
        ladder_say("  reference of %.0f samples per pixel in %.1f s, its own relMSE %.2g", out->samples, out->seconds,
                   out->error);
    if (code)
        ladder_reference_free(out);
    return code;
}

void ladder_reference_free(ladder_reference *reference)
{
    free(reference->radiance);
    reference->radiance = NULL;
}

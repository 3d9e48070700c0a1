/* measure_identity.c SCENE... -- is a scene's picture the same to the bit whatever code is left out of it? `make
 * identity` renders a window of every scene file by the program built for it, at one lane; by that with each feature
 * more, alone; by the generic one; and by both of these at the device's width; and prints a table. Exit status 1: one
 * differs.
 *
 * test_effects does the same with a few small scenes in seconds; this takes minutes, nearly all of them in the
 * compiler. */
#include <stdio.h>
#include <string.h>

#include "../cl/shared.h"
#include "effects.h"

enum { SIZE = 24, SAMPLES = 2, FLOATS = SIZE * SIZE * 3 };

/* Returns the features compiled in; 0: it failed, and has said why. */
static uint32_t render(brume_context *context, brume_device *device, const brume_scene *scene,
                       const brume_render_desc *desc, float out[FLOATS]) {
    brume_render *r;
    brume_render_stats stats;
    memset(&stats, 0, sizeof stats);
    brume_result result = brume_render_create(device, scene, desc, &r);
    if (result == BRUME_OK) {
        result = brume_render_run(r, NULL, NULL);
        if (result == BRUME_OK) result = brume_render_read(r, BRUME_CHANNEL_RADIANCE, out, FLOATS);
        if (result == BRUME_OK) result = brume_render_get_stats(r, &stats);
        brume_render_destroy(r);
    }
    if (result != BRUME_OK) fprintf(stderr, "%s\n", brume_context_message(context));
    return result == BRUME_OK ? stats.features : 0;
}

static int values_that_differ(const float *a, const float *b) {
    int count = 0;
    for (int i = 0; i < FLOATS; i++) count += memcmp(&a[i], &b[i], sizeof *a) != 0;
    return count;
}

/* Prints the scene's row. Returns how many programs gave another picture; < 0: something failed. */
static int compare(brume_context *context, brume_device *device, const char *path) {
    static float own[FLOATS], other[FLOATS];
    brume_scene *scene;
    brume_film_desc film;
    if (brume_scene_load(context, path, NULL, 0, &scene) != BRUME_OK) {
        fprintf(stderr, "%s\n", brume_context_message(context));
        return -1;
    }
    brume_scene_get_film(scene, &film);
    brume_render_desc desc = brume_render_desc_default();
    desc.lanes = 1;
    desc.guides = desc.error_estimate = 0;
    desc.sample_count = SAMPLES;
    desc.use_crop = 1;
    desc.crop_x = (film.width - SIZE) / 2;
    desc.crop_y = (film.height - SIZE) / 2;
    desc.crop_width = desc.crop_height = SIZE;
    uint32_t needed = render(context, device, scene, &desc, own);
    int programs = 1, wrong = 0, failed = !needed, lit = 0;
    for (int i = 0; i < FLOATS; i++) lit += own[i] > 0;
    printf("| %s | %u | %d of %d |", path, needed, lit, FLOATS);
    /* Each bit; then none, at the device's width; then the generic program at both. */
    for (uint32_t k = 0; k < 32 + 3 && !failed; k++) {
        uint32_t bit = k < 32 ? FEATURE_ALL & (1u << k) : 0;
        if (k < 32 && (!bit || (needed & bit) || bit == FEATURE_GUIDES || bit == FEATURE_LIGHT_LAYERS)) continue;
        desc.extra_features = bit;
        desc.generic = desc.light_layers = k > 32;
        desc.lanes = k == 32 || k == 34 ? 0 : 1;
        uint32_t features = render(context, device, scene, &desc, other);
        failed = features != (k > 32 ? (uint32_t)FEATURE_ALL : needed | bit);
        int different = failed ? 0 : values_that_differ(own, other);
        programs++;
        wrong += different > 0;
        if (different)
            printf(" %s at %s: %d values;", k > 32 ? "generic" : bit ? brume_feature_name((uint32_t)k) : "own",
                   desc.lanes ? "1 lane" : "all lanes", different);
    }
    printf(" %d | %d |\n", programs, wrong);
    fflush(stdout);
    brume_scene_destroy(scene);
    return failed ? -1 : wrong;
}

int main(int argc, char **argv) {
    brume_context *context;
    brume_device *device;
    int wrong = 0, failed = 0;
    if (brume_context_create(&context) != BRUME_OK) return 1;
    if (brume_device_open(context, BRUME_DEVICE_ANY, &device) != BRUME_OK) {
        fprintf(stderr, "%s\n", brume_context_message(context));
        return 1;
    }
    puts("| scene | features | values lit | programs | of these give another picture |\n|---|--:|--:|--:|--:|");
    for (int i = 1; i < argc; i++) {
        int n = compare(context, device, argv[i]);
        wrong += n > 0 ? n : 0;
        failed += n < 0;
    }
    printf("%d scenes, %d programs that give another picture, %d failures\n", argc - 1, wrong, failed);
    brume_device_destroy(device);
    brume_context_destroy(context);
    return wrong || failed || argc < 2;
}

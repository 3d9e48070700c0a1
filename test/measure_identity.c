/* measure_identity.c SCENE... -- is a scene's picture the same to the bit whatever code is left out of it? `make
 * identity` renders a window of every scene file by the program built for it, at one lane; by that with each feature
 * more, alone; by the generic one; and by both of these at the device's width; and prints a table. Exit status 1: one
 * differs.
 *
 * test_identity does a part of it in half a minute; this takes many, nearly all of them in the compiler. */
#include <stdio.h>

#include "effects.h"
#include "identity.h"

/* Prints the scene's row. Returns how many programs gave another picture; < 0: something failed. */
static int compare(brume_context *context, brume_device *device, const char *path, int *programs) {
    static identity scene;
    if (identity_open(context, device, path, &scene) != BRUME_OK) {
        fprintf(stderr, "%s\n", brume_context_message(context));
        return -1;
    }
    printf("| %s | %u | %d of %d |", path, scene.needed, scene.lit, IDENTITY_FLOATS);
    int own = 1, wrong = 0, failed = 0;
    /* Each bit; then none, at the device's width; then the generic program at both. */
    for (uint32_t k = 0; k < 32 + 3 && !failed; k++) {
        uint32_t bit = k < 32 ? identity_spare(&scene) & (1u << k) : 0;
        if (k < 32 && !bit) continue;
        const identity_program program = {bit, k > 32, k == 32 || k == 34 ? 0 : 1};
        int different = identity_differs(&scene, &program);
        failed = different < 0;
        own++;
        wrong += different > 0;
        if (different > 0)
            printf(" %s at %s: %d values;", program.generic ? "generic" : bit ? brume_feature_name(k) : "own",
                   program.lanes ? "1 lane" : "all lanes", different);
    }
    if (failed) fprintf(stderr, "%s\n", brume_context_message(context));
    printf(" %d | %d |\n", own, wrong);
    fflush(stdout);
    *programs += own;
    identity_close(&scene);
    return failed ? -1 : wrong;
}

int main(int argc, char **argv) {
    brume_context *context;
    brume_device *device;
    int wrong = 0, failed = 0, programs = 0;
    if (brume_context_create(&context) != BRUME_OK) return 1;
    if (brume_device_open(context, BRUME_DEVICE_ANY, &device) != BRUME_OK) {
        fprintf(stderr, "%s\n", brume_context_message(context));
        return 1;
    }
    puts("| scene | features | values lit | programs | of these give another picture |\n|---|--:|--:|--:|--:|");
    for (int i = 1; i < argc; i++) {
        int n = compare(context, device, argv[i], &programs);
        wrong += n > 0 ? n : 0;
        failed += n < 0;
    }
    printf("%d scenes, %d programs, %d that give another picture, %d failures\n", argc - 1, programs, wrong, failed);
    brume_device_destroy(device);
    brume_context_destroy(context);
    return wrong || failed || argc < 2;
}

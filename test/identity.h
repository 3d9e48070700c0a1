/* identity.h -- a window of a scene's picture by one program and another: is it the same to the bit whatever code is
 * left out of them? For test_identity, which tries each scene file in part, and measure_identity, which tries all. */
#ifndef TEST_IDENTITY_H
#define TEST_IDENTITY_H

#include "brume.h"

enum { IDENTITY_SIZE = 24, IDENTITY_FLOATS = IDENTITY_SIZE * IDENTITY_SIZE * 3 };

typedef struct identity {
    brume_device *device; /* not owned */
    brume_scene *scene;
    brume_render_desc desc;
    uint32_t needed; /* the features that the program built for the scene has */
    float own[IDENTITY_FLOATS]; /* its picture, at one lane */
    int lit;         /* values of it that are not 0 */
} identity;

/* What a program has besides; width: lanes, 0 for the device's. `generic`: everything. */
typedef struct identity_program {
    uint32_t extra;
    int generic;
    uint32_t lanes;
} identity_program;

/* Loads a scene file and renders the middle of its picture by its own program. On failure the context knows why, and
 * there is nothing to close. */
brume_result identity_open(brume_context *context, brume_device *device, const char *path, identity *out);
void identity_close(identity *i);

/* The features that the scene does without, but for guides and light layers, which no picture depends on. */
uint32_t identity_spare(const identity *i);

/* How many values of the picture by that program are other bits; < 0: it could not be rendered, or has not the features
 * asked for. */
int identity_differs(identity *i, const identity_program *program);

#endif

/* checkpoints.h -- what the tests of checkpoints share: a small scene, its film to the last bit, a folder for files. */
#ifndef CHECKPOINTS_H
#define CHECKPOINTS_H

#include "known_answer.h"
#include "render.h"

enum { WIDTH = 48, HEIGHT = 30, COUNT = WIDTH * HEIGHT };

/* All that a render came to: the planes as the device has them, and what it knows of its error. */
typedef struct whole_film {
    float planes[FILM_LAYER_PLANES * 2 * COUNT]; /* room for tiles that lie partly outside */
    size_t used;
    float error[3 * COUNT];
    uint64_t samples;
    double relmse, relmse_low, relmse_high, order;
    uint32_t adaptive, complete;
} whole_film;

/* Group setup and teardown: a device, and a temporary folder that also holds the programs, which are compiled once. */
int open_checkpoints(void **state);
int close_checkpoints(void **state);

/* A path in the folder; valid until the next call but three. */
const char *path_of(const char *name);

/* The beam between slats: shadows with many edges. A small one. */
brume_scene *slats(void);

/* With narrow vectors, which compile soon. */
brume_render_desc checkpoint_desc(void);

brume_render *create(const brume_scene *scene, const brume_render_desc *desc);
void finish(brume_render *render, whole_film *out); /* runs, reads, destroys */
void expect_same(const whole_film *a, const whole_film *b);

/* The contents of a file, malloc'ed. */
unsigned char *read_whole(const char *path, size_t *size);
void write_whole(const char *path, const void *bytes, size_t size);

#endif

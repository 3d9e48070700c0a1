/* memory.h -- loading a scene, rendering it, going on from a checkpoint, and adding up parts, while memory runs out at one
 * allocation or from one on. */
#ifndef MEMORY_H
#define MEMORY_H

typedef enum memory_work {
    MEMORY_LOAD, MEMORY_RENDER, MEMORY_SAVE, MEMORY_MERGE,
    MEMORY_SHARED, /* rendering, on the two halves of the device */
    MEMORY_WORKS
} memory_work;

extern const char *const memory_names[MEMORY_WORKS];

typedef struct memory_sweep {
    unsigned tried, reported, went_on, lost;
} memory_sweep;

/* Scene files with includes, meshes and textures in a temporary folder. Returns 0 if there is no way to test, < 0 if
 * the work fails by itself, with the reason on standard error. */
int memory_begin(void);
void memory_end(void);

/* How many allocations the work makes; 0 without a device to render on. */
unsigned memory_allocations(memory_work work);

/* The n-th fails, with `forever` all from then on until the work has failed. It must end in BRUME_ERROR_MEMORY, or go
 * on to the same result, and leave nothing behind; asked again, it must succeed. What doesn't hold is printed. */
void memory_try(memory_work work, unsigned n, int forever, memory_sweep *s);

#endif

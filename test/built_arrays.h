/* built_arrays.h -- the kernels' arrays of a scene that a test describes by calls. */
#ifndef BUILT_ARRAYS_H
#define BUILT_ARRAYS_H

#include "arrays.h"

/* Set by open_context and freed by close_context, a test program's group setup and teardown. */
extern brume_context *scene_context;
int open_context(void **state);
int close_context(void **state);

/* With a sensor and nothing else; brume_scene_destroy it. */
brume_scene *scene_with_sensor(void);

/* Fails the test with the library's message; brume_arrays_free them. */
void build_arrays(const brume_scene *scene, brume_arrays *arrays);

void assert_close(double value, double wanted, double relative);

#endif

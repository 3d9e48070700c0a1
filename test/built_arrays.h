/* built_arrays.h -- the kernels' arrays of a scene that a test describes by calls. */
#ifndef BUILT_ARRAYS_H
#define BUILT_ARRAYS_H

#include "arrays.h"
#include "open_device.h"

/* With a sensor and nothing else; brume_scene_destroy it. */
brume_scene *scene_with_sensor(void);

/* Fails the test with the library's message; brume_arrays_free them. */
void build_arrays(const brume_scene *scene, brume_arrays *arrays);

void assert_close(double value, double wanted, double relative);

#endif

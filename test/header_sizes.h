/* Sizes of the public structs, as the language that includes this sees them. */
#ifndef HEADER_SIZES_H
#define HEADER_SIZES_H

#include <stddef.h>

#include "brume.h"

enum { HEADER_SIZES = 18 };

#define HEADER_FILL(out) do { \
    const size_t sizes[HEADER_SIZES] = { \
        sizeof(brume_device_info), sizeof(brume_parameter), sizeof(brume_texture_desc), sizeof(brume_bsdf_desc), \
        sizeof(brume_medium_desc), sizeof(brume_light_desc), sizeof(brume_shape_desc), sizeof(brume_sensor_desc), \
        sizeof(brume_film_desc), sizeof(brume_integrator_desc), sizeof(brume_render_desc), sizeof(brume_progress), \
        sizeof(brume_render_stats), sizeof(brume_picture_desc), sizeof(brume_merge_desc), sizeof(brume_result), \
        offsetof(brume_shape_desc, radiance), offsetof(brume_render_stats, render_seconds)}; \
    for (int header_i = 0; header_i < HEADER_SIZES; header_i++) \
        (out)[header_i] = (unsigned)sizes[header_i]; \
} while (0)

#ifdef __cplusplus
extern "C"
#endif
void header_sizes_cxx(unsigned *out);

#endif

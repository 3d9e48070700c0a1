/* denoise.h -- Intel's Open Image Denoise, which is loaded when it is asked for and not linked. */
#ifndef BRUME_DENOISE_H
#define BRUME_DENOISE_H

#include "context.h"

/* All pictures are height x width x 3 floats. rgb is HDR radiance; albedo in [0, 1] and normals in [-1, 1] guide the
 * filter, both or none (NULL). BRUME_ERROR_DENOISER: the library isn't there, or failed. */
brume_result brume_denoise_picture(brume_context *context, uint32_t width, uint32_t height, const float *rgb,
                                   const float *albedo, const float *normal, float *out);

#endif

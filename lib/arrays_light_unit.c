/* arrays_light_unit.c -- the power of two that all light of a scene is divided by on its way to the device, and the
 * picture multiplied with on its way back.
 *
 * Kernels multiply powers by areas and by probabilities, and the film squares them: of radiances around 1e30 or 1e-30
 * those are no floats. A power of two changes no digit, so it is only used where it is needed.
 */
#include "arrays_build.h"

#include <math.h>

/* Binary orders of magnitude that are left as they are. */
#define USUAL 20

static double brightest(const brume_scene *scene) {
    double most = 0;
    for (int c = 0; c < 3; c++) {
        for (uint32_t i = 0; i < scene->shape_count; i++)
            most = fmax(most, scene->shapes[i].desc.radiance[c]);
        for (uint32_t i = 0; i < scene->medium_count; i++)
            most = fmax(most, scene->media[i].emission[c]);
        for (uint32_t i = 0; i < scene->light_count; i++)
            if (scene->lights[i].desc.kind != BRUME_LIGHT_ENVMAP)
                most = fmax(most, scene->lights[i].desc.intensity[c]);
    }
    for (uint32_t i = 0; i < scene->light_count; i++) {
        const brume_light_desc *desc = &scene->lights[i].desc;
        size_t count = desc->kind == BRUME_LIGHT_ENVMAP ? 3 * (size_t)desc->width * desc->height : 0;
        for (size_t k = 0; k < count; k++)
            most = fmax(most, (double)scene->lights[i].texels[k] * desc->scale);
    }
    return most;
}

void brume_arrays_choose_light_unit(const brume_scene *scene, brume_arrays *arrays) {
    int exponent = 0;
    frexp(brightest(scene), &exponent);
    arrays->light_unit = exponent > USUAL || exponent < -USUAL ? ldexp(1, exponent) : 1;
}

void brume_arrays_store_light(const brume_arrays *arrays, const float rgb[3], float out[3]) {
    for (int c = 0; c < 3; c++)
        out[c] = (float)(rgb[c] / arrays->light_unit);
}

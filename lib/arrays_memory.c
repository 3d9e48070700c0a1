/* arrays_memory.c -- room in the arrays, and what several of their builders sum up alike. */
#include "arrays_build.h"

#include <stdlib.h>
#include <string.h>

brume_result brume_arrays_alloc(const brume_scene *scene, const char *what, size_t count, size_t size,
                                void *out_pointer) {
    void *memory = NULL;
    if (count > INT32_MAX)
        return brume_fail(scene->context, BRUME_ERROR_MEMORY, "the scene has too many %s: %zu", what, count);
    if (count && !(memory = calloc(count, size)))
        return brume_fail(scene->context, BRUME_ERROR_MEMORY, "no memory for %zu %s", count, what);
    memcpy(out_pointer, &memory, sizeof memory);
    return BRUME_OK;
}

static brume_result more(const brume_scene *scene, const char *what, float **array, uint32_t *count, size_t extra,
                         size_t floats, uint32_t *out_first) {
    size_t total = *count + extra;
    /* Kernels index single floats by int. */
    if (total > INT32_MAX / floats)
        return brume_fail(scene->context, BRUME_ERROR_MEMORY, "the scene has too many %s: %zu", what, total);
    float *grown = realloc(*array, (total ? total : 1) * floats * sizeof(float));
    if (!grown)
        return brume_fail(scene->context, BRUME_ERROR_MEMORY, "no memory for %zu %s", total, what);
    *array = grown;
    *out_first = *count;
    *count = (uint32_t)total;
    return BRUME_OK;
}

brume_result brume_arrays_more_texels(const brume_scene *scene, brume_arrays *arrays, size_t count,
                                      uint32_t *out_first) {
    return more(scene, "texels", &arrays->texels, &arrays->texel_count, count, 3, out_first);
}

brume_result brume_arrays_more_cdf(const brume_scene *scene, brume_arrays *arrays, size_t count, uint32_t *out_first) {
    return more(scene, "table entries", &arrays->cdf, &arrays->cdf_count, count, 1, out_first);
}

double brume_luminance(const float rgb[3]) {
    return 0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2];
}

double brume_cumulate(const double *weights, size_t count, float *cdf) {
    double total = 0, sum = 0;
    for (size_t i = 0; i < count; i++)
        total += weights[i];
    cdf[0] = 0;
    for (size_t i = 0; i < count; i++) {
        sum += weights[i];
        /* The same additions in the same order: the last quotient is exactly 1. */
        cdf[i + 1] = (float)(total > 0 ? sum / total : (double)(i + 1) / (double)count);
    }
    return total;
}

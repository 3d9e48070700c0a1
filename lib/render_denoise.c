/* render_denoise.c -- a render's picture without its noise: what the denoiser is given of the film. */
#include <stdlib.h>

#include "denoise.h"
#include "render.h"

/* A channel of three, malloc'ed; NULL after a failure. */
static float *take(brume_render *render, brume_channel channel, brume_result *result) {
    size_t count = (size_t)render->layout.width * render->layout.height * 3;
    float *data = *result == BRUME_OK ? malloc(count * sizeof *data) : NULL;
    if (*result == BRUME_OK && !data)
        *result = brume_fail(render->device->context, BRUME_ERROR_MEMORY, "denoising: out of memory");
    if (data) *result = brume_render_read(render, channel, data, count);
    return data;
}

static brume_result check_denoise(const brume_render *render, brume_denoise kind) {
    brume_context *context = render->device->context;
    if (kind != BRUME_DENOISE_BEAUTY && kind != BRUME_DENOISE_LAYERS)
        return brume_fail(context, BRUME_ERROR_ARGUMENT, "denoising: unknown kind %d", (int)kind);
    if (!render->desc.guides)
        return brume_fail(context, BRUME_ERROR_ARGUMENT, "denoising: this render does not record guides");
    if (kind == BRUME_DENOISE_LAYERS && !render->desc.light_layers)
        return brume_fail(context, BRUME_ERROR_ARGUMENT, "denoising: this render does not record parts of the light");
    return BRUME_OK;
}

brume_result brume_render_denoise(brume_render *render, brume_denoise kind, float *out) {
    brume_context *context = render->device->context;
    uint32_t width = render->layout.width, height = render->layout.height;
    size_t count = (size_t)width * height * 3;
    brume_result result = check_denoise(render, kind);
    if (result != BRUME_OK) return result;
    int parts = kind == BRUME_DENOISE_LAYERS;
    float *albedo = take(render, BRUME_CHANNEL_ALBEDO, &result), *normal = take(render, BRUME_CHANNEL_NORMAL, &result);
    float *first = take(render, parts ? BRUME_CHANNEL_SURFACE : BRUME_CHANNEL_RADIANCE, &result);
    float *second = parts ? take(render, BRUME_CHANNEL_VOLUME, &result) : NULL;
    if (result == BRUME_OK) result = brume_denoise_picture(context, width, height, first, albedo, normal, out);
    if (parts && result == BRUME_OK)
        result = brume_denoise_picture(context, width, height, second, NULL, NULL, first);
    if (parts && result == BRUME_OK)
        for (size_t i = 0; i < count; i++) out[i] += first[i];
    free(albedo);
    free(normal);
    free(first);
    free(second);
    return result;
}

/* render_write.c -- a render as the source of picture files (picture.c). */
#include <string.h>

#include "picture.h"
#include "render.h"

void brume_render_world_to_ndc(const brume_render *render, float out[16]) {
    const float *m = render->world_to_camera;
    const b_params *p = &render->params;
    for (int c = 0; c < 4; c++) {
        out[c] = -m[c] / p->tan_x; /* the camera's x points to the left */
        out[4 + c] = m[4 + c] / p->tan_y;
        out[8 + c] = m[8 + c];
        out[12 + c] = m[8 + c];
    }
}

static brume_result read_render(void *of, brume_channel channel, float *out, size_t count) {
    return brume_render_read(of, channel, out, count);
}

static brume_result denoise_render(void *of, brume_denoise what, float *rgb) {
    return brume_render_denoise(of, what, rgb);
}

brume_result brume_render_write(brume_render *render, const char *path, const brume_picture_desc *desc) {
    if (!render) return BRUME_ERROR_ARGUMENT;
    brume_picture_source from = {.context = render->device->context, .recorded = brume_render_recorded(render),
                                 .alpha = render->film.alpha, .half = render->film.half,
                                 .sampler = (uint32_t)render->params.sampler, .device = render->device->info.name,
                                 .read = read_render, .denoise = denoise_render, .of = render};
    brume_render_get_stats(render, &from.stats);
    memcpy(from.world_to_camera, render->world_to_camera, sizeof from.world_to_camera);
    brume_render_world_to_ndc(render, from.world_to_ndc);
    return brume_picture_write(&from, "brume_render_write", path, desc);
}

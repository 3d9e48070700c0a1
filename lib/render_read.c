/* render_read.c -- a render's film by channels. */
#include "render.h"

#include <stdlib.h>

#include "channel.h"

uint32_t brume_render_recorded(const brume_render *render) {
    return render->desc.light_layers ? 2 : render->desc.guides != 0;
}

brume_result brume_render_read(brume_render *render, brume_channel channel, float *out, size_t count) {
    if (!render) return BRUME_ERROR_ARGUMENT;
    brume_context *context = render->device->context;
    size_t needed = (size_t)render->layout.width * render->layout.height * (size_t)brume_channel_size(channel);
    if (!out || needed == 0)
        return brume_fail(context, BRUME_ERROR_ARGUMENT, "brume_render_read: NULL, or no channel %d", (int)channel);
    if (count != needed)
        return brume_fail(context, BRUME_ERROR_ARGUMENT, "brume_render_read: room for %zu floats, expected %zu", count,
                          needed);
    if (!brume_channel_is_recorded(brume_render_recorded(render), channel))
        return brume_fail(context, BRUME_ERROR_ARGUMENT, "brume_render_read: this render does not record %s",
                          brume_channel_name(channel) ? brume_channel_name(channel) : "alpha");
    float *data = NULL, *counts = NULL;
    brume_result result =
        brume_render_read_planes(render, brume_film_plane_count(brume_render_recorded(render)), &data);
    if (result == BRUME_OK && channel == BRUME_CHANNEL_ERROR && render->error.known) {
        counts = malloc(needed / 3 * sizeof *counts);
        if (counts) brume_film_resolve(&render->layout, data, 1, BRUME_CHANNEL_SAMPLE_COUNT, counts);
        if (!counts || !brume_error_estimate_variance(&render->estimate, counts, out))
            result = brume_fail(context, BRUME_ERROR_MEMORY, "reading the film: out of memory");
    } else if (result == BRUME_OK && channel == BRUME_CHANNEL_BAD_SAMPLES) {
        result = brume_render_bad_channel(render, data, out);
    } else if (result == BRUME_OK) {
        if (channel == BRUME_CHANNEL_ERROR) channel = BRUME_CHANNEL_VARIANCE; /* all there is */
        brume_film_resolve(&render->layout, data, render->params.filter_weight, channel, out);
    }
    if (result == BRUME_OK) brume_film_to_scene_light(render->light_unit, channel, out, count);
    free(data);
    free(counts);
    return result;
}

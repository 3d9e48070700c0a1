/* render_bad.c -- samples that came out NaN or infinite (cl/path.cl drops and counts them): how many, and where. */
#include <stdlib.h>

#include "render.h"

brume_result brume_render_count_bad(brume_render *r) {
    brume_context *context = r->device->context;
    brume_render_stats *s = &r->stats;
    cl_uint bad[BAD_SIZE];
    cl_int code = clEnqueueReadBuffer(r->device->queue, r->bad, CL_TRUE, 0, sizeof bad, bad, 0, NULL, NULL);
    if (code != CL_SUCCESS) return brume_fail_cl(context, code, "reading the count of bad samples");
    s->bad_samples = bad[BAD_COUNT];
    if (s->bad_samples == 0) return BRUME_OK;
    s->bad_pixel_x = bad[BAD_PIXEL] % s->full_width;
    s->bad_pixel_y = bad[BAD_PIXEL] / s->full_width;
    s->bad_sample = bad[BAD_SAMPLE];
    if (r->trace) return BRUME_OK; /* which tells it itself */
    brume_warn(context,
               "%llu samples came out NaN or infinite and were dropped, one at pixel %u, %u sample %u: please report "
               "this", (unsigned long long)s->bad_samples, s->bad_pixel_x, s->bad_pixel_y, s->bad_sample);
    return BRUME_OK;
}

/* Whether the pixel gets samples in the pass under way. */
static int takes_part(const brume_render *r, size_t pixel) {
    return !r->ends || (r->done[pixel] == r->samples_done && r->ends[pixel] > r->done[pixel]);
}

/* Sets entries of tiles that the pass under way has been through. */
static void mark_passed(const brume_render *r, unsigned char *passed) {
    const brume_film_layout *l = &r->layout;
    size_t lanes = (size_t)l->tile_width * l->tile_height;
    uint32_t left = r->groups_done;
    for (uint32_t y = 0; y < l->height; y++)
        for (uint32_t x = 0; x < l->width; x++)
            if (takes_part(r, (size_t)y * l->width + x)) passed[brume_film_slot_of(l, x, y) / lanes] = 1;
    for (uint32_t group = 0; group < l->group_count; group++) {
        if (passed[group] && left > 0)
            left--;
        else
            passed[group] = 0;
    }
}

/* No counter is needed on the device: it is what the film has of a pixel against what was rendered of it. */
brume_result brume_render_bad_channel(const brume_render *r, const float *planes, float *out) {
    const brume_film_layout *l = &r->layout;
    size_t slots = brume_film_slot_count(l), lanes = (size_t)l->tile_width * l->tile_height;
    unsigned char *passed = calloc(l->group_count, 1);
    if (!passed) return brume_fail(r->device->context, BRUME_ERROR_MEMORY, "reading the film: out of memory");
    mark_passed(r, passed);
    for (uint32_t y = 0; y < l->height; y++)
        for (uint32_t x = 0; x < l->width; x++) {
            size_t i = (size_t)y * l->width + x, slot = brume_film_slot_of(l, x, y);
            uint32_t samples = r->ends ? r->done[i] : r->samples_done;
            if (passed[slot / lanes] && takes_part(r, i)) samples += r->pass_samples;
            out[i] = (float)((double)samples - planes[FILM_COUNT * slots + slot]);
        }
    free(passed);
    return BRUME_OK;
}

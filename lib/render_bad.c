/* render_bad.c -- samples that came out NaN or infinite (cl/path.cl drops and counts them): how many, and where. */
#include <stdlib.h>

#include "render.h"

brume_result brume_render_count_bad(brume_render *r) {
    brume_context *context = r->device->context;
    brume_render_stats *s = &r->stats;
    cl_uint bad[BAD_SIZE];
    cl_int code = brume_render_get(r, BRUME_FILM_BAD, 0, sizeof bad, bad);
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

/* Sets the slots that the pass under way has been through. Of a launch in doubt those that have got samples are
 * certain, and the others count as still to come. */
static brume_result mark_passed(brume_render *r, const float *counts, unsigned char *passed) {
    size_t lanes = brume_film_slot_count(&r->layout) / r->layout.group_count, size;
    size_t sure = r->pass.groups_done * lanes, end = sure + r->pass.doubtful * lanes;
    cl_int *schedule = r->ends ? brume_render_make_schedule(r, &size) : NULL;
    if (r->ends && !schedule)
        return brume_fail(r->device->context, BRUME_ERROR_MEMORY, "reading the film: out of memory");
    for (size_t i = 0; i < end; i++) {
        if (schedule && schedule[i] < 0) continue;
        size_t slot = schedule ? (size_t)schedule[i] : i;
        passed[slot] = i < sure || counts[slot] > brume_render_count_before(r, slot);
    }
    free(schedule);
    return BRUME_OK;
}

/* No counter is needed on the device: it is what the film has of a pixel against what was rendered of it. */
brume_result brume_render_bad_channel(brume_render *r, const float *planes, float *out) {
    const brume_film_layout *l = &r->layout;
    size_t slots = brume_film_slot_count(l);
    const float *counts = planes + FILM_COUNT * slots;
    unsigned char *passed = calloc(slots, 1);
    if (!passed) return brume_fail(r->device->context, BRUME_ERROR_MEMORY, "reading the film: out of memory");
    brume_result result = r->pass.samples ? mark_passed(r, counts, passed) : BRUME_OK;
    for (uint32_t y = 0; y < l->height; y++)
        for (uint32_t x = 0; x < l->width; x++) {
            size_t i = (size_t)y * l->width + x, slot = brume_film_slot_of(l, x, y);
            uint32_t samples = (r->ends ? r->done[i] : r->samples_done) + (passed[slot] ? r->pass.samples : 0);
            out[i] = (float)((double)samples - counts[slot]);
        }
    free(passed);
    return result;
}

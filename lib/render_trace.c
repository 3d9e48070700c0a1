/* render_trace.c -- one sample of a picture rendered again, by a program that writes its path down (cl/trace.h). */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "render.h"

/* Fits brume_trace_vertex.event. */
typedef char events_match[(int)BRUME_TRACE_ESCAPED == TRACE_ESCAPED && (int)BRUME_TRACE_SCATTERED == TRACE_SCATTERED &&
                          (int)BRUME_TRACE_SURFACE == TRACE_SURFACE && (int)BRUME_TRACE_PASSED == TRACE_PASSED &&
                          (int)BRUME_TRACE_ABSORBED == TRACE_ABSORBED ? 1 : -1];

/* What a stage added to a sum. */
static void difference(const float before[3], const float after[3], float out[3]) {
    for (int c = 0; c < 3; c++) out[c] = (float)((double)after[c] - before[c]);
}

static void convert(const b_trace_vertex *from, const double origin[3], const float sum[3], brume_trace_vertex *to) {
    for (int c = 0; c < 3; c++) to->position[c] = origin[c] + from->position[c];
    memcpy(to->direction, from->direction, sizeof to->direction);
    to->length = from->length;
    to->event = (brume_trace_event)from->event;
    to->medium = (uint32_t)from->medium;
    to->shape = (uint32_t)from->shape;
    to->pdf = from->pdf;
    memcpy(to->throughput_before, from->before, sizeof to->throughput_before);
    memcpy(to->throughput_after, from->after, sizeof to->throughput_after);
    difference(sum, from->radiance[TRACE_ALONG], to->along);
    difference(from->radiance[TRACE_ALONG], from->radiance[TRACE_MET], to->met);
    difference(from->radiance[TRACE_MET], from->radiance[TRACE_LIT], to->lit);
    memcpy(to->radiance, from->radiance[TRACE_LIT], sizeof to->radiance);
    to->ends = (uint32_t)from->ends;
}

static brume_result read_trace(brume_render *r, brume_trace *out) {
    brume_context *context = r->device->context;
    b_trace_vertex *vertices = malloc(TRACE_ROOM * sizeof *vertices);
    brume_trace trace = {0};
    brume_result result = BRUME_OK;
    if (!vertices) return brume_fail(context, BRUME_ERROR_MEMORY, "tracing a sample: out of memory");
    size_t size = TRACE_ROOM * sizeof *vertices;
    cl_int code = clEnqueueReadBuffer(r->device->queue, r->trace, CL_TRUE, 0, size, vertices, 0, NULL, NULL);
    if (code != CL_SUCCESS) result = brume_fail_cl(context, code, "reading a traced path");
    if (result == BRUME_OK)
        while (trace.count < TRACE_ROOM && vertices[trace.count].event != TRACE_NOTHING) trace.count++;
    trace.vertices = calloc(trace.count + 1, sizeof *trace.vertices);
    if (result == BRUME_OK && !trace.vertices)
        result = brume_fail(context, BRUME_ERROR_MEMORY, "tracing a sample: out of memory");
    if (result == BRUME_OK) result = brume_render_read(r, BRUME_CHANNEL_RADIANCE, trace.radiance, 3);
    if (result != BRUME_OK) {
        free(trace.vertices);
        free(vertices);
        return result;
    }
    const float nothing[3] = {0, 0, 0};
    for (size_t i = 0; i < trace.count; i++) {
        float *light = &vertices[i].radiance[0][0];
        for (int k = 0; k < 3 * TRACE_STAGES; k++) light[k] = (float)(light[k] * r->light_unit);
    }
    for (size_t i = 0; i < trace.count; i++)
        convert(&vertices[i], r->origin, i ? vertices[i - 1].radiance[TRACE_LIT] : nothing, &trace.vertices[i]);
    free(vertices);
    trace.bad = r->stats.bad_samples != 0;
    *out = trace;
    return BRUME_OK;
}

brume_result brume_sample_trace(brume_device *device, const brume_scene *scene, const brume_render_desc *given,
                                uint32_t x, uint32_t y, uint32_t sample, brume_trace *out) {
    if (!device) return BRUME_ERROR_ARGUMENT;
    if (!scene || !out) return brume_fail(device->context, BRUME_ERROR_ARGUMENT, "brume_sample_trace: NULL argument");
    if (x >= scene->film.width || y >= scene->film.height)
        return brume_fail(device->context, BRUME_ERROR_ARGUMENT,
                          "brume_sample_trace: pixel %u, %u lies outside the film of %u x %u", x, y, scene->film.width,
                          scene->film.height);
    brume_render_desc desc = given ? *given : brume_render_desc_default();
    desc.lanes = 1;
    desc.sample_count = 1;
    desc.first_sample = sample;
    desc.use_crop = 1;
    desc.crop_x = x;
    desc.crop_y = y;
    desc.crop_width = desc.crop_height = 1;
    desc.noise_threshold = desc.time_limit = 0;
    desc.adaptive = BRUME_ADAPTIVE_OFF;
    desc.error_estimate = 0;
    desc.quick_start = 0;
    brume_render *render;
    BRUME_TRY(brume_render_make(device, scene, &desc, 1, &render));
    if (given) render->replays_chosen = brume_goal_may_choose(given, sample - given->first_sample);
    brume_result result = brume_render_run(render, NULL, NULL);
    if (result == BRUME_OK) result = read_trace(render, out);
    brume_render_destroy(render);
    return result;
}

void brume_trace_free(brume_trace *trace) {
    if (!trace) return;
    free(trace->vertices);
    memset(trace, 0, sizeof *trace);
}

/* render_launch.c -- the launches of a render's kernel, and its film read back. */
#include <stdlib.h>

#include "checkpoint_state.h"
#include "render.h"

/* PoCL has other code for grids of 65535 and wider, and would generate it in the middle of the render. */
#define WIDEST_GRID ((size_t)32768)

static cl_int launch(brume_render *render, cl_kernel kernel, size_t at, size_t end, uint32_t first, uint32_t samples,
                     cl_uint mode) {
    size_t local = render->local_size, most = render->device->info.is_gpu ? end : WIDEST_GRID;
    cl_int code = CL_SUCCESS;
    for (; at < end && code == CL_SUCCESS; at += most) {
        size_t count = end - at < most ? end - at : most, global = (count + local - 1) / local * local;
        cl_uint values[5] = {(cl_uint)at, (cl_uint)(at + count), first, samples, mode};
        for (cl_uint i = 0; i < 5 && code == CL_SUCCESS; i++)
            code = clSetKernelArg(kernel, BRUME_KERNEL_BUFFERS + i, sizeof(cl_uint), &values[i]);
        if (code == CL_SUCCESS)
            code = clEnqueueNDRangeKernel(render->device->queue, kernel, 1, NULL, &global, &local, 0, NULL, NULL);
    }
    cl_int finished = clFinish(render->device->queue);
    return code == CL_SUCCESS ? finished : code;
}

cl_int brume_render_launch(brume_render *render, uint32_t group, uint32_t groups, uint32_t first, uint32_t samples,
                           cl_uint mode) {
    if (render->crew) return brume_crew_launch(render, group, groups, first, samples, mode);
    cl_kernel kernel = brume_render_program_begin_launch(render);
    size_t narrow = render->stats.lanes / render->program.lanes; /* groups of a narrower program in one of ours */
    cl_int code = launch(render, kernel, group * narrow, (group + (size_t)groups) * narrow, first, samples, mode);
    brume_render_program_end_launch(render);
    return code;
}

cl_int brume_render_launch_units(brume_render *render, size_t unit, size_t units, uint32_t first, uint32_t samples,
                                 cl_uint mode) {
    if (render->crew) return brume_crew_launch(render, (uint32_t)unit, (uint32_t)units, first, samples, mode);
    cl_kernel kernel = brume_render_program_begin_launch(render);
    cl_int code = launch(render, kernel, unit, unit + units, first, samples, mode);
    brume_render_program_end_launch(render);
    return code;
}

cl_int *brume_render_make_schedule(brume_render *r, size_t *size) {
    cl_int *schedule = brume_schedule_make(&r->layout, r->done, r->ends, r->samples_done, size);
    if (schedule) r->pass.groups = (uint32_t)(*size / (r->stats.lanes * sizeof *schedule));
    return schedule;
}

cl_uint brume_render_chosen(const brume_render *r) { return r->ends || r->replays_chosen ? LAUNCH_CHOSEN : 0; }

brume_result brume_render_read_planes(brume_render *render, size_t planes, float **out) {
    brume_context *context = render->device->context;
    size_t size = planes * brume_film_slot_count(&render->layout) * sizeof(float);
    float *data = malloc(size);
    if (!data) return brume_fail(context, BRUME_ERROR_MEMORY, "reading the film: out of memory");
    cl_int code = brume_render_get(render, BRUME_FILM_PLANES, 0, size, data);
    if (code != CL_SUCCESS) {
        free(data);
        return brume_fail_cl(context, code, "reading the film");
    }
    *out = data;
    return BRUME_OK;
}

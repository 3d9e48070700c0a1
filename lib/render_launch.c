/* render_launch.c -- a render's film on the device, and the launches of its kernel. */
#include <stdlib.h>

#include "render.h"

/* A zeroed buffer of `size` bytes. */
static cl_int create_buffer(brume_render *render, size_t size, cl_mem *out) {
    cl_int code;
    cl_uchar zero = 0;
    cl_mem buffer = clCreateBuffer(render->device->cl, CL_MEM_READ_WRITE, size, NULL, &code);
    if (code != CL_SUCCESS) return code;
    *out = buffer;
    render->stats.device_bytes += size;
    return clEnqueueFillBuffer(render->device->queue, buffer, &zero, 1, 0, size, 0, NULL, NULL);
}

brume_result brume_render_create_film(brume_render *render) {
    brume_device *device = render->device;
    size_t slots = brume_film_slot_count(&render->layout);
    size_t planes = render->desc.guides ? FILM_GUIDE_PLANES : FILM_PLANES;
    cl_int code = create_buffer(render, planes * slots * sizeof(float), &render->planes);
    if (code == CL_SUCCESS) code = create_buffer(render, BAD_SIZE * sizeof(cl_uint), &render->bad);
    /* Nobody looks at the plan without a pilot, nor at the schedule while all pixels are alike. */
    if (code == CL_SUCCESS) code = create_buffer(render, render->needs_pilot ? EVERY_LAMP * slots : 1, &render->plan);
    size_t schedule = brume_goal_exists(render) ? render->layout.group_count + slots : 1;
    if (code == CL_SUCCESS) code = create_buffer(render, schedule * sizeof(cl_int), &render->schedule);
    if (code == CL_SUCCESS) code = clFinish(device->queue);
    return code == CL_SUCCESS ? BRUME_OK : brume_fail_cl(device->context, code, "creating the film");
}

/* PoCL has other code for grids of 65535 and wider, and would generate it in the middle of the render. */
#define WIDEST_GRID ((size_t)32768)

cl_int brume_render_launch(brume_render *render, uint32_t group, uint32_t groups, uint32_t first, uint32_t samples,
                           cl_uint mode) {
    cl_kernel kernel = brume_render_program_begin_launch(render);
    size_t narrow = render->stats.lanes / render->program.lanes; /* groups of a narrower program in one of ours */
    size_t at = group * narrow, end = (group + (size_t)groups) * narrow, local = render->local_size;
    size_t most = render->device->info.is_gpu ? end : WIDEST_GRID;
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
    brume_render_program_end_launch(render);
    return code == CL_SUCCESS ? finished : code;
}

brume_result brume_render_read_planes(brume_render *render, size_t planes, float **out) {
    brume_context *context = render->device->context;
    size_t size = planes * brume_film_slot_count(&render->layout) * sizeof(float);
    float *data = malloc(size);
    if (!data) return brume_fail(context, BRUME_ERROR_MEMORY, "reading the film: out of memory");
    cl_int code = clEnqueueReadBuffer(render->device->queue, render->planes, CL_TRUE, 0, size, data, 0, NULL, NULL);
    if (code != CL_SUCCESS) {
        free(data);
        return brume_fail_cl(context, code, "reading the film");
    }
    *out = data;
    return BRUME_OK;
}

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

cl_int brume_render_launch(brume_render *render, uint32_t group, uint32_t groups, uint32_t first, uint32_t samples,
                           cl_uint mode) {
    cl_uint values[5] = {group, group + groups, first, samples, mode};
    cl_int code = CL_SUCCESS;
    for (cl_uint i = 0; i < 5 && code == CL_SUCCESS; i++)
        code = clSetKernelArg(render->kernel, BRUME_SCENE_BUFFERS + 4 + i, sizeof(cl_uint), &values[i]);
    size_t local = render->local_size;
    size_t global = (groups + local - 1) / local * local;
    if (code == CL_SUCCESS)
        code = clEnqueueNDRangeKernel(render->device->queue, render->kernel, 1, NULL, &global, &local, 0, NULL, NULL);
    if (code == CL_SUCCESS) code = clFinish(render->device->queue);
    return code;
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

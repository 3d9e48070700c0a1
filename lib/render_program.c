/* render_program.c -- see render_program.h.
 *
 * With PoCL 3.1 the narrow program renders while the front end is busy with the wide one, but waits while machine code
 * is generated at the first launch, about a second: a lock of the driver's is held all that time.
 */
#include "render_program.h"

#include <stdio.h>
#include <string.h>
#include <stdlib.h>

#include "platform.h"
#include "program_cache.h"
#include "render.h"

/* Of all widths the quickest to compile: 1.5 seconds, half a second of which any program costs, where the others take
 * 1.8 to 2. It renders two to three times as slowly as 16. */
enum { QUICK_LANES = 1 };

enum { WIDE_PENDING = 0, WIDE_READY = 1, WIDE_FAILED = 2 };

/* Held for reading around launches, for writing while a binary is taken out of the driver. PoCL 3.1 aborts the process
 * if a launch of the same program, another render's perhaps, ends meanwhile: to look for the code that the launch may
 * now let go it goes by the work-group size alone, and finds what it generated for the binary. */
static brume_lock launching = BRUME_LOCK_INIT;

static int state_of(brume_render_program *p) { return __atomic_load_n(&p->state, __ATOMIC_ACQUIRE); }

/* The kernel with its buffers set. */
static cl_int make_kernel(const brume_render_program *p, cl_program program, cl_kernel *out) {
    cl_int code;
    cl_kernel kernel = clCreateKernel(program, "render_paths", &code);
    for (cl_uint i = 0; i < BRUME_KERNEL_BUFFERS && code == CL_SUCCESS; i++)
        code = clSetKernelArg(kernel, i, sizeof(cl_mem), &p->arguments[i]);
    if (code == CL_SUCCESS && p->trace)
        code = clSetKernelArg(kernel, BRUME_KERNEL_BUFFERS + 5, sizeof(cl_mem), &p->trace);
    if (code == CL_SUCCESS)
        *out = kernel;
    else if (kernel)
        clReleaseKernel(kernel);
    return code;
}

/* One launch without samples, after which nothing is left to be compiled. */
static cl_int warm_up(cl_command_queue queue, cl_kernel kernel, size_t local) {
    const cl_uint values[5] = {0, 1, 0, 0, 0};
    cl_int code = CL_SUCCESS;
    for (cl_uint i = 0; i < 5 && code == CL_SUCCESS; i++)
        code = clSetKernelArg(kernel, BRUME_KERNEL_BUFFERS + i, sizeof values[i], &values[i]);
    brume_lock_shared(&launching);
    if (code == CL_SUCCESS) code = clEnqueueNDRangeKernel(queue, kernel, 1, NULL, &local, &local, 0, NULL, NULL);
    if (code == CL_SUCCESS) code = clFinish(queue);
    brume_unlock_shared(&launching);
    return code;
}

/* The program built, or as given, and its kernel ready to run. On failure nothing is kept. */
static brume_result prepare(const brume_render_program *p, brume_device *device, const brume_program_source *source,
                            cl_command_queue queue, size_t local, cl_program given, cl_program *program,
                            cl_kernel *kernel) {
    cl_program built = given;
    cl_kernel made = NULL;
    if (!built) BRUME_TRY(brume_program_compile(device, source, &built));
    cl_int code = make_kernel(p, built, &made);
    if (code == CL_SUCCESS) code = warm_up(queue, made, local);
    if (code != CL_SUCCESS) {
        if (made) clReleaseKernel(made);
        clReleaseProgram(built);
        return brume_fail_cl(device->context, code, "preparing the kernel");
    }
    *program = built;
    *kernel = made;
    return BRUME_OK;
}

/* ---- the thread ------------------------------------------------------------------------------------------------ */

static int build_wide(brume_render_program *p) {
    cl_int code;
    cl_command_queue queue = clCreateCommandQueue(p->device.cl, p->device.id, 0, &code);
    if (code != CL_SUCCESS) {
        brume_fail_cl(p->device.context, code, "creating a queue");
        return WIDE_FAILED;
    }
    /* One lane is for GPUs, which have no quick start: the local size of wide programs is 1. */
    brume_result result = prepare(p, &p->device, &p->source, queue, 1, NULL, &p->wide, &p->wide_kernel);
    clReleaseCommandQueue(queue);
    return result == BRUME_OK ? WIDE_READY : WIDE_FAILED;
}

static void work(void *argument) {
    brume_render_program *p = argument;
    __atomic_store_n(&p->state, build_wide(p), __ATOMIC_RELEASE);
}

/* Returns whether it runs. */
static int start_thread(brume_render_program *p, const brume_device *device) {
    p->device = *device;
    if (brume_context_create(&p->device.context) != BRUME_OK) {
        p->device.context = NULL;
        return 0;
    }
    p->thread = brume_thread_start(work, p);
    return p->thread != NULL;
}

/* ---- the render's side ----------------------------------------------------------------------------------------- */

static brume_result make_source(brume_render *render, uint32_t features, uint32_t stack_size, uint32_t lanes,
                                brume_program_source *out) {
    char options[220];
    /* The stack in steps, so that most scenes find each other's programs in the cache. */
    snprintf(options, sizeof options,
             "-DFEATURES=%u -DBVH_STACK=%u -DLOCAL_SIZE=%u -DSTRATEGY=%d -DINDIRECT=%d -DLAYOUT_LANES=%u%s%s",
             features, (stack_size + 15) / 16 * 16, (unsigned)render->local_size, (int)render->desc.strategy,
             (int)render->desc.indirect, render->stats.lanes, lanes < render->own_lanes ? " -DQUICK" : "",
             render->trace ? " -DTRACE" : "");
    return brume_program_source_make(render->device, "path.cl", lanes, render->desc.precision, options, out);
}

/* From the cache. Returns whether. */
static int open_cached(brume_render *render) {
    brume_render_program *p = &render->program;
    uint64_t bytes = 0;
    cl_program program =
        p->folder ? brume_program_cache_open(render->device, p->folder, &p->source, &bytes) : NULL;
    /* Not with the render's own device: what goes wrong with a binary is not to be anyone's last error message. */
    brume_device quiet = *render->device;
    quiet.context = NULL;
    if (!program || prepare(p, &quiet, &p->source, quiet.queue, render->local_size, program, &p->program, &p->kernel))
        return 0;
    free(p->folder);
    p->folder = NULL;
    render->stats.program_cached = 1;
    render->stats.program_bytes = bytes;
    return 1;
}

/* Of the program that runs; 0 where the driver doesn't say. */
static uint64_t size_of(cl_program program) {
    size_t size = 0; /* of one device's binary */
    brume_lock_exclusive(&launching);
    cl_int code = clGetProgramInfo(program, CL_PROGRAM_BINARY_SIZES, sizeof size, &size, NULL);
    brume_unlock_exclusive(&launching);
    return code == CL_SUCCESS ? size : 0;
}

/* A narrow program from source. */
static brume_result start_quickly(brume_render *render, uint32_t features, uint32_t stack_size) {
    brume_render_program *p = &render->program;
    brume_program_source narrow;
    BRUME_TRY(make_source(render, features, stack_size, QUICK_LANES, &narrow));
    brume_result result = prepare(p, render->device, &narrow, render->device->queue, render->local_size, NULL,
                                  &p->program, &p->kernel);
    brume_program_source_free(&narrow);
    if (result != BRUME_OK) return result;
    p->lanes = render->stats.quick_lanes = QUICK_LANES;
    p->is_quick = 1;
    return BRUME_OK;
}

void brume_render_program_go_on(brume_render *render) {
    brume_render_program *p = &render->program;
    if (p->is_quick) p->awaited = start_thread(p, render->device); /* else the narrow one does it all */
}

brume_result brume_render_program_start(brume_render *render, uint32_t features, uint32_t stack_size) {
    brume_render_program *p = &render->program;
    p->start = brume_seconds();
    p->lanes = render->own_lanes;
    memcpy(p->arguments, render->buffers, sizeof render->buffers);
    p->arguments[BRUME_SCENE_BUFFERS] = render->planes;
    p->arguments[BRUME_SCENE_BUFFERS + 1] = render->bad;
    p->arguments[BRUME_SCENE_BUFFERS + 2] = render->plan;
    p->arguments[BRUME_SCENE_BUFFERS + 3] = render->schedule;
    p->trace = render->trace;
    BRUME_TRY(make_source(render, features, stack_size, render->own_lanes, &p->source));
    p->folder = brume_program_cache_folder();
    if (open_cached(render)) return BRUME_OK;
    if (render->desc.quick_start && !render->desc.program_size && render->desc.lanes == 0 &&
        render->own_lanes > QUICK_LANES)
        return start_quickly(render, features, stack_size);
    BRUME_TRY(prepare(p, render->device, &p->source, render->device->queue, render->local_size, NULL, &p->program,
                      &p->kernel));
    if (render->desc.program_size) render->stats.program_bytes = size_of(p->program);
    return BRUME_OK;
}

static void swap(brume_render *render) {
    brume_render_program *p = &render->program;
    clReleaseKernel(p->kernel);
    clReleaseProgram(p->program);
    p->kernel = p->wide_kernel;
    p->program = p->wide;
    p->wide_kernel = NULL;
    p->wide = NULL;
    p->lanes = render->own_lanes;
    render->stats.swap_seconds = brume_seconds() - p->start;
    render->stats.swapped_at_sample = render->samples_done;
    brume_info(render->device->context, "The program of %u lanes takes over", p->lanes);
}

static void look_for_wide(brume_render *render) {
    brume_render_program *p = &render->program;
    if (p->swap_at && p->launches < p->swap_at) return;
    while (p->swap_at && state_of(p) == WIDE_PENDING) brume_sleep(0.001);
    int state = state_of(p);
    if (state == WIDE_PENDING) return;
    p->awaited = 0;
    if (state == WIDE_READY)
        swap(render);
    else
        brume_warn(render->device->context, "%u lanes go on, as the program of %u failed: %s", p->lanes,
                   render->own_lanes, brume_context_message(p->device.context));
}

cl_kernel brume_render_program_begin_launch(brume_render *render) {
    brume_render_program *p = &render->program;
    p->launches++;
    if (p->awaited && !render->pass.doubtful) look_for_wide(render); /* what is in doubt is counted in its work-items */
    brume_lock_shared(&launching);
    return p->kernel;
}

void brume_render_program_end_launch(brume_render *render) {
    (void)render;
    brume_unlock_shared(&launching);
}

/* Late, because it costs PoCL a second, and at no other time is it certain that the driver has nothing else to do. Who
 * did not want the whole picture does not want to wait for this. */
static void keep(brume_render *render) {
    brume_render_program *p = &render->program;
    cl_program program = p->wide ? p->wide : p->lanes == render->own_lanes ? p->program : NULL;
    if (!p->folder || !program || !render->stats.complete) return;
    brume_lock_exclusive(&launching);
    brume_program_cache_keep(render->device, p->folder, &p->source, program);
    brume_unlock_exclusive(&launching);
}

void brume_render_program_destroy(brume_render *render) {
    brume_render_program *p = &render->program;
    brume_thread_join(p->thread);
    keep(render);
    if (p->wide_kernel) clReleaseKernel(p->wide_kernel);
    if (p->wide) clReleaseProgram(p->wide);
    if (p->kernel) clReleaseKernel(p->kernel);
    if (p->program) clReleaseProgram(p->program);
    if (p->device.context) brume_context_destroy(p->device.context);
    brume_program_source_free(&p->source);
    free(p->folder);
}

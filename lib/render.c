/* render.c -- a render: upload, kernel, launches, progress.
 *
 * Work is cut into passes over the film of a few samples each, and a pass into launches sized by time, so that
 * progress, cancelling and GPU watchdogs work. How it is cut never changes the film (cl/film.h).
 */
#include "render.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "clock.h"
#include "effects.h"
#include "program.h"
#include "strategy.h"

#define LAUNCH_SECONDS 0.05
enum {
    MAX_PASS_SAMPLES = 16, /* enough for lanes to take turns, few enough for a picture that fills evenly */
    GPU_LOCAL_SIZE = 64,
    RENDER_COOKIE = 0x62720001,
    /* On a segment, unless asked for: more cost more than they gain (measured by make ladder). */
    SYSTEMATIC_POSITIONS = 4,
    RASTER_POSITIONS = 64,
    AUTO_POSITIONS = 16
};

brume_render_desc brume_render_desc_default(void) {
    brume_render_desc desc;
    memset(&desc, 0, sizeof desc);
    desc.cookie = RENDER_COOKIE;
    desc.precision = BRUME_PRECISION_FLOAT;
    desc.guides = 1;
    return desc;
}

static brume_result check_desc(brume_context *context, const brume_device *device, const brume_scene *scene,
                               const brume_render_desc *desc) {
    if (desc->cookie != RENDER_COOKIE)
        return brume_fail(context, BRUME_ERROR_ARGUMENT,
                          "brume_render_create: the descriptor does not come from brume_render_desc_default()");
    if (desc->lanes != 0 && desc->lanes != 1 && desc->lanes != 4 && desc->lanes != 8 && desc->lanes != 16)
        return brume_fail(context, BRUME_ERROR_ARGUMENT, "brume_render_create: lanes is %u; expected 0, 1, 4, 8 or 16",
                          desc->lanes);
    if (desc->precision != BRUME_PRECISION_FLOAT && desc->precision != BRUME_PRECISION_DOUBLE)
        return brume_fail(context, BRUME_ERROR_ARGUMENT, "brume_render_create: unknown precision %d",
                          (int)desc->precision);
    if (desc->precision == BRUME_PRECISION_DOUBLE && !device->info.has_double)
        return brume_fail(context, BRUME_ERROR_DEVICE, "%s has no double precision", device->info.name);
    uint32_t count = desc->sample_count ? desc->sample_count : scene->integrator.sample_count;
    if (count > UINT32_MAX - desc->first_sample)
        return brume_fail(context, BRUME_ERROR_ARGUMENT, "brume_render_create: sample %u + %u is beyond 2^32",
                          desc->first_sample, count);
    if (desc->use_strategy && !brume_strategy_name(desc->strategy))
        return brume_fail(context, BRUME_ERROR_ARGUMENT, "brume_render_create: unknown strategy %d",
                          (int)desc->strategy);
    if (desc->use_strategy && !brume_positions_valid(desc->positions))
        return brume_fail(context, BRUME_ERROR_ARGUMENT,
                          "brume_render_create: positions is %u; expected a power of two up to 64, or 0",
                          desc->positions);
    if (desc->use_indirect && !brume_indirect_name(desc->indirect))
        return brume_fail(context, BRUME_ERROR_ARGUMENT, "brume_render_create: unknown indirect %d",
                          (int)desc->indirect);
    if (scene->context != context)
        return brume_fail(context, BRUME_ERROR_ARGUMENT, "brume_render_create: the scene is another context's");
    if (!scene->has_sensor) return brume_fail(context, BRUME_ERROR_SCENE, "the scene has no sensor");
    return BRUME_OK;
}

/* A read-only buffer with a copy of `size` bytes; at least one struct's worth, because OpenCL has no empty buffers. */
static brume_result upload(brume_render *render, int index, const void *data, size_t size) {
    static const char nothing[256];
    if (size == 0) {
        data = nothing;
        size = sizeof nothing;
    }
    cl_int code;
    render->buffers[index] =
        clCreateBuffer(render->device->cl, CL_MEM_READ_ONLY | CL_MEM_COPY_HOST_PTR, size, (void *)(size_t)data, &code);
    if (code != CL_SUCCESS) return brume_fail_cl(render->device->context, code, "uploading the scene");
    render->stats.device_bytes += size;
    return BRUME_OK;
}

/* In the order of SCENE_PARAMETERS in cl/scene.h. */
static brume_result upload_arrays(brume_render *render, const brume_arrays *a) {
    const struct { const void *data; size_t size; } arrays[BRUME_SCENE_BUFFERS] = {
        {&a->params, sizeof a->params},
        {a->bvh.nodes, a->bvh.node_count * sizeof *a->bvh.nodes},
        {a->bvh.blocks, a->bvh.block_count * sizeof *a->bvh.blocks},
        {a->bvh.quadric_ids, a->bvh.quadric_block_count * 8 * sizeof *a->bvh.quadric_ids},
        {a->quadrics, (size_t)a->params.quadric_count * sizeof *a->quadrics},
        {a->triangles, (size_t)a->params.triangle_count * sizeof *a->triangles},
        {a->positions, (size_t)a->position_count * 3 * sizeof(float)},
        {a->normals, (size_t)a->normal_count * 3 * sizeof(float)},
        {a->uvs, (size_t)a->uv_count * 2 * sizeof(float)},
        {a->shapes, a->shape_count * sizeof *a->shapes},
        {a->bsdfs, a->bsdf_count * sizeof *a->bsdfs},
        {a->textures, a->texture_count * sizeof *a->textures},
        {a->texels, (size_t)a->texel_count * 3 * sizeof(float)},
        {a->media, a->medium_count * sizeof *a->media},
        {a->lights, a->light_count * sizeof *a->lights},
        {a->emitters, a->emitter_count * sizeof *a->emitters},
        {a->cdf, a->cdf_count * sizeof(float)},
        {a->filter, a->filter_count * sizeof(float)},
        {a->light_tree.blocks, a->light_tree.block_count * sizeof *a->light_tree.blocks},
    };
    for (int i = 0; i < BRUME_SCENE_BUFFERS; i++) {
        brume_result result = upload(render, i, arrays[i].data, arrays[i].size);
        if (result != BRUME_OK) return result;
    }
    return BRUME_OK;
}

static brume_result create_film(brume_render *render) {
    brume_device *device = render->device;
    size_t planes = render->desc.guides ? FILM_GUIDE_PLANES : FILM_PLANES;
    size_t size = planes * brume_film_slot_count(&render->layout) * sizeof(float);
    cl_int code;
    cl_uint zero = 0;
    render->planes = clCreateBuffer(device->cl, CL_MEM_READ_WRITE, size, NULL, &code);
    if (code == CL_SUCCESS) code = clEnqueueFillBuffer(device->queue, render->planes, &zero, 4, 0, size, 0, NULL, NULL);
    if (code == CL_SUCCESS)
        render->bad = clCreateBuffer(device->cl, CL_MEM_READ_WRITE, BAD_SIZE * sizeof(cl_uint), NULL, &code);
    if (code == CL_SUCCESS)
        code = clEnqueueFillBuffer(device->queue, render->bad, &zero, 4, 0, BAD_SIZE * sizeof(cl_uint), 0, NULL, NULL);
    if (code == CL_SUCCESS) code = clFinish(device->queue);
    if (code != CL_SUCCESS) return brume_fail_cl(device->context, code, "creating the film");
    render->stats.device_bytes += size;
    /* Without a pilot nobody looks at the plan. */
    size = render->needs_pilot ? EVERY_LAMP * brume_film_slot_count(&render->layout) : 1;
    render->plan = clCreateBuffer(device->cl, CL_MEM_READ_WRITE, size, NULL, &code);
    if (code == CL_SUCCESS) code = clEnqueueFillBuffer(device->queue, render->plan, &zero, 1, 0, size, 0, NULL, NULL);
    if (code == CL_SUCCESS) code = clFinish(device->queue);
    if (code != CL_SUCCESS) return brume_fail_cl(device->context, code, "creating the plan");
    render->stats.device_bytes += size;
    return BRUME_OK;
}

/* Renders `samples` samples from sample `first` on of `groups` tiles from `group` on, or lets the pilot look at them,
 * and waits. */
static cl_int launch(brume_render *render, uint32_t group, uint32_t groups, uint32_t first, uint32_t samples,
                     cl_uint is_pilot) {
    cl_uint values[5] = {group, group + groups, first, samples, is_pilot};
    cl_int code = CL_SUCCESS;
    for (cl_uint i = 0; i < 5 && code == CL_SUCCESS; i++)
        code = clSetKernelArg(render->kernel, BRUME_SCENE_BUFFERS + 3 + i, sizeof(cl_uint), &values[i]);
    size_t local = render->local_size;
    size_t global = (groups + local - 1) / local * local;
    if (code == CL_SUCCESS)
        code = clEnqueueNDRangeKernel(render->device->queue, render->kernel, 1, NULL, &global, &local, 0, NULL, NULL);
    if (code == CL_SUCCESS) code = clFinish(render->device->queue);
    return code;
}

/* Builds the kernel for what the scene calls for and, since PoCL generates machine code at the first launch, launches
 * it once without samples: afterwards nothing is left to be compiled. */
static brume_result build_kernel(brume_render *render, const brume_arrays *arrays) {
    brume_device *device = render->device;
    uint32_t features = arrays->features | (render->desc.extra_features & FEATURE_ALL);
    if (render->desc.generic) features = FEATURE_ALL & ~(uint32_t)FEATURE_GUIDES;
    if (render->desc.guides) features |= FEATURE_GUIDES;
    render->stats.features = features;
    /* In steps, so that most scenes find each other's kernels in the driver's cache. */
    uint32_t stack = (arrays->bvh.stack_size + 15) / 16 * 16;
    char options[160];
    snprintf(options, sizeof options, "-DFEATURES=%u -DBVH_STACK=%u -DLOCAL_SIZE=%u -DSTRATEGY=%d -DINDIRECT=%d",
             features, stack, (unsigned)render->local_size, (int)render->desc.strategy,
             (int)render->desc.indirect);
    brume_result result = brume_program_build(device, "path.cl", render->stats.lanes, render->desc.precision, options,
                                              &render->program);
    if (result != BRUME_OK) return result;
    cl_int code;
    render->kernel = clCreateKernel(render->program, "render_paths", &code);
    for (cl_uint i = 0; i < BRUME_SCENE_BUFFERS && code == CL_SUCCESS; i++)
        code = clSetKernelArg(render->kernel, i, sizeof(cl_mem), &render->buffers[i]);
    if (code == CL_SUCCESS) code = clSetKernelArg(render->kernel, BRUME_SCENE_BUFFERS, sizeof(cl_mem), &render->planes);
    if (code == CL_SUCCESS)
        code = clSetKernelArg(render->kernel, BRUME_SCENE_BUFFERS + 1, sizeof(cl_mem), &render->bad);
    if (code == CL_SUCCESS)
        code = clSetKernelArg(render->kernel, BRUME_SCENE_BUFFERS + 2, sizeof(cl_mem), &render->plan);
    if (code == CL_SUCCESS) code = launch(render, 0, 1, 0, 0, 0);
    if (code != CL_SUCCESS) return brume_fail_cl(device->context, code, "preparing the kernel");
    return BRUME_OK;
}

/* 0 where the driver doesn't say. */
static uint64_t program_bytes(cl_program program) {
    size_t size = 0; /* of one device's binary */
    return clGetProgramInfo(program, CL_PROGRAM_BINARY_SIZES, sizeof size, &size, NULL) == CL_SUCCESS ? size : 0;
}

static void fill_stats(brume_render *render, const brume_arrays *a) {
    brume_render_stats *s = &render->stats;
    s->width = render->layout.width;
    s->height = render->layout.height;
    s->full_width = (uint32_t)a->params.width;
    s->full_height = (uint32_t)a->params.height;
    s->crop_x = (uint32_t)a->params.crop_x;
    s->crop_y = (uint32_t)a->params.crop_y;
    s->triangles = (uint32_t)a->params.triangle_count;
    s->quadrics = (uint32_t)a->params.quadric_count;
    s->bvh_nodes = a->bvh.node_count;
    s->bvh_depth = a->bvh.depth;
    s->dropped_triangles = a->dropped_triangles;
    s->lights = a->light_count;
    s->emitters = a->emitter_count;
    s->media = a->medium_count;
    s->first_sample = render->desc.first_sample;
    s->sample_count = render->desc.sample_count;
    s->seed = a->params.seed;
    s->strategy = render->desc.strategy;
    s->positions = render->desc.positions;
    s->indirect = render->desc.indirect;
    s->bvh_seconds = a->bvh_seconds;
}

/* Rigid: the inverse of the camera's axes. */
static void camera_matrix(const b_params *p, float out[16]) {
    const float *axes[3] = {p->camera_x, p->camera_y, p->camera_z};
    memset(out, 0, 16 * sizeof *out);
    for (int row = 0; row < 3; row++) {
        double shift = 0;
        for (int c = 0; c < 3; c++) {
            out[4 * row + c] = axes[row][c];
            shift -= (double)axes[row][c] * p->camera_o[c];
        }
        out[4 * row + 3] = (float)shift;
    }
    out[15] = 1;
}

/* Rays of light are worth their price for light that scatters twice, and know only lamps with a place in one medium. */
static brume_indirect resolve_indirect(const brume_render_desc *desc, const brume_arrays *a) {
    const uint32_t needed = FEATURE_SCATTERING | FEATURE_DELTA_LIGHTS;
    if (desc->indirect == BRUME_INDIRECT_PHASE || desc->indirect == BRUME_INDIRECT_MIXTURE) return desc->indirect;
    if (desc->strategy == BRUME_STRATEGY_SPHERICAL || desc->strategy == BRUME_STRATEGY_DISTANCE)
        return BRUME_INDIRECT_PHASE;
    if ((a->features & needed) != needed || (a->features & FEATURE_NULL)) return BRUME_INDIRECT_PHASE;
    if (a->params.sensor_medium < 0 || a->params.max_depth < 3 || a->params.single_scattering)
        return BRUME_INDIRECT_PHASE;
    for (uint32_t i = 0; i < a->light_count; i++)
        if (a->lights[i].kind == LIGHT_DIRECTIONAL) return BRUME_INDIRECT_PHASE;
    return BRUME_INDIRECT_RAY_LIGHTS;
}

brume_result brume_render_create(brume_device *device, const brume_scene *scene, const brume_render_desc *given,
                                 brume_render **out) {
    if (!device) return BRUME_ERROR_ARGUMENT;
    brume_context *context = device->context;
    if (!scene || !out) return brume_fail(context, BRUME_ERROR_ARGUMENT, "brume_render_create: NULL argument");
    brume_render_desc desc = given ? *given : brume_render_desc_default();
    brume_result result = check_desc(context, device, scene, &desc);
    if (result != BRUME_OK) return result;

    brume_scene_view view;
    result = brume_scene_view_make(scene, desc.without, &view);
    if (result != BRUME_OK) return result;
    brume_arrays arrays;
    const uint32_t crop[4] = {desc.crop_x, desc.crop_y, desc.crop_width, desc.crop_height};
    memset(&arrays, 0, sizeof arrays);
    brume_render *render = calloc(1, sizeof *render);
    if (!render) {
        brume_scene_view_free(&view);
        return brume_fail(context, BRUME_ERROR_MEMORY, "creating a render: out of memory");
    }
    render->device = brume_device_retain(device);
    brume_info(context, "Building the hierarchy of surfaces");
    render->stats.effects = brume_effects_find(&view.scene, NULL);
    render->stats.without = desc.without;
    result = brume_arrays_build(&view.scene, desc.use_crop ? crop : NULL, &arrays);
    brume_scene_view_free(&view);
    if (result != BRUME_OK) {
        brume_render_destroy(render);
        return result;
    }
    if (desc.sample_count == 0) desc.sample_count = scene->integrator.sample_count;
    if (desc.use_seed) arrays.params.seed = desc.seed;
    if (!desc.use_strategy) {
        desc.strategy = scene->integrator.strategy;
        desc.positions = scene->integrator.positions;
    }
    if (!desc.use_indirect) desc.indirect = scene->integrator.indirect;
    desc.indirect = resolve_indirect(&desc, &arrays);
    render->needs_pilot = desc.strategy == BRUME_STRATEGY_AUTO && (arrays.features & FEATURE_SCATTERING) &&
                          arrays.light_count > 0 && arrays.light_count <= EVERY_LAMP && !arrays.params.has_null &&
                          arrays.params.max_depth >= 2;
    arrays.params.positions = desc.positions ? (int)desc.positions
                              : desc.strategy == BRUME_STRATEGY_SYSTEMATIC ? SYSTEMATIC_POSITIONS
                              : desc.strategy == BRUME_STRATEGY_AUTO       ? AUTO_POSITIONS
                                                                           : RASTER_POSITIONS;
    render->desc = desc;
    render->film = scene->film;
    render->params = arrays.params;
    render->stats.lanes = desc.lanes ? desc.lanes : device->info.lanes;
    render->local_size = device->info.is_gpu ? GPU_LOCAL_SIZE : 1;
    render->layout = brume_film_layout_make((uint32_t)arrays.params.crop_width, (uint32_t)arrays.params.crop_height,
                                            render->stats.lanes);
    fill_stats(render, &arrays);
    camera_matrix(&arrays.params, render->world_to_camera);

    /* Tiles and pixels are counted in 32 bits. */
    if ((uint64_t)render->layout.width * render->layout.height > INT32_MAX) {
        result = brume_fail(context, BRUME_ERROR_MEMORY, "a film of %u x %u pixels is too large", render->layout.width,
                            render->layout.height);
        brume_arrays_free(&arrays);
        brume_render_destroy(render);
        return result;
    }
    brume_info(context, "Uploading the scene");
    double start = brume_seconds();
    result = upload_arrays(render, &arrays);
    if (result == BRUME_OK) result = create_film(render);
    double uploaded = brume_seconds();
    brume_info(context, "Building kernels, %u lanes wide, in %s", render->stats.lanes,
               desc.precision == BRUME_PRECISION_DOUBLE ? "double" : "float");
    if (result == BRUME_OK) result = build_kernel(render, &arrays);
    render->stats.upload_seconds = uploaded - start;
    render->stats.build_seconds = brume_seconds() - uploaded;
    if (result == BRUME_OK) render->stats.program_bytes = program_bytes(render->program);
    brume_arrays_free(&arrays);
    if (result != BRUME_OK) {
        brume_render_destroy(render);
        return result;
    }
    *out = render;
    return BRUME_OK;
}

void brume_render_destroy(brume_render *render) {
    if (!render) return;
    if (render->kernel) clReleaseKernel(render->kernel);
    if (render->program) clReleaseProgram(render->program);
    if (render->planes) clReleaseMemObject(render->planes);
    if (render->bad) clReleaseMemObject(render->bad);
    if (render->plan) clReleaseMemObject(render->plan);
    for (int i = 0; i < BRUME_SCENE_BUFFERS; i++)
        if (render->buffers[i]) clReleaseMemObject(render->buffers[i]);
    brume_device_destroy(render->device);
    free(render);
}

void brume_render_cancel(brume_render *render) {
    if (render) __atomic_store_n(&render->cancelled, 1, __ATOMIC_RELAXED);
}

/* Work in group-samples: one tile, one sample. */
static double work_done(const brume_render *r) {
    return (double)r->samples_done * r->layout.group_count + (double)r->pass_samples * r->groups_done;
}

static int report_progress(const brume_render *render, double start, double work_at_start,
                           brume_progress_callback callback, void *user) {
    double total = (double)render->desc.sample_count * render->layout.group_count, done = work_done(render);
    brume_progress p;
    p.seconds = brume_seconds() - start;
    p.fraction = total > 0 ? done / total : 1;
    p.seconds_left = done > work_at_start ? p.seconds * (total - done) / (done - work_at_start) : 0;
    p.samples = (uint64_t)(done / render->layout.group_count * render->layout.width * render->layout.height);
    return callback(user, &p);
}

/* How many groups take about LAUNCH_SECONDS. Never fewer than keep the whole device busy: a smaller launch takes just
 * as long there, would be measured as slower, and the next one would be smaller still. */
static uint32_t launch_size(const brume_render *render, uint32_t samples) {
    size_t least = render->device->info.compute_units * render->local_size;
    double wanted = render->groups_per_second * LAUNCH_SECONDS / samples;
    if (wanted < (double)least) wanted = (double)least;
    return wanted < render->layout.group_count ? (uint32_t)wanted : render->layout.group_count;
}

static brume_result read_bad_samples(brume_render *render) {
    cl_uint bad[BAD_SIZE];
    cl_int code = clEnqueueReadBuffer(render->device->queue, render->bad, CL_TRUE, 0, sizeof bad, bad, 0, NULL, NULL);
    if (code != CL_SUCCESS) return brume_fail_cl(render->device->context, code, "reading the count of bad samples");
    render->stats.bad_samples = bad[BAD_COUNT];
    if (bad[BAD_COUNT]) {
        render->stats.bad_pixel_x = bad[BAD_PIXEL] % render->stats.full_width;
        render->stats.bad_pixel_y = bad[BAD_PIXEL] / render->stats.full_width;
        render->stats.bad_sample = bad[BAD_SAMPLE];
    }
    return BRUME_OK;
}

/* One launch of the pilot, which takes about as long as a sample. */
static brume_result run_pilot(brume_render *render) {
    uint32_t left = render->layout.group_count - render->pilot_done;
    uint32_t groups = launch_size(render, 1);
    if (groups > left) groups = left;
    double before = brume_seconds();
    cl_int code = launch(render, render->pilot_done, groups, PILOT_SAMPLE, 1, 1);
    double spent = brume_seconds() - before;
    render->stats.pilot_seconds += spent;
    if (code != CL_SUCCESS) return brume_fail_cl(render->device->context, code, "rendering the pilot");
    if (spent > 0) render->groups_per_second = (double)groups / spent;
    render->pilot_done += groups;
    return BRUME_OK;
}

brume_result brume_render_run(brume_render *render, brume_progress_callback callback, void *user) {
    if (!render) return BRUME_ERROR_ARGUMENT;
    double start = brume_seconds(), work_at_start = work_done(render), last_report = start;
    brume_result result = BRUME_OK;
    while (render->samples_done < render->desc.sample_count) {
        if (__atomic_exchange_n(&render->cancelled, 0, __ATOMIC_RELAXED)) {
            result = BRUME_CANCELLED;
            break;
        }
        if (render->needs_pilot && render->pilot_done < render->layout.group_count) {
            result = run_pilot(render);
            if (result != BRUME_OK) return result;
            continue;
        }
        if (render->pass_samples == 0) {
            /* 1, 1, 2, 4, ...: a whole picture soon, then long passes. */
            uint32_t left = render->desc.sample_count - render->samples_done;
            uint32_t size = render->samples_done ? render->samples_done : 1;
            size = size < MAX_PASS_SAMPLES ? size : MAX_PASS_SAMPLES;
            render->pass_samples = size < left ? size : left;
            render->groups_done = 0;
        }
        uint32_t left = render->layout.group_count - render->groups_done;
        uint32_t groups = launch_size(render, render->pass_samples);
        if (groups > left) groups = left;
        double before = brume_seconds();
        cl_int code = launch(render, render->groups_done, groups, render->desc.first_sample + render->samples_done,
                             render->pass_samples, 0);
        if (code != CL_SUCCESS) {
            render->stats.render_seconds += brume_seconds() - start;
            return brume_fail_cl(render->device->context, code, "rendering");
        }
        double now = brume_seconds(), spent = now - before;
        if (spent > 0) render->groups_per_second = (double)groups * render->pass_samples / spent;
        render->groups_done += groups;
        if (render->groups_done == render->layout.group_count) {
            render->samples_done += render->pass_samples;
            render->pass_samples = 0;
            render->groups_done = 0;
        }
        if (callback && now - last_report > 0.1) {
            last_report = now;
            if (report_progress(render, start, work_at_start, callback, user)) brume_render_cancel(render);
        }
    }
    render->stats.render_seconds += brume_seconds() - start;
    render->stats.complete = render->samples_done == render->desc.sample_count;
    if (callback) report_progress(render, start, work_at_start, callback, user);
    brume_result read = read_bad_samples(render);
    if (read != BRUME_OK) return read;
    if (render->stats.bad_samples)
        brume_warn(render->device->context,
                   "%llu samples came out NaN or infinite and were dropped, one at pixel %u, %u sample %u: "
                   "please report this", (unsigned long long)render->stats.bad_samples,
                   render->stats.bad_pixel_x, render->stats.bad_pixel_y, render->stats.bad_sample);
    if (result == BRUME_CANCELLED) brume_info(render->device->context, "the render was cancelled");
    return result;
}

brume_result brume_render_get_stats(const brume_render *render, brume_render_stats *out) {
    if (!render) return BRUME_ERROR_ARGUMENT;
    if (!out) return brume_fail(render->device->context, BRUME_ERROR_ARGUMENT, "brume_render_get_stats: NULL argument");
    *out = render->stats;
    /* Exact when no pass is under way; within one, tiles at the edge count as full ones. */
    out->samples = (uint64_t)render->samples_done * render->layout.width * render->layout.height;
    uint64_t partial = (uint64_t)render->pass_samples * render->groups_done * render->stats.lanes;
    uint64_t pass = (uint64_t)render->pass_samples * render->layout.width * render->layout.height;
    out->samples += partial < pass ? partial : pass;
    return BRUME_OK;
}

static int channel_size(brume_channel channel) {
    switch (channel) {
    case BRUME_CHANNEL_RADIANCE:
    case BRUME_CHANNEL_VARIANCE:
    case BRUME_CHANNEL_ALBEDO:
    case BRUME_CHANNEL_NORMAL: return 3;
    case BRUME_CHANNEL_DEPTH:
    case BRUME_CHANNEL_SAMPLE_COUNT:
    case BRUME_CHANNEL_ALPHA: return 1;
    }
    return 0;
}

brume_result brume_render_read(brume_render *render, brume_channel channel, float *out, size_t count) {
    if (!render) return BRUME_ERROR_ARGUMENT;
    brume_context *context = render->device->context;
    size_t needed = (size_t)render->layout.width * render->layout.height * (size_t)channel_size(channel);
    if (!out || needed == 0)
        return brume_fail(context, BRUME_ERROR_ARGUMENT, "brume_render_read: NULL, or no channel %d", (int)channel);
    if (count != needed)
        return brume_fail(context, BRUME_ERROR_ARGUMENT, "brume_render_read: room for %zu floats, expected %zu", count,
                          needed);
    int guide = channel == BRUME_CHANNEL_ALBEDO || channel == BRUME_CHANNEL_NORMAL ||
                channel == BRUME_CHANNEL_DEPTH || channel == BRUME_CHANNEL_ALPHA;
    if (guide && !render->desc.guides)
        return brume_fail(context, BRUME_ERROR_ARGUMENT, "brume_render_read: this render does not record guides");
    size_t planes = render->desc.guides ? FILM_GUIDE_PLANES : FILM_PLANES;
    size_t size = planes * brume_film_slot_count(&render->layout) * sizeof(float);
    float *data = malloc(size);
    if (!data) return brume_fail(context, BRUME_ERROR_MEMORY, "reading the film: out of memory");
    cl_int code = clEnqueueReadBuffer(render->device->queue, render->planes, CL_TRUE, 0, size, data, 0, NULL, NULL);
    brume_result result = BRUME_OK;
    if (code == CL_SUCCESS)
        brume_film_resolve(&render->layout, data, render->params.filter_weight, channel, out);
    else
        result = brume_fail_cl(context, code, "reading the film");
    free(data);
    return result;
}

/* render.c -- making a render: its description checked, the scene uploaded, the kernel built. render_run.c renders,
 * render_read.c reads its film. */
#include "render.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "effects.h"
#include "platform.h"
#include "strategy.h"

enum {
    GPU_LOCAL_SIZE = 64,
    RENDER_COOKIE = 0x62720001,
    MOST_SAMPLES = 1 << 24, /* per pixel: the film counts them in float */
    GOAL_SAMPLES = 1 << 20, /* per pixel at most, where an error or a time is the goal and no count is given */
    /* On a segment, unless asked for: more cost more than they gain (measured by make ladder). */
    SYSTEMATIC_POSITIONS = 4,
    RASTER_POSITIONS = 64,
    AUTO_POSITIONS = 16
};

#define REPORT_SECONDS 0.1

brume_render_desc brume_render_desc_default(void) {
    brume_render_desc desc;
    memset(&desc, 0, sizeof desc);
    desc.cookie = RENDER_COOKIE;
    desc.precision = BRUME_PRECISION_FLOAT;
    desc.guides = 1;
    desc.error_estimate = 1;
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
    if (count > MOST_SAMPLES)
        return brume_fail(context, BRUME_ERROR_ARGUMENT, "brume_render_create: %u samples per pixel; at most 2^24 fit",
                          count);
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
    if (!(desc->noise_threshold >= 0) || desc->noise_threshold > DBL_MAX)
        return brume_fail(context, BRUME_ERROR_ARGUMENT,
                          "brume_render_create: noise_threshold is %g; expected a relMSE above 0, or 0 for none",
                          desc->noise_threshold);
    if (!(desc->time_limit >= 0) || desc->time_limit > DBL_MAX)
        return brume_fail(context, BRUME_ERROR_ARGUMENT,
                          "brume_render_create: time_limit is %g; expected seconds above 0, or 0 for none",
                          desc->time_limit);
    if ((unsigned)desc->adaptive > BRUME_ADAPTIVE_ON)
        return brume_fail(context, BRUME_ERROR_ARGUMENT, "brume_render_create: unknown adaptive %d",
                          (int)desc->adaptive);
    if (desc->first_sample &&
        (desc->noise_threshold > 0 || desc->time_limit > 0 || desc->adaptive == BRUME_ADAPTIVE_ON))
        return brume_fail(context, BRUME_ERROR_ARGUMENT,
                          "brume_render_create: a range of samples is fixed; it goes with no noise threshold, time "
                          "limit or adaptive sampling");
    if (!isfinite(desc->clamp) || desc->clamp < 0)
        return brume_fail(context, BRUME_ERROR_ARGUMENT, "brume_render_create: clamp is %g; expected a radiance, or 0",
                          (double)desc->clamp);
    if (scene->context != context)
        return brume_fail(context, BRUME_ERROR_ARGUMENT, "brume_render_create: the scene is another context's");
    if (!scene->has_sensor) return brume_fail(context, BRUME_ERROR_SCENE, "the scene has no sensor");
    return BRUME_OK;
}

/* Builds the program for what the scene calls for. */
static brume_result build_program(brume_render *render, const brume_arrays *arrays) {
    /* They have planes of the film: never without. */
    const uint32_t recorded = FEATURE_GUIDES | FEATURE_LIGHT_LAYERS;
    uint32_t features = arrays->features | (render->desc.extra_features & FEATURE_ALL);
    if (render->desc.generic) features = FEATURE_ALL;
    features &= ~recorded;
    if (render->desc.guides) features |= FEATURE_GUIDES;
    if (render->desc.light_layers) features |= FEATURE_LIGHT_LAYERS;
    render->stats.features = features;
    return brume_render_program_start(render, features, arrays->bvh.stack_size);
}

brume_result brume_render_equip(brume_render *render, const brume_arrays *arrays) {
    brume_context *context = render->device->context;
    render->local_size = render->device->info.is_gpu ? GPU_LOCAL_SIZE : 1;
    render->own_lanes = render->desc.lanes ? render->desc.lanes : render->device->info.lanes;
    brume_info(context, "Uploading the scene");
    double start = brume_seconds();
    brume_result result = brume_render_create_buffers(render, arrays);
    double uploaded = brume_seconds();
    brume_info(context, "Building kernels, %u lanes wide, in %s", render->own_lanes,
               render->desc.precision == BRUME_PRECISION_DOUBLE ? "double" : "float");
    if (result == BRUME_OK) result = build_program(render, arrays);
    render->stats.upload_seconds = uploaded - start;
    render->stats.build_seconds = brume_seconds() - uploaded;
    return result;
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

/* Rigid: the inverse of the camera's axes, in the scene's coordinates. */
static void camera_matrix(const b_params *p, const double origin[3], float out[16]) {
    const float *axes[3] = {p->camera_x, p->camera_y, p->camera_z};
    memset(out, 0, 16 * sizeof *out);
    for (int row = 0; row < 3; row++) {
        double shift = 0;
        for (int c = 0; c < 3; c++) {
            out[4 * row + c] = axes[row][c];
            shift -= axes[row][c] * (origin[c] + p->camera_o[c]);
        }
        out[4 * row + 3] = (float)shift;
    }
    out[15] = 1;
}

static int has_spot(const brume_arrays *a) {
    for (uint32_t i = 0; i < a->light_count; i++)
        if (a->lights[i].kind == LIGHT_SPOT) return 1;
    return 0;
}

/* Rays of light are worth their price for light that scatters twice, and leave only lamps with a place. Without a medium,
 * or seen from out of it, they pay for what spots light, which is little of the scene. */
static brume_indirect resolve_indirect(const brume_render_desc *desc, const brume_arrays *a) {
    const int is_clear = !(a->features & FEATURE_MEDIA);
    const uint32_t needed = FEATURE_DELTA_LIGHTS | (is_clear ? 0 : FEATURE_SCATTERING);
    if (desc->indirect == BRUME_INDIRECT_PHASE || desc->indirect == BRUME_INDIRECT_MIXTURE) return desc->indirect;
    if (desc->strategy == BRUME_STRATEGY_SPHERICAL || desc->strategy == BRUME_STRATEGY_DISTANCE)
        return BRUME_INDIRECT_PHASE;
    if ((a->features & needed) != needed) return BRUME_INDIRECT_PHASE;
    if (!is_clear && a->params.single_scattering) return BRUME_INDIRECT_PHASE;
    int is_apart = is_clear || a->params.sensor_medium < 0;
    if (is_apart && desc->indirect == BRUME_INDIRECT_AUTO && !has_spot(a)) return BRUME_INDIRECT_PHASE;
    if (a->params.max_depth < 3) return BRUME_INDIRECT_PHASE;
    for (uint32_t i = 0; i < a->light_count; i++)
        if (a->lights[i].kind != LIGHT_DIRECTIONAL) return BRUME_INDIRECT_RAY_LIGHTS;
    return BRUME_INDIRECT_PHASE;
}

brume_result brume_render_make(brume_device *device, const brume_scene *scene, const brume_render_desc *given,
                               int traced, brume_render **out) {
    if (!device) return BRUME_ERROR_ARGUMENT;
    brume_context *context = device->context;
    double begin = brume_seconds();
    if (traced && device->member_count) device = device->members[0];
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
    int has_goal = desc.noise_threshold > 0 || desc.time_limit > 0;
    if (desc.sample_count == 0) desc.sample_count = has_goal ? GOAL_SAMPLES : scene->integrator.sample_count;
    if (has_goal || desc.adaptive == BRUME_ADAPTIVE_ON) desc.error_estimate = 1;
    if (desc.light_layers) desc.guides = 1;
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
    arrays.params.clamp = desc.clamp > 0 ? (float)(desc.clamp / arrays.light_unit) : INFINITY;
    render->report_seconds = REPORT_SECONDS;
    render->desc = desc;
    render->film = scene->film;
    render->params = arrays.params;
    memcpy(render->origin, arrays.origin, sizeof render->origin);
    render->light_unit = arrays.light_unit;
    render->traced = traced;
    render->stats.lanes = desc.lanes ? desc.lanes : device->info.lanes;
    render->layout = brume_film_layout_make((uint32_t)arrays.params.crop_width, (uint32_t)arrays.params.crop_height,
                                            render->stats.lanes);
    fill_stats(render, &arrays);
    camera_matrix(&arrays.params, render->origin, render->world_to_camera);

    /* Tiles and pixels are counted in 32 bits. */
    if ((uint64_t)render->layout.width * render->layout.height > INT32_MAX) {
        result = brume_fail(context, BRUME_ERROR_MEMORY, "a film of %u x %u pixels is too large", render->layout.width,
                            render->layout.height);
        brume_arrays_free(&arrays);
        brume_render_destroy(render);
        return result;
    }
    if (desc.error_estimate) {
        result = brume_error_estimate_create(context, render->layout.width, render->layout.height,
                                             arrays.params.sampler != SAMPLER_SOBOL, &render->estimate);
        if (result != BRUME_OK) {
            brume_arrays_free(&arrays);
            brume_render_destroy(render);
            return result;
        }
    }
    result = device->member_count ? brume_crew_create(render, &arrays) : brume_render_equip(render, &arrays);
    if (result == BRUME_OK && !render->crew) brume_render_program_go_on(render);
    brume_arrays_free(&arrays);
    if (result != BRUME_OK) {
        brume_render_destroy(render);
        return result;
    }
    render->create_seconds = brume_seconds() - begin;
    *out = render;
    return BRUME_OK;
}

brume_result brume_render_create(brume_device *device, const brume_scene *scene, const brume_render_desc *desc,
                                 brume_render **out) {
    return brume_render_make(device, scene, desc, 0, out);
}

void brume_render_destroy(brume_render *render) {
    if (!render) return;
    brume_crew_destroy(render);
    brume_render_program_destroy(render);
    if (render->planes) clReleaseMemObject(render->planes);
    if (render->bad) clReleaseMemObject(render->bad);
    if (render->plan) clReleaseMemObject(render->plan);
    if (render->trace) clReleaseMemObject(render->trace);
    if (render->schedule) clReleaseMemObject(render->schedule);
    brume_error_estimate_free(&render->estimate);
    brume_allocation_free(render->allocation);
    free(render->done);
    free(render->ends);
    free(render->pass.counts);
    for (int i = 0; i < BRUME_SCENE_BUFFERS; i++)
        if (render->buffers[i]) clReleaseMemObject(render->buffers[i]);
    brume_device_destroy(render->device);
    free(render);
}

brume_result brume_render_set_sample_count(brume_render *render, uint32_t sample_count) {
    if (!render) return BRUME_ERROR_ARGUMENT;
    uint32_t begun = render->ends ? (uint32_t)(render->work / render->layout.group_count)
                                  : render->samples_done + render->pass.samples;
    if (sample_count < begun || sample_count == 0 || sample_count > MOST_SAMPLES ||
        sample_count > UINT32_MAX - render->desc.first_sample)
        return brume_fail(render->device->context, BRUME_ERROR_ARGUMENT,
                          "brume_render_set_sample_count: %u is not between the %u samples that are begun and 2^24",
                          sample_count, begun);
    render->desc.sample_count = render->stats.sample_count = sample_count;
    if (!render->ends && render->stage_end > sample_count) render->stage_end = sample_count;
    render->finished = 0; /* which the next run finds out again, if so */
    render->stats.complete = !render->ends && render->samples_done == sample_count;
    return BRUME_OK;
}

brume_result brume_render_get_stats(const brume_render *render, brume_render_stats *out) {
    if (!render) return BRUME_ERROR_ARGUMENT;
    if (!out) return brume_fail(render->device->context, BRUME_ERROR_ARGUMENT, "brume_render_get_stats: NULL argument");
    *out = render->stats;
    /* Exact when no pass is under way; within one, tiles at the edge count as full ones. */
    uint64_t pixels = (uint64_t)render->layout.width * render->layout.height;
    uint64_t partial = (uint64_t)render->pass.samples * render->pass.groups_done * render->stats.lanes;
    uint64_t pass = (uint64_t)render->pass.samples * pixels;
    out->samples = partial < pass ? partial : pass;
    if (!render->ends) out->samples += render->samples_done * pixels;
    for (uint64_t i = 0; render->ends && i < pixels; i++) out->samples += render->done[i];
    out->relmse = render->error.known ? render->error.relmse : -1;
    out->relmse_low = render->error.known ? render->error.low : -1;
    out->relmse_high = render->error.known ? render->error.high : -1;
    out->order = render->error.known ? render->error.order : -1;
    return BRUME_OK;
}

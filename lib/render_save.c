/* render_save.c -- a render's state to a file and back (checkpoint.h). */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "checkpoint_state.h"
#include "platform.h"
#include "render.h"

/* ---- what identifies it ---- */

/* Of the scene as the device has it, and what its numbers mean: what is not in there makes no difference. */
static brume_result hash_scene(brume_render *r) {
    enum { PIECE = 1 << 20 };
    const brume_render *holder = r->crew ? brume_crew_any(r->crew) : r;
    brume_sha256_state sum;
    uint8_t *piece = malloc(PIECE);
    cl_int code = CL_SUCCESS;
    if (!piece) return brume_fail(r->device->context, BRUME_ERROR_MEMORY, "hashing the scene: out of memory");
    brume_sha256_start(&sum);
    brume_sha256_add(&sum, &r->light_unit, sizeof r->light_unit);
    brume_sha256_add(&sum, r->origin, sizeof r->origin);
    for (int i = 0; i < BRUME_SCENE_BUFFERS && code == CL_SUCCESS; i++) {
        size_t size = 0;
        code = clGetMemObjectInfo(holder->buffers[i], CL_MEM_SIZE, sizeof size, &size, NULL);
        uint64_t length = size;
        brume_sha256_add(&sum, &length, sizeof length);
        for (size_t at = 0; at < size && code == CL_SUCCESS; at += PIECE) {
            size_t count = size - at < PIECE ? size - at : PIECE;
            code = clEnqueueReadBuffer(holder->device->queue, holder->buffers[i], CL_TRUE, at, count, piece, 0, NULL,
                                       NULL);
            brume_sha256_add(&sum, piece, count);
        }
    }
    free(piece);
    if (code != CL_SUCCESS) return brume_fail_cl(r->device->context, code, "hashing the scene");
    brume_sha256_end(&sum, r->scene_hash);
    return BRUME_OK;
}

static brume_result find_hashes(brume_render *r) {
    if (r->has_hashes) return BRUME_OK;
    char *text;
    BRUME_TRY(hash_scene(r));
    BRUME_TRY(brume_program_expand(r->device->context, "path.cl", &text));
    brume_sha256(text, strlen(text), r->kernel_hash);
    free(text);
    r->has_hashes = 1;
    return BRUME_OK;
}

static brume_result fill_head(brume_render *r, brume_checkpoint_head *out) {
    const brume_render_stats *s = &r->stats;
    BRUME_TRY(find_hashes(r));
    memset(out, 0, sizeof *out);
    cl_int code = brume_render_get(r, BRUME_FILM_BAD, 0, sizeof out->bad, out->bad);
    if (code != CL_SUCCESS) return brume_fail_cl(r->device->context, code, "reading the count of bad samples");
    memcpy(out->scene, r->scene_hash, sizeof out->scene);
    memcpy(out->kernels, r->kernel_hash, sizeof out->kernels);
    out->width = s->width;
    out->height = s->height;
    out->full_width = s->full_width;
    out->full_height = s->full_height;
    out->crop_x = s->crop_x;
    out->crop_y = s->crop_y;
    out->precision = r->desc.precision;
    out->recorded = brume_render_recorded(r);
    out->sampler = (uint32_t)r->params.sampler;
    out->seed = s->seed;
    out->strategy = s->strategy;
    out->positions = s->positions;
    out->indirect = s->indirect;
    out->without = s->without;
    out->first_sample = r->desc.first_sample;
    out->sample_count = r->desc.sample_count;
    out->adaptive = r->desc.adaptive;
    out->has_time_limit = r->desc.time_limit > 0;
    out->error_estimate = r->desc.error_estimate != 0;
    out->clamp = r->params.clamp;
    out->noise_threshold = r->desc.noise_threshold;
    out->time_limit = r->desc.time_limit;
    out->light_unit = r->light_unit;
    out->filter_weight = r->params.filter_weight;
    out->half = r->film.half;
    out->alpha = r->film.alpha;
    memcpy(out->world_to_camera, r->world_to_camera, sizeof out->world_to_camera);
    brume_render_world_to_ndc(r, out->world_to_ndc);
    out->stats_effects = s->effects;
    snprintf(out->device, sizeof out->device, "%s", r->device->info.name);

    out->lanes = s->lanes;
    out->group_count = r->layout.group_count;
    out->stage_end = r->stage_end;
    out->samples_done = r->samples_done;
    out->pass_samples = r->pass.samples;
    out->groups_done = r->pass.groups_done;
    out->finished = r->finished != 0;
    out->looked = r->looked != 0;
    out->has_counts = r->ends != NULL;
    out->has_allocation = r->allocation != NULL;
    out->has_plan = r->needs_pilot != 0;
    out->pilot_done = r->pilot_done;
    out->doubtful = r->pass.doubtful;
    out->doubtful_lanes = r->pass.doubtful ? r->pass.doubtful_lanes : 0;
    out->look_at = r->look_at;
    out->work = r->work;
    out->stage_work = r->stage_work;
    out->stage_seconds = r->stage_seconds;
    out->rate = r->rate;
    out->render_seconds = s->render_seconds + (r->running_since > 0 ? brume_seconds() - r->running_since : 0);
    out->pilot_seconds = s->pilot_seconds;
    out->error_known = r->error.known != 0;
    if (r->error.known) {
        out->relmse = r->error.relmse;
        out->relmse_low = r->error.low;
        out->relmse_high = r->error.high;
        out->order = r->error.order;
    }
    return BRUME_OK;
}

/* ---- the film, in the order of rows ---- */

/* What the device holds in slots. */
typedef struct planes {
    brume_film_part part;
    uint32_t count;
    size_t size; /* bytes of a value */
} planes;

static planes film_of(const brume_render *r) {
    return (planes){BRUME_FILM_PLANES, (uint32_t)brume_film_plane_count(brume_render_recorded(r)), sizeof(float)};
}

static planes plan_of(const brume_render *r) { return (planes){BRUME_FILM_PLAN, r->needs_pilot ? EVERY_LAMP : 0, 1}; }

/* Plane by plane from the device into the file, in the order of rows. */
static brume_result append_planes(const brume_render *r, planes p, brume_checkpoint_writer *writer) {
    const brume_film_layout *l = &r->layout;
    size_t pixels = (size_t)l->width * l->height, size = brume_film_slot_count(l) * p.size;
    uint8_t *slots = malloc(size), *rows = malloc(pixels * p.size);
    cl_int code = CL_SUCCESS;
    int has_memory = slots && rows;
    for (uint32_t plane = 0; plane < p.count && code == CL_SUCCESS && has_memory; plane++) {
        uint8_t *to = rows;
        code = brume_render_get(r, p.part, plane * size, size, slots);
        for (uint32_t y = 0; y < l->height; y++)
            for (uint32_t x = 0; x < l->width; x++, to += p.size)
                memcpy(to, slots + brume_film_slot_of(l, x, y) * p.size, p.size);
        brume_checkpoint_append(writer, rows, pixels * p.size);
    }
    free(slots);
    free(rows);
    if (!has_memory) return brume_fail(r->device->context, BRUME_ERROR_MEMORY, "reading the film: out of memory");
    return code == CL_SUCCESS ? BRUME_OK : brume_fail_cl(r->device->context, code, "reading the film");
}

/* And back, with room for a plane. */
static cl_int upload_planes(brume_render *r, planes p, const uint8_t *rows, uint8_t *slots) {
    const brume_film_layout *l = &r->layout;
    size_t size = brume_film_slot_count(l) * p.size;
    cl_int code = CL_SUCCESS;
    memset(slots, 0, size);
    for (uint32_t plane = 0; plane < p.count && code == CL_SUCCESS; plane++) {
        for (uint32_t y = 0; y < l->height; y++)
            for (uint32_t x = 0; x < l->width; x++, rows += p.size)
                memcpy(slots + brume_film_slot_of(l, x, y) * p.size, rows, p.size);
        code = brume_render_put(r, p.part, plane * size, size, slots);
    }
    return code;
}

/* ---- saving ---- */

static brume_result append_rest(const brume_render *r, brume_checkpoint_writer *writer) {
    size_t pixels = (size_t)r->layout.width * r->layout.height;
    const brume_error_estimate *e = &r->estimate;
    if (r->desc.error_estimate) {
        brume_checkpoint_append(writer, e->mean, 3 * pixels * sizeof *e->mean);
        brume_checkpoint_append(writer, e->last, 3 * pixels * sizeof *e->last);
        brume_checkpoint_append(writer, e->before, 3 * pixels * sizeof *e->before);
        brume_checkpoint_append(writer, e->level, pixels * sizeof *e->level);
    }
    if (r->ends) {
        brume_checkpoint_append(writer, r->done, pixels * sizeof *r->done);
        brume_checkpoint_append(writer, r->ends, pixels * sizeof *r->ends);
    }
    if (!r->allocation) return BRUME_OK;
    size_t size = brume_allocation_bytes(r->allocation);
    uint8_t *bytes = malloc(size);
    if (!bytes) return brume_fail(r->device->context, BRUME_ERROR_MEMORY, "saving a render: out of memory");
    brume_allocation_pack(r->allocation, bytes);
    brume_checkpoint_append(writer, bytes, size);
    free(bytes);
    return BRUME_OK;
}

brume_result brume_render_save(brume_render *render, const char *path) {
    if (!render) return BRUME_ERROR_ARGUMENT;
    brume_context *context = render->device->context;
    if (!path) return brume_fail(context, BRUME_ERROR_ARGUMENT, "brume_render_save: NULL path");
    brume_checkpoint_head head;
    brume_checkpoint_writer writer;
    BRUME_TRY(fill_head(render, &head));
    BRUME_TRY(brume_checkpoint_begin(context, path, &writer));
    brume_checkpoint_append(&writer, &head, sizeof head);
    brume_result result = append_planes(render, film_of(render), &writer);
    if (result == BRUME_OK) result = append_planes(render, plan_of(render), &writer);
    if (result == BRUME_OK) result = append_rest(render, &writer);
    brume_result ended = brume_checkpoint_end(context, &writer, result == BRUME_OK);
    return result == BRUME_OK ? ended : result;
}

/* ---- loading ---- */

/* Whether this render can go on from there, which may have been told to take another number of samples. */
static brume_result check_progress(brume_render *r, const char *path, const brume_checkpoint_head *h) {
    brume_context *context = r->device->context;
    uint32_t begun = h->samples_done + h->pass_samples;
    if (brume_goal_exists(r) && h->sample_count != r->desc.sample_count)
        return brume_fail(context, BRUME_ERROR_CHECKPOINT,
                          "%s: doesn't fit this render: its sample count is %u, and not %u, and samples were placed by "
                          "it", path, h->sample_count, r->desc.sample_count);
    if (!brume_goal_exists(r) && r->desc.sample_count < begun)
        return brume_fail(context, BRUME_ERROR_CHECKPOINT, "%s: has %u samples already, and %u are asked for", path,
                          begun, r->desc.sample_count);
    if (h->pass_samples && (h->lanes != r->stats.lanes || h->group_count != r->layout.group_count))
        return brume_fail(context, BRUME_ERROR_CHECKPOINT,
                          "%s: was written in the middle of a pass %u lanes wide, and this render is %u lanes wide",
                          path, h->lanes, r->stats.lanes);
    if (h->has_plan != (uint32_t)r->needs_pilot)
        return brume_fail(context, BRUME_ERROR_CHECKPOINT, "%s: is damaged: its parts don't fit each other", path);
    return BRUME_OK;
}

/* Memory is had before; what fails in the middle leaves a film that is neither, so it is the device's failure. */
static brume_result upload(brume_render *r, const brume_checkpoint *c, const brume_checkpoint_state *s) {
    uint8_t *slots = malloc(brume_film_slot_count(&r->layout) * sizeof(float));
    if (!slots) return brume_fail(r->device->context, BRUME_ERROR_MEMORY, "writing the film: out of memory");
    cl_int code = brume_render_put(r, BRUME_FILM_BAD, 0, sizeof c->head.bad, c->head.bad);
    if (code == CL_SUCCESS) code = upload_planes(r, plan_of(r), c->rest, slots);
    if (code == CL_SUCCESS) code = upload_planes(r, film_of(r), (const uint8_t *)c->planes, slots);
    if (code == CL_SUCCESS && s->schedule)
        code = brume_render_put(r, BRUME_FILM_SCHEDULE, 0, s->schedule_size, s->schedule);
    free(slots);
    if (code == CL_SUCCESS) return BRUME_OK;
    brume_fail_cl(r->device->context, code, "writing the film");
    return BRUME_ERROR_DEVICE;
}

/* The film's counts of samples in the order of slots, which a pass under way is known by where samples were dropped
 * (brume_render_note_counts). malloc'ed; NULL: no memory. */
static float *counts_of(const brume_render *r, const brume_checkpoint *c) {
    const brume_film_layout *l = &r->layout;
    const float *rows = c->planes + (size_t)FILM_COUNT * l->width * l->height;
    float *counts = calloc(brume_film_slot_count(l), sizeof *counts);
    for (uint32_t y = 0; counts && y < l->height; y++)
        for (uint32_t x = 0; x < l->width; x++) counts[brume_film_slot_of(l, x, y)] = *rows++;
    return counts;
}

/* The state becomes the render's. A pilot that was in the middle begins anew if its groups are other ones. What had all
 * of its time goes on if it is given more: the run finds out if another goal was reached. */
static void take_over(brume_render *r, const brume_checkpoint_head *h, brume_checkpoint_state *s, float *counts) {
    uint32_t pass_groups = h->pass_samples ? s->pass_groups : r->layout.group_count;
    brume_error_estimate_free(&r->estimate);
    brume_allocation_free(r->allocation);
    free(r->done);
    free(r->ends);
    r->estimate = s->estimate;
    r->allocation = s->allocation;
    r->done = s->done;
    r->ends = s->ends;
    free(s->schedule);
    memset(s, 0, sizeof *s);
    free(r->pass.counts);
    r->pass.counts = counts;
    r->pass.bad_before = h->bad[BAD_COUNT];
    r->pass.counts_unknown = h->bad[BAD_COUNT] && h->doubtful;
    r->stage_end = h->stage_end;
    r->samples_done = h->samples_done;
    r->pass.samples = h->pass_samples;
    r->pass.groups_done = h->groups_done;
    r->pass.doubtful = h->doubtful;
    r->pass.doubtful_lanes = h->doubtful_lanes;
    r->look_at = h->look_at;
    r->pass.groups = pass_groups;
    r->pilot_done = h->group_count == r->layout.group_count || h->pilot_done == 0 ? h->pilot_done
                    : h->pilot_done == h->group_count                             ? r->layout.group_count
                                                                                  : 0;
    r->work = h->work * r->layout.group_count / h->group_count;
    r->stage_work = h->stage_work;
    r->stage_seconds = h->stage_seconds;
    r->rate = h->rate;
    r->finished = h->finished && r->desc.time_limit <= h->time_limit;
    r->looked = (int)h->looked;
    r->error = (brume_error_result){.known = (int)h->error_known,
                                    .relmse = h->relmse,
                                    .low = h->relmse_low,
                                    .high = h->relmse_high,
                                    .order = h->order};
    memset(&r->prediction, 0, sizeof r->prediction);
    r->stats.adaptive = h->has_counts;
    r->stats.complete = (uint32_t)r->finished;
    r->stats.render_seconds = h->render_seconds;
    r->stats.pilot_seconds = h->pilot_seconds;
    r->stats.bad_samples = h->bad[BAD_COUNT];
    r->stats.bad_pixel_x = h->bad[BAD_PIXEL] % h->full_width;
    r->stats.bad_pixel_y = h->bad[BAD_PIXEL] / h->full_width;
    r->stats.bad_sample = h->bad[BAD_SAMPLE];
}

brume_result brume_render_load(brume_render *render, const char *path) {
    if (!render) return BRUME_ERROR_ARGUMENT;
    brume_context *context = render->device->context;
    if (!path) return brume_fail(context, BRUME_ERROR_ARGUMENT, "brume_render_load: NULL path");
    brume_checkpoint_head here;
    brume_checkpoint c;
    brume_checkpoint_state s;
    memset(&s, 0, sizeof s);
    BRUME_TRY(fill_head(render, &here));
    BRUME_TRY(brume_checkpoint_read(context, path, &c));
    brume_result result = brume_checkpoint_same_render(context, path, &c.head, &here, "this render");
    if (result == BRUME_OK) result = check_progress(render, path, &c.head);
    if (result == BRUME_OK)
        result = brume_checkpoint_state_make(context, path, &c, render->estimate.independent, &s);
    float *counts = NULL;
    if (result == BRUME_OK && c.head.pass_samples && c.head.bad[BAD_COUNT] && !(counts = counts_of(render, &c)))
        result = brume_fail(context, BRUME_ERROR_MEMORY, "%s: out of memory", path);
    if (result == BRUME_OK) result = upload(render, &c, &s);
    if (result == BRUME_OK) {
        uint32_t wanted = render->desc.sample_count;
        take_over(render, &c.head, &s, counts);
        counts = NULL;
        if (strcmp(c.head.device, here.device) != 0)
            brume_warn(context, "%s was rendered on %s; what follows may differ in the last bits", path, c.head.device);
        if (wanted != c.head.sample_count) result = brume_render_set_sample_count(render, wanted);
    }
    free(counts);
    brume_checkpoint_state_free(&s);
    brume_checkpoint_free(&c);
    return result;
}

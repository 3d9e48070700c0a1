/* checkpoint_state.c -- see checkpoint_state.h. */
#include "checkpoint_state.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "../cl/shared.h"

enum {
    MOST_LEVEL = 24, /* log2 of the samples of a pixel, which the film counts in float */
    MOST_SAMPLES = 1 << MOST_LEVEL
};

/* ---- the head -------------------------------------------------------------------------------------------------- */

static int is_flag(uint32_t value) { return value <= 1; }

static int is_amount(double value) { return value >= 0 && isfinite(value); }

static int picture_is_valid(const brume_checkpoint_head *h) {
    brume_film_layout layout;
    if (h->lanes != 1 && h->lanes != 4 && h->lanes != 8 && h->lanes != 16) return 0;
    if (h->width == 0 || h->height == 0 || (uint64_t)h->width * h->height > INT32_MAX) return 0;
    layout = brume_film_layout_make(h->width, h->height, h->lanes);
    return h->group_count == layout.group_count && h->recorded <= 2 &&
           (uint64_t)h->crop_x + h->width <= h->full_width && (uint64_t)h->crop_y + h->height <= h->full_height &&
           isfinite(h->light_unit) && h->light_unit > 0;
}

static int samples_are_valid(const brume_checkpoint_head *h) {
    if (h->sample_count > MOST_SAMPLES || h->first_sample > UINT32_MAX - h->sample_count) return 0;
    if (h->stage_end > MOST_SAMPLES || h->samples_done > h->stage_end) return 0;
    if (h->pass_samples > h->stage_end - h->samples_done) return 0;
    if (h->pass_samples == 0 && (h->groups_done || h->doubtful)) return 0;
    if (h->pass_samples && h->groups_done >= h->group_count) return 0;
    if (h->doubtful ? h->doubtful_lanes == 0 || h->lanes % h->doubtful_lanes : h->doubtful_lanes) return 0;
    return h->doubtful <= h->group_count - h->groups_done && h->pilot_done <= h->group_count &&
           (h->has_plan || h->pilot_done == 0);
}

/* Samples are placed by an allocation, and that is made of an estimate, perhaps by the look that is due. */
static int plan_is_valid(const brume_checkpoint_head *h) {
    int has_goal = h->noise_threshold > 0 || h->has_time_limit || h->adaptive == BRUME_ADAPTIVE_ON;
    if (h->look_at & (h->look_at - 1) || h->look_at > h->stage_end) return 0;
    if ((h->look_at || h->has_counts || h->has_allocation || has_goal) && !h->error_estimate) return 0;
    if ((h->has_counts || h->has_allocation) && !has_goal) return 0;
    if (has_goal && h->first_sample) return 0;
    return !h->has_counts || h->has_allocation || h->look_at;
}

int brume_checkpoint_head_is_valid(const brume_checkpoint_head *h) {
    return picture_is_valid(h) && samples_are_valid(h) && plan_is_valid(h) && h->adaptive <= BRUME_ADAPTIVE_ON &&
           is_flag(h->has_time_limit) && is_flag(h->error_estimate) && is_flag(h->finished) && is_flag(h->looked) &&
           is_flag(h->has_counts) && is_flag(h->has_allocation) && is_flag(h->has_plan) && is_flag(h->error_known) &&
           is_amount(h->noise_threshold) && is_amount(h->time_limit) && (h->time_limit > 0) == h->has_time_limit &&
           is_amount(h->work) && h->work <= (double)MOST_SAMPLES * h->group_count && is_amount(h->stage_work) &&
           is_amount(h->stage_seconds) && is_amount(h->rate) && is_amount(h->render_seconds) &&
           is_amount(h->pilot_seconds) && memchr(h->device, 0, sizeof h->device);
}

/* ---- what lies behind it --------------------------------------------------------------------------------------- */

void brume_checkpoint_state_free(brume_checkpoint_state *s) {
    brume_error_estimate_free(&s->estimate);
    brume_allocation_free(s->allocation);
    free(s->done);
    free(s->ends);
    free(s->schedule);
    memset(s, 0, sizeof *s);
}

/* Moves on behind `size` bytes. 0 if they aren't there. */
static int take(const uint8_t **at, size_t *left, void *out, size_t size) {
    if (*left < size) return 0;
    if (out) memcpy(out, *at, size);
    *at += size;
    *left -= size;
    return 1;
}

/* Whether the file is as long as its head says. */
static int fill(const brume_checkpoint *c, brume_checkpoint_state *s, int *out_no_memory) {
    size_t pixels = (size_t)c->head.width * c->head.height, left = c->rest_size;
    const uint8_t *at = c->rest;
    brume_error_estimate *e = &s->estimate;
    if (c->head.has_plan && !take(&at, &left, NULL, EVERY_LAMP * pixels)) return 0;
    if (c->head.error_estimate &&
        !(take(&at, &left, e->mean, 3 * pixels * sizeof *e->mean) &&
          take(&at, &left, e->last, 3 * pixels * sizeof *e->last) &&
          take(&at, &left, e->before, 3 * pixels * sizeof *e->before) &&
          take(&at, &left, e->level, pixels * sizeof *e->level)))
        return 0;
    if (c->head.has_counts && !(take(&at, &left, s->done, pixels * sizeof *s->done) &&
                                take(&at, &left, s->ends, pixels * sizeof *s->ends)))
        return 0;
    if (!c->head.has_allocation) return left == 0;
    s->allocation = brume_allocation_unpack(at, left, c->head.width, c->head.height, out_no_memory);
    return s->allocation != NULL;
}

/* Those who take part in the pass are at samples_done and have as many to come; nobody else is behind. */
static int counts_are_valid(const brume_checkpoint_head *h, const brume_checkpoint_state *s) {
    for (size_t i = 0; s->done && i < (size_t)h->width * h->height; i++) {
        if (s->done[i] > s->ends[i] || s->ends[i] > h->stage_end) return 0;
        if (s->done[i] < s->ends[i] && s->done[i] < h->samples_done) return 0;
        if (s->done[i] == h->samples_done && s->ends[i] > s->done[i] && s->ends[i] - s->done[i] < h->pass_samples)
            return 0;
    }
    return 1;
}

/* Nobody has been looked at with more samples than there are. */
static int levels_are_valid(const brume_checkpoint_head *h, const brume_checkpoint_state *s) {
    for (size_t i = 0; h->error_estimate && i < (size_t)h->width * h->height; i++) {
        uint32_t level = s->estimate.level[i], samples = s->done ? s->done[i] : h->samples_done;
        if (level > MOST_LEVEL || (level > 0 && 1u << level > samples)) return 0;
    }
    return 1;
}

static brume_result make_arrays(brume_context *context, const char *path, const brume_checkpoint_head *h,
                                int independent, brume_checkpoint_state *s) {
    size_t pixels = (size_t)h->width * h->height;
    if (h->error_estimate)
        BRUME_TRY(brume_error_estimate_create(context, h->width, h->height, independent, &s->estimate));
    if (!h->has_counts) return BRUME_OK;
    s->done = malloc(pixels * sizeof *s->done);
    s->ends = malloc(pixels * sizeof *s->ends);
    if (s->done && s->ends) return BRUME_OK;
    return brume_fail(context, BRUME_ERROR_MEMORY, "%s: out of memory", path);
}

static brume_result make_schedule(brume_context *context, const char *path, const brume_checkpoint_head *h,
                                  brume_checkpoint_state *s) {
    brume_film_layout layout = brume_film_layout_make(h->width, h->height, h->lanes);
    s->pass_groups = h->group_count;
    if (!s->done || !h->pass_samples) return BRUME_OK;
    s->schedule = brume_schedule_make(&layout, s->done, s->ends, h->samples_done, &s->schedule_size);
    if (!s->schedule) return brume_fail(context, BRUME_ERROR_MEMORY, "%s: out of memory", path);
    s->pass_groups = (uint32_t)(s->schedule_size / (h->lanes * sizeof *s->schedule));
    if (h->groups_done < s->pass_groups && h->doubtful <= s->pass_groups - h->groups_done) return BRUME_OK;
    return brume_fail(context, BRUME_ERROR_CHECKPOINT, "%s: is damaged: its pass has more groups than take part", path);
}

/* Which sizes the file has is found out before room is made for them. */
static int is_long_enough(const brume_checkpoint *c) {
    const brume_checkpoint_head *h = &c->head;
    uint64_t pixels = (uint64_t)h->width * h->height, size = 0;
    if (h->has_plan) size += EVERY_LAMP;
    if (h->error_estimate) size += 9 * sizeof(float) + 1;
    if (h->has_counts) size += 2 * sizeof(uint32_t);
    return c->rest_size >= size * pixels;
}

brume_result brume_checkpoint_state_make(brume_context *context, const char *path, const brume_checkpoint *c,
                                         int independent, brume_checkpoint_state *out) {
    brume_checkpoint_state s;
    memset(&s, 0, sizeof s);
    brume_result result = BRUME_OK;
    int fits = brume_checkpoint_head_is_valid(&c->head) && is_long_enough(c), no_memory = 0;
    if (fits) result = make_arrays(context, path, &c->head, independent, &s);
    if (fits && result == BRUME_OK)
        fits = fill(c, &s, &no_memory) && counts_are_valid(&c->head, &s) && levels_are_valid(&c->head, &s);
    if (no_memory)
        result = brume_fail(context, BRUME_ERROR_MEMORY, "%s: out of memory", path);
    else if (!fits)
        result = brume_fail(context, BRUME_ERROR_CHECKPOINT, "%s: is damaged: its parts don't fit each other", path);
    if (result == BRUME_OK) result = make_schedule(context, path, &c->head, &s);
    if (result == BRUME_OK)
        *out = s;
    else
        brume_checkpoint_state_free(&s);
    return result;
}

int32_t *brume_schedule_make(const brume_film_layout *l, const uint32_t *done, const uint32_t *ends,
                             uint32_t samples_done, size_t *size) {
    size_t slots = brume_film_slot_count(l), lanes = slots / l->group_count, count = 0;
    int32_t *schedule = calloc(slots, sizeof *schedule);
    if (!schedule) return NULL;
    for (uint32_t y = 0; y < l->height; y++)
        for (uint32_t x = 0; x < l->width; x++) {
            size_t i = (size_t)y * l->width + x;
            schedule[brume_film_slot_of(l, x, y)] = done[i] == samples_done && ends[i] > done[i];
        }
    for (size_t slot = 0; slot < slots; slot++)
        if (schedule[slot]) schedule[count++] = (int32_t)slot;
    while (count % lanes) schedule[count++] = -1;
    *size = count * sizeof *schedule;
    return schedule;
}

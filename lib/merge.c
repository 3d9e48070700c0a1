/* merge.c -- films of ranges of samples, added up: which fit each other, what is missing, the sums.
 *
 * A film's sums are pairs of floats. Both of all files are added in double, in the order of their samples, and the
 * total is split in two again.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "channel.h"
#include "checkpoint.h"
#include "film.h"
#include "picture.h"

#include "../cl/shared.h"

enum { MERGE_COOKIE = 0x62720004, MOST_SAMPLES = 1 << 24 };

typedef struct part {
    const char *path; /* the caller's */
    brume_checkpoint_head head;
} part;

struct brume_merged {
    brume_context *context; /* retained */
    brume_checkpoint_head head; /* of the first samples */
    char device[160];
    brume_render_stats stats;
    brume_film_layout layout; /* a slot for each pixel, in the order of rows */
    float *planes;
    uint32_t *rendered;       /* per pixel, samples, with those that were dropped */
};

brume_merge_desc brume_merge_desc_default(void) {
    brume_merge_desc desc;
    memset(&desc, 0, sizeof desc);
    desc.cookie = MERGE_COOKIE;
    return desc;
}

/* ---- what there is ---- */

static uint64_t end_of(const part *p) { return (uint64_t)p->head.first_sample + p->head.sample_count; }

static int is_complete(const brume_checkpoint_head *h) {
    return h->samples_done == h->sample_count && h->pass_samples == 0 && h->doubtful == 0;
}

static int by_first_sample(const void *a, const void *b) {
    const part *x = a, *y = b;
    return x->head.first_sample < y->head.first_sample ? -1 : x->head.first_sample > y->head.first_sample;
}

static brume_result read_heads(brume_context *context, const char *const *paths, size_t count, part *parts) {
    for (size_t i = 0; i < count; i++) {
        brume_checkpoint c;
        if (!paths[i]) return brume_fail(context, BRUME_ERROR_ARGUMENT, "brume_merge: NULL path");
        BRUME_TRY(brume_checkpoint_read(context, paths[i], &c));
        parts[i] = (part){paths[i], c.head};
        brume_checkpoint_free(&c);
        if (parts[i].head.has_counts || parts[i].head.noise_threshold > 0 || parts[i].head.has_time_limit)
            return brume_fail(context, BRUME_ERROR_CHECKPOINT,
                              "%s: is not of a fixed range of samples, but of a render with a goal", paths[i]);
        BRUME_TRY(brume_checkpoint_same_picture(context, paths[i], &parts[i].head, &parts[0].head, paths[0]));
    }
    return BRUME_OK;
}

/* A list in a message; where it is too long it ends in dots. */
typedef struct list {
    char text[512];
    size_t length;
} list;

static void list_add(list *l, const char *file, uint64_t first, uint64_t end, uint64_t of) {
    char item[256];
    if (l->length + 8 > sizeof l->text) return;
    if (file)
        snprintf(item, sizeof item, "%s%s holds %llu of its %llu", l->length ? ", " : "", file,
                 (unsigned long long)first, (unsigned long long)of);
    else if (end - first == 1)
        snprintf(item, sizeof item, "%s%llu", l->length ? ", " : "", (unsigned long long)first);
    else
        snprintf(item, sizeof item, "%s%llu to %llu", l->length ? ", " : "", (unsigned long long)first,
                 (unsigned long long)(end - 1));
    size_t length = strlen(item);
    if (l->length + length + 8 > sizeof l->text) snprintf(item, sizeof item, ", ...");
    memcpy(l->text + l->length, item, strlen(item) + 1);
    l->length = strcmp(item, ", ...") == 0 ? sizeof l->text : l->length + length;
}

/* Sorted parts: none may overlap the next; *out_missing lists what is not there of the range wanted. */
static brume_result check_ranges(brume_context *context, const part *parts, size_t count, const brume_merge_desc *desc,
                                 list *out_missing) {
    uint64_t at = desc->first_sample, end = end_of(&parts[count - 1]), total = 0;
    for (size_t i = 0; i < count; i++) {
        if (i > 0 && parts[i].head.first_sample < end_of(&parts[i - 1])) {
            uint64_t shared = end_of(&parts[i]) < end_of(&parts[i - 1]) ? end_of(&parts[i]) : end_of(&parts[i - 1]);
            return brume_fail(context, BRUME_ERROR_CHECKPOINT, "%s and %s both hold samples %u to %llu",
                              parts[i - 1].path, parts[i].path, parts[i].head.first_sample,
                              (unsigned long long)(shared - 1));
        }
        total += parts[i].head.sample_count;
        if (parts[i].head.first_sample > at) list_add(out_missing, NULL, at, parts[i].head.first_sample, 0);
        if (!is_complete(&parts[i].head))
            list_add(out_missing, parts[i].path, parts[i].head.samples_done, 0, parts[i].head.sample_count);
        if (end_of(&parts[i]) > at) at = end_of(&parts[i]);
    }
    if (desc->sample_count) end = (uint64_t)desc->first_sample + desc->sample_count;
    if (at < end) list_add(out_missing, NULL, at, end, 0);
    if (total > MOST_SAMPLES)
        return brume_fail(context, BRUME_ERROR_CHECKPOINT, "%llu samples per pixel; at most 2^24 add up",
                          (unsigned long long)total);
    const part *outside = parts[0].head.first_sample < desc->first_sample ? &parts[0]
                          : end_of(&parts[count - 1]) > end               ? &parts[count - 1]
                                                                          : NULL;
    if (outside)
        return brume_fail(context, BRUME_ERROR_CHECKPOINT, "%s: holds samples %u to %llu, and %u to %llu are wanted",
                          outside->path, outside->head.first_sample, (unsigned long long)(end_of(outside) - 1),
                          desc->first_sample, (unsigned long long)(end - 1));
    if (out_missing->length && !desc->partial)
        return brume_fail(context, BRUME_ERROR_CHECKPOINT, "samples are missing: %s", out_missing->text);
    return BRUME_OK;
}

/* ---- the sums ---- */

static size_t plane_count(const brume_checkpoint_head *h) { return brume_film_plane_count(h->recorded); }

/* Both floats of a pair go to the same sum. */
static void add_planes(const brume_checkpoint *c, double *sums) {
    size_t pixels = (size_t)c->head.width * c->head.height;
    for (size_t plane = 0; plane < plane_count(&c->head); plane++) {
        int is_rest = plane >= FILM_REST_R && plane < FILM_SQUARE_R;
        double *to = sums + (plane - (is_rest ? FILM_REST_R - FILM_SUM_R : 0)) * pixels;
        const float *from = c->planes + plane * pixels;
        for (size_t i = 0; i < pixels; i++) to[i] += from[i];
    }
}

static void split_planes(const brume_checkpoint_head *h, const double *sums, float *planes) {
    size_t pixels = (size_t)h->width * h->height;
    for (size_t i = 0; i < plane_count(h) * pixels; i++) planes[i] = (float)sums[i];
    for (size_t i = 0; i < 3 * pixels; i++)
        planes[FILM_REST_R * pixels + i] = (float)(sums[i] - planes[FILM_SUM_R * pixels + i]);
}

/* Samples that the part went through, pixel by pixel: in a pass under way the tiles done have more. */
static void add_rendered(const brume_checkpoint_head *h, uint32_t *rendered) {
    brume_film_layout tiles = brume_film_layout_make(h->width, h->height, h->lanes);
    for (uint32_t y = 0; y < h->height; y++)
        for (uint32_t x = 0; x < h->width; x++) {
            int passed = brume_film_slot_of(&tiles, x, y) / h->lanes < h->groups_done;
            rendered[(size_t)y * h->width + x] += h->samples_done + (passed ? h->pass_samples : 0);
        }
}

static brume_result add_part(brume_merged *m, const part *p, double *sums) {
    brume_checkpoint c;
    BRUME_TRY(brume_checkpoint_read(m->context, p->path, &c));
    brume_result result = BRUME_OK;
    if (memcmp(&c.head, &p->head, sizeof c.head) != 0) {
        result = brume_fail(m->context, BRUME_ERROR_CHECKPOINT, "%s: changed while it was being read", p->path);
    } else {
        add_planes(&c, sums);
        add_rendered(&c.head, m->rendered);
        m->stats.render_seconds += p->head.render_seconds;
        m->stats.pilot_seconds += p->head.pilot_seconds;
        if (p->head.bad[BAD_COUNT]) {
            m->stats.bad_samples += p->head.bad[BAD_COUNT];
            m->stats.bad_pixel_x = p->head.bad[BAD_PIXEL] % p->head.full_width;
            m->stats.bad_pixel_y = p->head.bad[BAD_PIXEL] / p->head.full_width;
            m->stats.bad_sample = p->head.bad[BAD_SAMPLE];
        }
    }
    brume_checkpoint_free(&c);
    return result;
}

static void fill_stats(brume_merged *m, const part *parts, size_t count, int complete) {
    const brume_checkpoint_head *h = &m->head;
    brume_render_stats *s = &m->stats;
    int several = 0;
    for (size_t i = 1; i < count; i++) several |= strcmp(parts[i].head.device, h->device) != 0;
    snprintf(m->device, sizeof m->device, "%s%s", h->device, several ? " and others" : "");
    s->width = h->width;
    s->height = h->height;
    s->full_width = h->full_width;
    s->full_height = h->full_height;
    s->crop_x = h->crop_x;
    s->crop_y = h->crop_y;
    s->lanes = h->lanes;
    s->first_sample = h->first_sample;
    s->sample_count = (uint32_t)(end_of(&parts[count - 1]) - h->first_sample);
    s->seed = h->seed;
    s->strategy = (brume_strategy)h->strategy;
    s->positions = h->positions;
    s->indirect = (brume_indirect)h->indirect;
    s->without = h->without;
    s->effects = h->stats_effects;
    s->complete = (uint32_t)complete;
    s->relmse = s->relmse_low = s->relmse_high = s->order = -1;
    for (size_t i = 0; i < (size_t)h->width * h->height; i++) s->samples += m->rendered[i];
}

static brume_result merge_parts(brume_context *context, part *parts, size_t count, const brume_merge_desc *desc,
                                brume_merged *m) {
    list missing = {{0}, 0};
    qsort(parts, count, sizeof *parts, by_first_sample);
    BRUME_TRY(check_ranges(context, parts, count, desc, &missing));
    const brume_checkpoint_head *h = &parts[0].head;
    size_t pixels = (size_t)h->width * h->height, values = plane_count(h) * pixels;
    double *sums = calloc(values, sizeof *sums);
    m->head = *h;
    m->layout = brume_film_layout_make(h->width, h->height, 1);
    m->planes = malloc(values * sizeof *m->planes);
    m->rendered = calloc(pixels, sizeof *m->rendered);
    brume_result result = BRUME_OK;
    if (!sums || !m->planes || !m->rendered)
        result = brume_fail(context, BRUME_ERROR_MEMORY, "adding up films: out of memory");
    for (size_t i = 0; i < count && result == BRUME_OK; i++) result = add_part(m, &parts[i], sums);
    if (result == BRUME_OK) {
        split_planes(h, sums, m->planes);
        fill_stats(m, parts, count, missing.length == 0);
        if (missing.length) brume_warn(context, "samples are missing: %s", missing.text);
    }
    free(sums);
    return result;
}

brume_result brume_merge(brume_context *context, const char *const *paths, size_t count, const brume_merge_desc *given,
                         brume_merged **out) {
    if (!context) return BRUME_ERROR_ARGUMENT;
    if (!paths || count == 0 || !out)
        return brume_fail(context, BRUME_ERROR_ARGUMENT, "brume_merge: NULL argument, or no files");
    brume_merge_desc desc = given ? *given : brume_merge_desc_default();
    if (desc.cookie != MERGE_COOKIE)
        return brume_fail(context, BRUME_ERROR_ARGUMENT,
                          "brume_merge: the descriptor does not come from brume_merge_desc_default()");
    part *parts = calloc(count, sizeof *parts);
    brume_merged *m = calloc(1, sizeof *m);
    brume_result result = BRUME_OK;
    if (!parts || !m) {
        free(parts);
        free(m);
        return brume_fail(context, BRUME_ERROR_MEMORY, "adding up films: out of memory");
    }
    m->context = brume_context_retain(context);
    result = read_heads(context, paths, count, parts);
    if (result == BRUME_OK) result = merge_parts(context, parts, count, &desc, m);
    free(parts);
    if (result == BRUME_OK)
        *out = m;
    else
        brume_merged_destroy(m);
    return result;
}

/* ---- what came out ---- */

void brume_merged_destroy(brume_merged *merged) {
    if (!merged) return;
    free(merged->planes);
    free(merged->rendered);
    brume_context_release(merged->context);
    free(merged);
}

brume_result brume_merged_read(brume_merged *m, brume_channel channel, float *out, size_t count) {
    if (!m) return BRUME_ERROR_ARGUMENT;
    size_t pixels = (size_t)m->head.width * m->head.height, needed = pixels * (size_t)brume_channel_size(channel);
    if (!out || needed == 0)
        return brume_fail(m->context, BRUME_ERROR_ARGUMENT, "brume_merged_read: NULL, or no channel %d", (int)channel);
    if (count != needed)
        return brume_fail(m->context, BRUME_ERROR_ARGUMENT, "brume_merged_read: room for %zu floats, expected %zu",
                          count, needed);
    if (!brume_channel_is_recorded(m->head.recorded, channel))
        return brume_fail(m->context, BRUME_ERROR_ARGUMENT, "brume_merged_read: these renders did not record %s",
                          brume_channel_name(channel) ? brume_channel_name(channel) : "alpha");
    if (channel == BRUME_CHANNEL_ERROR) channel = BRUME_CHANNEL_VARIANCE;
    if (channel == BRUME_CHANNEL_BAD_SAMPLES)
        for (size_t i = 0; i < pixels; i++) out[i] = (float)m->rendered[i] - m->planes[FILM_COUNT * pixels + i];
    else
        brume_film_resolve(&m->layout, m->planes, m->head.filter_weight, channel, out);
    brume_film_to_scene_light(m->head.light_unit, channel, out, count);
    return BRUME_OK;
}

static brume_result read_merged(void *of, brume_channel channel, float *out, size_t count) {
    return brume_merged_read(of, channel, out, count);
}

brume_result brume_merged_write(brume_merged *m, const char *path, const brume_picture_desc *desc) {
    if (!m) return BRUME_ERROR_ARGUMENT;
    brume_picture_source from = {.context = m->context, .stats = m->stats, .recorded = m->head.recorded,
                                 .alpha = m->head.alpha, .half = m->head.half, .sampler = m->head.sampler,
                                 .device = m->device, .read = read_merged, .of = m};
    memcpy(from.world_to_camera, m->head.world_to_camera, sizeof from.world_to_camera);
    memcpy(from.world_to_ndc, m->head.world_to_ndc, sizeof from.world_to_ndc);
    return brume_picture_write(&from, "brume_merged_write", path, desc);
}

brume_result brume_merged_get_stats(const brume_merged *merged, brume_render_stats *out) {
    if (!merged) return BRUME_ERROR_ARGUMENT;
    if (!out) return brume_fail(merged->context, BRUME_ERROR_ARGUMENT, "brume_merged_get_stats: NULL argument");
    *out = merged->stats;
    return BRUME_OK;
}

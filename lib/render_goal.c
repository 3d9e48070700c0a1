/* render_goal.c -- when a render is done, and what it does until then.
 *
 * All pixels start alike, and their samples are doubled until the picture's error can be told (error_estimate.h). With
 * a target, a limit or a budget in view samples are then placed where the error is (sample_allocation.h), in stages:
 * each looks ahead by not more than a factor, because what lies further is another order of convergence, and
 * ends with a new estimate. Decisions depend on the film alone, never on time, except with a time limit.
 */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "render.h"

enum {
    FIRST_STAGE = 8,            /* samples per pixel */
    LEAST_SAMPLES = 16,         /* before an estimate is believed so far as to stop at it */
    PARTS = 16,                 /* of a power of two, after which the last stage before a target may end */
    MOST_SAMPLES = 1 << 20      /* of one pixel, in adaptive sampling */
};

/* How much a stage of adaptive sampling lowers the error, on the way to a target, at most: with 4 it was often
 * overshot by as much. And how much it raises the samples, towards a limit: there a stage more is time lost. */
#define STAGE_ERROR 2.0
#define STAGE_SAMPLES 4.0

static int is_power_of_two(uint32_t n) { return (n & (n - 1)) == 0; }

static int has_goal(const brume_render_desc *d) {
    return d->noise_threshold > 0 || d->time_limit > 0 || d->adaptive == BRUME_ADAPTIVE_ON;
}

int brume_goal_exists(const brume_render *r) { return has_goal(&r->desc); }

static int may_adapt(const brume_render_desc *d) { return d->adaptive != BRUME_ADAPTIVE_OFF && has_goal(d); }

int brume_goal_may_choose(const brume_render_desc *d, uint32_t sample) {
    return may_adapt(d) && sample >= FIRST_STAGE;
}

/* The film's mean and sample count, malloc'ed. */
static brume_result read_film(brume_render *r, float **mean, float **count) {
    size_t pixels = (size_t)r->layout.width * r->layout.height;
    float *planes = NULL;
    *mean = malloc(3 * pixels * sizeof **mean);
    *count = malloc(pixels * sizeof **count);
    brume_result result = BRUME_OK;
    if (!*mean || !*count)
        result = brume_fail(r->device->context, BRUME_ERROR_MEMORY, "estimating the error: out of memory");
    if (result == BRUME_OK) result = brume_render_read_planes(r, FILM_PLANES, &planes);
    if (result == BRUME_OK) {
        brume_film_resolve(&r->layout, planes, r->params.filter_weight, BRUME_CHANNEL_RADIANCE, *mean);
        brume_film_resolve(&r->layout, planes, r->params.filter_weight, BRUME_CHANNEL_SAMPLE_COUNT, *count);
    }
    free(planes);
    return result;
}

static brume_result estimate(brume_render *r, const float *count) {
    brume_error_result error = brume_error_estimate_picture(&r->estimate, count);
    if (error.no_memory)
        return brume_fail(r->device->context, BRUME_ERROR_MEMORY, "estimating the error: out of memory");
    r->error = error;
    return BRUME_OK;
}

brume_result brume_goal_look(brume_render *r, uint32_t samples) {
    /* Ranges that start elsewhere are not nets. */
    if (r->desc.first_sample % samples != 0 || !is_power_of_two(samples)) return BRUME_OK;
    float *mean, *count;
    brume_result result = read_film(r, &mean, &count);
    if (result == BRUME_OK) {
        int level = 0;
        while (1u << level < samples) level++;
        brume_error_estimate_update(&r->estimate, mean, count, level);
        /* Within an adaptive stage most pixels are as they were. */
        r->looked = !r->ends || r->samples_done >= r->stage_end;
        if (r->looked) result = estimate(r, count);
        if (result == BRUME_OK && may_adapt(&r->desc) && r->looked && r->error.known) {
            brume_allocation_free(r->allocation);
            r->allocation = brume_allocation_create(&r->estimate, brume_predict_order(r), MOST_SAMPLES);
            if (!r->allocation)
                result = brume_fail(r->device->context, BRUME_ERROR_MEMORY, "placing samples: out of memory");
        }
    }
    free(mean);
    free(count);
    return result;
}

brume_result brume_goal_last_look(brume_render *r) {
    if (r->looked || !r->error.known) return BRUME_OK;
    /* A range that starts in the middle of a net has been looked at for a part of it only, and is none. */
    uint32_t net = 1;
    while (net <= r->samples_done / 2) net *= 2;
    if (r->desc.first_sample % net != 0) {
        r->error.known = 0;
        return BRUME_OK;
    }
    float *mean, *count;
    brume_result result = read_film(r, &mean, &count);
    if (result == BRUME_OK) result = estimate(r, count);
    free(mean);
    free(count);
    return result;
}

/* Samples are placed by the allocation from now on. */
static brume_result start_adapting(brume_render *r) {
    size_t pixels = (size_t)r->layout.width * r->layout.height;
    r->done = malloc(pixels * sizeof *r->done);
    r->ends = malloc(pixels * sizeof *r->ends);
    if (!r->done || !r->ends) {
        free(r->done);
        free(r->ends);
        r->done = r->ends = NULL;
        return brume_fail(r->device->context, BRUME_ERROR_MEMORY, "placing samples: out of memory");
    }
    for (size_t i = 0; i < pixels; i++) r->done[i] = r->ends[i] = r->samples_done;
    r->stats.adaptive = 1;
    return BRUME_OK;
}

/* A stage that brings some pixels more samples, or the end. */
static void next_adaptive_stage(brume_render *r, double budget) {
    const brume_render_desc *d = &r->desc;
    size_t pixels = (size_t)r->layout.width * r->layout.height;
    double now, error, then, unused;
    brume_allocation_predict(r->allocation, 0, &now, &error);
    int most = brume_allocation_for_samples(r->allocation, budget - brume_mean_samples(r) + now);
    int detail = brume_allocation_for_samples(r->allocation, STAGE_SAMPLES * now);
    if (d->noise_threshold > 0) {
        double wanted = fmax(d->noise_threshold / r->error.relmse, 1 / STAGE_ERROR) * error;
        detail = error > 0 ? brume_allocation_for_error(r->allocation, wanted) : 0;
        /* The target is not reached yet: somebody has to go on. */
        brume_allocation_predict(r->allocation, detail, &then, &unused);
        while (then <= now && detail < most) brume_allocation_predict(r->allocation, ++detail, &then, &unused);
    }
    if (detail > most) detail = most;
    brume_allocation_predict(r->allocation, detail, &then, &unused);
    if (then <= now && !(d->noise_threshold > 0)) {
        r->finished = 1;
        return;
    }
    brume_allocation_counts(r->allocation, detail, r->ends);
    uint32_t lowest = UINT32_MAX;
    for (size_t i = 0; i < pixels; i++) {
        if (r->ends[i] > r->stage_end) r->stage_end = r->ends[i];
        if (r->done[i] < r->ends[i] && r->done[i] < lowest) lowest = r->done[i];
    }
    r->finished = lowest == UINT32_MAX;
    r->samples_done = r->finished ? r->stage_end : lowest;
}

/* The next power of two, or less if that is to be enough. */
static uint32_t next_uniform_stage(const brume_render *r) {
    uint32_t next = FIRST_STAGE;
    int level = 0;
    while (next <= r->samples_done) next *= 2;
    while (1u << level < r->samples_done) level++;
    if (!(r->desc.noise_threshold > 0) || !r->error.known || 1u << level != r->samples_done) return next;
    for (uint32_t n = r->samples_done + next / PARTS; n < next; n += next / PARTS) {
        double growth = brume_error_estimate_growth(n, level, r->error.order);
        if (n >= LEAST_SAMPLES && r->error.relmse * growth <= r->desc.noise_threshold) return n;
    }
    return next;
}

brume_result brume_goal_next_stage(brume_render *r, double seconds) {
    const brume_render_desc *d = &r->desc;
    uint32_t most = d->sample_count;
    if (!brume_goal_exists(r)) {
        r->finished = r->samples_done >= most;
        r->stage_end = most;
        return BRUME_OK;
    }
    /* A stage that ended between powers of two, because its error was to be low enough there. */
    if (d->noise_threshold > 0 && !r->ends && !is_power_of_two(r->samples_done)) BRUME_TRY(brume_goal_last_look(r));
    double work = brume_mean_samples(r), budget = most;
    if (work > r->stage_work && seconds > r->stage_seconds)
        r->rate = (work - r->stage_work) / (seconds - r->stage_seconds);
    r->stage_work = work;
    r->stage_seconds = seconds;
    if (d->time_limit > 0 && r->rate > 0) budget = fmin(most, work + r->rate * fmax(0, brume_run_limit(r) - seconds));
    brume_predict(r, seconds);
    int reached = d->noise_threshold > 0 && r->error.known && r->error.relmse <= d->noise_threshold;
    if ((reached && r->stage_end >= LEAST_SAMPLES) ||
        (d->time_limit > 0 && seconds >= brume_run_limit(r)) || work >= most || (!r->ends && r->samples_done >= most)) {
        r->finished = 1;
        return BRUME_OK;
    }
    if (!r->ends && !reached && is_power_of_two(r->samples_done) && r->error.known && may_adapt(&r->desc) && r->allocation) {
        double adapted, uniform;
        if (d->noise_threshold > 0) {
            adapted = brume_predict_samples(r, d->noise_threshold);
            uniform = brume_predict_uniform(r, d->noise_threshold);
        } else {
            adapted = brume_predict_relmse(r, budget);
            uniform = r->error.relmse * pow(budget / work, -brume_predict_order(r));
        }
        int pays = adapted * BRUME_WORTHWHILE < uniform;
        if (d->adaptive == BRUME_ADAPTIVE_ON || pays) {
            brume_result result = start_adapting(r);
            if (result != BRUME_OK) return result;
        }
    }
    if (r->ends) {
        next_adaptive_stage(r, budget);
    } else {
        uint32_t next = next_uniform_stage(r);
        r->stage_end = next < most ? next : most;
    }
    return BRUME_OK;
}

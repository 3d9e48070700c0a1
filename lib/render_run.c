/* render_run.c -- the loop of a render: pilot, stages, passes, launches, progress.
 *
 * Work is cut into passes over the film of a few samples each, and a pass into launches sized by time, so that
 * progress, cancelling and GPU watchdogs work. How it is cut never changes the film (cl/film.h). What the passes lead
 * up to is render_goal.c's to decide.
 */
#include <stdlib.h>
#include <string.h>

#include "platform.h"
#include "render.h"

#define LAUNCH_SECONDS 0.05
#define CREW_SECONDS 0.1 /* of several devices, which cut it in chunks and wait for each other at its end */
enum {
    MAX_PASS_SAMPLES = 16,         /* enough for lanes to take turns, few enough for a picture that fills evenly */
    MAX_CREW_SAMPLES = 64,         /* several devices move the film's slots to and fro for each */
    MAX_ADAPTIVE_SAMPLES = 256     /* a pass of some pixels only costs the schedule of all */
};

void brume_render_cancel(brume_render *render) {
    if (render) __atomic_store_n(&render->cancelled, 1, __ATOMIC_RELAXED);
}

/* A run, from one call to the next. */
typedef struct run {
    double start, work_at_start, last_report;
    brume_progress_callback callback;
    void *user;
} run;

static double spent(const brume_render *render, const run *now) {
    return render->stats.render_seconds + brume_seconds() - now->start;
}

static int report_progress(brume_render *r, run *now) {
    brume_progress p;
    memset(&p, 0, sizeof p);
    double total = (double)r->desc.sample_count * r->layout.group_count, seconds = spent(r, now);
    p.seconds = brume_seconds() - now->start;
    p.fraction = total > 0 ? r->work / total : 1;
    p.seconds_left =
        r->work > now->work_at_start ? p.seconds * (total - r->work) / (r->work - now->work_at_start) : 0;
    p.relmse = r->error.known ? r->error.relmse : -1;
    p.relmse_low = r->error.known ? r->error.low : -1;
    p.relmse_high = r->error.known ? r->error.high : -1;
    p.work = r->work / r->layout.group_count;
    p.predicted_seconds = p.predicted_low = p.predicted_high = p.predicted_relmse = p.predicted_work = -1;
    brume_prediction *soon = &r->prediction;
    soon->fresh = 0;
    now->last_report = brume_seconds();
    if (soon->known) {
        p.predicted_seconds = soon->seconds;
        p.predicted_low = soon->low;
        p.predicted_high = soon->high;
        p.predicted_relmse = soon->relmse;
        p.predicted_work = soon->work;
        p.seconds_left = soon->seconds - seconds;
    } else if (r->desc.time_limit > 0) {
        p.seconds_left = r->desc.time_limit - r->create_seconds - seconds;
    }
    if (p.seconds_left < 0 || r->finished) p.seconds_left = 0;
    if (brume_goal_exists(r)) p.fraction = seconds + p.seconds_left > 0 ? seconds / (seconds + p.seconds_left) : 1;
    if (r->finished) p.fraction = 1;
    brume_render_stats stats;
    brume_render_get_stats(r, &stats);
    p.samples = stats.samples;
    return now->callback(now->user, &p);
}

/* Groups that keep the whole device busy. */
static size_t least_groups(const brume_render *render) {
    return render->crew ? brume_crew_least_groups(render->crew)
                        : render->device->info.compute_units * render->local_size;
}

/* How many groups take about LAUNCH_SECONDS. Never fewer than keep the whole device busy: a smaller launch takes just
 * as long there, would be measured as slower, and the next one would be smaller still. */
static uint32_t launch_size(const brume_render *render, uint32_t samples, uint32_t left) {
    if (render->launch_groups) return render->launch_groups < left ? render->launch_groups : left;
    double wanted = render->groups_per_second * (render->crew ? CREW_SECONDS : LAUNCH_SECONDS) / samples;
    if (wanted < (double)least_groups(render)) wanted = (double)least_groups(render);
    if (render->most_groups && wanted > render->most_groups) wanted = render->most_groups;
    return wanted < left ? (uint32_t)wanted : left;
}

/* One launch of the pilot, which takes about as long as a sample. */
static brume_result run_pilot(brume_render *render) {
    uint32_t groups = launch_size(render, 1, render->layout.group_count - render->pilot_done);
    double before = brume_seconds();
    cl_int code = brume_render_launch(render, render->pilot_done, groups, PILOT_SAMPLE, 1, LAUNCH_PILOT);
    double seconds = brume_seconds() - before;
    render->stats.pilot_seconds += seconds;
    /* What has run of it may run again: the same plan comes out. */
    if (code != CL_SUCCESS && brume_render_shrink_launches(render, groups, code)) return BRUME_OK;
    if (code != CL_SUCCESS) return brume_fail_cl(render->device->context, code, "rendering the pilot");
    if (seconds > 0) render->groups_per_second = (double)groups / seconds;
    render->pilot_done += groups;
    return BRUME_OK;
}

brume_result brume_render_write_schedule(brume_render *r) {
    size_t size;
    cl_int *schedule = brume_render_make_schedule(r, &size);
    if (!schedule) return brume_fail(r->device->context, BRUME_ERROR_MEMORY, "placing samples: out of memory");
    cl_int code = CL_SUCCESS;
    if (size) code = brume_render_put(r, BRUME_FILM_SCHEDULE, 0, size, schedule);
    free(schedule);
    return code == CL_SUCCESS ? BRUME_OK : brume_fail_cl(r->device->context, code, "placing samples");
}

/* 1, 1, 2, 4, ...: a whole picture soon, then long passes; never across a power of two, where the error is taken, and
 * not so long that the smallest launch takes more than LAUNCH_SECONDS. */
static brume_result begin_pass(brume_render *r) {
    uint32_t left = r->stage_end - r->samples_done, power = 1;
    while (power <= r->samples_done) power *= 2;
    uint32_t size = r->samples_done ? power - r->samples_done : 1;
    uint32_t most = r->ends ? MAX_ADAPTIVE_SAMPLES : r->crew ? MAX_CREW_SAMPLES : MAX_PASS_SAMPLES;
    size = size < most ? size : most;
    double affordable = r->groups_per_second * LAUNCH_SECONDS / (double)least_groups(r);
    if (affordable < size) size = affordable > 1 ? (uint32_t)affordable : 1;
    r->pass.samples = size < left ? size : left;
    r->pass.groups = r->layout.group_count;
    r->pass.groups_done = 0;
    brume_result result = brume_render_note_counts(r);
    if (result == BRUME_OK && r->ends) result = brume_render_write_schedule(r);
    if (result != BRUME_OK) r->pass.samples = 0; /* not begun */
    return result;
}

/* Moves on to the least samples that some pixel has while it is to have more. */
static void end_adaptive_pass(brume_render *r) {
    size_t pixels = (size_t)r->layout.width * r->layout.height;
    uint32_t next = r->stage_end;
    for (size_t i = 0; i < pixels; i++) {
        if (r->done[i] == r->samples_done && r->ends[i] > r->done[i]) r->done[i] += r->pass.samples;
        if (r->done[i] < r->ends[i] && r->done[i] < next) next = r->done[i];
    }
    r->samples_done = next;
}

/* The look at the film that is due: if it fails, it still is. */
static brume_result look(brume_render *r) {
    brume_result result = r->look_at ? brume_goal_look(r, r->look_at) : BRUME_OK;
    if (result == BRUME_OK) r->look_at = 0;
    return result;
}

static brume_result end_pass(brume_render *r) {
    uint32_t samples = r->samples_done + r->pass.samples;
    if (r->ends)
        end_adaptive_pass(r);
    else
        r->samples_done = samples;
    r->pass.samples = 0;
    r->pass.groups_done = 0;
    if (r->desc.error_estimate && (samples & (samples - 1)) == 0) r->look_at = samples;
    return look(r);
}

static brume_result run_launch(brume_render *r, const run *now) {
    uint32_t groups = launch_size(r, r->pass.samples, r->pass.groups - r->pass.groups_done);
    double before = brume_seconds();
    cl_int code = brume_render_launch(r, r->pass.groups_done, groups, r->desc.first_sample + r->samples_done,
                                      r->pass.samples, (r->ends ? LAUNCH_ADAPTIVE : 0) | brume_render_chosen(r));
    if (code != CL_SUCCESS) {
        r->pass.doubtful = groups;
        r->pass.doubtful_lanes = r->program.lanes;
        r->looked = 0;
        if (brume_render_shrink_launches(r, groups, code)) return BRUME_OK;
        return brume_fail_cl(r->device->context, code, "rendering");
    }
    double seconds = brume_seconds() - before;
    if (seconds > 0) r->groups_per_second = (double)groups * r->pass.samples / seconds;
    r->pass.groups_done += groups;
    r->work += (double)groups * r->pass.samples;
    r->looked = 0;
    brume_result result = r->pass.groups_done == r->pass.groups ? end_pass(r) : BRUME_OK;
    if (r->desc.time_limit > 0 &&
        r->create_seconds + spent(r, now) + 0.5 * seconds >= r->desc.time_limit) r->finished = 1;
    return result;
}

static brume_result run_step(brume_render *r, const run *now) {
    if (r->pass.doubtful) {
        BRUME_TRY(brume_render_settle(r));
        return !r->pass.doubtful && r->pass.groups_done == r->pass.groups ? end_pass(r) : BRUME_OK;
    }
    if (r->look_at) return look(r);
    if (r->desc.time_limit > 0 && r->create_seconds + spent(r, now) >= r->desc.time_limit) {
        r->finished = 1;
        return BRUME_OK;
    }
    if (r->needs_pilot && r->pilot_done < r->layout.group_count) return run_pilot(r);
    if (r->pass.samples > 0) return run_launch(r, now);
    brume_result result = BRUME_OK;
    if (r->samples_done >= r->stage_end) result = brume_goal_next_stage(r, spent(r, now));
    if (result == BRUME_OK && !r->finished) result = begin_pass(r);
    /* Nobody left in it: a stage that asked for no more than there is. */
    if (result == BRUME_OK && !r->finished && r->pass.groups == 0) result = end_pass(r);
    return result;
}

brume_result brume_render_run(brume_render *render, brume_progress_callback callback, void *user) {
    if (!render) return BRUME_ERROR_ARGUMENT;
    run now = {brume_seconds(), render->work, brume_seconds(), callback, user};
    brume_result result = BRUME_OK;
    render->running_since = now.start;
    if (render->crew) brume_crew_revive(render->crew);
    while (!render->finished && result == BRUME_OK) {
        if (__atomic_exchange_n(&render->cancelled, 0, __ATOMIC_RELAXED)) {
            result = BRUME_CANCELLED;
            break;
        }
        result = run_step(render, &now);
        int due = render->prediction.fresh || brume_seconds() - now.last_report > render->report_seconds;
        if (callback && result == BRUME_OK && due && report_progress(render, &now)) brume_render_cancel(render);
    }
    render->stats.complete = render->finished;
    if (render->desc.error_estimate && (result == BRUME_OK || result == BRUME_CANCELLED)) {
        brume_result look = brume_goal_last_look(render);
        if (look != BRUME_OK) result = look;
    }
    if (callback && (result == BRUME_OK || result == BRUME_CANCELLED)) report_progress(render, &now);
    render->stats.render_seconds += brume_seconds() - now.start;
    render->running_since = 0;
    if (render->crew) brume_crew_add_stats(render);
    if (render->crew && render->finished) brume_crew_report(render);
    if (result != BRUME_OK && result != BRUME_CANCELLED) return result;
    BRUME_TRY(brume_render_count_bad(render));
    if (result == BRUME_CANCELLED) brume_info(render->device->context, "the render was cancelled");
    return result;
}

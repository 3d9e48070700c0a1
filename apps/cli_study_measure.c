/* The renders of a study, and what they cost. */
#include <string.h>
#include <stdlib.h>

#include "cli_study.h"
#include "picture_file.h"
#include "platform.h"

enum { MOST_SAMPLES = 1 << (STUDY_POINTS - 1) };

/* What the bar shows is the whole study. */
typedef struct watched {
    study *s;
    double before, limit; /* of this run: seconds in earlier steps; in all */
} watched;

static int on_progress(void *user, const brume_progress *progress)
{
    const watched *w = user;
    const study *s = w->s;
    brume_progress all = *progress;
    double here = w->before + progress->seconds;
    double done = s->behind + (here < w->limit ? here : w->limit);
    all.seconds = cli_now() - s->begun;
    all.fraction = s->planned > 0 ? done / s->planned : 1;
    all.seconds_left = s->planned - done;
    return cli_progress_update(s->progress, &all);
}

/* One setting's way from one power of two to the next. */
typedef struct climb {
    study *s;
    const char *stem;
    int seed_letter, all;
    uint32_t most;
    int anew;      /* a render of its own for every point */
    float *rgb;
    double cpu;    /* seconds of this render */
    watched watch; /* `before`: of all renders */
    study_run run;
    int code;
} climb;

static brume_result keep_picture(climb *c, brume_render *render, uint32_t samples)
{
    char path[STUDY_PATH];
    const study *s = c->s;
    brume_result result = brume_render_read(render, BRUME_CHANNEL_RADIANCE, c->rgb, 3 * (size_t)s->width * s->height);
    if (result)
        return result;
    study_picture_path(s, c->stem, c->seed_letter, samples, path);
    int error = picture_write_pfm(path, c->rgb, s->width, s->height);
    if (error)
        c->code = study_not_written(path, error);
    return BRUME_OK;
}

/* Renders up to the next point. *last: whether there should be no other. */
static brume_result reach(climb *c, brume_render *render, uint32_t samples, int *last)
{
    brume_render_stats stats;
    double before = platform_cpu_seconds();
    brume_result result = brume_render_run(render, on_progress, &c->watch);
    c->cpu += platform_cpu_seconds() - before;
    if (!result)
        result = brume_render_get_stats(render, &stats);
    if (result)
        return result;
    study_run *run = &c->run;
    study_run_point *point = &run->points[run->count++];
    point->samples = samples;
    point->seconds = stats.render_seconds;
    point->cpu_seconds = c->cpu;
    point->estimated = stats.relmse;
    point->bad_samples = stats.bad_samples;
    if (run->count == 1) { /* later renders find the program built */
        run->bvh_seconds = stats.bvh_seconds;
        run->upload_seconds = stats.upload_seconds;
        run->build_seconds = stats.build_seconds;
        run->pilot_seconds = stats.pilot_seconds;
    }
    c->watch.before = stats.render_seconds + (c->anew ? c->watch.before : 0);
    /* curves_goes_on looks at twice the time it is given: what the next point would end at. */
    double half = stats.render_seconds + (c->anew ? 0.5 * c->watch.before : 0);
    *last = c->most ? samples >= c->most : !curves_goes_on(half, c->watch.limit, samples, MOST_SAMPLES);
    return c->all || *last ? keep_picture(c, render, samples) : BRUME_OK;
}

static brume_result climb_up(climb *c, brume_render_desc desc)
{
    brume_render *render = NULL;
    brume_result result = BRUME_OK;
    int last = 0;
    for (uint32_t samples = 1; !result && !c->code && !last; samples *= 2) {
        if (render) {
            result = brume_render_set_sample_count(render, samples);
        } else {
            desc.sample_count = samples;
            c->cpu = 0;
            result = brume_render_create(c->s->session.device, c->s->session.scene, &desc, &render);
        }
        if (result)
            break;
        /* A signal that came while kernels were built is heeded by the first run. */
        cli_interruptible(render);
        if (cli_signal())
            brume_render_cancel(render);
        result = reach(c, render, samples, &last);
        cli_interruptible(NULL);
        if (c->anew) {
            brume_render_destroy(render);
            render = NULL;
        }
    }
    brume_render_destroy(render);
    return result;
}

int study_measure(study *s, const study_edit *edit, const char *stem, int seed_letter, uint32_t seed, double limit,
                  uint32_t most, int all, study_run *out)
{
    brume_render_desc desc = edit->render;
    climb c = {.s = s, .stem = stem, .seed_letter = seed_letter, .all = all, .most = most, .watch = {s, 0, limit}};
    c.anew = desc.adaptive == BRUME_ADAPTIVE_ON;
    c.rgb = malloc(3 * (size_t)s->width * s->height * sizeof *c.rgb);
    if (!c.rgb)
        return study_out_of_memory();
    desc.guides = 0;
    desc.quick_start = 0; /* what is timed is one program */
    desc.first_sample = 0;
    desc.use_seed = 1;
    desc.seed = seed;
    brume_result result = brume_scene_set_integrator(s->session.scene, &edit->integrator);
    if (!result)
        result = climb_up(&c, desc);
    if (cli_signal() && (result == BRUME_OK || result == BRUME_CANCELLED))
        c.code = CLI_EXIT_SIGNAL + cli_signal();
    else if (result)
        c.code = cli_report(s->context, result);
    if (!c.code)
        *out = c.run;
    free(c.rgb);
    return c.code;
}

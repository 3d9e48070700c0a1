/* The renders of a study, and what they cost. */
#include <string.h>
#include <stdlib.h>
#include <sys/resource.h>

#include "cli_study.h"
#include "picture_file.h"

enum { MOST_SAMPLES = 1 << (STUDY_POINTS - 1) };

static double cpu_now(void)
{
    struct rusage usage;
    if (getrusage(RUSAGE_SELF, &usage) != 0)
        return 0;
    return (double)(usage.ru_utime.tv_sec + usage.ru_stime.tv_sec) +
           1e-6 * (double)(usage.ru_utime.tv_usec + usage.ru_stime.tv_usec);
}

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

static brume_result keep_picture(study *s, brume_render *render, float *rgb, const char *stem, int seed,
                                 uint32_t samples, int *code)
{
    char path[STUDY_PATH];
    size_t count = (size_t)s->width * s->height;
    brume_result result = brume_render_read(render, BRUME_CHANNEL_RADIANCE, rgb, 3 * count);
    if (result)
        return result;
    study_picture_path(s, stem, seed, samples, path);
    int error = picture_write_pfm(path, rgb, s->width, s->height);
    if (error)
        *code = study_not_written(path, error);
    return BRUME_OK;
}

/* From one power of two to the next. */
static brume_result climb(study *s, brume_render *render, float *rgb, const char *stem, int seed, double limit,
                          uint32_t most, int all, study_run *run, int *code)
{
    watched w = {s, 0, limit};
    double cpu = 0;
    for (uint32_t samples = 1;; samples *= 2) {
        brume_render_stats stats;
        brume_result result = brume_render_set_sample_count(render, samples);
        double before = cpu_now();
        if (!result)
            result = brume_render_run(render, on_progress, &w);
        cpu += cpu_now() - before;
        if (!result)
            result = brume_render_get_stats(render, &stats);
        if (result)
            return result;
        study_run_point *point = &run->points[run->count++];
        point->samples = samples;
        point->seconds = w.before = stats.render_seconds;
        point->cpu_seconds = cpu;
        point->bad_samples = stats.bad_samples;
        run->bvh_seconds = stats.bvh_seconds;
        run->upload_seconds = stats.upload_seconds;
        run->build_seconds = stats.build_seconds;
        run->pilot_seconds = stats.pilot_seconds;
        int last = most ? samples >= most : !curves_goes_on(stats.render_seconds, limit, samples, MOST_SAMPLES);
        if (all || last)
            result = keep_picture(s, render, rgb, stem, seed, samples, code);
        if (result || *code || last)
            return result;
    }
}

int study_measure(study *s, const study_edit *edit, const char *stem, int seed_letter, uint32_t seed, double limit,
                  uint32_t most, int all, study_run *out)
{
    brume_render *render = NULL;
    brume_render_desc desc = edit->render;
    study_run run;
    int code = CLI_EXIT_OK;
    float *rgb = malloc(3 * (size_t)s->width * s->height * sizeof *rgb);
    memset(&run, 0, sizeof run);
    if (!rgb)
        return study_out_of_memory();
    desc.guides = 0;
    desc.sample_count = 1;
    desc.first_sample = 0;
    desc.use_seed = 1;
    desc.seed = seed;
    brume_result result = brume_scene_set_integrator(s->session.scene, &edit->integrator);
    if (!result)
        result = brume_render_create(s->session.device, s->session.scene, &desc, &render);
    /* A signal that came while kernels were built is heeded by the first run. */
    if (!result) {
        cli_interruptible(render);
        if (cli_signal())
            brume_render_cancel(render);
        result = climb(s, render, rgb, stem, seed_letter, limit, most, all, &run, &code);
    }
    cli_interruptible(NULL);
    if (cli_signal() && (result == BRUME_OK || result == BRUME_CANCELLED))
        code = CLI_EXIT_SIGNAL + cli_signal();
    else if (result)
        code = cli_report(s->context, result);
    if (!code)
        *out = run;
    brume_render_destroy(render);
    free(rgb);
    return code;
}

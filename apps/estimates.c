/* estimates -- is a picture as wrong as it says, and done when it said? Renders scenes to three target errors with many
 * seeds; compares the estimated error with the true one against a reference of a hundredth of the error (at most a
 * tenth, or the row is left out), and the work and the time that were predicted with what it took. A table in Markdown
 * goes to standard output.
 *
 * Predictions of work are the same on every run; those of time are of this machine, and of what else it does. */
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "brume.h"
#include "error_metrics.h"

enum { MOST_SEEDS = 64, TARGETS = 3, MOST = 10 * TARGETS * MOST_SEEDS };

/* Targets: what 16 samples of every pixel reach, divided by these. */
static const double divisors[TARGETS] = {2, 6, 18};

/* A prediction counts if at least so many times the work that had been done was still to come in the end. */
#define AHEAD 3

static const char *const scenes[] = {"open-beam",   "half-hidden", "slats",       "bunny-beam", "thick-fog",
                                     "forward-fog", "three-spots", "hundred-spots", "area-light", "environment-fog"};
enum { SCENES = sizeof scenes / sizeof scenes[0] };

typedef struct program {
    brume_context *context;
    brume_device *device;
    const char *only;
    char width[12], height[12];
    int seeds;
    double reference_seconds; /* at most */
} program;

typedef struct outcome {
    float *radiance;
    brume_render_stats stats;
    brume_progress predictions[64], last; /* each new one, and how it ended */
    int count;
} outcome;

static int note_prediction(void *user, const brume_progress *progress)
{
    outcome *o = user;
    int is_new = o->count == 0 || progress->predicted_work != o->predictions[o->count - 1].predicted_work;
    if (progress->predicted_work > 0 && is_new && o->count < 64)
        o->predictions[o->count++] = *progress;
    o->last = *progress;
    return 0;
}

static int render(const program *p, const brume_scene *scene, const brume_render_desc *desc, outcome *out)
{
    brume_render *picture = NULL;
    memset(out, 0, sizeof *out);
    brume_result result = brume_render_create(p->device, scene, desc, &picture);
    if (!result)
        result = brume_render_run(picture, note_prediction, out);
    if (!result)
        result = brume_render_get_stats(picture, &out->stats);
    size_t pixels = (size_t)out->stats.width * out->stats.height;
    out->radiance = malloc(3 * pixels * sizeof *out->radiance + 1);
    if (!result && out->radiance)
        result = brume_render_read(picture, BRUME_CHANNEL_RADIANCE, out->radiance, 3 * pixels);
    brume_render_destroy(picture);
    if (result)
        fprintf(stderr, "estimates: error: %s\n", brume_context_message(p->context));
    return !result && out->radiance;
}

static int ascending(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double median(const double *values, int count)
{
    double sorted[MOST];
    memcpy(sorted, values, (size_t)count * sizeof *values);
    qsort(sorted, (size_t)count, sizeof *sorted, ascending);
    return count ? 0.5 * (sorted[count / 2] + sorted[(count - 1) / 2]) : NAN;
}

static double share_within(const double *values, int count, double low, double high)
{
    int inside = 0;
    for (int i = 0; i < count; i++)
        inside += values[i] >= low && values[i] <= high;
    return count ? 100.0 * inside / count : NAN;
}

/* Of each picture; of predictions, those that count. */
typedef struct ratios {
    double errors[MOST];                                 /* true over estimated */
    double first[MOST], inside[MOST];                    /* predicted over needed work; 1: within the interval */
    double later[MOST], times[MOST];                     /* the same when a third of it was done; of time */
    int error_count, first_count, later_count;
} ratios;

/* Whether the work that it took is in the interval, which is told as time. */
static int is_inside(const brume_progress *p, double needed)
{
    double ahead = p->predicted_seconds - p->seconds, work = p->predicted_work - p->work;
    if (!(ahead > 0) || !(work > 0))
        return 0;
    return needed >= p->work + work * (p->predicted_low - p->seconds) / ahead &&
           needed <= p->work + work * (p->predicted_high - p->seconds) / ahead;
}

static void judge_predictions(const outcome *o, ratios *r)
{
    const brume_progress *first = o->predictions, *later = NULL;
    double needed = o->last.work;
    if (o->count == 0 || first->work * AHEAD > needed)
        return;
    r->first[r->first_count] = first->predicted_work / needed;
    r->inside[r->first_count++] = is_inside(first, needed);
    for (int i = 0; i < o->count; i++)
        if (o->predictions[i].work * AHEAD <= needed)
            later = &o->predictions[i];
    r->later[r->later_count] = later->predicted_work / needed;
    r->times[r->later_count++] = later->predicted_seconds / o->last.seconds;
}

/* Of what has come since `before`. */
static void print_row(const char *scene, double target, const ratios *r, const ratios *before, double samples)
{
    const double *errors = r->errors + before->error_count, *first = r->first + before->first_count;
    const double *inside = r->inside + before->first_count, *later = r->later + before->later_count;
    const double *times = r->times + before->later_count;
    int n = r->error_count - before->error_count, m = r->first_count - before->first_count;
    printf("| %s | ", scene);
    if (target > 0)
        printf("%.2g | %.0f", target, samples);
    else
        printf(" | ");
    printf(" | %.2f | %.0f %% | ", median(errors, n), share_within(errors, n, 0.5, 2));
    if (m > 0)
        printf("%d | %.2f | %.0f %% | %.2f | %.0f %% | %.2f | %.0f %% |\n", m, median(first, m),
               share_within(inside, m, 1, 1), median(later, m), share_within(later, m, 0.67, 1.5), median(times, m),
               share_within(times, m, 0.67, 1.5));
    else
        printf("0 | | | | | | |\n");
    fflush(stdout);
}

static int measure_scene(const program *p, const char *name, ratios *r)
{
    char path[256];
    brume_parameter parameters[] = {{"width", p->width}, {"height", p->height}};
    brume_scene *scene = NULL;
    outcome pilot, reference, run;
    snprintf(path, sizeof path, "scenes/ladder/%s.xml", name);
    if (brume_scene_load(p->context, path, parameters, 2, &scene)) {
        fprintf(stderr, "estimates: error: %s\n", brume_context_message(p->context));
        return 0;
    }
    brume_render_desc desc = brume_render_desc_default();
    desc.guides = 0;
    desc.use_seed = 1;
    desc.sample_count = 16;
    desc.seed = 1000;
    if (!render(p, scene, &desc, &pilot))
        return 0;
    desc.sample_count = 0;
    desc.noise_threshold = pilot.stats.relmse / divisors[TARGETS - 1] / 100;
    desc.time_limit = p->reference_seconds;
    desc.seed = 2000;
    if (!render(p, scene, &desc, &reference))
        return 0;
    desc.time_limit = 0;
    size_t pixels = (size_t)reference.stats.width * reference.stats.height;
    for (int t = 0; t < TARGETS; t++) {
        static ratios before;
        before = *r;
        if (reference.stats.relmse < 0 || reference.stats.relmse > 0.1 * pilot.stats.relmse / divisors[t]) {
            printf("| %s | %.2g | | the reference's own error is %.2g | | | | | | | | |\n", name,
                   pilot.stats.relmse / divisors[t], reference.stats.relmse);
            continue;
        }
        double target = pilot.stats.relmse / divisors[t], samples = 0;
        for (int s = 0; s < p->seeds; s++) {
            error_metrics metrics;
            desc.noise_threshold = target;
            desc.seed = (uint32_t)s;
            if (!render(p, scene, &desc, &run) ||
                !error_metrics_compute(run.radiance, reference.radiance, pixels, 0, &metrics))
                return 0;
            r->errors[r->error_count++] = metrics.mse / run.stats.relmse;
            judge_predictions(&run, r);
            samples += (double)run.stats.samples / (double)pixels / p->seeds;
            free(run.radiance);
        }
        print_row(name, target, r, &before, samples);
    }
    free(pilot.radiance);
    free(reference.radiance);
    brume_scene_destroy(scene);
    return 1;
}

static int parse(program *p, int argc, char **argv)
{
    uint32_t width = 96, height = 60, seeds = 10;
    for (int i = 1; i < argc; i += 2) {
        char *value = i + 1 < argc ? argv[i + 1] : NULL;
        int ok = value != NULL;
        if (ok && strcmp(argv[i], "--scene") == 0)
            p->only = value;
        else if (ok && strcmp(argv[i], "--seeds") == 0)
            ok = sscanf(value, "%u", &seeds) == 1 && seeds > 0 && seeds <= MOST_SEEDS;
        else if (ok && strcmp(argv[i], "--size") == 0)
            ok = sscanf(value, "%ux%u", &width, &height) == 2 && width > 0 && height > 0;
        else if (ok && strcmp(argv[i], "--reference-seconds") == 0)
            ok = sscanf(value, "%lf", &p->reference_seconds) == 1 && p->reference_seconds > 0;
        else
            ok = 0;
        if (!ok) {
            fputs("usage: estimates [--scene NAME] [--seeds N] [--size WxH] [--reference-seconds S]\n", stderr);
            return 0;
        }
    }
    snprintf(p->width, sizeof p->width, "%u", width);
    snprintf(p->height, sizeof p->height, "%u", height);
    p->seeds = (int)seeds;
    return 1;
}

int main(int argc, char **argv)
{
    static ratios all, none;
    program p = {.reference_seconds = 60};
    if (!parse(&p, argc, argv))
        return 2;
    if (brume_context_create(&p.context) || brume_device_open(p.context, BRUME_DEVICE_ANY, &p.device)) {
        fprintf(stderr, "estimates: error: %s\n", p.context ? brume_context_message(p.context) : "out of memory");
        return 4;
    }
    puts("| scene | target relMSE | samples | true / estimated, median | in 0.5 to 2 | predictions "
         "| first / needed, median | in its interval | at a third / needed, median | in 0.67 to 1.5 "
         "| of time, median | in 0.67 to 1.5 |\n"
         "|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|");
    int ok = 1;
    for (int i = 0; i < SCENES && ok; i++)
        if (!p.only || strcmp(p.only, scenes[i]) == 0)
            ok = measure_scene(&p, scenes[i], &all);
    if (ok)
        print_row("all", 0, &all, &none, 0);
    brume_device_destroy(p.device);
    brume_context_destroy(p.context);
    return ok ? 0 : 1;
}

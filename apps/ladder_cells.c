/* The rungs in one scene, at equal samples and at equal time.
 *
 * What a sample costs is measured in rounds, each rung once a round, and the least of them counts: whatever else the
 * machine does only ever adds, and by turns it does not always add to the same rung. From that follows how many samples
 * fit into the time. Sobol' points are at their best at powers of two, by much where an estimator is smooth; so that it
 * isn't luck how close to one that number comes, the two powers next to it are rendered, and the error is interpolated
 * between them, in logarithms. With several seeds errors are means over as many pictures: where few samples make most
 * of the error, as beside a lamp, one picture tells more about its luck than about the rung. */
#include <math.h>
#include <string.h>

#include "error_metrics.h"
#include "ladder.h"

/* The share of pixels, the worst ones, beyond which `trimmed` looks away. */
#define DROPPED 0.001

enum { ROUNDS = 3 };

static int judge(const ladder_shot *shot, const ladder_reference *reference, ladder_run *out, error_metrics *metrics)
{
    if (!error_metrics_compute(shot->radiance, reference->radiance, shot->pixel_count, DROPPED, metrics)) {
        ladder_error("out of memory");
        return LADDER_EXIT_RUNTIME;
    }
    out->samples = shot->samples;
    out->mse = metrics->mse;
    out->trimmed = metrics->trimmed;
    return LADDER_EXIT_OK;
}

static void note_time(ladder_cell *cell, const ladder_shot *shot)
{
    double time = shot->seconds / (shot->samples * (double)shot->pixel_count);
    if (cell->sample_time == 0 || time < cell->sample_time)
        cell->sample_time = time;
}

/* Of one sample, in the weights of relMSE. */
static void note_variance(ladder_cell *cell, const ladder_shot *shot, const ladder_reference *reference)
{
    cell->variance =
        shot->samples * error_metrics_of_variance(shot->variance, reference->radiance, shot->pixel_count);
}

/* How many samples fit into a time. */
static double samples_for(const ladder_cell *cell, size_t pixel_count, double seconds)
{
    return fmin(seconds / (cell->sample_time * (double)pixel_count), 1e9);
}

static double between(double low, double high, double share)
{
    return low > 0 && high > 0 ? low * pow(high / low, share) : low;
}

/* The errors of `samples` a pixel, means over the seeds from `seed` on; the first picture is written to `png`. */
static int measure_errors(const ladder *l, const brume_scene *scene, const ladder_rung *rung,
                          const ladder_reference *reference, uint32_t seed, uint32_t samples, const char *png,
                          int is_timed, ladder_cell *cell, ladder_run *out)
{
    ladder_run sum = {0};
    double seeds = l->options->seeds;
    int code = LADDER_EXIT_OK;
    for (uint32_t k = 0; k < l->options->seeds && !code; k++) {
        ladder_shot shot = {0};
        ladder_run one;
        error_metrics metrics;
        code = ladder_shoot(l, scene, rung, seed + k, samples, 0, k == 0 ? png : NULL, &shot);
        if (!code)
            code = judge(&shot, reference, &one, &metrics);
        if (!code) {
            sum.samples += one.samples / seeds;
            sum.mse += one.mse / seeds;
            sum.trimmed += one.trimmed / seeds;
            if (is_timed)
                note_time(cell, &shot);
            /* Of the last and longest: the spread of few samples is easily underestimated. */
            if (shot.samples > cell->equal_samples.samples)
                note_variance(cell, &shot, reference);
            cell->ratio = metrics.ratio;
            cell->deviates = metrics.deviates;
            cell->bad_samples += shot.bad_samples;
        }
        ladder_shot_free(&shot);
    }
    *out = sum;
    return code;
}

static int measure_samples(const ladder *l, const brume_scene *scene, const ladder_rung *rung,
                           const ladder_reference *reference, const char *name, ladder_cell *cell)
{
    ladder_shot shot = {0};
    ladder_run run;
    char png[LADDER_PATH];
    ladder_png_path(l, name, rung, "samples", png);
    /* The first launches on a device pay for what later ones find done: these are thrown away. */
    int code = ladder_shoot(l, scene, rung, l->options->seed, 1, 0, NULL, &shot);
    ladder_shot_free(&shot);
    if (!code)
        code = measure_errors(l, scene, rung, reference, l->options->seed, l->options->spp, png, 1, cell, &run);
    if (!code)
        cell->equal_samples = run;
    return code;
}

/* One rung's turn in a round: a quarter of the time. */
static int measure_speed(const ladder *l, const brume_scene *scene, const ladder_rung *rung, ladder_cell *cell)
{
    ladder_shot shot = {0};
    double samples = samples_for(cell, (size_t)l->options->width * l->options->height, l->options->seconds / 4);
    int code = ladder_shoot(l, scene, rung, l->options->seed, samples < 1 ? 1 : (uint32_t)samples, 0, NULL, &shot);
    if (!code)
        note_time(cell, &shot);
    ladder_shot_free(&shot);
    return code;
}

static int measure_time(const ladder *l, const brume_scene *scene, const ladder_rung *rung,
                        const ladder_reference *reference, const char *name, ladder_cell *cell)
{
    double fits = samples_for(cell, reference->pixel_count, l->options->seconds), share = 0;
    uint32_t samples = 1;
    int runs = fits > 1 ? 2 : 1; /* where not one sample fits, one is taken all the same */
    ladder_run run[2];
    char png[LADDER_PATH];
    ladder_png_path(l, name, rung, "time", png);
    while (2.0 * samples <= fits)
        samples *= 2;
    if (runs == 2)
        share = log2(fits / samples);

    int shown = share > 0.5, code = LADDER_EXIT_OK;
    for (int i = 0; i < runs && !code; i++) {
        code = measure_errors(l, scene, rung, reference, l->options->seed + 1, samples << i, i == shown ? png : NULL, 0,
                              cell, &run[i]);
        run[i].seconds = run[i].samples * (double)reference->pixel_count * cell->sample_time;
    }
    if (code)
        return code;
    cell->shown = cell->equal_time = run[shown];
    if (runs == 2) {
        cell->equal_time.samples = fits;
        cell->equal_time.seconds = l->options->seconds;
        cell->equal_time.mse = between(run[0].mse, run[1].mse, share);
        cell->equal_time.trimmed = between(run[0].trimmed, run[1].trimmed, share);
    }
    cell->equal_samples.seconds =
        cell->equal_samples.samples * (double)reference->pixel_count * cell->sample_time;
    ladder_say("  %-18s %4.0f spp: relMSE %-9.3g %6.0f spp in %.2f s: relMSE %-9.3g mean %.4f (%+.1f)", rung->name,
               cell->equal_samples.samples, cell->equal_samples.mse, cell->equal_time.samples,
               cell->equal_time.seconds, cell->equal_time.mse, cell->ratio, cell->deviates);
    return LADDER_EXIT_OK;
}

int ladder_measure_cells(const ladder *l, const brume_scene *scene, const ladder_reference *reference,
                         ladder_row *row)
{
    const ladder_options *o = l->options;
    int code = LADDER_EXIT_OK;
    memset(row->cells, 0, sizeof row->cells);
    for (size_t i = 0; i < o->rung_count && !code; i++)
        code = measure_samples(l, scene, &o->rungs[i], reference, row->scene, &row->cells[i]);
    for (int round = 0; round < ROUNDS; round++)
        for (size_t i = 0; i < o->rung_count && !code; i++)
            code = measure_speed(l, scene, &o->rungs[i], &row->cells[i]);
    for (size_t i = 0; i < o->rung_count && !code; i++)
        code = measure_time(l, scene, &o->rungs[i], reference, row->scene, &row->cells[i]);
    return code;
}

/* Independent against Owen-scrambled Sobol' points: how fast the error falls with the number of samples. The error is
 * had from two renders with different seeds, and a reference only gives the weights: none is long enough to judge 1024
 * Sobol' samples of a smooth estimator by. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "error_metrics.h"
#include "ladder.h"

enum { COUNTS = 5 };
static const double sample_counts[COUNTS] = {4, 16, 64, 256, 1024};

typedef struct measured {
    double error[2][COUNTS]; /* independent, Sobol' */
    double slope[2];
} measured;

static int set_sampler(const ladder *l, brume_scene *scene, brume_sampler sampler)
{
    brume_integrator_desc integrator;
    brume_result result = brume_scene_get_integrator(scene, &integrator);
    integrator.sampler = sampler;
    if (!result)
        result = brume_scene_set_integrator(scene, &integrator);
    return result ? ladder_report(l, result) : LADDER_EXIT_OK;
}

static int measure(const ladder *l, brume_scene *scene, const ladder_rung *rung, const float *weights, measured *out)
{
    const brume_sampler samplers[2] = {BRUME_SAMPLER_INDEPENDENT, BRUME_SAMPLER_SOBOL};
    int code = LADDER_EXIT_OK;
    for (int s = 0; s < 2 && !code; s++) {
        code = set_sampler(l, scene, samplers[s]);
        for (int i = 0; i < COUNTS && !code; i++) {
            ladder_shot pair[2] = {{0}, {0}};
            for (uint32_t k = 0; k < 2 && !code; k++)
                code = ladder_shoot(l, scene, rung, l->options->seed + k, (uint32_t)sample_counts[i], 0, NULL,
                                    &pair[k]);
            if (!code)
                out->error[s][i] = error_metrics_of_pair(pair[0].radiance, pair[1].radiance, weights,
                                                         pair[0].pixel_count);
            ladder_shot_free(&pair[0]);
            ladder_shot_free(&pair[1]);
        }
        out->slope[s] = error_metrics_slope(sample_counts, out->error[s], COUNTS);
    }
    return code;
}

static void write_rows(FILE *csv, FILE *table, const char *scene, const char *rung, const measured *r)
{
    fprintf(table, "| %s | %s |", scene, rung);
    for (int i = 0; i < COUNTS; i++) {
        double ratio = r->error[0][i] / r->error[1][i];
        fprintf(csv, "%s,%s,%.0f,%.6g,%.6g,%.4g,%.4f,%.4f\n", scene, rung, sample_counts[i], r->error[0][i],
                r->error[1][i], ratio, r->slope[0], r->slope[1]);
        if (isfinite(ratio))
            fprintf(table, " %.2f |", ratio);
        else
            fprintf(table, " - |"); /* nothing was found by either, or there is no noise */
    }
    for (int s = 0; s < 2; s++)
        fprintf(table, " %.2g | %.2f |", r->error[s][COUNTS - 1], r->slope[s]);
    fputc('\n', table);
    fflush(table);
}

static int measure_scene(const ladder *l, const ladder_scene *from, FILE *csv, FILE *table)
{
    brume_scene *scene = NULL;
    ladder_reference reference = {0};
    ladder_say("%s", from->name);
    int code = ladder_load(l, from, &scene);
    if (!code)
        code = ladder_reference_get(l, from, scene, &reference);
    for (size_t i = 0; i < l->options->rung_count && !code; i++) {
        const ladder_rung *rung = &l->options->rungs[i];
        measured r;
        memset(&r, 0, sizeof r);
        code = measure(l, scene, rung, reference.radiance, &r);
        if (!code) {
            write_rows(csv, table, from->name, rung->name, &r);
            ladder_say("  %-18s slope %.2f independent, %.2f Sobol'; ratio at %.0f samples %.2f", rung->name,
                       r.slope[0], r.slope[1], sample_counts[COUNTS - 1],
                       r.error[0][COUNTS - 1] / r.error[1][COUNTS - 1]);
        }
    }
    ladder_reference_free(&reference);
    brume_scene_destroy(scene);
    return code;
}

int ladder_samplers(const ladder *l)
{
    const ladder_options *o = l->options;
    FILE *csv = ladder_open(l, "samplers.csv"), *table = csv ? ladder_open(l, "samplers.md") : NULL;
    int code = table ? LADDER_EXIT_OK : LADDER_EXIT_OUTPUT;
    if (!code) {
        fputs("scene,rung,samples,relmse_independent,relmse_sobol,ratio,slope_independent,slope_sobol\n", csv);
        fprintf(table,
                "%s, %u x %u pixels.\n\nHow many times the relMSE of independent samples is that of Owen-scrambled "
                "Sobol' points, by samples per\npixel; then, for independent and for Sobol', relMSE at %.0f samples "
                "and the exponent of relMSE against samples\n(least squares on logarithms; -1 is chance). Errors are "
                "from pairs of renders.\n\n| scene | rung |", l->info.name, o->width, o->height,
                sample_counts[COUNTS - 1]);
        for (int i = 0; i < COUNTS; i++)
            fprintf(table, " %.0f |", sample_counts[i]);
        fputs(" independent | slope | Sobol' | slope |\n|---|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|\n", table);
    }
    for (size_t i = 0; i < o->scene_count && !code; i++)
        code = measure_scene(l, &o->scenes[i], csv, table);
    if (csv && ladder_close(l, csv, "samplers.csv") && !code)
        code = LADDER_EXIT_OUTPUT;
    if (table && ladder_close(l, table, "samplers.md") && !code)
        code = LADDER_EXIT_OUTPUT;
    return code;
}

/* study.csv, a row a picture, and study.json, the same and what follows from it. */
#include <math.h>
#include <string.h>

#include "cli_study.h"
#include "files.h"

static int open_table(const study *s, const char *name, char path[STUDY_PATH], files_draft *out)
{
    study_path(s, name, path);
    int error = files_begin(out, path);
    return error ? study_not_written(path, error) : CLI_EXIT_OK;
}

static int close_table(files_draft *table)
{
    int error = files_end(table, 1);
    return error ? study_not_written(table->path, error) : CLI_EXIT_OK;
}

/* ---- CSV: what isn't known is empty ---- */

static void cell(FILE *file, double value)
{
    if (isfinite(value))
        fprintf(file, ",%.9g", value);
    else
        fputc(',', file);
}

static void csv_row(FILE *file, const study_setting *setting, const study_curve *c, size_t i, int seed,
                    uint32_t number)
{
    const study_run *run = &c->runs[seed];
    const study_run_point *at = &run->points[i];
    const study_point *p = &c->points[i];
    const study_figures *f = &p->of[seed];
    fprintf(file, "%s,%u,%u", setting->name, number, at->samples);
    const double values[] = {run->bvh_seconds, run->upload_seconds, run->build_seconds, run->pilot_seconds, at->seconds,
                             at->cpu_seconds, f->metrics.mse, f->metrics.trimmed, f->figures.mape, f->figures.smape,
                             f->flip, f->estimated, (double)f->figures.fireflies, (double)at->bad_samples,
                             f->metrics.ratio, f->metrics.deviates, p->noise, p->bias, p->bias_sigma, f->other_relmse,
                             f->other_flip};
    for (size_t k = 0; k < sizeof values / sizeof values[0]; k++)
        cell(file, values[k]);
    fprintf(file, ",%d,%d\n", p->near_floor, p->on_front);
}

static int write_csv(const study *s)
{
    char path[STUDY_PATH];
    files_draft table;
    int code = open_table(s, "study.csv", path, &table);
    if (code)
        return code;
    FILE *file = table.file;
    fputs("setting,seed,samples,bvh_seconds,upload_seconds,build_seconds,pilot_seconds,render_seconds,cpu_seconds,"
          "relmse,relmse_trimmed,mape,smape,flip,estimated_relmse,fireflies,bad_samples,mean_ratio,deviates,pair_noise,"
          "pair_bias,pair_bias_sigma,other_relmse,other_flip,near_floor,on_front\n", file);
    for (size_t k = 0; k < s->setting_count; k++)
        for (size_t i = 0; i < s->curves[k].count; i++)
            for (int seed = 0; seed < STUDY_SEEDS; seed++)
                csv_row(file, &s->settings[k], &s->curves[k], i, seed, s->base.render.seed + (uint32_t)seed);
    return close_table(&table);
}

/* ---- JSON: what isn't known is null ---- */

static void number(FILE *file, const char *name, double value)
{
    if (isfinite(value))
        fprintf(file, "\"%s\":%.9g", name, value);
    else
        fprintf(file, "\"%s\":null", name);
}

static void member(FILE *file, const char *name, double value)
{
    fputc(',', file);
    number(file, name, value);
}

static void text(FILE *file, const char *name, const char *value)
{
    fprintf(file, "\"%s\":", name);
    cli_json_string(file, value);
}

static void json_point(FILE *file, const study_point *p)
{
    fputc('{', file);
    number(file, "samples", p->samples);
    member(file, "seconds", p->seconds);
    member(file, "render_seconds", p->wall_seconds);
    member(file, "cpu_seconds", p->cpu_seconds);
    member(file, "relmse", p->relmse);
    member(file, "relmse_trimmed", p->trimmed);
    member(file, "mape", p->mape);
    member(file, "smape", p->smape);
    member(file, "flip", p->flip);
    member(file, "estimated_relmse", p->estimated);
    member(file, "noise", p->noise);
    member(file, "bias", p->bias);
    member(file, "bias_sigma", p->bias_sigma);
    member(file, "fireflies", p->fireflies);
    member(file, "bad_samples", (double)p->bad_samples);
    member(file, "mean_ratio", p->ratio);
    member(file, "pair_deviates", p->deviates);
    member(file, "other_relmse", p->other_relmse);
    fprintf(file, ",\"near_floor\":%s,\"on_front\":%s}", p->near_floor ? "true" : "false",
            p->on_front ? "true" : "false");
}

static void json_setting(FILE *file, const study_setting *setting, const study_curve *c)
{
    static const char *const kinds[] = {"between", "at-most", "beyond", "never"};
    char what[512];
    study_setting_describe(setting, what, sizeof what);
    fputc('{', file);
    text(file, "name", setting->name);
    fputc(',', file);
    text(file, "what", what);
    fprintf(file, ",\"approximate\":%s", study_setting_kinds(setting) & STUDY_APPROXIMATE ? "true" : "false");
    if (c->count > 0) {
        member(file, "bvh_seconds", c->runs[0].bvh_seconds);
        member(file, "upload_seconds", c->runs[0].upload_seconds);
        member(file, "build_seconds", c->runs[0].build_seconds);
        member(file, "pilot_seconds", c->runs[0].pilot_seconds);
        member(file, "slope", c->slope);
        member(file, "noise_slope", c->noise_slope);
        member(file, "bias", c->bias);
        member(file, "time_to_target", c->time_to_target);
        fputc(',', file);
        text(file, "time_to_target_is", kinds[c->target_kind]);
        member(file, "time_factor_to_halve", c->halving);
        member(file, "relmse_at_time_target", c->at_time);
    }
    fputs(",\"points\":[", file);
    for (size_t i = 0; i < c->count; i++) {
        if (i > 0)
            fputc(',', file);
        json_point(file, &c->points[i]);
    }
    fputs("]}", file);
}

static void json_rounding(FILE *file, const study *s, const study_rounding *r)
{
    fputc('{', file);
    text(file, "single", s->settings[r->single].name);
    fputc(',', file);
    text(file, "double", s->settings[r->other].name);
    member(file, "samples", r->samples);
    member(file, "time_factor", r->cost);
    member(file, "median", r->median);
    member(file, "root_mean_square", r->root_mean_square);
    member(file, "most", r->most);
    member(file, "share_above_0.001", r->share_above);
    fputc('}', file);
}

static int write_json(const study *s)
{
    char path[STUDY_PATH];
    files_draft table;
    int code = open_table(s, "study.json", path, &table);
    if (code)
        return code;
    FILE *file = table.file;
    fputc('{', file);
    text(file, "version", BRUME_VERSION);
    fputc(',', file);
    text(file, "scene", s->options->scene);
    fputc(',', file);
    text(file, "device", s->session.info.name);
    member(file, "width", s->width);
    member(file, "height", s->height);
    member(file, "seed", s->base.render.seed);
    member(file, "budget", s->options->study.budget);
    fputc(',', file);
    text(file, "clock", s->options->study.cpu_clock ? "cpu" : "wall");
    member(file, "compute_units", s->session.info.compute_units);
    member(file, "target", s->target);
    member(file, "time_target", s->time_target);
    fputs(",\"reference\":", file);
    if (s->reference) {
        fputc('{', file);
        number(file, "samples", s->reference_samples);
        member(file, "relmse", s->reference_error);
        member(file, "mean", s->reference_mean);
        member(file, "exposure", s->exposure);
        fputc('}', file);
    } else {
        fputs("null", file);
    }
    fputs(",\"other\":", file);
    if (s->other && s->reference) {
        fputc('{', file);
        text(file, "file", s->options->study.reference);
        member(file, "relmse", s->other_relmse);
        member(file, "flip", s->other_flip);
        member(file, "mean_ratio", s->other_ratio);
        fputc('}', file);
    } else {
        fputs("null", file);
    }
    fputs(",\"settings\":[", file);
    for (size_t k = 0; k < s->setting_count; k++) {
        if (k > 0)
            fputc(',', file);
        json_setting(file, &s->settings[k], &s->curves[k]);
    }
    fputs("],\"rounding\":[", file);
    for (size_t k = 0; k < s->rounding_count; k++) {
        if (k > 0)
            fputc(',', file);
        json_rounding(file, s, &s->roundings[k]);
    }
    fputs("]}\n", file);
    return close_table(&table);
}

int study_write_tables(const study *s)
{
    int code = write_csv(s);
    return code ? code : write_json(s);
}

/* The results as tables: for spreadsheets, for programs, for people. */
#include <math.h>
#include <string.h>

#include "ladder.h"

/* The rung that variance x time is told relative to, the first one if it isn't there. */
static size_t baseline(const ladder_options *o)
{
    for (size_t i = 0; i < o->rung_count; i++)
        if (o->rungs[i].strategy == BRUME_STRATEGY_DISTANCE)
            return i;
    return 0;
}

/* Variance x time, what a picture of a given error costs. The spread of samples that miss a part of the light, all of
 * them or nearly all, says nothing: a rung whose mean is off has no cost, rather than the least. */
static double cost(const ladder_cell *cell)
{
    return fabs(cell->deviates) < 5 ? cell->variance * cell->sample_time : NAN;
}

/* A picture can't be shown to be closer to the truth than the reference is. */
static int is_limited(double mse, const ladder_row *row) { return mse < 2 * row->reference_error; }

/* A field that may be empty. */
static void put_field(FILE *file, double value)
{
    fprintf(file, isfinite(value) ? "%.6g," : ",", value);
}

static int write_csv(const ladder *l, const ladder_row *rows, size_t count)
{
    const ladder_options *o = l->options;
    FILE *file = ladder_open(l, "ladder.csv");
    if (!file)
        return LADDER_EXIT_OUTPUT;
    fputs("scene,rung,samples_equal,seconds_equal_samples,relmse_equal_samples,trimmed_equal_samples,samples_in_time,"
          "seconds,relmse_equal_time,trimmed_equal_time,variance_per_sample,seconds_per_sample,variance_time,"
          "variance_time_relative,mean_ratio,mean_deviates,bad_samples,reference_samples,reference_relmse\n", file);
    for (size_t s = 0; s < count; s++)
        for (size_t r = 0; r < o->rung_count; r++) {
            const ladder_row *row = &rows[s];
            const ladder_cell *c = &row->cells[r];
            fprintf(file, "%s,%s,%.0f,%.4f,%.6g,%.6g,%.0f,%.4f,%.6g,%.6g,%.6g,%.6g,", row->scene, o->rungs[r].name,
                    c->equal_samples.samples, c->equal_samples.seconds, c->equal_samples.mse,
                    c->equal_samples.trimmed, c->equal_time.samples, c->equal_time.seconds, c->equal_time.mse,
                    c->equal_time.trimmed, c->variance, c->sample_time);
            put_field(file, cost(c));
            put_field(file, cost(c) / cost(&row->cells[baseline(o)]));
            fprintf(file, "%.6g,%.3f,%llu,%.1f,%.3g\n", c->ratio, c->deviates, (unsigned long long)c->bad_samples,
                    row->reference_samples, row->reference_error);
        }
    return ladder_close(l, file, "ladder.csv");
}

/* ---- JSON ---- */

static void put_string(FILE *file, const char *text)
{
    fputc('"', file);
    for (; *text; text++)
        if (*text == '"' || *text == '\\')
            fprintf(file, "\\%c", *text);
        else
            fputc((unsigned char)*text < 0x20 ? ' ' : *text, file);
    fputc('"', file);
}

static void put_number(FILE *file, const char *name, double value)
{
    /* JSON has no infinity, and no NaN. */
    fprintf(file, isfinite(value) ? ",\"%s\":%.9g" : ",\"%s\":null", name, value);
}

static void put_run(FILE *file, const char *name, const ladder_run *run)
{
    fprintf(file, ",\"%s\":{\"samples\":%.0f", name, run->samples);
    put_number(file, "seconds", run->seconds);
    put_number(file, "relmse", run->mse);
    put_number(file, "relmse_trimmed", run->trimmed);
    fputc('}', file);
}

static int write_json(const ladder *l, const ladder_row *rows, size_t count)
{
    const ladder_options *o = l->options;
    FILE *file = ladder_open(l, "ladder.json");
    if (!file)
        return LADDER_EXIT_OUTPUT;
    fputs("{\"version\":\"" BRUME_VERSION "\",\"device\":", file);
    put_string(file, l->info.name);
    fputs(",\"driver\":", file);
    put_string(file, l->info.driver);
    fprintf(file, ",\"width\":%u,\"height\":%u,\"depth\":%s,\"seed\":%u,\"seeds\":%u,", o->width, o->height,
            o->depth ? o->depth : "null", o->seed, o->seeds);
    fprintf(file, "\"reference_rung\":\"%s\",\"scenes\":[\n", o->reference.name);
    for (size_t s = 0; s < count; s++) {
        const ladder_row *row = &rows[s];
        fprintf(file, "%s{\"scene\":\"%s\"", s ? ",\n" : "", row->scene);
        put_number(file, "reference_samples", row->reference_samples);
        put_number(file, "reference_seconds", row->reference_seconds);
        put_number(file, "reference_relmse", row->reference_error);
        fputs(",\"rungs\":[\n", file);
        for (size_t r = 0; r < o->rung_count; r++) {
            const ladder_cell *c = &row->cells[r];
            fprintf(file, "%s  {\"rung\":\"%s\"", r ? ",\n" : "", o->rungs[r].name);
            put_run(file, "equal_samples", &c->equal_samples);
            put_run(file, "equal_time", &c->equal_time);
            put_number(file, "variance_per_sample", c->variance);
            put_number(file, "seconds_per_sample", c->sample_time);
            put_number(file, "variance_time_relative", cost(c) / cost(&row->cells[baseline(o)]));
            put_number(file, "mean_ratio", c->ratio);
            put_number(file, "mean_deviates", c->deviates);
            fprintf(file, ",\"bad_samples\":%llu}", (unsigned long long)c->bad_samples);
        }
        fputs("]}", file);
    }
    fputs("]}\n", file);
    return ladder_close(l, file, "ladder.json");
}

/* ---- Markdown ---- */

static void put_error(FILE *file, double mse, const ladder_row *row)
{
    fprintf(file, " %.3g%s |", mse, is_limited(mse, row) ? "\\*" : "");
}

static int write_markdown(const ladder *l, const ladder_row *rows, size_t count)
{
    const ladder_options *o = l->options;
    FILE *file = ladder_open(l, "ladder.md");
    if (!file)
        return LADDER_EXIT_OUTPUT;
    fprintf(file,
            "%s, %u x %u pixels.\n\n"
            "relMSE is the mean of (I - R)^2 / (R^2 + 0.01 mean(R)^2) over all pixels; \"trimmed\" leaves out the\n"
            "worst 0.1 %% of them; both are means over %u seed%s, all else is of the last. R, the reference, is\n"
            "%s with seeds of its own; \\* marks what is too close to R's own error to be told from it.\n"
            "Variance is that of one sample of a pixel, in the same\n"
            "weights; variance x time is relative to %s, and left out where the mean is off by 5 standard\n"
            "errors: light is missed. The mean is the picture's over the reference's, and how many standard errors\n"
            "it is from 1. Times are of rendering alone, the least of several rounds. At equal time the error is\n"
            "interpolated between the powers of two samples next to it, where Sobol' points are at their best.\n",
            l->info.name, o->width, o->height, o->seeds, o->seeds == 1 ? "" : "s", o->reference.name,
            o->rungs[baseline(o)].name);
    for (size_t s = 0; s < count; s++) {
        const ladder_row *row = &rows[s];
        const ladder_cell *first = &row->cells[baseline(o)];
        fprintf(file, "\n**%s**, reference of %.0f samples per pixel, its own relMSE %.2g\n\n", row->scene,
                row->reference_samples, row->reference_error);
        fprintf(file,
                "| scene | rung | relMSE, %u samples | trimmed | samples | seconds | relMSE, equal time | trimmed | "
                "variance per sample | ns per sample | variance x time | mean | bad |\n"
                "|---|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|\n", o->spp);
        for (size_t r = 0; r < o->rung_count; r++) {
            const ladder_cell *c = &row->cells[r];
            fprintf(file, "| %s | %s |", row->scene, o->rungs[r].name);
            put_error(file, c->equal_samples.mse, row);
            put_error(file, c->equal_samples.trimmed, row);
            fprintf(file, " %.0f | %.2f |", c->equal_time.samples, c->equal_time.seconds);
            put_error(file, c->equal_time.mse, row);
            put_error(file, c->equal_time.trimmed, row);
            fprintf(file, " %.3g | %.3g |", c->variance, 1e9 * c->sample_time);
            fprintf(file, isfinite(cost(c) / cost(first)) ? " %.3g |" : " - |", cost(c) / cost(first));
            fprintf(file, " %.4f (%+.1f) | %llu |\n", c->ratio, c->deviates, (unsigned long long)c->bad_samples);
        }
    }
    return ladder_close(l, file, "ladder.md");
}

int ladder_write_tables(const ladder *l, const ladder_row *rows, size_t count)
{
    int code = write_csv(l, rows, count);
    if (!code)
        code = write_json(l, rows, count);
    return code ? code : write_markdown(l, rows, count);
}

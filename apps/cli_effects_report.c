/* What `render-cli effects` found, as a table, as JSON and as pictures. */
#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "cli_effects.h"
#include "files.h"
#include "small_png.h"

enum { MOST_WIDTH = 240, MOST_PATH = 4096 };

void cli_effects_print(const cli_effects_result *r)
{
    const cli_variant *full = &r->variants[0];
    printf("%u x %u pixels, %u samples each in %u rounds; %.3f s a round with all effects, program %.1f KiB\n",
           r->width, r->height, r->samples, r->rounds, full->seconds, (double)full->program_bytes / (1 << 10));
    printf("noise of the full picture at half of these samples: relMSE %.2g\n\n", r->noise);
    printf("%-21s %13s %13s %21s %12s\n", "effect", "of the time", "mean without", "relMSE without", "program");
    for (size_t k = 1; k < r->count; k++) {
        const cli_variant *v = &r->variants[k];
        int nothing = !(v->difference > 2 * v->uncertainty);
        printf("%-21s %11.1f %% %+11.2f %% ", brume_effect_name(v->effect), 100 * v->time_share,
               100 * v->mean_change);
        if (nothing)
            printf("%21s", "nothing to see");
        else
            printf("%11.2e +- %.1e", v->difference, v->uncertainty);
        printf(" %8.1f KiB\n", (double)v->program_bytes / (1 << 10));
    }
    if (r->count == 1)
        puts("nothing can be taken away from this scene");
}

/* JSON has no infinity. */
static void put_number(FILE *file, const char *name, double value)
{
    if (isfinite(value))
        fprintf(file, ",\"%s\":%.6g", name, value);
    else
        fprintf(file, ",\"%s\":null", name);
}

/* 0, or errno. */
static int write_json(const cli_effects_result *r, const char *path)
{
    files_draft draft;
    int error = files_begin(&draft, path);
    if (error)
        return error;
    FILE *file = draft.file;
    fputs("{\"event\":\"effects\",\"scene\":", file);
    cli_json_string(file, r->options->scene);
    fprintf(file, ",\"width\":%u,\"height\":%u,\"samples\":%u,\"rounds\":%u", r->width, r->height, r->samples,
            r->rounds);
    put_number(file, "seconds", r->variants[0].seconds);
    put_number(file, "build_seconds", r->variants[0].build_seconds);
    fprintf(file, ",\"program_bytes\":%llu", (unsigned long long)r->variants[0].program_bytes);
    put_number(file, "noise", r->noise);
    fputs(",\"effects\":[", file);
    for (size_t k = 1; k < r->count; k++) {
        const cli_variant *v = &r->variants[k];
        fprintf(file, "%s{\"effect\":\"%s\"", k > 1 ? "," : "", brume_effect_name(v->effect));
        put_number(file, "time_share", v->time_share);
        put_number(file, "mean_change", v->mean_change);
        put_number(file, "relmse", v->difference);
        put_number(file, "relmse_standard_error", v->uncertainty);
        put_number(file, "seconds", v->seconds);
        put_number(file, "build_seconds", v->build_seconds);
        fprintf(file, ",\"program_bytes\":%llu}", (unsigned long long)v->program_bytes);
    }
    fputs("]}\n", file);
    return files_end(&draft, 1);
}

/* ---- pictures: with, without, difference, side by side ---- */

static unsigned char srgb(double x)
{
    x = !(x > 0) ? 0 : x > 1 ? 1 : x;
    x = x <= 0.0031308 ? 12.92 * x : 1.055 * pow(x, 1 / 2.4) - 0.055;
    return (unsigned char)(255 * x + 0.5);
}

/* Mean of channel c of both pictures over the pixels that fall on (x, y) of a picture of `step`-th size. */
static double box(const cli_effects_result *r, const cli_variant *v, size_t step, size_t x, size_t y, size_t c)
{
    double sum = 0;
    size_t count = 0;
    for (size_t j = y * step; j < (y + 1) * step && j < r->height; j++)
        for (size_t i = x * step; i < (x + 1) * step && i < r->width; i++, count++)
            sum += 0.5 * ((double)v->sums[0][3 * (j * r->width + i) + c] + v->sums[1][3 * (j * r->width + i) + c]);
    return count ? sum / (double)count : 0;
}

/* Where the effect adds light: orange; where it takes light: blue; white where it does nothing. */
static void tint(double difference, double scale, unsigned char *out)
{
    double x = difference / (fabs(difference) + scale), weak = 1 - fabs(x);
    const double plus[3] = {0.95, 0.30, 0.02}, minus[3] = {0.02, 0.20, 0.85};
    for (int c = 0; c < 3; c++)
        out[c] = srgb(weak + (1 - weak) * (x > 0 ? plus[c] : minus[c]));
}

/* 0, or errno. */
static int write_picture(const cli_effects_result *r, const cli_variant *v, const char *path)
{
    size_t step = (r->width + MOST_WIDTH - 1) / MOST_WIDTH;
    size_t width = (r->width + step - 1) / step, height = (r->height + step - 1) / step;
    unsigned char *rgb = malloc(9 * width * height);
    if (!rgb)
        return ENOMEM;
    double mean = 0;
    for (size_t i = 0; i < 3 * (size_t)r->width * r->height; i++)
        mean += r->variants[0].sums[0][i] / (3.0 * r->width * r->height);
    for (size_t y = 0; y < height; y++)
        for (size_t x = 0; x < width; x++) {
            unsigned char *row = rgb + 9 * width * y;
            double difference = 0;
            for (size_t c = 0; c < 3; c++) {
                double with = box(r, r->variants, step, x, y, c), without = box(r, v, step, x, y, c);
                row[3 * x + c] = srgb(with);
                row[3 * (width + x) + c] = srgb(without);
                difference += (with - without) / 3;
            }
            tint(difference, mean > 0 ? mean : 1, row + 3 * (2 * width + x));
        }
    int error = small_png_write(path, 3 * width, height, rgb);
    free(rgb);
    return error;
}

int cli_effects_write(const cli_effects_result *r, const char *folder)
{
    char path[MOST_PATH];
    int error = 0;
    for (size_t k = 0; k < r->count && !error; k++) {
        if (k == 0)
            snprintf(path, sizeof path, "%s/effects.json", folder);
        else
            snprintf(path, sizeof path, "%s/%s.png", folder, brume_effect_name(r->variants[k].effect));
        error = k == 0 ? write_json(r, path) : write_picture(r, &r->variants[k], path);
    }
    if (error)
        cli_error("%s: could not be written: %s", path, strerror(error));
    return error ? CLI_EXIT_OUTPUT : CLI_EXIT_OK;
}

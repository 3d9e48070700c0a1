/* Statistics of a run: one JSON object for programs, a few lines for people. */
#include <errno.h>
#include <math.h>
#include <string.h>

#include "cli.h"
#include "files.h"

/* Length of the UTF-8 sequence that `s` starts with, 0 if it is none (RFC 3629: no overlong forms, no surrogates). */
static int utf8_length(const unsigned char *s)
{
    int length = s[0] < 0x80 ? 1
               : s[0] >= 0xc2 && s[0] < 0xe0 ? 2
               : (s[0] & 0xf0) == 0xe0 ? 3
               : s[0] >= 0xf0 && s[0] < 0xf5 ? 4 : 0;
    for (int i = 1; i < length; i++)
        if ((s[i] & 0xc0) != 0x80)
            return 0;
    if ((s[0] == 0xe0 && s[1] < 0xa0) || (s[0] == 0xed && s[1] > 0x9f) || (s[0] == 0xf0 && s[1] < 0x90) ||
        (s[0] == 0xf4 && s[1] > 0x8f))
        return 0;
    return length;
}

void cli_json_string(FILE *file, const char *text)
{
    fputc('"', file);
    for (const unsigned char *s = (const unsigned char *)text; *s;) {
        int length = utf8_length(s);
        if (length == 0) {
            fputs("\\ufffd", file);
            s++;
        } else if (*s == '"' || *s == '\\') {
            fprintf(file, "\\%c", *s++);
        } else if (*s < 0x20 || *s == 0x7f) {
            fprintf(file, "\\u%04x", *s++);
        } else {
            fwrite(s, 1, (size_t)length, file);
            s += length;
        }
    }
    fputc('"', file);
}

static void member_string(FILE *file, const char *name, const char *value)
{
    fprintf(file, ",\"%s\":", name);
    cli_json_string(file, value);
}

static void member_count(FILE *file, const char *name, uint64_t value)
{
    fprintf(file, ",\"%s\":%llu", name, (unsigned long long)value);
}

static void member_number(FILE *file, const char *name, double value)
{
    /* JSON has no infinity. */
    if (isfinite(value))
        fprintf(file, ",\"%s\":%.9g", name, value);
    else
        fprintf(file, ",\"%s\":null", name);
}

static double samples_per_second(const brume_render_stats *stats)
{
    return stats->render_seconds > 0 ? (double)stats->samples / stats->render_seconds : 0;
}

/* ,"name":["a","b"] of the numbers in a set */
static void member_set(FILE *file, const char *name, uint32_t set, const char *(*name_of)(uint32_t))
{
    int some = 0;
    fprintf(file, ",\"%s\":[", name);
    for (uint32_t i = 0; name_of(i); i++)
        if (set >> i & 1)
            fprintf(file, "%s\"%s\"", some++ ? "," : "", name_of(i));
    fputc(']', file);
}

static const char *effect_name(uint32_t number)
{
    return brume_effect_name((brume_effect)number);
}

void cli_stats_effects(FILE *file, const brume_render_stats *stats)
{
    member_set(file, "effects", stats->effects, effect_name);
    member_set(file, "without", stats->without, effect_name);
    member_set(file, "features_built", stats->features, brume_feature_name);
    member_set(file, "features_left_out", ~stats->features, brume_feature_name);
}

void cli_stats_print(FILE *file, const cli_run *run)
{
    const brume_render_stats *stats = run->stats;
    fputs("{\"event\":\"stats\"", file);
    member_string(file, "version", BRUME_VERSION);
    member_string(file, "scene", run->options->scene);
    member_count(file, "exit_code", (uint64_t)run->exit_code);
    member_string(file, "device", run->device->name);
    member_string(file, "platform", run->device->platform);
    member_string(file, "driver", run->device->driver);
    member_count(file, "device_is_gpu", run->device->is_gpu);
    member_count(file, "compute_units", run->device->compute_units);
    member_string(file, "precision", run->options->render.precision == BRUME_PRECISION_DOUBLE ? "double" : "float");
    member_count(file, "lanes", stats->lanes);
    member_count(file, "features", stats->features);
    member_count(file, "width", stats->width);
    member_count(file, "height", stats->height);
    member_count(file, "full_width", stats->full_width);
    member_count(file, "full_height", stats->full_height);
    member_count(file, "crop_x", stats->crop_x);
    member_count(file, "crop_y", stats->crop_y);
    member_count(file, "triangles", stats->triangles);
    member_count(file, "quadrics", stats->quadrics);
    member_count(file, "bvh_nodes", stats->bvh_nodes);
    member_count(file, "bvh_depth", stats->bvh_depth);
    member_count(file, "dropped_triangles", stats->dropped_triangles);
    member_count(file, "lights", stats->lights);
    member_count(file, "emitters", stats->emitters);
    member_count(file, "media", stats->media);
    member_count(file, "first_sample", stats->first_sample);
    member_count(file, "sample_count", stats->sample_count);
    member_count(file, "seed", stats->seed);
    member_string(file, "strategy", brume_strategy_name(stats->strategy));
    member_count(file, "positions", stats->positions);
    member_string(file, "indirect", brume_indirect_name(stats->indirect));
    fprintf(file, ",\"complete\":%s", stats->complete ? "true" : "false");
    member_count(file, "samples", stats->samples);
    member_number(file, "relmse", stats->relmse < 0 ? NAN : stats->relmse);
    member_number(file, "relmse_low", stats->relmse < 0 ? NAN : stats->relmse_low);
    member_number(file, "relmse_high", stats->relmse < 0 ? NAN : stats->relmse_high);
    member_number(file, "order", stats->relmse < 0 ? NAN : stats->order);
    fprintf(file, ",\"adaptive\":%s", stats->adaptive ? "true" : "false");
    member_count(file, "bad_samples", stats->bad_samples);
    if (stats->bad_samples > 0) {
        member_count(file, "bad_pixel_x", stats->bad_pixel_x);
        member_count(file, "bad_pixel_y", stats->bad_pixel_y);
        member_count(file, "bad_sample", stats->bad_sample);
    }
    member_count(file, "device_bytes", stats->device_bytes);
    member_number(file, "load_seconds", run->load_seconds);
    member_number(file, "bvh_seconds", stats->bvh_seconds);
    member_number(file, "upload_seconds", stats->upload_seconds);
    member_number(file, "build_seconds", stats->build_seconds);
    fprintf(file, ",\"program_cached\":%s", stats->program_cached ? "true" : "false");
    member_count(file, "quick_lanes", stats->quick_lanes);
    member_number(file, "swap_seconds", stats->swap_seconds);
    member_count(file, "swapped_at_sample", stats->swapped_at_sample);
    member_number(file, "render_seconds", stats->render_seconds);
    member_number(file, "pilot_seconds", stats->pilot_seconds);
    member_number(file, "write_seconds", run->write_seconds);
    member_number(file, "total_seconds", run->total_seconds);
    member_number(file, "samples_per_second", samples_per_second(stats));
    member_count(file, "program_bytes", stats->program_bytes);
    cli_stats_effects(file, stats);
    fputs(",\"parameters\":{", file);
    for (size_t i = 0; i < run->options->parameter_count; i++) {
        if (i > 0)
            fputc(',', file);
        cli_json_string(file, run->options->parameters[i].name);
        fputc(':', file);
        cli_json_string(file, run->options->parameters[i].value);
    }
    fputs("},\"outputs\":[", file);
    for (size_t i = 0; i < run->options->output_count; i++) {
        if (i > 0)
            fputc(',', file);
        cli_json_string(file, run->options->outputs[i]);
    }
    fputc(']', file);
    fputs("}\n", file);
}

void cli_stats_print_merge(FILE *file, const cli_merge_run *run)
{
    const brume_render_stats *stats = run->stats;
    fputs("{\"event\":\"stats\"", file);
    member_string(file, "version", BRUME_VERSION);
    member_count(file, "exit_code", (uint64_t)run->exit_code);
    member_count(file, "files", run->options->input_count);
    member_count(file, "width", stats->width);
    member_count(file, "height", stats->height);
    member_count(file, "first_sample", stats->first_sample);
    member_count(file, "sample_count", stats->sample_count);
    member_count(file, "samples", stats->samples);
    member_count(file, "bad_samples", stats->bad_samples);
    fprintf(file, ",\"complete\":%s", stats->complete ? "true" : "false");
    member_count(file, "seed", stats->seed);
    member_number(file, "render_seconds", stats->render_seconds);
    fputs("}\n", file);
}

int cli_stats_write(const char *path, void (*print)(FILE *file, const void *what), const void *what)
{
    if (!path)
        return CLI_EXIT_OK;
    files_draft draft = {stdout, path, NULL};
    int error = *path ? files_begin(&draft, path) : 0;
    if (!error) {
        print(draft.file, what);
        if (*path)
            error = files_end(&draft, 1);
        else if (fflush(stdout) != 0 || ferror(stdout))
            error = errno ? errno : EIO;
    }
    if (error)
        cli_error("%s: statistics could not be written: %s", *path ? path : "standard output", strerror(error));
    return error ? CLI_EXIT_OUTPUT : CLI_EXIT_OK;
}

void cli_stats_summary(FILE *file, const cli_run *run)
{
    const brume_render_stats *stats = run->stats;
    fprintf(file, "%u x %u pixels, %llu samples, %u triangles, %u lights, %u emitters, %u media\n", stats->width,
            stats->height, (unsigned long long)stats->samples, stats->triangles, stats->lights, stats->emitters,
            stats->media);
    fprintf(file,
            "scene %.2f s, BVH %.2f s, upload %.2f s, kernels %.2f s, render %.2f s (%.3g samples/s), write %.2f s\n",
            run->load_seconds, stats->bvh_seconds, stats->upload_seconds, stats->build_seconds, stats->render_seconds,
            samples_per_second(stats), run->write_seconds);
    if (stats->relmse >= 0)
        fprintf(file, "relMSE %.2g (%.2g to %.2g), falling as samples^-%.1f%s\n", stats->relmse, stats->relmse_low,
                stats->relmse_high, stats->order, stats->adaptive ? "; samples placed where the error is" : "");
}

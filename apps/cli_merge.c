/* render-cli merge: the parts of one picture, rendered by many, to the picture. Needs no device and no scene. */
#include <errno.h>
#include <string.h>

#include "cli.h"

static int write_stats(const cli_options *options, const brume_render_stats *stats, int exit_code)
{
    const char *path = options->stats_path;
    if (!path)
        return CLI_EXIT_OK;
    FILE *file = *path ? fopen(path, "w") : stdout;
    if (file)
        fprintf(file,
                "{\"event\":\"stats\",\"version\":\"" BRUME_VERSION "\",\"exit_code\":%d,\"files\":%zu,\"width\":%u,"
                "\"height\":%u,\"first_sample\":%u,\"sample_count\":%u,\"samples\":%llu,\"bad_samples\":%llu,"
                "\"complete\":%s,\"seed\":%u,\"render_seconds\":%.6g}\n",
                exit_code, options->input_count, stats->width, stats->height, stats->first_sample,
                stats->sample_count, (unsigned long long)stats->samples, (unsigned long long)stats->bad_samples,
                stats->complete ? "true" : "false", stats->seed, stats->render_seconds);
    int failed = !file || fflush(file) != 0 || ferror(file);
    if (file && *path)
        failed |= fclose(file) != 0;
    if (failed)
        cli_error("%s: statistics could not be written: %s", *path ? path : "standard output", strerror(errno));
    return failed ? CLI_EXIT_OUTPUT : CLI_EXIT_OK;
}

int cli_merge(brume_context *context, const cli_options *options, cli_progress *progress)
{
    brume_merged *merged = NULL;
    brume_merge_desc desc = brume_merge_desc_default();
    brume_picture_desc picture = brume_picture_desc_default();
    brume_render_stats stats;
    int code = cli_outputs_check(options);
    if (code)
        return code;
    desc.first_sample = options->render.first_sample;
    desc.sample_count = options->render.sample_count;
    desc.partial = (uint32_t)options->partial;
    cli_progress_step(progress, "Adding up", NULL);
    brume_result result = brume_merge(context, options->inputs, options->input_count, &desc, &merged);
    if (result)
        return cli_report(context, result);
    picture.exposure = options->exposure;
    picture.layers = options->layers;
    picture.tonemap = options->tonemap;
    for (size_t i = 0; i < options->output_count; i++) {
        cli_progress_step(progress, "Writing", options->outputs[i]);
        result = brume_merged_write(merged, options->outputs[i], &picture);
        if (result)
            code = cli_report(context, result);
    }
    brume_merged_get_stats(merged, &stats);
    if (options->verbosity > 0)
        fprintf(stderr, "%zu files, %u x %u pixels, %llu samples, rendered in %.2f s\n", options->input_count,
                stats.width, stats.height, (unsigned long long)stats.samples, stats.render_seconds);
    int stats_code = write_stats(options, &stats, code);
    brume_merged_destroy(merged);
    return code ? code : stats_code;
}

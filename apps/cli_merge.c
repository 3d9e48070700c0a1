/* render-cli merge: the parts of one picture, rendered by many, to the picture. Needs no device and no scene. */
#include "cli.h"

static void print_stats(FILE *file, const void *merge)
{
    cli_stats_print_merge(file, merge);
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
    const cli_merge_run run = {options, &stats, code};
    int stats_code = cli_stats_write(options->stats_path, print_stats, &run);
    brume_merged_destroy(merged);
    return code ? code : stats_code;
}

/* The checkpoint of a render: when it is written, and what happens when it can't be. */
#include <string.h>

#include "cli.h"
#include "platform.h"

int cli_checkpoint_check(const cli_options *options)
{
    const char *path = options->checkpoint;
    if (!path)
        return CLI_EXIT_OK;
    for (size_t i = 0; i < options->output_count; i++)
        if (strcmp(options->outputs[i], path) == 0) {
            cli_error("%s can't be both the picture and the checkpoint", path);
            return CLI_EXIT_USAGE;
        }
    if (!options->resume && brume_path_exists(path)) {
        cli_error("%s exists: --resume goes on from it; remove it to start over", path);
        return CLI_EXIT_USAGE;
    }
    return cli_output_check(path);
}

int cli_checkpoint_start(cli_checkpoint *checkpoint, brume_context *context, brume_render *render,
                         const cli_options *options, cli_progress *progress)
{
    memset(checkpoint, 0, sizeof *checkpoint);
    checkpoint->context = context;
    checkpoint->render = render;
    checkpoint->progress = progress;
    checkpoint->path = options->checkpoint;
    checkpoint->interval = options->checkpoint_interval;
    if (options->resume && brume_path_exists(options->checkpoint)) {
        cli_progress_step(progress, "Going on from", options->checkpoint);
        brume_result result = brume_render_load(render, options->checkpoint);
        if (result)
            return cli_report(context, result);
    }
    checkpoint->last = cli_now();
    return CLI_EXIT_OK;
}

static brume_result save(cli_checkpoint *checkpoint)
{
    double begin = cli_now();
    brume_result result = brume_render_save(checkpoint->render, checkpoint->path);
    checkpoint->last = cli_now();
    if (result == BRUME_OK)
        cli_progress_checkpoint(checkpoint->progress, checkpoint->path, checkpoint->last - begin);
    return result;
}

/* A disk that is full now may not be so later: the render goes on, and the checkpoint before stays. */
int cli_checkpoint_update(void *user, const brume_progress *update)
{
    cli_checkpoint *checkpoint = user;
    int stop = cli_progress_update(checkpoint->progress, update);
    if (!checkpoint->path || update->fraction >= 1 || cli_now() - checkpoint->last < checkpoint->interval)
        return stop;
    if (save(checkpoint) != BRUME_OK && !checkpoint->failed) {
        checkpoint->failed = 1;
        cli_progress_log(checkpoint->progress, BRUME_LOG_WARNING, brume_context_message(checkpoint->context));
    }
    return stop;
}

int cli_checkpoint_finish(cli_checkpoint *checkpoint)
{
    brume_result result = checkpoint->path ? save(checkpoint) : BRUME_OK;
    return result ? cli_report(checkpoint->context, result) : CLI_EXIT_OK;
}

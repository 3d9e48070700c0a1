/* render-cli render: a scene to pictures. */
#include "cli.h"

/* What a pixel of a picture takes to be written, an EXR with its layers; measured. */
#define WRITE_SECONDS 0.7e-6

/* The pixels of the pictures that will be written. */
static double pixels_to_write(const brume_scene *scene, const cli_options *options)
{
    brume_film_desc film = brume_film_desc_default();
    brume_scene_get_film(scene, &film);
    const brume_render_desc *render = &options->render;
    double pixels = render->use_crop ? (double)render->crop_width * render->crop_height
                                     : (double)film.width * film.height;
    return pixels * (double)options->output_count;
}

/* What is not to be written is not recorded either. */
static void record_layers(const brume_scene *scene, const cli_options *options, brume_render_desc *desc)
{
    const uint32_t guides = 1u << BRUME_CHANNEL_ALBEDO | 1u << BRUME_CHANNEL_NORMAL | 1u << BRUME_CHANNEL_DEPTH;
    const uint32_t light = 1u << BRUME_CHANNEL_DIRECT | 1u << BRUME_CHANNEL_INDIRECT | 1u << BRUME_CHANNEL_SURFACE |
                           1u << BRUME_CHANNEL_VOLUME | 1u << BRUME_CHANNEL_SEGMENTS;
    const uint32_t layers = options->layers;
    brume_film_desc film = brume_film_desc_default();
    brume_scene_get_film(scene, &film);
    desc->guides = film.alpha || (layers & guides) || options->denoise;
    desc->light_layers =
        (layers != BRUME_LAYERS_RECORDED && (layers & light)) || options->denoise == BRUME_DENOISE_LAYERS;
}

static int write_pictures(brume_context *context, brume_render *render, const cli_options *options,
                          cli_progress *progress)
{
    brume_picture_desc picture = brume_picture_desc_default();
    picture.exposure = options->exposure;
    picture.layers = options->layers;
    picture.tonemap = options->tonemap;
    picture.denoise = options->denoise;
    int code = CLI_EXIT_OK;
    for (size_t i = 0; i < options->output_count; i++) {
        cli_progress_step(progress, "Writing", options->outputs[i]);
        brume_result result = brume_render_write(render, options->outputs[i], &picture);
        if (result)
            code = cli_report(context, result);
    }
    return code;
}

static void print_stats(FILE *file, const void *run)
{
    cli_stats_print(file, run);
}

/* Who wants to know how far it is. */
typedef struct watchers {
    cli_checkpoint *checkpoint;
    cli_display *display;
} watchers;

static int tell(void *user, const brume_progress *update)
{
    watchers *w = user;
    cli_display_update(w->display);
    return cli_checkpoint_update(w->checkpoint, update);
}

int cli_render(brume_context *context, const cli_options *options, cli_progress *progress)
{
    cli_session session;
    brume_render *render = NULL;
    brume_render_stats stats;
    cli_checkpoint checkpoint;
    cli_display display;
    cli_run run = {options, &session.info, &stats, 0, 0, 0, 0};
    double begin = cli_now();

    if (options->debugs)
        return cli_debug_sample(context, options, progress);
    int code = cli_outputs_check(options);
    if (!code)
        code = cli_checkpoint_check(options);
    if (code)
        return code;
    if (options->denoise && brume_denoiser_find(context))
        return cli_report(context, BRUME_ERROR_DENOISER);
    code = cli_session_open(&session, context, options, progress);
    if (code)
        goto cleanup;
    run.load_seconds = session.load_seconds;
    brume_render_desc desc = options->render;
    record_layers(session.scene, options, &desc);
    if (desc.time_limit > 0) {
        /* The limit is the command's: less what has gone by, and something for the pictures. */
        double left = desc.time_limit - (cli_now() - begin) - WRITE_SECONDS * pixels_to_write(session.scene, options);
        desc.time_limit = left > 0.001 ? left : 0.001;
    }
    brume_result result = brume_render_create(session.device, session.scene, &desc, &render);
    if (result) {
        code = cli_report(context, result);
        goto cleanup;
    }

    code = cli_checkpoint_start(&checkpoint, context, render, options, progress);
    if (code)
        goto cleanup;

    cli_display_start(&display, render, options);
    watchers watching = {&checkpoint, &display};
    cli_progress_step(progress, "Rendering", NULL);
    cli_interruptible(render);
    result = brume_render_run(render, tell, &watching);
    cli_display_finish(&display);
    cli_progress_finish(progress);
    /* After a failure, too, what has been rendered stays, if the device hands it out; the code is the failure's. */
    int failed = result && result != BRUME_CANCELLED ? cli_report(context, result) : CLI_EXIT_OK;
    result = brume_render_get_stats(render, &stats);
    if (result || (failed && stats.samples == 0)) {
        code = failed ? failed : cli_report(context, result);
        goto cleanup;
    }

    double written = cli_now();
    code = cli_checkpoint_finish(&checkpoint);
    int pictures_code = write_pictures(context, render, options, progress);
    if (code == CLI_EXIT_OK)
        code = pictures_code;
    if (failed)
        code = failed;
    run.write_seconds = cli_now() - written;
    run.total_seconds = cli_now() - begin;
    if (code == CLI_EXIT_OK && cli_signal())
        code = CLI_EXIT_SIGNAL + cli_signal();
    run.exit_code = code;
    if (options->verbosity > 0)
        cli_stats_summary(stderr, &run);
    int stats_code = cli_stats_write(options->stats_path, print_stats, &run);
    if (code == CLI_EXIT_OK)
        code = stats_code;
    if (stats.bad_samples > 0 && options->verbosity >= 0)
        fprintf(stderr, "render-cli: warning: what became of that sample is shown by: %s --debug-sample=%u,%u,%u\n",
                options->replay, stats.bad_pixel_x, stats.bad_pixel_y, stats.bad_sample);
    if (options->render.time_limit > 0 && !cli_signal() && stats.samples < (uint64_t)stats.width * stats.height &&
        options->verbosity >= 0)
        fprintf(stderr, "render-cli: warning: --time-limit was over before every pixel had a sample\n");
    if ((cli_signal() || (failed && !pictures_code)) && options->verbosity >= 0)
        fprintf(stderr, "render-cli: stopped at %.3g samples per pixel; what there is has been written\n",
                (double)stats.samples / ((double)stats.width * stats.height));
cleanup:
    cli_progress_finish(progress);
    cli_interruptible(NULL);
    brume_render_destroy(render);
    cli_session_close(&session);
    return code;
}

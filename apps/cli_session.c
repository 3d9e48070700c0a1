/* The scene, the device and the signals of a run. */
#include <signal.h>
#include <stdlib.h>
#include <string.h>

#include "cli.h"
#include "platform.h"

/* ---- signals ---- */

/* What the handler may touch: the render once there is one, and the signal that came first. */
static brume_render *interruptible_render;
static volatile sig_atomic_t first_signal;
static volatile sig_atomic_t held;

/* The first signal during a render stops it, and the picture is written; any other time, or the second one, there is
 * nothing to save. While the pictures are being written the first one waits until they are. */
static void on_signal(int number)
{
    brume_render *render = __atomic_load_n(&interruptible_render, __ATOMIC_ACQUIRE);
    if (first_signal || (!render && !held))
        platform_quit(CLI_EXIT_SIGNAL + number);
    first_signal = number;
    brume_render_cancel(render); /* NULL: there is none */
}

void cli_watch_signals(void)
{
    platform_watch_signals(on_signal);
}

void cli_interruptible(brume_render *render)
{
    __atomic_store_n(&interruptible_render, render, __ATOMIC_RELEASE);
}

void cli_hold_signals(int hold)
{
    held = hold;
}

int cli_signal(void)
{
    return first_signal;
}

/* ---- errors ---- */

static int exit_code_of(brume_result result)
{
    switch (result) {
    case BRUME_OK:
    case BRUME_CANCELLED: return CLI_EXIT_OK;
    case BRUME_ERROR_ARGUMENT: return CLI_EXIT_USAGE;
    case BRUME_ERROR_SCENE: return CLI_EXIT_SCENE;
    case BRUME_ERROR_NO_DEVICE: return CLI_EXIT_DEVICE;
    case BRUME_ERROR_BUILD: return CLI_EXIT_BUILD;
    case BRUME_ERROR_OUTPUT: return CLI_EXIT_OUTPUT;
    case BRUME_ERROR_CHECKPOINT: return CLI_EXIT_CHECKPOINT;
    case BRUME_ERROR_MEMORY:
    case BRUME_ERROR_DENOISER:
    case BRUME_ERROR_DEVICE: break;
    }
    return CLI_EXIT_RUNTIME;
}

int cli_report(const brume_context *context, brume_result result)
{
    const char *message = brume_context_message(context);
    cli_error("%s", *message ? message : brume_result_name(result));
    return exit_code_of(result);
}

/* ---- scene and device ---- */

double cli_now(void)
{
    return brume_seconds();
}

int cli_session_open(cli_session *session, brume_context *context, const cli_options *options, cli_progress *progress)
{
    memset(session, 0, sizeof *session);
    session->context = context;
    double begin = cli_now();
    cli_progress_step(progress, "Reading", options->scene);
    brume_context_set_load_progress(context, cli_progress_load, progress);
    brume_result result =
        brume_scene_load(context, options->scene, options->parameters, options->parameter_count, &session->scene);
    brume_context_set_load_progress(context, NULL, NULL);
    cli_progress_load(progress, NULL);
    if (result)
        return cli_report(context, result);
    session->load_seconds = cli_now() - begin;

    int code = cli_open_device(context, options->device, &session->device, &session->info);
    if (code == 0)
        cli_progress_step(progress, "Opening device", session->info.name);
    return code;
}

void cli_session_close(cli_session *session)
{
    brume_device_destroy(session->device);
    brume_scene_destroy(session->scene);
    memset(session, 0, sizeof *session);
}

/* The scene, the device and the signals of a run. */
#include <ctype.h>
#include <limits.h>
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

/* ---- devices ---- */

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

int cli_list_devices(brume_context *context)
{
    uint32_t count;
    brume_result result = brume_device_count(context, &count);
    if (result)
        return cli_report(context, result);
    brume_device_info info;
    if (count == 0) /* fails, and says what to install */
        return cli_report(context, brume_device_describe(context, BRUME_DEVICE_ANY, &info));
    for (uint32_t i = 0; i < count; i++) {
        result = brume_device_describe(context, i, &info);
        if (result)
            return cli_report(context, result);
        printf("%u: %s, %s, driver %s, %.1f GiB, %s\n", i, info.name, info.platform, info.driver,
               (double)info.memory_bytes / (1 << 30), info.is_gpu ? "GPU" : "CPU");
    }
    return CLI_EXIT_OK;
}

/* Whether `part` occurs in `text`, whatever the case of the letters. */
static int contains(const char *text, const char *part)
{
    for (; *text; text++) {
        size_t i = 0;
        while (part[i] && tolower((unsigned char)text[i]) == tolower((unsigned char)part[i]))
            i++;
        if (!part[i])
            return 1;
    }
    return 0;
}

/* The index of the device that --device names, and its description. */
static int choose_device(brume_context *context, const char *wanted, uint32_t *out_index, brume_device_info *out_info)
{
    uint32_t count, index = BRUME_DEVICE_ANY;
    brume_result result = brume_device_count(context, &count);
    if (result)
        return cli_report(context, result);
    if (wanted && count > 0) {
        char *end;
        unsigned long number = isdigit((unsigned char)*wanted) ? strtoul(wanted, &end, 10) : ULONG_MAX;
        if (number != ULONG_MAX && *end == 0) {
            if (number >= count) {
                cli_error("no device %s; there %s %u: --list-devices names them", wanted, count == 1 ? "is" : "are",
                          count);
                return CLI_EXIT_DEVICE;
            }
            index = (uint32_t)number;
        }
        for (uint32_t i = 0; i < count && index == BRUME_DEVICE_ANY; i++) {
            result = brume_device_describe(context, i, out_info);
            if (result)
                return cli_report(context, result);
            if (contains(out_info->name, wanted) || contains(out_info->platform, wanted))
                index = i;
        }
        if (index == BRUME_DEVICE_ANY) {
            cli_error("no device is called \"%s\"; --list-devices names those there are", wanted);
            return CLI_EXIT_DEVICE;
        }
    }
    result = brume_device_describe(context, index, out_info);
    if (result)
        return cli_report(context, result);
    *out_index = index;
    return CLI_EXIT_OK;
}

/* ---- both ---- */

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
    brume_result result =
        brume_scene_load(context, options->scene, options->parameters, options->parameter_count, &session->scene);
    if (result)
        return cli_report(context, result);
    session->load_seconds = cli_now() - begin;

    uint32_t index = BRUME_DEVICE_ANY;
    int code = choose_device(context, options->device, &index, &session->info);
    if (code)
        return code;
    cli_progress_step(progress, "Opening device", session->info.name);
    result = brume_device_open(context, index, &session->device);
    return result ? cli_report(context, result) : 0;
}

void cli_session_close(cli_session *session)
{
    brume_device_destroy(session->device);
    brume_scene_destroy(session->scene);
    memset(session, 0, sizeof *session);
}

/* render-cli -- renders a scene file to pictures. This file is the run from beginning to end; the command line, the
 * progress lines, the checks of output files and the statistics have files of their own (cli_*.c). */
#include <ctype.h>
#include <errno.h>
#include <limits.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "cli.h"

/* ---- signals ---- */

/* What the handler may touch: the render once there is one, and the signal that came first. */
static brume_render *interruptible_render;
static volatile sig_atomic_t first_signal;

/* The first signal during a render stops it, and the picture is written; any other time, or the second one, there is
 * nothing to save. While the pictures are being written the first one waits until they are. */
static void on_signal(int number)
{
    brume_render *render = __atomic_load_n(&interruptible_render, __ATOMIC_ACQUIRE);
    if (first_signal || !render)
        _exit(CLI_EXIT_SIGNAL + number);
    first_signal = number;
    brume_render_cancel(render);
}

static void watch_signal(int number)
{
    struct sigaction action, before;
    memset(&action, 0, sizeof action);
    action.sa_handler = on_signal;
    action.sa_flags = SA_RESTART;
    sigemptyset(&action.sa_mask);
    /* A shell starts background jobs with SIGINT ignored; that is to stay so. */
    if (sigaction(number, NULL, &before) == 0 && before.sa_handler != SIG_IGN)
        sigaction(number, &action, NULL);
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
    case BRUME_ERROR_MEMORY:
    case BRUME_ERROR_DEVICE: break;
    }
    return CLI_EXIT_RUNTIME;
}

static int report(const brume_context *context, brume_result result)
{
    const char *message = brume_context_message(context);
    cli_error("%s", *message ? message : brume_result_name(result));
    return exit_code_of(result);
}

static int list_devices(brume_context *context)
{
    uint32_t count;
    brume_result result = brume_device_count(context, &count);
    if (result)
        return report(context, result);
    brume_device_info info;
    if (count == 0) /* fails, and says what to install */
        return report(context, brume_device_describe(context, BRUME_DEVICE_ANY, &info));
    for (uint32_t i = 0; i < count; i++) {
        result = brume_device_describe(context, i, &info);
        if (result)
            return report(context, result);
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
        return report(context, result);
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
                return report(context, result);
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
        return report(context, result);
    *out_index = index;
    return CLI_EXIT_OK;
}

/* ---- the run ---- */

static double now(void)
{
    struct timespec time;
    clock_gettime(CLOCK_MONOTONIC, &time);
    return (double)time.tv_sec + 1e-9 * (double)time.tv_nsec;
}

static int check_outputs(const cli_options *options)
{
    for (size_t i = 0; i < options->output_count; i++) {
        int code = cli_output_check(options->outputs[i]);
        if (code)
            return code;
    }
    return options->stats_path && *options->stats_path ? cli_output_check(options->stats_path) : CLI_EXIT_OK;
}

static int write_pictures(brume_context *context, brume_render *render, const cli_options *options,
                          cli_progress *progress)
{
    brume_picture_desc picture = brume_picture_desc_default();
    picture.exposure = options->exposure;
    int code = CLI_EXIT_OK;
    for (size_t i = 0; i < options->output_count; i++) {
        cli_progress_step(progress, "Writing", options->outputs[i]);
        brume_result result = brume_render_write(render, options->outputs[i], &picture);
        if (result)
            code = report(context, result);
    }
    return code;
}

static int write_stats(const cli_run *run)
{
    const char *path = run->options->stats_path;
    if (!path)
        return CLI_EXIT_OK;
    FILE *file = *path ? fopen(path, "w") : stdout;
    if (file)
        cli_stats_print(file, run);
    int failed = !file || fflush(file) != 0 || ferror(file);
    if (file && *path)
        failed |= fclose(file) != 0;
    if (failed)
        cli_error("%s: statistics could not be written: %s", *path ? path : "standard output", strerror(errno));
    return failed ? CLI_EXIT_OUTPUT : CLI_EXIT_OK;
}

static int render_scene(brume_context *context, const cli_options *options, cli_progress *progress)
{
    brume_scene *scene = NULL;
    brume_device *device = NULL;
    brume_render *render = NULL;
    brume_device_info info;
    brume_render_stats stats;
    uint32_t index = BRUME_DEVICE_ANY;
    cli_run run = {options, &info, &stats, 0, 0, 0, 0};
    double begin = now();

    int code = check_outputs(options);
    if (code)
        return code;
    cli_progress_step(progress, "Reading", options->scene);
    brume_result result =
        brume_scene_load(context, options->scene, options->parameters, options->parameter_count, &scene);
    if (result) {
        code = report(context, result);
        goto cleanup;
    }
    run.load_seconds = now() - begin;

    code = choose_device(context, options->device, &index, &info);
    if (code)
        goto cleanup;
    cli_progress_step(progress, "Opening device", info.name);
    result = brume_device_open(context, index, &device);
    if (!result)
        result = brume_render_create(device, scene, &options->render, &render);
    if (result) {
        code = report(context, result);
        goto cleanup;
    }

    cli_progress_step(progress, "Rendering", NULL);
    __atomic_store_n(&interruptible_render, render, __ATOMIC_RELEASE);
    result = brume_render_run(render, cli_progress_update, progress);
    cli_progress_finish(progress);
    if (result && result != BRUME_CANCELLED) {
        code = report(context, result);
        goto cleanup;
    }

    double written = now();
    code = write_pictures(context, render, options, progress);
    run.write_seconds = now() - written;
    run.total_seconds = now() - begin;
    result = brume_render_get_stats(render, &stats);
    if (result) {
        code = report(context, result);
        goto cleanup;
    }
    if (code == CLI_EXIT_OK && first_signal)
        code = CLI_EXIT_SIGNAL + first_signal;
    run.exit_code = code;
    if (options->verbosity > 0)
        cli_stats_summary(stderr, &run);
    int stats_code = write_stats(&run);
    if (code == CLI_EXIT_OK)
        code = stats_code;
    if (first_signal && options->verbosity >= 0)
        fprintf(stderr, "render-cli: stopped at %u %% of the samples; what there is has been written\n",
                stats.sample_count == 0 ? 0 : (unsigned)(100.0 * (double)stats.samples /
                ((double)stats.width * stats.height * stats.sample_count)));
cleanup:
    cli_progress_finish(progress);
    __atomic_store_n(&interruptible_render, (brume_render *)NULL, __ATOMIC_RELEASE);
    brume_render_destroy(render);
    brume_device_destroy(device);
    brume_scene_destroy(scene);
    return code;
}

int main(int argc, char **argv)
{
    cli_options options;
    cli_progress progress;
    brume_context *context = NULL;
    int code = cli_options_parse(&options, argc, argv);
    if (code)
        goto cleanup;
    if (options.help || options.version) {
        if (options.help)
            cli_print_help(stdout);
        else
            puts("render-cli (brume) " BRUME_VERSION);
        goto cleanup;
    }
    watch_signal(SIGINT);
    watch_signal(SIGTERM);
    if (brume_context_create(&context)) {
        cli_error("out of memory");
        code = CLI_EXIT_RUNTIME;
        goto cleanup;
    }
    cli_progress_init(&progress, &options);
    brume_context_set_log(context, cli_progress_log, &progress);
    code = options.list_devices ? list_devices(context) : render_scene(context, &options, &progress);
cleanup:
    brume_context_destroy(context);
    cli_options_free(&options);
    if (fflush(stdout) != 0 && code == CLI_EXIT_OK)
        code = CLI_EXIT_OUTPUT;
    return code;
}

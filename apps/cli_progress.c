/* What render-cli says while it works: error and warning lines, steps, and the progress bar on standard error, or one
 * JSON object per line on standard output. */
#include <stdarg.h>
#include <string.h>

#include "cli.h"
#include "cli_duration.h"
#include "platform.h"

void cli_error(const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    fputs("render-cli: error: ", stderr);
    vfprintf(stderr, format, arguments);
    fputc('\n', stderr);
    va_end(arguments);
}

void cli_progress_init(cli_progress *progress, const cli_options *options)
{
    memset(progress, 0, sizeof *progress);
    progress->kind = options->progress;
    progress->verbosity = options->verbosity;
    progress->threshold = options->render.noise_threshold;
    progress->limit = options->render.time_limit;
    progress->bar = options->progress == CLI_PROGRESS_AUTO && options->verbosity >= 0 && platform_has_terminal();
}

static void clear_bar(cli_progress *progress)
{
    if (progress->bar_visible)
        fputs("\r\033[K", stderr);
    progress->bar_visible = 0;
}

void cli_progress_step(cli_progress *progress, const char *step, const char *detail)
{
    if (progress->kind == CLI_PROGRESS_JSON) {
        fputs("{\"event\":\"step\",\"step\":", stdout);
        cli_json_string(stdout, step);
        if (detail) {
            fputs(",\"detail\":", stdout);
            cli_json_string(stdout, detail);
        }
        fputs("}\n", stdout);
        fflush(stdout);
    } else if (progress->bar || progress->verbosity > 0) {
        clear_bar(progress);
        fprintf(stderr, "%s%s%s\n", step, detail ? " " : "", detail ? detail : "");
    }
}

void cli_progress_log(void *user, brume_log_level level, const char *message)
{
    cli_progress *progress = user;
    /* An error comes back as the result of a call too, and is reported there. */
    if (level == BRUME_LOG_WARNING) {
        if (progress->verbosity < 0)
            return;
        clear_bar(progress);
        fprintf(stderr, "render-cli: warning: %s\n", message);
    } else if (level == BRUME_LOG_INFO) {
        cli_progress_step(progress, message, NULL);
    }
}

static void format_duration(char *out, size_t size, double seconds)
{
    unsigned long whole = seconds < 0 ? 0 : seconds > 3.6e8 ? 360000000ul : (unsigned long)(seconds + 0.5);
    if (whole >= 3600)
        snprintf(out, size, "%lu:%02lu:%02lu", whole / 3600, whole / 60 % 60, whole % 60);
    else
        snprintf(out, size, "%lu:%02lu", whole / 60, whole % 60);
}

/* What the goal takes, or what it will bring, once about a second of rendering can tell. */
static void print_prediction(cli_progress *progress, const brume_progress *update)
{
    if (progress->predicted || progress->verbosity < 0 || !(progress->threshold > 0 || progress->limit > 0) ||
        update->predicted_seconds < 0 || update->seconds < 1)
        return;
    progress->predicted = 1;
    clear_bar(progress);
    char seconds[CLI_DURATION_SIZE], low[CLI_DURATION_SIZE], high[CLI_DURATION_SIZE];
    cli_duration(update->predicted_seconds, seconds);
    if (progress->threshold > 0 && update->predicted_relmse <= progress->threshold)
        fprintf(stderr, "relMSE %.2g in about %s (%s to %s)\n", progress->threshold, seconds,
                cli_duration(update->predicted_low, low), cli_duration(update->predicted_high, high));
    else if (progress->threshold > 0)
        fprintf(stderr, "relMSE %.2g is out of reach: about %.2g in %s\n", progress->threshold,
                update->predicted_relmse, seconds);
    else
        fprintf(stderr, "relMSE of about %.2g in %s\n", update->predicted_relmse, seconds);
}

static void print_number(const char *name, double value)
{
    if (value >= 0)
        printf(",\"%s\":%.6g", name, value);
}

int cli_progress_update(void *user, const brume_progress *update)
{
    cli_progress *progress = user;
    print_prediction(progress, update);
    if (progress->kind == CLI_PROGRESS_JSON) {
        printf("{\"event\":\"progress\",\"seconds\":%.3f,\"fraction\":%.6f,\"seconds_left\":%.3f,\"samples\":%llu",
               update->seconds, update->fraction, update->seconds_left, (unsigned long long)update->samples);
        print_number("relmse", update->relmse);
        print_number("relmse_low", update->relmse_low);
        print_number("relmse_high", update->relmse_high);
        print_number("predicted_seconds", update->predicted_seconds);
        print_number("predicted_low", update->predicted_low);
        print_number("predicted_high", update->predicted_high);
        print_number("predicted_relmse", update->predicted_relmse);
        puts("}");
        fflush(stdout);
    } else if (progress->bar) {
        enum { WIDTH = 40 };
        char bar[WIDTH + 1], elapsed[24], left[24];
        double fraction = update->fraction < 0 ? 0 : update->fraction > 1 ? 1 : update->fraction;
        int filled = (int)(fraction * WIDTH + 0.5);
        for (int i = 0; i < WIDTH; i++)
            bar[i] = i < filled ? '#' : '.';
        bar[WIDTH] = 0;
        format_duration(elapsed, sizeof elapsed, update->seconds);
        format_duration(left, sizeof left, update->seconds_left);
        fprintf(stderr, "\r\033[K[%s] %3d %%  %s, %s left", bar, (int)(fraction * 100), elapsed, left);
        if (update->relmse >= 0)
            fprintf(stderr, ", relMSE %.2g", update->relmse);
        fflush(stderr);
        progress->bar_visible = 1;
    }
    return 0;
}

int cli_progress_load(void *user, const brume_load_progress *load)
{
    cli_progress *progress = user;
    clear_bar(progress);
    if (!progress->bar || !load)
        return 0;
    fprintf(stderr, "Reading %s: %d %%", load->path, (int)(100 * load->fraction));
    fflush(stderr);
    progress->bar_visible = 1;
    return 0;
}

void cli_progress_checkpoint(cli_progress *progress, const char *path, double seconds)
{
    if (progress->kind == CLI_PROGRESS_JSON) {
        fputs("{\"event\":\"checkpoint\",\"path\":", stdout);
        cli_json_string(stdout, path);
        printf(",\"seconds\":%.3f}\n", seconds);
        fflush(stdout);
    } else if (progress->verbosity > 0) {
        clear_bar(progress);
        fprintf(stderr, "Checkpoint %s, written in %.2f s\n", path, seconds);
    }
}

void cli_progress_finish(cli_progress *progress)
{
    clear_bar(progress);
}

/* What render-cli says while it works: error and warning lines, steps, and the progress bar on standard error, or one
 * JSON object per line on standard output. */
#include <stdarg.h>
#include <string.h>
#include <unistd.h>

#include "cli.h"

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
    progress->bar = options->progress == CLI_PROGRESS_AUTO && options->verbosity >= 0 && isatty(STDERR_FILENO);
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

int cli_progress_update(void *user, const brume_progress *update)
{
    cli_progress *progress = user;
    if (progress->kind == CLI_PROGRESS_JSON) {
        printf("{\"event\":\"progress\",\"seconds\":%.3f,\"fraction\":%.6f,\"seconds_left\":%.3f,\"samples\":%llu}\n",
               update->seconds, update->fraction, update->seconds_left, (unsigned long long)update->samples);
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
        fflush(stderr);
        progress->bar_visible = 1;
    }
    return 0;
}

void cli_progress_finish(cli_progress *progress)
{
    clear_bar(progress);
}

/* What the options' values mean. */
#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "cli_options.h"
#include "estimators.h"

/* A decimal number up to 2^32 - 1 at *text, which must be followed by `stop`; moves *text behind that. */
static int parse_uint(const char **text, char stop, uint32_t *out)
{
    const char *s = *text;
    if (*s < '0' || *s > '9')
        return 0;
    char *end;
    errno = 0;
    unsigned long long value = strtoull(s, &end, 10);
    if (errno || value > UINT32_MAX || *end != stop)
        return 0;
    *out = (uint32_t)value;
    *text = end + (stop != 0);
    return 1;
}

/* A positive number. */
static int parse_positive(option_id id, const char *value, double *out)
{
    char *end;
    *out = strtod(value, &end);
    return end != value && !*end && isfinite(*out) && *out > 0 ? 0 : cli_wrong_value(id, value);
}

static int parse_define(cli_options *options, const char *value)
{
    const char *equals = strchr(value, '=');
    if (!equals || equals == value)
        return cli_wrong_value(OPTION_DEFINE, value);
    size_t length = (size_t)(equals - value);
    for (size_t i = 0; i < options->parameter_count; i++)
        if (strncmp(options->parameters[i].name, value, length) == 0 && options->parameters[i].name[length] == 0) {
            options->parameters[i].value = equals + 1;
            return 0;
        }
    char *name = malloc(length + 1);
    if (!name) {
        cli_error("out of memory");
        return CLI_EXIT_RUNTIME;
    }
    memcpy(name, value, length);
    name[length] = 0;
    /* parameters holds one entry per argument of the command line, so it never grows. */
    options->parameters[options->parameter_count].name = name;
    options->parameters[options->parameter_count++].value = equals + 1;
    return 0;
}

static int parse_strategy(brume_render_desc *render, const char *value)
{
    if (!estimators_strategy(value, strlen(value), &render->strategy, &render->positions))
        return cli_wrong_value(OPTION_STRATEGY, value);
    render->use_strategy = 1;
    return 0;
}

static int parse_indirect(brume_render_desc *render, const char *value)
{
    if (!estimators_indirect(value, strlen(value), &render->indirect))
        return cli_wrong_value(OPTION_INDIRECT, value);
    render->use_indirect = 1;
    return 0;
}

/* The names that cli_options.c lists. */
static int unknown_layer(const char *name, size_t length)
{
    const char *best = NULL;
    int best_distance = 4;
    for (int i = 0; i < 32; i++) {
        const char *known = brume_channel_name((brume_channel)i);
        int distance = known ? cli_spelling_distance(name, length, known) : best_distance;
        if (distance < best_distance && distance * 2 <= (int)length) {
            best = known;
            best_distance = distance;
        }
    }
    if (best)
        cli_error("--layers: unknown layer %.*s; did you mean %s?", (int)length, name, best);
    else
        cli_error("--layers: unknown layer %.*s; --help lists them", (int)length, name);
    return CLI_EXIT_USAGE;
}

/* all, none or NAME,NAME,... */
static int parse_layers(uint32_t *layers, const char *value)
{
    *layers = 0;
    if (strcmp(value, "none") == 0)
        return 0;
    int all = strcmp(value, "all") == 0;
    for (const char *name = value;; name++) {
        size_t length = strcspn(name, ",");
        int found = all;
        for (int i = 0; i < 32; i++) {
            const char *known = brume_channel_name((brume_channel)i);
            if (known && (all || (strlen(known) == length && strncmp(known, name, length) == 0))) {
                *layers |= 1u << i;
                found = 1;
            }
        }
        if (!found)
            return unknown_layer(name, length);
        name += length;
        if (!*name)
            return 0;
    }
}

static int unknown_effect(const char *name, size_t length)
{
    const char *best = NULL, *known;
    int best_distance = 4;
    for (int i = 0; (known = brume_effect_name((brume_effect)i)) != NULL; i++) {
        int distance = cli_spelling_distance(name, length, known);
        if (distance < best_distance && distance * 2 <= (int)length && brume_effect_removable((brume_effect)i)) {
            best = known;
            best_distance = distance;
        }
    }
    if (best)
        cli_error("--without: unknown effect %.*s; did you mean %s?", (int)length, name, best);
    else
        cli_error("--without: unknown effect %.*s; --help lists them", (int)length, name);
    return CLI_EXIT_USAGE;
}

/* NAME,NAME,... */
static int parse_without(brume_render_desc *render, const char *value)
{
    for (const char *name = value;; name++) {
        size_t length = strcspn(name, ",");
        const char *known;
        int i = 0;
        while ((known = brume_effect_name((brume_effect)i)) != NULL &&
               (strlen(known) != length || strncmp(known, name, length) != 0))
            i++;
        if (!known)
            return unknown_effect(name, length);
        if (!brume_effect_removable((brume_effect)i)) {
            cli_error("--without: %s can't be taken away; --help lists what can", known);
            return CLI_EXIT_USAGE;
        }
        render->without |= 1u << i;
        name += length;
        if (!*name)
            return 0;
    }
}

int cli_option_set(cli_options *options, option_id id, const char *value)
{
    brume_render_desc *render = &options->render;
    const char *text = value;
    uint32_t a, b, x0, x1, y0, y1;
    char *end;
    switch (id) {
    case OPTION_OUTPUT:
        if (options->command != CLI_EFFECTS && !cli_output_known(value)) {
            cli_error("%s: the extension must be .exr or .png", value);
            return CLI_EXIT_USAGE;
        }
        options->outputs[options->output_count++] = value;
        return 0;
    case OPTION_SPP:
        if (!parse_uint(&text, 0, &a) || a == 0)
            return cli_wrong_value(id, value);
        render->sample_count = a;
        return 0;
    case OPTION_SAMPLE_RANGE:
        if (!parse_uint(&text, ':', &a) || !parse_uint(&text, 0, &b) || a >= b)
            return cli_wrong_value(id, value);
        render->first_sample = a;
        render->sample_count = b - a;
        return 0;
    case OPTION_NOISE_THRESHOLD:
        return parse_positive(id, value, &render->noise_threshold);
    case OPTION_TIME_LIMIT:
        return parse_positive(id, value, &render->time_limit);
    case OPTION_ADAPTIVE:
        if (strcmp(value, "auto") == 0)
            render->adaptive = BRUME_ADAPTIVE_AUTO;
        else if (strcmp(value, "on") == 0)
            render->adaptive = BRUME_ADAPTIVE_ON;
        else if (strcmp(value, "off") == 0)
            render->adaptive = BRUME_ADAPTIVE_OFF;
        else
            return cli_wrong_value(id, value);
        return 0;
    case OPTION_SEED:
        if (!parse_uint(&text, 0, &a))
            return cli_wrong_value(id, value);
        render->use_seed = 1;
        render->seed = a;
        return 0;
    case OPTION_STRATEGY:
        return parse_strategy(render, value);
    case OPTION_INDIRECT:
        return parse_indirect(render, value);
    case OPTION_WITHOUT:
        return parse_without(render, value);
    case OPTION_CROP:
        if (!parse_uint(&text, ',', &x0) || !parse_uint(&text, ',', &x1) || !parse_uint(&text, ',', &y0) ||
            !parse_uint(&text, 0, &y1) || x0 >= x1 || y0 >= y1)
            return cli_wrong_value(id, value);
        render->use_crop = 1;
        render->crop_x = x0;
        render->crop_y = y0;
        render->crop_width = x1 - x0;
        render->crop_height = y1 - y0;
        return 0;
    case OPTION_DEFINE:
        return parse_define(options, value);
    case OPTION_LAYERS:
        return parse_layers(&options->layers, value);
    case OPTION_EXPOSURE:
        options->exposure = strtof(value, &end);
        if (end == value || *end || !isfinite(options->exposure))
            return cli_wrong_value(id, value);
        return 0;
    case OPTION_TONEMAP:
        options->tonemap = strcmp(value, "filmic") == 0 ? BRUME_TONEMAP_FILMIC : BRUME_TONEMAP_NONE;
        return options->tonemap || strcmp(value, "none") == 0 ? 0 : cli_wrong_value(id, value);
    case OPTION_DENOISE:
        options->denoise = strcmp(value, "beauty") == 0   ? BRUME_DENOISE_BEAUTY
                           : strcmp(value, "layers") == 0 ? BRUME_DENOISE_LAYERS
                                                          : BRUME_DENOISE_NONE;
        return options->denoise || strcmp(value, "none") == 0 ? 0 : cli_wrong_value(id, value);
    case OPTION_DISPLAY:
        if (!*value)
            return cli_wrong_value(id, value);
        options->display_server = value;
        return 0;
    case OPTION_DEVICE:
        if (!*value)
            return cli_wrong_value(id, value);
        options->device = value;
        return 0;
    case OPTION_PRECISION:
        if (strcmp(value, "float") == 0)
            render->precision = BRUME_PRECISION_FLOAT;
        else if (strcmp(value, "double") == 0)
            render->precision = BRUME_PRECISION_DOUBLE;
        else
            return cli_wrong_value(id, value);
        return 0;
    case OPTION_LANES:
        if (!parse_uint(&text, 0, &a) || (a != 1 && a != 4 && a != 8 && a != 16))
            return cli_wrong_value(id, value);
        render->lanes = a;
        return 0;
    case OPTION_STATS:
        if (strncmp(value, "json", 4) != 0 || (value[4] && (value[4] != ':' || !value[5])))
            return cli_wrong_value(id, value);
        options->stats_path = value[4] ? value + 5 : "";
        return 0;
    case OPTION_PROGRESS:
        if (strcmp(value, "auto") == 0)
            options->progress = CLI_PROGRESS_AUTO;
        else if (strcmp(value, "none") == 0)
            options->progress = CLI_PROGRESS_NONE;
        else if (strcmp(value, "json") == 0)
            options->progress = CLI_PROGRESS_JSON;
        else
            return cli_wrong_value(id, value);
        return 0;
    case OPTION_LIST_DEVICES:
        options->list_devices = 1;
        return 0;
    case OPTION_CLAMP:
        render->clamp = strtof(value, &end);
        if (end == value || *end || !isfinite(render->clamp) || render->clamp <= 0)
            return cli_wrong_value(id, value);
        return 0;
    case OPTION_CHECKPOINT:
        if (!*value)
            return cli_wrong_value(id, value);
        options->checkpoint = value;
        return 0;
    case OPTION_CHECKPOINT_INTERVAL:
        return parse_positive(id, value, &options->checkpoint_interval);
    case OPTION_PARTIAL:
        options->partial = 1;
        return 0;
    case OPTION_RESUME:
        options->resume = 1;
        return 0;
    case OPTION_DEBUG_SAMPLE:
        if (!parse_uint(&text, ',', &options->debug_sample[0]) || !parse_uint(&text, ',', &options->debug_sample[1]) ||
            !parse_uint(&text, 0, &options->debug_sample[2]))
            return cli_wrong_value(id, value);
        options->debugs = 1;
        return 0;
    case OPTION_FOLDER:
    case OPTION_SETTINGS:
    case OPTION_REFERENCE:
        if (!*value)
            return cli_wrong_value(id, value);
        *(id == OPTION_FOLDER ? &options->study.folder
          : id == OPTION_SETTINGS ? &options->study.settings : &options->study.reference) = value;
        return 0;
    case OPTION_BUDGET:
        return parse_positive(id, value, &options->study.budget);
    case OPTION_TARGET:
        return parse_positive(id, value, &options->study.target);
    case OPTION_TIME_TARGET:
        return parse_positive(id, value, &options->study.time_target);
    case OPTION_CLOCK:
        options->study.cpu_clock = strcmp(value, "cpu") == 0;
        return options->study.cpu_clock || strcmp(value, "wall") == 0 ? 0 : cli_wrong_value(id, value);
    case OPTION_WIDTH:
        if (!parse_uint(&text, 0, &a) || a == 0 || a > 65536)
            return cli_wrong_value(id, value);
        options->study.width = a;
        return 0;
    case OPTION_FRESH:
        options->study.fresh = 1;
        return 0;
    case OPTION_QUIET:
        options->verbosity = -1;
        return 0;
    case OPTION_VERBOSE:
        options->verbosity = 1;
        return 0;
    case OPTION_HELP:
        options->help = 1;
        return 0;
    case OPTION_VERSION:
        options->version = 1;
        return 0;
    case OPTION_COUNT:
        break;
    }
    return CLI_EXIT_USAGE;
}

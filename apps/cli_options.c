/* The command line of render-cli: one table of options, from which the parser, the help and the near spellings come. */
#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "cli.h"

typedef enum option_id {
    OPTION_OUTPUT,
    OPTION_SPP,
    OPTION_SAMPLE_RANGE,
    OPTION_SEED,
    OPTION_STRATEGY,
    OPTION_INDIRECT,
    OPTION_CROP,
    OPTION_DEFINE,
    OPTION_EXPOSURE,
    OPTION_DEVICE,
    OPTION_LIST_DEVICES,
    OPTION_PRECISION,
    OPTION_LANES,
    OPTION_STATS,
    OPTION_PROGRESS,
    OPTION_QUIET,
    OPTION_VERBOSE,
    OPTION_HELP,
    OPTION_VERSION,
    OPTION_COUNT
} option_id;

typedef struct option {
    char letter;          /* 0: none */
    const char *name;     /* without the dashes */
    const char *argument; /* NULL: takes none */
    const char *help;
} option;

static const option options_table[OPTION_COUNT] = {
    [OPTION_OUTPUT] = {'o', "output", "FILE", "picture to write, .exr or .png; may be given more than once\n"
                                              "(default: the scene's name with .exr, in the current folder)"},
    [OPTION_SPP] = {0, "spp", "N", "samples per pixel (default: the scene's)"},
    [OPTION_SAMPLE_RANGE] = {0, "sample-range", "A:B", "samples A to B - 1 of every pixel; disjoint ranges add up"},
    [OPTION_SEED] = {0, "seed", "S", "seed of the random numbers (default: the scene's)"},
    [OPTION_STRATEGY] = {0, "strategy", "NAME[:N]", "estimator of light scattered once: spherical, distance,\n"
                                                    "equiangular, equiangular-cone, mis, product, systematic,\n"
                                                    "raster; N: positions on a segment, for the last two\n"
                                                    "(default: the scene's, else auto)"},
    [OPTION_INDIRECT] = {0, "indirect", "NAME", "estimator of light scattered more than once: phase, mixture,\n"
                                                "ray-lights (default: the scene's, else auto)"},
    [OPTION_CROP] = {0, "crop", "X0,X1,Y0,Y1", "only the pixels X0 <= x < X1, Y0 <= y < Y1, counted from the top left"},
    [OPTION_DEFINE] = {'D', "define", "NAME=VALUE", "sets $NAME in the scene file"},
    [OPTION_EXPOSURE] = {0, "exposure", "EV", "stops by which PNGs are brightened (default: 0)"},
    [OPTION_DEVICE] = {0, "device", "I|NAME", "device by index or part of its name (default: a GPU, else the CPU)"},
    [OPTION_LIST_DEVICES] = {0, "list-devices", NULL, "names the devices, one a line, and exits"},
    [OPTION_PRECISION] = {0, "precision", "float|double", "arithmetic of the kernels (default: float)"},
    [OPTION_LANES] = {0, "lanes", "N", "paths per work-item: 1, 4, 8 or 16 (default: what suits the device)"},
    [OPTION_STATS] = {0, "stats", "json[:FILE]", "statistics as one JSON object, to standard output or a file"},
    [OPTION_PROGRESS] = {0, "progress", "auto|none|json", "a bar on a terminal (default), nothing, or JSON lines on\n"
                                                          "standard output"},
    [OPTION_QUIET] = {'q', "quiet", NULL, "prints errors only"},
    [OPTION_VERBOSE] = {'v', "verbose", NULL, "prints each step, and times at the end"},
    [OPTION_HELP] = {'h', "help", NULL, "prints this and exits"},
    [OPTION_VERSION] = {0, "version", NULL, "prints the version and exits"},
};

void cli_print_help(FILE *file)
{
    fputs("usage: render-cli SCENE.xml [-o FILE]... [options]\n"
          "Renders a Mitsuba 3 scene, with light in fog, on an OpenCL device.\n\n", file);
    for (int i = 0; i < OPTION_COUNT; i++) {
        const option *entry = &options_table[i];
        char left[64];
        char short_form[] = "-x, ";
        short_form[1] = entry->letter;
        snprintf(left, sizeof left, "%s--%s%s%s", entry->letter ? short_form : "    ", entry->name,
                 entry->argument ? " " : "", entry->argument ? entry->argument : "");
        const char *line = entry->help, *end;
        fprintf(file, "  %-28s ", left);
        while ((end = strchr(line, '\n')) != NULL) {
            fprintf(file, "%.*s\n  %-28s ", (int)(end - line), line, "");
            line = end + 1;
        }
        fprintf(file, "%s\n", line);
    }
    fputs("\nCtrl-C stops, writes the picture as far as it is, and exits with 130; a second Ctrl-C exits at once.\n"
          "Exit codes: 0 done, 1 failed while running, 2 wrong usage, 3 wrong scene, 4 no device,\n"
          "5 kernels not built, 6 output not written, 130 and 143 stopped by SIGINT and SIGTERM.\n", file);
}

/* Optimal string alignment distance (insert, delete, replace, swap neighbours), capped: names are short. */
static int spelling_distance(const char *a, size_t a_length, const char *b)
{
    enum { LIMIT = 24 };
    size_t b_length = strlen(b);
    if (a_length > LIMIT || b_length > LIMIT)
        return LIMIT;
    int d[LIMIT + 1][LIMIT + 1];
    for (size_t i = 0; i <= a_length; i++)
        d[i][0] = (int)i;
    for (size_t j = 0; j <= b_length; j++)
        d[0][j] = (int)j;
    for (size_t i = 1; i <= a_length; i++)
        for (size_t j = 1; j <= b_length; j++) {
            int best = d[i - 1][j - 1] + (a[i - 1] != b[j - 1]);
            if (d[i - 1][j] + 1 < best)
                best = d[i - 1][j] + 1;
            if (d[i][j - 1] + 1 < best)
                best = d[i][j - 1] + 1;
            if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] && d[i - 2][j - 2] + 1 < best)
                best = d[i - 2][j - 2] + 1;
            d[i][j] = best;
        }
    return d[a_length][b_length];
}

static int unknown_option(const char *name, size_t length)
{
    int best = -1, best_distance = 4;
    for (int i = 0; i < OPTION_COUNT; i++) {
        int distance = spelling_distance(name, length, options_table[i].name);
        if (distance < best_distance && distance * 2 <= (int)length) {
            best = i;
            best_distance = distance;
        }
    }
    if (best >= 0)
        cli_error("unknown option --%.*s; did you mean --%s?", (int)length, name, options_table[best].name);
    else
        cli_error("unknown option --%.*s; --help lists them", (int)length, name);
    return CLI_EXIT_USAGE;
}

static int wrong_value(option_id id, const char *value)
{
    cli_error("--%s: expected %s, not \"%s\"", options_table[id].name, options_table[id].argument, value);
    return CLI_EXIT_USAGE;
}

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

static int parse_define(cli_options *options, const char *value)
{
    const char *equals = strchr(value, '=');
    if (!equals || equals == value)
        return wrong_value(OPTION_DEFINE, value);
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

/* NAME or NAME:N */
static int parse_strategy(brume_render_desc *render, const char *value)
{
    size_t length = strcspn(value, ":");
    const char *name;
    uint32_t positions = 0;
    if (value[length]) {
        const char *text = value + length + 1;
        if (!parse_uint(&text, 0, &positions) || positions == 0 || positions > 64 || (positions & (positions - 1)) != 0)
            return wrong_value(OPTION_STRATEGY, value);
    }
    for (int i = 0; (name = brume_strategy_name((brume_strategy)i)) != NULL; i++)
        if (strlen(name) == length && strncmp(name, value, length) == 0) {
            render->use_strategy = 1;
            render->strategy = (brume_strategy)i;
            render->positions = positions;
            return 0;
        }
    return wrong_value(OPTION_STRATEGY, value);
}

static int parse_indirect(brume_render_desc *render, const char *value)
{
    const char *name;
    for (int i = 0; (name = brume_indirect_name((brume_indirect)i)) != NULL; i++)
        if (strcmp(name, value) == 0) {
            render->use_indirect = 1;
            render->indirect = (brume_indirect)i;
            return 0;
        }
    return wrong_value(OPTION_INDIRECT, value);
}

static int parse_value(cli_options *options, option_id id, const char *value)
{
    brume_render_desc *render = &options->render;
    const char *text = value;
    uint32_t a, b, x0, x1, y0, y1;
    char *end;
    switch (id) {
    case OPTION_OUTPUT:
        if (!cli_output_known(value)) {
            cli_error("%s: the extension must be .exr or .png", value);
            return CLI_EXIT_USAGE;
        }
        options->outputs[options->output_count++] = value;
        return 0;
    case OPTION_SPP:
        if (!parse_uint(&text, 0, &a) || a == 0)
            return wrong_value(id, value);
        render->sample_count = a;
        return 0;
    case OPTION_SAMPLE_RANGE:
        if (!parse_uint(&text, ':', &a) || !parse_uint(&text, 0, &b) || a >= b)
            return wrong_value(id, value);
        render->first_sample = a;
        render->sample_count = b - a;
        return 0;
    case OPTION_SEED:
        if (!parse_uint(&text, 0, &a))
            return wrong_value(id, value);
        render->use_seed = 1;
        render->seed = a;
        return 0;
    case OPTION_STRATEGY:
        return parse_strategy(render, value);
    case OPTION_INDIRECT:
        return parse_indirect(render, value);
    case OPTION_CROP:
        if (!parse_uint(&text, ',', &x0) || !parse_uint(&text, ',', &x1) || !parse_uint(&text, ',', &y0) ||
            !parse_uint(&text, 0, &y1) || x0 >= x1 || y0 >= y1)
            return wrong_value(id, value);
        render->use_crop = 1;
        render->crop_x = x0;
        render->crop_y = y0;
        render->crop_width = x1 - x0;
        render->crop_height = y1 - y0;
        return 0;
    case OPTION_DEFINE:
        return parse_define(options, value);
    case OPTION_EXPOSURE:
        options->exposure = strtof(value, &end);
        if (end == value || *end || !isfinite(options->exposure))
            return wrong_value(id, value);
        return 0;
    case OPTION_DEVICE:
        if (!*value)
            return wrong_value(id, value);
        options->device = value;
        return 0;
    case OPTION_PRECISION:
        if (strcmp(value, "float") == 0)
            render->precision = BRUME_PRECISION_FLOAT;
        else if (strcmp(value, "double") == 0)
            render->precision = BRUME_PRECISION_DOUBLE;
        else
            return wrong_value(id, value);
        return 0;
    case OPTION_LANES:
        if (!parse_uint(&text, 0, &a) || (a != 1 && a != 4 && a != 8 && a != 16))
            return wrong_value(id, value);
        render->lanes = a;
        return 0;
    case OPTION_STATS:
        if (strncmp(value, "json", 4) != 0 || (value[4] && (value[4] != ':' || !value[5])))
            return wrong_value(id, value);
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
            return wrong_value(id, value);
        return 0;
    case OPTION_LIST_DEVICES:
        options->list_devices = 1;
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

/* "folder/fog.xml" is written to "fog.exr" in the current folder. */
static int set_default_output(cli_options *options)
{
    const char *slash = strrchr(options->scene, '/');
    const char *name = slash ? slash + 1 : options->scene;
    const char *dot = strrchr(name, '.');
    size_t length = dot && dot != name ? (size_t)(dot - name) : strlen(name);
    options->default_output = malloc(length + sizeof ".exr");
    if (!options->default_output) {
        cli_error("out of memory");
        return CLI_EXIT_RUNTIME;
    }
    memcpy(options->default_output, name, length);
    memcpy(options->default_output + length, ".exr", sizeof ".exr");
    options->outputs[options->output_count++] = options->default_output;
    return 0;
}

/* The option that `argument` names, and in *value what stands behind "=" or the letter (NULL: nothing). */
static int find_option(const char *argument, option_id *id, const char **value)
{
    *value = NULL;
    if (argument[1] != '-') {
        for (int i = 0; i < OPTION_COUNT; i++)
            if (options_table[i].letter == argument[1]) {
                *id = (option_id)i;
                if (argument[2])
                    *value = argument + 2;
                return 0;
            }
        cli_error("unknown option -%c; --help lists them", argument[1]);
        return CLI_EXIT_USAGE;
    }
    const char *name = argument + 2;
    size_t length = strcspn(name, "=");
    for (int i = 0; i < OPTION_COUNT; i++)
        if (strncmp(options_table[i].name, name, length) == 0 && options_table[i].name[length] == 0) {
            *id = (option_id)i;
            if (name[length])
                *value = name + length + 1;
            return 0;
        }
    return unknown_option(name, length);
}

int cli_options_parse(cli_options *options, int argc, char **argv)
{
    memset(options, 0, sizeof *options);
    options->render = brume_render_desc_default();
    options->render.quick_start = 1;
    size_t most = (size_t)argc + 1;
    options->outputs = calloc(most, sizeof *options->outputs);
    options->parameters = calloc(most, sizeof *options->parameters);
    if (!options->outputs || !options->parameters) {
        cli_error("out of memory");
        return CLI_EXIT_RUNTIME;
    }
    int only_names = 0, spp_given = 0, range_given = 0;
    for (int i = 1; i < argc; i++) {
        const char *argument = argv[i];
        if (only_names || argument[0] != '-' || !argument[1]) {
            if (options->scene) {
                cli_error("more than one scene: %s and %s", options->scene, argument);
                return CLI_EXIT_USAGE;
            }
            options->scene = argument;
            continue;
        }
        if (strcmp(argument, "--") == 0) {
            only_names = 1;
            continue;
        }
        option_id id;
        const char *value;
        int code = find_option(argument, &id, &value);
        if (code)
            return code;
        if (!options_table[id].argument && value) {
            cli_error("--%s takes no value", options_table[id].name);
            return CLI_EXIT_USAGE;
        }
        if (options_table[id].argument && !value) {
            if (i + 1 >= argc) {
                cli_error("--%s needs %s", options_table[id].name, options_table[id].argument);
                return CLI_EXIT_USAGE;
            }
            value = argv[++i];
        }
        spp_given |= id == OPTION_SPP;
        range_given |= id == OPTION_SAMPLE_RANGE;
        code = parse_value(options, id, value);
        if (code)
            return code;
    }
    if (options->help || options->version || options->list_devices)
        return 0;
    if (spp_given && range_given) {
        cli_error("--spp and --sample-range exclude each other");
        return CLI_EXIT_USAGE;
    }
    if (!options->scene || !*options->scene) {
        cli_error("no scene; usage: render-cli SCENE.xml [-o FILE]... [options], or --help");
        return CLI_EXIT_USAGE;
    }
    return options->output_count > 0 ? 0 : set_default_output(options);
}

void cli_options_free(cli_options *options)
{
    for (size_t i = 0; i < options->parameter_count; i++)
        free((char *)options->parameters[i].name);
    free(options->parameters);
    free(options->outputs);
    free(options->default_output);
}

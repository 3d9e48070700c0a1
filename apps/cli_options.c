/* The command line of render-cli: one table of options, from which the parser, the help and the near spellings come. */
#include <stdlib.h>
#include <string.h>

#include "cli_options.h"
#include "platform.h"

enum {
    RENDER = 1 << CLI_RENDER,
    INFO = 1 << CLI_INFO,
    EFFECTS = 1 << CLI_EFFECTS,
    STUDY = 1 << CLI_STUDY,
    MERGE = 1 << CLI_MERGE,
    ALL = (1 << CLI_COMMAND_COUNT) - 1,
    EVERY = ALL & ~MERGE, /* that reads a scene */
    ONE_RENDER = EVERY & ~STUDY, /* what a study varies itself */
    SAMPLE = 1 << 16 /* what a sample comes out as may depend on it: a part of the command that replays one */
};

const cli_option cli_option_table[OPTION_COUNT] = {
    [OPTION_OUTPUT] =
        {RENDER | EFFECTS | MERGE, 'o', "output", "FILE",
         "picture to write, .exr or .png; may be given more than once\n"
         "(default: the scene's name with .exr, in the current folder);\n"
         "of effects: folder for effects.json and small pictures (none)"},
    [OPTION_SPP] = {ONE_RENDER, 0, "spp", "N", "samples per pixel (default: the scene's)"},
    [OPTION_SAMPLE_RANGE] =
        {RENDER | MERGE, 0, "sample-range", "A:B", "samples A to B - 1 of every pixel; disjoint ranges add up;\n"
                                                   "of merge: which have to be there (default: 0 to the last that a\n"
                                                   "file is for)"},
    [OPTION_PARTIAL] = {MERGE, 0, "partial", NULL, "leaves out samples that are missing, and says which"},
    [OPTION_NOISE_THRESHOLD] =
        {RENDER, 0, "noise-threshold", "E", "renders until relMSE, the picture's estimated error, is E or less; then\n"
                                            "--spp is the most samples it may take"},
    [OPTION_TIME_LIMIT] =
        {RENDER, 0, "time-limit", "S", "the best picture within S seconds, reading and building included"},
    [OPTION_ADAPTIVE] =
        {RENDER, 0, "adaptive", "auto|on|off", "samples where the error is (default: auto, with one of the last two);\n"
                                               "on: with --spp, too, which then is the mean over the pixels"},
    [OPTION_SEED] = {EVERY | SAMPLE, 0, "seed", "S", "seed of the random numbers (default: the scene's)"},
    [OPTION_STRATEGY] =
        {ONE_RENDER | SAMPLE, 0, "strategy", "NAME[:N]",
         "estimator of light scattered once: spherical, distance,\n"
         "equiangular, equiangular-cone, mis, product, systematic,\n"
         "raster; N: positions on a segment, for the last two\n"
         "(default: the scene's, else auto)"},
    [OPTION_INDIRECT] =
        {ONE_RENDER | SAMPLE, 0, "indirect", "NAME", "estimator of light scattered more than once: phase, mixture,\n"
                                                     "ray-lights (default: the scene's, else auto)"},
    [OPTION_WITHOUT] =
        {EVERY | SAMPLE, 0, "without", "EFFECT,...",
         "effects to take away from the scene: media, absorption, emission,\n"
         "scattering, multiple-scattering, anisotropy, textures, lens,\n"
         "chromatic-extinction, {point,spot,directional,area}-lights,\n"
         "environment; render-cli effects says what each is worth"},
    [OPTION_CROP] =
        {ONE_RENDER, 0, "crop", "X0,X1,Y0,Y1", "only the pixels X0 <= x < X1, Y0 <= y < Y1, counted from the top left"},
    [OPTION_DEFINE] = {EVERY | SAMPLE, 'D', "define", "NAME=VALUE", "sets $NAME in the scene file"},
    [OPTION_LAYERS] =
        {RENDER | MERGE, 0, "layers", "all|none|A,B,...", "layers of EXRs: albedo, N, Z, variance, sampleCount,\n"
                                            "badSamples (default: these, the last if there are any);\n"
                                            "direct, indirect, surface, volume (parts of the light), segments"},
    [OPTION_EXPOSURE] = {RENDER | MERGE, 0, "exposure", "EV", "stops by which PNGs are brightened (default: 0)"},
    [OPTION_TONEMAP] =
        {RENDER | MERGE, 0, "tonemap", "none|filmic",
         "tone curve of PNGs, behind the exposure (default: none); filmic: by\n"
         "Narkowicz 2015"},
    [OPTION_DENOISE] =
        {RENDER, 0, "denoise", "none|beauty|layers", "by Open Image Denoise: an EXR gets the layer denoised, a PNG is\n"
                                                     "made of it; the whole picture, or surface and volume apart"},
    [OPTION_DISPLAY] =
        {RENDER, 0, "display-server", "HOST[:PORT]", "shows the picture in tev while it renders (port: 14158)"},
    [OPTION_DEVICE] =
        {EVERY | SAMPLE, 0, "device", "I|NAME[/N],...|all",
         "device by index or part of its name (default: a GPU, else the CPU);\n"
         "several share the picture; 0/2: a CPU's cores in two parts"},
    [OPTION_LIST_DEVICES] = {RENDER, 0, "list-devices", NULL, "names the devices, one a line, and exits"},
    [OPTION_PRECISION] =
        {ONE_RENDER | SAMPLE, 0, "precision", "float|double", "arithmetic of the kernels (default: float)"},
    [OPTION_LANES] = {EVERY, 0, "lanes", "N", "paths per work-item: 1, 4, 8 or 16 (default: what suits the device)"},
    [OPTION_STATS] =
        {RENDER | INFO | MERGE, 0, "stats", "json[:FILE]",
         "statistics as one JSON object, to standard output or a file"},
    [OPTION_PROGRESS] =
        {EVERY, 0, "progress", "auto|none|json", "a bar on a terminal (default), nothing, or JSON lines on\n"
                                                 "standard output"},
    [OPTION_CLAMP] =
        {RENDER | SAMPLE, 0, "clamp", "X",
         "most radiance that one sample counts: less noise, but too dark (default: none)"},
    [OPTION_CHECKPOINT] =
        {RENDER, 0, "checkpoint", "FILE", "keeps the state of the render in FILE, from which --resume goes on"},
    [OPTION_CHECKPOINT_INTERVAL] =
        {RENDER, 0, "checkpoint-interval", "S", "seconds between two checkpoints (default: 60); one is written at the\n"
                                                "end and after Ctrl-C, too"},
    [OPTION_RESUME] = {RENDER, 0, "resume", NULL, "goes on from the checkpoint if there is one; the picture comes out\n"
                                                  "the same bits as without the break"},
    [OPTION_DEBUG_SAMPLE] =
        {RENDER, 0, "debug-sample", "X,Y,I", "renders no picture, but prints what the path of sample I of pixel X, Y\n"
                                             "does, vertex by vertex"},
    [OPTION_FOLDER] =
        {STUDY, 'o', "output", "DIR", "folder of the results (default: the scene's name with -study)"},
    [OPTION_SETTINGS] =
        {STUDY, 0, "settings", "A,B,...", "what is compared: strategies, ways of --indirect, independent,\n"
                                          "depth-N, clamp-Nx (times the picture's mean), double, adaptive,\n"
                                          "without-EFFECT; or several joined by +, as in mis+phase+depth-4"},
    [OPTION_BUDGET] =
        {STUDY, 0, "budget", "S", "seconds of rendering in all, kernels not counted (default: 150)"},
    [OPTION_TARGET] = {STUDY, 0, "target", "E", "relMSE that the table gives times for (default: a round number\n"
                                       "that the most accurate setting reaches)"},
    [OPTION_TIME_TARGET] =
        {STUDY, 0, "time-target", "S", "time at which pictures are compared (default: the longest that\n"
                                       "every setting reaches)"},
    [OPTION_CLOCK] =
        {STUDY, 0, "clock", "wall|cpu", "what time is (default: wall); cpu: that of all processors over their\n"
                                        "number, which other programs disturb less"},
    [OPTION_WIDTH] =
        {STUDY, 0, "width", "N", "of the pictures, the height in proportion (default: 160)"},
    [OPTION_REFERENCE] =
        {STUDY, 0, "reference", "FILE", "also compares with this picture of the scene, .exr; its size is used"},
    [OPTION_FRESH] = {STUDY, 0, "fresh", NULL, "starts over, whatever the folder holds"},
    [OPTION_QUIET] = {ALL, 'q', "quiet", NULL, "prints errors only"},
    [OPTION_VERBOSE] = {ALL, 'v', "verbose", NULL, "prints each step, and times at the end"},
    [OPTION_HELP] = {ALL, 'h', "help", NULL, "prints this and exits"},
    [OPTION_VERSION] = {ALL, 0, "version", NULL, "prints the version and exits"},
};

void cli_print_help(FILE *file, cli_command command)
{
    const cli_command_entry *entry = &cli_commands[command];
    fprintf(file, "usage: render-cli %s%s%s [options]\n%s\n", command == CLI_RENDER ? "" : entry->name,
            command == CLI_RENDER ? "" : " ", entry->takes, entry->help);
    if (command == CLI_RENDER) {
        fputs("\nOther things to do with a scene, each with its own --help:\n", file);
        for (int i = CLI_RENDER + 1; i < CLI_COMMAND_COUNT; i++)
            fprintf(file, "  render-cli %s %s\n", cli_commands[i].name, cli_commands[i].takes);
    }
    fputc('\n', file);
    for (int i = 0; i < OPTION_COUNT; i++) {
        const cli_option *option = &cli_option_table[i];
        if (!(option->commands & 1u << command))
            continue;
        char left[64];
        char short_form[] = "-x, ";
        short_form[1] = option->letter;
        snprintf(left, sizeof left, "%s--%s%s%s", option->letter ? short_form : "    ", option->name,
                 option->argument ? " " : "", option->argument ? option->argument : "");
        const char *line = option->help, *end;
        fprintf(file, "  %-28s ", left);
        while ((end = strchr(line, '\n')) != NULL) {
            fprintf(file, "%.*s\n  %-28s ", (int)(end - line), line, "");
            line = end + 1;
        }
        fprintf(file, "%s\n", line);
    }
    if (command == CLI_STUDY)
        fputs("\nCtrl-C stops, writes the page as far as it is, and exits with 130; the same command then goes "
              "on.\n", file);
    else if (command == CLI_MERGE)
        fputc('\n', file);
    else
        fputs("\nCtrl-C stops, writes the picture as far as it is, and exits with 130; a second Ctrl-C exits at "
              "once.\n",
              file);
    fputs(
          "Exit codes: 0 done, 1 failed while running, 2 wrong usage, 3 wrong scene, 4 no device,\n"
          "5 kernels not built, 6 output not written, 7 wrong checkpoint, 130 and 143 stopped by SIGINT and\n"
          "SIGTERM.\n", file);
}

/* Optimal string alignment distance (insert, delete, replace, swap neighbours), capped: names are short. */
int cli_spelling_distance(const char *a, size_t a_length, const char *b)
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

/* The first of them may be a command, misspelt. */
static int two_scenes(const char *first, const char *second)
{
    for (int i = CLI_RENDER; i < CLI_COMMAND_COUNT; i++)
        if (cli_spelling_distance(first, strlen(first), cli_commands[i].name) <= 2) {
            cli_error("unknown command %s; did you mean %s?", first, cli_commands[i].name);
            return CLI_EXIT_USAGE;
        }
    cli_error("more than one scene: %s and %s", first, second);
    return CLI_EXIT_USAGE;
}

static int unknown_option(const char *name, size_t length)
{
    int best = -1, best_distance = 4;
    for (int i = 0; i < OPTION_COUNT; i++) {
        int distance = cli_spelling_distance(name, length, cli_option_table[i].name);
        if (distance < best_distance && distance * 2 <= (int)length) {
            best = i;
            best_distance = distance;
        }
    }
    if (best >= 0)
        cli_error("unknown option --%.*s; did you mean --%s?", (int)length, name, cli_option_table[best].name);
    else
        cli_error("unknown option --%.*s; --help lists them", (int)length, name);
    return CLI_EXIT_USAGE;
}

/* "folder/fog.xml" is written to "fog.exr" in the current folder, a study of it to "fog-study". */
static int set_default_output(cli_options *options, const char *ending)
{
    const char *name = options->scene + brume_path_folder(options->scene);
    const char *dot = strrchr(name, '.');
    size_t length = dot && dot != name ? (size_t)(dot - name) : strlen(name);
    options->default_output = malloc(length + strlen(ending) + 1);
    if (!options->default_output) {
        cli_error("out of memory");
        return CLI_EXIT_RUNTIME;
    }
    memcpy(options->default_output, name, length);
    memcpy(options->default_output + length, ending, strlen(ending) + 1);
    return 0;
}

/* The option of that letter, or of that name; the command's own if several have it. OPTION_COUNT: none. */
static option_id look_up(cli_command command, char letter, const char *name, size_t length)
{
    option_id found = OPTION_COUNT;
    for (int i = 0; i < OPTION_COUNT; i++) {
        const cli_option *option = &cli_option_table[i];
        int same = name ? strncmp(option->name, name, length) == 0 && option->name[length] == 0
                        : option->letter == letter;
        if (same && (found == OPTION_COUNT || (option->commands & 1u << command)))
            found = (option_id)i;
    }
    return found;
}

/* The option that `argument` names, and in *value what stands behind "=" or the letter (NULL: nothing). */
static int find_option(cli_command command, const char *argument, option_id *id, const char **value)
{
    *value = NULL;
    if (argument[1] != '-') {
        *id = look_up(command, argument[1], NULL, 0);
        if (argument[2])
            *value = argument + 2;
        if (*id != OPTION_COUNT)
            return 0;
        cli_error("unknown option -%c; --help lists them", argument[1]);
        return CLI_EXIT_USAGE;
    }
    const char *name = argument + 2;
    size_t length = strcspn(name, "=");
    *id = look_up(command, 0, name, length);
    if (name[length])
        *value = name + length + 1;
    return *id != OPTION_COUNT ? 0 : unknown_option(name, length);
}

int cli_options_parse(cli_options *options, int argc, char **argv)
{
    memset(options, 0, sizeof *options);
    options->render = brume_render_desc_default();
    options->render.quick_start = 1;
    options->layers = BRUME_LAYERS_RECORDED;
    options->study.budget = 150;
    options->checkpoint_interval = 60;
    size_t most = (size_t)argc + 1;
    options->outputs = calloc(most, sizeof *options->outputs);
    options->parameters = calloc(most, sizeof *options->parameters);
    options->inputs = calloc(most, sizeof *options->inputs);
    if (!options->outputs || !options->inputs || !options->parameters) {
        cli_error("out of memory");
        return CLI_EXIT_RUNTIME;
    }
    if (cli_replay_add(options, NULL, argv[0] ? argv[0] : "render-cli"))
        return CLI_EXIT_RUNTIME;
    int only_names = 0, spp_given = 0, range_given = 0, interval_given = 0;
    int first = 1;
    for (int i = CLI_RENDER; i < CLI_COMMAND_COUNT && argc > 1; i++)
        if (strcmp(argv[1], cli_commands[i].name) == 0) {
            options->command = (cli_command)i;
            first = 2;
        }
    for (int i = first; i < argc; i++) {
        const char *argument = argv[i];
        if (only_names || argument[0] != '-' || !argument[1]) {
            if (options->command == CLI_MERGE) {
                options->inputs[options->input_count++] = argument;
                continue;
            }
            if (options->scene) {
                return two_scenes(options->scene, argument);
            }
            options->scene = argument;
            if (cli_replay_add(options, NULL, argument))
                return CLI_EXIT_RUNTIME;
            continue;
        }
        if (strcmp(argument, "--") == 0) {
            only_names = 1;
            continue;
        }
        option_id id;
        const char *value;
        int code = find_option(options->command, argument, &id, &value);
        if (code)
            return code;
        if (!(cli_option_table[id].commands & 1u << options->command)) {
            cli_error("render-cli %s takes no --%s; its --help lists what it takes",
                      cli_commands[options->command].name, cli_option_table[id].name);
            return CLI_EXIT_USAGE;
        }
        if (!cli_option_table[id].argument && value) {
            cli_error("--%s takes no value", cli_option_table[id].name);
            return CLI_EXIT_USAGE;
        }
        if (cli_option_table[id].argument && !value) {
            if (i + 1 >= argc) {
                cli_error("--%s needs %s", cli_option_table[id].name, cli_option_table[id].argument);
                return CLI_EXIT_USAGE;
            }
            value = argv[++i];
        }
        spp_given |= id == OPTION_SPP;
        range_given |= id == OPTION_SAMPLE_RANGE;
        interval_given |= id == OPTION_CHECKPOINT_INTERVAL;
        code = cli_option_set(options, id, value);
        if (!code && cli_option_table[id].commands & SAMPLE)
            code = cli_replay_add(options, cli_option_table[id].name, value);
        if (code)
            return code;
    }
    if (options->help || options->version || options->list_devices)
        return 0;
    if (spp_given && range_given) {
        cli_error("--spp and --sample-range exclude each other");
        return CLI_EXIT_USAGE;
    }
    const brume_render_desc *render = &options->render;
    if (range_given && (render->noise_threshold > 0 || render->time_limit > 0 ||
                        render->adaptive == BRUME_ADAPTIVE_ON)) {
        cli_error("--sample-range is a fixed range of samples; it goes with no --noise-threshold, --time-limit or "
                  "--adaptive");
        return CLI_EXIT_USAGE;
    }
    if ((options->resume || interval_given) && !options->checkpoint) {
        cli_error("--%s needs --checkpoint FILE", options->resume ? "resume" : "checkpoint-interval");
        return CLI_EXIT_USAGE;
    }
    if (options->command == CLI_MERGE && (options->input_count == 0 || options->output_count == 0)) {
        cli_error("%s; usage: render-cli merge FILE... -o FILE [options], or --help",
                  options->input_count ? "no -o FILE" : "no checkpoints");
        return CLI_EXIT_USAGE;
    }
    if (options->command == CLI_MERGE)
        return 0;
    if (!options->scene || !*options->scene) {
        cli_error("no scene; usage: render-cli %s%sSCENE.xml [-o FILE] [options], or --help",
                  options->command == CLI_RENDER ? "" : cli_commands[options->command].name,
                  options->command == CLI_RENDER ? "" : " ");
        return CLI_EXIT_USAGE;
    }
    if (options->command == CLI_STUDY && !options->study.folder)
        return set_default_output(options, "-study");
    if (options->command != CLI_RENDER || options->output_count > 0)
        return 0;
    int code = set_default_output(options, ".exr");
    if (!code)
        options->outputs[options->output_count++] = options->default_output;
    return code;
}

void cli_options_free(cli_options *options)
{
    for (size_t i = 0; i < options->parameter_count; i++)
        free((char *)options->parameters[i].name);
    free(options->parameters);
    free(options->outputs);
    free(options->inputs);
    free(options->default_output);
    free(options->replay);
}

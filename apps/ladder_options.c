/* The command line of `ladder`. */
#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "estimators.h"
#include "ladder.h"
#include "platform.h"

static const char default_scenes[] = "open-beam,half-hidden,slats,bunny-beam,forest-beam,thin-fog,thick-fog,"
                                     "forward-fog,three-spots,hundred-spots,area-light,soft-lamp,environment-fog";
static const char default_rungs[] = "spherical,distance,equiangular,equiangular-cone,mis,product,systematic,raster,"
                                    "auto,auto+adaptive";

void ladder_print_help(FILE *file)
{
    fputs("usage: ladder [--samplers | --lights] [options]\n"
          "Renders scenes with each estimator of light in fog, and measures error against time.\n\n"
          "  (no mode)               every rung in every scene, at equal samples and at equal time, against a long\n"
          "                          reference: ladder.csv, .json, .md, and contact sheets\n"
          "  --samplers              independent against Sobol' points: samplers.csv, .md\n"
          "  --lights                1 to 10000 spotlights: lights.csv, .md\n\n"
          "  --scenes A,B            names in scenes/ladder/, or files (with a / or .xml)\n"
          "  --rungs A,B             STRATEGY[:POSITIONS][+INDIRECT][+adaptive], such as mis, systematic:16,\n"
          "                          auto+ray-lights, auto+adaptive: samples where the error is\n"
          "  --seconds S             of rendering per rung at equal time (default: 1)\n"
          "  --spp N                 samples per pixel at equal samples (default: 16)\n"
          "  --reference-spp N       of the reference (default: 8192), ...\n"
          "  --reference-seconds S   ... unless that takes longer than this (default: 90)\n"
          "  --reference-rung R      its estimator (default: mis+adaptive)\n"
          "  --size WxH              of the pictures (default: 240x150; quick, or with a mode: 160x100)\n"
          "  --depth N               path edges (default: the scene's, 2, light scattered once)\n"
          "  --seed N                of the pictures compared (default: 1); the reference has its own\n"
          "  --seeds N               pictures from that seed on, of which errors are means; no mode (default: 1)\n"
          "  --device I              as render-cli --list-devices counts them (default: a GPU, else the CPU)\n"
          "  --out DIR               where results go (default: out/ladder)\n"
          "  --cache DIR             where references are kept (default: build/references)\n"
          "  --quick                 three scenes, little time\n"
          "  --help\n\n"
          "Run it from the top folder. References are kept for as long as the scene's files and these options stay\n"
          "the same; remove them after a change to the renderer itself.\n"
          "Exit codes: 0 done, 1 failed while running, 2 wrong usage, 3 wrong scene, 4 no device,\n"
          "5 kernels not built, 6 a file could not be written.\n", file);
}

/* ---- values ---- */

static int wrong(const char *option, const char *value, const char *expected)
{
    ladder_error("%s: expected %s, not \"%s\"", option, expected, value);
    return LADDER_EXIT_USAGE;
}

/* A whole number up to 2^32 - 1 at *text, followed by `stop`; moves *text behind that. */
static int parse_uint(const char **text, char stop, uint32_t *out)
{
    char *end;
    if (**text < '0' || **text > '9')
        return 0;
    errno = 0;
    unsigned long long value = strtoull(*text, &end, 10);
    if (errno || value > UINT32_MAX || *end != stop)
        return 0;
    *out = (uint32_t)value;
    *text = end + (stop != 0);
    return 1;
}

static int parse_count(const char *option, const char *value, uint32_t least, uint32_t *out)
{
    const char *text = value;
    char expected[48];
    if (parse_uint(&text, 0, out) && *out >= least)
        return 0;
    snprintf(expected, sizeof expected, "a number from %u on", least);
    return wrong(option, value, expected);
}

static int parse_seconds(const char *option, const char *value, double *out)
{
    char *end;
    *out = strtod(value, &end);
    return *value && !*end && isfinite(*out) && *out > 0 ? 0 : wrong(option, value, "seconds");
}

static int parse_size(const char *option, const char *value, ladder_options *options)
{
    const char *text = value;
    if (parse_uint(&text, 'x', &options->width) && parse_uint(&text, 0, &options->height) && options->width > 0 &&
        options->height > 0)
        return 0;
    return wrong(option, value, "WIDTHxHEIGHT");
}

static int parse_depth(const char *option, const char *value, ladder_options *options)
{
    const char *text = value;
    uint32_t depth;
    options->depth = value;
    return strcmp(value, "-1") == 0 || parse_uint(&text, 0, &depth) ? 0 : wrong(option, value, "path edges, or -1");
}

static int parse_folder(const char *option, const char *value, char out[LADDER_FOLDER])
{
    if (!*value || strlen(value) >= LADDER_FOLDER)
        return wrong(option, value, "the name of a folder");
    memcpy(out, value, strlen(value) + 1);
    return 0;
}

static int parse_rung(const char *option, const char *value, ladder_rung *out)
{
    static const char expected[] = "STRATEGY[:POSITIONS][+INDIRECT][+adaptive]";
    size_t length = strcspn(value, "+");
    memset(out, 0, sizeof *out);
    if (strlen(value) >= sizeof out->name || !estimators_strategy(value, length, &out->strategy, &out->positions))
        return wrong(option, value, expected);
    memcpy(out->name, value, strlen(value) + 1);
    for (const char *part = value + length; *part == '+'; part += length) {
        length = 1 + strcspn(part + 1, "+");
        if (length == sizeof "+adaptive" - 1 && strncmp(part, "+adaptive", length) == 0)
            out->adaptive = 1;
        else if (estimators_indirect(part + 1, length - 1, &out->indirect))
            out->use_indirect = 1;
        else
            return wrong(option, value, expected);
    }
    return 0;
}

/* A name has to do for file names, labels and JSON strings. */
static int parse_scene(const char *option, const char *value, ladder_scene *out)
{
    const char *base = value + brume_path_folder(value);
    size_t length = strlen(base);
    int is_file = base > value || (length > 4 && strcmp(base + length - 4, ".xml") == 0);
    if (length > 4 && strcmp(base + length - 4, ".xml") == 0)
        length -= 4;
    size_t plain = strspn(base, "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-_.");
    if (length == 0 || length >= sizeof out->name || plain < length)
        return wrong(option, value, "scenes whose names are letters, digits and - _ .");
    memcpy(out->name, base, length);
    out->name[length] = 0;
    int written = is_file ? snprintf(out->path, sizeof out->path, "%s", value)
                          : snprintf(out->path, sizeof out->path, "scenes/ladder/%s.xml", out->name);
    return written < (int)sizeof out->path ? 0 : wrong(option, value, "shorter names");
}

/* Calls parse_scene or parse_rung for each of the names between commas. */
static int parse_list(const char *option, const char *list, int is_scenes, ladder_options *options)
{
    size_t count = 0, most = is_scenes ? LADDER_SCENES : LADDER_RUNGS;
    for (const char *s = list;; s++) {
        char item[LADDER_PATH];
        size_t length = strcspn(s, ",");
        if (length >= sizeof item || count == most) {
            ladder_error("%s: more than %zu, or too long", option, most);
            return LADDER_EXIT_USAGE;
        }
        memcpy(item, s, length);
        item[length] = 0;
        int code = is_scenes ? parse_scene(option, item, &options->scenes[count])
                             : parse_rung(option, item, &options->rungs[count]);
        if (code)
            return code;
        count++;
        s += length;
        if (!*s)
            break;
    }
    *(is_scenes ? &options->scene_count : &options->rung_count) = count;
    return 0;
}

/* ---- the whole line ---- */

/* Takes the option, with its value if it needs one; *used becomes how many arguments that was, 0 if it is unknown. */
static int parse_option(ladder_options *o, const char *name, const char *value, int *used)
{
    *used = 1;
    if (strcmp(name, "--samplers") == 0 || strcmp(name, "--lights") == 0) {
        o->mode = strcmp(name, "--lights") == 0 ? LADDER_MODE_LIGHTS : LADDER_MODE_SAMPLERS;
        return 0;
    }
    if (strcmp(name, "--help") == 0 || strcmp(name, "-h") == 0) {
        o->help = 1;
        return 0;
    }
    if (strcmp(name, "--quick") == 0)
        return 0; /* the caller's: it changes defaults */
    static const char *const valued[] = {"--scenes", "--rungs", "--seconds", "--spp", "--reference-spp",
                                         "--reference-seconds", "--reference-rung", "--size", "--depth", "--seed",
                                         "--seeds", "--device", "--out", "--cache"};
    enum { COUNT = sizeof valued / sizeof valued[0] };
    int which = 0;
    while (which < COUNT && strcmp(name, valued[which]) != 0)
        which++;
    *used = which < COUNT ? 2 : 0;
    if (which < COUNT && !value) {
        ladder_error("%s needs a value", name);
        return LADDER_EXIT_USAGE;
    }
    switch (which) {
    case 0: return parse_list(name, value, 1, o);
    case 1: return parse_list(name, value, 0, o);
    case 2: return parse_seconds(name, value, &o->seconds);
    case 3: return parse_count(name, value, 2, &o->spp); /* one alone tells no variance */
    case 4: return parse_count(name, value, 4, &o->reference_spp);
    case 5: return parse_seconds(name, value, &o->reference_seconds);
    case 6: return parse_rung(name, value, &o->reference);
    case 7: return parse_size(name, value, o);
    case 8: return parse_depth(name, value, o);
    case 9: return parse_count(name, value, 0, &o->seed);
    case 10: return parse_count(name, value, 1, &o->seeds);
    case 11: return parse_count(name, value, 0, &o->device);
    case 12: return parse_folder(name, value, o->out);
    case 13: return parse_folder(name, value, o->cache);
    default: return 0;
    }
}

/* What wasn't asked for, by mode. */
static int set_defaults(ladder_options *o, int quick)
{
    int is_scenes = o->mode == LADDER_MODE_SCENES;
    int code = 0;
    if (o->scene_count == 0)
        code = parse_list("--scenes", !is_scenes ? "open-beam,half-hidden"
                                      : quick ? "open-beam,half-hidden,hundred-spots" : default_scenes, 1, o);
    if (!code && o->rung_count == 0)
        code = parse_list("--rungs", is_scenes ? default_rungs : "distance,equiangular-cone,mis,product,raster", 0, o);
    if (!code && !o->reference.name[0])
        code = parse_rung("--reference-rung", "mis+adaptive", &o->reference);
    if (o->width == 0) {
        o->width = is_scenes && !quick ? 240 : 160;
        o->height = is_scenes && !quick ? 150 : 100;
    }
    if (o->spp == 0)
        o->spp = is_scenes ? 16 : 4;
    if (o->seconds == 0)
        o->seconds = quick ? 0.2 : 1;
    if (o->reference_spp == 0)
        o->reference_spp = quick ? 2048 : 8192;
    if (o->reference_seconds == 0)
        o->reference_seconds = quick ? 10 : 90;
    return code;
}

int ladder_options_parse(ladder_options *options, int argc, char **argv)
{
    memset(options, 0, sizeof *options);
    options->seed = options->seeds = 1;
    options->device = BRUME_DEVICE_ANY;
    snprintf(options->out, sizeof options->out, "out/ladder");
    snprintf(options->cache, sizeof options->cache, "build/references");
    int quick = 0;
    for (int i = 1; i < argc;) {
        int used;
        int code = parse_option(options, argv[i], i + 1 < argc ? argv[i + 1] : NULL, &used);
        if (code)
            return code;
        if (used == 0) {
            ladder_error("unknown option %s; --help lists them", argv[i]);
            return LADDER_EXIT_USAGE;
        }
        quick |= strcmp(argv[i], "--quick") == 0;
        i += used;
    }
    return set_defaults(options, quick);
}

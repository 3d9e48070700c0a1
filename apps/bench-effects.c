/* bench-effects -- does a scene pay for effects that it doesn't use? `make bench-effects` prints the README's table.
 *
 * Each scene is rendered by three programs in turn: the one built for it, the generic one that has everything, and one
 * built from kernels whose source never had what the scene doesn't call for (apps/strip-effects.py). And, with --bits,
 * with one feature too many: what leaving it out is worth. A scene is a process of its own, with a fresh folder for
 * PoCL's cache of kernels: each program is built once, and it is told how long that took. What is told is the median
 * over the rounds of the ratio of processor times within a round: the machine may do other things. (On a GPU that time
 * says nothing.) */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "brume.h"
#include "platform.h"

enum { MOST_ROUNDS = 99, MOST_PROGRAMS = 24, COMMAND = 512 };

typedef struct bench_scene {
    const char *name, *path;
    uint32_t without;
    brume_parameter parameters[4];
    size_t parameter_count;
    uint32_t samples;
} bench_scene;

#define WITHOUT(name) (1u << BRUME_EFFECT_##name)

static const bench_scene scenes[] = {
    {"nothing: spots in a room, no medium", "scenes/ladder/three-spots.xml", WITHOUT(MEDIA), {{"depth", "-1"}}, 1, 64},
    {"absorption only", "scenes/ladder/three-spots.xml", WITHOUT(SCATTERING), {{"depth", "-1"}}, 1, 64},
    {"fog, scattered once", "scenes/ladder/three-spots.xml", 0, {{"g", "0"}}, 1, 16},
    {"fog, scattered once, HG", "scenes/ladder/three-spots.xml", 0, {{"g", "0.5"}}, 1, 16},
    {"fog", "scenes/ladder/three-spots.xml", 0, {{"g", "0"}, {"depth", "-1"}}, 2, 8},
    {"fog, HG", "scenes/ladder/three-spots.xml", 0, {{"g", "0.5"}, {"depth", "-1"}}, 2, 4},
    {"emission: glowing fog in a ball", "scenes/furnace.xml", 0, {{"g", "0"}}, 1, 64},
    {"environment, bounded fog", "scenes/ladder/environment-fog.xml", 0, {{"depth", "-1"}}, 1, 8},
    {"glass in coloured fog, HG", "scenes/glass-in-fog.xml", 0, {{"width", "200"}, {"height", "200"}}, 2, 16},
    {"glass, grey isotropic fog", "scenes/glass-in-fog.xml", WITHOUT(CHROMATIC_EXTINCTION) | WITHOUT(ANISOTROPY),
     {{"width", "200"}, {"height", "200"}}, 2, 16},
    {"fog among triangles, scattered once", "scenes/ladder/open-beam.xml", 0, {{NULL}}, 0, 64},
};
enum { SCENE_COUNT = sizeof scenes / sizeof scenes[0] };

typedef struct program {
    char name[48];
    char folder[64]; /* of its source, "" for the library's */
    uint32_t extra, generic, lanes;
    double seconds[MOST_ROUNDS], build_seconds;
    uint64_t bytes;
} program;

static void die(const brume_context *context) __attribute__((noreturn));

static void die(const brume_context *context)
{
    fprintf(stderr, "bench-effects: %s\n", context ? brume_context_message(context) : "out of memory");
    exit(1);
}

static brume_render_stats render_once(brume_device *device, const brume_context *context, const brume_scene *scene,
                                      const bench_scene *s, const program *p, uint32_t samples, double *seconds,
                                      double *build_seconds)
{
    brume_render_desc desc = brume_render_desc_default();
    brume_render *render;
    brume_render_stats stats;
    desc.without = s->without;
    desc.sample_count = samples;
    desc.extra_features = p->extra;
    desc.generic = p->generic;
    desc.lanes = p->lanes;
    desc.error_estimate = 0;
    desc.program_size = samples == 1; /* the first render of each, which is not timed */
    platform_set_environment("BRUME_CL_DIR", p->folder[0] ? p->folder : NULL);
    clock_t start = clock();
    if (brume_render_create(device, scene, &desc, &render))
        die(context);
    *build_seconds = (double)(clock() - start) / CLOCKS_PER_SEC;
    start = clock();
    if (brume_render_run(render, NULL, NULL) || brume_render_get_stats(render, &stats))
        die(context);
    *seconds = (double)(clock() - start) / CLOCKS_PER_SEC;
    brume_render_destroy(render);
    return stats;
}

static int ascending(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double median_ratio(const double *a, const double *b, int rounds)
{
    double ratios[MOST_ROUNDS];
    for (int i = 0; i < rounds; i++)
        ratios[i] = a[i] / b[i];
    qsort(ratios, (size_t)rounds, sizeof *ratios, ascending);
    return rounds % 2 ? ratios[rounds / 2] : 0.5 * (ratios[rounds / 2 - 1] + ratios[rounds / 2]);
}

static double least(const double *a, int rounds)
{
    double x = a[0];
    for (int i = 1; i < rounds; i++)
        x = a[i] < x ? a[i] : x;
    return x;
}

/* Rounds forwards and backwards by turns, after one sample of each for the builds. */
static void measure(brume_device *device, const brume_context *context, const brume_scene *scene,
                    const bench_scene *s, program *programs, int count, int rounds)
{
    double unused;
    for (int i = 0; i < count; i++)
        programs[i].bytes =
            render_once(device, context, scene, s, &programs[i], 1, &unused, &programs[i].build_seconds).program_bytes;
    for (int r = 0; r < rounds; r++)
        for (int k = 0; k < count; k++) {
            int i = r % 2 ? count - 1 - k : k;
            render_once(device, context, scene, s, &programs[i], s->samples, &programs[i].seconds[r], &unused);
        }
}

static void strip(const brume_render_stats *stats, const char *build, int number, program *out)
{
    char command[COMMAND];
    snprintf(out->folder, sizeof out->folder, "%s/stripped/%d", build, number);
    snprintf(command, sizeof command,
             "python3 apps/strip-effects.py %s -DFEATURES=%u -DLANES=%u -DSTRATEGY=%d -DINDIRECT=%d >&2", out->folder,
             (unsigned)stats->features, (unsigned)stats->lanes, (int)stats->strategy, (int)stats->indirect);
    if (system(command) != 0) {
        fprintf(stderr, "bench-effects: %s: failed\n", command);
        exit(1);
    }
}

/* The programs to compare: the scene's own first. Returns how many. Guides and light layers are called for by who
 * renders, not by a scene. */
static int choose_programs(const brume_render_stats *stats, const char *build, int number, int bits,
                           program programs[MOST_PROGRAMS])
{
    if (!bits) {
        programs[1].generic = 1;
        strip(stats, build, number, &programs[2]);
        return 3;
    }
    int count = 1;
    for (uint32_t bit = 0; brume_feature_name(bit) && count < MOST_PROGRAMS; bit++) {
        const char *name = brume_feature_name(bit);
        if (stats->features >> bit & 1 || strcmp(name, "guides") == 0 || strcmp(name, "light-layers") == 0)
            continue;
        snprintf(programs[count].name, sizeof programs[count].name, "%s", name);
        programs[count++].extra = 1u << bit;
    }
    return count;
}

/* The rows of one scene. */
static void bench(const char *build, int number, int bits, int rounds)
{
    static program programs[MOST_PROGRAMS], narrow;
    const bench_scene *s = &scenes[number];
    brume_context *context = NULL;
    brume_device *device;
    brume_device_info info;
    brume_scene *scene;
    double unused;
    if (brume_context_create(&context) || brume_device_describe(context, BRUME_DEVICE_ANY, &info) ||
        brume_device_open(context, BRUME_DEVICE_ANY, &device) ||
        brume_scene_load(context, s->path, s->parameters, s->parameter_count, &scene))
        die(context);
    narrow.lanes = 1; /* what none of the others is: the compiler's start is nobody's build time */
    brume_render_stats stats = render_once(device, context, scene, s, &narrow, 1, &unused, &unused);
    stats.lanes = info.lanes;
    int count = choose_programs(&stats, build, number, bits, programs);
    measure(device, context, scene, s, programs, count, rounds);
    if (!bits)
        printf("| %s | %.2f s | %.3f | %.3f | %.0f of %.0f KiB |\n", s->name, least(programs[0].seconds, rounds),
               median_ratio(programs[0].seconds, programs[1].seconds, rounds),
               median_ratio(programs[0].seconds, programs[2].seconds, rounds), (double)programs[0].bytes / 1024,
               (double)programs[1].bytes / 1024);
    for (int i = 1; bits && i < count; i++)
        printf("| %s | %s | %.3f | %.2f | %+.0f KiB |\n", s->name, programs[i].name,
               median_ratio(programs[i].seconds, programs[0].seconds, rounds),
               programs[i].build_seconds / programs[0].build_seconds,
               ((double)programs[i].bytes - (double)programs[0].bytes) / 1024);
    brume_scene_destroy(scene);
    brume_device_destroy(device);
    brume_context_destroy(context);
}

/* With a cache of its own for PoCL. */
static int bench_alone(const char *build, int number, int bits, int rounds)
{
    char cache[] = "/tmp/bench-effects-XXXXXX", command[sizeof cache + 16];
    if (platform_make_temporary_folder(cache))
        die(NULL);
    platform_set_environment("POCL_CACHE_DIR", cache);
    platform_set_environment("BRUME_CACHE_DIR", "");
    bench(build, number, bits, rounds);
    snprintf(command, sizeof command, "rm -rf %s", cache);
    return system(command) != 0;
}

int main(int argc, char **argv)
{
    int rounds = 7, bits = 0, only = -1, row = -1;
    const char *build = argc > 1 ? argv[1] : "build";
    for (int i = 2; i < argc; i++) {
        bits |= strcmp(argv[i], "--bits") == 0;
        if (strncmp(argv[i], "--rounds=", 9) == 0)
            rounds = atoi(argv[i] + 9);
        if (strncmp(argv[i], "--scene=", 8) == 0)
            only = atoi(argv[i] + 8);
        if (strncmp(argv[i], "--row=", 6) == 0) /* what this program says to itself */
            row = atoi(argv[i] + 6);
    }
    if (rounds < 1 || rounds > MOST_ROUNDS || only >= SCENE_COUNT || row >= SCENE_COUNT) {
        fprintf(stderr, "usage: bench-effects BUILD [--bits] [--rounds=N] [--scene=0 to %d]\n", SCENE_COUNT - 1);
        return 2;
    }
    if (row >= 0)
        return bench_alone(build, row, bits, rounds);
    puts(bits ? "| scene | feature too many | time | build time | program |\n|---|---|---|---|---|"
              : "| scene | built for it | ÷ generic program | ÷ without that code in the source | program |\n"
                "|---|---|---|---|---|");
    fflush(stdout);
    for (int k = 0; k < SCENE_COUNT; k++) {
        char scene[32], round[32];
        snprintf(scene, sizeof scene, "--row=%d", k);
        snprintf(round, sizeof round, "--rounds=%d", rounds);
        char *arguments[] = {argv[0], (char *)(uintptr_t)build, scene, round, bits ? "--bits" : NULL, NULL};
        if ((only < 0 || k == only) && platform_run(arguments, NULL))
            return 1;
    }
    return 0;
}

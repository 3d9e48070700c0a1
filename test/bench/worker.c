/* worker -- brume as bench.py drives every renderer: a process that is told what to do, a line each.
 *
 *     load SCENE MODE NAME=VALUE...   MODE: uniform | adaptive; replies "ok SECONDS VERSION"
 *     render SPP SEED FILE            replies "ok WALL CPU SPP": seconds of rendering, by the clock and by the
 *                                     processors; FILE gets height x width x 3 floats, rows from the top
 *
 * Whatever fails replies "error TEXT". */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "brume.h"

enum { LINE = 4096, WORDS = 32 };

typedef struct worker {
    brume_context *context;
    brume_device *device;
    brume_scene *scene;
    int adaptive;
} worker;

static double now(clockid_t clock)
{
    struct timespec t;
    clock_gettime(clock, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static const char *load(worker *w, char **words, int count)
{
    brume_parameter parameters[WORDS];
    size_t n = 0;
    for (int i = 3; i < count; i++) {
        char *equals = strchr(words[i], '=');
        if (!equals)
            return "parameters are NAME=VALUE";
        *equals = 0;
        parameters[n].name = words[i];
        parameters[n++].value = equals + 1;
    }
    brume_scene *scene;
    if (brume_scene_load(w->context, words[1], parameters, n, &scene))
        return brume_context_message(w->context);
    brume_scene_destroy(w->scene);
    w->scene = scene;
    w->adaptive = strcmp(words[2], "adaptive") == 0;
    return NULL;
}

static int write_floats(const char *path, const float *values, size_t count)
{
    FILE *file = fopen(path, "wb");
    if (!file)
        return 0;
    int ok = fwrite(values, sizeof *values, count, file) == count;
    return (fclose(file) == 0) & ok;
}

/* Rendering alone is timed, its pilot sample included; the hierarchy and the program are there. */
static const char *render(worker *w, char **words, double *wall, double *cpu)
{
    brume_render_desc desc = brume_render_desc_default();
    desc.sample_count = (uint32_t)strtoul(words[1], NULL, 10);
    desc.use_seed = 1;
    desc.seed = (uint32_t)strtoul(words[2], NULL, 10);
    desc.adaptive = w->adaptive ? BRUME_ADAPTIVE_ON : BRUME_ADAPTIVE_OFF;
    desc.guides = 0;
    desc.error_estimate = (uint32_t)w->adaptive;
    brume_render *r = NULL;
    brume_render_stats stats;
    if (!w->scene)
        return "no scene";
    if (brume_render_create(w->device, w->scene, &desc, &r))
        return brume_context_message(w->context);
    *wall = now(CLOCK_MONOTONIC);
    *cpu = now(CLOCK_PROCESS_CPUTIME_ID);
    brume_result result = brume_render_run(r, NULL, NULL);
    *wall = now(CLOCK_MONOTONIC) - *wall;
    *cpu = now(CLOCK_PROCESS_CPUTIME_ID) - *cpu;
    const char *failure = NULL;
    float *picture = NULL;
    if (result || brume_render_get_stats(r, &stats)) {
        failure = brume_context_message(w->context);
    } else {
        size_t count = 3 * (size_t)stats.width * stats.height;
        picture = malloc(count * sizeof *picture);
        if (!picture)
            failure = "out of memory";
        else if (brume_render_read(r, BRUME_CHANNEL_RADIANCE, picture, count))
            failure = brume_context_message(w->context);
        else if (!write_floats(words[3], picture, count))
            failure = "can't write the picture";
    }
    free(picture);
    brume_render_destroy(r);
    return failure;
}

int main(void)
{
    worker w = {0};
    char line[LINE];
    if (brume_context_create(&w.context) || brume_device_open(w.context, BRUME_DEVICE_ANY, &w.device)) {
        printf("error %s\n", w.context ? brume_context_message(w.context) : "out of memory");
        return 1;
    }
    while (fgets(line, sizeof line, stdin)) {
        char *words[WORDS];
        int count = 0;
        for (char *word = strtok(line, " \n"); word && count < WORDS; word = strtok(NULL, " \n"))
            words[count++] = word;
        double wall = now(CLOCK_MONOTONIC), cpu = 0;
        const char *failure = "load SCENE MODE NAME=VALUE... or render SPP SEED FILE";
        if (count >= 3 && strcmp(words[0], "load") == 0) {
            failure = load(&w, words, count);
            if (!failure)
                printf("ok %.6f %s\n", now(CLOCK_MONOTONIC) - wall, BRUME_VERSION);
        } else if (count == 4 && strcmp(words[0], "render") == 0) {
            failure = render(&w, words, &wall, &cpu);
            if (!failure)
                printf("ok %.6f %.6f %s\n", wall, cpu, words[1]);
        }
        if (failure)
            printf("error %s\n", failure);
        fflush(stdout);
    }
    brume_scene_destroy(w.scene);
    brume_device_destroy(w.device);
    brume_context_destroy(w.context);
    return 0;
}

/* render-cli info: what is in a scene, which effects it calls for and why, and what is built for them. */
#include <string.h>

#include "cli.h"

static void print_effect(brume_effect effect, const brume_effect_report *r)
{
    char object[128];
    int unnumbered = r->object == BRUME_OBJECT_INTEGRATOR || r->object == BRUME_OBJECT_SENSOR;
    if (r->id[0])
        snprintf(object, sizeof object, "%s \"%s\"", brume_object_name(r->object), r->id);
    else if (unnumbered)
        snprintf(object, sizeof object, "%s", brume_object_name(r->object));
    else
        snprintf(object, sizeof object, "%s %u", brume_object_name(r->object), r->index);
    printf("  %-21s %s%s%s%s: %s", brume_effect_name(effect), object, r->where[0] ? " (" : "", r->where,
           r->where[0] ? ")" : "", r->why);
    if (r->count > 1 && !unnumbered)
        printf("; and %u more", r->count - 1);
    putchar('\n');
}

/* "name, name": those of a set, wrapped. */
static void print_names(const char *title, uint32_t set, const char *(*name_of)(uint32_t))
{
    enum { WIDTH = 100 };
    int column = printf("%-14s ", title), some = 0;
    for (uint32_t i = 0; name_of(i); i++) {
        if (!(set >> i & 1))
            continue;
        int length = (int)strlen(name_of(i)) + 2;
        if (some && column + length > WIDTH)
            column = printf(",\n%15s", "") - 2;
        else
            column += printf("%s", some ? ", " : "");
        some = 1;
        column += printf("%s", name_of(i));
    }
    puts(some ? "" : "nothing");
}

static const char *effect_name(uint32_t number)
{
    return brume_effect_name((brume_effect)number);
}

static void print_effects(uint32_t effects, const brume_effect_report *reports, const brume_render_stats *stats)
{
    const uint32_t lamps = 1u << BRUME_EFFECT_POINT_LIGHTS | 1u << BRUME_EFFECT_SPOT_LIGHTS |
                           1u << BRUME_EFFECT_DIRECTIONAL_LIGHTS;
    const uint32_t met = 1u << BRUME_EFFECT_AREA_LIGHTS | 1u << BRUME_EFFECT_ENVIRONMENT | 1u << BRUME_EFFECT_EMISSION;
    const uint32_t media = 1u << BRUME_EFFECT_MEDIA, scatters = 1u << BRUME_EFFECT_SCATTERING;
    uint32_t taken_away = 0;
    puts("the scene calls for");
    for (int i = 0; i < BRUME_EFFECT_COUNT; i++) {
        if (reports[i].present)
            print_effect((brume_effect)i, &reports[i]);
        taken_away |= (uint32_t)(reports[i].taken_away != 0) << i;
    }
    if (!(effects & media))
        puts("  no medium: rays go straight on for free");
    else if (!(effects & scatters))
        puts("  no scattering: light in the medium follows from lengths alone, without random numbers");
    if ((effects & lamps) && !(effects & met))
        puts("  lamps without extent only: no path meets light by itself");
    if (taken_away)
        print_names("taken away", taken_away, effect_name);
    print_names("not there", ~effects & ~taken_away, effect_name);
    print_names("code built", stats->features, brume_feature_name);
    print_names("code left out", ~stats->features, brume_feature_name);
}

typedef struct findings {
    const cli_options *options;
    const brume_effect_report *reports;
    const brume_render_stats *stats;
} findings;

static void print_json(FILE *file, const void *what)
{
    const findings *found = what;
    const brume_render_stats *stats = found->stats;
    fputs("{\"event\":\"info\",\"scene\":", file);
    cli_json_string(file, found->options->scene);
    cli_stats_effects(file, stats);
    fputs(",\"why\":[", file);
    for (int i = 0, some = 0; i < BRUME_EFFECT_COUNT; i++) {
        const brume_effect_report *r = &found->reports[i];
        if (!r->present)
            continue;
        fprintf(file, "%s{\"effect\":\"%s\",\"object\":\"%s\",\"index\":%u,\"count\":%u,\"id\":", some++ ? "," : "",
               brume_effect_name((brume_effect)i), brume_object_name(r->object), r->index, r->count);
        cli_json_string(file, r->id);
        fputs(",\"where\":", file);
        cli_json_string(file, r->where);
        fputs(",\"why\":", file);
        cli_json_string(file, r->why);
        fputc('}', file);
    }
    fprintf(file, "],\"program_bytes\":%llu,\"build_seconds\":%.6g,\"device_bytes\":%llu,\"lanes\":%u,\"triangles\":%u,"
           "\"quadrics\":%u,\"lights\":%u,\"emitters\":%u,\"media\":%u}\n", (unsigned long long)stats->program_bytes,
           stats->build_seconds, (unsigned long long)stats->device_bytes, stats->lanes, stats->triangles,
           stats->quadrics, stats->lights, stats->emitters, stats->media);
}

int cli_info(brume_context *context, const cli_options *options, cli_progress *progress)
{
    cli_session session;
    brume_render *render = NULL;
    brume_render_stats stats;
    brume_effect_report reports[BRUME_EFFECT_COUNT];
    uint32_t effects;
    brume_render_desc desc = options->render;
    desc.program_size = 1;
    int code = cli_session_open(&session, context, options, progress);
    if (code)
        goto cleanup;
    brume_result result = brume_scene_effects(session.scene, options->render.without, &effects, reports);
    if (!result)
        result = brume_render_create(session.device, session.scene, &desc, &render);
    if (!result)
        result = brume_render_get_stats(render, &stats);
    if (result) {
        code = cli_report(context, result);
        goto cleanup;
    }
    cli_progress_finish(progress);
    if (options->stats_path) {
        const findings found = {options, reports, &stats};
        code = cli_stats_write(options->stats_path, print_json, &found);
        goto cleanup;
    }
    printf("picture        %u x %u pixels of %u x %u\n", stats.width, stats.height, stats.full_width,
           stats.full_height);
    printf("surfaces       %u triangles, %u quadrics\n", stats.triangles, stats.quadrics);
    printf("lights         %u lamps, %u emitting surfaces, %u media\n", stats.lights, stats.emitters, stats.media);
    print_effects(effects, reports, &stats);
    printf("program        %.1f KiB, %u lanes wide, built in %.2f s\n", (double)stats.program_bytes / (1 << 10),
           stats.lanes, stats.build_seconds);
    printf("on the device  %.1f MiB\n", (double)stats.device_bytes / (1 << 20));
cleanup:
    cli_progress_finish(progress);
    brume_render_destroy(render);
    cli_session_close(&session);
    return code;
}

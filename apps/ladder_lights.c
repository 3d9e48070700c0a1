/* More and more spotlights: what a sample costs, and what error it leaves. The lamps are a grid under the ceiling of a
 * room full of fog, their beams as wide as their grid's meshes allow, and together they always have the same power. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "error_metrics.h"
#include "ladder.h"

enum { COUNTS = 5 };
/* Grids of columns x rows, about as many each way. */
static const int grids[COUNTS][2] = {{1, 1}, {5, 2}, {10, 10}, {40, 25}, {100, 100}};

#define PI 3.14159265358979323846

/* ---- the scene ---- */

/* Down from (x, y, z). */
static void point_down(float matrix[16], double x, double y, double z)
{
    const float down[16] = {1, 0, 0, (float)x, 0, 0, -1, (float)y, 0, 1, 0, (float)z, 0, 0, 0, 1};
    memcpy(matrix, down, sizeof down);
}

static brume_result add_spots(brume_scene *scene, const int grid[2])
{
    double dx = 9.0 / grid[0], dz = 9.0 / grid[1], height = 5.9;
    double angle = atan(0.35 * fmin(fmin(dx, dz), 2) / height);
    double power = 30000, solid_angle = 2 * PI * (1 - cos(angle)), count = (double)grid[0] * grid[1];
    brume_result result = BRUME_OK;
    for (int i = 0; i < grid[0] * grid[1] && !result; i++) {
        brume_light_desc spot = brume_light_desc_default(BRUME_LIGHT_SPOT);
        double column = i % grid[0] + 0.5, row = i / grid[0] + 0.5, hue = 6.0 * i / count;
        point_down(spot.to_world, -4.5 + dx * column, height, -4.5 + dz * row);
        spot.cutoff_angle = (float)(angle * 180 / PI);
        for (int c = 0; c < 3; c++) { /* the colours of the rainbow, row by row, none of them pure */
            double away = fabs(fmod(hue + 6 - 2 * c, 6) - 3), share = fmin(fmax(away - 1, 0), 1);
            spot.intensity[c] = (float)((0.25 + 0.75 * share) * power / (solid_angle * count) * 0.01);
        }
        result = brume_scene_add_light(scene, &spot, NULL);
    }
    return result;
}

static brume_result describe(const ladder *l, brume_scene *scene, const int grid[2])
{
    uint32_t fog;
    brume_medium_desc medium = brume_medium_desc_default();
    for (int c = 0; c < 3; c++) {
        medium.sigma_t[c] = 0.05f;
        medium.albedo[c] = 0.9f;
    }
    brume_result result = brume_scene_add_medium(scene, &medium, &fog);
    if (result)
        return result;

    /* Turned round: a sensor looks along +z. */
    brume_sensor_desc sensor = brume_sensor_desc_default();
    const float view[16] = {-1, 0, 0, 0, 0, 1, 0, 2.3f, 0, 0, -1, 4.8f, 0, 0, 0, 1};
    memcpy(sensor.to_world, view, sizeof view);
    sensor.fov = 70;
    sensor.medium = fog;
    if ((result = brume_scene_set_sensor(scene, &sensor)))
        return result;

    brume_film_desc film = brume_film_desc_default();
    film.width = l->options->width;
    film.height = l->options->height;
    if ((result = brume_scene_set_film(scene, &film)))
        return result;

    brume_integrator_desc integrator = brume_integrator_desc_default();
    integrator.max_depth = l->options->depth ? atoi(l->options->depth) : 2;
    if ((result = brume_scene_set_integrator(scene, &integrator)))
        return result;

    brume_shape_desc room = brume_shape_desc_default(BRUME_SHAPE_CUBE);
    const float size[16] = {5, 0, 0, 0, 0, 3, 0, 3, 0, 0, 5, 0, 0, 0, 0, 1};
    memcpy(room.to_world, size, sizeof size);
    room.flip_normals = 1;
    if ((result = brume_scene_add_shape(scene, &room, NULL)))
        return result;
    brume_shape_desc ball = brume_shape_desc_default(BRUME_SHAPE_SPHERE);
    ball.center[0] = -1.2f;
    ball.center[1] = 2;
    ball.center[2] = -1;
    ball.radius = 1.1f;
    if ((result = brume_scene_add_shape(scene, &ball, NULL)))
        return result;
    return add_spots(scene, grid);
}

/* ---- the measurement ---- */

typedef struct measured {
    double error, seconds; /* relMSE; per sample of a pixel */
} measured;

/* All rungs in the scene of one count. Pairs of renders tell the error without a reference; the weights of relMSE are
 * the mean of all of them. */
static int measure(const ladder *l, const brume_scene *scene, const char *name, measured out[])
{
    const ladder_options *o = l->options;
    size_t pixels = (size_t)o->width * o->height;
    ladder_shot pairs[LADDER_RUNGS][2];
    int code = LADDER_EXIT_OK;
    memset(pairs, 0, sizeof pairs);
    float *mean = calloc(3 * pixels, sizeof *mean);
    if (!mean) {
        ladder_error("out of memory");
        return LADDER_EXIT_RUNTIME;
    }
    for (size_t r = 0; r < o->rung_count && !code; r++)
        for (uint32_t k = 0; k < 2 && !code; k++) {
            char png[LADDER_PATH];
            ladder_png_path(l, name, &o->rungs[r], "samples", png);
            code = ladder_shoot(l, scene, &o->rungs[r], o->seed + k, o->spp, 0, k == 0 ? png : NULL, &pairs[r][k]);
            for (size_t i = 0; i < 3 * pixels && !code; i++)
                mean[i] += pairs[r][k].radiance[i] / (2 * (float)o->rung_count);
        }
    for (size_t r = 0; r < o->rung_count && !code; r++) {
        /* The quicker of the two: the first launches, and whatever else the machine does, only ever add. */
        double seconds = fmin(pairs[r][0].seconds, pairs[r][1].seconds);
        out[r].error = error_metrics_of_pair(pairs[r][0].radiance, pairs[r][1].radiance, mean, pixels);
        out[r].seconds = seconds / ((double)o->spp * (double)pixels);
        ladder_say("  %-18s %9.0f ns per sample, relMSE %.3g", o->rungs[r].name, 1e9 * out[r].seconds, out[r].error);
    }
    for (size_t r = 0; r < o->rung_count; r++)
        for (int k = 0; k < 2; k++)
            ladder_shot_free(&pairs[r][k]);
    free(mean);
    return code;
}

static int write_tables(const ladder *l, measured results[COUNTS][LADDER_RUNGS])
{
    const ladder_options *o = l->options;
    FILE *csv = ladder_open(l, "lights.csv"), *table = csv ? ladder_open(l, "lights.md") : NULL;
    int code = table ? LADDER_EXIT_OK : LADDER_EXIT_OUTPUT;
    if (!code) {
        fputs("rung,lights,seconds_per_sample,relmse,relmse_time\n", csv);
        fprintf(table,
                "%s, %u x %u pixels, %u samples.\n\nFor each number of spotlights, ns per sample / relMSE; then the "
                "exponents of the time per sample, of relMSE\nand of their product against the number of lamps "
                "(least squares on logarithms).\n\n| rung |", l->info.name, o->width, o->height, o->spp);
        for (int n = 0; n < COUNTS; n++)
            fprintf(table, " %d |", grids[n][0] * grids[n][1]);
        fputs(" time | relMSE | product |\n|---|--:|--:|--:|--:|--:|--:|--:|--:|\n", table);
        for (size_t r = 0; r < o->rung_count; r++) {
            double lights[COUNTS], seconds[COUNTS], error[COUNTS], product[COUNTS];
            fprintf(table, "| %s |", o->rungs[r].name);
            for (int n = 0; n < COUNTS; n++) {
                lights[n] = (double)grids[n][0] * grids[n][1];
                seconds[n] = results[n][r].seconds;
                error[n] = results[n][r].error;
                product[n] = seconds[n] * error[n];
                fprintf(csv, "%s,%.0f,%.6g,%.6g,%.6g\n", o->rungs[r].name, lights[n], seconds[n], error[n], product[n]);
                fprintf(table, " %.0f / %.2g |", 1e9 * seconds[n], error[n]);
            }
            fprintf(table, " %.2f | %.2f | %.2f |\n", error_metrics_slope(lights, seconds, COUNTS),
                    error_metrics_slope(lights, error, COUNTS), error_metrics_slope(lights, product, COUNTS));
        }
    }
    if (csv && ladder_close(l, csv, "lights.csv") && !code)
        code = LADDER_EXIT_OUTPUT;
    if (table && ladder_close(l, table, "lights.md") && !code)
        code = LADDER_EXIT_OUTPUT;
    return code;
}

int ladder_lights(const ladder *l)
{
    static measured results[COUNTS][LADDER_RUNGS];
    int code = LADDER_EXIT_OK;
    for (int n = 0; n < COUNTS && !code; n++) {
        char name[32], folder[2 * LADDER_PATH];
        brume_scene *scene = NULL;
        snprintf(name, sizeof name, "lights-%d", grids[n][0] * grids[n][1]);
        snprintf(folder, sizeof folder, "%s/%s", l->options->out, name);
        ladder_say("%s", name);
        code = ladder_make_folder(folder);
        brume_result result = code ? BRUME_OK : brume_scene_create(l->context, &scene);
        if (scene && !result)
            result = describe(l, scene, grids[n]);
        if (!code && result)
            code = ladder_report(l, result);
        if (!code)
            code = measure(l, scene, name, results[n]);
        brume_scene_destroy(scene);
    }
    return code ? code : write_tables(l, results);
}

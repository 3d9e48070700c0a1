/* arrays_environment.c -- the environment: its radiance, or its map with the tables that directions are drawn from.
 *
 * A map's density is constant over each of the width x height equal cells of (u, v), in proportion to the integral of
 * luminance over the cell's solid angle: the mean of the bilinear interpolant over the cell (so that a cell next to a
 * bright texel can be drawn, too) times the integral of sin theta. As in Mitsuba 3, texel column i is centred on
 * u = (i + 1/2) / width and wraps around, row j lies at v = j / (height - 1): the first and last rows are the poles.
 */
#include "arrays_build.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "affine.h"

#define PI 3.14159265358979323846

/* Integral of the hat function max(0, 1 - |x|) from -infinity to x. */
static double hat_integral(double x) {
    x = fmax(-1, fmin(1, x));
    return x < 0 ? 0.5 * (1 + x) * (1 + x) : 1 - 0.5 * (1 - x) * (1 - x);
}

/* out[i]: luminance averaged over the columns of cell (i, row), from rows interpolated linearly. */
static void cell_luminances(const float *texels, int width, int height, int row, double *rows, double *out) {
    /* The cell's span in units of rows, and what each row's hat contributes to the mean over it. */
    double scale = height > 1 ? (double)(height - 1) / height : 0, from = row * scale, to = from + scale;
    for (int x = 0; x < width; x++)
        rows[x] = 0;
    for (int y = row > 0 ? row - 1 : 0; y <= row + 1 && y < height; y++) {
        double share = height > 1 ? (hat_integral(to - y) - hat_integral(from - y)) / scale : 1;
        for (int x = 0; x < width; x++)
            rows[x] += share * brume_luminance(texels + 3 * ((size_t)y * (size_t)width + (size_t)x));
    }
    for (int x = 0; x < width; x++)
        out[x] = 0.75 * rows[x] + 0.125 * (rows[(x + 1) % width] + rows[(x + width - 1) % width]);
}

static void rotations(const float to_world[16], b_params *p) {
    double axes[3][3];
    brume_affine_axes(to_world, axes[0], axes[1], axes[2]);
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++) {
            p->environment_to_local[3 * i + k] = (float)axes[i][k];
            p->environment_to_world[3 * i + k] = (float)axes[k][i];
        }
}

/* The tables; *out_total is what the map emits altogether. */
static brume_result tables(const brume_scene *scene, const float *texels, int width, int height, brume_arrays *arrays,
                           double *out_total) {
    uint32_t first;
    double *memory;
    size_t columns = (size_t)width, rows = (size_t)height;
    BRUME_TRY(brume_arrays_more_cdf(scene, arrays, rows + 1 + rows * (columns + 1), &first));
    BRUME_TRY(brume_arrays_alloc(scene, "table entries", 2 * columns + rows, sizeof *memory, &memory));
    double *interpolated = memory, *cells = memory + columns, *row_weights = memory + 2 * columns;
    float *marginal = arrays->cdf + first, *conditional = marginal + rows + 1;
    for (int y = 0; y < height; y++) {
        cell_luminances(texels, width, height, y, interpolated, cells);
        double band = cos(PI * y / height) - cos(PI * (y + 1) / height);
        row_weights[y] = band * brume_cumulate(cells, columns, conditional + (size_t)y * (columns + 1)) / width;
    }
    *out_total = brume_cumulate(row_weights, rows, marginal);
    arrays->params.environment_cdf = (int)first;
    free(memory);
    return BRUME_OK;
}

static brume_result add_map(const brume_scene *scene, const brume_scene_light *light, brume_arrays *arrays) {
    b_params *p = &arrays->params;
    size_t count = (size_t)light->desc.width * light->desc.height;
    uint32_t first;
    double total;
    BRUME_TRY(brume_arrays_more_texels(scene, arrays, count, &first));
    float *texels = arrays->texels + 3 * (size_t)first;
    for (size_t i = 0; i < 3 * count; i++) {
        texels[i] = light->texels[i] * light->desc.scale;
        if (!isfinite(texels[i]))
            return brume_fail(scene->context, BRUME_ERROR_SCENE, "the environment map times its scale is infinite");
    }
    BRUME_TRY(tables(scene, texels, (int)light->desc.width, (int)light->desc.height, arrays, &total));
    if (!(total > 0))
        return BRUME_OK;
    p->environment = ENVIRONMENT_MAP;
    p->environment_width = (int)light->desc.width;
    p->environment_height = (int)light->desc.height;
    p->environment_first = (int)first;
    rotations(light->desc.to_world, p);
    return BRUME_OK;
}

brume_result brume_arrays_environment(const brume_scene *scene, brume_arrays *arrays) {
    b_params *p = &arrays->params;
    for (uint32_t i = 0; i < scene->light_count; i++) {
        const brume_light_desc *desc = &scene->lights[i].desc;
        if (desc->kind == BRUME_LIGHT_ENVMAP)
            BRUME_TRY(add_map(scene, &scene->lights[i], arrays));
        if (desc->kind == BRUME_LIGHT_CONSTANT && brume_luminance(desc->intensity) > 0) {
            p->environment = ENVIRONMENT_CONSTANT;
            memcpy(p->environment_radiance, desc->intensity, sizeof p->environment_radiance);
        }
    }
    if (p->environment != ENVIRONMENT_NONE)
        arrays->features |= FEATURE_ENVIRONMENT;
    return BRUME_OK;
}

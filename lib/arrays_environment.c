/* arrays_environment.c -- the environment: its radiance, or its map with the tables that directions are drawn from.
 *
 * A map's density is constant over each of the width x height equal cells of (u, v), in proportion to the integral of
 * the bilinear interpolant's luminance over the cell's solid angle: a cell next to a bright texel is drawn, too. As in
 * Mitsuba 3, texel column i is centred on u = (i + 1/2) / width and wraps around, row j lies at v = j / (height - 1):
 * the first and last rows are the poles.
 */
#include "arrays_build.h"

#include <math.h>
#include <stdlib.h>

#include "affine.h"

#define PI 3.14159265358979323846

/* Integral of max(0, 1 - |(height - 1) v - y|) sin(pi v) from `from` to `to`, between which the hat has no corner, by
 * Gauss and Legendre's rule of five points: a row is short enough for more digits than float has. */
static double hat_times_sine(double from, double to, int y, int height) {
    static const double nodes[3] = {0, 0.5384693101056831, 0.9061798459386640};
    static const double weights[3] = {0.5688888888888889, 0.4786286704993665, 0.2369268850561891};
    double middle = 0.5 * (from + to), reach = 0.5 * (to - from), sum = 0;
    for (int i = -2; i <= 2 && to > from; i++) {
        double v = middle + (i < 0 ? -nodes[-i] : nodes[i]) * reach;
        sum += weights[abs(i)] * reach * fmax(0, 1 - fabs((height - 1) * v - y)) * sin(PI * v);
    }
    return sum;
}

/* What row y contributes to the cells of `row`, v in [row / height, (row + 1) / height]. */
static double row_share(int y, int row, int height) {
    double from = (double)row / height, to = (double)(row + 1) / height, sum = 0;
    if (height == 1)
        return 2 / PI;
    for (int piece = -1; piece < 1; piece++) {
        double low = (double)(y + piece) / (height - 1), high = (double)(y + piece + 1) / (height - 1);
        sum += hat_times_sine(fmax(from, low), fmin(to, high), y, height);
    }
    return sum;
}

/* out[i]: the integral of luminance times sin(pi v) over cell (i, row), up to a factor of all cells. */
static void cell_weights(const float *texels, int width, int height, int row, double *rows, double *out) {
    for (int x = 0; x < width; x++)
        rows[x] = 0;
    for (int y = row > 0 ? row - 1 : 0; y <= row + 1 && y < height; y++) {
        double share = row_share(y, row, height);
        for (int x = 0; x < width; x++)
            rows[x] += share * brume_luminance(texels + 3 * ((size_t)y * (size_t)width + (size_t)x));
    }
    /* The mean of the hat functions of three columns over the middle one's cell. */
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
        cell_weights(texels, width, height, y, interpolated, cells);
        row_weights[y] = brume_cumulate(cells, columns, conditional + (size_t)y * (columns + 1));
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
        int infinite = !isfinite(texels[i]);
        texels[i] = (float)(texels[i] / arrays->light_unit);
        if (infinite)
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
            brume_arrays_store_light(arrays, desc->intensity, p->environment_radiance);
        }
    }
    return BRUME_OK;
}

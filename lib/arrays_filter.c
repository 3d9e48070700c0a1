/* arrays_filter.c -- the reconstruction filter as a table to draw offsets from, one axis at a time.
 *
 * Filter importance sampling (Ernst, Stamminger, Greiner, "Filter importance sampling", 2006): a sample is offset in
 * proportion to |f| and counts with the sign of f, so that pixels stay independent of each other. The table:
 *     [0 .. size]   the offset in pixels at u = i / size, linear in between
 *     [size + 1]    n, the number of positive offsets where f changes its sign
 *     [size + 2 ..] those offsets, ascending
 * The weight is 1 / (mean sign) of the offsets as the table draws them, not of the exact filter: brightness is exact.
 *
 * The filters and their default radii are Mitsuba 3's (Mitchell and Netravali 1988; Keys 1981; Duchon 1979).
 */
#include "arrays_build.h"

#include <math.h>
#include <stdlib.h>

#define PI 3.14159265358979323846

enum { TABLE_SIZE = 2048, CELLS = 1 << 15, MOST_CROSSINGS = 32 };

static double own_radius(const brume_film_desc *film) {
    switch (film->rfilter) {
    case BRUME_RFILTER_BOX: return 0.5;
    case BRUME_RFILTER_TENT: return 1;
    case BRUME_RFILTER_GAUSSIAN: return 4 * (double)film->filter_stddev;
    case BRUME_RFILTER_MITCHELL: return 2;
    case BRUME_RFILTER_CATMULLROM: return 2;
    case BRUME_RFILTER_LANCZOS: return film->filter_lobes;
    }
    return 0.5;
}

static double sinc(double x) {
    return fabs(x) < 1e-8 ? 1 : sin(PI * x) / (PI * x);
}

static double cubic(double x, double b, double c) {
    if (x < 1)
        return ((12 - 9 * b - 6 * c) * x * x * x + (-18 + 12 * b + 6 * c) * x * x + 6 - 2 * b) / 6;
    return ((-b - 6 * c) * x * x * x + (6 * b + 30 * c) * x * x + (-12 * b - 48 * c) * x + 8 * b + 24 * c) / 6;
}

/* At 0 <= x <= radius, not normalised. A radius other than its own cuts a Gaussian and stretches other filters. */
static double filter_value(const brume_film_desc *film, double radius, double x) {
    double own = own_radius(film), stretched = x * own / radius, sigma = film->filter_stddev;
    switch (film->rfilter) {
    case BRUME_RFILTER_BOX: return 1;
    case BRUME_RFILTER_TENT: return 1 - stretched;
    case BRUME_RFILTER_GAUSSIAN:
        return exp(-x * x / (2 * sigma * sigma)) - exp(-radius * radius / (2 * sigma * sigma));
    case BRUME_RFILTER_MITCHELL: return cubic(stretched, film->filter_b, film->filter_c);
    case BRUME_RFILTER_CATMULLROM: return cubic(stretched, 0, 0.5);
    case BRUME_RFILTER_LANCZOS: return sinc(stretched) * sinc(stretched / own);
    }
    return 1;
}

/* Where f changes its sign in (0, radius), by bisection between samples. */
static int find_crossings(const brume_film_desc *film, double radius, double crossings[MOST_CROSSINGS]) {
    int count = 0;
    double before = 0;
    for (int i = 1; i < CELLS; i++) {
        double x = radius * i / CELLS, last = filter_value(film, radius, before), f = filter_value(film, radius, x);
        if (f == 0)
            continue;
        if ((f > 0) != (last > 0) && count < MOST_CROSSINGS) {
            double low = before, high = x;
            for (int k = 0; k < 60; k++) {
                double middle = 0.5 * (low + high);
                if ((filter_value(film, radius, middle) > 0) == (last > 0))
                    low = middle;
                else
                    high = middle;
            }
            crossings[count++] = 0.5 * (low + high);
        }
        before = x;
    }
    return count;
}

/* The positive half's inverse cumulative of |f|; the other half mirrors it. cumulative: CELLS + 1 values. */
static void fill_offsets(const brume_film_desc *film, double radius, double *cumulative, float *table) {
    const double h = radius / CELLS;
    cumulative[0] = 0;
    for (int i = 0; i < CELLS; i++) {
        double a = fabs(filter_value(film, radius, i * h)), m = fabs(filter_value(film, radius, (i + 0.5) * h)),
               b = fabs(filter_value(film, radius, (i + 1) * h));
        cumulative[i + 1] = cumulative[i] + (a + 4 * m + b) * (h / 6);
    }
    const int half = TABLE_SIZE / 2;
    int cell = 0;
    for (int i = 0; i <= half; i++) {
        double wanted = cumulative[CELLS] * i / half;
        while (cell < CELLS - 1 && cumulative[cell + 1] < wanted)
            cell++;
        double mass = cumulative[cell + 1] - cumulative[cell];
        double offset = (cell + (mass > 0 ? (wanted - cumulative[cell]) / mass : 0)) * h;
        table[half + i] = (float)(i == half ? radius : offset);
        table[half - i] = -table[half + i];
    }
}

/* The share of table cell [low, high] in which an odd number of crossings lies below the offset. */
static double negative_share(double low, double high, const float *crossings, int count) {
    double negative = 0;
    for (int k = 0; k < count; k += 2) {
        double from = fmax(low, crossings[k]), to = fmin(high, k + 1 < count ? crossings[k + 1] : (double)INFINITY);
        if (to > from)
            negative += to - from;
    }
    return high > low ? negative / (high - low) : 0;
}

static brume_result tabulate(const brume_scene *scene, double radius, brume_arrays *arrays) {
    double crossings[MOST_CROSSINGS], *cumulative;
    int count = find_crossings(&scene->film, radius, crossings);
    size_t entries = TABLE_SIZE + 2 + (size_t)count;
    BRUME_TRY(brume_arrays_alloc(scene, "filter entries", entries, sizeof(float), &arrays->filter));
    BRUME_TRY(brume_arrays_alloc(scene, "filter entries", CELLS + 1, sizeof *cumulative, &cumulative));
    arrays->filter_count = (uint32_t)entries;
    fill_offsets(&scene->film, radius, cumulative, arrays->filter);
    free(cumulative);
    float *signs = arrays->filter + TABLE_SIZE + 1;
    signs[0] = (float)count;
    for (int i = 0; i < count; i++)
        signs[1 + i] = (float)crossings[i];
    double mean_sign = 0;
    for (int i = TABLE_SIZE / 2; i < TABLE_SIZE; i++)
        mean_sign += 1 - 2 * negative_share(arrays->filter[i], arrays->filter[i + 1], signs + 1, count);
    mean_sign /= TABLE_SIZE / 2;
    if (!(mean_sign > 0.05))
        return brume_fail(scene->context, BRUME_ERROR_SCENE, "the reconstruction filter cancels itself");
    arrays->params.filter_size = TABLE_SIZE;
    arrays->params.filter_weight = (float)(1 / (mean_sign * mean_sign)); /* along x and along y */
    return BRUME_OK;
}

brume_result brume_arrays_filter(const brume_scene *scene, brume_arrays *arrays) {
    const brume_film_desc *film = &scene->film;
    double radius = film->filter_radius > 0 ? film->filter_radius : own_radius(film);
    arrays->params.filter_radius = (float)radius;
    arrays->params.filter_weight = 1;
    if (film->rfilter == BRUME_RFILTER_BOX && radius == 0.5)
        return BRUME_OK;
    return tabulate(scene, radius, arrays);
}

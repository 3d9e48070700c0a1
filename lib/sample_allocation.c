/* sample_allocation.c -- see sample_allocation.h. */
#include "sample_allocation.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "parallel.h"

enum {
    STEPS = 16,
    RADIUS = 2,
    PIECE_LINES = 8 /* for one thread at a time */
};

/* Where nothing was seen around a pixel it still gets samples, as if its error were this share of the mean: what lies
 * there may only have been missed so far. */
#define UNSEEN 0.001

/* How much the pixels on a line count, against all of the 5 x 5: measured in pictures that are all edges and in others
 * that are all noise. */
#define LINE 0.7

static uint32_t hash(uint32_t x) {
    x = (x ^ x >> 16) * 0x21f0aaadu;
    x = (x ^ x >> 15) * 0xd35a2d97u;
    return x ^ x >> 15;
}

static int bin_of(double e, double order, uint32_t place) {
    double dither = hash(place) * (1.0 / 4294967296.0);
    double step = floor(STEPS * (log2(e > 1e-300 ? e : 1e-300) / (order + 1) + dither));
    return (int)fmin(fmax(step + BRUME_ALLOCATION_BINS / 2, 0), BRUME_ALLOCATION_BINS - 1);
}

/* What is known of each pixel, in parts of the picture's relMSE. */
typedef struct pixel_errors {
    double *share; /* by the last difference, in the picture's weights */
    double *alone; /* times n^p: by both differences, which is less noisy, and by nothing but this pixel */
} pixel_errors;

static void free_errors(pixel_errors *p) {
    free(p->share);
    free(p->alone);
}

static int find_errors(brume_error_estimate *e, double order, pixel_errors *out) {
    size_t pixels = (size_t)e->width * e->height;
    out->share = calloc(pixels, sizeof *out->share);
    out->alone = calloc(pixels, sizeof *out->alone);
    const float *weights = out->share && out->alone ? brume_error_estimate_weights(e) : NULL;
    if (!weights) return 0;
    double scale = 1 / (3.0 * (double)pixels * (pow(2, order) - 1)), fall = pow(2, -order), mean = 0;
    double growth[BRUME_ERROR_LEVELS];
    for (int k = 0; k < BRUME_ERROR_LEVELS; k++) growth[k] = 0.5 * scale * pow(2, order * k);
    for (size_t c = 0; c < 3 * pixels; c++) mean += e->mean[c] / (3.0 * (double)pixels);
    for (size_t i = 0; i < pixels; i++) {
        double grown = growth[e->level[i]];
        for (size_t c = 3 * i; c < 3 * i + 3; c++) {
            double square = (double)e->mean[c] * e->mean[c] + 0.01 * mean * mean;
            out->share[i] += scale * weights[c] * e->last[c];
            if (square > 0) out->alone[i] += grown * (e->last[c] + fall * e->before[c]) / square;
        }
    }
    return 1;
}

/* In the direction dx, dy of a chess queen or knight: the geometric mean of what lies on either side of a pixel. */
static double error_along(const double *at, ptrdiff_t stride, int dx, int dy) {
    double side[2];
    for (int k = 0; k < 2; k++, dx = -dx, dy = -dy) {
        ptrdiff_t far = dx + dy * stride, near = dx / 2 + dy / 2 * stride, beside = far - near;
        /* A knight passes two pixels. */
        if (abs(dx) + abs(dy) != 3) near = beside = 2 * far;
        side[k] = 0.5 * at[far] + 0.25 * (at[near] + at[beside]);
    }
    return sqrt(side[0] * side[1]);
}

/* What the pixels around one say of its error, without a look at it: mostly those on the line through it that has most
 * on both sides, or every edge would be taken for three pixels wide. */
static double error_around(const double *errors, uint32_t width, uint32_t height, uint32_t x, uint32_t y) {
    static const int lines[][2] = {{1, 0}, {2, 1}, {1, 1}, {1, 2}, {0, 1}, {-1, 2}, {-1, 1}, {-2, 1}};
    const double *at = errors + (size_t)y * width + x;
    uint32_t left = x < RADIUS ? x : RADIUS, right = width - 1 - x < RADIUS ? width - 1 - x : RADIUS;
    uint32_t above = y < RADIUS ? y : RADIUS, below = height - 1 - y < RADIUS ? height - 1 - y : RADIUS;
    double sum = 0, line = 0, others = (double)(left + 1 + right) * (above + 1 + below) - 1;
    for (uint32_t j = 0; j <= above + below; j++)
        for (uint32_t i = 0; i <= left + right; i++)
            if (i != left || j != above) sum += at[((ptrdiff_t)j - above) * width + (ptrdiff_t)i - left];
    double box = others > 0 ? sum / others : 0;
    if (others < (2 * RADIUS + 1) * (2 * RADIUS + 1) - 1) return box; /* lines leave the picture */
    for (size_t k = 0; k < sizeof lines / sizeof lines[0]; k++)
        line = fmax(line, error_along(at, width, lines[k][0], lines[k][1]));
    return LINE * line + (1 - LINE) * box;
}

/* Some lines of the bins. */
typedef struct piece_of_work {
    brume_allocation *a;
    const pixel_errors *e;
    double unseen;
} piece_of_work;

static void find_bins(void *user, uint32_t piece) {
    const piece_of_work *w = user;
    uint32_t width = w->a->width, height = w->a->height, end = (piece + 1) * PIECE_LINES;
    if (end > height) end = height;
    for (uint32_t y = piece * PIECE_LINES; y < end; y++)
        for (uint32_t x = 0; x < width; x++) {
            double error = error_around(w->e->alone, width, height, x, y) + w->unseen;
            w->a->bin[(size_t)y * width + x] = (int16_t)bin_of(error, w->a->order, x | y << 16);
        }
}

/* The bins. What the pixels of a bin have for an error they say themselves: they had no part in the choice of the bin,
 * so that errors which only chance put into one neighbourhood promise nothing. */
static void fill_bins(brume_allocation *a, const pixel_errors *e, uint32_t threads) {
    size_t count = (size_t)a->width * a->height;
    double pixels = (double)count, mean = 0;
    for (size_t i = 0; i < count; i++) mean += e->alone[i] / pixels;
    piece_of_work work = {a, e, UNSEEN * mean};
    brume_parallel(threads, (a->height + PIECE_LINES - 1) / PIECE_LINES, find_bins, &work);
    for (size_t i = 0; i < count; i++) {
        a->error[a->level[i]][a->bin[i]] += e->share[i];
        a->cost[a->level[i]][a->bin[i]] += 1 / pixels;
    }
}

brume_allocation *brume_allocation_create(brume_error_estimate *e, double order, uint32_t most_samples) {
    size_t pixels = (size_t)e->width * e->height;
    brume_allocation *a = calloc(1, sizeof *a);
    pixel_errors errors = {0};
    int found = find_errors(e, order, &errors);
    if (a) {
        a->bin = malloc(pixels * sizeof *a->bin);
        a->level = malloc(pixels * sizeof *a->level);
    }
    if (!a || !found || !a->bin || !a->level) {
        free_errors(&errors);
        brume_allocation_free(a);
        return NULL;
    }
    a->width = e->width;
    a->height = e->height;
    a->order = order;
    while (a->most < BRUME_ERROR_LEVELS - 2 && 2ull << a->most <= most_samples) a->most++;
    memcpy(a->level, e->level, pixels * sizeof *a->level);
    fill_bins(a, &errors, e->threads);
    free_errors(&errors);
    for (int level = 0; level < BRUME_ERROR_LEVELS; level++)
        for (int bin = 0; bin < BRUME_ALLOCATION_BINS; bin++) {
            if (a->cost[level][bin] == 0 && a->error[level][bin] == 0) continue;
            if (a->bins[level][1] == 0) a->bins[level][0] = bin;
            a->bins[level][1] = bin + 1;
        }
    return a;
}

void brume_allocation_free(brume_allocation *a) {
    if (!a) return;
    free(a->bin);
    free(a->level);
    free(a);
}

/* log2 of the samples of a pixel. Detail is counted from where even the highest bin wants one sample only. */
static int level_at(const brume_allocation *a, int bin, int level, int detail) {
    int steps = bin + detail - BRUME_ALLOCATION_BINS, wanted = steps < 0 ? 0 : steps / STEPS;
    if (wanted > a->most) wanted = a->most;
    return wanted > level ? wanted : level;
}

void brume_allocation_counts(const brume_allocation *a, int detail, uint32_t *counts) {
    size_t pixels = (size_t)a->width * a->height;
    for (size_t i = 0; i < pixels; i++) counts[i] = 1u << level_at(a, a->bin[i], a->level[i], detail);
}

void brume_allocation_predict(const brume_allocation *a, int detail, double *samples, double *relmse) {
    double cost = 0, error = 0, falls[BRUME_ERROR_LEVELS];
    for (int k = 0; k < BRUME_ERROR_LEVELS; k++) falls[k] = pow(2, -a->order * k);
    for (int level = 0; level < BRUME_ERROR_LEVELS; level++)
        for (int bin = a->bins[level][0]; bin < a->bins[level][1]; bin++) {
            int then = level_at(a, bin, level, detail);
            cost += ldexp(a->cost[level][bin], then);
            error += a->error[level][bin] * falls[then - level];
        }
    *samples = cost;
    *relmse = error;
}

/* Both fall or rise with the detail. */
int brume_allocation_for_samples(const brume_allocation *a, double samples) {
    int low = 0, high = brume_allocation_most_detail(a);
    while (low < high) {
        int middle = (low + high + 1) / 2;
        double cost, error;
        brume_allocation_predict(a, middle, &cost, &error);
        if (cost <= samples)
            low = middle;
        else
            high = middle - 1;
    }
    return low;
}

int brume_allocation_for_error(const brume_allocation *a, double relmse) {
    int low = 0, high = brume_allocation_most_detail(a);
    while (low < high) {
        int middle = (low + high) / 2;
        double cost, error;
        brume_allocation_predict(a, middle, &cost, &error);
        if (error <= relmse)
            high = middle;
        else
            low = middle + 1;
    }
    return low;
}

int brume_allocation_most_detail(const brume_allocation *a) { return BRUME_ALLOCATION_BINS + STEPS * a->most; }

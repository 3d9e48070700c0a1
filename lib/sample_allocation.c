/* sample_allocation.c -- see sample_allocation.h. */
#include "sample_allocation.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { STEPS = 16, BLOCK = 4, RING = 1 };

/* Where nothing was seen around a pixel it still gets samples, as if its error were this share of the mean: what lies
 * there may only have been missed so far. */
#define UNSEEN 0.02

static uint32_t hash(uint32_t x) {
    x = (x ^ x >> 16) * 0x21f0aaadu;
    x = (x ^ x >> 15) * 0xd35a2d97u;
    return x ^ x >> 15;
}

/* The part of a line of `count` pixels that starts at `origin` which holds the block of pixel `i`, and `ring` around
 * it. */
static void block_of(uint32_t i, uint32_t origin, uint32_t count, uint32_t ring, uint32_t *first, uint32_t *end) {
    uint32_t begin = (origin + i) / BLOCK * BLOCK; /* in the whole picture */
    *first = begin < origin + ring ? 0 : begin - origin - ring;
    *end = begin - origin + BLOCK + ring; /* wraps around, and back, where the block begins before the crop */
    if (*end > count) *end = count;
}

static int bin_of(double e, double order, uint32_t place) {
    double dither = hash(place) * (1.0 / 4294967296.0);
    double step = floor(STEPS * (log2(e > 1e-300 ? e : 1e-300) / (order + 1) + dither));
    return (int)fmin(fmax(step + BRUME_ALLOCATION_BINS / 2, 0), BRUME_ALLOCATION_BINS - 1);
}

/* Each pixel's share of relMSE: by the last difference alone, and by both, which is less noisy. */
typedef struct pixel_errors {
    double *last, *both;
} pixel_errors;

static void free_errors(pixel_errors *p) {
    free(p->last);
    free(p->both);
}

static int find_errors(const brume_error_estimate *e, double order, pixel_errors *out) {
    size_t pixels = (size_t)e->width * e->height;
    out->last = calloc(pixels, sizeof *out->last);
    out->both = calloc(pixels, sizeof *out->both);
    float *weights = out->last && out->both ? brume_error_estimate_weights(e) : NULL;
    if (!weights) return 0;
    double scale = 1 / (3.0 * (double)pixels * (pow(2, order) - 1)), fall = pow(2, -order);
    for (size_t i = 0; i < pixels; i++)
        for (size_t c = 3 * i; c < 3 * i + 3; c++) {
            out->last[i] += scale * weights[c] * e->last[c];
            out->both[i] += 0.5 * scale * weights[c] * (e->last[c] + fall * e->before[c]);
        }
    free(weights);
    return 1;
}

/* The bins, from e n^p of the pixels around each (`both` becomes that). What the pixels of a bin have for an error they
 * say themselves: they had no part in the choice of the bin, so that errors which only chance put into one
 * neighbourhood promise nothing. */
static void fill_bins(brume_allocation *a, const pixel_errors *errors, uint32_t x0, uint32_t y0) {
    double mean = 0, powers[BRUME_ERROR_LEVELS], *both = errors->both; /* n^p */
    size_t pixels = (size_t)a->width * a->height;
    for (int k = 0; k < BRUME_ERROR_LEVELS; k++) powers[k] = pow(2, a->order * k);
    for (size_t i = 0; i < pixels; i++) {
        both[i] *= powers[a->level[i]];
        mean += both[i] / (double)pixels;
    }
    for (uint32_t y = 0; y < a->height; y++) {
        uint32_t top, bottom;
        block_of(y, y0, a->height, RING, &top, &bottom);
        for (uint32_t x = 0; x < a->width; x++) {
            uint32_t left, right;
            block_of(x, x0, a->width, RING, &left, &right);
            size_t here = (size_t)y * a->width + x;
            double sum = 0;
            for (uint32_t j = top; j < bottom; j++)
                for (size_t i = (size_t)j * a->width + left; i < (size_t)j * a->width + right; i++)
                    if (i != here) sum += both[i];
            double count = (double)(bottom - top) * (right - left) - 1;
            double error = (count > 0 ? sum / count : 0) + UNSEEN * mean;
            int bin = bin_of(error, a->order, (x0 + x) / BLOCK | (y0 + y) / BLOCK << 16);
            a->bin[here] = (int16_t)bin;
            a->error[a->level[here]][bin] += errors->last[here];
        }
    }
}

static void fill_costs(brume_allocation *a, uint32_t x0, uint32_t y0) {
    double pixels = (double)a->width * a->height;
    for (uint32_t y = 0, next_y; y < a->height; y = next_y) {
        uint32_t top, left, next_x;
        block_of(y, y0, a->height, 0, &top, &next_y);
        for (uint32_t x = 0; x < a->width; x = next_x) {
            block_of(x, x0, a->width, 0, &left, &next_x);
            int bin = 0, level = 0;
            for (uint32_t j = top; j < next_y; j++)
                for (uint32_t i = left; i < next_x; i++) {
                    size_t at = (size_t)j * a->width + i;
                    if (a->bin[at] > bin) bin = a->bin[at];
                    if (a->level[at] > level) level = a->level[at];
                }
            a->cost[level][bin] += (double)(next_x - left) * (next_y - top) / pixels;
        }
    }
}

brume_allocation *brume_allocation_create(const brume_error_estimate *e, uint32_t x0, uint32_t y0, double order,
                                          uint32_t most_samples) {
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
    fill_bins(a, &errors, x0, y0);
    fill_costs(a, x0, y0);
    for (int level = 0; level < BRUME_ERROR_LEVELS; level++)
        for (int bin = 0; bin < BRUME_ALLOCATION_BINS; bin++) {
            if (a->cost[level][bin] == 0 && a->error[level][bin] == 0) continue;
            if (a->bins[level][1] == 0) a->bins[level][0] = bin;
            a->bins[level][1] = bin + 1;
        }
    free_errors(&errors);
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

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

/* Each pixel's share of relMSE. */
static double *pixel_errors(const brume_error_estimate *e, double order) {
    size_t pixels = (size_t)e->width * e->height;
    double *errors = malloc(pixels * sizeof *errors);
    float *weights = errors ? brume_error_estimate_weights(e) : NULL;
    if (!weights) {
        free(errors);
        return NULL;
    }
    double scale = 1 / (3.0 * (double)pixels * (pow(2, order) - 1));
    for (size_t i = 0; i < pixels; i++) {
        errors[i] = 0;
        for (size_t c = 3 * i; c < 3 * i + 3; c++) errors[i] += scale * weights[c] * e->last[c];
    }
    free(weights);
    return errors;
}

int brume_allocation_create(const brume_error_estimate *e, uint32_t x0, uint32_t y0, double order,
                            uint32_t most_samples, brume_allocation *out) {
    size_t pixels = (size_t)e->width * e->height;
    memset(out, 0, sizeof *out);
    out->width = e->width;
    out->height = e->height;
    out->first = 1u << e->level[0];
    out->order = order;
    while (out->most < 30 && (uint64_t)out->first << (out->most + 1) <= most_samples) out->most++;
    double *errors = pixel_errors(e, order), mean = 0;
    out->bin = malloc(pixels * sizeof *out->bin);
    if (!errors || !out->bin) {
        free(errors);
        brume_allocation_free(out);
        return 0;
    }
    for (size_t i = 0; i < pixels; i++) mean += errors[i] / (double)pixels;

    for (uint32_t y = 0; y < e->height; y++) {
        uint32_t top, bottom;
        block_of(y, y0, e->height, RING, &top, &bottom);
        for (uint32_t x = 0; x < e->width; x++) {
            uint32_t left, right;
            block_of(x, x0, e->width, RING, &left, &right);
            double sum = -errors[(size_t)y * e->width + x];
            for (uint32_t j = top; j < bottom; j++)
                for (uint32_t i = left; i < right; i++) sum += errors[(size_t)j * e->width + i];
            double count = (double)(bottom - top) * (right - left) - 1;
            double error = (count > 0 && sum > 0 ? sum / count : 0) + UNSEEN * mean;
            uint32_t place = (x0 + x) / BLOCK | (y0 + y) / BLOCK << 16;
            int bin = bin_of(error, order, place);
            out->bin[(size_t)y * e->width + x] = (int16_t)bin;
            out->error[bin] += error;
        }
    }
    for (uint32_t y = 0, next_y; y < e->height; y = next_y) {
        uint32_t top, left, next_x;
        block_of(y, y0, e->height, 0, &top, &next_y);
        for (uint32_t x = 0; x < e->width; x = next_x) {
            block_of(x, x0, e->width, 0, &left, &next_x);
            int highest = 0;
            for (uint32_t j = top; j < next_y; j++)
                for (uint32_t i = left; i < next_x; i++)
                    if (out->bin[(size_t)j * e->width + i] > highest) highest = out->bin[(size_t)j * e->width + i];
            out->cost[highest] += (double)(next_x - left) * (next_y - top) / (double)pixels;
        }
    }
    free(errors);
    /* Detail is counted from where the first pixel would get more. */
    int top_bin = 0;
    for (size_t i = 0; i < pixels; i++)
        if (out->bin[i] > top_bin) top_bin = out->bin[i];
    out->base = top_bin;
    return 1;
}

void brume_allocation_free(brume_allocation *a) {
    free(a->bin);
    memset(a, 0, sizeof *a);
}

static int doublings(const brume_allocation *a, int bin, int detail) {
    int steps = bin + detail - a->base;
    int k = steps < 0 ? 0 : steps / STEPS;
    return k < a->most ? k : a->most;
}

void brume_allocation_counts(const brume_allocation *a, int detail, uint32_t *counts) {
    size_t pixels = (size_t)a->width * a->height;
    for (size_t i = 0; i < pixels; i++) counts[i] = a->first << doublings(a, a->bin[i], detail);
}

void brume_allocation_predict(const brume_allocation *a, int detail, double *samples, double *relmse) {
    double cost = 0, error = 0;
    for (int bin = 0; bin < BRUME_ALLOCATION_BINS; bin++) {
        if (a->cost[bin] == 0 && a->error[bin] == 0) continue;
        int k = doublings(a, bin, detail);
        cost += ldexp(a->cost[bin], k);
        error += a->error[bin] * pow(2, -a->order * k);
    }
    *samples = a->first * cost;
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

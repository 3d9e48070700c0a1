/* sample_allocation_pack.c -- an allocation as bytes and back: the bins in use at each level, then what each
 * pixel has. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "sample_allocation.h"

/* log2 of the samples of a pixel, which the film counts in float. */
enum { MOST_LEVEL = 24 };

static uint8_t *put(uint8_t *at, const void *bytes, size_t size) {
    memcpy(at, bytes, size);
    return at + size;
}

static const uint8_t *take(const uint8_t *at, void *bytes, size_t size) {
    memcpy(bytes, at, size);
    return at + size;
}

static size_t bins_at(const brume_allocation *a, int level) {
    return (size_t)(a->bins[level][1] - a->bins[level][0]);
}

size_t brume_allocation_bytes(const brume_allocation *a) {
    size_t pixels = (size_t)a->width * a->height, size = sizeof a->most + sizeof a->order + sizeof a->bins;
    for (int level = 0; level < BRUME_ERROR_LEVELS; level++) size += bins_at(a, level) * 2 * sizeof(double);
    return size + pixels * (sizeof *a->bin + sizeof *a->level);
}

void brume_allocation_pack(const brume_allocation *a, uint8_t *out) {
    size_t pixels = (size_t)a->width * a->height;
    out = put(out, &a->most, sizeof a->most);
    out = put(out, &a->order, sizeof a->order);
    out = put(out, a->bins, sizeof a->bins);
    for (int level = 0; level < BRUME_ERROR_LEVELS; level++) {
        out = put(out, a->cost[level] + a->bins[level][0], bins_at(a, level) * sizeof(double));
        out = put(out, a->error[level] + a->bins[level][0], bins_at(a, level) * sizeof(double));
    }
    out = put(out, a->bin, pixels * sizeof *a->bin);
    put(out, a->level, pixels * sizeof *a->level);
}

static int bins_are_valid(const brume_allocation *a) {
    for (int level = 0; level < BRUME_ERROR_LEVELS; level++)
        if (a->bins[level][0] < 0 || a->bins[level][1] < a->bins[level][0] ||
            a->bins[level][1] > BRUME_ALLOCATION_BINS)
            return 0;
    return a->most >= 0 && a->most <= MOST_LEVEL && isfinite(a->order) && a->order > 0;
}

static int pixels_are_valid(const brume_allocation *a) {
    for (size_t i = 0; i < (size_t)a->width * a->height; i++)
        if (a->bin[i] < 0 || a->bin[i] >= BRUME_ALLOCATION_BINS || a->level[i] > MOST_LEVEL) return 0;
    return 1;
}

brume_allocation *brume_allocation_unpack(const uint8_t *bytes, size_t size, uint32_t width, uint32_t height,
                                          int *out_no_memory) {
    size_t pixels = (size_t)width * height;
    brume_allocation *a = calloc(1, sizeof *a);
    *out_no_memory = !a;
    int valid = a && size >= sizeof a->most + sizeof a->order + sizeof a->bins;
    if (valid) {
        a->width = width;
        a->height = height;
        bytes = take(bytes, &a->most, sizeof a->most);
        bytes = take(bytes, &a->order, sizeof a->order);
        bytes = take(bytes, a->bins, sizeof a->bins);
        valid = bins_are_valid(a) && brume_allocation_bytes(a) == size;
    }
    if (valid) {
        for (int level = 0; level < BRUME_ERROR_LEVELS; level++) {
            bytes = take(bytes, a->cost[level] + a->bins[level][0], bins_at(a, level) * sizeof(double));
            bytes = take(bytes, a->error[level] + a->bins[level][0], bins_at(a, level) * sizeof(double));
        }
        a->bin = malloc(pixels * sizeof *a->bin);
        a->level = malloc(pixels * sizeof *a->level);
        valid = a->bin && a->level;
        *out_no_memory = !valid;
    }
    if (valid) {
        bytes = take(bytes, a->bin, pixels * sizeof *a->bin);
        take(bytes, a->level, pixels * sizeof *a->level);
        if (pixels_are_valid(a)) return a;
    }
    brume_allocation_free(a);
    return NULL;
}

/* sample_allocation.h -- how many samples each pixel gets, so that the picture's error falls fastest.
 *
 * A pixel that has n_i samples and the error e_i has e_i (n_i / n)^p with n. Their sum is least, for a given number
 * of samples, where n is in proportion to (e_i n_i^p)^(1 / (p + 1)). A pixel's e is taken from the pixels around it and
 * not from itself: stopping a pixel by its own samples, when it looks converged, would bias it (Kirk & Arvo 1991). What
 * remains runs through the whole picture's totals and, from the second allocation on, through how well its neighbours
 * are known: too little for tests to see.
 *
 * Counts are powers of two, where Sobol' points are at their best; which of the two next to it a pixel gets is decided
 * by a hash of its place, so that totals come out finely graded. Pixels that have as many to come are rendered
 * together, wherever they lie, so that each may have a count of its own: an edge is a pixel wide.
 */
#ifndef BRUME_SAMPLE_ALLOCATION_H
#define BRUME_SAMPLE_ALLOCATION_H

#include "error_estimate.h"

/* Steps of 1/16 of a power of two. */
enum { BRUME_ALLOCATION_BINS = 2048 };

typedef struct brume_allocation {
    uint32_t width, height;
    int most;            /* log2 of the samples that no pixel exceeds */
    double order;        /* p */
    int16_t *bin;        /* per pixel: 16 log2 of (e n^p)^(1 / (p + 1)), and the dither */
    uint8_t *level;      /* per pixel: log2 of its samples at the time */
    /* By the level and the bin: the share of the pixels, and their part in the relMSE at the time. */
    double cost[BRUME_ERROR_LEVELS][BRUME_ALLOCATION_BINS], error[BRUME_ERROR_LEVELS][BRUME_ALLOCATION_BINS];
    int bins[BRUME_ERROR_LEVELS][2]; /* the first in use at a level, and behind the last */
} brume_allocation;

/* From an estimate. order: how the error falls from here on. most_samples: of any pixel. NULL without memory. */
brume_allocation *brume_allocation_create(brume_error_estimate *e, double order, uint32_t most_samples);
void brume_allocation_free(brume_allocation *a);

/* An allocation as bytes, for a checkpoint: brume_allocation_bytes of them. From bytes of another kind, or without
 * memory, which *out_no_memory tells apart, comes NULL. */
size_t brume_allocation_bytes(const brume_allocation *a);
void brume_allocation_pack(const brume_allocation *a, uint8_t *out);
brume_allocation *brume_allocation_unpack(const uint8_t *bytes, size_t size, uint32_t width, uint32_t height,
                                          int *out_no_memory);

/* `detail` is how finely it is looked at, in steps: the higher, the more samples. At 0 no pixel gets more than it
 * has. */

/* Each pixel's samples. */
void brume_allocation_counts(const brume_allocation *a, int detail, uint32_t *counts);

/* The mean number of samples per pixel, and the relMSE to be expected. */
void brume_allocation_predict(const brume_allocation *a, int detail, double *samples, double *relmse);

/* The highest detail that costs at most `samples` per pixel; the lowest that brings relMSE down to `relmse`. */
int brume_allocation_for_samples(const brume_allocation *a, double samples);
int brume_allocation_for_error(const brume_allocation *a, double relmse);

/* At this detail every pixel has as many samples as it may have. */
int brume_allocation_most_detail(const brume_allocation *a);

#endif

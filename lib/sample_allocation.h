/* sample_allocation.h -- how many samples each pixel gets, so that the picture's error falls fastest.
 *
 * With errors e (first / n)^p the sum is least, for a given number of samples, where n is in proportion to
 * e^(1 / (p + 1)). A pixel's e is taken from the pixels around it and not from itself: its own samples, which stay in
 * the picture, have no say in how many of them there are, and so its mean has no bias. (Stopping a pixel when it looks
 * converged has: Kirk & Arvo 1991.) What remains of the dependence runs through the whole picture's total.
 *
 * Counts are powers of two, where Sobol' points are at their best; which of the two next to it a pixel gets is decided
 * by a hash of its place, so that totals come out finely graded. They are nearly the same within 4 x 4 pixels, which a
 * vector unit renders together.
 */
#ifndef BRUME_SAMPLE_ALLOCATION_H
#define BRUME_SAMPLE_ALLOCATION_H

#include "error_estimate.h"

/* Steps of 1/16 of a power of two. */
enum { BRUME_ALLOCATION_BINS = 2048 };

typedef struct brume_allocation {
    uint32_t width, height;
    uint32_t first;      /* samples of every pixel at the time; a power of two */
    int most;            /* doublings of that at most */
    int base;            /* the highest bin in use */
    double order;        /* p */
    int16_t *bin;        /* per pixel: 16 log2 of e^(1 / (p + 1)), and the dither */
    double cost[BRUME_ALLOCATION_BINS];  /* share of the pixels: in blocks whose highest bin it is */
    double error[BRUME_ALLOCATION_BINS]; /* relMSE at `first` samples of the pixels in the bin, by those around them */
} brume_allocation;

/* From an estimate in which every pixel is at the same level. x, y: the crop's place in the picture. order: how the
 * error falls from here on. most_samples: of any pixel. 0 without memory. */
int brume_allocation_create(const brume_error_estimate *e, uint32_t x, uint32_t y, double order,
                            uint32_t most_samples, brume_allocation *out);
void brume_allocation_free(brume_allocation *a);

/* `detail` is how finely it is looked at, in steps: the higher, the more samples. At 0 all pixels have `first`. */

/* Each pixel's samples. */
void brume_allocation_counts(const brume_allocation *a, int detail, uint32_t *counts);

/* The mean number of samples per pixel, as a vector unit pays for it: 4 x 4 pixels cost what the one with most samples
 * does. And the relMSE to be expected. */
void brume_allocation_predict(const brume_allocation *a, int detail, double *samples, double *relmse);

/* The highest detail that costs at most `samples` per pixel; the lowest that brings relMSE down to `relmse`. */
int brume_allocation_for_samples(const brume_allocation *a, double samples);
int brume_allocation_for_error(const brume_allocation *a, double relmse);

/* At this detail every pixel has as many samples as it may have. */
int brume_allocation_most_detail(const brume_allocation *a);

#endif

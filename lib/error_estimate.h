/* error_estimate.h -- how far a picture is from what it converges to, from the picture itself.
 *
 * The doubling estimate. Let I_n be a pixel's mean over its first n samples, n = 2^k, and A, B the means over their
 * two halves: I_n = (A + B) / 2 and I_n - I_{n/2} = (B - A) / 2. Scrambled Sobol' points give A and B the same
 * distribution, so that I_n and I_n - I_{n/2} are uncorrelated, and
 *
 *     E[(I_n - I_{n/2})^2] = V(n/2) - V(n) = V(n) (2^p - 1)        where V(n) = c n^-p.
 *
 * With p = 1 this is what independent samples give; the spread of the samples, the usual measure, knows no other p and
 * is far too large for p near 2 or 3. The order p comes from two successive differences over many pixels: the ratio of
 * their expectations is 2^p. Few pixels hold most of the error, and theirs alone says little: the ratio is found where
 * the last differences times it have the same distribution as those before, each pixel counting by the root of them; and
 * as far as pixels are too few to tell, it is what is usual. They are scrambled independently of each other: they are
 * the independent randomisations that the confidence interval comes from.
 *
 * All arrays are height x width x 3 floats, or height x width, rows from the top.
 */
#ifndef BRUME_ERROR_ESTIMATE_H
#define BRUME_ERROR_ESTIMATE_H

#include "context.h"

enum { BRUME_ERROR_LEVELS = 32 };

/* Of pictures in fog, and what is assumed as far as pixels can't tell. */
#define BRUME_USUAL_ORDER 1.4

typedef struct brume_error_estimate {
    uint32_t width, height;
    float *mean;    /* per channel, of the first 2^level samples */
    float *last;    /* (I_n - I_{n/2})^2 per channel, n = 2^level */
    float *before;  /* the same at n / 2 */
    uint8_t *level; /* per pixel */
    float *weights; /* brume_error_estimate_weights, of what is here; NULL: nobody has asked yet */
    int independent; /* the sampler is: p = 1 is known */
    uint32_t threads; /* to work with; what comes out doesn't depend on it */
} brume_error_estimate;

/* The relative mean squared error of a picture: the mean over pixels and channels of (I - R)^2 / (R^2 + 0.01 mean(R)^2)
 * for the R that it converges to. */
typedef struct brume_error_result {
    int known;         /* 0: too few samples; the rest means nothing */
    int no_memory;     /* not known for want of memory */
    double relmse;
    double low, high;  /* 95 % confidence */
    double order;      /* p, between 1 and 4: the error falls as samples^-p */
} brume_error_result;

brume_result brume_error_estimate_create(brume_context *context, uint32_t width, uint32_t height, int independent,
                                         brume_error_estimate *out);
void brume_error_estimate_free(brume_error_estimate *e);

/* Takes note of `mean`, for the pixels that hold exactly 2^level samples by `count`. Levels must come one by one, from
 * 0 on. */
void brume_error_estimate_update(brume_error_estimate *e, const float *mean, const float *count, int level);

/* The error of the picture whose pixels hold `count` samples: at least the 2^level that the estimate knows of. */
brume_error_result brume_error_estimate_picture(brume_error_estimate *e, const float *count);

/* Per pixel and channel the variance of its mean: from the differences in the 5 x 5 pixels around it.
 * 0 without memory. */
int brume_error_estimate_variance(const brume_error_estimate *e, const float *count, float *out);

/* What a pixel's squared errors count for in the picture's relMSE, per channel, times 3 width height:
 * 1 / (R^2 + 0.01 mean(R)^2). R^2 is the product of the means of a pixel's two halves, averaged over those of the 5 x 5
 * pixels around it that differ from it by no more than their noise. A pixel's own square would be large where its error
 * is: with 8 to 32 samples beams had an error of up to eight times what that said, of a dark pixel at their edge that
 * the light has met once. Computed once after an update; the estimate's. NULL without memory. */
const float *brume_error_estimate_weights(brume_error_estimate *e);

/* Sums of height x width x 3 values over 5 x 5 pixels, those outside left out, and how many were in. 0 without
 * memory. */
int brume_box_sums(const float *values, uint32_t width, uint32_t height, float *sums, float *inside);

/* The variance of n samples over that of 2^level: in blocks of powers of two, each of them scrambled as if alone. */
double brume_error_estimate_growth(uint32_t n, int level, double order);

#endif

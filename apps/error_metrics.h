/* error_metrics.h -- how far a picture is from the truth, in numbers. Pure functions, shared by `ladder`,
 * `render-cli study` and their tests. Pictures are 3 floats a pixel. */
#ifndef ERROR_METRICS_H
#define ERROR_METRICS_H

#include <stddef.h>

/* Of a pixel: the mean over its channels of (I - R)^2 / (R^2 + 0.01 mean(R)^2), mean(R) over the whole reference. */
typedef struct error_metrics {
    double mse;      /* relMSE: the mean over all pixels */
    double trimmed;  /* without the worst pixels */
    double ratio;    /* mean(I) / mean(R) */
    double deviates; /* mean(I) - mean(R) in standard errors, which come from the spread of I - R over the pixels */
} error_metrics;

/* `dropped` is the share of pixels that `trimmed` leaves out, rounded down. Returns 0 if memory ran out. */
int error_metrics_compute(const float *picture, const float *reference, size_t pixel_count, double dropped,
                          error_metrics *out);

/* relMSE of either of two pictures that are right on average and independent, without knowing the truth: half the
 * squared difference, in the weights of `reference`, whose own noise doesn't matter much. */
double error_metrics_of_pair(const float *a, const float *b, const float *reference, size_t pixel_count);

/* The mean of a variance per pixel and channel, in the weights of relMSE. */
double error_metrics_of_variance(const float *variance, const float *reference, size_t pixel_count);

/* More figures of a picture against a reference. e is 0.1 mean(R), the root of what relMSE adds to R^2. */
typedef struct error_figures {
    double mape;      /* mean over pixels and channels of |I - R| / (|R| + e) */
    double smape;     /* the same of |I - R| / (|I| + |R| + e): from 0 to 1 */
    size_t fireflies; /* pixels more than 4 times as bright as all of their 3 x 3 neighbourhood in the reference, to
                         whose luminance 0.1 of the mean is added */
} error_figures;

void error_figures_compute(const float *picture, const float *reference, size_t width, size_t height,
                           error_figures *out);

/* Bias told from noise, by two pictures a and b of one estimator with independent seeds and a reference that is right
 * on average: their errors have only the bias and the reference's own error in common, so that the mean of
 * (a - R)(b - R), in the weights of relMSE, less `reference_error` is the bias squared, without the noise. *sigma is
 * its standard error, from the spread over the pixels. Can come out below 0. */
double error_metrics_bias(const float *a, const float *b, const float *reference, size_t pixel_count,
                          double reference_error, double *sigma);

/* The exponent s of y = c x^s: least squares on logarithms. Points that aren't positive are left out; NaN if there
 * are fewer than two different x. */
double error_metrics_slope(const double *x, const double *y, size_t count);

#endif

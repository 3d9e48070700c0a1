/* error_metrics.c -- see error_metrics.h. */
#include "error_metrics.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* What keeps black pixels from weighing without bound. */
static double floor_of(const float *reference, size_t pixel_count)
{
    double sum = 0;
    for (size_t i = 0; i < 3 * pixel_count; i++)
        sum += reference[i];
    double mean = sum / (3.0 * (double)pixel_count);
    return 0.01 * mean * mean;
}

/* A square over what it is relative to; 0 of nothing is right. */
static double relative(double square, double reference, double floor)
{
    return square == 0 ? 0 : square / (reference * reference + floor);
}

static int descending(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x < y) - (x > y);
}

int error_metrics_compute(const float *picture, const float *reference, size_t pixel_count, double dropped,
                          error_metrics *out)
{
    double *errors = malloc(pixel_count * sizeof *errors);
    if (!errors)
        return 0;
    double floor = floor_of(reference, pixel_count);
    double sum = 0, sum_reference = 0, differences = 0, squares = 0, total = 0;
    for (size_t i = 0; i < pixel_count; i++) {
        double error = 0, difference = 0;
        for (size_t c = 3 * i; c < 3 * i + 3; c++) {
            double d = (double)picture[c] - reference[c];
            error += relative(d * d, reference[c], floor) / 3;
            difference += d;
            sum += picture[c];
            sum_reference += reference[c];
        }
        errors[i] = error;
        total += error;
        differences += difference;
        squares += difference * difference;
    }
    /* Pixels are independent, and in an honest picture each differs by 0 on average: the variance of the sum of the
     * differences is the sum of their squares, however unlike the pixels are. */
    out->mse = total / (double)pixel_count;
    out->ratio = sum / sum_reference;
    out->deviates = squares > 0 ? differences / sqrt(squares) : 0;

    qsort(errors, pixel_count, sizeof *errors, descending);
    size_t first = (size_t)(dropped * (double)pixel_count);
    double kept = 0;
    for (size_t i = first; i < pixel_count; i++)
        kept += errors[i];
    out->trimmed = first < pixel_count ? kept / (double)(pixel_count - first) : 0;
    free(errors);
    return 1;
}

double error_metrics_of_pair(const float *a, const float *b, const float *reference, size_t pixel_count)
{
    double floor = floor_of(reference, pixel_count), sum = 0;
    for (size_t i = 0; i < 3 * pixel_count; i++) {
        double d = (double)a[i] - b[i];
        sum += relative(0.5 * d * d, reference[i], floor);
    }
    return sum / (3.0 * (double)pixel_count);
}

double error_metrics_of_variance(const float *variance, const float *reference, size_t pixel_count)
{
    double floor = floor_of(reference, pixel_count), sum = 0;
    for (size_t i = 0; i < 3 * pixel_count; i++)
        sum += relative(variance[i], reference[i], floor);
    return sum / (3.0 * (double)pixel_count);
}

double error_metrics_slope(const double *x, const double *y, size_t count)
{
    double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0;
    for (size_t i = 0; i < count; i++) {
        if (!(x[i] > 0) || !(y[i] > 0))
            continue;
        double u = log(x[i]), v = log(y[i]);
        n += 1;
        sx += u;
        sy += v;
        sxx += u * u;
        sxy += u * v;
    }
    double spread = n * sxx - sx * sx;
    return spread > 1e-12 * n * sxx ? (n * sxy - sx * sy) / spread : NAN;
}

static double luminance(const float *rgb)
{
    return 0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2];
}

/* The greatest luminance about (x, y). */
static double brightest(const float *picture, size_t width, size_t height, size_t x, size_t y)
{
    double most = -INFINITY;
    for (size_t v = y > 0 ? y - 1 : 0; v <= y + 1 && v < height; v++)
        for (size_t u = x > 0 ? x - 1 : 0; u <= x + 1 && u < width; u++)
            most = fmax(most, luminance(picture + 3 * (v * width + u)));
    return most;
}

void error_figures_compute(const float *picture, const float *reference, size_t width, size_t height,
                           error_figures *out)
{
    size_t count = width * height;
    double e = sqrt(floor_of(reference, count)), light = 0;
    memset(out, 0, sizeof *out);
    for (size_t i = 0; i < 3 * count; i++) {
        double d = fabs((double)picture[i] - reference[i]), r = fabs(reference[i]);
        if (d > 0) {
            out->mape += d / (r + e);
            out->smape += d / (fabs(picture[i]) + r + e);
        }
    }
    out->mape /= 3.0 * (double)count;
    out->smape /= 3.0 * (double)count;
    for (size_t i = 0; i < count; i++)
        light += luminance(reference + 3 * i) / (double)count;
    for (size_t y = 0; y < height; y++)
        for (size_t x = 0; x < width; x++)
            out->fireflies += luminance(picture + 3 * (y * width + x)) >
                              4 * (brightest(reference, width, height, x, y) + 0.1 * light);
}

double error_metrics_bias(const float *a, const float *b, const float *reference, size_t pixel_count,
                          double reference_error, double *sigma)
{
    double floor = floor_of(reference, pixel_count), sum = 0, squares = 0, n = (double)pixel_count;
    for (size_t i = 0; i < pixel_count; i++) {
        double common = 0;
        for (size_t c = 3 * i; c < 3 * i + 3; c++) {
            double product = ((double)a[c] - reference[c]) * ((double)b[c] - reference[c]);
            common += relative(product, reference[c], floor) / 3;
        }
        sum += common;
        squares += common * common;
    }
    double mean = sum / n, spread = squares / n - mean * mean;
    *sigma = spread > 0 ? sqrt(spread / n) : 0;
    return mean - reference_error;
}

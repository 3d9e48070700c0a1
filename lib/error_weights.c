/* error_weights.c -- what a pixel's error counts for in the picture's, from a picture that is itself noisy: see
 * error_estimate.h.
 *
 * relMSE divides by the square of what a pixel converges to. A dark pixel that has met one bright path is the worst of
 * the picture, and by its own value among the bright ones, whose errors count for little. That square is therefore
 * taken to be the product of the means over the pixel's two halves, in which such a path is in one only; and averaged
 * over those pixels around it that might be alike, as far as noise lets one tell.
 */
#include <math.h>
#include <stdlib.h>

#include "error_estimate.h"
#include "parallel.h"

enum {
    RADIUS = 2,
    PIECE_LINES = 8 /* for one thread at a time */
};

static uint32_t line_first(uint32_t i) { return i < RADIUS ? 0 : i - RADIUS; }

static uint32_t line_last(uint32_t i, uint32_t count) { return i + RADIUS < count ? i + RADIUS : count - 1; }

int brume_box_sums(const float *values, uint32_t width, uint32_t height, float *sums, float *inside) {
    size_t row = 3 * (size_t)width;
    float *rows = calloc(row * height, sizeof *rows);
    if (!rows) return 0;
    for (uint32_t y = 0; y < height; y++) {
        const float *in = values + y * row;
        float *out = rows + y * row;
        for (uint32_t x = 0; x < width; x++)
            for (size_t i = 3 * line_first(x); i <= 3 * line_last(x, width); i += 3)
                for (size_t c = 0; c < 3; c++) out[3 * x + c] += in[i + c];
    }
    for (uint32_t y = 0; y < height; y++) {
        float *out = sums + y * row;
        for (size_t i = 0; i < row; i++) out[i] = 0;
        for (uint32_t j = line_first(y); j <= line_last(y, height); j++)
            for (size_t i = 0; i < row; i++) out[i] += rows[j * row + i];
        float lines = (float)(line_last(y, height) - line_first(y) + 1);
        for (uint32_t x = 0; x < width; x++)
            inside[(size_t)y * width + x] = lines * (float)(line_last(x, width) - line_first(x) + 1);
    }
    free(rows);
    return 1;
}

/* How many of its standard deviations, squared, two pixels may differ by to be half alike. */
#define ALIKE 0.7

/* The product of a pixel's halves is I^2 - d^2, d^2 being the last difference. A little of d^2 is left in it: sparse
 * pixels that are bright in truth have halves without light, too. Measured in ten scenes, like ALIKE. */
#define DIFFERENCE_KEPT 0.1

/* How much a pixel counts itself, against one that is just like it: what it says is what is in doubt. */
#define OWN 0.5

static double of_all_channels(const float *variance, size_t pixel) {
    return (double)variance[3 * pixel] + variance[3 * pixel + 1] + variance[3 * pixel + 2];
}

/* Per channel the square of what a pixel converges to. */
static void find_squares(const brume_error_estimate *e, const float *variance, double least, uint32_t x, uint32_t y,
                         double squares[3]) {
    size_t here = (size_t)y * e->width + x;
    double own = of_all_channels(variance, here) + least, sum = 0;
    squares[0] = squares[1] = squares[2] = 0;
    for (uint32_t v = line_first(y); v <= line_last(y, e->height); v++)
        for (uint32_t u = line_first(x); u <= line_last(x, e->width); u++) {
            size_t there = (size_t)v * e->width + u;
            const float *mean = e->mean + 3 * there, *last = e->last + 3 * there;
            double both = own + of_all_channels(variance, there) + least, apart = 0;
            for (size_t c = 0; c < 3; c++) {
                double difference = (double)e->mean[3 * here + c] - mean[c];
                apart += difference * difference;
            }
            apart /= ALIKE * both;
            apart *= apart;
            double weight = (there == here ? OWN : 1) / (both * (1 + apart * apart));
            sum += weight;
            for (size_t c = 0; c < 3; c++) {
                double product = (double)mean[c] * mean[c] - (1 - DIFFERENCE_KEPT) * last[c];
                squares[c] += product > 0 ? weight * product : 0; /* fmax would be a call */
            }
        }
    for (size_t c = 0; c < 3; c++) squares[c] = sum > 0 ? squares[c] / sum : 0;
}

/* The variance of each value, roughly: its own difference alone may be nothing by chance; nor is any value known to
 * better than a percent. */
static void find_variances(const brume_error_estimate *e, const float *sums, const float *inside, float *out) {
    for (size_t i = 0; i < 3 * (size_t)e->width * e->height; i++) {
        float square = e->mean[i] * e->mean[i], around = sums[i] / inside[i / 3];
        out[i] = e->last[i] + 0.25f * fminf(around, square) + 1e-4f * square;
    }
}

/* Weights of some lines. */
typedef struct piece_of_work {
    const brume_error_estimate *e;
    const float *variance;
    double floor;
    float *out;
} piece_of_work;

static void find_weights(void *user, uint32_t piece) {
    const piece_of_work *w = user;
    uint32_t width = w->e->width, end = (piece + 1) * PIECE_LINES;
    double least = fmax(0.03 * w->floor, 1e-300);
    if (end > w->e->height) end = w->e->height;
    for (uint32_t y = piece * PIECE_LINES; y < end; y++)
        for (uint32_t x = 0; x < width; x++) {
            double squares[3];
            float *out = w->out + 3 * ((size_t)y * width + x);
            find_squares(w->e, w->variance, least, x, y, squares);
            for (size_t c = 0; c < 3; c++) {
                double square = squares[c] + w->floor;
                out[c] = square > 0 ? (float)(1 / square) : 0;
            }
        }
}

const float *brume_error_estimate_weights(brume_error_estimate *e) {
    size_t pixels = (size_t)e->width * e->height, values = 3 * pixels;
    if (e->weights) return e->weights;
    float *weights = malloc(values * sizeof *weights), *sums = malloc(values * sizeof *sums);
    float *variance = malloc(values * sizeof *variance), *inside = malloc(pixels * sizeof *inside);
    int done = weights && sums && variance && inside && brume_box_sums(e->last, e->width, e->height, sums, inside);
    double total = 0;
    for (size_t i = 0; i < values && done; i++) total += e->mean[i];
    double all = total / (double)values;
    if (done) {
        find_variances(e, sums, inside, variance);
        piece_of_work work = {e, variance, 0.01 * all * all, weights};
        brume_parallel(e->threads, (e->height + PIECE_LINES - 1) / PIECE_LINES, find_weights, &work);
        e->weights = weights;
    } else {
        free(weights);
    }
    free(sums);
    free(variance);
    free(inside);
    return e->weights;
}

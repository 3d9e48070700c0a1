/* error_weights.c -- what a pixel's error counts for in the picture's, from a picture that is itself noisy: see
 * error_estimate.h.
 *
 * relMSE divides by the square of what a pixel converges to. A dark pixel that has met one bright path is the worst of
 * the picture, and by its own value among the bright ones, whose errors count for little. So each value is drawn
 * towards what its surroundings say, as far as its own noise exceeds what pixels differ by there.
 */
#include <math.h>
#include <stdlib.h>

#include "error_estimate.h"

enum { RADIUS = 2 };

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

/* Arrays of values, height x width x 3 each. */
typedef struct surroundings {
    float *trust;  /* 1 / the variance of each value, roughly */
    float *trusts; /* sums of it over the box */
    float *mean;   /* of the box, weighted by trust: pixels that met something bright say little */
    float *noise;  /* and in the same way the variance of its values, */
    float *spread; /* and what they differ from their own boxes' means by, squared */
    float *scratch, *inside;
} surroundings;

static void free_surroundings(surroundings *s) {
    free(s->trust);
    free(s->trusts);
    free(s->mean);
    free(s->noise);
    free(s->spread);
    free(s->scratch);
    free(s->inside);
}

static int average(const brume_error_estimate *e, surroundings *s, float *out) {
    size_t values = 3 * (size_t)e->width * e->height;
    for (size_t i = 0; i < values; i++) s->scratch[i] *= s->trust[i];
    if (!brume_box_sums(s->scratch, e->width, e->height, out, s->inside)) return 0;
    for (size_t i = 0; i < values; i++) out[i] = s->trusts[i] > 0 ? out[i] / s->trusts[i] : 0;
    return 1;
}

static int find_surroundings(const brume_error_estimate *e, surroundings *s) {
    size_t pixels = (size_t)e->width * e->height, values = 3 * pixels;
    if (!brume_box_sums(e->last, e->width, e->height, s->noise, s->inside)) return 0;
    for (size_t i = 0; i < values; i++) {
        /* Its own difference alone may be nothing by chance; nor is any value known to better than a percent. */
        float variance = e->last[i] + s->noise[i] / s->inside[i / 3] + 1e-4f * e->mean[i] * e->mean[i];
        s->trust[i] = variance > 1e-37f ? 1 / variance : 1e37f;
    }
    if (!brume_box_sums(s->trust, e->width, e->height, s->trusts, s->inside)) return 0;
    for (size_t i = 0; i < values; i++) s->scratch[i] = e->mean[i];
    if (!average(e, s, s->mean)) return 0;
    for (size_t i = 0; i < values; i++) s->scratch[i] = e->last[i];
    if (!average(e, s, s->noise)) return 0;
    for (size_t i = 0; i < values; i++) s->scratch[i] = (e->mean[i] - s->mean[i]) * (e->mean[i] - s->mean[i]);
    return average(e, s, s->spread);
}

float *brume_error_estimate_weights(const brume_error_estimate *e) {
    size_t pixels = (size_t)e->width * e->height, values = 3 * pixels;
    surroundings s = {0};
    float *weights = malloc(values * sizeof *weights);
    s.trust = malloc(values * sizeof *s.trust);
    s.trusts = malloc(values * sizeof *s.trusts);
    s.mean = malloc(values * sizeof *s.mean);
    s.noise = malloc(values * sizeof *s.noise);
    s.spread = malloc(values * sizeof *s.spread);
    s.scratch = malloc(values * sizeof *s.scratch);
    s.inside = malloc(pixels * sizeof *s.inside);
    int done = weights && s.trust && s.trusts && s.mean && s.noise && s.spread && s.scratch && s.inside &&
               find_surroundings(e, &s);
    double total = 0;
    for (size_t i = 0; i < values && done; i++) total += e->mean[i];
    double all = total / (double)values, floor = 0.01 * all * all;
    for (size_t i = 0; i < values && done; i++) {
        double signal = fmax((double)s.spread[i] - s.noise[i], 0);
        double own = fmax(e->last[i], 0.5 * s.noise[i]);
        double share = signal > 0 ? signal / (signal + own) : 0;
        double r = s.mean[i] + share * (e->mean[i] - s.mean[i]);
        /* The square of what is noisy is too large by its variance, here about half of the last difference. */
        double weight = fmax(r * r - share * share * 0.5 * e->last[i], 0) + floor;
        weights[i] = weight > 0 ? (float)(1 / weight) : 0;
    }
    free_surroundings(&s);
    if (done) return weights;
    free(weights);
    return NULL;
}

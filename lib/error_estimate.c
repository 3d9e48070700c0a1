/* error_estimate.c -- see error_estimate.h. */
#include "error_estimate.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define MIN_ORDER 1.0 /* scrambled points are never much worse than independent ones */
#define MAX_ORDER 4.0 /* smooth integrands: 3, and some room for what the ratio of two estimates does */

/* So many samples make two differences that mean something. */
enum { FIRST_LEVEL = 3, RADIUS = 2 };

/* Pixels at one level are too few, sometimes, to tell an order; all others then count a little, too. */
#define SHARED 0.05

brume_result brume_error_estimate_create(brume_context *context, uint32_t width, uint32_t height, int independent,
                                         brume_error_estimate *out) {
    size_t pixels = (size_t)width * height;
    brume_error_estimate e = {.width = width, .height = height, .independent = independent};
    e.mean = calloc(3 * pixels, sizeof *e.mean);
    e.last = calloc(3 * pixels, sizeof *e.last);
    e.before = calloc(3 * pixels, sizeof *e.before);
    e.level = calloc(pixels, sizeof *e.level);
    if (!e.mean || !e.last || !e.before || !e.level) {
        brume_error_estimate_free(&e);
        return brume_fail(context, BRUME_ERROR_MEMORY, "estimating the error: out of memory");
    }
    *out = e;
    return BRUME_OK;
}

void brume_error_estimate_free(brume_error_estimate *e) {
    free(e->mean);
    free(e->last);
    free(e->before);
    free(e->level);
    memset(e, 0, sizeof *e);
}

void brume_error_estimate_update(brume_error_estimate *e, const float *mean, const float *count, int level) {
    size_t pixels = (size_t)e->width * e->height;
    float samples = ldexpf(1, level);
    for (size_t i = 0; i < pixels; i++) {
        /* Dropped samples (NaN) leave a pixel a few short of it. */
        if (count[i] > samples || count[i] <= 0.5f * samples) continue;
        if (level > 0 && e->level[i] >= level) continue; /* seen before */
        for (size_t c = 3 * i; c < 3 * i + 3; c++) {
            float d = mean[c] - e->mean[c];
            e->before[c] = e->last[c];
            e->last[c] = d * d;
            e->mean[c] = mean[c];
        }
        e->level[i] = (uint8_t)level;
    }
}

double brume_error_estimate_growth(uint32_t n, int level, double order) {
    if (n == 0) return 0;
    if (n == 1u << level) return 1;
    uint32_t block = 1u << 31;
    double sum = 0, first = ldexp(1, level);
    for (uint32_t left = n; left > 0; left -= block) {
        while (block > left) block /= 2;
        double share = (double)block / n;
        sum += share * share * pow(first / block, order);
    }
    return sum;
}

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
        memset(out, 0, row * sizeof *out);
        for (uint32_t j = line_first(y); j <= line_last(y, height); j++)
            for (size_t i = 0; i < row; i++) out[i] += rows[j * row + i];
        float lines = (float)(line_last(y, height) - line_first(y) + 1);
        for (uint32_t x = 0; x < width; x++)
            inside[(size_t)y * width + x] = lines * (float)(line_last(x, width) - line_first(x) + 1);
    }
    free(rows);
    return 1;
}

float *brume_error_estimate_weights(const brume_error_estimate *e) {
    size_t pixels = (size_t)e->width * e->height, values = 3 * pixels;
    float *mean = malloc(values * sizeof *mean), *square = malloc(values * sizeof *square);
    float *noise = malloc(values * sizeof *noise), *inside = malloc(pixels * sizeof *inside);
    int done = mean && square && noise && inside;
    double total = 0;
    for (size_t i = 0; i < values && done; i++) {
        noise[i] = e->mean[i] * e->mean[i];
        total += e->mean[i];
    }
    done = done && brume_box_sums(e->mean, e->width, e->height, mean, inside) &&
           brume_box_sums(noise, e->width, e->height, square, inside) &&
           brume_box_sums(e->last, e->width, e->height, noise, inside);
    double all = total / (double)values, floor = 0.01 * all * all;
    for (size_t i = 0; i < pixels && done; i++)
        for (size_t c = 3 * i; c < 3 * i + 3; c++) {
            double box = (double)mean[c] / inside[i];
            double spread = (double)square[c] / inside[i] - box * box;
            double share = spread > 0 ? fmax(1 - noise[c] / inside[i] / spread, 0) : 0;
            double r = box + share * (e->mean[c] - box);
            /* The square of what is noisy is too large by its variance, here about half of the last difference. */
            double weight = fmax(r * r - share * share * 0.5 * e->last[c], 0) + floor;
            mean[c] = weight > 0 ? (float)(1 / weight) : 0;
        }
    free(square);
    free(noise);
    free(inside);
    if (done) return mean;
    free(mean);
    return NULL;
}

/* What the pixels at each level have in common. */
typedef struct level_sums {
    double last[BRUME_ERROR_LEVELS], before[BRUME_ERROR_LEVELS]; /* weighted sums of the differences, and of the */
    double last_squares[BRUME_ERROR_LEVELS], before_squares[BRUME_ERROR_LEVELS]; /* squares of each pixel's */
    double ratio[BRUME_ERROR_LEVELS]; /* 2^order, */
    double order[BRUME_ERROR_LEVELS];
    double trust[BRUME_ERROR_LEVELS]; /* and how far it is the pixels' and not what is usual, 0 to 1 */
} level_sums;

/* The order of what a picture's last errors consist of is usually 1 and a little: its logarithm has a spread of SPREAD
 * about that. Where few pixels hold most of the error their ratio says less than that does, and believing it would make
 * errors too small more often than too large. */
#define SPREAD 0.6

static void find_ratio(const brume_error_estimate *e, level_sums *s, int k, double last, double before) {
    double ratio = last > 0 ? before / last : 2;
    s->trust[k] = 0;
    if (!e->independent && ratio > 2 && s->last[k] > 0 && s->before[k] > 0) {
        double uncertain = s->last_squares[k] / (s->last[k] * s->last[k]) +
                           s->before_squares[k] / (s->before[k] * s->before[k]);
        s->trust[k] = SPREAD * SPREAD / (SPREAD * SPREAD + uncertain);
    }
    ratio = s->trust[k] > 0 ? 2 * pow(ratio / 2, s->trust[k]) : 2; /* MIN_ORDER */
    s->ratio[k] = ratio < 16 ? ratio : 16;                         /* MAX_ORDER */
    s->order[k] = log2(s->ratio[k]);
}

static void sum_levels(const brume_error_estimate *e, const float *weights, level_sums *s) {
    size_t pixels = (size_t)e->width * e->height;
    double last = 0, before = 0;
    memset(s, 0, sizeof *s);
    for (size_t i = 0; i < pixels; i++) {
        int level = e->level[i];
        double pixel_last = 0, pixel_before = 0;
        if (level < FIRST_LEVEL) continue;
        for (size_t c = 3 * i; c < 3 * i + 3; c++) {
            double w = weights ? weights[c] : 1;
            pixel_last += w * e->last[c];
            pixel_before += w * e->before[c];
        }
        s->last[level] += pixel_last;
        s->before[level] += pixel_before;
        s->last_squares[level] += pixel_last * pixel_last;
        s->before_squares[level] += pixel_before * pixel_before;
    }
    for (int k = 0; k < BRUME_ERROR_LEVELS; k++) {
        last += s->last[k];
        before += s->before[k];
    }
    for (int k = 0; k < BRUME_ERROR_LEVELS; k++)
        find_ratio(e, s, k, s->last[k] + SHARED * last, s->before[k] + SHARED * before);
}

/* The variance that two successive differences tell of: each for itself, and the mean of both. */
static double variance_of(double last, double before, double ratio) {
    return 0.5 * (last + before / ratio) / (ratio - 1);
}

brume_error_result brume_error_estimate_picture(const brume_error_estimate *e, const float *count) {
    brume_error_result r = {0};
    level_sums s;
    size_t pixels = (size_t)e->width * e->height;
    /* A pixel or two whose samples came out NaN are not to stand in the way. */
    size_t behind = 0;
    for (size_t i = 0; i < pixels; i++) behind += e->level[i] < FIRST_LEVEL;
    if (behind > pixels / 100) return r;
    float *weights = brume_error_estimate_weights(e);
    if (!weights) return r;
    sum_levels(e, weights, &s);
    double sum = 0, influences = 0, squares = 0, orders = 0;
    uint32_t grown_n = 0;
    int grown_level = -1;
    double growth = 1;
    for (size_t i = 0; i < pixels; i++) {
        int level = e->level[i];
        double last = 0, before = 0, ratio = s.ratio[level];
        if (level < FIRST_LEVEL) continue;
        for (size_t c = 3 * i; c < 3 * i + 3; c++) {
            last += (double)weights[c] * e->last[c];
            before += (double)weights[c] * e->before[c];
        }
        uint32_t n = count[i] > 1 ? (uint32_t)(count[i] + 0.5f) : 1;
        if (n != grown_n || level != grown_level) {
            growth = brume_error_estimate_growth(n, level, s.order[level]);
            grown_n = n;
            grown_level = level;
        }
        double error = growth * variance_of(last, before, ratio);
        sum += error;
        orders += error * s.order[level];
        /* The derivative of the picture's error by this pixel's differences, times those: by themselves, and through
         * the ratio. */
        double influence = error;
        /* A level may hold nothing but black pixels, which have no differences. */
        if (s.trust[level] > 0 && ratio < 16 && s.last[level] > 0 && s.before[level] > 0) {
            double by_ratio = -0.5 * ratio * (s.last[level] + s.before[level] * (2 * ratio - 1) / (ratio * ratio)) /
                              ((ratio - 1) * (ratio - 1));
            influence += growth * by_ratio * s.trust[level] * (before / s.before[level] - last / s.last[level]);
        }
        influences += influence;
        squares += influence * influence;
    }
    free(weights);
    double n = (double)pixels, variance = squares - influences * influences / n;
    double deviation = sum > 0 && variance > 0 ? sqrt(variance) / sum : 0;
    deviation = fmax(deviation, 1 / sqrt(n)); /* a few pixels know nothing of their own spread */
    r.known = 1;
    r.relmse = sum / (3 * n);
    r.low = r.relmse * exp(-1.96 * deviation);
    r.high = r.relmse * exp(1.96 * deviation);
    r.order = sum > 0 ? orders / sum : MIN_ORDER;
    return r;
}

int brume_error_estimate_variance(const brume_error_estimate *e, const float *count, float *out) {
    size_t pixels = (size_t)e->width * e->height;
    level_sums s;
    float *inside = malloc(pixels * sizeof *inside), *scaled = calloc(3 * pixels, sizeof *scaled);
    int done = inside && scaled;
    if (done) {
        sum_levels(e, NULL, &s);
        for (size_t i = 0; i < pixels; i++) {
            double ratio = s.ratio[e->level[i]];
            uint32_t n = count[i] > 1 ? (uint32_t)(count[i] + 0.5f) : 1;
            double growth = brume_error_estimate_growth(n, e->level[i], s.order[e->level[i]]);
            for (size_t c = 3 * i; c < 3 * i + 3; c++)
                scaled[c] = (float)(growth * variance_of(e->last[c], e->before[c], ratio));
        }
        done = brume_box_sums(scaled, e->width, e->height, out, inside);
    }
    for (size_t i = 0; i < pixels && done; i++)
        for (size_t c = 3 * i; c < 3 * i + 3; c++) out[c] /= inside[i];
    free(inside);
    free(scaled);
    return done;
}

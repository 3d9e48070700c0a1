/* error_estimate.c -- see error_estimate.h. */
#include "error_estimate.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define MIN_ORDER 1.0 /* scrambled points are never much worse than independent ones */
#define MAX_ORDER 4.0 /* smooth integrands: 3, and some room for what the ratio of two estimates does */

/* So many samples make two differences that mean something. */
enum { FIRST_LEVEL = 3 };

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

/* What the pixels at each level have in common. */
typedef struct level_sums {
    double last[BRUME_ERROR_LEVELS], before[BRUME_ERROR_LEVELS]; /* weighted sums of the differences, and of the */
    double last_squares[BRUME_ERROR_LEVELS], before_squares[BRUME_ERROR_LEVELS]; /* squares of each pixel's */
    double ratio[BRUME_ERROR_LEVELS]; /* 2^order, */
    double order[BRUME_ERROR_LEVELS];
    double trust[BRUME_ERROR_LEVELS]; /* and how far it is the pixels' and not what is usual, 0 to 1 */
    double doubt[BRUME_ERROR_LEVELS]; /* what is left of the spread of the logarithm of (ratio - 1) */
} level_sums;

/* Of pictures in fog the order is usually USUAL_ORDER, and the logarithm of 2^order has a spread of SPREAD about that:
 * for 8 scenes with 16 to 256 samples the true error over the last difference gave orders from 1 to 1.9. Where few
 * pixels hold most of the error their ratio says less than that does. */
#define USUAL_ORDER 1.3
#define SPREAD 0.3

static void find_ratio(const brume_error_estimate *e, level_sums *s, int k, double last, double before) {
    double ratio = e->independent ? 2 : exp2(USUAL_ORDER);
    s->trust[k] = s->doubt[k] = 0;
    if (!e->independent && s->last[k] > 0 && s->before[k] > 0) {
        double uncertain = s->last_squares[k] / (s->last[k] * s->last[k]) +
                           s->before_squares[k] / (s->before[k] * s->before[k]);
        s->trust[k] = SPREAD * SPREAD / (SPREAD * SPREAD + uncertain);
        ratio *= pow(before / last / ratio, s->trust[k]);
    }
    s->ratio[k] = fmin(fmax(ratio, exp2(MIN_ORDER)), exp2(MAX_ORDER));
    s->order[k] = log2(s->ratio[k]);
    if (ratio != s->ratio[k]) s->trust[k] = 0; /* nothing follows the pixels any more */
    if (!e->independent) s->doubt[k] = SPREAD * sqrt(1 - s->trust[k]) * s->ratio[k] / (s->ratio[k] - 1);
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

/* The variance that two successive differences tell of. Where the order is known the mean of what each says has less
 * noise than either; where it isn't, an error in it counts twice in what the older one says. */
static double variance_of(const brume_error_estimate *e, double last, double before, double ratio) {
    return e->independent ? 0.5 * (last + before / ratio) / (ratio - 1) : last / (ratio - 1);
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
    r.no_memory = !weights;
    if (!weights) return r;
    sum_levels(e, weights, &s);
    double sum = 0, influences = 0, squares = 0, orders = 0, doubts = 0;
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
        double error = growth * variance_of(e, last, before, ratio);
        sum += error;
        doubts += error * s.doubt[level];
        orders += error * s.order[level];
        /* The derivative of the picture's error by this pixel's differences, times those: by themselves, and through
         * the ratio. */
        double influence = error;
        /* A level may hold nothing but black pixels, which have no differences. */
        if (s.trust[level] > 0) {
            double by_ratio = -ratio * s.last[level] / ((ratio - 1) * (ratio - 1));
            influence += growth * by_ratio * s.trust[level] * (before / s.before[level] - last / s.last[level]);
        }
        influences += influence;
        squares += influence * influence;
    }
    free(weights);
    double n = (double)pixels, variance = squares - influences * influences / n;
    double deviation = sum > 0 && variance > 0 ? sqrt(variance + doubts * doubts) / sum : 0;
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
                scaled[c] = (float)(growth * variance_of(e, e->last[c], e->before[c], ratio));
        }
        done = brume_box_sums(scaled, e->width, e->height, out, inside);
    }
    for (size_t i = 0; i < pixels && done; i++)
        for (size_t c = 3 * i; c < 3 * i + 3; c++) out[c] /= inside[i];
    free(inside);
    free(scaled);
    return done;
}

/* error_estimate.c -- see error_estimate.h. */
#include "error_estimate.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define MIN_ORDER 1.0 /* scrambled points are never much worse than independent ones */
#define MAX_ORDER 4.0 /* smooth integrands: 3, and some room for what the ratio of two estimates does */

/* So many samples make two differences that mean something. */
enum { FIRST_LEVEL = 3, NEWTON_STEPS = 6 };

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
    free(e->weights);
    memset(e, 0, sizeof *e);
}

void brume_error_estimate_update(brume_error_estimate *e, const float *mean, const float *count, int level) {
    size_t pixels = (size_t)e->width * e->height;
    float samples = ldexpf(1, level);
    free(e->weights);
    e->weights = NULL;
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

/* What pixels have in common: those at each level, and behind these all together. */
enum { ALL = BRUME_ERROR_LEVELS, SETS };

typedef struct level_sums {
    double ratio[SETS]; /* 2^order, */
    double order[SETS];
    double trust[SETS]; /* and how far it is the pixels' own and not what is usual, 0 to 1 */
    double doubt[SETS]; /* what is left of the spread of the logarithm of (ratio - 1) */
    double last[SETS];  /* sum of the differences */
    double slope[SETS]; /* of the sum of `excess` by the logarithm of the ratio */
} level_sums;

/* The logarithm of 2^order has a spread of SPREAD about what is usual; pixels at one level differ by LEVEL_SPREAD from
 * the picture's. */
#define SPREAD 0.25
#define LEVEL_SPREAD 0.15

/* By how much a pixel's last difference is larger than the one before says, for such a ratio. Over the root of their
 * sum, or the few pixels that hold most of the error would decide alone: with the right ratio both have the same
 * distribution, so that the sum over pixels is 0 on average whatever even weight they have. */
static double excess(double last, double before, double ratio) {
    double sum = last * ratio + before;
    return sum > 0 ? (last * ratio - before) / sqrt(sum) : 0;
}

/* The derivative of that by the logarithm of the ratio. */
static double excess_slope(double last, double before, double ratio) {
    double sum = last * ratio + before;
    return sum > 0 ? last * ratio / sqrt(sum) * (1 - 0.5 * (last * ratio - before) / sum) : 0;
}

/* A pixel's differences in the picture's weights; without any, as they are. */
static void weigh(const brume_error_estimate *e, const float *weights, size_t pixel, double *last, double *before) {
    *last = *before = 0;
    for (size_t c = 3 * pixel; c < 3 * pixel + 3; c++) {
        double w = weights ? weights[c] : 1;
        *last += w * e->last[c];
        *before += w * e->before[c];
    }
}

/* Draws what the pixels say, which `uncertain` is the variance of, towards what is usual. */
static void settle(level_sums *s, int k, double uncertain, double usual, double spread) {
    s->trust[k] = spread * spread / (spread * spread + uncertain);
    double ratio = usual * pow(s->ratio[k] / usual, s->trust[k]);
    s->ratio[k] = fmin(fmax(ratio, exp2(MIN_ORDER)), exp2(MAX_ORDER));
    s->order[k] = log2(s->ratio[k]);
    if (ratio != s->ratio[k]) s->trust[k] = 0; /* nothing follows the pixels any more */
    s->doubt[k] = spread * sqrt(1 - s->trust[k]) * s->ratio[k] / (s->ratio[k] - 1);
}

static void find_orders(const brume_error_estimate *e, const float *weights, level_sums *s) {
    size_t pixels = (size_t)e->width * e->height;
    double squares[SETS];
    memset(s, 0, sizeof *s);
    for (int k = 0; k < SETS; k++) s->ratio[k] = exp2(e->independent ? 1 : BRUME_USUAL_ORDER);
    for (int step = 0; step <= NEWTON_STEPS && !e->independent; step++) {
        double sums[SETS] = {0};
        memset(squares, 0, sizeof squares);
        memset(s->slope, 0, sizeof s->slope);
        memset(s->last, 0, sizeof s->last);
        for (size_t i = 0; i < pixels; i++) {
            int sets[] = {e->level[i], ALL};
            double last, before;
            if (e->level[i] < FIRST_LEVEL) continue;
            weigh(e, weights, i, &last, &before);
            for (int j = 0; j < 2; j++) {
                int k = sets[j];
                double x = excess(last, before, s->ratio[k]);
                sums[k] += x;
                s->last[k] += last;
                squares[k] += x * x;
                s->slope[k] += excess_slope(last, before, s->ratio[k]);
            }
        }
        for (int k = 0; k < SETS && step < NEWTON_STEPS; k++)
            if (s->slope[k] > 0) s->ratio[k] *= exp(fmin(fmax(-sums[k] / s->slope[k], -1), 1));
    }
    for (int k = ALL; k >= 0; k--) {
        double usual = k == ALL ? exp2(BRUME_USUAL_ORDER) : s->ratio[ALL], spread = k == ALL ? SPREAD : LEVEL_SPREAD;
        s->order[k] = 1;
        if (e->independent) continue;
        if (s->slope[k] > 0) {
            settle(s, k, squares[k] / (s->slope[k] * s->slope[k]), usual, spread);
        } else {
            s->ratio[k] = usual;
            s->order[k] = log2(usual);
        }
        if (k != ALL) s->doubt[k] = hypot(s->doubt[k], s->doubt[ALL]);
    }
}

/* The variance that two successive differences tell of. Where the order is known the mean of what each says has less
 * noise than either; where it isn't, an error in it counts twice in what the older one says. */
static double variance_of(const brume_error_estimate *e, double last, double before, double ratio) {
    return e->independent ? 0.5 * (last + before / ratio) / (ratio - 1) : last / (ratio - 1);
}

brume_error_result brume_error_estimate_picture(brume_error_estimate *e, const float *count) {
    brume_error_result r = {0};
    level_sums s;
    size_t pixels = (size_t)e->width * e->height;
    /* A pixel or two whose samples came out NaN are not to stand in the way. */
    size_t behind = 0;
    for (size_t i = 0; i < pixels; i++) behind += e->level[i] < FIRST_LEVEL;
    if (behind > pixels / 100) return r;
    const float *weights = brume_error_estimate_weights(e);
    r.no_memory = !weights;
    if (!weights) return r;
    find_orders(e, weights, &s);
    double sum = 0, influences = 0, squares = 0, orders = 0, doubts = 0;
    uint32_t grown_n = 0;
    int grown_level = -1;
    double growth = 1;
    for (size_t i = 0; i < pixels; i++) {
        int level = e->level[i];
        double last, before, ratio = s.ratio[level];
        if (level < FIRST_LEVEL) continue;
        weigh(e, weights, i, &last, &before);
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
            influence -= growth * by_ratio * s.trust[level] * excess(last, before, ratio) / s.slope[level];
        }
        influences += influence;
        squares += influence * influence;
    }
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
        find_orders(e, NULL, &s);
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

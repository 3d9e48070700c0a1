/* error_estimate.c -- see error_estimate.h. */
#include "error_orders.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "platform.h"

enum { WORTH_THREADS = 2048 }; /* pixels; fewer are done before a thread has started */

brume_result brume_error_estimate_create(brume_context *context, uint32_t width, uint32_t height, int independent,
                                         brume_error_estimate *out) {
    size_t pixels = (size_t)width * height;
    brume_error_estimate e = {.width = width, .height = height, .independent = independent};
    e.threads = pixels < WORTH_THREADS ? 1 : brume_processors();
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

/* The variance that two successive differences tell of. Where the order is known the mean of what each says has less
 * noise than either; where it isn't, an error in it counts twice in what the older one says. */
static double variance_of(const brume_error_estimate *e, brume_error_pair pair, double ratio) {
    return e->independent ? 0.5 * (pair.last + pair.before / ratio) / (ratio - 1) : pair.last / (ratio - 1);
}

brume_error_result brume_error_estimate_picture(brume_error_estimate *e, const float *count) {
    brume_error_result r = {0};
    brume_error_orders s;
    size_t pixels = (size_t)e->width * e->height;
    /* A pixel or two whose samples came out NaN are not to stand in the way. */
    size_t behind = 0;
    for (size_t i = 0; i < pixels; i++) behind += e->level[i] < BRUME_ERROR_FIRST_LEVEL;
    if (behind > pixels / 100) return r;
    const float *weights = brume_error_estimate_weights(e);
    brume_error_pair *pairs = weights ? brume_error_pairs(e, weights) : NULL;
    r.no_memory = !pairs || !brume_error_find_orders(e, pairs, &s);
    if (r.no_memory) {
        free(pairs);
        return r;
    }
    double sum = 0, influences = 0, squares = 0, orders = 0, doubts = 0;
    uint32_t grown_n = 0;
    int grown_level = -1;
    double growth = 1;
    for (size_t i = 0; i < pixels; i++) {
        int level = e->level[i];
        double ratio = s.ratio[level];
        if (level < BRUME_ERROR_FIRST_LEVEL) continue;
        uint32_t n = count[i] > 1 ? (uint32_t)(count[i] + 0.5f) : 1;
        if (n != grown_n || level != grown_level) {
            growth = brume_error_estimate_growth(n, level, s.order[level]);
            grown_n = n;
            grown_level = level;
        }
        double error = growth * variance_of(e, pairs[i], ratio);
        sum += error;
        doubts += error * s.doubt[level];
        orders += error * s.order[level];
        /* The derivative of the picture's error by this pixel's differences, times those: by themselves, and through
         * the ratio. */
        double influence = error;
        /* A level may hold nothing but black pixels, which have no differences. */
        if (s.trust[level] > 0) {
            double by_ratio = -ratio * s.last[level] / ((ratio - 1) * (ratio - 1));
            influence -= growth * by_ratio * s.trust[level] * brume_error_excess(pairs[i], ratio) / s.slope[level];
        }
        influences += influence;
        squares += influence * influence;
    }
    free(pairs);
    double n = (double)pixels, variance = squares - influences * influences / n;
    double deviation = sum > 0 && variance > 0 ? sqrt(variance + doubts * doubts) / sum : 0;
    deviation = fmax(deviation, 1 / sqrt(n)); /* a few pixels know nothing of their own spread */
    r.known = 1;
    r.relmse = sum / (3 * n);
    r.low = r.relmse * exp(-1.96 * deviation);
    r.high = r.relmse * exp(1.96 * deviation);
    r.order = sum > 0 ? orders / sum : 1;
    return r;
}

int brume_error_estimate_variance(const brume_error_estimate *e, const float *count, float *out) {
    size_t pixels = (size_t)e->width * e->height;
    brume_error_orders s;
    float *inside = malloc(pixels * sizeof *inside), *scaled = calloc(3 * pixels, sizeof *scaled);
    brume_error_pair *pairs = brume_error_pairs(e, NULL);
    int done = inside && scaled && pairs && brume_error_find_orders(e, pairs, &s);
    free(pairs);
    for (size_t i = 0; i < pixels && done; i++) {
        double ratio = s.ratio[e->level[i]];
        uint32_t n = count[i] > 1 ? (uint32_t)(count[i] + 0.5f) : 1;
        double growth = brume_error_estimate_growth(n, e->level[i], s.order[e->level[i]]);
        for (size_t c = 3 * i; c < 3 * i + 3; c++) {
            brume_error_pair pair = {e->last[c], e->before[c]};
            scaled[c] = (float)(growth * variance_of(e, pair, ratio));
        }
    }
    done = done && brume_box_sums(scaled, e->width, e->height, out, inside);
    for (size_t i = 0; i < pixels && done; i++)
        for (size_t c = 3 * i; c < 3 * i + 3; c++) out[c] /= inside[i];
    free(inside);
    free(scaled);
    return done;
}

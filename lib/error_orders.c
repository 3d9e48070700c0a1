/* error_orders.c -- see error_orders.h. The ratio of a set of pixels is where the sum of their excesses is 0: by Newton's
 * method, each step a pass over the picture. */
#include "error_orders.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "parallel.h"

#define MIN_ORDER 1.0 /* scrambled points are never much worse than independent ones */
#define MAX_ORDER 4.0 /* smooth integrands: 3, and some room for what the ratio of two estimates does */

enum {
    NEWTON_STEPS = 6,
    PIECE = 4096,           /* pixels, for one thread at a time; the sums are those of the pieces */
    WORTH_THREADS = 4 * PIECE /* a pass is short, and there are many */
};

/* The logarithm of 2^order has a spread of SPREAD about what is usual; pixels at one level differ by LEVEL_SPREAD from
 * the picture's. */
#define SPREAD 0.25
#define LEVEL_SPREAD 0.15

double brume_error_excess(brume_error_pair pair, double ratio) {
    double sum = pair.last * ratio + pair.before;
    return sum > 0 ? (pair.last * ratio - pair.before) / sqrt(sum) : 0;
}

brume_error_pair *brume_error_pairs(const brume_error_estimate *e, const float *weights) {
    size_t pixels = (size_t)e->width * e->height;
    brume_error_pair *pairs = calloc(pixels, sizeof *pairs);
    for (size_t i = 0; pairs && i < pixels; i++)
        for (size_t c = 3 * i; c < 3 * i + 3; c++) {
            double w = weights ? weights[c] : 1;
            pairs[i].last += w * e->last[c];
            pairs[i].before += w * e->before[c];
        }
    return pairs;
}

/* Sums over pixels. */
typedef struct sums {
    double excess[BRUME_ERROR_SETS], squares[BRUME_ERROR_SETS];
    double slope[BRUME_ERROR_SETS], last[BRUME_ERROR_SETS];
} sums;

typedef struct step {
    const brume_error_estimate *e;
    const brume_error_pair *pairs;
    const double *ratio;
    sums *pieces;
} step;

static void add(sums *s, int set, brume_error_pair pair, double ratio) {
    double with = pair.last * ratio, sum = with + pair.before;
    s->last[set] += pair.last;
    if (!(sum > 0)) return;
    double per_root = 1 / sqrt(sum), excess = (with - pair.before) * per_root;
    s->excess[set] += excess;
    s->squares[set] += excess * excess;
    /* The derivative of the excess by the logarithm of the ratio. */
    s->slope[set] += with * per_root * (1 - 0.5 * (with - pair.before) / sum);
}

static void sum_piece(void *user, uint32_t piece) {
    const step *s = user;
    size_t pixels = (size_t)s->e->width * s->e->height, end = ((size_t)piece + 1) * PIECE;
    sums *out = &s->pieces[piece];
    memset(out, 0, sizeof *out);
    if (end > pixels) end = pixels;
    for (size_t i = (size_t)piece * PIECE; i < end; i++) {
        int level = s->e->level[i];
        if (level < BRUME_ERROR_FIRST_LEVEL) continue;
        add(out, level, s->pairs[i], s->ratio[level]);
        add(out, BRUME_ERROR_ALL, s->pairs[i], s->ratio[BRUME_ERROR_ALL]);
    }
}

/* One pass. */
static void sum_all(step *s, uint32_t count, sums *out) {
    brume_parallel(count * PIECE < WORTH_THREADS ? 1 : s->e->threads, count, sum_piece, s);
    memset(out, 0, sizeof *out);
    for (uint32_t piece = 0; piece < count; piece++)
        for (int k = 0; k < BRUME_ERROR_SETS; k++) {
            out->excess[k] += s->pieces[piece].excess[k];
            out->squares[k] += s->pieces[piece].squares[k];
            out->slope[k] += s->pieces[piece].slope[k];
            out->last[k] += s->pieces[piece].last[k];
        }
}

/* Draws what the pixels say, which `uncertain` is the variance of, towards what is usual. */
static void settle(brume_error_orders *s, int k, double uncertain, double usual, double spread) {
    s->trust[k] = spread * spread / (spread * spread + uncertain);
    double ratio = usual * pow(s->ratio[k] / usual, s->trust[k]);
    s->ratio[k] = fmin(fmax(ratio, exp2(MIN_ORDER)), exp2(MAX_ORDER));
    s->order[k] = log2(s->ratio[k]);
    if (ratio != s->ratio[k]) s->trust[k] = 0; /* nothing follows the pixels any more */
    s->doubt[k] = spread * sqrt(1 - s->trust[k]) * s->ratio[k] / (s->ratio[k] - 1);
}

int brume_error_find_orders(const brume_error_estimate *e, const brume_error_pair *pairs, brume_error_orders *s) {
    uint32_t count = (uint32_t)(((size_t)e->width * e->height + PIECE - 1) / PIECE);
    sums all = {{0}, {0}, {0}, {0}};
    memset(s, 0, sizeof *s);
    for (int k = 0; k < BRUME_ERROR_SETS; k++) {
        s->ratio[k] = exp2(e->independent ? 1 : BRUME_USUAL_ORDER);
        s->order[k] = 1;
    }
    if (e->independent) return 1;
    step pass = {e, pairs, s->ratio, malloc(count * sizeof *pass.pieces)};
    if (!pass.pieces) return 0;
    for (int n = 0; n <= NEWTON_STEPS; n++) {
        sum_all(&pass, count, &all);
        for (int k = 0; k < BRUME_ERROR_SETS && n < NEWTON_STEPS; k++)
            if (all.slope[k] > 0) s->ratio[k] *= exp(fmin(fmax(-all.excess[k] / all.slope[k], -1), 1));
    }
    free(pass.pieces);
    memcpy(s->slope, all.slope, sizeof s->slope);
    memcpy(s->last, all.last, sizeof s->last);
    for (int k = BRUME_ERROR_ALL; k >= 0; k--) {
        int whole = k == BRUME_ERROR_ALL;
        double usual = whole ? exp2(BRUME_USUAL_ORDER) : s->ratio[BRUME_ERROR_ALL];
        if (s->slope[k] > 0) {
            settle(s, k, all.squares[k] / (s->slope[k] * s->slope[k]), usual, whole ? SPREAD : LEVEL_SPREAD);
        } else {
            s->ratio[k] = usual;
            s->order[k] = log2(usual);
        }
        if (!whole) s->doubt[k] = hypot(s->doubt[k], s->doubt[BRUME_ERROR_ALL]);
    }
    return 1;
}

/* bvh_bins.c -- the binned surface area heuristic (Wald 2007): 16 bins an axis.
 *
 * A side costs by the number of 8-wide blocks it would fill, because a block costs the same however many of its lanes
 * are used. Minima, maxima and counts come out the same in whatever order, and items keep theirs: a set may be worked
 * on in pieces.
 */
#include "bvh_bins.h"

#include <float.h>
#include <math.h>
#include <stddef.h>

/* With the item's number for a fourth lane. */
static inline brume_bounds box_of(const brume_bvh_item *item) {
    brume_bounds b = {brume_float4_load(item), brume_float4_load((const char *)item + offsetof(brume_bvh_item, hi))};
    return b;
}

void brume_bvh_bound(const brume_bvh_item *items, uint32_t count, brume_bounds *box, brume_bounds *centers) {
    brume_bounds all = *box, span = *centers;
    for (uint32_t i = 0; i < count; i++) {
        brume_bounds b = box_of(&items[i]);
        brume_float4 c = b.lo + b.hi;
        brume_bounds_join(&all, &b);
        span.lo = brume_float4_min(c, span.lo);
        span.hi = brume_float4_max(c, span.hi);
    }
    *box = all;
    *centers = span;
}

brume_binning brume_bvh_binning(const brume_bounds *centers, uint32_t count) {
    brume_binning b = {brume_float4_all(1), brume_float4_all(0), BVH_BINS}; /* no denormal numbers in the fourth lane */
    if (count < 60) b.bins = BVH_BINS / 2;
    for (int a = 0; a < 3; a++) {
        float low = centers->lo[a], high = centers->hi[a];
        /* Spans too small or too large for the quotient to be a normal number count as equal. */
        float scale = (float)b.bins * 0.999999f / (high - low);
        b.origin[a] = low;
        b.scale[a] = high > low && scale >= FLT_MIN && scale <= FLT_MAX ? scale : 0;
    }
    return b;
}

static inline brume_int4 bin_of(const brume_binning *b, const brume_bounds *box) {
    brume_float4 bin = (box->lo + box->hi - b->origin) * b->scale;
    return __builtin_convertvector(brume_float4_min(bin, brume_float4_all((float)(b->bins - 1))), brume_int4);
}

void brume_bins_clear(brume_bins *bins, const brume_binning *b) {
    bins->bins = b->bins;
    for (int k = 0; k < bins->bins; k++) {
        for (int a = 0; a < 3; a++) bins->box[k][a] = brume_bounds_empty();
        bins->count[k] = (brume_int4){0, 0, 0, 0};
    }
}

void brume_bins_add(brume_bins *bins, const brume_binning *b, const brume_bvh_item *items, uint32_t count) {
    const brume_binning own = *b;
    for (uint32_t i = 0; i < count; i++) {
        brume_bounds box = box_of(&items[i]);
        brume_int4 bin = bin_of(&own, &box);
        int x = bin[0], y = bin[1], z = bin[2];
        brume_bounds_join(&bins->box[x][0], &box);
        brume_bounds_join(&bins->box[y][1], &box);
        brume_bounds_join(&bins->box[z][2], &box);
        bins->count[x][0]++;
        bins->count[y][1]++;
        bins->count[z][2]++;
    }
}

void brume_bins_join(brume_bins *to, const brume_bins *bins) {
    for (int k = 0; k < bins->bins; k++) {
        for (int a = 0; a < 3; a++) brume_bounds_join(&to->box[k][a], &bins->box[k][a]);
        to->count[k] += bins->count[k];
    }
}

/* The fourth lane is 0: it may hold denormal numbers, with which multiplying is slow. */
static inline brume_float4 extent_of(const brume_bounds *b) {
    return (brume_float4)((brume_int4)(b->hi - b->lo) & (brume_int4){-1, -1, -1, 0});
}

/* What sides cost, for the three axes at once: half the surface area times the blocks. Areas are scaled before: 1e20
 * squared is not a float. Not a number where there are no items. */
static inline brume_float4 costs(const brume_bounds box[3], brume_int4 count, brume_float4 unit) {
    brume_float4 x, y, z;
    brume_float4_transpose(extent_of(&box[0]) * unit, extent_of(&box[1]) * unit, extent_of(&box[2]) * unit, &x, &y, &z);
    return (x * y + y * z + z * x) * __builtin_convertvector((count + 7) >> 3, brume_float4);
}

static void add_bin(brume_bounds to[3], const brume_bounds bin[3]) {
    for (int a = 0; a < 3; a++) brume_bounds_join(&to[a], &bin[a]);
}

static brume_bounds join_bins(const brume_bins *bins, int axis, int from, int to) {
    brume_bounds box = brume_bounds_empty();
    for (int k = from; k < to; k++) brume_bounds_join(&box, &bins->box[k][axis]);
    return box;
}

int brume_bins_split(const brume_bins *bins, brume_split *out) {
    const brume_bounds none[3] = {brume_bounds_empty(), brume_bounds_empty(), brume_bounds_empty()};
    brume_bounds all = join_bins(bins, 0, 0, bins->bins), box[3];
    brume_float4 size = extent_of(&all), right_cost[BVH_BINS], best = brume_float4_all(INFINITY);
    brume_int4 best_bin = {0, 0, 0, 0}, n = {0, 0, 0, 0};
    float extent = size[0] > size[1] ? size[0] : size[1];
    extent = size[2] > extent ? size[2] : extent;
    brume_float4 unit = brume_float4_all(extent >= 1e-30f && extent <= 1e30f ? 1 / extent : 1);
    memcpy(box, none, sizeof box);
    for (int k = bins->bins - 1; k > 0; k--) {
        add_bin(box, bins->box[k]);
        n += bins->count[k];
        right_cost[k] = costs(box, n, unit);
    }
    memcpy(box, none, sizeof box);
    n = (brume_int4){0, 0, 0, 0};
    for (int k = 0; k < bins->bins - 1; k++) {
        add_bin(box, bins->box[k]);
        n += bins->count[k];
        brume_float4 cost = costs(box, n, unit) + right_cost[k + 1];
        brume_int4 better = cost < best;
        best = brume_float4_select(better, cost, best);
        best_bin = (best_bin & ~better) | (better & k);
    }
    out->axis = 0;
    for (int a = 1; a < 3; a++) out->axis = best[a] < best[out->axis] ? a : out->axis;
    if (!(best[out->axis] < INFINITY)) return 0;
    out->bin = best_bin[out->axis];
    out->left = brume_bins_left(bins, out);
    out->box[0] = join_bins(bins, out->axis, 0, out->bin + 1);
    out->box[1] = join_bins(bins, out->axis, out->bin + 1, bins->bins);
    return 1;
}

uint32_t brume_bins_left(const brume_bins *bins, const brume_split *split) {
    brume_int4 left = {0, 0, 0, 0};
    for (int k = 0; k <= split->bin; k++) left += bins->count[k];
    return (uint32_t)left[split->axis];
}

/* Without branches: which side it will be nobody can foresee. */
void brume_bvh_partition(const brume_bvh_item *items, uint32_t count, const brume_binning *b, const brume_split *split,
                         brume_bvh_item *left, brume_bvh_item *right, brume_bounds centers[2]) {
    brume_bounds span[2] = {centers[0], centers[1]};
    const brume_binning own = *b;
    for (uint32_t i = 0; i < count; i++) {
        brume_bounds box = box_of(&items[i]);
        brume_float4 c = box.lo + box.hi;
        brume_int4 bin = bin_of(&own, &box);
        int goes_left = bin[split->axis] <= split->bin;
        brume_int4 mask = (brume_int4){-goes_left, -goes_left, -goes_left, -goes_left};
        brume_bvh_item *to = goes_left ? left : right;
        memcpy(to, &box, sizeof *to);
        left += goes_left;
        right += !goes_left;
        span[0].lo = brume_float4_min(brume_float4_select(mask, c, span[0].lo), span[0].lo);
        span[0].hi = brume_float4_max(brume_float4_select(mask, c, span[0].hi), span[0].hi);
        span[1].lo = brume_float4_min(brume_float4_select(mask, span[1].lo, c), span[1].lo);
        span[1].hi = brume_float4_max(brume_float4_select(mask, span[1].hi, c), span[1].hi);
    }
    centers[0] = span[0];
    centers[1] = span[1];
}

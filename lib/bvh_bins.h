/* bvh_bins.h -- where to part a set of items: by bins over the centres of their boxes. */
#ifndef BRUME_BVH_BINS_H
#define BRUME_BVH_BINS_H

#include "bvh_tree.h"

enum { BVH_BINS = 16 };

/* Joins the items' boxes, and the span of the doubled centres of these. */
void brume_bvh_bound(const brume_bvh_item *items, uint32_t count, brume_bounds *box, brume_bounds *centers);

/* bin = (doubled centre - origin) * scale; scale 0: all centres are equal along this axis. */
typedef struct brume_binning {
    brume_float4 origin, scale;
    int bins;
} brume_binning;

/* Fewer bins for few items. */
brume_binning brume_bvh_binning(const brume_bounds *centers, uint32_t count);

typedef struct brume_bins {
    brume_bounds box[BVH_BINS][3];
    brume_int4 count[BVH_BINS];
    int bins;
} brume_bins;

void brume_bins_clear(brume_bins *bins, const brume_binning *b);
void brume_bins_add(brume_bins *bins, const brume_binning *b, const brume_bvh_item *items, uint32_t count);
void brume_bins_join(brume_bins *to, const brume_bins *bins);

typedef struct brume_split {
    int axis, bin; /* the last bin of the left side */
    uint32_t left;
    brume_bounds box[2];
} brume_split;

/* The cheapest by the surface area heuristic; 0 if no axis splits. */
int brume_bins_split(const brume_bins *bins, brume_split *out);
uint32_t brume_bins_left(const brume_bins *bins, const brume_split *split);

/* Copies the items to one side or the other, in their order, and joins the span of each side's centres. */
void brume_bvh_partition(const brume_bvh_item *items, uint32_t count, const brume_binning *b, const brume_split *split,
                         brume_bvh_item *left, brume_bvh_item *right, brume_bounds centers[2]);

#endif

/* cdf.h -- choosing from a cumulative table. */
#ifndef BRUME_CDF_H
#define BRUME_CDF_H

#include "lane.h"

/* The cell of a cumulative table of n + 1 entries from cdf[first] on that holds u. */
FN ireal cdf_find(__global const float *cdf, ireal first, int n, real u) {
    ireal low = I(0);
    int step = 1;
    while (step < n) step <<= 1;
    for (; step > 0; step >>= 1) {
        ireal at = low + I(step);
        mask inside = at < I(n);
        mask right = gather(cdf, first + (inside ? at : I(0))) <= u;
        low = inside & right ? at : low;
    }
    return low;
}

#endif

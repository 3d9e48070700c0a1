/* error_orders.h -- how fast the error of pixels falls as their samples double: by level, and all together. Private to
 * lib/error*.c; error_estimate.h says what it is for. */
#ifndef BRUME_ERROR_ORDERS_H
#define BRUME_ERROR_ORDERS_H

#include "error_estimate.h"

/* So many samples, 2^level, make two differences that mean something. */
enum { BRUME_ERROR_FIRST_LEVEL = 3 };

/* What pixels have in common: those at each level, and behind these all together. */
enum { BRUME_ERROR_ALL = BRUME_ERROR_LEVELS, BRUME_ERROR_SETS };

typedef struct brume_error_orders {
    double ratio[BRUME_ERROR_SETS]; /* 2^order, */
    double order[BRUME_ERROR_SETS];
    double trust[BRUME_ERROR_SETS]; /* and how far it is the pixels' own and not what is usual, 0 to 1 */
    double doubt[BRUME_ERROR_SETS]; /* what is left of the spread of the logarithm of (ratio - 1) */
    double last[BRUME_ERROR_SETS];  /* sum of the differences */
    double slope[BRUME_ERROR_SETS]; /* of the sum of the `excess` by the logarithm of the ratio */
} brume_error_orders;

/* A pixel's differences. */
typedef struct brume_error_pair { double last, before; } brume_error_pair;

/* Per pixel, in the picture's weights; without any (NULL), as they are. malloc'ed; NULL without memory. */
brume_error_pair *brume_error_pairs(const brume_error_estimate *e, const float *weights);

/* In several threads where pixels are many; the same to the bit with any number of them. 0 without memory. */
int brume_error_find_orders(const brume_error_estimate *e, const brume_error_pair *pairs, brume_error_orders *out);

/* By how much a pixel's last difference is larger than the one before says, for such a ratio. Over the root of their
 * sum, or the few pixels that hold most of the error would decide alone: with the right ratio both have the same
 * distribution, so that the sum over pixels is 0 on average whatever even weight they have. */
double brume_error_excess(brume_error_pair pair, double ratio);

#endif

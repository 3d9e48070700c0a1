/* estimators.h -- the names of estimators as they stand on command lines. */
#ifndef ESTIMATORS_H
#define ESTIMATORS_H

#include "brume.h"

/* STRATEGY or STRATEGY:POSITIONS, as in "raster:16", in the first `length` characters. 0 if it is neither; *positions
 * becomes 0 if none are given. */
int estimators_strategy(const char *text, size_t length, brume_strategy *strategy, uint32_t *positions);
int estimators_indirect(const char *text, size_t length, brume_indirect *indirect);

#endif

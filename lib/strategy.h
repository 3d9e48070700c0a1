/* strategy.h -- the names of estimators, and what is a valid choice of them. */
#ifndef BRUME_STRATEGY_H
#define BRUME_STRATEGY_H

#include "brume.h"

/* 1 and the value, or 0. */
int brume_strategy_find(const char *name, brume_strategy *out);
int brume_indirect_find(const char *name, brume_indirect *out);

/* 0 or a power of two up to 64. */
int brume_positions_valid(uint32_t positions);

#endif

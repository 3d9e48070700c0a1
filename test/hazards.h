/* hazards.h -- formulas that lose their digits where another one keeps them: both on the device, over the same numbers.
 *
 * Each hazard is shown twice: the formula of cl/ stays within a tolerance, and the textbook's, kept in the test as its
 * planted bug, exceeds it. A test whose numbers were not hard enough to tell them apart would fail.
 */
#ifndef HAZARDS_H
#define HAZARDS_H

#include <stdint.h>

#include "brume.h"

enum { HAZARD_INPUTS = 8 };

typedef struct hazard {
    const char *name, *reference, *unit;
    const char *headers;      /* #include lines */
    const char *ours, *naive; /* OpenCL: each sets `real y` from `real a, b, c, d, e, f, g, h` */
    void (*make)(uint64_t *seed, uint32_t i, double in[HAZARD_INPUTS]); /* they become floats before anyone sees them */
    double (*error)(const double in[HAZARD_INPUTS], double y);          /* in `unit` */
    double tolerance;
} hazard;

/* Runs it, reports the row "hazard", with what the naive formula is off by, and fails the test if ours exceeds the
 * tolerance or the naive one doesn't. Skips without a device. */
void hazard_check(const hazard *it);

#endif

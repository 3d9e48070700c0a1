/* clock.h -- time that never runs backwards. */
#ifndef BRUME_CLOCK_H
#define BRUME_CLOCK_H

#include <time.h>

static inline double brume_seconds(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

#endif

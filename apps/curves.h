/* curves.h -- what can be read from points of time and error: lines between them in logarithms, as errors of sampling
 * are powers of time. Pure functions. */
#ifndef CURVES_H
#define CURVES_H

#include <stddef.h>

/* The error at a time between the first point and the last; NaN outside. `times` ascend. */
double curves_error_at(const double *times, const double *errors, size_t count, double time);

typedef enum curves_kind {
    CURVES_BETWEEN = 0, /* crossed between two points */
    CURVES_AT_MOST = 1, /* the first point is below the target already: it took no longer than that */
    CURVES_BEYOND = 2,  /* not reached; goes on from the last point as the slope says */
    CURVES_NEVER = 3    /* not reached, and no time would do */
} curves_kind;

/* How long until the error is first at or below the target. Beyond the last point the noise goes on falling by `slope`
 * (below 0; NaN: unknown, never) from what is above `bias`, the part of the error that stays. Infinite if never. */
double curves_time_to(const double *times, const double *errors, size_t count, double target, double slope,
                      double bias, curves_kind *kind);

/* By what factor the time grows when the last error is to be halved: the noise alone can give way. Infinite if the bias
 * is more than half, or the slope isn't below 0. */
double curves_halving(double error, double bias, double slope);

/* front[i] becomes 1 where no other point is better in time or error and as good in the other, else 0. Points that
 * aren't positive numbers are not on the front. */
void curves_front(const double *times, const double *errors, size_t count, int *front);

/* Whether a render that has taken `seconds` for a power of two samples goes on to twice as many: if it is to be
 * expected to end within the limit, and they are no more than `most`. */
int curves_goes_on(double seconds, double limit, unsigned samples, unsigned most);

#endif

/* curves.c -- see curves.h. */
#include "curves.h"

#include <math.h>

/* y where x lies between two points; level if there is nothing to take logarithms of. */
static double between(double x0, double y0, double x1, double y1, double x)
{
    if (!(x0 > 0) || !(x1 > x0) || !(y0 > 0) || !(y1 > 0))
        return y1;
    return y0 * pow(y1 / y0, log(x / x0) / log(x1 / x0));
}

double curves_error_at(const double *times, const double *errors, size_t count, double time)
{
    if (count == 0 || !(time >= times[0]) || !(time <= times[count - 1]))
        return NAN;
    for (size_t i = 1; i < count; i++)
        if (time <= times[i])
            return between(times[i - 1], errors[i - 1], times[i], errors[i], time);
    return errors[0];
}

double curves_time_to(const double *times, const double *errors, size_t count, double target, double slope,
                      double bias, curves_kind *kind)
{
    *kind = CURVES_NEVER;
    if (count == 0)
        return INFINITY;
    for (size_t i = 0; i < count; i++) {
        if (errors[i] > target)
            continue;
        *kind = i == 0 ? CURVES_AT_MOST : CURVES_BETWEEN;
        return i == 0 ? times[0] : between(errors[i], times[i], errors[i - 1], times[i - 1], fmax(target, 1e-300));
    }
    double last = errors[count - 1];
    if (!(slope < 0) || !(target > bias) || !(last > bias))
        return INFINITY;
    *kind = CURVES_BEYOND;
    return times[count - 1] * pow((target - bias) / (last - bias), 1 / slope);
}

double curves_halving(double error, double bias, double slope)
{
    double noise = error - bias, wanted = 0.5 * error - bias;
    return slope < 0 && wanted > 0 && noise > 0 ? pow(wanted / noise, 1 / slope) : INFINITY;
}

void curves_front(const double *times, const double *errors, size_t count, int *front)
{
    for (size_t i = 0; i < count; i++) {
        front[i] = times[i] > 0 && errors[i] > 0 && isfinite(times[i]) && isfinite(errors[i]);
        for (size_t j = 0; j < count && front[i]; j++)
            if (times[j] > 0 && errors[j] > 0 && times[j] <= times[i] && errors[j] <= errors[i] &&
                (times[j] < times[i] || errors[j] < errors[i]))
                front[i] = 0;
    }
}

int curves_goes_on(double seconds, double limit, unsigned samples, unsigned most)
{
    return samples <= most / 2 && 2 * seconds <= limit;
}

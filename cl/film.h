/* film.h -- adding samples to the film's planes.
 *
 * Sums of radiance are pairs of floats, sum + rest, of which each addition keeps the exact sum but for one rounding of
 * the rest: n samples are off by at most n 2^-47 of the sum of their absolute values, 7e-8 for ten millions. (Plain sums
 * stop at 2^24. A compensation that is only added up, as Neumaier's, grows until it rounds like a plain sum itself: half
 * a percent off after ten million equal samples.) Each pixel's samples are added in the order of their index, whatever
 * the launches, so the film of a seed is the same bits however the work is cut.
 */
#ifndef BRUME_FILM_CL_H
#define BRUME_FILM_CL_H

#include "math.h"
#include "vec.h"

/* The planes of `slots` pixels each; this work-item's lanes own the LANES slots from `first` on. */
typedef struct {
    __global float *planes;
    size_t slots, first;
} film;

FN __global float *film_plane(const film *f, int plane) { return f->planes + (size_t)plane * f->slots + f->first; }

FN void film_add_plain(const film *f, int plane, real x, mask m) {
    __global float *p = film_plane(f, plane);
    real old = load_lanes(p);
    store_lanes(m ? old + x : old, p);
}

/* To three planes. */
FN void film_add_rgb(const film *f, int plane, rgb x, mask m) {
    film_add_plain(f, plane, x.r, m);
    film_add_plain(f, plane + 1, x.g, m);
    film_add_plain(f, plane + 2, x.b, m);
}

/* As the film will hold it: what a double loses on the way goes to the compensation, too. */
FN real film_precision(real x) {
#ifdef BRUME_DOUBLE
    return to_real(LANE_PASTE(convert_, LANE_TYPE(float))(x));
#else
    return x;
#endif
}

FN void film_add(const film *f, int sum_plane, int rest_plane, real x, mask m) {
    __global float *sum_at = film_plane(f, sum_plane), *rest_at = film_plane(f, rest_plane);
    real sum = load_lanes(sum_at), rest = load_lanes(rest_at);
    real next = film_precision(sum + x);
    real lost = fabs(sum) >= fabs(x) ? (sum - next) + x : (x - next) + sum; /* exact (Dekker 1971) */
    real low = rest + lost;
    real high = film_precision(next + low);
    store_lanes(m ? high : sum, sum_at);
    store_lanes(m ? low - (high - next) : rest, rest_at);
}

#endif

/* film.h -- adding samples to the film's planes.
 *
 * Sums of radiance are pairs of floats, sum + rest, of which each addition keeps the exact sum but for one rounding of
 * the rest: n samples are off by at most n 2^-47 of the sum of their absolute values, 7e-8 for ten millions. (Plain
 * sums stop at 2^24. A compensation that is only added up, as Neumaier's, grows until it rounds like a plain sum
 * itself: half a percent off after ten million equal samples.) Each pixel's samples are added in the order of their
 * index, whatever the launches, so the film of a seed is the same bits however the work is cut.
 */
#ifndef BRUME_FILM_CL_H
#define BRUME_FILM_CL_H

#include "features.h"
#include "math.h"
#include "vec.h"

#define FILM_HELD (HAS(LIGHT_LAYERS) ? FILM_LAYER_PLANES : HAS(GUIDES) ? FILM_GUIDE_PLANES : FILM_PLANES)

/* The planes of `slots` pixels each, and what this work-item's lanes hold of them: LANES pixels next to each other, or
 * wherever a schedule has found them. */
typedef struct {
    __global float *planes;
    size_t slots;
    ireal slot; /* of each lane's pixel; below 0: none */
    real values[FILM_HELD];
} film;

FN void film_load(film *f) {
    lanes_of_ireal at;
    at.all = f->slot;
    for (int plane = 0; plane < FILM_HELD; plane++) {
        lanes_of_real held;
        EACH_LANE(k) held.one[k] = at.one[k] < 0 ? 0 : f->planes[plane * f->slots + (size_t)at.one[k]];
        f->values[plane] = held.all;
    }
}

FN void film_store(const film *f) {
    lanes_of_ireal at;
    at.all = f->slot;
    for (int plane = 0; plane < FILM_HELD; plane++) {
        lanes_of_real held;
        held.all = f->values[plane];
        EACH_LANE(k) {
            if (at.one[k] >= 0) f->planes[plane * f->slots + (size_t)at.one[k]] = (float)held.one[k];
        }
    }
}

/* As the film will hold it: what a double loses on the way goes to the compensation, too. */
FN real film_precision(real x) {
#ifdef BRUME_DOUBLE
    return to_real(LANE_PASTE(convert_, LANE_TYPE(float))(x));
#else
    return x;
#endif
}

/* A sum of n samples is off by at most n 2^-24 of that of their absolute values. */
FN void film_add_plain(film *f, int plane, real x, mask m) {
    f->values[plane] = m ? film_precision(f->values[plane] + x) : f->values[plane];
}

/* To three planes. */
FN void film_add_rgb(film *f, int plane, rgb x, mask m) {
    film_add_plain(f, plane, x.r, m);
    film_add_plain(f, plane + 1, x.g, m);
    film_add_plain(f, plane + 2, x.b, m);
}

FN void film_add(film *f, int sum_plane, int rest_plane, real x, mask m) {
    real sum = f->values[sum_plane], rest = f->values[rest_plane];
    real next = film_precision(sum + x);
    real lost = fabs(sum) >= fabs(x) ? (sum - next) + x : (x - next) + sum; /* exact (Dekker 1971) */
    real low = rest + lost;
    real high = film_precision(next + low);
    f->values[sum_plane] = m ? high : sum;
    f->values[rest_plane] = m ? film_precision(low - (high - next)) : rest;
}

#endif

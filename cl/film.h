/* film.h -- adding samples to the film's planes.
 *
 * Sums of radiance are pairs of floats, sum + rest, of which each addition keeps the exact sum but for one rounding of
 * the rest: n samples are off by at most n 2^-47 of the sum of their absolute values, 7e-8 for ten millions. (Plain
 * sums stop at 2^24. A compensation that is only added up, as Neumaier's, grows until it rounds like a plain sum
 * itself: half a percent off after ten million equal samples.) Other sums take one plane each: counts, which are exact
 * up to 2^24, and squares, guides and layers, rounded up or down at random (Forsythe 1959), so that the errors of n
 * samples grow with the root of n, not with n. Each pixel's samples are added in the order of their
 * index, whatever the launches, so the film of a seed is the same bits however the work is cut.
 */
#ifndef BRUME_FILM_CL_H
#define BRUME_FILM_CL_H

#include "features.h"
#include "math.h"
#include "random.h"
#include "vec.h"

/* Of the bits of a real. */
#ifdef BRUME_DOUBLE
#define FILM_EXPONENT I(0x7ff0000000000000L)
#else
#define FILM_EXPONENT I(0x7f800000)
#endif

#define FILM_HELD (HAS(LIGHT_LAYERS) ? FILM_LAYER_PLANES : HAS(GUIDES) ? FILM_GUIDE_PLANES : FILM_PLANES)

/* The planes of `slots` pixels each, and what this work-item's lanes hold of them: LANES pixels next to each other, or
 * wherever a schedule has found them. */
typedef struct {
    __global float *planes;
    size_t slots;
    ireal slot; /* of each lane's pixel; below 0: none */
    real values[FILM_HELD];
    real dither; /* in (-1/2, 1/2), of each lane's sample */
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

/* Counts: a sum of n samples is off by at most n 2^-24 of that of their absolute values. */
FN void film_add_plain(film *f, int plane, real x, mask m) {
    f->values[plane] = m ? film_precision(f->values[plane] + x) : f->values[plane];
}

/* What a + b = sum lost in rounding, exactly (Dekker 1971). */
FN real film_lost(real a, real b, real sum) { return fabs(a) >= fabs(b) ? (a - sum) + b : (b - sum) + a; }

/* Random bits of the samples that are added next. One dither serves all planes: what is grey stays grey. */
FN void film_dither(film *f, ureal32 bits) { f->dither = unit(bits) - R(0.5 - 0x1p-25); }

/* A sum of n samples has the right mean, and a standard error of at most sqrt(n) 2^-24 of the sum of their absolute
 * values: 2e-4 for ten millions. The dither is that of the sum's last place before, half of what it should be where
 * the exponent grows, which is seldom; infinite sums stay infinite. */
FN void film_add_dithered(film *f, int plane, real x, mask m) {
    real sum = f->values[plane], place = lmin(as_real(as_ireal(sum) & FILM_EXPONENT), R(0x1p126)) * R(0x1p-23);
    f->values[plane] = m ? film_precision(sum + fma(f->dither, place, x)) : sum;
}

/* To three planes. */
FN void film_add_rgb(film *f, int plane, rgb x, mask m) {
    film_add_dithered(f, plane, x.r, m);
    film_add_dithered(f, plane + 1, x.g, m);
    film_add_dithered(f, plane + 2, x.b, m);
}

FN void film_add(film *f, int sum_plane, int rest_plane, real x, mask m) {
    real sum = f->values[sum_plane], rest = f->values[rest_plane];
    real next = film_precision(sum + x);
    real low = rest + film_lost(sum, x, next);
    real high = film_precision(next + low);
    f->values[sum_plane] = m ? high : sum;
    f->values[rest_plane] = m ? film_precision(low - (high - next)) : rest;
}

#endif

/* reservoir.h -- choosing one of many lights in a single pass over them (Chao 1982), with one random number.
 *
 * Mostly in proportion to a weight, now and then evenly among all with a positive weight: against a weight that
 * misjudges one of them, which would make rare, large samples.
 */
#ifndef BRUME_RESERVOIR_H
#define BRUME_RESERVOIR_H

#include "vec.h"

#define RESERVOIR_EVEN_SHARE R(0.1)

typedef struct {
    real u;         /* what is left of the random number */
    mask even;      /* this lane chooses evenly */
    real total, count, kept; /* sum of weights, number of them, weight of the choice */
    ireal choice;   /* -1 while there is none */
} reservoir;

/* True with probability p by u in [0, 1), which is replaced by a number again uniform in [0, 1). */
FN mask split(real *u, real p) {
    mask below = *u < p;
    real left = below ? *u / lmax(p, R(1e-30)) : (*u - p) / lmax(R(1) - p, R(1e-30));
    *u = lclamp(left, R(0), R(0.99999994));
    return below;
}

FN reservoir reservoir_start(real u) {
    reservoir r;
    r.u = u;
    r.even = split(&r.u, RESERVOIR_EVEN_SHARE);
    r.total = r.count = r.kept = R(0);
    r.choice = I(-1);
    return r;
}

FN void reservoir_offer(reservoir *r, ireal candidate, real weight, mask live) {
    mask some = live & (weight > R(0));
    r->total = some ? r->total + weight : r->total;
    r->count = some ? r->count + R(1) : r->count;
    real u = r->u;
    mask take = split(&u, r->even ? R(1) / lmax(r->count, R(1)) : weight / lmax(r->total, R(1e-37))) & some;
    r->u = some ? u : r->u;
    r->choice = take ? candidate : r->choice;
    r->kept = take ? weight : r->kept;
}

/* Probability with which the choice was made. */
FN real reservoir_share(const reservoir *r) {
    return RESERVOIR_EVEN_SHARE / lmax(r->count, R(1)) +
           (R(1) - RESERVOIR_EVEN_SHARE) * r->kept / lmax(r->total, R(1e-37));
}

#endif

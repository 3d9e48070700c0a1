/* random.h -- random numbers as a pure function of (seed, pixel, sample, set, dimension).
 *
 * Who computes a sample, when, and at which width never matters. Numbers come in sets of four dimensions that are well
 * distributed together; different sets are as good as independent (padding: Kollig & Keller 2002). SAMPLER_SOBOL takes
 * each set from the Owen-scrambled Sobol' sequence with its own shuffled order (Burley 2020); SAMPLER_INDEPENDENT
 * hashes. Beyond 2^16 samples of a pixel, each block of 2^16 is a fresh, independent scrambling.
 *
 * Names are what keeps dimensions apart: whoever needs a number takes one that nobody else has.
 */
#ifndef BRUME_RANDOM_H
#define BRUME_RANDOM_H

#include "lane.h"
#include "shared.h"
#include "sobol.h"

/* Once a path. */
#define SET_PIXEL U32(0) /* x, y: position in the pixel; z: distance, w: free flight on the first segment */
#define SET_LENS U32(1)  /* x, y: position on the lens */
#define SET_LIGHT_RAY U32(2) /* x: which lamp; y, z: direction of the ray of light */

/* Once a segment: random_bounce_set(segment, one of these). */
enum {
    SET_MEDIUM,  /* x: which lamp; y: technique, colour channel; z: distance to gather light at; w: free flight */
    SET_SURFACE, /* x: lobe; y, z: direction (also of the phase function); w: roulette */
    SET_LIGHT,   /* x: which emitter; y, z: position on it; w: which lamp */
    SET_INDIRECT, /* x: point on the ray of light; y, z: of the segment, towards it and towards its end; w: which */
    SET_EMITTER,  /* x: which emitter; y, z: position on it, for light gathered along the segment */
    SETS_PER_BOUNCE,
    SET_BOUNCE = 1 << 16 /* x: point on the ray of light; y: that or its end. Beyond all others of any segment */
};

#define FIRST_BOUNCE_SET 3

/* A path's place among the random numbers. */
typedef struct {
    ureal32 key;     /* of seed, block of samples and pixel */
    ureal32 index;   /* Sobol': the sample's number in its block, 16 bits reversed; independent: the sample's number */
    int sampler;     /* of b_params */
} rng;

/* Four times 32 random bits. */
typedef struct { ureal32 x, y, z, w; } random4;

/* A bijection that mixes every bit into every other (multiply-xorshift; constants: Wellons 2018). */
FN ureal32 hash32(ureal32 x) {
    x = x ^ (x >> U32(16));
    x = x * U32(0x21f0aaadu);
    x = x ^ (x >> U32(15));
    x = x * U32(0xd35a2d97u);
    return x ^ (x >> U32(15));
}

/* x, y < 65536. For one seed and block, different pixels have different keys: every step is a bijection. */
FN rng random_start(__global const b_params *p, ureal32 x, ureal32 y, ureal32 sample) {
    rng r;
    r.sampler = p->sampler;
    ureal32 seed = hash32(U32(p->seed) + U32(0x9e3779b9u));
    if (r.sampler == SAMPLER_SOBOL) {
        seed = hash32(seed + (sample >> U32(16)));
        r.index = reverse_bits(sample) >> U32(16);
    } else {
        r.index = sample;
    }
    r.key = hash32(hash32((x | (y << U32(16))) ^ seed) + hash32(~seed));
    return r;
}

FN ureal32 random_bounce_set(ireal segment, uint set) {
    return to_ureal32(segment) * U32(SETS_PER_BOUNCE) + U32(FIRST_BOUNCE_SET + set);
}

/* For whoever needs none. */
FN random4 random_none(void) {
    random4 u;
    u.x = u.y = u.z = u.w = U32(0);
    return u;
}

CALL random4 random_set(const rng *r, ureal32 set) {
    random4 u;
    ureal32 h = hash32(r->key ^ (set * U32(0x9e3779b9u)));
    if (r->sampler == SAMPLER_SOBOL) {
        /* a shuffle that keeps the first 2^k points together in a block of 2^k: each prefix stays a net */
        ureal32 index = reverse_bits(owen_scramble_reversed(r->index, h) << U32(16));
        sobol_reversed(index, &u.x, &u.y, &u.z, &u.w);
        u.x = reverse_bits(owen_scramble_reversed(u.x, hash32(h + U32(1))));
        u.y = reverse_bits(owen_scramble_reversed(u.y, hash32(h + U32(2))));
        u.z = reverse_bits(owen_scramble_reversed(u.z, hash32(h + U32(3))));
        u.w = reverse_bits(owen_scramble_reversed(u.w, hash32(h + U32(4))));
    } else {
        h = hash32(h + r->index);
        u.x = hash32(h ^ U32(0x68bc21ebu));
        u.y = hash32(h ^ U32(0x02e5be93u));
        u.z = hash32(h ^ U32(0x967a889bu));
        u.w = hash32(h ^ U32(0x368cc8b7u));
    }
    return u;
}

/* The sample's own bits for the film, of no set. */
FN ureal32 random_of_film(const rng *r) { return hash32(r->key + hash32(r->index ^ U32(0x7feb352du))); }

FN rng random_select(mask m, rng a, rng b) {
    rng r;
    r.key = select32(m, a.key, b.key);
    r.index = select32(m, a.index, b.index);
    r.sampler = a.sampler;
    return r;
}

/* In [0, 1), evenly spaced: 24 bits in float, 32 in double. */
FN real unit(ureal32 bits) {
#ifdef BRUME_DOUBLE
    return to_real(bits) * R(2.3283064365386963e-10);
#else
    return to_real(as_ireal(bits >> U32(8))) * R(5.9604644775390625e-8); /* signed: cheaper before AVX-512 */
#endif
}

/* In (0, 1], within one ulp of (n + 1) 2^-32, with all 32 bits near 0, so that -log of it reaches 22: 24 bits would cut
 * a free flight at 16.6 mean free paths. */
FN real unit_positive(ureal32 bits) { return fma(to_real(bits), R(2.3283064365386963e-10), R(2.3283064365386963e-10)); }

#endif

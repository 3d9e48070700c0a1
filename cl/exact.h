/* exact.h -- sums of products in twice the working precision (Ogita, Rump & Oishi 2005), for the few places where float
 * would lose what counts: which side of a large surface a nearby point lies on.
 */
#ifndef BRUME_EXACT_H
#define BRUME_EXACT_H

#include "vec.h"

/* The unevaluated sum high + low, |low| of the order of high's rounding error. */
#define EXACT(type, pair, prefix)                                                                                     \
    typedef struct { type high, low; } pair;                                                                          \
    FN pair prefix##sum(type a, type b) {                                                                             \
        pair r;                                                                                                       \
        r.high = a + b;                                                                                               \
        type part = r.high - a;                                                                                       \
        r.low = (a - (r.high - part)) + (b - part);                                                                   \
        return r;                                                                                                     \
    }                                                                                                                 \
    /* The same for |a| >= |b| (Dekker 1971). */                                                                      \
    FN pair prefix##quick_sum(type a, type b) {                                                                       \
        pair r;                                                                                                       \
        r.high = a + b;                                                                                               \
        r.low = b - (r.high - a);                                                                                     \
        return r;                                                                                                     \
    }                                                                                                                 \
    FN pair prefix##add(pair a, pair b) {                                                                             \
        pair r = prefix##sum(a.high, b.high);                                                                         \
        r.low = r.low + (a.low + b.low);                                                                              \
        return prefix##sum(r.high, r.low);                                                                            \
    }                                                                                                                 \
    FN pair prefix##mul(pair a, pair b) {                                                                             \
        pair r;                                                                                                       \
        r.high = a.high * b.high;                                                                                     \
        r.low = fma(a.high, b.high, -r.high) + fma(a.high, b.low, a.low * b.high);                                    \
        return prefix##quick_sum(r.high, r.low);                                                                      \
    }                                                                                                                 \
    /* a s */                                                                                                         \
    FN pair prefix##scale(pair a, type s) {                                                                           \
        pair r;                                                                                                       \
        r.high = a.high * s;                                                                                          \
        r.low = fma(a.high, s, -r.high) + a.low * s;                                                                  \
        return prefix##quick_sum(r.high, r.low);                                                                      \
    }                                                                                                                 \
    FN pair prefix##of(type a) { pair r; r.high = a; r.low = a - a; return r; }                                       \
    FN pair prefix##neg(pair a) { pair r; r.high = -a.high; r.low = -a.low; return r; }                               \
    /* The value of s + a. */                                                                                         \
    FN type prefix##value_from(type s, pair a) {                                                                      \
        pair r = prefix##sum(s, a.high);                                                                              \
        return r.high + (r.low + a.low);                                                                              \
    }                                                                                                                 \
    FN type prefix##value(pair a) { return a.high + a.low; }

EXACT(real1, pair1, one_)
#if LANES == 1
typedef pair1 pair;
#define pair_sum one_sum
#define pair_add one_add
#define pair_mul one_mul
#define pair_scale one_scale
#define pair_of one_of
#define pair_neg one_neg
#define pair_value one_value
#define pair_value_from one_value_from
#else
EXACT(real, pair, pair_)
#endif

#endif

/* float4.h -- four floats at once on the host, and boxes of them: SSE2 where there is, else what the compiler makes of
 * vectors. */
#ifndef BRUME_FLOAT4_H
#define BRUME_FLOAT4_H

#include <float.h>
#include <stdint.h>
#include <string.h>
#ifdef __SSE2__
#include <emmintrin.h>
#endif

typedef float brume_float4 __attribute__((vector_size(16)));
typedef int32_t brume_int4 __attribute__((vector_size(16)));

/* From and to any place, which need not be aligned: `from` points to 16 bytes. */
static inline brume_float4 brume_float4_load(const void *from) {
    brume_float4 v;
    memcpy(&v, from, sizeof v);
    return v;
}

static inline brume_float4 brume_float4_all(float x) {
    return (brume_float4){x, x, x, x};
}

/* a where the mask has all bits set, b where it has none. */
static inline brume_float4 brume_float4_select(brume_int4 mask, brume_float4 a, brume_float4 b) {
    return (brume_float4)(((brume_int4)a & mask) | ((brume_int4)b & ~mask));
}

/* a < b ? a : b */
static inline brume_float4 brume_float4_min(brume_float4 a, brume_float4 b) {
#ifdef __SSE2__
    return (brume_float4)_mm_min_ps((__m128)a, (__m128)b);
#else
    return brume_float4_select(a < b, a, b);
#endif
}

static inline brume_float4 brume_float4_max(brume_float4 a, brume_float4 b) {
#ifdef __SSE2__
    return (brume_float4)_mm_max_ps((__m128)a, (__m128)b);
#else
    return brume_float4_select(a > b, a, b);
#endif
}

/* The first three lanes of a, b, c become x[0 ... 2] = a[0], b[0], c[0], y = a[1] ..., z = a[2] ... */
static inline void brume_float4_transpose(brume_float4 a, brume_float4 b, brume_float4 c, brume_float4 *x,
                                          brume_float4 *y, brume_float4 *z) {
#ifdef __SSE2__
    __m128 low = _mm_unpacklo_ps((__m128)a, (__m128)b), high = _mm_unpackhi_ps((__m128)a, (__m128)b);
    *x = (brume_float4)_mm_movelh_ps(low, (__m128)c);
    *y = (brume_float4)_mm_shuffle_ps(low, (__m128)c, _MM_SHUFFLE(3, 1, 3, 2));
    *z = (brume_float4)_mm_shuffle_ps(high, (__m128)c, _MM_SHUFFLE(3, 2, 1, 0));
#else
    *x = (brume_float4){a[0], b[0], c[0], 0};
    *y = (brume_float4){a[1], b[1], c[1], 0};
    *z = (brume_float4){a[2], b[2], c[2], 0};
#endif
}

/* x, y, z; the fourth lane means nothing. */
typedef struct brume_bounds {
    brume_float4 lo, hi;
} brume_bounds;

static inline brume_bounds brume_bounds_empty(void) {
    brume_bounds b = {brume_float4_all(FLT_MAX), brume_float4_all(-FLT_MAX)};
    return b;
}

static inline void brume_bounds_join(brume_bounds *to, const brume_bounds *b) {
    to->lo = brume_float4_min(b->lo, to->lo);
    to->hi = brume_float4_max(b->hi, to->hi);
}

#endif

/* lane.h -- the lane type: one text of transport for CPU lanes, GPU work-items, float and double.
 *
 * A work-item carries LANES paths at once. `real`, `ireal`, `ureal` and `mask` hold one value per path: plain scalars
 * at LANES = 1 (the GPU and debugging form, and the reference of the tests), OpenCL vectors at 4, 8 and 16. Everything
 * else in cl/ is written once over these names.
 *
 * What keeps one text right at every width:
 *  - `m ? a : b` is the select, for scalars and vectors alike; both sides are evaluated.
 *  - Masks come from relational operators, combine with & | ! and never with ~ (a scalar true is 1, a vector true -1),
 *    and are tested with ANY and ALL only.
 *  - Constants next to lanes are written R(0.5), I(3), U(7).
 *  - Dead lanes hold anything, NaN included: accumulate through select, never by multiplying with 0.
 *  - gather does not look at masks: the index of a dead lane must still be in bounds.
 *
 * In double (-DBRUME_DOUBLE) ireal, ureal and mask are 64 bits wide, because OpenCL selects only between operands of
 * the mask's own width. Hashes need 32-bit wrap-around, so random bits are `ureal32`: no masks, only arithmetic.
 */
#ifndef BRUME_LANE_H
#define BRUME_LANE_H

#ifndef LANES
#define LANES 1
#endif

#pragma OPENCL FP_CONTRACT OFF

/* How functions are declared; both can be given by -D. What is inlined is the compiler's choice: always_inline at every
 * site took LLVM 1.7 times as long to build and ran no faster. QUICK is for a program that is to be built soon and used
 * for seconds: LLVM inlines less of what is cold, which at one lane saves a seventh of the build, and runs as fast
 * (wider, it doesn't). */
#ifdef QUICK
#define BUILD_SOON __attribute__((cold))
#else
#define BUILD_SOON
#endif
#ifndef FN
#define FN static BUILD_SOON
#endif
/* A real call, for long functions with many sites: the path kernel builds in 30 % less time and runs as fast. Gathers
 * as calls were refused: 8 % less to build, 5 to 10 % slower. */
#ifndef CALL
#define CALL static __attribute__((noinline)) BUILD_SOON
#endif

#define LANE_PASTE2(a, b) a##b
#define LANE_PASTE(a, b) LANE_PASTE2(a, b)

#ifdef BRUME_DOUBLE
#pragma OPENCL EXTENSION cl_khr_fp64 : enable
#define LANE_REAL double
#define LANE_INT long
#define LANE_UINT ulong
#else
#define LANE_REAL float
#define LANE_INT int
#define LANE_UINT uint
#endif

/* One lane's value, for code that treats a lane alone (traversal, gathers). */
typedef LANE_REAL real1;
typedef LANE_INT int1;
typedef LANE_UINT uint1;

#if LANES == 1
#define LANE_TYPE(scalar) scalar
#else
#define LANE_TYPE(scalar) LANE_PASTE(scalar, LANES)
#endif

typedef LANE_TYPE(LANE_REAL) real;
typedef LANE_TYPE(LANE_INT) ireal;
typedef LANE_TYPE(LANE_UINT) ureal;
typedef LANE_TYPE(LANE_INT) mask;
typedef LANE_TYPE(uint) ureal32;

#define R(x) ((real)((real1)(x)))
#define I(x) ((ireal)((int1)(x)))
#define U(x) ((ureal)((uint1)(x)))
#define U32(x) ((ureal32)((uint)(x)))

/* The same bits under another name (as_...), the same value in another type (to_...). */
#define as_real(x) LANE_PASTE(as_, LANE_TYPE(LANE_REAL))(x)
#define as_ireal(x) LANE_PASTE(as_, LANE_TYPE(LANE_INT))(x)
#define as_ureal(x) LANE_PASTE(as_, LANE_TYPE(LANE_UINT))(x)
#define to_real(x) LANE_PASTE(convert_, LANE_TYPE(LANE_REAL))(x)
#define to_ireal(x) LANE_PASTE(convert_, LANE_TYPE(LANE_INT))(x)
#define to_ureal(x) LANE_PASTE(convert_, LANE_TYPE(LANE_UINT))(x)
#define to_ureal32(x) LANE_PASTE(convert_, LANE_TYPE(uint))(x)

/* One lane of a value: lanes_of_real v; v.all = x; v.one[k]. After unrolling each k is one extract or insert. */
typedef union { real all; real1 one[LANES]; } lanes_of_real;
typedef union { ireal all; int1 one[LANES]; } lanes_of_ireal;
#define EACH_LANE(k) _Pragma("unroll") for (int k = 0; k < LANES; k++)

#if LANES == 1
#define ANY(m) (m)
#define ALL(m) (m)
#define TRUE_MASK ((mask)1)
#define FALSE_MASK ((mask)0)
FN ireal lane_index(void) { return 0; }
FN int count_lanes(mask m) { return m != 0; }
FN uint mask_bits(mask m) { return m != 0; }
#else
#define TRUE_MASK ((mask)(-1))
#define FALSE_MASK ((mask)(0))
/* The built-in any() goes lane by lane on PoCL: 27 % of a path tracer's time. Narrowed to bytes it is one test. */
#if LANES == 16
FN int ANY(mask m) { ulong2 b = as_ulong2(convert_char16(m)); return (b.x | b.y) != 0; }
FN int ALL(mask m) { ulong2 b = as_ulong2(convert_char16(m)); return (b.x & b.y) == (ulong)-1; }
FN ireal lane_index(void) { return to_ireal((int16)(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15)); }
FN int count_lanes(mask m) {
    ulong2 b = as_ulong2(convert_char16(m)) & (ulong2)(0x0101010101010101ul);
    return (int)(popcount(b.x) + popcount(b.y));
}
#elif LANES == 8
FN int ANY(mask m) { return as_ulong(convert_char8(m)) != 0; }
FN int ALL(mask m) { return as_ulong(convert_char8(m)) == (ulong)-1; }
FN ireal lane_index(void) { return to_ireal((int8)(0, 1, 2, 3, 4, 5, 6, 7)); }
FN int count_lanes(mask m) { return (int)popcount(as_ulong(convert_char8(m)) & 0x0101010101010101ul); }
#elif LANES == 4
FN int ANY(mask m) { return as_uint(convert_char4(m)) != 0; }
FN int ALL(mask m) { return as_uint(convert_char4(m)) == (uint)-1; }
FN ireal lane_index(void) { return to_ireal((int4)(0, 1, 2, 3)); }
FN int count_lanes(mask m) { return (int)popcount(as_uint(convert_char4(m)) & 0x01010101u); }
#else
#error "LANES must be 1, 4, 8 or 16"
#endif

/* Lane k's as bit k. */
FN uint mask_bits(mask m) {
#if LANES == 16
    uint16 b = as_uint16(convert_int16(m)) & ((uint16)(1) << convert_uint16(lane_index()));
    uint8 c = b.lo | b.hi;
    uint4 e = c.lo | c.hi;
#elif LANES == 8
    uint8 c = as_uint8(convert_int8(m)) & ((uint8)(1) << convert_uint8(lane_index()));
    uint4 e = c.lo | c.hi;
#else
    uint4 e = as_uint4(convert_int4(m)) & ((uint4)(1) << convert_uint4(lane_index()));
#endif
    uint2 f = e.lo | e.hi;
    return f.x | f.y;
}
#endif

/* Random bits have their own width: the select for them. */
FN ureal32 select32(mask m, ureal32 a, ureal32 b) { return LANE_PASTE(convert_, LANE_TYPE(int))(m) ? a : b; }

/* p[i] for every lane. */
FN real gather(__global const float *p, ireal i) {
    lanes_of_real r;
    lanes_of_ireal at;
    at.all = i;
    EACH_LANE(k) r.one[k] = p[at.one[k]];
    return r.all;
}

FN ireal gather_int(__global const int *p, ireal i) {
    lanes_of_ireal r, at;
    at.all = i;
    EACH_LANE(k) r.one[k] = p[at.one[k]];
    return r.all;
}

/* A 4-byte field of element i in an array of structs. */
#define GATHER(array, field, i) \
    gather((__global const float *)&(array)[0].field, (i) * I(sizeof((array)[0]) / 4))
#define GATHER_INT(array, field, i) \
    gather_int((__global const int *)&(array)[0].field, (i) * I(sizeof((array)[0]) / 4))

/* LANES consecutive values in memory. */
FN real load_lanes(__global const float *p) {
#if LANES == 1
    return *p;
#else
    return to_real(LANE_PASTE(vload, LANES)(0, p));
#endif
}

FN void store_lanes(real x, __global float *p) {
#if LANES == 1
    *p = (float)x;
#else
    LANE_PASTE(vstore, LANES)(LANE_PASTE(convert_float, LANES)(x), 0, p);
#endif
}

#endif

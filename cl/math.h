/* math.h -- elementary functions over the lane type, float and double.
 *
 * Why not the built-ins: on CPU devices they cost 20-140 ns a call, differ between vector widths and devices, and the
 * specification leaves them 3-16 ulp. These use only + - * / fma sqrt, integers and selects, all of which IEEE 754
 * rounds one way, so every width gives the same bits, and so does every device that divides correctly rounded.
 *
 * Largest error in ulp. Float: over all 2^32 of them, of latan2 with eleven other arguments (make exhaustive,
 * test/exhaustive.md; test_functions holds a sample to it). Double: the largest among 2^20 of all magnitudes, and the
 * bound that test_math holds them to.
 *
 *                 float  double  bound  domain
 *   lexp          1.02   0.96    2      all; inf above, 0 below, denormals in between
 *   lexpm1        1.50   1.76    2      all
 *   llog          0.83   0.77    2      all; -inf at 0, NaN below, denormals
 *   llog1p        0.83   0.79    2      all; -inf at -1, NaN below
 *   lsincos       0.88   0.76    2      |x| <= SINCOS_LIMIT, NaN beyond
 *   lsincos_turns 1.00   0.98    2      |u| <= 2^20 turns
 *   latan2        1.81   1.92    2      all, signed zeros and infinities as in C
 *   lasin         2.41   2.04    2.5    [-1, 1], NaN beyond
 *   lacos         1.18   1.08    2      [-1, 1], NaN beyond
 *
 * Method: Cody & Waite range reduction with fma, then a polynomial in Horner form whose coefficients, rounded to the
 * format, minimise the largest relative error (Brisebarre & Chevillard 2007, the fpminimax of the Sollya tool). The
 * logarithm's arrangement follows Tang 1990. There is no lpow: exp(y log x) loses digits, and every power that
 * transport needs is a product of squares and square roots.
 */
#ifndef BRUME_MATH_H
#define BRUME_MATH_H

#include "lane.h"

#ifdef BRUME_DOUBLE
#define REAL_MANTISSA 52
#define REAL_ONE_BITS 0x3ff0000000000000l
#define REAL_MANTISSA_MASK 0xfffffffffffffl
#define REAL_SIGN_SHIFT 63
#define SQRT_HALF_BITS 0x3fe6a09e667f3bcdl
#define REAL_MIN_NORMAL 2.2250738585072014e-308
#define ROUNDER 6755399441055744.0 /* 1.5 * 2^52: adding it rounds to an integer that stands in the low bits */
#define LN2_HIGH 0.69314718055994529
#define LN2_LOW 2.3190468138462996e-17
#define EXP_MAX 709.79
#define EXP_MIN -745.2
#define EXPM1_MIN -38.0
#define LINEAR_BELOW 1e-16 /* below it f(x) = x to half an ulp for f = expm1, log1p, sin */
#define SINCOS_LIMIT 1e9
#define HALF_PI_1 1.5707963267948966
#define HALF_PI_2 6.123233995736766e-17
#define HALF_PI_3 -1.4973849048591833e-33
#define HALF_OF_MAX 8.9884656743115795e307
#else
#define REAL_MANTISSA 23
#define REAL_ONE_BITS 0x3f800000
#define REAL_MANTISSA_MASK 0x7fffff
#define REAL_SIGN_SHIFT 31
#define SQRT_HALF_BITS 0x3f3504f3
#define REAL_MIN_NORMAL 1.17549435e-38
#define ROUNDER 12582912.0 /* 1.5 * 2^23: adding it rounds to an integer that stands in the low bits */
#define LN2_HIGH 0.693147182
#define LN2_LOW -1.90465430e-9
#define EXP_MAX 88.73
#define EXP_MIN -104.0
#define EXPM1_MIN -18.0
#define LINEAR_BELOW 2e-8
#define SINCOS_LIMIT 1e5
#define HALF_PI_1 1.57079637
#define HALF_PI_2 -4.37113883e-8
#define HALF_PI_3 -1.71512489e-15
#define HALF_OF_MAX 1.70141183e38
#endif

#define PI 3.14159265358979323846
#define REAL_INF R(INFINITY)
#define REAL_NAN as_real(I(REAL_ONE_BITS) | (I(3) << I(REAL_MANTISSA - 1)) | (I(1) << I(REAL_SIGN_SHIFT - 1)))

/* NaN or infinite, by the bits: no comparison can be compiled away. */
FN mask is_bad(real x) {
#ifdef BRUME_DOUBLE
    return (as_ireal(x) & I(0x7ff0000000000000)) == I(0x7ff0000000000000);
#else
    return (as_ireal(x) & I(0x7f800000)) == I(0x7f800000);
#endif
}

/* One step of Horner's scheme in the variable z. */
#define HORNER(p, c) p = fma(p, z, R(c))

/* 2^k for k within the exponents of normal numbers. */
FN real lpow2(ireal k) { return as_real((k << I(REAL_MANTISSA)) + I(REAL_ONE_BITS)); }

/* Flips the sign of x where bit is 1; bit is 0 or 1. */
FN real flip_sign(real x, ireal bit) { return as_real(as_ireal(x) ^ (bit << I(REAL_SIGN_SHIFT))); }

/* ---- exp, expm1 -------------------------------------------------------------------------------------------------- */

/* x = k ln 2 + r, |r| <= ln 2 / 2; returns expm1(r). */
FN real exp_reduced(real x, ireal *k) {
    real t = fma(x, R(1.4426950408889634), R(ROUNDER));
    real n = t - R(ROUNDER);
    real z = fma(-n, R(LN2_LOW), fma(-n, R(LN2_HIGH), x));
    *k = as_ireal(t) - as_ireal(R(ROUNDER));
#ifdef BRUME_DOUBLE
    real p = R(2.2984889939708502e-9);
    HORNER(p, 2.5111837436525465e-8);
    HORNER(p, 2.7549522366090766e-7);
    HORNER(p, 2.7557235602542082e-6);
    HORNER(p, 2.4801598287652739e-5);
    HORNER(p, 1.9841269895405275e-4);
    HORNER(p, 1.3888888881682551e-3);
    HORNER(p, 8.3333333333175733e-3);
    HORNER(p, 4.1666666666688106e-2);
    HORNER(p, 0.16666666666666682);
    HORNER(p, 0.49999999999999978);
#else
    real p = R(1.38979522e-3);
    HORNER(p, 8.36896803e-3);
    HORNER(p, 4.16671485e-2);
    HORNER(p, 0.166665182);
    HORNER(p, 0.499999970);
#endif
    return fma(z * z, p, z);
}

CALL real lexp(real x) {
    ireal k;
    real e = R(1) + exp_reduced(x, &k);
    /* in two steps, as 2^k itself may be out of range while the product is not */
    ireal half_k = k >> I(1);
    real y = e * lpow2(half_k) * lpow2(k - half_k);
    y = x > R(EXP_MAX) ? REAL_INF : y;
    return x < R(EXP_MIN) ? R(0) : y;
}

CALL real lexpm1(real x) {
    ireal k;
    real p = exp_reduced(x, &k);
    real s = lpow2(k - I(1)); /* half of 2^k, which may be out of range */
    real y = fma(s, p, s - R(0.5)) * R(2);
    y = x > R(EXP_MAX) ? REAL_INF : y;
    y = x < R(EXPM1_MIN) ? R(-1) : y;
    return fabs(x) < R(LINEAR_BELOW) ? x : y;
}

/* ---- log, log1p -------------------------------------------------------------------------------------------------- */

/* k ln 2 + low + log(1 + f) for 1 + f in [sqrt(1/2), sqrt(2)] */
FN real log_reduced(real k, real f, real low) {
    real s = f / (R(2) + f);
    real z = s * s;
#ifdef BRUME_DOUBLE
    real p = R(0.14798017531317179);
    HORNER(p, 0.15313855445132341);
    HORNER(p, 0.18183571495781667);
    HORNER(p, 0.22222198443972460);
    HORNER(p, 0.28571428743564609);
    HORNER(p, 0.39999999999409713);
    HORNER(p, 0.66666666666667351);
#else
    real p = R(0.298715115);
    HORNER(p, 0.399775684);
    HORNER(p, 0.666667759);
#endif
    real h = R(0.5) * f * f;
    return fma(k, R(LN2_HIGH), f - (h - fma(s, fma(z, p, h), fma(k, R(LN2_LOW), low))));
}

/* A normal x = 2^k (1 + f). */
FN ireal log_split(real x, real *f) {
    ireal i = as_ireal(x) - I(SQRT_HALF_BITS);
    *f = as_real((i & I(REAL_MANTISSA_MASK)) + I(SQRT_HALF_BITS)) - R(1);
    return i >> I(REAL_MANTISSA);
}

CALL real llog(real x) {
    mask denormal = x < R(REAL_MIN_NORMAL);
    real f, y;
    ireal k = log_split(denormal ? x * R(18014398509481984.0) : x, &f); /* 2^54 */
    y = log_reduced(to_real(denormal ? k - I(54) : k), f, R(0));
    y = x < REAL_INF ? y : x; /* inf and NaN pass through */
    y = x < R(0) ? REAL_NAN : y;
    return x == R(0) ? -REAL_INF : y;
}

CALL real llog1p(real x) {
    real u = R(1) + x;
    real f;
    ireal k = log_split(u, &f);
    real low = (x - (u - R(1))) / u; /* what the sum u lost, as a share of u */
    mask near = k == I(0);
    real y = log_reduced(to_real(k), near ? x : f, near ? R(0) : low);
    y = x < REAL_INF ? y : x;
    y = x < R(-1) ? REAL_NAN : y;
    y = x == R(-1) ? -REAL_INF : y;
    return fabs(x) < R(LINEAR_BELOW) ? x : y;
}

/* ---- sine and cosine --------------------------------------------------------------------------------------------- */

/* Of z + low, |z| <= pi/4, turned by `quarters` (its two low bits) quarter turns. */
FN void sincos_reduced(real r, real low, ireal quarters, real *sine, real *cosine) {
    real z = r * r;
#ifdef BRUME_DOUBLE
    real p = R(1.5895751310611434e-10);
    HORNER(p, -2.5050739332293742e-8);
    HORNER(p, 2.7557313565777628e-06);
    HORNER(p, -1.9841269829420804e-4);
    HORNER(p, 8.3333333333218892e-3);
    HORNER(p, -0.16666666666666630);
    real q = R(-1.1358637549834275e-11);
    HORNER(q, 2.0875703526944049e-9);
    HORNER(q, -2.7557314205756297e-7);
    HORNER(q, 2.4801587288973229e-5);
    HORNER(q, -1.3888888888873316e-3);
    HORNER(q, 4.1666666666666595e-2);
#else
    real p = R(-1.95180721e-4);
    HORNER(p, 8.33218824e-3);
    HORNER(p, -0.166666552);
    real q = R(2.44323383e-5);
    HORNER(q, -1.38873095e-3);
    HORNER(q, 4.16666456e-2);
#endif
    real s = r + fma(r * z, p, low);
    /* 1 - z/2 rounds; what it lost is 1 - c - z/2 */
    real h = R(0.5) * z;
    real c = R(1) - h;
    c = c + ((R(1) - c) - h + fma(z * z, q, -r * low));
    s = r == R(0) ? r : s; /* -0 stays */
    mask odd = (quarters & I(1)) == I(1);
    *sine = flip_sign(odd ? c : s, (quarters >> I(1)) & I(1));
    *cosine = flip_sign(odd ? s : c, ((quarters + I(1)) >> I(1)) & I(1));
}

/* sin x and cos x, x in radians. */
CALL void lsincos(real x, real *sine, real *cosine) {
    x = fabs(x) <= R(SINCOS_LIMIT) ? x : REAL_NAN;
    real t = fma(x, R(0.63661977236758134), R(ROUNDER));
    real n = t - R(ROUNDER);
    real a = fma(-n, R(HALF_PI_1), x); /* exact */
    real b = -n * R(HALF_PI_2);
    real r = a + b;
    real v = r - a;
    real low = (a - (r - v)) + (b - v) + (fma(-n, R(HALF_PI_2), -b) - n * R(HALF_PI_3)); /* a + b - r: Knuth's sum */
    r = n == R(0) ? x : r; /* -0 stays */
    low = n == R(0) ? R(0) : low;
    sincos_reduced(r, low, as_ireal(t), sine, cosine);
}

/* sin and cos of 2 pi u: for uniform variates, without a rounded 2 pi and so exactly periodic. */
FN void lsincos_turns(real u, real *sine, real *cosine) {
    real t = fma(u, R(4), R(ROUNDER));
    real f = fma(u, R(4), -(t - R(ROUNDER))); /* exact, in [-1/2, 1/2] */
    real r = f * R(HALF_PI_1);
    sincos_reduced(r, fma(f, R(HALF_PI_1), -r) + f * R(HALF_PI_2), as_ireal(t), sine, cosine);
}

/* ---- inverse functions ------------------------------------------------------------------------------------------- */

/* The angle of (x, y) from the x axis, in [-pi, pi]. */
CALL real latan2(real y, real x) {
    real ay = fabs(y), ax = fabs(x);
    mask steep = ay > ax;
    real a = steep ? ax : ay, b = steep ? ay : ax;
    mask huge = b > R(HALF_OF_MAX);
    a = huge ? (a == REAL_INF ? R(1) : (b == REAL_INF ? R(0) : a * R(0.25))) : a;
    b = huge ? (b == REAL_INF ? R(1) : b * R(0.25)) : b;
    b = b == R(0) ? R(1) : b;
    /* beyond 1/2 the angle to the diagonal instead */
    mask far = a > R(0.5) * b;
    real r = (far ? a - b : a) / (far ? a + b : b);
    real z = r * r;
#ifdef BRUME_DOUBLE
    real p = R(-0.0083674317035369924);
    HORNER(p, 2.3658556708502528e-2);
    HORNER(p, -3.7121894186426821e-2);
    HORNER(p, 4.5896122473050576e-2);
    HORNER(p, -5.2300681838275971e-2);
    HORNER(p, 5.8778198183790223e-2);
    HORNER(p, -6.6662255390634598e-2);
    HORNER(p, 7.6922776884900485e-2);
    HORNER(p, -9.0909077081359063e-2);
    HORNER(p, 0.11111111070139501);
    HORNER(p, -0.14285714285000095);
    HORNER(p, 0.19999999999993781);
    HORNER(p, -0.33333333333333315);
#else
    real p = R(-5.12899384e-2);
    HORNER(p, 0.101577766);
    HORNER(p, -0.141745210);
    HORNER(p, 0.199941828);
    HORNER(p, -0.333332330);
#endif
    r = fma(r * z, p, r);
    /* angle = k pi/4 + r or - r */
    ireal k = far ? I(1) : I(0);
    k = steep ? I(2) - k : k;
    r = steep ? -r : r;
    mask left = as_ireal(x) < I(0); /* -0 included */
    k = left ? I(4) - k : k;
    r = left ? -r : r;
    real n = to_real(k);
    r = fma(n, R(HALF_PI_1 * 0.5), fma(n, R(HALF_PI_2 * 0.5), r));
    /* NaN took neither side of the comparisons above */
    mask numbers = (x == x) & (y == y);
    return numbers ? copysign(r, y) : REAL_NAN;
}

FN real latan(real x) { return latan2(x, R(1)); }

/* asin on [-1/2, 1/2] */
FN real asin_reduced(real r) {
    real z = r * r;
#ifdef BRUME_DOUBLE
    real p = R(3.2647143489574592e-2);
    HORNER(p, -0.021027173170642021);
    HORNER(p, 2.1726180847754850e-2);
    HORNER(p, 3.6992078761952114e-3);
    HORNER(p, 0.010782015850438337);
    HORNER(p, 1.1398625809865838e-2);
    HORNER(p, 1.3980851700477536e-2);
    HORNER(p, 1.7351609783358625e-2);
    HORNER(p, 2.2372215087562000e-2);
    HORNER(p, 0.030381942705297076);
    HORNER(p, 4.4642857174634863e-2);
    HORNER(p, 7.4999999999708190e-2);
    HORNER(p, 0.16666666666666760);
#else
    real p = R(4.21650372e-2);
    HORNER(p, 2.41815336e-2);
    HORNER(p, 4.54696380e-2);
    HORNER(p, 7.49530717e-2);
    HORNER(p, 0.166667521);
#endif
    real y = fma(r * z, p, r);
    return r == R(0) ? r : y;
}

FN real lasin(real x) {
    real a = fabs(x);
    mask outer = a > R(0.5);
    real p = asin_reduced(outer ? sqrt(fma(a, R(-0.5), R(0.5))) : x);
    real y = fma(p, R(-2), R(HALF_PI_2)) + R(HALF_PI_1);
    return outer ? copysign(y, x) : p;
}

FN real lacos(real x) {
    real a = fabs(x);
    mask outer = a > R(0.5);
    real p = asin_reduced(outer ? sqrt(fma(a, R(-0.5), R(0.5))) : x);
    real inner_y = (R(HALF_PI_2) - p) + R(HALF_PI_1);
    real left_y = fma(p, R(-2), R(2 * HALF_PI_2)) + R(2 * HALF_PI_1);
    return outer ? (x < R(0) ? left_y : R(2) * p) : inner_y;
}

#endif

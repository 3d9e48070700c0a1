/* function_cases.c -- see function_cases.h. */
#include "function_cases.h"

#include <math.h>
#include <string.h>

const function_case *function_case_at(uint32_t index) {
    if (index < function_cases_math_count) return &function_cases_math[index];
    index -= function_cases_math_count;
    if (index < function_cases_sampling_count) return &function_cases_sampling[index];
    index -= function_cases_sampling_count;
    return index < function_cases_surfaces_count ? &function_cases_surfaces[index] : NULL;
}

uint64_t function_case_inputs(const function_case *c) {
    size_t n = 0;
    switch (c->inputs) {
    case EVERY_VARIATE: return 1u << 24;
    case EVERY_WORD: return (uint64_t)1 << 32;
    case EVERY_PAIR: c->table(&n); return (uint64_t)n * n;
    default: return (uint64_t)c->last - c->first + 1;
    }
}

uint32_t function_bits(float x) {
    uint32_t bits;
    memcpy(&bits, &x, sizeof bits);
    return bits;
}

float function_float(uint32_t bits) {
    float x;
    memcpy(&x, &bits, sizeof x);
    return x;
}

double function_ulps(float y, double exact) {
    if (isnan(exact)) return isnan(y) ? 0 : (double)INFINITY;
    float nearest = (float)exact;
    if (isinf(nearest) || exact == 0) {
        int same = y == nearest && !signbit(y) == !signbit(nearest);
        return same ? 0 : (double)INFINITY;
    }
    if (!isfinite(y)) return INFINITY;
    uint64_t bits;
    memcpy(&bits, &exact, sizeof bits);
    int exponent = (int)(bits >> 52 & 0x7ff) - 1023 - 23;
    if (exponent < -149) exponent = -149;
    uint64_t per_ulp_bits = (uint64_t)(1023 - exponent) << 52;
    double per_ulp;
    memcpy(&per_ulp, &per_ulp_bits, sizeof per_ulp);
    return fabs((double)y - exact) * per_ulp;
}

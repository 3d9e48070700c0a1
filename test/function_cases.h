/* function_cases.h -- device functions of one number, or of two, that are compared with the exact value everywhere: the
 * list that test_functions samples in seconds and measure_exhaustive goes through whole.
 *
 * A float has 2^32 values and a variate 2^24 or 2^32, so "everywhere" means every one of them. References are computed
 * in double or 80 bits from closed forms. What libm adds, 2^-52 of the value, is 2e-9 of a float's ulp.
 */
#ifndef FUNCTION_CASES_H
#define FUNCTION_CASES_H

#include <stddef.h>
#include <stdint.h>

typedef enum function_inputs {
    EVERY_FLOAT,   /* x has the bits first ... last */
    EVERY_VARIATE, /* x = bits 2^-24, all that cl/random.h's unit() gives */
    EVERY_WORD,    /* bits: what a hash gives */
    EVERY_PAIR     /* x and z from a grid of numbers */
} function_inputs;

enum { FUNCTION_PARAMETERS = 4 };

typedef struct function_case function_case;

/* What the device made of it: y, from these. */
typedef struct function_result {
    uint32_t bits; /* the input as it was counted */
    double x, z;   /* as a number; the second of a pair */
    float y;
    const float *p; /* the parameters */
} function_result;

struct function_case {
    const char *name, *domain, *reference, *unit;
    const char *body; /* OpenCL: sets `real y` from `real x, z`, `ureal32 bits`, `real p0 ... p3`,
                         `__global const float *table` */
    double (*error)(const function_result *r); /* in `unit`; INFINITY where what must be exact isn't */
    double bound;     /* the largest error, as measure_exhaustive found it, rounded up */
    uint32_t worst;   /* the bits where it did */
    function_inputs inputs;
    uint32_t first, last; /* of EVERY_FLOAT */
    const float (*parameters)[FUNCTION_PARAMETERS]; /* each row is gone through; NULL for none */
    uint32_t parameter_count;
    const float *edges;   /* of formulas: their neighbours are worth a look */
    uint32_t edge_count;
    const float *(*table)(size_t *out_count); /* of EVERY_PAIR the grid; else what `table` points to, or NULL */
};

extern const function_case function_cases_math[], function_cases_sampling[], function_cases_surfaces[];
extern const uint32_t function_cases_math_count, function_cases_sampling_count, function_cases_surfaces_count;

/* All of them, one list after the other. NULL beyond. */
const function_case *function_case_at(uint32_t index);

/* How many inputs a case has. */
uint64_t function_case_inputs(const function_case *c);

/* |y - exact| in units of the last place of the exact value. NaN, infinities and zeros must be just that, with their
 * sign; INFINITY if not. Of a value below float's smallest normal number the unit is 2^-149. */
double function_ulps(float y, double exact);

uint32_t function_bits(float x);
float function_float(uint32_t bits);

#endif

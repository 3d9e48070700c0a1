/* test_math.c -- cl/math.h against 80-bit libm: bounds in ulp over all of float and double, special values exactly, and
 * the same bits at every width. The bounds are those that cl/math.h states. Float alone, over all its numbers:
 * test_functions, make exhaustive.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "device_test.h"
#include "stability.h"

enum { COUNT = 1 << 20, FUNCTIONS = 11, SPECIALS = 24 };

#define PI_LONG 3.141592653589793238462643383279502884L

/* sin(2 pi u) for u reduced to a quarter turn around 0, exactly */
static long double sin_turns(long double u) {
    if (u == 0) return u; /* with its sign */
    u -= rintl(u);
    if (u > 0.25L) u = 0.5L - u;
    if (u < -0.25L) u = -0.5L - u;
    return sinl(2 * PI_LONG * u);
}

static long double cos_turns(long double u) {
    u = fabsl(u - rintl(u));
    return u < 0.125L ? cosl(2 * PI_LONG * u) : sin_turns(0.25L - u);
}

static long double atan2_inverse(long double y) { return atan2l(y, 0.75L); }

typedef struct function {
    const char *name;
    long double (*reference)(long double);
    double bound[2];        /* ulp, by precision: float's as test/exhaustive.md has it */
    double limit[2];        /* |x| up to here by precision; 0: no limit */
} function;

static const function functions[FUNCTIONS] = {
    {"lexp(x)", expl, {1.03, 2}, {0, 0}},
    {"lexpm1(x)", expm1l, {1.5, 2}, {0, 0}},
    {"llog(x)", logl, {0.83, 2}, {0, 0}},
    {"llog1p(x)", log1pl, {0.83, 2}, {0, 0}},
    {"latan(x)", atanl, {2, 2}, {0, 0}},
    {"latan2(x, 0.75)", atan2_inverse, {2, 2}, {0, 0}},
    {"lasin(x)", asinl, {2.5, 2.5}, {0, 0}},
    {"lacos(x)", acosl, {2, 2}, {0, 0}},
    {"lsincos: sin", sinl, {0.88, 2}, {1e5, 1e9}},
    {"lsincos: cos", cosl, {0.87, 2}, {1e5, 1e9}},
    {"lsincos_turns: sin", sin_turns, {1, 2}, {0x1p20, 0x1p20}},
};

/* The cosine of turns comes last and has an array of its own: 11 functions plus it. */
static const char text[] =
    "#include \"math.h\"\n"
    "__kernel void test(__global const real1 *in, __global real1 *out, __global real1 *turns) {\n"
    "    real x = LOAD(in + AT), s, c;\n"
    "    uint n = get_global_size(0) * LANES;\n"
    "    __global real1 *to = out + AT;\n"
    "    STORE(to, lexp(x)); to += n;\n"
    "    STORE(to, lexpm1(x)); to += n;\n"
    "    STORE(to, llog(x)); to += n;\n"
    "    STORE(to, llog1p(x)); to += n;\n"
    "    STORE(to, latan(x)); to += n;\n"
    "    STORE(to, latan2(x, R(0.75))); to += n;\n"
    "    STORE(to, lasin(x)); to += n;\n"
    "    STORE(to, lacos(x)); to += n;\n"
    "    lsincos(x, &s, &c);\n"
    "    STORE(to, s); to += n;\n"
    "    STORE(to, c); to += n;\n"
    "    lsincos_turns(x, &s, &c);\n"
    "    STORE(to, s);\n"
    "    STORE(turns + AT, c);\n"
    "}\n";

static const double specials[SPECIALS] = {
    0.0, -0.0, INFINITY, -INFINITY, NAN, 1, -1, 0.5, -0.5, 2, 88.7228394, -88.7228394, 88.7229, -103.97,
    -103.98, -104.1, 1e-40, -1e-40, 0.75, -0.75, 709.78, -745.1, 1e30, -1e30,
};

/* Every binade of the format, evenly, then magnitudes from 1e-9 to 1e3, then the special values. */
static void fill(double *x, brume_precision precision) {
    uint64_t state = 1;
    for (int i = 0; i < COUNT; i++) {
        uint64_t bits = test_random_bits(&state);
        if (i >= COUNT * 5 / 8) {
            x[i] = (2 * test_random_unit(&state) - 1) * pow(10, 12 * test_random_unit(&state) - 9);
        } else if (precision == BRUME_PRECISION_DOUBLE) {
            bits = ((uint64_t)i << 44) * 8 / 5 ^ bits >> 20;
            memcpy(&x[i], &bits, sizeof bits);
        } else {
            uint32_t low = (uint32_t)(((uint64_t)i << 12) * 8 / 5) ^ (uint32_t)(bits >> 52);
            float f;
            memcpy(&f, &low, sizeof low);
            x[i] = f;
        }
        if (i >= COUNT - SPECIALS) x[i] = specials[i - (COUNT - SPECIALS)];
        if (precision == BRUME_PRECISION_FLOAT) x[i] = (float)x[i];
    }
}

static double *array(size_t count) {
    double *a = malloc(count * sizeof *a);
    assert_non_null(a);
    return a;
}

static double rounded(long double x, brume_precision precision) {
    return precision == BRUME_PRECISION_DOUBLE ? (double)x : (double)(float)x;
}

/* What is NaN, infinite or zero must be exactly that, with its sign; anything else is within the bound. */
static double compare(const char *name, long double (*reference)(long double), double bound, double limit,
                      brume_precision precision, const double *x, const double *y) {
    double worst = 0;
    for (int i = 0; i < COUNT; i++) {
        long double exact = limit > 0 && !(fabs(x[i]) <= limit) ? NAN : reference(x[i]);
        if (limit > 0 && strstr(name, "turns") && !(fabs(x[i]) <= limit)) continue;
        double r = rounded(exact, precision);
        int same = isnan(r) ? isnan(y[i]) : y[i] == r && !signbit(y[i]) == !signbit(r);
        if (same) continue;
        double error = isnan(r) || isinf(r) || !isfinite(y[i]) ? INFINITY : ulp_error(y[i], exact, precision);
        if (error > bound || (r == 0 && x[i] == 0))
            fail_msg("%s of %.17g is %.17g and should be %.17g: %g ulp", name, x[i], y[i], r, error);
        if (error > worst) worst = error;
    }
    return worst;
}

/* Of float test_functions has more to say. */
static void report(const char *name, brume_precision precision, double bound, double worst) {
    char row[64];
    print_message("%-20s %.3f ulp\n", name, worst);
    if (precision != BRUME_PRECISION_DOUBLE) return;
    snprintf(row, sizeof row, "%s, in double", name);
    stability_row("function", row, "libm in 80 bits", "ulp", bound, worst, "of 2^20 numbers of all magnitudes");
}

static void check_functions(brume_precision precision) {
    if (!device_test_offers(precision)) skip();
    double *x = array(COUNT), *first = array((size_t)COUNT * FUNCTIONS), *y = array((size_t)COUNT * FUNCTIONS);
    double *first_turns = array(COUNT), *turns = array(COUNT);
    fill(x, precision);
    static const uint32_t widths[] = {16, 8, 4, 1};
    for (int w = 0; w < 4; w++) {
        const device_array arrays[] = {{READ_REAL, x, COUNT},
                                       {WRITE_REAL, w ? y : first, (size_t)COUNT * FUNCTIONS},
                                       {WRITE_REAL, w ? turns : first_turns, COUNT}};
        device_test_run(text, NULL, widths[w], precision, COUNT, arrays, 3);
        for (size_t i = 0; w && i < (size_t)COUNT * FUNCTIONS; i++)
            if (memcmp(&y[i], &first[i], sizeof y[i]) != 0 && !(isnan(y[i]) && isnan(first[i])))
                fail_msg("%s of %.17g is %.17g at width 16 and %.17g at width %u", functions[i / COUNT].name,
                         x[i % COUNT], first[i], y[i], widths[w]);
        for (int i = 0; w && i < COUNT; i++)
            if (turns[i] != first_turns[i] && !isnan(turns[i]))
                fail_msg("lsincos_turns differs at width %u", widths[w]);
    }
    for (int f = 0; f < FUNCTIONS; f++) {
        const function *g = &functions[f];
        const double *results = first + (size_t)f * COUNT;
        double bound = g->bound[precision];
        double worst = compare(g->name, g->reference, bound, g->limit[precision], precision, x, results);
        report(g->name, precision, bound, worst);
    }
    double bound = precision == BRUME_PRECISION_FLOAT ? 1 : 2;
    double worst = compare("lsincos_turns: cos", cos_turns, bound, 0x1p20, precision, x, first_turns);
    report("lsincos_turns: cos", precision, bound, worst);
    free(x);
    free(first);
    free(y);
    free(first_turns);
    free(turns);
}

static void functions_in_float(void **state) {
    (void)state;
    check_functions(BRUME_PRECISION_FLOAT);
}

static void functions_in_double(void **state) {
    (void)state;
    check_functions(BRUME_PRECISION_DOUBLE);
}

/* Both arguments of atan2 at all magnitudes, and every pair of special values, signs of zeros included. */
static void check_atan2(brume_precision precision) {
    if (!device_test_offers(precision)) skip();
    static const char text2[] =
        "#include \"math.h\"\n"
        "__kernel void test(__global const real1 *y, __global const real1 *x, __global real1 *out) {\n"
        "    STORE(out + AT, latan2(LOAD(y + AT), LOAD(x + AT)));\n"
        "}\n";
    double *x = array(COUNT), *y = array(COUNT), *out = array(COUNT);
    uint64_t state = 2;
    fill(x, precision);
    for (int i = 0; i < COUNT; i++) {
        y[i] = i % 2 ? x[i] * exp(40 * test_random_unit(&state) - 20) : x[(i + 12345) % COUNT];
        if (i < SPECIALS * SPECIALS) {
            x[i] = specials[i % SPECIALS];
            y[i] = specials[i / SPECIALS];
        }
        x[i] = rounded(x[i], precision);
        y[i] = rounded(y[i], precision);
    }
    const device_array arrays[] = {{READ_REAL, y, COUNT}, {READ_REAL, x, COUNT}, {WRITE_REAL, out, COUNT}};
    device_test_run(text2, NULL, 16, precision, COUNT, arrays, 3);
    double worst = 0;
    for (int i = 0; i < COUNT; i++) {
        long double exact = atan2l(y[i], x[i]);
        double r = rounded(exact, precision);
        int same = isnan(r) ? isnan(out[i]) : out[i] == r && !signbit(out[i]) == !signbit(r);
        if (same) continue;
        double error = isnan(r) || isnan(out[i]) ? INFINITY : ulp_error(out[i], exact, precision);
        if (error > 2 || signbit(r) != signbit(out[i]))
            fail_msg("atan2(%g, %g) is %.17g and should be %.17g: %g ulp", y[i], x[i], out[i], r, error);
        if (error > worst) worst = error;
    }
    report("latan2", precision, 2, worst);
    free(x);
    free(y);
    free(out);
}

static void atan2_in_float(void **state) {
    (void)state;
    check_atan2(BRUME_PRECISION_FLOAT);
}

static void atan2_in_double(void **state) {
    (void)state;
    check_atan2(BRUME_PRECISION_DOUBLE);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(functions_in_float),
        cmocka_unit_test(functions_in_double),
        cmocka_unit_test(atan2_in_float),
        cmocka_unit_test(atan2_in_double),
    };
    return cmocka_run_group_tests(tests, device_test_setup, device_test_teardown);
}

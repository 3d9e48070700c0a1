/* hazards.c -- see hazards.h. */
#include "hazards.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "device_test.h"
#include "stability.h"

enum { COUNT = 1 << 16 };

static double in[HAZARD_INPUTS][COUNT], out[2][COUNT];

static const char kernel[] =
    "%s"
    "__kernel void test(__global const real1 *in, __global real1 *out) {\n"
    "    uint total = get_global_size(0) * LANES, at = AT;\n"
    "    real a = LOAD(in + at), b = LOAD(in + total + at), c = LOAD(in + 2 * total + at);\n"
    "    real d = LOAD(in + 3 * total + at), e = LOAD(in + 4 * total + at), f = LOAD(in + 5 * total + at);\n"
    "    real g = LOAD(in + 6 * total + at), h = LOAD(in + 7 * total + at);\n"
    "    { real y; %s; STORE(out + at, y); }\n"
    "    { real y; %s; STORE(out + total + at, y); }\n"
    "}\n";

void hazard_check(const hazard *it) {
    if (!device_test_offers(BRUME_PRECISION_FLOAT)) skip();
    static char text[8192];
    uint64_t seed = 1;
    double worst[2] = {-1, -1};
    uint32_t where[2] = {0, 0};
    int size = snprintf(text, sizeof text, kernel, it->headers, it->ours, it->naive);
    assert_true(size > 0 && size < (int)sizeof text);
    for (uint32_t i = 0; i < COUNT; i++) {
        double one[HAZARD_INPUTS] = {0};
        it->make(&seed, i, one);
        for (int k = 0; k < HAZARD_INPUTS; k++) in[k][i] = (float)one[k];
    }
    const device_array arrays[] = {{READ_REAL, in, sizeof in / sizeof(double)},
                                   {WRITE_REAL, out, sizeof out / sizeof(double)}};
    device_test_run(text, "-DBVH_STACK=32", 8, BRUME_PRECISION_FLOAT, COUNT, arrays, 2);
    for (int which = 0; which < 2; which++)
        for (uint32_t i = 0; i < COUNT; i++) {
            double one[HAZARD_INPUTS];
            for (int k = 0; k < HAZARD_INPUTS; k++) one[k] = in[k][i];
            double error = it->error(one, out[which][i]);
            if (isnan(error)) error = INFINITY;
            if (error > worst[which]) worst[which] = error, where[which] = i;
        }
    char place[160];
    int used = snprintf(place, sizeof place, "naive %.2g; ", worst[1]);
    for (int k = 0; k < HAZARD_INPUTS; k++) {
        double value = in[k][where[0]];
        if (value != 0) used += snprintf(place + used, sizeof place - (size_t)used, k ? " %.6g" : "%.6g", value);
    }
    print_message("%-44s %.3g, naive %.3g\n", it->name, worst[0], worst[1]);
    stability_row("hazard", it->name, it->reference, it->unit, it->tolerance, worst[0], "%s", place);
    if (!(worst[1] > it->tolerance))
        fail_msg("%s: the naive formula is off by %.3g only: these numbers prove nothing", it->name, worst[1]);
}

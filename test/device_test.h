/* device_test.h -- device functions on arrays of numbers: a test writes a kernel of a few lines around the function,
 * and compares what comes back with its double twin on the host.
 *
 * A kernel text starts with the #includes of cl/ that it needs and holds one kernel named `test`. A work-item serves
 * LANES elements, the first of them AT. This prelude comes before it (after lane.h):
 *     LOAD(p), STORE(p, x)            real from / to LANES places of a `__global real1 *`
 *     LOAD_BITS(p), STORE_BITS(p, x)  the same for ureal32 and `__global uint *`
 *     STORE_MASK(p, m)                1 or 0 as uint
 * Real arrays are double on the host whatever the precision on the device.
 */
#ifndef DEVICE_TEST_H
#define DEVICE_TEST_H

#include <stddef.h>
#include <stdint.h>

#include "brume.h"

/* For options: features by name, FEATURES_ARE("FEATURE_MEDIA|FEATURE_NULL"), and those of fog of any kind. */
#define FEATURES_ARE(names) "-DFEATURES=(" names ")"
#define FOG_FEATURES "FEATURE_MEDIA|FEATURE_SCATTERING|FEATURE_FLIGHTS|FEATURE_CHROMATIC|FEATURE_ANISOTROPY"
#define BEAM_FEATURES FOG_FEATURES "|FEATURE_DELTA_LIGHTS"

typedef enum device_array_kind {
    READ_REAL,  /* double * on the host, rounded to the device's precision */
    WRITE_REAL,
    READ_BITS,  /* uint32_t * */
    WRITE_BITS,
    READ_RAW    /* any struct; count is in bytes */
} device_array_kind;

typedef struct device_array {
    device_array_kind kind;
    void *data;
    size_t count;
} device_array;

/* Opens the first device for all tests of a program; use as cmocka group setup and teardown. */
int device_test_setup(void **state);
int device_test_teardown(void **state);

/* 0 where there is no OpenCL device, or none with doubles: then the test is to skip(). */
int device_test_offers(brume_precision precision);

/* Builds the text, runs kernel `test` over `elements` (a multiple of 16) and reads back what it wrote. The arrays are
 * its parameters in order. Fails the running test with the library's message, the build log included, if anything goes
 * wrong. `options` may be NULL. */
void device_test_run(const char *text, const char *options, uint32_t lanes, brume_precision precision, size_t elements,
                     const device_array *arrays, size_t array_count);

/* A planted bug: the kernel text behind a header of cl/ in which `from` has become `to`, so that the kernel includes
 * the header no more. Valid until the next call. Fails the running test if there is no `from`. */
const char *device_test_plant(const char *header, const char *from, const char *to, const char *kernel);

/* Pseudo-random numbers that owe nothing to the code under test (splitmix64: Steele, Lea & Flood 2014). */
uint64_t test_random_bits(uint64_t *state);
/* In [0, 1), multiples of 2^-24: the variates that the device uses in float. */
double test_random_unit(uint64_t *state);
double test_random_in(uint64_t *state, double low, double high); /* in [low, high) */

/* |x - y| in units of the last place of y as a float, or as a double. */
double ulp_error(long double x, long double y, brume_precision precision);

#endif

/* test_precision.c -- float against double, from the same random numbers, sample by sample.
 *
 * What float rounds is 1e-7; along a path that becomes 1e-5 and more, and now and then another branch: a shadow ray
 * that just misses, another lamp, one more reflection inside a glass ball. (Variates have 24 bits in float and 32 in
 * double, so that they, too, differ by 6e-8.) A sample counts as different from 1e-4 on, and one in a hundred may be.
 * measure_agreement says it of every scene, and which sample differs most; render-cli --debug-sample then shows where.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "open_device.h"
#include "planted.h"
#include "sample_pairs.h"
#include "stability.h"

#define MOST_DIFFERENT 0.01

/* The share of samples off by more than 1e-4. */
static double share_different(const char *path, uint32_t samples) {
    const sample_maker makers[2] = {{device, BRUME_PRECISION_FLOAT, 1}, {device, BRUME_PRECISION_DOUBLE, 1}};
    brume_scene *scene;
    must(brume_scene_load(context, path, NULL, 0, &scene));
    sample_pairs p = sample_pairs_compare(context, scene, makers, samples);
    brume_scene_destroy(scene);
    if (p.message) fail_msg("%s: %s", path, p.message);
    assert_int_equal(p.bad, 0);
    assert_true(p.mean > 0 && p.different > p.count / 10); /* they are two programs, and there is something to see */
    print_message("%s: %u of %u samples off by 1e-4, at most %.3g of the mean, pixel %u, %u sample %u\n", path,
                  p.above[1], p.count, p.worst / p.mean, p.worst_x, p.worst_y, p.worst_sample);
    return (double)p.above[1] / p.count;
}

static void hardly_a_sample_differs(void **state) {
    (void)state;
    brume_device_info info;
    NEEDS_DEVICE();
    must(brume_device_describe(context, BRUME_DEVICE_ANY, &info));
    if (!info.has_double) skip();
    static const char *const paths[] = {"scenes/ladder/half-hidden.xml", "scenes/ladder/hundred-spots.xml",
                                        "scenes/glass-in-fog.xml"};
    for (size_t i = 0; i < sizeof paths / sizeof paths[0]; i++)
        stability_row("double", paths[i] + 7, "the kernels in double", "of samples off by 1e-4", MOST_DIFFERENT,
                      share_different(paths[i], 2), "the middle of the picture");
}

/* Losses of precision in float, none of which shows in the picture. */
static void lost_digits_are_found(void **state) {
    (void)state;
    brume_device_info info;
    NEEDS_DEVICE();
    must(brume_device_describe(context, BRUME_DEVICE_ANY, &info));
    if (!info.has_double) skip();
    static const struct { const char *what, *file, *right, *wrong; } plants[] = {
        {"16 bits of a variate", "random.h", "return to_real(as_ireal(bits >> U32(8))) * R(5.9604644775390625e-8);",
         "return to_real(as_ireal(bits >> U32(16))) * R(1.52587890625e-5);"},
        {"12 bits of a length in fog", "medium.h",
         "FN rgb medium_transmittance(rgb sigma_t, real t) {\n",
         "FN rgb medium_transmittance(rgb sigma_t, real t) {\n"
         "#ifndef BRUME_DOUBLE\n"
         "    t = as_real(as_ireal(t) & I(~0xfff));\n"
         "#endif\n"},
    };
    for (size_t i = 0; i < sizeof plants / sizeof plants[0]; i++) {
        planted_bug(plants[i].file, plants[i].right, plants[i].wrong);
        double share = share_different("scenes/glass-in-fog.xml", 1);
        planted_remove();
        if (!(share > 3 * MOST_DIFFERENT)) fail_msg("%s: only %.3g of the samples differ", plants[i].what, share);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(hardly_a_sample_differs),
        cmocka_unit_test(lost_digits_are_found),
    };
    return cmocka_run_group_tests(tests, open_device, close_device);
}

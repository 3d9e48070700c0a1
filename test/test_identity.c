/* test_identity.c -- does a picture depend on code that its scene doesn't call for? Scene files by the program built for
 * them, by the generic one and by some between the two, to the bit. `make identity` does it with every scene, each
 * feature alone, and at two widths. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "../cl/shared.h"
#include "identity.h"
#include "open_device.h"
#include "planted.h"

/* All but the wood and two of the bunny, whose programs nobody else shares: they would take a third of the time. PoCL
 * keeps what it has built. */
static const char *const scenes[] = {
    "scenes/emission-slab.xml", "scenes/furnace.xml", "scenes/glass-in-fog.xml", "scenes/one-spot.xml",
    "scenes/three-spots.xml", "scenes/ladder/area-light.xml", "scenes/ladder/environment-fog.xml",
    "scenes/ladder/fog-box.xml", "scenes/ladder/forward-fog.xml", "scenes/ladder/half-hidden.xml",
    "scenes/ladder/hundred-spots.xml", "scenes/ladder/open-beam.xml", "scenes/ladder/slats.xml", "scenes/ladder/soft-lamp.xml",
    "scenes/ladder/thick-fog.xml", "scenes/ladder/thin-fog.xml", "scenes/ladder/three-spots.xml",
};

static identity scene;

static void expect_same(const char *path, uint32_t extra, int generic) {
    const identity_program program = {extra, generic, 1};
    int different = identity_differs(&scene, &program);
    if (different < 0) fail_msg("%s with features %u more: %s", path, extra, brume_context_message(context));
    if (different > 0)
        fail_msg("%s with features %u more: %d of %d values are others", path, extra, different, IDENTITY_FLOATS);
}

static void the_generic_program_gives_the_same_bits(void **state) {
    (void)state;
    NEEDS_DEVICE();
    for (size_t i = 0; i < sizeof scenes / sizeof scenes[0]; i++) {
        must(identity_open(context, device, scenes[i], &scene));
        assert_in_range(scene.lit, IDENTITY_FLOATS / 4, IDENTITY_FLOATS);
        expect_same(scenes[i], identity_spare(&scene), 1);
        identity_close(&scene);
    }
}

/* Every other feature that a scene does without, and the others. */
static void halves_of_the_rest_give_the_same_bits(void **state) {
    (void)state;
    NEEDS_DEVICE();
    const char *const some[] = {"scenes/emission-slab.xml", "scenes/ladder/thin-fog.xml"};
    for (size_t i = 0; i < sizeof some / sizeof some[0]; i++) {
        must(identity_open(context, device, some[i], &scene));
        uint32_t spare = identity_spare(&scene), half[2] = {0};
        for (int k = 0; spare; k++, spare &= spare - 1) half[k % 2] |= spare & (0u - spare);
        for (int k = 0; k < 2; k++) expect_same(some[i], half[k], 0);
        identity_close(&scene);
    }
}

/* Grey media, off by an ulp where nothing is chromatic. */
static void an_ulp_is_found(void **state) {
    (void)state;
    NEEDS_DEVICE();
    const identity_program chromatic = {FEATURE_CHROMATIC, 0, 1};
    planted_bug("medium.h", "cscale(m->emission, transmittance_integral(m->sigma_t.r, t))",
                "cscale(m->emission, transmittance_integral(m->sigma_t.r * R(1.0000001f), t))");
    must(identity_open(context, device, "scenes/emission-slab.xml", &scene));
    assert_in_range(identity_differs(&scene, &chromatic), 1, IDENTITY_FLOATS);
    identity_close(&scene);
    planted_remove();
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_generic_program_gives_the_same_bits),
        cmocka_unit_test(halves_of_the_rest_give_the_same_bits),
        cmocka_unit_test(an_ulp_is_found),
    };
    return cmocka_run_group_tests(tests, open_device, close_device);
}

/* test_functions.c -- the device's functions of one and of two numbers against exact values (function_cases.h): a
 * sample of every function in seconds, to the bounds that `make exhaustive` has found over all inputs.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "function_sweep.h"
#include "open_device.h"
#include "planted.h"
#include "stability.h"

enum { SAMPLES = 1 << 16 };

static void every_function_keeps_its_bound(void **state) {
    (void)state;
    NEEDS_DEVICE();
    function_sweep *sweep;
    must(function_sweep_create(context, device, NULL, &sweep));
    char failed[1024] = "";
    for (uint32_t i = 0; function_case_at(i); i++) {
        const function_case *c = function_case_at(i);
        function_worst worst;
        char place[128];
        must(function_sweep_some(sweep, c, SAMPLES, &worst));
        function_worst_place(c, &worst, place, sizeof place);
        print_message("%-32s %.4g %s at %s: %.9g\n", c->name, worst.error, c->unit, place, (double)worst.at.y);
        if (!(worst.error <= c->bound)) {
            size_t used = strlen(failed);
            snprintf(failed + used, sizeof failed - used, "\n%s: %.4g %s at %s, %.4g are allowed", c->name, worst.error,
                     c->unit, place, c->bound);
        } else {
            stability_row("function", c->name, c->reference, c->unit, c->bound, worst.error, "%s", place);
        }
    }
    function_sweep_destroy(sweep);
    if (failed[0]) fail_msg("%s", failed);
}

/* Planted: what is only a little wrong, or only somewhere. */
static void wrong_functions_are_noticed(void **state) {
    (void)state;
    NEEDS_DEVICE();
    static const struct { const char *name, *file, *right, *wrong; } bugs[] = {
        {"lexp", "math.h", "1.38979522e-3", "1.44e-3"},                          /* the last coefficient, by 4 % */
        {"llog", "math.h", "x < R(REAL_MIN_NORMAL)", "x < R(0)"},                /* denormals */
        {"latan2", "math.h", "as_ireal(x) < I(0); /* -0", "x < R(0); /* -0"},    /* the sign of zero */
        {"lexpm1", "math.h", "x < R(EXPM1_MIN) ? R(-1) : y", "y"},
        {"transmittance_quantile", "scatter_point.h", "-llog1p(u * lexpm1(-tau))", "-llog(R(1) + u * lexpm1(-tau))"},
        {"equiangular_sample", "equiangular.h", "latan2(D * (t1 - t0), fma(t0, t1, square(D)))",
         "latan2(t1, D) - latan2(t0, D)"},
        {"unit_positive", "random.h", "fma(to_real(bits), R(2.3283064365386963e-10), R(2.3283064365386963e-10))",
         "fma(to_real(bits), R(2.3283064365386963e-10), R(0))"},
        {"lasinh", "path_indirect.h", "a > R(1e18)", "a > R(1e38)"},
        {"power_heuristic", "heuristic.h", "real r = b / lmax(a, R(1e-37));", "real r = b / a;"},
        {"fresnel_conductor", "fresnel.h", "square(ac - sin2) + b2c2 + R(1e-30)", "square(ac - sin2) + b2c2"},
        {"fresnel_conductor", "fresnel.h", "fma(eta - R(1), eta + R(1), fma(-k, k, c2))",
         "fma(eta - k, eta + k, -sin2)"},
        {"gaussian_moment", "microfacet.h", "*gauss * R(1 / SQRT_PI) -", "*gauss * R(0.56419) -"},
        {"microfacet_area", "microfacet.h", "sqrt(fma(w.z, w.z, r2))", "sqrt(fma(w.z, w.z, r2 + R(1e-9)))"},
        {"microfacet_density", "microfacet.h", "square(m.x / d->alpha_u)", "square(R(1.000001) * m.x / d->alpha_u)"},
        {"beckmann_sample_visible: remainder", "microfacet.h", "#define BECKMANN_STEPS 4", "#define BECKMANN_STEPS 2"},
        {"ggx_sample_visible: slope", "microfacet.h", "(R(1) - v) * (R(1) + stretched.z)",
         "(R(0.999999) - v) * (R(1) + stretched.z)"},
    };
    for (size_t i = 0; i < sizeof bugs / sizeof bugs[0]; i++) {
        function_sweep *sweep;
        function_worst worst = {0};
        double over = 0;
        planted_bug(bugs[i].file, bugs[i].right, bugs[i].wrong);
        brume_result result = function_sweep_create(context, device, bugs[i].name, &sweep);
        planted_remove();
        must(result);
        for (uint32_t k = 0; function_case_at(k); k++) {
            const function_case *c = function_case_at(k);
            if (strcmp(c->name, bugs[i].name) != 0) continue;
            must(function_sweep_some(sweep, c, SAMPLES, &worst));
            over = worst.error - c->bound;
        }
        function_sweep_destroy(sweep);
        if (!(over > 0)) fail_msg("%s: a planted bug is not noticed (%g)", bugs[i].name, worst.error);
    }
}

/* The reference for phase_hg_sample, an arrangement of the textbook's inverse, agrees with it where that has digits. */
static void the_phase_function_is_inverted_as_in_the_textbook(void **state) {
    (void)state;
    for (int i = 1; i < 100; i++)
        for (int k = 1; k < 100; k++) {
            long double g = k / 100.0L, u = i / 100.0L, root = (1 - g * g) / (1 - g + 2 * g * u);
            long double v = 1 - (1 + g * g - root * root) / (2 * g);
            long double arranged = 2 * (1 - g) * (1 - g) * (1 - u) * (1 + g * u) / powl(1 - g + 2 * g * u, 2);
            assert_true(fabsl(arranged - v) < 1e-16L);
        }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_function_keeps_its_bound),
        cmocka_unit_test(wrong_functions_are_noticed),
        cmocka_unit_test(the_phase_function_is_inverted_as_in_the_textbook),
    };
    return cmocka_run_group_tests(tests, open_device, close_device);
}

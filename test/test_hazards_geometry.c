/* test_hazards_geometry.c -- where a textbook formula of geometry loses its digits, ours against the naive one
 * (hazards.h): edge functions, bases of directions, points on large surfaces, origins of rays that leave them.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "device_test.h"
#include "hazards.h"

static double in_octaves(uint64_t *seed, double low, double high) {
    return low * pow(high / low, test_random_unit(seed));
}

/* ---- products ---------------------------------------------------------------------------------------------------- */

/* a b and c d agree in many digits. */
static void make_products(uint64_t *seed, uint32_t i, double in[HAZARD_INPUTS]) {
    (void)i;
    in[0] = (float)in_octaves(seed, 1e-3, 1e3);
    in[1] = (float)in_octaves(seed, 1e-3, 1e3);
    in[2] = (float)in_octaves(seed, 1e-3, 1e3);
    in[3] = in[0] * in[1] / in[2] * (1 + in_octaves(seed, 1e-9, 1e-3));
}

/* Products of floats are exact in double, their difference rounds once. */
static double products_error(const double in[HAZARD_INPUTS], double y) {
    double exact = in[0] * in[1] - in[2] * in[3];
    return exact == 0 ? (y == 0 ? 0 : (double)INFINITY) : ulp_error(y, exact, BRUME_PRECISION_FLOAT);
}

static void difference_of_nearly_equal_products(void **state) {
    (void)state;
    hazard_check(&(hazard){"a b - c d, nearly equal: a triangle's edge", "exact in double", "ulp",
                           "#include \"vec.h\"\n", "y = difference_of_products(a, b, c, d)", "y = a * b - c * d",
                           make_products, products_error, 1.5});
}

/* The same for the eight triangles of a block, whose sign decides what is hit: Kahan's, as above, gives the sign. */
static double sign_error(const double in[HAZARD_INPUTS], double y) {
    double exact = in[0] * in[1] - in[2] * in[3];
    return (exact > 0) == (y > 0) && (exact < 0) == (y < 0) ? 0 : 1;
}

static void side_of_an_edge(void **state) {
    (void)state;
    hazard_check(&(hazard){"side of a triangle's edge", "exact in double", "wrong sides",
                           "#include \"vec.h\"\n#include \"wide.h\"\n",
                           "lanes_of_real p, q, r, s, t; p.all = a; q.all = b; r.all = c; s.all = d; "
                           "for (int k = 0; k < LANES; k++) { lanes_of_wide w; "
                           "w.all = wide_difference((wide)p.one[k], (wide)q.one[k], (wide)r.one[k], (wide)s.one[k]); "
                           "t.one[k] = w.one[3]; } y = t.all",
                           "y = a * b - c * d", make_products, sign_error, 0});
}

/* ---- directions -------------------------------------------------------------------------------------------------- */

/* Unit vectors close to -z, -z itself, and any. */
static void make_downward(uint64_t *seed, uint32_t i, double in[HAZARD_INPUTS]) {
    double phi = 6.283185307179586 * test_random_unit(seed), angle = i % 4 ? in_octaves(seed, 1e-9, 3) : 0;
    in[0] = sin(angle) * cos(phi);
    in[1] = sin(angle) * sin(phi);
    in[2] = -cos(angle);
    in[3] = i % 3;
}

/* What the three vectors' products are off by; y is the largest. */
static double basis_error(const double in[HAZARD_INPUTS], double y) { return (void)in, y; }

#define PRODUCTS \
    " vec n = vmake(a, b, c); real p = fabs(vdot(t, t) - R(1)), q = fabs(vdot(s, s) - R(1)), u = fabs(vdot(t, s)), " \
    "v = fabs(vdot(t, n)), w = fabs(vdot(s, n)); y = p + q + u + v + w; y = y == y ? y : REAL_INF"

static void basis_around_a_direction(void **state) {
    (void)state;
    hazard_check(&(hazard){"orthonormal basis around -z", "its own products", "absolute",
                           "#include \"math.h\"\n#include \"vec.h\"\n",
                           "vec t, s; orthonormal_basis(vmake(a, b, c), &t, &s);" PRODUCTS,
                           /* Frisvad 2012 */
                           "real k = R(1) / (R(1) + c), m = -a * b * k; vec t = vmake(R(1) - a * a * k, m, -a); "
                           "vec s = vmake(m, R(1) - b * b * k, -b);" PRODUCTS,
                           make_downward, basis_error, 1e-6});
}

/* ---- surfaces ---------------------------------------------------------------------------------------------------- */

/* Along one axis: a triangle's vertices far away (a, b, c), weights (d, e) of a point near 0. */
static void make_large_triangle(uint64_t *seed, uint32_t i, double in[HAZARD_INPUTS]) {
    double size = in_octaves(seed, 1e-6, 1e6);
    (void)i;
    in[0] = (float)(-size * (1 + test_random_unit(seed)));
    in[1] = (float)(size * (1 + test_random_unit(seed)));
    in[2] = (float)(size * (1 + test_random_unit(seed)));
    in[3] = (float)(0.5 * test_random_unit(seed));
    /* a + u (b - a) + v (c - a) close to 0 */
    double rest = in[0] + in[3] * (in[1] - in[0]);
    in[4] = -rest / (in[2] - in[0]) * (1 + in_octaves(seed, 1e-5, 1e-2));
}

/* Twice a float's digits of the triangle, once a float's of the point. */
static double mix_error(const double in[HAZARD_INPUTS], double y) {
    long double a = in[0], exact = a + in[3] * (in[1] - a) + in[4] * (in[2] - a);
    double size = fmax(-in[0], fmax(in[1], in[2])), ulp = exact == 0 ? 0 : ldexp(1, ilogb((double)exact) - 23);
    return (double)fabsl(y - exact) / fmax(ulp, size * 0x1p-46);
}

static void point_of_a_large_triangle(void **state) {
    (void)state;
    hazard_check(&(hazard){"point of a large triangle near 0", "80 bits",
                           "ulp of the point, or 2^-46 of the triangle",
                           "#include \"geometry.h\"\n", "y = exact_mix(a, b, c, d, e)",
                           "y = a + d * (b - a) + e * (c - a)", make_large_triangle, mix_error, 1});
}

/* A point at any scale, a normal, a direction. */
static void make_surface_point(uint64_t *seed, uint32_t i, double in[HAZARD_INPUTS]) {
    double scale = in_octaves(seed, 1e-9, 1e9);
    (void)i;
    for (int k = 0; k < 3; k++) in[k] = scale * (2 * test_random_unit(seed) - 1);
    in[3] = 0.6, in[4] = -0.48, in[5] = 0.64;
    in[6] = test_random_unit(seed) < 0.5 ? -1 : 1;
}

/* y: how far it was moved to the side asked for, in ulp of its largest coordinate. Enough is 2, for rounding; 24 is
 * more than the sides' and the rounding's share of the 16 promised. */
static double offset_error(const double in[HAZARD_INPUTS], double y) {
    double size = fmax(fabs(in[0]), fmax(fabs(in[1]), fabs(in[2]))), ulp = ldexp(1, ilogb(size) - 23), ulps = y / ulp;
    return ulps < 2 ? (double)INFINITY : fmax(log2(ulps / 16), 0);
}

#define MOVED(by) \
    "vec p = vmake(a, b, c), n = vmake(d, e, f), o = " by "; y = g * vdot(vsub(o, p), n)"

static void origin_of_a_ray_that_leaves(void **state) {
    (void)state;
    hazard_check(&(hazard){"origin of a ray that leaves a surface, scales 1e-9 to 1e9", "8 to 16 ulp",
                           "octaves beyond 16 ulp", "#include \"geometry.h\"\n",
                           MOVED("offset_origin(p, n, vscale(n, g))"), MOVED("vmad(n, g * R(1e-4), p)"),
                           make_surface_point, offset_error, 0.25});
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(difference_of_nearly_equal_products),
        cmocka_unit_test(side_of_an_edge),
        cmocka_unit_test(basis_around_a_direction),
        cmocka_unit_test(point_of_a_large_triangle),
        cmocka_unit_test(origin_of_a_ray_that_leaves),
    };
    return cmocka_run_group_tests(tests, device_test_setup, device_test_teardown);
}

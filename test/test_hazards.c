/* test_hazards.c -- where a textbook formula loses its digits: distances, angles, samples, densities and sums of light
 * in fog, ours against the naive one (hazards.h). All in float, references in 80 bits of the very same floats.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "../cl/shared.h"
#include "device_test.h"
#include "hazards.h"
#include "stability.h"

#define PI 3.14159265358979323846264338327950288L

static double in_range(uint64_t *seed, double low, double high) { return low + (high - low) * test_random_unit(seed); }
static double in_octaves(uint64_t *seed, double low, double high) {
    return low * pow(high / low, test_random_unit(seed));
}

/* A unit vector, evenly. */
static void direction(uint64_t *seed, double v[3]) {
    double z = in_range(seed, -1, 1), phi = in_range(seed, 0, 2 * (double)PI), r = sqrt(1 - z * z);
    v[0] = r * cos(phi), v[1] = r * sin(phi), v[2] = z;
}

/* A unit vector at `angle` from the unit vector `axis`. */
static void aside(uint64_t *seed, const double axis[3], double angle, double v[3]) {
    double side[3], along = 0, size = 0;
    direction(seed, side);
    for (int k = 0; k < 3; k++) along += side[k] * axis[k];
    for (int k = 0; k < 3; k++) side[k] -= along * axis[k], size += side[k] * side[k];
    for (int k = 0; k < 3; k++) v[k] = cos(angle) * axis[k] + sin(angle) * side[k] / sqrt(size);
}

static long double dot(const long double a[3], const long double b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void unit_of(const double *from, long double v[3]) {
    for (int k = 0; k < 3; k++) v[k] = from[k];
    long double size = sqrtl(dot(v, v));
    for (int k = 0; k < 3; k++) v[k] /= size;
}

/* 1 - cos of the angle between the directions of a and b, however small. */
static long double versine_between(const double *a, const double *b) {
    long double u[3], v[3], off[3];
    unit_of(a, u);
    unit_of(b, v);
    for (int k = 0; k < 3; k++) off[k] = u[k] - v[k];
    return dot(off, off) / 2;
}

/* ---- along a ray ------------------------------------------------------------------------------------------------- */

/* The lamp at a, b, c; the ray from 0 along d, e, f, which passes it closely. */
static void make_close_pass(uint64_t *seed, uint32_t i, double in[HAZARD_INPUTS]) {
    double d[3], w[3], far = in_octaves(seed, 1, 1e4);
    (void)i;
    direction(seed, d);
    aside(seed, d, in_octaves(seed, 1e-6, 0.1), w);
    for (int k = 0; k < 3; k++) in[k] = far * w[k], in[3 + k] = d[k];
}

static double distance_error(const double in[HAZARD_INPUTS], double y) {
    long double d[3], w[3] = {in[0], in[1], in[2]}, e[3];
    unit_of(in + 3, d);
    long double delta = dot(w, d), largest = 0;
    for (int k = 0; k < 3; k++) e[k] = w[k] - delta * d[k], largest = fmaxl(largest, fabsl(w[k]));
    /* closer than the rounding of the lamp's place it is nowhere */
    long double exact = fmaxl(sqrtl(dot(e, e)), largest * 0x1p-21L);
    return (double)(fabsl(y - exact) / sqrtl(dot(w, w)));
}

#define POINT_LAMP \
    "lamp l; l.position = vmake(a, b, c); l.axis = vmake(R(0), R(0), R(1)); l.cone = l.cosine = FALSE_MASK;" \
    "l.v_cutoff = R(2); "

static void distance_from_the_ray(void **state) {
    (void)state;
    hazard_check(&(hazard){
        "distance of a lamp from a ray", "projection in 80 bits", "of its distance", "#include \"beam.h\"\n",
        POINT_LAMP "beam m = beam_of(&l, vmake(R(0), R(0), R(0)), vmake(d, e, f), R(1e6)); y = m.D",
        "real delta = a * d + b * e + c * f; y = sqrt(lmax(a * a + b * b + c * c - delta * delta, R(0)))",
        make_close_pass, distance_error, 2e-7});
}

/* D, t0, t1 - far along the ray, or a short piece of it, or both. */
static void make_far_segment(uint64_t *seed, uint32_t i, double in[HAZARD_INPUTS]) {
    in[0] = in_octaves(seed, 1e-3, 1e2);
    in[1] = (float)((i & 1 ? -1 : 1) * in_octaves(seed, 1e-2, 1e5));
    in[2] = in[1] + fmax(fabs(in[1]) * in_octaves(seed, 1e-5, 10), 1e-4);
    in[3] = test_random_unit(seed);
}

static long double angle_between(long double D, long double t0, long double t1) {
    return atan2l(D * (t1 - t0), D * D + t0 * t1);
}

static double width_error(const double in[HAZARD_INPUTS], double y) {
    return (double)fabsl(y / angle_between(in[0], in[1], in[2]) - 1);
}

static void angle_of_a_far_segment(void **state) {
    (void)state;
    hazard_check(&(hazard){
        "angle of a far, short segment", "atan2 in 80 bits", "relative", "#include \"equiangular.h\"\n",
        "y = equiangular_range_of(a, b, c).width", "y = latan2(c, a) - latan2(b, a)", make_far_segment, width_error,
        4e-7});
}

/* By length and by the size of t, whose last digit is all that a float has; outside of the segment nothing is right. */
static double point_error(const double in[HAZARD_INPUTS], double y) {
    long double D = in[0], t0 = in[1], t1 = in[2], u = in[3], all = angle_between(D, t0, t1);
    int left = u < 0.5L;
    long double end = left ? t0 : -t1, turn = (left ? u : 1 - u) * all;
    long double t = D * (end * cosl(turn) + D * sinl(turn)) / (D * cosl(turn) - end * sinl(turn));
    if (!(y >= in[1] && y <= in[2])) return INFINITY;
    return (double)(fabsl(y - (left ? t : -t)) / (fmaxl(t1 - t0, fmaxl(fabsl(t0), fabsl(t1)))));
}

static void equiangular_points(void **state) {
    (void)state;
    hazard_check(&(hazard){
        "equiangular point of a far segment", "sum formula of the tangent, 80 bits", "of the larger of length and |t|",
        "#include \"equiangular.h\"\n",
        "equiangular_range r = equiangular_range_of(a, b, c); y = equiangular_sample(&r, d)",
        "real p = latan2(b, a), q = latan2(c, a), s, k; lsincos(p + d * (q - p), &s, &k); y = a * s / k",
        make_far_segment, point_error, 1e-6});
}

/* tau, u */
static void make_thin(uint64_t *seed, uint32_t i, double in[HAZARD_INPUTS]) {
    (void)i;
    in[0] = in_octaves(seed, 1e-9, 1e-2);
    in[1] = test_random_unit(seed);
}

static double quantile_error(const double in[HAZARD_INPUTS], double y) {
    return (double)fabsl(y + log1pl(in[1] * expm1l(-(long double)in[0])) / in[0]);
}

static void point_in_thin_fog(void **state) {
    (void)state;
    hazard_check(&(hazard){
        "point by transmittance in thin fog", "log1p, expm1 in 80 bits", "of the length",
        "#include \"scatter_segment.h\"\n", "y = transmittance_quantile(a, R(1), b)",
        "y = -llog(R(1) - b * (R(1) - lexp(-a))) / a", make_thin, quantile_error, 3e-7});
}

static double absorbed_error(const double in[HAZARD_INPUTS], double y) {
    return (double)fabsl(y / (-expm1l(-(long double)in[0]) / in[0]) - 1);
}

static void share_absorbed_by_thin_fog(void **state) {
    (void)state;
    hazard_check(&(hazard){
        "light lost or gained in thin fog", "expm1 in 80 bits", "relative", "#include \"medium.h\"\n",
        "y = transmittance_integral(a, R(1))", "y = (R(1) - lexp(-a)) / a", make_thin, absorbed_error, 3e-7});
}

/* ---- flights and depths ------------------------------------------------------------------------------------------ */

static void make_longest(uint64_t *seed, uint32_t i, double in[HAZARD_INPUTS]) {
    (void)seed;
    (void)i;
    in[0] = 1;
}

/* Of 2^32 words one flies the farthest. */
static double longest_error(const double in[HAZARD_INPUTS], double y) {
    (void)in;
    return fabs(y / (32 * log(2.0)) - 1);
}

static void longest_flight(void **state) {
    (void)state;
    hazard_check(&(hazard){
        "longest free flight, 32 ln 2", "closed form", "relative", "#include \"medium.h\"\n",
        "y = -llog(unit_positive(U32(0)))", "y = -llog(R(1) - unit(U32(0xffffffffu)))", make_longest, longest_error,
        1e-6});
}

/* Two channels, up to depths of which a float transmittance has no digits left. */
static void make_deep(uint64_t *seed, uint32_t i, double in[HAZARD_INPUTS]) {
    (void)i;
    in[0] = in_octaves(seed, 1, 30);
    in[1] = in[0] * in_range(seed, 1, 1.2);
    in[2] = in_octaves(seed, 1, 100) / in[0];
}

/* What passes, one channel relative to the mean of all three: 3 / (1 + 2 exp(-(b - a) c)). The rounding of the depth's
 * difference, as large as the depth, is the exponential's error. */
static double weight_error(const double in[HAZARD_INPUTS], double y) {
    long double depth = ((long double)in[1] - in[0]) * in[2], exact = 3 / (1 + 2 * expl(-depth));
    return (double)(fabsl(y / exact - 1) / (1 + depth));
}

static void thick_coloured_fog(void **state) {
    (void)state;
    hazard_check(&(hazard){
        "weight of a flight through thick coloured fog", "exp of the difference, 80 bits", "relative, over 1 + depth",
        "#include \"medium.h\"\n",
        "medium m = medium_none(); m.sigma_t = cmake(a, b, b); m.albedo = cgrey(R(1)); "
        "y = medium_flight(&m, cgrey(R(1)), c, R(0), R(0x1p-149f)).weight.r",
        "real p = lexp(-a * c), q = lexp(-b * c); y = p / lmax((p + q + q) * R(1.0 / 3), R(1e-37))", make_deep,
        weight_error, 3e-7});
}

/* Half of the depth to the eye and half to the lamp, seen through a lens that makes up for it. */
static void make_two_ways(uint64_t *seed, uint32_t i, double in[HAZARD_INPUTS]) {
    (void)i;
    in[0] = in_range(seed, 80, 100);
    in[1] = in_range(seed, 80, 100);
    in[2] = in_range(seed, in[0] + in[1] - 10, in[0] + in[1]);
}

static double relative_depth_error(const double in[HAZARD_INPUTS], double y) {
    long double depth = (long double)in[0] + in[1] - in[2];
    return (double)(fabsl(y / expl(-depth) - 1) / (in[0] + in[1]));
}

static void depths_before_exponentials(void **state) {
    (void)state;
    hazard_check(&(hazard){
        "transmittances compared at depth 200", "exp of the difference, 80 bits", "relative, over the depth",
        "#include \"medium.h\"\n", "y = medium_transmittance(cgrey(R(1)), a + b - c).r",
        "y = lexp(-a) * lexp(-b) / lexp(-c)", make_two_ways, relative_depth_error, 2e-7});
}

/* ---- directions and densities ------------------------------------------------------------------------------------ */

static void make_isotropic(uint64_t *seed, uint32_t i, double in[HAZARD_INPUTS]) {
    in[0] = (i & 1 ? -1 : 1) * in_octaves(seed, 1e-8, 1e-4);
    in[1] = test_random_unit(seed);
}

/* To first order in g, whose square is below 1e-8: s + 3 g (1 - s^2) / 2 with s = 2 u - 1. */
static double isotropic_error(const double in[HAZARD_INPUTS], double y) {
    double s = 2 * in[1] - 1, g = in[0];
    return fabs(y - (s + 1.5 * g * (1 - s) * (1 + s)));
}

#define HG_TEXTBOOK "real q = (R(1) - a * a) / (R(1) - a + R(2) * a * b), z = (R(1) + a * a - q * q) / (R(2) * a); "

static void phase_function_nearly_isotropic(void **state) {
    (void)state;
    hazard_check(&(hazard){
        "Henyey-Greenstein sample, |g| <= 1e-4", "series in g, double", "cosine", "#include \"phase_hg.h\"\n",
        /* of g < 0 the variates run the other way */
        "real q; y = phase_hg_sample(vmake(R(0), R(0), R(1)), a, a < R(0) ? R(1) - b : b, R(0), &q).z",
        HG_TEXTBOOK "y = z", make_isotropic, isotropic_error, 5e-7});
}

static void make_forward(uint64_t *seed, uint32_t i, double in[HAZARD_INPUTS]) {
    static const double means[] = {0.99, 0.999, 0.9999};
    in[0] = means[i % 3];
    in[1] = 1 - in_octaves(seed, 1e-6, 1);
}

static double forward_error(const double in[HAZARD_INPUTS], double y) {
    long double a = in[0], u = in[1], q = 1 - a + 2 * a * u;
    long double v = 2 * (1 - a) * (1 - a) * (1 - u) * (1 + a * u) / (q * q), sine = sqrtl(v * (2 - v));
    return (double)fabsl(y / sine - 1);
}

static void phase_function_nearly_forward(void **state) {
    (void)state;
    hazard_check(&(hazard){
        "Henyey-Greenstein sample, g to 0.9999", "1 - cos in 80 bits", "sine, relative", "#include \"phase_hg.h\"\n",
        "real q; y = phase_hg_sample(vmake(R(0), R(0), R(1)), a, b, R(0), &q).x",
        HG_TEXTBOOK "y = sqrt(R(1) - z * z)", make_forward, forward_error, 1e-6});
}

/* g; two directions, close to each other. */
static void make_narrow(uint64_t *seed, uint32_t i, double in[HAZARD_INPUTS]) {
    static const double means[] = {0.99, 0.999, 0.9999};
    double before[3], after[3];
    direction(seed, before);
    aside(seed, before, in_octaves(seed, 1e-3, 1), after);
    in[0] = means[i % 2];
    for (int k = 0; k < 3; k++) in[1 + k] = before[k], in[4 + k] = after[k];
}

static double density_error(const double in[HAZARD_INPUTS], double y) {
    long double g = in[0], x = (1 - g) * (1 - g) + 2 * g * versine_between(in + 1, in + 4);
    return (double)fabsl(y / ((1 - g) * (1 + g) / (4 * PI * x * sqrtl(x))) - 1);
}

static void phase_function_near_its_peak(void **state) {
    (void)state;
    hazard_check(&(hazard){
        "Henyey-Greenstein density near its peak", "1 - cos in 80 bits", "relative", "#include \"phase_hg.h\"\n",
        "y = phase_hg(vmake(b, c, d), vmake(e, f, g), a)",
        "real x = R(1) + a * a - R(2) * a * (b * e + c * f + d * g); "
        "y = (R(1) - a * a) / (R(4 * PI) * x * sqrt(x))", make_narrow, density_error, 2e-6});
}

/* Densities of 64 turns: their product is no float, the product of their ratios is 1. */
static double ratio_error(const double in[HAZARD_INPUTS], double y) { return (void)in, fabs(y - 1); }

static void make_turns(uint64_t *seed, uint32_t i, double in[HAZARD_INPUTS]) {
    (void)i;
    in[0] = in_range(seed, 0.7, 0.9);
    in[1] = test_random_unit(seed);
    in[2] = test_random_unit(seed);
}

#define TURNS(step, result) \
    "vec w = vmake(R(0), R(0), R(1)); real p = R(1), q = R(1), u = b, v = c; " \
    "for (int k = 0; k < 64; k++) { real density; vec before = w; " \
    "w = phase_hg_sample(w, a, u, v, &density); real value = phase_hg(before, w, a); " step \
    "u = u + R(0.6180339887); u = u - floor(u); v = v + R(0.7548776662); v = v - floor(v); } " result

static void ratios_of_densities(void **state) {
    (void)state;
    hazard_check(&(hazard){
        "weight after 64 turns", "1", "relative", "#include \"phase_hg.h\"\n",
        TURNS("p = p * (value / density); ", "y = p"),
        TURNS("p = p * value; q = q * density; ", "y = p / q"), make_turns, ratio_error, 64 * 5e-7});
}

/* ---- spots ------------------------------------------------------------------------------------------------------- */

/* Half angle and the direction to a point in the cone. The axis is (0.36, 0.48, 0.8), the beam three quarters. */
static const double spot_axis[3] = {(double)0.36f, (double)0.48f, (double)0.8f};

static void make_in_spot(uint64_t *seed, uint32_t i, double in[HAZARD_INPUTS]) {
    double axis[3], v[3], degrees = i & 1 ? 0.1 : 0.01;
    long double u[3];
    unit_of(spot_axis, u);
    for (int k = 0; k < 3; k++) axis[k] = (double)u[k];
    in[0] = (float)(degrees * (double)PI / 180);
    aside(seed, axis, in[0] * sqrt(test_random_unit(seed)), v);
    for (int k = 0; k < 3; k++) in[1 + k] = v[k];
    in[4] = 2 * pow(sin(in[0] / 2), 2);
    in[5] = 2 * pow(sin(0.375 * in[0]), 2);
}

static double spot_error(const double in[HAZARD_INPUTS], double y) {
    long double angle = 2 * asinl(sqrtl(versine_between(in + 1, spot_axis) / 2));
    long double exact = 4 * (1 - angle / in[0]);
    return (double)fabsl(y - (exact < 0 ? 0 : exact > 1 ? 1 : exact));
}

static void falloff_of_a_narrow_spot(void **state) {
    (void)state;
    hazard_check(&(hazard){
        "falloff of spots of 0.1 and 0.01 degrees", "angle in 80 bits", "of full beam", "#include \"lamp.h\"\n",
        "lamp l; l.cone = TRUE_MASK; l.cosine = FALSE_MASK; l.cutoff = a; l.inv_fade = R(4) / a; l.v_cutoff = e; "
        "l.v_beam = f; vec off = vsub(vmake(b, c, d), vmake(R(0.36f), R(0.48f), R(0.8f))); "
        "y = lamp_falloff(&l, R(0.5) * vdot(off, off))",
        "y = lclamp((a - lacos(lmin(b * R(0.36f) + c * R(0.48f) + d * R(0.8f), R(1)))) * R(4) / a, R(0), R(1))",
        make_in_spot, spot_error, 4e-6});
}

/* ---- sums -------------------------------------------------------------------------------------------------------- */

/* 2^25 samples of 1 in each pixel of a film, and in a plain sum. */
static void a_film_of_many_samples(void **state) {
    (void)state;
    if (!device_test_offers(BRUME_PRECISION_FLOAT)) skip();
    static const char text[] =
        "#include \"film.h\"\n"
        "__kernel void test(__global float *planes) {\n"
        "    film f;\n"
        "    f.planes = planes; f.slots = 16; f.slot = I(AT) + lane_index();\n"
        "    film_load(&f);\n"
        "    for (int i = 0; i < 1 << 25; i++) {\n"
        "        film_add(&f, 0, 1, R(1), TRUE_MASK);\n"
        "        film_add_plain(&f, 2, R(1), TRUE_MASK);\n"
        "    }\n"
        "    film_store(&f);\n"
        "}\n";
    double planes[16 * FILM_LAYER_PLANES];
    const device_array arrays[] = {{WRITE_REAL, planes, 16 * FILM_LAYER_PLANES}};
    device_test_run(text, NULL, 16, BRUME_PRECISION_FLOAT, 16, arrays, 1);
    double ours = 0, naive = INFINITY;
    for (int i = 0; i < 16; i++) {
        ours = fmax(ours, fabs((planes[i] + planes[16 + i]) * 0x1p-25 - 1));
        naive = fmin(naive, fabs(planes[32 + i] * 0x1p-25 - 1));
    }
    print_message("2^25 samples: %.3g, naive %.3g\n", ours, naive);
    stability_row("hazard", "2^25 samples of 1 in a pixel", "2^25", "relative", 6e-8, ours, "naive %.2g", naive);
    assert_true(naive > 0.4);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(distance_from_the_ray),
        cmocka_unit_test(angle_of_a_far_segment),
        cmocka_unit_test(equiangular_points),
        cmocka_unit_test(point_in_thin_fog),
        cmocka_unit_test(share_absorbed_by_thin_fog),
        cmocka_unit_test(longest_flight),
        cmocka_unit_test(thick_coloured_fog),
        cmocka_unit_test(depths_before_exponentials),
        cmocka_unit_test(phase_function_nearly_isotropic),
        cmocka_unit_test(phase_function_nearly_forward),
        cmocka_unit_test(phase_function_near_its_peak),
        cmocka_unit_test(ratios_of_densities),
        cmocka_unit_test(falloff_of_a_narrow_spot),
        cmocka_unit_test(a_film_of_many_samples),
    };
    return cmocka_run_group_tests(tests, device_test_setup, device_test_teardown);
}

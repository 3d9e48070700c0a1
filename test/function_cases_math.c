/* function_cases_math.c -- the functions of cl/math.h, and formulas of one or two numbers: see function_cases.h. */
#include <math.h>

#include "function_cases.h"
#include "../cl/shared.h"

#define PI 3.14159265358979323846
#define ALL_FLOATS .inputs = EVERY_FLOAT, .first = 0, .last = 0xffffffffu
#define FLOATS_0_TO_2 .inputs = EVERY_FLOAT, .first = 0, .last = 0x40000000u
#define POSITIVE_FLOATS .inputs = EVERY_FLOAT, .first = 0, .last = 0x7f800000u
#define WITH_EDGES(e) .edges = (e), .edge_count = sizeof(e) / sizeof(e)[0]
#define WITH_PARAMETERS(p) .parameters = (p), .parameter_count = sizeof(p) / sizeof(p)[0]

#define LIBM "libm in double"

/* ---- exp, log, sine, cosine and their inverses ------------------------------------------------------------------- */

static const float exp_edges[] = {88.72284f, 88.73f, -87.336548f, -103.97208f, -104.0f, -18.0f, 2e-8f, -2e-8f,
                                  0.34657359f, -0.34657359f};
static const float log_edges[] = {1.0f, 0.70710678f, 1.41421356f, -1.0f, 2e-8f, -2e-8f, -0.29289322f, 0.41421356f};
static const float angle_edges[] = {0.78539816f, 1.57079633f, 3.14159265f, 1e5f, -1e5f, 0.5f, 0.25f, 0.125f, 0.75f,
                                    1.0f, -1.0f, -0.5f, 0x1p20f};

static double exp_error(const function_result *r) { return function_ulps(r->y, exp(r->x)); }
static double expm1_error(const function_result *r) { return function_ulps(r->y, expm1(r->x)); }
static double log_error(const function_result *r) { return function_ulps(r->y, log(r->x)); }
static double log1p_error(const function_result *r) { return function_ulps(r->y, log1p(r->x)); }
static double atan_error(const function_result *r) { return function_ulps(r->y, atan(r->x)); }
static double asin_error(const function_result *r) { return function_ulps(r->y, asin(r->x)); }
static double acos_error(const function_result *r) { return function_ulps(r->y, acos(r->x)); }

static double sin_error(const function_result *r) {
    return function_ulps(r->y, fabs(r->x) <= 1e5 ? sin(r->x) : (double)NAN);
}

static double cos_error(const function_result *r) {
    return function_ulps(r->y, fabs(r->x) <= 1e5 ? cos(r->x) : (double)NAN);
}

/* sin 2 pi u: u brought to a quarter turn around 0, which is exact */
static double sin_turns(double u) {
    double rest = u - rint(u);
    if (rest == 0) return copysign(0, u);
    if (rest > 0.25) rest = 0.5 - rest;
    if (rest < -0.25) rest = -0.5 - rest;
    return sin(2 * PI * rest);
}

static double cos_turns(double u) {
    u = fabs(u - rint(u));
    return u < 0.125 ? cos(2 * PI * u) : u == 0.25 ? 0 : sin_turns(0.25 - u);
}

/* Of a zero between two quarters the sign is nobody's. */
static double turns_ulps(const function_result *r, double exact) {
    if (!(fabs(r->x) <= 0x1p20)) return 0;
    if (exact == 0 && r->x != 0) return r->y == 0 ? 0 : (double)INFINITY;
    return function_ulps(r->y, exact);
}

static double sin_turns_error(const function_result *r) { return turns_ulps(r, sin_turns(r->x)); }
static double cos_turns_error(const function_result *r) { return turns_ulps(r, cos_turns(r->x)); }

/* All signs and magnitudes: powers of 2 with their neighbours, numbers between them, denormals, what is not finite. */
static const float *grid(size_t *out_count) {
    enum { MOST = 2048 };
    static float values[MOST];
    static size_t count;
    for (uint32_t binade = 0; count == 0 || (binade > 0 && binade < 256); binade++) {
        static const uint32_t offsets[] = {0, 1, 0x2a5f3cu, 0x7fffffu};
        for (uint32_t k = 0; k < 4 && binade < 255; k++)
            for (uint32_t sign = 0; sign < 2; sign++)
                if (k < 3 || binade % 8 == 0 || binade > 250)
                    values[count++] = function_float(sign << 31 | binade << 23 | offsets[k]);
    }
    static const float specials[] = {INFINITY, -INFINITY, NAN};
    if (!isnan(values[count - 1]))
        for (int k = 0; k < 3; k++) values[count++] = specials[k];
    *out_count = count;
    return values;
}

/* Positive, of squares that are floats. */
static const float *lengths(size_t *out_count) {
    static float values[512];
    static size_t count;
    for (int k = -58; count == 0 || (k > -58 && k <= 58); k++) {
        values[count++] = ldexpf(1, k);
        values[count++] = ldexpf(0x1.fffffep0f, k);
        values[count++] = ldexpf(1.3762131f, k);
    }
    *out_count = count;
    return values;
}

static double atan2_by_error(const function_result *r) { return function_ulps(r->y, atan2(r->x, r->p[0])); }
static double atan2_error(const function_result *r) { return function_ulps(r->y, atan2(r->x, r->z)); }

/* In [0, 1), so that 1 is 0; 2^-24 of a turn is what coordinates are good for. */
static double turns_of_error(const function_result *r) {
    double exact = atan2(r->x, r->z) / (2 * PI);
    if (isnan(exact)) return 0;
    exact = exact < 0 ? exact + 1 : exact;
    double off = fabs(r->y - exact);
    return r->y >= 0 && r->y < 1 ? fmin(off, 1 - off) * 0x1p24 : (double)INFINITY;
}

/* ---- formulas ---------------------------------------------------------------------------------------------------- */

static double angle_of_versine_error(const function_result *r) {
    return function_ulps(r->y, 2 * atan2(sqrt(r->x), sqrt(2 - r->x)));
}

static double sphere_versine_error(const function_result *r) {
    double sine2 = r->x * r->x;
    return function_ulps(r->y, sine2 / (1 + sqrt(1 - sine2)));
}

/* exp(y^2) erfc(y): y^2 is exact */
static double erfcx_error(const function_result *r) {
    return function_ulps(r->y, (double)(expl((long double)(r->x * r->x)) * erfcl((long double)r->x)));
}

static double transmittance_error(const function_result *r) {
    double tau = r->x * r->z, exact = exp(-tau);
    if (!(tau <= 1e30)) return 0; /* sizes beyond those of scenes */
    return fabs(r->y - exact) / (exact * 0x1p-24 + 0x1p-149) / (1 + tau);
}

static double complement_error(const function_result *r) {
    return function_ulps(r->y, r->x == 0 ? 1 : -expm1(-r->x) / r->x);
}

static double complement_of_two_error(const function_result *r) {
    return function_ulps(r->y, -expm1(-r->x * r->z) / r->x);
}

/* (1 - a^2) / (4 pi ((1 - a)^2 + 2 a v)^(3/2)) */
static double hg_error(const function_result *r) {
    double a = r->p[0], q = (1 - a) * (1 - a) + 2 * a * r->x;
    return function_ulps(r->y, (1 - a) * (1 + a) / (4 * PI * q * sqrt(q)));
}

/* 1 + t / r without cancellation in double: D^2 / (r (r - t)) for t < 0 */
static double beam_turn_error(const function_result *r) {
    double t = r->p[0] * r->x, distance = sqrt(t * t + r->z * r->z);
    return function_ulps(r->y, t < 0 ? r->z * r->z / (distance * (distance - t)) : 1 + t / distance);
}

static double beam_path_error(const function_result *r) {
    double t = r->p[0] * r->x, distance = sqrt(t * t + r->z * r->z);
    return function_ulps(r->y, t < 0 ? r->z * r->z / (distance - t) : t + distance);
}

/* Of g < 0 v is counted from straight on, the peak lies at 2. */
static double hg_back_error(const function_result *r) {
    double a = -r->p[0], q = (1 - a) * (1 - a) + 2 * a * (2 - r->x);
    return function_ulps(r->y, (1 - a) * (1 + a) / (4 * PI * q * sqrt(q)));
}

static double asinh_error(const function_result *r) { return function_ulps(r->y, asinh(r->x)); }

/* a^2 / (a^2 + b^2) of densities that are neither negative nor infinite: which are not is for the caller to know. */
static double heuristic_error(const function_result *r) {
    if (!(r->x >= 0 && r->z >= 0 && r->x < INFINITY)) return 0;
    double a = fmax(r->x, 1e-37f), ratio = r->z / a, exact = 1 / (1 + ratio * ratio);
    return fabs(r->y - exact) * 0x1p24;
}

/* Of a NaN, too, one is chosen: the second. */
static double chosen_error(const function_result *r, double exact) {
    float y = (float)exact;
    return (isnan(y) ? isnan(r->y) : function_bits(r->y) == function_bits(y)) ? 0 : (double)INFINITY;
}

static double min_error(const function_result *r) { return chosen_error(r, r->x < r->z ? r->x : r->z); }
static double max_error(const function_result *r) { return chosen_error(r, r->x > r->z ? r->x : r->z); }

static double held_error(const function_result *r) {
    return chosen_error(r, !(r->x > 1e-36f) ? 1e-36f : r->x < 1e36f ? r->x : 1e36f);
}

static double fresnel(double c, double eta) {
    double sin2 = (1 - c) * (1 + c) / (eta * eta);
    if (sin2 >= 1) return 1;
    double ct = sqrt(1 - sin2), rs = (c - eta * ct) / (c + eta * ct), rp = (eta * c - ct) / (eta * c + ct);
    return (rs * rs + rp * rp) / 2;
}

/* Near total reflection it is infinitely steep: what counts is to be right for a cosine within two ulp. */
static double dielectric_error(const function_result *r) {
    double eta = r->p[1] > 0 ? r->p[0] : 1 / (double)r->p[0], exact = fresnel(r->x, eta), off = fabs(r->y - exact);
    if (off * 0x1p24 < 2) return off * 0x1p24;
    double above = fresnel(r->x * (1 + 0x1p-22), eta), below = fresnel(r->x * (1 - 0x1p-22), eta);
    double low = fmin(exact, fmin(above, below)), high = fmax(exact, fmax(above, below));
    return fmax(2, fmax(low - r->y, r->y - high) * 0x1p24);
}

static double falloff_error(const function_result *r) {
    double angle = 2 * atan2(sqrt(r->x), sqrt(2 - r->x)), exact = (r->p[0] - angle) * r->p[1];
    exact = exact < 0 ? 0 : exact > 1 ? 1 : exact;
    if (r->x <= r->p[3]) exact = 1;
    if (r->x >= r->p[2]) exact = 0;
    return fabs(r->y - exact) * 0x1p24;
}

/* Repeat, clamp, mirror. In [0, 1], and nowhere off by more than the unit. */
static double wrap_error(const function_result *r) {
    double x = r->x * r->p[1], exact = x < 0 ? 0 : x > 1 ? 1 : x;
    if (r->p[0] == TEXTURE_WRAP_REPEAT) exact = x - floor(x);
    if (r->p[0] == TEXTURE_WRAP_MIRROR) exact = fabs(x - 2 * floor(x / 2 + 0.5));
    return r->y >= 0 && r->y <= 1 ? fabs(r->y - exact) * 0x1p24 : (double)INFINITY;
}

static double is_bad_error(const function_result *r) { return r->y == (isfinite(r->x) ? 0 : 1) ? 0 : (double)INFINITY; }

static const float peaks[][FUNCTION_PARAMETERS] = {{0}, {1e-6f}, {0.5f}, {0.99f}, {0.9999f}, {0x1.fffffep-1f}};
static const float backs[][FUNCTION_PARAMETERS] = {{-1e-6f}, {-0.5f}, {-0.99f}, {-0.9999f}, {-0x1.fffffep-1f}};
static const float ordinates[][FUNCTION_PARAMETERS] = {{0.75f}, {1}, {-1}, {1.0947f}, {1.3f}, {-1.4142f}, {1.61803f},
                                                       {1.9999f}, {-0.5001f}, {0.6180f}};
static const float sides[][FUNCTION_PARAMETERS] = {{1}, {-1}};
static const float wraps[][FUNCTION_PARAMETERS] = {{0, 1}, {0, -1}, {1, 1}, {1, -1}, {2, 1}, {2, -1}};
static const float interfaces[][FUNCTION_PARAMETERS] = {{1.5f, 1}, {1.5f, -1}, {1.0001f, 1}, {1.0001f, -1}, {2.4f, 1}};
/* Cutoff, 1 / fade, and the versines of cutoff and beam, for beam = 3/4 cutoff: 0.01, 0.1, 1, 20, 90, 179.9 degrees */
#define FALLOFF(degrees, v_cutoff, v_beam) \
    {(float)((degrees) * PI / 180), (float)(720 / ((degrees) * PI)), (float)(v_cutoff), (float)(v_beam)}
static const float falloffs[][FUNCTION_PARAMETERS] = {
    FALLOFF(0.01, 1.523087095067e-08, 8.567364919268e-09),
    FALLOFF(0.1, 1.523086712301e-06, 8.567363708172e-07),
    FALLOFF(1, 0.0001523048436088, 8.567242599297e-05),
    FALLOFF(20, 0.06030737921409, 0.03407417371093),
    FALLOFF(90, 1, 0.6173165676349),
    FALLOFF(179.9, 1.999998476913, 1.706180575035),
};

#define FUNCTION(label, inside, from, in, expression, check) \
    .name = label, .domain = inside, .reference = from, .unit = in, .body = "    y = " expression ";\n", .error = check
#define SINE_COSINE(call, part) "R(0); real s, c; " call "; y = " part

const function_case function_cases_math[] = {
    {FUNCTION("lexp", "all", LIBM, "ulp", "lexp(x)", exp_error), ALL_FLOATS, WITH_EDGES(exp_edges),
     .bound = 1.03, .worst = 0xc0bb786bu},
    {FUNCTION("lexpm1", "all", LIBM, "ulp", "lexpm1(x)", expm1_error), ALL_FLOATS, WITH_EDGES(exp_edges),
     .bound = 1.5, .worst = 0x3ec5015bu},
    {FUNCTION("llog", "all", LIBM, "ulp", "llog(x)", log_error), ALL_FLOATS, WITH_EDGES(log_edges),
     .bound = 0.827, .worst = 0x3f34c627u},
    {FUNCTION("llog1p", "all", LIBM, "ulp", "llog1p(x)", log1p_error), ALL_FLOATS, WITH_EDGES(log_edges),
     .bound = 0.828, .worst = 0x3ece7505u},
    {FUNCTION("lsincos: sine", "all; NaN beyond 1e5", LIBM, "ulp", SINE_COSINE("lsincos(x, &s, &c)", "s"), sin_error),
     ALL_FLOATS, WITH_EDGES(angle_edges), .bound = 0.874, .worst = 0x43a61ca3u},
    {FUNCTION("lsincos: cosine", "all; NaN beyond 1e5", LIBM, "ulp", SINE_COSINE("lsincos(x, &s, &c)", "c"), cos_error),
     ALL_FLOATS, WITH_EDGES(angle_edges), .bound = 0.865, .worst = 0x4288a7c8u},
    {FUNCTION("lsincos_turns: sine", "up to 2^20 turns", LIBM, "ulp", SINE_COSINE("lsincos_turns(x, &s, &c)", "s"),
              sin_turns_error), ALL_FLOATS, WITH_EDGES(angle_edges), .bound = 1, .worst = 0x002b7b3du},
    {FUNCTION("lsincos_turns: cosine", "up to 2^20 turns", LIBM, "ulp", SINE_COSINE("lsincos_turns(x, &s, &c)", "c"),
              cos_turns_error), ALL_FLOATS, WITH_EDGES(angle_edges), .bound = 0.948, .worst = 0x3e009155u},
    {FUNCTION("latan", "all", LIBM, "ulp", "latan(x)", atan_error), ALL_FLOATS, WITH_EDGES(angle_edges),
     .bound = 1.67, .worst = 0x3f0178d9u},
    {FUNCTION("lasin", "all; NaN beyond 1", LIBM, "ulp", "lasin(x)", asin_error), ALL_FLOATS, WITH_EDGES(angle_edges),
     .bound = 2.41, .worst = 0x3f00101fu},
    {FUNCTION("lacos", "all; NaN beyond 1", LIBM, "ulp", "lacos(x)", acos_error), ALL_FLOATS, WITH_EDGES(angle_edges),
     .bound = 1.18, .worst = 0x3f0aa5b4u},
    {FUNCTION("latan2", "a grid of all magnitudes, signs and special values", LIBM, "ulp", "latan2(x, z)", atan2_error),
     .inputs = EVERY_PAIR, .table = grid, .bound = 1.34},
    {FUNCTION("latan2 of x and ten z", "x in [1/16, 16], z in [-1.5, 2]", LIBM, "ulp", "latan2(x, p0)", atan2_by_error),
     .inputs = EVERY_FLOAT, .first = 0x3d800000u, .last = 0x41800000u, WITH_PARAMETERS(ordinates),
     .bound = 1.81, .worst = 0x3ec0fb9au},
    {FUNCTION("turns_of", "the same grid", LIBM, "2^-24 turns", "turns_of(x, z)", turns_of_error),
     .inputs = EVERY_PAIR, .table = grid, .bound = 1.33},
    {FUNCTION("is_bad", "all", "isfinite", "exact", "is_bad(x) ? R(1) : R(0)", is_bad_error), ALL_FLOATS, .bound = 0},
    {FUNCTION("angle_of_versine", "[0, 2]", LIBM, "ulp", "angle_of_versine(x)", angle_of_versine_error), FLOATS_0_TO_2,
     .bound = 3.05, .worst = 0x3cfd0261u},
    {FUNCTION("sphere_versine", "r / d in [0, 0.9999]", "closed form in double", "ulp", "sphere_versine(x, R(1))",
              sphere_versine_error), .inputs = EVERY_FLOAT, .first = 0, .last = 0x3f7ff972u,
     .bound = 14.5, .worst = 0x3f7ff4b1u},
    {FUNCTION("erfc_of", "[0, 7], times exp(y^2)", "erfcl in 80 bits", "ulp", "erfc_of(x, R(1))", erfcx_error),
     .inputs = EVERY_FLOAT, .first = 0, .last = 0x40e00000u, .bound = 4.92, .worst = 0x3aa32d00u},
    {FUNCTION("medium_transmittance", "a grid of sigma and t, tau up to 1e30", LIBM, "2^-24 (1 + tau)",
              "medium_transmittance(cgrey(x), z).r", transmittance_error), .inputs = EVERY_PAIR, .table = lengths,
     .bound = 0.545},
    {FUNCTION("transmittance_integral", "sigma >= 0, t = 1", LIBM, "ulp", "transmittance_integral(x, R(1))",
              complement_error), POSITIVE_FLOATS, .bound = 1.73, .worst = 0x3ebad44au},
    {FUNCTION("transmittance_integral of two", "a grid of sigma and t", LIBM, "ulp", "transmittance_integral(x, z)",
              complement_of_two_error), .inputs = EVERY_PAIR, .table = lengths, .bound = 1.05},
    {FUNCTION("hg_density", "v in [2^-40, 2]; g: 0, 1e-6, 0.5, 0.99, 0.9999, 1 - 2^-24", "closed form in double", "ulp",
              "hg_density(x, p0)", hg_error), .inputs = EVERY_FLOAT, .first = 0x2b800000u, .last = 0x40000000u,
     WITH_PARAMETERS(peaks), .bound = 4.83, .worst = 0x3b00bfc0u},
    {FUNCTION("phase_hg_versine", "v in [2^-20, 2]; g: -1e-6, -0.5, -0.99, -0.9999, 2^-24 - 1",
              "closed form in double", "ulp", "phase_hg_versine(x, p0)", hg_back_error),
     .inputs = EVERY_FLOAT, .first = 0x35800000u, .last = 0x40000000u, WITH_PARAMETERS(backs),
     .bound = 4.53, .worst = 0x3f3251ffu},
    {FUNCTION("lasinh", "all", LIBM, "ulp", "lasinh(x)", asinh_error), ALL_FLOATS, .bound = 1.78, .worst = 0x3f04a480u},
    {FUNCTION("power_heuristic", "a grid of densities", "closed form in double", "2^-24", "power_heuristic(x, z)",
              heuristic_error), .inputs = EVERY_PAIR, .table = grid, .bound = 1.01},
    {FUNCTION("lmin", "the same grid", "exact", "exact", "lmin(x, z)", min_error), .inputs = EVERY_PAIR, .table = grid,
     .bound = 0},
    {FUNCTION("lmax", "the same grid", "exact", "exact", "lmax(x, z)", max_error), .inputs = EVERY_PAIR, .table = grid,
     .bound = 0},
    {FUNCTION("light_weight_held", "all", "exact", "exact", "light_weight_held(x)", held_error), ALL_FLOATS,
     .bound = 0},
    {FUNCTION("beam_turn", "a grid of t and D; either side", "closed form in double", "ulp",
              "R(0); beam g; g.D = z; x = p0 * x; y = beam_turn(&g, x, sqrt(fma(x, x, z * z)), R(1))", beam_turn_error),
     .inputs = EVERY_PAIR, .table = lengths, WITH_PARAMETERS(sides), .bound = 3.21},
    {FUNCTION("beam_path", "a grid of t and D; either side", "closed form in double", "ulp",
              "R(0); beam g; g.D = z; x = p0 * x; y = beam_path(&g, x, sqrt(fma(x, x, z * z)))", beam_path_error),
     .inputs = EVERY_PAIR, .table = lengths, WITH_PARAMETERS(sides), .bound = 2.03},
    {FUNCTION("fresnel_dielectric", "cosine in [2^-30, 1]; index 1.5, 1.0001, 2.4, from either side",
              "textbook, in double", "2^-24, cosine within 2 ulp",
              "fresnel_dielectric(x, p0, p1 > R(0)).reflected", dielectric_error), .inputs = EVERY_FLOAT,
     .first = 0x30800000u, .last = 0x3f800000u, WITH_PARAMETERS(interfaces), .bound = 10.8, .worst = 0x3c22fb86u},
    {FUNCTION("lamp_falloff", "v in [2^-31, 2]; cutoff 0.01, 0.1, 1, 20, 90, 179.9 degrees, beam 3/4 of it",
              "closed form in double", "2^-24",
              "R(0); lamp l; l.cone = TRUE_MASK; l.cosine = FALSE_MASK; l.cutoff = p0; l.inv_fade = p1; "
              "l.v_cutoff = p2; l.v_beam = p3; y = lamp_falloff(&l, x)", falloff_error),
     .inputs = EVERY_FLOAT, .first = 0x30000000u, .last = 0x40000000u, WITH_PARAMETERS(falloffs),
     .bound = 12.9, .worst = 0x391cd5eeu},
    {FUNCTION("texture_wrap", "x to 2^24, either sign; repeat, clamp, mirror", "closed form in double", "2^-24",
              "texture_wrap(p1 * x, to_ireal(p0))", wrap_error), .inputs = EVERY_FLOAT, .first = 0x30800000u,
     .last = 0x4b800000u, WITH_PARAMETERS(wraps), .bound = 1.01, .worst = 0x3f7fffffu},
};
const uint32_t function_cases_math_count = sizeof function_cases_math / sizeof function_cases_math[0];

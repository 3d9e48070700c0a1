/* function_cases_surfaces.c -- Fresnel's formulas and rough surfaces: see function_cases.h.
 *
 * A direction of cosine z lies in the plane of x and z; its sine is rounded as on the device, so that both start from
 * the same two floats.
 */
#include <complex.h>
#include <math.h>

#include "function_cases.h"

#define PI 3.14159265358979323846
#define WITH_PARAMETERS(p) .parameters = (p), .parameter_count = sizeof(p) / sizeof(p)[0]
#define COSINES .inputs = EVERY_FLOAT, .first = 0x3a800000u, .last = 0x3f800000u /* 2^-10 to 1 */

static double sine_of(double cosine) {
    volatile float below = 1 - (float)cosine, above = 1 + (float)cosine, product = below * above;
    return sqrtf(product);
}

/* ---- Fresnel ----------------------------------------------------------------------------------------------------- */

static double conductor_error(const function_result *r) {
    double complex eta = r->p[0] + I * (double)r->p[1], square = eta * eta, q = csqrt(r->x * r->x + (square - 1));
    double complex s = (r->x - q) / (r->x + q), p = (square * r->x - q) / (square * r->x + q);
    double exact = r->p[0] == 0 ? 1 : (creal(s * conj(s)) + creal(p * conj(p))) / 2; /* an imaginary index: a mirror */
    return fabs(r->y - exact) * 0x1p24;
}

/* sin^2 of the refracted angle may round to 1 early or late: what counts is to be right for a cosine within two ulp. */
static double refracted(double c, double eta) { return sqrt(fmax(1 - (1 - c) * (1 + c) / (eta * eta), 0)); }

static double refracted_error(const function_result *r) {
    double eta = r->p[1] > 0 ? r->p[0] : 1 / (double)r->p[0], exact = refracted(r->x, eta), off = fabs(r->y - exact);
    if (off * 0x1p24 < 2) return off * 0x1p24;
    double above = refracted(r->x * (1 + 0x1p-22), eta), below = refracted(r->x * (1 - 0x1p-22), eta);
    return fmax(2, fmax(below - r->y, r->y - above) * 0x1p24);
}

/* ---- facets ------------------------------------------------------------------------------------------------------ */

/* D times pi alpha_u alpha_v, in z and the slope's square x^2 / alpha_u^2. Of Beckmann's, exp loses a share that is the
 * exponent's, and everything where its own range ends. */
static double density_error(const function_result *r) {
    double x = sine_of(r->x), z2 = r->x * r->x, slope2 = x * x / ((double)r->p[0] * r->p[0]);
    double area = PI * r->p[0] * r->p[1];
    if (r->p[2] == 0) return function_ulps(r->y, 1 / ((z2 + slope2) * (z2 + slope2) * area));
    double exact = exp(-slope2 / z2) / (z2 * z2 * area), least = 0x1p-149 / (z2 * z2 * area);
    return fabs(r->y - exact) / (exact * 0x1p-24 + least) / (1 + slope2 / z2);
}

/* Integral over t > a of (t - a) exp(-t^2) / sqrt(pi) */
static long double moment(long double a) {
    return 0.5L * (expl(-a * a) / sqrtl(3.14159265358979323846264L) - a * erfcl(a));
}

static double area_error(const function_result *r) {
    double rough = (double)r->p[0] * sine_of(r->x), z = r->x;
    if (r->p[2] == 0) return function_ulps(r->y, 0.5 * (z + sqrt(z * z + rough * rough)));
    double a = z / fmax(rough, 1e-15);
    return function_ulps(r->y, a > 20 ? z : z + rough * (double)moment(a));
}

/* It cancels: what counts is a share of the Gaussian. */
static double moment_error(const function_result *r) {
    double exact = (double)moment(r->x);
    return fabs(r->y - exact) * 0x1p24 / exp(-r->x * r->x);
}

/* ---- visible facets ---------------------------------------------------------------------------------------------- */

/* Slope along x of the facet at the share v of the cap, u = 0. */
static double ggx_visible_slope(double cosine, double alpha, double v) {
    double x = alpha * sine_of(cosine), length = hypot(x, cosine);
    double height = (1 - v) * (1 + cosine / length), low = v * (1 + cosine / length); /* low = 1 - z */
    return alpha * (sqrt(low * (2 - low)) + x / length) / height;
}

/* Or right for a v within some steps. */
static double ggx_visible_error(const function_result *r) {
    double exact = ggx_visible_slope(r->p[0], r->p[1], r->x), off = fabs(r->y - exact);
    double step = ggx_visible_slope(r->p[0], r->p[1], fmin(r->x + 0x1p-24, 1 - 0x1p-25)) - exact;
    return fmin(function_ulps(r->y, exact), off / fabs(step));
}

/* Into the remainder: its tail beyond the slope is, as a share of the whole, erfc of the normal variate. Where that is
 * flat, at the start, right for a slope within 4 ulp. */
static long double tail_share(long double a, long double y) {
    if (y <= a) return 1;
    return 0.5L * (expl(-y * y) / sqrtl(3.14159265358979323846264L) - a * erfcl(y)) / moment(a);
}

static double beckmann_visible_error(const function_result *r) {
    const long double few = 0x1p-22L, root_pi = sqrtl(3.14159265358979323846264L);
    long double a = r->p[0] / (long double)sine_of(r->p[0]), y = r->y;
    long double normal = sqrtl(-log1pl(-r->x)), wanted = erfcl(normal), share = tail_share(a, y);
    long double above = tail_share(a, y * (1 - few)), below = tail_share(a, y * (1 + few)), off = fabsl(wanted - share);
    if (!(y >= a * (1 - few))) return INFINITY;
    if (wanted <= above && wanted >= below) return 4;
    /* of the slope, or of u: erfc of the normal variate falls by 1 / (sqrt(pi) normal) */
    return fmin((double)(4 * off / (wanted > share ? above - share : share - below)),
                (double)(off * root_pi * normal) * 0x1p24);
}

/* Index and absorption: silver, a mirror, clear ones, one that hardly absorbs, a large one. */
static const float metals[][FUNCTION_PARAMETERS] = {{0.155f, 4.82f}, {0, 0},        {1.5f, 0},
                                                    {1.0001f, 0},    {2.5f, 1e-3f}, {100, 100}};
static const float interfaces[][FUNCTION_PARAMETERS] = {{1.5f, 1}, {1.5f, -1}, {1.0001f, -1}};
static const float roughness[][FUNCTION_PARAMETERS] = {
    {1e-4f, 1e-4f, 0}, {1, 0.1f, 0}, {1e-2f, 1e-2f, 1}, {1, 0.1f, 1}};
/* Cosine and roughness. */
static const float looks[][FUNCTION_PARAMETERS] = {{1, 1}, {0.7f, 0.1f}, {0.1f, 1}, {1e-3f, 0.5f}, {1e-3f, 1e-3f},
                                                   {1e-6f, 1}};
static const float grazing[][FUNCTION_PARAMETERS] = {{1e-6f}, {1e-2f}, {0.3f}};

#define FUNCTION(label, inside, from, in, text, check) \
    .name = label, .domain = inside, .reference = from, .unit = in, .body = "    " text "\n", .error = check
#define TURNED(cosine) "vmake(sqrt((R(1) - " cosine ") * (R(1) + " cosine ")), R(0), " cosine ")"
#define FACETS "microfacets m; m.alpha_u = p0; m.alpha_v = p1; m.beckmann = p2 > R(0); "

const function_case function_cases_surfaces[] = {
    {FUNCTION("fresnel_conductor", "cosine in [2^-10, 1]; six indices, 0 to 100 (1 - i)",
              "complex indices in double", "2^-24", "y = fresnel_conductor(x, p0, p1);", conductor_error), COSINES,
     WITH_PARAMETERS(metals), .bound = 7.35, .worst = 0x3a8dade7u},
    {FUNCTION("fresnel_dielectric: refracted cosine", "cosine in [2^-10, 1]; index 1.5, 1 / 1.5, 1 / 1.0001",
              "closed form in double", "2^-24, cosine within 2 ulp",
              "y = fresnel_dielectric(x, p0, p1 > R(0)).cos_t;", refracted_error), COSINES,
     WITH_PARAMETERS(interfaces), .bound = 2.01},
    {FUNCTION("microfacet_density", "cosine in [2^-10, 1]; roughness 1e-4 to 1, both kinds", "closed form in double",
              "ulp; Beckmann: 2^-24 (1 + tan^2 / alpha^2)", FACETS "y = microfacet_density(&m, " TURNED("x") ");",
              density_error), COSINES, WITH_PARAMETERS(roughness), .bound = 7.46, .worst = 0x3f695d99u},
    {FUNCTION("microfacet_area", "cosine in [2^-10, 1]; roughness 1e-4 to 1, both kinds",
              "closed form in double, erfcl in 80 bits", "ulp", FACETS "y = microfacet_area(&m, " TURNED("x") ");",
              area_error), COSINES, WITH_PARAMETERS(roughness), .bound = 3.43, .worst = 0x3ac3c2c0u},
    {FUNCTION("gaussian_moment", "[2^-20, 4]", "erfcl in 80 bits", "2^-24 exp(-x^2)",
              "real e; y = gaussian_moment(x, x, &e);", moment_error), .inputs = EVERY_FLOAT, .first = 0x35800000u,
     .last = 0x40800000u, .bound = 1.57, .worst = 0x4068f567u},
    {FUNCTION("ggx_sample_visible: slope", "all variates; cosine 1 to 1e-6, roughness 1e-3 to 1",
              "closed form in double", "ulp, or 2^-24 of v",
              "microfacets m; m.alpha_u = m.alpha_v = p1; m.beckmann = FALSE_MASK; "
              "vec w = ggx_sample_visible(&m, " TURNED("p0") ", R(0), x); y = w.x / w.z;", ggx_visible_error),
     .inputs = EVERY_VARIATE, WITH_PARAMETERS(looks), .bound = 2.83, .worst = 0x3ebdffu},
    {FUNCTION("beckmann_sample_visible: remainder", "all variates; cosine 1e-6, 0.01, 0.3, roughness 1",
              "tail integrals in 80 bits", "2^-24 of the slope or of u, or 4",
              "microfacets m; m.alpha_u = m.alpha_v = R(1); m.beckmann = TRUE_MASK; "
              "vec w = beckmann_sample_visible(&m, " TURNED("p0") ", R(0x1.fffffep-1f), x, R(0)); y = w.x / w.z;",
              beckmann_visible_error), .inputs = EVERY_VARIATE, WITH_PARAMETERS(grazing), .bound = 5.23,
     .worst = 0x4b6485u},
};
const uint32_t function_cases_surfaces_count = sizeof function_cases_surfaces / sizeof function_cases_surfaces[0];

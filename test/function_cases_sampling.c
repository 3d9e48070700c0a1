/* function_cases_sampling.c -- what makes points, distances and directions of variates: see function_cases.h.
 *
 * An inverse distribution function t(u) may be steep: then neighbouring variates are far apart, and what counts is that
 * t is right for a u within a step or so of 2^-24, the spacing of variates. So some errors are the lesser of two: of t
 * in ulp, and of the u to which t belongs in 2^-24.
 */
#include <math.h>
#include <string.h>

#include "function_cases.h"
#include "../cl/shared.h"

#define PI 3.14159265358979323846
#define WITH_PARAMETERS(p) .parameters = (p), .parameter_count = sizeof(p) / sizeof(p)[0]
#define EITHER "ulp, or 2^-24 of u"

static double either(float t, double exact_t, double u_of_t, double u) {
    return fmin(function_ulps(t, exact_t), fabs(u_of_t - u) * 0x1p24);
}

/* ---- bits to numbers --------------------------------------------------------------------------------------------- */

static double unit_error(const function_result *r) { return r->y == (r->bits >> 8) * 0x1p-24 ? 0 : (double)INFINITY; }

static double unit_positive_error(const function_result *r) {
    return r->y > 0 && r->y <= 1 ? function_ulps(r->y, (r->bits + 1.0) * 0x1p-32) : (double)INFINITY;
}

static double reverse_error(const function_result *r) {
    static const uint32_t reversed[16] = {0, 8, 4, 12, 2, 10, 6, 14, 1, 9, 5, 13, 3, 11, 7, 15};
    uint32_t y = 0;
    for (int i = 0; i < 8; i++) y |= reversed[r->bits >> 4 * i & 15] << (28 - 4 * i);
    return function_bits(r->y) == y ? 0 : (double)INFINITY;
}

/* ---- distances --------------------------------------------------------------------------------------------------- */

static double flight_error(const function_result *r) {
    double exact = -log((r->bits + 1.0) * 0x1p-32);
    return fabs(r->y - exact) * 0x1p24 / fmax(exact, 1);
}

static double quantile_error(const function_result *r) {
    double tau = r->p[0], all = expm1(-tau), exact = -log1p(r->x * all) / tau;
    return either(r->y, fmin(exact, 1), expm1(-tau * r->y) / all, r->x);
}

/* Angle between t0 and t as the light at distance D sees them. */
static long double angle_between(long double D, long double t0, long double t) {
    return atan2l(D * (t - t0), D * D + t0 * t);
}

static double equiangular_error(const function_result *r) {
    long double D = r->p[0], t0 = r->p[1], t1 = r->p[2], all = angle_between(D, t0, t1), u = r->x;
    if (!(r->y >= r->p[1] && r->y <= r->p[2])) return INFINITY;
    /* from the nearer end, by the sum formula of the tangent */
    int left = u < 0.5L;
    long double end = left ? t0 : -t1, turn = (left ? u : 1 - u) * all;
    long double t = D * (end * cosl(turn) + D * sinl(turn)) / (D * cosl(turn) - end * sinl(turn));
    return either(r->y, (double)(left ? t : -t), (double)(angle_between(D, t0, r->y) / all), r->x);
}

/* ---- directions -------------------------------------------------------------------------------------------------- */

/* tan(angle / 2) = sqrt(v / (2 - v)) for v = 2 (1-g)^2 (1-u) (1+gu) / (1-g+2gu)^2, whose 2 - v has the same form. Of
 * g < 0 the angle is counted from straight back. */
static double hg_sample_error(const function_result *r) {
    double a = fabs(r->p[0]), u = r->x;
    return function_ulps(r->y, (1 - a) / (1 + a) * sqrt((1 - u) * (1 + a * u) / (u * (a * u + 1 - a))));
}

/* Cutoff and beam in radians, solid angle, versine of the beam. The share of what is in full beam is a float. */
static double lamp_sample_error(const function_result *r) {
    double cutoff = r->p[0], beam = r->p[1], u = r->x, angle;
    float core = (float)(2 * PI) * r->p[3] / r->p[2];
    if (u < core) {
        angle = 2 * asin(sqrt(u / core * r->p[3] / 2));
    } else {
        angle = cutoff - (cutoff - beam) * sqrt((u - core) / (1 - core));
    }
    return fabs(2 * atan(r->y) - angle) / cutoff * 0x1p24;
}

/* Concentric: the square's rings become circles. */
static double disk(double u, double v, int want_y) {
    double a = 2 * u - 1, b = 2 * v - 1, radius, turn;
    if (a == 0 && b == 0) return 0;
    if (fabs(a) > fabs(b)) radius = a, turn = PI / 4 * (b / a);
    else radius = b, turn = PI / 2 - PI / 4 * (a / b);
    return radius * (want_y ? sin(turn) : cos(turn));
}

static double disk_x_error(const function_result *r) { return fabs(r->y - disk(r->x, r->z, 0)) * 0x1p24; }
static double disk_y_error(const function_result *r) { return fabs(r->y - disk(r->x, r->z, 1)) * 0x1p24; }

static double cosine_error(const function_result *r) {
    double radius = fmax(fabs(2 * r->x - 1), fabs(2 * r->z - 1));
    /* where the disk's rim would give 0, the floor of 1e-5 is */
    return function_ulps(r->y, sqrt(fmax((1 - radius) * (1 + radius), 1e-10)));
}

static double sphere_error(const function_result *r) {
    return fabs(r->y - 2 * sqrt(r->x * (1 - r->x)) * cos(2 * PI * r->z)) * 0x1p24;
}

static double ggx_slope_error(const function_result *r) { return function_ulps(r->y, sqrt(r->x / (1 - r->x))); }
static double beckmann_slope_error(const function_result *r) { return function_ulps(fabsf(r->y), sqrt(-log1p(-r->x))); }

/* The square's halves u >= v and v > u, each squeezed along one axis. */
static double triangle_second_error(const function_result *r) {
    return r->y >= 0 ? fabs(r->y - (r->z > r->x ? r->x / 2 : r->x - r->z / 2)) * 0x1p24 : (double)INFINITY;
}

static double triangle_first_error(const function_result *r) {
    return r->y >= 0 ? fabs(r->y - (1 - fmax(r->x, r->z))) * 0x1p24 : (double)INFINITY;
}

/* Variates: few digits and all, near both ends and in between. */
static const float *variates(size_t *out_count) {
    static float values[1536];
    static size_t count;
    for (uint32_t i = 0; count == 0 || (i > 0 && i < 512); i++) {
        static const uint32_t steps[] = {1u << 15, (1u << 15) + 12345};
        values[count++] = (float)(i * steps[0] * 0x1p-24);
        if (i < 500) values[count++] = (float)(i * steps[1] % (1u << 24) * 0x1p-24);
        if (i < 64) values[count++] = (float)(i * 0x1p-24), values[count++] = (float)(1 - (i + 1) * 0x1p-24);
        if (i < 64) values[count++] = (float)(0.5 + (i - 32.0) * 0x1p-24);
    }
    *out_count = count;
    return values;
}

/* ---- tables ------------------------------------------------------------------------------------------------------ */

enum { PIECES = 16, CDF_CELLS = 1000, FILTER_SIZE = 2048 };

static const float *nodes(size_t *out_count) {
    static const float values[PIECES + 1] = {0, 1e-8f, 3, 3, 0.1f, 7, 100, 1e4f, 50, 2, 2, 2, 1e-3f, 0, 0, 5, 1};
    *out_count = PIECES + 1;
    return values;
}

/* The density's integral up to the device's x is u. */
static double piecewise_error(const function_result *r) {
    size_t n;
    const float *value = nodes(&n);
    double sum = 0.5 * (value[0] + value[PIECES]), below = 0, y = r->y * PIECES, density[PIECES + 1];
    for (int k = 1; k < PIECES; k++) sum += value[k];
    for (int k = 0; k <= PIECES; k++) density[k] = value[k] * 0.85 * PIECES / sum + 0.15;
    int cell = y < PIECES ? (int)y : PIECES - 1;
    for (int k = 0; k < cell; k++) below += (density[k] + density[k + 1]) * 0.5 / PIECES;
    double z = y - cell;
    below += (density[cell] * z + (density[cell + 1] - density[cell]) * z * z / 2) / PIECES;
    return r->y >= 0 && r->y <= 1 ? fabs(below - r->x) * 0x1p24 : (double)INFINITY;
}

/* Cells of all widths, some empty. */
static const float *cdf(size_t *out_count) {
    static float values[CDF_CELLS + 1];
    for (int i = 0; i < CDF_CELLS && values[CDF_CELLS] == 0; i++) {
        float width = i % 7 == 3 ? 0 : ldexpf(1, -8 - i % 23);
        values[i + 1] = fminf(values[i] + width, 1);
    }
    values[CDF_CELLS] = 1;
    *out_count = CDF_CELLS + 1;
    return values;
}

static double cdf_error(const function_result *r) {
    size_t n;
    const float *value = cdf(&n);
    int cell = (int)r->y;
    return cell == r->y && cell >= 0 && cell < CDF_CELLS && value[cell] <= r->x && r->x < value[cell + 1]
               ? 0
               : (double)INFINITY;
}

/* What is no number gets some cell. */
static double cell_error(const function_result *r) {
    double cell = r->x <= 0 ? 0 : r->x >= CDF_CELLS ? CDF_CELLS - 1 : floor(r->x);
    int inside = r->y >= 0 && r->y <= CDF_CELLS - 1 && r->y == floorf(r->y);
    return inside && (isnan(r->x) || r->y == cell) ? 0 : (double)INFINITY;
}

/* Beyond one end is the other, or that end. */
static double neighbour_error(const function_result *r) {
    double n = r->p[1], i = r->x * 0x1p24 - 0x1p23, end = i < 0 ? 0 : n - 1;
    double exact = i >= 0 && i < n ? i : r->p[0] == TEXTURE_WRAP_REPEAT ? n - 1 - end : end;
    return r->y == exact ? 0 : (double)INFINITY;
}

/* A b_params and the offsets behind it: a curve as steep at its ends as a Gaussian's. */
static const float *filter(size_t *out_count) {
    enum { PARAMS = sizeof(b_params) / sizeof(float) };
    static float values[PARAMS + FILTER_SIZE + 2];
    if (values[PARAMS] == 0) {
        b_params params;
        memset(&params, 0, sizeof params);
        params.filter_size = FILTER_SIZE;
        memcpy(values, &params, sizeof params);
        for (int i = 0; i <= FILTER_SIZE; i++) values[PARAMS + i] = (float)(0.5 * atanh((i - 1024.0) / 1024.001));
    }
    *out_count = PARAMS + FILTER_SIZE + 2;
    return values;
}

static double filter_error(const function_result *r) {
    size_t n;
    const float *value = filter(&n) + sizeof(b_params) / sizeof(float);
    double at = r->x * FILTER_SIZE;
    int i = at < FILTER_SIZE ? (int)at : FILTER_SIZE - 1;
    return fabs(r->y - (value[i] + (at - i) * ((double)value[i + 1] - value[i]))) * 0x1p24;
}

/* What is left of u after a choice of probability p: again in [0, 1). */
static double split_error(const function_result *r) {
    double p = r->p[0], exact = r->x < p ? r->x / p : (r->x - p) / (1 - p);
    return r->y >= 0 && r->y < 1 ? fabs(r->y - exact) * 0x1p24 : (double)INFINITY;
}

static const float depths[][FUNCTION_PARAMETERS] = {{1e-20f}, {1e-7f}, {1e-6f}, {9.99e-6f}, {1.01e-5f}, {1e-3f}, {0.1f},
                                                    {1}, {5}, {16}, {17.5f}, {50}, {1e3f}, {1e6f}, {1e20f}};
/* D, t0, t1 */
static const float spans[][FUNCTION_PARAMETERS] = {
    {1, -2, 3}, {1, 0, 1}, {1, 10, 11}, {1e-3f, 1, 2}, {1e-3f, 1e3f, 1.001e3f}, {1e-6f, -1, 1}, {1e-6f, 1, 1e18f},
    {1, -1e18f, 1e18f}, {1e3f, -1, 1}, {1e3f, 5, 5.001f}, {0.5f, -2, -1.9999f}, {1e-18f, 0, 1}, {1, 1e5f, 1.0001e5f},
};
static const float means[][FUNCTION_PARAMETERS] = {{0}, {1e-6f}, {0.3f}, {-0.5f}, {0.9f}, {-0.9f}, {0.99f}, {0.999f},
                                                   {0.9999f}, {-0.9999f}, {0x1.fffffep-1f}};
/* cutoff, beam, integral of the falloff, 1 - cos beam: 0.1 and 0.075 degrees, 20 and 15, 90 and 0, 179 and 178 */
static const float lamps[][FUNCTION_PARAMETERS] = {
    {0.00174532925f, 0.00130899694f, 7.37674901e-06f, 8.56736371e-07f},
    {0.34906585f, 0.261799388f, 0.292706235f, 0.0340741737f},
    {1.57079633f, 0, 2.28318531f, 0},
    {3.12413936f, 3.10668607f, 12.5641378f, 1.99939083f},
};
static const float shares[][FUNCTION_PARAMETERS] = {{0.1f}, {0.5f}, {1e-6f}, {0x1p-24f}, {0x1.fffffep-1f}, {0.7f}, {0},
                                                    {1}};

/* How, and of how many texels. */
static const float rows[][FUNCTION_PARAMETERS] = {{0, 1}, {0, 1000}, {1, 1}, {1, 1000}, {2, 1}, {2, 1000}};

#define FUNCTION(label, inside, from, in, text, check) \
    .name = label, .domain = inside, .reference = from, .unit = in, .body = "    " text "\n", .error = check
#define HALF_TANGENT "y = w.z < R(0) ? (R(1) - w.z) / w.x : w.x / (R(1) + w.z);"

const function_case function_cases_sampling[] = {
    {FUNCTION("unit", "all words", "exact", "exact", "y = unit(bits);", unit_error), .inputs = EVERY_WORD, .bound = 0},
    {FUNCTION("unit_positive", "all words", "(n + 1) 2^-32", "ulp", "y = unit_positive(bits);", unit_positive_error),
     .inputs = EVERY_WORD, .bound = 1.01, .worst = 0x01000001u},
    {FUNCTION("reverse_bits", "all words", "four bits at a time", "exact", "y = as_real(as_ireal(reverse_bits(bits)));",
              reverse_error), .inputs = EVERY_WORD, .bound = 0},
    {FUNCTION("free flight", "all words; sigma = 1", "libm in double", "2^-24 max(t, 1)",
              "y = -llog(unit_positive(bits));", flight_error), .inputs = EVERY_WORD,
     .bound = 2.04, .worst = 0x59f14dbfu},
    {FUNCTION("transmittance_quantile", "all variates; tau from 1e-20 to 1e20", "libm in double", EITHER,
              "y = transmittance_quantile(p0, R(1), x);", quantile_error), .inputs = EVERY_VARIATE,
     WITH_PARAMETERS(depths), .bound = 3.3, .worst = 0xfbd27au},
    {FUNCTION("equiangular_sample", "all variates; 13 segments, near, far, narrow, through the light",
              "sum formula of the tangent, 80 bits", EITHER,
              "equiangular_range e = equiangular_range_of(p0, p1, p2); y = equiangular_sample(&e, x);",
              equiangular_error), .inputs = EVERY_VARIATE, WITH_PARAMETERS(spans), .bound = 2.34, .worst = 0x7e24d0u},
    {FUNCTION("phase_hg_sample", "all variates; g from -0.9999 to 1 - 2^-24: tan(angle / 2)", "closed form in double",
              "ulp", "real d; vec w = phase_hg_sample(vmake(R(0), R(0), p0 < R(0) ? R(-1) : R(1)), p0, x, R(0), &d); "
              "w.x = fabs(w.x); " HALF_TANGENT, hg_sample_error), .inputs = EVERY_VARIATE, WITH_PARAMETERS(means),
     .bound = 8.5, .worst = 0x68848u},
    {FUNCTION("lamp_sample", "all variates; cutoff 0.1, 20, 90, 179 degrees: the angle", "closed form in double",
              "2^-24 of the cutoff",
              "lamp l; l.axis = vmake(R(0), R(0), R(1)); l.cone = TRUE_MASK; l.cutoff = p0; "
              "l.inv_fade = R(1) / (p0 - p1); "
              "l.v_beam = p3; real weight; vec w = lamp_sample(&l, p2, x, R(0), &weight); " HALF_TANGENT,
              lamp_sample_error),
     .inputs = EVERY_VARIATE, WITH_PARAMETERS(lamps), .bound = 31.9, .worst = 0xfff7ceu},
    {FUNCTION("warp_disk: x", "a grid of variates", "libm in double", "2^-24", "real v; warp_disk(x, z, &y, &v);",
              disk_x_error), .inputs = EVERY_PAIR, .table = variates, .bound = 1.86},
    {FUNCTION("warp_disk: y", "a grid of variates", "libm in double", "2^-24", "real v; warp_disk(x, z, &v, &y);",
              disk_y_error), .inputs = EVERY_PAIR, .table = variates, .bound = 1.86},
    {FUNCTION("warp_cosine: z", "a grid of variates", "closed form in double", "ulp", "y = warp_cosine(x, z).z;",
              cosine_error), .inputs = EVERY_PAIR, .table = variates, .bound = 0.744},
    {FUNCTION("warp_sphere: x", "a grid of variates", "libm in double", "2^-24", "y = warp_sphere(x, z).x;",
              sphere_error), .inputs = EVERY_PAIR, .table = variates, .bound = 1.6},
    {FUNCTION("warp_triangle: second weight", "a grid of variates", "closed form in double", "2^-24",
              "real v; warp_triangle(x, z, &y, &v);", triangle_second_error), .inputs = EVERY_PAIR, .table = variates,
     .bound = 0.51},
    {FUNCTION("warp_triangle: first weight", "a grid of variates", "closed form in double", "2^-24",
              "real a, b; warp_triangle(x, z, &a, &b); y = R(1) - a - b;", triangle_first_error),
     .inputs = EVERY_PAIR, .table = variates, .bound = 1.01},
    {FUNCTION("microfacet_sample_all: GGX slope", "all variates", "closed form in double", "ulp",
              "microfacets m; m.alpha_u = m.alpha_v = R(1); m.beckmann = FALSE_MASK; "
              "vec w = microfacet_sample_all(&m, x, R(0)); y = w.x / w.z;", ggx_slope_error),
     .inputs = EVERY_VARIATE, .bound = 1.85, .worst = 0x557139u},
    {FUNCTION("microfacet_sample_all: Beckmann slope", "all variates", "libm in double", "ulp",
              "microfacets m; m.alpha_u = m.alpha_v = R(1); m.beckmann = TRUE_MASK; "
              "vec w = microfacet_sample_all(&m, x, R(0)); y = w.x / w.z;", beckmann_slope_error),
     .inputs = EVERY_VARIATE, .bound = 1.95, .worst = 0x67a383u},
    {FUNCTION("piecewise_warp", "all variates; a density of 0.15 to 60", "its integral in double", "2^-24 of u",
              "piecewise w; for (int k = 0; k <= PIECES; k++) w.node[k] = R(table[k]); piecewise_finish(&w); "
              "real q; y = piecewise_warp(&w, x, &q);", piecewise_error), .inputs = EVERY_VARIATE, .table = nodes,
     .bound = 5.52, .worst = 0x7c9870u},
    {FUNCTION("cdf_find", "all variates; 1000 cells, some empty", "exact", "exact",
              "y = to_real(cdf_find(table, I(0), 1000, x));", cdf_error), .inputs = EVERY_VARIATE, .table = cdf,
     .bound = 0},
    {FUNCTION("environment_cell", "all; 1000 cells", "exact", "exact", "y = to_real(environment_cell(x, 1000));",
              cell_error), .inputs = EVERY_FLOAT, .first = 0, .last = 0xffffffffu, .bound = 0},
    {FUNCTION("texture_neighbour", "-2^23 to 2^23 of 1 and of 1000 texels; repeat, clamp, mirror", "exact", "exact",
              "y = to_real(texture_neighbour(to_ireal(x * R(0x1p24f)) - I(0x800000), to_ireal(p1), to_ireal(p0)));",
              neighbour_error), .inputs = EVERY_VARIATE, WITH_PARAMETERS(rows), .bound = 0},
    {FUNCTION("filter_sample", "all variates; 2048 steps", "its table in double", "2^-24",
              "scene s; s.params = (__global const b_params *)table; s.filter = table + sizeof(b_params) / 4; "
              "y = filter_sample(&s, x).offset;", filter_error), .inputs = EVERY_VARIATE, .table = filter,
     .bound = 2.01, .worst = 0x800u},
    {FUNCTION("split", "all variates; p: 0, 2^-24 ... 1 - 2^-24, 1", "closed form in double", "2^-24",
              "y = x; split(&y, p0);", split_error), .inputs = EVERY_VARIATE, WITH_PARAMETERS(shares),
     .bound = 0.793, .worst = 0x8ccccdu},
};
const uint32_t function_cases_sampling_count = sizeof function_cases_sampling / sizeof function_cases_sampling[0];

/* bsdf_twin.c -- see bsdf_twin.h. Fresnel: Born & Wolf 1.5.2, complex indices; distributions, Lambda: Heitz 2014. */
#include "bsdf_twin.h"

#include <complex.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>

#include <cmocka.h>

#define PI 3.14159265358979323846

direction polar(double theta, double phi) {
    direction d = {sin(theta) * cos(phi), sin(theta) * sin(phi), cos(theta)};
    return d;
}

double dot(direction a, direction b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

direction halfway(direction a, direction b) {
    direction m = {a.x + b.x, a.y + b.y, a.z + b.z};
    double length = sqrt(dot(m, m));
    m.x /= length, m.y /= length, m.z /= length;
    return m;
}

direction rounded(direction d, brume_precision precision) {
    if (precision == BRUME_PRECISION_DOUBLE) return d;
    /* volatile: GCC 12.2 at -O2 drops the rounding of x and y when the compiler may pair them */
    volatile float x = (float)d.x, y = (float)d.y, z = (float)d.z;
    direction r = {x, y, z};
    return r;
}

b_bsdf white(int kind) {
    b_bsdf b = {.kind = kind, .texture = -1, .reflectance = {1, 1, 1}, .transmittance = {1, 1, 1}, .ior = 1.5f,
                .alpha_u = 0.1f, .alpha_v = 0.1f, .k = {1, 1, 1}};
    return b;
}

b_bsdf rough(int flags, double alpha_u, double alpha_v) {
    b_bsdf b = white(BSDF_ROUGH_CONDUCTOR);
    b.flags = flags;
    b.alpha_u = (float)alpha_u;
    b.alpha_v = (float)alpha_v;
    return b;
}

/* long double: the differences lose digits */
static double fresnel(long double cosine, long double complex index) {
    long double complex q = csqrtl(cosine * cosine + (index * index - 1));
    long double complex s = (cosine - q) / (cosine + q);
    long double complex p = (index * index * cosine - q) / (index * index * cosine + q);
    return (double)(creall(s * conjl(s)) + creall(p * conjl(p))) / 2;
}

double twin_fresnel_dielectric(double cosine, double ior) {
    return fresnel(fabsl(cosine), cosine < 0 ? 1.0L / ior : ior);
}

double twin_fresnel_conductor(double cosine, double eta, double k) {
    return eta == 0 ? 1 : fresnel(cosine, eta + I * (long double)k); /* an imaginary index reflects everything */
}

double twin_density(const b_bsdf *b, direction m) {
    double au = b->alpha_u, av = b->alpha_v, x = m.x / m.z / au, y = m.y / m.z / av, t = x * x + y * y;
    double slopes = b->flags & BSDF_BECKMANN ? exp(-t) : 1 / ((1 + t) * (1 + t));
    return slopes / (PI * au * av * pow(m.z, 4));
}

double twin_lambda(const b_bsdf *b, direction w) {
    double tangent = hypot(b->alpha_u * w.x, b->alpha_v * w.y) / w.z, a = 1 / tangent;
    if (!(b->flags & BSDF_BECKMANN)) return (sqrt(1 + tangent * tangent) - 1) / 2;
    return a > 20 ? 0 : (exp(-a * a) / (a * sqrt(PI)) - erfc(a)) / 2;
}

double twin_eval(const b_bsdf *b, direction wo, direction wi, double f[3]) {
    f[0] = f[1] = f[2] = 0;
    if (wo.z <= 0 || wi.z <= 0) return 0;
    if (b->kind == BSDF_DIFFUSE) {
        for (int c = 0; c < 3; c++) f[c] = b->reflectance[c] * wi.z / PI;
        return wi.z / PI;
    }
    if (b->kind != BSDF_ROUGH_CONDUCTOR) return 0;
    direction m = halfway(wo, wi);
    /* |wo + wi| / 2 is wo.m of unit vectors; of rounded ones it tells the angle between them best */
    double cosine = fmin((wo.x + wi.x) * m.x + (wo.y + wi.y) * m.y + (wo.z + wi.z) * m.z, 2) / 2;
    double density = twin_density(b, m);
    double masking_o = 1 / (1 + twin_lambda(b, wo)), masking_i = 1 / (1 + twin_lambda(b, wi));
    for (int c = 0; c < 3; c++)
        f[c] = b->reflectance[c] * twin_fresnel_conductor(cosine, b->eta[c], b->k[c]) * density * masking_o *
               masking_i / (4 * wo.z);
    return b->flags & BSDF_SAMPLE_ALL ? density * m.z / (4 * cosine) : density * masking_o / (4 * wo.z);
}

#define KERNEL_HEAD                                                                                                  \
    "#include \"bsdf.h\"\n"                                                                                          \
    "FN vec load3(__global const real1 *p, uint n) {\n"                                                              \
    "    return vmake(LOAD(p + AT), LOAD(p + n + AT), LOAD(p + 2 * n + AT));\n"                                      \
    "}\n"                                                                                                            \
    "FN void store3(__global real1 *p, uint n, real x, real y, real z) {\n"                                          \
    "    STORE(p + AT, x);\n"                                                                                        \
    "    STORE(p + n + AT, y);\n"                                                                                    \
    "    STORE(p + 2 * n + AT, z);\n"                                                                                \
    "}\n"                                                                                                            \
    "__kernel void test(__global const b_bsdf *bsdfs, __global const uint *ids, __global const real1 *wo,\n"         \
    "                   __global const real1 *in, __global real1 *out) {\n"                                          \
    "    uint n = get_global_size(0) * LANES;\n"                                                                     \
    "    scene s;\n"                                                                                                 \
    "    s.bsdfs = bsdfs;\n"                                                                                         \
    "    vec o = load3(wo, n);\n"                                                                                    \
    "    bsdf b = bsdf_of(&s, to_ireal(LOAD_BITS(ids + AT)), o, R(0), R(0), TRUE_MASK);\n"

static const char eval_text[] = KERNEL_HEAD
    "    bsdf_value v = bsdf_eval(&b, o, load3(in, n));\n"
    "    store3(out, n, v.f.r, v.f.g, v.f.b);\n"
    "    STORE(out + 3 * n + AT, v.pdf);\n"
    "}\n";

static const char sample_text[] = KERNEL_HEAD
    "    vec u = load3(in, n);\n"
    "    bsdf_sampled v = bsdf_sample(&b, o, u.x, u.y, u.z);\n"
    "    store3(out, n, v.wi.x, v.wi.y, v.wi.z);\n"
    "    store3(out + 3 * n, n, v.weight.r, v.weight.g, v.weight.b);\n"
    "    store3(out + 6 * n, n, v.pdf, v.eta, v.is_delta ? R(1) : R(0));\n"
    "}\n";

static const char facets_text[] = KERNEL_HEAD
    "    vec u = load3(in, n);\n"
    "    microfacets d = rough_conductor_facets(&b);\n"
    "    vec all = microfacet_sample_all(&d, u.y, u.z), seen = microfacet_sample_visible(&d, o, u.x, u.y, u.z);\n"
    "    vec m = vselect((b.flags & I(BSDF_SAMPLE_ALL)) != I(0), all, seen);\n"
    "    store3(out, n, m.x, m.y, m.z);\n"
    "}\n";

static double *run(const device_case *c, const char *text, const double *in, size_t planes) {
    double *out = malloc(planes * c->count * sizeof *out);
    assert_non_null(out);
    device_array arrays[] = {
        {READ_RAW, (void *)(uintptr_t)c->bsdfs, c->bsdf_count * sizeof *c->bsdfs},
        {READ_BITS, (void *)(uintptr_t)c->ids, c->count},
        {READ_REAL, (void *)(uintptr_t)c->wo, 3 * c->count},
        {READ_REAL, (void *)(uintptr_t)in, 3 * c->count},
        {WRITE_REAL, out, planes * c->count},
    };
    device_test_run(text, FEATURES_ARE("FEATURE_SPECULAR"), c->lanes, c->precision, c->count, arrays, 5);
    return out;
}

double *device_eval(const device_case *c, const double *wi) { return run(c, eval_text, wi, EVAL_PLANES); }
double *device_sample(const device_case *c, const double *u) { return run(c, sample_text, u, SAMPLE_PLANES); }
double *device_facets(const device_case *c, const double *u) { return run(c, facets_text, u, 3); }

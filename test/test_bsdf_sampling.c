/* test_bsdf_sampling.c -- the samples of cl/bsdf*.h: chi-square against the twins' densities integrated over cells,
 * from roughness 1e-4 to 1, from upright to grazing; weights; the light reflected in all.
 *
 * Two grids. Over directions wi, equal solid angles against the density that bsdf_eval reports: diffuse, and rough
 * metals whose lobes the cells resolve. Over facets, by their slopes in units of roughness, x = m.x / (m.z alpha_u) and
 * y: in r^2 = x^2 + y^2 turned into its share among all facets, and the turn phi, the density of visible facets is
 *     (wo.z + alpha_u x wo.x + alpha_v y wo.y)+ / (2 pi A(wo)),
 * of all facets 1 / 2 pi: smooth however smooth the surface, and knowing nothing of how facets are sampled.
 *
 * One family at CONFIDENCE (stats.h): right code fails once in a million choices of the seeds, which are fixed.
 */
#include <float.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

#include <cmocka.h>

#include "bsdf_twin.h"
#include "stats.h"

#define PI 3.14159265358979323846

enum { COUNT = 1 << 17, ROWS = 8, COLUMNS = 12, TESTS = 512, FEW = 1 << 13 };

typedef struct view {
    b_bsdf bsdf;
    direction wo;
    double bias; /* planted: the density times 1 + bias cos phi */
} view;

static uint32_t ids[COUNT];
static double wo[3 * COUNT], u[3 * COUNT];

typedef double *device_function(const device_case *c, const double *u);

/* device_sample or device_facets of one surface seen from one direction. */
static double *draw(device_function *f, const view *v, brume_precision precision, uint64_t seed) {
    direction o = rounded(v->wo, precision);
    for (size_t i = 0; i < COUNT; i++) {
        wo[i] = o.x, wo[COUNT + i] = o.y, wo[2 * COUNT + i] = o.z;
        for (int k = 0; k < 3; k++) u[k * COUNT + i] = test_random_unit(&seed);
    }
    device_case c = {precision, 16, &v->bsdf, 1, ids, COUNT, wo};
    return f(&c, u);
}

static double *sample(const view *v, brume_precision precision, uint64_t seed) {
    return draw(device_sample, v, precision, seed);
}

static double *facets(const view *v, brume_precision precision, uint64_t seed) {
    return draw(device_facets, v, precision, seed);
}

/* ---- over directions ---- */

static double direction_density(const void *user, double z, double phi) {
    const view *v = user;
    double f[3];
    direction wi = polar(acos(z), phi);
    return twin_eval(&v->bsdf, v->wo, wi, f) * (1 + v->bias * cos(phi));
}

static double p_of_directions(const view *v, const double *s) {
    direction_grid grid = {ROWS, COLUMNS, 0};
    double *x = malloc(3 * COUNT * sizeof *x), *y = x + COUNT, *z = x + 2 * COUNT;
    assert_non_null(x);
    for (size_t i = 0; i < COUNT; i++) {
        int lit = s[WEIGHT_R * COUNT + i] > 0; /* what isn't may lie anywhere */
        x[i] = lit ? s[WI_X * COUNT + i] : 0;
        y[i] = lit ? s[WI_Y * COUNT + i] : 0;
        z[i] = lit ? s[WI_Z * COUNT + i] : 1;
    }
    double p = stats_directions(&grid, x, y, z, s + WEIGHT_R * COUNT, COUNT, direction_density, v);
    free(x);
    return p;
}

/* ---- over facets ---- */

/* A band of steepness t, where 1 - (1 - t)^2 is the share of facets less steep: in t the heavy tail of GGX has a finite
 * density. Slopes in units of alpha: */
typedef struct band { const view *view; double t0, t1; } band;

static double slope_of(const view *v, double t) {
    return v->bsdf.flags & BSDF_BECKMANN ? sqrt(-2 * log1p(-t)) : sqrt(t * (2 - t)) / (1 - t);
}

static double steepness_of(const view *v, double r) {
    return v->bsdf.flags & BSDF_BECKMANN ? -expm1(-r * r / 2) : 1 - 1 / sqrt(1 + r * r);
}

/* At `along` in [0, 1] of what of the band is seen in direction phi: no edge for the quadrature to miss. */
static double facet_density(const void *user, double along, double phi) {
    const band *b = user;
    const view *v = b->view;
    double bias = 1 + v->bias * cos(phi), t1 = b->t1;
    double lean = v->bsdf.alpha_u * cos(phi) * v->wo.x + v->bsdf.alpha_v * sin(phi) * v->wo.y;
    int visible = !(v->bsdf.flags & BSDF_SAMPLE_ALL);
    if (visible && lean < 0) t1 = fmin(t1, steepness_of(v, -v->wo.z / lean));
    if (t1 <= b->t0) return 0;
    double t = b->t0 + along * (t1 - b->t0), all = (t1 - b->t0) * 2 * (1 - t) / (2 * PI) * bias;
    if (!visible) return all;
    return all * fmax(v->wo.z + slope_of(v, t) * lean, 0) / (v->wo.z * (1 + twin_lambda(&v->bsdf, v->wo)));
}

static int ascending(const void *a, const void *b) {
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* The share of a cell, cut where its band goes out of sight: a sliver there would fall through the nodes. */
static double facet_share(const band *b, double phi0, double phi1) {
    const view *v = b->view;
    double x = v->bsdf.alpha_u * v->wo.x, y = v->bsdf.alpha_v * v->wo.y, cuts[6] = {phi0, phi1}, share = 0;
    int count = 2;
    for (int edge = 0; edge < 2; edge++) {
        double cosine = -v->wo.z / (hypot(x, y) * slope_of(v, edge ? b->t1 : b->t0));
        if (!(cosine > -1)) continue; /* in sight all around */
        for (int side = -1; side <= 1; side += 2) {
            double phi = fmod(atan2(y, x) + side * acos(cosine) + 4 * PI, 2 * PI);
            if (phi > phi0 && phi < phi1) cuts[count++] = phi;
        }
    }
    qsort(cuts, (size_t)count, sizeof *cuts, ascending);
    for (int i = 0; i + 1 < count; i++) share += stats_integrate(facet_density, b, 0, 1, cuts[i], cuts[i + 1], 1e-9);
    return share;
}

/* Expected counts need one integral per cell, whatever the precision: the caller keeps them. */
static void facet_counts(const view *v, double *expected) {
    double total = 0;
    for (int i = 0; i < ROWS; i++)
        for (int j = 0; j < COLUMNS; j++) {
            band b = {v, (double)i / ROWS, (i + 1.0) / ROWS};
            double share = facet_share(&b, 2 * PI * j / COLUMNS, 2 * PI * (j + 1) / COLUMNS);
            expected[i * COLUMNS + j] = COUNT * share;
            total += share;
        }
    assert_true(v->bias != 0 || fabs(total - 1) < 1e-6);
}

/* m: the device's facets. */
static double p_of_facets(const view *v, const double *m, const double *expected) {
    static double observed[ROWS * COLUMNS];
    for (int i = 0; i < ROWS * COLUMNS; i++) observed[i] = 0;
    for (size_t i = 0; i < COUNT; i++) {
        double tan_x = m[i] / m[2 * COUNT + i], tan_y = m[COUNT + i] / m[2 * COUNT + i];
        double x = tan_x / v->bsdf.alpha_u, y = tan_y / v->bsdf.alpha_v;
        double t = steepness_of(v, sqrt(x * x + y * y)), turn = atan2(y, x) / (2 * PI);
        turn = turn < 0 ? turn + 1 : turn;
        int row = (int)fmin(t * ROWS, ROWS - 1), column = (int)fmin(turn * COLUMNS, COLUMNS - 1);
        observed[row * COLUMNS + column]++;
    }
    return stats_chi_square(observed, expected, ROWS * COLUMNS);
}

/* ---- the views ---- */

static const double slants[][2] = {{0, 0}, {0.5, 1}, {1.2, -2.5}, {1.5, 0.3}, {1.5607, 4}};
enum { SLANTS = sizeof slants / sizeof *slants };

#define LEAST 1.0001e-4 /* that isn't clamped */
static const double alphas[][2] = {{1, 1}, {0.3, 0.3}, {0.1, 0.6}, {0.01, 0.01}, {LEAST, LEAST}, {LEAST, 1}};
enum { ALPHAS = sizeof alphas / sizeof *alphas, RESOLVED = 3 };

static int tests_done;

static void accept(double p, const char *what, const view *v) {
    tests_done++;
    if (!(p > stats_level(CONFIDENCE, TESTS)))
        fail_msg("%s: kind %d, flags %d, alpha %g %g, cosine %g: p = %g", what, v->bsdf.kind, v->bsdf.flags,
                 v->bsdf.alpha_u, v->bsdf.alpha_v, v->wo.z, p);
}

static void check_diffuse(brume_precision precision) {
    if (!device_test_offers(precision)) skip();
    for (int i = 0; i < SLANTS; i++) {
        view v = {white(BSDF_DIFFUSE), polar(slants[i][0], slants[i][1]), 0};
        v.bsdf.reflectance[1] = 0.25f;
        double *s = sample(&v, precision, (uint64_t)i);
        accept(p_of_directions(&v, s), "directions", &v);
        for (size_t k = 0; k < COUNT; k++) {
            assert_true(s[WEIGHT_R * COUNT + k] == 1 && s[WEIGHT_G * COUNT + k] == 0.25);
            assert_true(fabs(s[PDF * COUNT + k] - s[WI_Z * COUNT + k] / PI) <= FLT_EPSILON);
            assert_true(s[DELTA * COUNT + k] == 0);
        }
        free(s);
    }
}

static void diffuse_float(void **state) { (void)state; check_diffuse(BRUME_PRECISION_FLOAT); }
static void diffuse_double(void **state) { (void)state; check_diffuse(BRUME_PRECISION_DOUBLE); }

/* Samples are mirrored in the facets, to the digits that rounded directions have. */
static void check_mirrored(const view *v, brume_precision precision, const double *m, const double *s) {
    direction o = rounded(v->wo, precision);
    double bound = 8 * (precision == BRUME_PRECISION_DOUBLE ? DBL_EPSILON : FLT_EPSILON);
    for (size_t i = 0; i < FEW; i++) {
        direction facet = {m[i], m[COUNT + i], m[2 * COUNT + i]};
        double twice = 2 * dot(o, facet);
        assert_true(fabs(twice * facet.x - o.x - s[WI_X * COUNT + i]) < bound);
        assert_true(fabs(twice * facet.y - o.y - s[WI_Y * COUNT + i]) < bound);
        assert_true(fabs(twice * facet.z - o.z - s[WI_Z * COUNT + i]) < bound);
    }
}

/* In double: the weight and the density are f / pdf and pdf of the twin where the sample went. */
static void check_weights(const view *v, const double *s) {
    for (size_t i = 0; i < FEW; i++) {
        direction wi = {s[WI_X * COUNT + i], s[WI_Y * COUNT + i], s[WI_Z * COUNT + i]};
        double weight = s[WEIGHT_R * COUNT + i], pdf = s[PDF * COUNT + i], f[3];
        if (weight == 0) {
            assert_true(pdf == 0);
            continue;
        }
        double expected = twin_eval(&v->bsdf, v->wo, wi, f);
        /* a slope in units of alpha is as good as a direction's digits allow */
        double least = fmin(v->bsdf.alpha_u, v->bsdf.alpha_v), cosine = fmin(v->wo.z, wi.z);
        double bound = 1e-13 / least / cosine;
        if (fabs(pdf - expected) > bound * expected || fabs(weight - f[0] / expected) > bound * weight)
            fail_msg("flags %d alpha %g %g cosines %g %g: density %.12g, %.12g, weight %.12g, %.12g", v->bsdf.flags,
                     v->bsdf.alpha_u, v->bsdf.alpha_v, v->wo.z, wi.z, pdf, expected, weight, f[0] / expected);
        assert_true(weight <= 1 + 1e-12 || (v->bsdf.flags & BSDF_SAMPLE_ALL));
    }
}

static void check_rough(int flags) {
    if (!device_test_offers(BRUME_PRECISION_FLOAT)) skip();
    static double expected[ROWS * COLUMNS];
    for (int a = 0; a < ALPHAS; a++)
        for (int i = 0; i < SLANTS; i++) {
            view v = {rough(flags, alphas[a][0], alphas[a][1]), polar(slants[i][0], slants[i][1]), 0};
            facet_counts(&v, expected);
            for (int p = 0; p < 2; p++) {
                brume_precision precision = p ? BRUME_PRECISION_DOUBLE : BRUME_PRECISION_FLOAT;
                if (!device_test_offers(precision)) continue;
                uint64_t seed = (uint64_t)(100 * flags + 10 * a + i + 1000 * p);
                double *m = facets(&v, precision, seed), *s = sample(&v, precision, seed);
                accept(p_of_facets(&v, m, expected), p ? "facets, double" : "facets, float", &v);
                if (p == 0 && a < RESOLVED) accept(p_of_directions(&v, s), "directions", &v);
                check_mirrored(&v, precision, m, s);
                if (p == 1) check_weights(&v, s);
                free(m);
                free(s);
            }
        }
}

static void ggx_visible(void **state) { (void)state; check_rough(0); }
static void beckmann_visible(void **state) { (void)state; check_rough(BSDF_BECKMANN); }
static void ggx_all(void **state) { (void)state; check_rough(BSDF_SAMPLE_ALL); }
static void beckmann_all(void **state) { (void)state; check_rough(BSDF_SAMPLE_ALL | BSDF_BECKMANN); }

/* (x - a)+ exp(-x^2) over sqrt(pi), beyond x. */
static double remainder_beyond(double x, double a) { return (exp(-x * x) / sqrt(PI) - a * erfc(x)) / 2; }

/* Beckmann's remainder, which Newton's steps invert (microfacet.h): as much of it lies beyond the slope as of a normal
 * variate beyond the one that was drawn. Too small an error for any histogram: relative, from 1e-7 in the slope. */
static void beckmann_remainder(void **state) {
    (void)state;
    if (!device_test_offers(BRUME_PRECISION_DOUBLE)) skip();
    int met = 0;
    for (int i = 2; i < SLANTS; i++)
        for (int j = 0; j < ALPHAS - 3; j++) {
            view v = {rough(BSDF_BECKMANN, alphas[j][0], alphas[j][1]), polar(slants[i][0], slants[i][1]), 0};
            double wx = v.bsdf.alpha_u * v.wo.x, wy = v.bsdf.alpha_v * v.wo.y, r = hypot(wx, wy), a = v.wo.z / r;
            double *m = facets(&v, BRUME_PRECISION_DOUBLE, (uint64_t)i);
            for (size_t k = 0; k < FEW; k++) {
                if (u[k] * (1 + twin_lambda(&v.bsdf, v.wo)) < 1 + 1e-9) continue;
                double x = m[k] / v.bsdf.alpha_u, y = m[COUNT + k] / v.bsdf.alpha_v;
                double towards = (x * wx + y * wy) / (r * m[2 * COUNT + k]);
                double drawn = fabs(sqrt(-log1p(-u[COUNT + k])) * cos(2 * PI * u[2 * COUNT + k]));
                double share = remainder_beyond(towards, a) / remainder_beyond(a, a);
                assert_true(fabs(log(share) - log(erfc(drawn))) < 2e-6);
                met++;
            }
            free(m);
        }
    assert_true(met > FEW);
}

/* ---- the light reflected in all ---- */

static double reflected(const void *user, double z, double phi) {
    const view *v = user;
    double f[3];
    twin_eval(&v->bsdf, v->wo, polar(acos(z), phi), f);
    return f[0];
}

/* Under a white sky mirroring facets show the integral of f |cos|, at most 1, and 1 as the surface gets smooth. */
static void furnace(void **state) {
    (void)state;
    if (!device_test_offers(BRUME_PRECISION_FLOAT)) skip();
    for (int flags = 0; flags < 8; flags += 2)
        for (int i = 0; i < SLANTS - 1; i++) {
            view v = {rough(flags, i % 2 ? 0.5 : 0.8, 0.3), polar(slants[i][0], slants[i][1]), 0};
            double *s = sample(&v, BRUME_PRECISION_FLOAT, (uint64_t)(flags + 100 * i));
            double whole = 0;
            for (int k = 0; k < 8; k++)
                whole += stats_integrate(reflected, &v, 0, 1, PI / 4 * k, PI / 4 * (k + 1), 1e-7);
            assert_true(whole < 1 && whole > 0.5);
            accept(stats_mean(s + WEIGHT_R * COUNT, COUNT, whole), "reflected light", &v);
            free(s);
            v.bsdf.alpha_u = v.bsdf.alpha_v = 1e-3f;
            s = sample(&v, BRUME_PRECISION_FLOAT, 7);
            double mean = 0;
            for (size_t k = 0; k < COUNT; k++) mean += s[WEIGHT_R * COUNT + k] / COUNT;
            assert_true(fabs(mean - 1) < 1e-3);
            free(s);
        }
}

/* ---- the tests themselves ---- */

/* 6 % of bias in the density must be seen in every one of these. */
static void sees_planted_bias(void **state) {
    (void)state;
    if (!device_test_offers(BRUME_PRECISION_FLOAT)) skip();
    static double expected[ROWS * COLUMNS];
    double level = stats_level(CONFIDENCE, TESTS);
    view diffuse = {white(BSDF_DIFFUSE), polar(0.5, 1), 0.06};
    double *s = sample(&diffuse, BRUME_PRECISION_FLOAT, 1);
    assert_true(p_of_directions(&diffuse, s) < level);
    free(s);
    for (int flags = 0; flags < 8; flags += 2)
        for (int a = 0; a < ALPHAS; a++) {
            view v = {rough(flags, alphas[a][0], alphas[a][1]), polar(1.2, -2.5), 0.06};
            s = sample(&v, BRUME_PRECISION_FLOAT, 2);
            double *m = facets(&v, BRUME_PRECISION_FLOAT, 2);
            facet_counts(&v, expected);
            assert_true(p_of_facets(&v, m, expected) < level);
            if (a < RESOLVED) assert_true(p_of_directions(&v, s) < level);
            /* and facets 5 % steeper than they were drawn */
            v.bias = 0;
            facet_counts(&v, expected);
            for (size_t i = 0; i < COUNT; i++) m[i] *= 1.05;
            assert_true(p_of_facets(&v, m, expected) < level);
            free(m);
            free(s);
        }
}

static void level_holds(void **state) {
    (void)state;
    assert_true(tests_done <= TESTS);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(diffuse_float),
        cmocka_unit_test(diffuse_double),
        cmocka_unit_test(ggx_visible),
        cmocka_unit_test(beckmann_visible),
        cmocka_unit_test(ggx_all),
        cmocka_unit_test(beckmann_all),
        cmocka_unit_test(beckmann_remainder),
        cmocka_unit_test(furnace),
        cmocka_unit_test(sees_planted_bias),
        cmocka_unit_test(level_holds),
    };
    return cmocka_run_group_tests(tests, device_test_setup, device_test_teardown);
}

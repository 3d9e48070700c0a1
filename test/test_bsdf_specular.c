/* test_bsdf_specular.c -- mirrors, glass and panes against Fresnel's and Snell's laws.
 *
 * Bounds are in units of the device's epsilon and follow from counting roundings; the comment at each says which.
 */
#include <float.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "bsdf_planes.h"

static void check_dielectric(brume_precision precision) {
    if (!device_test_offers(precision)) skip();
    static const double iors[] = {1.5, 1.33, 1.0003, 1, 2.4, 0.7, 1 / 1.5};
    enum { IORS = sizeof iors / sizeof *iors };
    b_bsdf glass[IORS];
    for (int i = 0; i < IORS; i++) {
        glass[i] = white(BSDF_DIELECTRIC);
        glass[i].ior = (float)iors[i];
    }
    uint64_t state = 2;
    for (size_t i = 0; i < COUNT; i += 2) { /* each twice: once drawn to reflect, once to refract */
        double z = test_random_unit(&state);
        z = i % 3 ? z : pow(z, 6);
        direction o = polar(acos(z), 2 * PI * test_random_unit(&state));
        if (test_random_bits(&state) & 1) o.z = -o.z;
        ids[i] = ids[i + 1] = (uint32_t)(test_random_bits(&state) % IORS);
        put(wo, i, rounded(o, precision));
        put(wo, i + 1, rounded(o, precision));
        put(u, i, (direction){0, 0.5, 0.5});
        put(u, i + 1, (direction){LAST_UNIT, 0.5, 0.5});
    }
    device_case c = {precision, 8, glass, IORS, ids, COUNT, wo};
    double *s = device_sample(&c, u), eps = epsilon(precision);
    int refracted = 0, total = 0;
    for (size_t i = 0; i < COUNT; i++) {
        direction o = at(wo, i), in = at(s, i);
        double n = glass[ids[i]].ior, eta = o.z < 0 ? 1 / n : n;
        double pdf = s[PDF * COUNT + i], weight = s[WEIGHT_R * COUNT + i];
        double sine2 = (1 - o.z * o.z) / (eta * eta), sharp = 1 / fabs(1 - sine2); /* near the critical angle */
        double f = sine2 > 1 ? 1 : twin_fresnel_dielectric(o.z, n);
        assert_true(s[DELTA * COUNT + i] == 1);
        if (in.z * o.z > 0) {
            assert_true(in.x == -o.x && in.y == -o.y && in.z == o.z);
            assert_true(weight == 1 && s[ETA * COUNT + i] == 1);
            /* sqrt near the critical angle, then about ten roundings */
            assert_true(fabs(pdf - f) <= eps * (8 + 8 * fmin(sharp, sqrt(1 / eps))) * f);
            total += sine2 > 1;
            continue;
        }
        refracted++;
        assert_true(sine2 < 1 + 4 * eps);
        assert_true(fabs(pdf - (1 - f)) <= eps * (8 + 8 * fmin(sharp, sqrt(1 / eps))));
        /* Snell, to the opposite side, as a unit vector; the angle's inverse tells what an error in sine^2 does */
        assert_true(fabs(in.x * eta + o.x) <= 3 * eps && fabs(in.y * eta + o.y) <= 3 * eps);
        assert_true(fabs(dot(in, in) - 1) <= 16 * eps * fmax(1, sine2 * eta * eta));
        assert_true(fabs(s[ETA * COUNT + i] - eta) <= eps * eta);
        assert_true(fabs(weight * eta * eta - 1) <= 4 * eps); /* radiance / index^2 is kept */
    }
    assert_true(refracted > COUNT / 4 && total > COUNT / 50);
    free(s);
}

static void dielectric_float(void **state) { (void)state; check_dielectric(BRUME_PRECISION_FLOAT); }
static void dielectric_double(void **state) { (void)state; check_dielectric(BRUME_PRECISION_DOUBLE); }

/* Lobes of other colours: their weights times their probabilities are what the surface reflects and lets through. */
static void coloured_dielectric(void **state) {
    (void)state;
    if (!device_test_offers(BRUME_PRECISION_FLOAT)) skip();
    b_bsdf glass[4] = {white(BSDF_DIELECTRIC), white(BSDF_DIELECTRIC), white(BSDF_DIELECTRIC), white(BSDF_DIELECTRIC)};
    static const float r[4][3] = {{1, 0.5f, 0.2f}, {0, 0, 0}, {0.1f, 0.3f, 0.2f}, {0, 0, 0}};
    static const float t[4][3] = {{0.2f, 0.9f, 0}, {1, 1, 0.5f}, {0, 0, 0}, {0, 0, 0}};
    for (int i = 0; i < 4; i++) {
        memcpy(glass[i].reflectance, r[i], sizeof r[i]);
        memcpy(glass[i].transmittance, t[i], sizeof t[i]);
    }
    uint64_t random = 3;
    for (size_t i = 0; i < COUNT; i += 2) {
        direction o = rounded(polar(PI * test_random_unit(&random), 1), BRUME_PRECISION_FLOAT);
        for (size_t k = i; k < i + 2; k++) {
            ids[k] = (uint32_t)(i / 2 % 4);
            put(wo, k, o);
            put(u, k, (direction){k == i ? 0 : LAST_UNIT, 0, 0});
        }
    }
    device_case c = {BRUME_PRECISION_FLOAT, 16, glass, 4, ids, COUNT, wo};
    double *s = device_sample(&c, u);
    for (size_t i = 0; i < COUNT; i += 2) {
        double z = at(wo, i).z, eta = z < 0 ? 1 / 1.5 : 1.5, f = twin_fresnel_dielectric(z, 1.5);
        int inside = (1 - z * z) / (eta * eta) >= 1, both = at(s, i).z * z > 0 && at(s, i + 1).z * z < 0;
        for (int k = 0; k < 3; k++) {
            double back = 0, through = 0;
            for (size_t j = i; j < i + 1 + (size_t)both; j++) {
                double carried = s[(size_t)(WEIGHT_R + k) * COUNT + j] * s[PDF * COUNT + j];
                *(at(s, j).z * z > 0 ? &back : &through) += carried;
            }
            assert_true(fabs(back - r[ids[i]][k] * (inside ? 1 : f)) < 2e-5);
            assert_true(fabs(through - t[ids[i]][k] * (inside ? 0 : (1 - f) / (eta * eta))) < 2e-5);
        }
    }
    free(s);
}

/* Both lobes of every ray: two faces' series summed term by term in double, straight on and mirrored. */
static void panes(void **state) {
    (void)state;
    if (!device_test_offers(BRUME_PRECISION_FLOAT)) skip();
    static const float iors[] = {1.5f, 1.33f, 1.0003f, 1, 2.4f, 0.7f};
    static const float colours[2][3] = {{1, 0.5f, 0.2f}, {0.3f, 0.9f, 0}};
    enum { PANES = sizeof iors / sizeof *iors };
    b_bsdf pane[PANES];
    for (int i = 0; i < PANES; i++) {
        pane[i] = white(BSDF_THIN_DIELECTRIC);
        pane[i].ior = iors[i];
        memcpy(pane[i].reflectance, colours[0], sizeof colours[0]);
        memcpy(pane[i].transmittance, colours[1], sizeof colours[1]);
    }
    uint64_t random = 7;
    for (size_t i = 0; i < COUNT; i += 2) {
        double z = test_random_unit(&random);
        direction o = polar(acos(i % 3 ? z : pow(z, 6)), 2 * PI * test_random_unit(&random));
        if (test_random_bits(&random) & 1) o.z = -o.z;
        for (size_t k = i; k < i + 2; k++) {
            ids[k] = (uint32_t)(i / 2 % PANES);
            put(wo, k, rounded(o, BRUME_PRECISION_FLOAT));
            put(u, k, (direction){k == i ? 0 : LAST_UNIT, 0.5, 0.5});
        }
    }
    device_case c = {BRUME_PRECISION_FLOAT, 16, pane, PANES, ids, COUNT, wo};
    double *s = device_sample(&c, u);
    for (size_t i = 0; i < COUNT; i += 2) {
        double n = iors[ids[i]], z = fabs(at(wo, i).z);
        double face = n < 1 && 1 - z * z >= n * n ? 1 : twin_fresnel_dielectric(z, n);
        double whole = face, inside = 1 - face, carried[2][3] = {{0}};
        for (int bounce = 0; bounce < 100000 && inside > 1e-12; bounce++) { /* out by the back, or by the front again */
            inside *= face;
            whole += inside * (1 - face);
            inside *= face;
        }
        for (size_t j = i; j < i + 2; j++) {
            direction o = at(wo, j), in = at(s, j);
            int through = in.z * o.z < 0;
            assert_true(in.x == -o.x && in.y == -o.y && fabs(in.z) == fabs(o.z));
            assert_true(s[DELTA * COUNT + j] == 1 && s[ETA * COUNT + j] == 1);
            for (int k = 0; k < 3; k++)
                carried[through][k] = s[(size_t)(WEIGHT_R + k) * COUNT + j] * s[PDF * COUNT + j];
        }
        /* as of check_dielectric; the series doubles what one face is off by */
        double sharp = 1 / fabs(1 - (1 - z * z) / (n * n)), eps = FLT_EPSILON;
        double bound = 2 * eps * (8 + 8 * fmin(sharp, sqrt(1 / eps)));
        for (int k = 0; k < 3; k++) {
            assert_true(fabs(carried[0][k] - colours[0][k] * whole) < bound);
            assert_true(fabs(carried[1][k] - colours[1][k] * (1 - whole)) < bound);
        }
    }
    free(s);
}

static void check_conductor(brume_precision precision) {
    if (!device_test_offers(precision)) skip();
    enum { METALS = 8 };
    static const double eta[METALS] = {0, 0.2, 1.5, 0.05, 10, 1e-3, 1, 3.1};
    static const double k[METALS] = {1, 3.9, 0, 12, 10, 1, 1e-2, 2.2};
    b_bsdf metals[METALS];
    for (int i = 0; i < METALS; i++) {
        metals[i] = white(BSDF_CONDUCTOR);
        for (int c = 0; c < 3; c++) {
            metals[i].eta[c] = (float)eta[(i + c * (i > 0)) % METALS];
            metals[i].k[c] = (float)k[(i + c * (i > 0)) % METALS];
        }
        metals[i].reflectance[1] = 0.5f;
    }
    uint64_t state = 4;
    for (size_t i = 0; i < COUNT; i++) {
        ids[i] = (uint32_t)(test_random_bits(&state) % METALS);
        double z = test_random_unit(&state);
        direction o = polar(acos(i % 2 ? z : pow(z, 6)), 2 * PI * test_random_unit(&state));
        put(wo, i, rounded(o, precision));
    }
    device_case c = {precision, 16, metals, METALS, ids, COUNT, wo};
    double *s = device_sample(&c, u), eps = epsilon(precision);
    for (size_t i = 0; i < COUNT; i++) {
        direction o = at(wo, i), in = at(s, i);
        assert_true(in.x == -o.x && in.y == -o.y && in.z == o.z && s[DELTA * COUNT + i] == 1);
        for (int j = 0; j < 3; j++) {
            const b_bsdf *b = &metals[ids[i]];
            double weight = s[(size_t)(WEIGHT_R + j) * COUNT + i];
            if (ids[i] == 0) {
                assert_true(weight == (double)b->reflectance[j]); /* a perfect mirror is perfect */
                continue;
            }
            /* Two quotients of sums of positive terms, each term to about ten roundings; where eta is near 1 and k near
             * 0, a - c cancels: an error in the root of R */
            double f = b->reflectance[j] * twin_fresnel_conductor(o.z, b->eta[j], b->k[j]);
            if (fabs(weight - f) > eps * (32 * f + 16 * sqrt(f)))
                fail_msg("eta %g k %g cosine %g: %.9g instead of %.9g", b->eta[j], b->k[j], o.z, weight, f);
        }
    }
    free(s);
}

static void conductor_float(void **state) { (void)state; check_conductor(BRUME_PRECISION_FLOAT); }
static void conductor_double(void **state) { (void)state; check_conductor(BRUME_PRECISION_DOUBLE); }

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(dielectric_float),
        cmocka_unit_test(dielectric_double),
        cmocka_unit_test(coloured_dielectric),
        cmocka_unit_test(panes),
        cmocka_unit_test(conductor_float),
        cmocka_unit_test(conductor_double),
    };
    return cmocka_run_group_tests(tests, device_test_setup, device_test_teardown);
}

/* test_bsdf.c -- values of cl/bsdf*.h against double twins and Mitsuba 3; what holds of every surface: reciprocity, two
 * sides, the same bits at every width, nothing but numbers. Specular surfaces: test_bsdf_specular.c. Samples of rough
 * and diffuse ones: test_bsdf_sampling.c.
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

enum { SURFACES = 20 };

static b_bsdf surfaces[SURFACES];
static size_t surface_count;
static const double roughness[] = {1.0001e-4, 1e-3, 0.02, 0.3, 1}; /* the least that isn't clamped, just above 1e-4 */

static int setup(void **state) {
    surfaces[0] = white(BSDF_DIFFUSE);
    surfaces[0].reflectance[1] = 0.25f;
    surfaces[0].reflectance[2] = 0;
    surface_count = 1;
    for (int i = 0; i < 5; i++) {
        for (int flags = 0; flags <= BSDF_BECKMANN; flags += BSDF_BECKMANN) {
            b_bsdf b = rough(flags | (i & 1 ? BSDF_SAMPLE_ALL : 0), roughness[i], roughness[(i + flags) % 5]);
            for (int c = 0; c < 3; c++) {
                b.eta[c] = (float)(0.2 + 0.7 * c);
                b.k[c] = (float)(3.9 - 1.3 * c);
                b.reflectance[c] = (float)(1 - 0.3 * c);
            }
            surfaces[surface_count++] = b;
        }
    }
    surfaces[surface_count++] = white(BSDF_DIELECTRIC);
    surfaces[surface_count++] = white(BSDF_THIN_DIELECTRIC);
    surfaces[surface_count++] = white(BSDF_CONDUCTOR);
    surfaces[surface_count++] = white(BSDF_NULL);
    return device_test_setup(state);
}

static device_case all_surfaces(brume_precision precision, uint32_t lanes) {
    device_case c = {precision, lanes, surfaces, surface_count, ids, COUNT, wo};
    return c;
}

/* Pairs of directions, most of them joined by a facet as such a surface has many: elsewhere D is next to nothing. */
static void draw_pairs(brume_precision precision) {
    uint64_t state = 1;
    for (size_t i = 0; i < COUNT; i++) {
        ids[i] = (uint32_t)(test_random_bits(&state) % surface_count);
        const b_bsdf *b = &surfaces[ids[i]];
        double height = 1e-6 + (1 - 1e-6) * pow(test_random_unit(&state), test_random_unit(&state) < 0.5 ? 1 : 4);
        direction o = polar(acos(height), 2 * PI * test_random_unit(&state)), in;
        do {
            double spread = 2 * sqrt(test_random_unit(&state)), turn = 2 * PI * test_random_unit(&state);
            direction m = {b->alpha_u * spread * cos(turn), b->alpha_v * spread * sin(turn), 1};
            double length = sqrt(dot(m, m)), cosine = dot(o, m) / length;
            in.x = 2 * cosine * m.x / length - o.x;
            in.y = 2 * cosine * m.y / length - o.y;
            in.z = 2 * cosine * m.z / length - o.z;
        } while (in.z <= 0 && test_random_unit(&state) < 0.9);
        put(wo, i, rounded(o, precision));
        put(wi, i, rounded(in, precision));
        for (int k = 0; k < 3; k++) u[k * COUNT + i] = test_random_unit(&state);
    }
}

static void check_values(brume_precision precision) {
    if (!device_test_offers(precision)) skip();
    draw_pairs(precision);
    device_case c = all_surfaces(precision, 16);
    double *v = device_eval(&c, wi), eps = epsilon(precision);
    int lit = 0;
    for (size_t i = 0; i < COUNT; i++) {
        double f[3], pdf = twin_eval(&surfaces[ids[i]], at(wo, i), at(wi, i), f), tolerance = 4 * eps;
        if (surfaces[ids[i]].kind == BSDF_ROUGH_CONDUCTOR) {
            /* Slopes are off by 4 eps, D by 4 times that (GGX), or by their square's error in the exponent (Beckmann);
             * some 20 roundings elsewhere. Directions aren't unit to 1 eps, which a grazing facet shows in wo.m. */
            direction m = halfway(at(wo, i), at(wi, i));
            const b_bsdf *b = &surfaces[ids[i]];
            double x = m.x / m.z / b->alpha_u, y = m.y / m.z / b->alpha_v;
            double cosine = (dot(at(wo, i), m) + dot(at(wi, i), m)) / 2;
            tolerance = eps * (36 + 10 * (x * x + y * y) + 4 / cosine);
        }
        for (int k = 0; k < 3; k++)
            if (fabs(v[k * COUNT + i] - f[k]) > tolerance * f[k] + 1e-30)
                fail_msg("surface %u at cosines %g, %g: f %.9g instead of %.9g (%g eps)", ids[i], at(wo, i).z,
                         at(wi, i).z, v[k * COUNT + i], f[k], fabs(v[k * COUNT + i] / f[k] - 1) / eps);
        if (fabs(v[3 * COUNT + i] - pdf) > tolerance * pdf + 1e-30)
            fail_msg("surface %u: density %.9g instead of %.9g", ids[i], v[3 * COUNT + i], pdf);
        lit += pdf > 0;
    }
    assert_true(lit > COUNT / 2);
    free(v);
}

static void values_float(void **state) { (void)state; check_values(BRUME_PRECISION_FLOAT); }
static void values_double(void **state) { (void)state; check_values(BRUME_PRECISION_DOUBLE); }

/* Mitsuba 3.9.1, scalar_rgb, roughconductor with eta = (0.2, 0.9, 1.1), k = (3.9, 2.4, 2.2): eval_pdf, three pairs of
 * directions each. Mitsuba takes Smith's masking of Beckmann's distribution from a rational fit good to 0.35 %. */
static const double mitsuba_pairs[3][6] = {
    {0.458012711, 0.141679934, 0.877582562, -0.55757302, -0.0890699189, 0.825335615},
    {0.958744408, 0.0961953058, 0.267498829, -0.93044975, -0.0544069834, 0.362357754},
    {0.0998334166, 0, 0.995004165, -0.118514187, 0.0168937877, 0.992808636},
};
static const struct { int flags; double alpha_u, alpha_v; double f_pdf[3][4]; } mitsuba[] = {
    {0, 0.3, 0.3, {{0.8647035, 0.5594826, 0.4769732, 0.9182389}, {1.964425, 1.374956, 1.231752, 2.359716},
                   {0.8427302, 0.5451421, 0.464167, 0.8855556}}},
    {0, 0.1, 0.4, {{1.193901, 0.7724809, 0.6585597, 1.256754}, {4.456304, 3.119092, 2.794233, 4.811549},
                   {1.868969, 1.208992, 1.029409, 1.963396}}},
    {BSDF_SAMPLE_ALL, 0.3, 0.3, {{0.8647035, 0.5594826, 0.4769732, 0.9485766}, {1.964425, 1.374956, 1.231752, 2.461884},
                                 {0.8427302, 0.5451421, 0.464167, 0.8865921}}},
    {BSDF_SAMPLE_ALL, 0.1, 0.4, {{1.193901, 0.7724809, 0.6585597, 1.291892}, {4.456304, 3.119092, 2.794233, 4.206998},
                                 {1.868969, 1.208992, 1.029409, 1.965298}}},
    {BSDF_BECKMANN, 0.3, 0.3, {{0.9212214, 0.596051, 0.5081487, 0.9681655}, {2.828983, 1.980085, 1.773855, 3.015364},
                               {0.8446995, 0.546416, 0.4652517, 0.8873348}}},
    {BSDF_BECKMANN, 0.1, 0.4, {{1.536772, 0.9943257, 0.847688, 1.615083}, {5.641928, 3.948944, 3.537653, 5.989312},
                               {1.886374, 1.220251, 1.038995, 1.981587}}},
    {BSDF_BECKMANN | BSDF_SAMPLE_ALL, 0.1, 0.4, {{1.536772, 0.9943257, 0.847688, 1.657388},
                                                 {5.641928, 3.948944, 3.537653, 5.054847},
                                                 {1.886374, 1.220251, 1.038995, 1.983457}}},
};

static void rough_metals_of_mitsuba(void **state) {
    (void)state;
    if (!device_test_offers(BRUME_PRECISION_FLOAT)) skip();
    enum { METALS = sizeof mitsuba / sizeof *mitsuba };
    b_bsdf metals[METALS];
    for (int i = 0; i < METALS; i++) {
        static const float eta[] = {0.2f, 0.9f, 1.1f}, k[] = {3.9f, 2.4f, 2.2f};
        metals[i] = rough(mitsuba[i].flags, mitsuba[i].alpha_u, mitsuba[i].alpha_v);
        memcpy(metals[i].eta, eta, sizeof eta);
        memcpy(metals[i].k, k, sizeof k);
    }
    memset(ids, 0, sizeof ids);
    memset(wo, 0, sizeof wo);
    memset(wi, 0, sizeof wi);
    for (size_t i = 0; i < 3 * METALS; i++) {
        const double *p = mitsuba_pairs[i % 3];
        ids[i] = (uint32_t)i / 3;
        put(wo, i, (direction){p[0], p[1], p[2]});
        put(wi, i, (direction){p[3], p[4], p[5]});
    }
    device_case c = {BRUME_PRECISION_FLOAT, 4, metals, METALS, ids, COUNT, wo};
    double *v = device_eval(&c, wi);
    for (size_t i = 0; i < 3 * METALS; i++)
        for (int k = 0; k < 4; k++) {
            double expected = mitsuba[i / 3].f_pdf[i % 3][k];
            /* f holds the fit twice; seven digits, some lost by Mitsuba's own float */
            double tolerance = mitsuba[i / 3].flags & BSDF_BECKMANN ? 7e-3 : 2e-5;
            if (fabs(v[k * COUNT + i] - expected) > tolerance * expected)
                fail_msg("metal %d, pair %d, value %d: %.8g instead of %.8g", (int)i / 3, (int)i % 3, k,
                         v[k * COUNT + i], expected);
        }
    free(v);
}

/* ---- what holds of every surface ---- */

static void null_lets_pass(void **state) {
    (void)state;
    if (!device_test_offers(BRUME_PRECISION_FLOAT)) skip();
    draw_pairs(BRUME_PRECISION_FLOAT);
    b_bsdf null = white(BSDF_NULL);
    memset(ids, 0, sizeof ids);
    device_case c = {BRUME_PRECISION_FLOAT, 16, &null, 1, ids, COUNT, wo};
    double *s = device_sample(&c, u), *v = device_eval(&c, wi);
    for (size_t i = 0; i < COUNT; i++) {
        direction o = at(wo, i), in = at(s, i);
        assert_true(in.x == -o.x && in.y == -o.y && in.z == -o.z);
        assert_true(s[WEIGHT_G * COUNT + i] == 1 && s[ETA * COUNT + i] == 1 && s[DELTA * COUNT + i] == 1);
        assert_true(v[i] == 0 && v[3 * COUNT + i] == 0);
    }
    free(s);
    free(v);
}

/* f(wo, wi) = f(wi, wo), bit for bit but for the order of two factors. */
static void reciprocity(void **state) {
    (void)state;
    if (!device_test_offers(BRUME_PRECISION_FLOAT)) skip();
    draw_pairs(BRUME_PRECISION_FLOAT);
    device_case c = all_surfaces(BRUME_PRECISION_FLOAT, 16);
    double *v = device_eval(&c, wi);
    c.wo = wi;
    double *swapped = device_eval(&c, wo);
    int lit = 0;
    for (size_t i = 0; i < COUNT; i++) {
        double a = v[i] * at(wo, i).z, b = swapped[i] * at(wi, i).z;
        if (at(wo, i).z <= 0 || at(wi, i).z <= 0) continue;
        assert_true(fabs(a - b) <= 4 * FLT_EPSILON * a);
        lit += a > 0;
    }
    assert_true(lit > COUNT / 2);
    free(v);
    free(swapped);
}

/* One-sided surfaces are black from behind, glass aside. Two-sided ones show `back` there: what the front of `back`
 * shows of mirrored directions. */
static void two_sides(void **state) {
    (void)state;
    if (!device_test_offers(BRUME_PRECISION_FLOAT)) skip();
    draw_pairs(BRUME_PRECISION_FLOAT);
    b_bsdf sided[2 * SURFACES];
    for (size_t i = 0; i < surface_count; i++) {
        sided[i] = surfaces[i];
        sided[surface_count + i] = surfaces[(i + 3) % surface_count];
        sided[surface_count + i].flags |= BSDF_TWO_SIDED;
        sided[surface_count + i].back = (int)i;
    }
    static uint32_t front_ids[COUNT], back_ids[COUNT];
    static double below_o[3 * COUNT], below_i[3 * COUNT];
    for (size_t i = 0; i < COUNT; i++) {
        direction o = at(wo, i), in = at(wi, i);
        front_ids[i] = ids[i];
        back_ids[i] = ids[i] + (uint32_t)surface_count;
        put(below_o, i, (direction){o.x, o.y, -o.z});
        put(below_i, i, (direction){in.x, in.y, -in.z});
    }
    device_case c = {BRUME_PRECISION_FLOAT, 16, sided, 2 * surface_count, front_ids, COUNT, wo};
    double *v = device_eval(&c, wi), *s = device_sample(&c, u);
    c.wo = below_o;
    double *behind_v = device_eval(&c, below_i), *behind_s = device_sample(&c, u);
    c.ids = back_ids;
    double *back_v = device_eval(&c, below_i), *back_s = device_sample(&c, u), *across = device_eval(&c, wi);
    for (size_t i = 0; i < COUNT; i++) {
        int kind = sided[front_ids[i]].kind;
        int passes = kind == BSDF_DIELECTRIC || kind == BSDF_THIN_DIELECTRIC || kind == BSDF_NULL;
        assert_true(behind_v[i] == 0 && behind_v[3 * COUNT + i] == 0);
        assert_true(passes || behind_s[WEIGHT_R * COUNT + i] == 0);
        for (size_t k = 0; k < EVAL_PLANES; k++) assert_true(back_v[k * COUNT + i] == v[k * COUNT + i]);
        for (size_t k = 0; k < SAMPLE_PLANES; k++)
            assert_true(back_s[k * COUNT + i] == (k == WI_Z ? -1 : 1) * s[k * COUNT + i]);
        if (wi[2 * COUNT + i] > 0) assert_true(across[i] == 0);
    }
    double *results[] = {v, s, behind_v, behind_s, back_v, back_s, across};
    for (int i = 0; i < 7; i++) free(results[i]);
}

static void same_bits_at_every_width(void **state) {
    (void)state;
    for (int p = 0; p < 2; p++) {
        brume_precision precision = p ? BRUME_PRECISION_DOUBLE : BRUME_PRECISION_FLOAT;
        if (!device_test_offers(precision)) {
            if (p == 0) skip();
            continue;
        }
        draw_pairs(precision);
        device_case c = all_surfaces(precision, 1);
        double *v = device_eval(&c, wi), *s = device_sample(&c, u);
        for (c.lanes = 4; c.lanes <= 16; c.lanes *= 2) {
            double *wide_v = device_eval(&c, wi), *wide_s = device_sample(&c, u);
            assert_memory_equal(v, wide_v, EVAL_PLANES * COUNT * sizeof *v);
            assert_memory_equal(s, wide_s, SAMPLE_PLANES * COUNT * sizeof *s);
            free(wide_v);
            free(wide_s);
        }
        free(v);
        free(s);
    }
}

/* Directions along, near and below the horizon, straight up, opposite each other; variates at both ends of their range:
 * finite everywhere, no more than all light reflected, and no sample where there is no light. */
static void check_edges(brume_precision precision) {
    if (!device_test_offers(precision)) skip();
    static const double heights[] = {0, 1e-38, 1e-20, 1e-10, 1e-7, 1e-4, 1, 0.5, -1e-20, -1e-7, -0.5, -1};
    static const double ends[] = {0, 0x1p-24, 0x1p-32, 0.25, 0.5, 0.75, LAST_UNIT};
    uint64_t state = 5;
    for (size_t i = 0; i < COUNT; i++) {
        ids[i] = (uint32_t)(test_random_bits(&state) % surface_count);
        double z = heights[test_random_bits(&state) % 12], phi = PI / 4 * (double)(test_random_bits(&state) % 8);
        direction o = {sqrt(1 - z * z) * cos(phi), sqrt(1 - z * z) * sin(phi), z}, in = {-o.x, -o.y, o.z};
        uint64_t pick = test_random_bits(&state);
        if (pick % 4 == 1) in.z = -in.z;
        if (pick % 4 == 2) in = polar(acos(heights[test_random_bits(&state) % 12]), phi * 3);
        if (pick % 4 == 3) in = o;
        put(wo, i, rounded(o, precision));
        put(wi, i, rounded(in, precision));
        for (int k = 0; k < 3; k++) u[k * COUNT + i] = ends[test_random_bits(&state) % 7];
    }
    device_case c = all_surfaces(precision, 16);
    double *v = device_eval(&c, wi), *s = device_sample(&c, u);
    for (size_t k = 0; k < EVAL_PLANES; k++)
        for (size_t i = 0; i < COUNT; i++) assert_true(isfinite(v[k * COUNT + i]) && v[k * COUNT + i] >= 0);
    for (size_t i = 0; i < COUNT; i++) {
        const b_bsdf *b = &surfaces[ids[i]];
        for (size_t k = 0; k < SAMPLE_PLANES; k++)
            if (!isfinite(s[k * COUNT + i]))
                fail_msg("surface %u, cosine %g, u %g %g %g: plane %d is %g", ids[i], at(wo, i).z, u[i], u[COUNT + i],
                         u[2 * COUNT + i], (int)k, s[k * COUNT + i]);
        direction in = at(s, i);
        double weight = s[WEIGHT_R * COUNT + i];
        assert_true(fabs(dot(in, in) - 1) < 1e-5 && weight >= 0);
        int bounded = b->kind != BSDF_DIELECTRIC && !(b->flags & BSDF_SAMPLE_ALL);
        assert_true(!bounded || weight <= 1 + 8 * epsilon(precision));
        if (weight > 0 && (b->kind == BSDF_DIFFUSE || b->kind == BSDF_ROUGH_CONDUCTOR))
            assert_true(at(wo, i).z > 0 && in.z >= 0);
    }
    free(v);
    free(s);
}

static void edges_float(void **state) { (void)state; check_edges(BRUME_PRECISION_FLOAT); }
static void edges_double(void **state) { (void)state; check_edges(BRUME_PRECISION_DOUBLE); }

/* ---- the frame ---- */

static void frames(void **state) {
    (void)state;
    if (!device_test_offers(BRUME_PRECISION_FLOAT)) skip();
    static const char text[] =
        "#include \"bsdf.h\"\n"
        "FN vec load3(__global const real1 *p, uint n) {\n"
        "    return vmake(LOAD(p + AT), LOAD(p + n + AT), LOAD(p + 2 * n + AT));\n"
        "}\n"
        "FN void store3(__global real1 *p, uint n, vec v) {\n"
        "    STORE(p + AT, v.x);\n"
        "    STORE(p + n + AT, v.y);\n"
        "    STORE(p + 2 * n + AT, v.z);\n"
        "}\n"
        "__kernel void test(__global const real1 *n, __global const real1 *tangent, __global real1 *out) {\n"
        "    uint count = get_global_size(0) * LANES;\n"
        "    shading_frame f = shading_frame_of(load3(n, count), load3(tangent, count));\n"
        "    store3(out, count, to_world(&f, vmake(R(1), R(0), R(0))));\n"
        "    store3(out + 3 * count, count, to_world(&f, vmake(R(0), R(1), R(0))));\n"
        "    store3(out + 6 * count, count, to_local(&f, f.n));\n"
        "}\n";
    double *out = malloc(9 * COUNT * sizeof *out);
    assert_non_null(out);
    uint64_t random = 6;
    for (size_t i = 0; i < COUNT; i++) {
        double *n = wo, *tangent = wi;
        direction d = polar(acos(2 * test_random_unit(&random) - 1), 2 * PI * test_random_unit(&random));
        direction t = polar(acos(2 * test_random_unit(&random) - 1), 2 * PI * test_random_unit(&random));
        if (i % 16 == 1) d = (direction){0, 0, -1};
        double size = pow(10, 8 * test_random_unit(&random) - 4);
        if (i % 8 == 2) t = (direction){0, 0, 0};
        if (i % 8 == 3) t = d;
        if (i % 8 == 4) t = (direction){d.x + 1e-3 * t.x, d.y + 1e-3 * t.y, d.z + 1e-3 * t.z};
        put(n, i, rounded(d, BRUME_PRECISION_FLOAT));
        put(tangent, i, rounded((direction){size * t.x, size * t.y, size * t.z}, BRUME_PRECISION_FLOAT));
    }
    device_array arrays[] = {{READ_REAL, wo, 3 * COUNT}, {READ_REAL, wi, 3 * COUNT}, {WRITE_REAL, out, 9 * COUNT}};
    device_test_run(text, NULL, 16, BRUME_PRECISION_FLOAT, COUNT, arrays, 3);
    for (size_t i = 0; i < COUNT; i++) {
        direction n = at(wo, i), tangent = at(wi, i), s = at(out, i), t = at(out + 3 * COUNT, i);
        direction up = at(out + 6 * COUNT, i);
        double bound = 6 * FLT_EPSILON;
        assert_true(fabs(dot(s, s) - 1) < bound && fabs(dot(t, t) - 1) < bound);
        assert_true(fabs(dot(s, t)) < bound && fabs(dot(s, n)) < bound && fabs(dot(t, n)) < bound);
        assert_true(fabs(up.x) < bound && fabs(up.y) < bound && fabs(up.z - 1) < bound);
        double triple = n.x * (s.y * t.z - s.z * t.y) + n.y * (s.z * t.x - s.x * t.z) + n.z * (s.x * t.y - s.y * t.x);
        assert_true(fabs(triple - 1) < 2 * bound);
        /* the tangent has no part along t, and its part in the plane points along s */
        double size = sqrt(dot(tangent, tangent));
        if (i % 8 == 2 || i % 8 == 3) continue;
        assert_true(fabs(dot(tangent, t)) < bound * size && dot(tangent, s) > 0);
    }
    free(out);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(values_float),
        cmocka_unit_test(values_double),
        cmocka_unit_test(rough_metals_of_mitsuba),
        cmocka_unit_test(null_lets_pass),
        cmocka_unit_test(reciprocity),
        cmocka_unit_test(two_sides),
        cmocka_unit_test(same_bits_at_every_width),
        cmocka_unit_test(edges_float),
        cmocka_unit_test(edges_double),
        cmocka_unit_test(frames),
    };
    return cmocka_run_group_tests(tests, setup, device_test_teardown);
}

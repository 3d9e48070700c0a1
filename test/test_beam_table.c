/* test_beam_table.c -- where along a lit interval points are taken: the table of cl/beam_table.h, the one-point rungs
 * of cl/scatter_point.h; and what cl/beam_integral.h makes of an interval without taking any.
 *
 * The geometry of the intervals themselves is test_beam's subject; here they are what the device found. Statistical
 * tests are one family at CONFIDENCE (stats.h), counted by TESTS.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "arrays.h"
#include "device_test.h"
#include "stats.h"

#define PI 3.14159265358979323846

enum { GROUPS = 512, COUNT = 16 * GROUPS, CELLS = 16, VARIATES = 24 };
enum { WIDTH, X0, T_FIRST, T_LAST, DELTA, D, RHO, VERSINE, EXACT, VALUE, NODES = VALUE + 3, BELOW = NODES + CELLS + 1,
       SHARES = BELOW + CELLS + 1, DENSITIES = SHARES + VARIATES, PLANES = DENSITIES + VARIATES };
enum { RAYS = 32, SAMPLES = 1 << 14, DRAWN = RAYS * SAMPLES, BINS = 32, TESTS = 4 * RAYS };

/* 16 beams share a lamp. ray: origin, direction, length, extinctions, g. Of two lit pieces the second is looked at. */
static const char table_text[] =
    "#include \"beam_table.h\"\n"
    "#include \"beam_integral.h\"\n"
    "#include \"light_choice.h\"\n"
    "__kernel void test(__global const b_light *lights, __global const real1 *ray, __global const real1 *u,\n"
    "                   __global real1 *out) {\n"
    "    uint n = get_global_size(0) * LANES;\n"
    "    scene s;\n"
    "    s.lights = lights;\n"
    "    lamp l = lamp_uniform(&s, AT / 16);\n"
    "    ray += AT, u += AT, out += AT;\n"
    "    vec o = vmake(LOAD(ray), LOAD(ray + n), LOAD(ray + 2 * n));\n"
    "    vec d = vmake(LOAD(ray + 3 * n), LOAD(ray + 4 * n), LOAD(ray + 5 * n));\n"
    "    medium m = medium_none();\n"
    "    m.sigma_t = cmake(LOAD(ray + 7 * n), LOAD(ray + 8 * n), LOAD(ray + 9 * n));\n"
    "    m.g = LOAD(ray + 10 * n);\n"
    "    beam g = beam_of(&l, o, d, LOAD(ray + 6 * n));\n"
    "    beam_interval i = beam_interval_select(g.b.width > R(0), g.b, g.a);\n"
    "    STORE(out, i.width); STORE(out + n, i.x0); STORE(out + 2 * n, i.t0); STORE(out + 3 * n, i.t1);\n"
    "    STORE(out + 4 * n, g.delta); STORE(out + 5 * n, g.D); STORE(out + 6 * n, g.rho);\n"
    "    STORE(out + 7 * n, g.versine_out_of_plane);\n"
    "    integral whole = beam_integral(&g, &l, i, &m);\n"
    "    STORE(out + 8 * n, whole.exact ? R(1) : R(0));\n"
    "    STORE(out + 9 * n, whole.value.r); STORE(out + 10 * n, whole.value.g); STORE(out + 11 * n, whole.value.b);\n"
    "    out += 12 * n;\n"
    "    piecewise table = beam_table_of(&g, &l, i, grey_extinction(&m), m.g);\n"
    "    for (int k = 0; k <= PIECES; k++, out += n) STORE(out, table.node[k]);\n"
    "    for (int k = 0; k <= PIECES; k++, out += n) STORE(out, table.below[k]);\n"
    "    for (int k = 0; k < VARIATES; k++, out += n) {\n"
    "        real density, share = piecewise_warp(&table, LOAD(u + k * n), &density);\n"
    "        STORE(out, share); STORE(out + VARIATES * n, density);\n"
    "    }\n"
    "}\n";

static b_light lights[GROUPS];
static double ray[11][COUNT], u[VARIATES][COUNT], out[PLANES][COUNT];

/* ---- cases ------------------------------------------------------------------------------------------------------ */

static void random_direction(uint64_t *seed, double v[3]) {
    double z = test_random_in(seed, -1, 1), phi = test_random_in(seed, 0, 2 * PI), r = sqrt(1 - z * z);
    v[0] = r * cos(phi), v[1] = r * sin(phi), v[2] = z;
}

static void set_lamp(b_light *light, double cutoff, double beam) {
    light->cutoff = (float)cutoff;
    light->beam = (float)beam;
    light->inv_fade = cutoff > beam ? (float)(1 / (cutoff - beam)) : 1e30f;
    light->v_cutoff = (float)(2 * pow(sin(cutoff / 2), 2));
    light->v_beam = (float)(2 * pow(sin(beam / 2), 2));
}

/* Ordinary: fog of moderate depth and beams as in scenes. Else anything that a scene file may say. */
static void make_beams(int ordinary) {
    static const double usual[] = {5, 12, 20, 30, 45, 60, 90, 120}, any[] = {1e-3, 0.1, 3, 20, 89.9, 90, 120, 179, 180};
    static const double means[] = {0, 0.3, 0.6, 0.8, -0.5, 0.9};
    static const double extremes[] = {0.9999, -0.9999, 0.99, -0.99, 0, 1e-6};
    uint64_t seed = ordinary ? 5 : 6;
    memset(lights, 0, sizeof lights);
    for (int i = 0; i < COUNT; i++) {
        int group = i / 16;
        b_light *light = &lights[group];
        if (i % 16 == 0) {
            double axis[3], cutoff = (ordinary ? usual[group % 8] : any[group % 9]) * (PI / 180);
            random_direction(&seed, axis);
            light->kind = group % 5 == 4 ? LIGHT_POINT : LIGHT_SPOT;
            light->texture = -1;
            for (int a = 0; a < 3; a++) {
                light->position[a] = (float)test_random_in(&seed, -1, 1);
                light->axis[a] = (float)axis[a];
            }
            set_lamp(light, cutoff, cutoff * (group % 3 == 0 ? 0.75 : group % 3 == 1 ? 1 : ordinary ? 0.9 : 0));
        }
        double d[3], side[3], back, sigma, along = test_random_in(&seed, 0.2, 2);
        double across = along * tan(fmin(light->cutoff, 1));
        random_direction(&seed, d);
        random_direction(&seed, side);
        across *= test_random_in(&seed, 0, 0.9);
        if (!ordinary && i % 16 == 3) along = across = 0; /* the lamp on the ray */
        if (!ordinary && i % 16 == 4) along = 0, across = 1e-5;
        back = ordinary ? test_random_in(&seed, 0.5, 4) : test_random_in(&seed, -3, 3) * (i % 16 == 5 ? 1e4 : 1);
        for (int a = 0; a < 3; a++) {
            ray[a][i] = (float)(light->position[a] + along * light->axis[a] + across * side[a] - back * d[a]);
            ray[3 + a][i] = (float)d[a];
        }
        ray[6][i] = (float)(ordinary ? back * test_random_in(&seed, 0.7, 3) : pow(10, test_random_in(&seed, -7, 5)));
        if (!ordinary && i % 16 == 7) ray[6][i] = 1e18;
        sigma = ordinary ? pow(10, test_random_in(&seed, -3, 0)) : pow(10, test_random_in(&seed, -12, 6));
        for (int a = 0; a < 3; a++) ray[7 + a][i] = (float)(sigma * (i % 4 == 0 ? 1 - 0.25 * a : 1));
        ray[10][i] = (float)(ordinary ? means[i / 16 / 8 % 6] : extremes[i % 6]);
        for (int k = 0; k < VARIATES; k++) u[k][i] = (k + test_random_unit(&seed)) / VARIATES;
        u[0][i] = 0;
        u[VARIATES - 1][i] = 1 - 0x1p-24;
        for (int k = 0; k < VARIATES; k++) u[k][i] = (float)u[k][i] < 1 ? (float)u[k][i] : 1 - 0x1p-24;
    }
}

static void compute_as(const char *text, uint32_t lanes, brume_precision precision, int ordinary) {
    make_beams(ordinary);
    const device_array arrays[] = {{READ_RAW, lights, sizeof lights}, {READ_REAL, ray, 11 * (size_t)COUNT},
                                   {READ_REAL, u, (size_t)VARIATES * COUNT},
                                   {WRITE_REAL, out, (size_t)PLANES * COUNT}};
    char options[300];
    snprintf(options, sizeof options, FEATURES_ARE(BEAM_FEATURES) " -DVARIATES=%d", VARIATES);
    device_test_run(text, options, lanes, precision, COUNT, arrays, 4);
}

static void compute(uint32_t lanes, brume_precision precision, int ordinary) {
    compute_as(table_text, lanes, precision, ordinary);
}

/* ---- the table --------------------------------------------------------------------------------------------------- */

/* Integral of the density from 0 to x, piecewise linear between the nodes. */
static double share_below(int i, double x) {
    double sum = 0;
    int cell = (int)(x * CELLS);
    cell = cell < CELLS ? cell : CELLS - 1;
    for (int k = 0; k < cell; k++) sum += 0.5 * (out[NODES + k][i] + out[NODES + k + 1][i]) / CELLS;
    double q0 = out[NODES + cell][i], q1 = out[NODES + cell + 1][i], z = x * CELLS - cell;
    return sum + z * (q0 + 0.5 * z * (q1 - q0)) / CELLS;
}

static void check_tables(brume_precision precision, double *largest) {
    const double e = precision == BRUME_PRECISION_DOUBLE ? 1e-13 : 1e-6;
    for (int i = 0; i < COUNT; i++) {
        if (!(out[WIDTH][i] > 0)) continue;
        double last = 0;
        for (int k = 0; k <= CELLS; k++)
            if (!(out[NODES + k][i] >= 0.15 * (1 - e) && out[NODES + k][i] <= 2 * CELLS))
                fail_msg("beam %d: node %d is %g", i, k, out[NODES + k][i]);
        if (!(fabs(share_below(i, 1) - 1) < e) || !(fabs(out[BELOW + CELLS][i] - 1) < e))
            fail_msg("beam %d: the density integrates to %.9g", i, share_below(i, 1));
        for (int k = 0; k < VARIATES; k++) {
            double share = out[SHARES + k][i], density = out[DENSITIES + k][i];
            int cell = share < 1 ? (int)(share * CELLS) : CELLS - 1;
            double q0 = out[NODES + cell][i], q1 = out[NODES + cell + 1][i];
            double there = q0 + (share * CELLS - cell) * (q1 - q0);
            if (!(share >= last && share <= 1)) fail_msg("beam %d: from %.9g to %.9g", i, last, share);
            /* a share is rounded, which moves the density by its slope */
            double rough = e * (density + CELLS * fabs(q1 - q0));
            if (!(density >= 0.15 - rough)) fail_msg("beam %d: a density of %.9g", i, density);
            if (!(fabs(density - there) <= rough))
                fail_msg("beam %d at %.9g: a density of %.9g, not %.9g", i, share, density, there);
            *largest = fmax(*largest, fabs(share_below(i, share) - u[k][i]) / e);
            last = share;
        }
    }
}

static void tables_are_densities(void **state) {
    (void)state;
    for (int precision = 0; precision < 2; precision++)
        for (int ordinary = 0; ordinary < 2; ordinary++) {
            double largest = 0;
            if (!device_test_offers((brume_precision)precision)) continue;
            compute(16, (brume_precision)precision, ordinary);
            check_tables((brume_precision)precision, &largest);
            int lit = 0;
            for (int i = 0; i < COUNT; i++) lit += out[WIDTH][i] > 0;
            print_message("%d lit; shares are where the integral of the density is u, to %.2g e\n", lit, largest);
            assert_true(lit > COUNT / 4);
        }
}

/* ---- the integral ------------------------------------------------------------------------------------------------ */

typedef struct { int i, channel; double theta0; } integrand;

/* Transmittance, falloff and phase at the angle y from the interval's start. */
static double value_at(const integrand *f, double y) {
    int i = f->i;
    const b_light *light = &lights[i / 16];
    double g = ray[10][i], theta = f->theta0 + y, x = out[X0][i] + y;
    double t = out[D][i] * tan(theta), r = out[D][i] / cos(theta);
    /* t + r without cancellation: D (1 + sin) / cos = D cos / (1 - sin) */
    double way = theta < 0 ? out[D][i] * cos(theta) / (1 - sin(theta)) : t + r, falloff = 1;
    double v = 1 + g * g + 2 * g * sin(theta);
    if (light->kind == LIGHT_SPOT) {
        double angle = 2 * asin(sqrt(fmin((out[VERSINE][i] + 2 * out[RHO][i] * pow(sin(x / 2), 2)) / 2, 1)));
        falloff = angle <= light->beam ? 1 : fmax(0, (light->cutoff - angle) / ((double)light->cutoff - light->beam));
    }
    return falloff * exp(-ray[7 + f->channel][i] * fmax(out[DELTA][i] + way, 0)) * (1 - g * g) / (4 * PI * v * sqrt(v));
}

static double gauss(const integrand *f, double a, double b) {
    static const double nodes[4] = {0.1834346424956498, 0.5255324099163290, 0.7966664774136267, 0.9602898564975363};
    static const double weights[4] = {0.3626837833783620, 0.3137066458778873, 0.2223810344533745, 0.1012285362903763};
    double sum = 0, half = (b - a) / 2, middle = (a + b) / 2;
    for (int k = 0; k < 4; k++)
        sum += weights[k] * (value_at(f, middle - half * nodes[k]) + value_at(f, middle + half * nodes[k]));
    return sum * half;
}

/* Two halvings must agree: one could by chance where the falloff has its kinks. */
static double refine(const integrand *f, double a, double b, double whole, double tolerance, int levels) {
    double step = (b - a) / 4, q[4], left, right;
    for (int k = 0; k < 4; k++) q[k] = gauss(f, a + k * step, a + (k + 1) * step);
    left = gauss(f, a, a + 2 * step), right = gauss(f, a + 2 * step, b);
    double quarters = q[0] + q[1] + q[2] + q[3];
    int good = fabs(left + right - whole) <= tolerance && fabs(quarters - whole) <= tolerance;
    if (levels == 0 || good) return quarters;
    return refine(f, a, a + 2 * step, left, tolerance, levels - 1) +
           refine(f, a + 2 * step, b, right, tolerance, levels - 1);
}

static double integral_of(int i, int channel) {
    enum { PARTS = 16 };
    integrand f = {i, channel, atan2(out[T_FIRST][i], out[D][i])};
    double rough[PARTS], all = 0, sum = 0, step = out[WIDTH][i] / PARTS;
    for (int k = 0; k < PARTS; k++) all += rough[k] = gauss(&f, k * step, (k + 1) * step);
    for (int k = 0; k < PARTS; k++) sum += refine(&f, k * step, (k + 1) * step, rough[k], 1e-10 * all, 20);
    return sum;
}

/* What rounding an angle x to e does to the light of a fading rim: how well cutoff - angle is known. Of an interval a
 * turn on, x is as large as 2 pi. */
static double rim_error(int i, double e) {
    const b_light *light = &lights[i / 16];
    double least = PI;
    for (int k = 0; k <= 16; k++) {
        double x = out[X0][i] + out[WIDTH][i] * k / 16, v = out[VERSINE][i] + 2 * out[RHO][i] * pow(sin(x / 2), 2);
        least = fmin(least, 2 * asin(sqrt(fmin(v / 2, 1))));
    }
    int is_rim = light->kind == LIGHT_SPOT && least > 0.9 * light->cutoff;
    return is_rim ? 2 * e * fmax(light->cutoff, fabs(out[X0][i]) + out[WIDTH][i]) / (light->cutoff - least) : 0;
}

/* Largest relative error among the beams called exact, over the bound, and their share. Lamps as near to the ray as
 * those that scatter_interval doesn't ask about are left out, and numbers near the smallest, which have few digits. */
static double check_integrals(brume_precision precision, double bound, double *share) {
    double worst = 0, smallest = precision ? 1e-290 : 1e-34, e = precision ? 0x1p-52 : 0x1p-23;
    int exact = 0, lit = 0;
    for (int i = 0; i < COUNT; i++) {
        if (!(out[WIDTH][i] > 0 && out[D][i] > 1e-4)) continue;
        lit++;
        if (out[EXACT][i] == 0) continue;
        exact++;
        for (int c = 0; c < (i % 4 == 0 ? 3 : 1); c++) {
            double expected = integral_of(i, c), error = fabs(out[VALUE + c][i] / expected - 1);
            if (expected > smallest) worst = fmax(worst, error / (bound + rim_error(i, e)));
        }
    }
    *share = (double)exact / lit;
    return worst;
}

static const double bounds[2] = {5e-6, 3e-6};

static void integrals_are_exact_where_they_say(void **state) {
    (void)state;
    for (int precision = 0; precision < 2; precision++)
        for (int ordinary = 0; ordinary < 2; ordinary++) {
            double share;
            if (!device_test_offers((brume_precision)precision)) continue;
            compute(16, (brume_precision)precision, ordinary);
            double worst = check_integrals((brume_precision)precision, bounds[precision], &share);
            print_message("%s, %s: %.0f %% are exact, to %.2g of the bound\n", precision ? "double" : "float",
                          ordinary ? "ordinary" : "extreme", 100 * share, worst);
            assert_true(worst < 1);
            assert_true(share > (ordinary ? 0.75 : 0.4));
        }
}

static void wrong_integrals_are_noticed(void **state) {
    static const struct { const char *from, *to; int ordinary; } bugs[] = {
        {"INTEGRAL_POLE R(3.8)", "INTEGRAL_POLE R(2.4)", 1},   /* poles nearer than the rule converges for */
        {"INTEGRAL_END R(2.5)", "INTEGRAL_END R(2.05)", 0},
        {"INTEGRAL_POLE_4 R(12.3)", "INTEGRAL_POLE_4 R(4)", 1}, /* nor do four nodes */
        {"INTEGRAL_DEPTH R(6)", "INTEGRAL_DEPTH R(60)", 0},
        /* panels between sums of the start and a part of the width: a narrow one has no digits */
        {"R(0.5) * (high - low)", "R(0.5) * ((high + i.x0) - (low + i.x0))", 0},
        {"lclamp(center - core,", "lclamp(center - core * R(0.99),", 1}}; /* a kink within a panel */
    (void)state;
    if (!device_test_offers(BRUME_PRECISION_FLOAT)) skip();
    for (size_t k = 0; k < sizeof bugs / sizeof bugs[0]; k++) {
        double share;
        const char *text = device_test_plant("beam_integral.h", bugs[k].from, bugs[k].to, table_text);
        compute_as(text, 16, BRUME_PRECISION_FLOAT, bugs[k].ordinary);
        double worst = check_integrals(BRUME_PRECISION_FLOAT, bounds[0], &share);
        if (!(worst > 2)) fail_msg("%s: %.3g of the bound", bugs[k].to, worst);
    }
}

static void every_width_gives_the_same_bits(void **state) {
    static double first[PLANES][COUNT];
    (void)state;
    if (!device_test_offers(BRUME_PRECISION_FLOAT)) skip();
    for (int ordinary = 0; ordinary < 2; ordinary++) {
        compute(16, BRUME_PRECISION_FLOAT, ordinary);
        memcpy(first, out, sizeof out);
        compute(1, BRUME_PRECISION_FLOAT, ordinary);
        for (int p = 0; p < PLANES; p++) /* an interval of no width, or nothing, has no table worth comparing */
            for (int i = 0; i < COUNT; i++)
                if (out[WIDTH][i] > 0 && memcmp(&first[p][i], &out[p][i], sizeof out[p][i]) != 0)
                    fail_msg("beam %d, plane %d: %.17g and %.17g", i, p, first[p][i], out[p][i]);
    }
}

/* ---- points drawn ------------------------------------------------------------------------------------------------ */

/* By scatter_from_lamp, as the rung that STRATEGY says; and warped variates. Rays are those of the beams 1, 17, ... */
static const char draw_text[] =
    "#include \"scatter_point.h\"\n"
    "#include \"beam_table.h\"\n"
    "__kernel void test(__global const b_light *lights, __global const real1 *ray, __global const real1 *u,\n"
    "                   __global real1 *out) {\n"
    "    uint n = get_global_size(0) * LANES, i = AT / SAMPLES;\n"
    "    scene s;\n"
    "    s.lights = lights;\n"
    "    lamp l = lamp_uniform(&s, i);\n"
    "    ray += i, u += AT, out += AT;\n"
    "    vec o = vmake(R(ray[0]), R(ray[RAYS]), R(ray[2 * RAYS]));\n"
    "    vec d = vmake(R(ray[3 * RAYS]), R(ray[4 * RAYS]), R(ray[5 * RAYS]));\n"
    "    real t_end = R(ray[6 * RAYS]);\n"
    "    medium m = medium_none();\n"
    "    m.sigma_t = cmake(R(ray[7 * RAYS]), R(ray[8 * RAYS]), R(ray[9 * RAYS]));\n"
    "    m.g = R(ray[10 * RAYS]);\n"
    "    beam g = beam_of(&l, o, d, t_end);\n"
    "    in_scatter p = scatter_from_lamp(&l, o, d, t_end, &m, LOAD(u), LOAD(u + n));\n"
    "    STORE(out, p.t - g.delta);\n"
    "    real density;\n"
    "    piecewise table = beam_table_of(&g, &l, g.a, grey_extinction(&m), m.g);\n"
    "    STORE(out + n, piecewise_warp(&table, LOAD(u + n), &density));\n"
    "    STORE(out + 2 * n, density);\n"
    "    STORE(out + 3 * n, g.a.t0); STORE(out + 4 * n, g.a.t1); STORE(out + 5 * n, g.b.t0);\n"
    "    STORE(out + 6 * n, g.b.width > R(0) ? g.b.t1 : g.b.t0);\n"
    "    STORE(out + 7 * n, g.D); STORE(out + 8 * n, g.delta);\n"
    "}\n";

static b_light drawn_lights[RAYS];
static double drawn_rays[11 * RAYS], drawn_u[2 * DRAWN], drawn[9][DRAWN];

static void draw(int strategy) {
    uint64_t seed = 17;
    make_beams(1);
    for (int k = 0; k < RAYS; k++) {
        drawn_lights[k] = lights[k];
        for (int p = 0; p < 11; p++) drawn_rays[p * RAYS + k] = ray[p][16 * k + 1];
    }
    for (int i = 0; i < 2 * DRAWN; i++) drawn_u[i] = test_random_unit(&seed);
    const device_array arrays[] = {{READ_RAW, drawn_lights, sizeof drawn_lights}, {READ_REAL, drawn_rays, 11 * RAYS},
                                   {READ_REAL, drawn_u, 2 * DRAWN}, {WRITE_REAL, drawn, 9 * (size_t)DRAWN}};
    char options[300];
    snprintf(options, sizeof options, FEATURES_ARE(BEAM_FEATURES) " -DSTRATEGY=%d -DRAYS=%d -DSAMPLES=%d", strategy,
             RAYS, SAMPLES);
    device_test_run(draw_text, options, 16, BRUME_PRECISION_FLOAT, DRAWN, arrays, 4);
}

/* Share of the points of [t0, t1] below t: by angle, and by transmittance. */
static double by_angle(double apart, double t0, double t1, double t) {
    t = fmin(fmax(t, t0), t1);
    return (atan2(t, apart) - atan2(t0, apart)) / (atan2(t1, apart) - atan2(t0, apart));
}

static double by_transmittance(double sigma, double t0, double t1, double t) {
    return expm1(-sigma * (fmin(fmax(t, t0), t1) - t0)) / expm1(-sigma * (t1 - t0));
}

/* What the rung promises of a ray: the share of points below t. */
static double promised(int strategy, int k, double t) {
    int i = k * SAMPLES;
    double apart = drawn[7][i], sum = 0, weights = 0, sigma = 0;
    for (int c = 0; c < 3; c++) sigma += drawn_rays[(7 + c) * RAYS + k] / 3;
    if (strategy == STRATEGY_EQUIANGULAR)
        return by_angle(apart, -drawn[8][i], drawn_rays[6 * RAYS + k] - drawn[8][i], t);
    for (int piece = 0; piece < 2; piece++) {
        double t0 = drawn[3 + 2 * piece][i], t1 = drawn[4 + 2 * piece][i], angle = atan2(t1, apart) - atan2(t0, apart);
        if (!(t1 > t0)) continue;
        double below = by_angle(apart, t0, t1, t);
        if (strategy == STRATEGY_MIS) below = 0.5 * (below + by_transmittance(sigma, t0, t1, t));
        sum += angle * below;
        weights += angle;
    }
    return sum / weights;
}

static double drawn_p(int promised_by, int k) {
    double observed[BINS] = {0}, expected[BINS], low = -drawn[8][k * SAMPLES], apart = drawn[7][k * SAMPLES];
    double high = low + drawn_rays[6 * RAYS + k], a = atan2(low, apart), b = atan2(high, apart);
    for (int i = k * SAMPLES; i < (k + 1) * SAMPLES; i++) {
        int bin = (int)((atan2(drawn[0][i], apart) - a) / (b - a) * BINS);
        observed[bin < 0 ? 0 : bin < BINS ? bin : BINS - 1]++;
    }
    for (int j = 0; j < BINS; j++) {
        double from = apart * tan(a + (b - a) * j / BINS), to = apart * tan(a + (b - a) * (j + 1) / BINS);
        expected[j] = SAMPLES * (promised(promised_by, k, to) - promised(promised_by, k, from));
    }
    return stats_chi_square(observed, expected, BINS);
}

static void points_follow_their_densities(void **state) {
    (void)state;
    if (!device_test_offers(BRUME_PRECISION_FLOAT)) skip();
    for (int strategy = STRATEGY_EQUIANGULAR; strategy <= STRATEGY_MIS; strategy++) {
        int noticed = 0, lit = 0;
        draw(strategy);
        for (int k = 0; k < RAYS; k++) {
            if (!(drawn[4][k * SAMPLES] > drawn[3][k * SAMPLES])) continue;
            double p = drawn_p(strategy, k);
            if (p < stats_level(CONFIDENCE, TESTS)) fail_msg("strategy %d, ray %d: p = %g", strategy, k, p);
            lit++;
            /* planted: the density of another rung */
            noticed += drawn_p(strategy == STRATEGY_MIS ? STRATEGY_EQUIANGULAR_CONE : STRATEGY_MIS, k) <
                       stats_level(CONFIDENCE, TESTS);
        }
        print_message("strategy %d: another density would be noticed for %d of %d rays\n", strategy, noticed, lit);
        assert_true(lit > RAYS / 2 && noticed > lit / 2);
    }
}

/* The warped variate by chi-square, in 64 cells; planted: as if the density were constant within the table's cells. */
static void warped_variates_follow_the_table(void **state) {
    (void)state;
    if (!device_test_offers(BRUME_PRECISION_FLOAT)) skip();
    draw(STRATEGY_MIS);
    compute(16, BRUME_PRECISION_FLOAT, 1); /* for the nodes */
    int lit = 0, noticed = 0;
    for (int k = 0; k < RAYS; k++) {
        int b = 16 * k + 1;
        double observed[64] = {0}, expected[64], flat[64];
        if (!(drawn[4][k * SAMPLES] > drawn[3][k * SAMPLES]) || drawn[6][k * SAMPLES] > drawn[5][k * SAMPLES]) continue;
        lit++;
        for (int i = k * SAMPLES; i < (k + 1) * SAMPLES; i++) {
            int cell = (int)(drawn[1][i] * 64);
            observed[cell < 64 ? cell : 63]++;
        }
        for (int j = 0; j < 64; j++) {
            expected[j] = SAMPLES * (share_below(b, (j + 1) / 64.0) - share_below(b, j / 64.0));
            flat[j] = SAMPLES * (share_below(b, (j / 4 + 1) / 16.0) - share_below(b, j / 4 / 16.0)) / 4;
        }
        double p = stats_chi_square(observed, expected, 64);
        if (p < stats_level(CONFIDENCE, TESTS)) fail_msg("ray %d: p = %g", k, p);
        noticed += stats_chi_square(observed, flat, 64) < stats_level(CONFIDENCE, TESTS);
    }
    print_message("flat cells would be noticed for %d of %d rays\n", noticed, lit);
    assert_true(lit > RAYS / 2 && noticed > lit / 4);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(tables_are_densities),
        cmocka_unit_test(warped_variates_follow_the_table),
        cmocka_unit_test(points_follow_their_densities),
        cmocka_unit_test(integrals_are_exact_where_they_say),
        cmocka_unit_test(wrong_integrals_are_noticed),
        cmocka_unit_test(every_width_gives_the_same_bits),
    };
    return cmocka_run_group_tests(tests, device_test_setup, device_test_teardown);
}

/* test_beam.c -- cl/beam.h and the falloff of cl/lamp.h against a twin in 80-bit arithmetic.
 *
 * The twin finds where a line crosses a cone as the roots of a quadratic, and angles from differences of unit vectors;
 * the device works with angles throughout. Errors are counted in units that follow from the rounding of what goes in: a
 * direction from the light to a point at distance r on the line is off by e (1 + |w| / r), where e is half an ulp of 1
 * and w leads from the ray's origin to the light. Bounds are a few such units, the same in float and in double, where
 * they leave no room for a formula that is only nearly right.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "device_test.h"
#include "arrays.h"

#define PI 3.14159265358979323846264338327950288L

enum { GROUPS = 3072, COUNT = 16 * GROUPS, VARIATES = 6, POINTS = 24 };
enum { DELTA, CLOSEST, A, B = A + 4, SAMPLES = B + 4, VERSINES = SAMPLES + VARIATES, RESPONSES = VERSINES + VARIATES,
       FALLOFF = RESPONSES + VARIATES, PLANES };

/* The light is the same for the lanes of a work-item, so 16 rays share one. */
static const char text[] =
    "#include \"beam.h\"\n"
    "__kernel void test(__global const b_light *lights, __global const real1 *ray, __global const real1 *u,\n"
    "                   __global real1 *out) {\n"
    "    uint n = get_global_size(0) * LANES;\n"
    "    scene s;\n"
    "    s.lights = lights;\n"
    "    lamp light = lamp_uniform(&s, AT / 16);\n"
    "    ray += AT, u += AT, out += AT;\n"
    "    vec o = vmake(LOAD(ray), LOAD(ray + n), LOAD(ray + 2 * n));\n"
    "    vec d = vmake(LOAD(ray + 3 * n), LOAD(ray + 4 * n), LOAD(ray + 5 * n));\n"
    "    beam g = beam_of(&light, o, d, LOAD(ray + 6 * n));\n"
    "    STORE(out, g.delta); STORE(out + n, g.D); out += 2 * n;\n"
    "    STORE(out, g.a.x0); STORE(out + n, g.a.t0); STORE(out + 2 * n, g.a.t1); STORE(out + 3 * n, g.a.width);\n"
    "    out += 4 * n;\n"
    "    STORE(out, g.b.x0); STORE(out + n, g.b.t0); STORE(out + 2 * n, g.b.t1); STORE(out + 3 * n, g.b.width);\n"
    "    out += 4 * n;\n"
    "    mask second = g.b.width > R(0);\n"
    "    beam_interval i;\n"
    "    i.x0 = second ? g.b.x0 : g.a.x0;\n"
    "    i.t0 = second ? g.b.t0 : g.a.t0;\n"
    "    i.t1 = second ? g.b.t1 : g.a.t1;\n"
    "    i.width = second ? g.b.width : g.a.width;\n"
    "    for (int k = 0; k < VARIATES; k++) {\n"
    "        real t = beam_equiangular(&g, i, LOAD(u + k * n));\n"
    "        STORE(out + k * n, t);\n"
    "        beam_point p = beam_point_at(&g, t);\n"
    "        STORE(out + (VARIATES + k) * n, beam_versine(&g, p.x));\n"
    "        real r = beam_response(&g, &light, p, LOAD(ray + 7 * n));\n"
    "        STORE(out + (2 * VARIATES + k) * n, r);\n"
    "    }\n"
    "    STORE(out + 3 * VARIATES * n, lamp_falloff(&light, LOAD(ray + 8 * n)));\n"
    "}\n";

static b_light lights[GROUPS];
static double ray[9][COUNT], u[VARIATES][COUNT], out[PLANES][COUNT];

/* ---- cases ------------------------------------------------------------------------------------------------------ */

static double round_to(double x, brume_precision precision) {
    return precision == BRUME_PRECISION_DOUBLE ? x : (double)(float)x;
}

static void random_direction(uint64_t *seed, double out3[3]) {
    double z = test_random_in(seed, -1, 1), phi = test_random_in(seed, 0, 6.283185307179586), r = sqrt(1 - z * z);
    out3[0] = r * cos(phi), out3[1] = r * sin(phi), out3[2] = z;
}

static double versine(double angle) { return 2 * pow(sin(angle / 2), 2); }

static void make_light(uint64_t *seed, int group, brume_precision precision) {
    static const double cutoffs[] = {0.01, 1, 20, 45, 89, 90, 91, 120, 179.9, 180};
    static const double offsets[] = {0, 1, 100, 1e4};
    b_light *light = &lights[group];
    memset(light, 0, sizeof *light);
    light->kind = group % 7 == 6 ? LIGHT_POINT : LIGHT_SPOT;
    light->texture = -1;
    double cutoff = cutoffs[group % 10] * 0.017453292519943295, axis[3];
    double beam = cutoff * (group / 10 % 3 == 0 ? 1 : group / 10 % 3 == 1 ? 0.75 : 0);
    random_direction(seed, axis);
    /* Only these have exactly unit length in float, which is what the arrays hold for a kernel in double, too. */
    if (precision == BRUME_PRECISION_DOUBLE)
        for (int i = 0; i < 3; i++) axis[i] = i == group % 3 ? (group & 4 ? 1 : -1) : 0;
    for (int i = 0; i < 3; i++) {
        light->position[i] = (float)(test_random_in(seed, -1, 1) + offsets[group / 30 % 4] * (i - 1.25));
        light->axis[i] = (float)axis[i];
    }
    light->cutoff = (float)cutoff;
    light->beam = (float)beam;
    light->inv_fade = cutoff > beam ? (float)(1 / (cutoff - beam)) : 1e30f;
    light->v_cutoff = (float)versine(cutoff);
    light->v_beam = (float)versine(beam);
}

static void make_ray(uint64_t *seed, int i, brume_precision precision) {
    static const double means[] = {0, -0.7, 0.9, 0.3};
    const b_light *light = &lights[i / 16];
    double target[3], d[3], side[3], scale = pow(10, test_random_in(seed, -2, 2));
    random_direction(seed, d);
    random_direction(seed, side);
    /* Aimed at the cone's inside or edge; past the light by far and by little; through the light itself. */
    double along = test_random_in(seed, 0, 1);
    double across = tan(fmin(light->cutoff, 1.2f)) * along * test_random_in(seed, 0, 1.5);
    if (i % 8 == 5) along = 0, across = pow(10, test_random_in(seed, -6, 0));
    if (i % 8 == 6) along = across = 0;
    if (i % 8 == 7) along = -along;
    for (int k = 0; k < 3; k++) target[k] = light->position[k] + scale * (along * light->axis[k] + across * side[k]);
    double back = scale * test_random_in(seed, -1, 3), length = 0;
    for (int k = 0; k < 3; k++) {
        ray[k][i] = round_to(target[k] - back * d[k], precision);
        /* A float knows its own direction to the target better than the one that the target was made with. */
        if (fabs(back) > 0.1 * scale) d[k] = (back > 0 ? 1 : -1) * (target[k] - ray[k][i]);
        length += d[k] * d[k];
    }
    for (int k = 0; k < 3; k++) ray[3 + k][i] = round_to(d[k] / sqrt(length), precision);
    int extent = i / 8 % 8;
    double t_end = extent == 0 ? 1e18 : extent == 1 ? scale * 1e-4 : scale * pow(10, test_random_in(seed, -1, 1.5));
    ray[6][i] = round_to(t_end, precision);
    ray[7][i] = round_to(means[i / 3 % 4], precision);
    /* Falloff: around the cutoff, around the beam, in between. */
    double angle = test_random_in(seed, light->beam, light->cutoff);
    if (i & 1) angle = (i & 2 ? light->beam : light->cutoff) * (1 + test_random_in(seed, -1e-3, 1e-3));
    ray[8][i] = round_to(versine(fmin(angle, 3.1415925)), precision);
    for (int k = 0; k < VARIATES; k++) u[k][i] = (k + test_random_unit(seed)) / VARIATES;
    u[0][i] = 0;
    u[VARIATES - 1][i] = 1 - 0x1p-24;
    for (int k = 0; k < VARIATES; k++) u[k][i] = round_to(u[k][i], precision);
}

static void compute(uint32_t lanes, brume_precision precision) {
    uint64_t seed = 3;
    for (int g = 0; g < GROUPS; g++) make_light(&seed, g, precision);
    for (int i = 0; i < COUNT; i++) make_ray(&seed, i, precision);
    const device_array arrays[] = {{READ_RAW, lights, sizeof lights}, {READ_REAL, ray, 9 * (size_t)COUNT},
                                   {READ_REAL, u, (size_t)VARIATES * COUNT},
                                   {WRITE_REAL, out, (size_t)PLANES * COUNT}};
    char options[32];
    snprintf(options, sizeof options, "-DVARIATES=%d", VARIATES);
    device_test_run(text, options, lanes, precision, COUNT, arrays, 4);
}

/* ---- the twin --------------------------------------------------------------------------------------------------- */

typedef struct {
    const b_light *light;
    long double d[3], n[3], axis[3], delta, D, distance, extent, w, start, end, e;
} twin;

static long double dot(const long double a[3], const long double b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void normalize(long double a[3]) {
    long double length = sqrtl(dot(a, a));
    for (int k = 0; k < 3; k++) a[k] /= length;
}

static twin twin_of(int i, brume_precision precision) {
    twin t = {.light = &lights[i / 16], .e = precision == BRUME_PRECISION_DOUBLE ? 0x1p-53L : 0x1p-24L};
    long double w[3], largest_o = 0, largest_l = 0;
    for (int k = 0; k < 3; k++) {
        t.d[k] = ray[3 + k][i];
        t.axis[k] = t.light->axis[k];
        w[k] = (long double)t.light->position[k] - ray[k][i];
        largest_o = fmaxl(largest_o, fabs(ray[k][i]));
        largest_l = fmaxl(largest_l, fabsf(t.light->position[k]));
    }
    normalize(t.d);
    normalize(t.axis);
    t.w = sqrtl(dot(w, w));
    t.delta = dot(w, t.d);
    for (int k = 0; k < 3; k++) t.n[k] = t.delta * t.d[k] - w[k];
    t.distance = sqrtl(dot(t.n, t.n));
    for (int k = 0; k < 3; k++) t.n[k] /= t.distance > 0 ? t.distance : 1;
    /* The floor is part of what beam_of promises. */
    t.extent = largest_o + largest_l;
    t.D = fmaxl(t.distance, t.extent * 0x1p-21L);
    t.start = -t.delta;
    t.end = ray[6][i] - t.delta;
    return t;
}

/* 1 - cos of the angle between the spot's axis and the direction from the light to t' on the line. */
static long double twin_versine(const twin *b, long double t) {
    long double r = hypotl(b->D, t), sum = 0;
    for (int k = 0; k < 3; k++) {
        long double difference = (b->n[k] * b->D + b->d[k] * t) / r - b->axis[k];
        sum += difference * difference / 2;
    }
    return sum;
}

static long double angle_of(long double v) { return 2 * asinl(sqrtl(fminl(fmaxl(v, 0), 2) / 2)); }

/* Angle between t0 and t1 as seen from the light. */
static long double angle_between(const twin *b, long double t0, long double t1) {
    return atan2l(b->D * (t1 - t0), b->D * b->D + t0 * t1);
}

/* Ends of the lit pieces of the segment for a cutoff of versine v; returns their number, and the angle of all. */
static int lit_pieces(const twin *b, long double v, long double ends[4], long double *width) {
    long double cuts[4] = {b->start}, c = 1 - v;
    int count = 1, pieces = 0;
    *width = 0;
    if (b->light->kind == LIGHT_SPOT) {
        long double an = dot(b->axis, b->n), ad = dot(b->axis, b->d);
        long double p = ad * ad - c * c, q = an * ad, r = an * an - c * c;
        long double reach = an * an + ad * ad - c * c, root = c * c * reach; /* q^2 - p r without cancellation */
        long double s = reach > 0 ? -(q + copysignl(sqrtl(root), q)) : 0;
        long double x[2] = {s != 0 ? r / s * b->D : 0, p != 0 ? s / p * b->D : 0};
        if (x[0] > x[1]) s = x[0], x[0] = x[1], x[1] = s;
        for (int k = 0; k < 2 && reach > 0; k++)
            if (x[k] > b->start && x[k] < b->end) cuts[count++] = x[k];
    }
    cuts[count] = b->end;
    for (int k = 0; k < count; k++) {
        /* the piece's middle in the angle */
        long double half = (atanl(cuts[k] / b->D) + atanl(cuts[k + 1] / b->D)) / 2;
        if (b->light->kind == LIGHT_SPOT && !(twin_versine(b, b->D * tanl(half)) < v)) continue;
        *width += angle_between(b, cuts[k], cuts[k + 1]);
        if (pieces > 0 && ends[2 * pieces - 1] == cuts[k]) pieces--; /* a root that only touches */
        else ends[2 * pieces] = cuts[k];
        ends[2 * pieces++ + 1] = cuts[k + 1];
    }
    return pieces;
}

/* How far directions to the line's closest point may be off: see the top of the file. */
static long double turn(const twin *b, long double t) {
    long double tilt = b->distance < b->D ? b->D / b->distance : 1; /* the floor of D moves an inexact n away */
    return b->e * (1 + b->w / hypotl(b->D, t) * tilt);
}

/* A versine moved by an angle and by its own rounding. */
static long double turned(const twin *b, long double v, long double by) {
    long double angle = angle_of(v) + by;
    if (angle < 0) return -1;
    return angle >= PI ? 3 : 2 * powl(sinl(angle / 2), 2) + (by > 0 ? 4 : -4) * b->e * v;
}

/* Where the light sits on the line to rounding, the plane through both has no direction. */
static int has_plane(const twin *b) {
    return b->light->kind == LIGHT_POINT || b->distance > 64 * b->e * (b->w + b->extent);
}

/* ---- tests ------------------------------------------------------------------------------------------------------ */

static void worse(double *worst, long double error, long double unit) {
    double ratio = (double)(error / unit);
    if (!(ratio <= *worst)) *worst = isnan(ratio) ? 1e300 : ratio;
}

static void must_stay_below(const char *what, brume_precision precision, double worst, double bound) {
    if (!(worst < bound))
        fail_msg("%s, %s: %g units, %g are allowed", what, precision == BRUME_PRECISION_DOUBLE ? "double" : "float",
                 worst, bound);
}

static int inside(const twin *b, int i, int interval, long double t, long double slack) {
    const int at = interval ? B : A;
    if (!(out[at + 3][i] > 0)) return 0;
    return angle_between(b, out[at + 1][i], t) >= -slack && angle_between(b, t, out[at + 2][i]) >= -slack;
}

/* Every point that the twin finds inside of the cone by SLACK units lies in an interval, none that is outside does:
 * how often not. */
static int check_lit_set(brume_precision precision, int *lit, int *dark, int *wide) {
    enum { SLACK = 16 };
    uint64_t seed = 5;
    int wrong = 0;
    for (int i = 0; i < COUNT; i++) {
        twin b = twin_of(i, precision);
        if (!has_plane(&b)) continue;
        long double from = atanl(b.start / b.D), width = angle_between(&b, b.start, b.end), slack = SLACK * turn(&b, 0);
        *wide += out[B + 3][i] > 0;
        for (int k = 0; k < POINTS; k++) {
            double share = test_random_unit(&seed);
            long double t = k & 1 ? b.start + (b.end - b.start) * share : b.D * tanl(from + width * share);
            if (k > 1 && k < 8) { /* close to the ends of what the device found */
                double edge = out[(k & 4 ? B : A) + 1 + k % 2][i];
                t = edge + (share - 0.5) * 64 * (double)turn(&b, 0) * (fabs(edge) + (double)b.D);
            }
            if (!(t >= b.start && t <= b.end)) continue;
            long double v = b.light->kind == LIGHT_SPOT ? twin_versine(&b, t) : 0;
            long double limit = b.light->kind == LIGHT_SPOT ? b.light->v_cutoff : 2;
            int found = inside(&b, i, 0, t, slack) || inside(&b, i, 1, t, slack);
            int surely = inside(&b, i, 0, t, -slack) || inside(&b, i, 1, t, -slack);
            wrong += (v < turned(&b, limit, -slack) && !found) || (v > turned(&b, limit, slack) && surely);
            *lit += v < turned(&b, limit, -slack);
            *dark += v > turned(&b, limit, slack);
        }
    }
    return wrong;
}

/* The angle of all that is lit lies between those of cones narrower and wider by SLACK units: by how much not. */
static double check_widths(brume_precision precision) {
    double delta = 0, closest = 0, width = 0;
    for (int i = 0; i < COUNT; i++) {
        twin b = twin_of(i, precision);
        worse(&delta, fabsl(out[DELTA][i] - b.delta), b.e * b.w + 1e-30L);
        worse(&closest, fabsl(out[CLOSEST][i] - b.D), b.e * (b.w + b.D));
        if (!has_plane(&b)) continue;
        long double low, high, ends[4], found = (long double)out[A + 3][i] + out[B + 3][i], slack = 16 * turn(&b, 0);
        lit_pieces(&b, turned(&b, b.light->v_cutoff, -slack), ends, &low);
        lit_pieces(&b, turned(&b, b.light->v_cutoff, slack), ends, &high);
        /* The ends of the segment, seen from the light; and what the closest distance's own error scales. */
        long double far = fminl(fabsl(b.start), fabsl(b.end)), r = hypotl(b.D, b.start > 0 || b.end < 0 ? far : 0);
        long double unit = b.e * (b.w / r + (1 + b.w / b.D) * found + (b.start * b.end < 0 ? 1 : b.D / r));
        worse(&width, fmaxl(low - found, found - high), unit);
    }
    must_stay_below("distance along the ray", precision, delta, 4);
    must_stay_below("distance from the ray", precision, closest, 4);
    return width;
}

/* u is the share of the angle, in order, and never outside of the interval. */
static void check_equiangular(brume_precision precision) {
    double worst = 0;
    for (int i = 0; i < COUNT; i++) {
        const int at = out[B + 3][i] > 0 ? B : A;
        if (!(out[at + 3][i] > 0)) continue;
        twin b = twin_of(i, precision);
        b.D = out[CLOSEST][i];
        long double t0 = out[at + 1][i], t1 = out[at + 2][i], all = angle_between(&b, t0, t1);
        int whole = t0 == -out[DELTA][i] && t1 == round_to(ray[6][i] - out[DELTA][i], precision);
        for (int k = 0; k < VARIATES; k++) {
            double t = out[SAMPLES + k][i];
            if (!(t >= t0 && t <= t1)) fail_msg("ray %d: %.9g is outside of [%.9Lg, %.9Lg]", i, t, t0, t1);
            if (k > 0 && !(t >= out[SAMPLES + k - 1][i]))
                fail_msg("ray %d: samples out of order at u = %g", i, u[k][i]);
            /* angles are rounded, so are lengths of the size of t' (times D / r^2 as seen from the light) */
            long double far = fmaxl(fabsl(t0), fabsl(t1)), near = t0 * t1 > 0 ? fminl(fabsl(t0), fabsl(t1)) : 0;
            long double unit = b.e * (all + far * b.D / (b.D * b.D + near * near));
            if (near == 0 || !whole || out[at + 3][i] > 0.02) unit = b.e * (1 + all);
            worse(&worst, fabsl(angle_between(&b, t0, t) - u[k][i] * all), unit);
        }
    }
    must_stay_below("share of the angle", precision, worst, 16);
}

static long double twin_falloff(const b_light *light, long double angle) {
    if (angle >= angle_of(light->v_cutoff)) return 0;
    if (angle <= angle_of(light->v_beam)) return 1;
    return fminl(fmaxl((light->cutoff - angle) * light->inv_fade, 0), 1);
}

/* (1 - g^2) / (4 pi (1 + g^2 - 2 g cos)^(3/2)) */
static long double twin_phase(long double v, long double g, long double *x) {
    *x = (1 - g) * (1 - g) + 2 * g * v;
    return (1 - g * g) / (4 * PI * *x * sqrtl(*x));
}

static void check_response(brume_precision precision) {
    double versines = 0, responses = 0;
    for (int i = 0; i < COUNT; i++) {
        if (!(out[A + 3][i] + out[B + 3][i] > 0)) continue;
        twin b = twin_of(i, precision);
        if (!has_plane(&b)) continue;
        for (int k = 0; k < VARIATES; k++) {
            long double t = out[SAMPLES + k][i], r = hypotl(b.D, t), off = turn(&b, t), x, low = 1, high = 1;
            if (b.light->kind == LIGHT_SPOT) {
                long double v = twin_versine(&b, t), angle = angle_of(v), sine = sqrtl(v * fmaxl(2 - v, 0));
                worse(&versines, fabsl(out[VERSINES + k][i] - v), off * sine + off * off + b.e * v);
                /* 16 units of angle, and the versine's own near pi, where it can't tell angles apart */
                off = 16 * (off + 2 * b.e * sqrtl(v / fmaxl(2 - v, 2 * b.e)));
                low = twin_falloff(b.light, angle + off);
                high = twin_falloff(b.light, angle - off);
            }
            /* light travels along D n + t' d, scattered light along -d */
            long double phase = twin_phase(1 + t / r, ray[7][i], &x);
            long double rough = b.e * (8 + 48 * fabsl(ray[7][i]) * (b.w / r + 1) / x);
            long double error = fmaxl(low * phase - out[RESPONSES + k][i], out[RESPONSES + k][i] - high * phase);
            worse(&responses, error, rough * high * phase + 1e-36L);
        }
    }
    must_stay_below("1 - cos to the axis", precision, versines, 16);
    must_stay_below("response", precision, responses, 1);
}

static void check_falloff(brume_precision precision) {
    const long double e = precision == BRUME_PRECISION_DOUBLE ? 0x1p-53L : 0x1p-24L;
    double worst = 0;
    int fading = 0;
    for (int i = 0; i < COUNT; i++) {
        const b_light *light = &lights[i / 16];
        if (light->kind != LIGHT_SPOT) continue;
        long double v = ray[8][i], angle = angle_of(v), found = out[FALLOFF][i];
        long double off = 8 * e * (angle + sqrtl(v / fmaxl(2 - v, e)));
        long double low = twin_falloff(light, angle + off), high = twin_falloff(light, angle - off);
        worse(&worst, fmaxl(low - found, found - high), 4 * e);
        fading += found > 0 && found < 1;
    }
    must_stay_below("falloff", precision, worst, 1);
    assert_true(fading > COUNT / 8);
}

static void check(brume_precision precision) {
    if (!device_test_offers(precision)) skip();
    compute(16, precision);
    int lit = 0, dark = 0, wide = 0;
    assert_int_equal(check_lit_set(precision, &lit, &dark, &wide), 0);
    /* the cases do test something */
    assert_true(lit > COUNT && dark > COUNT && wide > 100);
    must_stay_below("angle of what is lit", precision, check_widths(precision), 16);
    check_equiangular(precision);
    check_response(precision);
    check_falloff(precision);
}

static void beams_in_float(void **state) {
    (void)state;
    check(BRUME_PRECISION_FLOAT);
}

static void beams_in_double(void **state) {
    (void)state;
    check(BRUME_PRECISION_DOUBLE);
}

/* Planted: intervals a thousandth too wide or moved by a thousandth of their length. */
static void wrong_intervals_are_noticed(void **state) {
    (void)state;
    if (!device_test_offers(BRUME_PRECISION_FLOAT)) skip();
    int lit = 0, dark = 0, wide = 0;
    compute(16, BRUME_PRECISION_FLOAT);
    for (int i = 0; i < COUNT; i++) out[A + 3][i] *= 1.001;
    assert_true(check_widths(BRUME_PRECISION_FLOAT) > 1000);
    for (int i = 0; i < COUNT; i++) out[A + 1][i] += 1e-3 * (out[A + 2][i] - out[A + 1][i]);
    assert_true(check_lit_set(BRUME_PRECISION_FLOAT, &lit, &dark, &wide) > 100);
}

static void every_width_gives_the_same_bits(void **state) {
    (void)state;
    if (!device_test_offers(BRUME_PRECISION_FLOAT)) skip();
    static double first[PLANES][COUNT];
    compute(16, BRUME_PRECISION_FLOAT);
    memcpy(first, out, sizeof out);
    compute(1, BRUME_PRECISION_FLOAT);
    assert_memory_equal(first, out, sizeof out);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(beams_in_float),
        cmocka_unit_test(beams_in_double),
        cmocka_unit_test(wrong_intervals_are_noticed),
        cmocka_unit_test(every_width_gives_the_same_bits),
    };
    return cmocka_run_group_tests(tests, device_test_setup, device_test_teardown);
}

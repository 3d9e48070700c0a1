/* test_wedge.c -- what cl/traverse_wedge.h says about many points of a ray at once, against a shadow ray for each.
 *
 * Where the two differ, brute force in double decides whether rounding excuses it: only if moving lamp or point by some
 * units of the last place of their coordinates makes an occluder come or go. Closed meshes need no such excuse: from
 * inside to outside not one position may be lit, those exactly behind edges and vertices included.
 *
 * Planted bugs are changes to the text of traverse_wedge.h that leave everything else as it is.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "bvh.h"
#include "device_test.h"
#include "meshes.h"

enum { WEDGES = 4096, POSITIONS = 64, PLANES = 6 };
enum { T0, T1, D, DELTA, OPEN, COUNT };

/* One wedge a lane. in: lamp, origin, direction, length, offset of the positions, whether the ray ends at what it hits.
 * setup: number of blocks; whether positions are the very ends of ranges that the triangles hide, as many as there is
 * room for, instead of evenly spaced. */
static const char kernel_text[] =
    "#include \"scatter_segment.h\"\n"
    "__kernel void test(__global const b_params *params, __global const b_node *nodes,\n"
    "                   __global const b_triangle_block *blocks, __global const b_quadric *quadrics,\n"
    "                   __global const int *ids, __global const int *setup, __global const real1 *in,\n"
    "                   __global real1 *out, __global real1 *positions, __global uint *bits) {\n"
    "    uint n = get_global_size(0) * LANES;\n"
    "    scene s;\n"
    "    s.params = params;\n"
    "    s.geometry.nodes = nodes; s.geometry.blocks = blocks; s.geometry.quadrics = quadrics;\n"
    "    s.geometry.quadric_ids = ids; s.geometry.triangle_count = params->triangle_count;\n"
    "    in += AT, out += AT, positions += AT, bits += AT;\n"
    "    lamp l;\n"
    "    l.position = vmake(LOAD(in), LOAD(in + n), LOAD(in + 2 * n));\n"
    "    l.axis = vmake(R(0), R(0), R(1));\n"
    "    l.intensity = cgrey(R(1));\n"
    "    l.cutoff = l.inv_fade = l.v_cutoff = l.v_beam = R(0);\n"
    "    l.directional = l.cone = l.cosine = FALSE_MASK;\n"
    "    l.light = I(-1);\n"
    "    vec o = vmake(LOAD(in + 3 * n), LOAD(in + 4 * n), LOAD(in + 5 * n));\n"
    "    vec d = vmake(LOAD(in + 6 * n), LOAD(in + 7 * n), LOAD(in + 8 * n));\n"
    "    real t_end = LOAD(in + 9 * n), u = LOAD(in + 10 * n);\n"
    "    hit h = closest(&s.geometry, o, d, R(0), t_end, TRUE_MASK);\n"
    "    t_end = LOAD(in + 11 * n) > R(0) ? h.t : t_end;\n"
    "    beam g = beam_of(&l, o, d, t_end);\n"
    "    lanes_of_real rows[16], t[64];\n"
    "    lanes_of_u32 low, high, rays_low, rays_high;\n"
    "    lanes_of_ireal counts;\n"
    "    low.all = high.all = rays_low.all = rays_high.all = U32(0);\n"
    "    counts.all = I(64);\n"
    "    wedge_store(&s, &l, &g, d, g.a, rows);\n"
    "    for (int j = 0; j < 64; j++) t[j].all = beam_equiangular(&g, g.a, (R(j) + u) * R(1.0 / 64));\n"
    "    if (setup[1]) for (int k = 0; k < LANES; k++) {\n"
    "        wedge w = wedge_take(rows, k);\n"
    "        int count = 0;\n"
    "        for (int i = 0; i < *setup && count < 64; i++) {\n"
    "            lanes_of_wide a, b;\n"
    "            ulong set = wedge_block(&blocks[(i + 7 * (int)(AT + k)) % *setup], &w, &a, &b);\n"
    "            while (set) {\n"
    "                int q = wide_last(set);\n"
    "                set = wide_without(set, q);\n"
    "                for (int e = 0; e < 2; e++) {\n"
    "                    real1 end = e ? b.one[q] : a.one[q];\n"
    "                    if (!(end > w.t0 && end < w.t1) || count == 64) continue;\n"
    "                    int at = count++;\n"
    "                    for (; at > 0 && t[at - 1].one[k] > end; at--) t[at].one[k] = t[at - 1].one[k];\n"
    "                    t[at].one[k] = end;\n"
    "                }\n"
    "            }\n"
    "        }\n"
    "        counts.one[k] = count;\n"
    "    }\n"
    "    wedge_rasterize(&s, rows, t, counts.all, counts.all > I(0), &low, &high);\n"
    "    if (!setup[1]) for (int j = 0; j < 64; j++) {\n"
    "        real distance = sqrt(fma(t[j].all, t[j].all, square(g.D)));\n"
    "        vec wi = vscale(vmad(d, t[j].all, vscale(g.n, g.D)), R(-1) / distance);\n"
    "        real along = lclamp(t[j].all + g.delta, R(0), t_end);\n"
    "        mask dark = occluded(&s.geometry, vmad(d, along, o), wi, R(0), distance * SHORT_OF_LIGHT, TRUE_MASK);\n"
    "        ureal32 bit = to_ureal32(dark ? I(1) : I(0)) << U32(j & 31);\n"
    "        if (j < 32) rays_low.all |= bit; else rays_high.all |= bit;\n"
    "    }\n"
    "    for (int j = 0; j < 64; j++) STORE(positions + j * n, t[j].all);\n"
    "    STORE(out, g.a.t0); STORE(out + n, g.a.t1); STORE(out + 2 * n, g.D); STORE(out + 3 * n, g.delta);\n"
    "    STORE(out + 4 * n, wedge_open(&s, rows, TRUE_MASK) ? R(1) : R(0));\n"
    "    STORE(out + 5 * n, to_real(counts.all));\n"
    "    STORE_BITS(bits, low.all); STORE_BITS(bits + n, high.all);\n"
    "    STORE_BITS(bits + 2 * n, rays_low.all); STORE_BITS(bits + 3 * n, rays_high.all);\n"
    "}\n";

static double scene_radius = 2;
static double in[12][WEDGES], out[PLANES][WEDGES], positions[POSITIONS][WEDGES];
static uint32_t bits[4][WEDGES];

/* Nearer, lamp and ray span no plane: scatter_interval sends rays. */
static int is_planar(int i) { return out[D][i] > 1e-4 * scene_radius; }

static int wedge_dark_at(int i, int j) { return bits[j / 32][i] >> (j % 32) & 1; }
static int ray_dark_at(int i, int j) { return bits[2 + j / 32][i] >> (j % 32) & 1; }

static void compute(const char *text, const char *more, uint32_t lanes, int ends, const test_mesh *mesh) {
    static brume_context *context;
    brume_bvh bvh;
    b_params params;
    char options[160];
    if (!context) assert_int_equal(brume_context_create(&context), BRUME_OK);
    assert_int_equal(brume_bvh_build(context, mesh->positions, mesh->triangles, mesh->triangle_count, mesh->quadrics,
                                     mesh->quadric_count, &bvh), BRUME_OK);
    assert_true(bvh.stack_size <= 200);
    memset(&params, 0, sizeof params);
    params.scene_radius = (float)scene_radius;
    params.triangle_count = (int)mesh->triangle_count;
    int32_t setup[2] = {(int32_t)bvh.block_count, ends};
    const device_array arrays[] = {
        {READ_RAW, &params, sizeof params}, {READ_RAW, bvh.nodes, bvh.node_count * sizeof *bvh.nodes},
        {READ_RAW, mesh->triangle_count ? (void *)bvh.blocks : &params, bvh.block_count * sizeof *bvh.blocks},
        {READ_RAW, mesh->quadric_count ? (void *)mesh->quadrics : &params,
         mesh->quadric_count * sizeof *mesh->quadrics},
        {READ_RAW, mesh->quadric_count ? (void *)bvh.quadric_ids : &params,
         bvh.quadric_block_count * 8 * sizeof *bvh.quadric_ids},
        {READ_RAW, setup, sizeof setup},
        {READ_REAL, in, 12 * WEDGES}, {WRITE_REAL, out, PLANES * WEDGES}, {WRITE_REAL, positions, POSITIONS * WEDGES},
        {WRITE_BITS, bits, 4 * WEDGES}};
    snprintf(options, sizeof options, "-DFEATURES=31757 -DSTRATEGY=8 -DBVH_STACK=200 %s", more);
    device_test_run(text, options, lanes, BRUME_PRECISION_FLOAT, WEDGES, arrays, sizeof arrays / sizeof arrays[0]);
    brume_bvh_free(&bvh);
}

/* ---- brute force ------------------------------------------------------------------------------------------------ */

static double dot(const double a[3], const double b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

static void cross(const double a[3], const double b[3], double c[3]) {
    for (int i = 0; i < 3; i++) c[i] = a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3];
}

static int meets_triangle(const test_mesh *m, uint32_t prim, const double p[3], const double d[3], double *t) {
    const float *v[3];
    double e[3], f[3], s[3], q[3], r[3];
    for (int k = 0; k < 3; k++) v[k] = m->positions + 3 * m->triangles[prim].v[k];
    for (int i = 0; i < 3; i++) {
        e[i] = (double)v[1][i] - v[0][i];
        f[i] = (double)v[2][i] - v[0][i];
        s[i] = p[i] - v[0][i];
    }
    cross(d, f, q);
    cross(s, e, r);
    double det = dot(e, q), u = dot(s, q) / det, w = dot(d, r) / det;
    *t = dot(f, r) / det;
    return det != 0 && u >= 0 && w >= 0 && u + w <= 1;
}

static int meets_quadric(const b_quadric *q, const double p[3], const double d[3], double low, double high) {
    double w[3], du[3], dv[3], n[3];
    for (int i = 0; i < 3; i++) w[i] = p[i] - q->center[i], du[i] = q->du[i], dv[i] = q->dv[i];
    if (q->kind == QUADRIC_SPHERE) {
        double dd = dot(d, d), wd = dot(w, d), r = q->radius, root = wd * wd - dd * (dot(w, w) - r * r);
        if (root < 0) return 0;
        double t0 = (-wd - sqrt(root)) / dd, t1 = (-wd + sqrt(root)) / dd;
        return (t0 > low && t0 < high) || (t1 > low && t1 < high);
    }
    cross(du, dv, n);
    double t = -dot(w, n) / dot(d, n);
    for (int i = 0; i < 3; i++) w[i] += t * d[i];
    double x = dot(w, du) / dot(du, du), y = dot(w, dv) / dot(dv, dv);
    return t > low && t < high && x * x + y * y <= 1;
}

/* The way from p to the lamp, short of it by a millionth and of p by nothing. */
static int is_hidden(const test_mesh *m, const double p[3], const double lamp[3]) {
    const double high = 1 - 1e-6;
    double d[3], t;
    for (int i = 0; i < 3; i++) d[i] = lamp[i] - p[i];
    for (uint32_t k = 0; k < m->triangle_count; k++)
        if (meets_triangle(m, k, p, d, &t) && t > 0 && t < high) return 1;
    for (uint32_t k = 0; k < m->quadric_count; k++)
        if (meets_quadric(&m->quadrics[k], p, d, 0, high)) return 1;
    return 0;
}

/* Offsets by which lamp and point are moved: towards the corners and sides of a cube, of three sizes. */
enum { MOVES = 3 * 14 };

static void move(double p[3], int k, double slack) {
    static const double sizes[3] = {1, 0.25, 0.0625};
    int way = k % 14;
    for (int a = 0; a < 3; a++) {
        int sign = way < 8 ? (way >> a & 1 ? 1 : -1) : a == (way - 8) % 3 ? (way < 11 ? 1 : -1) : 0;
        p[a] += sizes[k / 14] * slack * sign;
    }
}

static void place(int i, double t, double p[3], double lamp[3]) {
    for (int a = 0; a < 3; a++) {
        lamp[a] = (float)in[a][i];
        p[a] = (float)in[3 + a][i] + (t + out[DELTA][i]) * (float)in[6 + a][i];
    }
}

/* Whether moving lamp or point by the slack changes the answer. */
static int is_ambiguous(const test_mesh *m, int i, double t, double slack) {
    double p[3], lamp[3];
    slack *= fmax(1, fabs(t)); /* far out on an infinite ray the coordinates are larger */
    place(i, t, p, lamp);
    int hidden = is_hidden(m, p, lamp);
    for (int k = 0; k < 2 * MOVES; k++) {
        place(i, t, p, lamp);
        move(k < MOVES ? p : lamp, k % MOVES, slack);
        if (is_hidden(m, p, lamp) != hidden) return 1;
    }
    return 0;
}

/* The plane of lamp and ray in double: x axis, z axis, and how far the lamp is from the ray. */
typedef struct plane { double lamp[3], x[3], y[3], z[3], D; } plane;

static plane plane_of(int i, int moved, double slack) {
    plane p;
    double o[3], w[3], length = 0, closest = 0;
    for (int a = 0; a < 3; a++) {
        o[a] = (float)in[3 + a][i];
        p.lamp[a] = (float)in[a][i];
        p.y[a] = (float)in[6 + a][i];
        length += p.y[a] * p.y[a];
    }
    if (moved >= 0) move(moved < MOVES ? o : p.lamp, moved % MOVES, slack);
    for (int a = 0; a < 3; a++) {
        p.y[a] /= sqrt(length);
        w[a] = o[a] - p.lamp[a];
        closest += w[a] * p.y[a];
    }
    for (int a = 0; a < 3; a++) w[a] -= closest * p.y[a];
    p.D = sqrt(dot(w, w));
    for (int a = 0; a < 3; a++) p.x[a] = w[a] / p.D;
    cross(p.x, p.y, p.z);
    return p;
}

/* The range of the ray behind a triangle, as crossings of its edges with the plane; 0 if there is none. */
static int hidden_range(const test_mesh *m, uint32_t prim, const plane *p, double *low, double *high) {
    double x[3], y[3], z[3], ends[2][2];
    int count = 0;
    for (int k = 0; k < 3; k++) {
        double v[3];
        for (int a = 0; a < 3; a++) v[a] = m->positions[3 * m->triangles[prim].v[k] + a] - p->lamp[a];
        x[k] = dot(v, p->x), y[k] = dot(v, p->y), z[k] = dot(v, p->z);
    }
    for (int k = 0; k < 3; k++) {
        int j = (k + 1) % 3;
        if ((z[k] < 0) == (z[j] < 0)) continue;
        double s = z[k] / (z[k] - z[j]);
        ends[count][0] = x[k] + s * (x[j] - x[k]);
        ends[count++][1] = y[k] + s * (y[j] - y[k]);
    }
    if (count < 2) return 0;
    for (int e = 0; e < 2; e++) {
        const double limits[2] = {1e-6 * p->D, p->D};
        for (int side = 0; side < 2; side++) { /* cut to what lies between lamp and ray */
            double *a = ends[e], *b = ends[1 - e], out_by = side ? a[0] - limits[1] : limits[0] - a[0];
            if (out_by <= 0) continue;
            if (side ? b[0] >= limits[1] : b[0] <= limits[0]) return 0;
            double s = (limits[side] - a[0]) / (b[0] - a[0]);
            a[1] += s * (b[1] - a[1]);
            a[0] = limits[side];
        }
    }
    double t0 = p->D * ends[0][1] / ends[0][0], t1 = p->D * ends[1][1] / ends[1][0];
    *low = fmin(t0, t1);
    *high = fmax(t0, t1);
    return 1;
}

/* ---- cases ------------------------------------------------------------------------------------------------------ */

static double symmetric(uint64_t *seed) { return 2 * test_uniform(seed) - 1; }

typedef enum lamps { LAMPS_ANYWHERE, LAMPS_ON_SURFACES } lamps;

/* Of a triangle's inside, an edge or a vertex. */
static void point_of(const test_mesh *m, uint64_t *seed, double shift, double p[3]) {
    if (m->triangle_count == 0) return;
    const int *v = m->triangles[(uint32_t)(test_uniform(seed) * m->triangle_count)].v;
    double kind = test_uniform(seed), u = kind < 0.3 ? 0 : test_uniform(seed);
    double w = kind < 0.6 ? 0 : test_uniform(seed) * (1 - u);
    for (int a = 0; a < 3; a++) {
        double x = m->positions[3 * v[0] + a];
        p[a] = x + u * (m->positions[3 * v[1] + a] - x) + w * (m->positions[3 * v[2] + a] - x) - shift;
    }
}

/* Rays towards points of the mesh or anywhere; some without end, some that end at the first surface. */
static void make_wedges(const test_mesh *m, uint64_t seed, lamps where, double shift) {
    for (int i = 0; i < WEDGES; i++) {
        double o[3], target[3], lamp[3], d[3], length = 0;
        for (int a = 0; a < 3; a++) {
            in[a][i] = shift + 1.5 * symmetric(&seed);
            o[a] = 1.5 * symmetric(&seed);
            target[a] = symmetric(&seed);
        }
        if (i % 2) point_of(m, &seed, shift, target);
        if (where == LAMPS_ON_SURFACES) {
            point_of(m, &seed, 0, lamp);
            for (int a = 0; a < 3; a++) in[a][i] = lamp[a];
        }
        for (int a = 0; a < 3; a++) length += (target[a] - o[a]) * (target[a] - o[a]);
        for (int a = 0; a < 3; a++) {
            d[a] = (target[a] - o[a]) / sqrt(length);
            in[3 + a][i] = shift + o[a];
            in[6 + a][i] = d[a];
        }
        in[9][i] = i % 8 == 3 ? 1e18 : 4 * test_uniform(&seed);
        in[10][i] = test_random_unit(&seed);
        in[11][i] = i % 8 > 4;
    }
}

typedef struct tally { int positions, dark, extra, missed, unexcused, open, wrongly_open, wrongly_shut; } tally;

static tally all;

/* Whether a triangle's range reaches into the wedge, whatever the move. */
static int reaches_in(const test_mesh *m, int i, double slack) {
    for (int moved = -1; moved < 2 * MOVES; moved++) {
        plane p = plane_of(i, moved, slack);
        double low, high;
        for (uint32_t k = 0; k < m->triangle_count; k++)
            if (hidden_range(m, k, &p, &low, &high) && low < out[T1][i] + slack && high > out[T0][i] - slack) return 1;
    }
    return 0;
}

/* A wedge is open if and only if nothing reaches into it, by more than rounding. Quadrics nearby may shut it. */
static void judge_open(const test_mesh *m, int i, double slack, tally *c) {
    plane p = plane_of(i, -1, 0);
    if (out[OPEN][i] == 0) {
        int certain = m->quadric_count == 0 && out[T1][i] - out[T0][i] > 4 * slack;
        if (certain && !reaches_in(m, i, 2 * slack)) c->wrongly_shut++;
        return;
    }
    c->open++;
    int wrong = 0;
    for (int j = 0; j < POSITIONS; j++)
        wrong |= ray_dark_at(i, j) && !is_ambiguous(m, i, positions[j][i], slack);
    for (uint32_t k = 0; k < m->triangle_count; k++) {
        double low, high;
        if (!hidden_range(m, k, &p, &low, &high)) continue;
        low = fmax(low, out[T0][i]), high = fmin(high, out[T1][i]);
        double middle = low + 0.5 * (high - low), q[3], lamp[3];
        place(i, middle, q, lamp);
        wrong |= high - low > slack && is_hidden(m, q, lamp) && !is_ambiguous(m, i, middle, slack);
    }
    c->wrongly_open += wrong;
}

static tally judge(const test_mesh *m, double slack) {
    tally c = {0};
    for (int i = 0; i < WEDGES; i++) {
        if (!is_planar(i)) continue;
        for (int j = 0; j < POSITIONS; j++) {
            int wedge = wedge_dark_at(i, j), ray = ray_dark_at(i, j);
            c.positions++;
            c.dark += ray;
            c.extra += wedge && !ray;
            c.missed += ray && !wedge;
            c.unexcused += wedge != ray && !is_ambiguous(m, i, positions[j][i], slack);
        }
        judge_open(m, i, slack, &c);
    }
    return c;
}

static tally judge_mesh(const char *text, test_mesh *m, lamps where, double shift, double slack) {
    for (uint32_t i = 0; i < 3 * m->vertex_count; i++) m->positions[i] = (float)(m->positions[i] + shift);
    for (uint32_t i = 0; i < m->quadric_count; i++)
        for (int a = 0; a < 3; a++) m->quadrics[i].center[a] = (float)(m->quadrics[i].center[a] + shift);
    make_wedges(m, 71, where, shift);
    compute(text, "", 16, 0, m);
    return judge(m, slack);
}

/* `differ`: how many positions in a million may need the excuse. */
static void check_mesh(const char *name, test_mesh m, lamps where, double shift, double slack, double differ) {
    tally c = judge_mesh(kernel_text, &m, where, shift, slack);
    print_message("%-22s %d positions, %d dark; only by the wedge %d, only by rays %d; %d wedges open\n", name,
                  c.positions, c.dark, c.extra, c.missed, c.open);
    test_mesh_free(&m);
    assert_int_equal(c.unexcused, 0);
    assert_int_equal(c.wrongly_open, 0);
    assert_int_equal(c.wrongly_shut, 0);
    assert_true(c.extra + c.missed <= differ * 1e-6 * c.positions);
    all.positions += c.positions, all.dark += c.dark, all.extra += c.extra, all.missed += c.missed, all.open += c.open;
}

static void as_shadow_rays_see_it(void **state) {
    (void)state;
    if (!device_test_offers(BRUME_PRECISION_FLOAT)) skip();
    memset(&all, 0, sizeof all);
    check_mesh("soup", test_mesh_soup(2000, 1, 0.1, 31), LAMPS_ANYWHERE, 0, 2e-6, 20);
    check_mesh("large triangles", test_mesh_soup(60, 1, 0.7, 32), LAMPS_ANYWHERE, 0, 2e-6, 20);
    check_mesh("closed", test_mesh_sphere(24, 32, 0.2), LAMPS_ANYWHERE, 0, 2e-6, 20);
    check_mesh("terrain", test_mesh_terrain(30), LAMPS_ANYWHERE, 0, 2e-6, 20);
    check_mesh("slats", test_mesh_slats(40), LAMPS_ANYWHERE, 0, 2e-6, 20);
    check_mesh("slivers", test_mesh_slivers(2000), LAMPS_ANYWHERE, 0, 2e-6, 20);
    check_mesh("cones", test_mesh_cones(100, 5), LAMPS_ANYWHERE, 0, 2e-6, 20);
    check_mesh("quadrics", test_mesh_quadrics(200, 51), LAMPS_ANYWHERE, 0, 4e-6, 20);
    assert_true(all.positions > 2000000 && all.dark > 900000 && all.open > 3000);
}

/* Nothing there: every wedge is open, and nothing dark. */
static void nothing_hides_nothing(void **state) {
    (void)state;
    if (!device_test_offers(BRUME_PRECISION_FLOAT)) skip();
    test_mesh m = test_mesh_soup(0, 1, 0.1, 31);
    make_wedges(&m, 71, LAMPS_ANYWHERE, 0);
    compute(kernel_text, "", 16, 0, &m);
    for (int i = 0; i < WEDGES; i++) assert_true(out[OPEN][i] == 1 && bits[0][i] == 0 && bits[1][i] == 0);
    test_mesh_free(&m);
}

/* A lamp on a surface is now before it, now behind, by rounding: a position in a hundred differs from its shadow ray.
 * And 10000 from the origin a float's last place is a thousandth: the slack is ten of them. */
static void where_rounding_is_large(void **state) {
    (void)state;
    if (!device_test_offers(BRUME_PRECISION_FLOAT)) skip();
    check_mesh("lamps on surfaces", test_mesh_cones(100, 5), LAMPS_ON_SURFACES, 0, 2e-6, 1e4);
    check_mesh("far away", test_mesh_soup(2000, 1, 0.1, 31), LAMPS_ANYWHERE, 1e4, 1e-2, 1e4);
}

/* ---- watertightness --------------------------------------------------------------------------------------------- */

/* Lamp in the mesh, ray outside, or the other way about: nothing is lit. */
static void make_inside_out(uint64_t seed, int on_grid, int lamp_outside, double scale, double shift) {
    for (int i = 0; i < WEDGES; i++) {
        double inner[3], outer[3], d[3], r2 = 0, along = 0, length = 0;
        int axis = i % 3, j = (axis + 1) % 3, k = (axis + 2) % 3;
        for (int a = 0; a < 3; a++) {
            inner[a] = 0.4 * symmetric(&seed);
            outer[a] = symmetric(&seed);
            d[a] = symmetric(&seed);
            r2 += d[a] * d[a];
        }
        for (int a = 0; a < 3; a++) along += outer[a] * d[a] / r2;
        for (int a = 0; a < 3; a++) outer[a] -= along * d[a], length += outer[a] * outer[a];
        /* outside: the line passes the middle at more than the mesh's 1.2, or the cube's diagonal of 1.73 */
        double away = 1.8 + test_uniform(&seed), back = 2 * symmetric(&seed);
        for (int a = 0; a < 3; a++) {
            d[a] /= sqrt(r2);
            outer[a] = outer[a] * away / sqrt(length) - back * d[a];
        }
        if (on_grid) { /* all of it on the corners' own planes, so that planes, edges and vertices fall together */
            for (int a = 0; a < 3; a++) {
                inner[a] = floor(inner[a] * 8) / 8;
                d[a] = 0;
            }
            d[axis] = i & 1 ? 1 : -1;
            outer[axis] = -2 * d[axis];
            outer[j] = inner[j];
            outer[k] = i & 2 ? -1.5 : 1.5;
            if (i & 4) outer[j] += outer[k] - inner[k]; /* a diagonal plane */
        }
        double *lamp = lamp_outside ? outer : inner, *o = lamp_outside ? inner : outer;
        for (int a = 0; a < 3; a++) {
            in[a][i] = (float)(scale * lamp[a] + shift);
            in[3 + a][i] = (float)(scale * o[a] + shift);
            in[6 + a][i] = d[a];
        }
        in[9][i] = lamp_outside ? 0.1 * scale : i % 5 ? 5 * scale * test_uniform(&seed) : 1e18;
        in[10][i] = test_random_unit(&seed);
        in[11][i] = 0;
    }
}

typedef struct leaks { int lit, positions; } leaks;

/* Surfaces nearer to the lamp than a millionth of the way count as its own, for shadow rays as for wedges: positions
 * that far out are not looked at. */
static void count_lit(const char *text, const test_mesh *m, int ends, leaks *c) {
    compute(text, "", 16, ends, m);
    for (int i = 0; i < WEDGES; i++)
        for (int j = 0; j < out[COUNT][i] && is_planar(i); j++) {
            if (fabs(positions[j][i]) > 1e5 * scene_radius) continue;
            c->positions++;
            c->lit += !wedge_dark_at(i, j);
        }
}

/* kind: a bumpy sphere, or a cube whose planes, edges and vertices lamp and ray share. */
static leaks count_leaks(const char *text, int kind, double scale, double shift) {
    leaks c = {0, 0};
    test_mesh m = kind ? test_mesh_cube(16) : test_mesh_sphere(48, 64, 0.2);
    for (uint32_t i = 0; i < 3 * m.vertex_count; i++) m.positions[i] = (float)(scale * m.positions[i] + shift);
    scene_radius = 2 * scale;
    for (int outside = 0; outside < 2; outside++) {
        make_inside_out(91, kind, outside, scale, shift);
        for (int ends = 0; ends < 2; ends++) count_lit(text, &m, ends, &c);
    }
    scene_radius = 2;
    test_mesh_free(&m);
    return c;
}

static void closed_meshes_let_nothing_through(void **state) {
    static const double where[][2] = {{1, 0}, {1, 10000}, {1e-4, 0}, {1e4, 0}};
    (void)state;
    if (!device_test_offers(BRUME_PRECISION_FLOAT)) skip();
    for (int k = 0; k < 4; k++)
        for (int kind = 0; kind < 2; kind++) {
            leaks c = count_leaks(kernel_text, kind, where[k][0], where[k][1]);
            print_message("%s of size %g at %g: %d of %d positions lit\n", kind ? "cube" : "sphere", where[k][0],
                          where[k][1], c.lit, c.positions);
            assert_int_equal(c.lit, 0);
            assert_true(c.positions > 500000);
        }
}

/* ---- the rest --------------------------------------------------------------------------------------------------- */

/* With a budget of 8 nodes almost every walk runs out, and shadow rays take over. */
static void running_out_changes_nothing(void **state) {
    static uint32_t first[4][WEDGES];
    (void)state;
    if (!device_test_offers(BRUME_PRECISION_FLOAT)) skip();
    test_mesh m = test_mesh_soup(2000, 1, 0.1, 31);
    make_wedges(&m, 73, LAMPS_ANYWHERE, 0);
    compute(kernel_text, "", 16, 0, &m);
    memcpy(first, bits, sizeof first);
    compute(kernel_text, "-DWEDGE_MAX_VISITS=8", 16, 0, &m);
    int shut = 0;
    for (int i = 0; i < WEDGES; i++) {
        if (!is_planar(i)) continue;
        assert_int_equal(bits[0][i], first[0][i]);
        assert_int_equal(bits[1][i], first[1][i]);
        shut += out[OPEN][i] == 0;
    }
    assert_true(shut > WEDGES * 9 / 10); /* it did run out: nothing is known to be open */
    test_mesh_free(&m);
}

static void every_width_gives_the_same_bits(void **state) {
    static uint32_t first[4][WEDGES];
    static double opened[WEDGES];
    (void)state;
    if (!device_test_offers(BRUME_PRECISION_FLOAT)) skip();
    test_mesh m = test_mesh_cones(100, 5);
    make_wedges(&m, 72, LAMPS_ANYWHERE, 0);
    compute(kernel_text, "", 16, 0, &m);
    memcpy(first, bits, sizeof first);
    memcpy(opened, out[OPEN], sizeof opened);
    compute(kernel_text, "", 1, 0, &m);
    assert_memory_equal(first, bits, sizeof first);
    assert_memory_equal(opened, out[OPEN], sizeof opened);
    test_mesh_free(&m);
}

/* By leaks or by what double can't excuse. */
static void wrong_walks_are_noticed(void **state) {
    static const struct { const char *from, *to; int kind; } bugs[] = {
        /* ranges open at both ends */
        {"(t >= (wide)low) & (t < (wide)high)", "(t > (wide)low) & (t < (wide)high)", 0},
        /* an edge's two triangles interpolate from different ends */
        {"wide_mask a_below = za < (wide)0;", "wide_mask a_below = za == za;", 0},
        /* a vertex in the plane is on one side as the first of its triangle, on the other else */
        {"n0 = z[0] < (wide)0,", "n0 = z[0] <= (wide)0,", 1},
        /* a range that begins at the last position still open is not looked at */
        {"            w.t1 = whole->t1;\n", "\n", 0},
        /* what lies behind the ray hides it, too */
        {"wmin(wmax(x0, near), far), x1c", "wmax(x0, near), x1c", -1},
    };
    (void)state;
    if (!device_test_offers(BRUME_PRECISION_FLOAT)) skip();
    for (size_t i = 0; i < sizeof bugs / sizeof bugs[0]; i++) {
        const char *text = device_test_plant("traverse_wedge.h", bugs[i].from, bugs[i].to, kernel_text);
        int noticed;
        if (bugs[i].kind >= 0) {
            noticed = count_leaks(text, bugs[i].kind, 1, 0).lit;
        } else {
            test_mesh m = test_mesh_soup(2000, 1, 0.1, 31);
            noticed = judge_mesh(text, &m, LAMPS_ANYWHERE, 0, 2e-6).unexcused;
            test_mesh_free(&m);
        }
        assert_true(noticed > 100);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(as_shadow_rays_see_it),
        cmocka_unit_test(nothing_hides_nothing),
        cmocka_unit_test(where_rounding_is_large),
        cmocka_unit_test(closed_meshes_let_nothing_through),
        cmocka_unit_test(running_out_changes_nothing),
        cmocka_unit_test(every_width_gives_the_same_bits),
        cmocka_unit_test(wrong_walks_are_noticed),
    };
    return cmocka_run_group_tests(tests, device_test_setup, device_test_teardown);
}

/* test_light_tree.c -- the tree over lamps: what lib/light_tree.c builds, and the choices that cl/light_tree.h makes by
 * it for segments of rays and for points.
 *
 * Every cluster's weight, every lamp's own and which lamps a leaf looks at are read from the device for all queries;
 * from them follows, in double, with what probability each lamp is chosen. Choices are held against that by
 * chi-square, and what they estimate against the sum over all lamps by t-tests: one family at CONFIDENCE (stats.h),
 * counted by TESTS. What lamps contribute is computed here, in double, by a rule over the angle that the lamp sees the
 * segment under; as the sum and the estimate use the same numbers, its error doesn't matter.
 *
 * `test_light_tree measure` prints how the variance and the time of a choice grow with the number of lamps.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "arrays.h"
#include "clock.h"
#include "device_test.h"
#include "stats.h"

#define PI 3.14159265358979323846

enum { QUERIES = 32, SAMPLES = 1 << 14, PLANES = 11, NODES = 512 /* of the rule for contributions */ };
enum { SCENES = 3, TESTS = SCENES * 2 * (QUERIES + 1) };

/* queries: o, d, t_end or p, n, front; then in_medium, extinction, mean cosine */
#define QUERY \
    "light_query query_of(__global const real1 *query, uint n, uint lane, medium *m) {\n" \
    "    light_query q;\n" \
    "    query += lane;\n" \
    "    q.is_point = POINT;\n" \
    "    q.o = vmake(QUERY_LOAD(0), QUERY_LOAD(1), QUERY_LOAD(2));\n" \
    "    q.d = vmake(QUERY_LOAD(3), QUERY_LOAD(4), QUERY_LOAD(5));\n" \
    "    q.t_end = QUERY_LOAD(6);\n" \
    "    q.front = QUERY_LOAD(7);\n" \
    "    q.in_medium = QUERY_LOAD(8) > R(0);\n" \
    "    *m = medium_none();\n" \
    "    m->sigma_t = cgrey(QUERY_LOAD(9));\n" \
    "    m->g = QUERY_LOAD(10);\n" \
    "    q.m = m;\n" \
    "    return q;\n" \
    "}\n" \
    "#define SCENE scene s; s.params = params; s.lights = lights; s.light_tree = tree; medium m\n" \
    "#define SCENE_ARRAYS __global const b_params *params, __global const b_light *lights, \\\n" \
    "                     __global const b_light_block *tree, __global const real1 *query\n"

/* One query for all lanes, a variate each. */
static const char choose_text[] =
    "#include \"light_choice.h\"\n"
    "#define QUERY_LOAD(k) R(query[(k) * n])\n"
    QUERY
    "__kernel void test(SCENE_ARRAYS, __global const real1 *u, __global real1 *out) {\n"
    "    uint n = get_global_size(0) * LANES;\n"
    "    SCENE;\n"
    "    light_query q = query_of(query, QUERIES, AT / SAMPLES, &m);\n"
    "    real share;\n"
    "    ireal k;\n"
    "    if (POINT) k = lamp_choose_for_point(&s, q.o, q.d, q.front, q.in_medium, LOAD(u + AT), TRUE_MASK, &share);\n"
    "    else k = lamp_choose_for_segment(&s, q.o, q.d, q.t_end, &m, LOAD(u + AT), TRUE_MASK, &share);\n"
    "    STORE(out + AT, to_real(k)); STORE(out + n + AT, share);\n"
    "}\n";

/* Of a block and a query: its clusters' weights, and which of them a leaf would look at. */
static const char block_text[] =
    "#include \"light_choice.h\"\n"
    "#define QUERY_LOAD(k) R(query[(k) * n])\n"
    QUERY
    "__kernel void test(SCENE_ARRAYS, __global real1 *out) {\n"
    "    uint n = get_global_size(0) * LANES;\n"
    "    SCENE;\n"
    "    light_query q = query_of(query, QUERIES, AT / LIGHT_BLOCK % QUERIES, &m);\n"
    "    light_asks asks = light_asks_of(&q);\n"
    "    light_ask a = light_ask_take(&asks, 0);\n"
    "    __global const b_light_block *block = tree + AT / LIGHT_BLOCK / QUERIES;\n"
    "    light_weights w = light_block_weights(block, &a, POINT);\n"
    "    uint bits = light_block_reaches(block, &a, POINT);\n"
    "    for (int k = 0; k < LIGHT_BLOCK; k++) {\n"
    "        out[AT + k] = w.one[k];\n"
    "        out[n + AT + k] = bits >> k & 1;\n"
    "    }\n"
    "}\n";

/* A lamp for all lanes, a query each: its weight. */
static const char lamp_text[] =
    "#include \"light_choice.h\"\n"
    "#define QUERY_LOAD(k) LOAD(query + (k) * n)\n"
    QUERY
    "__kernel void test(SCENE_ARRAYS, __global real1 *out) {\n"
    "    SCENE;\n"
    "    light_query q = query_of(query, QUERIES, AT % QUERIES, &m);\n"
    "    lamp l = lamp_uniform(&s, AT / QUERIES);\n"
    "    STORE(out + AT, lamp_weight(&s, &l, &q));\n"
    "}\n";

/* A scene, its tree, and all that is known of one set of queries. */
static struct {
    b_params params;
    b_light *lights;
    brume_light_tree tree;
    uint32_t count;
    int is_point;
    double query[PLANES][QUERIES];
    double *contribution, *probability; /* of lamp k for query q: [q * count + k] */
    double *choice, *share;             /* of sample i for query q: [q * SAMPLES + i] */
    double *out;
} now;

static void *room(size_t count, size_t size) {
    void *p = calloc(count ? count : 1, size);
    assert_non_null(p);
    return p;
}

/* ---- scenes and queries ------------------------------------------------------------------------------------------ */

static double random_in(uint64_t *seed, double low, double high) { return low + (high - low) * test_random_unit(seed); }

static void random_direction(uint64_t *seed, double direction[3]) {
    double z = random_in(seed, -1, 1), phi = random_in(seed, 0, 2 * PI), r = sqrt(1 - z * z);
    direction[0] = r * cos(phi), direction[1] = r * sin(phi), direction[2] = z;
}

static b_light make_spot(const double position[3], const double axis[3], double cutoff, double beam, double intensity) {
    b_light light = {.kind = LIGHT_SPOT, .texture = -1};
    double length = sqrt(axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2]);
    for (int i = 0; i < 3; i++) {
        light.position[i] = (float)position[i];
        light.axis[i] = (float)(axis[i] / length);
        light.intensity[i] = (float)intensity;
    }
    light.cutoff = (float)cutoff;
    light.beam = (float)beam;
    light.inv_fade = cutoff > beam ? (float)(1 / (cutoff - beam)) : 1e30f;
    light.v_cutoff = (float)(2 * pow(sin(cutoff / 2), 2));
    light.v_beam = (float)(2 * pow(sin(beam / 2), 2));
    return light;
}

/* Narrow spots above a floor of 40 x 40, aimed down at a slant. */
static b_light stage_spot(uint64_t *seed) {
    double position[3] = {random_in(seed, -20, 20), random_in(seed, -20, 20), random_in(seed, 3, 8)};
    double tilt = random_in(seed, 0, PI / 4), phi = random_in(seed, 0, 2 * PI);
    double cutoff = random_in(seed, 3, 12) * PI / 180;
    double axis[3] = {sin(tilt) * cos(phi), sin(tilt) * sin(phi), -cos(tilt)};
    return make_spot(position, axis, cutoff, 0.75 * cutoff, pow(10, random_in(seed, 0, 1.5)));
}

/* Anything: points, spots of every width, directional light, lamps on top of each other, and dark ones. */
static b_light odd_lamp(uint64_t *seed, uint32_t k) {
    static const double cutoffs[] = {0.2, 1, 5, 30, 60, 89, 120, 179};
    double position[3], axis[3], cutoff = cutoffs[k % 8] * PI / 180;
    random_direction(seed, axis);
    for (int i = 0; i < 3; i++) position[i] = k % 11 < 3 ? (double)(k % 5) - 2 : random_in(seed, -4, 4);
    b_light light = make_spot(position, axis, cutoff, k % 3 ? cutoff : cutoff / 2, pow(10, random_in(seed, -2, 2)));
    if (k % 7 == 0) light.kind = LIGHT_POINT;
    if (k % 97 == 5) {
        light.kind = LIGHT_DIRECTIONAL;
        for (int i = 0; i < 3; i++) light.intensity[i] *= 0.1f;
    }
    if (k % 31 == 0) memset(light.intensity, 0, sizeof light.intensity);
    return light;
}

static void make_scene(int scene, uint32_t count) {
    uint64_t seed = 71 + (uint64_t)scene;
    free(now.lights);
    brume_light_tree_free(&now.tree);
    now.lights = room(count, sizeof *now.lights);
    now.count = count;
    for (uint32_t k = 0; k < count; k++) {
        now.lights[k] = scene % 2 ? stage_spot(&seed) : odd_lamp(&seed, k);
        if (scene == 3) now.lights[k].kind = LIGHT_POINT;
    }
    assert_int_equal(brume_light_tree_build(NULL, now.lights, count, &now.tree), BRUME_OK);
    now.params.light_count = (int)count;
    now.params.light_tree_blocks = (int)now.tree.block_count;
    now.params.light_tree_lamps = (int)now.tree.placed;
    now.params.light_tree_scale = brume_light_tree_scale(&now.tree);
}

/* Across the floor from the side at eye level, or anywhere, also past a lamp, very short or without an end. */
static void make_queries(int scene, int is_point) {
    uint64_t seed = 5 + (uint64_t)scene;
    static const double means[] = {0, 0.7, -0.5, 0.9};
    now.is_point = is_point;
    for (int q = 0; q < QUERIES; q++) {
        double o[3], d[3];
        const b_light *near = &now.lights[(unsigned)q * 7919 % now.count];
        random_direction(&seed, d);
        for (int i = 0; i < 3; i++) o[i] = random_in(&seed, -5, 5);
        double t_end = pow(10, random_in(&seed, -1, 1.5)), sigma = pow(10, random_in(&seed, -2.5, 0));
        if (scene % 2) {
            d[2] *= 0.1;
            o[0] = random_in(&seed, -20, 20), o[1] = random_in(&seed, -20, 20), o[2] = random_in(&seed, 0.5, 3);
            sigma = 0.05, t_end = 30;
        }
        if (q % 8 == 3) t_end = 1e18;
        if (q % 8 == 5) /* passes a lamp closely */
            for (int i = 0; i < 3; i++)
                o[i] = near->position[i] + random_in(&seed, -1e-3, 1e-3) - d[i] * random_in(&seed, 0, t_end);
        if (is_point && q % 8 == 7) /* on the floor */
            o[2] = -0.001, d[0] = d[1] = 0, d[2] = 1;
        double length = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
        for (int i = 0; i < 3; i++) {
            now.query[i][q] = (float)o[i];
            now.query[3 + i][q] = (float)(d[i] / length);
        }
        now.query[6][q] = (float)t_end;
        now.query[7][q] = q % 2 ? 1 : -1;
        if (is_point && q % 8 == 7) now.query[7][q] = 1;
        now.query[8][q] = q % 5 == 0;
        now.query[9][q] = (float)sigma;
        now.query[10][q] = (float)means[q % 4];
    }
}

/* ---- contributions ----------------------------------------------------------------------------------------------- */

static double falloff(const b_light *light, double cosine) {
    if (light->kind != LIGHT_SPOT) return 1;
    double angle = acos(fmax(-1, fmin(1, cosine)));
    if (angle >= light->cutoff) return 0;
    return angle > light->beam ? (light->cutoff - angle) / (light->cutoff - light->beam) : 1;
}

static double phase(double cosine, double g) {
    return (1 - g * g) / (4 * PI * pow(1 + g * g - 2 * g * cosine, 1.5));
}

static double luminance_of(const b_light *light) {
    return 0.2126 * light->intensity[0] + 0.7152 * light->intensity[1] + 0.0722 * light->intensity[2];
}

static double dot(const double *a, const double *b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

static double brightens_segment(const b_light *light, const double *q) {
    const double *o = q, *d = q + 3;
    double t_end = q[6], sigma = q[9], g = q[10], w[3], axis[3], closest, D2 = 0, sum = 0;
    for (int i = 0; i < 3; i++) w[i] = light->position[i] - o[i], axis[i] = light->axis[i];
    if (light->kind == LIGHT_DIRECTIONAL)
        return luminance_of(light) * phase(-dot(axis, d), g) * -expm1(-sigma * t_end) / sigma;
    closest = dot(w, d);
    for (int i = 0; i < 3; i++) D2 += pow(w[i] - closest * d[i], 2);
    double D = sqrt(D2), a = atan2(-closest, D), b = atan2(t_end - closest, D);
    for (int j = 0; j < NODES; j++) {
        double x = a + (b - a) * (j + 0.5) / NODES, t = D * tan(x), r = D / cos(x), out[3], f;
        for (int i = 0; i < 3; i++) out[i] = ((closest + t) * d[i] - w[i]) / r;
        double cosine = dot(out, axis);
        if (light->kind == LIGHT_SPOT && cosine < 0.999 * cos(light->cutoff) - 1e-3) continue;
        if ((f = falloff(light, cosine)) > 0) sum += f * phase(-dot(out, d), g) * exp(-sigma * (closest + t + r));
    }
    return luminance_of(light) * sum * (b - a) / NODES / D;
}

static double brightens_point(const b_light *light, const double *q) {
    double to[3], r2 = 0, axial = 0, cosine = 0;
    for (int i = 0; i < 3; i++) {
        to[i] = light->kind == LIGHT_DIRECTIONAL ? -light->axis[i] : light->position[i] - q[i];
        r2 += to[i] * to[i];
        axial -= to[i] * light->axis[i];
        cosine += to[i] * q[3 + i];
    }
    double r = sqrt(r2);
    cosine = q[8] > 0 ? 1 : cosine / r * q[7];
    return cosine > 0 ? luminance_of(light) * falloff(light, axial / r) * cosine /
                            (light->kind == LIGHT_DIRECTIONAL ? 1 : r2) : 0;
}

static void contribute(void) {
    free(now.contribution);
    now.contribution = room((size_t)QUERIES * now.count, sizeof(double));
    for (int q = 0; q < QUERIES; q++) {
        double one[PLANES];
        for (int i = 0; i < PLANES; i++) one[i] = now.query[i][q];
        for (uint32_t k = 0; k < now.count; k++)
            now.contribution[(size_t)q * now.count + k] =
                now.is_point ? brightens_point(&now.lights[k], one) : brightens_segment(&now.lights[k], one);
    }
}

/* ---- the device -------------------------------------------------------------------------------------------------- */

static void run(const char *text, uint32_t lanes, int samples, size_t elements, const device_array *more,
                size_t more_count) {
    device_array arrays[6] = {{READ_RAW, &now.params, sizeof now.params},
                              {READ_RAW, now.lights, now.count * sizeof *now.lights},
                              {READ_RAW, now.tree.blocks, now.tree.block_count * sizeof *now.tree.blocks},
                              {READ_REAL, now.query, PLANES * QUERIES}};
    char options[120];
    memcpy(arrays + 4, more, more_count * sizeof *more);
    snprintf(options, sizeof options, "-DFEATURES=32265 -DPOINT=%d -DSAMPLES=%d -DQUERIES=%d", now.is_point, samples,
             QUERIES);
    device_test_run(text, options, lanes, BRUME_PRECISION_FLOAT, elements, arrays, 4 + more_count);
}

/* `samples` for each query, at most SAMPLES. */
static void choose_some(uint32_t lanes, int samples) {
    static double u[QUERIES * SAMPLES], out[2 * QUERIES * SAMPLES];
    size_t all = (size_t)QUERIES * (size_t)samples;
    uint64_t seed = 99;
    for (size_t i = 0; i < all; i++) u[i] = test_random_unit(&seed);
    const device_array arrays[] = {{READ_REAL, u, all}, {WRITE_REAL, out, 2 * all}};
    run(choose_text, lanes, samples, all, arrays, 2);
    now.choice = out;
    now.share = out + all;
}

static void choose(uint32_t lanes) { choose_some(lanes, SAMPLES); }

/* The probability of each of `count` lamps that a reservoir chosen with `p` is offered. */
static void share_out(int q, uint32_t first, uint32_t count, double p, const double *weight) {
    double total = 0, some = 0;
    for (uint32_t k = 0; k < count; k++) total += weight[k], some += weight[k] > 0;
    double *probability = now.probability + (size_t)q * now.count + first;
    for (uint32_t k = 0; k < count; k++)
        if (weight[k] > 0) probability[k] = p * (0.1 / some + 0.9 * weight[k] / total);
}

/* `clusters` and `reached`: of the query, LIGHT_BLOCK a block. */
static void descend(int q, int at, double p, const double *clusters, const double *reached, const double *weight) {
    double total = 0, some = 0;
    const double *w = clusters + LIGHT_BLOCK * at;
    for (int k = 0; k < LIGHT_BLOCK; k++) total += w[k], some += w[k] > 0;
    for (int k = 0; k < LIGHT_BLOCK; k++) {
        int child = now.tree.blocks[at].child[k];
        double below = p * (0.05 / some + 0.95 * w[k] / total);
        if (!(w[k] > 0)) continue;
        if (child >= 0) {
            descend(q, child, below, clusters, reached, weight);
            continue;
        }
        double offered[LIGHT_LEAF_BLOCKS * LIGHT_BLOCK] = {0};
        int first = ~child / LIGHT_LEAF_BLOCKS, blocks = ~child % LIGHT_LEAF_BLOCKS + 1;
        uint32_t lamp = (uint32_t)now.tree.blocks[first].child[0], count = 0;
        for (int i = 0; i < blocks * LIGHT_BLOCK; i++) {
            const b_light_block *block = &now.tree.blocks[first + i / LIGHT_BLOCK];
            if (i > 0 && block->child[i % LIGHT_BLOCK] == 0) break; /* unused */
            count++;
            if (reached[LIGHT_BLOCK * first + i] > 0) offered[i] = weight[lamp + (uint32_t)i];
        }
        share_out(q, lamp, count, below, offered);
    }
}

/* Fills in `probability`: of the tree, or of one reservoir for all. */
static void weigh_by(int tree) {
    size_t blocks = now.tree.block_count, n = blocks * QUERIES * LIGHT_BLOCK, row = blocks * LIGHT_BLOCK;
    double *out = room(2 * n, sizeof *out), *lamps = room((size_t)now.count * QUERIES, sizeof *lamps);
    double *clusters = room(2 * row, sizeof *clusters), *reached = clusters + row;
    double *weight = room(now.count, sizeof *weight);
    const device_array block_arrays[] = {{WRITE_REAL, out, 2 * n}};
    const device_array lamp_arrays[] = {{WRITE_REAL, lamps, (size_t)now.count * QUERIES}};
    if (tree) run(block_text, 16, SAMPLES, n, block_arrays, 1);
    run(lamp_text, 16, SAMPLES, (size_t)now.count * QUERIES, lamp_arrays, 1);
    free(now.probability);
    now.probability = room((size_t)QUERIES * now.count, sizeof(double));
    for (int q = 0; q < QUERIES; q++) {
        double other = 0, inside = 0;
        for (uint32_t k = 0; k < now.count; k++) {
            weight[k] = lamps[(size_t)k * QUERIES + (size_t)q];
            if (k >= now.tree.placed) other += weight[k] * now.params.light_tree_scale;
        }
        if (!tree) {
            share_out(q, 0, now.count, 1, weight);
            continue;
        }
        for (size_t i = 0; i < blocks; i++) {
            const double *from = out + (i * QUERIES + (size_t)q) * LIGHT_BLOCK;
            memcpy(clusters + i * LIGHT_BLOCK, from, LIGHT_BLOCK * sizeof *from);
            memcpy(reached + i * LIGHT_BLOCK, from + n, LIGHT_BLOCK * sizeof *from);
        }
        for (int k = 0; k < LIGHT_BLOCK; k++) inside += clusters[k];
        double away = other > 0 ? inside > 0 ? 0.05 + 0.9 * other / (other + inside) : 1 : 0;
        if (away > 0) share_out(q, now.tree.placed, now.count - now.tree.placed, away, weight + now.tree.placed);
        if (inside > 0) descend(q, 0, 1 - away, clusters, reached, weight);
    }
    free(out);
    free(lamps);
    free(clusters);
    free(weight);
}

static void weigh(void) { weigh_by(1); }
static void weigh_all(void) { weigh_by(0); }

/* ---- structure --------------------------------------------------------------------------------------------------- */

typedef struct {
    uint32_t first, count;
} lamp_range;

static void check_cluster(const b_light_block *block, int k, lamp_range below) {
    double axis[3] = {block->axis_x[k], block->axis_y[k], block->axis_z[k]};
    for (uint32_t i = below.first; i < below.first + below.count; i++) {
        const b_light *light = &now.lights[i];
        double off[3] = {light->position[0] - (double)block->x[k], light->position[1] - (double)block->y[k],
                         light->position[2] - (double)block->z[k]};
        double other[3] = {light->axis[0], light->axis[1], light->axis[2]};
        assert_true(light->kind != LIGHT_DIRECTIONAL);
        assert_true(sqrt(dot(off, off)) <= block->radius[k]);
        double angle = acos(fmax(-1, fmin(1, dot(axis, other) / sqrt(dot(other, other) * dot(axis, axis)))));
        double reach = light->kind == LIGHT_POINT ? PI : fmin(angle + light->cutoff, PI);
        assert_true(1 - cos(reach) <= block->versine[k] + 1e-7);
        if (luminance_of(light) > 0) assert_true(block->flux[k] > 0);
    }
}

/* The lamps of a leaf or of a block, each counted in `seen`, as each block is. */
static lamp_range check_child(int child, uint32_t depth, int *seen, int *seen_blocks) {
    lamp_range all = {UINT32_MAX, 0};
    int leaf = child < 0, first = leaf ? ~child / LIGHT_LEAF_BLOCKS : child;
    int blocks = leaf ? ~child % LIGHT_LEAF_BLOCKS + 1 : 1;
    assert_true(first >= 0 && first + blocks <= (int)now.tree.block_count && depth < 64);
    for (int i = 0; i < blocks * LIGHT_BLOCK; i++) {
        const b_light_block *block = &now.tree.blocks[first + i / LIGHT_BLOCK];
        int k = i % LIGHT_BLOCK;
        seen_blocks[first + i / LIGHT_BLOCK] += k == 0;
        /* The root is nobody's child, and the first lamp stands first. */
        if (block->child[k] == 0 && !(leaf && all.count == 0)) {
            assert_true(block->flux[k] == 0);
            continue;
        }
        lamp_range below = {(uint32_t)block->child[k], 1};
        if (!leaf) below = check_child(block->child[k], depth + 1, seen, seen_blocks);
        if (leaf) seen[below.first]++;
        if (leaf && all.count) assert_true(below.first == all.first + all.count);
        check_cluster(block, k, below);
        all.first = below.first < all.first ? below.first : all.first;
        all.count += below.count;
    }
    return all;
}

static int by_bytes(const void *a, const void *b) { return memcmp(a, b, sizeof(b_light)); }

/* Lamps where splits fail: all alike, ever closer to each other on a line, in opposite directions. */
static b_light hard_lamp(int kind, uint32_t k) {
    double position[3] = {0, 0, 1}, axis[3] = {0, 0, 1};
    if (kind == 1) position[0] = 1e6 * pow(0.7, k);
    if (kind == 2) axis[2] = k % 2 ? 1 : -1;
    if (kind == 3) position[1] = 1e18 * (k % 3), position[2] = 1e-18 * k;
    return make_spot(position, axis, 0.1 + 0.001 * k, 0.05, 1 + k);
}

static void check_tree(void) {
    int *seen = room(now.count + now.tree.block_count, sizeof *seen);
    if (now.tree.placed) {
        lamp_range all = check_child(0, 0, seen, seen + now.count);
        assert_true(all.first == 0 && all.count == now.tree.placed);
    }
    for (uint32_t i = 0; i < now.count; i++) {
        assert_int_equal(seen[i], i < now.tree.placed);
        assert_true(i < now.tree.placed || now.lights[i].kind == LIGHT_DIRECTIONAL);
    }
    for (uint32_t i = 0; i < now.tree.block_count; i++) assert_int_equal(seen[now.count + i], 1);
    free(seen);
}

static void every_lamp_is_in_one_leaf(void **state) {
    (void)state;
    static const uint32_t counts[] = {1, 3, 8, 9, 33, 300, 3000};
    for (int scene = 0; scene < 6; scene++)
        for (size_t i = 0; i < sizeof counts / sizeof *counts; i++) {
            make_scene(scene % 2, counts[i]);
            for (uint32_t k = 0; scene > 1 && k < now.count; k++) now.lights[k] = hard_lamp(scene - 2, k);
            b_light *before = room(now.count, sizeof *before), *again = room(now.count, sizeof *again);
            brume_light_tree tree;
            memcpy(before, now.lights, now.count * sizeof *before);
            memcpy(again, now.lights, now.count * sizeof *again);
            brume_light_tree_free(&now.tree);
            assert_int_equal(brume_light_tree_build(NULL, now.lights, now.count, &now.tree), BRUME_OK);
            check_tree();
            /* Twice the same. */
            assert_int_equal(brume_light_tree_build(NULL, again, now.count, &tree), BRUME_OK);
            assert_int_equal(tree.block_count, now.tree.block_count);
            assert_memory_equal(tree.blocks, now.tree.blocks, tree.block_count * sizeof *tree.blocks);
            assert_memory_equal(again, now.lights, now.count * sizeof *again);
            /* None lost, none twice. */
            qsort(before, now.count, sizeof *before, by_bytes);
            qsort(again, now.count, sizeof *again, by_bytes);
            assert_memory_equal(before, again, now.count * sizeof *again);
            brume_light_tree_free(&tree);
            free(before);
            free(again);
        }
}

/* ---- choices ----------------------------------------------------------------------------------------------------- */

static const uint32_t scene_counts[SCENES] = {300, 3000, 3000};

static void ask(int scene, int is_point) {
    make_scene(scene, scene_counts[scene]);
    make_queries(scene, is_point);
}

/* p of the choices made for query q, where the lamps' probabilities are those in `p`. */
static double choices_p(int q, const double *p) {
    double *observed = room(now.count + 1, sizeof(double)), *expected = room(now.count + 1, sizeof(double)), rest = 1;
    for (uint32_t k = 0; k < now.count; k++) expected[k] = p[k] * SAMPLES, rest -= p[k];
    expected[now.count] = rest < 1e-6 ? 0 : rest * SAMPLES;
    for (int i = 0; i < SAMPLES; i++) {
        int k = (int)now.choice[q * SAMPLES + i];
        observed[k < 0 ? now.count : (uint32_t)k]++;
    }
    double result = stats_chi_square(observed, expected, now.count + 1);
    free(observed);
    free(expected);
    return result;
}

static void choices_follow_their_share(void **state) {
    (void)state;
    if (!device_test_offers(BRUME_PRECISION_FLOAT)) skip();
    for (int scene = 0; scene < SCENES; scene++)
        for (int is_point = 0; is_point < 2; is_point++) {
            int noticed = 0, asked = 0;
            ask(scene, is_point);
            choose(16);
            weigh();
            for (int q = 0; q < QUERIES; q++) {
                double *p = now.probability + (size_t)q * now.count;
                for (int i = 0; i < SAMPLES; i++) {
                    int k = (int)now.choice[q * SAMPLES + i];
                    if (k < 0) continue;
                    if (!(fabs(now.share[q * SAMPLES + i] - p[k]) <= 1e-4 * p[k]))
                        fail_msg("scene %d, %s %d: lamp %d with share %g, expected %g", scene,
                                 is_point ? "point" : "segment", q, k, now.share[q * SAMPLES + i], p[k]);
                }
                double right = choices_p(q, p), sum = 0;
                if (right < stats_level(CONFIDENCE, TESTS))
                    fail_msg("scene %d, %s %d: p = %g", scene, is_point ? "point" : "segment", q, right);
                /* planted: every second lamp more often, the others less */
                for (uint32_t k = 0; k < now.count; k++) sum += p[k];
                for (uint32_t k = 0; k < now.count; k++) p[k] *= k % 2 ? 1.1 : 0.9;
                asked += sum > 0.5;
                noticed += sum > 0.5 && choices_p(q, p) < stats_level(CONFIDENCE, TESTS);
            }
            if (2 * noticed < asked) fail_msg("scene %d: planted error noticed for %d of %d", scene, noticed, asked);
        }
}

/* Lamps of more than a millionth of the light that are never chosen. */
static uint32_t forgotten(void) {
    uint32_t count = 0;
    for (int q = 0; q < QUERIES; q++) {
        const double *f = now.contribution + (size_t)q * now.count, *p = now.probability + (size_t)q * now.count;
        double sum = 0;
        for (uint32_t k = 0; k < now.count; k++) sum += f[k];
        for (uint32_t k = 0; k < now.count; k++) count += f[k] > 1e-6 * sum && !(p[k] > 0);
    }
    return count;
}

static void no_lamp_is_forgotten(void **state) {
    (void)state;
    if (!device_test_offers(BRUME_PRECISION_FLOAT)) skip();
    int narrow = 0, small = 0;
    for (int scene = 0; scene < SCENES; scene++)
        for (int is_point = 0; is_point < 2; is_point++) {
            ask(scene, is_point);
            contribute();
            weigh();
            if (forgotten()) fail_msg("scene %d, points %d: %u forgotten", scene, is_point, (unsigned)forgotten());
            /* planted: cones too narrow by a tenth, then bounds of a fifth */
            for (uint32_t i = 0; i < now.tree.block_count; i++)
                for (int k = 0; k < LIGHT_BLOCK; k++)
                    if (now.tree.blocks[i].versine[k] < 2) now.tree.blocks[i].versine[k] *= 0.81f;
            weigh();
            narrow += forgotten() > 0;
            ask(scene, is_point);
            for (uint32_t i = 0; i < now.tree.block_count; i++)
                for (int k = 0; k < LIGHT_BLOCK; k++) now.tree.blocks[i].radius[k] *= 0.2f;
            weigh();
            small += forgotten() > 0;
        }
    /* Leaves of hundreds of lamps leave few clusters to get wrong. */
    if (narrow < 2 * SCENES || small < SCENES)
        fail_msg("narrow cones were noticed in %d, small bounds in %d of %d", narrow, small, 2 * SCENES);
}

/* Over all queries: the estimate over the sum that it is for, on average. *out_variance: of one estimate. */
static double estimate_p(double share_scale, double *out_variance) {
    static double values[QUERIES * SAMPLES];
    size_t n = 0;
    double mean = 0, square = 0;
    for (int q = 0; q < QUERIES; q++) {
        const double *f = now.contribution + (size_t)q * now.count;
        double sum = 0;
        for (uint32_t k = 0; k < now.count; k++) sum += f[k];
        if (!(sum > 0)) continue;
        for (int i = 0; i < SAMPLES; i++) {
            int k = (int)now.choice[q * SAMPLES + i];
            values[n] = k < 0 ? 0 : f[k] / (now.share[q * SAMPLES + i] * share_scale * sum);
            mean += values[n];
            square += values[n] * values[n];
            n++;
        }
    }
    assert_true(n > 0);
    *out_variance = square / (double)n - pow(mean / (double)n, 2);
    return stats_mean(values, n, 1);
}

static void estimates_meet_the_sum(void **state) {
    (void)state;
    if (!device_test_offers(BRUME_PRECISION_FLOAT)) skip();
    for (int scene = 0; scene < SCENES; scene++)
        for (int is_point = 0; is_point < 2; is_point++) {
            double variance;
            ask(scene, is_point);
            contribute();
            choose(16);
            double p = estimate_p(1, &variance);
            if (p < stats_level(CONFIDENCE, TESTS)) fail_msg("scene %d, points %d: p = %g", scene, is_point, p);
            p = estimate_p(1.03, &variance); /* planted: shares off by 3 % */
            if (p > stats_level(CONFIDENCE, TESTS))
                fail_msg("scene %d, points %d: 3 %% weren't noticed: p = %g, variance %g", scene, is_point, p,
                         variance);
        }
}

static void every_width_gives_the_same_bits(void **state) {
    (void)state;
    if (!device_test_offers(BRUME_PRECISION_FLOAT)) skip();
    static double first[2][QUERIES * SAMPLES];
    for (int is_point = 0; is_point < 2; is_point++) {
        ask(0, is_point);
        choose(16);
        memcpy(first[0], now.choice, sizeof first[0]);
        memcpy(first[1], now.share, sizeof first[1]);
        choose(1);
        assert_memory_equal(first[0], now.choice, sizeof first[0]);
        assert_memory_equal(first[1], now.share, sizeof first[1]);
    }
}

/* ---- measurements ------------------------------------------------------------------------------------------------ */

/* Relative variance of one sample of the sum, whose lamp is chosen with the probabilities `p`: over all queries, the
 * mean variance by the mean square. */
static double relative_variance(const double *p, double *out_wasted) {
    double variance = 0, squares = 0, wasted = 0;
    for (int q = 0; q < QUERIES; q++) {
        double sum = 0, second = 0, hit = 0;
        for (uint32_t k = 0; k < now.count; k++) {
            double f = now.contribution[(size_t)q * now.count + k], pk = p[(size_t)q * now.count + k];
            sum += f;
            hit += pk;
            if (f > 0 && pk > 0) second += f * f / pk;
        }
        variance += second - sum * sum;
        squares += sum * sum;
        wasted += (1 - hit) / QUERIES;
    }
    *out_wasted = wasted;
    return variance / squares;
}

static double seconds_per_choice(int tree) {
    double best = 1e30;
    int samples = tree || now.count <= 100 ? 1 << 12 : now.count <= 1000 ? 1 << 9 : 1 << 7;
    now.params.light_tree_blocks = tree ? (int)now.tree.block_count : 0;
    choose_some(16, samples);
    for (int i = 0; i < 3; i++) {
        double start = brume_seconds();
        choose_some(16, samples);
        best = fmin(best, brume_seconds() - start);
    }
    now.params.light_tree_blocks = (int)now.tree.block_count;
    return best / (QUERIES * samples);
}

/* Kinds of scenes as make_scene has them, for segments and for points. */
static void measure(void **state) {
    (void)state;
    static const uint32_t counts[] = {10, 20, 30, 60, 100, 300, 1000, 3000, 10000};
    static const char *kinds[] = {"odd", "stage", "", "points"};
    printf("%16s %6s %9s %9s %9s %9s %9s %9s %9s %9s\n", "", "lamps", "uniform", "power", "loop", "tree", "missed",
           "loop ns", "tree ns", "build ms");
    for (int i = 0; i < 6 * (int)(sizeof counts / sizeof *counts); i++) {
        int kind = i / (int)(sizeof counts / sizeof *counts), is_point = kind % 2;
        uint32_t count = counts[(size_t)i % (sizeof counts / sizeof *counts)];
        kind = kind / 2 == 0 ? 1 : kind / 2 == 1 ? 3 : 0;
        double missed, ignored, flux = 0, start = brume_seconds();
        make_scene(kind, count);
        double built = brume_seconds() - start;
        make_queries(kind, is_point);
        contribute();
        weigh();
        double tree = relative_variance(now.probability, &missed);
        weigh_all();
        double loop = relative_variance(now.probability, &ignored);
        size_t n = (size_t)QUERIES * now.count;
        for (size_t k = 0; k < n; k++) now.probability[k] = 1.0 / now.count;
        double uniform = relative_variance(now.probability, &ignored);
        for (size_t k = 0; k < now.count; k++) flux += luminance_of(&now.lights[k]) * now.lights[k].v_cutoff;
        for (size_t k = 0; k < n; k++)
            now.probability[k] = luminance_of(&now.lights[k % now.count]) * now.lights[k % now.count].v_cutoff / flux;
        double power = relative_variance(now.probability, &ignored);
        printf("%7s %8s %6u %9.3g %9.3g %9.3g %9.3g %9.3g %9.0f %9.0f %9.1f\n", kinds[kind],
               is_point ? "surface" : "segment", count, uniform, power, loop, tree, missed, 1e9 * seconds_per_choice(0),
               1e9 * seconds_per_choice(1), 1e3 * built);
        fflush(stdout);
    }
}

int main(int argc, char **argv) {
    const struct CMUnitTest measurements[] = {cmocka_unit_test(measure)};
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_lamp_is_in_one_leaf),
        cmocka_unit_test(choices_follow_their_share),
        cmocka_unit_test(no_lamp_is_forgotten),
        cmocka_unit_test(estimates_meet_the_sum),
        cmocka_unit_test(every_width_gives_the_same_bits),
    };
    if (argc > 1 && !strcmp(argv[1], "measure"))
        return cmocka_run_group_tests(measurements, device_test_setup, device_test_teardown);
    return cmocka_run_group_tests(tests, device_test_setup, device_test_teardown);
}

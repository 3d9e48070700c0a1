/* light_queries.c -- see light_queries.h. */
#include "light_queries.h"

#define PI 3.14159265358979323846

enum { NODES = 512 }; /* of the rule for contributions */

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


light_queries now;

void *room(size_t count, size_t size) {
    void *p = calloc(count ? count : 1, size);
    assert_non_null(p);
    return p;
}

/* ---- scenes and queries ------------------------------------------------------------------------------------------ */

static void random_direction(uint64_t *seed, double direction[3]) {
    double z = test_random_in(seed, -1, 1), phi = test_random_in(seed, 0, 2 * PI), r = sqrt(1 - z * z);
    direction[0] = r * cos(phi), direction[1] = r * sin(phi), direction[2] = z;
}

b_light make_spot(const double position[3], const double axis[3], double cutoff, double beam, double intensity) {
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
    double position[3] = {test_random_in(seed, -20, 20), test_random_in(seed, -20, 20), test_random_in(seed, 3, 8)};
    double tilt = test_random_in(seed, 0, PI / 4), phi = test_random_in(seed, 0, 2 * PI);
    double cutoff = test_random_in(seed, 3, 12) * PI / 180;
    double axis[3] = {sin(tilt) * cos(phi), sin(tilt) * sin(phi), -cos(tilt)};
    return make_spot(position, axis, cutoff, 0.75 * cutoff, pow(10, test_random_in(seed, 0, 1.5)));
}

/* Anything: points, spots of every width, directional light, lamps on top of each other, and dark ones. */
static b_light odd_lamp(uint64_t *seed, uint32_t k) {
    static const double cutoffs[] = {0.2, 1, 5, 30, 60, 89, 120, 179};
    double position[3], axis[3], cutoff = cutoffs[k % 8] * PI / 180;
    random_direction(seed, axis);
    for (int i = 0; i < 3; i++) position[i] = k % 11 < 3 ? (double)(k % 5) - 2 : test_random_in(seed, -4, 4);
    double intensity = pow(10, test_random_in(seed, -2, 2));
    b_light light = make_spot(position, axis, cutoff, k % 3 ? cutoff : cutoff / 2, intensity);
    if (k % 7 == 0) light.kind = LIGHT_POINT;
    if (k % 97 == 5) {
        light.kind = LIGHT_DIRECTIONAL;
        for (int i = 0; i < 3; i++) light.intensity[i] *= 0.1f;
    }
    if (k % 31 == 0) memset(light.intensity, 0, sizeof light.intensity);
    return light;
}

void make_scene(int scene, uint32_t count) {
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
void make_queries(int scene, int is_point) {
    uint64_t seed = 5 + (uint64_t)scene;
    static const double means[] = {0, 0.7, -0.5, 0.9};
    now.is_point = is_point;
    for (int q = 0; q < QUERIES; q++) {
        double o[3], d[3];
        const b_light *near = &now.lights[(unsigned)q * 7919 % now.count];
        random_direction(&seed, d);
        for (int i = 0; i < 3; i++) o[i] = test_random_in(&seed, -5, 5);
        double t_end = pow(10, test_random_in(&seed, -1, 1.5)), sigma = pow(10, test_random_in(&seed, -2.5, 0));
        if (scene % 2) {
            d[2] *= 0.1;
            o[0] = test_random_in(&seed, -20, 20), o[1] = test_random_in(&seed, -20, 20);
            o[2] = test_random_in(&seed, 0.5, 3);
            sigma = 0.05, t_end = 30;
        }
        if (q % 8 == 3) t_end = 1e18;
        if (q % 8 == 5) /* passes a lamp closely */
            for (int i = 0; i < 3; i++)
                o[i] = near->position[i] + test_random_in(&seed, -1e-3, 1e-3) - d[i] * test_random_in(&seed, 0, t_end);
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

double luminance_of(const b_light *light) {
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

void contribute(void) {
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
    char options[300];
    memcpy(arrays + 4, more, more_count * sizeof *more);
    snprintf(options, sizeof options, FEATURES_ARE(BEAM_FEATURES "|FEATURE_MANY_LIGHTS") " -DPOINT=%d -DSAMPLES=%d "
             "-DQUERIES=%d", now.is_point, samples, QUERIES);
    device_test_run(text, options, lanes, BRUME_PRECISION_FLOAT, elements, arrays, 4 + more_count);
}

void choose(uint32_t lanes, int samples) {
    static double u[QUERIES * SAMPLES], out[2 * QUERIES * SAMPLES];
    size_t all = (size_t)QUERIES * (size_t)samples;
    uint64_t seed = 99;
    for (size_t i = 0; i < all; i++) u[i] = test_random_unit(&seed);
    const device_array arrays[] = {{READ_REAL, u, all}, {WRITE_REAL, out, 2 * all}};
    run(choose_text, lanes, samples, all, arrays, 2);
    now.choice = out;
    now.share = out + all;
}

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

void weigh(int by_tree) {
    size_t blocks = now.tree.block_count, n = blocks * QUERIES * LIGHT_BLOCK, row = blocks * LIGHT_BLOCK;
    double *out = room(2 * n, sizeof *out), *lamps = room((size_t)now.count * QUERIES, sizeof *lamps);
    double *clusters = room(2 * row, sizeof *clusters), *reached = clusters + row;
    double *weight = room(now.count, sizeof *weight);
    const device_array block_arrays[] = {{WRITE_REAL, out, 2 * n}};
    const device_array lamp_arrays[] = {{WRITE_REAL, lamps, (size_t)now.count * QUERIES}};
    if (by_tree) run(block_text, 16, SAMPLES, n, block_arrays, 1);
    run(lamp_text, 16, SAMPLES, (size_t)now.count * QUERIES, lamp_arrays, 1);
    free(now.probability);
    now.probability = room((size_t)QUERIES * now.count, sizeof(double));
    for (int q = 0; q < QUERIES; q++) {
        double other = 0, inside = 0;
        for (uint32_t k = 0; k < now.count; k++) {
            weight[k] = lamps[(size_t)k * QUERIES + (size_t)q];
            if (k >= now.tree.placed) other += weight[k] * now.params.light_tree_scale;
        }
        if (!by_tree) {
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

/* test_light_tree.c -- the tree over lamps: what lib/light_tree.c builds, and the choices that cl/light_tree.h makes by
 * it for segments of rays and for points.
 *
 * Choices are held against the probabilities that light_queries.h computes, by chi-square, and what they estimate
 * against the sum over all lamps, by t-tests: one family at CONFIDENCE (stats.h), counted by TESTS. As the sum and the
 * estimate use the same contributions, their error doesn't matter.
 */
#include "light_queries.h"
#include "stats.h"

#define PI 3.14159265358979323846

enum { SCENES = 3, TESTS = SCENES * 2 * (QUERIES + 1) };

/* ---- structure --------------------------------------------------------------------------------------------------- */

typedef struct {
    uint32_t first, count;
} lamp_range;

static double dot(const double *a, const double *b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

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
            choose(16, SAMPLES);
            weigh(1);
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
            weigh(1);
            if (forgotten()) fail_msg("scene %d, points %d: %u forgotten", scene, is_point, (unsigned)forgotten());
            /* planted: cones too narrow by a tenth, then bounds of a fifth */
            for (uint32_t i = 0; i < now.tree.block_count; i++)
                for (int k = 0; k < LIGHT_BLOCK; k++)
                    if (now.tree.blocks[i].versine[k] < 2) now.tree.blocks[i].versine[k] *= 0.81f;
            weigh(1);
            narrow += forgotten() > 0;
            ask(scene, is_point);
            for (uint32_t i = 0; i < now.tree.block_count; i++)
                for (int k = 0; k < LIGHT_BLOCK; k++) now.tree.blocks[i].radius[k] *= 0.2f;
            weigh(1);
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
            choose(16, SAMPLES);
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
        choose(16, SAMPLES);
        memcpy(first[0], now.choice, sizeof first[0]);
        memcpy(first[1], now.share, sizeof first[1]);
        choose(1, SAMPLES);
        assert_memory_equal(first[0], now.choice, sizeof first[0]);
        assert_memory_equal(first[1], now.share, sizeof first[1]);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_lamp_is_in_one_leaf),
        cmocka_unit_test(choices_follow_their_share),
        cmocka_unit_test(no_lamp_is_forgotten),
        cmocka_unit_test(estimates_meet_the_sum),
        cmocka_unit_test(every_width_gives_the_same_bits),
    };
    return cmocka_run_group_tests(tests, device_test_setup, device_test_teardown);
}

/* test_wedge.c -- what cl/traverse_wedge.h says about many points of a ray at once, against a shadow ray for each;
 * where the two differ, brute force decides (wedge_truth.h). Closed meshes, which need no excuse: test_wedge_leaks.c.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

#include "wedge_truth.h"

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
            wedge_in[a][i] = shift + 1.5 * symmetric(&seed);
            o[a] = 1.5 * symmetric(&seed);
            target[a] = symmetric(&seed);
        }
        if (i % 2) point_of(m, &seed, shift, target);
        if (where == LAMPS_ON_SURFACES) {
            point_of(m, &seed, 0, lamp);
            for (int a = 0; a < 3; a++) wedge_in[a][i] = lamp[a];
        }
        for (int a = 0; a < 3; a++) length += (target[a] - o[a]) * (target[a] - o[a]);
        for (int a = 0; a < 3; a++) {
            d[a] = (target[a] - o[a]) / sqrt(length);
            wedge_in[3 + a][i] = shift + o[a];
            wedge_in[6 + a][i] = d[a];
        }
        wedge_in[9][i] = i % 8 == 3 ? 1e18 : 4 * test_uniform(&seed);
        wedge_in[10][i] = test_random_unit(&seed);
        wedge_in[11][i] = i % 8 > 4;
    }
}

static wedge_tally all;

static wedge_tally judge_mesh(const char *text, test_mesh *m, lamps where, double shift, double slack) {
    for (uint32_t i = 0; i < 3 * m->vertex_count; i++) m->positions[i] = (float)(m->positions[i] + shift);
    for (uint32_t i = 0; i < m->quadric_count; i++)
        for (int a = 0; a < 3; a++) m->quadrics[i].center[a] = (float)(m->quadrics[i].center[a] + shift);
    make_wedges(m, 71, where, shift);
    wedge_compute(text, "", 16, 0, m);
    return wedge_judge(m, slack);
}

/* `differ`: how many positions in a million may need the excuse. */
static void check_mesh(const char *name, test_mesh m, lamps where, double shift, double slack, double differ) {
    wedge_tally c = judge_mesh(wedge_text, &m, where, shift, slack);
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
    wedge_compute(wedge_text, "", 16, 0, &m);
    for (int i = 0; i < WEDGES; i++)
        assert_true(wedge_out[OPEN][i] == 1 && wedge_bits[0][i] == 0 && wedge_bits[1][i] == 0);
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

/* With a budget of 8 nodes almost every walk runs out, and shadow rays take over. */
static void running_out_changes_nothing(void **state) {
    static uint32_t first[4][WEDGES];
    (void)state;
    if (!device_test_offers(BRUME_PRECISION_FLOAT)) skip();
    test_mesh m = test_mesh_soup(2000, 1, 0.1, 31);
    make_wedges(&m, 73, LAMPS_ANYWHERE, 0);
    wedge_compute(wedge_text, "", 16, 0, &m);
    memcpy(first, wedge_bits, sizeof first);
    wedge_compute(wedge_text, "-DWEDGE_MAX_VISITS=8", 16, 0, &m);
    int shut = 0;
    for (int i = 0; i < WEDGES; i++) {
        if (!wedge_is_planar(i)) continue;
        assert_int_equal(wedge_bits[0][i], first[0][i]);
        assert_int_equal(wedge_bits[1][i], first[1][i]);
        shut += wedge_out[OPEN][i] == 0;
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
    wedge_compute(wedge_text, "", 16, 0, &m);
    memcpy(first, wedge_bits, sizeof first);
    memcpy(opened, wedge_out[OPEN], sizeof opened);
    wedge_compute(wedge_text, "", 1, 0, &m);
    assert_memory_equal(first, wedge_bits, sizeof first);
    assert_memory_equal(opened, wedge_out[OPEN], sizeof opened);
    test_mesh_free(&m);
}

/* What lies behind the ray hides it, too: nothing in double excuses that. */
static void wrong_ranges_are_noticed(void **state) {
    (void)state;
    if (!device_test_offers(BRUME_PRECISION_FLOAT)) skip();
    const char *text =
        device_test_plant("traverse_wedge.h", "wmin(wmax(x0, near), far), x1c", "wmax(x0, near), x1c", wedge_text);
    test_mesh m = test_mesh_soup(2000, 1, 0.1, 31);
    assert_true(judge_mesh(text, &m, LAMPS_ANYWHERE, 0, 2e-6).unexcused > 100);
    test_mesh_free(&m);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(as_shadow_rays_see_it),
        cmocka_unit_test(nothing_hides_nothing),
        cmocka_unit_test(where_rounding_is_large),
        cmocka_unit_test(running_out_changes_nothing),
        cmocka_unit_test(every_width_gives_the_same_bits),
        cmocka_unit_test(wrong_ranges_are_noticed),
    };
    return cmocka_run_group_tests(tests, device_test_setup, device_test_teardown);
}

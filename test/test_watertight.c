/* test_watertight.c -- from within a closed mesh not one ray gets out, by none of the traversals: some millions, or as
 * many as the environment variable BRUME_WATERTIGHT_RAYS says (make watertight).
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

#include <cmocka.h>

#include "leaks.h"
#include "naive_triangle.h"
#include "stability.h"

/* Evenly over meshes and traversals. */
static uint64_t rays_of_each(void) {
    const char *text = getenv("BRUME_WATERTIGHT_RAYS");
    double rays = text && *text ? strtod(text, NULL) : 3.6e6;
    if (!(rays >= 1 && rays < 1e15)) fail_msg("BRUME_WATERTIGHT_RAYS is to be a number of rays, not %s", text);
    return (uint64_t)(rays / (LEAK_WAYS * LEAK_MESHES) + 1);
}

static const char *text_of(const leak_way *way) { return way->wedges ? leak_wedge_text : leak_ray_text; }

static void closed_meshes_leak_nowhere(void **state) {
    (void)state;
    if (!device_test_offers(BRUME_PRECISION_FLOAT)) skip();
    for (int i = 0; i < LEAK_WAYS; i++) {
        leak_tally all = {0, 0, 0};
        const char *where = "none";
        if (!device_test_offers(leak_ways[i].precision)) continue;
        for (int k = 0; k < LEAK_MESHES; k++) {
            leak_mesh m = leak_mesh_make(k);
            leak_tally t = {0, 0, 0};
            leaks_count(text_of(&leak_ways[i]), &leak_ways[i], &m, rays_of_each(), &t);
            print_message("%s, %s: %llu leaks of %llu\n", leak_ways[i].name, m.name, (unsigned long long)t.leaks,
                          (unsigned long long)t.rays);
            if (t.leaks && !all.leaks) {
                where = m.name;
                all.first = t.first;
            }
            all.leaks += t.leaks;
            all.rays += t.rays;
            test_mesh_free(&m.mesh);
        }
        char name[96];
        snprintf(name, sizeof name, "rays out of closed meshes: %s", leak_ways[i].name);
        stability_row("hazard", name, "none gets out", "rays", 0, (double)all.leaks, "of %llu; %s, ray %llu",
                      (unsigned long long)all.rays, where, (unsigned long long)all.first);
    }
}

static uint64_t leaks_with(const char *text, int way, int mesh) {
    leak_mesh m = leak_mesh_make(mesh);
    leak_tally t = {0, 0, 0};
    leaks_count(text, &leak_ways[way], &m, 200000, &t);
    print_message("planted, %s, %s: %llu leaks of %llu\n", leak_ways[way].name, m.name, (unsigned long long)t.leaks,
                  (unsigned long long)t.rays);
    test_mesh_free(&m.mesh);
    return t.leaks;
}

/* Each mesh finds an edge test that rounds; each traversal's own error is found. */
static void wrong_tests_leak(void **state) {
    static const struct { const char *file, *from, *to; int way, mesh; } bugs[] = {
        /* an edge belongs to neither of its triangles */
        {"intersect_triangle.h", "(low >= (wide)0) | (high <= (wide)0)", "(low > (wide)0) | (high < (wide)0)", 0, 5},
        {"traverse_packet.h", "(low >= R(0)) | (high <= R(0))", "(low > R(0)) | (high < R(0))", 1, 5},
        /* boxes without a margin for rounding */
        {"traverse_single.h", "#define WIDEN ((real1)(1 + 0x1p-19f))", "#define WIDEN ((real1)1)", 0, 5},
        /* two triangles interpolate an edge from different ends; ranges are open at both ends */
        {"traverse_wedge.h", "wide_mask a_below = za < (wide)0;", "wide_mask a_below = za == za;", 5, 0},
        {"traverse_wedge.h", "(t >= (wide)low) & (t < (wide)high)", "(t > (wide)low) & (t < (wide)high)", 5, 4},
    };
    static char naive[16384];
    (void)state;
    if (!device_test_offers(BRUME_PRECISION_FLOAT)) skip();
    snprintf(naive, sizeof naive, "%s%s", NAIVE_TRIANGLE, leak_ray_text);
    for (int k = 0; k < LEAK_MESHES; k++) assert_true(leaks_with(naive, 0, k) > 0);
    for (size_t i = 0; i < sizeof bugs / sizeof bugs[0]; i++) {
        const char *kernel = text_of(&leak_ways[bugs[i].way]);
        assert_true(leaks_with(device_test_plant(bugs[i].file, bugs[i].from, bugs[i].to, kernel), bugs[i].way,
                               bugs[i].mesh) > 0);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(closed_meshes_leak_nowhere),
        cmocka_unit_test(wrong_tests_leak),
    };
    return cmocka_run_group_tests(tests, device_test_setup, device_test_teardown);
}

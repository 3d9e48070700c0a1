/* test_cracks.c -- rays at edges, vertices and the faces of boxes: nothing leaks, and nothing is hit from afar. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "naive_triangle.h"
#include "planted.h"
#include "ray_batch.h"
#include "stability.h"

static const char naive_text[] = NAIVE_TRIANGLE "#include \"traverse.h\"\n" RAY_KERNEL;

static uint32_t count_leaks(const char *text, double scale, double shift, uint32_t n, uint32_t lanes,
                            brume_precision precision) {
    test_mesh mesh = test_mesh_sphere(96, 128, 0.2);
    uint64_t seed = 55;
    uint32_t leaks = 0;
    for (uint32_t i = 0; i < 3 * mesh.vertex_count; i++)
        mesh.positions[i] = (float)(scale * mesh.positions[i] + shift);
    brume_bvh bvh = ray_batch_build(&mesh);
    ray_batch b = ray_batch_make(n);
    for (uint32_t i = 0; i < n; i++) {
        vec3 o = ray_random_point(&seed, 0.4), d;
        o = (vec3){(float)(scale * o.x + shift), (float)(scale * o.y + shift), (float)(scale * o.z + shift)};
        d = vec3_sub(ray_random_target(&mesh, &seed), o);
        if (i % 2) {
            double size = vec3_length(d);
            d = (vec3){d.x / size, d.y / size, d.z / size};
        }
        ray_batch_set(&b, i, o, d);
    }
    ray_batch_trace(text, &mesh, &bvh, lanes, precision, &b);
    for (uint32_t i = 0; i < n; i++) leaks += b.prim[i] < 0 || !b.dark[i];
    ray_batch_free(&b);
    brume_bvh_free(&bvh);
    test_mesh_free(&mesh);
    return leaks;
}

static void test_watertight(void **state) {
    (void)state;
    NEEDS_DEVICE();
    uint32_t leaks = count_leaks(ray_text, 1, 0, 600000, 8, BRUME_PRECISION_FLOAT);
    leaks += count_leaks(ray_text, 1, 1000, 200000, 16, BRUME_PRECISION_FLOAT);
    leaks += count_leaks(ray_text, 1e-6, 0, 100000, 8, BRUME_PRECISION_FLOAT);
    leaks += count_leaks(ray_text, 1e6, 0, 100000, 1, BRUME_PRECISION_FLOAT);
    leaks += count_leaks(ray_text, 1, 0, 100000, 8, BRUME_PRECISION_DOUBLE);
    uint32_t naive = count_leaks(naive_text, 1, 0, 200000, 8, BRUME_PRECISION_FLOAT);
    stability_row("hazard", "rays at a closed mesh's edges and vertices", "none leaks", "of 1 100 000 rays", 0, leaks,
                  "naive %u of 200 000", naive);
    assert_true(naive > 100);
}

/* Planted: without the margin of the box test, boxes are missed whose edges the rays meet. */
static const char tight_text[] = "#include \"traverse.h\"\n" RAY_KERNEL;

static void test_box_margin(void **state) {
    (void)state;
    NEEDS_DEVICE();
    uint32_t naive = 0, leaks = 0;
    for (int tight = 1; tight >= 0; tight--) {
        if (tight)
            planted_bug("traverse_single.h", "#define WIDEN ((real1)(1 + 0x1p-19f))", "#define WIDEN ((real1)1)");
        test_mesh mesh = test_mesh_cube(32);
        uint64_t seed = 56;
        brume_bvh bvh = ray_batch_build(&mesh);
        ray_batch b = ray_batch_make(200000);
        for (uint32_t i = 0; i < b.n; i++) {
            vec3 o = ray_random_point(&seed, 0.9);
            o = (vec3){(float)o.x, (float)o.y, (float)o.z};
            ray_batch_set(&b, i, o, vec3_sub(ray_random_target(&mesh, &seed), o));
        }
        ray_batch_trace(tight ? tight_text : ray_text, &mesh, &bvh, 8, BRUME_PRECISION_FLOAT, &b);
        for (uint32_t i = 0; i < b.n; i++) *(tight ? &naive : &leaks) += b.prim[i] < 0;
        ray_batch_free(&b);
        brume_bvh_free(&bvh);
        test_mesh_free(&mesh);
        planted_remove();
    }
    stability_row("hazard", "rays at the edges of boxes", "none leaks", "of 200 000 rays", 0, leaks, "naive %u", naive);
    assert_true(naive > 10);
}

/* Straight down on each vertex and edge of a grid, whose boxes' faces the rays run along. */
static void test_axis_rays(void **state) {
    (void)state;
    NEEDS_DEVICE();
    test_mesh mesh = test_mesh_terrain(64);
    brume_bvh bvh = ray_batch_build(&mesh);
    for (int up = 0; up < 2; up++) {
        ray_batch b = ray_batch_make(127 * 127);
        for (int i = 0; i < 127 * 127; i++) {
            double x = -1 + (i % 127 + 1) / 64.0, y = -1 + (i / 127 + 1) / 64.0;
            ray_batch_set(&b, (uint32_t)i, (vec3){x, y, up ? -1 : 1}, (vec3){0, i & 1 ? 0 : -0.0, up ? 1 : -1});
        }
        ray_batch_trace(ray_text, &mesh, &bvh, 8, BRUME_PRECISION_FLOAT, &b);
        for (int i = 0; i < 127 * 127; i++) assert_true(b.prim[i] >= 0 && b.dark[i]);
        ray_batch_free(&b);
    }
    brume_bvh_free(&bvh);
    test_mesh_free(&mesh);
}

/* Off a huge slanted triangle by about its vertices' rounding, or by a hundredth of it: rays away from it miss it, rays
 * towards it hit. */
static void test_large_triangle(void **state) {
    (void)state;
    NEEDS_DEVICE();
    test_mesh mesh = test_mesh_soup(1, 0, 0, 42);
    float p[9] = {-1000, -900, 100, 1000, -800, -120, 50, 1000, 77};
    uint64_t seed = 43;
    memcpy(mesh.positions, p, sizeof p);
    vec3 a = vec3_from(p), e = vec3_sub(vec3_from(p + 3), a), f = vec3_sub(vec3_from(p + 6), a), n = vec3_cross(e, f);
    brume_bvh bvh = ray_batch_build(&mesh);
    ray_batch b = ray_batch_make(20000);
    for (uint32_t i = 0; i < b.n; i++) {
        double u = 0.1 + 0.4 * test_uniform(&seed), v = 0.1 + 0.4 * test_uniform(&seed);
        int closer = i % 8 >= 4;
        double off = (closer ? 1e-6 : 1e-4) * (i % 4 < 2 ? 1 : -1);
        vec3 d = ray_random_point(&seed, 1), o;
        double side = vec3_dot(d, n) / vec3_length(n), size = vec3_length(d);
        /* At a grazing angle or, from closer by, any; away from it where i is even. */
        double less = (closer ? 0 : 0.99) * side / vec3_length(n);
        d = (vec3){d.x - less * n.x, d.y - less * n.y, d.z - less * n.z};
        double keep = (i % 2 == 0) == (side * off > 0) ? 1 : -1;
        d = (vec3){keep * d.x / size, keep * d.y / size, keep * d.z / size};
        off /= vec3_length(n);
        o = (vec3){a.x + u * e.x + v * f.x + off * n.x, a.y + u * e.y + v * f.y + off * n.y,
                   a.z + u * e.z + v * f.z + off * n.z};
        ray_batch_set(&b, i, o, d);
    }
    for (uint32_t lanes = 1; lanes <= 8; lanes += 7) { /* alone and together */
        ray_batch_trace(ray_text, &mesh, &bvh, lanes, BRUME_PRECISION_FLOAT, &b);
        for (uint32_t i = 0; i < b.n; i++) {
            /* Which side the rounded origin is on. */
            vec3 o = {b.o[i], b.o[b.n + i], b.o[2 * b.n + i]}, d = {b.d[i], b.d[b.n + i], b.d[2 * b.n + i]};
            double height = vec3_dot(vec3_sub(o, a), n), along = vec3_dot(d, n), t = -height / along;
            if (t < -1e-9) assert_int_equal(b.prim[i], -1);
            if (t > 1e-9 && t < 1) { /* refined unless t is four times the float error of this size and angle */
                assert_int_equal(b.prim[i], 0);
                assert_true(fabs(b.t[i] - t) <= 0.25 * t + 1e-9);
            }
        }
    }
    ray_batch_free(&b);
    brume_bvh_free(&bvh);
    test_mesh_free(&mesh);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_watertight),
        cmocka_unit_test(test_box_margin),
        cmocka_unit_test(test_axis_rays),
        cmocka_unit_test(test_large_triangle),
    };
    return cmocka_run_group_tests(tests, open_device, close_device);
}

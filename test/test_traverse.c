/* test_traverse.c -- rays through a hierarchy of triangles on the device against brute force in double. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "ray_batch.h"

/* A ray's meeting with one primitive's plane or surface: where, how far inside the outline (distance between the lines;
 * negative outside), and the error that `slack` of displacement means for t. */
typedef struct meeting { double t, inside, t_error; } meeting;

static meeting meet_triangle(const test_mesh *m, uint32_t prim, vec3 o, vec3 d, double slack) {
    vec3 v[3];
    double distance[3], low = INFINITY, high = -INFINITY;
    for (int i = 0; i < 3; i++) v[i] = vec3_sub(vec3_from(m->positions + 3 * m->triangles[prim].v[i]), o);
    for (int i = 0; i < 3; i++) {
        vec3 e = vec3_sub(v[(i + 1) % 3], v[i]), across = vec3_cross(d, e);
        double size = vec3_length(across);
        distance[i] = size > 0 ? vec3_dot(across, v[i]) / size : 0;
        low = fmin(low, distance[i]), high = fmax(high, distance[i]);
    }
    vec3 n = vec3_cross(vec3_sub(v[1], v[0]), vec3_sub(v[2], v[0]));
    double along = vec3_dot(n, d);
    /* Moving a vertex by the slack turns the plane by slack / height; where that is all of the angle to the ray, the
     * triangle is met somewhere between its corners and no more can be said. */
    double longest = 0;
    for (int i = 0; i < 3; i++) longest = fmax(longest, vec3_length(vec3_sub(v[(i + 1) % 3], v[i])));
    double sine = fabs(along) / (vec3_length(n) * vec3_length(d)) - 4 * slack * longest / vec3_length(n);
    double rounding = sine > 0 ? slack / vec3_length(d) * (1 + 1 / sine) : INFINITY;
    meeting r = {vec3_dot(n, v[0]) / along, fmax(low, -high), rounding};
    if (!(fabs(along) > 0)) r = (meeting){0, -INFINITY, 0};
    return r;
}

/* Closest and certain: brackets what the device may answer. `slack` is the displacement that its rounding amounts to:
 * hits nearer to the outline may be found or not. */
static void check_ray(const test_mesh *m, const ray_batch *b, uint32_t i, double slack) {
    vec3 o = {b->o[i], b->o[b->n + i], b->o[2 * b->n + i]}, d = {b->d[i], b->d[b->n + i], b->d[2 * b->n + i]};
    double tmin = b->range[i], tmax = b->range[b->n + i], t = b->t[i];
    for (uint32_t prim = 0; prim < m->triangle_count; prim++) {
        meeting c = meet_triangle(m, prim, o, d, slack);
        if ((int)prim == b->prim[i]) {
            assert_true(c.inside > -slack);
            assert_true(isinf(c.t_error) || fabs(c.t - t) <= c.t_error);
            assert_true(t > tmin && t < tmax);
            /* The point on the ray is the one that the weights name. */
            vec3 p[3], at;
            for (int k = 0; k < 3; k++) p[k] = vec3_from(m->positions + 3 * m->triangles[prim].v[k]);
            double u = b->uv[i], v = b->uv[b->n + i], w = 1 - u - v;
            at = (vec3){w * p[0].x + u * p[1].x + v * p[2].x - o.x - t * d.x,
                        w * p[0].y + u * p[1].y + v * p[2].y - o.y - t * d.y,
                        w * p[0].z + u * p[1].z + v * p[2].z - o.z - t * d.z};
            assert_true(u >= 0 && v >= 0 && u + v <= 1.000001);
            assert_true(isinf(c.t_error) || vec3_length(at) <= 2 * slack + vec3_length(d) * c.t_error);
        } else if (c.inside > slack && c.t > tmin + c.t_error && c.t < tmax - c.t_error) {
            assert_true(t <= c.t + c.t_error);
        }
    }
    if (b->prim[i] < 0) assert_true(b->prim[i] == -1 && t == tmax);
    assert_int_equal(b->dark[i], b->prim[i] >= 0);
}

/* Every width and precision; the float ones and the double ones equal among each other. Slack: float's is 16 ulp of the
 * largest distance; double_slack is what brute force itself needs for these triangles. */
static void check_mesh(test_mesh mesh, uint32_t n, double double_slack) {
    brume_bvh bvh = ray_batch_build(&mesh);
    ray_batch first = ray_batch_random(&mesh, n, 101), other = ray_batch_random(&mesh, n, 101);
    for (int precision = 0; precision < 2; precision++) {
        for (uint32_t lanes = 1; lanes <= 16; lanes *= lanes == 1 ? 4 : 2) {
            ray_batch_trace(ray_text, &mesh, &bvh, lanes, (brume_precision)precision, lanes == 1 ? &first : &other);
            if (lanes > 1) ray_batch_same(&first, &other);
        }
        uint32_t hits = 0;
        for (uint32_t i = 0; i < n; i++) {
            if (first.range[i] < 0) {
                assert_true(first.prim[i] == -1 && first.dark[i] == 0);
                continue;
            }
            check_ray(&mesh, &first, i, precision ? double_slack : 2e-6);
            hits += first.prim[i] >= 0;
        }
        if (mesh.triangle_count) assert_true(hits > n / 4);
    }
    ray_batch_free(&first);
    ray_batch_free(&other);
    brume_bvh_free(&bvh);
    test_mesh_free(&mesh);
}

static void test_soup(void **state) {
    (void)state;
    NEEDS_DEVICE();
    check_mesh(test_mesh_soup(2000, 1, 0.1, 31), 3000, 1e-12);
    check_mesh(test_mesh_soup(1, 1, 1, 32), 1000, 1e-12);
    check_mesh(test_mesh_soup(0, 1, 1, 33), 100, 1e-12);
}

static void test_closed(void **state) {
    (void)state;
    NEEDS_DEVICE();
    check_mesh(test_mesh_sphere(24, 32, 0.2), 3000, 1e-12);
}

static void test_terrain(void **state) {
    (void)state;
    NEEDS_DEVICE();
    check_mesh(test_mesh_terrain(30), 3000, 1e-12);
}

static void test_slivers(void **state) {
    (void)state;
    NEEDS_DEVICE();
    check_mesh(test_mesh_slivers(2000), 3000, 1e-9);
}

/* Many triangles at one place: the lowest number wins, at every width. */
static void test_ties(void **state) {
    (void)state;
    NEEDS_DEVICE();
    test_mesh mesh = test_mesh_soup(1000, 0, 0, 41);
    float p[9] = {-1, -1, 0, 1, -1, 0, 0, 1, 0};
    for (int i = 0; i < 1000; i++) memcpy(mesh.positions + 9 * i, p, sizeof p);
    brume_bvh bvh = ray_batch_build(&mesh);
    for (uint32_t lanes = 1; lanes <= 16; lanes *= lanes == 1 ? 4 : 2) {
        ray_batch b = ray_batch_make(64);
        for (uint32_t i = 0; i < 64; i++)
            ray_batch_set(&b, i, (vec3){0.001 * i, 0.002 * i, 2}, (vec3){0.001 * i, 0, -1});
        ray_batch_trace(ray_text, &mesh, &bvh, lanes, BRUME_PRECISION_FLOAT, &b);
        for (int i = 0; i < 64; i++) assert_int_equal(b.prim[i], 0);
        ray_batch_free(&b);
    }
    brume_bvh_free(&bvh);
    test_mesh_free(&mesh);
}

/* The same rays, from triangle 3. */
static const char own_text[] =
    "#include \"traverse.h\"\n"
    "#define closest(g, o, d, low, high, live) closest_from(g, o, d, low, high, I(3), live)\n"
    "#define occluded(g, o, d, low, high, live) occluded_from(g, o, d, low, high, I(3), live)\n" RAY_KERNEL;

/* The triangle that a ray starts on is not there for it; others are. Rays meet 3 first, then the lowest of several at
 * one place, and the last few of them nothing but 3. */
static void test_own(void **state) {
    (void)state;
    NEEDS_DEVICE();
    test_mesh mesh = test_mesh_soup(40, 0, 0, 41);
    for (int i = 0; i < 40; i++) {
        float z = i == 3 ? 1 : i < 6 ? 0 : -1, size = i == 3 ? 4 : 1;
        float p[9] = {-size, -size, z, size, -size, z, 0, size, z};
        memcpy(mesh.positions + 9 * i, p, sizeof p);
    }
    brume_bvh bvh = ray_batch_build(&mesh);
    for (uint32_t lanes = 1; lanes <= 16; lanes *= lanes == 1 ? 4 : 2) {
        for (int few = 0; few < 2; few++) { /* lanes that go together, lanes that go alone */
            ray_batch b = ray_batch_make(64);
            for (uint32_t i = 0; i < 64; i++) {
                ray_batch_set(&b, i, (vec3){i < 48 ? 0.005 * i - 0.1 : 2, i < 48 ? 0 : -2, 2}, (vec3){0, 0, -1});
                if (few && i % 8) b.range[i] = -1;
            }
            ray_batch_trace(ray_text, &mesh, &bvh, lanes, BRUME_PRECISION_FLOAT, &b);
            for (int i = 0; i < 64; i += few ? 8 : 1) assert_int_equal(b.prim[i], 3);
            ray_batch_trace(own_text, &mesh, &bvh, lanes, BRUME_PRECISION_FLOAT, &b);
            for (int i = 0; i < 64; i += few ? 8 : 1) {
                assert_int_equal(b.prim[i], i < 48 ? 0 : -1);
                assert_int_equal(b.dark[i], i < 48);
            }
            ray_batch_free(&b);
        }
    }
    brume_bvh_free(&bvh);
    test_mesh_free(&mesh);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_soup),
        cmocka_unit_test(test_closed),
        cmocka_unit_test(test_terrain),
        cmocka_unit_test(test_slivers),
        cmocka_unit_test(test_ties),
        cmocka_unit_test(test_own),
    };
    return cmocka_run_group_tests(tests, open_device, close_device);
}

/* test_quadrics.c -- spheres and disks in the hierarchy on the device, against their roots in long double. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "ray_batch.h"

/* Roots in long double; `inside`: how far within the outline. */
static int quadric_roots(const b_quadric *q, vec3 of, vec3 df, double slack, double t[2], double *inside,
                         double *t_error) {
    long double o[3] = {of.x, of.y, of.z}, d[3] = {df.x, df.y, df.z}, dd = 0, b = 0, c = 0, w[3];
    if (q->kind == QUADRIC_SPHERE) {
        for (int a = 0; a < 3; a++) {
            w[a] = q->center[a] - o[a];
            dd += d[a] * d[a], b += w[a] * d[a], c += w[a] * w[a];
        }
        long double r = q->radius, line = sqrtl(fmaxl(c - b * b / dd, 0));
        long double half = sqrtl(fmaxl(r * r - line * line, 0) / dd);
        *inside = (double)(r - line);
        t[0] = (double)(b / dd - half), t[1] = (double)(b / dd + half);
        *t_error = slack * (2 + (double)(r / (half + 1e-9L)));
        return 2;
    }
    vec3 du = vec3_from(q->du), dv = vec3_from(q->dv), n = vec3_cross(du, dv);
    vec3 from = vec3_sub(vec3_from(q->center), of);
    double along = vec3_dot(n, df);
    t[0] = vec3_dot(n, from) / along;
    vec3 p = {t[0] * df.x - from.x, t[0] * df.y - from.y, t[0] * df.z - from.z};
    double x = vec3_dot(p, du) / vec3_dot(du, du), y = vec3_dot(p, dv) / vec3_dot(dv, dv);
    double least = fmin(vec3_length(du), vec3_length(dv));
    *t_error = slack * (2 + vec3_length(n) * vec3_length(df) / fabs(along));
    *inside = (1 - sqrt(x * x + y * y)) * least / (1 + vec3_length(n) * vec3_length(df) / fabs(along));
    return 1;
}

static void test_quadrics(void **state) {
    (void)state;
    NEEDS_DEVICE();
    test_mesh mesh = test_mesh_quadrics(200, 51);
    brume_bvh bvh = ray_batch_build(&mesh);
    ray_batch first = ray_batch_random(&mesh, 6000, 102), other = ray_batch_random(&mesh, 6000, 102);
    for (int precision = 0; precision < 2; precision++) {
        double slack = precision ? 1e-6 : 4e-6; /* axes are perpendicular to float precision only */
        uint32_t hits = 0;
        for (uint32_t lanes = 1; lanes <= 16; lanes *= lanes == 1 ? 4 : 2) {
            ray_batch_trace(ray_text, &mesh, &bvh, lanes, (brume_precision)precision, lanes == 1 ? &first : &other);
            if (lanes > 1) ray_batch_same(&first, &other);
        }
        for (uint32_t i = 0; i < first.n; i++) {
            if (first.range[i] < 0) continue;
            vec3 o = {first.o[i], first.o[first.n + i], first.o[2 * first.n + i]};
            vec3 d = {first.d[i], first.d[first.n + i], first.d[2 * first.n + i]};
            double tmin = first.range[i], tmax = first.range[first.n + i], t = first.t[i];
            assert_int_equal(first.dark[i], first.prim[i] >= 0);
            hits += first.prim[i] >= 0;
            for (uint32_t k = 0; k < mesh.quadric_count; k++) {
                double roots[2], inside, t_error;
                int count = quadric_roots(&mesh.quadrics[k], o, d, slack, roots, &inside, &t_error), matches = 0;
                for (int j = 0; j < count; j++) {
                    matches |= fabs(roots[j] - t) <= t_error;
                    if (inside > slack && roots[j] > tmin + t_error && roots[j] < tmax - t_error)
                        assert_true(t <= roots[j] + t_error);
                }
                if ((int)k == first.prim[i]) assert_true(matches && inside > -slack && t > tmin && t < tmax);
            }
        }
        assert_true(hits > 2000);
    }
    ray_batch_free(&first);
    ray_batch_free(&other);
    brume_bvh_free(&bvh);
    test_mesh_free(&mesh);
}

/* Far, small, huge and touched spheres: relative accuracy of the distance where subtracting would leave none. */
static void test_hard_spheres(void **state) {
    (void)state;
    NEEDS_DEVICE();
    const struct { float z, radius, x; double tolerance; } cases[] = {
        {10000, 1, 0.5f, 3e-7}, {10000, 0.01f, 0.002f, 3e-7}, {1, 0.25f, 0.1f, 3e-7},
        {100001, 100000, 0.5f, 3e-7},      /* standing 1 above a planet, looking down at its ground */
        {1000000, 999999.9375f, 0, 3e-7},  /* 1/16 above a larger one */
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        test_mesh mesh = test_mesh_quadrics(1, 1);
        b_quadric *q = &mesh.quadrics[0];
        q->center[0] = cases[i].x, q->center[1] = 0, q->center[2] = cases[i].z, q->radius = cases[i].radius;
        brume_bvh bvh = ray_batch_build(&mesh);
        ray_batch b = ray_batch_make(16);
        for (uint32_t k = 0; k < 16; k++) ray_batch_set(&b, k, (vec3){0, 0, 0}, (vec3){0, 0, 1});
        b.range[1] = cases[i].z; /* its far side */
        ray_batch_trace(ray_text, &mesh, &bvh, 4, BRUME_PRECISION_FLOAT, &b);
        long double x = cases[i].x, z = cases[i].z, r = cases[i].radius, half = sqrtl((r - x) * (r + x));
        long double near = (x * x + (z - r) * (z + r)) / (z + half);
        assert_true(fabsl(b.t[0] / near - 1) < cases[i].tolerance);
        assert_true(fabsl(b.t[1] / (z + half) - 1) < cases[i].tolerance);
        ray_batch_free(&b);
        brume_bvh_free(&bvh);
        test_mesh_free(&mesh);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_quadrics),
        cmocka_unit_test(test_hard_spheres),
    };
    return cmocka_run_group_tests(tests, open_device, close_device);
}

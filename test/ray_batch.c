/* ray_batch.c -- see ray_batch.h. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "ray_batch.h"

#include "program.h"

const char ray_text[] = "#include \"traverse.h\"\n" RAY_KERNEL;

ray_batch ray_batch_make(uint32_t n) {
    ray_batch b = {(n + 15) / 16 * 16, NULL, NULL, NULL, NULL, NULL, NULL, NULL};
    b.o = calloc(3 * b.n, sizeof *b.o);
    b.d = calloc(3 * b.n, sizeof *b.d);
    b.range = calloc(2 * b.n, sizeof *b.range);
    b.t = calloc(b.n, sizeof *b.t);
    b.uv = calloc(2 * b.n, sizeof *b.uv);
    b.prim = calloc(b.n, sizeof *b.prim);
    b.dark = calloc(b.n, sizeof *b.dark);
    assert_true(b.o && b.d && b.range && b.t && b.uv && b.prim && b.dark);
    for (uint32_t i = 0; i < b.n; i++) {
        b.range[i] = i < n ? 0 : -1;
        b.range[b.n + i] = INFINITY;
        b.d[i] = i < n ? 0 : NAN; /* dead lanes hold anything */
    }
    return b;
}

void ray_batch_free(ray_batch *b) {
    free(b->o);
    free(b->d);
    free(b->range);
    free(b->t);
    free(b->uv);
    free(b->prim);
    free(b->dark);
}

/* Programs are kept: most of a test's time would be their compilation. */
static cl_kernel trace_kernel(const char *text, uint32_t lanes, brume_precision precision) {
    static struct { const char *text; uint32_t lanes; int precision; cl_kernel kernel; } kept[16];
    int at = 0;
    cl_int code;
    cl_program program;
    for (; kept[at].text; at++)
        if (kept[at].text == text && kept[at].lanes == lanes && kept[at].precision == (int)precision)
            return kept[at].kernel;
    assert_true(at < 15);
    assert_int_equal(brume_program_build_text(device, text, lanes, precision, "-DBVH_STACK=200", &program), BRUME_OK);
    kept[at].kernel = clCreateKernel(program, "trace", &code);
    assert_int_equal(code, CL_SUCCESS);
    clReleaseProgram(program);
    kept[at].text = text;
    kept[at].lanes = lanes;
    kept[at].precision = (int)precision;
    return kept[at].kernel;
}

void ray_batch_trace(const char *text, const test_mesh *mesh, const brume_bvh *bvh, uint32_t lanes,
                  brume_precision precision, ray_batch *b) {
    cl_int code;
    size_t real_size = precision == BRUME_PRECISION_DOUBLE ? 8 : 4;
    cl_kernel kernel = trace_kernel(text, lanes, precision);
    assert_true(bvh->stack_size <= 200);

    cl_mem buffers[11] = {upload_bytes(bvh->nodes, bvh->node_count * sizeof *bvh->nodes),
                          upload_bytes(bvh->blocks, bvh->block_count * sizeof *bvh->blocks),
                          upload_bytes(mesh->quadrics, mesh->quadric_count * sizeof *mesh->quadrics),
                          upload_bytes(bvh->quadric_ids, bvh->quadric_block_count * 8 * sizeof *bvh->quadric_ids),
                          upload_bytes(b->o, 3 * b->n * sizeof *b->o),
                          upload_bytes(b->d, 3 * b->n * sizeof *b->d),
                          upload_bytes(b->range, 2 * b->n * sizeof *b->range),
                          upload_bytes(b->t, b->n * real_size),
                          upload_bytes(b->prim, b->n * sizeof *b->prim),
                          upload_bytes(b->uv, 2 * b->n * real_size),
                          upload_bytes(b->dark, b->n * sizeof *b->dark)};
    cl_int counts[2] = {(cl_int)mesh->triangle_count, (cl_int)b->n};
    for (cl_uint i = 0; i < 4; i++) clSetKernelArg(kernel, i, sizeof(cl_mem), &buffers[i]);
    for (cl_uint i = 0; i < 2; i++) clSetKernelArg(kernel, 4 + i, sizeof(cl_int), &counts[i]);
    for (cl_uint i = 4; i < 11; i++) clSetKernelArg(kernel, 2 + i, sizeof(cl_mem), &buffers[i]);
    size_t items = b->n / lanes;
    assert_int_equal(clEnqueueNDRangeKernel(device->queue, kernel, 1, NULL, &items, NULL, 0, NULL, NULL), CL_SUCCESS);

    void *raw = malloc(2 * b->n * real_size);
    assert_non_null(raw);
    clEnqueueReadBuffer(device->queue, buffers[7], CL_TRUE, 0, b->n * real_size, raw, 0, NULL, NULL);
    for (uint32_t i = 0; i < b->n; i++) b->t[i] = real_size == 8 ? ((double *)raw)[i] : ((float *)raw)[i];
    clEnqueueReadBuffer(device->queue, buffers[9], CL_TRUE, 0, 2 * b->n * real_size, raw, 0, NULL, NULL);
    for (uint32_t i = 0; i < 2 * b->n; i++) b->uv[i] = real_size == 8 ? ((double *)raw)[i] : ((float *)raw)[i];
    clEnqueueReadBuffer(device->queue, buffers[8], CL_TRUE, 0, b->n * sizeof *b->prim, b->prim, 0, NULL, NULL);
    code = clEnqueueReadBuffer(device->queue, buffers[10], CL_TRUE, 0, b->n * sizeof *b->dark, b->dark, 0, NULL, NULL);
    assert_int_equal(code, CL_SUCCESS);
    free(raw);
    for (int i = 0; i < 11; i++) clReleaseMemObject(buffers[i]);
}

brume_bvh ray_batch_build(const test_mesh *mesh) {
    brume_bvh bvh;
    assert_int_equal(brume_bvh_build(context, mesh->positions, mesh->triangles, mesh->triangle_count, mesh->quadrics,
                                     mesh->quadric_count, &bvh), BRUME_OK);
    return bvh;
}

void ray_batch_same(const ray_batch *a, const ray_batch *b) {
    assert_memory_equal(a->t, b->t, a->n * sizeof *a->t);
    assert_memory_equal(a->uv, b->uv, 2 * a->n * sizeof *a->uv);
    assert_memory_equal(a->prim, b->prim, a->n * sizeof *a->prim);
    assert_memory_equal(a->dark, b->dark, a->n * sizeof *a->dark);
}

void ray_batch_set(ray_batch *b, uint32_t i, vec3 o, vec3 d) {
    b->o[i] = (float)o.x, b->o[b->n + i] = (float)o.y, b->o[2 * b->n + i] = (float)o.z;
    b->d[i] = (float)d.x, b->d[b->n + i] = (float)d.y, b->d[2 * b->n + i] = (float)d.z;
}

vec3 ray_random_point(uint64_t *seed, double size) {
    double x = test_uniform(seed), y = test_uniform(seed), z = test_uniform(seed);
    return (vec3){size * (2 * x - 1), size * (2 * y - 1), size * (2 * z - 1)};
}

vec3 ray_random_target(const test_mesh *m, uint64_t *seed) {
    uint32_t prim = (uint32_t)(test_uniform(seed) * m->triangle_count);
    const int *v = m->triangles[prim].v;
    const float *at = m->positions;
    vec3 p = vec3_from(at + 3 * v[0]), q = vec3_from(at + 3 * v[1]), r = vec3_from(at + 3 * v[2]);
    double kind = test_uniform(seed), s = kind < 0.3 ? 0 : test_uniform(seed), u = kind < 0.8 ? 0 : test_uniform(seed);
    return (vec3){p.x + s * (q.x - p.x) + u * (1 - s) * (r.x - p.x), p.y + s * (q.y - p.y) + u * (1 - s) * (r.y - p.y),
                  p.z + s * (q.z - p.z) + u * (1 - s) * (r.z - p.z)};
}

ray_batch ray_batch_random(const test_mesh *m, uint32_t n, uint64_t seed) {
    ray_batch b = ray_batch_make(n);
    for (uint32_t i = 0; i < n; i++) {
        vec3 o = ray_random_point(&seed, 2);
        vec3 target = m->triangle_count ? ray_random_target(m, &seed) : ray_random_point(&seed, 1);
        vec3 d = vec3_sub(target, o);
        double size = vec3_length(d);
        d = (vec3){d.x / size, d.y / size, d.z / size};
        if (i % 8 == 1) { /* along an axis, through a vertex as often as not */
            double *c[3] = {&d.x, &d.y, &d.z};
            for (int a = 0; a < 3; a++) *c[a] = a == (int)(i / 8 % 3) ? (i & 64 ? 1 : -1) : (i & 128 ? 0 : -0.0);
            o = (vec3){target.x - 3 * d.x, target.y - 3 * d.y, target.z - 3 * d.z};
        }
        if (i % 8 == 2) d.x = 0;
        if (i % 8 == 3) o = target; /* from the surface */
        ray_batch_set(&b, i, o, d);
        if (i % 8 == 4) b.range[i] = (float)test_uniform(&seed), b.range[b.n + i] = (float)(3 * test_uniform(&seed));
        if (i % 64 == 5) b.range[i] = -1;
    }
    return b;
}

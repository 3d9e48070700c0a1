/* test_traverse.c -- rays through the hierarchy on the device against brute force in double, and for cracks. */
#include <float.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "bvh.h"
#include "meshes.h"
#include "open_device.h"
#include "planted.h"
#include "program.h"
#include "stability.h"

/* One ray a lane; arrays hold x of all rays, then y, then z. */
#define TRACE_KERNEL                                                                                                  \
    "__kernel void trace(__global const b_node *nodes, __global const b_triangle_block *blocks,\n"                    \
    "                    __global const b_quadric *quadrics, __global const int *ids, int triangles, int n,\n"        \
    "                    __global const float *o, __global const float *d, __global const float *range,\n"            \
    "                    __global real1 *t, __global int *prim, __global real1 *uv, __global int *dark) {\n"          \
    "    int at = get_global_id(0) * LANES;\n"                                                                        \
    "    geometry g = {nodes, blocks, quadrics, ids, triangles};\n"                                                   \
    "    vec from = vmake(load_lanes(o + at), load_lanes(o + n + at), load_lanes(o + 2 * n + at));\n"                 \
    "    vec to = vmake(load_lanes(d + at), load_lanes(d + n + at), load_lanes(d + 2 * n + at));\n"                   \
    "    real low = load_lanes(range + at), high = load_lanes(range + n + at);\n"                                     \
    "    mask live = low >= R(0);\n"                                                                                  \
    "    hit h = closest(&g, from, to, low, high, live);\n"                                                           \
    "    lanes_of_real ts, us, vs; lanes_of_ireal prims, darks;\n"                                                    \
    "    ts.all = h.t; us.all = h.u; vs.all = h.v; prims.all = h.prim;\n"                                             \
    "    darks.all = occluded(&g, from, to, low, high, live) ? I(1) : I(0);\n"                                        \
    "    for (int k = 0; k < LANES; k++) {\n"                                                                         \
    "        t[at + k] = ts.one[k]; prim[at + k] = (int)prims.one[k]; dark[at + k] = (int)darks.one[k];\n"            \
    "        uv[at + k] = us.one[k]; uv[n + at + k] = vs.one[k];\n"                                                   \
    "    }\n"                                                                                                         \
    "}\n"

static const char trace_text[] = "#include \"traverse.h\"\n" TRACE_KERNEL;

/* The planted bug: the test of Moeller & Trumbore 1997 with its float edge tests in place of the watertight one. */
static const char naive_text[] =
    "#define BVH_PACKET 0\n"
    "#define BRUME_INTERSECT_TRIANGLE_H\n"
    "#include \"shared.h\"\n"
    "#include \"exact.h\"\n"
    "#include \"wide.h\"\n"
    "FN void intersect_block(__global const b_triangle_block *block, const ray *r, real1 near, real1 tmax,\n"
    "                        block_hits *out) {\n"
    "    wide a[3], e[3], f[3], s[3], p[3], q[3];\n"
    "    for (int i = 0; i < 3; i++) {\n"
    "        a[i] = wide_load(block->v0[i]);\n"
    "        e[i] = wide_load(block->v1[i]) - a[i];\n"
    "        f[i] = wide_load(block->v2[i]) - a[i];\n"
    "        s[i] = (wide)r->o[i] - a[i];\n"
    "    }\n"
    "    for (int i = 0; i < 3; i++) {\n"
    "        int j = (i + 1) % 3, k = (i + 2) % 3;\n"
    "        p[i] = (wide)r->d[j] * f[k] - (wide)r->d[k] * f[j];\n"
    "        q[i] = s[j] * e[k] - s[k] * e[j];\n"
    "    }\n"
    "    wide det = e[0] * p[0] + e[1] * p[1] + e[2] * p[2], scale = (wide)1 / det;\n"
    "    wide u = (s[0] * p[0] + s[1] * p[1] + s[2] * p[2]) * scale;\n"
    "    wide v = ((wide)r->d[0] * q[0] + (wide)r->d[1] * q[1] + (wide)r->d[2] * q[2]) * scale;\n"
    "    wide t = (f[0] * q[0] + f[1] * q[1] + f[2] * q[2]) * scale;\n"
    "    wide entered = wmax(t, (wide)near);\n"
    "    out->set = wide_set((u >= (wide)0) & (v >= (wide)0) & (u + v <= (wide)1) & (t > (wide)r->tmin) &\n"
    "                        (entered <= (wide)tmax));\n"
    "    out->t.all = entered;\n"
    "    out->v.all = u * det;\n"
    "    out->w.all = v * det;\n"
    "    out->det.all = det;\n"
    "}\n"
    "#include \"traverse.h\"\n" TRACE_KERNEL;

/* Rays and what came back. n is a multiple of 16; the first ray's lanes beyond the last real one have range -1. */
typedef struct batch {
    uint32_t n;
    float *o, *d, *range; /* 3 n, 3 n, 2 n; a first range below 0: a dead lane */
    double *t, *uv;       /* as computed: floats widened */
    int *prim, *dark;
} batch;

static batch batch_make(uint32_t n) {
    batch b = {(n + 15) / 16 * 16, NULL, NULL, NULL, NULL, NULL, NULL, NULL};
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

static void batch_free(batch *b) {
    free(b->o);
    free(b->d);
    free(b->range);
    free(b->t);
    free(b->uv);
    free(b->prim);
    free(b->dark);
}

static cl_mem upload(const void *data, size_t size) {
    cl_int code;
    char nothing[16] = {0};
    cl_mem m = clCreateBuffer(device->cl, CL_MEM_READ_WRITE | CL_MEM_COPY_HOST_PTR, size ? size : sizeof nothing,
                              size ? (void *)(uintptr_t)data : nothing, &code);
    assert_int_equal(code, CL_SUCCESS);
    return m;
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

static void trace(const char *text, const test_mesh *mesh, const brume_bvh *bvh, uint32_t lanes,
                  brume_precision precision, batch *b) {
    cl_int code;
    size_t real_size = precision == BRUME_PRECISION_DOUBLE ? 8 : 4;
    cl_kernel kernel = trace_kernel(text, lanes, precision);
    assert_true(bvh->stack_size <= 200);

    cl_mem buffers[11] = {upload(bvh->nodes, bvh->node_count * sizeof *bvh->nodes),
                          upload(bvh->blocks, bvh->block_count * sizeof *bvh->blocks),
                          upload(mesh->quadrics, mesh->quadric_count * sizeof *mesh->quadrics),
                          upload(bvh->quadric_ids, bvh->quadric_block_count * 8 * sizeof *bvh->quadric_ids),
                          upload(b->o, 3 * b->n * sizeof *b->o),
                          upload(b->d, 3 * b->n * sizeof *b->d),
                          upload(b->range, 2 * b->n * sizeof *b->range),
                          upload(b->t, b->n * real_size),
                          upload(b->prim, b->n * sizeof *b->prim),
                          upload(b->uv, 2 * b->n * real_size),
                          upload(b->dark, b->n * sizeof *b->dark)};
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

static brume_bvh build(const test_mesh *mesh) {
    brume_bvh bvh;
    assert_int_equal(brume_bvh_build(context, mesh->positions, mesh->triangles, mesh->triangle_count, mesh->quadrics,
                                     mesh->quadric_count, &bvh), BRUME_OK);
    return bvh;
}

/* ---- brute force ---------------------------------------------------------------------------------------------- */

typedef struct vec3 { double x, y, z; } vec3;
static vec3 sub(vec3 a, vec3 b) { return (vec3){a.x - b.x, a.y - b.y, a.z - b.z}; }
static double dot(vec3 a, vec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
static double length(vec3 a) { return sqrt(dot(a, a)); }
static vec3 cross(vec3 a, vec3 b) {
    return (vec3){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
static vec3 point(const float *p) { return (vec3){p[0], p[1], p[2]}; }

/* A ray's meeting with one primitive's plane or surface: where, how far inside the outline (distance between the lines;
 * negative outside), and the error that `slack` of displacement means for t. */
typedef struct meeting { double t, inside, t_error; } meeting;

static meeting meet_triangle(const test_mesh *m, uint32_t prim, vec3 o, vec3 d, double slack) {
    vec3 v[3];
    double distance[3], low = INFINITY, high = -INFINITY;
    for (int i = 0; i < 3; i++) v[i] = sub(point(m->positions + 3 * m->triangles[prim].v[i]), o);
    for (int i = 0; i < 3; i++) {
        vec3 e = sub(v[(i + 1) % 3], v[i]), across = cross(d, e);
        double size = length(across);
        distance[i] = size > 0 ? dot(across, v[i]) / size : 0;
        low = fmin(low, distance[i]), high = fmax(high, distance[i]);
    }
    vec3 n = cross(sub(v[1], v[0]), sub(v[2], v[0]));
    double along = dot(n, d);
    /* Moving a vertex by the slack turns the plane by slack / height; where that is all of the angle to the ray, the
     * triangle is met somewhere between its corners and no more can be said. */
    double longest = fmax(length(sub(v[1], v[0])), fmax(length(sub(v[2], v[1])), length(sub(v[0], v[2]))));
    double sine = fabs(along) / (length(n) * length(d)) - 4 * slack * longest / length(n);
    meeting r = {dot(n, v[0]) / along, fmax(low, -high), sine > 0 ? slack / length(d) * (1 + 1 / sine) : INFINITY};
    if (!(fabs(along) > 0)) r = (meeting){0, -INFINITY, 0};
    return r;
}

/* Closest and certain: brackets what the device may answer. `slack` is the displacement that its rounding amounts to:
 * hits nearer to the outline may be found or not. */
static void check_ray(const test_mesh *m, const batch *b, uint32_t i, double slack) {
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
            for (int k = 0; k < 3; k++) p[k] = point(m->positions + 3 * m->triangles[prim].v[k]);
            double u = b->uv[i], v = b->uv[b->n + i], w = 1 - u - v;
            at = (vec3){w * p[0].x + u * p[1].x + v * p[2].x - o.x - t * d.x,
                        w * p[0].y + u * p[1].y + v * p[2].y - o.y - t * d.y,
                        w * p[0].z + u * p[1].z + v * p[2].z - o.z - t * d.z};
            assert_true(u >= 0 && v >= 0 && u + v <= 1.000001);
            assert_true(isinf(c.t_error) || length(at) <= 2 * slack + length(d) * c.t_error);
        } else if (c.inside > slack && c.t > tmin + c.t_error && c.t < tmax - c.t_error) {
            assert_true(t <= c.t + c.t_error);
        }
    }
    if (b->prim[i] < 0) assert_true(b->prim[i] == -1 && t == tmax);
    assert_int_equal(b->dark[i], b->prim[i] >= 0);
}

static void same(const batch *a, const batch *b) {
    assert_memory_equal(a->t, b->t, a->n * sizeof *a->t);
    assert_memory_equal(a->uv, b->uv, 2 * a->n * sizeof *a->uv);
    assert_memory_equal(a->prim, b->prim, a->n * sizeof *a->prim);
    assert_memory_equal(a->dark, b->dark, a->n * sizeof *a->dark);
}

static void set_ray(batch *b, uint32_t i, vec3 o, vec3 d) {
    b->o[i] = (float)o.x, b->o[b->n + i] = (float)o.y, b->o[2 * b->n + i] = (float)o.z;
    b->d[i] = (float)d.x, b->d[b->n + i] = (float)d.y, b->d[2 * b->n + i] = (float)d.z;
}

static vec3 random_point(uint64_t *seed, double size) {
    double x = test_uniform(seed), y = test_uniform(seed), z = test_uniform(seed);
    return (vec3){size * (2 * x - 1), size * (2 * y - 1), size * (2 * z - 1)};
}

/* A point of the mesh: a vertex, on an edge, or inside a triangle; exactly so only for vertices. */
static vec3 random_target(const test_mesh *m, uint64_t *seed) {
    uint32_t prim = (uint32_t)(test_uniform(seed) * m->triangle_count);
    const int *v = m->triangles[prim].v;
    vec3 p = point(m->positions + 3 * v[0]), q = point(m->positions + 3 * v[1]), r = point(m->positions + 3 * v[2]);
    double kind = test_uniform(seed), s = kind < 0.3 ? 0 : test_uniform(seed), u = kind < 0.8 ? 0 : test_uniform(seed);
    return (vec3){p.x + s * (q.x - p.x) + u * (1 - s) * (r.x - p.x), p.y + s * (q.y - p.y) + u * (1 - s) * (r.y - p.y),
                  p.z + s * (q.z - p.z) + u * (1 - s) * (r.z - p.z)};
}

/* Rays of all sorts: anywhere, at vertices and edges, along axes, with limits, dead ones. */
static batch make_rays(const test_mesh *m, uint32_t n, uint64_t seed) {
    batch b = batch_make(n);
    for (uint32_t i = 0; i < n; i++) {
        vec3 o = random_point(&seed, 2), target = m->triangle_count ? random_target(m, &seed) : random_point(&seed, 1);
        vec3 d = sub(target, o);
        double size = length(d);
        d = (vec3){d.x / size, d.y / size, d.z / size};
        if (i % 8 == 1) { /* along an axis, through a vertex as often as not */
            double *c[3] = {&d.x, &d.y, &d.z};
            for (int a = 0; a < 3; a++) *c[a] = a == (int)(i / 8 % 3) ? (i & 64 ? 1 : -1) : (i & 128 ? 0 : -0.0);
            o = (vec3){target.x - 3 * d.x, target.y - 3 * d.y, target.z - 3 * d.z};
        }
        if (i % 8 == 2) d.x = 0;
        if (i % 8 == 3) o = target; /* from the surface */
        set_ray(&b, i, o, d);
        if (i % 8 == 4) b.range[i] = (float)test_uniform(&seed), b.range[b.n + i] = (float)(3 * test_uniform(&seed));
        if (i % 64 == 5) b.range[i] = -1;
    }
    return b;
}

/* Every width and precision; the float ones and the double ones equal among each other. Slack: float's is 16 ulp of the
 * largest distance; double_slack is what brute force itself needs for these triangles. */
static void check_mesh(test_mesh mesh, uint32_t n, double double_slack) {
    brume_bvh bvh = build(&mesh);
    batch first = make_rays(&mesh, n, 101), other = make_rays(&mesh, n, 101);
    for (int precision = 0; precision < 2; precision++) {
        for (uint32_t lanes = 1; lanes <= 16; lanes *= lanes == 1 ? 4 : 2) {
            trace(trace_text, &mesh, &bvh, lanes, (brume_precision)precision, lanes == 1 ? &first : &other);
            if (lanes > 1) same(&first, &other);
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
    batch_free(&first);
    batch_free(&other);
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

/* ---- cracks --------------------------------------------------------------------------------------------------- */

static uint32_t count_leaks(const char *text, double scale, double shift, uint32_t n, uint32_t lanes,
                            brume_precision precision) {
    test_mesh mesh = test_mesh_sphere(96, 128, 0.2);
    uint64_t seed = 55;
    uint32_t leaks = 0;
    for (uint32_t i = 0; i < 3 * mesh.vertex_count; i++)
        mesh.positions[i] = (float)(scale * mesh.positions[i] + shift);
    brume_bvh bvh = build(&mesh);
    batch b = batch_make(n);
    for (uint32_t i = 0; i < n; i++) {
        vec3 o = random_point(&seed, 0.4), d;
        o = (vec3){(float)(scale * o.x + shift), (float)(scale * o.y + shift), (float)(scale * o.z + shift)};
        d = sub(random_target(&mesh, &seed), o);
        if (i % 2) {
            double size = length(d);
            d = (vec3){d.x / size, d.y / size, d.z / size};
        }
        set_ray(&b, i, o, d);
    }
    trace(text, &mesh, &bvh, lanes, precision, &b);
    for (uint32_t i = 0; i < n; i++) leaks += b.prim[i] < 0 || !b.dark[i];
    batch_free(&b);
    brume_bvh_free(&bvh);
    test_mesh_free(&mesh);
    return leaks;
}

static void test_watertight(void **state) {
    (void)state;
    NEEDS_DEVICE();
    uint32_t leaks = count_leaks(trace_text, 1, 0, 600000, 8, BRUME_PRECISION_FLOAT);
    leaks += count_leaks(trace_text, 1, 1000, 200000, 16, BRUME_PRECISION_FLOAT);
    leaks += count_leaks(trace_text, 1e-6, 0, 100000, 8, BRUME_PRECISION_FLOAT);
    leaks += count_leaks(trace_text, 1e6, 0, 100000, 1, BRUME_PRECISION_FLOAT);
    leaks += count_leaks(trace_text, 1, 0, 100000, 8, BRUME_PRECISION_DOUBLE);
    uint32_t naive = count_leaks(naive_text, 1, 0, 200000, 8, BRUME_PRECISION_FLOAT);
    stability_row("hazard", "rays at a closed mesh's edges and vertices", "none leaks", "of 1 100 000 rays", 0, leaks,
                  "naive %u of 200 000", naive);
    assert_true(naive > 100);
}

/* Planted: without the margin of the box test, boxes are missed whose edges the rays meet. */
static const char tight_text[] = "#include \"traverse.h\"\n" TRACE_KERNEL;

static void test_box_margin(void **state) {
    (void)state;
    NEEDS_DEVICE();
    uint32_t naive = 0, leaks = 0;
    for (int tight = 1; tight >= 0; tight--) {
        if (tight)
            planted_bug("traverse_single.h", "#define WIDEN ((real1)(1 + 0x1p-19f))", "#define WIDEN ((real1)1)");
        test_mesh mesh = test_mesh_cube(32);
        uint64_t seed = 56;
        brume_bvh bvh = build(&mesh);
        batch b = batch_make(200000);
        for (uint32_t i = 0; i < b.n; i++) {
            vec3 o = random_point(&seed, 0.9);
            o = (vec3){(float)o.x, (float)o.y, (float)o.z};
            set_ray(&b, i, o, sub(random_target(&mesh, &seed), o));
        }
        trace(tight ? tight_text : trace_text, &mesh, &bvh, 8, BRUME_PRECISION_FLOAT, &b);
        for (uint32_t i = 0; i < b.n; i++) *(tight ? &naive : &leaks) += b.prim[i] < 0;
        batch_free(&b);
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
    brume_bvh bvh = build(&mesh);
    for (int up = 0; up < 2; up++) {
        batch b = batch_make(127 * 127);
        for (int i = 0; i < 127 * 127; i++) {
            double x = -1 + (i % 127 + 1) / 64.0, y = -1 + (i / 127 + 1) / 64.0;
            set_ray(&b, (uint32_t)i, (vec3){x, y, up ? -1 : 1}, (vec3){0, i & 1 ? 0 : -0.0, up ? 1 : -1});
        }
        trace(trace_text, &mesh, &bvh, 8, BRUME_PRECISION_FLOAT, &b);
        for (int i = 0; i < 127 * 127; i++) assert_true(b.prim[i] >= 0 && b.dark[i]);
        batch_free(&b);
    }
    brume_bvh_free(&bvh);
    test_mesh_free(&mesh);
}

/* Many triangles at one place: the lowest number wins, at every width. */
static void test_ties(void **state) {
    (void)state;
    NEEDS_DEVICE();
    test_mesh mesh = test_mesh_soup(1000, 0, 0, 41);
    float p[9] = {-1, -1, 0, 1, -1, 0, 0, 1, 0};
    for (int i = 0; i < 1000; i++) memcpy(mesh.positions + 9 * i, p, sizeof p);
    brume_bvh bvh = build(&mesh);
    for (uint32_t lanes = 1; lanes <= 16; lanes *= lanes == 1 ? 4 : 2) {
        batch b = batch_make(64);
        for (uint32_t i = 0; i < 64; i++)
            set_ray(&b, i, (vec3){0.001 * i, 0.002 * i, 2}, (vec3){0.001 * i, 0, -1});
        trace(trace_text, &mesh, &bvh, lanes, BRUME_PRECISION_FLOAT, &b);
        for (int i = 0; i < 64; i++) assert_int_equal(b.prim[i], 0);
        batch_free(&b);
    }
    brume_bvh_free(&bvh);
    test_mesh_free(&mesh);
}

/* Off a huge slanted triangle by about its vertices' rounding: rays away from it miss it, rays towards it hit. */
static void test_large_triangle(void **state) {
    (void)state;
    NEEDS_DEVICE();
    test_mesh mesh = test_mesh_soup(1, 0, 0, 42);
    float p[9] = {-1000, -900, 100, 1000, -800, -120, 50, 1000, 77};
    uint64_t seed = 43;
    memcpy(mesh.positions, p, sizeof p);
    vec3 a = point(p), e = sub(point(p + 3), a), f = sub(point(p + 6), a), n = cross(e, f);
    brume_bvh bvh = build(&mesh);
    batch b = batch_make(20000);
    for (uint32_t i = 0; i < b.n; i++) {
        double u = 0.1 + 0.4 * test_uniform(&seed), v = 0.1 + 0.4 * test_uniform(&seed);
        double off = 1e-4 * (i % 4 < 2 ? 1 : -1);
        vec3 d = random_point(&seed, 1), o;
        double side = dot(d, n) / length(n), size = length(d);
        /* At a grazing angle, away from it where i is even. */
        double less = 0.99 * side / length(n);
        d = (vec3){d.x - less * n.x, d.y - less * n.y, d.z - less * n.z};
        double keep = (i % 2 == 0) == (side * off > 0) ? 1 : -1;
        d = (vec3){keep * d.x / size, keep * d.y / size, keep * d.z / size};
        off /= length(n);
        o = (vec3){a.x + u * e.x + v * f.x + off * n.x, a.y + u * e.y + v * f.y + off * n.y,
                   a.z + u * e.z + v * f.z + off * n.z};
        set_ray(&b, i, o, d);
    }
    trace(trace_text, &mesh, &bvh, 8, BRUME_PRECISION_FLOAT, &b);
    for (uint32_t i = 0; i < b.n; i++) {
        /* Which side the rounded origin is on. */
        vec3 o = {b.o[i], b.o[b.n + i], b.o[2 * b.n + i]}, d = {b.d[i], b.d[b.n + i], b.d[2 * b.n + i]};
        double height = dot(sub(o, a), n), along = dot(d, n), t = -height / along;
        if (t < -1e-9) assert_int_equal(b.prim[i], -1);
        if (t > 1e-9 && t < 1) { /* refined unless t is four times the error that float makes at this size and angle */
            assert_int_equal(b.prim[i], 0);
            assert_true(fabs(b.t[i] - t) <= 0.25 * t + 1e-9);
        }
    }
    batch_free(&b);
    brume_bvh_free(&bvh);
    test_mesh_free(&mesh);
}

/* ---- quadrics ------------------------------------------------------------------------------------------------- */

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
    vec3 du = point(q->du), dv = point(q->dv), n = cross(du, dv), from = sub(point(q->center), of);
    double along = dot(n, df);
    t[0] = dot(n, from) / along;
    vec3 p = {t[0] * df.x - from.x, t[0] * df.y - from.y, t[0] * df.z - from.z};
    double x = dot(p, du) / dot(du, du), y = dot(p, dv) / dot(dv, dv);
    double least = fmin(length(du), length(dv));
    *t_error = slack * (2 + length(n) * length(df) / fabs(along));
    *inside = (1 - sqrt(x * x + y * y)) * least / (1 + length(n) * length(df) / fabs(along));
    return 1;
}

static void test_quadrics(void **state) {
    (void)state;
    NEEDS_DEVICE();
    test_mesh mesh = test_mesh_quadrics(200, 51);
    brume_bvh bvh = build(&mesh);
    batch first = make_rays(&mesh, 6000, 102), other = make_rays(&mesh, 6000, 102);
    for (int precision = 0; precision < 2; precision++) {
        double slack = precision ? 1e-6 : 4e-6; /* axes are perpendicular to float precision only */
        uint32_t hits = 0;
        for (uint32_t lanes = 1; lanes <= 16; lanes *= lanes == 1 ? 4 : 2) {
            trace(trace_text, &mesh, &bvh, lanes, (brume_precision)precision, lanes == 1 ? &first : &other);
            if (lanes > 1) same(&first, &other);
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
    batch_free(&first);
    batch_free(&other);
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
        brume_bvh bvh = build(&mesh);
        batch b = batch_make(16);
        for (uint32_t k = 0; k < 16; k++) set_ray(&b, k, (vec3){0, 0, 0}, (vec3){0, 0, 1});
        b.range[1] = cases[i].z; /* its far side */
        trace(trace_text, &mesh, &bvh, 4, BRUME_PRECISION_FLOAT, &b);
        long double x = cases[i].x, z = cases[i].z, r = cases[i].radius, half = sqrtl((r - x) * (r + x));
        long double near = (x * x + (z - r) * (z + r)) / (z + half);
        assert_true(fabsl(b.t[0] / near - 1) < cases[i].tolerance);
        assert_true(fabsl(b.t[1] / (z + half) - 1) < cases[i].tolerance);
        batch_free(&b);
        brume_bvh_free(&bvh);
        test_mesh_free(&mesh);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_soup),       cmocka_unit_test(test_closed),
        cmocka_unit_test(test_terrain),    cmocka_unit_test(test_slivers),
        cmocka_unit_test(test_watertight), cmocka_unit_test(test_box_margin),
        cmocka_unit_test(test_axis_rays),  cmocka_unit_test(test_ties),
        cmocka_unit_test(test_quadrics),   cmocka_unit_test(test_hard_spheres),
        cmocka_unit_test(test_large_triangle),
    };
    return cmocka_run_group_tests(tests, open_device, close_device);
}

/* test_geometry.c -- surfaces from hits, as Mitsuba 3.9.1 describes them, and rays that leave them. */
#include <limits.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "bvh.h"
#include "meshes.h"
#include "open_device.h"
#include "planted.h"
#include "program.h"
#include "stability.h"

/* Planted: origins move by 1e-4, whatever the scale. */
static int fixed_offset;

/* out: p, ng, ns, tangent, u, v, then the prim that a ray from there along `next` hits; 15 values of n rays each. */
static const char text[] =
    "#include \"geometry.h\"\n"
    "__kernel void look(__global const b_node *nodes, __global const b_triangle_block *blocks,\n"
    "                   __global const b_quadric *quadrics, __global const int *ids,\n"
    "                   __global const b_triangle *triangles, __global const b_shape *shapes,\n"
    "                   __global const float *positions, __global const float *normals, __global const float *uvs,\n"
    "                   __global const float *rays, __global float *out, int triangle_count, int n) {\n"
    "    int at = get_global_id(0) * LANES;\n"
    "    scene s;\n"
    "    s.geometry.nodes = nodes; s.geometry.blocks = blocks; s.geometry.quadrics = quadrics;\n"
    "    s.geometry.quadric_ids = ids; s.geometry.triangle_count = triangle_count; s.triangles = triangles;\n"
    "    s.shapes = shapes; s.positions = positions; s.normals = normals; s.uvs = uvs;\n"
    "    real in[9];\n"
    "    for (int i = 0; i < 9; i++) in[i] = load_lanes(rays + i * n + at);\n"
    "    vec o = vmake(in[0], in[1], in[2]), d = vmake(in[3], in[4], in[5]), next = vmake(in[6], in[7], in[8]);\n"
    "    hit h = closest(&s.geometry, o, d, R(0), R(INFINITY), TRUE_MASK);\n"
    "    surface x = surface_of(&s, o, d, h, TRUE_MASK);\n"
    "    hit again = closest(&s.geometry, offset_origin(x.p, x.ng, next), next, R(0), R(INFINITY), TRUE_MASK);\n"
    "    real values[16] = {x.p.x, x.p.y, x.p.z, x.ng.x, x.ng.y, x.ng.z, x.ns.x, x.ns.y, x.ns.z, x.tangent.x,\n"
    "                       x.tangent.y, x.tangent.z, x.u, x.v, to_real(again.prim), to_real(h.prim)};\n"
    "    for (int i = 0; i < 16; i++) store_lanes(values[i], out + i * n + at);\n"
    "}\n";

enum { VALUES = 16, AGAIN = 14, FIRST = 15 };

typedef struct setup {
    test_mesh mesh;
    b_shape shape;
    float *normals, *uvs; /* per vertex, or NULL */
} setup;

/* n a multiple of 16. */
static void look(const setup *s, uint32_t lanes, brume_precision precision, const float *rays, uint32_t n, float *out) {
    static struct { cl_kernel kernel; uint32_t lanes; int precision, fixed_offset; } kept[10];
    int at = 0;
    cl_int code;
    brume_bvh bvh;
    while (kept[at].kernel && (kept[at].lanes != lanes || kept[at].precision != (int)precision ||
                               kept[at].fixed_offset != fixed_offset))
        at++;
    if (!kept[at].kernel) {
        cl_program program;
        if (fixed_offset)
            planted_bug("geometry.h", "real size = lmax(fabs(p.x), lmax(fabs(p.y), fabs(p.z))) * step;",
                        "real size = R(1e-4);");
        brume_result built = brume_program_build_text(device, text, lanes, precision, "-DBVH_STACK=64", &program);
        planted_remove();
        assert_int_equal(built, BRUME_OK);
        kept[at].fixed_offset = fixed_offset;
        kept[at].kernel = clCreateKernel(program, "look", &code);
        assert_int_equal(code, CL_SUCCESS);
        kept[at].lanes = lanes;
        kept[at].precision = (int)precision;
        clReleaseProgram(program);
    }
    const test_mesh *m = &s->mesh;
    assert_int_equal(brume_bvh_build(context, m->positions, m->triangles, m->triangle_count, m->quadrics,
                                     m->quadric_count, &bvh), BRUME_OK);
    assert_true(bvh.stack_size <= 64);
    cl_mem buffers[11] = {upload_bytes(bvh.nodes, bvh.node_count * sizeof *bvh.nodes),
                          upload_bytes(bvh.blocks, bvh.block_count * sizeof *bvh.blocks),
                          upload_bytes(m->quadrics, m->quadric_count * sizeof *m->quadrics),
                          upload_bytes(bvh.quadric_ids, bvh.quadric_block_count * 8 * sizeof *bvh.quadric_ids),
                          upload_bytes(m->triangles, m->triangle_count * sizeof *m->triangles),
                          upload_bytes(&s->shape, sizeof s->shape),
                          upload_bytes(m->positions, m->vertex_count * 3 * sizeof *m->positions),
                          upload_bytes(s->normals, s->normals ? m->vertex_count * 3 * sizeof(float) : 0),
                          upload_bytes(s->uvs, s->uvs ? m->vertex_count * 2 * sizeof(float) : 0),
                          upload_bytes(rays, 9 * n * sizeof *rays),
                          upload_bytes(out, VALUES * n * sizeof *out)};
    cl_int counts[2] = {(cl_int)m->triangle_count, (cl_int)n};
    for (cl_uint i = 0; i < 11; i++) clSetKernelArg(kept[at].kernel, i, sizeof(cl_mem), &buffers[i]);
    for (cl_uint i = 0; i < 2; i++) clSetKernelArg(kept[at].kernel, 11 + i, sizeof(cl_int), &counts[i]);
    size_t items = n / lanes;
    code = clEnqueueNDRangeKernel(device->queue, kept[at].kernel, 1, NULL, &items, NULL, 0, NULL, NULL);
    assert_int_equal(code, CL_SUCCESS);
    code = clEnqueueReadBuffer(device->queue, buffers[10], CL_TRUE, 0, VALUES * n * sizeof *out, out, 0, NULL, NULL);
    assert_int_equal(code, CL_SUCCESS);
    for (int i = 0; i < 11; i++) clReleaseMemObject(buffers[i]);
    brume_bvh_free(&bvh);
}

/* One ray in all lanes against p, ng, ns, tangent, u, v as Mitsuba printed them (6 digits). */
static void check_one(const setup *s, const float o[3], const float expected[14]) {
    float rays[9 * 16], out[VALUES * 16];
    for (int i = 0; i < 16; i++)
        for (int a = 0; a < 9; a++) rays[16 * a + i] = a < 3 ? o[a] : a % 3 == 2 ? -1.0f : 0.0f;
    for (uint32_t lanes = 1; lanes <= 16; lanes *= lanes == 1 ? 4 : 2)
        for (int precision = 0; precision < 2; precision += lanes == 4 ? 1 : 2) {
            look(s, lanes, (brume_precision)precision, rays, 16, out);
            for (int i = 0; i < 16; i++) {
                assert_true(out[16 * FIRST + i] == 0);
                for (int k = 0; k < 14; k++)
                    assert_true(fabs(out[16 * k + i] - expected[k]) < (fabs(expected[k]) < 1 ? 2e-6 : 6e-6));
            }
        }
}

static setup make_setup(test_mesh mesh, int flags) {
    setup s = {mesh, {0}, NULL, NULL};
    s.shape.flags = flags;
    s.shape.normal_base = s.shape.uv_base = NO_BASE;
    return s;
}

static void test_triangle(void **state) {
    (void)state;
    NEEDS_DEVICE();
    float p[9] = {0, 0, 0, 2, 0, 0, 0, 3, 0}, o[3] = {0.5f, 0.6f, 5};
    float normals[9] = {0.3f, 0, 0.954f, 0, 0.3f, 0.954f, 0, 0, 1}, uvs[6] = {0, 0, 0, 1, 1, 0.2f};
    for (int i = 0; i < 8; i++) {
        setup s = make_setup(test_mesh_soup(1, 1, 1, 1), i & 1 ? SHAPE_FLIP_NORMALS : 0);
        float sign = i & 1 ? -1 : 1;
        float e[14] = {0.5f, 0.6f, 0, 0, 0, sign, 0, 0, sign, 1, 0, 0, 0.25f, 0.2f};
        memcpy(s.mesh.positions, p, sizeof p);
        if (i & 2) {
            s.uvs = uvs;
            s.shape.uv_base = 0;
            e[9] = -0.132164f, e[10] = 0.991228f, e[12] = 0.2f, e[13] = 0.29f;
        }
        if (i & 4) {
            float t[2][3] = {{0.985727f, -0.013069f, -0.167841f}, {-0.141391f, 0.988547f, -0.0527529f}};
            s.normals = normals;
            s.shape.normal_base = 0;
            e[6] = sign * 0.168349f, e[7] = sign * 0.0765225f, e[8] = sign * 0.982753f;
            memcpy(e + 9, t[i & 2 ? 1 : 0], sizeof t[0]);
        }
        check_one(&s, o, e);
        test_mesh_free(&s.mesh);
    }
}

static void set_axes(b_quadric *q, float x, float y, int kind) {
    memset(q, 0, sizeof *q);
    q->kind = kind;
    q->du[0] = x, q->dv[1] = y, q->n[2] = 1;
}

static void test_sphere_and_disk(void **state) {
    (void)state;
    NEEDS_DEVICE();
    for (int flip = 0; flip < 2; flip++) {
        float sign = flip ? -1 : 1;
        setup s = make_setup(test_mesh_quadrics(1, 1), flip ? SHAPE_FLIP_NORMALS : 0);
        b_quadric *q = &s.mesh.quadrics[0];
        set_axes(q, 1, 1, QUADRIC_SPHERE);
        q->center[0] = 1, q->center[1] = 2, q->center[2] = 3, q->radius = 2;
        float o[3] = {1.5f, 1.3f, 9}, n[3] = {sign * 0.25f, sign * -0.35f, sign * 0.902773f};
        float e[14] = {1.5f,      1.3f,      4.80555f, n[0],      n[1], n[2], n[0], n[1], n[2],
                       0.813734f, 0.581238f, 0,        0.848716f, 0.141527f};
        check_one(&s, o, e);
        set_axes(q, -2, 1, QUADRIC_DISK);
        float o2[3] = {0.5f, -0.3f, 9};
        float e2[14] = {0.5f, -0.3f, 0, 0, 0, sign, 0, 0, sign, 0.857493f, -0.514496f, 0, 0.390512f, 0.639429f};
        check_one(&s, o2, e2);
        test_mesh_free(&s.mesh);
    }
}

/* A ray that leaves a convex or flat surface on the side of its normal never meets it again, wherever the scene lies
 * and however large it is; one that goes through does not meet the flat one, and the sphere's far side. Returns how
 * many do otherwise, of about 8192. */
static uint32_t count_wrong(setup *s, const float aim[3], float reach, brume_precision precision, int convex) {
    enum { N = 4096 };
    float *rays = malloc(9 * N * sizeof *rays), *out = malloc(VALUES * N * sizeof *out);
    uint64_t seed = 3;
    uint32_t wrong = 0;
    assert_true(rays && out);
    for (int i = 0; i < N; i++) {
        float next[3] = {0};
        for (int a = 0; a < 3; a++) {
            float target = aim[a] + reach * (float)(test_uniform(&seed) - 0.5), o = aim[a] + 3 * reach * (a == 2);
            rays[N * a + i] = o;
            rays[N * (3 + a) + i] = target - o;
            next[a] = (float)(2 * test_uniform(&seed) - 1);
        }
        for (int a = 0; a < 3; a++) rays[N * (6 + a) + i] = next[a];
    }
    look(s, 8, precision, rays, N, out);
    for (int pass = 0; pass < 2; pass++) { /* the second at grazing angles, now that the normals are known */
        uint32_t hits = 0;
        for (int i = 0; i < N; i++) {
            if (out[FIRST * N + i] < 0) continue;
            double along = 0;
            hits++;
            for (int a = 0; a < 3; a++) along += rays[N * (6 + a) + i] * (double)out[N * (3 + a) + i];
            wrong += (!convex || along > 1e-4) && out[AGAIN * N + i] != -1;
            wrong += convex && along < -1e-4 && out[AGAIN * N + i] != 0;
        }
        assert_true(hits > N / 2);
        for (int i = 0; i < N; i++) {
            double along = 0, keep = i % 2 ? 0.99 : 0.999;
            for (int a = 0; a < 3; a++) along += rays[N * (6 + a) + i] * (double)out[N * (3 + a) + i];
            for (int a = 0; a < 3; a++) rays[N * (6 + a) + i] -= (float)(keep * along * out[N * (3 + a) + i]);
        }
        look(s, 8, precision, rays, N, out);
    }
    free(rays);
    free(out);
    return wrong;
}

/* Triangles, spheres and disks at seven scales and places. */
static uint32_t count_wrong_everywhere(void) {
    uint32_t wrong = 0;
    const float scales[] = {1, 1e-6f, 1e6f, 1, 1, 1000, 1e-6f}, shifts[] = {0, 0, 0, 1e5f, -3000, 7, 1};
    for (int i = 0; i < 7; i++)
        for (int precision = 0; precision < 2; precision++) {
            float k = scales[i], shift[3] = {shifts[i], shifts[i] / 3, -shifts[i]};
            float corners[9] = {-1000, -900, 100, 1000, -800, -120, 0, 1700, 20};
            setup s = make_setup(test_mesh_soup(1, 1, 1, 1), 0);
            /* Large: ten and a thousand times as far as the points looked at. */
            for (int j = 0; j < 9; j++) s.mesh.positions[j] = k * corners[j] + shift[j % 3];
            float aim[3] = {shift[0], shift[1], shift[2]};
            wrong += count_wrong(&s, aim, k * 100, (brume_precision)precision, 0);
            wrong += count_wrong(&s, aim, k, (brume_precision)precision, 0);
            test_mesh_free(&s.mesh);

            s = make_setup(test_mesh_quadrics(1, 1), 0);
            b_quadric *q = &s.mesh.quadrics[0];
            set_axes(q, 1, 1, QUADRIC_SPHERE);
            for (int a = 0; a < 3; a++) q->center[a] = shift[a];
            q->radius = k;
            if (k > 1e-3f || shifts[i] == 0) wrong += count_wrong(&s, aim, k, (brume_precision)precision, 1);
            float du[3] = {300, 100, 50}, dv[3] = {-100, 300, 0};
            set_axes(q, 1, 1, QUADRIC_DISK);
            for (int a = 0; a < 3; a++) q->center[a] = shift[a], q->du[a] = k * du[a], q->dv[a] = k * dv[a];
            double n[3] = {-15000, -5000, 100000}, size = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
            for (int a = 0; a < 3; a++) q->n[a] = (float)(n[a] / size);
            wrong += count_wrong(&s, aim, k * 10, (brume_precision)precision, 0);
            test_mesh_free(&s.mesh);
        }
    return wrong;
}

static void test_leaving(void **state) {
    (void)state;
    NEEDS_DEVICE();
    fixed_offset = 1;
    uint32_t naive = count_wrong_everywhere();
    fixed_offset = 0;
    stability_row("hazard", "rays that leave a surface, scales 1e-6 to 1e6", "none meets it again",
                  "of about 440 000 rays", 0, count_wrong_everywhere(), "naive %u", naive);
    assert_true(naive > 1000);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_triangle),
        cmocka_unit_test(test_sphere_and_disk),
        cmocka_unit_test(test_leaving),
    };
    return cmocka_run_group_tests(tests, open_device, close_device);
}

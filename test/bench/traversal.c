/* traversal -- rays a second through our hierarchy and through Embree's: `make bench-traversal`.
 *
 *     traversal FILE.json [ROUNDS [OPTIONS]]      OPTIONS: more of them for the kernels, as -DBVH_PACKET=0
 *
 * The same triangles and the same rays, on one core, in turns: camera rays in squares of 4 x 4 pixels, cosine
 * distributed rays from what they hit, and shadow rays from there to a panel. Embree takes rays singly (rtcIntersect1,
 * rtcOccluded1) and in packets of 16, in scenes that are ROBUST and such that are not, each with AVX2 and AVX-512, of
 * which the better counts; ours are watertight always. Times are the processor's, medians over the rounds. Every ray's
 * answer is compared: more than one in 10000 that differ make it fail.
 */
#include <embree3/rtcore.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "bvh.h"
#include "device.h"
#include "program.h"
#include "traversal_meshes.h"

enum { SIDE = 512, RAYS = SIDE * SIDE, MOST_ROUNDS = 31, LANES = 16, KINDS = 3, EMBREES = 8 };

static const char *const kinds[KINDS] = {"primary", "bounce", "shadow"};

/* Arrays hold x of all rays, then y, then z. */
typedef struct ray_set {
    float *o, *d, *tmax;
    float *t;   /* where our closest hit is; tmax for none, and for shadow rays 0 where something is in the way */
    int *prim;
} ray_set;

typedef struct timing {
    double seconds[MOST_ROUNDS];
} timing;

static void die(const char *what) {
    fprintf(stderr, "traversal: %s\n", what);
    exit(1);
}

static void *need(void *p) {
    if (!p) die("out of memory");
    return p;
}

static double cpu_now(void) { return (double)clock() / CLOCKS_PER_SEC; }

static int ascending(const void *a, const void *b) {
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double median(const timing *t, int rounds) {
    double sorted[MOST_ROUNDS];
    memcpy(sorted, t->seconds, (size_t)rounds * sizeof *sorted);
    qsort(sorted, (size_t)rounds, sizeof *sorted, ascending);
    return sorted[rounds / 2];
}

/* ---- ours ------------------------------------------------------------------------------------------------------ */

static const char kernels[] =
    "#include \"traverse.h\"\n"
    "#define HEAD(name) \\\n"
    "    __kernel __attribute__((reqd_work_group_size(1, 1, 1))) __attribute__((vec_type_hint(real))) \\\n"
    "    void name(__global const b_node *nodes, __global const b_triangle_block *blocks, int triangles, int n, \\\n"
    "              __global const float *o, __global const float *d, __global const float *tmax, \\\n"
    "              __global float *t, __global int *prim)\n"
    "#define TAKE \\\n"
    "    int at = get_global_id(0) * LANES; \\\n"
    "    geometry g = {nodes, blocks, 0, 0, triangles}; \\\n"
    "    vec from = vmake(load_lanes(o + at), load_lanes(o + n + at), load_lanes(o + 2 * n + at)); \\\n"
    "    vec to = vmake(load_lanes(d + at), load_lanes(d + n + at), load_lanes(d + 2 * n + at)); \\\n"
    "    real high = load_lanes(tmax + at);\n"
    "HEAD(bench_closest) {\n"
    "    TAKE\n"
    "    hit h = closest(&g, from, to, R(1e-4f), high, TRUE_MASK);\n"
    "    store_lanes(h.t, t + at);\n"
    "    LANE_PASTE(vstore, LANES)(h.prim, 0, prim + at);\n"
    "}\n"
    "HEAD(bench_occluded) {\n"
    "    TAKE\n"
    "    store_lanes(occluded(&g, from, to, R(1e-4f), high, TRUE_MASK) ? R(0) : high, t + at);\n"
    "}\n";

typedef struct ours {
    brume_context *context;
    brume_device *device;
    cl_kernel kernel[2]; /* closest, occluded */
    cl_mem nodes, blocks;
    brume_bvh bvh;
} ours;

static void must(ours *b, brume_result result) {
    if (result != BRUME_OK) die(brume_context_message(b->context));
}

static cl_mem buffer(ours *b, void *data, size_t size) {
    cl_int code;
    cl_mem m = clCreateBuffer(b->device->cl, CL_MEM_READ_WRITE | CL_MEM_USE_HOST_PTR, size, data, &code);
    if (code != CL_SUCCESS) die(brume_cl_error_name(code));
    return m;
}

static double ours_build(ours *b, const traversal_mesh *m, const char *more) {
    char options[256];
    cl_program program;
    double start = cpu_now();
    must(b, brume_bvh_build(b->context, m->positions, m->triangles, m->triangle_count, NULL, 0, &b->bvh));
    double seconds = cpu_now() - start;
    snprintf(options, sizeof options, "-DFEATURES=0 -DBVH_STACK=%u %s", b->bvh.stack_size, more);
    must(b, brume_program_build_text(b->device, kernels, LANES, BRUME_PRECISION_FLOAT, options, &program));
    for (int k = 0; k < 2; k++) {
        cl_int code;
        b->kernel[k] = clCreateKernel(program, k ? "bench_occluded" : "bench_closest", &code);
        if (code != CL_SUCCESS) die(brume_cl_error_name(code));
    }
    clReleaseProgram(program);
    b->nodes = buffer(b, b->bvh.nodes, b->bvh.node_count * sizeof *b->bvh.nodes);
    b->blocks = buffer(b, b->bvh.blocks, b->bvh.block_count * sizeof *b->bvh.blocks);
    return seconds;
}

static void ours_free(ours *b) {
    for (int k = 0; k < 2; k++) clReleaseKernel(b->kernel[k]);
    clReleaseMemObject(b->nodes);
    clReleaseMemObject(b->blocks);
    brume_bvh_free(&b->bvh);
}

static double ours_trace(ours *b, const traversal_mesh *m, ray_set *r, int shadow) {
    cl_mem rays[5] = {buffer(b, r->o, 3 * RAYS * sizeof *r->o), buffer(b, r->d, 3 * RAYS * sizeof *r->d),
                      buffer(b, r->tmax, RAYS * sizeof *r->tmax), buffer(b, r->t, RAYS * sizeof *r->t),
                      buffer(b, r->prim, RAYS * sizeof *r->prim)};
    cl_kernel kernel = b->kernel[shadow];
    cl_int counts[2] = {(cl_int)m->triangle_count, RAYS};
    clSetKernelArg(kernel, 0, sizeof(cl_mem), &b->nodes);
    clSetKernelArg(kernel, 1, sizeof(cl_mem), &b->blocks);
    for (cl_uint i = 0; i < 2; i++) clSetKernelArg(kernel, 2 + i, sizeof(cl_int), &counts[i]);
    for (cl_uint i = 0; i < 5; i++) clSetKernelArg(kernel, 4 + i, sizeof(cl_mem), &rays[i]);
    size_t global = RAYS / LANES, local = 1;
    double start = cpu_now();
    cl_int code = clEnqueueNDRangeKernel(b->device->queue, kernel, 1, NULL, &global, &local, 0, NULL, NULL);
    if (code == CL_SUCCESS) code = clFinish(b->device->queue);
    double seconds = cpu_now() - start;
    if (code != CL_SUCCESS) die(brume_cl_error_name(code));
    for (int i = 3; i < 5; i++) { /* what it wrote is in our memory only after this */
        cl_command_queue queue = b->device->queue;
        void *p = clEnqueueMapBuffer(queue, rays[i], CL_TRUE, CL_MAP_READ, 0, RAYS * 4, 0, NULL, NULL, &code);
        if (code == CL_SUCCESS) clEnqueueUnmapMemObject(queue, rays[i], p, 0, NULL, NULL);
    }
    clFinish(b->device->queue);
    for (int i = 0; i < 5; i++) clReleaseMemObject(rays[i]);
    return seconds;
}

/* ---- Embree ----------------------------------------------------------------------------------------------------- */

/* Variant bits: 1 AVX-512 instead of AVX2, 2 ROBUST, 4 packets of 16. */
static void embree_name(int variant, char out[32]) {
    snprintf(out, 32, "%s%s%s", variant & 1 ? "avx512" : "avx2", variant & 2 ? " robust" : "",
             variant & 4 ? " packets" : "");
}

static RTCScene embree_build(RTCDevice device, const traversal_mesh *m, int variant, double *seconds) {
    double start = cpu_now();
    RTCScene scene = rtcNewScene(device);
    RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    float *v = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 12, m->vertex_count);
    unsigned *t = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12, m->triangle_count);
    if (!v || !t) die("Embree: out of memory");
    memcpy(v, m->positions, 12 * (size_t)m->vertex_count);
    for (size_t i = 0; i < m->triangle_count; i++)
        for (int k = 0; k < 3; k++) t[3 * i + (size_t)k] = (unsigned)m->triangles[i].v[k];
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene, geometry);
    rtcReleaseGeometry(geometry);
    rtcSetSceneBuildQuality(scene, RTC_BUILD_QUALITY_MEDIUM);
    rtcSetSceneFlags(scene, variant & 2 ? RTC_SCENE_FLAG_ROBUST : RTC_SCENE_FLAG_NONE);
    rtcCommitScene(scene);
    *seconds = cpu_now() - start;
    return scene;
}

static struct RTCRay embree_ray(const ray_set *r, int i) {
    struct RTCRay ray = {0};
    ray.org_x = r->o[i], ray.org_y = r->o[RAYS + i], ray.org_z = r->o[2 * RAYS + i];
    ray.dir_x = r->d[i], ray.dir_y = r->d[RAYS + i], ray.dir_z = r->d[2 * RAYS + i];
    ray.tnear = 1e-4f, ray.tfar = r->tmax[i], ray.mask = ~0u;
    return ray;
}

static void embree_one_by_one(RTCScene scene, const ray_set *r, int shadow, float *out) {
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    for (int i = 0; i < RAYS; i++) {
        struct RTCRayHit h;
        memset(&h.hit, -1, sizeof h.hit);
        h.ray = embree_ray(r, i);
        if (shadow) rtcOccluded1(scene, &context, &h.ray);
        else rtcIntersect1(scene, &context, &h);
        out[i] = shadow && h.ray.tfar < 0 ? 0 : h.ray.tfar;
    }
}

static void embree_packets(RTCScene scene, const ray_set *r, int shadow, float *out) {
    struct RTCIntersectContext context;
    __attribute__((aligned(64))) int valid[16];
    memset(valid, -1, sizeof valid);
    rtcInitIntersectContext(&context);
    for (int i = 0; i < RAYS; i += 16) {
        __attribute__((aligned(64))) struct RTCRayHit16 h;
        memcpy(h.ray.org_x, r->o + i, 64), memcpy(h.ray.org_y, r->o + RAYS + i, 64);
        memcpy(h.ray.org_z, r->o + 2 * RAYS + i, 64), memcpy(h.ray.dir_x, r->d + i, 64);
        memcpy(h.ray.dir_y, r->d + RAYS + i, 64), memcpy(h.ray.dir_z, r->d + 2 * RAYS + i, 64);
        memcpy(h.ray.tfar, r->tmax + i, 64);
        for (int k = 0; k < 16; k++) h.ray.tnear[k] = 1e-4f, h.ray.time[k] = 0, h.ray.flags[k] = 0;
        memset(h.ray.mask, -1, 64), memset(h.hit.geomID, -1, 64), memset(h.hit.instID, -1, sizeof h.hit.instID);
        if (shadow) rtcOccluded16(valid, scene, &context, &h.ray);
        else rtcIntersect16(valid, scene, &context, &h);
        for (int k = 0; k < 16; k++) out[i + k] = shadow && h.ray.tfar[k] < 0 ? 0 : h.ray.tfar[k];
    }
}

/* ---- rays ------------------------------------------------------------------------------------------------------- */

static void camera_rays(const traversal_mesh *m, ray_set *r) {
    for (int i = 0; i < RAYS; i++) {
        int tile = i / 16, x = tile % (SIDE / 4) * 4 + i % 4, y = tile / (SIDE / 4) * 4 + i / 4 % 4;
        double u = 2 * (x + 0.5) / SIDE - 1, v = 1 - 2 * (y + 0.5) / SIDE;
        for (int a = 0; a < 3; a++) {
            r->o[a * RAYS + i] = m->eye[a];
            r->d[a * RAYS + i] = (float)(m->forward[a] + 0.7 * u * m->right[a] + 0.7 * v * m->up[a]);
        }
        r->tmax[i] = INFINITY;
    }
}

/* From the hits of `from` into cosine distributed directions, or to the panel. A miss takes the hit before it. */
static void rays_from_hits(const traversal_mesh *m, const ray_set *from, int shadow, ray_set *r) {
    uint64_t seed = 5;
    int last = 0;
    while (last < RAYS && from->prim[last] < 0) last++;
    if (last == RAYS) die("no camera ray hits anything");
    for (int i = 0; i < RAYS; i++) {
        if (from->prim[i] >= 0) last = i;
        double n[3], facing = 0, p[3], d[3];
        traversal_normal(m, from->prim[last], n);
        for (int a = 0; a < 3; a++) facing += n[a] * from->d[a * RAYS + last];
        for (int a = 0; a < 3; a++) {
            if (facing > 0) n[a] = -n[a];
            p[a] = from->o[a * RAYS + last] + (double)from->t[last] * from->d[a * RAYS + last] + 1e-4 * n[a];
        }
        double z = 2 * traversal_uniform(&seed) - 1, phi = 2 * 3.14159265358979 * traversal_uniform(&seed);
        double s = sqrt(1 - z * z), ball[3] = {s * cos(phi), s * sin(phi), z};
        for (int a = 0; a < 3; a++)
            d[a] = shadow ? m->panel[a] + (a == 1 ? 0 : 2 * traversal_uniform(&seed) - 1) - p[a] : n[a] + ball[a];
        for (int a = 0; a < 3; a++) r->o[a * RAYS + i] = (float)p[a], r->d[a * RAYS + i] = (float)d[a];
        r->tmax[i] = shadow ? 1 - 1e-4f : INFINITY;
    }
}

static ray_set new_rays(void) {
    ray_set r = {need(calloc(3 * RAYS, 4)), need(calloc(3 * RAYS, 4)), need(calloc(RAYS, 4)), need(calloc(RAYS, 4)),
                 need(calloc(RAYS, 4))};
    return r;
}

/* How many rays got another answer. A shadow ray's is 0 or tmax. */
static int differences(const float *a, const float *b, int shadow) {
    int count = 0;
    for (int i = 0; i < RAYS; i++)
        if (isinf(a[i]) || isinf(b[i]) || shadow) count += a[i] != b[i];
        else count += fabsf(a[i] - b[i]) > 1e-4f * (1 + fabsf(a[i]));
    return count;
}

/* ---- the comparison --------------------------------------------------------------------------------------------- */

static void report(const traversal_mesh *m, int kind, const timing *own, const timing *others, int rounds, int worst,
                   FILE *json) {
    double best[4] = {INFINITY, INFINITY, INFINITY, INFINITY}, mine = median(own, rounds);
    fprintf(json, "%s\n  {\"mesh\": \"%s\", \"rays\": \"%s\", \"different_answers\": %d, \"mrays\": {\"brume\": %.4g",
            ftell(json) > 4 ? "," : "", m->name, kinds[kind], worst, 1e-6 * RAYS / mine);
    for (int v = 0; v < EMBREES; v++) {
        char name[32];
        double seconds = median(&others[v], rounds);
        embree_name(v, name);
        fprintf(json, ", \"embree %s\": %.4g", name, 1e-6 * RAYS / seconds);
        best[v >> 1] = fmin(best[v >> 1], seconds);
    }
    fprintf(json, "}}");
    printf("| %s, %s | %.2f |", m->name, kinds[kind], 1e-6 * RAYS / mine);
    for (int k = 0; k < 4; k++) printf(" %.2f | %.2f |", 1e-6 * RAYS / best[k], best[k] / mine);
    printf(" %d |\n", worst);
    fflush(stdout);
}

static int compare(ours *b, RTCDevice devices[2], const traversal_mesh *m, int rounds, const char *more,
                   FILE *json) {
    RTCScene scenes[4];
    double build[5];
    int most = 0;
    static timing own, others[EMBREES];
    float *answers = need(malloc(RAYS * sizeof *answers));
    ray_set sets[KINDS];
    build[4] = ours_build(b, m, more);
    for (int v = 0; v < 4; v++) scenes[v] = embree_build(devices[v & 1], m, v, &build[v]);
    for (int kind = 0; kind < KINDS; kind++) {
        int shadow = kind == 2, worst = 0;
        ray_set *r = &sets[kind];
        *r = new_rays();
        if (kind == 0) camera_rays(m, r);
        else rays_from_hits(m, &sets[0], shadow, r);
        ours_trace(b, m, r, shadow); /* generates the code */
        for (int round = 0; round < rounds; round++) {
            own.seconds[round] = ours_trace(b, m, r, shadow);
            for (int v = 0; v < EMBREES; v++) {
                double start = cpu_now();
                (v & 4 ? embree_packets : embree_one_by_one)(scenes[v & 3], r, shadow, answers);
                others[v].seconds[round] = cpu_now() - start;
                int count = differences(r->t, answers, shadow);
                worst = count > worst ? count : worst;
            }
        }
        report(m, kind, &own, others, rounds, worst, json);
        most = worst > most ? worst : most;
    }
    fprintf(stderr, "%s: %u triangles; built in %.2f s of one core, by Embree (MEDIUM) in %.2f s\n", m->name,
            m->triangle_count, build[4], fmin(build[0], build[1]));
    fprintf(json, ",\n  {\"mesh\": \"%s\", \"triangles\": %u, \"build_seconds\": {\"brume\": %.4g, \"embree\": %.4g}}",
            m->name, m->triangle_count, build[4], fmin(build[0], build[1]));
    for (int v = 0; v < 4; v++) rtcReleaseScene(scenes[v]);
    for (int kind = 0; kind < KINDS; kind++) {
        free(sets[kind].o), free(sets[kind].d), free(sets[kind].tmax), free(sets[kind].t), free(sets[kind].prim);
    }
    free(answers);
    ours_free(b);
    return most;
}

int main(int argc, char **argv) {
    int rounds = argc > 2 ? atoi(argv[2]) : 5, worst = 0;
    if (argc < 2 || rounds < 1 || rounds > MOST_ROUNDS) die("usage: traversal FILE.json [ROUNDS [OPTIONS]]");
    FILE *json = need(fopen(argv[1], "w"));
    ours b = {0};
    if (brume_context_create(&b.context) || brume_device_open(b.context, BRUME_DEVICE_ANY, &b.device))
        die(b.context ? brume_context_message(b.context) : "out of memory");
    RTCDevice devices[2] = {rtcNewDevice("threads=1,isa=avx2"), rtcNewDevice("threads=1,isa=avx512")};
    fputs("[", json);
    puts("| million rays a second | brume | Embree | ÷ | ROBUST | ÷ | packets | ÷ | ROBUST packets | ÷ | differ |\n"
         "|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|");
    for (int k = 0; k < 2; k++) {
        traversal_mesh m = k ? traversal_terrain(1000) : traversal_room(98);
        if (!m.positions) die("out of memory");
        int count = compare(&b, devices, &m, rounds, argc > 3 ? argv[3] : "", json);
        worst = count > worst ? count : worst;
        traversal_mesh_free(&m);
    }
    fputs("\n]\n", json);
    fclose(json);
    for (int k = 0; k < 2; k++) rtcReleaseDevice(devices[k]);
    brume_device_destroy(b.device);
    brume_context_destroy(b.context);
    if (worst > RAYS / 10000) die("too many rays got different answers");
    return 0;
}

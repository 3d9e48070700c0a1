/* hierarchy -- how fast and in how much memory our hierarchy is built, and Embree's: `make bench-build`.
 *
 *     hierarchy FILE.json [MOST [ROUNDS]]      MOST: meshes of up to so many million triangles (10)
 *
 * Both read the same arrays in place. Each build is a process of its own, which tells the time of all its threads'
 * processors, the time on the wall, and by how much its peak of resident memory has grown: the least of ROUNDS (3; of a
 * mesh beyond two million triangles, 1). Embree builds for MEDIUM quality, with AVX2 and with AVX-512, of which the
 * faster counts. The expected cost is that of the surface area heuristic, in nodes and blocks of 8 triangles a ray.
 */
#include <embree3/rtcore.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include "bvh.h"
#include "platform.h"
#include "traversal_meshes.h"

typedef struct measure {
    double cpu, wall, bytes, cost;
} measure;

static void die(const char *what) {
    fprintf(stderr, "hierarchy: %s\n", what);
    exit(1);
}

static double peak_bytes(void) {
    struct rusage usage;
    getrusage(RUSAGE_SELF, &usage);
    return 1024.0 * (double)usage.ru_maxrss;
}

static measure now(void) {
    measure m = {(double)clock() / CLOCKS_PER_SEC, brume_seconds(), peak_bytes(), 0};
    return m;
}

static measure since(const measure *start) {
    measure end = now();
    end.cpu -= start->cpu, end.wall -= start->wall, end.bytes -= start->bytes;
    return end;
}

static double slot_area(const b_node *n, int k) {
    double x = (double)n->hi_x[k] - n->lo_x[k], y = (double)n->hi_y[k] - n->lo_y[k];
    double z = (double)n->hi_z[k] - n->lo_z[k];
    return x * y + y * z + z * x;
}

static double expected_cost(const brume_bvh *bvh) {
    b_node all = bvh->nodes[0];
    double sum = 0;
    for (int k = 1; k < 8; k++) {
        all.lo_x[0] = fminf(all.lo_x[0], all.lo_x[k]), all.hi_x[0] = fmaxf(all.hi_x[0], all.hi_x[k]);
        all.lo_y[0] = fminf(all.lo_y[0], all.lo_y[k]), all.hi_y[0] = fmaxf(all.hi_y[0], all.hi_y[k]);
        all.lo_z[0] = fminf(all.lo_z[0], all.lo_z[k]), all.hi_z[0] = fmaxf(all.hi_z[0], all.hi_z[k]);
    }
    for (uint32_t n = 0; n < bvh->node_count; n++)
        for (int k = 0; k < 8; k++) {
            const b_node *node = &bvh->nodes[n];
            if (node->lo_x[k] > node->hi_x[k]) continue;
            sum += slot_area(node, k) * (node->child[k] < 0 ? (~node->child[k] & 7) + 1 : 1);
        }
    return 1 + sum / slot_area(&all, 0);
}

static measure build_ours(const traversal_mesh *m, unsigned threads, const char *isa) {
    brume_bvh bvh;
    (void)isa;
    measure start = now();
    if (brume_bvh_build_threaded(NULL, threads, m->positions, m->triangles, m->triangle_count, NULL, 0, &bvh))
        die("out of memory");
    measure end = since(&start);
    end.cost = expected_cost(&bvh);
    return end;
}

/* As long as Embree is told, a scene of one triangle makes it start its threads. */
static RTCScene embree_scene(RTCDevice device, const traversal_mesh *m, size_t triangles) {
    RTCScene scene = rtcNewScene(device);
    RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, m->positions, 0, 12,
                               m->vertex_count);
    rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, m->triangles, 0,
                               sizeof *m->triangles, triangles);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene, geometry);
    rtcReleaseGeometry(geometry);
    rtcSetSceneBuildQuality(scene, RTC_BUILD_QUALITY_MEDIUM);
    rtcCommitScene(scene);
    return scene;
}

static measure build_embree(const traversal_mesh *m, unsigned threads, const char *isa) {
    char config[64];
    snprintf(config, sizeof config, "threads=%u,isa=%s", threads, isa);
    RTCDevice device = rtcNewDevice(config);
    rtcReleaseScene(embree_scene(device, m, 1));
    measure start = now();
    embree_scene(device, m, m->triangle_count);
    measure end = since(&start);
    if (rtcGetDeviceError(device) != RTC_ERROR_NONE) die("Embree does not build it");
    return end;
}

typedef measure (*builder)(const traversal_mesh *, unsigned threads, const char *isa);

static measure in_child(builder build, const traversal_mesh *m, unsigned threads, const char *isa) {
    int ends[2], status;
    measure got = {0};
    if (pipe(ends)) die("no pipe");
    fflush(NULL);
    pid_t child = fork();
    if (child < 0) die("no process");
    if (child == 0) {
        got = build(m, threads, isa);
        _exit(write(ends[1], &got, sizeof got) != (ssize_t)sizeof got);
    }
    close(ends[1]);
    int whole = read(ends[0], &got, sizeof got) == (ssize_t)sizeof got;
    close(ends[0]);
    if (waitpid(child, &status, 0) != child || status || !whole) die("a build failed");
    return got;
}

static measure least(const measure *a, const measure *b) {
    measure m = {fmin(a->cpu, b->cpu), fmin(a->wall, b->wall), fmin(a->bytes, b->bytes), b->cost};
    return m;
}

static void compare(const traversal_mesh *m, unsigned threads, int rounds, FILE *json) {
    measure ours = {INFINITY, INFINITY, INFINITY, 0}, theirs = ours;
    double per = 1.0 / m->triangle_count;
    for (int round = 0; round < rounds; round++) {
        measure a = in_child(build_ours, m, threads, "");
        ours = least(&ours, &a);
        for (int wide = 0; wide < 2; wide++) {
            measure b = in_child(build_embree, m, threads, wide ? "avx512" : "avx2");
            theirs = least(&theirs, &b);
        }
    }
    printf("| %s | %u | %u | %.0f | %.0f | %.2f | %.0f | %.0f | %.2f | %.0f | %.0f | %.2f | %.2f |\n", m->name,
           m->triangle_count, threads, 1e9 * ours.cpu * per, 1e9 * theirs.cpu * per, ours.cpu / theirs.cpu,
           1e9 * ours.wall * per, 1e9 * theirs.wall * per, ours.wall / theirs.wall, ours.bytes * per,
           theirs.bytes * per, ours.bytes / theirs.bytes, ours.cost);
    fflush(stdout);
    fprintf(json, "%s\n  {\"mesh\": \"%s\", \"triangles\": %u, \"threads\": %u, \"expected_cost\": %.6g",
            ftell(json) > 4 ? "," : "", m->name, m->triangle_count, threads, ours.cost);
    fprintf(json, ", \"brume\": {\"cpu_s\": %.4g, \"wall_s\": %.4g, \"peak_bytes\": %.0f}", ours.cpu, ours.wall,
            ours.bytes);
    fprintf(json, ", \"embree\": {\"cpu_s\": %.4g, \"wall_s\": %.4g, \"peak_bytes\": %.0f}}", theirs.cpu,
            theirs.wall, theirs.bytes);
}

int main(int argc, char **argv) {
    double most = argc > 2 ? atof(argv[2]) : 10;
    int rounds = argc > 3 ? atoi(argv[3]) : 3;
    if (argc < 2 || most <= 0 || rounds < 1) die("usage: hierarchy FILE.json [MOST [ROUNDS]]");
    FILE *json = fopen(argv[1], "w");
    if (!json) die("cannot write the file");
    fputs("[", json);
    puts("| | triangles | threads | ns a triangle of processors | Embree | ÷ | on the wall | Embree | ÷ "
         "| peak bytes a triangle | Embree | ÷ | expected cost |\n"
         "|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|");
    for (int k = 0; k < 5; k++) {
        static const uint32_t cells[5] = {0, 224, 0, 707, 2236}, parts[5] = {100, 0, 1000, 0, 0};
        static const double millions[5] = {0.1, 0.1, 1, 1, 10};
        if (millions[k] > most) continue;
        traversal_mesh m = parts[k] ? traversal_room(parts[k]) : traversal_terrain(cells[k]);
        if (!m.positions) die("out of memory");
        for (unsigned threads = 1; threads <= 2; threads++) compare(&m, threads, millions[k] > 2 ? 1 : rounds, json);
        traversal_mesh_free(&m);
    }
    fputs("\n]\n", json);
    return fclose(json) != 0;
}

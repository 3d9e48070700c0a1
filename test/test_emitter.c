/* test_emitter.c -- sampling of emitting surfaces and the environment (cl/emitter.h, cl/environment.h) from points near
 * and far, inside and outside.
 *
 * For each case: the sampled directions by chi-square against the density over all directions, computed in double from
 * the shapes themselves; the irradiance that the samples estimate against closed forms, by t-test; and what a ray in
 * the sampled direction meets: the surface that was sampled, with the same density, and nothing before it. The
 * statistical tests are one family at CONFIDENCE (stats.h), counted by TESTS.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "arrays.h"
#include "device_test.h"
#include "stats.h"

#define PI 3.14159265358979323846

enum { COUNT = 1 << 16, MAX_PIECES = 6, MAP_WIDTH = 16, MAP_HEIGHT = 9 };
enum { WX, WY, WZ, DISTANCE, RADIANCE, PDF, MET, MET_PDF, COSINE, BLOCKED, ENVIRONMENT_PDF, ENVIRONMENT_R, PLANES };
enum { NO_SKY, CONSTANT_SKY, MAP_SKY };

/* Surfaces that emit `red`: triangles by their corners, spheres and disks (facing +z) by centre and radius. */
typedef struct {
    int kind; /* EMITTER_... */
    double a[3], b[3], c[3], radius, red;
    int flipped;
} piece;

typedef struct {
    const char *name;
    piece pieces[MAX_PIECES];
    int sky;
    double p[3], n[3];  /* where light arrives, and on what orientation */
    double irradiance;  /* in units of pi; < 0: polygons, by Lambert's formula */
} emitter_case;

#define TRIANGLE(ax, ay, az, bx, by, bz, cx, cy, cz, red) \
    {EMITTER_TRIANGLE, {ax, ay, az}, {bx, by, bz}, {cx, cy, cz}, 0, red, 0}
#define SPHERE(x, y, z, r, red, flipped) {EMITTER_SPHERE, {x, y, z}, {0}, {0}, r, red, flipped}
#define DISK(x, y, z, r, red) {EMITTER_DISK, {x, y, z}, {0}, {0}, r, red, 0}

/* Disks are seen along their axis. The edge of the sphere before the sky, at cos = 5/6, lies between two rows of the
 * histogram. */
static const emitter_case cases[] = {
    {"triangle", {TRIANGLE(-1, 0, 2, 0, 1.5, 2.2, 1, -1, 1.5, 3)}, NO_SKY, {0.1, 0.2, 0}, {0, 0, 1}, -1},
    {"triangle, near", {TRIANGLE(-1, 0, 2, 0, 1.5, 2, 1, -1, 2, 3)}, NO_SKY, {0.1, 0.2, 1.6}, {0, 0, 1}, -1},
    {"triangle, far", {TRIANGLE(-30, 0, 2e3, 0, 40, 2e3, 25, -20, 2e3, 3)}, NO_SKY, {0, 0, 0}, {0, 0, 1}, -1},
    {"two triangles", {TRIANGLE(-1, -1, 1, -1, 1, 1, 1, 1, 1, 2), TRIANGLE(-1, -1, 1, 1, 1, 1, 1, -1, 1, 2)}, NO_SKY,
     {0.5, -0.5, 0}, {0, 0, 1}, -1},
    {"disk", {DISK(0, 0, -1, 2, 5)}, NO_SKY, {0, 0, 1}, {0, 0, -1}, 5 * 4 / 8.0},
    {"disk, near", {DISK(0, 0, 0, 3, 5)}, NO_SKY, {0, 0, 0.5}, {0, 0, -1}, 5 * 9 / 9.25},
    {"disk, from behind", {DISK(0, 0, 1, 2, 5)}, NO_SKY, {0, 0, 0}, {0, 0, 1}, 0},
    {"sphere", {SPHERE(1, 2, 2, 1, 7, 0)}, NO_SKY, {0, 0, 0}, {1. / 3, 2. / 3, 2. / 3}, 7 / 9.0},
    {"sphere, near", {SPHERE(0, 0, 1.01, 1, 7, 0)}, NO_SKY, {0, 0, 0}, {0, 0, 1}, 7 / 1.0201},
    {"sphere, far", {SPHERE(600, 0, 800, 1, 7, 0)}, NO_SKY, {0, 0, 0}, {0.6, 0, 0.8}, 7e-6},
    {"sphere, from inside", {SPHERE(0.2, 0.3, -0.4, 1, 7, 1)}, NO_SKY, {0, 0, 0}, {0, 0, 1}, 7},
    {"constant sky", {{0}}, CONSTANT_SKY, {0, 0, 0}, {0.6, 0, 0.8}, 0.5},
    {"map", {{0}}, MAP_SKY, {0, 0, 0}, {0, 0.6, 0.8}, -2},
    {"all", {SPHERE(3, 0, 1, 1, 2, 0), DISK(0, 0, -2, 1, 3), TRIANGLE(-3, -1, 0, -3, 1, 0, -3, 0, 2, 1)}, MAP_SKY,
     {0, 0, 0}, {0, 0, 1}, -3},
    {"sphere and sky", {SPHERE(0, 0, 2, 1.1055415967851333, 2, 0)}, CONSTANT_SKY, {0, 0, 0}, {0, 0, 1},
     0.5 + 2 * 11 / 36.0},
};
enum { CASES = sizeof cases / sizeof cases[0], TESTS = 3 * CASES };

static brume_context *context;
static brume_arrays arrays;
static float map[MAP_HEIGHT][MAP_WIDTH][3];
static double u[3][COUNT], out[PLANES][COUNT];

static const char text[] =
    "#include \"emitter.h\"\n"
    "__kernel void test(SCENE_PARAMETERS, __global const real1 *p, __global const real1 *u, __global real1 *out) {\n"
    "    SCENE_FROM_PARAMETERS(s);\n"
    "    uint n = get_global_size(0) * LANES;\n"
    "    u += AT, out += AT;\n"
    "    vec from = vmake(R(p[0]), R(p[1]), R(p[2]));\n"
    "    emitted_light e = emitter_sample(&s, from, LOAD(u), LOAD(u + n), LOAD(u + 2 * n), TRUE_MASK);\n"
    "    STORE(out, e.wi.x); STORE(out + n, e.wi.y); STORE(out + 2 * n, e.wi.z);\n"
    "    STORE(out + 3 * n, e.distance); STORE(out + 4 * n, e.radiance.r); STORE(out + 5 * n, e.pdf);\n"
    "    hit h = closest(&s.geometry, from, e.wi, R(0), R(INFINITY), TRUE_MASK);\n"
    "    mask met = h.prim >= I(0);\n"
    "    STORE(out + 6 * n, met ? R(1) : R(0));\n"
    "    surface at = surface_of(&s, from, e.wi, h, met);\n"
    "    real pdf = R(0), sky = R(0);\n"
    "    rgb radiance = cgrey(R(0));\n"
    "    if (ANY(met)) pdf = emitter_pdf(&s, from, met ? h.prim : I(0), at.shape, at.p, at.ng, met);\n"
    "    STORE(out + 7 * n, pdf);\n"
    "    STORE(out + 8 * n, vdot(at.ng, e.wi));\n"
    "    mask dark = occluded(&s.geometry, from, e.wi, R(0), e.distance, TRUE_MASK);\n"
    "    STORE(out + 9 * n, dark ? R(1) : R(0));\n"
    "    if (params->environment != ENVIRONMENT_NONE) {\n"
    "        sky = environment_pdf(&s, e.wi) * environment_share(&s);\n"
    "        radiance = environment_radiance(&s, e.wi);\n"
    "    }\n"
    "    STORE(out + 10 * n, sky); STORE(out + 11 * n, radiance.r);\n"
    "}\n";

/* ---- scenes ------------------------------------------------------------------------------------------------------ */

static void must(brume_result result) {
    if (result != BRUME_OK) fail_msg("%s", brume_context_message(context));
}

static void add_piece(brume_scene *scene, const piece *x) {
    static const brume_shape_kind kinds[] = {BRUME_SHAPE_MESH, BRUME_SHAPE_SPHERE, BRUME_SHAPE_DISK};
    static const uint32_t corners[3] = {0, 1, 2};
    brume_shape_desc desc = brume_shape_desc_default(kinds[x->kind]);
    float positions[9];
    for (int i = 0; i < 3; i++) {
        positions[i] = (float)x->a[i], positions[3 + i] = (float)x->b[i], positions[6 + i] = (float)x->c[i];
        desc.to_world[5 * i] = x->kind == EMITTER_DISK ? (float)x->radius : 1;
        desc.to_world[4 * i + 3] = x->kind == EMITTER_DISK ? (float)x->a[i] : 0;
        if (x->kind == EMITTER_SPHERE) desc.center[i] = (float)x->a[i];
        desc.radiance[i] = (float)x->red;
    }
    if (x->kind == EMITTER_SPHERE) desc.radius = (float)x->radius;
    if (x->kind == EMITTER_TRIANGLE) {
        desc.vertex_count = 3, desc.positions = positions;
        desc.triangle_count = 1, desc.triangles = corners;
    }
    desc.flip_normals = (uint32_t)x->flipped;
    must(brume_scene_add_shape(scene, &desc, NULL));
}

static void add_sky(brume_scene *scene, int sky) {
    brume_light_desc desc = brume_light_desc_default(sky == MAP_SKY ? BRUME_LIGHT_ENVMAP : BRUME_LIGHT_CONSTANT);
    for (int i = 0; i < 3; i++) desc.intensity[i] = 0.5f;
    if (sky == MAP_SKY) {
        uint64_t seed = 4;
        for (int y = 0; y < MAP_HEIGHT; y++)
            for (int x = 0; x < MAP_WIDTH; x++) {
                float value = (float)(0.1 + test_random_unit(&seed)) * (x == 5 && y == 3 ? 1000 : 1);
                for (int k = 0; k < 3; k++) map[y][x][k] = value;
            }
        desc.width = MAP_WIDTH, desc.height = MAP_HEIGHT, desc.texels = &map[0][0][0];
        /* turned about all axes: x' = z, y' = x, z' = y */
        memset(desc.to_world, 0, sizeof desc.to_world);
        desc.to_world[2] = desc.to_world[4] = desc.to_world[9] = desc.to_world[15] = 1;
    }
    must(brume_scene_add_light(scene, &desc, NULL));
}

static void sample(const emitter_case *c, uint32_t lanes, brume_precision precision) {
    static const double nothing[2];
    brume_scene *scene;
    brume_sensor_desc sensor = brume_sensor_desc_default();
    must(brume_scene_create(context, &scene));
    must(brume_scene_set_sensor(scene, &sensor));
    for (int i = 0; i < MAX_PIECES && c->pieces[i].red > 0; i++) add_piece(scene, &c->pieces[i]);
    if (c->sky != NO_SKY) add_sky(scene, c->sky);
    brume_arrays_free(&arrays);
    must(brume_arrays_build(scene, NULL, &arrays));
    brume_scene_destroy(scene);
    uint64_t seed = 9;
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < COUNT; i++) u[k][i] = test_random_unit(&seed);
    brume_arrays *a = &arrays;
    device_array in[] = {
        {READ_RAW, &a->params, sizeof a->params},
        {READ_RAW, a->bvh.nodes, a->bvh.node_count * sizeof *a->bvh.nodes},
        {READ_RAW, a->bvh.blocks, a->bvh.block_count * sizeof *a->bvh.blocks},
        {READ_RAW, a->bvh.quadric_ids, a->bvh.quadric_block_count * 8 * sizeof *a->bvh.quadric_ids},
        {READ_RAW, a->quadrics, (size_t)a->params.quadric_count * sizeof *a->quadrics},
        {READ_RAW, a->triangles, (size_t)a->params.triangle_count * sizeof *a->triangles},
        {READ_RAW, a->positions, a->position_count * 3 * sizeof(float)},
        {READ_RAW, a->normals, 0},
        {READ_RAW, a->uvs, 0},
        {READ_RAW, a->shapes, a->shape_count * sizeof *a->shapes},
        {READ_RAW, a->bsdfs, a->bsdf_count * sizeof *a->bsdfs},
        {READ_RAW, a->textures, 0},
        {READ_RAW, a->texels, a->texel_count * 3 * sizeof(float)},
        {READ_RAW, a->media, 0},
        {READ_RAW, a->lights, 0},
        {READ_RAW, a->emitters, a->emitter_count * sizeof *a->emitters},
        {READ_RAW, a->cdf, a->cdf_count * sizeof(float)},
        {READ_RAW, a->filter, 0},
        {READ_RAW, a->light_tree.blocks, 0},
        {READ_REAL, (void *)(uintptr_t)c->p, 3},
        {READ_REAL, u, 3 * COUNT},
        {WRITE_REAL, out, (size_t)PLANES * COUNT},
    };
    for (int i = 0; i < 19; i++)
        if (in[i].count == 0) in[i].data = (void *)(uintptr_t)nothing, in[i].count = sizeof nothing;
    device_test_run(text, FEATURES_ARE("FEATURE_QUADRICS|FEATURE_AREA_LIGHTS|FEATURE_ENVIRONMENT") " -DBVH_STACK=64",
                    lanes, precision, COUNT, in, sizeof in / sizeof in[0]);
}

/* ---- the twin ---------------------------------------------------------------------------------------------------- */

static double dot(const double a[3], const double b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

static void cross(const double a[3], const double b[3], double c[3]) {
    for (int i = 0; i < 3; i++) c[i] = a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3];
}

static double triangle_normal(const piece *x, double n[3]) { /* returns the area */
    double e[3], f[3];
    for (int i = 0; i < 3; i++) e[i] = x->b[i] - x->a[i], f[i] = x->c[i] - x->a[i];
    cross(e, f, n);
    double length = sqrt(dot(n, n));
    for (int i = 0; i < 3; i++) n[i] /= length;
    return length / 2;
}

static double area_of(const piece *x) {
    double n[3];
    if (x->kind == EMITTER_TRIANGLE) return triangle_normal(x, n);
    return (x->kind == EMITTER_SPHERE ? 4 : 1) * PI * x->radius * x->radius;
}

/* Per steradian in direction w, if this piece is chosen evenly over its area or, for spheres, its cone. */
static double piece_density(const piece *x, const double p[3], const double w[3]) {
    double to[3], n[3] = {0, 0, 1};
    for (int i = 0; i < 3; i++) to[i] = x->a[i] - p[i];
    if (x->kind == EMITTER_SPHERE) {
        double along = dot(to, w), d2 = dot(to, to), r2 = x->radius * x->radius, root = along * along - d2 + r2;
        if (d2 > r2 * 1.0001 * 1.0001) return along > 0 && root > 0 ? 1 / (2 * PI * (1 - sqrt(1 - r2 / d2))) : 0;
        if (root <= 0) return 0;
        double sum = 0;
        for (int side = -1; side <= 1; side += 2) { /* the far side too: it is sampled, if in vain */
            double t = along + side * sqrt(root);
            if (t > 0) sum += t * t / (sqrt(root) / x->radius * 4 * PI * r2);
        }
        return sum;
    }
    double area = x->kind == EMITTER_TRIANGLE ? triangle_normal(x, n) : area_of(x);
    double t = dot(to, n) / dot(w, n);
    if (!(t > 0)) return 0;
    double q[3];
    for (int i = 0; i < 3; i++) q[i] = p[i] + t * w[i];
    if (x->kind == EMITTER_DISK) {
        if (hypot(q[0] - x->a[0], q[1] - x->a[1]) > x->radius) return 0;
    } else {
        const double *corners[4] = {x->a, x->b, x->c, x->a};
        for (int k = 0; k < 3; k++) {
            double e[3], f[3], side[3];
            for (int i = 0; i < 3; i++) e[i] = corners[k + 1][i] - corners[k][i], f[i] = q[i] - corners[k][i];
            cross(e, f, side);
            if (dot(side, n) < 0) return 0;
        }
    }
    return t * t / (fabs(dot(w, n)) * area);
}

/* Map coordinates of a world direction. */
static void map_uv(const double w[3], double *x, double *y) {
    double local[3] = {w[1], w[2], w[0]}; /* the inverse of the turn in add_sky */
    *x = atan2(local[0], -local[2]) / (2 * PI);
    *x -= floor(*x);
    *y = acos(fmax(-1, fmin(1, local[1]))) / PI;
}

static double sky_density(int sky, const double w[3]) {
    if (sky == CONSTANT_SKY) return 1 / (4 * PI);
    double x, y;
    map_uv(w, &x, &y);
    int column = (int)(x * MAP_WIDTH), row = (int)(y * MAP_HEIGHT);
    column = column < MAP_WIDTH ? column : MAP_WIDTH - 1, row = row < MAP_HEIGHT ? row : MAP_HEIGHT - 1;
    /* which shares the cells should have is test_arrays's business */
    const float *rows = arrays.cdf + arrays.params.environment_cdf;
    const float *columns = rows + MAP_HEIGHT + 1 + row * (MAP_WIDTH + 1);
    double share = ((double)rows[row + 1] - rows[row]) * ((double)columns[column + 1] - columns[column]);
    return share * MAP_WIDTH * MAP_HEIGHT / (2 * PI * PI * fmax(sin(PI * y), 1e-9));
}

typedef struct {
    const emitter_case *c;
    double frame[3][3]; /* directions are counted in this frame */
} density;

static double twin_density(const void *user, double z, double phi) {
    const density *f = user;
    const emitter_case *c = f->c;
    double r = sqrt(fmax(0, 1 - z * z)), w[3], total = 0, sum = 0;
    for (int i = 0; i < 3; i++)
        w[i] = r * cos(phi) * f->frame[0][i] + r * sin(phi) * f->frame[1][i] + z * f->frame[2][i];
    for (int i = 0; i < MAX_PIECES && c->pieces[i].red > 0; i++) total += area_of(&c->pieces[i]) * c->pieces[i].red;
    for (int i = 0; i < MAX_PIECES && c->pieces[i].red > 0; i++) {
        const piece *x = &c->pieces[i];
        sum += area_of(x) * x->red / total * piece_density(x, c->p, w);
    }
    if (c->sky == NO_SKY) return sum;
    double share = total > 0 ? 0.5 : 1;
    return share * sky_density(c->sky, w) + (1 - share) * sum;
}

/* ---- tests ------------------------------------------------------------------------------------------------------- */

/* A histogram that looks closely at what there is to see: the cap around the single emitter, else the whole sphere. */
static double directions_p(const emitter_case *c, double squeeze) {
    density f = {c, {{c->sky == MAP_SKY ? -1 : 1, 0, 0}, {0, 1, 0}, {0, 0, 1}}}; /* the map's, its columns ours */
    direction_grid grid = {12, 16, -1};
    static double x[3][COUNT];
    const piece *only = c->pieces[0].red > 0 && c->pieces[1].red == 0 && c->sky == NO_SKY ? &c->pieces[0] : NULL;
    if (only) {
        double *axis = f.frame[2], away[3] = {0}, reach = only->radius, d;
        for (int i = 0; i < 3; i++) {
            axis[i] = only->a[i] - c->p[i];
            if (only->kind == EMITTER_TRIANGLE) axis[i] = (only->a[i] + only->b[i] + only->c[i]) / 3 - c->p[i];
        }
        d = sqrt(dot(axis, axis));
        for (int i = 0; i < 3; i++) axis[i] /= d;
        away[fabs(axis[0]) < 0.5 ? 0 : 1] = 1;
        cross(axis, away, f.frame[0]);
        double length = sqrt(dot(f.frame[0], f.frame[0]));
        for (int i = 0; i < 3; i++) f.frame[0][i] /= length;
        cross(axis, f.frame[0], f.frame[1]);
        if (only->kind == EMITTER_SPHERE && d > 1.0001 * reach) grid.z0 = sqrt(1 - reach * reach / d / d);
        else if (only->kind == EMITTER_DISK) grid.z0 = d / hypot(d, reach);
        else if (only->kind == EMITTER_TRIANGLE && d > 1000) grid.z0 = cos(60 / d);
    }
    for (int i = 0; i < COUNT; i++)
        for (int k = 0; k < 3; k++)
            x[k][i] = f.frame[k][0] * out[WX][i] + f.frame[k][1] * out[WY][i] + f.frame[k][2] * out[WZ][i];
    for (int i = 0; i < COUNT; i++) { /* a float's length of 1 is no length of 1 where a cap is a millionth */
        double length = sqrt(x[0][i] * x[0][i] + x[1][i] * x[1][i] + x[2][i] * x[2][i]);
        for (int k = 0; k < 3; k++) x[k][i] /= length;
        x[2][i] = 1 - (1 - x[2][i]) * squeeze;
        /* at the edge of what is seen, to the rounding of a point far away */
        if (x[2][i] < grid.z0 && 1 - x[2][i] < (1 - grid.z0) * 1.01) x[2][i] = grid.z0;
    }
    return stats_directions(&grid, x[0], x[1], x[2], NULL, COUNT, twin_density, &f);
}

/* Lambert 1760: irradiance from a polygon wholly above the horizon. */
static double triangle_irradiance(const piece *x, const emitter_case *c) {
    const double *corners[4] = {x->a, x->b, x->c, x->a};
    double sum = 0;
    for (int k = 0; k < 3; k++) {
        double e[3], f[3], g[3];
        for (int i = 0; i < 3; i++) e[i] = corners[k][i] - c->p[i], f[i] = corners[k + 1][i] - c->p[i];
        cross(e, f, g);
        double length = sqrt(dot(g, g));
        sum += atan2(length, dot(e, f)) * dot(g, c->n) / length;
    }
    return x->red * fabs(sum) / 2;
}

static double map_irradiance(const double n[3]) {
    enum { FINE = 64 };
    double sum = 0;
    for (int j = 0; j < (MAP_HEIGHT - 1) * FINE; j++)
        for (int i = 0; i < MAP_WIDTH * FINE; i++) {
            double y = (j + 0.5) / FINE, x = (i + 0.5) / FINE, v = y / (MAP_HEIGHT - 1) * PI;
            double azimuth = x / MAP_WIDTH * 2 * PI;
            double local[3] = {sin(azimuth) * sin(v), cos(v), -cos(azimuth) * sin(v)};
            double w[3] = {local[2], local[0], local[1]};
            int column = (int)floor(x - 0.5), row = (int)y;
            double fx = x - 0.5 - column, fy = y - row;
            int left = (column + MAP_WIDTH) % MAP_WIDTH, right = (column + 1) % MAP_WIDTH;
            double radiance = (1 - fy) * ((1 - fx) * map[row][left][0] + fx * map[row][right][0]) +
                              fy * ((1 - fx) * map[row + 1][left][0] + fx * map[row + 1][right][0]);
            sum += radiance * sin(v) * fmax(0, dot(w, n));
        }
    return sum * PI / (MAP_HEIGHT - 1) / FINE * 2 * PI / MAP_WIDTH / FINE;
}

static double expected_irradiance(const emitter_case *c) {
    double sum = 0;
    if (c->irradiance >= 0) return PI * c->irradiance;
    if (c->sky == MAP_SKY) sum += map_irradiance(c->n);
    if (c->irradiance > -1.5)
        for (int i = 0; i < MAX_PIECES && c->pieces[i].red > 0; i++) sum += triangle_irradiance(&c->pieces[i], c);
    return sum;
}

static double irradiance_p(const emitter_case *c, double scale) {
    static double values[COUNT];
    double mean = 0, expected = expected_irradiance(c);
    for (int i = 0; i < COUNT; i++) {
        double cosine = out[WX][i] * c->n[0] + out[WY][i] * c->n[1] + out[WZ][i] * c->n[2];
        values[i] = out[RADIANCE][i] * fmax(cosine, 0) / (scale * out[PDF][i]);
        mean += values[i] / COUNT;
    }
    if (fabs(mean - expected) <= 2e-6 * expected) return 1; /* all samples alike: float's own rounding */
    return stats_mean(values, COUNT, expected);
}

static void check_rays(const emitter_case *c) {
    int missed = 0, blocked = 0, several = c->sky != NO_SKY && c->pieces[0].red > 0;
    for (int i = 0; i < COUNT; i++) {
        double length = sqrt(pow(out[WX][i], 2) + pow(out[WY][i], 2) + pow(out[WZ][i], 2));
        assert_true(fabs(length - 1) < 4e-7);
        if (out[DISTANCE][i] > 1e17) {
            /* Next to a cell's edge the direction's own rounding decides on which side it lies. */
            missed += !(fabs(out[ENVIRONMENT_PDF][i] / out[PDF][i] - 1) < 1e-4);
            assert_true(fabs(out[ENVIRONMENT_R][i] - out[RADIANCE][i]) <= 1e-6 * out[RADIANCE][i]);
        } else {
            blocked += out[BLOCKED][i] != 0 && out[RADIANCE][i] > 0;
            /* Where the surface is seen edge-on, its density hangs on the direction's last digits. */
            double tolerance = 1e-5 + 4e-6 / fabs(out[COSINE][i]) * (1 + 1 / out[DISTANCE][i]);
            missed += out[MET][i] == 0 || !(fabs(out[MET_PDF][i] / out[PDF][i] - 1) < tolerance);
        }
    }
    if (blocked) fail_msg("%s: %d of %d samples are hidden by what they lie on", c->name, blocked, COUNT);
    /* Directions lead to points just before the surface, which at its rim may be beside it: 8e-4 of the far sphere. */
    if (missed > COUNT / 250 && !several)
        fail_msg("%s: %d of %d rays meet something else than what was sampled", c->name, missed, COUNT);
}

static void samples_match_densities_and_irradiance(void **state) {
    (void)state;
    if (!device_test_offers(BRUME_PRECISION_FLOAT)) skip();
    for (int k = 0; k < (int)CASES; k++) {
        const emitter_case *c = &cases[k];
        sample(c, 16, BRUME_PRECISION_FLOAT);
        double p = directions_p(c, 1);
        if (p < stats_level(CONFIDENCE, TESTS)) fail_msg("%s: directions have p = %g", c->name, p);
        if (c->irradiance > -2.5) {
            p = irradiance_p(c, 1);
            if (p < stats_level(CONFIDENCE, TESTS)) fail_msg("%s: irradiance has p = %g", c->name, p);
        }
        check_rays(c);
    }
}

/* Planted: directions moved a little off, densities 3 % off. */
static void wrong_samples_are_noticed(void **state) {
    (void)state;
    if (!device_test_offers(BRUME_PRECISION_FLOAT)) skip();
    static const int noisy[] = {0, 4, 7, 11};
    for (int k = 0; k < 4; k++) {
        const emitter_case *c = &cases[noisy[k]];
        sample(c, 16, BRUME_PRECISION_FLOAT);
        if (!(irradiance_p(c, 1.03) < stats_level(CONFIDENCE, TESTS))) fail_msg("%s: 3 %% pass unseen", c->name);
        if (!(directions_p(c, 0.95) < stats_level(CONFIDENCE, TESTS))) fail_msg("%s: a squeeze is unseen", c->name);
    }
}

static void every_width_gives_the_same_bits(void **state) {
    (void)state;
    if (!device_test_offers(BRUME_PRECISION_FLOAT)) skip();
    static double first[PLANES][COUNT];
    sample(&cases[CASES - 2], 16, BRUME_PRECISION_FLOAT);
    memcpy(first, out, sizeof out);
    sample(&cases[CASES - 2], 1, BRUME_PRECISION_FLOAT);
    /* up to what the rays met: traversal has two forms, with a test of its own */
    assert_memory_equal(first, out, MET * sizeof out[0]);
}

static int setup(void **state) {
    return brume_context_create(&context) == BRUME_OK ? device_test_setup(state) : -1;
}

static int teardown(void **state) {
    brume_arrays_free(&arrays);
    brume_context_destroy(context);
    return device_test_teardown(state);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(samples_match_densities_and_irradiance),
        cmocka_unit_test(wrong_samples_are_noticed),
        cmocka_unit_test(every_width_gives_the_same_bits),
    };
    return cmocka_run_group_tests(tests, setup, teardown);
}

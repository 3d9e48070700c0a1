/* test_extreme_furnaces.c -- a closed room in which the radiance is the same everywhere, with every parameter at its
 * extremes, two by two: whatever the fog, the surfaces and their shapes are, each ray carries the walls' radiance.
 *
 * The walls and grey surfaces emit what they don't reflect, the fog what it absorbs; white and clear things emit
 * nothing. Rough metal loses light to bounces that its model leaves out, what white walls enclose stays dark, and in
 * fog so thick and white that paths have hundreds of events they are cut short: there the radiance is the most that may
 * come.
 */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "known_answer.h"
#include "pairwise.h"
#include "planted.h"
#include "stability.h"

enum { SIGMA, ALBEDO, G, SURFACE, SHAPE, EYE, RADIANCE, SCALE, FOG, PARAMETERS };
enum { WHITE, GREY, MIRROR, GLASS, METAL, CLEAR };
enum { BALL, CUBE, NEEDLE, SLIVER, DOUBLED, OVERLAP, PLAIN };
enum { SAMPLES = 16 };
#define MOST_ERRORS 5.0 /* p = 6e-7 for each */

static const double sigmas[] = {0, 1e-12, 1e-3, 1, 30, 1e6}, albedos[] = {0, 0.5, 1 - 0x1p-24, 1};
static const double gs[] = {-0.9999, -0.6, 0, 0.6, 0.9999}, radiances[] = {1e-30, 1, 1e30};
static const double scales[] = {1e-6, 1, 1e6};
static const char *const surfaces[] = {"white", "grey", "mirror", "glass", "metal", "clear"};
static const char *const shapes[] = {"ball", "cube", "needle", "sliver", "doubled", "overlap", "plain"};

typedef struct furnace {
    double sigma, albedo, g, radiance, scale;
    int surface, shape, inside, everywhere;
} furnace;

static furnace furnace_of(const unsigned char *row) {
    furnace f = {sigmas[row[SIGMA]], albedos[row[ALBEDO]], gs[row[G]], radiances[row[RADIANCE]], scales[row[SCALE]],
                 row[SURFACE], row[SHAPE], row[EYE], row[FOG]};
    /* What the fog emits has to be a float, too. */
    if (f.radiance * f.sigma / f.scale > 1e38)
        f.radiance *= 1e-12;
    return f;
}

/* ---- the scene --------------------------------------------------------------------------------------------------- */

static void add_room(brume_scene *scene, const furnace *f) {
    brume_shape_desc wall = brume_shape_desc_default(BRUME_SHAPE_SPHERE);
    wall.radius = (float)(2 * f->scale);
    wall.flip_normals = 1;
    wall.bsdf = add_diffuse(scene, 0.5);
    set_all(wall.radiance, 0.5 * f->radiance);
    must(brume_scene_add_shape(scene, &wall, NULL));
}

static uint32_t add_surface(brume_scene *scene, int surface) {
    static const brume_bsdf_kind kinds[] = {BRUME_BSDF_DIFFUSE, BRUME_BSDF_DIFFUSE, BRUME_BSDF_CONDUCTOR,
                                            BRUME_BSDF_DIELECTRIC, BRUME_BSDF_ROUGH_CONDUCTOR, BRUME_BSDF_NULL};
    uint32_t id;
    brume_bsdf_desc desc = brume_bsdf_desc_default(kinds[surface]);
    if (surface <= GREY)
        set_all(desc.reflectance, surface == WHITE ? 1 : 0.5);
    desc.two_sided = surface != GLASS && surface != CLEAR;
    must(brume_scene_add_bsdf(scene, &desc, &id));
    return id;
}

/* A cube of triangles, each twice, and with triangles without area on its edges. */
static void make_doubled(brume_shape_desc *desc, float positions[24], uint32_t triangles[78]) {
    static const uint32_t faces[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                         {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
    int n = 0;
    for (int i = 0; i < 24; i++)
        positions[i] = i / 3 >> i % 3 & 1 ? 1 : -1;
    for (int i = 0; i < 24; i++) {
        const uint32_t *v = faces[i / 2 % 6];
        const uint32_t corners[2][3] = {{v[0], v[1], v[2]}, {v[0], v[2], v[3]}};
        for (int k = 0; k < 3; k++)
            triangles[n++] = corners[i % 2][k];
    }
    for (uint32_t i = 0; i < 6; i++)
        triangles[n++] = i % 3 ? 1 + i / 3 : i / 3;
    desc->kind = BRUME_SHAPE_MESH;
    desc->positions = positions;
    desc->vertex_count = 8;
    desc->triangles = triangles;
    desc->triangle_count = 26;
}

static void add_object(brume_scene *scene, const furnace *f, uint32_t bsdf, uint32_t medium, int shape, double shift) {
    static const double sizes[][3] = {{0.5, 0.5, 0.5}, {0.5, 0.5, 0.5}, {1e-6, 1e-6, 0.9}, {0.8, 0.8, 1e-7},
                                      {0.5, 0.5, 0.5}, {0.5, 0.5, 0.5}, {0.5, 0.5, 0.5}};
    const double s = f->scale, *size = sizes[shape];
    float positions[24];
    uint32_t triangles[78];
    brume_shape_desc desc = brume_shape_desc_default(shape == BALL ? BRUME_SHAPE_SPHERE : BRUME_SHAPE_CUBE);
    if (shape == DOUBLED)
        make_doubled(&desc, positions, triangles);
    scale_and_move(desc.to_world, s * size[0], s * size[1], s * size[2], s * shift, s * shift / 4, 0);
    desc.bsdf = bsdf;
    if (f->surface == GREY) {
        /* Emitters that coincide would be two. */
        set_all(desc.radiance, shape == DOUBLED || shape == OVERLAP ? 0 : 0.5 * f->radiance);
        desc.flip_normals = f->inside != 0;
    }
    if (f->surface == GLASS || f->surface == CLEAR || f->inside) {
        desc.interior = medium;
        desc.exterior = f->everywhere ? medium : BRUME_NONE;
        if (desc.flip_normals) {
            desc.exterior = medium;
            desc.interior = f->everywhere ? medium : BRUME_NONE;
        }
        desc.is_boundary = 1;
    }
    must(brume_scene_add_shape(scene, &desc, NULL));
}

/* White, two-sided, a hundred million times as large as what stands on it. */
static void add_plain(brume_scene *scene, const furnace *f) {
    const float m[16] = {1e8f * (float)f->scale, 0, 0, 0, 0, 0, 1, -0.75f * (float)f->scale,
                         0, -1e8f * (float)f->scale, 0, 0, 0, 0, 0, 1};
    brume_shape_desc desc = brume_shape_desc_default(BRUME_SHAPE_RECTANGLE);
    memcpy(desc.to_world, m, sizeof m);
    desc.bsdf = add_diffuse(scene, 1);
    must(brume_scene_add_shape(scene, &desc, NULL));
}

/* Thick and white. */
static int cut_short(const furnace *f) {
    int matters = f->everywhere || f->inside || f->surface == GLASS || f->surface == CLEAR;
    return matters && f->sigma * (f->everywhere ? 2 : 1) > 10 && f->albedo > 0.9;
}

static brume_scene *furnace_scene(const furnace *f) {
    view v = along_z;
    brume_sensor_desc sensor = brume_sensor_desc_default();
    brume_scene *scene = new_scene(DEPTH_ANY, SAMPLES);
    brume_integrator_desc integrator;
    uint32_t fog = add_medium(scene, f->sigma / f->scale, f->albedo, f->g,
                              f->radiance * f->sigma / f->scale * (1 - f->albedo));
    must(brume_scene_get_integrator(scene, &integrator));
    integrator.rr_depth = 100;
    if (cut_short(f))
        integrator.max_depth = 50;
    must(brume_scene_set_integrator(scene, &integrator));
    v.origin[2] = f->inside ? 0 : -1.5 * f->scale;
    view_matrix(&v, sensor.to_world);
    sensor.fov = 80;
    sensor.near_clip = (float)(1e-9 * f->scale);
    sensor.far_clip = (float)(1e3 * f->scale);
    sensor.medium = f->everywhere || f->inside ? fog : BRUME_NONE;
    must(brume_scene_set_sensor(scene, &sensor));
    add_room(scene, f);
    uint32_t bsdf = add_surface(scene, f->surface);
    add_object(scene, f, bsdf, fog, f->shape, 0);
    if (f->shape == OVERLAP) /* in y and z its faces lie half on the other's planes */
        add_object(scene, f, bsdf, fog, f->shape, 0.25);
    if (f->shape == PLAIN)
        add_plain(scene, f);
    return scene;
}

/* ---- what comes out ---------------------------------------------------------------------------------------------- */

/* Radiance in glass is larger by the square of its index. */
#define DENSEST (1.5046 / 1.000277 * 1.5046 / 1.000277)

/* Exactly the radiance, or at most that. */
typedef enum promise { EQUAL, AT_MOST } promise;

static promise promise_of(const furnace *f) {
    if (cut_short(f))
        return AT_MOST;
    if (f->surface == GLASS && (f->inside || (f->sigma > 0 && f->albedo < 1)))
        return AT_MOST;
    if (f->surface == GREY && (f->shape == DOUBLED || f->shape == OVERLAP))
        return AT_MOST;
    if (f->surface == METAL || (f->inside && (f->surface == WHITE || f->surface == MIRROR)))
        return AT_MOST;
    return EQUAL;
}

/* In standard errors, beyond FLOAT_ERROR. */
static double off_by(const furnace *f, double *mean) {
    brume_render_desc desc = brume_render_desc_default();
    brume_scene *scene = furnace_scene(f);
    float pixels[PIXELS * PIXELS * 3];
    brume_render *render = NULL;
    brume_render_stats stats;
    desc.guides = 0;
    desc.generic = 1;
    must(brume_render_create(device, scene, &desc, &render));
    must(brume_render_run(render, NULL, NULL));
    must(brume_render_read(render, BRUME_CHANNEL_RADIANCE, pixels, PIXELS * PIXELS * 3));
    must(brume_render_get_stats(render, &stats));
    brume_render_destroy(render);
    brume_scene_destroy(scene);
    if (stats.bad_samples > 0)
        return INFINITY;
    for (int i = 0; i < PIXELS * PIXELS * 3; i++)
        if (!(pixels[i] >= 0 && pixels[i] <= 1e38f))
            return INFINITY;
    estimate e = estimate_of(pixels);
    promise p = promise_of(f);
    double beyond = e.mean[0] / f->radiance - 1;
    *mean = e.mean[0] / f->radiance;
    if (p == AT_MOST && f->surface == GLASS)
        beyond -= DENSEST - 1;
    beyond = p == AT_MOST ? beyond : fabs(beyond);
    beyond = fmax(beyond - FLOAT_ERROR, 0);
    return beyond == 0 ? 0 : beyond * f->radiance / e.error[0];
}

static void every_two_extremes(void **state) {
    pairwise table = {PARAMETERS, {6, 4, 5, 6, 7, 2, 3, 3, 2}, 0, {{0}}};
    double worst = -1;
    int counts[2] = {0, 0}, bad = 0;
    char where[160] = "";
    (void)state;
    NEEDS_DEVICE();
    pairwise_fill(&table);
    assert_int_equal(pairwise_missing(&table), 0);
    for (int i = 0; i < table.count; i++) {
        furnace f = furnace_of(table.rows[i]);
        double mean = 0, off = off_by(&f, &mean);
        char here[160];
        snprintf(here, sizeof here, "sigma %g albedo %.9g g %g %s %s%s L %g scale %g%s", f.sigma, f.albedo, f.g,
                 surfaces[f.surface], shapes[f.shape], f.inside ? " seen from inside" : "", f.radiance, f.scale,
                 f.everywhere ? "" : ", fog inside only");
        print_message("%-110s %d: %.6g of L, %.2f standard errors\n", here, (int)promise_of(&f), mean, off);
        counts[promise_of(&f)]++;
        bad += off > MOST_ERRORS;
        if (off > worst) {
            worst = off;
            memcpy(where, here, sizeof where);
        }
    }
    print_message("%d furnaces: %d known, %d bounded; %d wrong\n", table.count, counts[EQUAL],
                  counts[AT_MOST], bad);
    stability_row("furnace", "extremes of fog, surface, shape, radiance and scale, two by two",
                  "the walls' radiance everywhere", "standard errors", MOST_ERRORS, worst, "%s", where);
}

/* What was wrong once, and what would be. */
static void planted_errors_are_noticed(void **state) {
    static const struct { const char *file, *right, *wrong; furnace f; } plants[] = {
        {"geometry.h", "(size > LARGE_TRIANGLE * from)", "(size > R(1e30) * from)",
         {0, 0, 0, 1, 1, CLEAR, PLAIN, 0, 0}},
        {"medium.h", "cselect(f.scatters, m->albedo, cgrey(R(1)))", "cselect(f.scatters, m->albedo, cgrey(R(1.02)))",
         {1, 1, 0.6, 1, 1, CLEAR, BALL, 0, 1}},
    };
    double mean;
    (void)state;
    NEEDS_DEVICE();
    for (size_t i = 0; i < sizeof plants / sizeof plants[0]; i++) {
        double right = off_by(&plants[i].f, &mean);
        planted_bug(plants[i].file, plants[i].right, plants[i].wrong);
        double wrong = off_by(&plants[i].f, &mean);
        planted_remove();
        print_message("%s: %.2f standard errors, without it %.2f\n", plants[i].wrong, wrong, right);
        if (!(right <= MOST_ERRORS && wrong > MOST_ERRORS))
            fail_msg("%s was not noticed", plants[i].wrong);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_two_extremes),
        cmocka_unit_test(planted_errors_are_noticed),
    };
    return cmocka_run_group_tests(tests, open_device, close_device);
}

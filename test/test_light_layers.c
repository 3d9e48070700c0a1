/* test_light_layers.c -- the parts of the light: that they add up, that each is what it should be, where that has a
 * closed form or is nothing at all, and that light booked to the wrong part is noticed. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "planted.h"
#include "stage.h"

enum { FLOATS = PIXELS * PIXELS * 3 };

typedef struct parts {
    float radiance[FLOATS], direct[FLOATS], indirect[FLOATS], surface[FLOATS], volume[FLOATS], segments[FLOATS / 3];
} parts;

static brume_render_desc describe(uint32_t samples) {
    brume_render_desc desc = brume_render_desc_default();
    desc.light_layers = 1;
    desc.lanes = 1;
    desc.sample_count = samples;
    return desc;
}

static void read_parts(brume_render *render, parts *out) {
    must(brume_render_read(render, BRUME_CHANNEL_RADIANCE, out->radiance, FLOATS));
    must(brume_render_read(render, BRUME_CHANNEL_DIRECT, out->direct, FLOATS));
    must(brume_render_read(render, BRUME_CHANNEL_INDIRECT, out->indirect, FLOATS));
    must(brume_render_read(render, BRUME_CHANNEL_SURFACE, out->surface, FLOATS));
    must(brume_render_read(render, BRUME_CHANNEL_VOLUME, out->volume, FLOATS));
    must(brume_render_read(render, BRUME_CHANNEL_SEGMENTS, out->segments, FLOATS / 3));
}

/* Renders and destroys the scene. */
static void render_parts(brume_scene *scene, const brume_render_desc *desc, parts *out) {
    brume_render *render;
    must(brume_render_create(device, scene, desc, &render));
    must(brume_render_run(render, NULL, NULL));
    read_parts(render, out);
    brume_render_destroy(render);
    brume_scene_destroy(scene);
}

static double mean_of(const float *x) {
    double sum = 0;
    for (int i = 0; i < FLOATS; i++) sum += x[i];
    return sum / FLOATS;
}

/* Each part is a sum of up to 64 floats, rounded as often; `all` is about what those add up to without their signs. */
static void expect_sum(const float *a, const float *b, const float *sum) {
    double bound = 64 * 0x1p-23 * 2, all = mean_of(sum);
    for (int i = 0; i < FLOATS; i++) {
        double here = fabs((double)a[i]) + fabs((double)b[i]) + fabs((double)sum[i]);
        if (!(fabs((double)a[i] + b[i] - sum[i]) <= bound * (here + all)))
            fail_msg("%d: %.9g + %.9g is not %.9g", i, (double)a[i], (double)b[i], (double)sum[i]);
    }
}

static void expect_black(const char *what, const float *x) {
    for (int i = 0; i < FLOATS; i++)
        if (x[i] != 0) fail_msg("%s is %g and not 0", what, (double)x[i]);
}

/* ---- sums -------------------------------------------------------------------------------------------------------- */

/* And the picture is the same bits as without layers, the layers are at another width. */
static void parts_add_up(void **state) {
    (void)state;
    NEEDS_DEVICE();
    for (int fog = 0; fog < 2; fog++) {
        static parts p, wide;
        static float plain[FLOATS];
        const stage told = {.fog = fog};
        brume_render_desc desc = describe(32);
        render_parts(stage_scene(&told, 32), &desc, &p);
        expect_sum(p.direct, p.indirect, p.radiance);
        expect_sum(p.surface, p.volume, p.radiance);
        assert_true(mean_of(p.direct) > 0 && mean_of(p.indirect) > 0 && mean_of(p.surface) > 0);
        if (fog)
            assert_true(mean_of(p.volume) > 0);
        else
            expect_black("volume light without a medium", p.volume);
        if (fog) {
            desc.lanes = 16;
            render_parts(stage_scene(&told, 32), &desc, &wide);
            assert_memory_equal(&p, &wide, sizeof p);
            desc.lanes = 1;
        }
        desc.light_layers = desc.guides = 0;
        brume_scene *scene = stage_scene(&told, 32);
        render_pixels(scene, &desc, plain);
        brume_scene_destroy(scene);
        assert_memory_equal(plain, p.radiance, sizeof plain);
        desc = describe(32);
        desc.clamp = (float)(0.5 * mean_of(p.radiance));
        render_parts(stage_scene(&told, 32), &desc, &p);
        expect_sum(p.direct, p.indirect, p.radiance);
        expect_sum(p.surface, p.volume, p.radiance);
    }
}

/* ---- parts with a known answer ----------------------------------------------------------------------------------- */

/* Fog, a lamp beside the one ray that is looked along, a wall across it. */
#define SIGMA 0.4
#define ALBEDO 0.8
#define WALL 2.0
#define REFLECTANCE 0.5
#define LAMP_X 0.5
#define LAMP_Z 0.75

static brume_scene *wall_in_fog(int max_depth, brume_bsdf_kind kind) {
    brume_scene *scene = new_scene(max_depth, 1);
    uint32_t fog = add_medium(scene, SIGMA, ALBEDO, 0, 0);
    set_camera(scene, &along_z, fog);
    if (kind == BRUME_BSDF_DIFFUSE) {
        add_wall(scene, WALL, 20, REFLECTANCE);
    } else {
        brume_shape_desc wall = brume_shape_desc_default(BRUME_SHAPE_RECTANGLE);
        brume_bsdf_desc bsdf = brume_bsdf_desc_default(kind);
        bsdf.two_sided = 1;
        scale_and_move(wall.to_world, 20, 20, 1, 0, 0, WALL);
        must(brume_scene_add_bsdf(scene, &bsdf, &wall.bsdf));
        must(brume_scene_add_shape(scene, &wall, NULL));
    }
    add_point(scene, LAMP_X, 0, LAMP_Z);
    return scene;
}

/* Light scattered once by the fog before the wall, by Simpson's rule in double. */
static double fog_light(void) {
    enum { STEPS = 2000 };
    double sum = 0, h = WALL / STEPS;
    for (int i = 0; i <= STEPS; i++) {
        double z = i * h, r = sqrt(LAMP_X * LAMP_X + (z - LAMP_Z) * (z - LAMP_Z));
        double f = SIGMA * ALBEDO / (4 * PI) * exp(-SIGMA * (z + r)) / (r * r);
        sum += f * (i == 0 || i == STEPS ? 1 : i % 2 ? 4 : 2);
    }
    return sum * h / 3;
}

static double wall_light(void) {
    double d = sqrt(LAMP_X * LAMP_X + (WALL - LAMP_Z) * (WALL - LAMP_Z));
    return REFLECTANCE / PI * (WALL - LAMP_Z) / (d * d * d) * exp(-SIGMA * (d + WALL));
}

static void direct_light_is_known(void **state) {
    (void)state;
    NEEDS_DEVICE();
    static const brume_strategy strategies[] = {BRUME_STRATEGY_AUTO, BRUME_STRATEGY_DISTANCE};
    for (int i = 0; i < 2; i++) {
        static parts p;
        brume_render_desc desc = describe(64);
        desc.use_strategy = 1;
        desc.strategy = strategies[i];
        render_parts(wall_in_fog(2, BRUME_BSDF_DIFFUSE), &desc, &p);
        expect_black("indirect light of single scattering", p.indirect);
        estimate surface = estimate_of(p.surface), volume = estimate_of(p.volume);
        check("the wall's light, max_depth 2", &surface, 0, wall_light(), 0.01);
        check("the fog's light, max_depth 2", &volume, 0, fog_light(), 0.01);
        render_parts(wall_in_fog(6, BRUME_BSDF_DIFFUSE), &desc, &p);
        estimate direct = estimate_of(p.direct);
        check("direct light, max_depth 6", &direct, 1, wall_light() + fog_light(), 0.01);
        assert_true(mean_of(p.indirect) > 0);
    }
}

/* By rays of light and by chance: two ways to the same parts. */
static int ways_agree(void) {
    static parts a, b;
    static int has_a; /* the first way is not what is planted in */
    brume_render_desc desc = describe(256);
    desc.use_indirect = 1;
    desc.indirect = BRUME_INDIRECT_PHASE;
    if (!has_a) render_parts(wall_in_fog(4, BRUME_BSDF_DIFFUSE), &desc, &a);
    has_a = 1;
    desc.indirect = BRUME_INDIRECT_RAY_LIGHTS;
    desc.use_seed = 1;
    desc.seed = 99;
    render_parts(wall_in_fog(4, BRUME_BSDF_DIFFUSE), &desc, &b);
    const float *ways[3][2] = {{a.indirect, b.indirect}, {a.surface, b.surface}, {a.volume, b.volume}};
    int agree = 1;
    for (int i = 0; i < 3; i++) {
        estimate x = estimate_of(ways[i][0]), y = estimate_of(ways[i][1]);
        double error = sqrt(x.error[0] * x.error[0] + y.error[0] * y.error[0]);
        print_message("part %d: %.6g and %.6g, standard error %.2g\n", i, x.mean[0], y.mean[0], error);
        assert_true(error < 0.02 * y.mean[0]);
        agree &= agrees(x.mean[0], error, y.mean[0]);
    }
    return agree;
}

static void both_ways_find_the_same_parts(void **state) {
    (void)state;
    NEEDS_DEVICE();
    assert_true(ways_agree());
}

/* What a mirror shows lies behind it: fog is fog there, but scattered twice. */
static void a_mirror_shows_what_is_behind_it(void **state) {
    (void)state;
    NEEDS_DEVICE();
    static parts p;
    brume_render_desc desc = describe(64);
    render_parts(wall_in_fog(6, BRUME_BSDF_CONDUCTOR), &desc, &p);
    expect_black("surface light of a mirror in fog", p.surface);
    expect_sum(p.volume, p.surface, p.radiance);
    estimate direct = estimate_of(p.direct);
    check("direct light before a mirror", &direct, 2, fog_light(), 0.01);
    assert_true(mean_of(p.indirect) > 0);
}

static void emission_is_direct(void **state) {
    (void)state;
    NEEDS_DEVICE();
    static parts p;
    brume_render_desc desc = describe(4);
    brume_scene *scene = new_scene(6, 4);
    set_camera(scene, &along_z, add_medium(scene, 1, 0, 0, 3));
    add_wall(scene, 1, 4, 0);
    render_parts(scene, &desc, &p);
    estimate glow = estimate_of(p.volume);
    check("a glowing medium", &glow, 0, 3 * (1 - exp(-1)), 0.01);
    expect_black("its indirect light", p.indirect);
    expect_black("its surface light", p.surface);
    /* a sky is counted to the surfaces */
    scene = new_scene(6, 4);
    set_camera(scene, &along_z, BRUME_NONE);
    add_constant(scene, 2);
    render_parts(scene, &desc, &p);
    estimate sky = estimate_of(p.surface);
    check("a sky", &sky, 0, 2, 0.01);
    expect_black("the indirect light of a sky", p.indirect);
    expect_black("the volume light of a sky", p.volume);
}

/* Where depths are set so that a path ends soon, events are still counted one by one. */
static void single_scattering_is_direct(void **state) {
    (void)state;
    NEEDS_DEVICE();
    static parts p;
    brume_scene *scene = new_scene(6, 4);
    brume_integrator_desc integrator;
    must(brume_scene_get_integrator(scene, &integrator));
    integrator.single_scattering = 1;
    must(brume_scene_set_integrator(scene, &integrator));
    set_camera(scene, &along_z, BRUME_NONE);
    add_null_box(scene, add_medium(scene, 0.5, 0.9, 0, 0), 1, 1, 0.5, 2);
    add_constant(scene, 1);
    brume_render_desc desc = describe(16);
    render_parts(scene, &desc, &p);
    expect_black("indirect light of single scattering", p.indirect);
    assert_true(mean_of(p.volume) > 0);
}

static void segments_are_counted(void **state) {
    (void)state;
    NEEDS_DEVICE();
    static parts p;
    brume_render_desc desc = describe(4);
    for (int mirror = 0; mirror < 2; mirror++) {
        brume_scene *scene = new_scene(3, 4);
        set_camera(scene, &along_z, BRUME_NONE);
        add_constant(scene, 1);
        if (mirror) {
            brume_shape_desc wall = brume_shape_desc_default(BRUME_SHAPE_RECTANGLE);
            brume_bsdf_desc bsdf = brume_bsdf_desc_default(BRUME_BSDF_CONDUCTOR);
            bsdf.two_sided = 1;
            scale_and_move(wall.to_world, 1, 1, 1, 0, 0, 1);
            must(brume_scene_add_bsdf(scene, &bsdf, &wall.bsdf));
            must(brume_scene_add_shape(scene, &wall, NULL));
        }
        render_parts(scene, &desc, &p);
        for (int i = 0; i < FLOATS / 3; i++) assert_true(p.segments[i] == (mirror ? 2 : 1));
    }
}

/* ---- light in the wrong part ------------------------------------------------------------------------------------- */

/* Whether the parts are as they should be where everything is known of them. */
static int parts_are_right(brume_bsdf_kind wall, int max_depth) {
    static parts p;
    brume_render_desc desc = describe(64);
    render_parts(wall_in_fog(max_depth, wall), &desc, &p);
    estimate direct = estimate_of(p.direct), volume = estimate_of(p.volume);
    double known = fog_light() + (wall == BRUME_BSDF_DIFFUSE ? wall_light() : 0);
    int right = agrees(direct.mean[0], direct.error[0], known);
    if (wall != BRUME_BSDF_DIFFUSE) right &= mean_of(p.surface) == 0;
    if (max_depth == 2) right &= agrees(volume.mean[0], volume.error[0], fog_light());
    return right;
}

static void planted_bugs_are_found(void **state) {
    (void)state;
    NEEDS_DEVICE();
    static const struct { const char *file, *right, *wrong; brume_bsdf_kind wall; int max_depth; } bugs[] = {
        {"path_medium.h", "gathered, TRUE_MASK, 1", "gathered, FALSE_MASK, 1", BRUME_BSDF_DIFFUSE, 2},
        {"light_layers.h", "!l->placed & !specular", "!l->placed", BRUME_BSDF_CONDUCTOR, 6},
        {"light_layers.h", "<= I(1)", "<= I(2)", BRUME_BSDF_DIFFUSE, 6},
        {"light_layers.h", "turns ? l->events + I(1)", "(turns & !specular) ? l->events + I(1)", BRUME_BSDF_CONDUCTOR,
         6},
        {"path_indirect.h", "TRUE_MASK, 2", "TRUE_MASK, 1", BRUME_BSDF_DIFFUSE, 6},
    };
    for (size_t i = 0; i < sizeof bugs / sizeof bugs[0]; i++) {
        planted_bug(bugs[i].file, bugs[i].right, bugs[i].wrong);
        if (parts_are_right(bugs[i].wall, bugs[i].max_depth)) fail_msg("not found: %s", bugs[i].wrong);
        print_message("found: %s\n", bugs[i].wrong);
    }
    planted_bug("path_indirect.h", "TRUE_MASK, 2", "FALSE_MASK, 2");
    assert_false(ways_agree());
}

static int remove_bug(void **state) {
    (void)state;
    planted_remove();
    return 0;
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(parts_add_up),
        cmocka_unit_test(direct_light_is_known),
        cmocka_unit_test(both_ways_find_the_same_parts),
        cmocka_unit_test(a_mirror_shows_what_is_behind_it),
        cmocka_unit_test(emission_is_direct),
        cmocka_unit_test(single_scattering_is_direct),
        cmocka_unit_test(segments_are_counted),
        cmocka_unit_test_teardown(planted_bugs_are_found, remove_bug),
    };
    return cmocka_run_group_tests(tests, open_device, close_device);
}

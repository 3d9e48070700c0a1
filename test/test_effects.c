/* test_effects.c -- what scenes call for, which object calls for it, and what taking it away comes down to; and that
 * code which a scene doesn't call for never changes a picture: every mask of features that covers what it calls for
 * gives the same bits. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "../cl/shared.h"
#include "effects.h"
#include "scene_files.h"

#define OK(call) assert_int_equal((call), BRUME_OK)
#define LAMPS_IN_FOG (EFFECT(MEDIA) | EFFECT(ABSORPTION) | EFFECT(SCATTERING) | EFFECT(MULTIPLE_SCATTERING) | \
                      EFFECT(SPOT_LIGHTS) | EFFECT(BEAM_SHADOWS) | EFFECT(DIFFUSE))

static void expect_set(const char *what, uint32_t actual, uint32_t expected) {
    char missing[512], extra[512];
    if (actual == expected) return;
    brume_effects_list(expected & ~actual, missing, sizeof missing);
    brume_effects_list(actual & ~expected, extra, sizeof extra);
    fail_msg("%s: missing \"%s\", not expected \"%s\"", what, missing, extra);
}

/* ---- the scenes that come with the program --------------------------------------------------------------------- */

static void what_the_scenes_call_for(void **state) {
    (void)state;
    static const struct { const char *path; uint32_t effects; } scenes[] = {
        {"scenes/one-spot.xml", LAMPS_IN_FOG | EFFECT(QUADRICS)},
        {"scenes/three-spots.xml", LAMPS_IN_FOG | EFFECT(ANISOTROPY)},
        {"scenes/bunny-fog.xml", LAMPS_IN_FOG},
        {"scenes/forest.xml", LAMPS_IN_FOG | EFFECT(ANISOTROPY)},
        {"scenes/emission-slab.xml", EFFECT(MEDIA) | EFFECT(ABSORPTION) | EFFECT(EMISSION) | EFFECT(BOUNDED_MEDIA) |
                                     EFFECT(NULL_SURFACES)},
        {"scenes/furnace.xml", EFFECT(MEDIA) | EFFECT(ABSORPTION) | EFFECT(EMISSION) | EFFECT(SCATTERING) |
                               EFFECT(MULTIPLE_SCATTERING) | EFFECT(ANISOTROPY) | EFFECT(BOUNDED_MEDIA) |
                               EFFECT(AREA_LIGHTS) | EFFECT(DIFFUSE) | EFFECT(QUADRICS)},
        {"scenes/glass-in-fog.xml", EFFECT(MEDIA) | EFFECT(ABSORPTION) | EFFECT(SCATTERING) |
                                    EFFECT(MULTIPLE_SCATTERING) | EFFECT(ANISOTROPY) | EFFECT(CHROMATIC_EXTINCTION) |
                                    EFFECT(BOUNDED_MEDIA) | EFFECT(AREA_LIGHTS) | EFFECT(DIFFUSE) |
                                    EFFECT(DIELECTRIC) | EFFECT(NULL_SURFACES) | EFFECT(QUADRICS)},
        /* max_depth 2 */
        {"scenes/ladder/open-beam.xml", LAMPS_IN_FOG & ~EFFECT(MULTIPLE_SCATTERING)},
        {"scenes/ladder/hundred-spots.xml", (LAMPS_IN_FOG & ~EFFECT(MULTIPLE_SCATTERING)) | EFFECT(MANY_LIGHTS) |
                                            EFFECT(QUADRICS)},
        {"scenes/ladder/forward-fog.xml", (LAMPS_IN_FOG & ~EFFECT(MULTIPLE_SCATTERING)) | EFFECT(ANISOTROPY)},
        {"scenes/ladder/environment-fog.xml", EFFECT(MEDIA) | EFFECT(ABSORPTION) | EFFECT(SCATTERING) |
                                              EFFECT(BOUNDED_MEDIA) | EFFECT(ENVIRONMENT) | EFFECT(DIFFUSE) |
                                              EFFECT(NULL_SURFACES) | EFFECT(QUADRICS)},
    };
    brume_context *context;
    OK(brume_context_create(&context));
    for (size_t i = 0; i < sizeof scenes / sizeof scenes[0]; i++) {
        brume_scene *scene;
        uint32_t effects;
        if (brume_scene_load(context, scenes[i].path, NULL, 0, &scene) != BRUME_OK)
            fail_msg("%s", brume_context_message(context));
        OK(brume_scene_effects(scene, 0, &effects, NULL));
        expect_set(scenes[i].path, effects, scenes[i].effects);
        brume_scene_destroy(scene);
    }
    brume_context_destroy(context);
}

/* ---- scenes with one effect more or less ------------------------------------------------------------------------ */

/* A description in parts: what is NULL is not there, or a grey ball. */
typedef struct parts {
    const char *integrator; /* its properties */
    const char *medium;     /* the medium "fog", NULL for none */
    const char *sensor;     /* in a thinlens, else NULL */
    const char *surface;    /* the ball's bsdf and more */
    const char *light;
} parts;

#define SPOT(intensity)                                                                                                \
    "<emitter type='spot'><transform name='to_world'><lookat origin='-2,3,1' target='0,1,0' up='0,1,0'/></transform>" \
    "<rgb name='intensity' value='" intensity "'/></emitter>"
#define FOG(sigma, albedo, more)                                                                                       \
    "<medium type='homogeneous' id='fog'><rgb name='sigma_t' value='" sigma "'/><rgb name='albedo' value='" albedo     \
    "'/>" more "</medium>"
#define HG(g) "<phase type='hg'><float name='g' value='" g "'/></phase>"
#define GREY "<bsdf type='diffuse'/>"
#define DEPTH(n) "<integer name='max_depth' value='" n "'/>"

static brume_scene *make(const parts *p) {
    static char text[8192];
    snprintf(text, sizeof text,
             SCENE("<integrator type='volpath'>%s</integrator>%s\n"
                   "<sensor type='%s'>%s<transform name='to_world'><lookat origin='0,1,5' target='0,0.8,0' up='0,1,0'/>"
                   "</transform>%s<film type='hdrfilm'><integer name='width' value='17'/>"
                   "<integer name='height' value='9'/></film>\n"
                   "<sampler type='independent'><integer name='sample_count' value='4'/></sampler></sensor>\n"
                   "%s<shape type='sphere'><point name='center' x='0' y='1' z='0'/>%s</shape>"),
             p->integrator ? p->integrator : "", p->medium ? p->medium : "", p->sensor ? "thinlens" : "perspective",
             p->sensor ? p->sensor : "", p->medium ? "<ref id='fog'/>" : "", p->light ? p->light : "",
             p->surface ? p->surface : GREY);
    return scene_files_good(text);
}

static void one_effect_more(void **state) {
    (void)state;
    const uint32_t ball = EFFECT(DIFFUSE) | EFFECT(QUADRICS);
    const uint32_t beam = ball | EFFECT(SPOT_LIGHTS), fog = EFFECT(MEDIA) | EFFECT(ABSORPTION) | EFFECT(SCATTERING);
    const uint32_t lit = beam | fog | EFFECT(BEAM_SHADOWS), many = EFFECT(MULTIPLE_SCATTERING);
    static const char spot[] = SPOT("60"), thin[] = FOG("0.2", "0.75", "");
    const struct { parts p; uint32_t effects, features; } rows[] = {
        {{0}, ball, FEATURE_QUADRICS},
        {{.light = spot}, beam, FEATURE_QUADRICS | FEATURE_DELTA_LIGHTS},
        {{.light = spot, .medium = thin}, lit | many,
         FEATURE_QUADRICS | FEATURE_DELTA_LIGHTS | FEATURE_MEDIA | FEATURE_SCATTERING | FEATURE_FLIGHTS},
        {{DEPTH("2"), .light = spot, .medium = thin}, lit,
         FEATURE_QUADRICS | FEATURE_DELTA_LIGHTS | FEATURE_MEDIA | FEATURE_SCATTERING},
        {{DEPTH("3"), .light = spot, .medium = thin}, lit | many,
         FEATURE_QUADRICS | FEATURE_DELTA_LIGHTS | FEATURE_MEDIA | FEATURE_SCATTERING | FEATURE_FLIGHTS},
        {{DEPTH("1"), .light = spot, .medium = thin}, beam | EFFECT(MEDIA) | EFFECT(ABSORPTION),
         FEATURE_QUADRICS | FEATURE_DELTA_LIGHTS | FEATURE_MEDIA},
        {{"<boolean name='single_scattering' value='true'/>", .light = spot, .medium = thin}, lit,
         FEATURE_QUADRICS | FEATURE_DELTA_LIGHTS | FEATURE_MEDIA | FEATURE_SCATTERING},
        {{.light = spot, .medium = FOG("0.2", "0", HG("0.5"))}, beam | EFFECT(MEDIA) | EFFECT(ABSORPTION),
         FEATURE_QUADRICS | FEATURE_DELTA_LIGHTS | FEATURE_MEDIA},
        {{.light = spot, .medium = FOG("0.2", "1", "")}, (lit | many) & ~EFFECT(ABSORPTION),
         FEATURE_QUADRICS | FEATURE_DELTA_LIGHTS | FEATURE_MEDIA | FEATURE_SCATTERING | FEATURE_FLIGHTS},
        {{.light = spot, .medium = FOG("0", "1", "")}, beam, FEATURE_QUADRICS | FEATURE_DELTA_LIGHTS},
        {{.light = spot, .medium = FOG("0.2, 0.2, 0.3", "0", "")},
         beam | EFFECT(MEDIA) | EFFECT(ABSORPTION) | EFFECT(CHROMATIC_EXTINCTION),
         FEATURE_QUADRICS | FEATURE_DELTA_LIGHTS | FEATURE_MEDIA | FEATURE_CHROMATIC},
        {{DEPTH("2"), .light = spot, .medium = FOG("0.2", "0.75", HG("-0.1"))}, lit | EFFECT(ANISOTROPY),
         FEATURE_QUADRICS | FEATURE_DELTA_LIGHTS | FEATURE_MEDIA | FEATURE_SCATTERING | FEATURE_ANISOTROPY},
        {{.medium = FOG("0", "0", "<rgb name='emission' value='0, 0, 1'/>")}, ball | EFFECT(MEDIA) | EFFECT(EMISSION),
         FEATURE_QUADRICS | FEATURE_MEDIA},
        {{.light = "<emitter type='constant'/>"}, ball | EFFECT(ENVIRONMENT), FEATURE_QUADRICS | FEATURE_ENVIRONMENT},
        {{.light = "<emitter type='constant'><rgb name='radiance' value='0'/></emitter>"}, ball, FEATURE_QUADRICS},
        {{.light = "<emitter type='point'/><emitter type='directional'/>"},
         ball | EFFECT(POINT_LIGHTS) | EFFECT(DIRECTIONAL_LIGHTS), FEATURE_QUADRICS | FEATURE_DELTA_LIGHTS},
        {{.surface = "<emitter type='area'/>"}, ball | EFFECT(AREA_LIGHTS), FEATURE_QUADRICS | FEATURE_AREA_LIGHTS},
        {{.surface = "<bsdf type='dielectric'/>"}, EFFECT(QUADRICS) | EFFECT(DIELECTRIC),
         FEATURE_QUADRICS | FEATURE_SPECULAR},
        {{.surface = "<bsdf type='diffuse'><texture name='reflectance' type='checkerboard'/></bsdf>"},
         ball | EFFECT(TEXTURES), FEATURE_QUADRICS | FEATURE_TEXTURES},
        {{.sensor = "<float name='aperture_radius' value='0.1'/><float name='focus_distance' value='4'/>"},
         ball | EFFECT(LENS), FEATURE_QUADRICS},
        {{.medium = thin, .surface = "<bsdf type='null'/><ref name='interior' id='fog'/>"},
         fog | many | EFFECT(QUADRICS) | EFFECT(NULL_SURFACES) | EFFECT(BOUNDED_MEDIA),
         FEATURE_QUADRICS | FEATURE_NULL | FEATURE_MEDIA | FEATURE_SCATTERING | FEATURE_FLIGHTS},
        /* a spot that shines past the ball: nothing to cast a shadow */
        {{DEPTH("2"), .medium = thin,
          .light = "<emitter type='spot'><transform name='to_world'>"
                   "<lookat origin='-2,3,0' target='-2,9,0' up='1,0,0'/></transform></emitter>"},
         lit & ~EFFECT(BEAM_SHADOWS), FEATURE_QUADRICS | FEATURE_DELTA_LIGHTS | FEATURE_MEDIA | FEATURE_SCATTERING},
    };
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        char what[32];
        uint32_t effects;
        brume_scene *scene = make(&rows[i].p);
        snprintf(what, sizeof what, "row %zu", i);
        OK(brume_scene_effects(scene, 0, &effects, NULL));
        expect_set(what, effects, rows[i].effects);
        if (brume_effects_features(effects) != rows[i].features)
            fail_msg("%s: features %u instead of %u", what, brume_effects_features(effects), rows[i].features);
        brume_scene_destroy(scene);
    }
}

static void reports_name_the_object(void **state) {
    (void)state;
    const parts p = {.medium = FOG("0.2, 0.3, 0.4", "0.75", HG("0.5")), .light = SPOT("60")};
    brume_scene *scene = make(&p);
    brume_effect_report r[BRUME_EFFECT_COUNT];
    uint32_t effects;
    OK(brume_scene_effects(scene, EFFECT(ANISOTROPY), &effects, r));
    assert_int_equal(r[BRUME_EFFECT_CHROMATIC_EXTINCTION].present, 1);
    assert_int_equal(r[BRUME_EFFECT_CHROMATIC_EXTINCTION].count, 1);
    assert_int_equal(r[BRUME_EFFECT_CHROMATIC_EXTINCTION].object, BRUME_OBJECT_MEDIUM);
    assert_string_equal(r[BRUME_EFFECT_CHROMATIC_EXTINCTION].id, "fog");
    assert_string_equal(r[BRUME_EFFECT_CHROMATIC_EXTINCTION].where, "scene.xml:2");
    assert_string_equal(r[BRUME_EFFECT_CHROMATIC_EXTINCTION].why, "sigma_t 0.2, 0.3, 0.4");
    assert_string_equal(r[BRUME_EFFECT_MULTIPLE_SCATTERING].why, "max_depth has no limit");
    assert_int_equal(r[BRUME_EFFECT_ANISOTROPY].present, 0);
    assert_int_equal(r[BRUME_EFFECT_ANISOTROPY].taken_away, 1);
    assert_int_equal(r[BRUME_EFFECT_LENS].taken_away, 0);
    assert_int_equal(r[BRUME_EFFECT_LENS].count, 0);
    for (int i = 0; i < BRUME_EFFECT_COUNT; i++)
        assert_int_equal(r[i].present, effects >> i & 1);
    brume_scene_destroy(scene);
}

static void names_and_misuse(void **state) {
    (void)state;
    const parts p = {0};
    brume_scene *scene = make(&p);
    uint32_t effects = 12345;
    for (int i = 0; i < BRUME_EFFECT_COUNT; i++)
        assert_non_null(brume_effect_name((brume_effect)i));
    assert_null(brume_effect_name((brume_effect)BRUME_EFFECT_COUNT));
    assert_false(brume_effect_removable(BRUME_EFFECT_QUADRICS));
    assert_false(brume_effect_removable((brume_effect)BRUME_EFFECT_COUNT));
    uint32_t bits = 0;
    while (brume_feature_name(bits)) bits++;
    assert_int_equal((1u << bits) - 1, FEATURE_ALL);
    assert_int_equal(brume_scene_effects(NULL, 0, &effects, NULL), BRUME_ERROR_ARGUMENT);
    assert_int_equal(brume_scene_effects(scene, 0, NULL, NULL), BRUME_ERROR_ARGUMENT);
    assert_int_equal(brume_scene_effects(scene, EFFECT(QUADRICS), &effects, NULL), BRUME_ERROR_ARGUMENT);
    assert_int_equal(brume_scene_effects(scene, 1u << 31, &effects, NULL), BRUME_ERROR_ARGUMENT);
    assert_int_equal(effects, 12345);
    brume_scene_destroy(scene);
}

/* How many programs the table of features can ask for; README.md and cl/shared.h say so. */
static void there_are_so_many_programs(void **state) {
    (void)state;
    /* What needs code, and what each cannot be there without. */
    static const struct { uint32_t effect, needs; } all[] = {
        {EFFECT(MEDIA), 0}, {EFFECT(SCATTERING), EFFECT(MEDIA)}, {EFFECT(MULTIPLE_SCATTERING), EFFECT(SCATTERING)},
        {EFFECT(ANISOTROPY), EFFECT(SCATTERING)}, {EFFECT(CHROMATIC_EXTINCTION), EFFECT(MEDIA)},
        {EFFECT(EMISSION), EFFECT(MEDIA)}, {EFFECT(SPOT_LIGHTS), 0}, {EFFECT(MANY_LIGHTS), EFFECT(SPOT_LIGHTS)},
        {EFFECT(AREA_LIGHTS), 0}, {EFFECT(ENVIRONMENT), 0}, {EFFECT(DIELECTRIC), 0}, {EFFECT(NULL_SURFACES), 0},
        {EFFECT(TEXTURES), 0}, {EFFECT(QUADRICS), 0},
    };
    enum { COUNT = sizeof all / sizeof all[0] };
    static unsigned char seen[FEATURE_ALL + 1];
    int masks = 0;
    for (uint32_t pick = 0; pick < 1u << COUNT; pick++) {
        uint32_t effects = 0, needs = 0;
        for (int i = 0; i < COUNT; i++)
            if (pick >> i & 1) {
                effects |= all[i].effect;
                needs |= all[i].needs;
            }
        uint32_t features = brume_effects_features(effects);
        if ((effects & needs) != needs || seen[features]) continue;
        seen[features] = 1;
        masks++;
    }
    assert_int_equal(masks, 1536);
}

/* ---- pictures --------------------------------------------------------------------------------------------------- */

enum { FLOATS = 17 * 9 * 3 };

static brume_device *device;

/* 0: there is none. */
static int open_device(const brume_scene *scene) {
    return device || brume_device_open(scene->context, BRUME_DEVICE_ANY, &device) == BRUME_OK;
}

static uint32_t render(const brume_scene *scene, const brume_render_desc *desc, float *out) {
    brume_render *r;
    brume_render_stats stats;
    OK(brume_render_create(device, scene, desc, &r));
    OK(brume_render_run(r, NULL, NULL));
    OK(brume_render_read(r, BRUME_CHANNEL_RADIANCE, out, FLOATS));
    OK(brume_render_get_stats(r, &stats));
    assert_int_equal(stats.bad_samples, 0);
    brume_render_destroy(r);
    return stats.features;
}

static double sum_of(const float *x) {
    double sum = 0;
    for (int i = 0; i < FLOATS; i++) sum += x[i];
    return sum;
}

/* Each bit that a scene doesn't call for, alone, and all of them: a kernel takes seconds to build, so at one lane. */
static void every_covering_mask_gives_the_same_bits(void **state) {
    (void)state;
    const parts scenes[] = {
        {.light = SPOT("60")},
        {.light = SPOT("60"), .medium = FOG("0.2", "0.75", "")},
        {.light = SPOT("60"), .medium = FOG("0.2, 0.3, 0.2", "0", "<rgb name='emission' value='0.1, 0.2, 0.3'/>")},
        {DEPTH("2"), .light = SPOT("60") "<emitter type='constant'/>", .medium = FOG("0.2", "0.75", "")},
        {.surface = "<bsdf type='dielectric'/><ref name='exterior' id='fog'/>",
         .light = "<shape type='rectangle'><transform name='to_world'><rotate x='1' angle='90'/><translate y='4'/>"
                  "</transform><emitter type='area'/></shape>",
         .medium = FOG("0.2", "0.75", HG("0.6"))},
    };
    static float special[FLOATS], other[FLOATS];
    int quick = getenv("BRUME_QUICK") != NULL;
    for (size_t i = 0; i < sizeof scenes / sizeof scenes[0]; i++) {
        brume_scene *scene = make(&scenes[i]);
        if (!open_device(scene)) {
            brume_scene_destroy(scene);
            skip();
        }
        brume_render_desc desc = brume_render_desc_default();
        desc.lanes = 1;
        desc.guides = 0;
        uint32_t needed = render(scene, &desc, special);
        assert_true(sum_of(special) > 0);
        for (uint32_t bit = 1; bit < FEATURE_ALL && !quick; bit <<= 1) {
            if ((needed & bit) || bit == FEATURE_GUIDES || bit == FEATURE_LIGHT_LAYERS) continue;
            desc.extra_features = bit;
            assert_int_equal(render(scene, &desc, other), needed | bit);
            if (memcmp(special, other, sizeof special) != 0) fail_msg("scene %zu with feature %u added", i, bit);
        }
        desc.extra_features = 0;
        desc.guides = desc.generic = desc.light_layers = 1;
        assert_int_equal(render(scene, &desc, other), FEATURE_ALL);
        assert_memory_equal(special, other, sizeof special);
        desc.lanes = 0;
        render(scene, &desc, other);
        assert_memory_equal(special, other, sizeof special);
        brume_scene_destroy(scene);
    }
}

/* What `without` leaves is what a description without the effect gives, to the bit, in the same program. */
static void without_is_a_description_without(void **state) {
    (void)state;
    static const char spot[] = SPOT("60"), fog[] = FOG("0.2, 0.3, 0.4", "0.75", HG("0.5"));
    const struct { uint32_t without; parts with, edited; } rows[] = {
        {EFFECT(MEDIA), {.light = spot, .medium = fog}, {.light = spot}},
        {EFFECT(ANISOTROPY), {.light = spot, .medium = fog},
         {.light = spot, .medium = FOG("0.2, 0.3, 0.4", "0.75", "")}},
        {EFFECT(CHROMATIC_EXTINCTION), {.light = spot, .medium = fog},
         {.light = spot, .medium = FOG("0.3", "0.75", HG("0.5"))}},
        {EFFECT(SCATTERING), {.light = spot, .medium = fog},
         {.light = spot, .medium = FOG("0.2, 0.3, 0.4", "0", HG("0.5"))}},
        {EFFECT(ABSORPTION), {.light = spot, .medium = FOG("0.25", "0.5", "")},
         {.light = spot, .medium = FOG("0.125", "1", "")}},
        {EFFECT(EMISSION), {.light = spot, .medium = FOG("0.2", "0", "<rgb name='emission' value='1'/>")},
         {.light = spot, .medium = FOG("0.2", "0", "")}},
        {EFFECT(MULTIPLE_SCATTERING), {.light = spot, .medium = fog},
         {"<boolean name='single_scattering' value='true'/>", .light = spot, .medium = fog}},
        /* black surfaces: no path is longer than two edges but those that the fog makes */
        {EFFECT(MULTIPLE_SCATTERING),
         {.light = spot, .medium = fog, .surface = "<bsdf type='diffuse'><rgb name='reflectance' value='0'/></bsdf>"},
         {DEPTH("2"), .light = spot, .medium = fog,
          .surface = "<bsdf type='diffuse'><rgb name='reflectance' value='0'/></bsdf>"}},
        /* the same for light that paths meet by themselves; emitters that name no bsdf are black */
        {EFFECT(MULTIPLE_SCATTERING), {.light = "<emitter type='constant'/>", .medium = fog,
                                       .surface = "<emitter type='area'/>"},
         {DEPTH("2"), .light = "<emitter type='constant'/>", .medium = fog, .surface = "<emitter type='area'/>"}},
        {EFFECT(SPOT_LIGHTS), {.light = SPOT("60") "<emitter type='point'/>"}, {.light = "<emitter type='point'/>"}},
        {EFFECT(ENVIRONMENT), {.light = SPOT("60") "<emitter type='constant'/>"}, {.light = spot}},
        {EFFECT(AREA_LIGHTS), {.light = spot, .surface = "<bsdf type='diffuse'/><emitter type='area'/>"},
         {.light = spot}},
        {EFFECT(AREA_LIGHTS), {.light = "<emitter type='constant'/>", .surface = "<emitter type='area'/>"},
         {.light = "<emitter type='constant'/>",
          .surface = "<bsdf type='diffuse'><rgb name='reflectance' value='0'/></bsdf>"}},
        {EFFECT(TEXTURES),
         {.light = spot, .surface = "<bsdf type='diffuse'><texture name='reflectance' type='checkerboard'>"
                                    "<rgb name='color0' value='0.25'/><rgb name='color1' value='0.75'/></texture>"
                                    "</bsdf>"},
         {.light = spot}},
        {EFFECT(LENS),
         {.light = spot, .sensor = "<float name='aperture_radius' value='0.2'/>"
                                   "<float name='focus_distance' value='4'/>"},
         {.light = spot}},
    };
    static float without[FLOATS], edited[FLOATS], full[FLOATS];
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        brume_scene *with = make(&rows[i].with), *by_hand = make(&rows[i].edited);
        brume_render_desc desc = brume_render_desc_default();
        if (!open_device(with)) {
            brume_scene_destroy(with);
            brume_scene_destroy(by_hand);
            skip();
        }
        desc.lanes = 1;
        desc.guides = 0;
        render(with, &desc, full);
        uint32_t expected = render(by_hand, &desc, edited);
        desc.without = rows[i].without;
        uint32_t features = render(with, &desc, without);
        if (features != expected) fail_msg("row %zu: features %u instead of %u", i, features, expected);
        if (memcmp(without, edited, sizeof without) != 0) fail_msg("row %zu: not what is left by hand", i);
        if (memcmp(without, full, sizeof without) == 0) fail_msg("row %zu: nothing was taken away", i);
        brume_scene_destroy(with);
        brume_scene_destroy(by_hand);
    }
}

static int leave(void **state) {
    brume_device_destroy(device);
    return scene_files_leave(state);
}

int main(void) {
    const struct CMUnitTest shipped[] = {
        cmocka_unit_test(what_the_scenes_call_for),
    };
    const struct CMUnitTest written[] = {
        cmocka_unit_test(one_effect_more),
        cmocka_unit_test(reports_name_the_object),
        cmocka_unit_test(names_and_misuse),
        cmocka_unit_test(there_are_so_many_programs),
        cmocka_unit_test(every_covering_mask_gives_the_same_bits),
        cmocka_unit_test(without_is_a_description_without),
    };
    int failed = cmocka_run_group_tests(shipped, NULL, NULL);
    return failed + cmocka_run_group_tests(written, scene_files_enter, leave);
}

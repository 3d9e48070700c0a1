/* test_short_ways.c -- what a ray doesn't call for it doesn't pay for, in a program that has the code: no scattering is
 * looked for in a medium that only absorbs, no lamp along a segment that no cone meets, and a beam that nothing hides
 * is integrated. A change is planted into the long way: where rays take the short one the picture stays the same bits,
 * and where they don't it does not. At one lane, where no ray shares another's way. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "../cl/shared.h"
#include "planted.h"
#include "scene_files.h"

enum { WIDTH = 32, HEIGHT = 24, FLOATS = WIDTH * HEIGHT * 3 };

static brume_device *device;

/* A medium; a spot's beam across the middle of the picture, along x; far behind it a wall. */
typedef struct parts {
    const char *albedo, *reflectance, *more;
} parts;

static brume_scene *make(const parts *p) {
    static char text[4096];
    snprintf(text, sizeof text,
             SCENE("<integrator type='volpath'><integer name='max_depth' value='2'/></integrator>\n"
                   "<medium type='homogeneous' id='fog'><rgb name='sigma_t' value='0.05'/>"
                   "<rgb name='albedo' value='%s'/></medium>\n"
                   "<sensor type='perspective'><transform name='to_world'>"
                   "<lookat origin='0,0,9' target='0,0,0' up='0,1,0'/></transform><float name='fov' value='40'/>"
                   "<ref id='fog'/><film type='hdrfilm'><integer name='width' value='32'/>"
                   "<integer name='height' value='24'/><rfilter type='box'/></film>"
                   "<sampler type='independent'><integer name='sample_count' value='4'/></sampler></sensor>\n"
                   "<emitter type='spot'><transform name='to_world'>"
                   "<lookat origin='-8,0,0' target='0,0,0' up='0,1,0'/></transform>"
                   "<rgb name='intensity' value='50'/><float name='cutoff_angle' value='8'/></emitter>\n"
                   "<shape type='rectangle'><transform name='to_world'><scale value='40'/><translate z='-20'/>"
                   "</transform><bsdf type='diffuse'><rgb name='reflectance' value='%s'/></bsdf></shape>\n%s"),
             p->albedo, p->reflectance, p->more);
    return scene_files_good(text);
}

static void render(const parts *p, brume_strategy strategy, float out[FLOATS]) {
    brume_scene *scene = make(p);
    brume_render *r;
    brume_render_desc desc = brume_render_desc_default();
    desc.lanes = 1;
    desc.guides = desc.error_estimate = 0;
    desc.use_strategy = 1;
    desc.strategy = strategy;
    desc.extra_features = FEATURE_SCATTERING; /* whether the scene calls for it or not */
    if (brume_render_create(device, scene, &desc, &r) != BRUME_OK || brume_render_run(r, NULL, NULL) != BRUME_OK ||
        brume_render_read(r, BRUME_CHANNEL_RADIANCE, out, FLOATS) != BRUME_OK)
        fail_msg("%s", brume_context_message(scene->context));
    brume_render_destroy(r);
    brume_scene_destroy(scene);
}

/* Renders the scene by the library's kernels and with that planted, and tells how many values are lit, how many of
 * these the same bits, and how many of those that aren't lit. */
typedef struct effect {
    int lit, lit_same, dark_same;
} effect;

static effect plant(const parts *p, brume_strategy strategy, const char *file, const char *right, const char *wrong) {
    static float own[FLOATS], other[FLOATS];
    effect e = {0, 0, 0};
    render(p, strategy, own);
    planted_bug(file, right, wrong);
    render(p, strategy, other);
    planted_remove();
    for (int k = 0; k < FLOATS; k++) {
        int same = memcmp(&own[k], &other[k], sizeof *own) == 0;
        e.lit += own[k] > 0;
        e.lit_same += own[k] > 0 && same;
        e.dark_same += own[k] == 0 && same;
    }
    return e;
}

static void nothing_scatters_in_a_medium_that_absorbs(void **state) {
    (void)state;
    static const char file[] = "path_medium.h", right[] = "mask camera = p->segments == I(0);",
                      wrong[] = "p->throughput = cgrey(R(0.5)); mask camera = p->segments == I(0);";
    if (!device) skip();
    static const char lamp[] = "<emitter type='point'><point name='position' x='0' y='0' z='9'/>"
                               "<rgb name='intensity' value='50'/></emitter>";
    const parts absorbs = {"0", "0.5", lamp}, scatters = {"0.5", "0.5", lamp};
    effect e = plant(&absorbs, BRUME_STRATEGY_AUTO, file, right, wrong);
    assert_int_equal(e.lit, FLOATS);
    assert_int_equal(e.lit_same, FLOATS);
    e = plant(&scatters, BRUME_STRATEGY_AUTO, file, right, wrong);
    assert_int_equal(e.lit, FLOATS);
    assert_int_equal(e.lit_same, 0);
}

static void no_lamp_is_asked_where_no_cone_is(void **state) {
    (void)state;
    if (!device) skip();
    const parts fog = {"0.5", "0", ""};
    effect e = plant(&fog, BRUME_STRATEGY_AUTO, "scatter_segment.h", "value = cadd(value, scatter_interval(",
                     "value = cadd(cgrey(R(1000)), scatter_interval(");
    assert_in_range(e.lit, FLOATS / 10, FLOATS / 2);
    assert_int_equal(e.lit_same, 0);
    assert_int_equal(e.dark_same, FLOATS - e.lit);
}

/* By the default, which knows from its pilot what is open: no points are chosen for shadow rays to go from, but one,
 * which takes off what it finds hidden nevertheless. By another, which looks along each ray: no shadow ray at all. */
static void a_beam_that_nothing_hides_is_integrated(void **state) {
    (void)state;
    static const struct { brume_strategy strategy; const char *right, *wrong; } rows[] = {
        {BRUME_STRATEGY_AUTO, "if (shaped) table =", "if (shaped) sum = cgrey(R(1000)); if (shaped) table ="},
        {BRUME_STRATEGY_SYSTEMATIC, "mask hidden = occluded(", "sum = cgrey(R(1000)); mask hidden = occluded("},
    };
    const parts fog = {"0.5", "0", ""},
                hidden = {"0.5", "0", "<shape type='rectangle'><transform name='to_world'><scale value='0.3'/>"
                                      "<rotate y='1' angle='90'/><translate x='-4'/></transform>"
                                      "<bsdf type='diffuse'><rgb name='reflectance' value='0'/></bsdf></shape>"};
    if (!device) skip();
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        effect e = plant(&fog, rows[i].strategy, "scatter_segment.h", rows[i].right, rows[i].wrong);
        assert_in_range(e.lit, FLOATS / 10, FLOATS / 2);
        assert_int_equal(e.lit_same, e.lit);
        e = plant(&hidden, rows[i].strategy, "scatter_segment.h", rows[i].right, rows[i].wrong);
        assert_in_range(e.lit_same, 0, e.lit - FLOATS / 20);
    }
}

static int enter(void **state) {
    static const parts any = {"0.5", "0", ""};
    if (scene_files_enter(state) != 0) return -1;
    brume_scene *scene = make(&any);
    if (brume_device_open(scene->context, BRUME_DEVICE_ANY, &device) != BRUME_OK) device = NULL;
    brume_scene_destroy(scene);
    return 0;
}

static int leave(void **state) {
    planted_remove();
    brume_device_destroy(device);
    return scene_files_leave(state);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(nothing_scatters_in_a_medium_that_absorbs),
        cmocka_unit_test(no_lamp_is_asked_where_no_cone_is),
        cmocka_unit_test(a_beam_that_nothing_hides_is_integrated),
    };
    return cmocka_run_group_tests(tests, enter, leave);
}

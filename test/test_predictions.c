/* test_predictions.c -- what a render says of when it will be done, by a made-up clock (faults/cl_shim.h): nothing here
 * depends on how long anything takes. How good the predictions are in ten scenes, `make estimates` measures.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "faults/cl_shim.h"
#include "open_device.h"
#include "render.h"

enum { WIDTH = 64, HEIGHT = 40, MOST = 64 };
#define SLOW 1e-4 /* seconds of a sample of one pixel: a pass takes longer than a launch may */
#define FAST 1e-5

typedef struct told {
    brume_progress reports[MOST];
    int count;
    double faster_after; /* samples per pixel from which the device is FAST; 0: always SLOW */
} told;

static int keep(void *user, const brume_progress *progress) {
    told *l = user;
    assert_true(l->count < MOST);
    l->reports[l->count++] = *progress;
    if (l->faster_after > 0 && progress->work >= l->faster_after) cl_shim_set_speed(FAST);
    return 0;
}

/* Only new predictions and the end are reported. */
static void watch(double faster_after, told *l) {
    static const brume_parameter parameters[] = {{"width", "64"}, {"height", "40"}};
    brume_scene *scene;
    brume_render *render;
    brume_render_desc desc = brume_render_desc_default();
    must(brume_scene_load(context, "scenes/ladder/half-hidden.xml", parameters, 2, &scene));
    desc.lanes = 1;
    desc.guides = 0;
    desc.noise_threshold = 5e-4;
    must(brume_render_create(device, scene, &desc, &render));
    render->report_seconds = 1e30;
    l->count = 0;
    l->faster_after = faster_after;
    cl_shim_set_speed(SLOW);
    brume_result result = brume_render_run(render, keep, l);
    cl_shim_set_speed(0);
    must(result);
    brume_render_destroy(render);
    brume_scene_destroy(scene);
}

/* The seconds ahead over what the work ahead takes at that speed: 1. */
static double off_by(const brume_progress *p, double speed) {
    return (p->predicted_seconds - p->seconds) / (speed * WIDTH * HEIGHT * (p->predicted_work - p->work));
}

static void each_is_told_once(void **state) {
    (void)state;
    NEEDS_DEVICE();
    static told l;
    watch(0, &l);
    assert_true(l.count >= 5);
    for (int i = 0; i + 1 < l.count; i++) {
        const brume_progress *p = &l.reports[i];
        assert_true(p->predicted_work >= p->work && p->predicted_seconds >= p->seconds);
        assert_true(p->predicted_low <= p->predicted_seconds && p->predicted_seconds <= p->predicted_high);
        assert_true(i == 0 || p->work > l.reports[i - 1].work);
    }
    assert_true(l.reports[l.count - 1].fraction == 1);
}

/* The time ahead is that of the work ahead at the rate of the latest stage, the pilot's and the first stage's aside. */
static void time_follows_the_device(void **state) {
    (void)state;
    NEEDS_DEVICE();
    static told l;
    watch(0, &l);
    int checked = 0;
    for (int i = 1; i + 2 < l.count; i++, checked++) {
        print_message("%g of %g samples, seconds off by %g\n", l.reports[i].work, l.reports[i].predicted_work,
                      off_by(&l.reports[i], SLOW));
        if (l.reports[i].predicted_work > l.reports[i].work)
            assert_float_equal(off_by(&l.reports[i], SLOW), 1, 0.01);
    }
    assert_true(checked >= 2);

    /* Ten times as fast from the third report on: known after one stage; by all the time so far it would not be. */
    watch(l.reports[2].work, &l);
    int later = 0;
    for (int i = 3; i + 2 < l.count; i++) {
        const brume_progress *p = &l.reports[i];
        if (!(p->predicted_work > p->work)) continue;
        double naive = p->predicted_work * p->seconds / p->work - p->seconds;
        assert_float_equal(off_by(p, FAST), 1, 0.01);
        assert_true(naive > 1.5 * (p->predicted_seconds - p->seconds));
        later++;
    }
    assert_true(later >= 1);
}

/* What the first prediction says of the work, over what it takes. */
typedef struct first_told {
    double ratio, naive; /* naive: as if the error fell by as much as samples grow, which is what independent ones do */
    int inside;          /* the interval */
} first_told;

static first_told first_of(const char *path, uint32_t seed, double target) {
    static const brume_parameter parameters[] = {{"width", "96"}, {"height", "60"}};
    static told l;
    brume_scene *scene;
    brume_render *render;
    brume_render_desc desc = brume_render_desc_default();
    must(brume_scene_load(context, path, parameters, 2, &scene));
    desc.guides = 0;
    desc.noise_threshold = target;
    desc.use_seed = 1;
    desc.seed = seed;
    must(brume_render_create(device, scene, &desc, &render));
    render->report_seconds = 1e30;
    l.count = 0;
    l.faster_after = 0;
    cl_shim_set_speed(FAST);
    brume_result result = brume_render_run(render, keep, &l);
    cl_shim_set_speed(0);
    must(result);
    brume_render_destroy(render);
    brume_scene_destroy(scene);
    assert_true(l.count >= 2);
    const brume_progress *p = &l.reports[0];
    double needed = l.reports[l.count - 1].work;
    double scale = (p->predicted_work - p->work) / (p->predicted_seconds - p->seconds);
    assert_true(needed > 2 * p->work);
    return (first_told){
        .ratio = p->predicted_work / needed,
        .naive = p->work * p->relmse / target / needed,
        .inside = needed >= p->work + scale * (p->predicted_low - p->seconds) &&
                  needed <= p->work + scale * (p->predicted_high - p->seconds),
    };
}

/* By 8 samples, of a beam's edges behind a wall and of shadows with many edges: of 135 first predictions of ten scenes
 * in this size 99 % were right to a factor of two and 95 % in their interval. Of 12 at least 9 are to be, which chance
 * lets happen all but once in 200000, and in 400. Planted: that errors fell as samples grow. */
static void first_predictions_hold(void **state) {
    (void)state;
    NEEDS_DEVICE();
    enum { SEEDS = 6, ALL = 2 * SEEDS, ENOUGH = 9 };
    int right = 0, naive = 0, inside = 0;
    for (uint32_t i = 0; i < ALL; i++) {
        first_told f = i < SEEDS ? first_of("scenes/ladder/half-hidden.xml", i, 5e-4)
                                 : first_of("scenes/ladder/slats.xml", i, 1e-3);
        right += f.ratio > 0.5 && f.ratio < 2;
        naive += f.naive > 0.5 && f.naive < 2;
        inside += f.inside;
        print_message("%.2f %s, naive %.2f\n", f.ratio, f.inside ? "inside" : "outside", f.naive);
    }
    assert_true(right >= ENOUGH && inside >= ENOUGH);
    assert_true(naive < ENOUGH);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(each_is_told_once),
        cmocka_unit_test(time_follows_the_device),
        cmocka_unit_test(first_predictions_hold),
    };
    return cmocka_run_group_tests(tests, open_device, close_device);
}

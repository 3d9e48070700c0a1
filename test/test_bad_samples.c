/* test_bad_samples.c -- samples that come out NaN or infinite, planted: each is dropped, counted, and known by its
 * pixel and number; nothing else of the picture changes. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include "device_test.h"
#include "known_answer.h"
#include "planted.h"
#include "render.h"

enum { SAMPLES = 8, COUNT = PIXELS * PIXELS };

static char last_warning[512];

static void keep_warning(void *user, brume_log_level level, const char *message) {
    (void)user;
    if (level == BRUME_LOG_WARNING) snprintf(last_warning, sizeof last_warning, "%s", message);
}

/* A point light in fog before a wall: every ray meets fog and wall, and every path is lit on both. */
static brume_scene *fog_and_wall(void) {
    const view wide = {{0, 0, 0}, {0, 0, 1}, {0, 1, 0}, 60};
    brume_scene *scene = new_scene(4, SAMPLES);
    set_camera(scene, &wide, add_medium(scene, 0.2, 0.9, 0.5, 0));
    add_wall(scene, 5, 40, 0.8);
    add_point(scene, 0.5, 1.5, 2);
    return scene;
}

static brume_render *rendered(const brume_render_desc *desc) {
    brume_scene *scene = fog_and_wall();
    brume_render *out;
    last_warning[0] = '\0';
    must(brume_render_create(device, scene, desc, &out));
    must(brume_render_run(out, NULL, NULL));
    brume_scene_destroy(scene);
    return out;
}

static brume_render_desc plain(uint32_t lanes) {
    brume_render_desc desc = brume_render_desc_default();
    desc.lanes = lanes;
    return desc;
}

static const char start[] = "    p.radiance = cgrey(R(0));";

/* One sample of one pixel. */
static void one_bad_sample_is_dropped_and_known(void **state) {
    (void)state;
    NEEDS_DEVICE();
    static float good[COUNT * 3], found[COUNT * 3], bad[COUNT], counts[COUNT];
    static const uint32_t widths[] = {1, 16};
    for (size_t w = 0; w < 2; w++) {
        brume_render_desc desc = plain(widths[w]);
        brume_render *render = rendered(&desc);
        brume_render_stats stats;
        must(brume_render_read(render, BRUME_CHANNEL_RADIANCE, good, COUNT * 3));
        must(brume_render_read(render, BRUME_CHANNEL_BAD_SAMPLES, bad, COUNT));
        must(brume_render_get_stats(render, &stats));
        assert_int_equal(stats.bad_samples, 0);
        assert_string_equal(last_warning, "");
        for (int i = 0; i < COUNT; i++) assert_true(bad[i] == 0);
        brume_render_destroy(render);

        planted_bug("path_state.h", start,
                    "    p.radiance = cgrey(((x == I(5)) & (y == I(3)) & (to_ireal(sample) == I(6))) ? REAL_NAN : R(0));");
        render = rendered(&desc);
        planted_remove();
        must(brume_render_get_stats(render, &stats));
        assert_int_equal(stats.bad_samples, 1);
        assert_int_equal(stats.bad_pixel_x, 5);
        assert_int_equal(stats.bad_pixel_y, 3);
        assert_int_equal(stats.bad_sample, 6);
        assert_non_null(strstr(last_warning, "pixel 5, 3 sample 6"));
        must(brume_render_read(render, BRUME_CHANNEL_RADIANCE, found, COUNT * 3));
        must(brume_render_read(render, BRUME_CHANNEL_BAD_SAMPLES, bad, COUNT));
        must(brume_render_read(render, BRUME_CHANNEL_SAMPLE_COUNT, counts, COUNT));
        brume_render_destroy(render);
        for (int i = 0; i < COUNT; i++) {
            int here = i == 3 * PIXELS + 5;
            assert_true(bad[i] == here && counts[i] == SAMPLES - here);
            if (here)
                assert_true(isfinite(found[3 * i]) && found[3 * i] > 0);
            else
                assert_memory_equal(found + 3 * i, good + 3 * i, 3 * sizeof *good);
        }
    }
}

static int stop_soon(void *user, const brume_progress *progress) {
    (void)progress;
    return --*(int *)user < 0;
}

/* Of each pixel, whatever it got and wherever the render stopped; and in the file. */
static void each_pixel_knows_how_many(void **state) {
    (void)state;
    NEEDS_DEVICE();
    static float bad[COUNT], counts[COUNT];
    brume_render_desc uniform = plain(16), adaptive = plain(16), stopped = plain(16);
    adaptive.sample_count = 40;
    adaptive.adaptive = BRUME_ADAPTIVE_ON;
    stopped.sample_count = 1 << 14;
    const brume_render_desc *const descs[] = {&uniform, &adaptive, &stopped};
    /* Infinite, so that a sum of two of them with different signs would be NaN. */
    planted_bug("path_state.h", start,
                "    p.radiance = cgrey(((x & I(3)) == I(1)) & (y == I(9)) ? -REAL_INF : R(0));");
    for (int k = 0; k < 3; k++) {
        brume_scene *scene = fog_and_wall();
        brume_render *render;
        brume_render_stats stats;
        int calls = 50;
        must(brume_render_create(device, scene, descs[k], &render));
        render->launch_groups = 3;
        render->report_seconds = -1;
        assert_int_equal(brume_render_run(render, k == 2 ? stop_soon : NULL, &calls),
                         k == 2 ? BRUME_CANCELLED : BRUME_OK);
        must(brume_render_get_stats(render, &stats));
        assert_int_equal(stats.complete, k != 2);
        must(brume_render_read(render, BRUME_CHANNEL_BAD_SAMPLES, bad, COUNT));
        must(brume_render_read(render, BRUME_CHANNEL_SAMPLE_COUNT, counts, COUNT));
        double all = 0, added = 0;
        for (int i = 0; i < COUNT; i++) {
            int here = i / PIXELS == 9 && i % 4 == 1;
            assert_true(here ? counts[i] == 0 && bad[i] > 0 : bad[i] == 0 && counts[i] > 0);
            all += bad[i];
            added += counts[i];
        }
        assert_true(all == (double)stats.bad_samples);
        assert_true(all + added == (double)stats.samples);
        if (k == 0) {
            char text[4096], path[64];
            snprintf(path, sizeof path, "/tmp/brume-bad-samples-%ld.exr", (long)getpid());
            must(brume_render_write(render, path, NULL));
            FILE *file = fopen(path, "rb");
            assert_non_null(file);
            size_t size = fread(text, 1, sizeof text - 1, file);
            fclose(file);
            unlink(path);
            int named = 0;
            for (size_t i = 0; i + 10 < size; i++) named |= memcmp(text + i, "badSamples", 10) == 0;
            assert_true(named);
        }
        brume_render_destroy(render);
        brume_scene_destroy(scene);
    }
    planted_remove();
}

/* Stops within an adaptive pass. */
typedef struct stopper { const brume_render *render; int passes; } stopper;

static int stop_within(void *user, const brume_progress *progress) {
    stopper *s = user;
    (void)progress;
    return s->render->ends && s->render->pass.groups_done > 0 && --s->passes == 0;
}

/* A schedule packs the pixels that take part, wherever they lie: those that have been through are known by it. */
static void adaptive_passes_are_cut_short(void **state) {
    (void)state;
    NEEDS_DEVICE();
    enum { WIDTH = 48, HEIGHT = 30 };
    static const brume_parameter parameters[] = {{"width", "48"}, {"height", "30"}};
    static float bad[WIDTH * HEIGHT];
    brume_render_desc desc = plain(4);
    brume_scene *scene;
    brume_render *render;
    desc.sample_count = 32;
    desc.adaptive = BRUME_ADAPTIVE_ON;
    must(brume_scene_load(context, "scenes/ladder/slats.xml", parameters, 2, &scene));
    planted_bug("path_state.h", start, "    p.radiance = cgrey(((x & I(3)) == I(1)) & (y == I(9)) ? REAL_NAN : R(0));");
    must(brume_render_create(device, scene, &desc, &render));
    planted_remove();
    render->launch_groups = 30;
    render->report_seconds = -1;
    int stops = 0;
    for (;; stops++) {
        stopper s = {render, 2};
        brume_result result = brume_render_run(render, stop_within, &s);
        if (result == BRUME_OK) break;
        assert_int_equal(result, BRUME_CANCELLED);
        brume_render_stats stats;
        double all = 0;
        must(brume_render_get_stats(render, &stats));
        must(brume_render_read(render, BRUME_CHANNEL_BAD_SAMPLES, bad, WIDTH * HEIGHT));
        for (int i = 0; i < WIDTH * HEIGHT; i++) {
            assert_true(i / WIDTH == 9 && i % 4 == 1 ? bad[i] > 0 : bad[i] == 0);
            all += bad[i];
        }
        assert_true(all == (double)stats.bad_samples);
    }
    print_message("%d stops\n", stops);
    assert_true(stops >= 3);
    brume_render_destroy(render);
    brume_scene_destroy(scene);
}

/* Dropped behind the wall that the guides are of: they are means over the samples that are left. */
static void guides_go_with_their_sample(void **state) {
    (void)state;
    NEEDS_DEVICE();
    static float right[COUNT * 3], found[COUNT * 3];
    static const brume_channel channels[] = {BRUME_CHANNEL_ALBEDO, BRUME_CHANNEL_NORMAL};
    brume_render_desc desc = plain(1);
    brume_render *good = rendered(&desc);
    planted_bug("path.h", "p->depth = turns ? p->depth + I(1) : p->depth;",
                "p->depth = turns ? p->depth + I(1) : p->depth;\n"
                "    path_break(p, turns & (p->random.index % U32(2) == U32(1)));");
    brume_render *bad = rendered(&desc);
    planted_remove();
    brume_render_stats stats;
    must(brume_render_get_stats(bad, &stats));
    assert_true(stats.bad_samples > stats.samples / 4 && stats.bad_samples < stats.samples);
    for (size_t c = 0; c < 2; c++) {
        must(brume_render_read(good, channels[c], right, COUNT * 3));
        must(brume_render_read(bad, channels[c], found, COUNT * 3));
        for (int i = 0; i < 3 * COUNT; i++) assert_float_equal(found[i], right[i], 1e-5);
    }
    brume_render_destroy(good);
    brume_render_destroy(bad);
}

/* Wherever on its way a path meets a NaN: none is lost in a comparison, to leave a picture that is too dark. */
static void nowhere_is_one_lost(void **state) {
    (void)state;
    NEEDS_DEVICE();
    static const struct { const char *what, *file, *right, *wrong; int guides; } plants[] = {
        {"direction of the camera", "camera.h", "r.d = vscale(through, R(1) / length);",
         "r.d = vscale(through, REAL_NAN);", 0},
        {"transmittance", "medium.h", "if (!HAS(CHROMATIC)) return cgrey(lexp(-sigma_t.r * t));",
         "if (!HAS(CHROMATIC)) return cgrey(REAL_NAN);", 0},
        {"phase function", "phase_hg.h", "return (R(1) - a) * (R(1) + a) * R(0.25 / PI) / (x * sqrt(x));",
         "return REAL_NAN;", 0},
        {"connection", "path_indirect.h",
         "out.value = cmul(out.value, cmul(cmul(fog.sigma_t, fog.albedo), cmul(m->sigma_t, m->albedo)));",
         "out.value = cgrey(REAL_NAN);", 0},
        {"albedo, for the guides", "path.h", "path_guides(p, &at, h.t, bsdf_albedo(&v.b),",
         "path_guides(p, &at, h.t, cgrey(REAL_INF),", 1},
    };
    for (size_t i = 0; i < sizeof plants / sizeof plants[0]; i++) {
        brume_render_desc desc = plain(1);
        brume_render_stats stats;
        desc.guides = (uint32_t)plants[i].guides;
        desc.sample_count = 2;
        planted_bug(plants[i].file, plants[i].right, plants[i].wrong);
        brume_render *render = rendered(&desc);
        planted_remove();
        must(brume_render_get_stats(render, &stats));
        brume_render_destroy(render);
        print_message("%s: %llu of %llu\n", plants[i].what, (unsigned long long)stats.bad_samples,
                      (unsigned long long)stats.samples);
        if (stats.bad_samples != stats.samples)
            fail_msg("%s: %llu of %llu samples are known to be bad", plants[i].what,
                     (unsigned long long)stats.bad_samples, (unsigned long long)stats.samples);
    }
}

/* The options with which a compiler may assume that there are neither NaNs nor infinities. */
static void found_by_their_bits(void **state) {
    (void)state;
    if (!device_test_offers(BRUME_PRECISION_FLOAT)) skip();
    static const char kernel[] = "#include \"film.h\"\n"
                                 "__kernel void test(__global const LANE_REAL *a, __global const LANE_REAL *b,\n"
                                 "                   __global uint *loaded, __global uint *computed) {\n"
                                 "    real x = LOAD(a + AT), y = LOAD(b + AT);\n"
                                 "    STORE_MASK(loaded + AT, is_bad(x));\n"
                                 "    STORE_MASK(computed + AT, is_bad(x / y));\n"
                                 "}\n";
    static const char *const options[] = {"", "-cl-finite-math-only", "-cl-fast-relaxed-math"};
    double a[16], b[16];
    const double values[8] = {0, 1, -1, INFINITY, -INFINITY, NAN, 1e-30, 3e38};
    for (int i = 0; i < 16; i++) {
        a[i] = values[i % 8];
        b[i] = i < 8 ? 0 : 2;
    }
    for (int precision = 0; precision < 2; precision++)
        for (uint32_t lanes = 1; lanes <= 16; lanes += 15)
            for (size_t k = 0; k < 3 && device_test_offers((brume_precision)precision); k++) {
                uint32_t loaded[16], computed[16];
                const device_array arrays[] = {{READ_REAL, a, 16}, {READ_REAL, b, 16},
                                               {WRITE_BITS, loaded, 16}, {WRITE_BITS, computed, 16}};
                device_test_run(kernel, options[k], lanes, (brume_precision)precision, 16, arrays, 4);
                for (int i = 0; i < 16; i++) {
                    double quotient = a[i] / b[i];
                    if (loaded[i] != !isfinite(a[i]) || computed[i] != !isfinite(quotient))
                        fail_msg("%s, %u lanes: %g / %g: %u, %u", options[k], lanes, a[i], b[i], loaded[i],
                                 computed[i]);
                }
            }
}

static int setup(void **state) {
    if (open_device(state) != 0) return -1;
    brume_context_set_log(context, keep_warning, NULL);
    return device_test_setup(state);
}

static int teardown(void **state) {
    device_test_teardown(state);
    return close_device(state);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(one_bad_sample_is_dropped_and_known),
        cmocka_unit_test(each_pixel_knows_how_many),
        cmocka_unit_test(adaptive_passes_are_cut_short),
        cmocka_unit_test(guides_go_with_their_sample),
        cmocka_unit_test(nowhere_is_one_lost),
        cmocka_unit_test(found_by_their_bits),
    };
    return cmocka_run_group_tests(tests, setup, teardown);
}

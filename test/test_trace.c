/* test_trace.c -- one sample, explained: what the trace tells is what the picture got, to the bit. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "known_answer.h"
#include "planted.h"

/* Each vertex goes on where the one before it stood. */
static void check_path(const brume_trace *t) {
    double sums[3] = {0, 0, 0};
    assert_true(t->count > 0);
    for (size_t i = 0; i < t->count; i++) {
        const brume_trace_vertex *v = &t->vertices[i];
        assert_int_equal(v->ends, i + 1 == t->count);
        assert_true(fabs(1 - hypot(hypot(v->direction[0], v->direction[1]), v->direction[2])) < 1e-5);
        assert_int_equal(v->shape == BRUME_NONE, v->event != BRUME_TRACE_SURFACE && v->event != BRUME_TRACE_PASSED);
        if (v->event == BRUME_TRACE_SCATTERED) assert_true(v->medium != BRUME_NONE);
        for (int c = 0; c < 3; c++) {
            sums[c] += (double)v->along[c] + v->met[c] + v->lit[c];
            assert_true(fabs(sums[c] - v->radiance[c]) <= 1e-6 * (1e-6 + fabs(sums[c])));
            if (i == 0) continue;
            const brume_trace_vertex *before = v - 1;
            double there = before->position[c] + (double)v->length * v->direction[c];
            assert_true(before->throughput_after[c] == v->throughput_before[c]);
            if (v->event != BRUME_TRACE_ESCAPED) /* rays start a little off the surface they leave */
                assert_true(fabs(there - v->position[c]) < 1e-4 * (1 + fabs(there) + v->length));
        }
    }
}

/* Samples of pixels along a diagonal, as a picture of all at 16 lanes has them. Counts events of each kind. */
static void compare(const brume_scene *scene, brume_precision precision, uint32_t first, uint32_t events[6]) {
    enum { SIDE = 3 };
    brume_film_desc film;
    brume_render_desc desc = brume_render_desc_default();
    float pixels[SIDE * SIDE * 3];
    brume_render *render;
    must(brume_scene_get_film(scene, &film));
    desc.precision = precision;
    desc.lanes = 16;
    desc.use_crop = 1;
    desc.crop_x = film.width / 2;
    desc.crop_y = film.height / 2;
    desc.crop_width = desc.crop_height = SIDE;
    desc.first_sample = first;
    desc.sample_count = 1;
    must(brume_render_create(device, scene, &desc, &render));
    must(brume_render_run(render, NULL, NULL));
    must(brume_render_read(render, BRUME_CHANNEL_RADIANCE, pixels, SIDE * SIDE * 3));
    brume_render_destroy(render);
    for (uint32_t i = 0; i < SIDE; i++) {
        brume_trace t;
        must(brume_sample_trace(device, scene, &desc, desc.crop_x + i, desc.crop_y + i, first, &t));
        assert_memory_equal(t.radiance, pixels + 3 * (SIDE * i + i), sizeof t.radiance);
        assert_int_equal(t.bad, 0);
        check_path(&t);
        for (size_t k = 0; k < t.count; k++) events[t.vertices[k].event]++;
        brume_trace_free(&t);
        assert_null(t.vertices);
    }
}

static void the_trace_is_what_the_picture_got(void **state) {
    (void)state;
    NEEDS_DEVICE();
    uint32_t events[6] = {0};
    const brume_parameter small[] = {{"width", "64"}, {"height", "40"}};
    brume_scene *scene;
    must(brume_scene_load(context, "scenes/ladder/slats.xml", small, 2, &scene));
    compare(scene, BRUME_PRECISION_FLOAT, 3, events); /* with a pilot */
    brume_scene_destroy(scene);
    must(brume_scene_load(context, "scenes/glass-in-fog.xml", NULL, 0, &scene));
    compare(scene, BRUME_PRECISION_FLOAT, 1000, events);
    brume_scene_destroy(scene);
    assert_true(events[BRUME_TRACE_SCATTERED] > 0 && events[BRUME_TRACE_SURFACE] > 0);
}

/* Adaptive sampling gives pixels that it chooses more points along their rays, where the pilot saw but shadow. A pixel is
 * then the mean of what its samples' traces say, and those of the same samples placed evenly say something else. */
static void chosen_samples_are_traced_as_chosen(void **state) {
    (void)state;
    NEEDS_DEVICE();
    enum { WIDTH = 32, HEIGHT = 20, PIXELS_OF_IT = WIDTH * HEIGHT, FIRST_CHOSEN = 8, MOST = 32, ENOUGH = 2 };
    const brume_parameter small[] = {{"width", "32"}, {"height", "20"}};
    static float radiance[PIXELS_OF_IT * 3], counts[PIXELS_OF_IT];
    brume_render_desc even = brume_render_desc_default(), desc = even;
    brume_scene *scene;
    brume_render *render;
    must(brume_scene_load(context, "scenes/ladder/slats.xml", small, 2, &scene));
    desc.adaptive = BRUME_ADAPTIVE_ON;
    desc.sample_count = 32;
    must(brume_render_create(device, scene, &desc, &render));
    must(brume_render_run(render, NULL, NULL));
    must(brume_render_read(render, BRUME_CHANNEL_RADIANCE, radiance, PIXELS_OF_IT * 3));
    must(brume_render_read(render, BRUME_CHANNEL_SAMPLE_COUNT, counts, PIXELS_OF_IT));
    brume_render_destroy(render);
    int found = 0;
    for (uint32_t i = PIXELS_OF_IT / 2; i < PIXELS_OF_IT && found < ENOUGH; i++) {
        uint32_t count = (uint32_t)counts[i], x = i % WIDTH, y = i / WIDTH;
        double sum[3] = {0, 0, 0};
        int differ = 0;
        if (count <= FIRST_CHOSEN || count > MOST) continue;
        for (uint32_t k = 0; k < count && (differ || k < 2); k++) {
            uint32_t sample = k < 2 ? FIRST_CHOSEN + k : k < FIRST_CHOSEN + 2 ? k - 2 : k; /* those first that tell */
            brume_trace chosen, evenly;
            must(brume_sample_trace(device, scene, &desc, x, y, sample, &chosen));
            must(brume_sample_trace(device, scene, &even, x, y, sample, &evenly));
            int differs = memcmp(chosen.radiance, evenly.radiance, sizeof chosen.radiance) != 0;
            assert_true(!differs || sample >= FIRST_CHOSEN);
            differ |= differs;
            for (int c = 0; c < 3; c++) sum[c] += chosen.radiance[c];
            brume_trace_free(&chosen);
            brume_trace_free(&evenly);
        }
        if (!differ) continue;
        found++;
        for (int c = 0; c < 3; c++)
            assert_true(fabs(sum[c] / count - radiance[3 * i + c]) <= 1e-6 * (sum[c] / count));
    }
    assert_int_equal(found, ENOUGH);
    brume_scene_destroy(scene);
}

static void a_bad_sample_says_where_it_went_wrong(void **state) {
    (void)state;
    NEEDS_DEVICE();
    const view wide = {{0, 0, 0}, {0, 0, 1}, {0, 1, 0}, 60};
    brume_scene *scene = new_scene(4, 1);
    brume_trace t;
    set_camera(scene, &wide, BRUME_NONE);
    add_wall(scene, 5, 40, 0.8);
    add_point(scene, 0.5, 1.5, 2);
    /* The light that reaches the wall. */
    planted_bug("bsdf_diffuse.h", "v.f = cscale(b->reflectance, v.pdf);", "v.f = cgrey(v.pdf / R(0));");
    must(brume_sample_trace(device, scene, NULL, 3, 4, 5, &t));
    planted_remove();
    assert_int_equal(t.bad, 1);
    const brume_trace_vertex *v = &t.vertices[0];
    assert_int_equal(v->event, BRUME_TRACE_SURFACE);
    assert_int_equal(v->shape, 0);
    assert_true(isfinite(v->along[0]) && isfinite(v->met[0]) && !isfinite(v->lit[0]) && !isfinite(v->radiance[0]));
    for (int c = 0; c < 3; c++) assert_true(t.radiance[c] == 0);
    brume_trace_free(&t);
    assert_int_equal(brume_sample_trace(device, scene, NULL, PIXELS, 0, 0, &t), BRUME_ERROR_ARGUMENT);
    assert_non_null(strstr(brume_context_message(context), "outside"));
    assert_int_equal(brume_sample_trace(device, scene, NULL, 0, 0, UINT32_MAX, &t), BRUME_ERROR_ARGUMENT);
    assert_int_equal(brume_sample_trace(device, NULL, NULL, 0, 0, 0, &t), BRUME_ERROR_ARGUMENT);
    assert_int_equal(brume_sample_trace(NULL, scene, NULL, 0, 0, 0, &t), BRUME_ERROR_ARGUMENT);
    brume_trace_free(NULL);
    brume_scene_destroy(scene);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_trace_is_what_the_picture_got),
        cmocka_unit_test(chosen_samples_are_traced_as_chosen),
        cmocka_unit_test(a_bad_sample_says_where_it_went_wrong),
    };
    return cmocka_run_group_tests(tests, open_device, close_device);
}

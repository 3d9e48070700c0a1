/* test_denoise.c -- the denoiser, where it is installed (BRUME_OIDN): a real picture comes closer to a long reference;
 * and what becomes of a picture where it isn't. `make check-pictures` installs it. */
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

#include "open_device.h"
#include "render.h"

enum { WIDTH = 120, HEIGHT = 75, FLOATS = WIDTH * HEIGHT * 3 };

static brume_scene *one_spot(void) {
    static const brume_parameter size[2] = {{"width", "120"}, {"height", "75"}};
    brume_scene *scene;
    must(brume_scene_load(context, "scenes/one-spot.xml", size, 2, &scene));
    return scene;
}

static brume_render *rendered(uint32_t samples, uint32_t seed, uint32_t light_layers) {
    brume_scene *scene = one_spot();
    brume_render *render;
    brume_render_desc desc = brume_render_desc_default();
    desc.sample_count = samples;
    desc.use_seed = 1;
    desc.seed = seed;
    desc.light_layers = light_layers;
    must(brume_render_create(device, scene, &desc, &render));
    must(brume_render_run(render, NULL, NULL));
    brume_scene_destroy(scene);
    return render;
}

/* brume.h's measure. */
static double relmse(const float *picture, const float *reference) {
    double mean = 0, sum = 0;
    for (int i = 0; i < FLOATS; i++) mean += reference[i] / (double)FLOATS;
    for (int i = 0; i < FLOATS; i++) {
        double off = (double)picture[i] - reference[i];
        sum += off * off / ((double)reference[i] * reference[i] + 0.01 * mean * mean);
    }
    return sum / FLOATS;
}

static double mean_of(const float *x) {
    double sum = 0;
    for (int i = 0; i < FLOATS; i++) sum += x[i];
    return sum / FLOATS;
}

static void the_error_falls(void **state) {
    (void)state;
    NEEDS_DEVICE();
    if (brume_denoiser_find(context) != BRUME_OK) skip();
    static float reference[FLOATS], noisy[FLOATS], clean[FLOATS];
    brume_render *render = rendered(1024, 1, 0);
    must(brume_render_read(render, BRUME_CHANNEL_RADIANCE, reference, FLOATS));
    brume_render_destroy(render);
    render = rendered(8, 2, 1);
    must(brume_render_read(render, BRUME_CHANNEL_RADIANCE, noisy, FLOATS));
    double before = relmse(noisy, reference);
    static const struct { const char *name; brume_denoise kind; } ways[] = {{"beauty", BRUME_DENOISE_BEAUTY},
                                                                            {"layers", BRUME_DENOISE_LAYERS}};
    for (int i = 0; i < 2; i++) {
        must(brume_render_denoise(render, ways[i].kind, clean));
        double after = relmse(clean, reference);
        print_message("%s: relMSE %.3g, denoised %.3g; mean %.4g of %.4g\n", ways[i].name, before, after,
                      mean_of(clean), mean_of(reference));
        assert_true(after < 0.5 * before);
        assert_true(fabs(mean_of(clean) / mean_of(reference) - 1) < 0.05);
    }
    brume_render_destroy(render);
}

/* A PNG says what it is. */
static void a_png_says_so(void **state) {
    (void)state;
    NEEDS_DEVICE();
    if (brume_denoiser_find(context) != BRUME_OK) skip();
    char folder[] = "/tmp/brume-denoise-XXXXXX", path[64], bytes[200];
    assert_non_null(mkdtemp(folder));
    brume_render *render = rendered(1, 1, 0);
    brume_picture_desc picture = brume_picture_desc_default();
    picture.denoise = BRUME_DENOISE_BEAUTY;
    snprintf(path, sizeof path, "%s/a.png", folder);
    must(brume_render_write(render, path, &picture));
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    assert_int_equal(fread(bytes, 1, sizeof bytes, file), sizeof bytes);
    fclose(file);
    assert_memory_equal(bytes + 37, "tEXtComment\0denoised", 20);
    unlink(path);
    brume_render_destroy(render);
    rmdir(folder);
}

static void what_it_needs_is_said(void **state) {
    (void)state;
    NEEDS_DEVICE();
    static float clean[FLOATS];
    brume_render *render = rendered(1, 1, 0);
    assert_int_equal(brume_render_denoise(render, BRUME_DENOISE_LAYERS, clean), BRUME_ERROR_ARGUMENT);
    assert_non_null(strstr(brume_context_message(context), "parts of the light"));
    assert_int_equal(brume_render_denoise(render, (brume_denoise)7, clean), BRUME_ERROR_ARGUMENT);
    brume_render_destroy(render);
}

/* The picture is written all the same. */
static void without_the_library_it_is_an_error(void **state) {
    (void)state;
    NEEDS_DEVICE();
    char before[1024] = "", folder[] = "/tmp/brume-denoise-XXXXXX", path[64];
    if (getenv("BRUME_OIDN")) snprintf(before, sizeof before, "%s", getenv("BRUME_OIDN"));
    setenv("BRUME_OIDN", "/nonexistent", 1);
    assert_int_equal(brume_denoiser_find(context), BRUME_ERROR_DENOISER);
    assert_non_null(strstr(brume_context_message(context), "/nonexistent"));
    assert_non_null(mkdtemp(folder));
    brume_render *render = rendered(1, 1, 0);
    brume_picture_desc picture = brume_picture_desc_default();
    picture.denoise = BRUME_DENOISE_BEAUTY;
    static const char *const names[2] = {"a.exr", "a.png"};
    for (int i = 0; i < 2; i++) {
        uint32_t width, height;
        float *rgb;
        snprintf(path, sizeof path, "%s/%s", folder, names[i]);
        assert_int_equal(brume_render_write(render, path, &picture), BRUME_ERROR_DENOISER);
        must(brume_picture_read(context, path, &width, &height, &rgb));
        assert_int_equal(width, WIDTH);
        brume_picture_free(rgb);
        unlink(path);
    }
    picture.denoise = (brume_denoise)3;
    assert_int_equal(brume_render_write(render, path, &picture), BRUME_ERROR_ARGUMENT);
    brume_render_destroy(render);
    rmdir(folder);
    if (*before)
        setenv("BRUME_OIDN", before, 1);
    else
        unsetenv("BRUME_OIDN");
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_error_falls),
        cmocka_unit_test(a_png_says_so),
        cmocka_unit_test(what_it_needs_is_said),
        cmocka_unit_test(without_the_library_it_is_an_error),
    };
    return cmocka_run_group_tests(tests, open_device, close_device);
}

/* test_layers.c -- which layers an EXR holds, and what is refused. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <OpenEXR/openexr.h>
#include <cmocka.h>

#include "known_answer.h"
#include "open_device.h"

#define BIT(channel) (1u << BRUME_CHANNEL_##channel)

static char folder[] = "/tmp/brume-layers-XXXXXX", path[64];

/* The names of a file's channels, between blanks. */
static void channels_of(char *out, size_t size) {
    exr_context_t exr;
    exr_context_initializer_t start = EXR_DEFAULT_CONTEXT_INITIALIZER;
    const exr_attr_chlist_t *list;
    assert_int_equal(exr_start_read(&exr, path, &start), EXR_ERR_SUCCESS);
    assert_int_equal(exr_get_channels(exr, 0, &list), EXR_ERR_SUCCESS);
    out[0] = '\0';
    for (int i = 0; i < list->num_channels; i++) {
        size_t used = strlen(out);
        snprintf(out + used, size - used, "%s%s", i ? " " : "", list->entries[i].name.str);
    }
    exr_finish(&exr);
}

static brume_render *rendered(const brume_render_desc *desc) {
    brume_render *render;
    brume_scene *scene = new_scene(4, 2);
    set_camera(scene, &along_z, BRUME_NONE);
    add_wall(scene, 2, 1, 0.5);
    add_point(scene, 0, 0, 0);
    must(brume_render_create(device, scene, desc, &render));
    must(brume_render_run(render, NULL, NULL));
    brume_scene_destroy(scene);
    return render;
}

static void a_file_holds_the_layers_asked_for(void **state) {
    (void)state;
    NEEDS_DEVICE();
    static const struct { uint32_t set; const char *channels; } cases[] = {
        {0, "B G R"},
        {BIT(BAD_SAMPLES), "B G R badSamples"},
        {BIT(ALBEDO), "B G R albedo.B albedo.G albedo.R"},
        {BIT(NORMAL) | BIT(DEPTH), "B G N.X N.Y N.Z R Z"},
        {BIT(ERROR) | BIT(SAMPLE_COUNT), "B G R sampleCount variance.B variance.G variance.R"},
        {BRUME_LAYERS_RECORDED, "B G N.X N.Y N.Z R Z albedo.B albedo.G albedo.R sampleCount variance.B variance.G "
                                "variance.R"},
    };
    brume_render *render = rendered(NULL);
    brume_picture_desc picture = brume_picture_desc_default();
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        char channels[512];
        picture.layers = cases[i].set;
        must(brume_render_write(render, path, &picture));
        channels_of(channels, sizeof channels);
        assert_string_equal(channels, cases[i].channels);
    }
    picture.layers = BIT(RADIANCE);
    assert_int_equal(brume_render_write(render, path, &picture), BRUME_ERROR_ARGUMENT);
    assert_non_null(strstr(brume_context_message(context), "channel 0 is no layer"));
    picture.layers = 1u << 31;
    assert_int_equal(brume_render_write(render, path, &picture), BRUME_ERROR_ARGUMENT);
    brume_render_destroy(render);
}

static void what_is_not_recorded_is_not_written(void **state) {
    (void)state;
    NEEDS_DEVICE();
    brume_render_desc desc = brume_render_desc_default();
    desc.guides = 0;
    brume_render *render = rendered(&desc);
    brume_picture_desc picture = brume_picture_desc_default();
    char channels[512];
    must(brume_render_write(render, path, &picture));
    channels_of(channels, sizeof channels);
    assert_string_equal(channels, "B G R sampleCount variance.B variance.G variance.R");
    picture.layers = BIT(DEPTH);
    assert_int_equal(brume_render_write(render, path, &picture), BRUME_ERROR_ARGUMENT);
    assert_non_null(strstr(brume_context_message(context), "does not record Z"));
    brume_render_destroy(render);
}

static void layers_have_names(void **state) {
    (void)state;
    assert_string_equal(brume_channel_name(BRUME_CHANNEL_NORMAL), "N");
    assert_string_equal(brume_channel_name(BRUME_CHANNEL_ERROR), "variance");
    assert_null(brume_channel_name(BRUME_CHANNEL_RADIANCE));
    assert_null(brume_channel_name(BRUME_CHANNEL_VARIANCE));
    assert_null(brume_channel_name((brume_channel)31));
    assert_null(brume_channel_name((brume_channel)-1));
}

static int open_all(void **state) {
    if (!mkdtemp(folder)) return 1;
    snprintf(path, sizeof path, "%s/a.exr", folder);
    return open_device(state);
}

static int close_all(void **state) {
    unlink(path);
    rmdir(folder);
    return close_device(state);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(layers_have_names),
        cmocka_unit_test(a_file_holds_the_layers_asked_for),
        cmocka_unit_test(what_is_not_recorded_is_not_written),
    };
    return cmocka_run_group_tests(tests, open_all, close_all);
}

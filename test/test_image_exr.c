/* test_image_exr.c -- EXR files as OpenEXRCore reads them, and what the library reads of them. */
#include <OpenEXR/openexr.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "image_folder.h"
#include "stability.h"

enum { WIDTH = 37, HEIGHT = 53 }; /* several chunks of 16 lines, the last one short */

/* One channel of a file, as floats, by the reference library; fails unless the channel is stored as `type`. */
static void read_channel(const char *path, const char *name, exr_pixel_type_t type, float *out) {
    exr_context_t exr;
    exr_context_initializer_t start = EXR_DEFAULT_CONTEXT_INITIALIZER;
    exr_attr_box2i_t window;
    int32_t lines;
    float other[64]; /* version 3.1.5 crashes on some mixes that skip channels */
    assert_int_equal(exr_start_read(&exr, path, &start), EXR_ERR_SUCCESS);
    assert_int_equal(exr_get_data_window(exr, 0, &window), EXR_ERR_SUCCESS);
    assert_int_equal(exr_get_scanlines_per_chunk(exr, 0, &lines), EXR_ERR_SUCCESS);
    int width = window.max.x - window.min.x + 1, found = 0;
    assert_true(width <= 64);
    for (int y = window.min.y; y <= window.max.y; y += lines) {
        exr_chunk_info_t chunk;
        exr_decode_pipeline_t decoder = EXR_DECODE_PIPELINE_INITIALIZER;
        assert_int_equal(exr_read_scanline_chunk_info(exr, 0, y, &chunk), EXR_ERR_SUCCESS);
        assert_int_equal(exr_decoding_initialize(exr, 0, &chunk, &decoder), EXR_ERR_SUCCESS);
        for (int c = 0; c < decoder.channel_count; c++) {
            exr_coding_channel_info_t *channel = &decoder.channels[c];
            int wanted = strcmp(channel->channel_name, name) == 0;
            float *to = out + (size_t)(y - window.min.y) * (size_t)width;
            if (wanted)
                assert_int_equal(channel->data_type, type);
            found |= wanted;
            channel->decode_to_ptr = (uint8_t *)(wanted ? to : other);
            channel->user_pixel_stride = channel->user_bytes_per_element = sizeof(float);
            channel->user_line_stride = wanted ? (int32_t)sizeof(float) * width : 0;
            channel->user_data_type = EXR_PIXEL_FLOAT;
        }
        assert_int_equal(exr_decoding_choose_default_routines(exr, 0, &decoder), EXR_ERR_SUCCESS);
        assert_int_equal(exr_decoding_run(exr, 0, &decoder), EXR_ERR_SUCCESS);
        exr_decoding_destroy(exr, &decoder);
    }
    assert_true(found);
    exr_finish(&exr);
}

/* A crop in the corner of a larger film, interleaved and planar channels, halves and floats, names in no order. */
static void test_exr_round_trip(void **state) {
    (void)state;
    static float rgb[3 * WIDTH * HEIGHT], depth[WIDTH * HEIGHT], back[WIDTH * HEIGHT];
    for (int i = 0; i < 3 * WIDTH * HEIGHT; i++)
        rgb[i] = (float)((i % 2048) / 1024.0); /* eleven bits: exact as a half */
    for (int i = 0; i < WIDTH * HEIGHT; i++)
        depth[i] = 1.0f / 3 + (float)i;
    rgb[0] = 1e6f, rgb[3] = -INFINITY, rgb[6] = NAN, rgb[9] = INFINITY;
    const brume_exr_channel channels[4] = {
        {"Z", depth, 1, 0}, {"R", rgb, 3, 1}, {"B", rgb + 2, 3, 0}, {"G", rgb + 1, 3, 1}};
    const char *path = in_folder("a.exr");
    assert_int_equal(brume_exr_write(context, path, 5, 7, WIDTH, HEIGHT, 100, 80, channels, 4, NULL, 0), BRUME_OK);
    assert_int_equal(files_in_folder(), 1);
    read_channel(in_folder("a.exr"), "Z", EXR_PIXEL_FLOAT, back);
    assert_memory_equal(back, depth, sizeof back);
    read_channel(path, "R", EXR_PIXEL_HALF, back);
    /* Planted: unclamped, what is 2^16 less half a step or more has no half but infinity. */
    stability_row("hazard", "a picture's values beyond the largest half", "65504", "absolute", 0,
                  fabs(back[0] - 65504.0), "naive inf; 1e6");
    assert_true(rgb[0] >= 65520);
    assert_float_equal(back[1], -65504, 0);
    assert_true(isnan(back[2]));
    assert_float_equal(back[3], 65504, 0);
    for (int i = 4; i < WIDTH * HEIGHT; i++)
        assert_float_equal(back[i], rgb[3 * i], 0);
    read_channel(path, "G", EXR_PIXEL_HALF, back);
    for (int i = 0; i < WIDTH * HEIGHT; i++)
        assert_float_equal(back[i], rgb[3 * i + 1], 0);
    read_channel(path, "B", EXR_PIXEL_FLOAT, back);
    for (int i = 0; i < WIDTH * HEIGHT; i++)
        assert_float_equal(back[i], rgb[3 * i + 2], 0);
}

static void test_exr_header(void **state) {
    (void)state;
    static const float grey[6] = {1, 2, 3, 4, 5, 6};
    const brume_exr_channel channel = {"Y", grey, 1, 0};
    brume_exr_attribute attributes[4] = {
        {.name = "software", .type = BRUME_EXR_STRING, .string = "brume, ünder test"},
        {.name = "seed", .type = BRUME_EXR_INT, .integer = -7},
        {.name = "renderTimeSeconds", .type = BRUME_EXR_FLOAT, .number = 1.25f},
        {.name = "worldToCamera", .type = BRUME_EXR_MATRIX},
    };
    for (int i = 0; i < 16; i++)
        attributes[3].matrix[i] = (float)i;
    const char *path = in_folder("h.exr");
    assert_int_equal(brume_exr_write(context, path, 1, 2, 3, 2, 10, 20, &channel, 1, attributes, 4), BRUME_OK);

    exr_context_t exr;
    exr_context_initializer_t start = EXR_DEFAULT_CONTEXT_INITIALIZER;
    exr_attr_box2i_t data, display;
    exr_attr_chromaticities_t chromaticities;
    exr_attr_m44f_t matrix;
    exr_compression_t compression;
    const char *text;
    int32_t length, seed;
    float seconds;
    assert_int_equal(exr_start_read(&exr, path, &start), EXR_ERR_SUCCESS);
    assert_int_equal(exr_get_data_window(exr, 0, &data), EXR_ERR_SUCCESS);
    assert_int_equal(exr_get_display_window(exr, 0, &display), EXR_ERR_SUCCESS);
    assert_true(data.min.x == 1 && data.min.y == 2 && data.max.x == 3 && data.max.y == 3);
    assert_true(display.min.x == 0 && display.min.y == 0 && display.max.x == 9 && display.max.y == 19);
    assert_int_equal(exr_get_compression(exr, 0, &compression), EXR_ERR_SUCCESS);
    assert_int_equal(compression, EXR_COMPRESSION_ZIP);
    assert_int_equal(exr_attr_get_string(exr, 0, "software", &length, &text), EXR_ERR_SUCCESS);
    assert_string_equal(text, "brume, ünder test");
    assert_int_equal(exr_attr_get_int(exr, 0, "seed", &seed), EXR_ERR_SUCCESS);
    assert_int_equal(seed, -7);
    assert_int_equal(exr_attr_get_float(exr, 0, "renderTimeSeconds", &seconds), EXR_ERR_SUCCESS);
    assert_float_equal(seconds, 1.25, 0);
    assert_int_equal(exr_attr_get_m44f(exr, 0, "worldToCamera", &matrix), EXR_ERR_SUCCESS);
    /* EXR multiplies row vectors: our rows are its columns. */
    for (int i = 0; i < 16; i++)
        assert_float_equal(matrix.m[4 * (i % 4) + i / 4], i, 0);
    assert_int_equal(exr_attr_get_chromaticities(exr, 0, "chromaticities", &chromaticities), EXR_ERR_SUCCESS);
    assert_float_equal(chromaticities.green_y, 0.60, 1e-6); /* ITU-R BT.709 */
    assert_float_equal(chromaticities.white_x, 0.3127, 1e-6);
    exr_finish(&exr);
}

static void test_exr_reading(void **state) {
    (void)state;
    static float rgb[3 * WIDTH * HEIGHT], alpha[WIDTH * HEIGHT];
    for (int i = 0; i < 3 * WIDTH * HEIGHT; i++)
        rgb[i] = (float)(i % 1000) / 1000;
    const brume_exr_channel colour[4] = {
        {"A", alpha, 1, 1}, {"R", rgb, 3, 0}, {"B", rgb + 2, 3, 0}, {"G", rgb + 1, 3, 0}};
    const brume_exr_channel grey = {"Y", rgb, 3, 1}, odd = {"density", rgb, 3, 1};
    brume_image image;
    assert_int_equal(brume_exr_write(context, in_folder("c.exr"), 50, 1, WIDTH, HEIGHT, 100, 80, colour, 4, NULL, 0),
                     BRUME_OK);
    assert_int_equal(brume_image_read(context, path_memory, 0, NULL, &image), BRUME_OK);
    assert_int_equal(image.width, WIDTH);
    assert_int_equal(image.height, HEIGHT);
    assert_memory_equal(image.texels, rgb, sizeof rgb);
    free(image.texels);

    const char *path = in_folder("y.exr");
    assert_int_equal(brume_exr_write(context, path, 0, 0, WIDTH, HEIGHT, WIDTH, HEIGHT, &grey, 1, NULL, 0), BRUME_OK);
    assert_int_equal(brume_image_read(context, path_memory, 0, NULL, &image), BRUME_OK);
    for (int i = 0; i < WIDTH * HEIGHT; i++) {
        assert_float_equal(image.texels[3 * i], rgb[3 * i], 0.0005 * rgb[3 * i] + 1e-7); /* a half has 11 bits */
        assert_float_equal(image.texels[3 * i + 1], image.texels[3 * i], 0);
        assert_float_equal(image.texels[3 * i + 2], image.texels[3 * i], 0);
    }
    free(image.texels);

    path = in_folder("d.exr");
    assert_int_equal(brume_exr_write(context, path, 0, 0, WIDTH, HEIGHT, WIDTH, HEIGHT, &odd, 1, NULL, 0), BRUME_OK);
    assert_int_equal(brume_image_read(context, path_memory, 0, "s.xml:3:5", &image), BRUME_ERROR_SCENE);
    assert_non_null(strstr(brume_context_message(context), "s.xml:3:5: "));
    assert_non_null(strstr(brume_context_message(context), "expected the channels R, G and B, or Y"));
    /* the same by the public interface */
    uint32_t width = 7, height = 7;
    float *read = NULL;
    assert_int_equal(brume_picture_read(context, path_memory, &width, &height, &read), BRUME_ERROR_SCENE);
    assert_int_equal(brume_picture_read(context, NULL, &width, &height, &read), BRUME_ERROR_ARGUMENT);
    assert_true(width == 7 && height == 7 && read == NULL);
    assert_int_equal(brume_picture_read(context, in_folder("c.exr"), &width, &height, &read), BRUME_OK);
    assert_true(width == WIDTH && height == HEIGHT);
    assert_memory_equal(read, rgb, sizeof rgb);
    brume_picture_free(read);
}

/* Every mix of halves and floats over three to five channels. Among them are chunks that compress to exactly their own
 * length, which OpenEXRCore 3.1.5 by itself writes so that nobody can read them. */
static void test_exr_mixes(void **state) {
    (void)state;
    static const char *const names[5] = {"R", "G", "B", "A", "Z"};
    float data[5 * 6];
    for (int i = 0; i < 30; i++)
        data[i] = (float)i;
    for (uint32_t count = 3; count <= 5; count++)
        for (uint32_t halves = 0; halves < 1u << count; halves++) {
            brume_exr_channel channels[5];
            brume_image image;
            for (uint32_t c = 0; c < count; c++)
                channels[c] = (brume_exr_channel){names[c], data + c, 5, halves >> c & 1};
            assert_int_equal(brume_exr_write(context, in_folder("m.exr"), 0, 0, 3, 2, 3, 2, channels, count, NULL, 0),
                             BRUME_OK);
            assert_int_equal(brume_image_read(context, path_memory, 0, NULL, &image), BRUME_OK);
            for (int i = 0; i < 18; i++)
                assert_float_equal(image.texels[i], data[5 * (i / 3) + i % 3], 0);
            free(image.texels);
        }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        FRESH(test_exr_round_trip),
        FRESH(test_exr_header),
        FRESH(test_exr_reading),
        FRESH(test_exr_mixes),
    };
    return cmocka_run_group_tests(tests, open_images, close_images);
}

/* test_image.c -- picture files: EXR read back through OpenEXRCore, PNG bytes against the sRGB formula, failures. */
#include <OpenEXR/openexr.h>
#include <errno.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <dirent.h>
#include <fcntl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmocka.h>

#include "stability.h"
#include "image.h"
#include "text.h"

static brume_context *context;
static char folder[] = "/tmp/brume-image-XXXXXX";
static char path_memory[512];

static const char *in_folder(const char *name) {
    snprintf(path_memory, sizeof path_memory, "%s/%s", folder, name);
    return path_memory;
}

static int files_in_folder(void) {
    DIR *dir = opendir(folder);
    int count = 0;
    assert_non_null(dir);
    for (struct dirent *entry; (entry = readdir(dir));)
        count += entry->d_name[0] != '.';
    closedir(dir);
    return count;
}

static void empty_folder(void) {
    DIR *dir = opendir(folder);
    for (struct dirent *entry; dir && (entry = readdir(dir));)
        if (entry->d_name[0] != '.')
            remove(in_folder(entry->d_name));
    closedir(dir);
}

static int open_all(void **state) {
    (void)state;
    return brume_context_create(&context) != BRUME_OK || !mkdtemp(folder);
}

static int close_all(void **state) {
    (void)state;
    empty_folder();
    rmdir(folder);
    brume_context_destroy(context);
    return 0;
}

static int fresh_folder(void **state) {
    (void)state;
    empty_folder();
    return 0;
}

/* ---- EXR -------------------------------------------------------------------------------------------------------- */

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

enum { WIDTH = 37, HEIGHT = 53 }; /* several chunks of 16 lines, the last one short */

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

/* ---- PNG and the rest ------------------------------------------------------------------------------------------- */

/* IEC 61966-2-1 in double. */
static double to_srgb(double v) {
    return v <= 0.0031308 ? 12.92 * v : 1.055 * pow(v, 1 / 2.4) - 0.055;
}

static void test_png_curve(void **state) {
    (void)state;
    enum { COUNT = 4096 };
    static float rgb[3 * COUNT];
    for (int i = 0; i < 3 * COUNT; i++)
        rgb[i] = (float)i / (3 * COUNT) * 0.6f; /* exposure +1 takes some of it beyond 1 */
    rgb[0] = NAN, rgb[1] = INFINITY, rgb[2] = -1;
    assert_int_equal(brume_png_write(context, in_folder("p.png"), 64, 64, rgb, 1, BRUME_TONEMAP_NONE, NULL), BRUME_OK);
    assert_int_equal(files_in_folder(), 1);
    brume_image image;
    assert_int_equal(brume_image_read(context, path_memory, 1, NULL, &image), BRUME_OK);
    assert_int_equal(image.width, 64);
    assert_int_equal(image.height, 64);
    assert_float_equal(image.texels[0], 0, 0);
    assert_float_equal(image.texels[1], 1, 0);
    assert_float_equal(image.texels[2], 0, 0);
    for (int i = 3; i < 3 * COUNT; i++) {
        double wanted = fmin(255, 255 * to_srgb(fmin(1, 2.0 * rgb[i]))), byte = image.texels[i] * 255.0;
        assert_true(fabs(byte - wanted) <= 0.5 + 1e-4);
    }
    free(image.texels);
    /* Read as sRGB it is linear again, to half a step of the curve. */
    assert_int_equal(brume_image_read(context, path_memory, 0, NULL, &image), BRUME_OK);
    for (int i = 3; i < 3 * COUNT; i++)
        assert_float_equal(255 * to_srgb(image.texels[i]), 255 * to_srgb(fmin(1, 2.0 * rgb[i])), 0.5 + 1e-3);
    free(image.texels);
}

/* The published curve in double, of every exposure that a byte can tell apart. */
static void test_png_filmic(void **state) {
    (void)state;
    enum { COUNT = 4096 };
    static float rgb[3 * COUNT];
    for (int i = 0; i < 3 * COUNT; i++)
        rgb[i] = (float)exp2(-14 + 20.0 * i / (3 * COUNT)); /* 2^-14 to 2^6 */
    rgb[0] = NAN, rgb[1] = INFINITY, rgb[2] = -1, rgb[3] = 0, rgb[4] = 3e38f;
    assert_int_equal(brume_png_write(context, in_folder("f.png"), 64, 64, rgb, 0.5f, BRUME_TONEMAP_FILMIC, NULL),
                     BRUME_OK);
    brume_image image;
    assert_int_equal(brume_image_read(context, path_memory, 1, NULL, &image), BRUME_OK);
    static const float ends[5] = {0, 1, 0, 0, 1};
    for (int i = 0; i < 5; i++)
        assert_float_equal(image.texels[i], ends[i], 0);
    double worst = 0;
    for (int i = 5; i < 3 * COUNT; i++) {
        double x = sqrt(2.0) * rgb[i], curve = (2.51 * x * x + 0.03 * x) / (2.43 * x * x + 0.59 * x + 0.14);
        worst = fmax(worst, fabs(255.0 * image.texels[i] - 255 * to_srgb(fmin(1, curve))));
        assert_true(i == 5 || image.texels[i] >= image.texels[i - 1]); /* it rises */
    }
    assert_true(worst <= 0.5 + 1e-4);
    free(image.texels);
}

/* A binary PPM: what else stb reads, and by content whatever its name says. */
static void test_by_content(void **state) {
    (void)state;
    static const unsigned char ppm[] = "P6 2 1 255\n\x00\x80\xff\xff\x00\x80";
    FILE *file = fopen(in_folder("x.exr"), "wb");
    brume_image image;
    assert_non_null(file);
    fwrite(ppm, 1, sizeof ppm - 1, file);
    fclose(file);
    assert_int_equal(brume_image_read(context, path_memory, 1, NULL, &image), BRUME_OK);
    assert_int_equal(image.width, 2);
    assert_float_equal(image.texels[1], 128 / 255.0, 1e-7);
    assert_float_equal(image.texels[3], 1, 0);
    free(image.texels);
}

/* ---- failures --------------------------------------------------------------------------------------------------- */

static void put(const char *name, const void *bytes, size_t size) {
    FILE *file = fopen(in_folder(name), "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(bytes, 1, size, file), size);
    fclose(file);
}

static void assert_unreadable(const char *name, const char *words) {
    brume_image image = {1, 2, NULL};
    if (brume_image_read(context, in_folder(name), 0, NULL, &image) != BRUME_ERROR_SCENE)
        fail_msg("%s was read", name);
    const char *said = brume_context_message(context);
    if (!strstr(said, words) || !strstr(said, name) || strchr(said, '\n'))
        fail_msg("%s: \"%s\" instead of \"%s\"", name, said, words);
    assert_true(image.width == 1 && image.height == 2 && !image.texels);
}

static void test_unreadable(void **state) {
    (void)state;
    static const float grey[16] = {0};
    const brume_exr_channel channel = {"Y", grey, 1, 0};
    static unsigned char whole[4096];
    assert_unreadable("missing.png", "No such file");
    put("empty.png", "", 0);
    assert_unreadable("empty.png", "empty");
    put("text.png", "this is no picture", 18);
    assert_unreadable("text.png", "not a readable picture");
    put("cut.png", "\x89PNG\r\n\x1a\n\0\0\0\rIHDR", 16);
    assert_unreadable("cut.png", "not a readable picture");
    put("nothing.png", "\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\0\1\0\0\0\1\10\2\0\0\0\x90\x77\x53\xde"
        "\0\0\0\0IDAT\x35\xaf\6\x1e", 45);
    assert_unreadable("nothing.png", "begins with an empty chunk");
    /* TGA, 20000 x 10000 pixels, of which there is none */
    put("short.tga", "\0\0\2\0\0\0\0\0\0\0\0\0\x20\x4e\x10\x27\x18\0", 18);
    assert_unreadable("short.tga", "too short for as many pixels");
    put("magic.exr", "\x76\x2f\x31\x01", 4);
    assert_unreadable("magic.exr", "");
    /* An EXR cut off anywhere, and with each byte of it damaged in turn: refused or read, but never worse. */
    assert_int_equal(brume_exr_write(context, in_folder("y.exr"), 0, 0, 4, 4, 4, 4, &channel, 1, NULL, 0), BRUME_OK);
    FILE *file = fopen(path_memory, "rb");
    size_t size = fread(whole, 1, sizeof whole, file);
    fclose(file);
    for (size_t i = 4; i < size; i++) {
        put("cut.exr", whole, i);
        assert_unreadable("cut.exr", "");
    }
    for (size_t i = 4; i < size; i++) {
        brume_image image;
        whole[i] ^= 0xa5;
        put("damaged.exr", whole, size);
        whole[i] ^= 0xa5;
        if (brume_image_read(context, path_memory, 0, NULL, &image) == BRUME_OK)
            free(image.texels);
    }
}

static void test_unwritable(void **state) {
    (void)state;
    static const float grey[12] = {0};
    const brume_exr_channel channel = {"Y", grey, 1, 0}, unnamed = {NULL, grey, 1, 0};
    const char *nowhere = in_folder("none/a.exr");
    assert_int_equal(brume_exr_write(context, nowhere, 0, 0, 2, 2, 2, 2, &channel, 1, NULL, 0), BRUME_ERROR_OUTPUT);
    assert_non_null(strstr(brume_context_message(context), strerror(ENOENT)));
    assert_int_equal(brume_png_write(context, nowhere, 2, 2, grey, 0, BRUME_TONEMAP_NONE, NULL), BRUME_ERROR_OUTPUT);
    assert_non_null(strstr(brume_context_message(context), nowhere));
    /* A folder has the name already. */
    assert_int_equal(mkdir(in_folder("dir.png"), 0777), 0);
    assert_int_equal(brume_png_write(context, path_memory, 2, 2, grey, 0, BRUME_TONEMAP_NONE, NULL),
                     BRUME_ERROR_OUTPUT);
    assert_non_null(strstr(brume_context_message(context), strerror(EISDIR)));
    assert_int_equal(files_in_folder(), 1);
    rmdir(in_folder("dir.png"));

    const char *path = in_folder("a.exr");
    assert_int_equal(brume_exr_write(context, path, 0, 0, 2, 2, 2, 2, &channel, 0, NULL, 0), BRUME_ERROR_ARGUMENT);
    assert_int_equal(brume_exr_write(context, path, 0, 0, 2, 2, 2, 2, &unnamed, 1, NULL, 0), BRUME_ERROR_ARGUMENT);
    assert_int_equal(brume_exr_write(context, path, 0, 0, 0, 2, 2, 2, &channel, 1, NULL, 0), BRUME_ERROR_ARGUMENT);
    assert_int_equal(brume_exr_write(context, path, 1, 0, 2, 2, 2, 2, &channel, 1, NULL, 0), BRUME_ERROR_ARGUMENT);
    assert_int_equal(brume_png_write(context, path, 0, 2, grey, 0, BRUME_TONEMAP_NONE, NULL), BRUME_ERROR_ARGUMENT);
    assert_int_equal(brume_png_write(context, path, 2, 2, NULL, 0, BRUME_TONEMAP_NONE, NULL), BRUME_ERROR_ARGUMENT);
    assert_int_equal(files_in_folder(), 0);
}

/* A disk that fills up, played by the limit on a file's size: the error is reported, no signal ends us, no file of any
 * name is left, and a picture that was there before is still whole. */
static void test_full_disk(void **state) {
    (void)state;
    enum { SIDE = 256 };
    static float noise[3 * SIDE * SIDE];
    const brume_exr_channel channel = {"Y", noise, 1, 0};
    struct rlimit before, small;
    uint32_t bits = 1;
    for (int i = 0; i < 3 * SIDE * SIDE; i++) {
        bits = bits * 1664525u + 1013904223u;
        noise[i] = (float)(bits >> 8) / 16777216.0f;
    }
    put("old.exr", "old", 3);
    put("old.png", "old", 3);
    assert_int_equal(getrlimit(RLIMIT_FSIZE, &before), 0);
    small = before;
    small.rlim_cur = 10000;
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &small), 0);
    const char *path = in_folder("old.exr");
    brume_result exr = brume_exr_write(context, path, 0, 0, SIDE, SIDE, SIDE, SIDE, &channel, 1, NULL, 0);
    int exr_words = strstr(brume_context_message(context), strerror(EFBIG)) != NULL;
    brume_result png =
        brume_png_write(context, in_folder("old.png"), SIDE, SIDE, noise, 0, BRUME_TONEMAP_NONE, NULL);
    int png_words = strstr(brume_context_message(context), strerror(EFBIG)) != NULL;
    setrlimit(RLIMIT_FSIZE, &before);
    assert_int_equal(exr, BRUME_ERROR_OUTPUT);
    assert_int_equal(png, BRUME_ERROR_OUTPUT);
    assert_true(exr_words && png_words);
    assert_int_equal(files_in_folder(), 2);
    struct stat old;
    assert_int_equal(stat(in_folder("old.exr"), &old), 0);
    assert_int_equal(old.st_size, 3);
    /* With room again it is replaced, and readable by whom the umask allows. */
    mode_t mask = umask(022);
    assert_int_equal(brume_png_write(context, in_folder("old.png"), SIDE, SIDE, noise, 0, BRUME_TONEMAP_NONE, NULL),
                     BRUME_OK);
    umask(mask);
    assert_int_equal(stat(path_memory, &old), 0);
    assert_true(old.st_size > 10000);
    assert_int_equal(old.st_mode & 0777, 0644);
}

#define FRESH(test) cmocka_unit_test_setup(test, fresh_folder)

/* CRC by long division of bits, most significant first: another road than the writer's. */
static uint32_t divide_crc(const unsigned char *bytes, size_t count) {
    uint32_t rest = 0xffffffffu, mirrored = 0;
    for (size_t i = 0; i < 8 * count; i++) {
        uint32_t bit = (bytes[i / 8] >> (i % 8)) & 1, top = rest >> 31;
        rest = (rest << 1) ^ (bit ^ top ? 0x04c11db7u : 0);
    }
    for (int i = 0; i < 32; i++) mirrored |= ((rest >> i) & 1) << (31 - i);
    return ~mirrored;
}

static void test_png_comment(void **state) {
    (void)state;
    static const float grey[12] = {0.5f};
    static const char wanted[] = "tEXtComment\0incomplete render";
    assert_int_equal(divide_crc((const unsigned char *)"IEND", 4), 0xae426082u); /* as every PNG ends */
    assert_int_equal(
        brume_png_write(context, in_folder("c.png"), 2, 2, grey, 0, BRUME_TONEMAP_NONE, "incomplete render"), BRUME_OK);
    size_t size;
    char *file = brume_text_read_file(in_folder("c.png"), &size);
    assert_non_null(file);
    const unsigned char *chunk = (const unsigned char *)file + 33;
    const size_t content = sizeof wanted - 1;
    assert_true(size > 33 + 8 + content);
    assert_int_equal(chunk[3], content - 4);
    assert_memory_equal(chunk + 4, wanted, content);
    const unsigned char *crc = chunk + 4 + content;
    uint32_t stored = (uint32_t)crc[0] << 24 | (uint32_t)crc[1] << 16 | (uint32_t)crc[2] << 8 | crc[3];
    assert_int_equal(stored, divide_crc(chunk + 4, content));
    free(file);
    brume_image image;
    assert_int_equal(brume_image_read(context, in_folder("c.png"), 0, NULL, &image), BRUME_OK);
    assert_int_equal(image.width, 2);
    free(image.texels);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        FRESH(test_exr_round_trip), FRESH(test_exr_header), FRESH(test_exr_reading),
        FRESH(test_exr_mixes),      FRESH(test_png_curve),  FRESH(test_png_filmic), FRESH(test_by_content),
        FRESH(test_unreadable),     FRESH(test_unwritable), FRESH(test_full_disk),
        FRESH(test_png_comment),
    };
    return cmocka_run_group_tests(tests, open_all, close_all);
}

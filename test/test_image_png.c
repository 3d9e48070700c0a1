/* test_image_png.c -- PNG bytes against the sRGB formula and the published tone curve; their comment. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

#include <cmocka.h>

#include "image_folder.h"
#include "text.h"

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
        FRESH(test_png_curve),
        FRESH(test_png_filmic),
        FRESH(test_png_comment),
    };
    return cmocka_run_group_tests(tests, open_images, close_images);
}

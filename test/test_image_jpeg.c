/* test_image_jpeg.c -- JPEG: pictures that libjpeg writes here are read to within what JPEG loses; cut off, damaged,
 * lying about their size or of a kind that isn't read, they are one line of error; memory that runs out is, too.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "faults/host_shim.h"
#include "image_folder.h"
#include "jpeg_file.h"

enum { WIDTH = 37, HEIGHT = 21, PIXELS = WIDTH * HEIGHT }; /* no multiples of 8 */

static const jpeg_kind baseline = {3, 100, 0, 0, 0}, progressive = {3, 100, 1, 0, 0}, grey = {1, 100, 0, 0, 0},
                       grey_progressive = {1, 100, 1, 0, 0}, subsampled = {3, 100, 0, 1, 0};

/* Channels that have nothing in common, or, for chroma at half the size, that differ by constants. */
static void paint(const jpeg_kind *kind, unsigned char *out) {
    for (int y = 0; y < HEIGHT; y++)
        for (int x = 0; x < WIDTH; x++)
            for (int c = 0; c < kind->components; c++) {
                double wave = kind->subsampled ? 80 * sin(0.3 * x) * cos(0.4 * y) + 30 * c
                                               : 95 * sin((0.2 + 0.1 * c) * x + 2 * c) * cos((0.5 - 0.1 * c) * y);
                *out++ = (unsigned char)lround(100 + wave + (kind->subsampled ? 0 : 25));
            }
}

static unsigned char *make(const jpeg_kind *kind, size_t *out_size) {
    unsigned char pixels[4 * PIXELS];
    paint(kind, pixels);
    unsigned char *bytes = jpeg_write(kind, WIDTH, HEIGHT, pixels, out_size);
    assert_non_null(bytes);
    return bytes;
}

static brume_result read_bytes(const void *bytes, size_t size, int raw, brume_image *out) {
    put_file("a.jpg", bytes, size);
    return brume_image_read(context, path_memory, raw, NULL, out);
}

/* ---- right files ----------------------------------------------------------------------------------------------- */

/* Quality 100 rounds every coefficient of the orthonormal DCT to a whole number, by 0.5 at most: so is the root mean
 * square error of a block of samples, 0.56 over this picture's share (777 of 960) of its blocks, into which all of it
 * may fall. Samples are rounded on the way out (0.5), RGB to YCbCr on the way in (0.5), and the fixed-point DCTs may be
 * off by 0.15 RMS each (IEEE 1180): 1.36 for grey, 1.86 for each of YCbCr. Blue = Y + 1.772 Cb has both, and is rounded
 * once more: 5.7. Red and green have less. These are bounds: errors don't all add up. */
static const double grey_bound = 1.36, colour_bound = 5.7;

static void assert_read(const char *name, const jpeg_kind *kind, double bound, brume_image *out) {
    unsigned char pixels[3 * PIXELS];
    size_t size;
    unsigned char *bytes = make(kind, &size);
    paint(kind, pixels);
    assert_int_equal(read_bytes(bytes, size, 1, out), BRUME_OK);
    free(bytes);
    assert_int_equal(out->width, WIDTH);
    assert_int_equal(out->height, HEIGHT);
    for (int c = 0; c < 3; c++) {
        double sum = 0;
        for (int i = 0; i < PIXELS; i++) {
            double e = 255.0 * out->texels[3 * i + c] - pixels[kind->components * i + c % kind->components];
            sum += e * e;
        }
        print_message("%s, channel %d: off by %.2f of 255 (RMS; at most %.2f)\n", name, c, sqrt(sum / PIXELS), bound);
        assert_true(sqrt(sum / PIXELS) <= bound);
    }
}

static void test_known_pictures(void **state) {
    (void)state;
    brume_image a, b;
    assert_read("colour", &baseline, colour_bound, &a);
    assert_read("progressive", &progressive, colour_bound, &b);
    /* The same coefficients in another order. */
    assert_memory_equal(a.texels, b.texels, 3 * PIXELS * sizeof *a.texels);
    free(a.texels);
    free(b.texels);
    assert_read("subsampled", &subsampled, colour_bound, &a);
    free(a.texels);
    assert_read("grey", &grey, grey_bound, &a);
    assert_read("grey, progressive", &grey_progressive, grey_bound, &b);
    assert_memory_equal(a.texels, b.texels, 3 * PIXELS * sizeof *a.texels);
    for (int i = 0; i < PIXELS; i++)
        assert_true(a.texels[3 * i] == a.texels[3 * i + 1] && a.texels[3 * i] == a.texels[3 * i + 2]);
    free(a.texels);
    free(b.texels);
}

/* By the curve of IEC 61966-2-1; and to the bit what a PNG of the same bytes is read as. */
static void test_srgb(void **state) {
    (void)state;
    size_t size;
    unsigned char *bytes = make(&baseline, &size);
    brume_image raw, linear, png;
    assert_int_equal(read_bytes(bytes, size, 1, &raw), BRUME_OK);
    assert_int_equal(read_bytes(bytes, size, 0, &linear), BRUME_OK);
    free(bytes);
    for (int i = 0; i < 3 * PIXELS; i++) {
        double v = raw.texels[i], wanted = v <= 0.04045 ? v / 12.92 : pow((v + 0.055) / 1.055, 2.4);
        assert_true(fabs(linear.texels[i] - wanted) <= 1e-6);
    }
    assert_int_equal(
        brume_png_write(context, in_folder("a.png"), WIDTH, HEIGHT, linear.texels, 0, BRUME_TONEMAP_NONE, NULL),
        BRUME_OK);
    assert_int_equal(brume_image_read(context, path_memory, 0, NULL, &png), BRUME_OK);
    assert_memory_equal(linear.texels, png.texels, 3 * PIXELS * sizeof *png.texels);
    free(raw.texels);
    free(linear.texels);
    free(png.texels);
}

/* ---- wrong ones ------------------------------------------------------------------------------------------------ */

static void assert_refused(const char *what, const void *bytes, size_t size, const char *words) {
    brume_image image = {1, 2, NULL};
    brume_result result = read_bytes(bytes, size, 0, &image);
    const char *said = brume_context_message(context);
    if (result != BRUME_ERROR_SCENE || strchr(said, '\n') || !strstr(said, "a.jpg: ") || !strstr(said, words))
        fail_msg("%s, %zu bytes: %s, \"%s\" instead of \"%s\"", what, size, brume_result_name(result), said, words);
    assert_true(image.width == 1 && image.height == 2 && !image.texels);
}

/* libjpeg itself goes on with what it has, from the first scan on, and warns. */
static void test_cut_off(void **state) {
    (void)state;
    static const struct { const char *name; const jpeg_kind *kind; } cases[] = {
        {"colour", &baseline}, {"progressive", &progressive}, {"grey", &grey}, {"subsampled", &subsampled}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        size_t size;
        unsigned char *bytes = make(cases[i].kind, &size);
        assert_refused(cases[i].name, bytes, 0, "the file is empty");
        assert_refused(cases[i].name, bytes, 1, "not a readable picture: unknown image type");
        for (size_t n = 2; n < size; n++) assert_refused(cases[i].name, bytes, n, "Premature end of JPEG file");
        free(bytes);
    }
}

/* Each byte in turn: refused with words or read, but never worse. */
static void test_damaged(void **state) {
    (void)state;
    const jpeg_kind *const kinds[] = {&baseline, &progressive, &grey, &subsampled};
    int refused = 0, tried = 0;
    for (int i = 0; i < 4; i++) {
        size_t size;
        unsigned char *bytes = make(kinds[i], &size);
        for (size_t n = 0; n < size; n++, tried++) {
            brume_image image;
            bytes[n] ^= 0xa5;
            brume_result result = read_bytes(bytes, size, 0, &image);
            bytes[n] ^= 0xa5;
            if (result == BRUME_OK) {
                free(image.texels);
                continue;
            }
            refused++;
            assert_int_equal(result, BRUME_ERROR_SCENE);
            assert_true(strlen(brume_context_message(context)) > 20);
        }
        free(bytes);
    }
    print_message("damaged in one byte: %d of %d refused\n", refused, tried);
}

/* A marker's place. */
static size_t find_marker(const unsigned char *bytes, size_t size, unsigned char marker) {
    size_t at = 0;
    while (at + 1 < size && !(bytes[at] == 0xff && bytes[at + 1] == marker)) at++;
    assert_true(at + 16 < size);
    return at;
}

static void test_unsupported(void **state) {
    (void)state;
    static const jpeg_kind cmyk = {4, 90, 0, 0, 0}, pair = {2, 90, 0, 0, 0}, arithmetic = {3, 90, 0, 0, 1};
    unsigned char pixels[4 * PIXELS];
    size_t size;
    unsigned char *bytes = make(&cmyk, &size);
    assert_refused("CMYK", bytes, size, "not a readable picture: its colours are CMYK: expected grey, RGB or YCbCr");
    free(bytes);
    bytes = make(&pair, &size);
    assert_refused("two channels", bytes, size, "its colours are not known");
    free(bytes);
    paint(&arithmetic, pixels);
    bytes = jpeg_write(&arithmetic, WIDTH, HEIGHT, pixels, &size);
    if (bytes) assert_refused("arithmetic coding", bytes, size, "arithmetic coding");
    free(bytes);

    bytes = make(&baseline, &size);
    size_t frame = find_marker(bytes, size, 0xc0), table = find_marker(bytes, size, 0xc4);
    unsigned char *height = bytes + frame + 5;
    memset(height, 0, 2);
    assert_refused("no height", bytes, size, "Empty JPEG image");
    /* 16384 x 16384: below what is too large in any case. */
    memcpy(height, "\x40\0\x40\0", 4);
    assert_refused("large", bytes, size, "the file is too short for as many pixels as it says");
    memcpy(height, "\xf0\0\xf0\0", 4);
    assert_refused("larger", bytes, size, "the picture is too large");
    memcpy(height, "\0\x15\0\x25", 4);
    /* 16 counts of codes, of which 256 are the most. */
    memset(bytes + table + 5, 0xff, 16);
    assert_refused("codes", bytes, size, "Bogus Huffman table definition");
    free(bytes);
}

/* What fuzzing has found: stb wrote past its table of codes. It took FF before the first marker, libjpeg does not. */
static void test_found(void **state) {
    (void)state;
    static const char *const found[][2] = {
        {"test/fuzz/found/picture/jpeg-codes-behind-ff", "not a readable picture: unknown image type"},
        {"test/fuzz/found/picture/jpeg-too-many-codes", "not a readable picture: Bogus Huffman table definition"}};
    for (int i = 0; i < 2; i++) {
        brume_image image;
        assert_int_equal(brume_image_read(context, found[i][0], 0, NULL, &image), BRUME_ERROR_SCENE);
        assert_non_null(strstr(brume_context_message(context), found[i][1]));
    }
}

/* The bound on pixels lets the emptiest pictures pass: two scans of grey take little more than a bit for a block. */
static void test_nothing_in_it(void **state) {
    (void)state;
    enum { SIDE = 2048 };
    static const jpeg_kind kinds[] = {{1, 50, 0, 0, 0}, {3, 50, 0, 1, 0}, {1, 50, 2, 0, 0}, {3, 50, 1, 1, 0}};
    unsigned char *pixels = malloc(3 * SIDE * SIDE);
    assert_non_null(pixels);
    memset(pixels, 128, 3 * SIDE * SIDE);
    for (size_t i = 0; i < sizeof kinds / sizeof kinds[0]; i++) {
        size_t size;
        brume_image image;
        unsigned char *bytes = jpeg_write(&kinds[i], SIDE, SIDE, pixels, &size);
        assert_non_null(bytes);
        print_message("%d pixels a byte\n", (int)(SIDE * SIDE / size));
        assert_int_equal(read_bytes(bytes, size, 1, &image), BRUME_OK);
        assert_float_equal(image.texels[3 * SIDE * SIDE - 1], 128 / 255.0, 1e-7);
        free(image.texels);
        free(bytes);
    }
    free(pixels);
}

/* The second of two scans, again and again: each says what the one before has said, which libjpeg doesn't mind. */
static void test_scans(void **state) {
    (void)state;
    static const jpeg_kind two = {1, 50, 2, 0, 0};
    size_t size, last = 0;
    unsigned char *bytes = make(&two, &size);
    for (size_t at = 0; at + 1 < size; at++)
        if (bytes[at] == 0xff && bytes[at + 1] == 0xda) last = at;
    size_t scan = size - 2 - last; /* the file's end is a marker of two bytes */
    unsigned char *many = malloc(size + 500 * scan);
    assert_non_null(many);
    memcpy(many, bytes, last);
    for (size_t i = 0; i < 500; i++) memcpy(many + last + i * scan, bytes + last, scan);
    memcpy(many + last + 499 * scan, "\xff\xd9", 2);
    brume_image image;
    assert_int_equal(read_bytes(many, last + 499 * scan + 2, 0, &image), BRUME_OK);
    free(image.texels);
    memcpy(many + last + 499 * scan, bytes + last, scan);
    memcpy(many + last + 500 * scan, "\xff\xd9", 2);
    assert_refused("501 scans", many, last + 500 * scan + 2, "it has more than 500 scans");
    free(many);
    free(bytes);
}

/* ---- memory ---------------------------------------------------------------------------------------------------- */

/* Each allocation fails, with all later ones or alone: an error that leaves nothing behind. Alone, the C library reads
 * without a buffer, and libjpeg asks for a smaller pool: then it is the same picture. */
static void test_memory(void **state) {
    (void)state;
    const jpeg_kind *const kinds[] = {&baseline, &progressive, &subsampled, &grey};
    char who[256], said[256];
    if (!host_shim_works()) skip();
    for (int i = 0; i < 4; i++) {
        size_t size;
        unsigned char *bytes = make(kinds[i], &size);
        brume_image right, image;
        put_file("a.jpg", bytes, size);
        free(bytes);
        host_shim_begin(0, 0);
        assert_int_equal(brume_image_read(context, path_memory, 0, NULL, &right), BRUME_OK);
        unsigned count = host_shim_count(), reported = 0;
        host_shim_end();
        for (unsigned n = 2; n < 2 * count + 2; n++) {
            host_shim_begin(n / 2, n % 2);
            brume_result result = brume_image_read(context, path_memory, 0, NULL, &image);
            host_shim_relent();
            int fired = host_shim_fired();
            snprintf(said, sizeof said, "%s", result == BRUME_OK ? "read" : brume_context_message(context));
            int same = result == BRUME_OK &&
                       memcmp(image.texels, right.texels, 3 * PIXELS * sizeof *right.texels) == 0;
            if (result == BRUME_OK) free(image.texels);
            brume_fail(context, BRUME_OK, "%s", ""); /* the one allocation that is left */
            size_t left = host_shim_left(who);
            host_shim_end();
            if (!fired || (result != BRUME_ERROR_MEMORY && (n % 2 || !same)) || !said[0] || left != 1)
                fail_msg("allocation %u of %u: %s, \"%s\", %zu left, one of %s", n / 2, count,
                         brume_result_name(result), said, left, who);
            reported += result != BRUME_OK;
        }
        free(right.texels);
        print_message("%u allocations, %u failures, %u reported\n", count, 2 * count, reported);
        assert_true(count > 10 && reported > count);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        FRESH(test_known_pictures), FRESH(test_srgb),  FRESH(test_cut_off),       FRESH(test_damaged),
        FRESH(test_unsupported),    FRESH(test_found), FRESH(test_nothing_in_it), FRESH(test_scans),
        FRESH(test_memory),
    };
    return cmocka_run_group_tests(tests, open_images, close_images);
}

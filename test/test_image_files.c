/* test_image_files.c -- picture files that can't be read or written, and what kind a file is. */
#include <errno.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmocka.h>

#include "image_folder.h"

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
    put_file("empty.png", "", 0);
    assert_unreadable("empty.png", "empty");
    put_file("text.png", "this is no picture", 18);
    assert_unreadable("text.png", "not a readable picture");
    put_file("cut.png", "\x89PNG\r\n\x1a\n\0\0\0\rIHDR", 16);
    assert_unreadable("cut.png", "not a readable picture");
    put_file("nothing.png", "\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\0\1\0\0\0\1\10\2\0\0\0\x90\x77\x53\xde"
        "\0\0\0\0IDAT\x35\xaf\6\x1e", 45);
    assert_unreadable("nothing.png", "begins with an empty chunk");
    /* TGA, 20000 x 10000 pixels, of which there is none */
    put_file("short.tga", "\0\0\2\0\0\0\0\0\0\0\0\0\x20\x4e\x10\x27\x18\0", 18);
    assert_unreadable("short.tga", "too short for as many pixels");
    put_file("magic.exr", "\x76\x2f\x31\x01", 4);
    assert_unreadable("magic.exr", "");
    /* An EXR cut off anywhere, and with each byte of it damaged in turn: refused or read, but never worse. */
    assert_int_equal(brume_exr_write(context, in_folder("y.exr"), 0, 0, 4, 4, 4, 4, &channel, 1, NULL, 0), BRUME_OK);
    FILE *file = fopen(path_memory, "rb");
    size_t size = fread(whole, 1, sizeof whole, file);
    fclose(file);
    /* 50 million pixels a line, of which there are 4: refused before there is memory for them. */
    static const char window[] = "dataWindow\0box2i\0\x10\0\0";
    size_t at = 0;
    while (at < size && memcmp(whole + at, window, sizeof window) != 0) at++;
    assert_true(at + sizeof window + 16 < size);
    unsigned char *right = whole + at + sizeof window + 8, was = right[3];
    right[3] = 3;
    put_file("wide.exr", whole, size);
    right[3] = was;
    assert_unreadable("wide.exr", "too short for as many pixels");
    for (size_t i = 4; i < size; i++) {
        put_file("cut.exr", whole, i);
        assert_unreadable("cut.exr", "");
    }
    for (size_t i = 4; i < size; i++) {
        brume_image image;
        whole[i] ^= 0xa5;
        put_file("damaged.exr", whole, size);
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
    put_file("old.exr", "old", 3);
    put_file("old.png", "old", 3);
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

int main(void) {
    const struct CMUnitTest tests[] = {
        FRESH(test_by_content),
        FRESH(test_unreadable),
        FRESH(test_unwritable),
        FRESH(test_full_disk),
    };
    return cmocka_run_group_tests(tests, open_images, close_images);
}

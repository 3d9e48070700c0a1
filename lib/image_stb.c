/* image_stb.c -- stb_image and stb_image_write, compiled here alone and kept static, so that a program with its own
 * copy can link the static library.
 */
#include "image_stb.h"

#include <limits.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <zlib.h>

#include "platform.h"

/* For the whole file: unused static functions are reported at its end. */
#if defined(__GNUC__)
#pragma GCC diagnostic ignored "-Wunused-function"
#pragma GCC diagnostic ignored "-Wunused-parameter"
#pragma GCC diagnostic ignored "-Wsign-compare"
#pragma GCC diagnostic ignored "-Wshadow"
#pragma GCC diagnostic ignored "-Wpointer-arith"
#pragma GCC diagnostic ignored "-Wmissing-field-initializers"
#pragma GCC diagnostic ignored "-Wstrict-prototypes"
#pragma GCC diagnostic ignored "-Wmissing-prototypes"
#endif
#define STB_IMAGE_STATIC
#define STB_IMAGE_IMPLEMENTATION
#define STBI_NO_STDIO
/* image_jpeg.c; stb's reader writes past a table of Huffman codes. */
#define STBI_NO_JPEG
/* What nobody takes for textures is not for files from anywhere to reach. */
#define STBI_NO_PSD
#define STBI_NO_GIF
#define STBI_NO_PIC
#include <stb/stb_image.h>

/* What stb packs: its own deflate crashes where memory runs out, and packs less. Where memory runs out later, stb
 * forgets what it holds: so it is the lock's holder who frees it. */
static brume_lock packing = BRUME_LOCK_INIT;
static unsigned char *packed;

static unsigned char *pack(const unsigned char *bytes, int count, int *out_count) {
    uLongf size = compressBound((uLong)count);
    packed = size <= INT_MAX ? malloc(size) : NULL;
    if (!packed || compress2(packed, &size, bytes, (uLong)count, Z_DEFAULT_COMPRESSION) != Z_OK) return NULL;
    *out_count = (int)size;
    return packed;
}

static void release(void *memory) {
    if (memory != packed) free(memory);
}

#define STBIW_ZLIB_COMPRESS(bytes, count, out_count, quality) pack(bytes, count, out_count)
#define STBIW_MALLOC(size) malloc(size)
#define STBIW_REALLOC(memory, size) realloc(memory, size)
#define STBIW_FREE(memory) release(memory)
#define STB_IMAGE_WRITE_STATIC
#define STB_IMAGE_WRITE_IMPLEMENTATION
#define STBI_WRITE_NO_STDIO
#include <stb/stb_image_write.h>

/* An empty chunk before the first data of a PNG, which the format allows and nobody writes: stb copies it to NULL. */
static int begins_with_nothing(const unsigned char *bytes, size_t size) {
    static const unsigned char signature[] = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};
    if (size < sizeof signature || memcmp(bytes, signature, sizeof signature) != 0) return 0;
    for (size_t at = sizeof signature; size - at >= 12;) {
        const unsigned char *chunk = bytes + at;
        size_t length = (size_t)chunk[0] << 24 | (size_t)chunk[1] << 16 | (size_t)chunk[2] << 8 | chunk[3];
        if (memcmp(chunk + 4, "IDAT", 4) == 0) return length == 0;
        if (length > size - at - 12) return 0;
        at += 12 + length;
    }
    return 0;
}

/* Pixels that a byte of a file can hold at most: PNG's, 8 of one bit in what deflate packs 1032 times; the other
 * formats stay far below. Where a file is cut off, stb goes on with zeros. */
enum { MOST_PIXELS_OF_A_BYTE = 8 * 1032 };

static int holds_less_than_it_says(const unsigned char *bytes, size_t size) {
    int width, height, channels;
    return stbi_info_from_memory(bytes, (int)size, &width, &height, &channels) && width > 0 && height > 0 &&
           (uint64_t)width * (uint64_t)height > (uint64_t)MOST_PIXELS_OF_A_BYTE * size;
}

void *brume_stb_decode(const void *bytes, size_t size, int *out_width, int *out_height, int *out_bits,
                       const char **out_why) {
    int channels;
    void *texels;
    *out_why = "the file is too large";
    if (size > INT_MAX)
        return NULL;
    *out_why = "its data begins with an empty chunk";
    if (begins_with_nothing(bytes, size))
        return NULL;
    *out_why = "the file is too short for as many pixels as it says";
    if (holds_less_than_it_says(bytes, size))
        return NULL;
    if (stbi_is_hdr_from_memory(bytes, (int)size)) {
        *out_bits = BRUME_STB_FLOAT;
        texels = stbi_loadf_from_memory(bytes, (int)size, out_width, out_height, &channels, 3);
    } else if (stbi_is_16_bit_from_memory(bytes, (int)size)) {
        *out_bits = BRUME_STB_16;
        texels = stbi_load_16_from_memory(bytes, (int)size, out_width, out_height, &channels, 3);
    } else {
        *out_bits = BRUME_STB_8;
        texels = stbi_load_from_memory(bytes, (int)size, out_width, out_height, &channels, 3);
    }
    if (!texels)
        *out_why = stbi_failure_reason() ? stbi_failure_reason() : "unknown image format";
    return texels;
}

int brume_stb_encode_png(void (*write)(void *user, void *bytes, int size), void *user, int width, int height,
                         const unsigned char *rgb) {
    brume_lock_exclusive(&packing);
    int done = stbi_write_png_to_func(write, user, width, height, 3, rgb, 3 * width);
    free(packed);
    packed = NULL;
    brume_unlock_exclusive(&packing);
    return done;
}

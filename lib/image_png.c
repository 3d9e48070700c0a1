/* image_png.c -- 8-bit pictures from linear radiance. Transfer curve: sRGB, IEC 61966-2-1, exactly. */
#include <limits.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include <zlib.h>

#include "image.h"
#include "image_stb.h"
#include "output.h"

static unsigned char encode(double linear) {
    if (!(linear > 0)) /* NaN, too */
        return 0;
    if (linear >= 1)
        return 255;
    double curve = linear <= 0.0031308 ? 12.92 * linear : 1.055 * pow(linear, 1 / 2.4) - 0.055;
    return (unsigned char)(255 * curve + 0.5);
}

/* Narkowicz 2015: a fit to the reference rendering of ACES. Its limit is 1.03, and NaN stays one. */
static double filmic(double x) {
    if (x > 1e6) return 1;
    return x < 0 ? 0 : x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14);
}

/* Where the encoder's bytes go, and what to slip in between. */
typedef struct png_stream {
    brume_output *output;
    const char *comment; /* NULL: none, or written already */
    int failed;
} png_stream;

enum { HEADER_END = 33 }; /* the signature and the IHDR chunk, which come first */

static void big_endian(uint32_t value, unsigned char out[4]) {
    for (int i = 0; i < 4; i++)
        out[i] = (unsigned char)(value >> (24 - 8 * i));
}

static void append_comment(png_stream *stream) {
    static const char keyword[] = "tEXtComment"; /* its NUL separates keyword and text */
    size_t length = strlen(stream->comment), content = sizeof keyword + length;
    unsigned char *chunk = malloc(content + 8);
    if (!chunk) {
        stream->failed = 1;
        return;
    }
    big_endian((uint32_t)(content - 4), chunk);
    memcpy(chunk + 4, keyword, sizeof keyword);
    memcpy(chunk + 4 + sizeof keyword, stream->comment, length);
    big_endian((uint32_t)crc32(0, chunk + 4, (uInt)content), chunk + 4 + content);
    brume_output_append(stream->output, chunk, content + 8);
    free(chunk);
}

/* stb hands over the whole file at once. */
static void append(void *user, void *bytes, int size) {
    png_stream *stream = user;
    const unsigned char *from = bytes;
    size_t count = (size_t)size;
    if (stream->comment && count > HEADER_END) {
        brume_output_append(stream->output, from, HEADER_END);
        append_comment(stream);
        stream->comment = NULL;
        from += HEADER_END;
        count -= HEADER_END;
    }
    brume_output_append(stream->output, from, count);
}

brume_result brume_png_write(brume_context *context, const char *path, uint32_t width, uint32_t height,
                             const float *rgb, float exposure, brume_tonemap tonemap, const char *comment) {
    if (!path || !rgb || width == 0 || height == 0 || !isfinite(exposure))
        return brume_fail(context, BRUME_ERROR_ARGUMENT, "%s: a PNG needs pixels and a finite exposure",
                          path ? path : "(no name)");
    /* stb counts bytes in an int. */
    if ((3 * (uint64_t)width + 1) * height > INT_MAX / 2)
        return brume_fail(context, BRUME_ERROR_OUTPUT, "%s: %u x %u pixels are too many for a PNG", path,
                          (unsigned)width, (unsigned)height);
    size_t count = 3 * (size_t)width * height;
    double scale = exp2(exposure);
    unsigned char *bytes = malloc(count);
    if (!bytes)
        return brume_fail(context, BRUME_ERROR_MEMORY, "%s: out of memory", path);
    for (size_t i = 0; i < count; i++)
        bytes[i] = encode(tonemap == BRUME_TONEMAP_FILMIC ? filmic(rgb[i] * scale) : rgb[i] * scale);
    brume_output output;
    brume_result result = brume_output_open(context, path, &output);
    if (result == BRUME_OK) {
        png_stream stream = {&output, comment, 0};
        int encoded = brume_stb_encode_png(append, &stream, (int)width, (int)height, bytes) && !stream.failed;
        result = brume_output_close(context, &output, encoded);
        if (result == BRUME_OK && !encoded)
            result = brume_fail(context, BRUME_ERROR_MEMORY, "%s: out of memory", path);
    }
    free(bytes);
    return result;
}

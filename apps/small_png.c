/* small_png.c -- see small_png.h. PNG: ISO/IEC 15948; the zlib stream inside (RFC 1950) is one of stored blocks
 * (RFC 1951, 3.2.4), a row each. */
#include "small_png.h"

#include <errno.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include "files.h"

typedef struct stream {
    FILE *file;
    uint32_t crc;
} stream;

static void put(stream *s, const void *bytes, size_t count)
{
    const unsigned char *b = bytes;
    for (size_t i = 0; i < count; i++) {
        s->crc ^= b[i];
        for (int k = 0; k < 8; k++)
            s->crc = s->crc >> 1 ^ (s->crc & 1 ? 0xedb88320u : 0);
    }
    fwrite(bytes, 1, count, s->file);
}

static void put32(stream *s, uint32_t x)
{
    const unsigned char bytes[4] = {(unsigned char)(x >> 24), (unsigned char)(x >> 16), (unsigned char)(x >> 8),
                                    (unsigned char)x};
    put(s, bytes, 4);
}

static void begin_chunk(stream *s, const char *name, size_t length)
{
    put32(s, (uint32_t)length);
    s->crc = 0xffffffffu;
    put(s, name, 4);
}

static void end_chunk(stream *s)
{
    put32(s, ~s->crc);
}

static void put_rows(stream *s, size_t width, size_t height, const unsigned char *rgb)
{
    uint32_t a = 1, b = 0; /* Adler-32 */
    size_t row = 3 * width + 1;
    put(s, "\x78\x01", 2);
    for (size_t y = 0; y < height; y++) {
        const unsigned char head[6] = {y + 1 == height, (unsigned char)row, (unsigned char)(row >> 8),
                                       (unsigned char)~row, (unsigned char)(~row >> 8), 0 /* no filter */};
        put(s, head, 6);
        put(s, rgb + 3 * width * y, 3 * width);
        b = (b + a) % 65521;
        for (size_t i = 0; i < 3 * width; i++) {
            a = (a + rgb[3 * width * y + i]) % 65521;
            b = (b + a) % 65521;
        }
    }
    put32(s, b << 16 | a);
}

int small_png_write(const char *path, size_t width, size_t height, const unsigned char *rgb)
{
    if (width == 0 || height == 0 || 3 * width + 1 > 0xffff)
        return EINVAL;
    files_draft draft;
    int error = files_begin(&draft, path);
    if (error)
        return error;
    stream s = {draft.file, 0};
    put(&s, "\x89PNG\r\n\x1a\n", 8);
    begin_chunk(&s, "IHDR", 13);
    put32(&s, (uint32_t)width);
    put32(&s, (uint32_t)height);
    put(&s, "\x08\x02\0\0\0", 5);
    end_chunk(&s);
    begin_chunk(&s, "IDAT", 2 + height * (3 * width + 6) + 4);
    put_rows(&s, width, height, rgb);
    end_chunk(&s);
    begin_chunk(&s, "IEND", 0);
    end_chunk(&s);
    return files_end(&draft, 1);
}

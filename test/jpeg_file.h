/* jpeg_file.h -- JPEG files for tests, written by libjpeg. */
#ifndef TEST_JPEG_FILE_H
#define TEST_JPEG_FILE_H

#include <stddef.h>

typedef struct jpeg_kind {
    int components; /* of the pixels: 1 grey, 3 RGB, 4 CMYK, 2 nothing known */
    int quality; /* 1 to 100 */
    int progressive; /* 1: in libjpeg's scans; 2, grey alone: in two, of which the second may be repeated */
    int subsampled; /* chroma at half the size, as most programs write it */
    int arithmetic; /* coded so, where libjpeg can */
} jpeg_kind;

/* Bytes that are the caller's to free; NULL if libjpeg can't. `pixels`: height x width x components. */
unsigned char *jpeg_write(const jpeg_kind *kind, unsigned width, unsigned height, const unsigned char *pixels,
                          size_t *out_size);

#endif

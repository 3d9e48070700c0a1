/* picture_file.h -- pictures of 3 floats a pixel, rows from the top, on disk and in pages. */
#ifndef PICTURE_FILE_H
#define PICTURE_FILE_H

#include <stddef.h>

/* PFM (Debevec's portable float map): "PF", width and height, -1 for little-endian, then rows from the bottom. Any
 * viewer for high dynamic range opens it. 0, or errno; the file appears whole or not at all. */
int picture_write_pfm(const char *path, const float *rgb, size_t width, size_t height);
/* Returns NULL if there is no such file of exactly that size; free() the pixels. */
float *picture_read_pfm(const char *path, size_t width, size_t height);

/* As a display shows it: times `exposure`, cut, the sRGB curve, 8 bits. `bytes` receives 3 a pixel. */
void picture_to_bytes(const float *rgb, size_t pixel_count, double exposure, unsigned char *bytes);

/* Differences of luminance relative to the reference: blue where the picture is too dark, black where it is right, red
 * to yellow where it is too bright; full colour at `full`. */
void picture_difference(const float *picture, const float *reference, size_t pixel_count, double full,
                        unsigned char *bytes);

/* A PNG file in memory, to be freed; NULL if memory ran out. */
unsigned char *picture_png(const unsigned char *bytes, size_t width, size_t height, size_t *size);

#endif

/* small_png.h -- an 8-bit RGB PNG without compression, for small pictures that no render holds. */
#ifndef SMALL_PNG_H
#define SMALL_PNG_H

#include <stddef.h>

/* rgb: height x width x 3 bytes, rows from the top. The file appears whole. 0, or errno: EINVAL for a size
 * that it is not for. */
int small_png_write(const char *path, size_t width, size_t height, const unsigned char *rgb);

#endif

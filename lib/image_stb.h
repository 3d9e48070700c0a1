/* image_stb.h -- the two calls of stb that the library makes. Private to lib/image_*.c. */
#ifndef BRUME_IMAGE_STB_H
#define BRUME_IMAGE_STB_H

#include <stddef.h>

enum { BRUME_STB_8 = 8, BRUME_STB_16 = 16, BRUME_STB_FLOAT = 32 };

/* Decodes to RGB, row 0 at the top: bytes, 16-bit words or linear floats, as *out_bits says. NULL with *out_why (a
 * constant string) if it can't. free() */
void *brume_stb_decode(const void *bytes, size_t size, int *out_width, int *out_height, int *out_bits,
                       const char **out_why);

/* PNG of 8-bit RGB, handed to `write` in pieces. 0 if memory ran out. */
int brume_stb_encode_png(void (*write)(void *user, void *bytes, int size), void *user, int width, int height,
                         const unsigned char *rgb);

#endif

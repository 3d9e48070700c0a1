/* image_jpeg.h -- reading JPEG. Private to lib/image_*.c. */
#ifndef BRUME_IMAGE_JPEG_H
#define BRUME_IMAGE_JPEG_H

#include <stddef.h>

#include "brume.h"

enum { BRUME_JPEG_WHY = 256 };

/* By its first bytes. */
int brume_jpeg_is(const void *bytes, size_t size);

/* Decodes grey, RGB or YCbCr to height x width x 3 bytes of RGB, row 0 at the top: free(). BRUME_ERROR_MEMORY, or
 * BRUME_ERROR_SCENE with the reason in `why`: also for data that is cut off or damaged where libjpeg would go on with a
 * warning. */
brume_result brume_jpeg_decode(const void *bytes, size_t size, int *out_width, int *out_height,
                               unsigned char **out_rgb, char why[BRUME_JPEG_WHY]);

#endif

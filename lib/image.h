/* image.h -- picture files: reading textures, writing films. */
#ifndef BRUME_IMAGE_H
#define BRUME_IMAGE_H

#include "context.h"

typedef struct brume_image {
    uint32_t width, height;
    float *texels; /* height x width x 3, linear RGB, row 0 at the top; free() */
} brume_image;

/* PNG (and what else stb_image reads), JPEG or EXR, by content. 8-bit data is taken as sRGB unless `raw`. `where`
 * prefixes errors ("file.xml:3:5"), NULL for none. Grey becomes RGB, alpha is dropped. */
brume_result brume_image_read(brume_context *context, const char *path, int raw, const char *where, brume_image *out);

/* One channel of an EXR: `data` is height x width with `stride` floats between pixels. */
typedef struct brume_exr_channel {
    const char *name;
    const float *data;
    uint32_t stride;
    uint32_t half; /* store 16 bits, clamped to +-65504 */
} brume_exr_channel;

typedef struct brume_exr_attribute {
    const char *name;
    enum { BRUME_EXR_STRING, BRUME_EXR_INT, BRUME_EXR_FLOAT, BRUME_EXR_MATRIX } type;
    const char *string;
    int32_t integer;
    float number;
    float matrix[16]; /* row-major as in brume.h; stored transposed, since EXR multiplies row vectors */
} brume_exr_attribute;

/* Data window [x, x + width) x [y, y + height) inside a display window of full_width x full_height. Channels in any
 * order, stored alphabetically; ZIP. Written to a temporary name in the same folder, then renamed. */
brume_result brume_exr_write(brume_context *context, const char *path, uint32_t x, uint32_t y, uint32_t width,
                             uint32_t height, uint32_t full_width, uint32_t full_height,
                             const brume_exr_channel *channels, uint32_t channel_count,
                             const brume_exr_attribute *attributes, uint32_t attribute_count);

/* 8-bit PNG from linear RGB: scaled by 2^exposure, by the tone curve, then the exact sRGB curve. Same way of writing.
 * comment: ASCII, shown by viewers under that name (a tEXt chunk), or NULL. */
brume_result brume_png_write(brume_context *context, const char *path, uint32_t width, uint32_t height,
                             const float *rgb, float exposure, brume_tonemap tonemap, const char *comment);

#endif

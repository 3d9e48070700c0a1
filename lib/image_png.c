/* image_png.c -- 8-bit pictures from linear radiance. Transfer curve: sRGB, IEC 61966-2-1, exactly. */
#include <limits.h>
#include <math.h>
#include <stdlib.h>

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

static void append(void *user, void *bytes, int size) {
    brume_output_append(user, bytes, (size_t)size);
}

brume_result brume_png_write(brume_context *context, const char *path, uint32_t width, uint32_t height,
                             const float *rgb, float exposure) {
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
        bytes[i] = encode(rgb[i] * scale);
    brume_output output;
    brume_result result = brume_output_open(context, path, &output);
    if (result == BRUME_OK) {
        int encoded = brume_stb_encode_png(append, &output, (int)width, (int)height, bytes);
        result = brume_output_close(context, &output, encoded);
        if (result == BRUME_OK && !encoded)
            result = brume_fail(context, BRUME_ERROR_MEMORY, "%s: out of memory", path);
    }
    free(bytes);
    return result;
}

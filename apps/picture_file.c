/* picture_file.c -- see picture_file.h. */
#include "picture_file.h"

#include <errno.h>
#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "files.h"

#if defined(__GNUC__)
#pragma GCC diagnostic ignored "-Wunused-function"
#pragma GCC diagnostic ignored "-Wmissing-field-initializers"
#pragma GCC diagnostic ignored "-Wmissing-prototypes"
#endif
#define STB_IMAGE_WRITE_STATIC
#define STB_IMAGE_WRITE_IMPLEMENTATION
#define STBI_WRITE_NO_STDIO
#include <stb/stb_image_write.h>

/* The machines that this runs on are little-endian, as OpenCL's CPU drivers are; one that isn't would have to swap. */
int picture_write_pfm(const char *path, const float *rgb, size_t width, size_t height)
{
    char header[64];
    size_t begin = (size_t)snprintf(header, sizeof header, "PF\n%zu %zu\n-1.0\n", width, height);
    size_t row = 3 * width * sizeof(float), size = begin + row * height;
    char *bytes = malloc(size);
    if (!bytes)
        return ENOMEM;
    memcpy(bytes, header, begin);
    for (size_t y = 0; y < height; y++)
        memcpy(bytes + begin + row * y, rgb + 3 * width * (height - 1 - y), row);
    int error = files_write(path, bytes, size);
    free(bytes);
    return error;
}

float *picture_read_pfm(const char *path, size_t width, size_t height)
{
    size_t in_width, in_height, row = 3 * width;
    double scale;
    float *rgb = NULL;
    FILE *file = fopen(path, "rb");
    if (!file)
        return NULL;
    int ok = fscanf(file, "PF %zu %zu %lf", &in_width, &in_height, &scale) == 3 && fgetc(file) == '\n' &&
             in_width == width && in_height == height && scale < 0;
    if (ok)
        rgb = malloc(row * height * sizeof *rgb);
    for (size_t y = 0; y < height && rgb; y++)
        if (fread(rgb + row * (height - 1 - y), sizeof *rgb, row, file) != row) {
            free(rgb);
            rgb = NULL;
        }
    fclose(file);
    return rgb;
}

/* IEC 61966-2-1 */
static unsigned char encode(double linear)
{
    if (!(linear > 0)) /* NaN, too */
        return 0;
    if (linear >= 1)
        return 255;
    double curve = linear <= 0.0031308 ? 12.92 * linear : 1.055 * pow(linear, 1 / 2.4) - 0.055;
    return (unsigned char)(255 * curve + 0.5);
}

void picture_to_bytes(const float *rgb, size_t pixel_count, double exposure, unsigned char *bytes)
{
    for (size_t i = 0; i < 3 * pixel_count; i++)
        bytes[i] = encode(exposure * rgb[i]);
}

static double luminance(const float *rgb)
{
    return 0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2];
}

void picture_difference(const float *picture, const float *reference, size_t pixel_count, double full,
                        unsigned char *bytes)
{
    double mean = 0;
    for (size_t i = 0; i < pixel_count; i++)
        mean += luminance(reference + 3 * i) / (double)pixel_count;
    for (size_t i = 0; i < pixel_count; i++) {
        double right = luminance(reference + 3 * i), is = luminance(picture + 3 * i);
        double off = is == right ? 0 : (is - right) / (fabs(right) + 0.1 * mean) / full;
        double strength = fmin(fabs(off), 1), brighter = strength > 0.5 ? 2 * strength - 1 : 0;
        bytes[3 * i] = (unsigned char)(255 * (off > 0 ? fmin(2 * strength, 1) : 0.55 * brighter) + 0.5);
        bytes[3 * i + 1] = (unsigned char)(255 * (off > 0 ? 0.85 * brighter : 0.45 * strength + 0.4 * brighter) + 0.5);
        bytes[3 * i + 2] = (unsigned char)(255 * (off > 0 ? 0.1 * strength : fmin(2 * strength, 1)) + 0.5);
    }
}

/* stb hands over the whole file at once. */
typedef struct collected {
    unsigned char *bytes;
    size_t size;
} collected;

static void collect(void *user, void *bytes, int size)
{
    collected *c = user;
    c->bytes = malloc((size_t)size);
    if (c->bytes)
        memcpy(c->bytes, bytes, (size_t)size);
    c->size = (size_t)size;
}

unsigned char *picture_png(const unsigned char *bytes, size_t width, size_t height, size_t *size)
{
    collected c = {NULL, 0};
    if (width == 0 || height == 0 || width > INT_MAX / 3 || (3 * width + 1) * height > INT_MAX / 2)
        return NULL;
    stbi_write_png_to_func(collect, &c, (int)width, (int)height, 3, bytes, 3 * (int)width);
    *size = c.size;
    return c.bytes;
}

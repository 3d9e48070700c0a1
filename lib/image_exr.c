/* image_exr.c -- writing OpenEXR: one part of scanlines, ZIP, through OpenEXRCore's C interface. */
#include <errno.h>
#include <limits.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "image.h"
#include "image_exr_context.h"
#include "output.h"

enum { MOST_CHANNELS = 1024 };

typedef struct sink {
    brume_exr_errors errors;
    brume_output output;
} sink;

__thread brume_exr_errors *brume_exr_listener;

static int64_t write_bytes(exr_const_context_t exr, void *user, const void *bytes, uint64_t size, uint64_t offset,
                           exr_stream_error_func_ptr_t fail) {
    sink *s = user;
    if (brume_output_write(&s->output, bytes, (size_t)size, offset))
        return (int64_t)size;
    fail(exr, EXR_ERR_WRITE_IO, "%s", strerror(s->output.error));
    return -1;
}

static int by_name(const void *a, const void *b) {
    const brume_exr_channel *const *left = a, *const *right = b;
    return strcmp((*left)->name, (*right)->name);
}

static exr_result_t set_attribute(exr_context_t exr, int part, const brume_exr_attribute *attribute) {
    exr_attr_m44f_t m;
    switch (attribute->type) {
    case BRUME_EXR_STRING: return exr_attr_set_string(exr, part, attribute->name, attribute->string);
    case BRUME_EXR_INT: return exr_attr_set_int(exr, part, attribute->name, attribute->integer);
    case BRUME_EXR_FLOAT: return exr_attr_set_float(exr, part, attribute->name, attribute->number);
    case BRUME_EXR_MATRIX:
        for (int row = 0; row < 4; row++)
            for (int column = 0; column < 4; column++)
                m.m[4 * column + row] = attribute->matrix[4 * row + column];
        return exr_attr_set_m44f(exr, part, attribute->name, &m);
    }
    return EXR_ERR_INVALID_ARGUMENT;
}

/* Lines y .. y + lines of a channel as floats in a row; halves are clamped, which OpenEXRCore
 * 3.1.5 does by itself, but doesn't promise. */
static void gather(const brume_exr_channel *channel, uint32_t width, uint32_t y, uint32_t lines, float *out) {
    const float *from = channel->data + (size_t)y * width * channel->stride;
    for (size_t i = 0; i < (size_t)width * lines; i++) {
        float value = from[i * channel->stride];
        if (channel->half && value > 65504.0f)
            value = 65504.0f;
        if (channel->half && value < -65504.0f)
            value = -65504.0f;
        out[i] = value;
    }
}

typedef struct picture {
    uint32_t x, y, width, height, full_width, full_height;
    const brume_exr_channel **channels; /* sorted */
    uint32_t channel_count;
} picture;

static exr_result_t write_header(exr_context_t exr, int part, const picture *p, const brume_exr_attribute *attributes,
                                 uint32_t attribute_count) {
    static const exr_attr_chromaticities_t rec709 = {0.64f, 0.33f, 0.30f, 0.60f, 0.15f, 0.06f, 0.3127f, 0.3290f};
    const exr_attr_v2f_t center = {{{0, 0}}};
    exr_attr_box2i_t display, data;
    memset(&display, 0, sizeof display);
    memset(&data, 0, sizeof data);
    display.max.x = (int32_t)p->full_width - 1;
    display.max.y = (int32_t)p->full_height - 1;
    data.min.x = (int32_t)p->x;
    data.min.y = (int32_t)p->y;
    data.max.x = (int32_t)(p->x + p->width) - 1;
    data.max.y = (int32_t)(p->y + p->height) - 1;
    exr_result_t code = exr_initialize_required_attr(exr, part, &display, &data, 1, &center, 1,
                                                     EXR_LINEORDER_INCREASING_Y, EXR_COMPRESSION_ZIP);
    for (uint32_t i = 0; i < p->channel_count && code == EXR_ERR_SUCCESS; i++)
        code = exr_add_channel(exr, part, p->channels[i]->name, p->channels[i]->half ? EXR_PIXEL_HALF : EXR_PIXEL_FLOAT,
                               EXR_PERCEPTUALLY_LOGARITHMIC, 1, 1);
    if (code == EXR_ERR_SUCCESS)
        code = exr_attr_set_chromaticities(exr, part, "chromaticities", &rec709);
    for (uint32_t i = 0; i < attribute_count && code == EXR_ERR_SUCCESS; i++)
        code = set_attribute(exr, part, &attributes[i]);
    return code == EXR_ERR_SUCCESS ? exr_write_header(exr) : code;
}

typedef exr_result_t (*compress_step)(exr_encode_pipeline_t *);

/* OpenEXRCore 3.1.5 keeps a compressed chunk that came out just as long as the pixels themselves; every reader takes a
 * chunk of that length for plain pixels and shows noise. Such a chunk is stored plain. */
static exr_result_t compress(exr_encode_pipeline_t *encoder) {
    compress_step library = *(compress_step *)encoder->encoding_user_data;
    exr_result_t code = library(encoder);
    if (code == EXR_ERR_SUCCESS && encoder->compressed_bytes == encoder->packed_bytes)
        memcpy(encoder->compressed_buffer, encoder->packed_buffer, encoder->packed_bytes);
    return code;
}

/* block: room for `per_chunk` lines of every channel. */
static exr_result_t write_lines(exr_context_t exr, int part, const picture *p, uint32_t per_chunk, float *block) {
    exr_encode_pipeline_t encoder = EXR_ENCODE_PIPELINE_INITIALIZER;
    compress_step library = NULL;
    exr_result_t code = EXR_ERR_SUCCESS;
    for (uint32_t y = 0; y < p->height && code == EXR_ERR_SUCCESS; y += per_chunk) {
        uint32_t lines = per_chunk < p->height - y ? per_chunk : p->height - y;
        exr_chunk_info_t chunk;
        code = exr_write_scanline_chunk_info(exr, part, (int)(p->y + y), &chunk);
        if (code == EXR_ERR_SUCCESS)
            code = y == 0 ? exr_encoding_initialize(exr, part, &chunk, &encoder)
                          : exr_encoding_update(exr, part, &chunk, &encoder);
        for (uint32_t i = 0; i < p->channel_count && code == EXR_ERR_SUCCESS; i++) {
            exr_coding_channel_info_t *c = &encoder.channels[i];
            float *plane = block + (size_t)i * per_chunk * p->width;
            gather(p->channels[i], p->width, y, lines, plane);
            c->encode_from_ptr = (const uint8_t *)plane;
            c->user_pixel_stride = sizeof(float);
            c->user_line_stride = (int32_t)(p->width * sizeof(float));
            c->user_bytes_per_element = sizeof(float);
            c->user_data_type = EXR_PIXEL_FLOAT;
        }
        if (code == EXR_ERR_SUCCESS && y == 0) {
            code = exr_encoding_choose_default_routines(exr, part, &encoder);
            library = encoder.compress_fn;
            encoder.encoding_user_data = &library;
            encoder.compress_fn = library ? compress : NULL;
        }
        if (code == EXR_ERR_SUCCESS)
            code = exr_encoding_run(exr, part, &encoder);
    }
    exr_encoding_destroy(exr, &encoder);
    return code;
}

static brume_result check(brume_context *context, const char *path, const picture *p, const brume_exr_channel *channels,
                          const brume_exr_attribute *attributes, uint32_t attribute_count) {
    if (!path || !channels || p->channel_count == 0 || p->channel_count > MOST_CHANNELS ||
        (attribute_count && !attributes))
        return brume_fail(context, BRUME_ERROR_ARGUMENT, "%s: an EXR needs channels", path ? path : "(no name)");
    if (p->width == 0 || p->height == 0 || p->full_width > INT_MAX / 4 || p->full_height > INT_MAX / 4 ||
        p->x > p->full_width || p->width > p->full_width - p->x || p->y > p->full_height ||
        p->height > p->full_height - p->y)
        return brume_fail(context, BRUME_ERROR_ARGUMENT, "%s: %u x %u pixels at (%u, %u) do not lie inside %u x %u",
                          path, (unsigned)p->width, (unsigned)p->height, (unsigned)p->x, (unsigned)p->y,
                          (unsigned)p->full_width, (unsigned)p->full_height);
    for (uint32_t i = 0; i < p->channel_count; i++)
        if (!channels[i].name || !channels[i].name[0] || !channels[i].data || channels[i].stride == 0)
            return brume_fail(context, BRUME_ERROR_ARGUMENT, "%s: channel %u lacks a name, data or a stride", path,
                              (unsigned)i);
    for (uint32_t i = 0; i < attribute_count; i++)
        if (!attributes[i].name || (attributes[i].type == BRUME_EXR_STRING && !attributes[i].string))
            return brume_fail(context, BRUME_ERROR_ARGUMENT, "%s: attribute %u lacks a name or a value", path,
                              (unsigned)i);
    return BRUME_OK;
}

brume_result brume_exr_write(brume_context *context, const char *path, uint32_t x, uint32_t y, uint32_t width,
                             uint32_t height, uint32_t full_width, uint32_t full_height,
                             const brume_exr_channel *channels, uint32_t channel_count,
                             const brume_exr_attribute *attributes, uint32_t attribute_count) {
    picture p = {x, y, width, height, full_width, full_height, NULL, channel_count};
    brume_result result = check(context, path, &p, channels, attributes, attribute_count);
    if (result != BRUME_OK)
        return result;
    enum { ZIP_LINES = 16 };
    float *block = malloc((size_t)width * ZIP_LINES * channel_count * sizeof *block);
    p.channels = malloc(channel_count * sizeof *p.channels);
    sink s;
    memset(&s, 0, sizeof s);
    if (!block || !p.channels) {
        result = brume_fail(context, BRUME_ERROR_MEMORY, "%s: out of memory", path);
        goto cleanup;
    }
    for (uint32_t i = 0; i < channel_count; i++)
        p.channels[i] = &channels[i];
    /* Chunks hold channels in the order of the header's sorted list. */
    qsort(p.channels, channel_count, sizeof *p.channels, by_name);
    result = brume_output_open(context, path, &s.output);
    if (result != BRUME_OK)
        goto cleanup;

    exr_context_t exr = NULL;
    exr_context_initializer_t start = EXR_DEFAULT_CONTEXT_INITIALIZER;
    start.error_handler_fn = brume_exr_on_error;
    start.user_data = &s;
    brume_exr_listener = &s.errors;
    start.write_fn = write_bytes;
    int part = 0;
    errno = 0; /* which allocations that fail set: compression calls that corrupt data */
    exr_result_t code = exr_start_write(&exr, path, EXR_WRITE_FILE_DIRECTLY, &start);
    if (code == EXR_ERR_SUCCESS) {
        code = exr_add_part(exr, NULL, EXR_STORAGE_SCANLINE, &part);
        if (code == EXR_ERR_SUCCESS)
            code = write_header(exr, part, &p, attributes, attribute_count);
        if (code == EXR_ERR_SUCCESS)
            code = write_lines(exr, part, &p, ZIP_LINES, block);
        if (code != EXR_ERR_SUCCESS && errno == ENOMEM)
            code = EXR_ERR_OUT_OF_MEMORY;
        exr_result_t finished = exr_finish(&exr);
        code = code == EXR_ERR_SUCCESS ? finished : code;
    }
    brume_exr_listener = NULL;
    result = brume_output_close(context, &s.output, code == EXR_ERR_SUCCESS);
    if (result == BRUME_OK && code != EXR_ERR_SUCCESS)
        result = brume_fail(context, code == EXR_ERR_OUT_OF_MEMORY ? BRUME_ERROR_MEMORY : BRUME_ERROR_OUTPUT, "%s: %s",
                            path, s.errors.first[0] ? s.errors.first : exr_get_default_error_message(code));
cleanup:
    free(block);
    free(p.channels);
    return result;
}

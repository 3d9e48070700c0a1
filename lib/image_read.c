/* image_read.c -- reading pictures, for scenes and programs: EXR through OpenEXRCore, JPEG through
 * libjpeg, the rest through stb_image.
 *
 * 8 and 16-bit data is decoded by the exact sRGB curve (IEC 61966-2-1) unless taken raw; EXR and HDR are linear.
 */
#include <errno.h>
#include <limits.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "image.h"
#include "image_exr_context.h"
#include "image_jpeg.h"
#include "image_stb.h"
#include "text.h"

/* What every message starts with. */
typedef struct source {
    brume_context *context;
    const char *path, *where;
} source;

static brume_result fail_at(const source *s, brume_result code, const char *what) {
    return brume_fail(s->context, code, "%s%s%s: %s", s->where ? s->where : "", s->where ? ": " : "", s->path, what);
}

/* ---- bytes and words of RGB ------------------------------------------------------------------------------------ */

static float decode_srgb(double v) {
    return (float)(v <= 0.04045 ? v / 12.92 : pow((v + 0.055) / 1.055, 2.4));
}

static brume_result fail_unreadable(const source *s, const char *why) {
    return brume_fail(s->context, BRUME_ERROR_SCENE, "%s%s%s: not a readable picture: %s", s->where ? s->where : "",
                      s->where ? ": " : "", s->path, why);
}

/* Takes over `decoded`, of `bits` each (BRUME_STB_...). */
static brume_result finish(const source *s, void *decoded, int width, int height, int bits, int raw, brume_image *out) {
    size_t count = 3 * (size_t)width * (size_t)height;
    float *texels = bits == BRUME_STB_FLOAT ? decoded : malloc(count * sizeof *texels);
    if (!texels) {
        free(decoded);
        return fail_at(s, BRUME_ERROR_MEMORY, "out of memory");
    }
    if (bits != BRUME_STB_FLOAT) {
        float curve[256];
        for (int i = 0; i < 256; i++)
            curve[i] = raw ? (float)(i / 255.0) : decode_srgb(i / 255.0);
        for (size_t i = 0; i < count; i++) {
            unsigned value = bits == BRUME_STB_8 ? ((unsigned char *)decoded)[i] : ((unsigned short *)decoded)[i];
            if (bits == BRUME_STB_8)
                texels[i] = curve[value];
            else
                texels[i] = raw ? (float)(value / 65535.0) : decode_srgb(value / 65535.0);
        }
        free(decoded);
    }
    out->width = (uint32_t)width;
    out->height = (uint32_t)height;
    out->texels = texels;
    return BRUME_OK;
}

static brume_result read_stb(const source *s, const char *bytes, size_t size, int raw, brume_image *out) {
    int width, height, bits;
    const char *why;
    errno = 0; /* which allocations that fail set, whatever the library makes of them */
    void *decoded = brume_stb_decode(bytes, size, &width, &height, &bits, &why);
    if (!decoded && errno == ENOMEM)
        return fail_at(s, BRUME_ERROR_MEMORY, "out of memory");
    if (!decoded)
        return fail_unreadable(s, why);
    if (width < 1 || height < 1) {
        free(decoded);
        return fail_at(s, BRUME_ERROR_SCENE, "the picture has no pixels");
    }
    return finish(s, decoded, width, height, bits, raw, out);
}

static brume_result read_jpeg(const source *s, const char *bytes, size_t size, int raw, brume_image *out) {
    int width, height;
    unsigned char *decoded;
    char why[BRUME_JPEG_WHY];
    brume_result result = brume_jpeg_decode(bytes, size, &width, &height, &decoded, why);
    if (result == BRUME_ERROR_MEMORY)
        return fail_at(s, result, "out of memory");
    return result == BRUME_OK ? finish(s, decoded, width, height, BRUME_STB_8, raw, out) : fail_unreadable(s, why);
}

/* ---- EXR ------------------------------------------------------------------------------------------------------- */

typedef struct exr_file {
    exr_context_t exr;
    exr_attr_box2i_t window;
    int32_t width, height;
    int grey;      /* a Y channel instead of R, G and B */
    float *texels;
    float *unwanted; /* a line for what other channels hold: OpenEXRCore 3.1.5 crashes on some mixes with gaps */
} exr_file;

/* 0, 1, 2 for the channels that go to R, G and B, else -1. */
static int component(const exr_file *file, const char *name) {
    static const char *const rgb[3] = {"R", "G", "B"};
    for (int i = 0; i < 3; i++)
        if (strcmp(name, file->grey ? "Y" : rgb[i]) == 0)
            return file->grey ? 0 : i;
    return -1;
}

static brume_result check_channels(const source *s, exr_file *file) {
    const exr_attr_chlist_t *list;
    if (exr_get_channels(file->exr, 0, &list) != EXR_ERR_SUCCESS)
        return fail_at(s, BRUME_ERROR_SCENE, "the EXR has no channels");
    for (int pass = 0; pass < 2; pass++) {
        int found = 0;
        file->grey = pass;
        for (int i = 0; i < list->num_channels; i++) {
            if (component(file, list->entries[i].name.str) < 0)
                continue;
            found++;
            if (list->entries[i].x_sampling != 1 || list->entries[i].y_sampling != 1)
                return fail_at(s, BRUME_ERROR_SCENE, "subsampled channels are not supported");
        }
        if (found == (pass ? 1 : 3))
            return BRUME_OK;
    }
    return fail_at(s, BRUME_ERROR_SCENE, "expected the channels R, G and B, or Y");
}

/* Points the decoder's channels at the texels of a chunk whose first pixel is (x, y) of the data window. */
static void aim(const exr_file *file, exr_decode_pipeline_t *decoder, int32_t x, int32_t y) {
    for (int i = 0; i < decoder->channel_count; i++) {
        exr_coding_channel_info_t *c = &decoder->channels[i];
        int at = component(file, c->channel_name);
        float *wanted = file->texels + 3 * ((size_t)y * (size_t)file->width + (size_t)x) + at;
        c->decode_to_ptr = (uint8_t *)(at < 0 ? file->unwanted : wanted);
        c->user_pixel_stride = at < 0 ? sizeof(float) : 3 * sizeof(float);
        c->user_line_stride = at < 0 ? 0 : (int32_t)(3 * sizeof(float)) * file->width;
        c->user_bytes_per_element = sizeof(float);
        c->user_data_type = EXR_PIXEL_FLOAT;
    }
}

static exr_result_t decode_chunk(const exr_file *file, exr_decode_pipeline_t *decoder, int *started,
                                 const exr_chunk_info_t *chunk, int32_t x, int32_t y) {
    exr_result_t code = *started ? exr_decoding_update(file->exr, 0, chunk, decoder)
                                 : exr_decoding_initialize(file->exr, 0, chunk, decoder);
    if (code != EXR_ERR_SUCCESS)
        return code;
    if (chunk->width > file->width - x || chunk->height > file->height - y)
        return EXR_ERR_BAD_CHUNK_LEADER;
    aim(file, decoder, x, y);
    if (!*started)
        code = exr_decoding_choose_default_routines(file->exr, 0, decoder);
    *started = 1;
    return code == EXR_ERR_SUCCESS ? exr_decoding_run(file->exr, 0, decoder) : code;
}

static exr_result_t read_scanlines(const exr_file *file, exr_decode_pipeline_t *decoder) {
    int32_t lines = 1;
    int started = 0;
    exr_result_t code = exr_get_scanlines_per_chunk(file->exr, 0, &lines);
    for (int32_t y = 0; y < file->height && code == EXR_ERR_SUCCESS; y += lines) {
        exr_chunk_info_t chunk;
        code = exr_read_scanline_chunk_info(file->exr, 0, file->window.min.y + y, &chunk);
        if (code == EXR_ERR_SUCCESS)
            code = decode_chunk(file, decoder, &started, &chunk, 0, y);
    }
    return code;
}

/* The full-resolution level. */
static exr_result_t read_tiles(const exr_file *file, exr_decode_pipeline_t *decoder) {
    int32_t tile_width = 0, tile_height = 0;
    int started = 0;
    exr_result_t code = exr_get_tile_sizes(file->exr, 0, 0, 0, &tile_width, &tile_height);
    if (code == EXR_ERR_SUCCESS && (tile_width < 1 || tile_height < 1))
        code = EXR_ERR_INVALID_ATTR;
    for (int32_t y = 0; code == EXR_ERR_SUCCESS && y < file->height; y += tile_height)
        for (int32_t x = 0; code == EXR_ERR_SUCCESS && x < file->width; x += tile_width) {
            exr_chunk_info_t chunk;
            code = exr_read_tile_chunk_info(file->exr, 0, x / tile_width, y / tile_height, 0, 0, &chunk);
            if (code == EXR_ERR_SUCCESS)
                code = decode_chunk(file, decoder, &started, &chunk, x, y);
        }
    return code;
}

/* What a file of so many bytes may hold at most: deflate packs 1032 bytes into one, PIZ's runs fewer, and a pixel has
 * two; only DWA keeps next to nothing of a block that is all one, some 250 bytes for 256 lines. */
static int may_hold(exr_compression_t compression, size_t size, int64_t pixels) {
    int is_dwa = compression == EXR_COMPRESSION_DWAA || compression == EXR_COMPRESSION_DWAB;
    return pixels / (is_dwa ? 20000 : 1100) <= (int64_t)size;
}

static brume_result read_exr(const source *s, size_t size, brume_image *out) {
    brume_exr_errors errors = {""};
    exr_file file;
    exr_context_initializer_t start = EXR_DEFAULT_CONTEXT_INITIALIZER;
    exr_decode_pipeline_t decoder = EXR_DECODE_PIPELINE_INITIALIZER;
    exr_storage_t storage = EXR_STORAGE_SCANLINE;
    exr_compression_t compression = EXR_COMPRESSION_NONE;
    brume_result result = BRUME_OK;
    memset(&file, 0, sizeof file);
    start.error_handler_fn = brume_exr_on_error;
    brume_exr_listener = &errors;
    errno = 0;
    exr_result_t code = exr_start_read(&file.exr, s->path, &start);
    if (code == EXR_ERR_SUCCESS)
        code = exr_get_storage(file.exr, 0, &storage);
    if (code == EXR_ERR_SUCCESS)
        code = exr_get_compression(file.exr, 0, &compression);
    if (code == EXR_ERR_SUCCESS)
        code = exr_get_data_window(file.exr, 0, &file.window);
    if (code != EXR_ERR_SUCCESS)
        goto cleanup;
    if (storage != EXR_STORAGE_SCANLINE && storage != EXR_STORAGE_TILED) {
        result = fail_at(s, BRUME_ERROR_SCENE, "deep EXR files are not supported");
        goto cleanup;
    }
    int64_t width = (int64_t)file.window.max.x - file.window.min.x + 1;
    int64_t height = (int64_t)file.window.max.y - file.window.min.y + 1;
    if (width < 1 || height < 1 || width > INT_MAX / 12 || height > INT_MAX / 12 || width * height > INT_MAX / 3) {
        result = fail_at(s, BRUME_ERROR_SCENE, "the EXR is empty or too large");
        goto cleanup;
    }
    if (!may_hold(compression, size, width * height)) {
        result = fail_at(s, BRUME_ERROR_SCENE, "the file is too short for as many pixels as it says");
        goto cleanup;
    }
    file.width = (int32_t)width;
    file.height = (int32_t)height;
    result = check_channels(s, &file);
    if (result != BRUME_OK)
        goto cleanup;
    file.texels = calloc((size_t)(width * height), 3 * sizeof *file.texels);
    file.unwanted = calloc((size_t)width, sizeof *file.unwanted);
    if (!file.texels || !file.unwanted) {
        result = fail_at(s, BRUME_ERROR_MEMORY, "out of memory");
        goto cleanup;
    }
    code = storage == EXR_STORAGE_TILED ? read_tiles(&file, &decoder) : read_scanlines(&file, &decoder);
    for (size_t i = 0; code == EXR_ERR_SUCCESS && file.grey && i < (size_t)(width * height); i++)
        file.texels[3 * i + 1] = file.texels[3 * i + 2] = file.texels[3 * i];
cleanup:;
    int error = errno;
    if (file.exr) {
        exr_decoding_destroy(file.exr, &decoder);
        exr_finish(&file.exr);
    }
    brume_exr_listener = NULL;
    if (result == BRUME_OK && code != EXR_ERR_SUCCESS)
        result = fail_at(s, brume_read_error(error),
                         errors.first[0] ? errors.first : exr_get_default_error_message(code));
    free(file.unwanted);
    if (result != BRUME_OK) {
        free(file.texels);
        return result;
    }
    out->width = (uint32_t)file.width;
    out->height = (uint32_t)file.height;
    out->texels = file.texels;
    return BRUME_OK;
}

brume_result brume_image_read(brume_context *context, const char *path, int raw, const char *where, brume_image *out) {
    static const char exr_magic[4] = {0x76, 0x2f, 0x31, 0x01};
    if (!path || !out)
        return brume_fail(context, BRUME_ERROR_ARGUMENT, "brume_image_read: NULL argument");
    const source s = {context, path, where};
    size_t size;
    char *bytes = brume_text_read_file(path, &size);
    if (!bytes)
        return fail_at(&s, brume_read_error(errno), strerror(errno));
    brume_result result;
    if (size == 0)
        result = fail_at(&s, BRUME_ERROR_SCENE, "the file is empty");
    else if (size >= sizeof exr_magic && memcmp(bytes, exr_magic, sizeof exr_magic) == 0)
        result = read_exr(&s, size, out);
    else if (brume_jpeg_is(bytes, size))
        result = read_jpeg(&s, bytes, size, raw, out);
    else
        result = read_stb(&s, bytes, size, raw, out);
    free(bytes);
    return result;
}

brume_result brume_picture_read(brume_context *context, const char *path, uint32_t *out_width, uint32_t *out_height,
                                float **out_rgb) {
    if (!context) return BRUME_ERROR_ARGUMENT;
    if (!path || !out_width || !out_height || !out_rgb)
        return brume_fail(context, BRUME_ERROR_ARGUMENT, "brume_picture_read: NULL argument");
    brume_image image;
    brume_result result = brume_image_read(context, path, 0, NULL, &image);
    if (result != BRUME_OK) return result;
    *out_width = image.width;
    *out_height = image.height;
    *out_rgb = image.texels;
    return BRUME_OK;
}

void brume_picture_free(float *rgb) { free(rgb); }

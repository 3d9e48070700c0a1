/* picture.c -- which channels and attributes a picture file gets. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "../cl/shared.h"
#include "channel.h"
#include "effects.h"
#include "image.h"
#include "picture.h"
#include "platform.h"

enum { PICTURE_COOKIE = 0x62720002, MAX_CHANNELS = 32, MAX_ATTRIBUTES = 24 };

brume_picture_desc brume_picture_desc_default(void) {
    brume_picture_desc desc;
    memset(&desc, 0, sizeof desc);
    desc.cookie = PICTURE_COOKIE;
    desc.layers = BRUME_LAYERS_RECORDED;
    desc.half = 2;
    return desc;
}

/* One brume_channel read from the film and what its components are called in an EXR. */
typedef struct layer {
    brume_channel channel;
    const char *names[3];
    enum { ALWAYS, WITH_ALPHA, LIGHT, WITH_LAYERS, IF_BAD } when; /* LIGHT: in the radiance's format */
} layer;

static const layer layers[] = {
    {BRUME_CHANNEL_RADIANCE, {"R", "G", "B"}, ALWAYS},
    {BRUME_CHANNEL_ALPHA, {"A", NULL, NULL}, WITH_ALPHA},
    {BRUME_CHANNEL_ALBEDO, {"albedo.R", "albedo.G", "albedo.B"}, WITH_LAYERS},
    {BRUME_CHANNEL_NORMAL, {"N.X", "N.Y", "N.Z"}, WITH_LAYERS},
    {BRUME_CHANNEL_DEPTH, {"Z", NULL, NULL}, WITH_LAYERS},
    {BRUME_CHANNEL_ERROR, {"variance.R", "variance.G", "variance.B"}, WITH_LAYERS},
    {BRUME_CHANNEL_SAMPLE_COUNT, {"sampleCount", NULL, NULL}, WITH_LAYERS},
    {BRUME_CHANNEL_DIRECT, {"direct.R", "direct.G", "direct.B"}, LIGHT},
    {BRUME_CHANNEL_INDIRECT, {"indirect.R", "indirect.G", "indirect.B"}, LIGHT},
    {BRUME_CHANNEL_SURFACE, {"surface.R", "surface.G", "surface.B"}, LIGHT},
    {BRUME_CHANNEL_VOLUME, {"volume.R", "volume.G", "volume.B"}, LIGHT},
    {BRUME_CHANNEL_SEGMENTS, {"segments", NULL, NULL}, WITH_LAYERS},
    /* written if there are any, or if asked for */
    {BRUME_CHANNEL_BAD_SAMPLES, {"badSamples", NULL, NULL}, IF_BAD},
};
enum { LAYER_COUNT = sizeof layers / sizeof layers[0] };

/* Whether an EXR gets this one. */
static int is_written(const brume_picture_source *from, const brume_picture_desc *desc, const layer *l) {
    if (l->when == WITH_ALPHA && !from->alpha) return 0;
    if (brume_channel_name(l->channel) && !(desc->layers >> l->channel & 1)) return 0;
    if (l->when == IF_BAD && desc->layers == BRUME_LAYERS_RECORDED && from->stats.bad_samples == 0) return 0;
    return brume_channel_is_recorded(from->recorded, l->channel);
}

static brume_result check_layers(const brume_picture_source *from, const char *path, uint32_t set) {
    for (uint32_t i = 0; i < 32 && set != BRUME_LAYERS_RECORDED; i++) {
        if (!(set >> i & 1)) continue;
        const char *name = brume_channel_name((brume_channel)i);
        if (!name)
            return brume_fail(from->context, BRUME_ERROR_ARGUMENT, "%s: channel %u is no layer", path, i);
        if (!brume_channel_is_recorded(from->recorded, (brume_channel)i))
            return brume_fail(from->context, BRUME_ERROR_ARGUMENT, "%s: this render does not record %s", path, name);
    }
    return BRUME_OK;
}

static brume_exr_attribute text_attribute(const char *name, const char *text) {
    brume_exr_attribute a = {.name = name, .type = BRUME_EXR_STRING, .string = text};
    return a;
}

static brume_exr_attribute int_attribute(const char *name, uint32_t value) {
    brume_exr_attribute a = {.name = name, .type = BRUME_EXR_INT, .integer = (int32_t)value};
    return a;
}

static brume_exr_attribute float_attribute(const char *name, double value) {
    brume_exr_attribute a = {.name = name, .type = BRUME_EXR_FLOAT, .number = (float)value};
    return a;
}

/* `denoised`: NULL for none. */
static brume_result write_exr(const brume_picture_source *from, const char *path, const brume_picture_desc *desc,
                              const float *denoised) {
    const brume_render_stats *s = &from->stats;
    size_t pixels = (size_t)s->width * s->height;
    float *data[LAYER_COUNT] = {0};
    brume_exr_channel channels[MAX_CHANNELS];
    uint32_t count = 0;
    brume_result result = check_layers(from, path, desc->layers);
    uint32_t half = desc->half == 2 ? from->half : desc->half;
    for (int i = 0; i < LAYER_COUNT && result == BRUME_OK; i++) {
        const layer *l = &layers[i];
        if (!is_written(from, desc, l)) continue;
        int size = brume_channel_size(l->channel);
        size_t floats = pixels * (size_t)size;
        data[i] = malloc(floats * sizeof(float));
        if (!data[i])
            result = brume_fail(from->context, BRUME_ERROR_MEMORY, "writing %s: out of memory", path);
        else
            result = from->read(from->of, l->channel, data[i], floats);
        for (int c = 0; c < size && result == BRUME_OK; c++)
            channels[count++] = (brume_exr_channel){l->names[c], data[i] + c, (uint32_t)size,
                                                    l->when < WITH_LAYERS && half};
    }
    static const char *const names[3] = {"denoised.R", "denoised.G", "denoised.B"};
    for (int c = 0; c < 3 && denoised; c++)
        channels[count++] = (brume_exr_channel){names[c], denoised + c, 3, half};
    if (result == BRUME_OK) {
        brume_exr_attribute attributes[MAX_ATTRIBUTES];
        uint32_t n = 0;
        brume_exr_attribute camera = {.name = "worldToCamera", .type = BRUME_EXR_MATRIX};
        brume_exr_attribute ndc = {.name = "worldToNDC", .type = BRUME_EXR_MATRIX};
        memcpy(camera.matrix, from->world_to_camera, sizeof camera.matrix);
        memcpy(ndc.matrix, from->world_to_ndc, sizeof ndc.matrix);
        attributes[n++] = text_attribute("software", "brume " BRUME_VERSION);
        attributes[n++] = text_attribute("device", from->device);
        attributes[n++] = text_attribute("samplerName",
                                         from->sampler == SAMPLER_SOBOL ? "sobol" : "independent");
        attributes[n++] = text_attribute("strategy", brume_strategy_name(s->strategy));
        attributes[n++] = text_attribute("indirect", brume_indirect_name(s->indirect));
        char seed[16], first[16]; /* text: EXR's integers end at 2^31 */
        snprintf(seed, sizeof seed, "%u", (unsigned)s->seed);
        snprintf(first, sizeof first, "%u", (unsigned)s->first_sample);
        attributes[n++] = int_attribute("samplesPerPixel", (uint32_t)(s->samples / pixels));
        attributes[n++] = text_attribute("firstSample", first);
        attributes[n++] = text_attribute("seed", seed);
        char without[512];
        brume_effects_list(s->without, without, sizeof without);
        if (s->without) attributes[n++] = text_attribute("without", without);
        attributes[n++] = int_attribute("incomplete", !s->complete);
        attributes[n++] = float_attribute("renderTimeSeconds", s->render_seconds);
        if (s->relmse >= 0) attributes[n++] = float_attribute("relMSE", s->relmse);
        attributes[n++] = camera;
        attributes[n++] = ndc;
        result = brume_exr_write(from->context, path, s->crop_x, s->crop_y, s->width, s->height,
                                 s->full_width, s->full_height, channels, count, attributes, n);
    }
    for (int i = 0; i < LAYER_COUNT; i++) free(data[i]);
    return result;
}

static brume_result write_png(const brume_picture_source *from, const char *path, const brume_picture_desc *desc,
                              const float *denoised) {
    size_t floats = (size_t)from->stats.width * from->stats.height * 3;
    float *rgb = malloc(floats * sizeof(float));
    if (!rgb) return brume_fail(from->context, BRUME_ERROR_MEMORY, "writing %s: out of memory", path);
    char comment[640] = "", without[512];
    brume_effects_list(from->stats.without, without, sizeof without);
    const char *incomplete = from->stats.complete ? "" : "incomplete render", *clean = denoised ? "denoised" : "";
    snprintf(comment, sizeof comment, "%s%s%s%s%s%s", incomplete, *incomplete && *without ? ", " : "",
             *without ? "without " : "", without, (*incomplete || *without) && denoised ? ", " : "", clean);
    brume_result result = from->read(from->of, BRUME_CHANNEL_RADIANCE, rgb, floats);
    if (result == BRUME_OK)
        result = brume_png_write(from->context, path, from->stats.width, from->stats.height, denoised ? denoised : rgb,
                                 desc->exposure, desc->tonemap, *comment ? comment : NULL);
    free(rgb);
    return result;
}

/* With what of the denoiser can be had. */
static brume_result write_denoised(const brume_picture_source *from, const char *path, const brume_picture_desc *desc,
                                   brume_result (*writer)(const brume_picture_source *, const char *,
                                                          const brume_picture_desc *, const float *)) {
    if (desc->denoise == BRUME_DENOISE_NONE) return writer(from, path, desc, NULL);
    float *rgb = malloc((size_t)from->stats.width * from->stats.height * 3 * sizeof(float));
    if (!rgb) return brume_fail(from->context, BRUME_ERROR_MEMORY, "writing %s: out of memory", path);
    brume_result denoised = from->denoise(from->of, desc->denoise, rgb);
    brume_result written = denoised == BRUME_ERROR_ARGUMENT ? denoised
                                                            : writer(from, path, desc, denoised ? NULL : rgb);
    free(rgb);
    return written != BRUME_OK ? written : denoised;
}

brume_result brume_picture_write(const brume_picture_source *from, const char *caller, const char *path,
                                 const brume_picture_desc *given) {
    if (!path) return brume_fail(from->context, BRUME_ERROR_ARGUMENT, "%s: NULL path", caller);
    brume_picture_desc desc = given ? *given : brume_picture_desc_default();
    if (desc.cookie != PICTURE_COOKIE)
        return brume_fail(from->context, BRUME_ERROR_ARGUMENT,
                          "%s: the descriptor does not come from brume_picture_desc_default()", caller);
    if ((unsigned)desc.tonemap > BRUME_TONEMAP_FILMIC || (unsigned)desc.denoise > BRUME_DENOISE_LAYERS)
        return brume_fail(from->context, BRUME_ERROR_ARGUMENT, "%s: unknown tonemap %d or denoise %d", caller,
                          (int)desc.tonemap, (int)desc.denoise);
    if (desc.denoise != BRUME_DENOISE_NONE && !from->denoise)
        return brume_fail(from->context, BRUME_ERROR_ARGUMENT, "%s: pictures that were added up are not denoised",
                          path);
    const char *dot = strrchr(path, '.');
    if (dot && brume_same_letters(dot, ".exr")) return write_denoised(from, path, &desc, write_exr);
    if (dot && brume_same_letters(dot, ".png")) return write_denoised(from, path, &desc, write_png);
    return brume_fail(from->context, BRUME_ERROR_ARGUMENT, "%s: expected a name ending in .exr or .png", path);
}

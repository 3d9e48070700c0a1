/* identity.c -- see identity.h. */
#include "identity.h"

#include <string.h>

#include "../cl/shared.h"
#include "effects.h"

enum { SAMPLES = 2 };

static brume_result render(const identity *i, uint32_t *features, float out[IDENTITY_FLOATS]) {
    brume_render *r;
    brume_render_stats stats;
    brume_result result = brume_render_create(i->device, i->scene, &i->desc, &r);
    if (result != BRUME_OK) return result;
    result = brume_render_run(r, NULL, NULL);
    if (result == BRUME_OK) result = brume_render_read(r, BRUME_CHANNEL_RADIANCE, out, IDENTITY_FLOATS);
    if (result == BRUME_OK) result = brume_render_get_stats(r, &stats);
    if (result == BRUME_OK) *features = stats.features;
    brume_render_destroy(r);
    return result;
}

brume_result identity_open(brume_context *context, brume_device *device, const char *path, identity *out) {
    brume_film_desc film;
    memset(out, 0, sizeof *out);
    out->device = device;
    brume_result result = brume_scene_load(context, path, NULL, 0, &out->scene);
    if (result != BRUME_OK) return result;
    brume_scene_get_film(out->scene, &film);
    out->desc = brume_render_desc_default();
    out->desc.lanes = 1;
    out->desc.guides = out->desc.error_estimate = 0;
    out->desc.sample_count = SAMPLES;
    out->desc.use_crop = 1;
    out->desc.crop_x = (film.width - IDENTITY_SIZE) / 2;
    out->desc.crop_y = (film.height - IDENTITY_SIZE) / 2;
    out->desc.crop_width = out->desc.crop_height = IDENTITY_SIZE;
    result = render(out, &out->needed, out->own);
    for (int k = 0; k < IDENTITY_FLOATS; k++) out->lit += out->own[k] > 0;
    if (result != BRUME_OK) identity_close(out);
    return result;
}

void identity_close(identity *i) {
    brume_scene_destroy(i->scene);
    i->scene = NULL;
}

uint32_t identity_spare(const identity *i) {
    return FEATURE_ALL & ~(i->needed | FEATURE_GUIDES | FEATURE_LIGHT_LAYERS);
}

int identity_differs(identity *i, const identity_program *program) {
    static float other[IDENTITY_FLOATS];
    uint32_t features = 0;
    int count = 0;
    i->desc.extra_features = program->extra;
    i->desc.generic = i->desc.light_layers = program->generic;
    i->desc.lanes = program->lanes;
    if (render(i, &features, other) != BRUME_OK) return -1;
    if (features != (program->generic ? (uint32_t)FEATURE_ALL : i->needed | program->extra)) return -1;
    for (int k = 0; k < IDENTITY_FLOATS; k++) count += memcmp(&i->own[k], &other[k], sizeof *other) != 0;
    return count;
}

/* effects_remove.c -- a scene without some of its effects: what each of them comes down to is said in brume.h. */
#include "effects.h"

#include <stdlib.h>
#include <string.h>

#include "scene_check.h"

static const uint32_t removable = EFFECT(MEDIA) | EFFECT(ABSORPTION) | EFFECT(EMISSION) | EFFECT(SCATTERING) |
                                  EFFECT(MULTIPLE_SCATTERING) | EFFECT(ANISOTROPY) | EFFECT(CHROMATIC_EXTINCTION) |
                                  EFFECT(POINT_LIGHTS) | EFFECT(SPOT_LIGHTS) | EFFECT(DIRECTIONAL_LIGHTS) |
                                  EFFECT(AREA_LIGHTS) | EFFECT(ENVIRONMENT) | EFFECT(TEXTURES) | EFFECT(LENS);

uint32_t brume_effects_removable(void) {
    return removable;
}

int brume_effect_removable(brume_effect effect) {
    return (unsigned)effect < BRUME_EFFECT_COUNT && (removable >> effect & 1);
}

/* A copy of an array, with room for one more. */
static brume_result copy(const brume_scene *scene, const void *from, size_t count, size_t size, void *out_pointer) {
    void *to = malloc((count + 1) * size);
    if (!to) return brume_fail(scene->context, BRUME_ERROR_MEMORY, "no memory for a copy of the scene");
    if (count) memcpy(to, from, count * size);
    memcpy(out_pointer, &to, sizeof to);
    return BRUME_OK;
}

static void remove_from_medium(brume_medium_desc *m, uint32_t without) {
    for (int c = 0; c < 3; c++) {
        if (without & EFFECT(EMISSION)) m->emission[c] = 0;
        if (without & EFFECT(ABSORPTION)) {
            m->sigma_t[c] *= m->albedo[c];
            m->albedo[c] = 1;
        }
        if (without & EFFECT(SCATTERING)) m->albedo[c] = 0;
    }
    if (without & EFFECT(CHROMATIC_EXTINCTION)) {
        double mean = ((double)m->sigma_t[0] + m->sigma_t[1] + m->sigma_t[2]) / 3;
        m->sigma_t[0] = m->sigma_t[1] = m->sigma_t[2] = (float)mean;
    }
    if (without & EFFECT(ANISOTROPY)) m->g = 0;
}

static void mean_of_texture(const brume_scene_texture *texture, float out[3]) {
    const brume_texture_desc *d = &texture->desc;
    size_t count = (size_t)d->width * d->height;
    for (int c = 0; c < 3; c++) {
        double sum = 0;
        for (size_t i = 0; d->kind == BRUME_TEXTURE_BITMAP && i < count; i++)
            sum += texture->texels[3 * i + (size_t)c];
        out[c] = d->kind == BRUME_TEXTURE_BITMAP ? (float)(sum / (double)count)
                                                 : (float)(0.5 * ((double)d->color0[c] + d->color1[c]));
    }
}

static void remove_textures(brume_scene *s) {
    float mean[3];
    for (uint32_t i = 0; i < s->bsdf_count; i++) {
        brume_bsdf_desc *b = &s->bsdfs[i];
        if (b->reflectance_texture == BRUME_NONE) continue;
        mean_of_texture(&s->textures[b->reflectance_texture], b->reflectance);
        b->reflectance_texture = BRUME_NONE;
    }
    for (uint32_t i = 0; i < s->light_count; i++) {
        brume_light_desc *l = &s->lights[i].desc;
        if (l->texture == BRUME_NONE) continue;
        mean_of_texture(&s->textures[l->texture], mean);
        for (int c = 0; c < 3; c++)
            l->intensity[c] *= mean[c];
        l->texture = BRUME_NONE;
    }
    s->texture_count = 0; /* nor do their texels go to the device */
}

/* There is room for the one bsdf that this may add. */
static void remove_area_lights(brume_scene *s) {
    uint32_t black = BRUME_NONE;
    for (uint32_t i = 0; i < s->shape_count; i++) {
        brume_shape_desc *d = &s->shapes[i].desc;
        if (!(d->radiance[0] > 0 || d->radiance[1] > 0 || d->radiance[2] > 0)) continue;
        memset(d->radiance, 0, sizeof d->radiance);
        if (d->bsdf != BRUME_NONE) continue;
        if (black == BRUME_NONE) {
            black = s->bsdf_count++;
            s->bsdfs[black] = brume_bsdf_desc_default(BRUME_BSDF_DIFFUSE);
            memset(s->bsdfs[black].reflectance, 0, sizeof s->bsdfs[black].reflectance);
        }
        d->bsdf = black;
    }
}

static void remove_lights(brume_scene *s, uint32_t without) {
    static const uint32_t kinds[] = {
        [BRUME_LIGHT_POINT] = EFFECT(POINT_LIGHTS),
        [BRUME_LIGHT_SPOT] = EFFECT(SPOT_LIGHTS),
        [BRUME_LIGHT_DIRECTIONAL] = EFFECT(DIRECTIONAL_LIGHTS),
        [BRUME_LIGHT_CONSTANT] = EFFECT(ENVIRONMENT),
        [BRUME_LIGHT_ENVMAP] = EFFECT(ENVIRONMENT),
    };
    uint32_t kept = 0;
    for (uint32_t i = 0; i < s->light_count; i++) {
        int goes = (kinds[s->lights[i].desc.kind] & without) != 0;
        for (uint32_t k = 0; k < s->origin_count; k++)
            if (s->origins[k].kind == BRUME_OBJECT_LIGHT && s->origins[k].index == i)
                s->origins[k].index = goes ? BRUME_NONE : kept;
        if (!goes) s->lights[kept++] = s->lights[i];
    }
    s->light_count = kept;
}

brume_result brume_scene_view_make(const brume_scene *scene, uint32_t without, brume_scene_view *out) {
    for (int i = 0; i < 32; i++)
        if ((without & ~removable) >> i & 1)
            return brume_fail(scene->context, BRUME_ERROR_ARGUMENT, "effect %d (%s) can't be taken away", i,
                              i < BRUME_EFFECT_COUNT ? brume_effect_name((brume_effect)i) : "unknown");
    brume_scene_view view = {*scene};
    brume_scene *s = &view.scene;
    s->bsdfs = NULL, s->media = NULL, s->lights = NULL, s->shapes = NULL, s->origins = NULL;
    brume_result result = copy(scene, scene->bsdfs, scene->bsdf_count, sizeof *s->bsdfs, &s->bsdfs);
    if (result == BRUME_OK) result = copy(scene, scene->media, scene->medium_count, sizeof *s->media, &s->media);
    if (result == BRUME_OK) result = copy(scene, scene->lights, scene->light_count, sizeof *s->lights, &s->lights);
    if (result == BRUME_OK) result = copy(scene, scene->shapes, scene->shape_count, sizeof *s->shapes, &s->shapes);
    if (result == BRUME_OK) result = copy(scene, scene->origins, scene->origin_count, sizeof *s->origins, &s->origins);
    if (result != BRUME_OK) {
        brume_scene_view_free(&view);
        return result;
    }
    for (uint32_t i = 0; i < s->medium_count; i++)
        remove_from_medium(&s->media[i], without);
    if (without & EFFECT(MEDIA)) s->integrator.ignore_media = 1;
    if (without & EFFECT(MULTIPLE_SCATTERING)) s->integrator.single_scattering = 1;
    if (without & EFFECT(LENS)) s->sensor.aperture_radius = 0;
    if (without & EFFECT(TEXTURES)) remove_textures(s);
    if (without & EFFECT(AREA_LIGHTS)) remove_area_lights(s);
    remove_lights(s, without);
    *out = view;
    return BRUME_OK;
}

void brume_scene_view_free(brume_scene_view *view) {
    free(view->scene.bsdfs);
    free(view->scene.media);
    free(view->scene.lights);
    free(view->scene.shapes);
    free(view->scene.origins);
    memset(view, 0, sizeof *view);
}

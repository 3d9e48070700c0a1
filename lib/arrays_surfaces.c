/* arrays_surfaces.c -- bsdfs, textures and media as the kernels see them. */
#include "arrays_build.h"

#include <stdlib.h>
#include <string.h>

static void copy3(float to[3], const float from[3]) {
    memcpy(to, from, 3 * sizeof *to);
}

static b_bsdf make_bsdf(const brume_bsdf_desc *desc, int id) {
    static const int kinds[] = {BSDF_DIFFUSE, BSDF_DIELECTRIC, BSDF_CONDUCTOR, BSDF_ROUGH_CONDUCTOR, BSDF_NULL,
                                BSDF_THIN_DIELECTRIC};
    b_bsdf out = {.kind = kinds[desc->kind], .alpha_u = desc->alpha_u, .alpha_v = desc->alpha_v};
    out.back = desc->back == BRUME_NONE ? id : (int)desc->back;
    out.texture = desc->reflectance_texture == BRUME_NONE ? -1 : (int)desc->reflectance_texture;
    out.ior = (float)((double)desc->int_ior / desc->ext_ior);
    copy3(out.reflectance, desc->reflectance);
    copy3(out.transmittance, desc->transmittance);
    copy3(out.eta, desc->eta);
    copy3(out.k, desc->k);
    if (desc->two_sided)
        out.flags |= BSDF_TWO_SIDED;
    if (desc->distribution == BRUME_DISTRIBUTION_BECKMANN)
        out.flags |= BSDF_BECKMANN;
    if (!desc->sample_visible)
        out.flags |= BSDF_SAMPLE_ALL;
    return out;
}

/* The bsdf of shapes that name none: appended after the scene's own when one needs it. */
static int default_bsdf(float reflectance, int *id, brume_arrays *arrays) {
    if (*id < 0) {
        brume_bsdf_desc desc = brume_bsdf_desc_default(BRUME_BSDF_DIFFUSE);
        desc.reflectance[0] = desc.reflectance[1] = desc.reflectance[2] = reflectance;
        *id = (int)arrays->bsdf_count++;
        arrays->bsdfs[*id] = make_bsdf(&desc, *id);
    }
    return *id;
}

static brume_result add_textures(const brume_scene *scene, brume_arrays *arrays) {
    BRUME_TRY(brume_arrays_alloc(scene, "textures", scene->texture_count, sizeof(b_texture), &arrays->textures));
    arrays->texture_count = scene->texture_count;
    for (uint32_t i = 0; i < scene->texture_count; i++) {
        static const int wraps[] = {TEXTURE_WRAP_REPEAT, TEXTURE_WRAP_CLAMP, TEXTURE_WRAP_MIRROR};
        const brume_texture_desc *desc = &scene->textures[i].desc;
        b_texture *out = &arrays->textures[i];
        out->kind = desc->kind == BRUME_TEXTURE_BITMAP ? TEXTURE_BITMAP : TEXTURE_CHECKERBOARD;
        out->filter = desc->filter == BRUME_FILTER_NEAREST ? TEXTURE_NEAREST : 0;
        out->wrap = wraps[desc->wrap];
        memcpy(out->to_uv, desc->to_uv, sizeof out->to_uv);
        copy3(out->color0, desc->color0);
        copy3(out->color1, desc->color1);
        if (desc->kind == BRUME_TEXTURE_BITMAP) {
            uint32_t first;
            size_t texels = (size_t)desc->width * desc->height;
            BRUME_TRY(brume_arrays_more_texels(scene, arrays, texels, &first));
            out->width = (int)desc->width;
            out->height = (int)desc->height;
            out->first = (int)first;
            memcpy(arrays->texels + 3 * (size_t)first, scene->textures[i].texels, 3 * texels * sizeof(float));
        }
    }
    return BRUME_OK;
}

brume_result brume_arrays_surfaces(const brume_scene *scene, brume_arrays *arrays) {
    BRUME_TRY(add_textures(scene, arrays));
    BRUME_TRY(brume_arrays_alloc(scene, "bsdfs", (size_t)scene->bsdf_count + 2, sizeof(b_bsdf), &arrays->bsdfs));
    arrays->bsdf_count = scene->bsdf_count;
    for (uint32_t i = 0; i < scene->bsdf_count; i++)
        arrays->bsdfs[i] = make_bsdf(&scene->bsdfs[i], (int)i);
    int grey = -1, black = -1;
    for (uint32_t i = 0; i < arrays->shape_count; i++) {
        b_shape *shape = &arrays->shapes[i];
        if (shape->bsdf < 0)
            shape->bsdf = shape->emits ? default_bsdf(0, &black, arrays) : default_bsdf(0.5f, &grey, arrays);
    }
    return BRUME_OK;
}

brume_result brume_arrays_media(const brume_scene *scene, brume_arrays *arrays) {
    BRUME_TRY(brume_arrays_alloc(scene, "media", scene->medium_count, sizeof(b_medium), &arrays->media));
    arrays->medium_count = scene->medium_count;
    arrays->params.medium_count = (int)scene->medium_count;
    for (uint32_t i = 0; i < scene->medium_count; i++) {
        const brume_medium_desc *desc = &scene->media[i];
        b_medium *out = &arrays->media[i];
        copy3(out->sigma_t, desc->sigma_t);
        copy3(out->albedo, desc->albedo);
        brume_arrays_store_light(arrays, desc->emission, out->emission);
        out->g = desc->g;
    }
    return BRUME_OK;
}

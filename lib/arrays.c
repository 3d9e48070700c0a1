/* arrays.c -- the order in which the scene description becomes arrays, and the pins of their layout. */
#include "arrays_build.h"

#include <stdlib.h>
#include <string.h>

#include "effects.h"
#include "platform.h"

/* cl/shared.h promises these sizes to every device compiler. */
#define PIN(type, size) typedef char pin_##type[sizeof(type) == (size) ? 1 : -1]
PIN(b_node, 256);
PIN(b_triangle_block, 320);
PIN(b_triangle, 16);
PIN(b_quadric, 64);
PIN(b_shape, 48);
PIN(b_bsdf, 80);
PIN(b_texture, 80);
PIN(b_medium, 48);
PIN(b_light, 112);
PIN(b_light_block, 640);
PIN(b_emitter, 16);
PIN(b_params, 336);

/* See path_roulette: error times time in a grey room, over that with 1, is 0.8 with 4, 8 and 16. */
#define SURVIVAL_WITHOUT_MEDIA 4

static void integrator(const brume_scene *scene, b_params *p) {
    const brume_integrator_desc *desc = &scene->integrator;
    p->sampler = desc->sampler == BRUME_SAMPLER_SOBOL ? SAMPLER_SOBOL : SAMPLER_INDEPENDENT;
    p->max_depth = desc->max_depth < 0 ? 1 << 30 : desc->max_depth;
    p->rr_depth = desc->rr_depth;
    p->hide_emitters = desc->hide_emitters != 0;
    p->ignore_media = desc->ignore_media != 0;
    p->seed = desc->seed;
    p->single_scattering = desc->single_scattering != 0;
}

static brume_result build(const brume_scene *scene, const uint32_t crop[4], brume_arrays *arrays) {
    b_params *p = &arrays->params;
    uint32_t effects = brume_effects_find(scene, NULL);
    arrays->features = brume_effects_features(effects);
    brume_arrays_choose_origin(scene, arrays);
    brume_arrays_choose_light_unit(scene, arrays);
    BRUME_TRY(brume_arrays_camera(scene, crop, arrays));
    BRUME_TRY(brume_arrays_filter(scene, arrays));
    integrator(scene, p);
    BRUME_TRY(brume_arrays_geometry(scene, arrays));
    BRUME_TRY(brume_arrays_surfaces(scene, arrays));
    BRUME_TRY(brume_arrays_media(scene, arrays));
    BRUME_TRY(brume_arrays_lights(scene, arrays));
    BRUME_TRY(brume_arrays_environment(scene, arrays));
    /* Only building it tells whether a tree is worth having. */
    if (!p->light_tree_blocks)
        arrays->features &= ~(uint32_t)FEATURE_MANY_LIGHTS;
    p->surfaces_emit = (effects & (EFFECT(AREA_LIGHTS) | EFFECT(ENVIRONMENT) | EFFECT(EMISSION))) != 0;
    p->has_null = (arrays->features & FEATURE_NULL) != 0;
    p->has_specular = (arrays->features & FEATURE_SPECULAR) != 0;
    p->survival = arrays->features & FEATURE_MEDIA ? 1 : SURVIVAL_WITHOUT_MEDIA;
    p->rays_share = p->has_null;
    for (uint32_t i = 0; i < arrays->light_count; i++)
        p->rays_share |= arrays->lights[i].kind == LIGHT_DIRECTIONAL;
    double start = brume_seconds();
    BRUME_TRY(brume_bvh_build(scene->context, arrays->positions, arrays->triangles, (uint32_t)p->triangle_count,
                              arrays->quadrics, (uint32_t)p->quadric_count, &arrays->bvh));
    arrays->bvh_seconds = brume_seconds() - start;
    if (p->has_null)
        brume_arrays_lamp_media(arrays);
    return BRUME_OK;
}

brume_result brume_arrays_build(const brume_scene *scene, const uint32_t crop[4], brume_arrays *out) {
    brume_arrays arrays;
    memset(&arrays, 0, sizeof arrays);
    if (!scene || !out)
        return brume_fail(scene ? scene->context : NULL, BRUME_ERROR_ARGUMENT, "brume_arrays_build: NULL argument");
    if (!scene->has_sensor)
        return brume_fail(scene->context, BRUME_ERROR_SCENE, "the scene has no sensor");
    brume_result result = build(scene, crop, &arrays);
    if (result != BRUME_OK) {
        brume_arrays_free(&arrays);
        return result;
    }
    if (arrays.dropped_triangles)
        brume_info(scene->context, "%u triangles without area were dropped", (unsigned)arrays.dropped_triangles);
    *out = arrays;
    return BRUME_OK;
}

void brume_arrays_free(brume_arrays *arrays) {
    if (!arrays)
        return;
    brume_bvh_free(&arrays->bvh);
    free(arrays->triangles);
    free(arrays->quadrics);
    free(arrays->positions);
    free(arrays->normals);
    free(arrays->uvs);
    free(arrays->shapes);
    free(arrays->bsdfs);
    free(arrays->textures);
    free(arrays->texels);
    free(arrays->media);
    free(arrays->lights);
    free(arrays->emitters);
    free(arrays->cdf);
    free(arrays->filter);
    brume_light_tree_free(&arrays->light_tree);
    memset(arrays, 0, sizeof *arrays);
}

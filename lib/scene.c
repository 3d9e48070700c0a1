/* scene.c -- the scene description: textures, bsdfs, media, lights, sensor, film and integrator, each checked as
 * brume.h documents it and copied. Shapes are in scene_shapes.c, default values in scene_desc.c.
 *
 * A refused call leaves the scene as it was.
 */
#include "scene_check.h"
#include "strategy.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

brume_result brume_scene_create(brume_context *context, brume_scene **out) {
    if (!context || !out)
        return brume_fail(context, BRUME_ERROR_ARGUMENT, "scene: the %s is NULL",
                          context ? "out-parameter" : "context");
    brume_scene *scene = calloc(1, sizeof *scene);
    if (!scene)
        return brume_fail(context, BRUME_ERROR_MEMORY, "no memory for a scene");
    scene->context = brume_context_retain(context);
    scene->film = brume_film_desc_default();
    scene->integrator = brume_integrator_desc_default();
    *out = scene;
    return BRUME_OK;
}

void brume_scene_destroy(brume_scene *scene) {
    if (!scene)
        return;
    for (uint32_t i = 0; i < scene->texture_count; i++)
        free(scene->textures[i].texels);
    for (uint32_t i = 0; i < scene->light_count; i++)
        free(scene->lights[i].texels);
    for (uint32_t i = 0; i < scene->shape_count; i++) {
        free(scene->shapes[i].positions);
        free(scene->shapes[i].normals);
        free(scene->shapes[i].uvs);
        free(scene->shapes[i].triangles);
    }
    free(scene->textures);
    free(scene->bsdfs);
    free(scene->media);
    free(scene->lights);
    free(scene->shapes);
    for (uint32_t i = 0; i < scene->origin_count; i++) {
        free(scene->origins[i].id);
        free(scene->origins[i].file);
    }
    free(scene->origins);
    brume_context_release(scene->context);
    free(scene);
}

/* ---- textures ---------------------------------------------------------------------------------------------------- */

/* Texels are indexed by an int, three floats each. */
#define MOST_TEXELS (INT32_MAX / 3)

static brume_result check_texels(const brume_scene *scene, const char *noun, uint32_t width, uint32_t height,
                                 const float *texels) {
    if (width == 0 || height == 0)
        REFUSE("%s: %u x %u texels are none", noun, (unsigned)width, (unsigned)height);
    if (!texels)
        REFUSE("%s: texels is NULL", noun);
    if ((uint64_t)width * height > MOST_TEXELS)
        REFUSE("%s: %u x %u texels are too many", noun, (unsigned)width, (unsigned)height);
    for (size_t i = 0; i < (size_t)width * height; i++)
        if (!brume_all_within(texels + 3 * i, 3, 0, INFINITY))
            REFUSE("%s: texel (%zu, %zu) is negative, infinite or NaN", noun, i % width, i / width);
    return BRUME_OK;
}

brume_result brume_scene_add_texture(brume_scene *scene, const brume_texture_desc *desc, uint32_t *out_id) {
    brume_scene_texture texture;
    BRUME_TRY(brume_check_desc(scene, "texture", desc, COOKIE_TEXTURE));
    if ((unsigned)desc->kind > BRUME_TEXTURE_CHECKERBOARD)
        REFUSE("texture: kind %d is none", (int)desc->kind);
    if ((unsigned)desc->filter > BRUME_FILTER_NEAREST)
        REFUSE("texture: filter %d is none", (int)desc->filter);
    if ((unsigned)desc->wrap > BRUME_WRAP_MIRROR)
        REFUSE("texture: wrap %d is none", (int)desc->wrap);
    if (!brume_all_finite(desc->to_uv, 6))
        REFUSE("texture: to_uv holds a NaN or an infinity");
    if (desc->kind == BRUME_TEXTURE_BITMAP)
        BRUME_TRY(check_texels(scene, "texture", desc->width, desc->height, desc->texels));
    else if (!brume_all_within(desc->color0, 3, 0, INFINITY) || !brume_all_within(desc->color1, 3, 0, INFINITY))
        REFUSE("texture: the colours must be finite and not negative");

    texture.desc = *desc;
    texture.desc.texels = NULL;
    texture.texels = NULL;
    BRUME_TRY(brume_scene_grow(scene, &scene->textures, scene->texture_count, sizeof texture));
    if (desc->kind == BRUME_TEXTURE_BITMAP)
        BRUME_TRY(brume_scene_copy(scene, desc->texels, (size_t)desc->width * desc->height, 3 * sizeof(float),
                                   &texture.texels));
    scene->textures[scene->texture_count] = texture;
    if (out_id)
        *out_id = scene->texture_count;
    scene->texture_count++;
    return BRUME_OK;
}

/* ---- bsdfs ------------------------------------------------------------------------------------------------------- */

static int transmits(brume_bsdf_kind kind) {
    return kind == BRUME_BSDF_DIELECTRIC || kind == BRUME_BSDF_THIN_DIELECTRIC || kind == BRUME_BSDF_NULL;
}

static int texture_exceeds_one(const brume_scene_texture *texture) {
    const brume_texture_desc *desc = &texture->desc;
    if (desc->kind == BRUME_TEXTURE_CHECKERBOARD)
        return !brume_all_within(desc->color0, 3, 0, 1) || !brume_all_within(desc->color1, 3, 0, 1);
    return !brume_all_within(texture->texels, 3 * (size_t)desc->width * desc->height, 0, 1);
}

brume_result brume_scene_add_bsdf(brume_scene *scene, const brume_bsdf_desc *desc, uint32_t *out_id) {
    BRUME_TRY(brume_check_desc(scene, "bsdf", desc, COOKIE_BSDF));
    if ((unsigned)desc->kind > BRUME_BSDF_THIN_DIELECTRIC)
        REFUSE("bsdf: kind %d is none", (int)desc->kind);
    if (!brume_all_within(desc->reflectance, 3, 0, 1))
        REFUSE("bsdf: reflectance must be in [0, 1], not (%g, %g, %g)", desc->reflectance[0], desc->reflectance[1],
               desc->reflectance[2]);
    BRUME_TRY(brume_check_id(scene, "bsdf: reflectance_texture", desc->reflectance_texture, scene->texture_count));
    if (!brume_all_within(desc->transmittance, 3, 0, 1))
        REFUSE("bsdf: transmittance must be in [0, 1], not (%g, %g, %g)", desc->transmittance[0],
               desc->transmittance[1], desc->transmittance[2]);
    if (!brume_all_within(&desc->int_ior, 1, 0, INFINITY) || !brume_all_within(&desc->ext_ior, 1, 0, INFINITY) ||
        desc->int_ior == 0 || desc->ext_ior == 0)
        REFUSE("bsdf: the indices of refraction must be positive, not %g inside and %g outside", desc->int_ior,
               desc->ext_ior);
    if (!brume_all_within(desc->eta, 3, 0, INFINITY) || !brume_all_within(desc->k, 3, 0, INFINITY))
        REFUSE("bsdf: eta and k must be finite and not negative");
    if ((unsigned)desc->distribution > BRUME_DISTRIBUTION_GGX)
        REFUSE("bsdf: distribution %d is none", (int)desc->distribution);
    if (desc->kind == BRUME_BSDF_ROUGH_CONDUCTOR &&
        (!brume_all_within(&desc->alpha_u, 1, 0, INFINITY) || !brume_all_within(&desc->alpha_v, 1, 0, INFINITY) ||
         desc->alpha_u == 0 || desc->alpha_v == 0))
        REFUSE("bsdf: the roughness must be positive, not %g and %g", desc->alpha_u, desc->alpha_v);
    if (desc->two_sided && transmits(desc->kind))
        REFUSE("bsdf: only reflecting bsdfs can be two-sided");
    if (desc->back != BRUME_NONE && !desc->two_sided)
        REFUSE("bsdf: back is set, but not two_sided");
    BRUME_TRY(brume_check_id(scene, "bsdf: back", desc->back, scene->bsdf_count));
    if (desc->back != BRUME_NONE && transmits(scene->bsdfs[desc->back].kind))
        REFUSE("bsdf: only reflecting bsdfs can be two-sided, bsdf %u is not", (unsigned)desc->back);
    if (desc->reflectance_texture != BRUME_NONE && texture_exceeds_one(&scene->textures[desc->reflectance_texture]))
        brume_warn(scene->context, "bsdf: texture %u exceeds 1 in places, where it will reflect more than it receives",
                   (unsigned)desc->reflectance_texture);

    BRUME_TRY(brume_scene_grow(scene, &scene->bsdfs, scene->bsdf_count, sizeof *desc));
    scene->bsdfs[scene->bsdf_count] = *desc;
    if (out_id)
        *out_id = scene->bsdf_count;
    scene->bsdf_count++;
    return BRUME_OK;
}

/* ---- media ------------------------------------------------------------------------------------------------------- */

brume_result brume_scene_add_medium(brume_scene *scene, const brume_medium_desc *desc, uint32_t *out_id) {
    BRUME_TRY(brume_check_desc(scene, "medium", desc, COOKIE_MEDIUM));
    if (!brume_all_within(desc->sigma_t, 3, 0, INFINITY))
        REFUSE("medium: sigma_t must be finite and not negative, not (%g, %g, %g)", desc->sigma_t[0], desc->sigma_t[1],
               desc->sigma_t[2]);
    if (!brume_all_within(desc->albedo, 3, 0, 1))
        REFUSE("medium: albedo must be in [0, 1], not (%g, %g, %g)", desc->albedo[0], desc->albedo[1], desc->albedo[2]);
    if (!brume_all_within(desc->emission, 3, 0, INFINITY))
        REFUSE("medium: emission must be finite and not negative, not (%g, %g, %g)", desc->emission[0],
               desc->emission[1], desc->emission[2]);
    if (!(desc->g > -1 && desc->g < 1))
        REFUSE("medium: g must be between -1 and 1, both excluded, not %g", desc->g);

    BRUME_TRY(brume_scene_grow(scene, &scene->media, scene->medium_count, sizeof *desc));
    scene->media[scene->medium_count] = *desc;
    if (out_id)
        *out_id = scene->medium_count;
    scene->medium_count++;
    return BRUME_OK;
}

/* ---- lights ------------------------------------------------------------------------------------------------------ */

static int is_environment(brume_light_kind kind) {
    return kind == BRUME_LIGHT_CONSTANT || kind == BRUME_LIGHT_ENVMAP;
}

static brume_result check_spot(const brume_scene *scene, const brume_light_desc *desc) {
    if (!(desc->cutoff_angle > 0 && desc->cutoff_angle <= 180))
        REFUSE("light: cutoff_angle must be in (0, 180] degrees, not %g", desc->cutoff_angle);
    if (!(desc->beam_width <= desc->cutoff_angle))
        REFUSE("light: beam_width must be in [0, cutoff_angle = %g] degrees, not %g", desc->cutoff_angle,
               desc->beam_width);
    BRUME_TRY(brume_check_id(scene, "light: texture", desc->texture, scene->texture_count));
    if (desc->texture != BRUME_NONE && desc->cutoff_angle >= 90)
        REFUSE("light: a texture needs a cutoff_angle below 90 degrees, not %g", desc->cutoff_angle);
    return BRUME_OK;
}

brume_result brume_scene_add_light(brume_scene *scene, const brume_light_desc *desc, uint32_t *out_id) {
    brume_scene_light light;
    BRUME_TRY(brume_check_desc(scene, "light", desc, COOKIE_LIGHT));
    if ((unsigned)desc->kind > BRUME_LIGHT_ENVMAP)
        REFUSE("light: kind %d is none", (int)desc->kind);
    /* A cone stays a cone and a map of directions one of directions only if every axis scales alike. */
    int shaped = desc->kind == BRUME_LIGHT_SPOT || desc->kind == BRUME_LIGHT_ENVMAP;
    const char *wrong = brume_check_transform(desc->to_world, shaped ? BRUME_MAP_EVEN : BRUME_MAP_ANY);
    if (wrong)
        REFUSE("light: %s", wrong);
    if (!brume_all_within(desc->intensity, 3, 0, INFINITY))
        REFUSE("light: intensity must be finite and not negative, not (%g, %g, %g)", desc->intensity[0],
               desc->intensity[1], desc->intensity[2]);
    if (desc->kind == BRUME_LIGHT_SPOT)
        BRUME_TRY(check_spot(scene, desc));
    else if (desc->texture != BRUME_NONE)
        REFUSE("light: only spots take a texture");
    if (desc->kind == BRUME_LIGHT_ENVMAP) {
        BRUME_TRY(check_texels(scene, "light", desc->width, desc->height, desc->texels));
        if (!brume_all_within(&desc->scale, 1, 0, INFINITY))
            REFUSE("light: scale must be finite and not negative, not %g", desc->scale);
    }
    for (uint32_t i = 0; is_environment(desc->kind) && i < scene->light_count; i++)
        if (is_environment(scene->lights[i].desc.kind))
            REFUSE("light: the scene has an environment (light %u) already, it can only have one", (unsigned)i);

    light.desc = *desc;
    light.desc.texels = NULL;
    light.texels = NULL;
    if (desc->beam_width < 0)
        light.desc.beam_width = 0.75f * desc->cutoff_angle;
    BRUME_TRY(brume_scene_grow(scene, &scene->lights, scene->light_count, sizeof light));
    if (desc->kind == BRUME_LIGHT_ENVMAP)
        BRUME_TRY(brume_scene_copy(scene, desc->texels, (size_t)desc->width * desc->height, 3 * sizeof(float),
                                   &light.texels));
    scene->lights[scene->light_count] = light;
    if (out_id)
        *out_id = scene->light_count;
    scene->light_count++;
    return BRUME_OK;
}

/* ---- sensor, film, integrator ------------------------------------------------------------------------------------ */

brume_result brume_scene_set_sensor(brume_scene *scene, const brume_sensor_desc *desc) {
    BRUME_TRY(brume_check_desc(scene, "sensor", desc, COOKIE_SENSOR));
    const char *wrong = brume_check_transform(desc->to_world, BRUME_MAP_RIGID);
    if (wrong)
        REFUSE("sensor: %s", wrong);
    if (!(desc->fov > 0 && desc->fov < 180))
        REFUSE("sensor: fov must be between 0 and 180 degrees, both excluded, not %g", desc->fov);
    if ((unsigned)desc->fov_axis > BRUME_FOV_LARGER)
        REFUSE("sensor: fov_axis %d is none", (int)desc->fov_axis);
    if (!isfinite(desc->far_clip) || !(desc->near_clip > 0 && desc->near_clip < desc->far_clip))
        REFUSE("sensor: 0 < near_clip < far_clip must hold, not %g and %g", desc->near_clip, desc->far_clip);
    if (!brume_all_within(&desc->aperture_radius, 1, 0, INFINITY))
        REFUSE("sensor: aperture_radius must be finite and not negative, not %g", desc->aperture_radius);
    if (desc->aperture_radius > 0 && !(isfinite(desc->focus_distance) && desc->focus_distance > 0))
        REFUSE("sensor: focus_distance must be positive, not %g", desc->focus_distance);
    BRUME_TRY(brume_check_id(scene, "sensor: medium", desc->medium, scene->medium_count));
    scene->sensor = *desc;
    scene->has_sensor = 1;
    return BRUME_OK;
}

/* The crop [start, start + count) inside [0, full); count 0 reaches to the edge. */
static int crop_fits(uint32_t start, uint32_t count, uint32_t full) {
    return start < full && count <= full - start;
}

brume_result brume_scene_set_film(brume_scene *scene, const brume_film_desc *desc) {
    BRUME_TRY(brume_check_desc(scene, "film", desc, COOKIE_FILM));
    if (desc->width < 1 || desc->width > 65536 || desc->height < 1 || desc->height > 65536)
        REFUSE("film: width and height must be in [1, 65536], not %u x %u", (unsigned)desc->width,
               (unsigned)desc->height);
    if (!crop_fits(desc->crop_x, desc->crop_width, desc->width) ||
        !crop_fits(desc->crop_y, desc->crop_height, desc->height))
        REFUSE("film: the crop of %u x %u at (%u, %u) leaves the film of %u x %u", (unsigned)desc->crop_width,
               (unsigned)desc->crop_height, (unsigned)desc->crop_x, (unsigned)desc->crop_y, (unsigned)desc->width,
               (unsigned)desc->height);
    if ((unsigned)desc->rfilter > BRUME_RFILTER_LANCZOS)
        REFUSE("film: rfilter %d is none", (int)desc->rfilter);
    if (!brume_all_within(&desc->filter_radius, 1, 0, 64))
        REFUSE("film: filter_radius must be in [0, 64] pixels, not %g", desc->filter_radius);
    /* The table of the inverse cumulative resolves neither a spike nor hundreds of lobes. */
    if (desc->rfilter == BRUME_RFILTER_GAUSSIAN && !(desc->filter_stddev >= 1e-3f && desc->filter_stddev <= 16))
        REFUSE("film: filter_stddev must be in [0.001, 16] pixels, not %g", desc->filter_stddev);
    if (desc->rfilter == BRUME_RFILTER_MITCHELL &&
        !(brume_all_within(&desc->filter_b, 1, 0, 1) && brume_all_within(&desc->filter_c, 1, 0, 1)))
        REFUSE("film: filter_b and filter_c must be in [0, 1], not %g and %g", desc->filter_b, desc->filter_c);
    if (desc->rfilter == BRUME_RFILTER_LANCZOS && !(desc->filter_lobes >= 1 && desc->filter_lobes <= 16))
        REFUSE("film: filter_lobes must be in [1, 16], not %u", (unsigned)desc->filter_lobes);
    scene->film = *desc;
    return BRUME_OK;
}

brume_result brume_scene_set_integrator(brume_scene *scene, const brume_integrator_desc *desc) {
    BRUME_TRY(brume_check_desc(scene, "integrator", desc, COOKIE_INTEGRATOR));
    if (desc->max_depth < -1)
        REFUSE("integrator: max_depth must be -1 (no limit) or not negative, not %d", (int)desc->max_depth);
    if (desc->rr_depth < 1)
        REFUSE("integrator: rr_depth must be at least 1, not %d", (int)desc->rr_depth);
    if ((unsigned)desc->sampler > BRUME_SAMPLER_INDEPENDENT)
        REFUSE("integrator: sampler %d is none", (int)desc->sampler);
    if (desc->sample_count < 1)
        REFUSE("integrator: sample_count must be at least 1");
    if (!brume_strategy_name(desc->strategy))
        REFUSE("integrator: strategy %d is none", (int)desc->strategy);
    if (!brume_positions_valid(desc->positions))
        REFUSE("integrator: positions must be a power of two up to 64, or 0, not %u", (unsigned)desc->positions);
    if (!brume_indirect_name(desc->indirect))
        REFUSE("integrator: indirect %d is none", (int)desc->indirect);
    scene->integrator = *desc;
    return BRUME_OK;
}

brume_result brume_scene_get_film(const brume_scene *scene, brume_film_desc *out) {
    if (!scene || !out)
        return brume_fail(scene ? scene->context : NULL, BRUME_ERROR_ARGUMENT, "film: the %s is NULL",
                          scene ? "out-parameter" : "scene");
    *out = scene->film;
    return BRUME_OK;
}

brume_result brume_scene_get_integrator(const brume_scene *scene, brume_integrator_desc *out) {
    if (!scene || !out)
        return brume_fail(scene ? scene->context : NULL, BRUME_ERROR_ARGUMENT, "integrator: the %s is NULL",
                          scene ? "out-parameter" : "scene");
    *out = scene->integrator;
    return BRUME_OK;
}

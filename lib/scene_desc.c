/* scene_desc.c -- the descriptors' default values, as brume.h documents them (Mitsuba 3's, where it has one). */
#include "scene_check.h"

#include <string.h>

static void set3(float v[3], float value) {
    v[0] = v[1] = v[2] = value;
}

static void set_identity(float m[16]) {
    memset(m, 0, 16 * sizeof *m);
    m[0] = m[5] = m[10] = m[15] = 1;
}

brume_texture_desc brume_texture_desc_default(void) {
    brume_texture_desc desc;
    memset(&desc, 0, sizeof desc);
    desc.cookie = COOKIE_TEXTURE;
    set3(desc.color0, 0.4f);
    set3(desc.color1, 0.2f);
    desc.to_uv[0] = desc.to_uv[4] = 1;
    return desc;
}

brume_bsdf_desc brume_bsdf_desc_default(brume_bsdf_kind kind) {
    brume_bsdf_desc desc;
    memset(&desc, 0, sizeof desc);
    desc.cookie = COOKIE_BSDF;
    desc.kind = kind;
    set3(desc.reflectance, kind == BRUME_BSDF_DIFFUSE ? 0.5f : 1);
    desc.reflectance_texture = BRUME_NONE;
    set3(desc.transmittance, 1);
    desc.int_ior = 1.5046f;
    desc.ext_ior = 1.000277f;
    set3(desc.k, 1);
    desc.alpha_u = desc.alpha_v = 0.1f;
    desc.sample_visible = 1;
    desc.back = BRUME_NONE;
    return desc;
}

brume_medium_desc brume_medium_desc_default(void) {
    brume_medium_desc desc;
    memset(&desc, 0, sizeof desc);
    desc.cookie = COOKIE_MEDIUM;
    set3(desc.sigma_t, 1);
    set3(desc.albedo, 0.75f);
    return desc;
}

brume_light_desc brume_light_desc_default(brume_light_kind kind) {
    brume_light_desc desc;
    memset(&desc, 0, sizeof desc);
    desc.cookie = COOKIE_LIGHT;
    desc.kind = kind;
    set_identity(desc.to_world);
    set3(desc.intensity, 1);
    desc.cutoff_angle = 20;
    desc.beam_width = -1;
    desc.texture = BRUME_NONE;
    desc.scale = 1;
    return desc;
}

brume_shape_desc brume_shape_desc_default(brume_shape_kind kind) {
    brume_shape_desc desc;
    memset(&desc, 0, sizeof desc);
    desc.cookie = COOKIE_SHAPE;
    desc.kind = kind;
    set_identity(desc.to_world);
    desc.radius = 1;
    desc.bsdf = desc.interior = desc.exterior = BRUME_NONE;
    return desc;
}

brume_sensor_desc brume_sensor_desc_default(void) {
    brume_sensor_desc desc;
    memset(&desc, 0, sizeof desc);
    desc.cookie = COOKIE_SENSOR;
    set_identity(desc.to_world);
    desc.fov = 39.3077f;
    desc.near_clip = 0.01f;
    desc.far_clip = 10000;
    desc.focus_distance = 1;
    desc.medium = BRUME_NONE;
    return desc;
}

brume_film_desc brume_film_desc_default(void) {
    brume_film_desc desc;
    memset(&desc, 0, sizeof desc);
    desc.cookie = COOKIE_FILM;
    desc.width = 768;
    desc.height = 576;
    desc.rfilter = BRUME_RFILTER_GAUSSIAN;
    desc.filter_stddev = 0.5f;
    desc.filter_b = desc.filter_c = 1 / 3.0f;
    desc.filter_lobes = 3;
    desc.half = 1;
    return desc;
}

brume_integrator_desc brume_integrator_desc_default(void) {
    brume_integrator_desc desc;
    memset(&desc, 0, sizeof desc);
    desc.cookie = COOKIE_INTEGRATOR;
    desc.max_depth = -1;
    desc.rr_depth = 5;
    desc.sample_count = 16;
    return desc;
}

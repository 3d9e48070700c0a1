/* features.c -- from effects to code: which feature bit of the kernels (cl/shared.h, where what each has been measured
 * to be worth is written) is needed by which effects. */
#include "effects.h"

#include "../cl/shared.h"

/* Needed where all of `all` and any of `any` are there. FEATURE_GUIDES is asked for by the render, not by the scene. */
static const struct { const char *name; uint32_t bit, all, any; } table[] = {
    {"media", FEATURE_MEDIA, 0, EFFECT(MEDIA)},
    {"null", FEATURE_NULL, 0, EFFECT(NULL_SURFACES)},
    {"quadrics", FEATURE_QUADRICS, 0, EFFECT(QUADRICS)},
    {"delta-lights", FEATURE_DELTA_LIGHTS, 0,
     EFFECT(POINT_LIGHTS) | EFFECT(SPOT_LIGHTS) | EFFECT(DIRECTIONAL_LIGHTS)},
    {"area-lights", FEATURE_AREA_LIGHTS, 0, EFFECT(AREA_LIGHTS)},
    {"environment", FEATURE_ENVIRONMENT, 0, EFFECT(ENVIRONMENT)},
    {"specular", FEATURE_SPECULAR, 0, EFFECT(DIELECTRIC) | EFFECT(CONDUCTOR) | EFFECT(ROUGH_CONDUCTOR)},
    {"textures", FEATURE_TEXTURES, 0, EFFECT(TEXTURES)},
    {"guides", FEATURE_GUIDES, 0, 0},
    {"many-lights", FEATURE_MANY_LIGHTS, 0, EFFECT(MANY_LIGHTS)},
    /* Light of lamps without extent that is scattered once is gathered along segments: nobody needs to fly. */
    {"flights", FEATURE_FLIGHTS, EFFECT(SCATTERING),
     EFFECT(MULTIPLE_SCATTERING) | EFFECT(AREA_LIGHTS) | EFFECT(ENVIRONMENT) | EFFECT(EMISSION)},
    {"chromatic", FEATURE_CHROMATIC, 0, EFFECT(CHROMATIC_EXTINCTION)},
    {"scattering", FEATURE_SCATTERING, 0, EFFECT(SCATTERING)},
    {"emission", FEATURE_EMISSION, 0, EFFECT(EMISSION)},
    {"anisotropy", FEATURE_ANISOTROPY, 0, EFFECT(ANISOTROPY)},
};
enum { FEATURE_COUNT = sizeof table / sizeof table[0] };

uint32_t brume_effects_features(uint32_t effects) {
    uint32_t features = 0;
    for (int i = 0; i < FEATURE_COUNT; i++)
        if ((effects & table[i].all) == table[i].all && (effects & table[i].any)) features |= table[i].bit;
    return features;
}

const char *brume_feature_name(uint32_t number) {
    for (int i = 0; i < FEATURE_COUNT; i++)
        if (number < 32 && table[i].bit == 1u << number) return table[i].name;
    return NULL;
}

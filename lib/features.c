/* features.c -- from effects to code: which feature bit of the kernels (cl/shared.h) is needed by which effects, and
 * what leaving it out where it isn't needed has been measured to be worth. What is not worth a bit is a branch: media
 * that glow (a bit saved 1.006 of the time in fog, 5 KiB), the lens, single scattering, kinds of lamps and textures. */
#include "effects.h"

#include "../cl/shared.h"

/* Needed where all of `all` and any of `any` are there. FEATURE_GUIDES and FEATURE_LIGHT_LAYERS are asked for by the
 * render, not by the scene.
 *
 * Comments: processor time and size of a program that has it too many, over one that doesn't (bench-effects --bits,
 * 16 lanes, AVX-512; times scatter by 0.02), for spots in a room without a medium and in fog. Size goes with compile
 * time. 1536 masks can come out, without those two; only those of scenes that are rendered are ever built. */
static const struct { const char *name; uint32_t bit, all, any; } table[] = {
    /* no medium 1.019, +32 KiB */
    {"media", FEATURE_MEDIA, 0, EFFECT(MEDIA)},
    /* no medium 1.044, -1 KiB; fog 1.039, +6 KiB */
    {"null", FEATURE_NULL, 0, EFFECT(NULL_SURFACES)},
    /* fog among triangles, scattered once: 1.003, +49 KiB */
    {"quadrics", FEATURE_QUADRICS, 0, EFFECT(QUADRICS)},
    /* fog under a sky: 1.009, +99 KiB */
    {"delta-lights", FEATURE_DELTA_LIGHTS, 0,
     EFFECT(POINT_LIGHTS) | EFFECT(SPOT_LIGHTS) | EFFECT(DIRECTIONAL_LIGHTS)},
    /* no medium 1.014, +101 KiB; fog 1.289, +123 KiB */
    {"area-lights", FEATURE_AREA_LIGHTS, 0, EFFECT(AREA_LIGHTS)},
    /* no medium 0.982, +60 KiB; fog 1.287, +78 KiB */
    {"environment", FEATURE_ENVIRONMENT, 0, EFFECT(ENVIRONMENT)},
    /* no medium 0.983, +70 KiB; fog 0.984, +68 KiB */
    {"specular", FEATURE_SPECULAR, 0, EFFECT(DIELECTRIC) | EFFECT(CONDUCTOR) | EFFECT(ROUGH_CONDUCTOR)},
    /* no medium 1.124, +49 KiB; fog 0.988, +50 KiB */
    {"textures", FEATURE_TEXTURES, 0, EFFECT(TEXTURES)},
    /* 19 planes of film instead of 10, for every sample */
    {"guides", FEATURE_GUIDES, 0, 0},
    /* no medium 1.130, +65 KiB; fog 0.986, +44 KiB */
    {"many-lights", FEATURE_MANY_LIGHTS, 0, EFFECT(MANY_LIGHTS)},
    /* Light of lamps without extent that is scattered once is gathered along segments: nobody needs to fly. Fog
     * scattered once against all of it: 578 and 670 KiB. */
    {"flights", FEATURE_FLIGHTS, EFFECT(SCATTERING),
     EFFECT(MULTIPLE_SCATTERING) | EFFECT(AREA_LIGHTS) | EFFECT(ENVIRONMENT) | EFFECT(EMISSION)},
    /* fog 0.994, +8 KiB */
    {"chromatic", FEATURE_CHROMATIC, 0, EFFECT(CHROMATIC_EXTINCTION)},
    /* Absorption alone against fog scattered once: 408 and 578 KiB. */
    {"scattering", FEATURE_SCATTERING, 0, EFFECT(SCATTERING)},
    /* fog 1.050, +25 KiB */
    {"anisotropy", FEATURE_ANISOTROPY, 0, EFFECT(ANISOTROPY)},
    /* 32 planes of film instead of 19, and 12 numbers more for each path */
    {"light-layers", FEATURE_LIGHT_LAYERS, 0, 0},
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

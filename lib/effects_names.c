/* effects_names.c -- effects by name, and the kinds of objects that call for them. */
#include "effects.h"

#include <stdio.h>

static const char *const names[BRUME_EFFECT_COUNT] = {
    "media", "absorption", "emission", "scattering", "multiple-scattering", "anisotropy", "chromatic-extinction",
    "bounded-media", "beam-shadows", "point-lights", "spot-lights", "directional-lights", "area-lights", "environment",
    "environment-map", "many-lights", "diffuse", "dielectric", "conductor", "rough-conductor", "null-surfaces",
    "textures", "quadrics", "lens"};

const char *brume_effect_name(brume_effect effect) {
    return (unsigned)effect < BRUME_EFFECT_COUNT ? names[effect] : NULL;
}

void brume_effects_list(uint32_t effects, char *out, size_t size) {
    size_t used = 0;
    out[0] = 0;
    for (int i = 0; i < BRUME_EFFECT_COUNT && used < size; i++)
        if (effects >> i & 1) {
            int length = snprintf(out + used, size - used, "%s%s", used ? "," : "", names[i]);
            used += length > 0 ? (size_t)length : 0;
        }
}

const char *brume_object_name(brume_object object) {
    static const char *const objects[] = {"integrator", "sensor", "medium", "texture", "bsdf", "light", "shape"};
    return (unsigned)object < sizeof objects / sizeof objects[0] ? objects[object] : NULL;
}

/* effects.h -- what a scene calls for, what can be taken away from it, and which code that needs.
 *
 * Scene description -> set of effects (brume_effect) -> feature bits of the kernels (FEATURE_... in cl/shared.h). Pure
 * functions: nothing here looks at arrays, devices or programs.
 */
#ifndef BRUME_EFFECTS_H
#define BRUME_EFFECTS_H

#include "scene.h"

#define EFFECT(name) (1u << BRUME_EFFECT_##name)

/* The effects of a scene as it is. `reports` may be NULL; else those of effects that are there are filled in, and the
 * rest zeroed. */
uint32_t brume_effects_find(const brume_scene *scene, brume_effect_report *reports);

/* How many shapes, null surfaces left out, stand where a lamp without extent shines (lib/effects_beams.c). Spheres
 * about them are looked at, so that it may be fewer. 0, or the first shape and its lamp. */
uint32_t brume_beams_meet(const brume_scene *scene, uint32_t *out_shape, uint32_t *out_lamp);

/* The code that these effects need (lib/features.c). */
uint32_t brume_effects_features(uint32_t effects);

/* "emission,lens": the names of a set, separated by commas, as far as they fit (lib/effects_names.c). */
void brume_effects_list(uint32_t effects, char *out, size_t size);

/* Those that can be taken away. */
uint32_t brume_effects_removable(void);

/* A scene with effects taken away (lib/effects_remove.c): a copy of the descriptors, which shares vertices and texels
 * with the original and must not outlive it. `view->scene` may be changed like any description. */
typedef struct brume_scene_view {
    brume_scene scene;
} brume_scene_view;

brume_result brume_scene_view_make(const brume_scene *scene, uint32_t without, brume_scene_view *out);
void brume_scene_view_free(brume_scene_view *view);

#endif

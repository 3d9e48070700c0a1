/* scene_check.h -- what every descriptor is checked with: cookies, ranges, transforms. Private to lib/scene*.c. */
#ifndef BRUME_SCENE_CHECK_H
#define BRUME_SCENE_CHECK_H

#include "scene.h"

/* One value per descriptor type: tells zeroed or foreign memory from what a default function filled in. */
enum {
    COOKIE_TEXTURE = 0x62780001,
    COOKIE_BSDF,
    COOKIE_MEDIUM,
    COOKIE_LIGHT,
    COOKIE_SHAPE,
    COOKIE_SENSOR,
    COOKIE_FILM,
    COOKIE_INTEGRATOR
};

/* First lines of every add and set call: no NULLs, and the cookie. `noun` is "texture", "bsdf", ... */
brume_result brume_check_desc(const brume_scene *scene, const char *noun, const void *desc, uint32_t cookie);

/* Leaves a call that was given what it cannot take; its format and arguments say what. Takes `scene` from there. */
#define REFUSE(...) return brume_fail(scene->context, BRUME_ERROR_ARGUMENT, __VA_ARGS__)

int brume_all_finite(const float *values, size_t count);
/* Every value in [low, high]; false for a NaN. high may be INFINITY, which then still refuses infinite values. */
int brume_all_within(const float *values, size_t count, float low, float high);

/* How much of an affine map a thing can take. */
typedef enum brume_map_kind {
    BRUME_MAP_ANY = 0,  /* invertible */
    BRUME_MAP_EVEN = 1, /* rotation, reflection and one scale factor */
    BRUME_MAP_RIGID = 2 /* no scale */
} brume_map_kind;

/* NULL if `m` is finite, affine, invertible and of that kind, else what is wrong with it, as the end of a sentence. */
const char *brume_check_transform(const float m[16], brume_map_kind kind);
int brume_transform_mirrors(const float m[16]);

/* `id` names one of `count` things, or is BRUME_NONE. */
brume_result brume_check_id(const brume_scene *scene, const char *what, uint32_t id, uint32_t count);

/* Makes room for one more in an array that grows by doubling. */
brume_result brume_scene_grow(const brume_scene *scene, void *array_pointer, uint32_t count, size_t size);

/* A copy of count x size bytes, or BRUME_ERROR_MEMORY. */
brume_result brume_scene_copy(const brume_scene *scene, const void *from, size_t count, size_t size, void *out_pointer);

#endif

/* scene_check.c -- the checks shared by every descriptor of the scene description. */
#include "scene_check.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "affine.h"

brume_result brume_check_desc(const brume_scene *scene, const char *noun, const void *desc, uint32_t cookie) {
    uint32_t found;
    if (!scene)
        return brume_fail(NULL, BRUME_ERROR_ARGUMENT, "%s: the scene is NULL", noun);
    if (!desc)
        return brume_fail(scene->context, BRUME_ERROR_ARGUMENT, "%s: the descriptor is NULL", noun);
    memcpy(&found, desc, sizeof found);
    if (found != cookie)
        return brume_fail(scene->context, BRUME_ERROR_ARGUMENT,
                          "%s: the descriptor does not come from brume_%s_desc_default()", noun, noun);
    return BRUME_OK;
}

int brume_all_finite(const float *values, size_t count) {
    for (size_t i = 0; i < count; i++)
        if (!isfinite(values[i]))
            return 0;
    return 1;
}

int brume_all_within(const float *values, size_t count, float low, float high) {
    for (size_t i = 0; i < count; i++)
        if (!isfinite(values[i]) || values[i] < low || values[i] > high)
            return 0;
    return 1;
}

static double dot_columns(const float m[16], int a, int b) {
    return (double)m[a] * m[b] + (double)m[4 + a] * m[4 + b] + (double)m[8 + a] * m[8 + b];
}

const char *brume_check_transform(const float m[16], brume_map_kind kind) {
    /* Files carry rotations with five or six digits: what differs by less is the same scale. */
    const double tolerance = 1e-4;
    if (!brume_all_finite(m, 16))
        return "to_world holds a NaN or an infinity";
    if (m[12] != 0 || m[13] != 0 || m[14] != 0 || m[15] != 1)
        return "to_world is not affine: its last row must be 0 0 0 1";
    double xx = dot_columns(m, 0, 0), yy = dot_columns(m, 1, 1), zz = dot_columns(m, 2, 2);
    /* Relative to the lengths of the axes, so that tiny and huge scenes are judged alike. */
    if (!(fabs(brume_affine_determinant(m)) > 1e-9 * sqrt(xx) * sqrt(yy) * sqrt(zz)))
        return "to_world is singular";
    if (kind == BRUME_MAP_ANY)
        return NULL;
    double most = fmax(xx, fmax(yy, zz)), least = fmin(xx, fmin(yy, zz));
    double shear = fmax(fabs(dot_columns(m, 0, 1)), fmax(fabs(dot_columns(m, 0, 2)), fabs(dot_columns(m, 1, 2))));
    if (most - least > 2 * tolerance * most || shear > tolerance * most)
        return "to_world must scale evenly, without shear";
    if (kind == BRUME_MAP_RIGID && fabs(most - 1) > 2 * tolerance)
        return "to_world must not scale";
    return NULL;
}

int brume_transform_mirrors(const float m[16]) {
    return brume_affine_determinant(m) < 0;
}

brume_result brume_check_id(const brume_scene *scene, const char *what, uint32_t id, uint32_t count) {
    if (id == BRUME_NONE || id < count)
        return BRUME_OK;
    return brume_fail(scene->context, BRUME_ERROR_ARGUMENT, "%s: there is no id %u, the scene has %u of them", what,
                      (unsigned)id, (unsigned)count);
}

brume_result brume_scene_grow(const brume_scene *scene, void *array_pointer, uint32_t count, size_t size) {
    /* Full exactly at 0 and at powers of two, so no capacity needs keeping. */
    if (count & (count - 1))
        return BRUME_OK;
    if (count > INT32_MAX / 2)
        return brume_fail(scene->context, BRUME_ERROR_ARGUMENT, "the scene has too many parts of one kind");
    void *array;
    memcpy(&array, array_pointer, sizeof array);
    array = realloc(array, (count ? 2 * (size_t)count : 1) * size);
    if (!array)
        return brume_fail(scene->context, BRUME_ERROR_MEMORY, "no memory for another part of the scene");
    memcpy(array_pointer, &array, sizeof array);
    return BRUME_OK;
}

brume_result brume_scene_copy(const brume_scene *scene, const void *from, size_t count, size_t size,
                              void *out_pointer) {
    void *copy = count <= SIZE_MAX / size ? malloc(count * size) : NULL;
    if (!copy)
        return brume_fail(scene->context, BRUME_ERROR_MEMORY, "no memory for %zu x %zu bytes of the scene", count,
                          size);
    memcpy(copy, from, count * size);
    memcpy(out_pointer, &copy, sizeof copy);
    return BRUME_OK;
}

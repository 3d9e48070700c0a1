/* scene_origin.c -- where the objects of a scene description were written, for those who explain it. */
#include "scene_check.h"

#include <stdlib.h>
#include <string.h>

static char *copy_text(const char *text) {
    size_t size = strlen(text) + 1;
    char *copy = malloc(size);
    if (copy) memcpy(copy, text, size);
    return copy;
}

brume_result brume_scene_set_origin(brume_scene *scene, brume_object kind, uint32_t index, const char *id,
                                    const char *file, uint32_t line) {
    BRUME_TRY(brume_scene_grow(scene, &scene->origins, scene->origin_count, sizeof *scene->origins));
    brume_scene_origin origin = {kind, index, id ? copy_text(id) : NULL, copy_text(file), line};
    if ((id && !origin.id) || !origin.file) {
        free(origin.id);
        free(origin.file);
        return brume_fail(scene->context, BRUME_ERROR_MEMORY, "no memory for another part of the scene");
    }
    scene->origins[scene->origin_count++] = origin;
    return BRUME_OK;
}

const brume_scene_origin *brume_scene_origin_of(const brume_scene *scene, brume_object kind, uint32_t index) {
    for (uint32_t i = 0; i < scene->origin_count; i++)
        if (scene->origins[i].kind == kind && scene->origins[i].index == index) return &scene->origins[i];
    return NULL;
}

/* scene.h -- the scene description: what brume_scene_add_... and the scene-file reader fill in, and lib/arrays.c reads.
 *
 * Everything is the caller's descriptors, checked, with the arrays they point to copied. Ids are indices here.
 */
#ifndef BRUME_SCENE_H
#define BRUME_SCENE_H

#include "context.h"

typedef struct brume_scene_texture { brume_texture_desc desc; float *texels; } brume_scene_texture;
typedef struct brume_scene_light { brume_light_desc desc; float *texels; } brume_scene_light;
/* Rectangles and cubes are meshes already (desc.kind is MESH, SPHERE or DISK); positions are still object space. */
typedef struct brume_scene_shape {
    brume_shape_desc desc;
    float *positions, *normals, *uvs; /* owned; desc's pointers are NULL */
    uint32_t *triangles;
} brume_scene_shape;

/* Where an object of the description was written. */
typedef struct brume_scene_origin {
    brume_object kind;
    uint32_t index; /* 0 where there is one only: sensor, film, integrator */
    char *id;       /* as given in the file, NULL for none; owned, like `file` */
    char *file;
    uint32_t line;
} brume_scene_origin;

struct brume_scene {
    brume_context *context; /* retained */
    brume_scene_texture *textures;
    brume_bsdf_desc *bsdfs;
    brume_medium_desc *media;
    brume_scene_light *lights;
    brume_scene_shape *shapes;
    uint32_t texture_count, bsdf_count, medium_count, light_count, shape_count;
    brume_sensor_desc sensor;
    brume_film_desc film;
    brume_integrator_desc integrator;
    int has_sensor;
    brume_scene_origin *origins; /* of what was read from a file; in no order */
    uint32_t origin_count;
};

/* Remembers where an object was written. `id` may be NULL. */
brume_result brume_scene_set_origin(brume_scene *scene, brume_object kind, uint32_t index, const char *id,
                                    const char *file, uint32_t line);
/* NULL if it was not read from a file. */
const brume_scene_origin *brume_scene_origin_of(const brume_scene *scene, brume_object kind, uint32_t index);

#endif

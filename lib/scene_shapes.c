/* scene_shapes.c -- shapes of the scene description: meshes are checked and copied, rectangles and cubes become meshes
 * with the vertices and texture coordinates that Mitsuba 3 gives them. Positions stay in object space.
 */
#include "scene_check.h"

#include <math.h>
#include <stdlib.h>

/* Texture coordinates are (x + 1) / 2, (y + 1) / 2. */
static const float rectangle_positions[4 * 3] = {-1, -1, 0, 1, -1, 0, 1, 1, 0, -1, 1, 0};
static const float rectangle_uvs[4 * 2] = {0, 0, 1, 0, 1, 1, 0, 1};

/* Four vertices a face, so that each face has its own texture coordinates: -y, +y, +x, +z, -x, -z. */
static const float cube_positions[24 * 3] = {
    1,  -1, -1, 1,  -1, 1, -1, -1, 1,  -1, -1, -1, /**/ 1, 1,  -1, -1, 1,  -1, -1, 1,  1,  1,  1,  1,
    1,  -1, -1, 1,  1, -1, 1,  1,  1,  1,  -1, 1,  /**/ 1, -1, 1,  1,  1,  1,  -1, 1,  1,  -1, -1, 1,
    -1, -1, 1,  -1, 1, 1,  -1, 1,  -1, -1, -1, -1, /**/ 1, 1,  -1, 1,  -1, -1, -1, -1, -1, -1, 1,  -1,
};
static const float face_uvs[4 * 2] = {0, 1, 1, 1, 1, 0, 0, 0};

static brume_result check_mesh(const brume_scene *scene, const brume_shape_desc *desc) {
    if (desc->vertex_count == 0 || desc->triangle_count == 0)
        REFUSE("shape: a mesh of %u vertices and %u triangles is empty", (unsigned)desc->vertex_count,
               (unsigned)desc->triangle_count);
    /* Kernels index floats and vertices by int. */
    if (desc->vertex_count > INT32_MAX / 3 || desc->triangle_count > INT32_MAX / 3)
        REFUSE("shape: a mesh of %u vertices and %u triangles is too large", (unsigned)desc->vertex_count,
               (unsigned)desc->triangle_count);
    if (!desc->positions || !desc->triangles)
        REFUSE("shape: the mesh's %s are NULL", desc->positions ? "triangles" : "positions");
    for (size_t i = 0; i < desc->vertex_count; i++) {
        if (!brume_all_finite(desc->positions + 3 * i, 3))
            REFUSE("shape: the position of vertex %zu holds a NaN or an infinity", i);
        if (desc->normals && !brume_all_finite(desc->normals + 3 * i, 3))
            REFUSE("shape: the normal of vertex %zu holds a NaN or an infinity", i);
        if (desc->uvs && !brume_all_finite(desc->uvs + 2 * i, 2))
            REFUSE("shape: the texture coordinates of vertex %zu hold a NaN or an infinity", i);
    }
    for (size_t i = 0; i < 3 * (size_t)desc->triangle_count; i++)
        if (desc->triangles[i] >= desc->vertex_count)
            REFUSE("shape: triangle %zu names vertex %u, but there are only %u", i / 3, (unsigned)desc->triangles[i],
                   (unsigned)desc->vertex_count);
    return BRUME_OK;
}

static brume_result check_shape(const brume_scene *scene, const brume_shape_desc *desc) {
    BRUME_TRY(brume_check_desc(scene, "shape", desc, COOKIE_SHAPE));
    if ((unsigned)desc->kind > BRUME_SHAPE_DISK)
        REFUSE("shape: kind %d is none", (int)desc->kind);
    const char *wrong =
        brume_check_transform(desc->to_world, desc->kind == BRUME_SHAPE_SPHERE ? BRUME_MAP_EVEN : BRUME_MAP_ANY);
    if (wrong)
        REFUSE("shape: %s", wrong);
    if (desc->kind == BRUME_SHAPE_SPHERE) {
        if (!brume_all_finite(desc->center, 3))
            REFUSE("shape: the sphere's center holds a NaN or an infinity");
        if (!(isfinite(desc->radius) && desc->radius > 0))
            REFUSE("shape: the sphere's radius must be positive, not %g", desc->radius);
    }
    if (!brume_all_within(desc->radiance, 3, 0, INFINITY))
        REFUSE("shape: radiance must be finite and not negative, not (%g, %g, %g)", desc->radiance[0],
               desc->radiance[1], desc->radiance[2]);
    BRUME_TRY(brume_check_id(scene, "shape: bsdf", desc->bsdf, scene->bsdf_count));
    BRUME_TRY(brume_check_id(scene, "shape: interior", desc->interior, scene->medium_count));
    BRUME_TRY(brume_check_id(scene, "shape: exterior", desc->exterior, scene->medium_count));
    return desc->kind == BRUME_SHAPE_MESH ? check_mesh(scene, desc) : BRUME_OK;
}

/* `faces` quads of four vertices each, counter-clockwise from outside, in the triangles' order of Mitsuba's cube. A
 * mirroring transform would turn them inside out: these shapes' normals are theirs by definition, not by winding. */
static void fill_quads(brume_scene_shape *shape, uint32_t faces, int mirrored) {
    static const uint32_t corners[2][6] = {{0, 1, 2, 3, 0, 2}, {0, 2, 1, 3, 2, 0}};
    for (uint32_t i = 0; i < 6 * faces; i++)
        shape->triangles[i] = 4 * (i / 6) + corners[mirrored != 0][i % 6];
}

static brume_result copy_geometry(const brume_scene *scene, const brume_shape_desc *desc, brume_scene_shape *shape) {
    int is_mesh = desc->kind == BRUME_SHAPE_MESH, is_cube = desc->kind == BRUME_SHAPE_CUBE;
    uint32_t vertices = is_mesh ? desc->vertex_count : is_cube ? 24 : 4;
    uint32_t triangles = is_mesh ? desc->triangle_count : vertices / 2;
    const float *positions = is_mesh ? desc->positions : is_cube ? cube_positions : rectangle_positions;
    BRUME_TRY(brume_scene_copy(scene, positions, vertices, 3 * sizeof(float), &shape->positions));
    if (is_mesh) {
        if (desc->normals)
            BRUME_TRY(brume_scene_copy(scene, desc->normals, vertices, 3 * sizeof(float), &shape->normals));
        if (desc->uvs)
            BRUME_TRY(brume_scene_copy(scene, desc->uvs, vertices, 2 * sizeof(float), &shape->uvs));
        BRUME_TRY(brume_scene_copy(scene, desc->triangles, triangles, 3 * sizeof(uint32_t), &shape->triangles));
    } else {
        shape->uvs = malloc(vertices * 2 * sizeof *shape->uvs);
        shape->triangles = malloc(triangles * 3 * sizeof *shape->triangles);
        if (!shape->uvs || !shape->triangles)
            return brume_fail(scene->context, BRUME_ERROR_MEMORY, "no memory for a shape");
        for (uint32_t i = 0; i < 2 * vertices; i++)
            shape->uvs[i] = is_cube ? face_uvs[i % 8] : rectangle_uvs[i];
        fill_quads(shape, vertices / 4, brume_transform_mirrors(desc->to_world));
    }
    shape->desc.kind = BRUME_SHAPE_MESH;
    shape->desc.vertex_count = vertices;
    shape->desc.triangle_count = triangles;
    return BRUME_OK;
}

brume_result brume_scene_add_shape(brume_scene *scene, const brume_shape_desc *desc, uint32_t *out_id) {
    BRUME_TRY(check_shape(scene, desc));
    brume_scene_shape shape = {.desc = *desc};
    shape.desc.positions = shape.desc.normals = shape.desc.uvs = NULL;
    shape.desc.triangles = NULL;
    if (desc->interior != BRUME_NONE || desc->exterior != BRUME_NONE)
        shape.desc.is_boundary = 1;
    BRUME_TRY(brume_scene_grow(scene, &scene->shapes, scene->shape_count, sizeof shape));
    brume_result result = BRUME_OK;
    if (desc->kind == BRUME_SHAPE_MESH || desc->kind == BRUME_SHAPE_RECTANGLE || desc->kind == BRUME_SHAPE_CUBE)
        result = copy_geometry(scene, desc, &shape);
    else
        shape.desc.vertex_count = shape.desc.triangle_count = 0;
    if (result != BRUME_OK) {
        free(shape.positions);
        free(shape.normals);
        free(shape.uvs);
        free(shape.triangles);
        return result;
    }
    scene->shapes[scene->shape_count] = shape;
    if (out_id)
        *out_id = scene->shape_count;
    scene->shape_count++;
    return BRUME_OK;
}

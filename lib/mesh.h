/* mesh.h -- reading triangle meshes: OBJ through tinyobjloader, and PLY. */
#ifndef BRUME_MESH_H
#define BRUME_MESH_H

#include "context.h"

typedef struct brume_mesh {
    uint32_t vertex_count, triangle_count;
    float *positions, *normals, *uvs; /* 3, 3, 2 floats a vertex; normals and uvs may be NULL */
    uint32_t *triangles;              /* 3 vertex numbers */
} brume_mesh;

typedef struct brume_mesh_options {
    int face_normals;    /* drop vertex normals */
    int flip_tex_coords; /* v -> 1 - v */
} brume_mesh_options;

/* Polygons are triangulated. As in Mitsuba 3, a mesh without normals gets smooth ones unless face_normals is set.
 * `where` prefixes errors ("file.xml:3:5"), NULL for none. */
brume_result brume_mesh_read_obj(brume_context *context, const char *path, const brume_mesh_options *options,
                                 const char *where, brume_mesh *out);
brume_result brume_mesh_read_ply(brume_context *context, const char *path, const brume_mesh_options *options,
                                 const char *where, brume_mesh *out);
void brume_mesh_free(brume_mesh *mesh);

#endif

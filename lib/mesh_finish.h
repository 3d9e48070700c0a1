/* mesh_finish.h -- shared by the mesh readers. Private to lib/mesh*. */
#ifndef BRUME_MESH_FINISH_H
#define BRUME_MESH_FINISH_H

#include "mesh.h"

#ifdef __cplusplus
extern "C" {
#endif

/* "where: path: what" */
brume_result brume_mesh_fail(brume_context *context, brume_result code, const char *where, const char *path,
                             const char *what);

/* Checks indices and numbers and applies the options. As in Mitsuba 3, a mesh without normals gets smooth ones, the
 * triangles' weighted by their angle at the vertex (Thuermer & Wuethrich 1998), unless face normals are asked for. */
brume_result brume_mesh_finish(brume_context *context, const brume_mesh_options *options, const char *where,
                               const char *path, brume_mesh *mesh);

#ifdef __cplusplus
}
#endif

#endif

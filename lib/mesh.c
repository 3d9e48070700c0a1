/* mesh.c -- what all mesh readers share: the last checks, vertex normals where a file has none, and release. */
#include "mesh_finish.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

void brume_mesh_free(brume_mesh *mesh) {
    if (!mesh)
        return;
    free(mesh->positions);
    free(mesh->normals);
    free(mesh->uvs);
    free(mesh->triangles);
    memset(mesh, 0, sizeof *mesh);
}

brume_result brume_mesh_fail(brume_context *context, brume_result code, const char *where, const char *path,
                             const char *what) {
    return brume_fail(context, code, "%s%s%s: %s", where ? where : "", where ? ": " : "", path, what);
}

static int all_finite(const float *values, size_t count) {
    for (size_t i = 0; i < count; i++)
        if (!isfinite(values[i]))
            return 0;
    return 1;
}

/* Unit vectors from corner `k` of a triangle along its two sides there. */
static void sides(const brume_mesh *mesh, const uint32_t *v, int k, double a[3], double b[3]) {
    const float *p = mesh->positions + 3 * (size_t)v[k], *q = mesh->positions + 3 * (size_t)v[(k + 1) % 3],
                *r = mesh->positions + 3 * (size_t)v[(k + 2) % 3];
    double length_a = 0, length_b = 0;
    for (int i = 0; i < 3; i++) {
        a[i] = (double)q[i] - p[i];
        b[i] = (double)r[i] - p[i];
        length_a += a[i] * a[i];
        length_b += b[i] * b[i];
    }
    for (int i = 0; i < 3; i++) {
        a[i] /= length_a > 0 ? sqrt(length_a) : 1;
        b[i] /= length_b > 0 ? sqrt(length_b) : 1;
    }
}

static brume_result smooth(brume_context *context, const char *where, const char *path, brume_mesh *mesh) {
    double *sums = calloc(mesh->vertex_count, 3 * sizeof *sums);
    mesh->normals = malloc(3 * (size_t)mesh->vertex_count * sizeof *mesh->normals);
    if (!sums || !mesh->normals) {
        free(sums);
        return brume_mesh_fail(context, BRUME_ERROR_MEMORY, where, path, "out of memory");
    }
    for (size_t t = 0; t < mesh->triangle_count; t++) {
        const uint32_t *v = mesh->triangles + 3 * t;
        for (int k = 0; k < 3; k++) {
            double a[3], b[3];
            sides(mesh, v, k, a, b);
            double n[3] = {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
            double sine = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
            double angle = atan2(sine, a[0] * b[0] + a[1] * b[1] + a[2] * b[2]);
            for (int i = 0; i < 3 && sine > 0; i++)
                sums[3 * (size_t)v[k] + (size_t)i] += n[i] * (angle / sine);
        }
    }
    for (size_t i = 0; i < mesh->vertex_count; i++) {
        double *n = sums + 3 * i, length = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
        for (int k = 0; k < 3; k++)
            mesh->normals[3 * i + (size_t)k] = (float)(length > 0 ? n[k] / length : 0);
    }
    free(sums);
    return BRUME_OK;
}

brume_result brume_mesh_finish(brume_context *context, const brume_mesh_options *options, const char *where,
                               const char *path, brume_mesh *mesh) {
    if (mesh->triangle_count == 0)
        return brume_mesh_fail(context, BRUME_ERROR_SCENE, where, path, "the file holds no triangles");
    for (size_t i = 0; i < 3 * (size_t)mesh->triangle_count; i++)
        if (mesh->triangles[i] >= mesh->vertex_count)
            return brume_mesh_fail(context, BRUME_ERROR_SCENE, where, path,
                                   "a face names a vertex that the file doesn't have");
    size_t count = mesh->vertex_count;
    if (!all_finite(mesh->positions, 3 * count) || (mesh->normals && !all_finite(mesh->normals, 3 * count)) ||
        (mesh->uvs && !all_finite(mesh->uvs, 2 * count)))
        return brume_mesh_fail(context, BRUME_ERROR_SCENE, where, path, "a vertex holds a NaN or an infinity");
    for (size_t i = 0; mesh->uvs && options->flip_tex_coords && i < count; i++)
        mesh->uvs[2 * i + 1] = 1 - mesh->uvs[2 * i + 1];
    if (options->face_normals) {
        free(mesh->normals);
        mesh->normals = NULL;
    } else if (!mesh->normals) {
        return smooth(context, where, path, mesh);
    }
    return BRUME_OK;
}

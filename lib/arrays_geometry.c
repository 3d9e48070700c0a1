/* arrays_geometry.c -- shapes as the kernels see them: world-space vertices, triangles, quadrics, the scene's extent.
 *
 * Transforms are applied in double, positions counted from brume_arrays.origin, and rounded once. Where a transform
 * mirrors, normals follow Mitsuba 3: those of spheres and of meshes without vertex normals turn around with the
 * winding; vertex normals keep their side of the surface, as do disks', rectangles' and cubes'. Geometric normals are
 * wound to agree with vertex normals.
 */
#include "arrays_build.h"

#include <math.h>
#include <stdlib.h>

#include "affine.h"

/* Kernels square distances in float and traverse from far away. */
#define MOST_COORDINATE 1e15

static brume_result check_extent(const brume_scene *scene, const double p[3], uint32_t shape) {
    for (int i = 0; i < 3; i++)
        if (!(fabs(p[i]) <= MOST_COORDINATE))
            return brume_fail(scene->context, BRUME_ERROR_SCENE,
                              "shape %u reaches farther than %g scene units from the origin, or from the camera",
                              (unsigned)shape, MOST_COORDINATE);
    return BRUME_OK;
}

static brume_result count_vertices(const brume_scene *scene, brume_arrays *arrays) {
    size_t positions = 0, normals = 0, uvs = 0, triangles = 0, quadrics = 0;
    for (uint32_t i = 0; i < scene->shape_count; i++) {
        const brume_scene_shape *shape = &scene->shapes[i];
        positions += shape->desc.vertex_count;
        normals += shape->normals ? shape->desc.vertex_count : 0;
        uvs += shape->uvs ? shape->desc.vertex_count : 0;
        triangles += shape->desc.triangle_count;
        quadrics += shape->desc.kind != BRUME_SHAPE_MESH;
    }
    BRUME_TRY(brume_arrays_alloc(scene, "shapes", scene->shape_count, sizeof(b_shape), &arrays->shapes));
    BRUME_TRY(brume_arrays_alloc(scene, "vertex coordinates", 3 * positions, sizeof(float), &arrays->positions));
    BRUME_TRY(brume_arrays_alloc(scene, "normal coordinates", 3 * normals, sizeof(float), &arrays->normals));
    BRUME_TRY(brume_arrays_alloc(scene, "texture coordinates", 2 * uvs, sizeof(float), &arrays->uvs));
    BRUME_TRY(brume_arrays_alloc(scene, "triangles", triangles + quadrics, sizeof(b_triangle), &arrays->triangles));
    return brume_arrays_alloc(scene, "quadrics", quadrics, sizeof(b_quadric), &arrays->quadrics);
}

/* Twice the vector area of a triangle of the world-space arrays. */
static void triangle_normal(const float *positions, const int v[3], double out[3]) {
    double e[2][3];
    for (int k = 0; k < 2; k++)
        for (int i = 0; i < 3; i++)
            e[k][i] = (double)positions[3 * (size_t)v[k + 1] + i] - positions[3 * (size_t)v[0] + i];
    brume_cross(e[0], e[1], out);
}

static void add_normals(const brume_scene_shape *shape, uint32_t first, uint32_t first_triangle, brume_arrays *arrays) {
    const int base = (int)arrays->normal_count - (int)first;
    for (uint32_t i = 0; i < shape->desc.vertex_count; i++) {
        double n[3];
        brume_affine_normal(shape->desc.to_world, shape->normals + 3 * (size_t)i, n);
        brume_normalize(n);
        brume_store(n, arrays->normals + 3 * ((size_t)arrays->normal_count + i));
    }
    /* A vertex whose normal is zero in the file gets its triangles' mean. */
    for (uint32_t t = first_triangle; t < (uint32_t)arrays->params.triangle_count; t++)
        for (int k = 0; k < 3; k++) {
            uint32_t at = (uint32_t)(arrays->triangles[t].v[k] - (int)first);
            const float *given = shape->normals + 3 * (size_t)at;
            if (given[0] != 0 || given[1] != 0 || given[2] != 0)
                continue;
            float *n = arrays->normals + 3 * (size_t)(arrays->triangles[t].v[k] + base);
            double face[3];
            triangle_normal(arrays->positions, arrays->triangles[t].v, face);
            for (int i = 0; i < 3; i++)
                n[i] += (float)face[i];
        }
    for (uint32_t i = 0; i < shape->desc.vertex_count; i++) {
        float *n = arrays->normals + 3 * ((size_t)arrays->normal_count + i);
        double unit[3] = {n[0], n[1], n[2]};
        if (brume_normalize(unit) == 0)
            unit[2] = 1;
        brume_store(unit, n);
    }
    arrays->normal_count += shape->desc.vertex_count;
}

static brume_result add_mesh(const brume_scene *scene, uint32_t id, brume_arrays *arrays) {
    const brume_scene_shape *shape = &scene->shapes[id];
    const brume_shape_desc *desc = &shape->desc;
    b_shape *out = &arrays->shapes[id];
    uint32_t first = arrays->position_count, first_triangle = (uint32_t)arrays->params.triangle_count;
    for (uint32_t i = 0; i < desc->vertex_count; i++) {
        double p[3];
        brume_affine_point(desc->to_world, shape->positions + 3 * (size_t)i, p);
        brume_arrays_place(arrays, p);
        BRUME_TRY(check_extent(scene, p, id));
        brume_store(p, arrays->positions + 3 * ((size_t)first + i));
    }
    arrays->position_count += desc->vertex_count;
    int swap = shape->normals && brume_affine_determinant(desc->to_world) < 0;
    for (uint32_t i = 0; i < desc->triangle_count; i++) {
        const uint32_t *v = shape->triangles + 3 * (size_t)i;
        b_triangle triangle = {{(int)(first + v[0]), (int)(first + v[swap ? 2 : 1]), (int)(first + v[swap ? 1 : 2])},
                               (int)id};
        double n[3];
        triangle_normal(arrays->positions, triangle.v, n);
        if (n[0] == 0 && n[1] == 0 && n[2] == 0)
            arrays->dropped_triangles++;
        else
            arrays->triangles[arrays->params.triangle_count++] = triangle;
    }
    if (shape->normals) {
        out->normal_base = (int)arrays->normal_count - (int)first;
        add_normals(shape, first, first_triangle, arrays);
    }
    if (shape->uvs) {
        out->uv_base = (int)arrays->uv_count - (int)first;
        for (size_t i = 0; i < 2 * (size_t)desc->vertex_count; i++)
            arrays->uvs[2 * (size_t)arrays->uv_count + i] = shape->uvs[i];
        arrays->uv_count += desc->vertex_count;
    }
    return BRUME_OK;
}

static brume_result add_sphere(const brume_scene *scene, uint32_t id, brume_arrays *arrays) {
    const brume_shape_desc *desc = &scene->shapes[id].desc;
    b_quadric *quadric = &arrays->quadrics[arrays->params.quadric_count++];
    double determinant = brume_affine_determinant(desc->to_world);
    double center[3], x[3], y[3], z[3], corner[3], radius = desc->radius * cbrt(fabs(determinant));
    brume_affine_point(desc->to_world, desc->center, center);
    brume_arrays_place(arrays, center);
    for (int i = 0; i < 3; i++)
        corner[i] = fabs(center[i]) + radius;
    BRUME_TRY(check_extent(scene, corner, id));
    brume_affine_axes(desc->to_world, x, y, z);
    brume_store(center, quadric->center);
    quadric->radius = (float)radius;
    if (!(quadric->radius > 0))
        return brume_fail(scene->context, BRUME_ERROR_SCENE, "shape %u, a sphere, is too small", (unsigned)id);
    brume_store(x, quadric->du);
    brume_store(y, quadric->dv);
    brume_store(z, quadric->n);
    quadric->kind = QUADRIC_SPHERE;
    quadric->shape = (int)id;
    if (determinant < 0)
        arrays->shapes[id].flags ^= SHAPE_FLIP_NORMALS;
    return BRUME_OK;
}

static brume_result add_disk(const brume_scene *scene, uint32_t id, brume_arrays *arrays) {
    static const float up[3] = {0, 0, 1};
    const brume_shape_desc *desc = &scene->shapes[id].desc;
    b_quadric *quadric = &arrays->quadrics[arrays->params.quadric_count++];
    double v[4][3], normal[3], corner[3];
    for (int i = 0; i < 4; i++)
        brume_affine_column(desc->to_world, i, v[i]);
    brume_arrays_place(arrays, v[3]);
    brume_affine_normal(desc->to_world, up, normal);
    brume_normalize(normal);
    for (int i = 0; i < 3; i++)
        corner[i] = fabs(v[3][i]) + fabs(v[0][i]) + fabs(v[1][i]);
    BRUME_TRY(check_extent(scene, corner, id));
    brume_store(v[3], quadric->center);
    brume_store(v[0], quadric->du);
    brume_store(v[1], quadric->dv);
    brume_store(normal, quadric->n);
    quadric->kind = QUADRIC_DISK;
    quadric->shape = (int)id;
    return BRUME_OK;
}

static int medium_index(const brume_scene *scene, uint32_t id) {
    return id == BRUME_NONE || scene->integrator.ignore_media ? -1 : (int)id;
}

static void describe_shape(const brume_scene *scene, const brume_shape_desc *desc, const brume_arrays *arrays,
                           b_shape *out) {
    out->bsdf = desc->bsdf == BRUME_NONE ? -1 : (int)desc->bsdf;
    out->flags = desc->flip_normals ? SHAPE_FLIP_NORMALS : 0;
    if (desc->is_boundary && !scene->integrator.ignore_media)
        out->flags |= SHAPE_BOUNDARY;
    out->interior = medium_index(scene, desc->interior);
    out->exterior = medium_index(scene, desc->exterior);
    for (int i = 0; i < 3; i++)
        out->emits |= desc->radiance[i] > 0;
    brume_arrays_store_light(arrays, desc->radiance, out->radiance);
    out->normal_base = out->uv_base = NO_BASE;
}

static void grow_box(double lo[3], double hi[3], const float p[3], const double reach[3]) {
    for (int i = 0; i < 3; i++) {
        lo[i] = fmin(lo[i], p[i] - reach[i]);
        hi[i] = fmax(hi[i], p[i] + reach[i]);
    }
}

/* A sphere about everything that can be hit. */
static void measure(brume_arrays *arrays) {
    static const double nothing[3] = {0, 0, 0};
    double lo[3] = {INFINITY, INFINITY, INFINITY}, hi[3] = {-INFINITY, -INFINITY, -INFINITY}, squared = 0;
    b_params *p = &arrays->params;
    for (int i = 0; i < p->triangle_count; i++)
        for (int k = 0; k < 3; k++)
            grow_box(lo, hi, arrays->positions + 3 * (size_t)arrays->triangles[i].v[k], nothing);
    for (int i = 0; i < p->quadric_count; i++) {
        const b_quadric *q = &arrays->quadrics[i];
        double reach[3];
        for (int k = 0; k < 3; k++)
            reach[k] = q->kind == QUADRIC_SPHERE ? q->radius : hypot(q->du[k], q->dv[k]);
        grow_box(lo, hi, q->center, reach);
    }
    for (int i = 0; i < 3; i++) {
        int any = lo[i] <= hi[i];
        p->scene_center[i] = any ? (float)(0.5 * (lo[i] + hi[i])) : 0;
        squared += any ? 0.25 * (hi[i] - lo[i]) * (hi[i] - lo[i]) : 0;
    }
    p->scene_radius = (float)sqrt(squared);
    if (!(p->scene_radius > 0))
        p->scene_radius = 1;
}

brume_result brume_arrays_geometry(const brume_scene *scene, brume_arrays *arrays) {
    BRUME_TRY(count_vertices(scene, arrays));
    arrays->shape_count = scene->shape_count;
    for (uint32_t i = 0; i < scene->shape_count; i++) {
        const brume_shape_desc *desc = &scene->shapes[i].desc;
        describe_shape(scene, desc, arrays, &arrays->shapes[i]);
        if (desc->kind == BRUME_SHAPE_SPHERE)
            BRUME_TRY(add_sphere(scene, i, arrays));
        else if (desc->kind == BRUME_SHAPE_DISK)
            BRUME_TRY(add_disk(scene, i, arrays));
        else
            BRUME_TRY(add_mesh(scene, i, arrays));
    }
    measure(arrays);
    return BRUME_OK;
}

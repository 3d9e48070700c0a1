/* arrays_origin.c -- the point of world space that the kernels' coordinates count from.
 *
 * A float has 24 bits: a million units from the origin it steps by 1/16. So where a camera stands far out, compared
 * with what is near it, all positions are taken relative to the camera before they are rounded; nothing in the kernels
 * depends on where the origin is. Elsewhere it stays where the scene has it, and so do the bits of the picture.
 */
#include "arrays_build.h"

#include <math.h>

#include "affine.h"

/* Near things are seen wrongly by 2^-24 times as much, in radians. */
#define MOST_RATIO 64

static double distance(const double a[3], const double b[3]) {
    double d[3] = {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
    return sqrt(brume_dot(d, d));
}

/* From the camera to the nearest vertex; spheres and disks to within their size. */
static double nearest_of_shape(const brume_scene_shape *shape, const double camera[3]) {
    const brume_shape_desc *desc = &shape->desc;
    double nearest = INFINITY, p[3], x[3];
    if (desc->kind == BRUME_SHAPE_SPHERE || desc->kind == BRUME_SHAPE_DISK) {
        int ball = desc->kind == BRUME_SHAPE_SPHERE;
        brume_affine_point(desc->to_world, desc->center, p);
        if (!ball)
            brume_affine_column(desc->to_world, 3, p);
        brume_affine_column(desc->to_world, 0, x);
        return fabs(distance(p, camera) - (ball ? desc->radius : 1) * sqrt(brume_dot(x, x)));
    }
    for (uint32_t i = 0; i < desc->vertex_count; i++) {
        brume_affine_point(desc->to_world, shape->positions + 3 * (size_t)i, p);
        nearest = fmin(nearest, distance(p, camera));
    }
    return nearest;
}

void brume_arrays_choose_origin(const brume_scene *scene, brume_arrays *arrays) {
    double camera[3], light[3], nearest = INFINITY, out = 0;
    brume_affine_column(scene->sensor.to_world, 3, camera);
    for (uint32_t i = 0; i < scene->shape_count; i++)
        nearest = fmin(nearest, nearest_of_shape(&scene->shapes[i], camera));
    for (uint32_t i = 0; i < scene->light_count; i++)
        if (scene->lights[i].desc.kind == BRUME_LIGHT_POINT || scene->lights[i].desc.kind == BRUME_LIGHT_SPOT) {
            brume_affine_column(scene->lights[i].desc.to_world, 3, light);
            nearest = fmin(nearest, distance(light, camera));
        }
    for (int k = 0; k < 3; k++)
        out = fmax(out, fabs(camera[k]));
    for (int k = 0; k < 3; k++)
        arrays->origin[k] = out > MOST_RATIO * nearest ? camera[k] : 0;
}

void brume_arrays_place(const brume_arrays *arrays, double p[3]) {
    for (int k = 0; k < 3; k++)
        p[k] -= arrays->origin[k];
}

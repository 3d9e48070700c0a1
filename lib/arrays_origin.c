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

static void subtract(const double a[3], const double b[3], double out[3]) {
    for (int k = 0; k < 3; k++)
        out[k] = a[k] - b[k];
}

static double distance(const double a[3], const double b[3]) {
    double d[3];
    subtract(a, b, d);
    return sqrt(brume_dot(d, d));
}

/* From p to the box about three points. */
static double distance_to_box(const double p[3], const double v[3][3]) {
    double square = 0;
    for (int k = 0; k < 3; k++) {
        double low = fmin(fmin(v[0][k], v[1][k]), v[2][k]), high = fmax(fmax(v[0][k], v[1][k]), v[2][k]);
        double d = fmax(fmax(low - p[k], p[k] - high), 0);
        square += d * d;
    }
    return sqrt(square);
}

static double distance_to_segment(const double p[3], const double a[3], const double b[3]) {
    double along[3], to[3], nearest[3];
    subtract(b, a, along);
    subtract(p, a, to);
    double square = brume_dot(along, along), t = square > 0 ? brume_dot(to, along) / square : 0;
    t = fmin(fmax(t, 0), 1);
    for (int k = 0; k < 3; k++)
        nearest[k] = a[k] + t * along[k];
    return distance(p, nearest);
}

/* To its plane, if p lies over it; else to its nearest side. */
static double distance_to_triangle(const double p[3], const double v[3][3]) {
    double e[2][3], n[3], to[3], nearest = INFINITY;
    int inside = 1;
    subtract(v[1], v[0], e[0]);
    subtract(v[2], v[0], e[1]);
    brume_cross(e[0], e[1], n);
    if (brume_normalize(n) == 0) inside = 0;
    for (int k = 0; k < 3; k++) {
        const double *a = v[k], *b = v[(k + 1) % 3];
        double side[3], across[3];
        subtract(b, a, side);
        subtract(p, a, to);
        brume_cross(side, to, across);
        inside &= brume_dot(across, n) >= 0;
        nearest = fmin(nearest, distance_to_segment(p, a, b));
    }
    return inside ? fabs(brume_dot(to, n)) : nearest;
}

/* To its plane, if p lies over it; else to its rim where p points to, which is its nearest point if it is round. */
static double distance_to_disk(const double p[3], const float to_world[16]) {
    double o[3], x[3], y[3], n[3], to[3], x_dual[3], y_dual[3];
    brume_affine_column(to_world, 0, x);
    brume_affine_column(to_world, 1, y);
    brume_affine_column(to_world, 3, o);
    brume_cross(x, y, n);
    double area = brume_dot(n, n);
    subtract(p, o, to);
    if (!(area > 0)) return sqrt(brume_dot(to, to));
    brume_cross(y, n, x_dual);
    brume_cross(n, x, y_dual);
    double u = brume_dot(to, x_dual) / area, v = brume_dot(to, y_dual) / area, r = sqrt(u * u + v * v);
    if (r <= 1) return fabs(brume_dot(to, n)) / sqrt(area);
    for (int k = 0; k < 3; k++)
        o[k] += (u * x[k] + v * y[k]) / r;
    return distance(p, o);
}

/* Whether something of the shape is nearer to the camera than `limit`. */
static int is_near(const brume_scene_shape *shape, const double camera[3], double limit) {
    const brume_shape_desc *desc = &shape->desc;
    if (desc->kind == BRUME_SHAPE_DISK) return distance_to_disk(camera, desc->to_world) < limit;
    if (desc->kind == BRUME_SHAPE_SPHERE) {
        double center[3], x[3];
        brume_affine_point(desc->to_world, desc->center, center);
        brume_affine_column(desc->to_world, 0, x);
        return fabs(distance(center, camera) - desc->radius * sqrt(brume_dot(x, x))) < limit;
    }
    for (size_t i = 0; i < desc->triangle_count; i++) {
        double v[3][3];
        for (int k = 0; k < 3; k++)
            brume_affine_point(desc->to_world, shape->positions + 3 * (size_t)shape->triangles[3 * i + k], v[k]);
        if (distance_to_box(camera, (const double (*)[3])v) < limit &&
            distance_to_triangle(camera, (const double (*)[3])v) < limit)
            return 1;
    }
    return 0;
}

void brume_arrays_choose_origin(const brume_scene *scene, brume_arrays *arrays) {
    double camera[3], light[3], limit = 0;
    int far_out = 0;
    brume_affine_column(scene->sensor.to_world, 3, camera);
    for (int k = 0; k < 3; k++)
        limit = fmax(limit, fabs(camera[k]) / MOST_RATIO);
    for (uint32_t i = 0; i < scene->light_count && !far_out; i++)
        if (scene->lights[i].desc.kind == BRUME_LIGHT_POINT || scene->lights[i].desc.kind == BRUME_LIGHT_SPOT) {
            brume_affine_column(scene->lights[i].desc.to_world, 3, light);
            far_out = distance(light, camera) < limit;
        }
    for (uint32_t i = 0; i < scene->shape_count && !far_out && limit > 0; i++)
        far_out = is_near(&scene->shapes[i], camera, limit);
    for (int k = 0; k < 3; k++)
        arrays->origin[k] = far_out ? camera[k] : 0;
}

void brume_arrays_place(const brume_arrays *arrays, double p[3]) {
    for (int k = 0; k < 3; k++)
        p[k] -= arrays->origin[k];
}

/* effects_beams.c -- whether anything stands in the light of a lamp: spheres about shapes against cones. */
#include "effects.h"

#include <math.h>

#include "affine.h"

typedef struct sphere { double center[3], radius; } sphere;

static double distance_of(const double a[3], const double b[3]) {
    double d[3] = {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
    return sqrt(brume_dot(d, d));
}

/* About the corners of the box around the shape in its own space. */
static sphere sphere_of(const brume_scene_shape *shape) {
    const brume_shape_desc *d = &shape->desc;
    float lo[3], hi[3];
    for (int i = 0; i < 3; i++) {
        int is_ball = d->kind == BRUME_SHAPE_SPHERE;
        lo[i] = is_ball ? d->center[i] - d->radius : i < 2 ? -1 : 0; /* a disk lies in the plane z = 0 */
        hi[i] = is_ball ? d->center[i] + d->radius : i < 2 ? 1 : 0;
    }
    for (uint32_t v = 0; d->kind == BRUME_SHAPE_MESH && v < d->vertex_count; v++)
        for (int i = 0; i < 3; i++) {
            float x = shape->positions[3 * (size_t)v + (size_t)i];
            lo[i] = v && lo[i] < x ? lo[i] : x;
            hi[i] = v && hi[i] > x ? hi[i] : x;
        }
    sphere s = {{0, 0, 0}, 0};
    double corners[8][3];
    for (int k = 0; k < 8; k++) {
        float p[3] = {k & 1 ? hi[0] : lo[0], k & 2 ? hi[1] : lo[1], k & 4 ? hi[2] : lo[2]};
        brume_affine_point(d->to_world, p, corners[k]);
        for (int i = 0; i < 3; i++)
            s.center[i] += corners[k][i] / 8;
    }
    for (int k = 0; k < 8; k++)
        s.radius = fmax(s.radius, distance_of(corners[k], s.center));
    s.radius *= 1 + 1e-6; /* shapes reach the device in float */
    return s;
}

static int shines_on(const brume_light_desc *light, const sphere *s) {
    if (light->kind == BRUME_LIGHT_CONSTANT || light->kind == BRUME_LIGHT_ENVMAP) return 0;
    if (light->kind != BRUME_LIGHT_SPOT) return 1;
    double apex[3], axis[3], to[3];
    brume_affine_column(light->to_world, 3, apex);
    brume_affine_column(light->to_world, 2, axis);
    brume_normalize(axis);
    for (int i = 0; i < 3; i++)
        to[i] = s->center[i] - apex[i];
    double distance = brume_normalize(to);
    if (distance <= s->radius) return 1;
    double angle = acos(fmax(-1, fmin(1, brume_dot(axis, to)))) - asin(s->radius / distance);
    return angle <= light->cutoff_angle * (3.14159265358979323846 / 180) + 1e-6;
}

uint32_t brume_beams_meet(const brume_scene *scene, uint32_t *out_shape, uint32_t *out_lamp) {
    uint32_t count = 0;
    for (uint32_t i = 0; i < scene->shape_count && scene->light_count; i++) {
        const brume_shape_desc *d = &scene->shapes[i].desc;
        if (d->bsdf != BRUME_NONE && scene->bsdfs[d->bsdf].kind == BRUME_BSDF_NULL) continue;
        sphere s = sphere_of(&scene->shapes[i]);
        for (uint32_t k = 0; k < scene->light_count; k++) {
            if (!shines_on(&scene->lights[k].desc, &s)) continue;
            if (count++ == 0) {
                *out_shape = i;
                *out_lamp = k;
            }
            break;
        }
    }
    return count;
}

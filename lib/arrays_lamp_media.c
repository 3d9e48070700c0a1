/* arrays_lamp_media.c -- the medium that each lamp stands in: behind or before the nearest boundary between it and the
 * camera, whose medium the scene tells.
 *
 * A walk through the hierarchy of surfaces in double. What lies on an edge counts for both triangles, which say the
 * same; only a miss would be wrong.
 */
#include "arrays_build.h"

#include <math.h>

#include "affine.h"

/* Of a triangle's size: what is still on it. */
#define MARGIN 1e-9

typedef struct segment {
    double o[3], d[3]; /* from the lamp to the camera, at 1 */
    double nearest;    /* boundary so far */
    int medium;        /* on the lamp's side of it */
} segment;

static void take(const brume_arrays *arrays, int shape, double t, double into, segment *s) {
    const b_shape *boundary = &arrays->shapes[shape];
    if (!(t >= 0 && t < s->nearest)) return;
    if (boundary->flags & SHAPE_FLIP_NORMALS) into = -into;
    s->nearest = t;
    s->medium = into < 0 ? boundary->exterior : boundary->interior;
}

static void cross_triangle(const brume_arrays *arrays, int prim, segment *s) {
    const b_triangle *triangle = &arrays->triangles[prim];
    double v[3][3], e1[3], e2[3], h[3], q[3], n[3], w[3];
    if (!(arrays->shapes[triangle->shape].flags & SHAPE_BOUNDARY)) return;
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < 3; i++) v[k][i] = arrays->positions[3 * (size_t)triangle->v[k] + (size_t)i];
    for (int i = 0; i < 3; i++) {
        e1[i] = v[1][i] - v[0][i];
        e2[i] = v[2][i] - v[0][i];
        w[i] = s->o[i] - v[0][i];
    }
    brume_cross(s->d, e2, h);
    double det = brume_dot(e1, h);
    if (det == 0) return;
    double x = brume_dot(w, h) / det;
    brume_cross(w, e1, q);
    double y = brume_dot(s->d, q) / det;
    if (!(x >= -MARGIN && y >= -MARGIN && x + y <= 1 + MARGIN)) return;
    brume_cross(e1, e2, n);
    take(arrays, triangle->shape, brume_dot(e2, q) / det, brume_dot(n, s->d), s);
}

static void cross_sphere(const brume_arrays *arrays, const b_quadric *sphere, segment *s) {
    double w[3], a = brume_dot(s->d, s->d), radius = sphere->radius;
    for (int i = 0; i < 3; i++) w[i] = s->o[i] - sphere->center[i];
    double b = brume_dot(w, s->d), c = brume_dot(w, w) - radius * radius, discriminant = b * b - a * c;
    if (!(discriminant >= 0) || a == 0) return;
    double root = sqrt(discriminant);
    take(arrays, sphere->shape, (-b - root) / a, -1, s);
    take(arrays, sphere->shape, (-b + root) / a, 1, s);
}

static void cross_disk(const brume_arrays *arrays, const b_quadric *disk, segment *s) {
    double du[3], dv[3], n[3], p[3], w[3];
    for (int i = 0; i < 3; i++) {
        du[i] = disk->du[i];
        dv[i] = disk->dv[i];
        n[i] = disk->n[i];
        w[i] = disk->center[i] - s->o[i];
    }
    double into = brume_dot(n, s->d);
    if (into == 0) return;
    double t = brume_dot(n, w) / into;
    for (int i = 0; i < 3; i++) p[i] = t * s->d[i] - w[i];
    double xx = brume_dot(du, du), xy = brume_dot(du, dv), yy = brume_dot(dv, dv), det = xx * yy - xy * xy;
    double x = (brume_dot(p, du) * yy - brume_dot(p, dv) * xy) / det;
    double y = (brume_dot(p, dv) * xx - brume_dot(p, du) * xy) / det;
    if (x * x + y * y <= 1 + MARGIN) take(arrays, disk->shape, t, into, s);
}

static void cross_quadric(const brume_arrays *arrays, int32_t id, segment *s) {
    const b_quadric *quadric = &arrays->quadrics[id];
    if (!(arrays->shapes[quadric->shape].flags & SHAPE_BOUNDARY)) return;
    (quadric->kind == QUADRIC_SPHERE ? cross_sphere : cross_disk)(arrays, quadric, s);
}

static void cross_leaf(const brume_arrays *arrays, int code, segment *s) {
    const brume_bvh *bvh = &arrays->bvh;
    for (int block = code >> 4; block <= (code >> 4) + (code & 7); block++)
        for (int k = 0; k < 8; k++) {
            int prim = code & 8 ? bvh->quadric_ids[8 * block + k] : bvh->blocks[block].prim[k];
            if (prim >= 0) (code & 8 ? cross_quadric : cross_triangle)(arrays, prim, s);
        }
}

/* Boxes are taken a little larger than they are. */
static int meets_box(const b_node *node, int child, const segment *s) {
    const float lo[3] = {node->lo_x[child], node->lo_y[child], node->lo_z[child]};
    const float hi[3] = {node->hi_x[child], node->hi_y[child], node->hi_z[child]};
    double t0 = 0, t1 = s->nearest < 1 ? s->nearest : 1;
    for (int i = 0; i < 3; i++) {
        double margin = 1e-6 * ((double)hi[i] - lo[i] + fabs(lo[i]) + fabs(hi[i]));
        double a = (lo[i] - margin - s->o[i]) / s->d[i], b = (hi[i] + margin - s->o[i]) / s->d[i];
        if (s->d[i] == 0) {
            if (s->o[i] < lo[i] - margin || s->o[i] > hi[i] + margin) return 0;
            continue;
        }
        t0 = fmax(t0, fmin(a, b));
        t1 = fmin(t1, fmax(a, b));
    }
    return t0 <= t1;
}

static void cross_node(const brume_arrays *arrays, int number, segment *s) {
    const b_node *node = &arrays->bvh.nodes[number];
    for (int k = 0; k < 8 && node->lo_x[k] <= node->hi_x[k]; k++) {
        if (!meets_box(node, k, s)) continue;
        if (node->child[k] >= 0)
            cross_node(arrays, node->child[k], s);
        else
            cross_leaf(arrays, ~node->child[k], s);
    }
}

void brume_arrays_lamp_media(brume_arrays *arrays) {
    const b_params *p = &arrays->params;
    for (uint32_t k = 0; k < arrays->light_count; k++) {
        b_light *light = &arrays->lights[k];
        segment s = {.nearest = 1, .medium = p->sensor_medium};
        for (int i = 0; i < 3; i++) {
            s.o[i] = light->position[i];
            s.d[i] = p->camera_o[i] - s.o[i];
        }
        cross_node(arrays, 0, &s);
        light->medium = s.medium;
    }
}

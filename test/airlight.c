/* airlight.c -- see airlight.h. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "airlight.h"
#include "known_answer.h"

/* ---- the scene --------------------------------------------------------------------------------------------------- */

static view frame_of(const air_lamp *lamp) {
    view v = {{lamp->position[0], lamp->position[1], lamp->position[2]}, {0, 0, 1}, {0, 1, 0}, 0};
    if (lamp->kind != BRUME_LIGHT_POINT)
        for (int i = 0; i < 3; i++)
            v.forward[i] = lamp->toward[i];
    if (v.forward[1] != 0) {
        v.up[1] = 0;
        v.up[2] = 1;
    }
    return v;
}

static uint32_t add_gobo(brume_scene *scene, const air_gobo *gobo) {
    brume_texture_desc desc = brume_texture_desc_default();
    uint32_t id;
    desc.width = desc.height = (uint32_t)gobo->size;
    desc.texels = gobo->texels;
    desc.filter = gobo->nearest ? BRUME_FILTER_NEAREST : BRUME_FILTER_BILINEAR;
    must(brume_scene_add_texture(scene, &desc, &id));
    return id;
}

static void add_lamp(brume_scene *scene, const air_lamp *lamp, const air_gobo *gobo) {
    brume_light_desc desc = brume_light_desc_default(lamp->kind);
    view v = frame_of(lamp);
    view_matrix(&v, desc.to_world);
    set_all(desc.intensity, lamp->intensity);
    if (lamp->kind == BRUME_LIGHT_SPOT) {
        desc.cutoff_angle = lamp->cutoff;
        desc.beam_width = lamp->beam;
        if (gobo)
            desc.texture = add_gobo(scene, gobo);
    }
    must(brume_scene_add_light(scene, &desc, NULL));
}

static void add_ball(brume_scene *scene, const air_ball *ball, uint32_t black) {
    brume_shape_desc desc = brume_shape_desc_default(ball->disk ? BRUME_SHAPE_DISK : BRUME_SHAPE_SPHERE);
    const float r = ball->radius, *c = ball->center;
    const float across_y[16] = {r, 0, 0, c[0], 0, 0, r, c[1], 0, r, 0, c[2], 0, 0, 0, 1};
    desc.bsdf = black;
    if (ball->disk) {
        memcpy(desc.to_world, across_y, sizeof across_y);
    } else {
        memcpy(desc.center, c, sizeof desc.center);
        desc.radius = r;
    }
    must(brume_scene_add_shape(scene, &desc, NULL));
}

static void add_triangles(brume_scene *scene, const airlight *a, uint32_t black) {
    brume_shape_desc desc = brume_shape_desc_default(BRUME_SHAPE_MESH);
    uint32_t *numbers = malloc(3 * (size_t)a->triangle_count * sizeof *numbers);
    assert_non_null(numbers);
    for (int i = 0; i < 3 * a->triangle_count; i++)
        numbers[i] = (uint32_t)i;
    desc.positions = a->triangles;
    desc.vertex_count = 3 * (uint32_t)a->triangle_count;
    desc.triangles = numbers;
    desc.triangle_count = (uint32_t)a->triangle_count;
    desc.bsdf = black;
    must(brume_scene_add_shape(scene, &desc, NULL));
    free(numbers);
}

static void add_box(brume_scene *scene, const float box[6], uint32_t medium) {
    brume_shape_desc desc = brume_shape_desc_default(BRUME_SHAPE_CUBE);
    brume_bsdf_desc null = brume_bsdf_desc_default(BRUME_BSDF_NULL);
    must(brume_scene_add_bsdf(scene, &null, &desc.bsdf));
    scale_and_move(desc.to_world, (box[3] - box[0]) / 2, (box[4] - box[1]) / 2, (box[5] - box[2]) / 2,
                   (box[3] + box[0]) / 2, (box[4] + box[1]) / 2, (box[5] + box[2]) / 2);
    desc.interior = medium;
    desc.is_boundary = 1;
    must(brume_scene_add_shape(scene, &desc, NULL));
}

static int in_box(const airlight *a, const double p[3]) {
    int in = 1;
    for (int i = 0; i < 3; i++)
        in &= p[i] > a->box[i] && p[i] < a->box[3 + i];
    return in;
}

brume_scene *airlight_scene(const airlight *a, uint32_t samples) {
    brume_scene *scene = new_scene(2, samples);
    const view ray = {{a->eye[0], a->eye[1], a->eye[2]}, {1, 0, 0}, {0, 1, 0}, NARROW};
    uint32_t medium = add_medium(scene, 1, a->albedo, a->g, 0), black = add_diffuse(scene, 0);
    brume_medium_desc fog = brume_medium_desc_default();
    memcpy(fog.sigma_t, a->sigma_t, sizeof fog.sigma_t);
    set_all(fog.albedo, a->albedo);
    fog.g = a->g;
    must(brume_scene_add_medium(scene, &fog, &medium));
    set_camera(scene, &ray, a->bounded && !in_box(a, ray.origin) ? BRUME_NONE : medium);
    for (int k = 0; k < AIR_LAMPS && a->lamps[k].intensity > 0; k++)
        add_lamp(scene, &a->lamps[k], a->gobo);
    for (int k = 0; k < AIR_BALLS && a->balls[k].radius > 0; k++)
        add_ball(scene, &a->balls[k], black);
    if (a->triangle_count > 0)
        add_triangles(scene, a, black);
    if (a->bounded)
        add_box(scene, a->box, medium);
    if (a->length > 0) {
        brume_shape_desc wall = brume_shape_desc_default(BRUME_SHAPE_CUBE);
        const double half = 0.0625 * a->length;
        scale_and_move(wall.to_world, half, half, half, a->eye[0] + a->length + half, a->eye[1], a->eye[2]);
        wall.bsdf = black;
        must(brume_scene_add_shape(scene, &wall, NULL));
    }
    return scene;
}

/* ---- the number -------------------------------------------------------------------------------------------------- */

static double dot(const double a[3], const double b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

static void cross(const double a[3], const double b[3], double out[3]) {
    for (int i = 0; i < 3; i++) {
        int j = (i + 1) % 3, k = (i + 2) % 3;
        out[i] = a[j] * b[k] - a[k] * b[j];
    }
}

/* Whether the open segment p + s d, 0 < s < 1, meets it. */
static int meets_triangle(const float *v, const double p[3], const double d[3]) {
    double e[3], f[3], s[3], q[3], r[3];
    for (int i = 0; i < 3; i++) {
        e[i] = (double)v[3 + i] - v[i];
        f[i] = (double)v[6 + i] - v[i];
        s[i] = p[i] - v[i];
    }
    cross(d, f, q);
    cross(s, e, r);
    double det = dot(e, q), u = dot(s, q) / det, w = dot(d, r) / det, t = dot(f, r) / det;
    return det != 0 && u >= 0 && w >= 0 && u + w <= 1 && t > 0 && t < 1;
}

static int meets_ball(const air_ball *ball, const double p[3], const double d[3]) {
    double w[3], r = ball->radius;
    for (int i = 0; i < 3; i++)
        w[i] = p[i] - ball->center[i];
    if (ball->disk) {
        double s = -w[1] / d[1], x = w[0] + s * d[0], z = w[2] + s * d[2];
        return d[1] != 0 && s > 0 && s < 1 && x * x + z * z < r * r;
    }
    double dd = dot(d, d), wd = dot(w, d), discriminant = wd * wd - dd * (dot(w, w) - r * r);
    if (discriminant <= 0)
        return 0;
    double root = sqrt(discriminant), s0 = (-wd - root) / dd, s1 = (-wd + root) / dd;
    return (s0 > 0 && s0 < 1) || (s1 > 0 && s1 < 1);
}

/* How much of p + s d, 0 <= s <= 1, is in the fog. */
static double length_in_fog(const airlight *a, const double p[3], const double d[3]) {
    double s0 = 0, s1 = 1, length = sqrt(dot(d, d));
    for (int i = 0; a->bounded && i < 3; i++) {
        double x = (a->box[i] - p[i]) / d[i], y = (a->box[3 + i] - p[i]) / d[i];
        if (d[i] == 0) {
            if (p[i] <= a->box[i] || p[i] >= a->box[3 + i])
                return 0;
            continue;
        }
        s0 = fmax(s0, fmin(x, y));
        s1 = fmin(s1, fmax(x, y));
    }
    return s1 > s0 ? (s1 - s0) * length : 0;
}

#define FAR 1e6 /* directional light comes from here */

/* From the point on the ray at t to the lamp. */
static void to_lamp(const airlight *a, const air_lamp *lamp, double t, double p[3], double d[3]) {
    for (int i = 0; i < 3; i++) {
        p[i] = a->eye[i] + (i == 0 ? t : 0);
        d[i] = lamp->kind == BRUME_LIGHT_DIRECTIONAL ? -FAR * lamp->toward[i] : lamp->position[i] - p[i];
    }
}

static double off_axis(const air_lamp *lamp, const double d[3]) {
    double axis[3] = {lamp->toward[0], lamp->toward[1], lamp->toward[2]}, across[3];
    cross(axis, d, across);
    return atan2(sqrt(dot(across, across)), -dot(axis, d));
}

/* What comes through in a channel towards the point that lies -d from the lamp; in i, j: the cell between middles of
 * texels, or the texel. */
static double through_gobo(const airlight *a, const air_lamp *lamp, const double d[3], int channel, int *i, int *j) {
    const air_gobo *gobo = a->gobo;
    view v = frame_of(lamp);
    double x[3], y[3], n = gobo->size, shift = gobo->nearest ? 0 : 0.5;
    cross(v.up, v.forward, x);
    cross(v.forward, x, y);
    double scale = 0.5 / (dot(d, v.forward) * tan(lamp->cutoff * (PI / 180)));
    double px = n * (0.5 + scale * dot(d, x)) - shift, py = n * (0.5 + scale * dot(d, y)) - shift, sum = 0;
    *i = (int)floor(px);
    *j = (int)floor(py);
    for (int k = 0; k < (gobo->nearest ? 1 : 4); k++) {
        int column = (*i + k % 2 + gobo->size) % gobo->size, row = (*j + k / 2 + gobo->size) % gobo->size;
        double wx = k % 2 ? px - *i : 1 - px + *i, wy = k / 2 ? py - *j : 1 - py + *j;
        sum += (gobo->nearest ? 1 : wx * wy) * gobo->texels[3 * (gobo->size * row + column) + channel];
    }
    return sum;
}

/* Which of the functions that the integrand is made of holds at t; 0 where it is black. */
static int state_at(const airlight *a, const air_lamp *lamp, double t) {
    double p[3], d[3];
    int state = 1;
    to_lamp(a, lamp, t, p, d);
    if (a->bounded && !in_box(a, p))
        return 0;
    if (lamp->kind == BRUME_LIGHT_SPOT) {
        double angle = off_axis(lamp, d);
        if (angle >= lamp->cutoff * (PI / 180))
            return 0;
        state += angle > lamp->beam * (PI / 180);
        if (a->gobo) {
            int i, j;
            through_gobo(a, lamp, d, 0, &i, &j);
            state += 2 * (i + 1 + (a->gobo->size + 1) * (j + 1));
        }
    }
    for (int k = 0; k < AIR_BALLS && a->balls[k].radius > 0; k++)
        if (meets_ball(&a->balls[k], p, d))
            return 0;
    for (int k = 0; k < a->triangle_count; k++)
        if (meets_triangle(a->triangles + 9 * (size_t)k, p, d))
            return 0;
    return state;
}

typedef struct integrand {
    const airlight *a;
    const air_lamp *lamp;
    int channel;
    int by_angle; /* the variable is the angle, t = closest + D tan x; else t */
    double closest, D;
} integrand;

static double t_of(const integrand *f, double x) { return f->by_angle ? f->closest + f->D * tan(x) : x; }

/* Without visibility. */
static double value_at(const integrand *f, double x) {
    const airlight *a = f->a;
    const air_lamp *lamp = f->lamp;
    const double back[3] = {-1, 0, 0}, sigma = a->sigma_t[f->channel], g = a->g, t = t_of(f, x);
    double p[3], d[3], along[3] = {t, 0, 0}, eye[3] = {a->eye[0], a->eye[1], a->eye[2]};
    to_lamp(a, lamp, t, p, d);
    double r2 = dot(d, d), way = length_in_fog(a, eye, along) + length_in_fog(a, p, d);
    double cosine = -dot(d, back) / sqrt(r2), v = 1 + g * g - 2 * g * cosine;
    double value = lamp->intensity * sigma * a->albedo * exp(-sigma * way) * (1 - g * g) / (4 * PI * v * sqrt(v));
    if (lamp->kind != BRUME_LIGHT_DIRECTIONAL)
        value /= r2;
    if (lamp->kind == BRUME_LIGHT_SPOT) {
        double angle = off_axis(lamp, d) * (180 / PI);
        value *= angle <= lamp->beam ? 1 : fmax(lamp->cutoff - angle, 0) / (lamp->cutoff - lamp->beam);
        int i, j;
        if (a->gobo)
            value *= through_gobo(a, lamp, d, f->channel, &i, &j);
    }
    return f->by_angle ? value * f->D / (cos(x) * cos(x)) : value;
}

static double gauss(const integrand *f, double a, double b) {
    static const double nodes[4] = {0.1834346424956498, 0.5255324099163290, 0.7966664774136267, 0.9602898564975363};
    static const double weights[4] = {0.3626837833783620, 0.3137066458778873, 0.2223810344533745, 0.1012285362903763};
    double sum = 0, half = (b - a) / 2, middle = (a + b) / 2;
    for (int i = 0; i < 4; i++)
        sum += weights[i] * (value_at(f, middle - half * nodes[i]) + value_at(f, middle + half * nodes[i]));
    return sum * half;
}

static double refine(const integrand *f, double a, double b, double whole, double tolerance, int levels) {
    double middle = (a + b) / 2, left = gauss(f, a, middle), right = gauss(f, middle, b);
    if (levels == 0 || fabs(left + right - whole) <= tolerance)
        return left + right;
    return refine(f, a, middle, left, tolerance / 2, levels - 1) +
           refine(f, middle, b, right, tolerance / 2, levels - 1);
}

/* The scan's steps: no shadow or light narrower than one may be missed, so cases keep theirs wider. */
enum { STEPS = 8192 };

/* Cut where the state changes, found by bisection. */
static double integral(const integrand *f, double x0, double x1) {
    static double cuts[STEPS + 2], rough[STEPS + 2];
    static char lit[STEPS + 2];
    int count = 0, state = state_at(f->a, f->lamp, t_of(f, x0 + 0.5 * (x1 - x0) / STEPS));
    double sum = 0;
    cuts[0] = x0;
    lit[0] = state != 0;
    for (int i = 1; i < STEPS; i++) {
        double low = x0 + (x1 - x0) * (i - 0.5) / STEPS, high = x0 + (x1 - x0) * (i + 0.5) / STEPS;
        int next = state_at(f->a, f->lamp, t_of(f, high));
        if (next != state) {
            for (int k = 0; k < 60; k++) {
                double middle = (low + high) / 2;
                if (state_at(f->a, f->lamp, t_of(f, middle)) == state)
                    low = middle;
                else
                    high = middle;
            }
        } else if (i % (STEPS / 64) != 0) {
            continue;
        }
        cuts[++count] = next != state ? high : low;
        lit[count] = next != 0;
        state = next;
    }
    cuts[++count] = x1;
    for (int i = 0; i < count; i++)
        sum += rough[i] = lit[i] ? gauss(f, cuts[i], cuts[i + 1]) : 0;
    double tolerance = 1e-12 * sum;
    sum = 0;
    for (int i = 0; i < count; i++)
        sum += lit[i] ? refine(f, cuts[i], cuts[i + 1], rough[i], tolerance, 40) : 0;
    return sum;
}

double airlight_between(const airlight *a, int channel, double from, double to) {
    double sum = 0;
    for (int k = 0; k < AIR_LAMPS && a->lamps[k].intensity > 0; k++) {
        integrand f = {a, &a->lamps[k], channel, 0, 0, 0};
        f.closest = (double)f.lamp->position[0] - a->eye[0];
        f.D = hypot((double)f.lamp->position[1] - a->eye[1], (double)f.lamp->position[2] - a->eye[2]);
        f.by_angle = f.lamp->kind != BRUME_LIGHT_DIRECTIONAL && f.D > 0;
        sum += f.by_angle ? integral(&f, atan((from - f.closest) / f.D), atan((to - f.closest) / f.D))
                          : integral(&f, from, to);
    }
    return sum;
}

double airlight_expected(const airlight *a, int channel) {
    /* e^-150 of the light comes from beyond the end of an infinite ray */
    double end = a->length > 0 ? a->length : a->bounded ? a->box[3] - a->eye[0] : 150 / a->sigma_t[channel];
    return airlight_between(a, channel, 0, end);
}

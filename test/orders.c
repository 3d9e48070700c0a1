/* orders.c -- see orders.h. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>

#include <math.h>
#include <string.h>

#include "device_test.h"
#include "known_answer.h"
#include "orders.h"
#include "stats.h"

/* ---- the scene --------------------------------------------------------------------------------------------------- */

brume_scene *orders_scene(const orders *o, int max_depth) {
    brume_scene *scene = new_scene(max_depth, 1);
    view eye = {{o->eye[0], o->eye[1], o->eye[2]}, {o->toward[0], o->toward[1], o->toward[2]}, {0, 1, 0}, NARROW};
    view down = {{o->lamp[0], o->lamp[1], o->lamp[2]}, {0, 0, -1}, {0, 1, 0}, 0};
    set_camera(scene, &eye, add_medium(scene, o->sigma_t, o->albedo, o->g, 0));
    if (o->cutoff < 180)
        add_spot(scene, &down, 1, o->cutoff, o->beam);
    else
        add_point(scene, o->lamp[0], o->lamp[1], o->lamp[2]);
    if (o->reflectance > 0)
        add_wall(scene, 0, 1000, o->reflectance);
    return scene;
}

/* ---- what all numbers share -------------------------------------------------------------------------------------- */

typedef struct {
    double x, y, z;
} point;

static point make(const float p[3]) {
    point q = {p[0], p[1], p[2]};
    return q;
}

static point along(point p, double t, point d) {
    point q = {p.x + t * d.x, p.y + t * d.y, p.z + t * d.z};
    return q;
}

static double dot(point a, point b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

static point unit(point d) { return along((point){0, 0, 0}, 1 / sqrt(dot(d, d)), d); }

static point turned(point axis, double cosine, double phi) {
    double sine = sqrt(fmax(0, 1 - cosine * cosine));
    point other = {fabs(axis.x) < 0.6, fabs(axis.x) >= 0.6, 0}, a, b;
    a = unit(along(other, -dot(other, axis), axis));
    b.x = axis.y * a.z - axis.z * a.y;
    b.y = axis.z * a.x - axis.x * a.z;
    b.z = axis.x * a.y - axis.y * a.x;
    return unit(along(along(along((point){0, 0, 0}, cosine, axis), sine * cos(phi), a), sine * sin(phi), b));
}

static double phase(double cosine, double g) {
    double v = 1 + g * g - 2 * g * cosine;
    return (1 - g * g) / (4 * PI * v * sqrt(v));
}

static double falloff(const orders *o, double degrees) {
    if (o->cutoff >= 180 || degrees <= o->beam)
        return 1;
    return degrees < o->cutoff ? (o->cutoff - degrees) / (o->cutoff - o->beam) : 0;
}

/* As far as anything matters, or to the floor. */
static double reach(const orders *o, point p, point d) {
    double far = 60 / o->sigma_t;
    return o->reflectance > 0 && d.z < 0 ? fmin(far, -p.z / d.z) : far;
}

typedef struct {
    const orders *o;
    double sigma, sigma_s, g, rho;
    point lamp, eye, d, end;
    double length; /* to the floor, in `end`, or far away */
    int ends;
} ray;

static ray ray_of(const orders *o) {
    ray r = {o, o->sigma_t, (double)o->sigma_t * o->albedo, o->g, o->reflectance / PI, make(o->lamp), make(o->eye),
             unit(make(o->toward)), {0, 0, 0}, 0, 0};
    r.length = reach(o, r.eye, r.d);
    r.end = along(r.eye, r.length, r.d);
    r.ends = o->reflectance > 0 && fabs(r.end.z) < 1e-9;
    return r;
}

/* From y to x on the ray at t, over the squared distance; arrives from `before`, scattered at y by the medium or, with
 * `floor`, by that. Without what scatters at y: sigma_s. */
static double to_ray(const ray *r, point y, point before, int floor, double t) {
    point w = along(along(r->eye, t, r->d), -1, y);
    double d2 = dot(w, w), distance = sqrt(d2);
    double at_y = floor ? r->rho * fmax(w.z / distance, 0) : phase(dot(before, w) / distance, r->g);
    return at_y * r->sigma_s * phase(-dot(w, r->d) / distance, r->g) * exp(-r->sigma * (distance + t));
}

/* From y in the medium to the end of the ray and by the floor there to the eye; the same. */
static double to_end(const ray *r, point y, point before) {
    point w = along(r->end, -1, y);
    double distance = sqrt(dot(w, w));
    return phase(dot(before, w) / distance, r->g) * r->rho * fmax(-w.z / distance, 0) *
           exp(-r->sigma * (distance + r->length));
}

static double distance2(const ray *r, point y, double t) {
    point w = along(along(r->eye, t, r->d), -1, y);
    return dot(w, w);
}

/* ---- walks ------------------------------------------------------------------------------------------------------- */

/* The place on o + t d, 0 <= t <= length, evenly in the angle that c sees; *per_density with the squared distance from
 * c taken out. */
static double equiangular(point o, point d, double length, point c, double u, double *per_density) {
    double closest = dot(along(c, -1, o), d);
    point off = along(c, -1, along(o, closest, d));
    double D = sqrt(dot(off, off)), a = atan2(-closest, D), b = atan2(length - closest, D);
    *per_density = (b - a) / D;
    return closest + D * tan(a + u * (b - a));
}

static point scatter(const ray *r, point d, uint64_t *seed) {
    double u = test_random_unit(seed), g = r->g, cosine = 1 - 2 * u;
    if (g != 0) {
        double s = (1 - g * g) / (1 - g + 2 * g * u);
        cosine = (1 + g * g - s * s) / (2 * g);
    }
    return turned(d, cosine, 2 * PI * test_random_unit(seed));
}

/* Adds what one walk brings to each order. */
static void walk(const ray *r, uint64_t *seed, double *sum) {
    const point up = {0, 0, 1}, down = {0, 0, -1};
    double span = r->o->cutoff < 180 ? 1 - cos(r->o->cutoff * (PI / 180)) : 2;
    double cosine = 1 - span * test_random_unit(seed), per;
    double weight = 2 * PI * span * falloff(r->o, acos(cosine) * (180 / PI));
    point p = r->lamp, d = turned(down, cosine, 2 * PI * test_random_unit(seed));
    for (int k = 0; k < MOST_ORDERS; k++) {
        double length = reach(r->o, p, d), flight = -log(1 - test_random_unit(seed)) / r->sigma;
        if (r->ends) {
            double s = equiangular(p, d, length, r->end, test_random_unit(seed), &per);
            sum[k] += weight * r->sigma_s * exp(-r->sigma * s) * per * to_end(r, along(p, s, d), d);
        }
        int floor = r->o->reflectance > 0 && d.z < 0 && flight >= length;
        p = along(p, fmin(flight, length), d);
        double t = equiangular(r->eye, r->d, r->length, p, test_random_unit(seed), &per);
        sum[k] += weight * (floor ? 1 : r->o->albedo) * per * to_ray(r, p, d, floor, t);
        weight *= floor ? r->o->reflectance : r->o->albedo;
        p.z = floor ? 0 : p.z;
        d = floor ? turned(up, sqrt(test_random_unit(seed)), 2 * PI * test_random_unit(seed)) : scatter(r, d, seed);
    }
}

walk_sums orders_by_walks(const orders *o, int walks, uint64_t seed) {
    walk_sums result;
    ray r = ray_of(o);
    double sums[MOST_ORDERS] = {0}, squares[MOST_ORDERS] = {0};
    for (int i = 0; i < walks; i++) {
        double one[MOST_ORDERS] = {0};
        walk(&r, &seed, one);
        for (int k = 0; k < MOST_ORDERS; k++) {
            sums[k] += one[k];
            squares[k] += one[k] * one[k];
        }
    }
    for (int k = 0; k < MOST_ORDERS; k++) {
        result.mean[k] = sums[k] / walks;
        result.error[k] = sqrt((squares[k] / walks - result.mean[k] * result.mean[k]) / walks);
    }
    return result;
}

/* ---- the rule for order 2 ---------------------------------------------------------------------------------------- */

/* What one direction of the lamp's light gives. */
static double second_of(const ray *r, point d, int n) {
    double length = reach(r->o, r->lamp, d), sum = 0, ds, dt;
    for (int i = 0; i < 16 * n; i++) {
        double s = stats_gauss_node(i, 2 * n, length, &ds), inner = 0;
        point y = along(r->lamp, s, d), w = along(r->end, -1, y);
        for (int j = 0; j < 16 * n; j++) {
            double t = stats_gauss_node(j, 2 * n, r->length, &dt);
            inner += dt * to_ray(r, y, d, 0, t) / distance2(r, y, t);
        }
        sum += ds * r->sigma_s * exp(-r->sigma * s) * (inner + to_end(r, y, d) / dot(w, w));
    }
    point y = along(r->lamp, length, d);
    for (int j = 0; j < 16 * n; j++) {
        double t = stats_gauss_node(j, 2 * n, r->length, &dt);
        sum += dt * exp(-r->sigma * length) * to_ray(r, y, d, 1, t) / distance2(r, y, t);
    }
    return sum;
}

static double second_of_spot(const ray *r, int n) {
    const point down = {0, 0, -1};
    const orders *o = r->o;
    double sum = 0, to_radians = PI / 180, weight;
    for (int part = 0; part < 2; part++) {
        double from = part ? o->beam : 0, width = part ? o->cutoff - o->beam : o->beam;
        for (int i = 0; width > 0 && i < 8; i++) {
            double angle = from + stats_gauss_node(i, 1, width, &weight);
            for (int j = 0; j < 12 * n; j++)
                sum += second_of(r, turned(down, cos(angle * to_radians), 2 * PI * (j + 0.5) / (12 * n)), n) *
                       falloff(o, angle) * sin(angle * to_radians) * weight * to_radians * 2 * PI / (12 * n);
        }
    }
    return sum;
}

/* What a point light's ray through x turns to x, over the solid angle's sine: directions at the angle psi to the lamp
 * at distance R, by angles at the lamp. */
static double airlight_at(const ray *r, double R, double psi, int n) {
    double closest = R * cos(psi), D = R * sin(psi), a = psi - PI / 2, sum = 0, weight;
    for (int k = 0; k < 16 * n; k++) {
        double angle = a + stats_gauss_node(k, 2 * n, PI / 2 - a, &weight);
        double way = closest + D * (tan(angle) + 1 / cos(angle));
        sum += weight * exp(-r->sigma * way) * phase(-sin(angle), r->g);
    }
    return r->sigma_s * sum / R;
}

static double second_of_point(const ray *r, int n) {
    double closest = dot(along(r->lamp, -1, r->eye), r->d), D = sqrt(distance2(r, r->lamp, closest)), sum = 0;
    double a = atan2(-closest, D), b = atan2(r->length - closest, D), dt, dpsi;
    for (int i = 0; i < 16 * n; i++) {
        double angle = a + stats_gauss_node(i, 2 * n, b - a, &dt), t = closest + D * tan(angle), R = D / cos(angle);
        double scale = dt * R * R / D * r->sigma_s * exp(-r->sigma * t);
        for (int j = 0; j < 32 * n; j++) {
            double psi = stats_gauss_node(j, 4 * n, PI, &dpsi), turns = 0;
            for (int k = 0; k < 32 * n; k++) {
                double across = cos(2 * PI * (k + 0.5) / (32 * n));
                turns += phase(-sin(angle) * cos(psi) + cos(angle) * sin(psi) * across, r->g);
            }
            sum += scale * dpsi * airlight_at(r, R, psi, n) * turns * 2 * PI / (32 * n);
        }
    }
    return sum;
}

double orders_second(const orders *o, int n) {
    ray r = ray_of(o);
    return o->cutoff < 180 ? second_of_spot(&r, n) : second_of_point(&r, n);
}

/* ---- isotropic scattering ---------------------------------------------------------------------------------------- */

/* The exponential integral: Abramowitz & Stegun 5.1.11, 5.1.22. */
static double e1(double x) {
    if (x > 2) {
        double f = 0;
        for (int n = 60; n > 0; n--)
            f = n / (1 + n / (x + f));
        return exp(-x) / (x + f);
    }
    double sum = -0.57721566490153286 - log(x), term = -1;
    for (int n = 1; n < 40; n++) {
        term *= -x / n;
        sum += term / n;
    }
    return sum;
}

/* Node k of tanh-sinh quadrature over [a, b]; singular ends do no harm. *near: its distance from the end it is close
 * to, which is `low` or not. */
enum { DOUBLE_NODES = 49 };
static double tanh_sinh(int k, double a, double b, double *weight, double *near, int *low) {
    double x = (k - DOUBLE_NODES / 2) * (6.2 / (DOUBLE_NODES - 1)), s = PI / 2 * sinh(x), c = cosh(s);
    *weight = (b - a) / 2 * (6.2 / (DOUBLE_NODES - 1)) * (PI / 2) * cosh(x) / (c * c);
    *near = (b - a) * exp(-fabs(s)) / (2 * c);
    *low = s < 0;
    return *low ? a + *near : b - *near;
}

static double arriving(const ray *r, double R, int order) {
    if (order == 1)
        return exp(-r->sigma * R) / (R * R);
    double sum = 0, weight, near;
    int low;
    for (int part = 0; part < 2; part++)
        for (int k = 0; k < DOUBLE_NODES; k++) {
            double x = tanh_sinh(k, part ? R : 0, part ? R + 30 / r->sigma : R, &weight, &near, &low);
            double off = low == part ? near : fabs(R - x);
            double shells = e1(r->sigma * off) - e1(r->sigma * (R + x));
            sum += weight * x * arriving(r, x, order - 1) * shells;
        }
    return r->sigma_s / (2 * R) * sum;
}

double orders_isotropic(const orders *o, int order) {
    ray r = ray_of(o);
    double closest = dot(along(r.lamp, -1, r.eye), r.d), D = sqrt(distance2(&r, r.lamp, closest));
    double a = atan2(-closest, D), b = atan2(r.length - closest, D), sum = 0, weight;
    for (int k = 0; k < 32; k++) {
        double angle = a + stats_gauss_node(k, 4, b - a, &weight), t = closest + D * tan(angle), R = D / cos(angle);
        sum += weight * R * R / D * r.sigma_s * exp(-r.sigma * t) * arriving(&r, R, order) / (4 * PI);
    }
    return sum;
}

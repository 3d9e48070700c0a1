/* wedge_truth.c -- see wedge_truth.h. */
#include "wedge_truth.h"

#include <math.h>

static double dot(const double a[3], const double b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

static void cross(const double a[3], const double b[3], double c[3]) {
    for (int i = 0; i < 3; i++) c[i] = a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3];
}

static int meets_triangle(const test_mesh *m, uint32_t prim, const double p[3], const double d[3], double *t) {
    const float *v[3];
    double e[3], f[3], s[3], q[3], r[3];
    for (int k = 0; k < 3; k++) v[k] = m->positions + 3 * m->triangles[prim].v[k];
    for (int i = 0; i < 3; i++) {
        e[i] = (double)v[1][i] - v[0][i];
        f[i] = (double)v[2][i] - v[0][i];
        s[i] = p[i] - v[0][i];
    }
    cross(d, f, q);
    cross(s, e, r);
    double det = dot(e, q), u = dot(s, q) / det, w = dot(d, r) / det;
    *t = dot(f, r) / det;
    return det != 0 && u >= 0 && w >= 0 && u + w <= 1;
}

static int meets_quadric(const b_quadric *q, const double p[3], const double d[3], double low, double high) {
    double w[3], du[3], dv[3], n[3];
    for (int i = 0; i < 3; i++) w[i] = p[i] - q->center[i], du[i] = q->du[i], dv[i] = q->dv[i];
    if (q->kind == QUADRIC_SPHERE) {
        double dd = dot(d, d), wd = dot(w, d), r = q->radius, root = wd * wd - dd * (dot(w, w) - r * r);
        if (root < 0) return 0;
        double t0 = (-wd - sqrt(root)) / dd, t1 = (-wd + sqrt(root)) / dd;
        return (t0 > low && t0 < high) || (t1 > low && t1 < high);
    }
    cross(du, dv, n);
    double t = -dot(w, n) / dot(d, n);
    for (int i = 0; i < 3; i++) w[i] += t * d[i];
    double x = dot(w, du) / dot(du, du), y = dot(w, dv) / dot(dv, dv);
    return t > low && t < high && x * x + y * y <= 1;
}

/* The way from p to the lamp, short of it by a millionth and of p by nothing. */
static int is_hidden(const test_mesh *m, const double p[3], const double lamp[3]) {
    const double high = 1 - 1e-6;
    double d[3], t;
    for (int i = 0; i < 3; i++) d[i] = lamp[i] - p[i];
    for (uint32_t k = 0; k < m->triangle_count; k++)
        if (meets_triangle(m, k, p, d, &t) && t > 0 && t < high) return 1;
    for (uint32_t k = 0; k < m->quadric_count; k++)
        if (meets_quadric(&m->quadrics[k], p, d, 0, high)) return 1;
    return 0;
}

/* Offsets by which lamp and point are moved: towards the corners and sides of a cube, of three sizes. */
enum { MOVES = 3 * 14 };

static void move(double p[3], int k, double slack) {
    static const double sizes[3] = {1, 0.25, 0.0625};
    int way = k % 14;
    for (int a = 0; a < 3; a++) {
        int sign = way < 8 ? (way >> a & 1 ? 1 : -1) : a == (way - 8) % 3 ? (way < 11 ? 1 : -1) : 0;
        p[a] += sizes[k / 14] * slack * sign;
    }
}

static void place(int i, double t, double p[3], double lamp[3]) {
    for (int a = 0; a < 3; a++) {
        lamp[a] = (float)wedge_in[a][i];
        p[a] = (float)wedge_in[3 + a][i] + (t + wedge_out[DELTA][i]) * (float)wedge_in[6 + a][i];
    }
}

/* Whether moving lamp or point by the slack changes the answer. */
static int is_ambiguous(const test_mesh *m, int i, double t, double slack) {
    double p[3], lamp[3];
    slack *= fmax(1, fabs(t)); /* far out on an infinite ray the coordinates are larger */
    place(i, t, p, lamp);
    int hidden = is_hidden(m, p, lamp);
    for (int k = 0; k < 2 * MOVES; k++) {
        place(i, t, p, lamp);
        move(k < MOVES ? p : lamp, k % MOVES, slack);
        if (is_hidden(m, p, lamp) != hidden) return 1;
    }
    return 0;
}

/* The plane of lamp and ray in double: x axis, z axis, and how far the lamp is from the ray. */
typedef struct plane { double lamp[3], x[3], y[3], z[3], D; } plane;

static plane plane_of(int i, int moved, double slack) {
    plane p;
    double o[3], w[3], length = 0, closest = 0;
    for (int a = 0; a < 3; a++) {
        o[a] = (float)wedge_in[3 + a][i];
        p.lamp[a] = (float)wedge_in[a][i];
        p.y[a] = (float)wedge_in[6 + a][i];
        length += p.y[a] * p.y[a];
    }
    if (moved >= 0) move(moved < MOVES ? o : p.lamp, moved % MOVES, slack);
    for (int a = 0; a < 3; a++) {
        p.y[a] /= sqrt(length);
        w[a] = o[a] - p.lamp[a];
        closest += w[a] * p.y[a];
    }
    for (int a = 0; a < 3; a++) w[a] -= closest * p.y[a];
    p.D = sqrt(dot(w, w));
    for (int a = 0; a < 3; a++) p.x[a] = w[a] / p.D;
    cross(p.x, p.y, p.z);
    return p;
}

/* The range of the ray behind a triangle, as crossings of its edges with the plane; 0 if there is none. */
static int hidden_range(const test_mesh *m, uint32_t prim, const plane *p, double *low, double *high) {
    double x[3], y[3], z[3], ends[2][2];
    int count = 0;
    for (int k = 0; k < 3; k++) {
        double v[3];
        for (int a = 0; a < 3; a++) v[a] = m->positions[3 * m->triangles[prim].v[k] + a] - p->lamp[a];
        x[k] = dot(v, p->x), y[k] = dot(v, p->y), z[k] = dot(v, p->z);
    }
    for (int k = 0; k < 3; k++) {
        int j = (k + 1) % 3;
        if ((z[k] < 0) == (z[j] < 0)) continue;
        double s = z[k] / (z[k] - z[j]);
        ends[count][0] = x[k] + s * (x[j] - x[k]);
        ends[count++][1] = y[k] + s * (y[j] - y[k]);
    }
    if (count < 2) return 0;
    for (int e = 0; e < 2; e++) {
        const double limits[2] = {1e-6 * p->D, p->D};
        for (int side = 0; side < 2; side++) { /* cut to what lies between lamp and ray */
            double *a = ends[e], *b = ends[1 - e], out_by = side ? a[0] - limits[1] : limits[0] - a[0];
            if (out_by <= 0) continue;
            if (side ? b[0] >= limits[1] : b[0] <= limits[0]) return 0;
            double s = (limits[side] - a[0]) / (b[0] - a[0]);
            a[1] += s * (b[1] - a[1]);
            a[0] = limits[side];
        }
    }
    double t0 = p->D * ends[0][1] / ends[0][0], t1 = p->D * ends[1][1] / ends[1][0];
    *low = fmin(t0, t1);
    *high = fmax(t0, t1);
    return 1;
}

/* Whether a triangle's range reaches into the wedge, whatever the move. */
static int reaches_in(const test_mesh *m, int i, double slack) {
    for (int moved = -1; moved < 2 * MOVES; moved++) {
        plane p = plane_of(i, moved, slack);
        double low, high;
        for (uint32_t k = 0; k < m->triangle_count; k++)
            if (hidden_range(m, k, &p, &low, &high) && low < wedge_out[T1][i] + slack &&
                high > wedge_out[T0][i] - slack)
                return 1;
    }
    return 0;
}

/* A wedge is open if and only if nothing reaches into it, by more than rounding. Quadrics nearby may shut it. */
static void judge_open(const test_mesh *m, int i, double slack, wedge_tally *c) {
    plane p = plane_of(i, -1, 0);
    if (wedge_out[OPEN][i] == 0) {
        int certain = m->quadric_count == 0 && wedge_out[T1][i] - wedge_out[T0][i] > 4 * slack;
        if (certain && !reaches_in(m, i, 2 * slack)) c->wrongly_shut++;
        return;
    }
    c->open++;
    int wrong = 0;
    for (int j = 0; j < POSITIONS; j++)
        wrong |= ray_dark_at(i, j) && !is_ambiguous(m, i, wedge_positions[j][i], slack);
    for (uint32_t k = 0; k < m->triangle_count; k++) {
        double low, high;
        if (!hidden_range(m, k, &p, &low, &high)) continue;
        low = fmax(low, wedge_out[T0][i]), high = fmin(high, wedge_out[T1][i]);
        double middle = low + 0.5 * (high - low), q[3], lamp[3];
        place(i, middle, q, lamp);
        wrong |= high - low > slack && is_hidden(m, q, lamp) && !is_ambiguous(m, i, middle, slack);
    }
    c->wrongly_open += wrong;
}

wedge_tally wedge_judge(const test_mesh *m, double slack) {
    wedge_tally c = {0};
    for (int i = 0; i < WEDGES; i++) {
        if (!wedge_is_planar(i)) continue;
        for (int j = 0; j < POSITIONS; j++) {
            int wedge = wedge_dark_at(i, j), ray = ray_dark_at(i, j);
            c.positions++;
            c.dark += ray;
            c.extra += wedge && !ray;
            c.missed += ray && !wedge;
            c.unexcused += wedge != ray && !is_ambiguous(m, i, wedge_positions[j][i], slack);
        }
        judge_open(m, i, slack, &c);
    }
    return c;
}

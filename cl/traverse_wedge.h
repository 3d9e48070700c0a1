/* traverse_wedge.h -- which of many points of a ray a lamp sees: one walk of the hierarchy instead of a shadow ray
 * each.
 *
 * Lamp and ray span a plane. A triangle that cuts this plane does so in a line segment, and hides from the lamp those
 * points of the ray that lie behind it: a range of the ray, found by projecting the segment's two ends from the lamp
 * onto the ray. So each triangle is rasterised in one dimension: the positions within its range are dark. Neighbouring
 * triangles compute their common end from the same two vertices in the same order, to the same bits, and ranges are
 * half open: no position slips through between them.
 *
 * In coordinates about the lamp, x towards the ray's closest point at distance D, y along the ray, z across the plane,
 * a point in the plane at (x, y) hides the ray at t' = D y / x, if it is nearer to the lamp: 0 < x < D.
 *
 * Spheres and disks are tested position by position. If a walk takes longer than MAX_VISITS nodes, shadow rays decide
 * about the positions still open: how visibility is found changes nothing about what is found.
 */
#ifndef BRUME_TRAVERSE_WEDGE_H
#define BRUME_TRAVERSE_WEDGE_H

#include "traverse_single.h"

#define WEDGE_POSITIONS 64
#ifndef WEDGE_MAX_VISITS
#define WEDGE_MAX_VISITS 1024
#endif

/* As for shadow rays: occluders nearer to the lamp than this share of the way are the lamp's own. */
#define WEDGE_NEAR ((real1)1e-6f)

typedef struct {
    real1 lamp[3], x[3], y[3], z[3]; /* position and unit axes */
    real1 D;
    real1 t0, t1;                    /* the part of the ray that matters, t' */
    real1 slack;                     /* what rounding does to positions about here */
} wedge;

/* Positions in ascending order of t'; past `count` infinite. */
typedef struct {
    lanes_of_wide t[WEDGE_POSITIONS / 8];
    int count;
} wedge_positions;

typedef struct { real1 x, y, z; } along3;

FN along3 wedge_along(const wedge *w, real1 x, real1 y) {
    along3 v;
    v.x = fma(w->x[0], x, w->y[0] * y);
    v.y = fma(w->x[1], x, w->y[1] * y);
    v.z = fma(w->x[2], x, w->y[2] * y);
    return v;
}

FN wide wide_dot(wide x, wide y, wide z, real1 a, real1 b, real1 c) {
    return fma(x, (wide)a, fma(y, (wide)b, z * (wide)c));
}

/* The children whose boxes reach into the triangle of the lamp and the ray from t0 to t1. */
FN ulong wedge_node(__global const b_node *node, const wedge *w, along3 edge0, along3 edge1) {
    __global const float *rows = (__global const float *)node;
    wide lx = wide_load(rows), hx = wide_load(rows + 8), ly = wide_load(rows + 16), hy = wide_load(rows + 24);
    wide lz = wide_load(rows + 32), hz = wide_load(rows + 40);
    wide half_ = (wide)(real1)0.5f, more = (wide)(real1)(0.5 + 0x1p-18);
    wide cx = fma(half_, lx + hx, (wide)-w->lamp[0]), cy = fma(half_, ly + hy, (wide)-w->lamp[1]);
    wide cz = fma(half_, lz + hz, (wide)-w->lamp[2]);
    wide rx = (hx - lx) * more, ry = (hy - ly) * more, rz = (hz - lz) * more;
    wide slack = (wide)w->slack;
    wide z = wide_dot(cx, cy, cz, w->z[0], w->z[1], w->z[2]);
    wide z_reach = wide_dot(rx, ry, rz, fabs(w->z[0]), fabs(w->z[1]), fabs(w->z[2])) + slack;
    wide x = wide_dot(cx, cy, cz, w->x[0], w->x[1], w->x[2]);
    wide x_reach = wide_dot(rx, ry, rz, fabs(w->x[0]), fabs(w->x[1]), fabs(w->x[2])) + slack;
    wide a = wide_dot(cx, cy, cz, edge0.x, edge0.y, edge0.z);
    wide a_reach = wide_dot(rx, ry, rz, fabs(edge0.x), fabs(edge0.y), fabs(edge0.z)) + slack;
    wide b = wide_dot(cx, cy, cz, edge1.x, edge1.y, edge1.z);
    wide b_reach = wide_dot(rx, ry, rz, fabs(edge1.x), fabs(edge1.y), fabs(edge1.z)) + slack;
    wide_mask in = (fabs(z) <= z_reach) & (x + x_reach >= (wide)0) & (x - x_reach <= (wide)w->D) &
                   (a + a_reach >= (wide)0) & (b + b_reach >= (wide)0) & (lx <= hx);
    return wide_set(in);
}

/* From where a triangle's edge crosses the plane, if it does: from the vertex below to the one above. */
FN void wedge_edge(wide za, wide xa, wide ya, wide zb, wide xb, wide yb, wide *x, wide *y) {
    wide_mask a_below = za < (wide)0;
    wide z0 = a_below ? za : zb, x0 = a_below ? xa : xb, y0 = a_below ? ya : yb;
    wide z1 = a_below ? zb : za, x1 = a_below ? xb : xa, y1 = a_below ? yb : ya;
    wide s = z0 / (z0 - z1);
    *x = fma(s, x1 - x0, x0);
    *y = fma(s, y1 - y0, y0);
}

/* Of the eight triangles those that hide a part of the ray, and which: low <= t' < high. */
FN ulong wedge_block(__global const b_triangle_block *block, const wedge *w, lanes_of_wide *low, lanes_of_wide *high) {
    __global const float *v = (__global const float *)block;
    wide x[3], y[3], z[3];
    for (int k = 0; k < 3; k++, v += 24) {
        wide px = wide_load(v) - (wide)w->lamp[0], py = wide_load(v + 8) - (wide)w->lamp[1];
        wide pz = wide_load(v + 16) - (wide)w->lamp[2];
        x[k] = wide_dot(px, py, pz, w->x[0], w->x[1], w->x[2]);
        y[k] = wide_dot(px, py, pz, w->y[0], w->y[1], w->y[2]);
        z[k] = wide_dot(px, py, pz, w->z[0], w->z[1], w->z[2]);
    }
    wide_mask n0 = z[0] < (wide)0, n1 = z[1] < (wide)0, n2 = z[2] < (wide)0;
    /* padding is NaN: neither below nor above */
    wide_mask number = (z[0] == z[0]) & (z[1] == z[1]) & (z[2] == z[2]);
    wide_mask c01 = n0 != n1, c12 = n1 != n2;
    wide_mask cuts = number & (c01 | c12);
    wide near = (wide)(WEDGE_NEAR * w->D), far = (wide)w->D;
    cuts = cuts & ((x[0] > near) | (x[1] > near) | (x[2] > near)) & ((x[0] < far) | (x[1] < far) | (x[2] < far));
    if (wide_set(cuts) == 0) return 0;
    wide ax, ay, bx, by, ex, ey;
    wedge_edge(z[0], x[0], y[0], z[1], x[1], y[1], &ax, &ay);
    wedge_edge(z[1], x[1], y[1], z[2], x[2], y[2], &bx, &by);
    wedge_edge(z[2], x[2], y[2], z[0], x[0], y[0], &ex, &ey);
    /* Two of the three cross. */
    wide x0 = c01 ? ax : bx, y0 = c01 ? ay : by;
    wide_mask second = c01 & c12;
    wide x1 = second ? bx : ex, y1 = second ? by : ey;
    cuts = cuts & ((x0 > near) | (x1 > near)) & ((x0 < far) | (x1 < far));
    /* Cut to near ... far; the ends within stay as they are, to the bit. */
    wide slope = (y1 - y0) / (x1 - x0);
    wide x0c = wmin(wmax(x0, near), far), x1c = wmin(wmax(x1, near), far);
    wide y0c = x0c == x0 ? y0 : fma(x0c - x0, slope, y0), y1c = x1c == x1 ? y1 : fma(x1c - x0, slope, y0);
    wide t0 = y0c * (wide)w->D / x0c, t1 = y1c * (wide)w->D / x1c;
    low->all = wmin(t0, t1);
    high->all = wmax(t0, t1);
    return wide_set(cuts & (low->all < (wide)w->t1) & (high->all > (wide)w->t0));
}

/* Eight positions a byte. */
FN ulong wedge_range(const wedge_positions *p, real1 low, real1 high) {
    ulong bits = 0;
    for (int k = 0; 8 * k < p->count; k++) {
        wide t = p->t[k].all;
        ulong set = wide_set((t >= (wide)low) & (t < (wide)high));
        bits |= ((set * 0x0102040810204080ul) >> 56) << (8 * k);
    }
    return bits;
}

FN real1 wedge_position(const wedge_positions *p, int k) { return p->t[k >> 3].one[k & 7]; }

/* The shadow ray from position k. */
FN ray wedge_ray(const wedge *w, const wedge_positions *p, int k, real1 *distance) {
    real1 t = wedge_position(p, k), o[3], d[3], length = sqrt(fma(t, t, w->D * w->D));
    for (int a = 0; a < 3; a++) {
        real1 out = fma(w->x[a], w->D, w->y[a] * t);
        o[a] = w->lamp[a] + out;
        d[a] = -out / length;
    }
    *distance = length * (1 - WEDGE_NEAR);
    return ray_make(o, d, 0, -1);
}

/* A sphere about the lamp: its centre in the plane's axes, and |centre|^2 - radius^2 in twice the precision. */
typedef struct { real1 x, y, z, radius, power; } wedge_sphere;

FN wedge_sphere wedge_sphere_of(const wedge *w, __global const b_quadric *q) {
    wedge_sphere c;
    real1 to[3];
    pair1 power = one_neg(one_mul(one_of(q->radius), one_of(q->radius)));
    for (int a = 0; a < 3; a++) {
        pair1 exact = one_sum(q->center[a], -w->lamp[a]);
        to[a] = exact.high;
        power = one_add(power, one_mul(exact, exact));
    }
    c.x = fma(to[0], w->x[0], fma(to[1], w->x[1], to[2] * w->x[2]));
    c.y = fma(to[0], w->y[0], fma(to[1], w->y[1], to[2] * w->y[2]));
    c.z = fma(to[0], w->z[0], fma(to[1], w->z[1], to[2] * w->z[2]));
    c.radius = q->radius;
    c.power = one_value(power);
    return c;
}

/* Positions that the sphere hides: a ray from the lamp to them meets it on the way. As intersect_sphere, for eight
 * rays. */
FN ulong wedge_sphere_dark(const wedge *w, const wedge_positions *p, const wedge_sphere *c) {
    ulong bits = 0;
    for (int k = 0; 8 * k < p->count; k++) {
        wide t = p->t[k].all, D = (wide)w->D, length = sqrt(fma(t, t, D * D)), radius = (wide)c->radius;
        wide dx = D / length, dy = t / length, x = (wide)c->x, y = (wide)c->y;
        wide b = fma(x, dx, y * dy), across = wide_difference(x, dy, y, dx);
        wide e = sqrt(fma(across, across, (wide)(c->z * c->z)));
        wide discriminant = b * b > radius * radius ? (radius - e) * (radius + e) : fma(b, b, (wide)-c->power);
        wide s = b + copysign(sqrt(wmax(discriminant, (wide)0)), b);
        wide r0 = s, r1 = (wide)c->power / s;
        wide_mask hit0 = (r0 > length * (wide)WEDGE_NEAR) & (r0 < length);
        wide_mask hit1 = (r1 > length * (wide)WEDGE_NEAR) & (r1 < length);
        ulong set = wide_set((discriminant >= (wide)0) & (hit0 | hit1));
        bits |= ((set * 0x0102040810204080ul) >> 56) << (8 * k);
    }
    return p->count < 64 ? bits & ((1ul << p->count) - 1) : bits;
}

FN ulong wedge_quadrics(const geometry *g, const wedge *w, const wedge_positions *p, uint code, ulong dark) {
    uint first = code >> 4, count = (code & 7) + 1;
    for (uint i = 8 * first; i < 8 * (first + count); i++) {
        int id = g->quadric_ids[i];
        if (id < 0) break;
        __global const b_quadric *q = &g->quadrics[id];
        if (q->kind == QUADRIC_SPHERE) {
            wedge_sphere c = wedge_sphere_of(w, q);
            dark |= wedge_sphere_dark(w, p, &c);
            continue;
        }
        for (int k = 0; k < p->count; k++) {
            real1 distance, t, x, y;
            if (dark >> k & 1) continue;
            ray r = wedge_ray(w, p, k, &distance);
            if (intersect_quadric(q, &r, &t, &x, &y) && t < distance) dark |= 1ul << k;
        }
    }
    return dark;
}

/* Whether one of a leaf's quadrics may reach into the wedge. */
FN int wedge_touches_quadrics(const geometry *g, const wedge *w, uint code) {
    uint first = code >> 4, count = (code & 7) + 1;
    for (uint i = 8 * first; i < 8 * (first + count); i++) {
        int id = g->quadric_ids[i];
        if (id < 0) break;
        if (g->quadrics[id].kind != QUADRIC_SPHERE) return 1;
        wedge_sphere c = wedge_sphere_of(w, &g->quadrics[id]);
        real1 reach = c.radius + w->slack, r0 = sqrt(fma(w->t0, w->t0, w->D * w->D));
        real1 r1 = sqrt(fma(w->t1, w->t1, w->D * w->D));
        if (fabs(c.z) <= reach && c.x - reach <= w->D && fma(w->D, c.y, -w->t0 * c.x) >= -reach * r0 &&
            fma(w->t1, c.x, -w->D * c.y) >= -reach * r1)
            return 1;
    }
    return 0;
}

/* Lines through the lamp that bound the wedge: positive towards its inside. */
FN void wedge_edges(const wedge *w, real1 t0, real1 t1, along3 *edge0, along3 *edge1) {
    real1 r0 = sqrt(fma(t0, t0, w->D * w->D)), r1 = sqrt(fma(t1, t1, w->D * w->D));
    *edge0 = wedge_along(w, -t0 / r0, w->D / r0);
    *edge1 = wedge_along(w, t1 / r1, -w->D / r1);
}

/* Whether one of the eight triangles hides a part of the ray, or of its neighbours on both sides of the plane. */
FN int wedge_block_near(__global const b_triangle_block *block, const wedge *w) {
    int hides = 0;
    for (int side = -1; side <= 1 && !hides; side++) {
        wedge beside = *w;
        lanes_of_wide low, high;
        for (int a = 0; a < 3; a++) beside.lamp[a] = fma((real1)side * w->slack, w->z[a], w->lamp[a]);
        hides = wedge_block(block, &beside, &low, &high) != 0;
    }
    return hides;
}

/* A walk through the wedge that looks at no position: how much there is in it. */
typedef struct {
    int touches; /* triangles and quadrics that hide a part of the ray; those that only touch its ends don't count */
    int visits;  /* nodes and leaves */
} wedge_contents;

/* Ends at the first touch if `to_first`, or after `limit` visits; then `touches` is 1 at least. `near`: what
 * hides a ray beside it, by the slack, touches, too. */
WALK wedge_contents wedge_survey(const geometry *g, const wedge *w, int to_first, int near, int limit) {
    int stack[BVH_STACK];
    int top = 0, child = 0;
    wedge_contents in;
    along3 edge0, edge1;
    wedge_edges(w, w->t0, w->t1, &edge0, &edge1);
    in.touches = 0;
    for (in.visits = 0; in.visits < limit; in.visits++) {
        if (child < 0) {
            uint code = ~(uint)child, first = code >> 4, count = (code & 7) + 1;
            int quadrics = (FEATURES & FEATURE_QUADRICS) && (code & 8);
            if (quadrics) in.touches += wedge_touches_quadrics(g, w, code);
            for (uint i = first; i < first + count && !quadrics; i++) {
                lanes_of_wide low, high;
                in.touches += near ? wedge_block_near(&g->blocks[i], w)
                                   : wedge_block(&g->blocks[i], w, &low, &high) != 0;
            }
            if (to_first && in.touches) return in;
        } else {
            ulong set = wedge_node(&g->nodes[child], w, edge0, edge1);
            for (; set; top++) {
                int k = wide_last(set);
                set = wide_without(set, k);
                stack[top] = g->nodes[child].child[k];
            }
        }
        if (top == 0) return in;
        child = stack[--top];
    }
    in.touches++;
    return in;
}

/* Whether nothing at all lies in the wedge. */
FN int wedge_is_empty(const geometry *g, const wedge *w) {
    return wedge_survey(g, w, 1, 0, WEDGE_MAX_VISITS).touches == 0;
}

/* One bit per position that something hides. `visits` counts nodes and leaves. */
WALK ulong wedge_dark(const geometry *g, const wedge *whole, const wedge_positions *p, int *visits) {
    int stack[BVH_STACK];
    int top = 0, child = 0, seen = 0;
    wedge w = *whole;
    ulong all = p->count == 64 ? ~0ul : (1ul << p->count) - 1, dark = 0;
    along3 edge0, edge1;
    wedge_edges(&w, w.t0, w.t1, &edge0, &edge1);
    for (; seen < WEDGE_MAX_VISITS; seen++) {
        if (child < 0) {
            uint code = ~(uint)child, first = code >> 4, count = (code & 7) + 1;
            ulong before = dark;
            if ((FEATURES & FEATURE_QUADRICS) && (code & 8)) {
                dark = wedge_quadrics(g, &w, p, code, dark);
            } else {
                for (uint i = first; i < first + count; i++) {
                    lanes_of_wide low, high;
                    ulong set = wedge_block(&g->blocks[i], &w, &low, &high);
                    while (set) {
                        int k = wide_last(set);
                        set = wide_without(set, k);
                        dark |= wedge_range(p, low.one[k], high.one[k]);
                    }
                }
            }
            if (dark == all) break;
            if (dark != before) { /* what is left to look at */
                ulong open = all & ~dark;
                int last = 63 - (int)clz(open), low_bit = 63 - (int)clz(open & (0 - open));
                w.t0 = wedge_position(p, low_bit);
                w.t1 = wedge_position(p, last);
                w.t1 = w.t1 > w.t0 ? w.t1 : w.t0;
                wedge_edges(&w, w.t0, w.t1, &edge0, &edge1);
                /* an open end would lose a range that begins exactly at the last position */
                w.t1 = whole->t1;
            }
        } else {
            ulong set = wedge_node(&g->nodes[child], &w, edge0, edge1);
            for (; set; top++) {
                int k = wide_last(set);
                set = wide_without(set, k);
                stack[top] = g->nodes[child].child[k];
            }
        }
        if (top == 0) {
            *visits += seen;
            return dark;
        }
        child = stack[--top];
    }
    *visits += seen;
    for (int k = 0; k < p->count && dark != all; k++) {
        if (dark >> k & 1) continue;
        real1 distance;
        ray r = wedge_ray(whole, p, k, &distance);
        if (walk_occluded(g, &r, 0, REAL_BEFORE(distance))) dark |= 1ul << k;
    }
    return dark;
}

#endif

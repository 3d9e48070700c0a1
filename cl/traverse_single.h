/* traverse_single.h -- one ray alone through the hierarchy: eight boxes or eight triangles at a time (wide.h). */
#ifndef BRUME_TRAVERSE_SINGLE_H
#define BRUME_TRAVERSE_SINGLE_H

#include "features.h"
#include "vec.h"
#include "wide.h"
#include "intersect_triangle.h"
#include "intersect_quadric.h"

/* Enough for every tree (bvh.h bounds the depth); the host passes what its tree needs. */
#ifndef BVH_STACK
#define BVH_STACK 687
#endif

/* Calls, because inlining them at every site gained nothing measurable and makes large kernels larger still. Their
 * stacks live in their own frames: not once per work-item of a group, as PoCL does with arrays of the kernel itself. */
#ifndef WALK
#define WALK static __attribute__((noinline))
#endif

typedef struct {
    __global const b_node *nodes;
    __global const b_triangle_block *blocks;
    __global const b_quadric *quadrics;
    __global const int *quadric_ids;
    int triangle_count;
} geometry;

/* One ray's best hit so far. */
typedef struct {
    real1 t, u, v;
    int prim;
} hit1;

#define WIDEN ((real1)(1 + 0x1p-19f))

/* Below this a direction's component counts as 0 and its inverse stays finite, so that 0 * inverse is never NaN. */
#define TINY_DIRECTION ((real1)1e-36f)

/* A node or leaf to visit, and where the ray enters its box (rounded down in double): ordered by the latter, which is
 * not negative. */
#ifdef BRUME_DOUBLE
#define ENTRY_HIGH 0xffffffff00000000ul
#define ENTRY(t, child) ((as_ulong(t) & ENTRY_HIGH) | (uint)(child))
#define ENTRY_T(e) as_double((e) & ENTRY_HIGH)
#define ENTRY_ROUND(t) as_double8(as_ulong8(t) & (ulong8)ENTRY_HIGH)
#define REAL_BEFORE(t) as_double(as_ulong(t) - 1)
#else
#define ENTRY(t, child) (((ulong)as_uint(t) << 32) | (uint)(child))
#define ENTRY_T(e) as_float((uint)((e) >> 32))
#define ENTRY_ROUND(t) (t)
#define REAL_BEFORE(t) as_float(as_uint(t) - 1)
#endif
#define ENTRY_CHILD(e) ((int)(uint)(e))

/* All but the shear; returns the axis of the direction's largest component. */
FN int ray_place(ray *r, const real1 *o, const real1 *d, const real1 *inverse, real1 tmin, int own) {
    r->own = own;
    for (int a = 0; a < 3; a++) {
        r->o[a] = o[a];
        r->d[a] = d[a];
        r->inverse[a] = inverse[a];
        r->near_row[a] = 16 * a + (inverse[a] < 0 ? 8 : 0);
        r->far_row[a] = 16 * a + (inverse[a] < 0 ? 0 : 8);
    }
    int z = fabs(d[0]) > fabs(d[1]) ? 0 : 1;
    z = fabs(d[2]) > fabs(d[z]) ? 2 : z;
    int x = z == 2 ? 0 : z + 1, y = x == 2 ? 0 : x + 1;
    r->x = 8 * x;
    r->y = 8 * y;
    r->z = 8 * z;
    r->ox = o[x];
    r->oy = o[y];
    r->oz = o[z];
    r->tmin = tmin;
    return z;
}

FN ray ray_make(const real1 *o, const real1 *d, real1 tmin, int own) {
    ray r;
    real1 inverse[3];
    for (int a = 0; a < 3; a++)
        inverse[a] = 1 / (fabs(d[a]) < TINY_DIRECTION ? copysign(TINY_DIRECTION, d[a]) : d[a]);
    int z = ray_place(&r, o, d, inverse, tmin, own), x = z == 2 ? 0 : z + 1, y = x == 2 ? 0 : x + 1;
    r.sx = d[x] / d[z];
    r.sy = d[y] / d[z];
    r.sz = 1 / d[z];
    return r;
}

/* The children that the ray enters no farther than tmax, and where. */
FN ulong intersect_node(__global const b_node *node, const ray *r, real1 tmax, lanes_of_wide *entered) {
    __global const float *rows = (__global const float *)node;
    wide x0 = (wide_load(rows + r->near_row[0]) - (wide)r->o[0]) * (wide)r->inverse[0];
    wide y0 = (wide_load(rows + r->near_row[1]) - (wide)r->o[1]) * (wide)r->inverse[1];
    wide z0 = (wide_load(rows + r->near_row[2]) - (wide)r->o[2]) * (wide)r->inverse[2];
    wide x1 = (wide_load(rows + r->far_row[0]) - (wide)r->o[0]) * (wide)r->inverse[0];
    wide y1 = (wide_load(rows + r->far_row[1]) - (wide)r->o[1]) * (wide)r->inverse[1];
    wide z1 = (wide_load(rows + r->far_row[2]) - (wide)r->o[2]) * (wide)r->inverse[2];
    wide near = ENTRY_ROUND(wmax(wmax(x0, y0), wmax(z0, (wide)r->tmin)));
    wide far = wmin(wmin(wmin(x1, y1), z1) * (wide)WIDEN, (wide)tmax);
    entered->all = near;
    return wide_set(near <= far);
}

/* Best hit of one leaf. */
FN void closest_in_leaf(const geometry *g, const ray *r, real1 near, uint code, hit1 *best) {
    uint first = code >> 4, count = (code & 7) + 1;
    if ((FEATURES & FEATURE_QUADRICS) && (code & 8)) {
        for (uint i = 8 * first; i < 8 * (first + count); i++) {
            int id = g->quadric_ids[i];
            real1 t, x, y;
            if (id < 0) break;
            if (!intersect_quadric(&g->quadrics[id], r, &t, &x, &y)) continue;
            int prim = g->triangle_count + id;
            t = t > near ? t : near;
            if (!(t < best->t || (t == best->t && prim < best->prim))) continue;
            best->t = t;
            best->u = x;
            best->v = y;
            best->prim = prim;
        }
        return;
    }
    for (uint i = first; i < first + count; i++) {
        block_hits hits;
        intersect_block(&g->blocks[i], r, near, best->t, &hits);
        while (hits.set) {
            int k = wide_last(hits.set);
            hits.set = wide_without(hits.set, k);
            real1 t = hits.t.one[k];
            int prim = g->blocks[i].prim[k];
            if (!(t < best->t || (t == best->t && prim < best->prim))) continue;
            best->t = t;
            best->u = hits.v.one[k] / hits.det.one[k];
            best->v = hits.w.one[k] / hits.det.one[k];
            best->prim = prim;
        }
    }
}

/* From one node or leaf down. Each node enters the stack once, so the walk ends. */
WALK void walk_closest(const geometry *g, const ray *r, ulong entry, hit1 *best) {
    ulong stack[BVH_STACK];
    int top = 0;
    for (;;) {
        int child = ENTRY_CHILD(entry);
        if (child < 0) {
            closest_in_leaf(g, r, ENTRY_T(entry), ~(uint)child, best);
        } else {
            lanes_of_wide entered;
            __global const b_node *node = &g->nodes[child];
            ulong set = intersect_node(node, r, best->t, &entered);
            int base = top;
            while (set) {
                int k = wide_last(set), at = top++;
                set = wide_without(set, k);
                ulong e = ENTRY(entered.one[k], node->child[k]);
                for (; at > base && stack[at - 1] < e; at--) stack[at] = stack[at - 1];
                stack[at] = e;
            }
        }
        do {
            if (top == 0) return;
            entry = stack[--top];
        } while (ENTRY_T(entry) > best->t);
    }
}

FN int occluded_in_leaf(const geometry *g, const ray *r, uint code, real1 tmax) {
    uint first = code >> 4, count = (code & 7) + 1;
    if ((FEATURES & FEATURE_QUADRICS) && (code & 8)) {
        for (uint i = 8 * first; i < 8 * (first + count); i++) {
            int id = g->quadric_ids[i];
            real1 t, x, y;
            if (id < 0) break;
            if (intersect_quadric(&g->quadrics[id], r, &t, &x, &y) && t <= tmax) return 1;
        }
        return 0;
    }
    for (uint i = first; i < first + count; i++) {
        block_hits hits;
        intersect_block(&g->blocks[i], r, r->tmin, tmax, &hits);
        if (hits.set) return 1;
    }
    return 0;
}

/* tmax is included: the caller passes the number before its own, for which closest() wants nearer hits. */
WALK int walk_occluded(const geometry *g, const ray *r, int child, real1 tmax) {
    int stack[BVH_STACK];
    int top = 0;
    for (;;) {
        if (child < 0) {
            if (occluded_in_leaf(g, r, ~(uint)child, tmax)) return 1;
        } else {
            lanes_of_wide entered;
            __global const b_node *node = &g->nodes[child];
            ulong set = intersect_node(node, r, tmax, &entered);
            while (set) {
                int k = wide_last(set);
                set = wide_without(set, k);
                stack[top++] = node->child[k];
            }
        }
        if (top == 0) return 0;
        child = stack[--top];
    }
}

/* The lanes of a ray as memory, for loops that take one after the other. */
typedef struct {
    lanes_of_real o[3], d[3], tmin, tmax;
    lanes_of_ireal live, own;
} rays;

FN void rays_store(rays *r, vec o, vec d, real tmin, real tmax, ireal own, mask live) {
    r->own.all = own;
    r->o[0].all = o.x;
    r->o[1].all = o.y;
    r->o[2].all = o.z;
    r->d[0].all = d.x;
    r->d[1].all = d.y;
    r->d[2].all = d.z;
    r->tmin.all = tmin;
    r->tmax.all = tmax;
    /* A NaN enters every box, the empty ones with it, and the walk would never end: such a ray meets nothing. */
    real size = fabs(o.x) + fabs(o.y) + fabs(o.z) + fabs(d.x) + fabs(d.y) + fabs(d.z);
    r->live.all = live & (tmax > tmin) & (size < R(INFINITY));
}

FN ray rays_take(const rays *r, int k) {
    real1 o[3], d[3];
    for (int a = 0; a < 3; a++) {
        o[a] = r->o[a].one[k];
        d[a] = r->d[a].one[k];
    }
    return ray_make(o, d, r->tmin.one[k], (int)r->own.one[k]);
}

#endif

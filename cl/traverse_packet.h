/* traverse_packet.h -- all lanes through the hierarchy together, for as long as many of them want the same nodes.
 *
 * A node's boxes and a leaf's triangles are tested one by one against all lanes. Where few lanes want a node, each
 * goes on alone from there (traverse.h): most of the gain over packets alone. The arithmetic is that of wide.h turned
 * by 90 degrees, operation by operation, so hits are the same to the last bit.
 */
#ifndef BRUME_TRAVERSE_PACKET_H
#define BRUME_TRAVERSE_PACKET_H

#include "traverse_single.h"

/* With this many lanes or fewer, each goes alone: through a subtree, through a leaf. */
#ifndef PACKET_NODE_LANES
#define PACKET_NODE_LANES (LANES / 4 + 2)
#endif
#ifndef PACKET_LEAF_LANES
#define PACKET_LEAF_LANES (LANES * 3 / 16)
#endif

/* Nodes and leaves to visit, and where the lanes enter them; a lane that doesn't has infinity. */
typedef struct {
    real near[BVH_STACK];
    int child[BVH_STACK];
} packet_stack;

typedef struct {
    vec o;
    vec from;                             /* the origin, z along the largest component of the direction */
    lanes_of_real inverse[3], sx, sy, sz; /* 1 / direction, finite; shear */
    real tmin;
    mask z_is_x, z_is_y; /* which coordinate z is; else z itself */
    int same;            /* all living lanes agree on it: */
    int x, y, z;         /* then these coordinates are x, y and z */
    const rays *all;
    ray one[LANES];      /* made when a lane first goes alone */
    uint made;
} packet;

FN real packet_bounded(real d) { return fabs(d) < R(TINY_DIRECTION) ? copysign(R(TINY_DIRECTION), d) : d; }

FN void packet_make(packet *p, const rays *all) {
    vec o = vmake(all->o[0].all, all->o[1].all, all->o[2].all), d = vmake(all->d[0].all, all->d[1].all, all->d[2].all);
    mask live = all->live.all;
    p->all = all;
    p->o = o;
    p->tmin = all->tmin.all;
    p->inverse[0].all = R(1) / packet_bounded(d.x);
    p->inverse[1].all = R(1) / packet_bounded(d.y);
    p->inverse[2].all = R(1) / packet_bounded(d.z);
    mask x_over_y = fabs(d.x) > fabs(d.y);
    mask z_is_z = fabs(d.z) > (x_over_y ? fabs(d.x) : fabs(d.y));
    p->z_is_x = x_over_y & !z_is_z;
    p->z_is_y = !x_over_y & !z_is_z;
    vec turned_x = vmake(d.y, d.z, d.x), turned_y = vmake(d.z, d.x, d.y);
    vec e = vselect(p->z_is_x, turned_x, vselect(p->z_is_y, turned_y, d));
    p->from = vselect(p->z_is_x, vmake(o.y, o.z, o.x), vselect(p->z_is_y, vmake(o.z, o.x, o.y), o));
    p->sx.all = e.x / e.z;
    p->sy.all = e.y / e.z;
    p->sz.all = R(1) / e.z;
    p->z = !ANY(live & !p->z_is_x) ? 0 : !ANY(live & !p->z_is_y) ? 1 : 2;
    p->same = p->z < 2 || !ANY(live & !z_is_z);
    p->x = p->z == 2 ? 0 : p->z + 1;
    p->y = p->x == 2 ? 0 : p->x + 1;
    p->made = 0;
}

FN const ray *packet_ray(packet *p, int k) {
    ray *r = &p->one[k];
    if (p->made >> k & 1) return r;
    p->made |= 1u << k;
    real1 o[3], d[3], inverse[3];
    for (int a = 0; a < 3; a++) {
        o[a] = p->all->o[a].one[k];
        d[a] = p->all->d[a].one[k];
        inverse[a] = p->inverse[a].one[k];
    }
    ray_place(r, o, d, inverse, p->all->tmin.one[k], (int)p->all->own.one[k]);
    r->sx = p->sx.one[k];
    r->sy = p->sy.one[k];
    r->sz = p->sz.one[k];
    return r;
}

/* The smallest lane. */
FN real1 least_lane(real x) {
#if LANES == 16
    LANE_PASTE(LANE_REAL, 8) a = x.lo < x.hi ? x.lo : x.hi;
#else
    LANE_PASTE(LANE_REAL, 8) a = x;
#endif
    LANE_PASTE(LANE_REAL, 4) b = a.lo < a.hi ? a.lo : a.hi;
    LANE_PASTE(LANE_REAL, 2) c = b.lo < b.hi ? b.lo : b.hi;
    return c.x < c.y ? c.x : c.y;
}

#ifdef BRUME_DOUBLE
#define PACKET_ROUND(t) as_real(as_ureal(t) & U(ENTRY_HIGH))
#else
#define PACKET_ROUND(t) (t)
#endif

/* Where the active lanes enter one box of a node. */
FN real packet_enter(__global const b_node *n, int c, const packet *p, real tmax, mask active) {
    real inverse_x = p->inverse[0].all, inverse_y = p->inverse[1].all, inverse_z = p->inverse[2].all;
    real x0 = (R(n->lo_x[c]) - p->o.x) * inverse_x, x1 = (R(n->hi_x[c]) - p->o.x) * inverse_x;
    real y0 = (R(n->lo_y[c]) - p->o.y) * inverse_y, y1 = (R(n->hi_y[c]) - p->o.y) * inverse_y;
    real z0 = (R(n->lo_z[c]) - p->o.z) * inverse_z, z1 = (R(n->hi_z[c]) - p->o.z) * inverse_z;
    real near = lmax(lmax(lmin(x0, x1), lmin(y0, y1)), lmax(lmin(z0, z1), p->tmin));
    real far = lmin(lmin(lmin(lmax(x0, x1), lmax(y0, y1)), lmax(z0, z1)) * R(WIDEN), tmax);
    near = PACKET_ROUND(near);
    return (active & (near <= far)) ? near : R(INFINITY);
}

/* A node's children that some lane enters, onto the stack, the nearest last. */
FN int packet_push(__global const b_node *node, const packet *p, real tmax, mask active, packet_stack *stack, int top) {
    real near[8];
    ulong order[8];
    int count = 0;
    for (int c = 0; c < 8 && node->lo_x[c] <= node->hi_x[c]; c++) {
        near[c] = packet_enter(node, c, p, tmax, active);
        real1 key = least_lane(near[c]);
        if (key == (real1)INFINITY) continue;
        ulong e = ENTRY(key, c);
        int at = count++;
        for (; at > 0 && order[at - 1] < e; at--) order[at] = order[at - 1];
        order[at] = e;
    }
    for (int i = 0; i < count; i++) {
        int c = ENTRY_CHILD(order[i]);
        stack->near[top] = near[c];
        stack->child[top++] = node->child[c];
    }
    return top;
}

/* One corner of triangle k relative to the origins, sheared. */
FN vec packet_corner(__global const float *rows, int k, const packet *p) {
    vec v;
    if (p->same) {
        v = vmake(R(rows[8 * p->x + k]), R(rows[8 * p->y + k]), R(rows[8 * p->z + k]));
    } else {
        real x = R(rows[k]), y = R(rows[8 + k]), z = R(rows[16 + k]);
        v = vselect(p->z_is_x, vmake(y, z, x), vselect(p->z_is_y, vmake(z, x, y), vmake(x, y, z)));
    }
    v = vsub(v, p->from);
    return vmake(fma(-p->sx.all, v.z, v.x), fma(-p->sy.all, v.z, v.y), v.z);
}

/* refined_within for all lanes at once: rays that leave one large surface meet it again together. */
CALL real packet_refined(__global const b_triangle_block *block, int k, vec o, real sz, real det, real rough,
                         real error) {
    pair a[3], b[3], c[3], volume = pair_of(R(0));
    for (int i = 0; i < 3; i++) {
        real from = i == 0 ? -o.x : i == 1 ? -o.y : -o.z;
        a[i] = pair_sum(R(block->v0[i][k]), from);
        b[i] = pair_sum(R(block->v1[i][k]), from);
        c[i] = pair_sum(R(block->v2[i][k]), from);
    }
    for (int i = 0; i < 3; i++) {
        int j = i == 2 ? 0 : i + 1, l = i == 0 ? 2 : i - 1;
        pair cross = pair_add(pair_mul(b[j], c[l]), pair_neg(pair_mul(b[l], c[j])));
        volume = pair_add(volume, pair_mul(a[i], cross));
    }
    real exact = -pair_value(volume) / det * sz;
    return lmin(lmax(exact, rough - error), rough + error);
}

typedef struct { real t, v, w, det; } packet_hits;

/* intersect_block for one triangle and all lanes; the hits. */
FN mask packet_triangle(__global const b_triangle_block *block, int k, packet *p, real near, real tmax, mask active,
                        packet_hits *out) {
    __global const float *rows = (__global const float *)block;
    vec a = packet_corner(rows, k, p), b = packet_corner(rows + 24, k, p), c = packet_corner(rows + 48, k, p);
    real u = difference_of_products(c.x, b.y, c.y, b.x);
    real v = difference_of_products(a.x, c.y, a.y, c.x);
    real w = difference_of_products(b.x, a.y, b.y, a.x);
    real low = lmin(u, lmin(v, w)), high = lmax(u, lmax(v, w)), det = u + v + w;
    active = active & (I(block->prim[k]) != p->all->own.all);
    mask inside = active & ((low >= R(0)) | (high <= R(0))) & (det != R(0));
    if (!ANY(inside)) return FALSE_MASK;

    real t = fma(u, a.z, fma(v, b.z, w * c.z)) / det * p->sz.all;
    real reach = lmax(fabs(a.z), lmax(fabs(b.z), fabs(c.z)));
    real across = lmax(lmax(fabs(a.x), lmax(fabs(b.x), fabs(c.x))), lmax(fabs(a.y), lmax(fabs(b.y), fabs(c.y))));
    real error = (reach + across) * across * reach * fabs(p->sz.all * R(DISTANCE_ERROR) / det);
    mask near_start = (fabs(t - p->tmin) <= error) | (fabs(t) < reach * R(LARGE_REACH));
    mask missed = (t + error <= p->tmin) | (t - error > tmax); /* however refined */
    mask doubtful = inside & near_start & !missed;
    if (ANY(doubtful)) t = doubtful ? packet_refined(block, k, p->o, p->sz.all, det, t, error) : t;
    real entered = lmax(t, near);
    out->t = entered;
    out->v = v;
    out->w = w;
    out->det = det;
    return inside & (t > p->tmin) & (entered <= tmax);
}

/* Best hits of all lanes, as vectors for packets and one by one for lanes that go alone. */
typedef struct {
    lanes_of_real t, u, v;
    lanes_of_ireal prim;
} packet_best;

FN hit1 packet_take(const packet_best *b, int k) {
    hit1 h = {b->t.one[k], b->u.one[k], b->v.one[k], (int)b->prim.one[k]};
    return h;
}

FN void packet_give(packet_best *b, int k, const hit1 *h) {
    b->t.one[k] = h->t;
    b->u.one[k] = h->u;
    b->v.one[k] = h->v;
    b->prim.one[k] = h->prim;
}

FN void packet_closest_in_leaf(const geometry *g, packet *p, real near, uint code, mask active, packet_best *best) {
    uint first = code >> 4, count = (code & 7) + 1;
    for (uint i = first; i < first + count; i++)
        for (int k = 0; k < 8 && g->blocks[i].prim[k] >= 0; k++) {
            packet_hits h;
            ireal prim = I(g->blocks[i].prim[k]);
            mask m = packet_triangle(&g->blocks[i], k, p, near, best->t.all, active, &h);
            m = m & ((h.t < best->t.all) | ((h.t == best->t.all) & (prim < best->prim.all)));
            if (!ANY(m)) continue;
            best->t.all = m ? h.t : best->t.all;
            best->u.all = m ? h.v / h.det : best->u.all;
            best->v.all = m ? h.w / h.det : best->v.all;
            best->prim.all = m ? prim : best->prim.all;
        }
}

WALK void packet_closest(const geometry *g, const rays *all, packet_best *best) {
    packet_stack stack;
    packet p;
    int top = 1;
    packet_make(&p, all);
    stack.near[0] = all->live.all ? p.tmin : R(INFINITY);
    stack.child[0] = 0;
    while (top > 0) {
        top--;
        int child = stack.child[top];
        lanes_of_real near;
        lanes_of_ireal active;
        near.all = stack.near[top];
        active.all = (near.all <= best->t.all) & (near.all < R(INFINITY));
        int count = count_lanes(active.all);
        if (count == 0) continue;
        int is_leaf = child < 0, quadrics = is_leaf && (~child & 8);
        if (quadrics || count <= (is_leaf ? PACKET_LEAF_LANES : PACKET_NODE_LANES)) {
            for (int k = 0; k < LANES; k++) {
                if (!active.one[k]) continue;
                hit1 h = packet_take(best, k);
                walk_closest(g, packet_ray(&p, k), ENTRY(near.one[k], child), &h);
                packet_give(best, k, &h);
            }
        } else if (is_leaf) {
            packet_closest_in_leaf(g, &p, near.all, ~(uint)child, active.all, best);
        } else {
            top = packet_push(&g->nodes[child], &p, best->t.all, active.all, &stack, top);
        }
    }
}

FN mask packet_occluded_in_leaf(const geometry *g, packet *p, uint code, mask active, real tmax) {
    uint first = code >> 4, count = (code & 7) + 1;
    mask found = FALSE_MASK;
    for (uint i = first; i < first + count; i++)
        for (int k = 0; k < 8 && g->blocks[i].prim[k] >= 0; k++) {
            packet_hits h;
            found = found | packet_triangle(&g->blocks[i], k, p, p->tmin, tmax, active & !found, &h);
        }
    return found;
}

WALK mask packet_occluded(const geometry *g, const rays *all) {
    packet_stack stack;
    packet p;
    lanes_of_ireal found;
    lanes_of_real far;
    int top = 1;
    packet_make(&p, all);
    real tmax = far.all = as_real(as_ireal(all->tmax.all) - I(1)); /* included, as in walk_occluded */
    stack.near[0] = all->live.all ? p.tmin : R(INFINITY);
    stack.child[0] = 0;
    found.all = FALSE_MASK;
    while (top > 0) {
        top--;
        int child = stack.child[top];
        lanes_of_ireal active;
        active.all = (stack.near[top] < R(INFINITY)) & !(found.all != I(0));
        int count = count_lanes(active.all);
        if (count == 0) continue;
        int is_leaf = child < 0, quadrics = is_leaf && (~child & 8);
        if (quadrics || count <= (is_leaf ? PACKET_LEAF_LANES : PACKET_NODE_LANES)) {
            for (int k = 0; k < LANES; k++)
                if (active.one[k] && walk_occluded(g, packet_ray(&p, k), child, far.one[k])) found.one[k] = -1;
        } else if (is_leaf) {
            found.all = found.all | packet_occluded_in_leaf(g, &p, ~(uint)child, active.all, tmax);
        } else {
            top = packet_push(&g->nodes[child], &p, tmax, active.all, &stack, top);
        }
    }
    return found.all != I(0);
}

#endif

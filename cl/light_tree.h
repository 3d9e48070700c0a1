/* light_tree.h -- choosing one of many lamps by a tree over them (lib/light_tree.c): Conty Estevez & Kulla 2018, for
 * segments of rays through a medium and for points.
 *
 * From the root down, one of sixteen clusters of lamps is chosen in proportion to what they would scatter to the eye,
 * or bring to the point, if their light filled the cone that holds all of it: 0 only where no lamp of the cluster
 * reaches. In a leaf the lamps' own weights decide (light_choice.h). Among thin beams hardly a cluster tells which of
 * them a ray meets; only the lamps do, one by one. So leaves are large, and a test of few products says which lamps to
 * weigh.
 *
 * Each lane goes down alone, with the clusters of a block in the lanes of the vector unit: rows are loaded as they
 * stand, while lanes together would gather them from as many nodes. Sums run over one block in its order, at every
 * width.
 *
 * What a cluster reaches: a point at distance r from its centre is seen from any of its lamps within asin(radius / r)
 * of the direction from the centre. A cone about the centre wider by that angle holds the light of all, and cuts the
 * segment's line as a lamp's own cone does (beam.h): in one piece, unless it is wider than a half space, where the
 * whole segment is taken. The angle is that at the segment's nearest point first, then at the nearest of the piece.
 */
#ifndef BRUME_LIGHT_TREE_CL_H
#define BRUME_LIGHT_TREE_CL_H

#include "beam.h"
#include "medium.h"
#include "reservoir.h"

/* As RESERVOIR_EVEN_SHARE, at each node: among its clusters that reach. */
#define LIGHT_TREE_EVEN_SHARE ((real1)0.05)

typedef struct {
    vec center, axis;
    real radius, versine, flux;
} light_cluster;

/* LANES clusters of a block. */
FN light_cluster light_cluster_load(__global const b_light_block *block, int j) {
    light_cluster c;
    c.center = vmake(load_lanes(block->x + j), load_lanes(block->y + j), load_lanes(block->z + j));
    c.axis = vmake(load_lanes(block->axis_x + j), load_lanes(block->axis_y + j), load_lanes(block->axis_z + j));
    c.radius = load_lanes(block->radius + j);
    c.versine = load_lanes(block->versine + j);
    c.flux = load_lanes(block->flux + j);
    return c;
}

/* How far rounding can misplace what is at p relative to a lamp near it. */
FN real light_slack(vec p) { return lmax(lmax(fabs(p.x), fabs(p.y)), fabs(p.z)) * R(0x1p-20f); }

/* 1 - cos of the cluster's cone, seen from its centre, for points at `distance` and farther; 2 for everywhere. Wider
 * than exact by more than what is computed with it can be wrong. */
FN real light_cluster_versine(const light_cluster *c, real radius, real distance) {
    real sine = lmin(radius / lmax(distance, R(1e-30)), R(1)), cosine = sqrt((R(1) - sine) * (R(1) + sine));
    real v = square(sine) / (R(1) + cosine);
    real spread_cosine = R(1) - c->versine, spread_sine = sqrt(lmax(c->versine * (R(2) - c->versine), R(0)));
    mask beyond = (sine >= R(1)) | (spread_sine * cosine + spread_cosine * sine <= R(0));
    real sum = fma(v, spread_cosine, c->versine) + spread_sine * sine;
    return beyond ? R(2) : lmin(sum * R(1.001) + R(1e-9), R(2));
}

/* What is lit, be it by a hair or beyond what float can hold, has a weight that can be added to others. */
FN real light_weight_held(real w) {
    mask some = w > R(1e-36);
    return some ? lmin(w, R(1e36)) : R(1e-36);
}

/* A segment o + t d, t in [0, t_end], as a cluster sees it, and the piece t0 ... t1 of it that the cluster's cone
 * holds, with t counted from the closest point. */
typedef struct {
    real delta, D2, radius, versine, t0, t1;
    mask reached;
} light_piece;

FN light_piece light_cluster_piece(const light_cluster *c, vec o, vec d, real t_end, real slack) {
    light_piece p;
    vec w = vsub(c->center, o);
    p.delta = vdot(w, d);
    vec e = vmad(d, -p.delta, w);
    real again = vdot(e, d);
    e = vmad(d, -again, e);
    p.delta = p.delta + again;
    p.D2 = vdot(e, e);
    p.radius = c->radius + slack;
    real D = sqrt(p.D2), per_D = R(1) / lmax(D, R(1e-18));
    /* The axis along the way from the centre to the closest point, along the ray, and across both. */
    vec across = vmake(e.y * d.z - e.z * d.y, e.z * d.x - e.x * d.z, e.x * d.y - e.y * d.x);
    real along_n = -vdot(c->axis, e) * per_D, along_d = vdot(c->axis, d), off = vdot(c->axis, across) * per_D;
    real rho = sqrt(square(along_n) + square(along_d)), out_of_plane = square(off) / (R(1) + rho);
    p.t0 = -p.delta;
    p.t1 = t_end - p.delta;
    p.reached = (c->flux > R(0)) & (t_end > R(0));
    /* Too close to the line, they span no plane that rounding leaves alone. */
    mask planar = D > p.radius * R(0x1p-10f) + slack;
    for (int pass = 0; pass < 2; pass++) {
        p.versine = light_cluster_versine(c, p.radius, sqrt(p.D2 + square(lclamp(R(0), p.t0, p.t1))));
        mask cuts = planar & (p.versine < R(1));
        real cosine = R(1) - p.versine, room = p.versine - out_of_plane, q = sqrt(lmax(room, R(0)) * (rho + cosine));
        real cos0 = along_n * cosine + along_d * q, sin0 = along_d * cosine - along_n * q;
        real cos1 = along_n * cosine - along_d * q, sin1 = along_d * cosine + along_n * q;
        real low = cos0 > R(0) ? D * sin0 / lmax(cos0, R(1e-18)) : R(-1e18);
        real high = cos1 > R(0) ? D * sin1 / lmax(cos1, R(1e-18)) : R(1e18);
        mask behind = (cos0 <= R(0)) & (cos1 <= R(0)) & (along_n <= R(0));
        mask misses = (room < R(0)) | behind | (low > p.t1) | (high < p.t0);
        p.reached = p.reached & !(cuts & misses);
        p.t0 = cuts ? lmax(low, p.t0) : p.t0;
        p.t1 = cuts ? lmax(lmin(high, p.t1), p.t0) : p.t1;
    }
    return p;
}

/* What a cluster would scatter to the eye, as a share of all lamps' flux. */
FN real light_cluster_segment(const light_cluster *c, vec o, vec d, real t_end, real sigma, real phase_g, real slack) {
    light_piece p = light_cluster_piece(c, o, d, t_end, slack);
    real S2 = p.D2 + R(0.5) * square(p.radius), S = lmax(sqrt(S2), R(1e-18));
    real r0 = sqrt(fma(p.t0, p.t0, S2)), r1 = sqrt(fma(p.t1, p.t1, S2));
    real width = latan2(S * (p.t1 - p.t0), fma(p.t0, p.t1, S2)) / S;
    /* The middle of the angle. */
    real t = (p.t0 * r1 + p.t1 * r0) / (r0 + r1), r = sqrt(fma(t, t, S2));
    real s = phase_g < R(0) ? -t / r : t / r;
    real turn = s > R(0) ? R(1) + s : S2 / (r * r * (R(1) - s));
    /* The mean over the cluster's depth: exp(radius) / (2 radius) where that is large. */
    real through = lexp(-sigma * lmax(p.delta + t + r - p.radius, R(0))) / fma(R(2) * sigma, p.radius, R(1));
    real f = lmax(hg_density(turn, fabs(phase_g)) * through, R(1e-12));
    return p.reached ? light_weight_held(c->flux / p.versine * width * f) : R(0);
}

/* Whether a cluster reaches p from the side of normal n that `front` says, or from any in a medium. *versine: of the
 * cone that holds its light; *most: a bound of the cosine that it arrives at. */
FN mask light_cluster_reaches(const light_cluster *c, vec p, vec n, real front, mask in_medium, real slack,
                              real *d2, real *versine, real *most) {
    vec w = vsub(p, c->center);
    *d2 = vdot(w, w);
    real distance = sqrt(*d2), radius = c->radius + slack;
    vec out = vscale(w, R(1) / lmax(distance, R(1e-18))), off = vsub(out, c->axis);
    *versine = light_cluster_versine(c, radius, distance);
    mask lit = (c->flux > R(0)) & ((*versine >= R(2)) | (R(0.5) * vdot(off, off) <= *versine));
    real cosine = vdot(out, n);
    cosine = front > R(0) ? -cosine : cosine;
    real sine = lmin(radius / lmax(distance, R(1e-30)), R(1)), aside = sqrt((R(1) - sine) * (R(1) + sine));
    real bound = fma(cosine, aside, sqrt(lmax(R(1) - square(cosine), R(0))) * sine);
    mask any = in_medium | (sine >= R(1)) | (cosine >= aside);
    *most = any ? R(1) : bound;
    return lit & (*most > R(-1e-5));
}

/* What a cluster would bring to p. */
FN real light_cluster_point(const light_cluster *c, vec p, vec n, real front, mask in_medium, real slack) {
    real d2, versine, most;
    mask reached = light_cluster_reaches(c, p, n, front, in_medium, slack, &d2, &versine, &most);
    real weight = c->flux / versine * lmax(most, R(1e-3)) / lmax(d2 + R(0.5) * square(c->radius), R(1e-30));
    return reached ? light_weight_held(weight) : R(0);
}

/* ---- one lane alone ---------------------------------------------------------------------------------------------- */

/* What a lamp is chosen for: a segment of a ray through a medium, or a point. */
typedef struct {
    int is_point;        /* the same for all lanes */
    vec o, d;            /* segment: origin, direction; point: itself, normal */
    real t_end;          /* segment */
    const medium *m;     /* segment */
    real front;          /* point: the side of the normal from which light counts, 1 or -1 */
    mask in_medium;      /* point: light counts from all sides */
} light_query;

/* A query's numbers for clusters; lane by lane in memory, or one lane's in all. */
typedef struct {
    vec o, d;
    real t_end, sigma, g; /* point: front; -; 1 in a medium */
} light_ask;

typedef union { light_ask all; lanes_of_real row[9]; } light_asks;

FN light_asks light_asks_of(const light_query *q) {
    light_asks a;
    a.all.o = q->o, a.all.d = q->d;
    a.all.t_end = q->is_point ? q->front : q->t_end;
    a.all.sigma = q->is_point ? R(0) : cmean(q->m->sigma_t);
    a.all.g = q->is_point ? (q->in_medium ? R(1) : R(0)) : q->m->g;
    return a;
}

FN light_ask light_ask_take(const light_asks *a, int k) {
    light_ask b;
    b.o = vmake(R(a->row[0].one[k]), R(a->row[1].one[k]), R(a->row[2].one[k]));
    b.d = vmake(R(a->row[3].one[k]), R(a->row[4].one[k]), R(a->row[5].one[k]));
    b.t_end = R(a->row[6].one[k]);
    b.sigma = R(a->row[7].one[k]);
    b.g = R(a->row[8].one[k]);
    return b;
}

FN real light_cluster_weight(const light_cluster *c, const light_ask *a, const int is_point) {
    real slack = light_slack(a->o);
    if (is_point) return light_cluster_point(c, a->o, a->d, a->t_end, a->g > R(0), slack);
    return light_cluster_segment(c, a->o, a->d, a->t_end, a->sigma, a->g, slack);
}

/* Of a block's clusters. */
typedef union { real all[LIGHT_BLOCK / LANES]; real1 one[LIGHT_BLOCK]; } light_weights;

FN light_weights light_block_weights(__global const b_light_block *block, const light_ask *a, const int is_point) {
    light_weights w;
    for (int j = 0; j < LIGHT_BLOCK / LANES; j++) {
        light_cluster c = light_cluster_load(block, j * LANES);
        w.all[j] = light_cluster_weight(&c, a, is_point);
    }
    return w;
}

/* Which lamps of a leaf's block light some of the segment: as light_cluster_piece, but with products only, as this is
 * asked of many. A cone narrower than a half space meets the plane of the lamp and the line if its axis is near enough
 * to it; the segment, if the axis points between its ends, or close enough to one. `slack`: see light_slack. */
FN mask light_lamp_meets(const light_cluster *c, vec o, vec d, real t_end, real slack) {
    vec w = vsub(c->center, o);
    real delta = vdot(w, d), off_by = slack + c->radius;
    vec e = vmad(d, -delta, w);
    vec cross = vmake(e.y * d.z - e.z * d.y, e.z * d.x - e.x * d.z, e.x * d.y - e.y * d.x);
    real D2 = vdot(e, e), t0 = -delta, t1 = t_end - delta;
    real off = vdot(c->axis, cross), along_e = vdot(c->axis, e), along_d = vdot(c->axis, d);
    real sine2 = c->versine * (R(2) - c->versine);
    mask near = square(off) <= fma(D2, fma(sine2, R(1.01), R(1e-9)), R(4000) * square(off_by));
    real cosine2 = lmax(R(1 - 4e-6) - sine2 * R(1.002), R(0));
    real dot0 = fma(along_d, t0, R(4) * off_by - along_e), dot1 = fma(along_d, t1, R(4) * off_by - along_e);
    mask at0 = (dot0 >= R(0)) & (square(dot0) >= cosine2 * fma(t0, t0, D2));
    mask at1 = (dot1 >= R(0)) & (square(dot1) >= cosine2 * fma(t1, t1, D2));
    mask after0 = fma(along_d, D2, along_e * t0) >= R(0), before1 = fma(along_d, D2, along_e * t1) <= R(0);
    mask meets = (near & (at0 | at1 | (after0 & before1))) | (D2 <= R(100) * square(off_by));
    return (c->flux > R(0)) & (t_end > R(0)) & (meets | (c->versine >= R(1)));
}

/* Which light p, on the side that counts. */
FN mask light_lamp_lights(const light_cluster *c, vec p, vec n, real front, mask in_medium, real slack) {
    vec w = vsub(p, c->center);
    real d2 = vdot(w, w), off_by = slack + c->radius, dot = vdot(w, c->axis) + R(4) * off_by;
    real cosine2 = lmax(R(1 - 4e-6) - c->versine * (R(2) - c->versine) * R(1.002), R(0));
    mask lit = (c->versine >= R(1)) | ((dot >= R(0)) & (square(dot) >= cosine2 * d2));
    real height = vdot(w, n);
    height = front > R(0) ? -height : height;
    return (c->flux > R(0)) & lit & (in_medium | (square(height) <= R(1e-10) * d2) | (height > R(-4) * off_by));
}

/* One bit for each lamp of a leaf's block that reaches. */
FN uint light_block_reaches(__global const b_light_block *block, const light_ask *a, const int is_point) {
    real slack = light_slack(a->o);
    uint bits = 0;
    for (int j = 0; j < LIGHT_BLOCK / LANES; j++) {
        light_cluster c = light_cluster_load(block, j * LANES);
        mask reached = is_point ? light_lamp_lights(&c, a->o, a->d, a->t_end, a->g > R(0), slack)
                                : light_lamp_meets(&c, a->o, a->d, a->t_end, slack);
        if (ANY(reached)) bits |= mask_bits(reached) << (j * LANES);
    }
    return bits;
}

/* Of the weights one, by what is left of u; -1 where all are 0. *share: its probability. */
FN int light_pick(const light_weights *w, real1 *u, real1 *share) {
    real1 total = 0, count = 0, sum = 0, from = 0;
    for (int k = 0; k < LIGHT_BLOCK; k++) {
        total += w->one[k];
        count += w->one[k] > 0 ? 1 : 0;
    }
    int choice = -1;
    *share = 1;
    if (!(total > 0)) return choice;
    real1 even = LIGHT_TREE_EVEN_SHARE / count, per_total = (1 - LIGHT_TREE_EVEN_SHARE) / total;
    for (int k = 0; k < LIGHT_BLOCK; k++) {
        if (!(w->one[k] > 0)) continue;
        real1 p = fma(w->one[k], per_total, even);
        if (*u >= sum) {
            from = sum;
            *share = p;
            choice = k;
        }
        sum += p;
    }
    *u = clamp((*u - from) / *share, (real1)0, (real1)0.99999994);
    return choice;
}

/* `count` blocks of lamps from `first` on, or all lamps without a place; none where count is 0. */
typedef struct {
    int first, count, placeless;
    real1 u, share; /* what is left of the random number; with what probability they were chosen */
} light_leaf;

/* Down from the root, where `other` is the weight of the lamps without a place. */
FN light_leaf light_tree_descend(const scene *s, const light_ask *a, const int is_point, real1 other, real1 u) {
    light_leaf leaf;
    leaf.first = leaf.count = leaf.placeless = 0;
    leaf.share = 1;
    int at = 0;
    do {
        light_weights w = light_block_weights(s->light_tree + at, a, is_point);
        if (at == 0 && other > 0) {
            real1 total = 0;
            for (int k = 0; k < LIGHT_BLOCK; k++) total += w.one[k];
            real1 p = other / (other + total);
            p = total > 0 ? fma(1 - 2 * LIGHT_TREE_EVEN_SHARE, p, LIGHT_TREE_EVEN_SHARE) : 1;
            leaf.placeless = u < p;
            leaf.u = clamp(leaf.placeless ? u / p : (u - p) / (1 - p), (real1)0, (real1)0.99999994);
            leaf.share = leaf.placeless ? p : 1 - p;
            if (leaf.placeless) return leaf;
            u = leaf.u;
        }
        real1 p;
        int k = light_pick(&w, &u, &p);
        if (k < 0) break;
        leaf.share *= p;
        at = s->light_tree[at].child[k];
    } while (at > 0);
    leaf.u = u;
    if (at < 0) {
        leaf.first = ~at / LIGHT_LEAF_BLOCKS;
        leaf.count = ~at % LIGHT_LEAF_BLOCKS + 1;
    }
    return leaf;
}

#endif

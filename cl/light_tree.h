/* light_tree.h -- choosing one of many lamps by a tree over them (lib/light_tree.c): Conty Estevez & Kulla 2018, for
 * segments of rays through a medium and for points.
 *
 * From the root down, one of four clusters of lamps is chosen in proportion to what they would scatter to the eye, or
 * bring to the point, if their light were spread evenly over the cone that holds all of it: an estimate, which is never
 * too good to be wrong by much, and 0 only where no lamp of the cluster reaches. In a leaf the lamps' own weights decide.
 * Lanes go down together, each at a node of its own.
 *
 * What a cluster reaches: seen from any of its lamps, a point at distance r is off from where it is seen from the
 * cluster's centre by asin(radius / r) at most. A cone about the centre wider by that angle holds the light of all, and
 * cuts the segment's line as a lamp's own cone does (beam.h): in one piece, unless it is wider than a half space, where
 * the whole segment is taken. The angle is that at the nearest point first, then at the nearest of the piece.
 */
#ifndef BRUME_LIGHT_TREE_CL_H
#define BRUME_LIGHT_TREE_CL_H

#include "beam.h"
#include "medium.h"
#include "reservoir.h"

/* As RESERVOIR_EVEN_SHARE, at each node: among its clusters that reach. */
#ifndef LIGHT_TREE_EVEN_SHARE
#define LIGHT_TREE_EVEN_SHARE R(0.05)
#endif

#ifndef LIGHT_TREE_PASSES
#define LIGHT_TREE_PASSES 2
#endif

typedef struct {
    vec center, axis;
    real radius, versine, flux;
} light_cluster;

FN light_cluster light_cluster_of(const scene *s, ireal node, int k) {
    light_cluster c;
    c.center = vmake(GATHER(s->light_tree, x[k], node), GATHER(s->light_tree, y[k], node),
                     GATHER(s->light_tree, z[k], node));
    c.axis = vmake(GATHER(s->light_tree, axis_x[k], node), GATHER(s->light_tree, axis_y[k], node),
                   GATHER(s->light_tree, axis_z[k], node));
    c.radius = GATHER(s->light_tree, radius[k], node);
    c.versine = GATHER(s->light_tree, versine[k], node);
    c.flux = GATHER(s->light_tree, flux[k], node);
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

/* What a cluster would scatter to the eye from the segment o + t d, t in [0, t_end], as a share of all lamps' flux. */
FN real light_cluster_segment(const light_cluster *c, vec o, vec d, real t_end, real sigma, real phase_g, real slack) {
    vec w = vsub(c->center, o);
    real delta = vdot(w, d);
    vec e = vmad(d, -delta, w);
    real again = vdot(e, d);
    e = vmad(d, -again, e);
    delta = delta + again;
    real D2 = vdot(e, e), D = sqrt(D2), radius = c->radius + slack, per_D = R(1) / lmax(D, R(1e-18));
    /* The axis along the way from the centre to the closest point, along the ray, and across both. */
    real along_n = -vdot(c->axis, e) * per_D, along_d = vdot(c->axis, d), across = vdot(c->axis, vcross(e, d)) * per_D;
    real rho = sqrt(square(along_n) + square(along_d)), out_of_plane = square(across) / (R(1) + rho);
    real t0 = -delta, t1 = t_end - delta, versine = R(2);
    mask reached = (c->flux > R(0)) & (t_end > R(0)), planar = D > radius * R(0x1p-10f) + slack;
    for (int pass = 0; pass < LIGHT_TREE_PASSES; pass++) {
        versine = light_cluster_versine(c, radius, sqrt(fma(lclamp(R(0), t0, t1), lclamp(R(0), t0, t1), D2)));
        mask cuts = planar & (versine < R(1));
        real cosine = R(1) - versine, room = versine - out_of_plane, q = sqrt(lmax(room, R(0)) * (rho + cosine));
        real cos0 = along_n * cosine + along_d * q, sin0 = along_d * cosine - along_n * q;
        real cos1 = along_n * cosine - along_d * q, sin1 = along_d * cosine + along_n * q;
        real low = cos0 > R(0) ? D * sin0 / lmax(cos0, R(1e-18)) : R(-1e18);
        real high = cos1 > R(0) ? D * sin1 / lmax(cos1, R(1e-18)) : R(1e18);
        mask misses = (room < R(0)) | ((cos0 <= R(0)) & (cos1 <= R(0)) & (along_n <= R(0))) | (low > t1) | (high < t0);
        reached = reached & !(cuts & misses);
        t0 = cuts ? lmax(low, t0) : t0;
        t1 = cuts ? lmax(lmin(high, t1), t0) : t1;
    }
    real S2 = D2 + R(0.5) * square(radius), S = lmax(sqrt(S2), R(1e-18));
    real r0 = sqrt(fma(t0, t0, S2)), r1 = sqrt(fma(t1, t1, S2));
    real width = latan2(S * (t1 - t0), fma(t0, t1, S2)) / S;
    real t = (t0 * r1 + t1 * r0) / (r0 + r1), r = sqrt(fma(t, t, S2));
    real s = phase_g < R(0) ? -t / r : t / r;
    real turn = s > R(0) ? R(1) + s : S2 / (r * r * (R(1) - s));
    /* The mean over the cluster's depth: exp(radius) / (2 radius) where that is large. */
    real through = lexp(-sigma * lmax(delta + t + r - radius, R(0))) / fma(R(2) * sigma, radius, R(1));
    real f = lmax(hg_density(turn, fabs(phase_g)) * through, R(1e-12));
    real weight = c->flux / versine * width * f;
    return reached ? light_weight_held(weight) : R(0);
}

/* What a cluster would bring to p, on the side of normal n that `front` says, or of any in a medium. */
FN real light_cluster_point(const light_cluster *c, vec p, vec n, real front, mask in_medium, real slack) {
    vec w = vsub(p, c->center);
    real d2 = vdot(w, w), distance = sqrt(d2), radius = c->radius + slack;
    vec out = vscale(w, R(1) / lmax(distance, R(1e-18)));
    real versine = light_cluster_versine(c, radius, distance);
    vec off = vsub(out, c->axis);
    mask reached = (c->flux > R(0)) & ((versine >= R(2)) | (R(0.5) * vdot(off, off) <= versine));
    /* The largest cosine that a lamp of the cluster can arrive at. */
    real cosine = vdot(out, n);
    cosine = front > R(0) ? -cosine : cosine;
    real sine = lmin(radius / lmax(distance, R(1e-30)), R(1)), aside = sqrt((R(1) - sine) * (R(1) + sine));
    real most = fma(cosine, aside, sqrt(lmax(R(1) - square(cosine), R(0))) * sine);
    most = cosine >= aside ? R(1) : most;
    reached = reached & (in_medium | (most > R(-1e-5)) | (sine >= R(1)));
    mask any = in_medium | (sine >= R(1));
    most = any ? R(1) : lmax(most, R(1e-3));
    real weight = c->flux / versine * most / lmax(d2 + R(0.5) * square(radius), R(1e-30));
    return reached ? light_weight_held(weight) : R(0);
}

/* Of four weights one, by what is left of u; -1 where all are 0. *share: its probability. */
FN ireal light_tree_pick(const real *weight, real *u, real *share) {
    real total = R(0), count = R(0);
    for (int k = 0; k < 4; k++) {
        total = total + weight[k];
        count = weight[k] > R(0) ? count + R(1) : count;
    }
    real even = LIGHT_TREE_EVEN_SHARE / lmax(count, R(1));
    real per_total = (R(1) - LIGHT_TREE_EVEN_SHARE) / lmax(total, R(1e-37));
    real sum = R(0), from = R(0);
    ireal choice = I(-1);
    *share = R(1);
    for (int k = 0; k < 4; k++) {
        mask some = weight[k] > R(0), take = some & (*u >= sum);
        real p = fma(weight[k], per_total, even);
        from = take ? sum : from;
        *share = take ? p : *share;
        choice = take ? I(k) : choice;
        sum = some ? sum + p : sum;
    }
    *u = lclamp((*u - from) / *share, R(0), R(0.99999994));
    return choice;
}

/* What a lamp is chosen for: a segment of a ray through a medium, or a point. */
typedef struct {
    int is_point;      /* the same for all lanes */
    vec o, d;          /* segment: origin, direction; point: itself, normal */
    real t_end;        /* segment */
    const medium *m;   /* segment */
    real front;        /* point: the side of the normal from which light counts, 1 or -1 */
    mask in_medium;    /* point: light counts from all sides */
} light_query;

FN real light_cluster_weight(const light_cluster *c, const light_query *q, real sigma, real slack) {
    if (q->is_point) return light_cluster_point(c, q->o, q->d, q->front, q->in_medium, slack);
    return light_cluster_segment(c, q->o, q->d, q->t_end, sigma, q->m->g, slack);
}

/* `count` lamps from `first` on; 0 where none was found to reach. */
typedef struct {
    ireal first, count;
    real share; /* with what probability they were chosen */
} light_leaf;

/* Down from the root, where `other` is the weight of the lamps without a place, which are a leaf of their own. */
FN light_leaf light_tree_descend(const scene *s, const light_query *q, real other, real *u, mask live) {
    real sigma = q->is_point ? R(0) : cmean(q->m->sigma_t), slack = light_slack(q->o), weight[4];
    int placed = s->params->light_tree_lamps;
    ireal node = I(0);
    light_leaf leaf;
    leaf.first = leaf.count = I(0);
    leaf.share = R(1);
    mask inner = live;
    for (int level = 0; ANY(inner); level++) {
        for (int k = 0; k < 4; k++) {
            light_cluster c = light_cluster_of(s, node, k);
            weight[k] = light_cluster_weight(&c, q, sigma, slack);
        }
        if (level == 0 && ANY(live & (other > R(0)))) {
            real total = weight[0] + weight[1] + weight[2] + weight[3];
            real p = other / (other + lmax(total, R(1e-37)));
            p = total > R(0) ? fma(R(1) - RESERVOIR_EVEN_SHARE, p, R(0.5) * RESERVOIR_EVEN_SHARE) : R(1);
            p = other > R(0) ? p : R(0);
            mask away = split(u, p) & live;
            leaf.first = away ? I(placed) : leaf.first;
            leaf.count = away ? I(s->params->light_count - placed) : leaf.count;
            leaf.share = away ? p : R(1) - p;
            inner = inner & !away;
        }
        real v = *u, p;
        ireal k = light_tree_pick(weight, &v, &p);
        mask some = inner & (k >= I(0));
        ireal at = node * I(sizeof(b_light_node) / 4) + k;
        ireal child = gather_int(s->light_tree[0].child, some ? at : I(0));
        mask ends = some & (child < I(0));
        ireal code = ends ? I(-1) - child : I(0);
        *u = some ? v : *u;
        leaf.share = some ? leaf.share * p : leaf.share;
        leaf.first = ends ? code / I(LIGHT_LEAF_MOST) : leaf.first;
        leaf.count = ends ? code % I(LIGHT_LEAF_MOST) + I(1) : leaf.count;
        inner = some & (child >= I(0));
        node = inner ? child : I(0);
    }
    return leaf;
}

#endif

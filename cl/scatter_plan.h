/* scatter_plan.h -- how a pixel's samples will look for what hides a lamp from the fog along its camera ray: the pilot's
 * verdict, which costs one sample and is thrown away otherwise.
 */
#ifndef BRUME_SCATTER_PLAN_H
#define BRUME_SCATTER_PLAN_H

#include "beam_table.h"
#include "light_choice.h"
#include "medium.h"
#include "scene.h"
#include "traverse_wedge.h"

/* More nodes and leaves than this and the pilot's walk ends; fewer than PLAN_RASTER_VISITS and walks replace shadow
 * rays. Half a million thin branches take 235, a bunny 36, slats 12, a room 19. None is few enough to pay in pictures,
 * where what differs within a pixel is more than what the rays miss: rays that go together cost 10 ns each at 16 lanes.
 */
#define PLAN_VISITS 24
#ifndef PLAN_RASTER_VISITS
#define PLAN_RASTER_VISITS 0
#endif

/* An emitter is small where the square of its distance from the ray exceeds its area (over the probability with which
 * it is chosen among others) by this. */
#define SMALL_EMITTER R(100)

/* Closer to the ray than this share of the scene the lamp and the ray span no plane worth trusting. */
#define WEDGE_LEAST R(1e-4)

/* Positions along the ray that the pilot looks at. */
#define PILOT_POSITIONS 16

typedef union { ureal32 all; uint one[LANES]; } lanes_of_u32;

/* A segment and its medium. */
typedef struct {
    vec o, d;
    real t_end;
    medium m;
    ireal inside; /* the medium's id */
    mask primary; /* seen by the camera, not by a scattered path */
    rgb throughput; /* of the path so far: what free flights along the segment are drawn by */
    real before;    /* the way from the path's last scattering event to o, through null surfaces */
    real pdf;       /* with which a surface sent it off, per steradian; below 0: no ray of light shares what it meets */
} segment;

/* Lane k's plane and part of the ray. */
FN wedge wedge_take(const lanes_of_real *rows, int k) {
    wedge w;
    for (int a = 0; a < 3; a++) {
        w.lamp[a] = rows[a].one[k];
        w.x[a] = rows[3 + a].one[k];
        w.y[a] = rows[6 + a].one[k];
        w.z[a] = rows[9 + a].one[k];
    }
    w.D = rows[12].one[k];
    w.t0 = rows[13].one[k];
    w.t1 = rows[14].one[k];
    w.slack = rows[15].one[k];
    return w;
}

FN void wedge_store(const scene *s, const lamp *l, const beam *g, vec d, beam_interval i, lanes_of_real *rows) {
    vec z = vcross(g->n, d);
    rows[0].all = l->position.x; rows[1].all = l->position.y; rows[2].all = l->position.z;
    rows[3].all = g->n.x; rows[4].all = g->n.y; rows[5].all = g->n.z;
    rows[6].all = d.x; rows[7].all = d.y; rows[8].all = d.z;
    rows[9].all = z.x; rows[10].all = z.y; rows[11].all = z.z;
    rows[12].all = g->D;
    rows[13].all = i.t0;
    rows[14].all = i.t1;
    real reach = lmin(lmax(fabs(i.t0), fabs(i.t1)) + g->D, R(4 * s->params->scene_radius));
    real size = lmax(fabs(l->position.x), lmax(fabs(l->position.y), fabs(l->position.z)));
    rows[15].all = (size + reach) * R(0x1p-20f);
}

/* The surfaces at the ends of the segment touch the wedge without hiding anything. */
FN wedge wedge_between_ends(wedge w) {
    w.t0 += w.slack;
    w.t1 -= w.slack;
    return w;
}

/* One bit per position of each lane that something hides. */
FN void wedge_rasterize(const scene *s, const lanes_of_real *rows, const lanes_of_real *t, ireal count, mask live,
                        lanes_of_u32 *low, lanes_of_u32 *high) {
    lanes_of_ireal in, counts;
    in.all = live;
    counts.all = count;
    for (int k = 0; k < LANES; k++) {
        if (!in.one[k]) continue;
        wedge w = wedge_take(rows, k);
        wedge_positions p;
        p.count = (int)counts.one[k];
        for (int j = 0; j < ((p.count + 7) & ~7); j++)
            p.t[j >> 3].one[j & 7] = j < p.count ? t[j].one[k] : (real1)INFINITY;
        int visits = 0;
        ulong dark = wedge_dark(&s->geometry, &w, &p, &visits);
        low->one[k] = (uint)dark;
        high->one[k] = (uint)(dark >> 32);
    }
}

FN void plan_write(const scene *s, ireal way, mask live, __global uchar *row) {
    lanes_of_ireal in, ways, slots;
    in.all = live;
    ways.all = way;
    slots.all = s->plan_slot;
    EACH_LANE(k) {
        if (in.one[k]) row[slots.one[k]] = (uchar)ways.one[k];
    }
}

FN ireal plan_read(const scene *s, __global const uchar *row) {
    lanes_of_ireal p, slots;
    slots.all = s->plan_slot;
    EACH_LANE(k) p.one[k] = row[slots.one[k]];
    return p.all;
}

/* Lanes in whose lit interval several points of a lamp are worth their cost, and whose wedge is wide enough to walk. The
 * place on a large or near emitter is noise that more points of the segment don't remove. */
FN mask several_points(const lamp *l, const segment *at, const beam *g) {
    return at->primary & (!l->met | (l->density * square(g->D) > SMALL_EMITTER));
}

FN mask spans_plane(const scene *s, const beam *g) { return g->D > WEDGE_LEAST * R(s->params->scene_radius); }

/* PLAN_INTEGRAL where nothing is in the wedge nor as near to it as the pixel's other rays stray: nothing hides the lamp
 * from any of them. */
FN ireal plan_of_contents(const scene *s, const segment *at, const beam *g, beam_interval i,
                          const lanes_of_real *exact, mask live) {
    lanes_of_real rows[16];
    lanes_of_ireal in, way;
    for (int k = 0; k < 16; k++) rows[k] = exact[k];
    /* Filters reach about two pixels far. */
    real margin = R(4.0f * s->params->tan_x / s->params->width) * lmax(i.t1 + g->delta, R(0));
    /* Beside the ray the cone's rim lies elsewhere; the surfaces at the segment's ends hide nothing. */
    real start = -g->delta, end = at->t_end - g->delta, slack = rows[15].all, stray = margin / g->D;
    rows[13].all = i.t0 > start + slack ? i.t0 - fma(fabs(i.t0), stray, margin) : i.t0 + slack;
    rows[14].all = i.t1 < end - slack ? i.t1 + fma(fabs(i.t1), stray, margin) : i.t1 - slack;
    rows[15].all = slack + margin;
    in.all = live;
    way.all = I(PLAN_UNKNOWN);
    for (int k = 0; k < LANES; k++) {
        if (!in.one[k]) continue;
        wedge w = wedge_take(rows, k);
        wedge_contents c = wedge_survey(&s->geometry, &w, PLAN_RASTER_VISITS == 0, 1, PLAN_VISITS);
        if (c.touches == 0)
            way.one[k] = PLAN_INTEGRAL;
        else if (c.visits < PLAN_RASTER_VISITS)
            way.one[k] = PLAN_RASTER;
    }
    return way.all;
}

/* The more often light and shadow take turns along the ray, the more shadow rays. */
FN ireal plan_of_shadows(const scene *s, const lamp *l, const segment *at, const beam *g, beam_interval i, real u,
                         const lanes_of_real *rows, ireal way, mask live) {
    lanes_of_real t[PILOT_POSITIONS];
    lanes_of_u32 low, high;
    lanes_of_ireal in, ways;
    piecewise table = beam_table_of(g, l, i, grey_extinction(&at->m), at->m.g);
    for (int j = 0; j < PILOT_POSITIONS; j++) {
        real density, share = piecewise_warp(&table, (R(j) + u) * R(1.0 / PILOT_POSITIONS), &density);
        t[j].all = beam_equiangular(g, i, share);
    }
    low.all = high.all = U32(0);
    wedge_rasterize(s, rows, t, I(PILOT_POSITIONS), live, &low, &high);
    in.all = live;
    ways.all = way;
    EACH_LANE(k) {
        uint bits = low.one[k], all = (1u << PILOT_POSITIONS) - 1;
        int edges = (int)popcount((bits ^ (bits >> 1)) & (all >> 1));
        int rays = edges <= 1 ? PLAN_RAYS_2 : edges <= 5 ? PLAN_RAYS_4 : PLAN_RAYS_8;
        rays = ways.one[k] == PLAN_UNKNOWN ? rays : (int)ways.one[k];
        rays = bits == all ? PLAN_ONE : rays;
        ways.one[k] = in.one[k] ? rays : ways.one[k];
    }
    return ways.all;
}

/* Writes the plan for a lamp and its lit interval i; u: in [0, 1). Once a pixel: a call, so that it is not in the way of
 * what is done for each sample. */
CALL void plan_interval(const scene *s, const lamp *l, const segment *at, const beam *g, beam_interval i, real u,
                        __global uchar *row, mask live) {
    lanes_of_real rows[16];
    live = live & several_points(l, at, g) & spans_plane(s, g);
    if (!ANY(live)) return;
    wedge_store(s, l, g, at->d, i, rows);
    ireal way = plan_of_contents(s, at, g, i, rows, live);
    mask shaded = live & (way != I(PLAN_INTEGRAL));
    if (ANY(shaded)) way = plan_of_shadows(s, l, at, g, i, u, rows, way, shaded);
    plan_write(s, way, live, row);
}

#endif

/* scatter_emitter.h -- light of emitting surfaces and the environment along a segment through a medium.
 *
 * First a point of an emitter, or a direction to the environment; then the segment's points are chosen towards it as
 * towards a lamp (scatter_segment.h). A path can meet the same light by itself: by free flight to a point t and the
 * phase function's choice of a direction. Both ways count with weights that add up to 1 for every (t, place on the
 * emitter): the balance heuristic (Veach 1995) of densities that stand in for the true ones, because they can be told
 * from both sides.
 */
#ifndef BRUME_SCATTER_EMITTER_H
#define BRUME_SCATTER_EMITTER_H

#include "emitter.h"
#include "lamp.h"
#include "medium.h"
#include "equiangular.h"
#include "phase_hg.h"

#define SCATTERS_EMITTERS (FLIES && (HAS(AREA_LIGHTS) || HAS(ENVIRONMENT)) && STRATEGY_IS_PRODUCT)

/* An emitter as a lamp. `random`: x chooses, y and z place. */
FN lamp emitter_lamp(const scene *s, vec o, vec d, real t_end, random4 random, mask live) {
    lamp l;
    real share = environment_share(s);
    l.position = o;
    l.axis = d;
    l.intensity = cgrey(R(0));
    l.cutoff = R(PI / 2);
    l.inv_fade = R(1);
    l.v_cutoff = R(1);
    l.v_beam = R(0);
    l.cosine = l.cone = l.met = TRUE_MASK;
    l.directional = live & (unit(random.x) < share);
    l.density = R(1);
    l.light = I(-1);
    l.rays = R(0);
    if (HAS(ENVIRONMENT) && ANY(l.directional)) {
        real pdf;
        vec to = environment_sample(s, unit(random.y), unit(random.z), &pdf);
        l.axis = vselect(l.directional, vneg(to), l.axis);
        l.density = l.directional ? pdf * share : l.density;
        rgb radiance = environment_radiance(s, to);
        l.intensity = cselect(l.directional, cscale(radiance, R(1) / lmax(l.density, R(1e-30))), l.intensity);
    }
    mask near = live & !l.directional;
    if (HAS(AREA_LIGHTS) && s->params->emitter_count > 0 && ANY(near)) {
        ireal at = emitter_choose(s, unit(random.x), share, near);
        emitter_place on = emitter_place_of(s, at, o, d, t_end, TRUE_MASK, unit(random.y), unit(random.z), near);
        real per_area = luminance(on.radiance) / R(s->params->emitter_weight) * on.density;
        vec side = vsub(segment_nearest(o, d, t_end, on.point), on.point);
        /* What glows glows on one side. */
        side = vselect(vdot(side, on.facing) < R(0), on.facing, side);
        l.position = vselect(near, offset_origin(on.point, on.normal, side), l.position);
        l.axis = vselect(near, on.facing, l.axis);
        l.density = near ? per_area * (R(1) - share) : l.density;
        l.intensity = cselect(near, cscale(on.radiance, R(1) / lmax(l.density, R(1e-37))), l.intensity);
    }
    l.cone = l.cone & !l.directional;
    l.cosine = l.cosine & !l.directional;
    return l;
}

/* Where the path last scattered, and how: what the weight of meeting an emitter needs to know of it. */
typedef struct {
    vec before;       /* direction until then */
    real back, ahead; /* from there to the start and the end of that segment */
    real flight;      /* density of scattering there */
    real sigma, g;    /* grey extinction and mean cosine of the medium */
} flight_record;

FN flight_record flight_record_none(void) {
    flight_record r;
    r.before = vmake(R(0), R(0), R(1));
    r.back = r.ahead = r.flight = r.sigma = r.g = R(0);
    return r;
}

FN flight_record flight_record_select(mask m, flight_record a, flight_record b) {
    flight_record r;
    r.before = vselect(m, a.before, b.before);
    r.back = m ? a.back : b.back;
    r.ahead = m ? a.ahead : b.ahead;
    r.flight = m ? a.flight : b.flight;
    r.sigma = m ? a.sigma : b.sigma;
    r.g = m ? a.g : b.g;
    return r;
}

/* Weight of light that a path met at `point` of an emitting surface, after it scattered at x into direction d. */
FN real emitter_met_weight(const scene *s, const flight_record *r, vec x, vec d, ireal prim, ireal shape, vec point,
                           vec normal, mask live) {
    vec w = vsub(point, x);
    real along = vdot(w, r->before);
    real D = vlength(vmad(r->before, -along, w));
    real angle = equiangular_range_of(D, -r->back - along, r->ahead - along).width;
    real per_area = luminance(CGATHER(s->shapes, radiance, shape)) / R(s->params->emitter_weight);
    if (HAS(QUADRICS)) {
        mask quadric = live & (prim >= I(s->params->triangle_count));
        if (ANY(quadric)) {
            ireal q = quadric ? prim - I(s->params->triangle_count) : I(0);
            mask sphere = quadric & (GATHER_INT(s->geometry.quadrics, kind, q) == I(QUADRIC_SPHERE));
            vec center = VGATHER(s->geometry.quadrics, center, q);
            vec start = vmad(r->before, -r->back, x);
            real density = sphere_density(vsub(point, center), center, start, r->before, r->back + r->ahead);
            per_area = sphere ? density * per_area : per_area;
        }
    }
    per_area = per_area * (R(1) - environment_share(s));
    real cosine = fabs(vdot(normal, d));
    real by_light = per_area * D, by_path = r->flight * phase_hg(r->before, d, r->g) * cosine * angle;
    return by_path / lmax(by_path + by_light, R(1e-37));
}

/* The same for the environment. */
FN real environment_met_weight(const scene *s, const flight_record *r, vec d) {
    real along = lexp(-r->sigma * r->back) / transmittance_integral(r->sigma, r->back + r->ahead);
    real by_light = environment_pdf(s, d) * environment_share(s) * along;
    real by_path = r->flight * phase_hg(r->before, d, r->g);
    return by_path / lmax(by_path + by_light, R(1e-37));
}

#endif

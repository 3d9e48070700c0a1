/* beam_integral.h -- all the light that one lamp scatters along a lit interval that nothing hides: quadrature, no
 * noise.
 *
 * Gauss-Legendre with 8 nodes on each of three panels, cut at the edges of the spot's full beam, where the falloff has
 * its kinks. Such a rule converges like r^-16 where the integrand has no singularity within the ellipse around the
 * panel whose half axes add up to r times half its width (Trefethen 2013, ch. 19). Those that there are: the phase
 * function's peak at theta = -pi/2 (pi/2 for g < 0), off the real axis by 2 asinh((1 - |g|) / (2 sqrt |g|)); the
 * infinite end of the ray at pi/2; and the falloff's corner at the spot's axis. beam_integral says in `exact` where all
 * are far enough for a relative error below 3e-6; in the other lanes the caller samples instead.
 */
#ifndef BRUME_BEAM_INTEGRAL_H
#define BRUME_BEAM_INTEGRAL_H

#include "beam.h"
#include "medium.h"

/* Four nodes, where that is enough for the same error, or eight.
 *
 * Far enough: the distances from the singularity to both ends of the panel, in half widths. r + 1/r for r = 3.5, 2; the
 * second is for the end of the ray, where the integrand goes to 0 with all its derivatives. And what optical depth a
 * panel may span. Measured with 40 000 random panels, sigma D from 1e-6 to 100, |g| up to 0.99: 2.7e-6 at most. For
 * four nodes r is squared. */
#define INTEGRAL_POLE R(3.8)
#define INTEGRAL_END R(2.5)
#define INTEGRAL_DEPTH R(6)
#define INTEGRAL_POLE_4 R(12.3)
#define INTEGRAL_END_4 R(4.25)
#define INTEGRAL_DEPTH_4 R(1.5)

/* Of four nodes, then of eight: the positive ones. */
__constant float gauss_nodes[6] = {0.339981043584856265f, 0.861136311594052575f, 0.183434642495649805f,
                                   0.525532409916328986f, 0.796666477413626740f, 0.960289856497536232f};
__constant float gauss_weights[6] = {0.652145154862546143f, 0.347854845137453857f, 0.362683783378361983f,
                                     0.313706645877887287f, 0.222381034453374471f, 0.101228536290376259f};

/* Distances from x + i y to the ends of the panel middle +- half. */
FN real integral_reach(real middle, real half_width, real x, real y) {
    real a = x - (middle - half_width), b = x - (middle + half_width), y2 = square(y);
    return sqrt(fma(a, a, y2)) + sqrt(fma(b, b, y2));
}

typedef struct {
    rgb value; /* integral over theta of transmittance from the eye and to the lamp, falloff and phase function */
    mask exact;
} integral;

FN integral beam_integral(const beam *g, const lamp *l, beam_interval i, const medium *m) {
    integral sum;
    sum.value = cgrey(R(0));
    sum.exact = TRUE_MASK;
    real a = fabs(m->g);
    /* Panels are counted from the interval's start: of a narrow one far from x = 0 the ends would have no digits left.
     * Full beam ends about x = 0 or about a whole turn. */
    real center = (i.x0 > R(PI) ? R(2 * PI) : R(0)) - i.x0;
    real k = lclamp((l->v_beam - g->versine_out_of_plane) / lmax(R(2) * g->rho, R(1e-24)), R(0), R(1));
    real core = R(2) * latan2(sqrt(k), sqrt(R(1) - k));
    mask thirds = !l->cone | l->cosine;
    real cut0 = thirds ? i.width * R(1.0 / 3) : lclamp(center - core, R(0), i.width);
    real cut1 = thirds ? i.width * R(2.0 / 3) : lclamp(center + core, R(0), i.width);
    real out_of_plane = sqrt(R(2) * g->versine_out_of_plane);

    real theta0 = latan2(i.t0, g->D);
    real h = (R(1) - a) * R(0.5) / sqrt(lmax(a, R(1e-12)));
    real pole = R(2) * llog(h + sqrt(fma(h, h, R(1))));
    real peak = m->g < R(0) ? R(PI / 2) : R(-PI / 2);
    real thickest = cmax(m->sigma_t);
    int chromatic = HAS(CHROMATIC) ? ANY(!medium_is_grey(m)) : 0;

    for (int panel = 0; panel < 3; panel++) {
        real low = panel == 0 ? R(0) : panel == 1 ? cut0 : cut1, high = panel == 0 ? cut0 : panel == 1 ? cut1 : i.width;
        real half_width = R(0.5) * (high - low), middle = R(0.5) * (high + low);
        mask some = half_width > R(0);
        real hs = R(0), hc = R(1), es = R(0), ec = R(1);
        if (!ANY(some)) continue;
        real theta = theta0 + middle;
        /* a scalar's true is 1, which as a lane's mask selects nothing */
        mask fades = (panel != 1 ? TRUE_MASK : k <= R(0)) & !thirds;
        mask falls = l->cone & (fades | l->cosine);
        int fades_any = ANY(falls & some);
        real to_peak = a < R(1e-3) ? R(1e30) : integral_reach(theta, half_width, peak, pole);
        real to_corner = fades ? integral_reach(middle, half_width, center, out_of_plane) : R(1e30);
        real to_pole = lmin(to_peak, to_corner), to_end = R(2) * (R(PI / 2) - theta);
        /* The nodes' angles are the middle's plus and minus four others: sums of angles by sines and cosines, from the
         * nearer end of the interval, as in equiangular.h. */
        mask left = R(2) * middle < i.width;
        real end = left ? i.t0 : -i.t1, qs, qc, xs, xc;
        lsincos(left ? middle : i.width - middle, &qs, &qc);
        if (fades_any) lsincos(R(0.5) * (i.x0 + middle), &xs, &xc);
        for (int rule = 0; rule < 2; rule++) {
            int first = 2 * rule;
            mask far = (to_pole >= (rule ? INTEGRAL_POLE : INTEGRAL_POLE_4) * half_width) &
                       (to_end >= (rule ? INTEGRAL_END : INTEGRAL_END_4) * half_width);
            if (!ANY(some & far)) continue;
            real nearest = R(0), farthest = R(0);
            rgb part = cgrey(R(0));
            for (int node = 0; node < 4 << rule; node++) {
                if (!(node & 1)) {
                    lsincos(R(0.5f * gauss_nodes[first + (node >> 1)]) * half_width, &hs, &hc);
                    es = R(2) * hs * hc;
                    ec = fma(R(-2) * hs, hs, R(1));
                } else {
                    hs = -hs;
                    es = -es;
                }
                real es_q = left ? es : -es;
                real s = fma(qs, ec, qc * es_q), c = fma(qc, ec, -qs * es_q);
                beam_point p;
                p.t = g->D * (fma(end, c, g->D * s) / difference_of_products(g->D, c, end, s));
                p.t = lclamp(left ? p.t : -p.t, i.t0, i.t1);
                p.distance = sqrt(fma(p.t, p.t, square(g->D)));
                real way = beam_path(g, p.t, p.distance);
                nearest = node == 0 ? way : lmin(nearest, way);
                farthest = node == 0 ? way : lmax(farthest, way);
                real f = R(gauss_weights[first + (node >> 1)]) * hg_density(beam_turn(g, p.t, p.distance, m->g), a);
                if (fades_any) {
                    real sine = fma(xs, hc, xc * hs);
                    real v = g->versine_out_of_plane + R(2) * g->rho * square(sine);
                    f = falls ? f * lamp_falloff(l, v) : f;
                }
                real total = lmax(g->delta + way, R(0)); /* from the eye to the point to the lamp */
                if (chromatic)
                    part = cadd(part, cscale(medium_transmittance(m->sigma_t, total), f));
                else
                    part = cadd(part, cgrey(f * lexp(-m->sigma_t.r * total)));
            }
            far = some & far & (thickest * (farthest - nearest) <= (rule ? INTEGRAL_DEPTH : INTEGRAL_DEPTH_4));
            sum.value = cselect(far, cadd(sum.value, cscale(part, half_width)), sum.value);
            some = some & !far;
            if (!ANY(some)) break;
        }
        sum.exact = sum.exact & !some;
    }
    return sum;
}

#endif

/* fresnel.h -- the share of unpolarised light that a smooth interface reflects.
 *
 * Both formulas are arranged so that nothing cancels: the textbook's differences of cosines lose all digits near normal
 * incidence at an index near 1, at grazing angles, and where a conductor's index vanishes.
 *
 * Born & Wolf, "Principles of Optics", 1.5.2 (dielectrics) and 14.2 (conductors).
 */
#ifndef BRUME_FRESNEL_H
#define BRUME_FRESNEL_H

#include "vec.h"

/* A ray meets an interface from the side whose index is 1 towards one whose index is eta. */
typedef struct {
    real reflected;     /* share of the power; 1 in total reflection */
    real cos_t;         /* of the refracted ray, >= 0 */
    real inverse_eta;   /* 1 / eta: sin_t / sin_i */
} interface_split;

/* At cosine c >= 0, entering the medium of index `ior` or leaving it. With q = eta cos_t = sqrt(c^2 + eta^2 - 1):
 *     r_s = (c - q) / (c + q)                 = (1 - eta^2) / (c + q)^2
 *     r_p = (eta^2 c - q) / (eta^2 c + q)     = (eta^2 - 1) ((eta^2 + 1) c^2 - 1) / (eta^2 c + q)^2
 * Within 7e-7 for a cosine that is off by two ulp: near total reflection it is infinitely steep. */
FN interface_split fresnel_dielectric(real c, real ior, mask enters) {
    real excess = (ior - R(1)) * (ior + R(1)); /* ior^2 - 1 */
    real inverse = R(1) / ior;
    real eta2 = enters ? square(ior) : square(inverse);
    real eta2_less_1 = enters ? excess : -excess * eta2;
    real c2 = c * c;
    real q2 = c2 + eta2_less_1;
    real q = sqrt(lmax(q2, R(0)));
    real s = lmax(square(c + q), R(1e-30)), p = lmax(square(fma(eta2, c, q)), R(1e-30));
    real r_s = eta2_less_1 / s;
    real r_p = eta2_less_1 * fma(eta2 + R(1), c2, R(-1)) / p;

    interface_split f;
    f.inverse_eta = enters ? inverse : ior;
    f.cos_t = q * f.inverse_eta;
    f.reflected = q2 > R(0) ? lmin(R(0.5) * fma(r_s, r_s, r_p * r_p), R(1)) : R(1);
    return f;
}

/* One wavelength band of a conductor of index eta - i k, at cosine c in [0, 1]. With sin^2 = 1 - c^2 and
 * (a - i b)^2 = (eta - i k)^2 - sin^2:
 *     R_s = ((a - c)^2 + b^2) / ((a + c)^2 + b^2)
 *     R_p = R_s ((a c - sin^2)^2 + b^2 c^2) / ((a c + sin^2)^2 + b^2 c^2)
 * An index of 0 gives a = 0 exactly, and so a perfect mirror at every angle. */
FN real fresnel_conductor(real c, real eta, real k) {
    real c2 = c * c, sin2 = (R(1) - c) * (R(1) + c);
    real re = fma(eta - R(1), eta + R(1), fma(-k, k, c2)), im = R(2) * eta * k;
    /* the larger of a^2 and b^2 is a sum, the smaller follows from a b = im / 2 */
    real larger = R(0.5) * (sqrt(fma(re, re, im * im)) + fabs(re));
    real smaller = R(0.25) * im * im / lmax(larger, R(1e-30));
    real a = sqrt(re > R(0) ? larger : smaller);
    real b2 = re > R(0) ? smaller : larger;
    real ac = a * c, b2c2 = b2 * c2;
    real r_s = (square(a - c) + b2) / lmax(square(a + c) + b2, R(1e-30));
    /* of an index of 0, seen head-on, 0 / 0 */
    real r_p = r_s * (square(ac - sin2) + b2c2 + R(1e-30)) / (square(ac + sin2) + b2c2 + R(1e-30));
    return R(0.5) * (r_s + r_p);
}

FN rgb fresnel_conductor_rgb(real c, rgb eta, rgb k) {
    return cmake(fresnel_conductor(c, eta.r, k.r), fresnel_conductor(c, eta.g, k.g), fresnel_conductor(c, eta.b, k.b));
}

#endif

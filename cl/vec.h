/* vec.h -- points, directions and colours over the lane type.
 *
 * `vec` is a 3-vector, `rgb` a colour or any quantity per colour channel. Names: v... for vectors, c... for colours;
 * ...mad(a, s, b) is a * s + b in one rounding per component.
 */
#ifndef BRUME_VEC_H
#define BRUME_VEC_H

#include "lane.h"

typedef struct { real x, y, z; } vec;
typedef struct { real r, g, b; } rgb;

FN vec vmake(real x, real y, real z) { vec v; v.x = x; v.y = y; v.z = z; return v; }
FN vec vadd(vec a, vec b) { return vmake(a.x + b.x, a.y + b.y, a.z + b.z); }
FN vec vsub(vec a, vec b) { return vmake(a.x - b.x, a.y - b.y, a.z - b.z); }
FN vec vscale(vec a, real s) { return vmake(a.x * s, a.y * s, a.z * s); }
FN vec vneg(vec a) { return vmake(-a.x, -a.y, -a.z); }
FN vec vmad(vec a, real s, vec b) { return vmake(fma(a.x, s, b.x), fma(a.y, s, b.y), fma(a.z, s, b.z)); }
FN real vdot(vec a, vec b) { return fma(a.x, b.x, fma(a.y, b.y, a.z * b.z)); }
FN vec vselect(mask m, vec a, vec b) { return vmake(m ? a.x : b.x, m ? a.y : b.y, m ? a.z : b.z); }

/* a b - c d without cancellation: error below 1.5 ulp of the result (Kahan; Jeannerod, Louvet & Muller 2013). */
FN real difference_of_products(real a, real b, real c, real d) {
    real cd = c * d;
    return fma(a, b, -cd) + fma(-c, d, cd);
}

FN vec vcross(vec a, vec b) {
    return vmake(difference_of_products(a.y, b.z, a.z, b.y), difference_of_products(a.z, b.x, a.x, b.z),
                 difference_of_products(a.x, b.y, a.y, b.x));
}

FN real vlength(vec a) { return sqrt(vdot(a, a)); }
FN vec vnormalize(vec a) { return vscale(a, R(1) / sqrt(vdot(a, a))); }

/* One vector for all lanes, from an array in memory. */
FN vec vuniform(__global const float *p) { return vmake(R(p[0]), R(p[1]), R(p[2])); }

/* Element i of an array of packed float triples. */
FN vec vgather(__global const float *p, ireal i) {
    ireal j = i * I(3);
    return vmake(gather(p, j), gather(p, j + I(1)), gather(p, j + I(2)));
}

/* A float[3] field of element i of an array of structs. */
#define VGATHER(array, field, i) \
    vmake(GATHER(array, field[0], i), GATHER(array, field[1], i), GATHER(array, field[2], i))
#define CGATHER(array, field, i) \
    cmake(GATHER(array, field[0], i), GATHER(array, field[1], i), GATHER(array, field[2], i))

/* Tangents t, s that complete the unit vector n to a right-handed basis (Duff et al. 2017; right at n.z = -1 too). */
FN void orthonormal_basis(vec n, vec *t, vec *s) {
    real sign = copysign(R(1), n.z);
    real a = R(-1) / (sign + n.z);
    real b = n.x * n.y * a;
    *t = vmake(R(1) + sign * n.x * n.x * a, sign * b, -sign * n.x);
    *s = vmake(b, sign + n.y * n.y * a, -n.y);
}

FN rgb cmake(real r, real g, real b) { rgb c; c.r = r; c.g = g; c.b = b; return c; }
FN rgb cgrey(real x) { return cmake(x, x, x); }
FN rgb cadd(rgb a, rgb b) { return cmake(a.r + b.r, a.g + b.g, a.b + b.b); }
FN rgb csub(rgb a, rgb b) { return cmake(a.r - b.r, a.g - b.g, a.b - b.b); }
FN rgb cmul(rgb a, rgb b) { return cmake(a.r * b.r, a.g * b.g, a.b * b.b); }
FN rgb cscale(rgb a, real s) { return cmake(a.r * s, a.g * s, a.b * s); }
FN rgb cmad(rgb a, rgb b, rgb c) { return cmake(fma(a.r, b.r, c.r), fma(a.g, b.g, c.g), fma(a.b, b.b, c.b)); }
FN rgb cselect(mask m, rgb a, rgb b) { return cmake(m ? a.r : b.r, m ? a.g : b.g, m ? a.b : b.b); }
FN rgb cuniform(__global const float *p) { return cmake(R(p[0]), R(p[1]), R(p[2])); }
FN rgb cgather(__global const float *p, ireal i) {
    ireal j = i * I(3);
    return cmake(gather(p, j), gather(p, j + I(1)), gather(p, j + I(2)));
}

FN real cmax(rgb c) { real m = c.r > c.g ? c.r : c.g; return m > c.b ? m : c.b; }
FN real cmin(rgb c) { real m = c.r < c.g ? c.r : c.g; return m < c.b ? m : c.b; }
FN real cmean(rgb c) { return (c.r + c.g + c.b) * R(1.0 / 3); }
FN real luminance(rgb c) { return R(0.2126) * c.r + R(0.7152) * c.g + R(0.0722) * c.b; }
FN mask is_black(rgb c) { return (c.r == R(0)) & (c.g == R(0)) & (c.b == R(0)); }

FN real lmin(real a, real b) { return a < b ? a : b; }
FN real lmax(real a, real b) { return a > b ? a : b; }
FN real lclamp(real x, real low, real high) { return x < low ? low : (x > high ? high : x); }
FN real square(real x) { return x * x; }

#endif

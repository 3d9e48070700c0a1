/* facet_integral.c -- see facet_integral.h. */
#include "facet_integral.h"

#include <math.h>

#define PI 3.14159265358979323846
#define GOLD_ETA 0.2f
#define GOLD_K 3.9f

b_bsdf mirror_and_gold(int flags, double alpha_u, double alpha_v) {
    b_bsdf b = rough(flags, alpha_u, alpha_v);
    b.eta[1] = GOLD_ETA;
    b.k[1] = GOLD_K;
    return b;
}

/* Of gold by linear interpolation, off by 1e-9: complex roots take time. */
static double fresnel_gold(double cosine) {
    enum { STEPS = 1 << 15 };
    static double table[STEPS + 2];
    if (table[0] == 0)
        for (int i = 0; i <= STEPS + 1; i++) table[i] = twin_fresnel_conductor((double)i / STEPS, GOLD_ETA, GOLD_K);
    int i = (int)(cosine * STEPS);
    return table[i] + (table[i + 1] - table[i]) * (cosine * STEPS - i);
}

facet facet_of(const b_bsdf *b, direction wo, int grid, int i, int j) {
    double up = (i + fmod(0.5 + 0.6180339887498949 * j, 1)) / grid, down = 1 - up, phi = 2 * PI * j / grid;
    double less = up * up * up * (10 - 15 * up + 6 * up * up);
    double more = down * down * down * (10 - 15 * down + 6 * down * down);
    double r = b->flags & BSDF_BECKMANN ? sqrt(-2 * log(more)) : sqrt(less * (1 + more)) / more;
    double x = b->alpha_u * r * cos(phi), y = b->alpha_v * r * sin(phi), z = 1 / sqrt(1 + x * x + y * y);
    facet f = {{x * z, y * z, z}, {0, 0, 1}, 0, 60 * up * up * down * down * more / (grid * grid)};
    double cosine = fmin(dot(wo, f.m), 1);
    direction wi = {2 * cosine * f.m.x - wo.x, 2 * cosine * f.m.y - wo.y, 2 * cosine * f.m.z - wo.z};
    if (cosine <= 0 || wi.z <= 1e-9) return f;
    f.cosine = cosine;
    f.wi = wi;
    return f;
}

void moments_of(const b_bsdf *b, direction wo, int grid, moments out[2]) {
    double area = wo.z * (1 + twin_lambda(b, wo));
    out[0] = out[1] = (moments){0, 0, 0, 0};
    for (int i = 0; i < grid; i++)
        for (int j = 0; j < grid; j++) {
            facet f = facet_of(b, wo, grid, i, j);
            if (f.cosine == 0) continue;
            double seen = f.cosine / (f.m.z * area), carried = 1 / (1 + twin_lambda(b, f.wi));
            for (int channel = 0; channel < 2; channel++) {
                if (channel) carried *= fresnel_gold(f.cosine);
                double cut = fmin(carried * seen, MOST_WEIGHT);
                out[channel].visible += f.weight * seen * carried;
                out[channel].visible2 += f.weight * seen * carried * carried;
                out[channel].all += f.weight * cut;
                out[channel].all2 += f.weight * cut * cut;
            }
        }
}

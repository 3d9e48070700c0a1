/* bsdf_twin.h -- the surfaces of cl/bsdf*.h in double, from the textbook's formulas as they stand (complex Fresnel
 * coefficients, erf, Lambda), and the kernels that run the device's.
 */
#ifndef BSDF_TWIN_H
#define BSDF_TWIN_H

#include "device_test.h"
#include "../cl/shared.h"

typedef struct direction { double x, y, z; } direction;

direction polar(double theta, double phi);
double dot(direction a, direction b);
direction halfway(direction a, direction b);
/* As the device receives it. */
direction rounded(direction d, brume_precision precision);

/* A surface of `kind` in white; metals are perfect mirrors. */
b_bsdf white(int kind);
b_bsdf rough(int flags, double alpha_u, double alpha_v);

double twin_fresnel_dielectric(double cosine, double ior);
double twin_fresnel_conductor(double cosine, double eta, double k);
double twin_density(const b_bsdf *b, direction m);
double twin_lambda(const b_bsdf *b, direction w);
/* f |cos wi| per channel, and the density of sampling wi; not two-sided. */
double twin_eval(const b_bsdf *b, direction wo, direction wi, double f[3]);

typedef struct device_case {
    brume_precision precision;
    uint32_t lanes;
    const b_bsdf *bsdfs;
    size_t bsdf_count;
    const uint32_t *ids;  /* per element */
    size_t count;         /* a multiple of 16 */
    const double *wo;     /* planes x, y, z of `count` */
} device_case;

/* What the device says, malloc'ed: planes of f.r, f.g, f.b, pdf. */
double *device_eval(const device_case *c, const double *wi);
/* Planes wi.x, y, z, weight.r, g, b, pdf, eta, delta. u: planes of u_lobe, u, v. */
double *device_sample(const device_case *c, const double *u);
/* Planes m.x, y, z of the facets that those samples of rough conductors are mirrored in. */
double *device_facets(const device_case *c, const double *u);
enum { EVAL_PLANES = 4, SAMPLE_PLANES = 9 };
enum { WI_X, WI_Y, WI_Z, WEIGHT_R, WEIGHT_G, WEIGHT_B, PDF, ETA, DELTA };

#endif

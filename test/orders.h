/* orders.h -- light of one lamp in fog, perhaps over a floor, by the number of times it scatters: as a scene and as
 * numbers. The scene is built by the public interface; the numbers are computed in double, in three ways that share
 * nothing with the kernels: by walks from the lamp, by a rule for smooth integrands, and by the integral equation of
 * isotropic scattering.
 *
 * An order is the number of events, in the medium or at the floor: a render with max_depth d holds orders 1 to d - 1.
 */
#ifndef ORDERS_H
#define ORDERS_H

#include <stdint.h>

#include "brume.h"

enum { MOST_ORDERS = 4 };

typedef struct orders {
    const char *name;
    float sigma_t, albedo, g;
    float lamp[3];             /* of intensity 1, shines towards -z */
    float cutoff, beam;        /* degrees; cutoff 180: a point light */
    float eye[3], toward[3];   /* the ray; towards: any length */
    float reflectance;         /* of a diffuse floor at z = 0, seen from above; 0: there is none */
} orders;

/* The samples are independent. Destroyed by the caller. */
brume_scene *orders_scene(const orders *o, int max_depth);

typedef struct walk_sums {
    double mean[MOST_ORDERS], error[MOST_ORDERS]; /* of the orders 2, 3 ...; error: standard error of the mean */
} walk_sums;

/* Walks follow the light: events by free flight, at each a connection to the ray. */
walk_sums orders_by_walks(const orders *o, int walks, uint64_t seed);

/* Order 2 of a spot over a floor whose light doesn't touch the ray, or of a point light without a floor: a product rule
 * with `n` times as many nodes as is least. The integrands are smooth, so that more nodes tell the error. */
double orders_second(const orders *o, int n);

/* Order 2 or 3 of a point light where scattering is isotropic and there is no floor, to about 1e-6. What arrives at
 * distance R of the lamp after n events, J_n / 4 pi per steradian, obeys J_(n+1)(R) = sigma_s / (2 R) times the
 * integral over r of r J_n(r) (E1(sigma |R - r|) - E1(sigma (R + r))). */
double orders_isotropic(const orders *o, int order);

#endif

/* facet_integral.h -- what rough metal reflects in all, as an integral over its facets in double.
 *
 * With the slopes of the facet in units of roughness, r = tan / alpha, their share among all facets as one variable and
 * the turn phi as the other, the albedo seen from wo is the mean of
 *     F(wo.m) G1(wi) (wo.m)+ / (m.z A(wo))
 * over a lattice: smooth however smooth the metal, and nothing of how the device draws facets.
 */
#ifndef FACET_INTEGRAL_H
#define FACET_INTEGRAL_H

#include "bsdf_twin.h"

/* A perfect mirror in channel 0, gold in channel 1. */
b_bsdf mirror_and_gold(int flags, double alpha_u, double alpha_v);

/* A facet of the lattice, its cosine to wo and where that is mirrored (0 and up where out of sight or below the
 * horizon), and its weight in a mean over all facets. Closer nodes where facets are flattest and steepest. */
typedef struct facet { direction m, wi; double cosine, weight; } facet;

/* Number i, j of grid x grid. */
facet facet_of(const b_bsdf *b, direction wo, int grid, int i, int j);

/* What a sample carries, in the mean, and its square: sampling visible facets, where that mean is the albedo, and
 * sampling all facets, cut at MOST_WEIGHT. */
typedef struct moments { double visible, visible2, all, all2; } moments;

#define MOST_WEIGHT 16.0

/* Of the two channels. */
void moments_of(const b_bsdf *b, direction wo, int grid, moments out[2]);

#endif

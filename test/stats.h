/* stats.h -- what statistical tests share: p-values, chi-square with pooling, correction for many tests, and integrals
 * of densities over cells.
 *
 * A test compares p against stats_level(CONFIDENCE, number of tests): right code fails one program in a million draws
 * of its seeds; since the seeds are fixed, it either always passes or never. That the tests see what they should is
 * shown by test_stats, which plants biases and demands a rejection.
 */
#ifndef STATS_H
#define STATS_H

#include <stddef.h>

/* Probability that right code fails anywhere in one family of tests. */
#define CONFIDENCE 1e-6

/* Upper tail of the chi-square distribution, Q(dof / 2, x / 2). */
double stats_chi_square_tail(double x, double dof);

/* Two-sided p-values: standard normal, and Student's t. */
double stats_z_tail(double z);
double stats_t_tail(double t, double dof);

/* p of observed counts against expected ones (same total). Cells expecting fewer than 5 are pooled; a count where
 * nothing (< 1e-9) is expected gives p = 0. */
double stats_chi_square(const double *observed, const double *expected, size_t cells);

/* p of a sample mean against `expected` (t-test). */
double stats_mean(const double *values, size_t count, double expected);

/* The level for one of `tests` so that all together keep `confidence` (Sidak 1967). */
double stats_level(double confidence, size_t tests);

/* Integral of f over the rectangle: Gauss-Legendre 8 x 8, halved along both axes until the parts add up to `tolerance`
 * (absolute), 8 levels at most. */
typedef double stats_density(const void *user, double x, double y);
double stats_integrate(stats_density *f, const void *user, double x0, double x1, double y0, double y1,
                       double tolerance);

/* Node k, and its weight, of Gauss-Legendre's rule of 8 nodes in each of n equal parts of [0, length]. */
double stats_gauss_node(int k, int n, double length, double *weight);

/* A histogram of directions: `rows` bands of equal solid angle, z = cos theta from z0 to 1, times `columns` of phi. */
typedef struct direction_grid {
    int rows, columns;
    double z0;
} direction_grid;

int direction_cell(const direction_grid *grid, double x, double y, double z);

/* Chi-square of sampled unit directions against the density per steradian f(user, z, phi). Directions below z0 must not
 * occur (p = 0); samples with weight[i] == 0 (weight may be NULL) failed and are counted as the share that the density
 * misses from 1. */
double stats_directions(const direction_grid *grid, const double *x, const double *y, const double *z,
                        const double *weight, size_t count, stats_density *f, const void *user);

#endif

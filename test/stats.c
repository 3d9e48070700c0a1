/* stats.c -- see stats.h. Continued fractions and series: Abramowitz & Stegun 6.5, 26.5; Lentz's method. */
#include "stats.h"

#include <math.h>
#include <stdlib.h>

#define PI 3.14159265358979323846

enum { MAX_TERMS = 10000 };

/* Regularised upper incomplete gamma function Q(a, x). */
static double gamma_tail(double a, double x) {
    if (x <= 0) return 1;
    double scale = exp(-x + a * log(x) - lgamma(a));
    if (x < a + 1) {
        double term = 1 / a, sum = term;
        for (int n = 1; n < MAX_TERMS && fabs(term) > 1e-17 * fabs(sum); n++) sum += term *= x / (a + n);
        return 1 - sum * scale;
    }
    double b = x + 1 - a, c = 1e300, d = 1 / b, h = d;
    for (int n = 1; n < MAX_TERMS; n++) {
        double an = -n * (n - a);
        b += 2;
        d = 1 / (an * d + b);
        c = b + an / c;
        h *= d * c;
        if (fabs(d * c - 1) < 1e-16) break;
    }
    return h * scale;
}

/* Regularised incomplete beta function I_x(a, b), by the continued fraction that converges below the mean. */
static double beta_share(double a, double b, double x) {
    if (x <= 0) return 0;
    if (x >= 1) return 1;
    if (x > (a + 1) / (a + b + 2)) return 1 - beta_share(b, a, 1 - x);
    double scale = exp(lgamma(a + b) - lgamma(a) - lgamma(b) + a * log(x) + b * log(1 - x)) / a;
    double c = 1, d = 1 / (1 - (a + b) * x / (a + 1)), h = d;
    for (int m = 1; m < MAX_TERMS; m++) {
        double even = m * (b - m) * x / ((a + 2 * m - 1) * (a + 2 * m));
        d = 1 / (1 + even * d);
        c = 1 + even / c;
        h *= d * c;
        double odd = -(a + m) * (a + b + m) * x / ((a + 2 * m) * (a + 2 * m + 1));
        d = 1 / (1 + odd * d);
        c = 1 + odd / c;
        h *= d * c;
        if (fabs(d * c - 1) < 1e-16) break;
    }
    return scale * h;
}

double stats_chi_square_tail(double x, double dof) { return gamma_tail(dof / 2, x / 2); }
double stats_z_tail(double z) { return erfc(fabs(z) / sqrt(2)); }
double stats_t_tail(double t, double dof) { return beta_share(dof / 2, 0.5, dof / (dof + t * t)); }

double stats_chi_square(const double *observed, const double *expected, size_t cells) {
    double statistic = 0, pooled_observed = 0, pooled_expected = 0;
    int terms = 0;
    for (size_t i = 0; i < cells; i++) {
        if (expected[i] < 1e-9) {
            if (observed[i] > 0) return 0;
        } else if (expected[i] < 5) {
            pooled_observed += observed[i];
            pooled_expected += expected[i];
        } else {
            double d = observed[i] - expected[i];
            statistic += d * d / expected[i];
            terms++;
        }
    }
    if (pooled_expected >= 5) {
        double d = pooled_observed - pooled_expected;
        statistic += d * d / pooled_expected;
        terms++;
    } else if (pooled_observed > 40) {
        return 0; /* a Poisson count that expects < 5 exceeds 40 once in 1e24 */
    }
    return terms < 2 ? 1 : stats_chi_square_tail(statistic, terms - 1);
}

double stats_mean(const double *values, size_t count, double expected) {
    double mean = 0, square = 0;
    for (size_t i = 0; i < count; i++) mean += values[i];
    mean /= (double)count;
    for (size_t i = 0; i < count; i++) square += (values[i] - mean) * (values[i] - mean);
    double error = sqrt(square / (double)(count - 1) / (double)count);
    if (error == 0) return mean == expected;
    return stats_t_tail((mean - expected) / error, (double)(count - 1));
}

double stats_level(double confidence, size_t tests) { return -expm1(log1p(-confidence) / (double)tests); }

static const double nodes[4] = {0.1834346424956498, 0.5255324099163290, 0.7966664774136267, 0.9602898564975363};
static const double weights[4] = {0.3626837833783620, 0.3137066458778873, 0.2223810344533745, 0.1012285362903763};

double stats_gauss_node(int k, int n, double length, double *weight) {
    double half = length / (2 * n), x = nodes[k % 8 / 2];
    *weight = weights[k % 8 / 2] * half;
    return half * (2 * (k / 8) + 1 + (k % 2 ? x : -x));
}

static double gauss(stats_density *f, const void *user, double x0, double x1, double y0, double y1) {
    double sum = 0, hx = (x1 - x0) / 2, hy = (y1 - y0) / 2, mx = (x0 + x1) / 2, my = (y0 + y1) / 2;
    for (int i = 0; i < 8; i++) {
        double x = mx + (i & 1 ? hx : -hx) * nodes[i / 2];
        for (int j = 0; j < 8; j++) {
            double y = my + (j & 1 ? hy : -hy) * nodes[j / 2];
            sum += weights[i / 2] * weights[j / 2] * f(user, x, y);
        }
    }
    return sum * hx * hy;
}

static double refine(stats_density *f, const void *user, double x0, double x1, double y0, double y1, double tolerance,
                     double whole, int levels) {
    double mx = (x0 + x1) / 2, my = (y0 + y1) / 2;
    double a = gauss(f, user, x0, mx, y0, my), b = gauss(f, user, mx, x1, y0, my);
    double c = gauss(f, user, x0, mx, my, y1), d = gauss(f, user, mx, x1, my, y1);
    if (levels == 0 || fabs(a + b + c + d - whole) < tolerance) return a + b + c + d;
    return refine(f, user, x0, mx, y0, my, tolerance / 2, a, levels - 1) +
           refine(f, user, mx, x1, y0, my, tolerance / 2, b, levels - 1) +
           refine(f, user, x0, mx, my, y1, tolerance / 2, c, levels - 1) +
           refine(f, user, mx, x1, my, y1, tolerance / 2, d, levels - 1);
}

double stats_integrate(stats_density *f, const void *user, double x0, double x1, double y0, double y1,
                       double tolerance) {
    return refine(f, user, x0, x1, y0, y1, tolerance, gauss(f, user, x0, x1, y0, y1), 8);
}

int direction_cell(const direction_grid *grid, double x, double y, double z) {
    double phi = atan2(y, x);
    int row = (int)floor((z - grid->z0) / (1 - grid->z0) * grid->rows);
    int column = (int)floor((phi / (2 * PI) + 0.5) * grid->columns);
    if (z < grid->z0) return -1;
    row = row < grid->rows ? row : grid->rows - 1;
    column = column < 0 ? 0 : column < grid->columns ? column : grid->columns - 1;
    return row * grid->columns + column;
}

double stats_directions(const direction_grid *grid, const double *x, const double *y, const double *z,
                        const double *weight, size_t count, stats_density *f, const void *user) {
    size_t cells = (size_t)(grid->rows * grid->columns) + 1;
    double *observed = calloc(2 * cells, sizeof *observed), *expected = observed + cells, total = 0, p = 0;
    if (!observed) return 0;
    for (size_t i = 0; i < count; i++) {
        int cell = (int)cells - 1;
        if (!weight || weight[i] != 0) cell = direction_cell(grid, x[i], y[i], z[i]);
        if (cell < 0) goto cleanup;
        observed[cell]++;
    }
    for (int r = 0; r < grid->rows; r++)
        for (int c = 0; c < grid->columns; c++) {
            double z0 = grid->z0 + (1 - grid->z0) * r / grid->rows;
            double z1 = grid->z0 + (1 - grid->z0) * (r + 1) / grid->rows;
            double phi = 2 * PI * ((double)c / grid->columns - 0.5);
            double share = stats_integrate(f, user, z0, z1, phi, phi + 2 * PI / grid->columns, 1e-8);
            expected[r * grid->columns + c] = share * (double)count;
            total += share;
        }
    if (total > 1 + 1e-5) goto cleanup; /* more than everything: not a density */
    expected[cells - 1] = total < 1 - 1e-5 ? (1 - total) * (double)count : 0;
    p = stats_chi_square(observed, expected, cells);
cleanup:
    free(observed);
    return p;
}

/* affine.c -- affine maps in double: from object to world space before anything is rounded to float. */
#include "affine.h"

#include <math.h>

double brume_dot(const double a[3], const double b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

void brume_cross(const double a[3], const double b[3], double out[3]) {
    double x = a[1] * b[2] - a[2] * b[1], y = a[2] * b[0] - a[0] * b[2], z = a[0] * b[1] - a[1] * b[0];
    out[0] = x;
    out[1] = y;
    out[2] = z;
}

double brume_normalize(double v[3]) {
    double length = sqrt(brume_dot(v, v));
    for (int i = 0; i < 3 && length > 0; i++)
        v[i] /= length;
    return length;
}

void brume_store(const double v[3], float out[3]) {
    for (int i = 0; i < 3; i++)
        out[i] = (float)v[i];
}

double brume_affine_determinant(const float m[16]) {
    return m[0] * ((double)m[5] * m[10] - (double)m[6] * m[9]) - m[1] * ((double)m[4] * m[10] - (double)m[6] * m[8]) +
           m[2] * ((double)m[4] * m[9] - (double)m[5] * m[8]);
}

void brume_affine_column(const float m[16], int column, double out[3]) {
    for (int i = 0; i < 3; i++)
        out[i] = m[4 * i + column];
}

void brume_affine_vector(const float m[16], const float v[3], double out[3]) {
    for (int i = 0; i < 3; i++)
        out[i] = (double)m[4 * i] * v[0] + (double)m[4 * i + 1] * v[1] + (double)m[4 * i + 2] * v[2];
}

void brume_affine_point(const float m[16], const float p[3], double out[3]) {
    brume_affine_vector(m, p, out);
    for (int i = 0; i < 3; i++)
        out[i] += m[4 * i + 3];
}

void brume_affine_normal(const float m[16], const float n[3], double out[3]) {
    /* The cofactor matrix, whose columns are cross products of the columns, is determinant times inverse transpose. */
    double c[3][3], cofactors[3][3];
    for (int i = 0; i < 3; i++)
        brume_affine_column(m, i, c[i]);
    for (int i = 0; i < 3; i++)
        brume_cross(c[(i + 1) % 3], c[(i + 2) % 3], cofactors[i]);
    double side = brume_affine_determinant(m) < 0 ? -1 : 1;
    for (int i = 0; i < 3; i++)
        out[i] = side * (cofactors[0][i] * n[0] + cofactors[1][i] * n[1] + cofactors[2][i] * n[2]);
}

void brume_affine_axes(const float m[16], double x[3], double y[3], double z[3]) {
    double given_x[3];
    brume_affine_column(m, 0, given_x);
    brume_affine_column(m, 1, y);
    brume_affine_column(m, 2, z);
    brume_normalize(z);
    double along = brume_dot(y, z);
    for (int i = 0; i < 3; i++)
        y[i] -= along * z[i];
    brume_normalize(y);
    brume_cross(y, z, x);
    double side = brume_dot(x, given_x) < 0 ? -1 : 1;
    for (int i = 0; i < 3; i++)
        x[i] *= side;
}

/* affine.h -- affine maps of a scene (float, 4x4, row-major) applied in double. */
#ifndef BRUME_AFFINE_H
#define BRUME_AFFINE_H

/* Of the linear part: negative where the map mirrors. */
double brume_affine_determinant(const float m[16]);

void brume_affine_column(const float m[16], int column, double out[3]);
void brume_affine_point(const float m[16], const float p[3], double out[3]);
void brume_affine_vector(const float m[16], const float v[3], double out[3]);

/* Times the inverse transpose of the linear part, up to a positive factor: a normal stays at right angles to its
 * surface, and on its side of it even where the map mirrors. */
void brume_affine_normal(const float m[16], const float n[3], double out[3]);

/* Orthonormal columns x, y, z closest in turn to the map's z, y and x (which may mirror), for maps that differ from a
 * rotation by a factor and by rounding. */
void brume_affine_axes(const float m[16], double x[3], double y[3], double z[3]);

double brume_dot(const double a[3], const double b[3]);
void brume_cross(const double a[3], const double b[3], double out[3]);
/* Makes v a unit vector, returns its length; 0 stays 0. */
double brume_normalize(double v[3]);
/* Rounds to float. */
void brume_store(const double v[3], float out[3]);

#endif

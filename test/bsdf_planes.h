/* bsdf_planes.h -- the surfaces and directions of many elements at once, as the kernels of bsdf_twin.h take them: what
 * test_bsdf and test_bsdf_specular share.
 */
#ifndef BSDF_PLANES_H
#define BSDF_PLANES_H

#include "bsdf_twin.h"

#define PI 3.14159265358979323846
#define LAST_UNIT (1 - 0x1p-24) /* the largest variate of 24 bits */

enum { COUNT = 1 << 14 };

/* Per element: the number of its surface; planes x, y, z of directions, and of variates. */
extern uint32_t ids[COUNT];
extern double wo[3 * COUNT], wi[3 * COUNT], u[3 * COUNT];

direction at(const double *planes, size_t i);
void put(double *planes, size_t i, direction d);

/* The device's. */
double epsilon(brume_precision precision);

#endif

/* bsdf_planes.c -- see bsdf_planes.h. */
#include "bsdf_planes.h"

#include <float.h>

uint32_t ids[COUNT];
double wo[3 * COUNT], wi[3 * COUNT], u[3 * COUNT];

direction at(const double *planes, size_t i) {
    direction d = {planes[i], planes[COUNT + i], planes[2 * COUNT + i]};
    return d;
}

void put(double *planes, size_t i, direction d) {
    planes[i] = d.x;
    planes[COUNT + i] = d.y;
    planes[2 * COUNT + i] = d.z;
}

double epsilon(brume_precision precision) {
    return precision == BRUME_PRECISION_DOUBLE ? DBL_EPSILON : FLT_EPSILON;
}

/* heuristic.h -- how two techniques that find the same light share it: weights that add up to one (Veach 1997, ch. 9). */
#ifndef BRUME_HEURISTIC_H
#define BRUME_HEURISTIC_H

#include "math.h"

/* Of the technique with density a, against one with density b. */
FN real power_heuristic(real a, real b) {
    real r = b / lmax(a, R(1e-37));
    return R(1) / fma(r, r, R(1));
}

/* What a medium scatters at y, a lamp's light, is seen from a surface point x by paths that leave x with density `pdf`
 * per steradian and gather the lamp's light equiangularly; and by connecting x to rays of light that leave the lamp with
 * density `rays`, equiangularly, too (path_bounce.h). By the theorem of sines the ratio of the two densities at y is
 * that of pdf |y - lamp| and rays |y - x|, but for the widths of the angles. Returns the weight of the path; that of the
 * connection is this with the two changed. */
FN real shared_with_rays(real pdf, real from_lamp, real rays, real from_surface) {
    return power_heuristic(pdf * from_lamp, rays * from_surface);
}

#endif

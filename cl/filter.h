/* filter.h -- the reconstruction filter, by importance: a sample's position is drawn around its pixel's centre in
 * proportion to the filter's magnitude (Ernst, Stamminger & Greiner 2006), so that samples belong to one pixel.
 *
 * filter[0 ... filter_size]: the offset in pixels at u = i / filter_size, linear in between; then how many positive
 * zeros the filter has, then these zeros in ascending order: the sign flips at each.
 */
#ifndef BRUME_FILTER_H
#define BRUME_FILTER_H

#include "scene.h"

#define MAX_FILTER_ZEROS 32

typedef struct {
    real offset, sign;
} filter_offset;

FN filter_offset filter_sample(const scene *s, real u) {
    filter_offset f;
    f.sign = R(1);
    int size = s->params->filter_size;
    if (size == 0) {
        f.offset = u - R(0.5);
        return f;
    }
    real at = u * R(size);
    ireal i = to_ireal(at);
    i = i < I(size) ? i : I(size - 1);
    real low = gather(s->filter, i), high = gather(s->filter, i + I(1));
    f.offset = fma(at - to_real(i), high - low, low);
    int zeros = (int)s->filter[size + 1];
    zeros = zeros < MAX_FILTER_ZEROS ? zeros : MAX_FILTER_ZEROS;
    for (int k = 0; k < zeros; k++) f.sign = fabs(f.offset) > R(s->filter[size + 2 + k]) ? -f.sign : f.sign;
    return f;
}

#endif

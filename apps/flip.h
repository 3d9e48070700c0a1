/* flip.h -- the error that an eye sees between two pictures flipped at the same place. */
#ifndef FLIP_H
#define FLIP_H

#include <stddef.h>

/* A display of 3840 pixels on 0.7 m, seen from 0.7 m: the paper's. */
#define FLIP_PIXELS_PER_DEGREE 67.02064

/* LDR-FLIP (Andersson, Nilsson, Akenine-Moller, Oskarsson, Astrom & Fairchild, "FLIP: A Difference Evaluator for
 * Alternating Images", 2020): 0 for the same picture to 1 for the worst difference, a pixel each in `map` (which may be
 * NULL), and the mean as result. Both pictures are linear RGB, 3 floats a pixel, multiplied by `exposure` and cut to
 * [0, 1] first, which is what a display shows of them. -1 if memory ran out. */
double flip_compute(const float *reference, const float *picture, size_t width, size_t height, double exposure,
                    double pixels_per_degree, float *map);

#endif

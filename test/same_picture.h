/* same_picture.h -- two renders of what should look alike, PIXELS x PIXELS, compared in bits or in standard errors.
 *
 * The pixels' differences are independent, so their mean over the picture and over each quarter of it, per channel, is
 * 0 within PICTURE_MOST_ERRORS of its standard errors (p = 1e-7 for six sigma, some hundreds of them in all), and
 * PICTURE_DRIFT for rounding.
 */
#ifndef SAME_PICTURE_H
#define SAME_PICTURE_H

#include "known_answer.h"

#define PICTURE_DRIFT 5e-6
#define PICTURE_MOST_ERRORS 6.0

enum { PICTURE_VALUES = PIXELS * PIXELS * 3 };

typedef struct picture {
    float mean[PICTURE_VALUES], variance[PICTURE_VALUES]; /* of the mean */
} picture;

/* Renders and destroys the scene, whose film is of that size; fails the test if a sample is bad. */
void picture_render(brume_scene *scene, picture *out);

/* How many values are not the others times `factor`, a power of two. */
int picture_differing(const picture *a, const picture *b, double factor);

/* The worst mean difference, beyond drift, in standard errors. */
double picture_errors_apart(const picture *a, const picture *b);

#endif

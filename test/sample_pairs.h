/* sample_pairs.h -- the same samples rendered twice, by two precisions or two devices, and compared one by one. */
#ifndef SAMPLE_PAIRS_H
#define SAMPLE_PAIRS_H

#include "brume.h"

enum { SAMPLE_PAIRS_SIDE = 32, SAMPLE_PAIRS_LEVELS = 4 };

/* Who renders: at `lanes`, 0 for what suits the device. */
typedef struct sample_maker {
    brume_device *device;
    brume_precision precision;
    uint32_t lanes;
} sample_maker;

typedef struct sample_pairs {
    uint32_t count;                        /* of samples compared */
    uint32_t different;                    /* in any bit of any colour */
    uint32_t above[SAMPLE_PAIRS_LEVELS];   /* off by more than 1e-5, 1e-4, 1e-3, 1e-2, relative, in any colour */
    double mean;                           /* of the second maker's, over samples and colours */
    double worst;                          /* largest absolute difference, of this sample: */
    uint32_t worst_x, worst_y, worst_sample;
    uint64_t bad;                          /* NaN or infinite */
    const char *message;                   /* what failed, or NULL */
} sample_pairs;

/* Samples 0 ... samples - 1 of the pixels in the middle of the picture, SAMPLE_PAIRS_SIDE squared or fewer. */
sample_pairs sample_pairs_compare(brume_context *context, const brume_scene *scene, const sample_maker makers[2],
                                  uint32_t samples);

#endif

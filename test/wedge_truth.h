/* wedge_truth.h -- brute force in double for wedge_batch: whether rounding excuses where wedge and shadow rays differ.
 *
 * Only if moving lamp or point by some units of the last place of their coordinates makes an occluder come or go.
 */
#ifndef WEDGE_TRUTH_H
#define WEDGE_TRUTH_H

#include "wedge_batch.h"

typedef struct wedge_tally {
    int positions, dark;            /* looked at; dark by shadow rays */
    int extra, missed, unexcused;   /* dark by the wedge alone, by the rays alone; without an excuse */
    int open, wrongly_open, wrongly_shut; /* wedges */
} wedge_tally;

/* Of what wedge_compute has left. slack: how far lamp and point are moved, at most. */
wedge_tally wedge_judge(const test_mesh *m, double slack);

#endif

/* checkpoint_state.h -- what a checkpoint holds behind its head and its film, unpacked, and whether all its numbers fit
 * each other: with a state that comes out of here a render goes on without a look at them. Pure host code.
 */
#ifndef BRUME_CHECKPOINT_STATE_H
#define BRUME_CHECKPOINT_STATE_H

#include "checkpoint.h"
#include "film.h"
#include "sample_allocation.h"

typedef struct brume_checkpoint_state {
    brume_error_estimate estimate; /* if head.error_estimate */
    uint32_t *done, *ends;         /* height x width; NULL without head.has_counts */
    brume_allocation *allocation;  /* NULL without head.has_allocation */
    int32_t *schedule;             /* of the pass under way, if it is one of some pixels only; else NULL */
    size_t schedule_size;          /* in bytes */
    uint32_t pass_groups;          /* that take part in the pass */
} brume_checkpoint_state;

/* Whether a head's numbers are some that a render can have. */
int brume_checkpoint_head_is_valid(const brume_checkpoint_head *head);

/* independent: as in brume_error_estimate. BRUME_ERROR_CHECKPOINT, with a message that begins with `path`, if what is
 * there does not fit the head. */
brume_result brume_checkpoint_state_make(brume_context *context, const char *path, const brume_checkpoint *checkpoint,
                                         int independent, brume_checkpoint_state *out);
void brume_checkpoint_state_free(brume_checkpoint_state *state);

/* For a pass of adaptive sampling at `samples_done`, malloc'ed, `size` bytes: the slots of the pixels that take part,
 * side by side as they lie in the film, whatever lies between them, so that all lanes have work; in groups, the last
 * filled up with -1. NULL: no memory. */
int32_t *brume_schedule_make(const brume_film_layout *layout, const uint32_t *done, const uint32_t *ends,
                             uint32_t samples_done, size_t *size);

#endif

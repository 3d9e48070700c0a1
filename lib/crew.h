/* crew.h -- several devices that share a render.
 *
 * The film lies on the host. A launch is cut into chunks of groups, which devices take from one queue, faster ones larger
 * and more of them: each uploads what the film has of its chunk, renders on, and hands it back when all of it is done.
 * Pixels get their samples in the same order as on one device, so that which device rendered what does not show. A
 * device that fails has changed nothing: the others do its chunk.
 */
#ifndef BRUME_CREW_H
#define BRUME_CREW_H

#include "device.h"

struct brume_arrays;
struct brume_render;
typedef struct brume_crew brume_crew;

/* The parts of a film. */
typedef enum brume_film_part {
    BRUME_FILM_PLANES,
    BRUME_FILM_BAD,     /* BAD_SIZE numbers */
    BRUME_FILM_PLAN,
    BRUME_FILM_SCHEDULE
} brume_film_part;

/* The scene and a program on each member of render->device, and an empty film; sets render->crew. Devices that fail are
 * left out with a warning; if all do, so does this. */
brume_result brume_crew_create(struct brume_render *render, const struct brume_arrays *arrays);
void brume_crew_destroy(struct brume_render *render);

/* Where a part of the film lies, as a device would hold it; and that the caller has changed it. */
void *brume_crew_film(brume_crew *crew, brume_film_part part);
void brume_crew_changed(brume_crew *crew, brume_film_part part);

/* As brume_render_launch. A device that fails takes no part any more, until brume_crew_revive; the code is not
 * CL_SUCCESS if none is left: then some of the groups are in the film, as a whole, and others are not at all. */
cl_int brume_crew_launch(struct brume_render *render, uint32_t group, uint32_t groups, uint32_t first,
                         uint32_t samples, cl_uint mode);

/* All take part again. */
void brume_crew_revive(brume_crew *crew);

/* Groups that keep all of them busy. */
size_t brume_crew_least_groups(const brume_crew *crew);

/* One that takes part, with the scene's buffers; if there is none, any. */
const struct brume_render *brume_crew_any(const brume_crew *crew);

/* What the crew's programs came to, into render->stats. */
void brume_crew_add_stats(struct brume_render *render);

/* Says who has done how much. */
void brume_crew_report(const struct brume_render *render);

/* For tests: groups that a member has rendered, times samples. */
double brume_crew_work(const brume_crew *crew, uint32_t member);

#endif

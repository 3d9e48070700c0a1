/* break_off.h -- renders that stop in their middle, after a launch. */
#ifndef TEST_BREAK_OFF_H
#define TEST_BREAK_OFF_H

#include "render.h"

/* Goes on for `reports` launches of `groups` groups: BRUME_CANCELLED, as run returns it, or what came of it. */
brume_result break_off_after(brume_render *render, uint32_t groups, int reports);

/* Goes on into the middle of a pass whose samples go where the error is, in launches of `groups` groups: BRUME_OK;
 * BRUME_ERROR_ARGUMENT if the render is done before that; or what failed: asked again, it goes on. */
brume_result break_off_in_a_pass(brume_render *render, uint32_t groups);

#endif

/* ball.h -- the smallest scenes that show something: a ball before the camera, and a lamp. */
#ifndef BALL_H
#define BALL_H

#include "brume.h"

/* The lamp where the camera is. Fails the test if it can't be made; brume_scene_destroy it. */
brume_scene *ball_scene(brume_context *context, uint32_t width, uint32_t height);

/* All in fog, and the lamp above the camera, a point or a spot that points where the camera looks; BRUME_LIGHT_CONSTANT:
 * a sky and no fog, which takes other kernels. May be made in any thread. */
brume_result ball_in_fog(brume_context *context, brume_light_kind lamp, uint32_t width, uint32_t height,
                         brume_scene **out);

#endif

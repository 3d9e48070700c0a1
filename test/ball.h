/* ball.h -- the smallest scene that shows something: a ball before the camera, lit by a lamp where the camera is. */
#ifndef BALL_H
#define BALL_H

#include "brume.h"

/* Fails the test if it can't be made; brume_scene_destroy it. */
brume_scene *ball_scene(brume_context *context, uint32_t width, uint32_t height);

#endif

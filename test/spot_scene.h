/* spot_scene.h -- a ball on a floor under a spotlight, in a small picture, with more by choice: what tests of whole
 * renders render. */
#ifndef SPOT_SCENE_H
#define SPOT_SCENE_H

#include <stddef.h>

#include "open_device.h"

enum { WIDTH = 33, HEIGHT = 21, PIXELS = WIDTH * HEIGHT };

enum spot_part {
    PART_FOG = 1,   /* around all, and the camera in it */
    PART_AREA = 2,  /* an emitting rectangle */
    PART_GLASS = 4, /* the ball is of it */
    PART_CLOUD = 8, /* a box of another medium, which glows, behind a null surface */
    PART_SKY = 16   /* a constant environment */
};

/* With a set of spot_parts; 8 samples and 6 edges at most. The camera stands at z = -6 and looks along +z. */
brume_scene *spot_scene(brume_context *owner, unsigned parts);

/* Its radiance, PIXELS x 3; all samples have to be there and none be bad. */
void spot_render(const brume_scene *scene, const brume_render_desc *desc, float *radiance);

/* All values have to be finite. */
double spot_mean(const float *x, size_t count);

#endif

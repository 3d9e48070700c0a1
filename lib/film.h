/* film.h -- where a pixel's values lie on the device, and how sums become channels. */
#ifndef BRUME_FILM_H
#define BRUME_FILM_H

#include "context.h"

/* A group is a tile of `lanes` pixels, rendered by one work-item; groups go row by row over the crop. */
typedef struct brume_film_layout {
    uint32_t width, height;           /* of the crop */
    uint32_t tile_width, tile_height; /* lanes = tile_width * tile_height */
    uint32_t tiles_x, group_count;
} brume_film_layout;

brume_film_layout brume_film_layout_make(uint32_t width, uint32_t height, uint32_t lanes);

/* Slots: group_count * lanes, some of them outside the crop. */
size_t brume_film_slot_count(const brume_film_layout *layout);

/* Where a pixel of the crop lies in a plane. */
size_t brume_film_slot_of(const brume_film_layout *layout, uint32_t x, uint32_t y);

/* What a film records, by number: 0 the radiance alone, 1 with guides, 2 with those and the parts of the light; and the
 * planes that it takes. */
size_t brume_film_plane_count(uint32_t recorded);

/* planes: FILM_PLANES, FILM_GUIDE_PLANES or FILM_LAYER_PLANES times the slot count, as read from the device. out:
 * height x width x (3 or 1) floats. filter_weight: b_params.filter_weight. */
void brume_film_resolve(const brume_film_layout *layout, const float *planes, float filter_weight,
                        brume_channel channel, float *out);

/* Values of a channel from the film's unit of light, in the scene's, to the scene's. A variance too large for a float
 * comes out as the largest. */
void brume_film_to_scene_light(double light_unit, brume_channel channel, float *values, size_t count);

#endif

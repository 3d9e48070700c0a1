/* channel.h -- the channels of a film, whoever holds it. brume_channel_name is public. */
#ifndef BRUME_CHANNEL_H
#define BRUME_CHANNEL_H

#include "brume.h"

/* Floats of a pixel, 0: there is no such channel. */
int brume_channel_size(brume_channel channel);

/* Whether a film that records so much (as for brume_film_plane_count) has it. */
int brume_channel_is_recorded(uint32_t recorded, brume_channel channel);

#endif

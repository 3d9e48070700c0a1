/* picture.h -- what a picture file is made from: a render's film, or the films of several added up. */
#ifndef BRUME_PICTURE_H
#define BRUME_PICTURE_H

#include "context.h"

typedef struct brume_picture_source {
    brume_context *context;
    brume_render_stats stats; /* as of now */
    uint32_t recorded; /* as for brume_film_plane_count */
    uint32_t alpha, half, sampler;
    const char *device;
    float world_to_camera[16], world_to_ndc[16];
    brume_result (*read)(void *of, brume_channel channel, float *out, size_t count);
    brume_result (*denoise)(void *of, brume_denoise what, float *rgb); /* NULL: can't be */
    void *of;
} brume_picture_source;

/* By the path's extension; desc NULL: the defaults. `caller` is named in messages. */
brume_result brume_picture_write(const brume_picture_source *source, const char *caller, const char *path,
                                 const brume_picture_desc *desc);

#endif

/* render_film.c -- the bytes of a render's film: on its device, or on the host while several devices share it. */
#include <string.h>

#include "crew.h"
#include "render.h"

static cl_mem buffer_of(const brume_render *r, brume_film_part part) {
    const cl_mem buffers[] = {[BRUME_FILM_PLANES] = r->planes, [BRUME_FILM_BAD] = r->bad, [BRUME_FILM_PLAN] = r->plan,
                              [BRUME_FILM_SCHEDULE] = r->schedule};
    return buffers[part];
}

cl_int brume_render_get(const brume_render *r, brume_film_part part, size_t at, size_t size, void *out) {
    if (!r->crew)
        return clEnqueueReadBuffer(r->device->queue, buffer_of(r, part), CL_TRUE, at, size, out, 0, NULL, NULL);
    memcpy(out, (const char *)brume_crew_film(r->crew, part) + at, size);
    return CL_SUCCESS;
}

cl_int brume_render_put(brume_render *r, brume_film_part part, size_t at, size_t size, const void *bytes) {
    if (!r->crew)
        return clEnqueueWriteBuffer(r->device->queue, buffer_of(r, part), CL_TRUE, at, size, bytes, 0, NULL, NULL);
    memcpy((char *)brume_crew_film(r->crew, part) + at, bytes, size);
    brume_crew_changed(r->crew, part);
    return CL_SUCCESS;
}

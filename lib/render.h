/* render.h -- what a render holds: the scene's arrays on the device, the program, the film, and how far it has come. */
#ifndef BRUME_RENDER_H
#define BRUME_RENDER_H

#include "arrays.h"
#include "device.h"
#include "film.h"
#include "render_program.h"

struct brume_render {
    brume_device *device; /* retained */
    brume_render_desc desc;
    brume_film_desc film;
    b_params params;
    brume_film_layout layout;
    cl_mem buffers[BRUME_SCENE_BUFFERS];
    cl_mem planes, bad, plan;
    brume_render_program program;
    size_t local_size;

    /* Progress through the sample range, in passes over the film; a pass in groups. */
    uint32_t samples_done;  /* per pixel, in whole passes */
    uint32_t pass_samples;  /* of the pass under way, 0 between passes */
    uint32_t groups_done;   /* of it */
    int needs_pilot;        /* STRATEGY_AUTO has lamps in a medium to make a plan for */
    uint32_t pilot_done;    /* groups */
    double groups_per_second; /* times samples; 0 unknown */
    int cancelled;          /* written from any thread, atomically */

    brume_render_stats stats;
    float world_to_camera[16];
};

#endif

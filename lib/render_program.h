/* render_program.h -- the program of a render: from the cache or from source, and never waited for longer than needed.
 *
 * With a quick start a narrow program, which compiles sooner, renders while a thread builds the wide one, which takes
 * over between two launches: every width computes the same bits into the same slots of the film.
 */
#ifndef BRUME_RENDER_PROGRAM_H
#define BRUME_RENDER_PROGRAM_H

#include "platform.h"
#include "program.h"

enum {
    BRUME_SCENE_BUFFERS = 19, /* the kernel parameters of cl/scene.h */
    BRUME_KERNEL_BUFFERS = BRUME_SCENE_BUFFERS + 4 /* and planes, bad, plan, schedule */
};

typedef struct brume_render_program {
    cl_program program;  /* what launches run at present */
    cl_kernel kernel;
    uint32_t lanes;      /* of it; a wide group is stats.lanes / lanes of its groups */

    brume_program_source source; /* of the wide program */
    char *folder;                /* of the cache; NULL: there is none, or the program came from it */
    cl_mem arguments[BRUME_KERNEL_BUFFERS];
    cl_mem trace;                /* the kernel's last argument, where it is not NULL */

    /* The thread that builds the wide program; `wide` and its kernel are its own until state says otherwise. */
    int is_quick;         /* there is to be one */
    brume_thread *thread; /* NULL: none was started */
    int awaited;
    brume_device device; /* a copy, with a context of its own: contexts belong to one thread */
    cl_program wide;
    cl_kernel wide_kernel;
    int state;           /* written by the thread, atomically */

    double start;
    uint32_t launches;
    uint32_t swap_at;    /* for tests: the launch, from 1 on, at which the wide program takes over; 0: when built */
} brume_render_program;

struct brume_render;

/* Builds what the first launch needs, in full: PoCL generates machine code at the first launch, so one without samples
 * has been made. The render's buffers and film exist already. */
brume_result brume_render_program_start(struct brume_render *render, uint32_t features, uint32_t stack_size);

/* Starts the thread that builds the wide program after a quick start. */
void brume_render_program_go_on(struct brume_render *render);

/* Around each launch, until it has finished: the kernel for it, its width in program.lanes. */
cl_kernel brume_render_program_begin_launch(struct brume_render *render);
void brume_render_program_end_launch(struct brume_render *render);

/* Keeps the program of a complete render in the cache, if it is not there. */
void brume_render_program_destroy(struct brume_render *render);

#endif

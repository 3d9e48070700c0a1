/* crew_member.h -- one device of a crew, and what all of them share. Private to crew.c and crew_member.c. */
#ifndef BRUME_CREW_MEMBER_H
#define BRUME_CREW_MEMBER_H

#include "crew.h"
#include "render.h"

typedef struct brume_crew_range { uint32_t begin, end; } brume_crew_range;

typedef struct brume_crew_member {
    brume_device device;    /* a copy, with a context of its own: contexts belong to one thread */
    brume_device *original; /* retained */
    brume_render *render;   /* the scene, the program, and room for the film that is in work */
    cl_int code;            /* CL_SUCCESS: it takes part; else what it failed with */
    int was_there;
    uint32_t most;          /* groups in a chunk, since larger ones failed for want of resources; 0: any number */
    double speed;           /* groups times samples a second, with all that goes with it; 0: unknown */
    double share;           /* of the speed of all that take part */
    int is_fastest;
    uint32_t declined, patience; /* launches without it since it was too slow to be of use; and until it is tried again */
    double work;            /* groups times samples done */
    uint32_t left_begin, left_end; /* of its chunk: groups that are still to be done */
    unsigned plan_stamp, schedule_stamp; /* what it has */
    cl_uint bad[BAD_SIZE];  /* in its chunks, until they are added up */
    float *chunk;           /* what comes back, before it is the film's */
    size_t chunk_size;      /* bytes */
    char note[256];         /* a warning from its context */
} brume_crew_member;

/* Chunks that are over sooner tell little of a device's speed: launches have a price. */
#define BRUME_CREW_LEAST_SECONDS 0.002

/* A launch. */
typedef struct brume_crew_job {
    uint32_t next, end; /* groups; next: atomically */
    uint32_t first, samples;
    cl_uint mode;
} brume_crew_job;

struct brume_crew {
    brume_crew_member *members;
    uint32_t count;
    /* The film, laid out as on a device. */
    float *planes;
    cl_uint bad[BAD_SIZE];
    cl_uchar *plan;
    cl_int *schedule;
    unsigned plan_stamp, schedule_stamp; /* counted up where they change */
    brume_crew_job job; /* under way */
};

/* On failure its context has the message. Destroy it either way. */
brume_result brume_crew_member_create(brume_crew_member *m, const brume_render *render, brume_device *device,
                                      const brume_arrays *arrays);
void brume_crew_member_destroy(brume_crew_member *m);

/* Groups that keep it busy. */
size_t brume_crew_member_least(const brume_crew_member *m);

/* Renders groups left_begin ... left_end - 1 of the job, and adds them to the film; left_begin follows. In any thread. */
void brume_crew_member_render(brume_crew_member *m, brume_crew *crew);

#endif

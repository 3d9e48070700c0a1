/* render.h -- what a render holds: the scene's arrays on the device, the program, the film, and how far it has come. */
#ifndef BRUME_RENDER_H
#define BRUME_RENDER_H

#include "arrays.h"
#include "crew.h"
#include "device.h"
#include "film.h"
#include "render_program.h"
#include "sha256.h"
#include "sample_allocation.h"

/* When the goal is reached, by what is known so far. */
typedef struct brume_prediction {
    int known, fresh;          /* fresh: nobody has been told yet */
    double seconds, low, high; /* of brume_render_run in all; with a time limit, the limit */
    double relmse;             /* of the picture then */
    double work;               /* then, samples per pixel */
} brume_prediction;

/* A few samples more for the pixels that take part, which launches do group by group. */
typedef struct brume_pass {
    uint32_t samples;        /* of each of them; 0: no pass is under way */
    uint32_t groups;         /* that take part in it */
    uint32_t groups_done;    /* of them */
    uint32_t doubtful;       /* and so many more were in a launch that failed: each has run, or has not */
    uint32_t doubtful_lanes; /* of the program then, whose work-items have each run as a whole or not at all */
    uint32_t bad_before;     /* samples dropped before the pass */
    float *counts;           /* by slot, of the film before the pass, if some were; else NULL: all are samples_done */
    int counts_unknown;      /* some were, and the pass came from a file with a launch in doubt */
} brume_pass;

struct brume_render {
    brume_device *device; /* retained */
    brume_render_desc desc;
    brume_film_desc film;
    b_params params;
    double light_unit; /* see arrays.h */
    brume_film_layout layout;
    cl_mem buffers[BRUME_SCENE_BUFFERS];
    cl_mem planes, bad, plan;
    int traced;       /* the program writes paths down: */
    cl_mem trace;     /* TRACE_ROOM vertices of the latest, or NULL */
    double origin[3]; /* of the positions on the device, in the scene's coordinates */
    brume_render_program program;
    size_t local_size;
    uint32_t own_lanes; /* that suit the device: the program's; fewer than stats.lanes where another of a crew has more */
    brume_crew *crew;   /* of a joined device: who has buffers and programs in its place; else NULL */

    /* Progress, in stages that end at a number of samples for each pixel; a stage in passes over the film, a pass in
     * groups. */
    uint32_t stage_end;       /* samples of the pixel with most, when the stage is done */
    uint32_t samples_done;    /* of each pixel whose end is not below, in whole passes */
    brume_pass pass;          /* the one under way */
    uint32_t most_groups;     /* in a launch, since larger ones failed for want of resources; 0: any number */
    uint32_t look_at;         /* samples per pixel: the film is to be looked at before it goes on; 0: it is not */
    double work;              /* group-samples done */
    double stage_work, stage_seconds; /* samples per pixel and seconds of the run when the latest stage began */
    double rate;              /* samples per pixel and second in the stage before; 0: unknown */
    double create_seconds;    /* that brume_render_create took: they count for the time limit */
    int finished;             /* nothing is left to do: the samples are done, or the goal is reached */
    int needs_pilot;          /* STRATEGY_AUTO has lamps in a medium to make a plan for */
    uint32_t pilot_done;      /* groups */
    double groups_per_second; /* times samples; 0 unknown */
    double running_since;     /* when the run began that is under way, 0: there is none */
    uint32_t launch_groups;   /* for tests: of every launch; 0: by time */
    double report_seconds;    /* between two reports, at least */
    int cancelled;            /* written from any thread, atomically */

    /* Adaptive sampling: per pixel, samples done and to be done; NULL while all pixels are alike. */
    uint32_t *done, *ends;
    brume_allocation *allocation; /* made of the latest estimate */
    cl_mem schedule;
    int replays_chosen; /* a traced sample is one that adaptive sampling may have placed */

    brume_error_estimate estimate;
    brume_error_result error; /* by the latest estimate */
    int looked;               /* that is of the film as it is */
    brume_prediction prediction;

    brume_render_stats stats;
    float world_to_camera[16];

    /* Of the scene's arrays and the kernels' source, once somebody has asked. */
    int has_hashes;
    uint8_t scene_hash[SHA256_SIZE], kernel_hash[SHA256_SIZE];
};

/* brume_render_create. `traced`, for one lane: the program writes into `trace` what the last sample's path does. */
brume_result brume_render_make(brume_device *device, const brume_scene *scene, const brume_render_desc *desc,
                               int traced, brume_render **out);

/* The scene on the render's own device, an empty film and a program there. */
brume_result brume_render_equip(brume_render *render, const brume_arrays *arrays);

/* ---- render_buffers.c ---- */

/* The scene on the device, and an empty film; BRUME_ERROR_MEMORY says how much is needed and how much there is. */
brume_result brume_render_create_buffers(brume_render *render, const brume_arrays *arrays);

/* ---- render_film.c: its bytes, wherever they lie ---- */

cl_int brume_render_get(const brume_render *render, brume_film_part part, size_t at, size_t size, void *out);
cl_int brume_render_put(brume_render *render, brume_film_part part, size_t at, size_t size, const void *bytes);

/* ---- render_launch.c: the kernel's launches, and the film read back ---- */

/* LAUNCH_CHOSEN, for samples that adaptive sampling places. */
cl_uint brume_render_chosen(const brume_render *render);

/* Renders `samples` samples from sample `first` on of `groups` tiles from `group` on, and waits. mode: LAUNCH_ bits. */
cl_int brume_render_launch(brume_render *render, uint32_t group, uint32_t groups, uint32_t first, uint32_t samples,
                           cl_uint mode);

/* The same in work-items of the program that runs at present. */
cl_int brume_render_launch_units(brume_render *render, size_t unit, size_t units, uint32_t first, uint32_t samples,
                                 cl_uint mode);

/* brume_schedule_make for the pass of adaptive sampling from samples_done on, and pass.groups. NULL: no memory. */
cl_int *brume_render_make_schedule(brume_render *render, size_t *size);

/* The film's sums as they are, `planes` of them from the first on, malloc'ed. */
brume_result brume_render_read_planes(brume_render *render, size_t planes, float **out);

/* ---- render_read.c ---- */

/* For brume_film_plane_count. */
uint32_t brume_render_recorded(const brume_render *render);

/* ---- render_denoise.c ---- */

/* The radiance denoised, height x width x 3. */
brume_result brume_render_denoise(brume_render *render, brume_denoise kind, float *out);

/* ---- render_bad.c: samples that came out NaN or infinite ---- */

/* Takes their number from the device into the statistics, and warns of them. */
brume_result brume_render_count_bad(brume_render *render);

/* Pixel by pixel, rows from the top. planes: of the film as it is. */
brume_result brume_render_bad_channel(brume_render *render, const float *planes, float *out);

/* ---- render_recover.c: launches that failed ---- */

/* What brume_render_settle compares with, taken before a pass, or in one before its next launch. */
brume_result brume_render_note_counts(brume_render *render);

/* Samples that the slot of a pixel of the pass under way held before it. */
double brume_render_count_before(const brume_render *render, size_t slot);

/* After a launch of `groups` groups failed. Whether smaller ones may do, which are tried from now on. */
int brume_render_shrink_launches(brume_render *render, uint32_t groups, cl_int code);

/* After a launch from groups_done on failed, of which `doubtful` groups may have run or not: does those that have not,
 * and counts all of them as done. Groups stay in doubt while that fails, or where smaller launches are to be tried. */
brume_result brume_render_settle(brume_render *render);

/* ---- render_run.c ---- */

/* Tells the kernel which pixels take part in the adaptive pass from samples_done on; sets pass.groups. */
brume_result brume_render_write_schedule(brume_render *render);

/* ---- render_write.c ---- */

/* World to normalised device coordinates: x and y in [-1, 1] over the full picture, y up, after division by depth. */
void brume_render_world_to_ndc(const brume_render *render, float out[16]);

/* ---- render_goal.c: what comes next ---- */

/* Whether there is a target error, a time limit, or freedom to give some pixels more samples than others. */
int brume_goal_exists(const brume_render *render);

/* Whether such a render may place this sample of a pixel, counted from its first. */
int brume_goal_may_choose(const brume_render_desc *desc, uint32_t sample);

/* Looks at the film after a pass that brought pixels to `samples` samples: the estimate of its error. */
brume_result brume_goal_look(brume_render *render, uint32_t samples);

/* Brings the estimate up to a film whose pixels don't all hold a power of two samples. */
brume_result brume_goal_last_look(brume_render *render);

/* Decides on the next stage; sets `finished` if there is none. `seconds`: of the run so far. */
brume_result brume_goal_next_stage(brume_render *render, double seconds);

/* ---- render_predict.c: what is still to come, by the latest estimate ---- */

/* Adaptive sampling has to promise this much to be used: its launches are less even. */
#define BRUME_WORTHWHILE 1.15

/* Samples per pixel so far, on average, as groups pay for them. */
double brume_mean_samples(const brume_render *render);

/* What the time limit leaves to brume_render_run. */
double brume_run_limit(const brume_render *render);

/* The error will fall as samples to the power of minus this. */
double brume_predict_order(const brume_render *render);

/* The mean samples per pixel that a relMSE takes, if all pixels stay alike; and with the allocation, if it pays. */
double brume_predict_uniform(const brume_render *render, double relmse);
double brume_predict_samples(const brume_render *render, double relmse);

/* The relMSE with so many. */
double brume_predict_relmse(const brume_render *render, double samples);

/* Sets the render's prediction. `seconds`: of the run so far. */
void brume_predict(brume_render *render, double seconds);

#endif

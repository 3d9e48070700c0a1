/* checkpoint.h -- the file that a render's state is kept in: what identifies the render, how far it has come, its film.
 *
 * 64 bytes (magic, byte order, version, size, SHA-256 of all that follows), the head, then arrays whose sizes follow
 * from it: the film's planes, and where the head says so the pilot's plan, the error estimate, the counts of adaptive
 * sampling and the allocation they came from. Pixels lie row by row, so that the file depends on no width of vectors.
 */
#ifndef BRUME_CHECKPOINT_H
#define BRUME_CHECKPOINT_H

#include "output.h"
#include "sha256.h"

/* Members of 4 and 8 bytes without gaps: it is written as it lies in memory. */
typedef struct brume_checkpoint_head {
    /* What makes two states parts of one picture. */
    uint8_t scene[SHA256_SIZE];   /* the arrays that the kernels read, their unit of light and their origin */
    uint8_t kernels[SHA256_SIZE]; /* their source */
    uint32_t width, height, full_width, full_height, crop_x, crop_y;
    uint32_t precision, recorded, sampler, seed, strategy, positions, indirect, without;
    /* What makes them states of one render, too. */
    uint32_t first_sample, sample_count, adaptive, has_time_limit, error_estimate;
    float clamp;           /* among those above */
    double noise_threshold;
    double time_limit;     /* may be another one, if there is one at all */

    /* What a picture needs besides. */
    double light_unit;     /* the film's, in the scene's */
    float filter_weight;
    uint32_t half, alpha;
    float world_to_camera[16], world_to_ndc[16];
    uint32_t stats_effects;
    char device[128];

    /* How far it has come; as in brume_render. */
    uint32_t lanes, group_count;
    uint32_t stage_end, samples_done, pass_samples, groups_done;
    uint32_t finished, looked;
    uint32_t has_counts, has_allocation;
    uint32_t has_plan, pilot_done; /* in groups, like groups_done */
    uint32_t bad[4];
    double work, stage_work, stage_seconds, rate, render_seconds, pilot_seconds;
    uint32_t error_known;
    uint32_t doubtful, look_at, doubtful_lanes; /* the last is 0 where there is no doubt */
    double relmse, relmse_low, relmse_high, order;
} brume_checkpoint_head;

/* A file in memory. */
typedef struct brume_checkpoint {
    brume_checkpoint_head head;
    const float *planes;   /* brume_film_plane_count(head.recorded), of height x width */
    const uint8_t *rest;   /* the arrays after them */
    size_t rest_size;
    uint8_t *bytes;        /* owned: all of it */
} brume_checkpoint;

/* Reads and checks a file. BRUME_ERROR_CHECKPOINT: it is none, damaged, or of another version. */
brume_result brume_checkpoint_read(brume_context *context, const char *path, brume_checkpoint *out);
void brume_checkpoint_free(brume_checkpoint *checkpoint);

/* Whether `head`, read from `path`, is of the same picture as `wanted`, and of the same render, too, which means the
 * same first sample and goal: how many samples or seconds it may take is compared by nobody here.
 * BRUME_ERROR_CHECKPOINT, with what it is that differs, if not. `other` names `wanted` in the message. */
brume_result brume_checkpoint_same_picture(brume_context *context, const char *path, const brume_checkpoint_head *head,
                                           const brume_checkpoint_head *wanted, const char *other);
brume_result brume_checkpoint_same_render(brume_context *context, const char *path, const brume_checkpoint_head *head,
                                          const brume_checkpoint_head *wanted, const char *other);

/* Writing: begin, append what the file holds, end, which gives it its name if `keep`. */
typedef struct brume_checkpoint_writer {
    brume_output output;
    brume_sha256_state sum;
} brume_checkpoint_writer;

brume_result brume_checkpoint_begin(brume_context *context, const char *path, brume_checkpoint_writer *out);
/* Non-zero if it was taken; an error is reported by end. */
int brume_checkpoint_append(brume_checkpoint_writer *writer, const void *bytes, size_t size);
brume_result brume_checkpoint_end(brume_context *context, brume_checkpoint_writer *writer, int keep);

#endif

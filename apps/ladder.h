/* ladder.h -- what the parts of the tool `ladder` know of each other. It uses the public header only. */
#ifndef LADDER_H
#define LADDER_H

#include <stdio.h>

#include "brume.h"

/* As render-cli's. */
enum {
    LADDER_EXIT_OK = 0,
    LADDER_EXIT_RUNTIME = 1,
    LADDER_EXIT_USAGE = 2,
    LADDER_EXIT_SCENE = 3,
    LADDER_EXIT_DEVICE = 4,
    LADDER_EXIT_BUILD = 5,
    LADDER_EXIT_OUTPUT = 6
};

enum { LADDER_NAME = 64, LADDER_FOLDER = 512, LADDER_PATH = 1024, LADDER_SCENES = 64, LADDER_RUNGS = 16 };

/* ---- options (ladder_options.c) ---- */

typedef enum ladder_mode { LADDER_MODE_SCENES = 0, LADDER_MODE_SAMPLERS = 1, LADDER_MODE_LIGHTS = 2 } ladder_mode;

/* One way of estimating: spelled STRATEGY[:POSITIONS][+INDIRECT][+adaptive]. */
typedef struct ladder_rung {
    char name[LADDER_NAME];
    brume_strategy strategy;
    uint32_t positions;
    uint32_t use_indirect; /* else the scene's */
    brume_indirect indirect;
    uint32_t adaptive; /* samples where the error is */
} ladder_rung;

typedef struct ladder_scene {
    char name[LADDER_NAME]; /* the file's, without folder and extension */
    char path[LADDER_PATH];
} ladder_scene;

typedef struct ladder_options {
    ladder_mode mode;
    int help;
    ladder_scene scenes[LADDER_SCENES];
    size_t scene_count;
    ladder_rung rungs[LADDER_RUNGS];
    size_t rung_count;
    double seconds;  /* of the comparison at equal time */
    uint32_t spp;    /* of the comparison at equal samples */
    uint32_t reference_spp;
    double reference_seconds; /* at most, per scene */
    ladder_rung reference;
    uint32_t width, height;
    const char *depth; /* of paths; NULL: the scene's */
    uint32_t seed, seeds; /* the first, and how many */
    uint32_t device;
    char out[LADDER_FOLDER], cache[LADDER_FOLDER];
} ladder_options;

/* On failure an error line has been printed and the exit code is returned; 0 otherwise. */
int ladder_options_parse(ladder_options *options, int argc, char **argv);
void ladder_print_help(FILE *file);

/* ---- the run (ladder.c) ---- */

typedef struct ladder {
    const ladder_options *options;
    brume_context *context;
    brume_device *device;
    brume_device_info info;
} ladder;

/* One line "ladder: error: ..." on standard error. */
void ladder_error(const char *format, ...) __attribute__((format(printf, 1, 2)));
/* One line of progress there. */
void ladder_say(const char *format, ...) __attribute__((format(printf, 1, 2)));
/* Prints the context's message; the exit code of `result`. */
int ladder_report(const ladder *l, brume_result result);
/* Loads a scene, with the depth and the film's size that the options ask for. */
int ladder_load(const ladder *l, const ladder_scene *from, brume_scene **out);
/* OUT/name, opened for writing; NULL after an error line. */
FILE *ladder_open(const ladder *l, const char *name);
/* Closes it; an exit code. */
int ladder_close(const ladder *l, FILE *file, const char *name);
/* Makes the folder and those above it; an exit code. */
int ladder_make_folder(const char *path);

/* ---- measured renders (ladder_measure.c) ---- */

/* A picture and what it cost. All zero is an empty one. */
typedef struct ladder_shot {
    size_t pixel_count;
    double samples; /* per pixel */
    double seconds; /* of rendering alone */
    uint64_t bad_samples;
    float *radiance, *variance; /* 3 floats a pixel; of the mean */
} ladder_shot;

/* Renders `samples` per pixel, or as many as fit into `limit` seconds if that is positive; writes a PNG unless `png`
 * is NULL. An exit code; the shot is then empty. */
int ladder_shoot(const ladder *l, const brume_scene *scene, const ladder_rung *rung, uint32_t seed, uint32_t samples,
                 double limit, const char *png, ladder_shot *out);
void ladder_shot_free(ladder_shot *shot);

/* ---- references (ladder_reference.c) ---- */

typedef struct ladder_reference {
    size_t pixel_count;
    double samples; /* per pixel */
    double seconds;
    double error;    /* relMSE of the reference itself, from the difference of its halves */
    float *radiance; /* 3 floats a pixel */
    char png[LADDER_PATH];
} ladder_reference;

/* From the cache, or rendered and put there. An exit code. */
int ladder_reference_get(const ladder *l, const ladder_scene *from, const brume_scene *scene, ladder_reference *out);
void ladder_reference_free(ladder_reference *reference);

/* ---- results (ladder_tables.c) ---- */

typedef struct ladder_run {
    double samples, mse, trimmed;
    double seconds; /* this many samples take undisturbed; see ladder_cells.c */
} ladder_run;

/* One rung in one scene. */
typedef struct ladder_cell {
    ladder_run equal_samples;
    ladder_run equal_time;  /* interpolated between two runs */
    ladder_run shown;       /* the one closer to that time, of which there is a picture */
    double variance;    /* relative, of one sample */
    double sample_time; /* seconds per sample of one pixel */
    double ratio;       /* of the longest run's mean to the reference's */
    double deviates;    /* its distance from 1 in standard errors */
    uint64_t bad_samples;
} ladder_cell;

typedef struct ladder_row {
    const char *scene;
    double reference_samples, reference_seconds, reference_error;
    char reference_png[LADDER_PATH];
    ladder_cell cells[LADDER_RUNGS];
} ladder_row;

/* All rungs in one scene, ladder_cells.c: fills row->cells, and writes the PNGs. */
int ladder_measure_cells(const ladder *l, const brume_scene *scene, const ladder_reference *reference,
                         ladder_row *row);

/* ladder.csv, ladder.json and ladder.md. */
int ladder_write_tables(const ladder *l, const ladder_row *rows, size_t count);

/* ---- contact sheets (ladder_sheets.c) ---- */

/* Where the PNG of a rung lies; `kind` is "samples" or "time". */
void ladder_png_path(const ladder *l, const char *scene, const ladder_rung *rung, const char *kind,
                     char out[LADDER_PATH]);
/* SCENE.png: every rung at equal samples and at about equal time. */
int ladder_scene_sheet(const ladder *l, const ladder_row *row);
/* ladder.png: every scene and rung at equal time. */
int ladder_overall_sheet(const ladder *l, const ladder_row *rows, size_t count);

/* ---- the other modes ---- */

int ladder_samplers(const ladder *l); /* ladder_samplers.c */
int ladder_lights(const ladder *l);   /* ladder_lights.c */

#endif

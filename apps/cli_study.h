/* cli_study.h -- what the parts of `render-cli study` know of each other.
 *
 * A study renders each setting twice, with independent seeds a and b, and looks at the picture at every power of two
 * samples; time and error of those points are its curve. The pair tells bias from noise; one picture alone can't.
 *
 * One render climbs through all of a curve's points. Adaptive ones can't: where samples go depends on how many there
 * are to be. They are rendered anew for every point, each with its own time. */
#ifndef CLI_STUDY_H
#define CLI_STUDY_H

#include "cli.h"
#include "curves.h"
#include "error_metrics.h"

enum { STUDY_NAME = 64, STUDY_PARTS = 8, STUDY_SETTINGS = 32, STUDY_POINTS = 21, STUDY_SEEDS = 2, STUDY_PATH = 1024 };

/* ---- settings (cli_study_settings.c) ---- */

/* What a setting edits: the options' descriptor and the scene's integrator. */
typedef struct study_edit {
    brume_render_desc render;
    brume_integrator_desc integrator;
    double mean; /* of the reference, for what is relative to it */
} study_edit;

typedef enum study_kind {
    STUDY_EXACT = 0,
    STUDY_APPROXIMATE = 1, /* leaves something out: there will be bias */
    STUDY_ROUNDING = 2,    /* other arithmetic, the same random numbers */
    STUDY_ADAPTIVE = 4     /* pixels get samples by their need: each point is a render of its own */
} study_kind;

typedef struct study_part study_part;

/* Parts joined by '+', as in "mis+independent+depth-4"; what no part names is the scene's. */
typedef struct study_setting {
    char name[STUDY_NAME];
    size_t part_count;
    struct {
        const study_part *part;
        const char *text; /* in `name` */
        size_t length;
    } parts[STUDY_PARTS];
} study_setting;

extern const char study_default_settings[];

/* A mean so many standard errors off the reference's is believed to be biased: by chance, once in two million. */
#define STUDY_DEVIATES 5.0

/* Names between commas. 0, or an exit code after an error line. */
int study_settings_parse(const char *list, study_setting *out, size_t *count);
/* Its parts point into its name: a copy has to be made by this. */
void study_setting_move(study_setting *to, const study_setting *from);
unsigned study_setting_kinds(const study_setting *setting); /* of its parts, or-ed */
/* Edits, leaving out the parts of the kinds in `without`. */
void study_setting_apply(const study_setting *setting, unsigned without, study_edit *edit);
/* Says in words what it is, for the page. */
void study_setting_describe(const study_setting *setting, char *out, size_t size);
/* The setting that is the same but for the parts of the kinds in `without`; `count` if there is none. */
size_t study_setting_partner(const study_setting *settings, size_t count, size_t of, unsigned without,
                             const study_edit *base);
/* Its name as part of a file name. */
void study_setting_stem(const study_setting *setting, char out[STUDY_NAME]);

/* ---- runs: what was rendered and how long it took (cli_study_measure.c, cli_study_journal.c) ---- */

typedef struct study_run_point {
    uint32_t samples;   /* per pixel; the mean, if adaptive */
    double seconds;     /* of rendering, since the first sample */
    double cpu_seconds; /* that this program had of all processors meanwhile */
    double estimated;   /* relMSE as the library estimates it; < 0: not known */
    uint64_t bad_samples;
} study_run_point;

typedef struct study_run {
    size_t count; /* 0: not rendered yet */
    study_run_point points[STUDY_POINTS];
    double bvh_seconds, upload_seconds, build_seconds, pilot_seconds;
} study_run;

/* ---- judged ---- */

/* One picture. */
typedef struct study_figures {
    error_metrics metrics;
    error_figures figures;
    double flip, estimated;            /* NaN: not known */
    double other_relmse, other_flip; /* against --reference; NaN without one */
} study_figures;

/* Both seeds at one number of samples: means, if nothing else is said. */
typedef struct study_point {
    uint32_t samples;
    double seconds; /* by the clock that the options name */
    double wall_seconds, cpu_seconds;
    study_figures of[STUDY_SEEDS];
    double relmse, trimmed, mape, smape, flip, estimated, fireflies, ratio, other_relmse;
    double noise;             /* relMSE that is noise: half the squared difference of the pair */
    double bias, bias_sigma;  /* squared, in the same weights, and its standard error */
    double deviates;          /* of the pair's mean, from the reference's, in standard errors */
    uint64_t bad_samples;     /* of both */
    int near_floor;           /* less than four times the reference's own error */
    int on_front;
} study_point;

typedef struct study_curve {
    study_run runs[STUDY_SEEDS];
    size_t count; /* of points judged */
    study_point points[STUDY_POINTS];
    double slope;         /* of relMSE against time; NaN */
    double noise_slope;   /* of the noise alone */
    double bias;          /* at the last point; 0 unless it is beyond three standard errors */
    double time_to_target;
    curves_kind target_kind;
    double halving;       /* time times this halves the last error */
    double at_time;       /* relMSE at the time target; NaN */
    size_t shown;         /* the point nearest to that time */
} study_curve;

/* What other arithmetic does to the same random numbers: of the values |x - y| / (|y| + 0.1 mean), x in float and y in
 * double, the largest of a pixel's channels. */
typedef struct study_rounding {
    size_t single, other; /* settings compared */
    uint32_t samples;
    double cost;          /* time of the other over that of the single precision one, at these samples */
    double median, most, root_mean_square, share_above; /* above 1e-3 */
} study_rounding;

typedef struct study {
    brume_context *context;
    const cli_options *options;
    cli_progress *progress;
    cli_session session;
    const char *folder;
    study_setting settings[STUDY_SETTINGS];
    size_t setting_count;
    study_edit base; /* no part applied */
    uint32_t full_width, full_height; /* the scene's film */
    uint32_t width, height;
    uint64_t scene_hash;
    double reference_limit, limit; /* seconds of a half of the reference, and of the longest render of a setting */

    study_run reference_runs[2];
    float *reference;        /* NULL: not rendered yet */
    double reference_error;  /* its own relMSE, from its halves */
    double reference_mean;
    uint32_t reference_samples;
    double exposure;         /* of every picture shown */
    float *other;            /* of --reference; NULL */
    double other_relmse, other_flip, other_ratio; /* of that against the study's own */

    study_curve curves[STUDY_SETTINGS];
    double target;      /* relMSE */
    double time_target; /* seconds; 0: none that all settings reach */
    study_rounding roundings[STUDY_SETTINGS];
    size_t rounding_count;

    FILE *journal;
    double begun;           /* cli_now() */
    double planned, behind; /* seconds of rendering in all, and of those done */
} study;

/* FOLDER/pictures/STEM-SEED-SAMPLES.pfm */
void study_picture_path(const study *s, const char *stem, int seed, uint32_t samples, char out[STUDY_PATH]);
/* FOLDER/NAME */
void study_path(const study *s, const char *name, char out[STUDY_PATH]);
int study_out_of_memory(void);
/* Error line for a file that can't be written; the exit code. */
int study_not_written(const char *path, int error);

/* Renders to every power of two samples that fits into `limit` seconds in all, or up to `most` unless that is 0, and
 * leaves pictures, all or the last. An exit code; 128 + the signal if one came, and nothing is to be kept then. */
int study_measure(study *s, const study_edit *edit, const char *stem, int seed_letter, uint32_t seed, double limit,
                  uint32_t most, int all, study_run *out);

/* Opens the journal of the folder: reads what an earlier study has finished, if it was the same study, else refuses. An
 * exit code. */
int study_journal_open(study *s);
/* Appends a finished run, to the disk itself. `setting` NULL: the reference. */
int study_journal_append(study *s, const study_setting *setting, int seed, const study_run *run);

/* The reference from its halves, once both are there (cli_study_judge.c). */
int study_judge_reference(study *s);
/* Everything else that can be judged. */
int study_judge(study *s);

int study_write_tables(const study *s); /* study.csv, study.json (cli_study_tables.c) */
/* study.gp and its data; study.svg and study.png by gnuplot. *drawn: whether they are there. (cli_study_plot.c) */
int study_write_plot(const study *s, int *drawn);
int study_write_page(const study *s, int drawn); /* study.html (cli_study_page.c) */

/* The sections of the page that show pictures (cli_study_gallery.c), what approximations cost (cli_study_prices.c), and
 * every run (cli_study_runs.c). */
int study_page_gallery(FILE *file, const study *s);
void study_page_prices(FILE *file, const study *s);
void study_page_runs(FILE *file, const study *s);
/* Text with <, >, & and quotes escaped; bytes that are not UTF-8 as U+FFFD. */
void study_html(FILE *file, const char *text);
/* "1.2 s", "3 min" */
void study_put_time(FILE *file, double seconds);
/* Three digits, with a real minus and without an exponent where that reads well. */
void study_put_number(FILE *file, double value);

#endif

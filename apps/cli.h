/* cli.h -- what the parts of render-cli know of each other. It uses the public header only, like any other program. */
#ifndef CLI_H
#define CLI_H

#include <stdio.h>

#include "brume.h"

/* Exit codes; after SIGINT or SIGTERM it is 128 + the signal's number. */
enum {
    CLI_EXIT_OK = 0,
    CLI_EXIT_RUNTIME = 1,
    CLI_EXIT_USAGE = 2,
    CLI_EXIT_SCENE = 3,
    CLI_EXIT_DEVICE = 4,
    CLI_EXIT_BUILD = 5,
    CLI_EXIT_OUTPUT = 6,
    CLI_EXIT_CHECKPOINT = 7,
    CLI_EXIT_SIGNAL = 128
};

/* ---- commands: one file each, cli_<name>.c ---- */

typedef enum cli_command {
    CLI_RENDER = 0, /* also without a name: render-cli SCENE.xml */
    CLI_INFO = 1,
    CLI_EFFECTS = 2,
    CLI_STUDY = 3,
    CLI_MERGE = 4,
    CLI_COMMAND_COUNT
} cli_command;

typedef struct cli_options cli_options;
typedef struct cli_progress cli_progress;

typedef struct cli_command_entry {
    const char *name, *takes, *help;
    /* Does it; the exit code. */
    int (*run)(brume_context *context, const cli_options *options, cli_progress *progress);
} cli_command_entry;

extern const cli_command_entry cli_commands[CLI_COMMAND_COUNT]; /* in cli.c */

int cli_render(brume_context *context, const cli_options *options, cli_progress *progress);
int cli_info(brume_context *context, const cli_options *options, cli_progress *progress);
int cli_effects(brume_context *context, const cli_options *options, cli_progress *progress);
int cli_study(brume_context *context, const cli_options *options, cli_progress *progress);
int cli_merge(brume_context *context, const cli_options *options, cli_progress *progress);

/* ---- options (cli_options.c, cli_values.c) ---- */

typedef enum cli_progress_kind {
    CLI_PROGRESS_AUTO = 0,
    CLI_PROGRESS_NONE = 1,
    CLI_PROGRESS_JSON = 2
} cli_progress_kind;

/* Of render-cli study; strings point into argv, NULL and 0: the default. */
typedef struct cli_study_options {
    const char *folder;
    const char *settings;  /* names between commas */
    const char *reference; /* somebody else's picture */
    double budget;         /* seconds of rendering */
    double target;         /* relMSE */
    double time_target;    /* seconds */
    uint32_t width;
    int fresh;
    int cpu_clock; /* time is that of the processors */
} cli_study_options;

/* Strings point into argv; the arrays are owned. */
struct cli_options {
    cli_command command;
    const char *scene;
    const char **inputs; /* of merge */
    size_t input_count;
    int partial;
    const char **outputs;
    size_t output_count;
    brume_parameter *parameters; /* names are owned, values point into argv */
    size_t parameter_count;
    const char *device;     /* indices or parts of names between commas, each perhaps with /PARTS; NULL: any */
    const char *stats_path; /* where --stats=json goes; "" for standard output; NULL: nowhere */
    char *default_output;   /* owned; used when there is no -o */
    cli_progress_kind progress;
    int verbosity; /* -1 quiet, 0, 1 verbose */
    int list_devices, help, version;
    int debugs;               /* --debug-sample: */
    uint32_t debug_sample[3]; /* x, y, sample */
    char *replay;             /* owned: the command line so far as samples depend on it, for a shell */
    float exposure;
    brume_tonemap tonemap;
    brume_denoise denoise;
    const char *display_server; /* NULL: none */
    uint32_t layers; /* as in brume_picture_desc */
    const char *checkpoint; /* file for the state of the render; NULL: none */
    double checkpoint_interval; /* seconds */
    int resume;
    brume_render_desc render;
    cli_study_options study;
};

/* Fills `options` (which cli_options_free releases, whatever came back). On failure an error line has been printed and
 * the exit code is returned; 0 otherwise. */
int cli_options_parse(cli_options *options, int argc, char **argv);
void cli_options_free(cli_options *options);
void cli_print_help(FILE *file, cli_command command);

/* ---- one sample, explained (cli_debug.c) ---- */

/* Adds --name=value, or the word value if there is no name, to options->replay. 0, or the exit code. */
int cli_replay_add(cli_options *options, const char *name, const char *value);
int cli_debug_sample(brume_context *context, const cli_options *options, cli_progress *progress);

/* ---- lines for people and for programs (cli_progress.c) ---- */

/* One line "render-cli: error: ..." on standard error. */
void cli_error(const char *format, ...) __attribute__((format(printf, 1, 2)));

struct cli_progress {
    cli_progress_kind kind;
    int verbosity;
    int bar;         /* standard error is a terminal and wants one */
    int bar_visible; /* the cursor stands behind a bar */
    double threshold, limit; /* the goal: --noise-threshold, --time-limit; 0 none */
    int predicted;   /* what it takes has been said */
};

void cli_progress_init(cli_progress *progress, const cli_options *options);

/* A step that begins ("Reading scene.xml") and, on the terminal, is overwritten by the next line. */
void cli_progress_step(cli_progress *progress, const char *step, const char *detail);
/* Callbacks for the library; `user` is the cli_progress. */
void cli_progress_log(void *user, brume_log_level level, const char *message);
int cli_progress_update(void *user, const brume_progress *update);
int cli_progress_load(void *user, const brume_load_progress *load); /* NULL: it has been read */
/* A checkpoint has been written, in so many seconds. */
void cli_progress_checkpoint(cli_progress *progress, const char *path, double seconds);
/* Ends the line that a bar stands on. */
void cli_progress_finish(cli_progress *progress);

/* ---- scene, device and signals of a command (cli_session.c) ---- */

typedef struct cli_session {
    brume_context *context;
    brume_scene *scene;
    brume_device *device;
    brume_device_info info;
    double load_seconds; /* reading the scene */
} cli_session;

/* Reads the scene and opens the device that the options name. 0, or the exit code after an error line;
 * cli_session_close releases what there is either way. */
int cli_session_open(cli_session *session, brume_context *context, const cli_options *options,
                     cli_progress *progress);
void cli_session_close(cli_session *session);

/* ---- devices (cli_devices.c) ---- */

int cli_list_devices(brume_context *context);
/* Opens what --device names (NULL: any), several of them as one, which brume_device_destroy releases. 0, or the exit
 * code after an error line. */
int cli_open_device(brume_context *context, const char *wanted, brume_device **out_device,
                    brume_device_info *out_info);

/* Prints the context's message and returns the exit code for a failed call. */
int cli_report(const brume_context *context, brume_result result);

/* Seconds of a clock that never goes back. */
double cli_now(void);

/* From here on SIGINT and SIGTERM end the program at once, except while a render is interruptible: then the first one
 * cancels it, and the second one ends the program. */
void cli_watch_signals(void);
/* `render` from now on, until called with NULL. */
void cli_interruptible(brume_render *render);
/* While this is on, a first signal without a render to stop is noted only: the caller asks cli_signal(). */
void cli_hold_signals(int hold);
/* The signal that came, 0 none. */
int cli_signal(void);

/* ---- checkpoints (cli_checkpoint.c) ---- */

/* The state of a render on disk, brought up to date while it runs. */
typedef struct cli_checkpoint {
    brume_context *context;
    brume_render *render;
    cli_progress *progress;
    const char *path; /* NULL: none is kept, and the calls below do nothing */
    double interval, last;
    int failed; /* a write has failed, which has been said */
} cli_checkpoint;

/* Finds out whether the file can be written, and that none is overwritten without --resume. 0 or an exit code. */
int cli_checkpoint_check(const cli_options *options);
/* With --resume, goes on from the file if there is one. 0 or an exit code. */
int cli_checkpoint_start(cli_checkpoint *checkpoint, brume_context *context, brume_render *render,
                         const cli_options *options, cli_progress *progress);
/* A progress callback that also writes the file when it is time; `user` is the cli_checkpoint. */
int cli_checkpoint_update(void *user, const brume_progress *update);
/* Writes what the render came to. 0 or an exit code. */
int cli_checkpoint_finish(cli_checkpoint *checkpoint);

/* ---- statistics (cli_stats.c) ---- */

/* Text as a JSON string with its quotes. Bytes that are not UTF-8 are written as U+FFFD. */
void cli_json_string(FILE *file, const char *text);

typedef struct cli_run {
    const cli_options *options;
    const brume_device_info *device;
    const brume_render_stats *stats;
    double load_seconds, write_seconds, total_seconds;
    int exit_code;
} cli_run;

typedef struct cli_merge_run {
    const cli_options *options;
    const brume_render_stats *stats;
    int exit_code;
} cli_merge_run;

/* One JSON object on one line. */
void cli_stats_print(FILE *file, const cli_run *run);
void cli_stats_print_merge(FILE *file, const cli_merge_run *run);
/* Has `print` write such a line to where --stats=json goes: `path`, standard output if that is empty, nowhere if NULL.
 * An exit code; what went wrong is said. */
int cli_stats_write(const char *path, void (*print)(FILE *file, const void *what), const void *what);
/* Members ,"effects":[...],"without":[...],"features_built":[...],"features_left_out":[...] of such an object. */
void cli_stats_effects(FILE *file, const brume_render_stats *stats);
/* A few lines for -v. */
void cli_stats_summary(FILE *file, const cli_run *run);

/* ---- a viewer (cli_display.c) ---- */

/* tev, for one render. Whatever becomes of it, the render goes on. */
typedef struct cli_display {
    brume_render *render;
    const char *server;
    char name[1024];     /* of the picture there: the scene's */
    uint32_t width, height;
    int verbosity;
    int socket;          /* -1: none, or it has gone */
    double next;         /* time of the next picture */
} cli_display;

void cli_display_start(cli_display *display, brume_render *render, const cli_options *options);
/* From the progress callback: shows the picture as it is, now and then. */
void cli_display_update(cli_display *display);
void cli_display_finish(cli_display *display); /* the last picture */

/* ---- output files (cli_output.c) ---- */

/* Whether the path's extension is one that brume_render_write knows. */
int cli_output_known(const char *path);
/* Finds out, without leaving a trace, whether a file can be made in the path's folder and may take its name.
 * 0, or CLI_EXIT_OUTPUT after an error line. */
int cli_output_check(const char *path);
/* The same for all pictures and the statistics. */
int cli_outputs_check(const cli_options *options);

#endif

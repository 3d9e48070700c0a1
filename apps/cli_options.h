/* cli_options.h -- the table of render-cli's options: what the parser (cli_options.c) and the readers of values
 * (cli_values.c) share. */
#ifndef CLI_OPTIONS_H
#define CLI_OPTIONS_H

#include "cli.h"

typedef enum option_id {
    OPTION_OUTPUT,
    OPTION_SPP,
    OPTION_SAMPLE_RANGE,
    OPTION_PARTIAL,
    OPTION_NOISE_THRESHOLD,
    OPTION_TIME_LIMIT,
    OPTION_ADAPTIVE,
    OPTION_SEED,
    OPTION_STRATEGY,
    OPTION_INDIRECT,
    OPTION_WITHOUT,
    OPTION_CROP,
    OPTION_DEFINE,
    OPTION_LAYERS,
    OPTION_EXPOSURE,
    OPTION_TONEMAP,
    OPTION_DENOISE,
    OPTION_DISPLAY,
    OPTION_DEVICE,
    OPTION_LIST_DEVICES,
    OPTION_PRECISION,
    OPTION_LANES,
    OPTION_STATS,
    OPTION_PROGRESS,
    OPTION_CLAMP,
    OPTION_CHECKPOINT,
    OPTION_CHECKPOINT_INTERVAL,
    OPTION_RESUME,
    OPTION_DEBUG_SAMPLE,
    OPTION_FOLDER,
    OPTION_SETTINGS,
    OPTION_BUDGET,
    OPTION_TARGET,
    OPTION_TIME_TARGET,
    OPTION_CLOCK,
    OPTION_WIDTH,
    OPTION_REFERENCE,
    OPTION_FRESH,
    OPTION_QUIET,
    OPTION_VERBOSE,
    OPTION_HELP,
    OPTION_VERSION,
    OPTION_COUNT
} option_id;

typedef struct cli_option {
    unsigned commands;    /* that take it: bits 1 << cli_command; and more in cli_options.c */
    char letter;          /* 0: none */
    const char *name;     /* without the dashes */
    const char *argument; /* NULL: takes none */
    const char *help;
} cli_option;

extern const cli_option cli_option_table[OPTION_COUNT];

/* Optimal string alignment distance between the first `a_length` letters of a and b, at most 24. */
int cli_spelling_distance(const char *a, size_t a_length, const char *b);

/* CLI_EXIT_USAGE after an error line that says what the option expects (cli_expected.c). */
int cli_wrong_value(option_id id, const char *value);

/* Stores an option's value. 0, or the exit code after an error line. */
int cli_option_set(cli_options *options, option_id id, const char *value);

#endif

/* cli_effects.h -- what `render-cli effects` has measured: shared by what measures (cli_effects.c) and what writes it
 * down (cli_effects_report.c). */
#ifndef CLI_EFFECTS_H
#define CLI_EFFECTS_H

#include "cli.h"

/* The scene without one effect; the first one has them all. */
typedef struct cli_variant {
    brume_effect effect; /* not of the first */
    float *sums[2];      /* radiance, for two seeds; the mean of these many rounds: */
    uint32_t counts[2];
    double seconds;      /* of rendering one round, the least of all rounds */
    double build_seconds; /* the least */
    uint64_t program_bytes;
    /* Of what the effect adds, after cli_effects_compare: */
    double time_share;   /* of the full render's time */
    double mean_change;  /* of the picture's mean without it, relative */
    double difference;   /* relMSE of the picture without it, free of noise, */
    double uncertainty;  /* and its standard error */
} cli_variant;

typedef struct cli_effects_result {
    const cli_options *options;
    cli_variant *variants;
    size_t count;
    uint32_t width, height;
    uint32_t rounds, samples; /* per pixel, in all rounds */
    double noise;             /* relMSE of the full picture of one seed */
} cli_effects_result;

/* Fills in what follows from sums and seconds. 0 if memory ran out. */
int cli_effects_compare(cli_effects_result *result);
void cli_effects_print(const cli_effects_result *result);
/* effects.json, and NAME.png for each effect: the scene with it, without it, and the difference. The exit code. */
int cli_effects_write(const cli_effects_result *result, const char *folder);

#endif

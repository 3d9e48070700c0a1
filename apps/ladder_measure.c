/* Measured renders. */
#include <stdlib.h>
#include <string.h>

#include "ladder.h"

void ladder_shot_free(ladder_shot *shot)
{
    free(shot->radiance);
    free(shot->variance);
    memset(shot, 0, sizeof *shot);
}

/* The callback of a render that has a limit. */
static int is_over(void *user, const brume_progress *progress)
{
    double limit = *(const double *)user;
    return limit > 0 && progress->seconds >= limit;
}

static brume_result read_shot(brume_render *render, ladder_shot *shot)
{
    brume_render_stats stats;
    brume_result result = brume_render_get_stats(render, &stats);
    if (result)
        return result;
    shot->pixel_count = (size_t)stats.width * stats.height;
    shot->samples = (double)stats.samples / (double)shot->pixel_count;
    shot->seconds = stats.render_seconds;
    shot->bad_samples = stats.bad_samples;
    shot->radiance = malloc(3 * shot->pixel_count * sizeof(float));
    shot->variance = malloc(3 * shot->pixel_count * sizeof(float));
    if (!shot->radiance || !shot->variance)
        return BRUME_ERROR_MEMORY;
    result = brume_render_read(render, BRUME_CHANNEL_RADIANCE, shot->radiance, 3 * shot->pixel_count);
    if (!result)
        result = brume_render_read(render, BRUME_CHANNEL_VARIANCE, shot->variance, 3 * shot->pixel_count);
    return result;
}

int ladder_shoot(const ladder *l, const brume_scene *scene, const ladder_rung *rung, uint32_t seed, uint32_t samples,
                 double limit, const char *png, ladder_shot *out)
{
    brume_render *render = NULL;
    brume_render_desc desc = brume_render_desc_default();
    desc.guides = 0;
    desc.sample_count = samples;
    desc.use_seed = 1;
    desc.seed = seed;
    desc.use_strategy = 1;
    desc.strategy = rung->strategy;
    desc.positions = rung->positions;
    desc.use_indirect = rung->use_indirect;
    desc.indirect = rung->indirect;
    desc.adaptive = rung->adaptive ? BRUME_ADAPTIVE_ON : BRUME_ADAPTIVE_OFF;
    desc.error_estimate = rung->adaptive; /* the others don't pay for it */
    if (rung->adaptive)
        desc.time_limit = limit;
    ladder_shot_free(out);
    brume_result result = brume_render_create(l->device, scene, &desc, &render);
    if (!result)
        result = brume_render_run(render, is_over, &limit);
    if (result == BRUME_CANCELLED)
        result = BRUME_OK;
    if (!result)
        result = read_shot(render, out);
    if (!result && png)
        result = brume_render_write(render, png, NULL);
    int code = result ? ladder_report(l, result) : LADDER_EXIT_OK;
    if (code)
        ladder_shot_free(out);
    brume_render_destroy(render);
    return code;
}

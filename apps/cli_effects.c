/* render-cli effects: the scene with all of its effects and without each in turn: what each costs, and what it adds.
 *
 * Rounds go through all variants, in turns forwards and backwards, so that a machine that slows down slows all of them;
 * what counts is the least time. Each round has samples of its own; even and odd ones have seeds of their own, so that
 * two independent pictures of each variant tell its difference from its noise.
 */
#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "cli_effects.h"
#include "error_metrics.h"
#include "platform.h"

enum { ROUNDS = 4 };

int cli_effects_compare(cli_effects_result *r)
{
    size_t pixels = (size_t)r->width * r->height, floats = 3 * pixels;
    float *reference = malloc(floats * sizeof *reference);
    if (!reference)
        return 0;
    const cli_variant *full = &r->variants[0];
    double sum = 0, mean;
    for (size_t i = 0; i < floats; i++) {
        reference[i] = 0.5f * (full->sums[0][i] + full->sums[1][i]);
        sum += reference[i];
    }
    mean = sum / (double)floats;
    r->noise = error_metrics_of_pair(full->sums[0], full->sums[1], reference, pixels);
    for (size_t k = 1; k < r->count; k++) {
        cli_variant *v = &r->variants[k];
        double changes = 0, products = 0, squares = 0;
        for (size_t i = 0; i < floats; i++) {
            /* Two independent estimates of the same difference: the product is its square on average, whatever the
             * noise. */
            double a = (double)v->sums[0][i] - full->sums[0][i], b = (double)v->sums[1][i] - full->sums[1][i];
            double scale = (double)reference[i] * reference[i] + 0.01 * mean * mean;
            double product = a * b == 0 ? 0 : a * b / scale;
            changes += 0.5 * (a + b);
            products += product;
            squares += product * product;
        }
        v->time_share = 1 - v->seconds / full->seconds;
        v->mean_change = changes / sum;
        v->difference = products / (double)floats;
        v->uncertainty = sqrt(squares) / (double)floats;
    }
    free(reference);
    return 1;
}

/* Renders one variant's part of a round. */
static int render_round(cli_session *session, const cli_options *options, cli_progress *progress, cli_variant *v,
                        uint32_t without, uint32_t round, uint32_t seed, uint32_t samples, cli_effects_result *out)
{
    brume_render_desc desc = options->render;
    brume_render *render = NULL;
    brume_render_stats stats;
    desc.without |= without;
    desc.guides = 0;
    desc.quick_start = 0; /* what is timed is one program, */
    desc.error_estimate = 0; /* and nothing else */
    desc.program_size = round == 0;
    desc.use_seed = 1;
    desc.seed = seed + (round & 1);
    desc.first_sample = round / 2 * samples;
    desc.sample_count = samples;
    int code = 0;
    float *radiance = NULL;
    brume_result result = brume_render_create(session->device, session->scene, &desc, &render);
    if (!result) {
        cli_interruptible(render);
        result = brume_render_run(render, cli_progress_update, progress);
        cli_interruptible(NULL);
    }
    if (result == BRUME_CANCELLED) {
        code = CLI_EXIT_SIGNAL + cli_signal();
        goto cleanup;
    }
    if (!result)
        result = brume_render_get_stats(render, &stats);
    if (result) {
        code = cli_report(session->context, result);
        goto cleanup;
    }
    size_t floats = (size_t)stats.width * stats.height * 3;
    radiance = malloc(floats * sizeof *radiance);
    for (int i = 0; i < 2; i++)
        if (!v->sums[i])
            v->sums[i] = calloc(floats, sizeof *v->sums[i]);
    if (!radiance || !v->sums[0] || !v->sums[1]) {
        cli_error("out of memory");
        code = CLI_EXIT_RUNTIME;
        goto cleanup;
    }
    result = brume_render_read(render, BRUME_CHANNEL_RADIANCE, radiance, floats);
    if (result) {
        code = cli_report(session->context, result);
        goto cleanup;
    }
    for (size_t i = 0; i < floats; i++)
        v->sums[round & 1][i] += radiance[i];
    v->counts[round & 1]++;
    v->seconds = round == 0 || stats.render_seconds < v->seconds ? stats.render_seconds : v->seconds;
    v->build_seconds = round == 0 || stats.build_seconds < v->build_seconds ? stats.build_seconds : v->build_seconds;
    if (round == 0)
        v->program_bytes = stats.program_bytes;
    out->width = stats.width;
    out->height = stats.height;
cleanup:
    free(radiance);
    brume_render_destroy(render);
    return code;
}

static int render_all(cli_session *session, const cli_options *options, cli_progress *progress,
                      cli_effects_result *r, uint32_t seed, uint32_t samples)
{
    for (uint32_t round = 0; round < ROUNDS; round++) {
        for (size_t i = 0; i < r->count; i++) {
            cli_variant *v = &r->variants[round & 1 ? r->count - 1 - i : i];
            int is_full = v == r->variants;
            char step[64];
            snprintf(step, sizeof step, "Round %u of %d, %s", round + 1, ROUNDS, is_full ? "with" : "without");
            cli_progress_step(progress, step, is_full ? "all effects" : brume_effect_name(v->effect));
            int code = render_round(session, options, progress, v, is_full ? 0 : 1u << v->effect, round, seed, samples,
                                    r);
            if (code)
                return code;
        }
        r->rounds = round + 1;
        r->samples = (round + 1) * samples;
    }
    return 0;
}

/* The folder that -o names, made if need be. */
static int prepare_folder(const cli_options *options)
{
    if (options->output_count > 1) {
        cli_error("-o: one folder at most");
        return CLI_EXIT_USAGE;
    }
    const char *folder = options->output_count ? options->outputs[0] : NULL;
    int error = folder ? platform_make_folder(folder) : 0;
    if (!error || brume_path_is_folder(folder))
        return 0;
    cli_error("%s: %s", folder, strerror(error == EEXIST ? ENOTDIR : error));
    return CLI_EXIT_OUTPUT;
}

int cli_effects(brume_context *context, const cli_options *options, cli_progress *progress)
{
    cli_session session;
    cli_variant variants[BRUME_EFFECT_COUNT + 1];
    cli_effects_result r = {options, variants, 1, 0, 0, 0, 0, 0};
    uint32_t effects;
    brume_integrator_desc integrator;
    memset(variants, 0, sizeof variants);
    int code = prepare_folder(options);
    if (code)
        return code;
    code = cli_session_open(&session, context, options, progress);
    if (code)
        goto cleanup;
    brume_result result = brume_scene_effects(session.scene, options->render.without, &effects, NULL);
    if (!result)
        result = brume_scene_get_integrator(session.scene, &integrator);
    if (result) {
        code = cli_report(context, result);
        goto cleanup;
    }
    for (int i = 0; i < BRUME_EFFECT_COUNT; i++)
        if ((effects >> i & 1) && brume_effect_removable((brume_effect)i))
            variants[r.count++].effect = (brume_effect)i;
    uint32_t samples = options->render.sample_count ? options->render.sample_count : integrator.sample_count;
    samples = samples < ROUNDS ? 1 : samples / ROUNDS;
    code = render_all(&session, options, progress, &r, options->render.use_seed ? options->render.seed
                                                                               : integrator.seed, samples);
    cli_progress_finish(progress);
    /* Stopped: two whole rounds are enough to tell of. */
    if (code && (code < CLI_EXIT_SIGNAL || r.rounds < 2))
        goto cleanup;
    for (size_t k = 0; k < r.count; k++)
        for (size_t i = 0; i < 3 * (size_t)r.width * r.height; i++) {
            variants[k].sums[0][i] /= (float)variants[k].counts[0];
            variants[k].sums[1][i] /= (float)variants[k].counts[1];
        }
    if (!cli_effects_compare(&r)) {
        cli_error("out of memory");
        code = CLI_EXIT_RUNTIME;
        goto cleanup;
    }
    cli_effects_print(&r);
    if (options->output_count) {
        int written = cli_effects_write(&r, options->outputs[0]);
        code = code ? code : written;
    }
cleanup:
    cli_progress_finish(progress);
    for (size_t k = 0; k < r.count; k++) {
        free(variants[k].sums[0]);
        free(variants[k].sums[1]);
    }
    cli_session_close(&session);
    return code;
}

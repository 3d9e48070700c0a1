/* render-cli study: what accuracy costs in time, for one scene. This file is the study from beginning to end; see
 * cli_study.h for the parts. */
#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "cli_study.h"
#include "files.h"
#include "scene_hash.h"

enum { DEFAULT_WIDTH = 160, REFERENCE_SEED = 1000003 };
/* Of the budget. */
#define REFERENCE_SHARE 0.4

/* ---- small things ---- */

void study_path(const study *s, const char *name, char out[STUDY_PATH])
{
    snprintf(out, STUDY_PATH, "%s/%s", s->folder, name);
}

void study_picture_path(const study *s, const char *stem, int seed, uint32_t samples, char out[STUDY_PATH])
{
    snprintf(out, STUDY_PATH, "%s/pictures/%s-%c-%u.pfm", s->folder, stem, 'a' + seed, samples);
}

int study_out_of_memory(void)
{
    cli_error("out of memory");
    return CLI_EXIT_RUNTIME;
}

int study_not_written(const char *path, int error)
{
    cli_error("%s: cannot be written: %s", path, strerror(error));
    return CLI_EXIT_OUTPUT;
}

/* Steps of the library, once for each of many renders, would bury the study's own. */
static void warnings_only(void *user, brume_log_level level, const char *message)
{
    const cli_progress *progress = user;
    if (level != BRUME_LOG_INFO || progress->verbosity > 0)
        cli_progress_log(user, level, message);
}

/* ---- before anything is rendered ---- */

static int make_folders(const study *s)
{
    char path[STUDY_PATH];
    if (strlen(s->folder) > STUDY_PATH / 2) {
        cli_error("%s: the name is too long", s->folder);
        return CLI_EXIT_OUTPUT;
    }
    study_path(s, "pictures", path);
    int error = files_make_folder(path);
    if (!error) {
        study_path(s, "study.html", path);
        return cli_output_check(path);
    }
    return study_not_written(path, error);
}

static void hash_scene(study *s)
{
    const cli_options *o = s->options;
    s->scene_hash = SCENE_HASH_START;
    scene_hash_file(&s->scene_hash, o->scene);
    for (size_t i = 0; i < o->parameter_count; i++) {
        scene_hash_bytes(&s->scene_hash, o->parameters[i].name, strlen(o->parameters[i].name) + 1);
        scene_hash_bytes(&s->scene_hash, o->parameters[i].value, strlen(o->parameters[i].value) + 1);
        scene_hash_file(&s->scene_hash, o->parameters[i].value);
    }
}

/* The film in small, or as large as --reference. */
static int set_size(study *s)
{
    const cli_study_options *o = &s->options->study;
    brume_film_desc film;
    uint32_t width = o->width, height = 0;
    brume_result result = brume_scene_get_film(s->session.scene, &film);
    if (!result && o->reference)
        result = brume_picture_read(s->context, o->reference, &width, &height, &s->other);
    if (result)
        return cli_report(s->context, result);
    s->full_width = film.width;
    s->full_height = film.height;
    if (width == 0)
        width = film.width < DEFAULT_WIDTH ? film.width : DEFAULT_WIDTH;
    double proportional = floor((double)width * film.height / film.width + 0.5);
    if (height == 0)
        height = proportional < 1 ? 1 : (uint32_t)proportional;
    if (o->reference && ((o->width && o->width != width) || fabs(proportional - height) > 1)) {
        cli_error("%s has %u x %u pixels; the scene's film is %u x %u%s", o->reference, width, height, film.width,
                  film.height, o->width && o->width != width ? ", and --width asks for another size" : "");
        return CLI_EXIT_USAGE;
    }
    film.width = s->width = width;
    film.height = s->height = height;
    film.crop_x = film.crop_y = film.crop_width = film.crop_height = 0;
    result = brume_scene_set_film(s->session.scene, &film);
    if (!result)
        result = brume_scene_get_integrator(s->session.scene, &s->base.integrator);
    return result ? cli_report(s->context, result) : CLI_EXIT_OK;
}

/* A device without doubles can't be asked for them; the rest of the study is as good. */
static void drop_doubles(study *s)
{
    size_t kept = 0;
    for (size_t i = 0; i < s->setting_count; i++)
        kept += !(study_setting_kinds(&s->settings[i]) & STUDY_ROUNDING);
    if (s->session.info.has_double || kept == s->setting_count || kept == 0)
        return;
    kept = 0;
    for (size_t i = 0; i < s->setting_count; i++)
        if (!(study_setting_kinds(&s->settings[i]) & STUDY_ROUNDING))
            study_setting_move(&s->settings[kept++], &s->settings[i]);
    s->setting_count = kept;
    if (s->options->verbosity >= 0)
        fprintf(stderr, "render-cli: warning: %s has no double precision: left out of the study\n",
                s->session.info.name);
}

/* Rendering anew for every power of two takes twice as long as going on: with twice the time curves end alike. */
static double shares_of(const study_setting *setting)
{
    return study_setting_kinds(setting) & STUDY_ADAPTIVE ? 2 : 1;
}

static int prepare(study *s)
{
    const cli_options *o = s->options;
    s->folder = o->study.folder ? o->study.folder : o->default_output;
    int code = study_settings_parse(o->study.settings ? o->study.settings : study_default_settings, s->settings,
                                    &s->setting_count);
    if (!code)
        code = cli_session_open(&s->session, s->context, o, s->progress);
    if (code)
        return code;
    drop_doubles(s);
    s->base.render = o->render;
    code = set_size(s);
    if (code)
        return code;
    if (!o->render.use_seed)
        s->base.render.seed = s->base.integrator.seed;
    hash_scene(s);
    s->reference_limit = REFERENCE_SHARE * o->study.budget / 2;
    double shares = 0;
    for (size_t i = 0; i < s->setting_count; i++)
        shares += shares_of(&s->settings[i]);
    s->limit = (1 - REFERENCE_SHARE) * o->study.budget / (STUDY_SEEDS * shares);
    code = make_folders(s);
    return code ? code : study_journal_open(s);
}

/* ---- renders ---- */

/* Unless it is done already: one seed of a setting, or a half of the reference (setting NULL). */
static int render_one(study *s, const study_setting *setting, study_run runs[STUDY_SEEDS], int seed)
{
    char stem[STUDY_NAME] = "reference";
    study_edit edit = s->base;
    double limit = setting ? shares_of(setting) * s->limit : s->reference_limit;
    uint32_t most = seed > 0 && runs[0].count > 0 ? runs[0].points[runs[0].count - 1].samples : 0;
    uint32_t number = s->base.render.seed + (uint32_t)seed + (setting ? 0 : REFERENCE_SEED);
    int code = CLI_EXIT_OK;
    if (setting) {
        edit.mean = s->reference_mean;
        study_setting_apply(setting, 0, &edit);
        study_setting_stem(setting, stem);
    }
    if (runs[seed].count == 0 && cli_signal())
        return CLI_EXIT_SIGNAL + cli_signal();
    if (runs[seed].count == 0) {
        code = study_measure(s, &edit, stem, seed, number, limit, most, setting != NULL, &runs[seed]);
        if (!code)
            code = study_journal_append(s, setting, seed, &runs[seed]);
    }
    s->behind += limit;
    return code;
}

static int render_all(study *s)
{
    char detail[2 * STUDY_NAME];
    int code = CLI_EXIT_OK;
    s->begun = cli_now();
    s->planned = s->reference_limit;
    for (size_t i = 0; i < s->setting_count; i++)
        s->planned += shares_of(&s->settings[i]) * s->limit;
    s->planned *= STUDY_SEEDS;
    for (int seed = 0; seed < STUDY_SEEDS && !code; seed++) {
        snprintf(detail, sizeof detail, "the reference, half %d of %d", seed + 1, STUDY_SEEDS);
        cli_progress_step(s->progress, "Rendering", detail);
        code = render_one(s, NULL, s->reference_runs, seed);
    }
    if (!code)
        code = study_judge_reference(s);
    for (size_t i = 0; i < s->setting_count && !code; i++) {
        snprintf(detail, sizeof detail, "%s (%zu of %zu)", s->settings[i].name, i + 1, s->setting_count);
        cli_progress_step(s->progress, "Rendering", detail);
        for (int seed = 0; seed < STUDY_SEEDS && !code; seed++)
            code = render_one(s, &s->settings[i], s->curves[i].runs, seed);
    }
    cli_progress_finish(s->progress);
    return code;
}

static int write_all(study *s)
{
    int drawn = 0;
    cli_progress_step(s->progress, "Writing", s->folder);
    int code = study_judge(s);
    if (!code)
        code = study_write_tables(s);
    if (!code)
        code = study_write_plot(s, &drawn);
    return code ? code : study_write_page(s, drawn);
}

int cli_study(brume_context *context, const cli_options *options, cli_progress *progress)
{
    study *s = calloc(1, sizeof *s);
    if (!s)
        return study_out_of_memory();
    s->context = context;
    s->options = options;
    s->progress = progress;
    brume_context_set_log(context, warnings_only, progress);
    int code = prepare(s);
    if (!code) {
        /* What is finished is on the disk, but the page is to be written whatever comes. */
        cli_hold_signals(1);
        code = render_all(s);
        if (code == CLI_EXIT_OK || code > CLI_EXIT_SIGNAL) {
            int written = write_all(s);
            code = written ? written : cli_signal() ? CLI_EXIT_SIGNAL + cli_signal() : code;
        }
        if (cli_signal() && options->verbosity >= 0)
            fprintf(stderr, "render-cli: stopped; the same command goes on where this was, %s/study.html shows what "
                            "there "
                            "is\n", s->folder);
        cli_hold_signals(0);
    }
    if (s->journal)
        fclose(s->journal);
    cli_session_close(&s->session);
    brume_picture_free(s->other);
    free(s->reference);
    free(s);
    return code;
}

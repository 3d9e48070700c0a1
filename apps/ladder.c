/* ladder -- renders scenes with each estimator of light in fog and measures error against time: the ladder from the
 * plainest way to the least noise. This file is the run from beginning to end; see ladder.h for the parts.
 *
 * What is compared is the estimator, so everything else is held equal: the scene, the paths' depth, the size, and
 * the time is that of rendering, without what is built or loaded before. */
#include <errno.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include "files.h"
#include "ladder.h"

/* ---- what is said ---- */

void ladder_error(const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    fputs("ladder: error: ", stderr);
    vfprintf(stderr, format, arguments);
    fputc('\n', stderr);
    va_end(arguments);
}

void ladder_say(const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    vfprintf(stderr, format, arguments);
    fputc('\n', stderr);
    va_end(arguments);
}

static void on_log(void *user, brume_log_level level, const char *message)
{
    (void)user;
    if (level == BRUME_LOG_WARNING)
        ladder_say("ladder: warning: %s", message);
}

int ladder_report(const ladder *l, brume_result result)
{
    const char *message = brume_context_message(l->context);
    ladder_error("%s", *message ? message : brume_result_name(result));
    switch (result) {
    case BRUME_ERROR_SCENE: return LADDER_EXIT_SCENE;
    case BRUME_ERROR_NO_DEVICE: return LADDER_EXIT_DEVICE;
    case BRUME_ERROR_BUILD: return LADDER_EXIT_BUILD;
    case BRUME_ERROR_OUTPUT: return LADDER_EXIT_OUTPUT;
    default: return LADDER_EXIT_RUNTIME;
    }
}

/* ---- files ---- */

int ladder_make_folder(const char *path)
{
    int error = files_make_folder(path);
    if (error)
        ladder_error("%s: cannot be made: %s", path, strerror(error));
    return error ? LADDER_EXIT_OUTPUT : LADDER_EXIT_OK;
}

FILE *ladder_open(const ladder *l, const char *name)
{
    char path[LADDER_PATH];
    snprintf(path, sizeof path, "%s/%s", l->options->out, name);
    FILE *file = fopen(path, "w");
    if (!file)
        ladder_error("%s: cannot be written: %s", path, strerror(errno));
    return file;
}

int ladder_close(const ladder *l, FILE *file, const char *name)
{
    int failed = ferror(file);
    failed |= fclose(file) != 0;
    if (!failed)
        return LADDER_EXIT_OK;
    ladder_error("%s/%s: cannot be written: %s", l->options->out, name, strerror(errno));
    return LADDER_EXIT_OUTPUT;
}

/* ---- scenes ---- */

int ladder_load(const ladder *l, const ladder_scene *from, brume_scene **out)
{
    const brume_parameter depth = {"depth", l->options->depth};
    brume_film_desc film;
    brume_result result = brume_scene_load(l->context, from->path, &depth, l->options->depth != NULL, out);
    if (result)
        return ladder_report(l, result);
    result = brume_scene_get_film(*out, &film);
    film.width = l->options->width;
    film.height = l->options->height;
    film.crop_x = film.crop_y = film.crop_width = film.crop_height = 0;
    if (!result)
        result = brume_scene_set_film(*out, &film);
    return result ? ladder_report(l, result) : LADDER_EXIT_OK;
}

/* ---- the rungs in all scenes ---- */

static int measure_scene(const ladder *l, const ladder_scene *from, ladder_row *row)
{
    brume_scene *scene = NULL;
    ladder_reference reference = {0};
    char folder[2 * LADDER_PATH];
    ladder_say("%s", from->name);
    snprintf(folder, sizeof folder, "%s/%s", l->options->out, from->name);
    int code = ladder_make_folder(folder);
    if (!code)
        code = ladder_load(l, from, &scene);
    if (!code)
        code = ladder_reference_get(l, from, scene, &reference);
    if (!code) {
        row->scene = from->name;
        row->reference_samples = reference.samples;
        row->reference_seconds = reference.seconds;
        row->reference_error = reference.error;
        memcpy(row->reference_png, reference.png, sizeof row->reference_png);
        code = ladder_measure_cells(l, scene, &reference, row);
    }
    ladder_reference_free(&reference);
    brume_scene_destroy(scene);
    return code ? code : ladder_scene_sheet(l, row);
}

static int measure_scenes(const ladder *l)
{
    ladder_row *rows = calloc(l->options->scene_count, sizeof *rows);
    if (!rows) {
        ladder_error("out of memory");
        return LADDER_EXIT_RUNTIME;
    }
    int code = LADDER_EXIT_OK;
    for (size_t i = 0; i < l->options->scene_count && !code; i++) {
        code = measure_scene(l, &l->options->scenes[i], &rows[i]);
        /* After each scene: who stops a long run has what there is. */
        if (!code)
            code = ladder_write_tables(l, rows, i + 1);
    }
    if (!code)
        code = ladder_overall_sheet(l, rows, l->options->scene_count);
    free(rows);
    return code;
}

int main(int argc, char **argv)
{
    static ladder_options options; /* large */
    ladder l;
    memset(&l, 0, sizeof l);
    l.options = &options;
    int code = ladder_options_parse(&options, argc, argv);
    if (code)
        return code;
    if (options.help) {
        ladder_print_help(stdout);
        return LADDER_EXIT_OK;
    }
    code = ladder_make_folder(options.out);
    if (code)
        return code;
    if (brume_context_create(&l.context)) {
        ladder_error("out of memory");
        return LADDER_EXIT_RUNTIME;
    }
    brume_context_set_log(l.context, on_log, NULL);
    brume_result result = brume_device_describe(l.context, options.device, &l.info);
    if (!result)
        result = brume_device_open(l.context, options.device, &l.device);
    if (result)
        code = ladder_report(&l, result);
    else if (options.mode == LADDER_MODE_SAMPLERS)
        code = ladder_samplers(&l);
    else if (options.mode == LADDER_MODE_LIGHTS)
        code = ladder_lights(&l);
    else
        code = measure_scenes(&l);
    brume_device_destroy(l.device);
    brume_context_destroy(l.context);
    return code;
}

/* Contact sheets: pictures side by side with what they are written below them, by ImageMagick's montage. */
#include <stdlib.h>
#include <string.h>

#include "ladder.h"
#include "platform.h"

void ladder_png_path(const ladder *l, const char *scene, const ladder_rung *rung, const char *kind,
                     char out[LADDER_PATH])
{
    char name[LADDER_NAME]; /* "systematic:16" is a fine label, but ':' and '+' mean things to tools */
    memcpy(name, rung->name, sizeof name);
    for (char *c = name; *c; c++)
        if (*c == ':' || *c == '+')
            *c = '-';
    snprintf(out, LADDER_PATH, "%s/%s/%s-%s.png", l->options->out, scene, name, kind);
}

/* ---- an argument list that owns its strings ---- */

enum { MOST_ARGUMENTS = 32 + 3 * (LADDER_RUNGS + 1) * LADDER_SCENES };

typedef struct command {
    char *arguments[MOST_ARGUMENTS + 1];
    size_t count;
    int failed; /* memory ran out, or there are too many */
} command;

static void add(command *c, const char *text)
{
    size_t size = strlen(text) + 1;
    char *copy = c->count < MOST_ARGUMENTS ? malloc(size) : NULL;
    if (!copy) {
        c->failed = 1;
        return;
    }
    memcpy(copy, text, size);
    c->arguments[c->count++] = copy;
}

static void add_picture(command *c, const char *label, const char *path)
{
    add(c, "-label");
    add(c, label);
    add(c, path);
}

/* `geometry` is the space for one picture and about it. */
static command *begin(const char *title, const char *geometry, size_t columns)
{
    char tile[32];
    command *c = calloc(1, sizeof *c);
    if (!c)
        return NULL;
    snprintf(tile, sizeof tile, "%zux", columns);
    /* Named: montage's own choice, Helvetica, is on few systems. */
    const char *const arguments[] = {"montage", "-font", "DejaVu-Sans", "-pointsize", "11", "-background", "#202020",
                                     "-fill", "#e0e0e0", "-tile", tile, "-geometry", geometry, "-title", title};
    for (size_t i = 0; i < sizeof arguments / sizeof arguments[0]; i++)
        add(c, arguments[i]);
    return c;
}

/* Runs it with the sheet's name as the last argument, and frees it. */
static int finish(const ladder *l, command *c, const char *name)
{
    char path[LADDER_PATH + LADDER_NAME + 8];
    int code = LADDER_EXIT_OK, error = 0;
    snprintf(path, sizeof path, "%s/%s.png", l->options->out, name);
    if (c)
        add(c, path);
    if (!c || c->failed) {
        ladder_error("%s: out of memory", path);
        code = LADDER_EXIT_RUNTIME;
    } else if ((error = platform_run(c->arguments, NULL)) > 0) {
        ladder_error("%s: montage cannot be run: %s (Debian: apt install imagemagick)", path, strerror(error));
        code = LADDER_EXIT_OUTPUT;
    } else if (error) {
        ladder_error("%s: montage failed", path);
        code = LADDER_EXIT_OUTPUT;
    }
    for (size_t i = 0; c && i < c->count; i++)
        free(c->arguments[i]);
    free(c);
    return code;
}

/* ---- the sheets ---- */

int ladder_scene_sheet(const ladder *l, const ladder_row *row)
{
    const ladder_options *o = l->options;
    char text[256], path[LADDER_PATH];
    snprintf(text, sizeof text, "%s: %u samples per pixel (above), about %g s (below); numbers are relMSE", row->scene,
             o->spp, o->seconds);
    command *c = begin(text, "+3+3", o->rung_count + 1);
    for (int timed = 0; timed < 2 && c; timed++) {
        snprintf(text, sizeof text, "reference\n%.0f spp", row->reference_samples);
        add_picture(c, text, row->reference_png);
        for (size_t i = 0; i < o->rung_count; i++) {
            const ladder_run *run = timed ? &row->cells[i].shown : &row->cells[i].equal_samples;
            ladder_png_path(l, row->scene, &o->rungs[i], timed ? "time" : "samples", path);
            snprintf(text, sizeof text, "%s\n%.0f spp, %.2f s\n%.2g", o->rungs[i].name, run->samples, run->seconds,
                     run->mse);
            add_picture(c, text, path);
        }
    }
    return finish(l, c, row->scene);
}

int ladder_overall_sheet(const ladder *l, const ladder_row *rows, size_t count)
{
    const ladder_options *o = l->options;
    char text[256], path[LADDER_PATH];
    snprintf(text, sizeof text, "Every rung in every scene, rendered for about %g s; numbers are relMSE", o->seconds);
    command *c = begin(text, "160x>+2+2", o->rung_count + 1);
    for (size_t s = 0; s < count && c; s++) {
        snprintf(text, sizeof text, "%s\nreference", rows[s].scene);
        add_picture(c, text, rows[s].reference_png);
        for (size_t i = 0; i < o->rung_count; i++) {
            const ladder_run *run = &rows[s].cells[i].shown;
            ladder_png_path(l, rows[s].scene, &o->rungs[i], "time", path);
            snprintf(text, sizeof text, "%s\n%.0f spp: %.2g", o->rungs[i].name, run->samples, run->mse);
            add_picture(c, text, path);
        }
    }
    return finish(l, c, "ladder");
}

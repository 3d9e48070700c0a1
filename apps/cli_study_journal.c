/* What a study has finished, in FOLDER/study.journal: a few lines that say which study it is, then a line a run. Every
 * line is on the disk before the next run begins, so that a study that was stopped, by whatever, goes on where it was.
 *
 * A line that the machine stopped in the middle of lacks the full stop at its end, and is overwritten. */
#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "cli_study.h"
#include "platform.h"

static const char title[] = "brume study 2";

/* ---- which study it is ---- */

enum { KEYS = 11, LINE = 8192 };

/* "name value" each. */
static void write_keys(const study *s, char keys[KEYS][LINE])
{
    const cli_study_options *o = &s->options->study;
    size_t n = 0;
    snprintf(keys[n++], LINE, "scene %s", s->options->scene);
    snprintf(keys[n++], LINE, "content %016llx", (unsigned long long)s->scene_hash);
    snprintf(keys[n++], LINE, "program %s", BRUME_VERSION);
    snprintf(keys[n++], LINE, "device %s", s->session.info.name);
    snprintf(keys[n++], LINE, "size %ux%u", s->width, s->height);
    snprintf(keys[n++], LINE, "seed %u", s->base.render.seed);
    snprintf(keys[n++], LINE, "lanes %u", s->base.render.lanes);
    snprintf(keys[n++], LINE, "without %x", s->base.render.without);
    snprintf(keys[n++], LINE, "budget %g", o->budget);
    snprintf(keys[n++], LINE, "settings %s", o->settings ? o->settings : study_default_settings);
    snprintf(keys[n++], LINE, "begin");
    for (size_t i = 0; i < KEYS; i++)
        for (char *c = keys[i]; *c; c++)
            if (*c == '\n')
                *c = ' ';
}

/* The line at *text, NULL at the end or if it has no end; moves *text behind it. */
static char *next_line(char **text)
{
    char *line = *text, *end = strchr(line, '\n');
    if (!end)
        return NULL;
    *end = 0;
    *text = end + 1;
    return line;
}

static int refuse(const study *s, const char *was, const char *is)
{
    size_t name = strcspn(is, " ");
    cli_error("%s holds another study: its %.*s is \"%s\", not \"%s\"; --fresh starts over", s->folder, (int)name, is,
              strncmp(was, is, name) == 0 && was[name] ? was + name + 1 : "", is[name] ? is + name + 1 : "");
    return CLI_EXIT_USAGE;
}

/* ---- runs ---- */

static study_run *find_run(study *s, const char *name, int seed)
{
    if (strcmp(name, "reference") == 0)
        return &s->reference_runs[seed];
    for (size_t i = 0; i < s->setting_count; i++)
        if (strcmp(name, s->settings[i].name) == 0)
            return &s->curves[i].runs[seed];
    return NULL;
}

/* run NAME SEED COUNT BVH UPLOAD BUILD PILOT, then SAMPLES:SECONDS:CPU:ESTIMATED:BAD each, then a full stop. */
static int read_run(study *s, const char *line)
{
    char name[STUDY_NAME];
    int seed, used;
    size_t count;
    study_run run;
    memset(&run, 0, sizeof run);
    if (sscanf(line, "run %63s %d %zu %la %la %la %la%n", name, &seed, &count, &run.bvh_seconds, &run.upload_seconds,
               &run.build_seconds, &run.pilot_seconds, &used) != 7 || seed < 0 || seed >= STUDY_SEEDS || count == 0 ||
        count > STUDY_POINTS)
        return 0;
    line += used;
    for (size_t i = 0; i < count; i++) {
        study_run_point *p = &run.points[i];
        unsigned long long bad;
        if (sscanf(line, " %u:%la:%la:%la:%llu%n", &p->samples, &p->seconds, &p->cpu_seconds, &p->estimated, &bad,
                   &used) != 5)
            return 0;
        p->bad_samples = bad;
        line += used;
    }
    run.count = count;
    study_run *to = find_run(s, name, seed);
    if (strcmp(line, " .") != 0 || !to)
        return 0;
    *to = run;
    return 1;
}

int study_journal_append(study *s, const study_setting *setting, int seed, const study_run *run)
{
    char path[STUDY_PATH];
    FILE *file = s->journal;
    fprintf(file, "run %s %d %zu %a %a %a %a", setting ? setting->name : "reference", seed, run->count,
            run->bvh_seconds, run->upload_seconds, run->build_seconds, run->pilot_seconds);
    for (size_t i = 0; i < run->count; i++)
        fprintf(file, " %u:%a:%a:%a:%llu", run->points[i].samples, run->points[i].seconds, run->points[i].cpu_seconds,
                run->points[i].estimated, (unsigned long long)run->points[i].bad_samples);
    fputs(" .\n", file);
    study_path(s, "study.journal", path);
    int error = platform_sync(file);
    if (error || ferror(file))
        return study_not_written(path, error ? error : EIO);
    return CLI_EXIT_OK;
}

/* ---- both ---- */

/* A run whose pictures are gone is rendered again. */
static void forget_without_pictures(study *s, study_run *run, const char *stem, int seed, int all)
{
    char path[STUDY_PATH];
    for (size_t i = all || run->count == 0 ? 0 : run->count - 1; i < run->count; i++) {
        study_picture_path(s, stem, seed, run->points[i].samples, path);
        if (!platform_is_readable(path))
            run->count = 0;
    }
}

static char *read_whole(const char *path)
{
    FILE *file = fopen(path, "rb");
    char *text = NULL;
    if (file && fseek(file, 0, SEEK_END) == 0) {
        long size = ftell(file);
        rewind(file);
        text = size >= 0 ? calloc((size_t)size + 1, 1) : NULL;
        if (text && fread(text, 1, (size_t)size, file) != (size_t)size) {
            free(text);
            text = NULL;
        }
    }
    if (file)
        fclose(file);
    return text;
}

/* Up to where the file is good; 0: from the start. An exit code. */
static int resume(study *s, char keys[KEYS][LINE], char *text, long *good)
{
    char *at = text, *line = next_line(&at);
    *good = 0;
    if (!line && !*text)
        return CLI_EXIT_OK;
    if (!line || strcmp(line, title) != 0) {
        cli_error("%s/study.journal is no journal of this version; --fresh starts over", s->folder);
        return CLI_EXIT_USAGE;
    }
    for (size_t i = 0; i < KEYS; i++) {
        line = next_line(&at);
        if (!line) /* stopped in its first moment */
            return CLI_EXIT_OK;
        if (strcmp(line, keys[i]) != 0)
            return refuse(s, line, keys[i]);
    }
    *good = at - text;
    while ((line = next_line(&at)) != NULL && read_run(s, line))
        *good = at - text;
    return CLI_EXIT_OK;
}

int study_journal_open(study *s)
{
    static char keys[KEYS][LINE];
    char path[STUDY_PATH], stem[STUDY_NAME];
    long good = 0;
    int code = CLI_EXIT_OK;
    write_keys(s, keys);
    study_path(s, "study.journal", path);
    char *text = s->options->study.fresh ? NULL : read_whole(path);
    if (text)
        code = resume(s, keys, text, &good);
    free(text);
    if (code)
        return code;
    s->journal = fopen(path, good > 0 ? "r+b" : "wb");
    if (!s->journal || (good > 0 && (platform_truncate(s->journal, good) != 0 ||
                                     fseek(s->journal, good, SEEK_SET) != 0)))
        return study_not_written(path, errno);
    if (good == 0) {
        fprintf(s->journal, "%s\n", title);
        for (size_t i = 0; i < KEYS; i++)
            fprintf(s->journal, "%s\n", keys[i]);
        int error = platform_sync(s->journal);
        if (error)
            return study_not_written(path, error);
    }
    for (int seed = 0; seed < STUDY_SEEDS; seed++) {
        forget_without_pictures(s, &s->reference_runs[seed], "reference", seed, 0);
        for (size_t i = 0; i < s->setting_count; i++) {
            study_setting_stem(&s->settings[i], stem);
            forget_without_pictures(s, &s->curves[i].runs[seed], stem, seed, 1);
        }
    }
    return CLI_EXIT_OK;
}

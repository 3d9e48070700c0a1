/* The settings of a study: names, and what they edit. To add one, add a line to the table. */
#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "cli_study.h"
#include "estimators.h"

const char study_default_settings[] =
    "auto,distance,equiangular,mis,raster,auto+phase,auto+independent,auto+adaptive,"
    "auto+without-multiple-scattering,auto+depth-3,auto+clamp-20x,auto+double";

/* What follows a part's name. */
typedef enum study_operand { OPERAND_NONE, OPERAND_WHOLE, OPERAND_FACTOR /* 3.5x */, OPERAND_EFFECT } study_operand;

struct study_part {
    const char *name; /* before the operand, if it takes one */
    study_operand operand;
    study_kind kind;
    void (*apply)(study_edit *edit, double number); /* an effect is given by its number, too */
    const char *what; /* %s: the operand */
};

static void set_sobol(study_edit *e, double number)
{
    (void)number;
    e->integrator.sampler = BRUME_SAMPLER_SOBOL;
}

static void set_independent(study_edit *e, double number)
{
    (void)number;
    e->integrator.sampler = BRUME_SAMPLER_INDEPENDENT;
}

static void set_float(study_edit *e, double number)
{
    (void)number;
    e->render.precision = BRUME_PRECISION_FLOAT;
}

static void set_double(study_edit *e, double number)
{
    (void)number;
    e->render.precision = BRUME_PRECISION_DOUBLE;
}

static void set_adaptive(study_edit *e, double number)
{
    (void)number;
    e->render.adaptive = BRUME_ADAPTIVE_ON;
}

static void set_without(study_edit *e, double number)
{
    e->render.without |= 1u << (unsigned)number;
}

static void set_depth(study_edit *e, double number)
{
    e->integrator.max_depth = (int32_t)number;
}

static void set_clamp(study_edit *e, double number)
{
    e->render.clamp = (float)(number * e->mean);
}

static const study_part parts[] = {
    {"sobol", OPERAND_NONE, STUDY_EXACT, set_sobol, "Owen-scrambled Sobol’ points"},
    {"independent", OPERAND_NONE, STUDY_EXACT, set_independent,
     "independent random numbers instead of Sobol’ points"},
    {"float", OPERAND_NONE, STUDY_EXACT, set_float, "single precision"},
    {"double", OPERAND_NONE, STUDY_ROUNDING, set_double, "the same random numbers, transport in double precision"},
    {"adaptive", OPERAND_NONE, STUDY_ADAPTIVE, set_adaptive,
     "samples placed where the error is; their number is the mean over the pixels, or a few percent less"},
    {"without-", OPERAND_EFFECT, STUDY_APPROXIMATE, set_without, "the scene without %s"},
    {"depth-", OPERAND_WHOLE, STUDY_APPROXIMATE, set_depth,
     "paths cut after %s edges (2: light that is scattered or reflected once)"},
    {"clamp-", OPERAND_FACTOR, STUDY_APPROXIMATE, set_clamp, "samples clamped to %s times the picture’s mean"},
};

/* Estimators are named by the library. */
static const study_part strategy_part = {"", OPERAND_NONE, STUDY_EXACT, NULL, "light scattered once found by %s"};
static const study_part indirect_part = {"", OPERAND_NONE, STUDY_EXACT, NULL,
                                         "light scattered more than once found by %s"};

/* An effect that can be taken away. */
static int read_effect(const char *name, double *out)
{
    for (int i = 0; i < BRUME_EFFECT_COUNT; i++)
        if (strcmp(brume_effect_name((brume_effect)i), name) == 0) {
            *out = i;
            return brume_effect_removable((brume_effect)i);
        }
    return 0;
}

static int read_operand(const study_part *part, const char *text, size_t length, double *out)
{
    char digits[STUDY_NAME], *end;
    size_t name = strlen(part->name);
    if (length <= name || length - name >= sizeof digits || strncmp(text, part->name, name) != 0)
        return 0;
    memcpy(digits, text + name, length - name);
    digits[length - name] = 0;
    if (part->operand == OPERAND_EFFECT)
        return read_effect(digits, out);
    *out = strtod(digits, &end);
    if (end == digits || digits[0] < '0' || digits[0] > '9' || !(*out > 0) || *out > 1e6)
        return 0;
    return part->operand == OPERAND_FACTOR ? strcmp(end, "x") == 0 : *end == 0 && *out == floor(*out);
}

static const study_part *find_part(const char *text, size_t length)
{
    brume_strategy strategy;
    brume_indirect indirect;
    uint32_t positions;
    double number;
    for (size_t i = 0; i < sizeof parts / sizeof parts[0]; i++)
        if (parts[i].operand ? read_operand(&parts[i], text, length, &number)
                             : strlen(parts[i].name) == length && strncmp(parts[i].name, text, length) == 0)
            return &parts[i];
    if (estimators_strategy(text, length, &strategy, &positions))
        return &strategy_part;
    return estimators_indirect(text, length, &indirect) ? &indirect_part : NULL;
}

static int parse_setting(const char *text, size_t length, study_setting *out)
{
    memset(out, 0, sizeof *out);
    if (length == 0 || length >= sizeof out->name) {
        cli_error("--settings: \"%.*s\" is no name of a setting", (int)length, text);
        return CLI_EXIT_USAGE;
    }
    memcpy(out->name, text, length);
    for (const char *at = out->name;; at++) {
        size_t part_length = strcspn(at, "+");
        const study_part *part = find_part(at, part_length);
        if (!part && strncmp(at, "without-", 8) == 0) {
            cli_error("--settings: %.*s names no effect that can be taken away; those of --without are listed by "
                      "--help", (int)part_length, at);
            return CLI_EXIT_USAGE;
        }
        if (!part || out->part_count == STUDY_PARTS) {
            cli_error("--settings: expected a strategy, a way of --indirect, sobol, independent, float, double, "
                      "adaptive, without-EFFECT, depth-N, clamp-Nx, or up to %d of these with + between them, not "
                      "\"%s\"", STUDY_PARTS, out->name);
            return CLI_EXIT_USAGE;
        }
        out->parts[out->part_count].part = part;
        out->parts[out->part_count].text = at;
        out->parts[out->part_count++].length = part_length;
        at += part_length;
        if (!*at)
            return CLI_EXIT_OK;
    }
}

int study_settings_parse(const char *list, study_setting *out, size_t *count)
{
    *count = 0;
    for (const char *at = list;; at++) {
        size_t length = strcspn(at, ",");
        if (*count == STUDY_SETTINGS) {
            cli_error("--settings: more than %d", STUDY_SETTINGS);
            return CLI_EXIT_USAGE;
        }
        int code = parse_setting(at, length, &out[*count]);
        if (code)
            return code;
        for (size_t i = 0; i < *count; i++)
            if (strcmp(out[i].name, out[*count].name) == 0) {
                cli_error("--settings: %s twice", out[i].name);
                return CLI_EXIT_USAGE;
            }
        ++*count;
        at += length;
        if (!*at)
            return CLI_EXIT_OK;
    }
}

void study_setting_move(study_setting *to, const study_setting *from)
{
    if (to == from)
        return;
    *to = *from;
    for (size_t i = 0; i < to->part_count; i++)
        to->parts[i].text = to->name + (from->parts[i].text - from->name);
}

unsigned study_setting_kinds(const study_setting *setting)
{
    unsigned kinds = 0;
    for (size_t i = 0; i < setting->part_count; i++)
        kinds |= (unsigned)setting->parts[i].part->kind;
    return kinds;
}

void study_setting_apply(const study_setting *setting, unsigned without, study_edit *edit)
{
    for (size_t i = 0; i < setting->part_count; i++) {
        const study_part *part = setting->parts[i].part;
        const char *text = setting->parts[i].text;
        size_t length = setting->parts[i].length;
        double number = 0;
        if ((unsigned)part->kind & without)
            continue;
        if (part == &strategy_part) {
            edit->render.use_strategy = 1;
            estimators_strategy(text, length, &edit->render.strategy, &edit->render.positions);
        } else if (part == &indirect_part) {
            edit->render.use_indirect = 1;
            estimators_indirect(text, length, &edit->render.indirect);
        } else {
            if (part->operand)
                read_operand(part, text, length, &number);
            part->apply(edit, number);
        }
    }
}

void study_setting_describe(const study_setting *setting, char *out, size_t size)
{
    size_t used = 0;
    *out = 0;
    for (size_t i = 0; i < setting->part_count && used < size; i++) {
        const study_part *part = setting->parts[i].part;
        char value[STUDY_NAME];
        size_t skip = strlen(part->name), length = setting->parts[i].length - skip;
        if (part->operand == OPERAND_FACTOR)
            length--; /* the x */
        memcpy(value, setting->parts[i].text + skip, length);
        value[length] = 0;
        const char *mark = strstr(part->what, "%s");
        int before = mark ? (int)(mark - part->what) : (int)strlen(part->what);
        int written = snprintf(out + used, size - used, "%s%.*s%s%s", i > 0 ? "; " : "", before, part->what,
                               mark ? value : "", mark ? mark + 2 : "");
        used += written > 0 ? (size_t)written : 0;
    }
}

/* Whether two edits render the same. */
static int same_edit(const study_edit *a, const study_edit *b)
{
    const brume_render_desc *x = &a->render, *y = &b->render;
    return (x->use_strategy ? x->strategy : a->integrator.strategy) ==
               (y->use_strategy ? y->strategy : b->integrator.strategy) &&
           (x->use_strategy ? x->positions : a->integrator.positions) ==
               (y->use_strategy ? y->positions : b->integrator.positions) &&
           (x->use_indirect ? x->indirect : a->integrator.indirect) ==
               (y->use_indirect ? y->indirect : b->integrator.indirect) &&
           x->precision == y->precision && x->clamp == y->clamp && a->integrator.sampler == b->integrator.sampler &&
           x->adaptive == y->adaptive && x->without == y->without &&
           a->integrator.max_depth == b->integrator.max_depth;
}

size_t study_setting_partner(const study_setting *settings, size_t count, size_t of, unsigned without,
                             const study_edit *base)
{
    study_edit wanted = *base;
    study_setting_apply(&settings[of], without, &wanted);
    for (size_t i = 0; i < count; i++) {
        study_edit edit = *base;
        study_setting_apply(&settings[i], 0, &edit);
        if (i != of && same_edit(&wanted, &edit))
            return i;
    }
    return count;
}

void study_setting_stem(const study_setting *setting, char out[STUDY_NAME])
{
    memcpy(out, setting->name, STUDY_NAME);
    for (char *c = out; *c; c++)
        if (*c == ':')
            *c = '-'; /* no name for a file everywhere */
}

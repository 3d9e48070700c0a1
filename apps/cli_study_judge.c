/* Figures of what a study has rendered: all of them follow from the pictures in its folder and the times in its
 * journal. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "cli_study.h"
#include "flip.h"
#include "picture_file.h"

/* The share of pixels, the worst ones, that `trimmed` leaves out. */
#define DROPPED 0.001
/* Bias is believed beyond so many standard errors. */
#define BELIEVED 3.0
/* Errors below so many times the reference's own can't be told from it. */
#define FLOOR_FACTOR 4.0
/* This share of the reference's pixels is shown without being cut. */
#define SHOWN_SHARE 0.98

static float *load(const study *s, const char *stem, int seed, uint32_t samples)
{
    char path[STUDY_PATH];
    study_picture_path(s, stem, seed, samples, path);
    float *picture = picture_read_pfm(path, s->width, s->height);
    if (!picture)
        cli_error("%s: is no picture of this study; --fresh starts over", path);
    return picture;
}

static int ascending(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* The value below which `share` of them lie; sorts them. */
static double quantile(double *values, size_t count, double share)
{
    qsort(values, count, sizeof *values, ascending);
    return values[(size_t)(share * (double)(count - 1) + 0.5)];
}

static double see_difference(const study *s, const float *from, const float *to)
{
    return flip_compute(from, to, s->width, s->height, s->exposure, FLIP_PIXELS_PER_DEGREE, NULL);
}

/* ---- the reference ---- */

int study_judge_reference(study *s)
{
    size_t count = (size_t)s->width * s->height;
    const study_run *run = s->reference_runs;
    if (run[0].count == 0 || run[1].count == 0 || s->reference)
        return CLI_EXIT_OK;
    uint32_t samples = run[0].points[run[0].count - 1].samples;
    float *a = load(s, "reference", 0, samples), *b = load(s, "reference", 1, samples);
    double *bright = malloc(count * sizeof *bright);
    if (!a || !b || !bright) {
        free(a);
        free(b);
        free(bright);
        return CLI_EXIT_RUNTIME;
    }
    s->reference = malloc(3 * count * sizeof *s->reference);
    if (!s->reference) {
        free(a);
        free(b);
        free(bright);
        return study_out_of_memory();
    }
    double sum = 0;
    for (size_t i = 0; i < 3 * count; i++)
        sum += s->reference[i] = 0.5f * (a[i] + b[i]);
    for (size_t i = 0; i < count; i++)
        bright[i] = fmax(fmax(s->reference[3 * i], s->reference[3 * i + 1]), s->reference[3 * i + 2]);
    /* The mean of two has half the error of each. */
    s->reference_error = 0.5 * error_metrics_of_pair(a, b, s->reference, count);
    s->reference_mean = sum / (3.0 * (double)count);
    s->reference_samples = 2 * samples;
    double brightest = quantile(bright, count, SHOWN_SHARE);
    s->exposure = brightest > 0 ? 1 / brightest : 1;
    free(a);
    free(b);
    free(bright);
    return CLI_EXIT_OK;
}

static int judge_other(study *s)
{
    error_metrics m;
    s->other_relmse = s->other_flip = s->other_ratio = NAN;
    if (!s->other)
        return CLI_EXIT_OK;
    if (!error_metrics_compute(s->reference, s->other, (size_t)s->width * s->height, DROPPED, &m))
        return study_out_of_memory();
    s->other_relmse = m.mse;
    s->other_ratio = m.ratio;
    s->other_flip = see_difference(s, s->other, s->reference);
    return s->other_flip < 0 ? study_out_of_memory() : CLI_EXIT_OK;
}

/* ---- one setting ---- */

static int judge_picture(const study *s, const float *picture, const study_run_point *at, study_figures *out)
{
    size_t count = (size_t)s->width * s->height;
    error_metrics m;
    if (!error_metrics_compute(picture, s->reference, count, DROPPED, &out->metrics))
        return study_out_of_memory();
    error_figures_compute(picture, s->reference, s->width, s->height, &out->figures);
    out->flip = see_difference(s, s->reference, picture);
    out->estimated = at->estimated >= 0 ? at->estimated : NAN;
    out->other_relmse = out->other_flip = NAN;
    if (out->flip < 0)
        return study_out_of_memory();
    if (s->other) {
        if (!error_metrics_compute(picture, s->other, count, DROPPED, &m))
            return study_out_of_memory();
        out->other_relmse = m.mse;
        out->other_flip = see_difference(s, s->other, picture);
        if (out->other_flip < 0)
            return study_out_of_memory();
    }
    return CLI_EXIT_OK;
}

static int judge_point(const study *s, const study_curve *curve, size_t i, float *const pictures[STUDY_SEEDS],
                       study_point *p)
{
    size_t count = (size_t)s->width * s->height;
    const study_figures *a = &p->of[0], *b = &p->of[1];
    const study_run_point *at[2] = {&curve->runs[0].points[i], &curve->runs[1].points[i]};
    p->samples = at[0]->samples;
    p->wall_seconds = 0.5 * (at[0]->seconds + at[1]->seconds);
    p->cpu_seconds = 0.5 * (at[0]->cpu_seconds + at[1]->cpu_seconds);
    p->seconds = s->options->study.cpu_clock ? p->cpu_seconds / s->session.info.compute_units : p->wall_seconds;
    p->bad_samples = at[0]->bad_samples + at[1]->bad_samples;
    p->relmse = 0.5 * (a->metrics.mse + b->metrics.mse);
    p->trimmed = 0.5 * (a->metrics.trimmed + b->metrics.trimmed);
    p->ratio = 0.5 * (a->metrics.ratio + b->metrics.ratio);
    p->mape = 0.5 * (a->figures.mape + b->figures.mape);
    p->smape = 0.5 * (a->figures.smape + b->figures.smape);
    p->flip = 0.5 * (a->flip + b->flip);
    p->estimated = 0.5 * (a->estimated + b->estimated);
    p->fireflies = 0.5 * (double)(a->figures.fireflies + b->figures.fireflies);
    p->other_relmse = 0.5 * (a->other_relmse + b->other_relmse);
    p->noise = error_metrics_of_pair(pictures[0], pictures[1], s->reference, count);
    p->bias = error_metrics_bias(pictures[0], pictures[1], s->reference, count, s->reference_error, &p->bias_sigma);
    p->near_floor = p->relmse < FLOOR_FACTOR * s->reference_error;

    error_metrics m;
    float *mean = malloc(3 * count * sizeof *mean);
    if (!mean)
        return study_out_of_memory();
    for (size_t k = 0; k < 3 * count; k++)
        mean[k] = 0.5f * (pictures[0][k] + pictures[1][k]);
    int ok = error_metrics_compute(mean, s->reference, count, 0, &m);
    p->deviates = m.deviates;
    free(mean);
    return ok ? CLI_EXIT_OK : study_out_of_memory();
}

/* A target that something reaches: the first of 1, 2 and 5 times a power of ten that is above the least error of the
 * settings that approximate nothing, or of all if there are no others. */
static double round_target(const study *s)
{
    double least = INFINITY, least_of_all = INFINITY;
    for (size_t k = 0; k < s->setting_count; k++)
        for (size_t i = 0; i < s->curves[k].count; i++) {
            double error = s->curves[k].points[i].relmse;
            if (!(error > 0))
                continue;
            least_of_all = fmin(least_of_all, error);
            if (!(study_setting_kinds(&s->settings[k]) & STUDY_APPROXIMATE))
                least = fmin(least, error);
        }
    least = isfinite(least) ? least : least_of_all;
    if (!isfinite(least))
        return 0.01;
    double power = pow(10, floor(log10(least)));
    return least <= power ? power : least <= 2 * power ? 2 * power : least <= 5 * power ? 5 * power : 10 * power;
}

/* Of fewer points a slope says little. */
enum { LEAST_FOR_SLOPE = 3 };

/* What follows from the points. */
static void judge_curve(const study *s, study_curve *c)
{
    double times[STUDY_POINTS], errors[STUDY_POINTS], noises[STUDY_POINTS];
    size_t above = 0;
    double clear_times[STUDY_POINTS], clear_errors[STUDY_POINTS];
    for (size_t i = 0; i < c->count; i++) {
        times[i] = c->points[i].seconds;
        errors[i] = c->points[i].relmse;
        noises[i] = c->points[i].noise;
        if (!c->points[i].near_floor) {
            clear_times[above] = times[i];
            clear_errors[above++] = errors[i];
        }
    }
    const study_point *last = &c->points[c->count - 1];
    c->bias = last->bias > BELIEVED * last->bias_sigma ? last->bias : 0;
    c->slope = above < LEAST_FOR_SLOPE ? NAN : error_metrics_slope(clear_times, clear_errors, above);
    c->noise_slope = c->count < LEAST_FOR_SLOPE ? NAN : error_metrics_slope(times, noises, c->count);
    c->time_to_target =
        curves_time_to(times, errors, c->count, s->target, c->noise_slope, c->bias, &c->target_kind);
    c->halving = curves_halving(c->bias + last->noise, c->bias, c->noise_slope);
}

static int judge_setting(study *s, const study_setting *setting, study_curve *c)
{
    char stem[STUDY_NAME];
    int code = CLI_EXIT_OK;
    c->count = 0;
    size_t count = c->runs[0].count < c->runs[1].count ? c->runs[0].count : c->runs[1].count;
    study_setting_stem(setting, stem);
    for (size_t i = 0; i < count && !code; i++) {
        study_point *p = &c->points[i];
        float *pictures[STUDY_SEEDS] = {NULL};
        for (int seed = 0; seed < STUDY_SEEDS && !code; seed++) {
            const study_run_point *at = &c->runs[seed].points[i];
            pictures[seed] = load(s, stem, seed, at->samples);
            code = pictures[seed] ? judge_picture(s, pictures[seed], at, &p->of[seed]) : CLI_EXIT_RUNTIME;
        }
        if (!code)
            code = judge_point(s, c, i, pictures, p);
        for (int seed = 0; seed < STUDY_SEEDS; seed++)
            free(pictures[seed]);
    }
    if (code || count == 0)
        return code;
    c->count = count;
    return CLI_EXIT_OK;
}

/* ---- precision: the same random numbers, so that the difference is the rounding ---- */

static int judge_rounding(study *s, size_t single, size_t other)
{
    const study_curve *x = &s->curves[single], *y = &s->curves[other];
    size_t common = x->count < y->count ? x->count : y->count, pixels = (size_t)s->width * s->height;
    char stem[STUDY_NAME];
    if (common == 0)
        return CLI_EXIT_OK;
    uint32_t samples = x->points[common - 1].samples;
    study_setting_stem(&s->settings[single], stem);
    float *a = load(s, stem, 0, samples);
    study_setting_stem(&s->settings[other], stem);
    float *b = load(s, stem, 0, samples);
    double *worst = malloc(pixels * sizeof *worst);
    int ok = a && b && worst;
    if (ok) {
        study_rounding *r = &s->roundings[s->rounding_count++];
        double squares = 0, above = 0;
        for (size_t i = 0; i < pixels; i++) {
            worst[i] = 0;
            for (size_t c = 3 * i; c < 3 * i + 3; c++) {
                double d = fabs((double)a[c] - b[c]);
                if (d > 0)
                    worst[i] = fmax(worst[i], d / (fabs(b[c]) + 0.1 * s->reference_mean));
            }
            squares += worst[i] * worst[i];
            above += worst[i] > 1e-3;
        }
        r->single = single;
        r->other = other;
        r->samples = samples;
        r->cost = y->points[common - 1].seconds / x->points[common - 1].seconds;
        r->root_mean_square = sqrt(squares / (double)pixels);
        r->share_above = above / (double)pixels;
        r->median = quantile(worst, pixels, 0.5);
        r->most = worst[pixels - 1];
    }
    free(a);
    free(b);
    free(worst);
    return ok ? CLI_EXIT_OK : CLI_EXIT_RUNTIME;
}

/* ---- all of them ---- */

/* The longest time that every curve has reached. */
static double common_time(const study *s)
{
    double time = INFINITY;
    for (size_t i = 0; i < s->setting_count; i++)
        if (s->curves[i].count > 0)
            time = fmin(time, s->curves[i].points[s->curves[i].count - 1].seconds);
    return isfinite(time) ? time : 0;
}

static void judge_times(study *s)
{
    double times[STUDY_POINTS], errors[STUDY_POINTS];
    for (size_t k = 0; k < s->setting_count; k++) {
        study_curve *c = &s->curves[k];
        double nearest = INFINITY;
        for (size_t i = 0; i < c->count; i++) {
            times[i] = c->points[i].seconds;
            errors[i] = c->points[i].relmse;
            double away = fabs(log(times[i] / s->time_target));
            if (away < nearest) {
                nearest = away;
                c->shown = i;
            }
        }
        c->at_time = curves_error_at(times, errors, c->count, s->time_target);
    }
}

static void judge_front(study *s)
{
    enum { MOST = STUDY_SETTINGS * STUDY_POINTS };
    static double times[MOST], errors[MOST];
    static int front[MOST];
    size_t n = 0;
    for (size_t k = 0; k < s->setting_count; k++)
        for (size_t i = 0; i < s->curves[k].count; i++, n++) {
            times[n] = s->curves[k].points[i].seconds;
            errors[n] = s->curves[k].points[i].relmse;
        }
    curves_front(times, errors, n, front);
    n = 0;
    for (size_t k = 0; k < s->setting_count; k++)
        for (size_t i = 0; i < s->curves[k].count; i++, n++)
            s->curves[k].points[i].on_front = front[n];
}

int study_judge(study *s)
{
    int code = study_judge_reference(s);
    s->rounding_count = 0;
    if (code || !s->reference)
        return code;
    code = judge_other(s);
    for (size_t i = 0; i < s->setting_count && !code; i++)
        code = judge_setting(s, &s->settings[i], &s->curves[i]);
    s->target = s->options->study.target > 0 ? s->options->study.target : round_target(s);
    for (size_t i = 0; i < s->setting_count && !code; i++)
        if (s->curves[i].count > 0)
            judge_curve(s, &s->curves[i]);
    s->time_target = s->options->study.time_target > 0 ? s->options->study.time_target : common_time(s);
    judge_times(s);
    judge_front(s);
    for (size_t i = 0; i < s->setting_count && !code; i++) {
        size_t partner = study_setting_partner(s->settings, s->setting_count, i, STUDY_ROUNDING, &s->base);
        if ((study_setting_kinds(&s->settings[i]) & STUDY_ROUNDING) && partner < s->setting_count)
            code = judge_rounding(s, partner, i);
    }
    return code;
}

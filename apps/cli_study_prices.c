/* The page's sections on what approximations and precision cost: what they save in time, and what error stays. */
#include <math.h>

#include "cli_study.h"

/* By how much a sample of `c` is cheaper than one of `base`, at the most samples both have. */
static double saving(const study_curve *c, const study_curve *base)
{
    size_t common = c->count < base->count ? c->count : base->count;
    return common == 0 ? NAN : 1 - c->points[common - 1].seconds / base->points[common - 1].seconds;
}

/* Noise at the time target, interpolated like the error. */
static double noise_at(const study *s, const study_curve *c)
{
    double times[STUDY_POINTS], noises[STUDY_POINTS];
    for (size_t i = 0; i < c->count; i++) {
        times[i] = c->points[i].seconds;
        noises[i] = c->points[i].noise;
    }
    return curves_error_at(times, noises, c->count, s->time_target);
}

static void verdict(FILE *file, const study *s, const study_curve *c, const study_curve *base)
{
    double noise = noise_at(s, base), ours = noise_at(s, c);
    const study_point *last = &c->points[c->count - 1];
    int off = fabs(last->deviates) > STUDY_DEVIATES;
    if (c->bias > ours) {
        fputs("Mostly bias: more time makes it hardly better. ", file);
    } else if (c->bias > 0) {
        fputs("Biased, but by less than its noise at this time. ", file);
    } else if (off) {
        fprintf(file, "Biased: %.1f %% of the light is %s, though spread over the pixels that is below their noise. ",
                100 * fabs(1 - last->ratio), last->ratio < 1 ? "missing" : "too much");
    } else {
        fputs("No bias found: below ", file);
        study_put_number(file, fmax(last->bias, 0) + 3 * last->bias_sigma);
        fputs(" with three standard errors. ", file);
    }
    /* Two seeds say little of a difference of a fifth. */
    double total = c->bias + ours;
    if (!isfinite(noise) || !isfinite(ours))
        return;
    if (total < noise / 1.2)
        fputs("At equal time it is closer to the truth than what it approximates.", file);
    else if (total > noise * 1.2)
        fputs("At equal time what it approximates is closer to the truth.", file);
    else
        fputs("At equal time both are about as close to the truth.", file);
}

static void approximation(FILE *file, const study *s, size_t k, size_t partner)
{
    const study_curve *c = &s->curves[k], *base = &s->curves[partner];
    const study_point *last = &c->points[c->count - 1];
    char what[512];
    study_setting_describe(&s->settings[k], what, sizeof what);
    double saved = saving(c, base);
    fputs("<tr><th scope=row><b>", file);
    study_html(file, s->settings[k].name);
    fputs("</b><small>", file);
    study_html(file, what);
    fputs("</small></th><td data-l='instead of'>", file);
    study_html(file, s->settings[partner].name);
    fprintf(file, "</td><td data-l='time per sample'>%s%.0f %%</td><td data-l='light'>%.1f %%</td><td data-l='bias'>",
            saved >= 0 ? "−" : "+", 100 * fabs(saved), 100 * last->ratio);
    study_put_number(file, last->bias);
    fputs(" ± ", file);
    study_put_number(file, last->bias_sigma);
    fputs("</td><td data-l='root of it'>", file);
    if (c->bias > 0)
        fprintf(file, "%.1f %%", 100 * sqrt(c->bias));
    else
        fputs("–", file);
    fputs("</td><td data-l='noise'>", file);
    study_put_number(file, noise_at(s, c));
    fputs("</td><td data-l='noise without'>", file);
    study_put_number(file, noise_at(s, base));
    fputs("</td><td class=words>", file);
    verdict(file, s, c, base);
    fputs("</td></tr>\n", file);
}

static void approximations(FILE *file, const study *s)
{
    int any = 0;
    for (size_t k = 0; k < s->setting_count; k++) {
        size_t partner = study_setting_partner(s->settings, s->setting_count, k, STUDY_APPROXIMATE, &s->base);
        if (!(study_setting_kinds(&s->settings[k]) & STUDY_APPROXIMATE) || partner == s->setting_count ||
            s->curves[k].count == 0 || s->curves[partner].count == 0)
            continue;
        if (!any++) {
            fputs("<h2 id=approximations>What approximations save, and what error stays</h2>\n"
                  "<p>Noise goes away with time, bias does not. Two pictures with independent seeds tell them apart: "
                  "the "
                  "noise is what they differ by, the bias is what their errors have in common. Both are parts of "
                  "relMSE "
                  "and add up to it; noise is given at ", file);
            study_put_time(file, s->time_target);
            fputs(".</p>\n<div class=scroll><table class=cards><thead><tr><th>setting<th>instead of<th>time per "
                  "sample<th>light<th>bias² (± 1 σ)<th>root of it<th>noise<th>noise "
                  "without<th></thead><tbody>\n", file);
        }
        approximation(file, s, k, partner);
    }
    if (any)
        fputs("</tbody></table></div>\n", file);
}

/* What approximates nothing should have no bias: said, or denied. */
static void exact_ones(FILE *file, const study *s)
{
    size_t worst = s->setting_count, count = 0;
    double most = 0;
    for (size_t k = 0; k < s->setting_count; k++) {
        const study_curve *c = &s->curves[k];
        if (c->count == 0 || (study_setting_kinds(&s->settings[k]) & STUDY_APPROXIMATE))
            continue;
        double off = fabs(c->points[c->count - 1].deviates);
        count++;
        if (worst == s->setting_count || off > most) {
            most = off;
            worst = k;
        }
    }
    if (count == 0)
        return;
    fprintf(file, "<p%s>The %zu settings that approximate nothing: ", most > STUDY_DEVIATES ? " "
                                                                                              "class=warn" : "", count);
    fputs(most > STUDY_DEVIATES ? "not all are right on average. The mean of " : "none is found biased. The mean of ",
          file);
    study_html(file, s->settings[worst].name);
    fprintf(file, " is furthest from the reference’s, by %.1f standard errors.</p>\n", most);
}

static void roundings(FILE *file, const study *s)
{
    if (s->rounding_count == 0)
        return;
    fputs("<h2 id=precision>What rounding costs</h2>\n"
          "<p>The same kernels from the same random numbers, in single and in double precision: the difference between "
          "the pictures <em>is</em> the rounding error (where rounding turns a decision the other way, a path goes "
          "elsewhere, and its pixel shows noise instead). Per pixel, relative to the value in double plus a tenth of "
          "the picture’s mean.</p>\n"
          "<div class=scroll><table class=cards><thead><tr><th>setting<th>against<th>samples<th>time ×<th>median "
          "difference<th>root mean square<th>largest<th>pixels above 0.1 %<th>noise, in the same "
          "measure</thead><tbody>\n", file);
    for (size_t i = 0; i < s->rounding_count; i++) {
        const study_rounding *r = &s->roundings[i];
        const study_curve *single = &s->curves[r->single];
        double noise = NAN;
        for (size_t k = 0; k < single->count; k++)
            if (single->points[k].samples == r->samples)
                noise = single->points[k].noise;
        fputs("<tr><th scope=row><b>", file);
        study_html(file, s->settings[r->other].name);
        fputs("</b></th><td data-l='against'>", file);
        study_html(file, s->settings[r->single].name);
        fprintf(file, "</td><td data-l='samples'>%u</td><td data-l='time ×'>%.2f</td><td data-l='median'>", r->samples,
                r->cost);
        study_put_number(file, r->median);
        fputs("</td><td data-l='root mean square'>", file);
        study_put_number(file, r->root_mean_square);
        fputs("</td><td data-l='largest'>", file);
        study_put_number(file, r->most);
        fprintf(file, "</td><td data-l='above 0.1 %%'>%.2f %%</td><td data-l='noise'>", 100 * r->share_above);
        study_put_number(file, sqrt(noise));
        fputs("</td></tr>\n", file);
    }
    fputs("</tbody></table></div>\n", file);
}

void study_page_prices(FILE *file, const study *s)
{
    approximations(file, s);
    exact_ones(file, s);
    roundings(file, s);
}

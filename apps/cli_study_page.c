/* study.html: one file that needs nothing else, on a phone and on a desk. No scripts, no fonts, nothing from
 * elsewhere. */
#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "cli_study.h"
#include "files.h"
#include "platform.h"

static const char style[] =
    ":root{color-scheme:light dark;--ink:#1d2126;--dim:#5c6670;--paper:#fff;--line:#d5dade;--tint:#f2f5f7;"
    "--accent:#0b62b0;--warn:#a04a00}\n"
    "@media(prefers-color-scheme:dark){:root{--ink:#e4e8eb;--dim:#9aa5ae;--paper:#14171a;--line:#363d44;--tint:#1d2226;"
    "--accent:#6cb2f5;--warn:#f0a050}}\n"
    "*{box-sizing:border-box}body{margin:0 auto;max-width:72rem;padding:1rem;font:16px/1.5 system-ui,sans-serif;"
    "color:var(--ink);background:var(--paper);overflow-wrap:break-word}\n"
    "h1{font-size:1.5rem;line-height:1.25;margin:.3rem 0}h2{font-size:1.15rem;margin:2.2rem 0 "
    ".4rem}p{max-width:46rem}\n"
    "small,.dim,figcaption{color:var(--dim);font-size:.85rem}code{font-size:.9em;background:var(--tint);padding:.1em "
    ".3em}\n"
    ".warn{color:var(--warn)}.scroll{overflow-x:auto}figure{margin:0}\n"
    ".plot svg{display:block;width:100%;min-width:38rem;height:auto;max-height:80vh}\n"
    ".plot svg text{fill:var(--ink)}.plot svg rect[fill='#ffffff']{fill:none}\n"
    "table{border-collapse:collapse;width:100%;font-variant-numeric:tabular-nums}\n"
    "th,td{padding:.35rem .6rem;text-align:right;border-bottom:1px solid var(--line);vertical-align:top}\n"
    "th:first-child,td.words,thead th:last-child{text-align:left}thead th{font-size:.8rem;color:var(--dim);"
    "font-weight:600;vertical-align:bottom}\n"
    "tbody th{font-weight:400;min-width:9rem}tbody th small{display:block}tr.front th b::after{content:' ◆';"
    "color:var(--accent)}\n"
    ".gallery{display:grid;gap:1rem;grid-template-columns:repeat(auto-fill,minmax(min(20rem,100%),1fr))}\n"
    ".pair{display:flex;gap:2px}.pair img{width:50%;height:auto;flex:1 1 0;min-width:0;image-rendering:pixelated;"
    "background:#000}.pair img:only-child{flex:0 0 50%}\n"
    ".bright{color:#fff;background:#b01c10;padding:0 .3em}.dark{color:#fff;background:#1c3fb0;padding:0 .3em}\n"
    "summary{cursor:pointer;padding:.4rem 0}a{color:var(--accent)}\n"
    "dl{display:grid;grid-template-columns:max-content 1fr;gap:.2rem 1rem;"
    "max-width:60rem}dt{font-weight:600}dd{margin:0}\n"
    "@media(max-width:44rem){dl{grid-template-columns:1fr}dd{margin-bottom:.5rem}\n"
    "table.cards thead{display:none}table.cards tr{display:block;border-bottom:2px solid var(--line);padding:.5rem 0}\n"
    "table.cards th,table.cards td{display:flex;justify-content:space-between;gap:1rem;border:0;padding:.1rem 0;"
    "text-align:right}table.cards th{display:block;text-align:left}\n"
    "table.cards td::before{content:attr(data-l);color:var(--dim);text-align:left}table.cards "
    "td.words{text-align:left}\n"
    "table.cards td.words::before{content:none}}\n";

/* ---- text ---- */

static int utf8_follows(const unsigned char *s, int count)
{
    for (int i = 1; i <= count; i++)
        if ((s[i] & 0xc0) != 0x80)
            return 0;
    return 1;
}

void study_html(FILE *file, const char *text)
{
    for (const unsigned char *s = (const unsigned char *)text; *s; s++) {
        int more = *s < 0x80 ? 0 : (*s >> 5) == 6 ? 1 : (*s >> 4) == 14 ? 2 : (*s >> 3) == 30 ? 3 : -1;
        if (*s == '<')
            fputs("&lt;", file);
        else if (*s == '>')
            fputs("&gt;", file);
        else if (*s == '&')
            fputs("&amp;", file);
        else if (*s == '"' || *s == '\'')
            fprintf(file, "&#%d;", *s);
        else if (more < 0 || !utf8_follows(s, more) || (*s < 0x20 && *s != '\t' && *s != '\n'))
            fputs("\xef\xbf\xbd", file);
        else {
            fwrite(s, 1, (size_t)more + 1, file);
            s += more;
        }
    }
}

void study_put_time(FILE *file, double seconds)
{
    if (!isfinite(seconds))
        fputs("–", file);
    else if (seconds < 0.9995)
        fprintf(file, "%.3g ms", 1000 * seconds);
    else if (seconds < 99.95)
        fprintf(file, "%.3g s", seconds);
    else if (seconds < 5400)
        fprintf(file, "%.3g min", seconds / 60);
    else if (seconds < 48 * 3600)
        fprintf(file, "%.3g h", seconds / 3600);
    else
        fprintf(file, "%.3g days", seconds / 86400);
}

void study_put_number(FILE *file, double value)
{
    if (!isfinite(value)) {
        fputs("–", file);
        return;
    }
    double size = fabs(value);
    if (value < 0)
        fputs("−", file);
    if (size == 0 || (size >= 0.000995 && size < 99950)) {
        fprintf(file, "%.3g", size);
    } else {
        int exponent = (int)floor(log10(size));
        double mantissa = size / pow(10, exponent);
        if (mantissa >= 9.95) {
            mantissa /= 10;
            exponent++;
        }
        /* Written with characters: as an element of its own an exponent would stand apart in the cards of a phone. */
        static const char *const raised[] = {"⁰", "¹", "²", "³", "⁴", "⁵", "⁶", "⁷", "⁸", "⁹"};
        fprintf(file, "%.1f·10%s", mantissa, exponent < 0 ? "⁻" : "");
        if (abs(exponent) >= 100)
            fputs(raised[abs(exponent) / 100], file);
        if (abs(exponent) >= 10)
            fputs(raised[abs(exponent) / 10 % 10], file);
        fputs(raised[abs(exponent) % 10], file);
    }
}

/* ---- sections ---- */

static const char *file_name(const char *path)
{
    return path + brume_path_folder(path);
}

static void put_head(FILE *file, const study *s)
{
    fputs("<!doctype html>\n<html lang=en><head><meta charset=utf-8>\n"
          "<meta name=viewport content='width=device-width,initial-scale=1'>\n"
          "<meta http-equiv=Content-Security-Policy content=\"default-src 'none';style-src 'unsafe-inline';img-src "
          "data:\">\n"
          "<link rel=icon href='data:,'><title>", file);
    study_html(file, file_name(s->options->scene));
    fprintf(file, ": what accuracy costs</title>\n<style>\n%s</style></head><body>\n<h1>What accuracy costs: ", style);
    study_html(file, file_name(s->options->scene));
    fputs("</h1>\n", file);
}

static void put_circumstances(FILE *file, const study *s)
{
    double cpu = 0, wall = 0;
    size_t finished = 0;
    for (size_t k = 0; k < s->setting_count; k++) {
        const study_curve *c = &s->curves[k];
        finished += c->count > 0;
        if (c->count > 0) {
            cpu += c->points[c->count - 1].cpu_seconds;
            wall += c->points[c->count - 1].wall_seconds;
        }
    }
    fputs("<p>", file);
    study_html(file, s->options->scene);
    fprintf(file, " at %u × %u pixels", s->width, s->height);
    if (s->width != s->full_width)
        fprintf(file, "%s instead of its %u × %u (times grow in proportion to the pixels)",
                s->width < s->full_width ? ", for speed," : "", s->full_width, s->full_height);
    fputs(", on ", file);
    study_html(file, s->session.info.name);
    fputs(". ", file);
    if (s->reference) {
        fprintf(file, "Errors are against a reference of %u samples a pixel by the scene’s own estimator, whose own "
                      "relMSE "
                      "is ", s->reference_samples);
        study_put_number(file, s->reference_error);
        fputs(" (from its two halves, with seeds of their own); errors below four times that are marked *.", file);
    }
    fputs("</p>\n", file);
    if (finished < s->setting_count)
        fprintf(file, "<p class=warn>Unfinished: %zu of %zu settings. The same command goes on.</p>\n", finished,
                s->setting_count);
    /* What else runs on the machine makes times longer; only on a CPU device is this program's share known. */
    double share = wall > 0 ? cpu / (wall * s->session.info.compute_units) : 1;
    if (s->options->study.cpu_clock)
        fprintf(file, "<p>Time is that of the processors over their number, %u.</p>\n", s->session.info.compute_units);
    else if (!s->session.info.is_gpu && share < 0.85)
        fprintf(file, "<p class=warn>The renders had %.0f %% of the processors: something else was running, and the "
                      "times are longer than they need be, perhaps not all alike. <code>--clock cpu</code> measures "
                      "what "
                      "the processors did instead.</p>\n", 100 * share);
}

static void put_other(FILE *file, const study *s)
{
    if (!s->other || !s->reference)
        return;
    fputs("<p>Somebody else’s reference, ", file);
    study_html(file, s->options->study.reference);
    fputs(": the study’s own differs from it by relMSE ", file);
    study_put_number(file, s->other_relmse);
    fprintf(file, ", FLIP %.3f, and has %.2f %% of its light. ", s->other_flip, 100 * s->other_ratio);
    fputs("What of that is that picture’s noise isn’t known; no setting can come closer to it than the truth is. "
          "Errors "
          "against it are in <code>study.csv</code> and in the table.</p>\n", file);
}

/* The SVG that gnuplot wrote, from its root element on: a page has no XML declaration. */
static int put_plot(FILE *file, const study *s, int drawn)
{
    char path[STUDY_PATH], line[4096];
    if (!drawn) {
        fputs("<p class=warn>No plot: gnuplot was not there. It is drawn by <code>gnuplot study.gp</code> in this "
              "folder."
              "</p>\n", file);
        return CLI_EXIT_OK;
    }
    study_path(s, "study.svg", path);
    FILE *svg = fopen(path, "r");
    if (!svg)
        return study_not_written(path, errno);
    fputs("<figure class=plot><div class=scroll>\n", file);
    int inside = 0;
    while (fgets(line, sizeof line, svg)) {
        const char *begin = inside ? line : strstr(line, "<svg");
        if (!begin)
            continue;
        inside = 1;
        fputs(begin, file);
    }
    fclose(svg);
    fputs("</div><figcaption>Error against time, both in logarithms: further down is more accurate, further left is "
          "faster. One mark a power of two samples (adaptive: on average), each the mean of two seeds; dotted, the "
          "fitted power of time (behind the names). Grey: the Pareto front, the least error that anything reached by "
          "a time. Dashed: the target, and the time at which pictures are compared.</figcaption></figure>\n", file);
    return CLI_EXIT_OK;
}

static int by_time(const void *a, const void *b)
{
    const study_curve *x = *(const study_curve *const *)a, *y = *(const study_curve *const *)b;
    if (x->time_to_target != y->time_to_target)
        return x->time_to_target < y->time_to_target ? -1 : 1;
    return (x->at_time > y->at_time) - (x->at_time < y->at_time);
}

static void put_target(FILE *file, const study_curve *c)
{
    if (c->target_kind == CURVES_NEVER) {
        fputs(c->bias > 0 ? "never: bias" : "not known", file);
        return;
    }
    fputs(c->target_kind == CURVES_AT_MOST ? "≤ " : c->target_kind == CURVES_BEYOND ? "≈ " : "", file);
    study_put_time(file, c->time_to_target);
}

static void put_row(FILE *file, const study *s, const study_curve *c)
{
    const study_setting *setting = &s->settings[c - s->curves];
    const study_point *p = &c->points[c->shown];
    char what[512];
    int front = 0;
    for (size_t i = 0; i < c->count; i++)
        front |= c->points[i].on_front;
    study_setting_describe(setting, what, sizeof what);
    fprintf(file, "<tr%s><th scope=row><b>", front ? " class=front" : "");
    study_html(file, setting->name);
    fputs("</b><small>", file);
    study_html(file, what);
    fputs("</small></th><td data-l='time to target'>", file);
    put_target(file, c);
    fputs("</td><td data-l='relMSE at equal time'>", file);
    study_put_number(file, c->at_time);
    fprintf(file, "%s</td><td data-l='slope'>", c->at_time < 4 * s->reference_error ? "*" : "");
    study_put_number(file, c->slope);
    fputs("</td><td data-l='halving the error'>", file);
    if (isfinite(c->halving))
        fprintf(file, "× %.2f", c->halving);
    else
        fputs(c->bias > 0 ? "no time does" : "–", file);
    fputs("</td><td data-l='trimmed'>", file);
    study_put_number(file, p->trimmed);
    fprintf(file, "</td><td data-l='MAPE'>%.1f %%</td><td data-l='SMAPE'>%.3f</td><td data-l='FLIP'>%.3f</td>"
                  "<td data-l='estimated'>", 100 * p->mape, p->smape, p->flip);
    study_put_number(file, p->estimated);
    fprintf(file, "</td><td data-l='fireflies'>%.0f</td><td data-l='NaN'>%llu</td>", p->fireflies,
            (unsigned long long)p->bad_samples);
    if (s->other) {
        fputs("<td data-l='against the other'>", file);
        study_put_number(file, p->other_relmse);
        fputs("</td>", file);
    }
    fputs("</tr>\n", file);
}

static void put_table(FILE *file, const study *s)
{
    const study_curve *order[STUDY_SETTINGS];
    size_t count = 0;
    for (size_t k = 0; k < s->setting_count; k++)
        if (s->curves[k].count > 0)
            order[count++] = &s->curves[k];
    qsort(order, count, sizeof *order, by_time);
    fputs("<h2 id=prices>The price list</h2>\n<p>Sorted by the time to relMSE ", file);
    study_put_number(file, s->target);
    fputs(" (≈: beyond what was rendered, by the slope of its noise; ≤: the first sample was enough). At "
          "equal time: ", file);
    study_put_time(file, s->time_target);
    fputs(", between the powers of two next to it; the columns from “trimmed” on are of the one nearest. "
          "Halving the error takes so many times the time. ◆ is on the Pareto front.</p>\n"
          "<div class=scroll><table class=cards><thead>"
          "<tr><th>setting<th>time to target<th>relMSE at equal time<th>slope<th>halving the error<th>trimmed<th>MAPE"
          "<th>SMAPE<th>FLIP<th>estimated<th>fireflies<th>NaN", file);
    fputs(s->other ? "<th>against the other</thead><tbody>\n" : "</thead><tbody>\n", file);
    for (size_t i = 0; i < count; i++)
        put_row(file, s, order[i]);
    fputs("</tbody></table></div>\n", file);
}

static void put_words(FILE *file)
{
    fputs("<h2 id=words>What the words mean</h2>\n<dl>"
          "<dt>relMSE<dd>mean over pixels and channels of (I − R)² / (R² + 0.01 mean(R)²): I the picture, R the "
          "reference. "
          "0.01 is an error of about 10 %."
          "<dt>trimmed<dd>the same without the worst 0.1 % of the pixels: what fireflies add is the difference."
          "<dt>MAPE, SMAPE<dd>mean of |I − R| / (|R| + e), and of |I − R| / (|I| + |R| + e); e = 0.1 mean(R)."
          "<dt>FLIP<dd>what an eye sees of the difference, 0 to 1 (Andersson et al. 2020), of the pictures as they "
          "are shown "
          "here, at 67 pixels per degree."
          "<dt>estimated<dd>relMSE as the renderer estimates it while it renders, without a reference: what "
          "<code>--noise-threshold</code> goes by. Against relMSE it shows how far that can be trusted; of bias it "
          "knows nothing."
          "<dt>fireflies<dd>pixels more than four times as bright as all their neighbours in the reference (plus a "
          "tenth of "
          "the mean)."
          "<dt>NaN<dd>samples that came out as no number and were dropped: a defect to be reported."
          "<dt>slope<dd>relMSE falls as this power of time: −1 for independent random numbers, steeper for Sobol’ "
          "points."
          "<dt>noise, bias<dd>noise is half the squared difference of two seeds, bias² the product of their errors "
          "less the "
          "reference’s own error, both in the weights of relMSE."
          "<dt>time<dd>of rendering alone. What comes before the first sample is under <a href='#runs'>every run</a>."
          "</dl>\n", file);
}

static void put_command(FILE *file, const study *s)
{
    const cli_study_options *o = &s->options->study;
    fputs("<p class=dim>Made by <code>render-cli study ", file);
    study_html(file, s->options->scene);
    for (size_t i = 0; i < s->options->parameter_count; i++) {
        fputs(" -D ", file);
        study_html(file, s->options->parameters[i].name);
        fputc('=', file);
        study_html(file, s->options->parameters[i].value);
    }
    for (int i = 0, any = 0; i < BRUME_EFFECT_COUNT; i++)
        if (s->options->render.without >> i & 1)
            fprintf(file, "%s%s", any++ ? "," : " --without ", brume_effect_name((brume_effect)i));
    if (s->options->render.use_seed)
        fprintf(file, " --seed %u", s->options->render.seed);
    if (o->settings) {
        fputs(" --settings ", file);
        study_html(file, o->settings);
    }
    fprintf(file, " --budget %g", o->budget);
    if (o->cpu_clock)
        fputs(" --clock cpu", file);
    if (o->width)
        fprintf(file, " --width %u", o->width);
    if (o->reference) {
        fputs(" --reference ", file);
        study_html(file, o->reference);
    }
    fprintf(file, "</code>, brume %s. All figures: <code>study.csv</code>, <code>study.json</code>; the plot: "
                  "<code>study.svg</code>, <code>study.png</code>; the pictures as floats: "
                  "<code>pictures/</code>.</p>\n",
            BRUME_VERSION);
}

int study_write_page(const study *s, int drawn)
{
    char path[STUDY_PATH];
    files_draft page;
    study_path(s, "study.html", path);
    int error = files_begin(&page, path);
    if (error)
        return study_not_written(path, error);
    FILE *file = page.file;
    size_t finished = 0;
    for (size_t k = 0; k < s->setting_count; k++)
        finished += s->curves[k].count > 0;
    int code = CLI_EXIT_OK;
    put_head(file, s);
    put_circumstances(file, s);
    if (finished > 0) {
        put_other(file, s);
        code = put_plot(file, s, drawn);
        put_table(file, s);
        study_page_prices(file, s);
        if (!code)
            code = study_page_gallery(file, s);
        study_page_runs(file, s);
        put_words(file);
    } else {
        fputs("<p>Nothing to compare yet: the reference comes first, then a setting at a time.</p>\n", file);
    }
    put_command(file, s);
    fputs("</body></html>\n", file);
    error = files_end(&page, code == CLI_EXIT_OK);
    return code || !error ? code : study_not_written(path, error);
}

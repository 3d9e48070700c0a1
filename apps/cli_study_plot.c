/* Error against time, by gnuplot: study.gp is its script, study.dat what it draws, both to be changed and run again in
 * the folder. Names in them are the program's own, but for the scene's, which is quoted. */
#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "cli_study.h"
#include "platform.h"

/* Told apart on white and on black, and most of them by the colour-blind too; the marks do the rest. */
static const char *const colours[] = {"#1f77d0", "#d95f02", "#1b9e57", "#c2379b", "#8a6bd1", "#a67c00",
                                      "#e0484c", "#0f9fb5", "#7f8c2b", "#b06a4f", "#6d7f8f", "#d08aa8"};
enum { COLOURS = sizeof colours / sizeof colours[0] };
static const int marks[] = {7, 5, 9, 11, 13, 6, 4, 8, 10, 12, 2, 3};

/* In a string between double quotes. */
static void put_quoted(FILE *file, const char *text)
{
    fputc('"', file);
    for (; *text; text++) {
        if (*text == '"' || *text == '\\')
            fputc('\\', file);
        if ((unsigned char)*text >= 0x20)
            fputc(*text, file);
    }
    fputc('"', file);
}

/* A block a curve, then the front, as steps: until the next one is reached, that is the least error. */
static void write_data(FILE *file, const study *s)
{
    for (size_t k = 0; k < s->setting_count; k++) {
        const study_curve *c = &s->curves[k];
        if (c->count == 0)
            continue;
        fprintf(file, "# %s: seconds, relMSE, samples, line of the fitted slope\n", s->settings[k].name);
        double middle_time = 0, middle_error = 0;
        size_t used = 0;
        for (size_t i = 0; i < c->count; i++)
            if (!c->points[i].near_floor && c->points[i].relmse > 0) {
                middle_time += log(c->points[i].seconds);
                middle_error += log(c->points[i].relmse);
                used++;
            }
        for (size_t i = 0; i < c->count; i++) {
            const study_point *p = &c->points[i];
            double fitted = isfinite(c->slope) && used > 0 && !p->near_floor
                                ? exp(middle_error / (double)used +
                                      c->slope * (log(p->seconds) - middle_time / (double)used))
                                : NAN;
            fprintf(file, "%.9g %.9g %u %.9g\n", p->seconds, p->relmse, p->samples, fitted);
        }
        fputs("\n\n", file);
    }
    fputs("# the front\n", file);
    double after = 0;
    for (;;) {
        const study_point *next = NULL;
        for (size_t k = 0; k < s->setting_count; k++)
            for (size_t i = 0; i < s->curves[k].count; i++) {
                const study_point *p = &s->curves[k].points[i];
                if (p->on_front && p->seconds > after && (!next || p->seconds < next->seconds))
                    next = p;
            }
        if (!next)
            break;
        fprintf(file, "%.9g %.9g\n", next->seconds, next->relmse);
        after = next->seconds;
    }
}

static void range(const study *s, double *x0, double *x1, double *y0, double *y1)
{
    *x0 = *y0 = INFINITY;
    *x1 = *y1 = 0;
    for (size_t k = 0; k < s->setting_count; k++)
        for (size_t i = 0; i < s->curves[k].count; i++) {
            const study_point *p = &s->curves[k].points[i];
            if (!(p->seconds > 0) || !(p->relmse > 0))
                continue;
            *x0 = fmin(*x0, p->seconds);
            *x1 = fmax(*x1, p->seconds);
            *y0 = fmin(*y0, p->relmse);
            *y1 = fmax(*y1, p->relmse);
        }
    *y0 = fmin(*y0, s->target);
    *y1 = fmax(*y1, s->target);
    if (s->reference_error > 0)
        *y0 = fmin(*y0, s->reference_error);
    *x0 /= 1.25;
    *x1 *= 1.25;
    *y0 /= 1.6;
    *y1 *= 1.6;
}

static void level(FILE *file, double y, double x0, double x1, const char *colour, const char *dashes)
{
    fprintf(file, "set arrow from %.9g,%.9g to %.9g,%.9g nohead lc rgb '%s' lw 1.2 dt '%s' back\n", x0, y, x1, y,
            colour, dashes);
}

/* 1, 2 and 5 times powers of ten, or fewer where they would touch. */
static void put_tics(FILE *file, double from, double to)
{
    static const double close[] = {1, 2, 5}, wide[] = {1, 3};
    double decades = log10(to / from);
    const double *steps = decades > 2.3 ? wide : close;
    int count = decades > 4 ? 1 : decades > 2.3 ? 2 : 3;
    const char *comma = "";
    fputs("set xtics (", file);
    for (int k = (int)floor(log10(from)); k <= (int)ceil(log10(to)); k++)
        for (int i = 0; i < count; i++) {
            double at = steps[i] * pow(10, k);
            if (at < from || at > to)
                continue;
            fprintf(file, "%s'%g' %g", comma, at, at);
            comma = ", ";
        }
    fputs(")\n", file);
}

static void write_script(FILE *file, const study *s)
{
    double x0, x1, y0, y1;
    range(s, &x0, &x1, &y0, &y1);
    fputs("# gnuplot study.gp\n"
          "set encoding utf8\n"
          "set logscale xy\n"
          "set format y '10^{%L}'\n"
          "set ylabel 'relMSE against the reference'\n"
          "set grid xtics ytics lc rgb '#888888' lw 0.4\n"
          "set border 3 lc rgb '#888888'\n"
          "set tics nomirror\n"
          /* gnuplot counts the exponents' markup as text: width makes up for that */
          "set key outside right top vertical Left reverse samplen 1.6 spacing 1.15 width -7 font ',13'\n", file);
    fprintf(file, "set xlabel 'seconds of rendering%s'\n",
            s->options->study.cpu_clock ? ", of the processors over their number" : "");
    fputs("set title ", file);
    put_quoted(file, s->options->scene);
    fprintf(file, " noenhanced\nset xrange [%.9g:%.9g]\nset yrange [%.9g:%.9g]\n", x0, x1, y0, y1);
    put_tics(file, x0, x1);
    level(file, s->target, x0, x1, "#d98200", "-");
    fprintf(file, "set label 'target %.3g' at %.9g,%.9g right offset 0,0.5 tc rgb '#b06a00'\n", s->target, x1 / 1.03,
            s->target);
    if (s->reference_error > 0) {
        level(file, s->reference_error, x0, x1, "#777777", ".");
        fprintf(file, "set label 'the reference’s own error' at %.9g,%.9g left offset 0,0.5 tc rgb '#777777'\n",
                x0 * 1.05, s->reference_error);
    }
    if (s->time_target > 0)
        fprintf(file, "set arrow from %.9g,%.9g to %.9g,%.9g nohead lc rgb '#d98200' lw 1.2 dt '-' back\n",
                s->time_target, y0, s->time_target, y1);
    size_t blocks = 0, block = 0;
    for (size_t k = 0; k < s->setting_count; k++)
        blocks += s->curves[k].count > 0;
    fprintf(file, "plot \\\n  'study.dat' index %zu using 1:2 with fsteps lc rgb '#aaaaaa' lw 5 dt 1 title 'Pareto "
                  "front'",
            blocks);
    for (size_t k = 0; k < s->setting_count; k++) {
        const study_curve *c = &s->curves[k];
        if (c->count == 0)
            continue;
        const char *colour = colours[k % COLOURS];
        char slope[32] = "";
        if (isfinite(c->slope))
            snprintf(slope, sizeof slope, "   t^{%s%.2f}", c->slope < 0 ? "−" : "", fabs(c->slope));
        fprintf(file, ", \\\n  'study.dat' index %zu using 1:4 with lines lc rgb '%s' lw 0.8 dt '.' notitle", block,
                colour);
        fprintf(file, ", \\\n  'study.dat' index %zu using 1:2 with linespoints lc rgb '%s' lw 1.8 pt %d ps 0.8 title "
                      "'%s%s'",
                block, colour, marks[k % COLOURS], s->settings[k].name, slope);
        block++;
    }
    fputc('\n', file);
}

static const char head_svg[] = "set terminal svg size 900,560 dynamic background rgb 'white' font 'sans-serif,15'\n"
                               "set output 'study.svg'\n";
static const char head_png[] = "set terminal pngcairo size 1350,840 font 'sans-serif,15' linewidth 1.4\n"
                               "set output 'study.png'\nreplot\n";

static int write_file(const study *s, const char *name, void (*fill)(FILE *file, const study *s), const char *before,
                      const char *after)
{
    char path[STUDY_PATH];
    study_path(s, name, path);
    FILE *file = fopen(path, "w");
    if (!file)
        return study_not_written(path, errno);
    fputs(before, file);
    fill(file, s);
    fputs(after, file);
    int failed = ferror(file);
    failed |= fclose(file) != 0;
    return failed ? study_not_written(path, errno) : CLI_EXIT_OK;
}

/* gnuplot, in the folder; 0 if it isn't there or did not end well. Ctrl-C does not reach it: the plot belongs to the
 * page that is written then. */
static int run_gnuplot(const study *s)
{
    static char program[] = "gnuplot", script[] = "study.gp";
    char *const arguments[] = {program, script, NULL};
    return platform_run(arguments, s->folder) == 0;
}

static void remove_plots(const study *s)
{
    char path[STUDY_PATH];
    study_path(s, "study.svg", path);
    remove(path);
    study_path(s, "study.png", path);
    remove(path);
}

int study_write_plot(const study *s, int *drawn)
{
    size_t curves = 0;
    *drawn = 0;
    remove_plots(s);
    for (size_t k = 0; k < s->setting_count; k++)
        curves += s->curves[k].count > 0;
    if (curves == 0)
        return CLI_EXIT_OK;
    int code = write_file(s, "study.dat", write_data, "", "");
    if (!code)
        code = write_file(s, "study.gp", write_script, head_svg, head_png);
    if (code)
        return code;
    *drawn = run_gnuplot(s);
    if (!*drawn) /* what it left on a full disk is half a plot */
        remove_plots(s);
    if (!*drawn && s->options->verbosity >= 0)
        fprintf(stderr, "render-cli: warning: gnuplot did not run (Debian: gnuplot-nox): the page is without its plot; "
                        "%s/study.gp is its script\n", s->folder);
    return CLI_EXIT_OK;
}

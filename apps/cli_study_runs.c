/* The page's last tables, folded up: every point of every curve, and the time of each phase before the first sample. */
#include <math.h>

#include "cli_study.h"

static void number_cell(FILE *file, double value)
{
    fputs("<td>", file);
    study_put_number(file, value);
    fputs("</td>", file);
}

static void time_cell(FILE *file, double seconds)
{
    fputs("<td>", file);
    study_put_time(file, seconds);
    fputs("</td>", file);
}

static void point_row(FILE *file, const study *s, size_t k, size_t i)
{
    const study_point *p = &s->curves[k].points[i];
    fputs("<tr><th scope=row>", file);
    study_html(file, s->settings[k].name);
    fprintf(file, "%s</th><td>%u</td>", p->on_front ? " ◆" : "", p->samples);
    time_cell(file, p->seconds);
    fputs("<td>", file);
    study_put_number(file, p->relmse);
    fprintf(file, "%s</td>", p->near_floor ? "*" : "");
    number_cell(file, p->trimmed);
    number_cell(file, p->noise);
    fputs("<td>", file);
    study_put_number(file, p->bias);
    fputs(" ± ", file);
    study_put_number(file, p->bias_sigma);
    fprintf(file, "</td><td>%.1f %%</td>", 100 * p->mape);
    number_cell(file, p->smape);
    number_cell(file, p->flip);
    number_cell(file, p->estimated);
    fprintf(file, "<td>%.0f</td><td>%llu</td></tr>\n", p->fireflies, (unsigned long long)p->bad_samples);
}

static void phase_row(FILE *file, const study_setting *setting, const study_run *run)
{
    fputs("<tr><th scope=row>", file);
    study_html(file, setting->name);
    fputs("</th>", file);
    time_cell(file, run->bvh_seconds);
    time_cell(file, run->upload_seconds);
    time_cell(file, run->build_seconds);
    time_cell(file, run->pilot_seconds);
    fputs("</tr>\n", file);
}

void study_page_runs(FILE *file, const study *s)
{
    fputs("<h2 id=runs>Every run</h2>\n<details><summary>All points: settings and samples</summary><div class=scroll>"
          "<table><thead><tr><th>setting<th>samples<th>time<th>relMSE<th>trimmed<th>noise<th>bias² (± 1 σ)<th>MAPE"
          "<th>SMAPE<th>FLIP<th>estimated<th>fireflies<th>NaN</thead><tbody>\n", file);
    for (size_t k = 0; k < s->setting_count; k++)
        for (size_t i = 0; i < s->curves[k].count; i++)
            point_row(file, s, k, i);
    fputs("</tbody></table></div></details>\n<details><summary>Time before the first sample</summary>"
          "<p>By the clock on the wall, of the first seed’s first render. Kernels take long where none are kept from "
          "an earlier run; the pilot is part of the time of rendering above.</p><div class=scroll><table><thead><tr>"
          "<th>setting<th>hierarchy of surfaces<th>upload<th>kernels<th>pilot</thead><tbody>\n", file);
    for (size_t k = 0; k < s->setting_count; k++)
        if (s->curves[k].count > 0)
            phase_row(file, &s->settings[k], &s->curves[k].runs[0]);
    fputs("</tbody></table></div></details>\n", file);
}

/* The page's pictures: every setting at about equal time beside its errors, embedded as PNG. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "cli_study.h"
#include "picture_file.h"

/* Relative difference of luminance that has full colour. */
#define FULL_COLOUR 1.0

static void put_base64(FILE *file, const unsigned char *bytes, size_t size)
{
    static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    for (size_t i = 0; i < size; i += 3) {
        size_t left = size - i;
        unsigned word = (unsigned)bytes[i] << 16 | (left > 1 ? (unsigned)bytes[i + 1] << 8 : 0) |
                        (left > 2 ? bytes[i + 2] : 0);
        fputc(digits[word >> 18], file);
        fputc(digits[word >> 12 & 63], file);
        fputc(left > 1 ? digits[word >> 6 & 63] : '=', file);
        fputc(left > 2 ? digits[word & 63] : '=', file);
    }
}

static int put_image(FILE *file, const study *s, const unsigned char *bytes, const char *what, const char *name)
{
    size_t size;
    unsigned char *png = picture_png(bytes, s->width, s->height, &size);
    if (!png)
        return study_out_of_memory();
    fprintf(file, "<img width=%u height=%u alt='%s ", s->width, s->height, what);
    study_html(file, name);
    fputs("' src='data:image/png;base64,", file);
    put_base64(file, png, size);
    fputs("'>", file);
    free(png);
    return CLI_EXIT_OK;
}

static int put_pair(FILE *file, const study *s, const float *picture, unsigned char *bytes, const char *name)
{
    size_t count = (size_t)s->width * s->height;
    fputs("<div class=pair>", file);
    picture_to_bytes(picture, count, s->exposure, bytes);
    int code = put_image(file, s, bytes, "picture by", name);
    if (!code && picture != s->reference) {
        picture_difference(picture, s->reference, count, FULL_COLOUR, bytes);
        code = put_image(file, s, bytes, "errors of", name);
    }
    fputs("</div>", file);
    return code;
}

static int put_setting(FILE *file, const study *s, size_t k, unsigned char *bytes)
{
    const study_curve *c = &s->curves[k];
    const study_point *p = &c->points[c->shown];
    char stem[STUDY_NAME], path[STUDY_PATH];
    study_setting_stem(&s->settings[k], stem);
    study_picture_path(s, stem, 0, p->samples, path);
    float *picture = picture_read_pfm(path, s->width, s->height);
    if (!picture)
        return study_not_written(path, 0);
    fputs("<figure>", file);
    int code = put_pair(file, s, picture, bytes, s->settings[k].name);
    fputs("<figcaption><b>", file);
    study_html(file, s->settings[k].name);
    fprintf(file, "</b> %u samples, ", p->samples);
    study_put_time(file, p->seconds);
    fputs(", relMSE ", file);
    study_put_number(file, p->of[0].metrics.mse);
    fputs(", FLIP ", file);
    study_put_number(file, p->of[0].flip);
    fputs("</figcaption></figure>\n", file);
    free(picture);
    return code;
}

static int put_reference(FILE *file, const study *s, unsigned char *bytes)
{
    fputs("<figure>", file);
    int code = put_pair(file, s, s->reference, bytes, "the reference");
    fprintf(file, "<figcaption><b>reference</b> %u samples, its own relMSE ", s->reference_samples);
    study_put_number(file, s->reference_error);
    fputs("</figcaption></figure>\n", file);
    if (!code && s->other) {
        fputs("<figure>", file);
        code = put_pair(file, s, s->other, bytes, "the other reference");
        fputs("<figcaption><b>", file);
        study_html(file, s->options->study.reference);
        fputs("</b> beside where it differs from the study’s reference</figcaption></figure>\n", file);
    }
    return code;
}

int study_page_gallery(FILE *file, const study *s)
{
    unsigned char *bytes = malloc(3 * (size_t)s->width * s->height);
    if (!bytes)
        return study_out_of_memory();
    fputs("<h2 id=pictures>Pictures at about ", file);
    study_put_time(file, s->time_target);
    fputs("</h2>\n<p>Of each setting the power of two samples that comes nearest to that time; its own time is written "
          "below. Beside it, where the picture is <span class=bright>too bright</span> and where "
          "<span class=dark>too dark</span>: noise is a mix of both colours, bias a cloud of one. Full colour: off by "
          "the pixel’s own value (plus a tenth of the mean).</p>\n<div class=gallery>\n", file);
    int code = put_reference(file, s, bytes);
    for (size_t k = 0; k < s->setting_count && !code; k++)
        if (s->curves[k].count > 0)
            code = put_setting(file, s, k, bytes);
    fputs("</div>\n", file);
    free(bytes);
    return code;
}

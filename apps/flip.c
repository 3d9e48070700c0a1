/* flip.c -- see flip.h. The steps are the paper's; all of its filters are sums of products of one along x and one along
 * y, and are applied so, with the pixels at the edge repeated beyond it. */
#include "flip.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double pi = 3.14159265358979323846;

typedef struct size {
    size_t width, height;
} size;

/* ---- colours: linear RGB of sRGB's primaries, XYZ, YCxCz, L*a*b* ---- */

static const double to_xyz[3][3] = {
    {10135552.0 / 24577794, 8788810.0 / 24577794, 4435075.0 / 24577794},
    {2613072.0 / 12288897, 8788810.0 / 12288897, 887015.0 / 12288897},
    {1425312.0 / 73733382, 8788810.0 / 73733382, 70074185.0 / 73733382},
};

static void multiply(double m[3][3], const double in[3], double out[3])
{
    for (int i = 0; i < 3; i++)
        out[i] = m[i][0] * in[0] + m[i][1] * in[1] + m[i][2] * in[2];
}

/* XYZ relative to white: every row of the matrix divided by its sum. */
static void relative_matrix(double out[3][3])
{
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            out[i][j] = to_xyz[i][j] / (to_xyz[i][0] + to_xyz[i][1] + to_xyz[i][2]);
}

/* By Cramer's rule. */
static void invert(double m[3][3], double out[3][3])
{
    double determinant = 0;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            int a = (j + 1) % 3, b = (j + 2) % 3, c = (i + 1) % 3, d = (i + 2) % 3;
            out[i][j] = m[a][c] * m[b][d] - m[a][d] * m[b][c];
        }
    for (int j = 0; j < 3; j++)
        determinant += m[0][j] * out[j][0];
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            out[i][j] /= determinant;
}

static double lab_curve(double t)
{
    const double delta = 6.0 / 29;
    return t > delta * delta * delta ? cbrt(t) : t / (3 * delta * delta) + 4.0 / 29;
}

/* L*, a*, b* with Hunt's adjustment: colours fade in the dark. */
static void hunt_lab(double m[3][3], const double rgb[3], double out[3])
{
    double xyz[3];
    multiply(m, rgb, xyz);
    double x = lab_curve(xyz[0]), y = lab_curve(xyz[1]), z = lab_curve(xyz[2]);
    out[0] = 116 * y - 16;
    out[1] = 0.01 * out[0] * 500 * (x - y);
    out[2] = 0.01 * out[0] * 200 * (y - z);
}

static double hyab(const double a[3], const double b[3])
{
    return fabs(a[0] - b[0]) + hypot(a[1] - b[1], a[2] - b[2]);
}

/* ---- filters ---- */

enum { MOST_TAPS = 255 };

typedef struct filter {
    int radius;
    double taps[MOST_TAPS];
} filter;

/* out += weight * (in, filtered by fx along x and by fy along y). */
static int convolve(const double *in, size s, const filter *fx, const filter *fy, double weight, double *out)
{
    double *rows = malloc(s.width * s.height * sizeof *rows);
    if (!rows)
        return 0;
    long width = (long)s.width, height = (long)s.height;
    for (long y = 0; y < height; y++)
        for (long x = 0; x < width; x++) {
            double sum = 0;
            for (int k = -fx->radius; k <= fx->radius; k++) {
                long u = x + k < 0 ? 0 : x + k >= width ? width - 1 : x + k;
                sum += fx->taps[k + fx->radius] * in[y * width + u];
            }
            rows[y * width + x] = sum;
        }
    for (long y = 0; y < height; y++)
        for (long x = 0; x < width; x++) {
            double sum = 0;
            for (int k = -fy->radius; k <= fy->radius; k++) {
                long v = y + k < 0 ? 0 : y + k >= height ? height - 1 : y + k;
                sum += fy->taps[k + fy->radius] * rows[v * width + x];
            }
            out[y * width + x] += weight * sum;
        }
    free(rows);
    return 1;
}

/* exp(-k x^2) at whole pixels, divided by its sum, which is returned. */
static double gaussian(filter *f, int radius, double k)
{
    double sum = 0;
    f->radius = radius;
    for (int x = -radius; x <= radius; x++)
        sum += f->taps[x + radius] = exp(-k * x * x);
    for (int i = 0; i <= 2 * radius; i++)
        f->taps[i] /= sum;
    return sum;
}

/* What the eye passes of a channel of YCxCz: a sum of two Gaussians a sqrt(pi / b) exp(-pi^2 r^2 / b), r in degrees,
 * divided by the sum of its weights. */
static int see(const double *in, size s, int channel, double ppd, double *out)
{
    static const struct { double a[2], b[2]; } sensitivity[3] = {
        {{1, 0}, {0.0047, 1e-5}}, {{1, 0}, {0.0053, 1e-5}}, {{34.1, 13.5}, {0.04, 0.025}}};
    int radius = (int)ceil(3 * sqrt(0.04 / (2 * pi * pi)) * ppd);
    double weights[2], total = 0;
    filter filters[2];
    for (int i = 0; i < 2; i++) {
        double a = sensitivity[channel].a[i], b = sensitivity[channel].b[i];
        double sum = gaussian(&filters[i], radius, pi * pi / (b * ppd * ppd));
        weights[i] = a * sqrt(pi / b) * sum * sum;
        total += weights[i];
    }
    memset(out, 0, s.width * s.height * sizeof *out);
    for (int i = 0; i < 2; i++)
        if (weights[i] > 0 && !convolve(in, s, &filters[i], &filters[i], weights[i] / total, out))
            return 0;
    return 1;
}

/* Edges (first derivative) or points (second derivative) of a Gaussian as wide as the eye's: weights above and below 0
 * each divided by what they add up to. */
static void derivative(filter *f, int radius, double deviation, int order)
{
    double above = 0, below = 0;
    f->radius = radius;
    for (int x = -radius; x <= radius; x++) {
        double z = x / deviation, g = exp(-0.5 * z * z), w = order == 1 ? -x * g : (z * z - 1) * g;
        f->taps[x + radius] = w;
        *(w > 0 ? &above : &below) += fabs(w);
    }
    for (int i = 0; i <= 2 * radius; i++)
        f->taps[i] /= f->taps[i] > 0 ? above : below > 0 ? below : 1;
}

/* How strongly edges (order 1) or points (order 2) stand out. */
static int feature(const double *in, size s, int order, double ppd, double *out)
{
    double deviation = 0.5 * 0.082 * ppd;
    int radius = (int)ceil(3 * deviation);
    size_t count = s.width * s.height;
    filter smooth, sharp;
    gaussian(&smooth, radius, 0.5 / (deviation * deviation));
    derivative(&sharp, radius, deviation, order);
    double *across = calloc(count, sizeof *across), *down = calloc(count, sizeof *down);
    int ok = across && down && convolve(in, s, &sharp, &smooth, 1, across) &&
             convolve(in, s, &smooth, &sharp, 1, down);
    for (size_t i = 0; i < count && ok; i++)
        out[i] = hypot(across[i], down[i]);
    free(across);
    free(down);
    return ok;
}

/* ---- a picture's two sides ---- */

typedef struct appearance {
    double *lab;    /* 3 a pixel, as seen through the eye's filters */
    double *edges, *points;
} appearance;

static void release(appearance *a)
{
    free(a->lab);
    free(a->edges);
    free(a->points);
}

static int look_at(const float *picture, size s, double exposure, double ppd, appearance *out)
{
    size_t count = s.width * s.height;
    double m[3][3], back[3][3], *planes = malloc(3 * count * sizeof *planes), *seen = malloc(3 * count * sizeof *seen);
    out->lab = malloc(3 * count * sizeof *out->lab);
    out->edges = malloc(count * sizeof *out->edges);
    out->points = malloc(count * sizeof *out->points);
    int ok = planes && seen && out->lab && out->edges && out->points;
    relative_matrix(m);
    invert(m, back);
    for (size_t i = 0; i < count && ok; i++) {
        double rgb[3], xyz[3];
        for (int c = 0; c < 3; c++)
            rgb[c] = fmin(fmax(exposure * picture[3 * i + (size_t)c], 0), 1);
        multiply(m, rgb, xyz);
        planes[i] = 116 * xyz[1] - 16;
        planes[count + i] = 500 * (xyz[0] - xyz[1]);
        planes[2 * count + i] = 200 * (xyz[1] - xyz[2]);
    }
    for (int c = 0; c < 3 && ok; c++)
        ok = see(planes + (size_t)c * count, s, c, ppd, seen + (size_t)c * count);
    for (size_t i = 0; i < count && ok; i++) {
        double xyz[3], rgb[3], y = (seen[i] + 16) / 116;
        xyz[0] = y + seen[count + i] / 500;
        xyz[1] = y;
        xyz[2] = y - seen[2 * count + i] / 200;
        multiply(back, xyz, rgb);
        for (int c = 0; c < 3; c++)
            rgb[c] = fmin(fmax(rgb[c], 0), 1);
        hunt_lab(m, rgb, out->lab + 3 * i);
        planes[i] = (planes[i] + 16) / 116;
    }
    ok = ok && feature(planes, s, 1, ppd, out->edges) && feature(planes, s, 2, ppd, out->points);
    free(planes);
    free(seen);
    return ok;
}

/* Differences in colour are spread over [0, 1]: most of the range for the small ones. */
static double spread_colour(double difference, double most)
{
    const double knee = 0.4 * most, share = 0.95;
    return difference < knee ? share / knee * difference
                             : share + (difference - knee) / (most - knee) * (1 - share);
}

double flip_compute(const float *reference, const float *picture, size_t width, size_t height, double exposure,
                    double pixels_per_degree, float *map)
{
    const double green[3] = {0, 1, 0}, blue[3] = {0, 0, 1};
    size s = {width, height};
    double m[3][3], green_lab[3], blue_lab[3], sum = 0;
    appearance a = {0}, b = {0};
    relative_matrix(m);
    hunt_lab(m, green, green_lab);
    hunt_lab(m, blue, blue_lab);
    double most = pow(hyab(green_lab, blue_lab), 0.7);
    int ok = look_at(reference, s, exposure, pixels_per_degree, &a) &&
             look_at(picture, s, exposure, pixels_per_degree, &b);
    for (size_t i = 0; i < width * height && ok; i++) {
        double colour = spread_colour(pow(hyab(a.lab + 3 * i, b.lab + 3 * i), 0.7), most);
        double edge = fabs(a.edges[i] - b.edges[i]), point = fabs(a.points[i] - b.points[i]);
        double structure = sqrt(fmax(edge, point) / sqrt(2));
        double difference = pow(colour, 1 - structure);
        if (map)
            map[i] = (float)difference;
        sum += difference;
    }
    release(&a);
    release(&b);
    return ok ? sum / (double)(width * height) : -1;
}

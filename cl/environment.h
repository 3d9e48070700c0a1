/* environment.h -- light from infinitely far away: one radiance, or a latitude-longitude map sampled by its brightness.
 *
 * Map coordinates: u = azimuth / 2 pi, v = polar angle from the map's +y / pi; the local direction is
 * (sin phi sin theta, cos theta, -cos phi sin theta). As in Mitsuba 3, texel column i is centred on u = (i + 1/2) /
 * width (and wraps around), row j on v = j / (height - 1), bilinear in between. The sampling density is constant over
 * each of the width x height equal cells of (u, v).
 */
#ifndef BRUME_ENVIRONMENT_H
#define BRUME_ENVIRONMENT_H

#include "cdf.h"
#include "scene.h"
#include "math.h"
#include "warp.h"

FN vec environment_rotate(__global const float *m, vec v) {
    return vmake(vdot(vuniform(m), v), vdot(vuniform(m + 3), v), vdot(vuniform(m + 6), v));
}

/* u, v of a world direction, and the sine of its polar angle. */
FN void environment_uv(const scene *s, vec d, real *u, real *v, real *sine) {
    vec in_map = environment_rotate(s->params->environment_to_local, d);
    real turn = latan2(in_map.x, -in_map.z) * R(1 / (2 * PI));
    *u = turn < R(0) ? turn + R(1) : turn;
    *sine = sqrt(square(in_map.x) + square(in_map.z));
    *v = latan2(*sine, in_map.y) * R(1 / PI);
}

/* The cell of 0 ... n - 1 that holds x; NaN, too, gets one: the sample is lost, the gather is not. */
FN ireal environment_cell(real x, int n) {
    ireal i = to_ireal(lclamp(x, R(0), R(n)));
    i = i > I(0) ? i : I(0);
    return i < I(n) ? i : I(n - 1);
}

FN rgb environment_texel(const scene *s, ireal x, ireal y) {
    return cgather(s->texels, I(s->params->environment_first) + y * I(s->params->environment_width) + x);
}

FN rgb environment_radiance(const scene *s, vec d) {
    if (s->params->environment == ENVIRONMENT_CONSTANT) return cuniform(s->params->environment_radiance);
    int width = s->params->environment_width, height = s->params->environment_height;
    real u, v, sine;
    environment_uv(s, d, &u, &v, &sine);
    real x = lclamp(u, R(0), R(1)) * R(width) - R(0.5), y = lclamp(v, R(0), R(1)) * R(height - 1);
    real column = floor(x);
    ireal x0 = to_ireal(column), y0 = environment_cell(y, height > 1 ? height - 1 : 1);
    real fx = x - column, fy = y - to_real(y0);
    ireal x1 = environment_cell(column + R(1), width + 1);
    x1 = x1 < I(width) ? x1 : I(0);
    x0 = x0 < I(0) ? I(width - 1) : x0;
    ireal y1 = height > 1 ? y0 + I(1) : y0;
    rgb top = cadd(cscale(environment_texel(s, x0, y0), R(1) - fx), cscale(environment_texel(s, x1, y0), fx));
    rgb bottom = cadd(cscale(environment_texel(s, x0, y1), R(1) - fx), cscale(environment_texel(s, x1, y1), fx));
    return cadd(cscale(top, R(1) - fy), cscale(bottom, fy));
}

/* Density per steradian of environment_sample. */
FN real environment_pdf(const scene *s, vec d) {
    if (s->params->environment == ENVIRONMENT_CONSTANT) return R(1 / (4 * PI));
    int width = s->params->environment_width, height = s->params->environment_height;
    real u, v, sine;
    environment_uv(s, d, &u, &v, &sine);
    ireal x = environment_cell(u * R(width), width), y = environment_cell(v * R(height), height);
    ireal rows = I(s->params->environment_cdf);
    ireal columns = rows + I(height + 1) + y * I(width + 1);
    real p_row = gather(s->cdf, rows + y + I(1)) - gather(s->cdf, rows + y);
    real p_column = gather(s->cdf, columns + x + I(1)) - gather(s->cdf, columns + x);
    return p_row * p_column * R((float)width * (float)height / (2 * PI * PI)) / lmax(sine, R(1e-9));
}

FN vec environment_sample(const scene *s, real u_row, real u_column, real *pdf) {
    if (s->params->environment == ENVIRONMENT_CONSTANT) {
        *pdf = R(1 / (4 * PI));
        return warp_sphere(u_row, u_column);
    }
    int width = s->params->environment_width, height = s->params->environment_height;
    ireal rows = I(s->params->environment_cdf);
    ireal y = cdf_find(s->cdf, rows, height, u_row);
    real low = gather(s->cdf, rows + y), p_row = gather(s->cdf, rows + y + I(1)) - low;
    ireal columns = rows + I(height + 1) + y * I(width + 1);
    ireal x = cdf_find(s->cdf, columns, width, u_column);
    real left = gather(s->cdf, columns + x), p_column = gather(s->cdf, columns + x + I(1)) - left;
    real v = (to_real(y) + lclamp((u_row - low) / lmax(p_row, R(1e-30)), R(0), R(1))) * R(1.0f / height);
    real u = (to_real(x) + lclamp((u_column - left) / lmax(p_column, R(1e-30)), R(0), R(1))) * R(1.0f / width);
    real st, ct, sp, cp;
    lsincos(v * R(PI), &st, &ct);
    lsincos(u * R(2 * PI), &sp, &cp);
    *pdf = p_row * p_column * R((float)width * (float)height / (2 * PI * PI)) / lmax(st, R(1e-9));
    return environment_rotate(s->params->environment_to_world, vmake(sp * st, ct, -cp * st));
}

#endif

/* texture.h -- colours over texture coordinates: bitmaps and checkerboards. */
#ifndef BRUME_TEXTURE_H
#define BRUME_TEXTURE_H

#include "shared.h"
#include "vec.h"

/* i brought into 0 ... n - 1. */
FN ireal texture_wrap(ireal i, ireal n, ireal mode) {
    ireal period = mode == I(TEXTURE_WRAP_MIRROR) ? n * I(2) : n;
    ireal within = i % period;
    within = within < I(0) ? within + period : within;
    ireal mirrored = within < n ? within : period - I(1) - within;
    ireal clamped = i < I(0) ? I(0) : (i < n ? i : n - I(1));
    return mode == I(TEXTURE_WRAP_CLAMP) ? clamped : mirrored;
}

/* Texture `id` of each lane at (u, v). Texel (i, j) is centred on ((i + 0.5) / width, (j + 0.5) / height); row 0 lies at
 * v = 0, as in Mitsuba 3. Coordinates beyond 2^20 repeats have no digits left for texels. */
FN rgb texture_lookup(__global const b_texture *textures, __global const float *texels, ireal id, real u, real v) {
    real x = fma(GATHER(textures, to_uv[0], id), u, fma(GATHER(textures, to_uv[1], id), v, GATHER(textures, to_uv[2], id)));
    real y = fma(GATHER(textures, to_uv[3], id), u, fma(GATHER(textures, to_uv[4], id), v, GATHER(textures, to_uv[5], id)));
    x = lclamp(x, R(-1048576), R(1048576));
    y = lclamp(y, R(-1048576), R(1048576));
    ireal kind = GATHER_INT(textures, kind, id);
    rgb c = cgrey(R(0));
    mask checker = kind == I(TEXTURE_CHECKERBOARD);
    if (ANY(checker)) {
        mask left = x - floor(x) < R(0.5), low = y - floor(y) < R(0.5);
        mask same = (left & low) | (!left & !low);
        c = cselect(same, CGATHER(textures, color0, id), CGATHER(textures, color1, id));
    }
    mask bitmap = kind == I(TEXTURE_BITMAP);
    if (ANY(bitmap)) {
        ireal width = bitmap ? GATHER_INT(textures, width, id) : I(1);
        ireal height = bitmap ? GATHER_INT(textures, height, id) : I(1);
        ireal wrap = GATHER_INT(textures, wrap, id), first = GATHER_INT(textures, first, id);
        first = bitmap ? first : I(0);
        mask nearest = (GATHER_INT(textures, filter, id) & I(TEXTURE_NEAREST)) != I(0);
        real shift = nearest ? R(0) : R(0.5);
        real px = x * to_real(width) - shift, py = y * to_real(height) - shift;
        ireal i = to_ireal(floor(px)), j = to_ireal(floor(py));
        real fx = nearest ? R(0) : px - floor(px), fy = nearest ? R(0) : py - floor(py);
        ireal i0 = texture_wrap(i, width, wrap), i1 = texture_wrap(i + I(1), width, wrap);
        ireal j0 = texture_wrap(j, height, wrap), j1 = texture_wrap(j + I(1), height, wrap);
        rgb a = cgather(texels, first + j0 * width + i0), b = cgather(texels, first + j0 * width + i1);
        rgb d = cgather(texels, first + j1 * width + i0), e = cgather(texels, first + j1 * width + i1);
        rgb top = cadd(cscale(a, R(1) - fx), cscale(b, fx)), bottom = cadd(cscale(d, R(1) - fx), cscale(e, fx));
        c = cselect(bitmap, cadd(cscale(top, R(1) - fy), cscale(bottom, fy)), c);
    }
    return c;
}

#endif

/* texture.h -- colours over texture coordinates: bitmaps and checkerboards. */
#ifndef BRUME_TEXTURE_H
#define BRUME_TEXTURE_H

#include "shared.h"
#include "vec.h"

/* A coordinate, |x| <= 2^24, brought into [0, 1], off by 2^-24 at most. (Beyond, where floats are whole numbers, a
 * mirror may give 2.) First as a number: integer remainders of whole vectors go lane by lane. */
FN real texture_wrap(real x, ireal mode) {
    real repeated = x - floor(x);
    real folded = fabs(fma(R(-2), floor(fma(R(0.5), x, R(0.5))), x));
    real clamped = lclamp(x, R(0), R(1));
    return mode == I(TEXTURE_WRAP_REPEAT) ? repeated : (mode == I(TEXTURE_WRAP_MIRROR) ? folded : clamped);
}

/* A neighbour -1 ... n of such a coordinate brought into 0 ... n - 1; anything else (of NaN) too. */
FN ireal texture_neighbour(ireal i, ireal n, ireal mode) {
    mask repeat = mode == I(TEXTURE_WRAP_REPEAT);
    ireal below = repeat ? n - I(1) : I(0), above = repeat ? I(0) : n - I(1);
    return i < I(0) ? below : (i < n ? i : above);
}

/* Row `row` of the matrices to_uv on (u, v, 1). */
#define TEXTURE_ROW(row) \
    fma(GATHER(textures, to_uv[3 * (row)], id), u, \
        fma(GATHER(textures, to_uv[3 * (row) + 1], id), v, GATHER(textures, to_uv[3 * (row) + 2], id)))

/* Texture `id` of each lane at (u, v). Texel (i, j) is centred on ((i + 0.5) / width, (j + 0.5) / height); row 0 lies
 * at v = 0, as in Mitsuba 3. */
FN rgb texture_lookup(__global const b_texture *textures, __global const float *texels, ireal id, real u, real v) {
    real x = TEXTURE_ROW(0), y = TEXTURE_ROW(1);
    ireal kind = GATHER_INT(textures, kind, id);
    rgb c = cgrey(R(0));
    mask checker = kind == I(TEXTURE_CHECKERBOARD);
    if (ANY(checker)) {
        mask left = x - floor(x) <= R(0.5), low = y - floor(y) <= R(0.5);
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
        real px = fma(texture_wrap(x, wrap), to_real(width), -shift);
        real py = fma(texture_wrap(y, wrap), to_real(height), -shift);
        ireal i = to_ireal(floor(px)), j = to_ireal(floor(py));
        real fx = nearest ? R(0) : px - floor(px), fy = nearest ? R(0) : py - floor(py);
        ireal i0 = texture_neighbour(i, width, wrap), i1 = texture_neighbour(i + I(1), width, wrap);
        ireal j0 = texture_neighbour(j, height, wrap), j1 = texture_neighbour(j + I(1), height, wrap);
        rgb a = cgather(texels, first + j0 * width + i0), b = cgather(texels, first + j0 * width + i1);
        rgb d = cgather(texels, first + j1 * width + i0), e = cgather(texels, first + j1 * width + i1);
        rgb top = cadd(cscale(a, R(1) - fx), cscale(b, fx)), bottom = cadd(cscale(d, R(1) - fx), cscale(e, fx));
        c = cselect(bitmap, cadd(cscale(top, R(1) - fy), cscale(bottom, fy)), c);
    }
    return c;
}

#endif

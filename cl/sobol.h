/* sobol.h -- the first four dimensions of the Sobol' sequence, 2^16 points, Owen-scrambled.
 *
 * Everything here lives in bit-reversed form: bit k of a reversed coordinate is its digit 2^-(k+1). A scrambling in
 * Owen's sense (each digit flipped by a random function of the digits before it) is then a hash in which bits only act
 * on higher bits, which is what multiplication, addition and x ^= x * even do (Laine & Karras 2011; Burley 2020).
 *
 * Direction numbers: Joe & Kuo 2008. Dimension 0 is the radical inverse (the index itself, reversed), dimension 1 is
 * Pascal's triangle modulo 2 and takes four steps instead of sixteen.
 */
#ifndef BRUME_SOBOL_H
#define BRUME_SOBOL_H

#include "lane.h"

/* For each bit of the index: the reversed 16-bit direction numbers of dimension 2 (low half) and 3 (high half), from
 * the primitive polynomials x^2 + x + 1 (m = 1, 3) and x^3 + x + 1 (m = 1, 3, 1). */
__constant uint sobol_directions[16] = {
    0x00010001, 0x00030003, 0x00040006, 0x000a0009, 0x001f0017, 0x002e003a, 0x00450071, 0x00c900a3,
    0x011b0116, 0x02a40339, 0x079a0677, 0x0b6709aa, 0x101e1601, 0x302d3903, 0x40417706, 0xa0c3aa09,
};

FN ureal32 reverse_bits(ureal32 x) {
    x = ((x >> U32(1)) & U32(0x55555555u)) | ((x & U32(0x55555555u)) << U32(1));
    x = ((x >> U32(2)) & U32(0x33333333u)) | ((x & U32(0x33333333u)) << U32(2));
    x = ((x >> U32(4)) & U32(0x0f0f0f0fu)) | ((x & U32(0x0f0f0f0fu)) << U32(4));
    x = ((x >> U32(8)) & U32(0x00ff00ffu)) | ((x & U32(0x00ff00ffu)) << U32(8));
    return (x >> U32(16)) | (x << U32(16));
}

/* Owen scrambling of a reversed number. Constants: Vegdahl 2021, found by search for even avalanche (the published ones
 * of 2011 leave visible structure). The seed must be well mixed. */
FN ureal32 owen_scramble_reversed(ureal32 x, ureal32 seed) {
    x = x ^ (x * U32(0x3d20adeau));
    x = x + seed;
    x = x * ((seed >> U32(16)) | U32(1));
    x = x ^ (x * U32(0x05526c56u));
    return x ^ (x * U32(0x53a22864u));
}

/* Reversed coordinates (16 digits each) of point `index` < 2^16. */
FN void sobol_reversed(ureal32 index, ureal32 *x0, ureal32 *x1, ureal32 *x2, ureal32 *x3) {
    ureal32 y = index;
    y = y ^ ((y >> U32(1)) & U32(0x5555));
    y = y ^ ((y >> U32(2)) & U32(0x3333));
    y = y ^ ((y >> U32(4)) & U32(0x0f0f));
    y = y ^ ((y >> U32(8)) & U32(0x00ff));
    ureal32 z = U32(0);
#pragma unroll
    for (int b = 0; b < 16; b++) z = z ^ ((U32(0) - ((index >> U32(b)) & U32(1))) & U32(sobol_directions[b]));
    *x0 = index;
    *x1 = y;
    *x2 = z & U32(0xffff);
    *x3 = z >> U32(16);
}

#endif

/* naive_triangle.h -- a planted bug: instead of intersect_triangle.h's the test of Moeller & Trumbore 1997, with its
 * float edge tests, which lets rays through between triangles. Comes before a kernel that includes traverse.h.
 */
#ifndef NAIVE_TRIANGLE_H
#define NAIVE_TRIANGLE_H

#define NAIVE_TRIANGLE \
    "#define BVH_PACKET 0\n" \
    "#define BRUME_INTERSECT_TRIANGLE_H\n" \
    "#include \"shared.h\"\n" \
    "#include \"exact.h\"\n" \
    "#include \"wide.h\"\n" \
    "FN void intersect_block(__global const b_triangle_block *block, const ray *r, real1 near, real1 tmax,\n" \
    "                        block_hits *out) {\n" \
    "    wide a[3], e[3], f[3], s[3], p[3], q[3];\n" \
    "    for (int i = 0; i < 3; i++) {\n" \
    "        a[i] = wide_load(block->v0[i]);\n" \
    "        e[i] = wide_load(block->v1[i]) - a[i];\n" \
    "        f[i] = wide_load(block->v2[i]) - a[i];\n" \
    "        s[i] = (wide)r->o[i] - a[i];\n" \
    "    }\n" \
    "    for (int i = 0; i < 3; i++) {\n" \
    "        int j = (i + 1) % 3, k = (i + 2) % 3;\n" \
    "        p[i] = (wide)r->d[j] * f[k] - (wide)r->d[k] * f[j];\n" \
    "        q[i] = s[j] * e[k] - s[k] * e[j];\n" \
    "    }\n" \
    "    wide det = e[0] * p[0] + e[1] * p[1] + e[2] * p[2], scale = (wide)1 / det;\n" \
    "    wide u = (s[0] * p[0] + s[1] * p[1] + s[2] * p[2]) * scale;\n" \
    "    wide v = ((wide)r->d[0] * q[0] + (wide)r->d[1] * q[1] + (wide)r->d[2] * q[2]) * scale;\n" \
    "    wide t = (f[0] * q[0] + f[1] * q[1] + f[2] * q[2]) * scale;\n" \
    "    wide entered = wmax(t, (wide)near);\n" \
    "    out->set = wide_set((u >= (wide)0) & (v >= (wide)0) & (u + v <= (wide)1) & (t > (wide)r->tmin) &\n" \
    "                        (entered <= (wide)tmax));\n" \
    "    out->t.all = entered;\n" \
    "    out->v.all = u * det;\n" \
    "    out->w.all = v * det;\n" \
    "    out->det.all = det;\n" \
    "}\n"

#endif

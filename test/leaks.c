/* leaks.c -- see leaks.h. */
#include "leaks.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "bvh.h"

#define LEAK_BVH "-DBVH_STACK=200 "

const leak_way leak_ways[LEAK_WAYS] = {
    {"each ray alone", 8, BRUME_PRECISION_FLOAT, LEAK_BVH "-DBVH_PACKET=0", 0},
    {"packets to the end", 16, BRUME_PRECISION_FLOAT, LEAK_BVH "-DPACKET_NODE_LANES=0 -DPACKET_LEAF_LANES=0", 0},
    {"packets, then alone", 16, BRUME_PRECISION_FLOAT, LEAK_BVH, 0},
    {"each ray alone, in double", 8, BRUME_PRECISION_DOUBLE, LEAK_BVH "-DBVH_PACKET=0", 0},
    {"packets, then alone, in double", 8, BRUME_PRECISION_DOUBLE, LEAK_BVH, 0},
    {"wedges", 16, BRUME_PRECISION_FLOAT, LEAK_BVH "-DSTRATEGY=8 " FEATURES_ARE(BEAM_FEATURES), 1},
};

leak_mesh leak_mesh_make(int which) {
    leak_mesh m = {"icosphere", {0}, 0.5f, 1.8f, {1, 1, 1}, {0, 0, 0}};
    switch (which) {
    case 0: m.mesh = test_mesh_icosphere(4); break;
    case 1:
        m.name = "icosphere 23 000 radii off";
        m.mesh = test_mesh_icosphere(3);
        m.shift[0] = 10000, m.shift[1] = -20000, m.shift[2] = 5000;
        break;
    case 2: /* two pyramids of needles, a hundred times as long as thick */
        m.name = "spindle of needles";
        m.mesh = test_mesh_sphere(2, 2048, 0);
        m.scale[2] = 100;
        m.inside = 0.3f;
        break;
    case 3: /* slivers along y and z, flattened */
        m.name = "lens of slivers";
        m.mesh = test_mesh_sphere(512, 6, 0);
        m.scale[0] = 1e-3f;
        break;
    case 4:
        m.name = "bumpy sphere";
        m.mesh = test_mesh_sphere(48, 64, 0.2);
        m.inside = 0.4f;
        break;
    default: /* planes, edges and vertices of the grid that half of the rays start from */
        m.name = "cube";
        m.mesh = test_mesh_cube(16);
        m.inside = 0.9f;
    }
    for (uint32_t i = 0; i < 3 * m.mesh.vertex_count; i++)
        m.mesh.positions[i] = m.scale[i % 3] * m.mesh.positions[i] + m.shift[i % 3];
    return m;
}

/* setup: rounds, numbers of the first ray (two words), triangles, blocks. place: of leak_mesh. found: leaks, number of
 * one that leaked (two words), rays. */
#define LEAK_RANDOM \
    "ulong leak_bits(ulong *state) {\n" /* splitmix64 */ \
    "    ulong z = *state += 0x9e3779b97f4a7c15ul;\n" \
    "    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ul;\n" \
    "    z = (z ^ (z >> 27)) * 0x94d049bb133111ebul;\n" \
    "    return z ^ (z >> 31);\n" \
    "}\n" \
    "float leak_unit(ulong *state) { return (float)(leak_bits(state) >> 40) * 0x1p-24f; }\n" \
    "float leak_within(ulong *state, float size) { return (2 * leak_unit(state) - 1) * size; }\n" \
    "float leak_on_grid(float x) { return trunc(8 * x) / 8; }\n" \
    "void leak_found(__global uint *found, ulong number, uint count) {\n" \
    "    if (atomic_add(&found[0], count) != 0) return;\n" \
    "    found[1] = (uint)number;\n" \
    "    found[2] = (uint)(number >> 32);\n" \
    "}\n"

const char leak_ray_text[] =
    "#include \"traverse.h\"\n" LEAK_RANDOM
    "void leak_ray(__global const float *vertices, __global const b_triangle *triangles, uint triangle_count,\n"
    "              __global const float *place, ulong number, ulong shared, float *o, float *d) {\n"
    "    __global const float *scale = place + 2, *shift = place + 5;\n"
    "    ulong own = number * 0x9e3779b97f4a7c15ul + 1, target = number & 1024 ? shared * 0xd1b54a32d192ed03ul : own;\n"
    "    __global const int *v = triangles[leak_bits(&target) % triangle_count].v;\n"
    "    ulong kind = leak_bits(&own), origin = number & 1024 ? target : own;\n"
    "    for (int a = 0; a < 3; a++) {\n"
    "        float x = leak_within(&origin, place[0]);\n"
    "        o[a] = fma(scale[a], kind & 8 ? leak_on_grid(x) : x, shift[a]);\n"
    "    }\n"
    "    float s = (kind & 7) < 3 ? 0 : leak_unit(&own), u = (kind & 7) < 7 ? 0 : leak_unit(&own), length = 0, p[3];\n"
    "    for (int a = 0; a < 3; a++) {\n"
    "        float v0 = vertices[3 * v[0] + a], v1 = vertices[3 * v[1] + a], v2 = vertices[3 * v[2] + a];\n"
    "        p[a] = fma(u * (1 - s), v2 - v0, fma(s, v1 - v0, v0));\n"
    "    }\n"
    "    if ((kind >> 4 & 7) == 0) {\n" /* along an axis, if that starts within */
    "        int i = (int)(kind >> 8 & 0xff) % 3, j = (i + 1) % 3, k = (i + 2) % 3;\n"
    "        if (fabs(p[j] - shift[j]) < place[0] * scale[j] && fabs(p[k] - shift[k]) < place[0] * scale[k])\n"
    "            o[j] = p[j], o[k] = p[k];\n"
    "    }\n"
    "    for (int a = 0; a < 3; a++) {\n"
    "        d[a] = p[a] - o[a];\n"
    "        length += d[a] * d[a];\n"
    "    }\n"
    "    if (kind & 128) for (int a = 0; a < 3; a++) d[a] /= sqrt(length);\n"
    "}\n"
    "__kernel void test(__global const uint *setup, __global const float *place, __global const float *vertices,\n"
    "                   __global const b_triangle *triangles, __global const b_node *nodes,\n"
    "                   __global const b_triangle_block *blocks, __global uint *found) {\n"
    "    geometry g = {nodes, blocks, (__global const b_quadric *)nodes, (__global const int *)nodes, (int)setup[3]};\n"
    "    ulong first = setup[1] | (ulong)setup[2] << 32;\n"
    "    for (uint round = 0; round < setup[0]; round++) {\n"
    "        ulong number = first + (ulong)round * (get_global_size(0) * LANES) + AT;\n"
    "        lanes_of_real o[3], d[3];\n"
    "        for (int k = 0; k < LANES; k++) {\n"
    "            float from[3], to[3];\n"
    "            leak_ray(vertices, triangles, setup[3], place, number + k, number, from, to);\n"
    "            for (int a = 0; a < 3; a++) o[a].one[k] = from[a], d[a].one[k] = to[a];\n"
    "        }\n"
    "        vec origin = vmake(o[0].all, o[1].all, o[2].all), way = vmake(d[0].all, d[1].all, d[2].all);\n"
    "        hit h = closest(&g, origin, way, R(0), R(INFINITY), TRUE_MASK);\n"
    "        mask dark = occluded(&g, origin, way, R(0), R(INFINITY), TRUE_MASK);\n"
    "        mask leak = (h.prim < I(0)) | !dark;\n"
    "        if (!ANY(leak)) continue;\n"
    "        lanes_of_ireal leaks;\n"
    "        leaks.all = leak ? I(1) : I(0);\n"
    "        for (int k = 0; k < LANES; k++) if (leaks.one[k]) leak_found(found, number + k, 1);\n"
    "    }\n"
    "    atomic_add(&found[3], setup[0] * LANES);\n"
    "}\n";

const char leak_wedge_text[] =
    "#include \"scatter_segment.h\"\n" LEAK_RANDOM
    /* Lamp, origin, direction and length of the line. */
    "void leak_plane(__global const float *place, ulong number, float *lamp, float *o, float *d, float *length) {\n"
    "    __global const float *scale = place + 2, *shift = place + 5;\n"
    "    ulong state = number * 0x9e3779b97f4a7c15ul + 1, kind = leak_bits(&state);\n"
    "    float inner[3], outer[3], dd = 0, along = 0, away = 0, back = leak_within(&state, 2), size = 0;\n"
    "    for (int a = 0; a < 3; a++) {\n"
    "        float x = leak_within(&state, place[0]);\n"
    "        inner[a] = kind & 1 ? leak_on_grid(x) : x;\n"
    "        outer[a] = leak_within(&state, 1);\n"
    "        d[a] = leak_within(&state, 1);\n"
    "        dd += d[a] * d[a];\n"
    "    }\n"
    "    for (int a = 0; a < 3; a++) along += outer[a] * d[a] / dd;\n"
    "    for (int a = 0; a < 3; a++) outer[a] -= along * d[a], away += outer[a] * outer[a];\n"
    "    for (int a = 0; a < 3; a++)\n"
    "        outer[a] = outer[a] * (place[1] + leak_unit(&state)) / sqrt(away) - back * d[a] / sqrt(dd);\n"
    "    if (kind & 1) {\n" /* planes of the grid, or diagonal ones */
    "        int i = (int)(kind >> 8 & 0xff) % 3, j = (i + 1) % 3, k = (i + 2) % 3;\n"
    "        for (int a = 0; a < 3; a++) d[a] = 0;\n"
    "        d[i] = kind & 2 ? 1 : -1;\n"
    "        outer[i] = -2 * d[i];\n"
    "        outer[k] = kind & 4 ? -1.875f : 1.875f;\n"
    "        outer[j] = inner[j] + (kind & 8 ? outer[k] - inner[k] : 0);\n"
    "    }\n"
    "    int within = kind & 16 ? 1 : 0;\n" /* the line; then short enough to stay there */
    "    for (int a = 0; a < 3; a++) {\n"
    "        float in = fma(scale[a], inner[a], shift[a]), out = fma(scale[a], outer[a], shift[a]);\n"
    "        lamp[a] = within ? out : in;\n"
    "        o[a] = within ? in : out;\n"
    "        d[a] *= scale[a];\n"
    "        size += d[a] * d[a];\n"
    "    }\n"
    "    for (int a = 0; a < 3; a++) d[a] /= sqrt(size);\n"
    "    float least = fmin(scale[0], fmin(scale[1], scale[2])), most = fmax(scale[0], fmax(scale[1], scale[2]));\n"
    "    *length = within ? 0.1f * least : kind & 96 ? 5 * most * leak_unit(&state) : 1e18f;\n"
    "}\n"
    "__kernel void test(__global const uint *setup, __global const float *place, __global const b_params *params,\n"
    "                   __global const b_node *nodes, __global const b_triangle_block *blocks,\n"
    "                   __global uint *found) {\n"
    "    scene s;\n"
    "    s.params = params;\n"
    "    geometry g = {nodes, blocks, (__global const b_quadric *)nodes, (__global const int *)nodes,\n"
    "                  params->triangle_count};\n"
    "    s.geometry = g;\n"
    "    lamp l;\n"
    "    l.axis = vmake(R(0), R(0), R(1));\n"
    "    l.intensity = cgrey(R(1));\n"
    "    l.cutoff = l.inv_fade = l.v_cutoff = l.v_beam = R(0);\n"
    "    l.directional = l.cone = l.cosine = FALSE_MASK;\n"
    "    l.light = I(-1);\n"
    "    ulong first = setup[1] | (ulong)setup[2] << 32;\n"
    "    for (uint round = 0; round < setup[0]; round++) {\n"
    "        ulong number = first + (ulong)round * (get_global_size(0) * LANES) + AT;\n"
    "        lanes_of_real at[3], o[3], d[3], length, rows[16], t[64];\n"
    "        lanes_of_u32 low, high;\n"
    "        lanes_of_ireal counts, planar;\n"
    "        for (int k = 0; k < LANES; k++) {\n"
    "            float lamp_at[3], from[3], to[3], far;\n"
    "            leak_plane(place, number + k, lamp_at, from, to, &far);\n"
    "            for (int a = 0; a < 3; a++) at[a].one[k] = lamp_at[a], o[a].one[k] = from[a], d[a].one[k] = to[a];\n"
    "            length.one[k] = far;\n"
    "        }\n"
    "        l.position = vmake(at[0].all, at[1].all, at[2].all);\n"
    "        vec way = vmake(d[0].all, d[1].all, d[2].all);\n"
    "        beam b = beam_of(&l, vmake(o[0].all, o[1].all, o[2].all), way, length.all);\n"
    "        planar.all = b.D > R(1e-4f * params->scene_radius) ? I(1) : I(0);\n"
    "        low.all = high.all = U32(0);\n"
    "        wedge_store(&s, &l, &b, way, b.a, rows);\n"
    "        for (int k = 0; k < LANES; k++) {\n"
    "            wedge w = wedge_take(rows, k);\n"
    "            float far = 2e4f * fmin(place[2], fmin(place[3], place[4]));\n" /* then they are the lamp's own */
    "            int count = 0, start = (int)((number + k) * 7919 % setup[4]);\n"
    "            for (int i = 0; i < (int)setup[4] && count < 64 && planar.one[k]; i++) {\n"
    "                lanes_of_wide lows, highs;\n"
    "                ulong set = wedge_block(&blocks[(start + i) % (int)setup[4]], &w, &lows, &highs);\n"
    "                while (set) {\n"
    "                    int q = wide_last(set);\n"
    "                    set = wide_without(set, q);\n"
    "                    for (int e = 0; e < 2; e++) {\n"
    "                        real1 end = e ? highs.one[q] : lows.one[q];\n"
    "                        if (!(end > w.t0 && end < w.t1 && fabs(end) < far) || count == 64) continue;\n"
    "                        int j = count++;\n"
    "                        for (; j > 0 && t[j - 1].one[k] > end; j--) t[j].one[k] = t[j - 1].one[k];\n"
    "                        t[j].one[k] = end;\n"
    "                    }\n"
    "                }\n"
    "            }\n"
    "            counts.one[k] = count;\n"
    "        }\n"
    "        wedge_rasterize(&s, rows, t, counts.all, counts.all > I(0), &low, &high);\n"
    "        for (int k = 0; k < LANES; k++) {\n"
    "            int count = counts.one[k];\n"
    "            ulong dark = low.one[k] | (ulong)high.one[k] << 32, all = count == 64 ? ~0ul : (1ul << count) - 1;\n"
    "            if (~dark & all) leak_found(found, number + k, (uint)popcount(~dark & all));\n"
    "            atomic_add(&found[3], (uint)count);\n"
    "        }\n"
    "    }\n"
    "}\n";

void leaks_count(const char *text, const leak_way *way, const leak_mesh *m, uint64_t rays, leak_tally *tally) {
    static brume_context *context;
    brume_bvh bvh;
    b_params params;
    if (!context) assert_int_equal(brume_context_create(&context), BRUME_OK);
    assert_int_equal(brume_bvh_build(context, m->mesh.positions, m->mesh.triangles, m->mesh.triangle_count, NULL, 0,
                                     &bvh), BRUME_OK);
    assert_true(bvh.stack_size <= 200);
    memset(&params, 0, sizeof params);
    params.scene_radius = 2 * fmaxf(m->scale[0], fmaxf(m->scale[1], m->scale[2]));
    params.triangle_count = (int)m->mesh.triangle_count;
    float place[8] = {m->inside, m->outside};
    memcpy(place + 2, m->scale, sizeof m->scale);
    memcpy(place + 5, m->shift, sizeof m->shift);

    uint64_t number = 0, end = tally->rays + rays;
    while (tally->rays < end) {
        const uint64_t positions = way->wedges ? 64 : 1;
        uint64_t left = (end - tally->rays + positions - 1) / positions;
        size_t elements = left < 4096 ? (size_t)(left + 255) / 256 * 256 : 4096;
        uint64_t rounds = left / elements < 1 ? 1 : left / elements > 512 ? 512 : left / elements;
        uint32_t setup[5] = {(uint32_t)rounds, (uint32_t)number, (uint32_t)(number >> 32), m->mesh.triangle_count,
                             bvh.block_count}, found[4];
        const device_array hierarchy[2] = {{READ_RAW, bvh.nodes, bvh.node_count * sizeof *bvh.nodes},
                                           {READ_RAW, bvh.blocks, bvh.block_count * sizeof *bvh.blocks}};
        const device_array for_rays[] = {
            {READ_RAW, setup, sizeof setup}, {READ_RAW, place, sizeof place},
            {READ_RAW, m->mesh.positions, 3 * m->mesh.vertex_count * sizeof *m->mesh.positions},
            {READ_RAW, m->mesh.triangles, m->mesh.triangle_count * sizeof *m->mesh.triangles},
            hierarchy[0], hierarchy[1], {WRITE_BITS, found, 4}};
        const device_array for_wedges[] = {
            {READ_RAW, setup, sizeof setup}, {READ_RAW, place, sizeof place}, {READ_RAW, &params, sizeof params},
            hierarchy[0], hierarchy[1], {WRITE_BITS, found, 4}};
        if (way->wedges)
            device_test_run(text, way->options, way->lanes, way->precision, elements, for_wedges, 6);
        else
            device_test_run(text, way->options, way->lanes, way->precision, elements, for_rays, 7);
        if (found[0] && !tally->leaks) tally->first = found[1] | (uint64_t)found[2] << 32;
        assert_true(found[3] > 0);
        tally->leaks += found[0];
        tally->rays += found[3];
        number += elements * rounds;
    }
    brume_bvh_free(&bvh);
}

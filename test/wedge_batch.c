/* wedge_batch.c -- see wedge_batch.h. */
#include "wedge_batch.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "bvh.h"

/* One wedge a lane. in: lamp, origin, direction, length, offset of the positions, whether the ray ends at what it hits.
 * setup: number of blocks; whether positions are the very ends of ranges that the triangles hide, as many as there is
 * room for, instead of evenly spaced. */
const char wedge_text[] =
    "#include \"scatter_segment.h\"\n"
    "__kernel void test(__global const b_params *params, __global const b_node *nodes,\n"
    "                   __global const b_triangle_block *blocks, __global const b_quadric *quadrics,\n"
    "                   __global const int *ids, __global const int *setup, __global const real1 *in,\n"
    "                   __global real1 *out, __global real1 *positions, __global uint *bits) {\n"
    "    uint n = get_global_size(0) * LANES;\n"
    "    scene s;\n"
    "    s.params = params;\n"
    "    s.geometry.nodes = nodes; s.geometry.blocks = blocks; s.geometry.quadrics = quadrics;\n"
    "    s.geometry.quadric_ids = ids; s.geometry.triangle_count = params->triangle_count;\n"
    "    in += AT, out += AT, positions += AT, bits += AT;\n"
    "    lamp l;\n"
    "    l.position = vmake(LOAD(in), LOAD(in + n), LOAD(in + 2 * n));\n"
    "    l.axis = vmake(R(0), R(0), R(1));\n"
    "    l.intensity = cgrey(R(1));\n"
    "    l.cutoff = l.inv_fade = l.v_cutoff = l.v_beam = R(0);\n"
    "    l.directional = l.cone = l.cosine = FALSE_MASK;\n"
    "    l.light = I(-1);\n"
    "    vec o = vmake(LOAD(in + 3 * n), LOAD(in + 4 * n), LOAD(in + 5 * n));\n"
    "    vec d = vmake(LOAD(in + 6 * n), LOAD(in + 7 * n), LOAD(in + 8 * n));\n"
    "    real t_end = LOAD(in + 9 * n), u = LOAD(in + 10 * n);\n"
    "    hit h = closest(&s.geometry, o, d, R(0), t_end, TRUE_MASK);\n"
    "    t_end = LOAD(in + 11 * n) > R(0) ? h.t : t_end;\n"
    "    beam g = beam_of(&l, o, d, t_end);\n"
    "    lanes_of_real rows[16], t[64];\n"
    "    lanes_of_u32 low, high, rays_low, rays_high;\n"
    "    lanes_of_ireal counts;\n"
    "    low.all = high.all = rays_low.all = rays_high.all = U32(0);\n"
    "    counts.all = I(64);\n"
    "    wedge_store(&s, &l, &g, d, g.a, rows);\n"
    "    for (int j = 0; j < 64; j++) t[j].all = beam_equiangular(&g, g.a, (R(j) + u) * R(1.0 / 64));\n"
    "    if (setup[1]) for (int k = 0; k < LANES; k++) {\n"
    "        wedge w = wedge_take(rows, k);\n"
    "        int count = 0;\n"
    "        for (int i = 0; i < *setup && count < 64; i++) {\n"
    "            lanes_of_wide a, b;\n"
    "            ulong set = wedge_block(&blocks[(i + 7 * (int)(AT + k)) % *setup], &w, &a, &b);\n"
    "            while (set) {\n"
    "                int q = wide_last(set);\n"
    "                set = wide_without(set, q);\n"
    "                for (int e = 0; e < 2; e++) {\n"
    "                    real1 end = e ? b.one[q] : a.one[q];\n"
    "                    if (!(end > w.t0 && end < w.t1) || count == 64) continue;\n"
    "                    int at = count++;\n"
    "                    for (; at > 0 && t[at - 1].one[k] > end; at--) t[at].one[k] = t[at - 1].one[k];\n"
    "                    t[at].one[k] = end;\n"
    "                }\n"
    "            }\n"
    "        }\n"
    "        counts.one[k] = count;\n"
    "    }\n"
    "    wedge_rasterize(&s, rows, t, counts.all, counts.all > I(0), &low, &high);\n"
    "    if (!setup[1]) for (int j = 0; j < 64; j++) {\n"
    "        real distance = sqrt(fma(t[j].all, t[j].all, square(g.D)));\n"
    "        vec wi = vscale(vmad(d, t[j].all, vscale(g.n, g.D)), R(-1) / distance);\n"
    "        real along = lclamp(t[j].all + g.delta, R(0), t_end);\n"
    "        mask dark = occluded(&s.geometry, vmad(d, along, o), wi, R(0), distance * SHORT_OF_LIGHT, TRUE_MASK);\n"
    "        ureal32 bit = to_ureal32(dark ? I(1) : I(0)) << U32(j & 31);\n"
    "        if (j < 32) rays_low.all |= bit; else rays_high.all |= bit;\n"
    "    }\n"
    "    for (int j = 0; j < 64; j++) STORE(positions + j * n, t[j].all);\n"
    "    STORE(out, g.a.t0); STORE(out + n, g.a.t1); STORE(out + 2 * n, g.D); STORE(out + 3 * n, g.delta);\n"
    "    STORE(out + 4 * n, wedge_open(&s, rows, TRUE_MASK) ? R(1) : R(0));\n"
    "    STORE(out + 5 * n, to_real(counts.all));\n"
    "    STORE_BITS(bits, low.all); STORE_BITS(bits + n, high.all);\n"
    "    STORE_BITS(bits + 2 * n, rays_low.all); STORE_BITS(bits + 3 * n, rays_high.all);\n"
    "}\n";

double wedge_scene_radius = 2;
double wedge_in[12][WEDGES], wedge_out[PLANES][WEDGES], wedge_positions[POSITIONS][WEDGES];
uint32_t wedge_bits[4][WEDGES];

int wedge_is_planar(int i) { return wedge_out[D][i] > 1e-4 * wedge_scene_radius; }

int wedge_dark_at(int i, int j) { return wedge_bits[j / 32][i] >> (j % 32) & 1; }
int ray_dark_at(int i, int j) { return wedge_bits[2 + j / 32][i] >> (j % 32) & 1; }

void wedge_compute(const char *text, const char *more, uint32_t lanes, int ends, const test_mesh *mesh) {
    static brume_context *context;
    brume_bvh bvh;
    b_params params;
    char options[300];
    if (!context) assert_int_equal(brume_context_create(&context), BRUME_OK);
    assert_int_equal(brume_bvh_build(context, mesh->positions, mesh->triangles, mesh->triangle_count, mesh->quadrics,
                                     mesh->quadric_count, &bvh), BRUME_OK);
    assert_true(bvh.stack_size <= 200);
    memset(&params, 0, sizeof params);
    params.scene_radius = (float)wedge_scene_radius;
    params.triangle_count = (int)mesh->triangle_count;
    int32_t setup[2] = {(int32_t)bvh.block_count, ends};
    const device_array arrays[] = {
        {READ_RAW, &params, sizeof params}, {READ_RAW, bvh.nodes, bvh.node_count * sizeof *bvh.nodes},
        {READ_RAW, mesh->triangle_count ? (void *)bvh.blocks : &params, bvh.block_count * sizeof *bvh.blocks},
        {READ_RAW, mesh->quadric_count ? (void *)mesh->quadrics : &params,
         mesh->quadric_count * sizeof *mesh->quadrics},
        {READ_RAW, mesh->quadric_count ? (void *)bvh.quadric_ids : &params,
         bvh.quadric_block_count * 8 * sizeof *bvh.quadric_ids},
        {READ_RAW, setup, sizeof setup},
        {READ_REAL, wedge_in, 12 * WEDGES}, {WRITE_REAL, wedge_out, PLANES * WEDGES},
        {WRITE_REAL, wedge_positions, POSITIONS * WEDGES},
        {WRITE_BITS, wedge_bits, 4 * WEDGES}};
    snprintf(options, sizeof options, "%s -DSTRATEGY=8 -DBVH_STACK=200 %s",
             FEATURES_ARE(BEAM_FEATURES "|FEATURE_QUADRICS"), more);
    device_test_run(text, options, lanes, BRUME_PRECISION_FLOAT, WEDGES, arrays, sizeof arrays / sizeof arrays[0]);
    brume_bvh_free(&bvh);
}

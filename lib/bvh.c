/* bvh.c -- the hierarchy's build as a whole: bounds of the primitives, then the binary tree, then the 8-wide one.
 *
 * Memory while building, n primitives: 32 n bytes of items, then up to 2 n binary nodes of 40 + 37 + 4 bytes (in
 * practice 0.7 n: about 90 n bytes in all). What stays: about 256 / 40 n of nodes and 320 / 6.5 n of blocks, 55 n
 * bytes.
 */
#include "bvh_tree.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>

/* Wider than the exact bounds, for three reasons that add up (see cl/traverse.h):
 *  - the triangle test rounds vertices relative to the ray's origin, which moves them by a few 2^-24 of the triangle's
 *    largest extent besides a few 2^-24 of the distance, which the box test's own margin covers;
 *  - a box without thickness must hold rays that run within it;
 *  - the sums here round, too. */
static void set_bounds(brume_bvh_item *item, const double lo[3], const double hi[3]) {
    double extent = 0;
    for (int a = 0; a < 3; a++) extent = fmax(extent, hi[a] - lo[a]);
    for (int a = 0; a < 3; a++) {
        double magnitude = fmax(fabs(lo[a]), fabs(hi[a]));
        double margin = extent * 0x1p-22 + magnitude * 0x1p-23 + FLT_MIN;
        item->lo[a] = (float)(lo[a] - margin);
        item->hi[a] = (float)(hi[a] + margin);
    }
}

static void set_triangle(brume_bvh_item *item, const float *positions, const b_triangle *t) {
    double lo[3], hi[3];
    for (int a = 0; a < 3; a++) {
        double p = positions[3 * (size_t)t->v[0] + a];
        double q = positions[3 * (size_t)t->v[1] + a];
        double r = positions[3 * (size_t)t->v[2] + a];
        lo[a] = p < q ? p : q;
        lo[a] = lo[a] < r ? lo[a] : r;
        hi[a] = p > q ? p : q;
        hi[a] = hi[a] > r ? hi[a] : r;
    }
    set_bounds(item, lo, hi);
}

/* An ellipse c + du cos s + dv sin s reaches sqrt(du^2 + dv^2) from its centre along each axis. */
static void set_quadric(brume_bvh_item *item, const b_quadric *q) {
    double lo[3], hi[3];
    for (int a = 0; a < 3; a++) {
        double reach = q->kind == QUADRIC_SPHERE ? fabs((double)q->radius) : hypot(q->du[a], q->dv[a]);
        lo[a] = q->center[a] - reach;
        hi[a] = q->center[a] + reach;
    }
    set_bounds(item, lo, hi);
}

brume_result brume_bvh_build(brume_context *context, const float *positions, const b_triangle *triangles,
                             uint32_t triangle_count, const b_quadric *quadrics, uint32_t quadric_count,
                             brume_bvh *out) {
    brume_bvh_tree tree = {0};
    brume_result result;

    /* Leaf codes keep 27 bits for the first block; a block holds at least one primitive. */
    if ((uint64_t)triangle_count + quadric_count > UINT32_C(1) << 27)
        return brume_fail(context, BRUME_ERROR_SCENE, "%u triangles and %u quadrics are more than %u primitives",
                          triangle_count, quadric_count, 1u << 27);
    tree.triangle_count = triangle_count;
    tree.item_count = triangle_count + quadric_count;
    tree.items = malloc(tree.item_count * sizeof *tree.items + 1);
    if (!tree.items)
        return brume_fail(context, BRUME_ERROR_MEMORY, "no memory for %u primitives", tree.item_count);
    for (uint32_t i = 0; i < tree.item_count; i++) {
        tree.items[i].prim = i;
        tree.items[i].pad = 0;
        if (i < triangle_count)
            set_triangle(&tree.items[i], positions, &triangles[i]);
        else
            set_quadric(&tree.items[i], &quadrics[i - triangle_count]);
    }
    result = brume_bvh_split(context, &tree);
    if (result == BRUME_OK) result = brume_bvh_collapse(context, &tree, positions, triangles, out);
    free(tree.items);
    free(tree.nodes);
    return result;
}

void brume_bvh_free(brume_bvh *bvh) {
    free(bvh->nodes);
    free(bvh->blocks);
    free(bvh->quadric_ids);
    bvh->nodes = NULL;
    bvh->blocks = NULL;
    bvh->quadric_ids = NULL;
}

/* bvh.c -- the hierarchy's build as a whole: bounds of the primitives, then the binary tree, then the 8-wide one.
 *
 * Memory while building, n primitives: 32 n bytes of items, twice while they are sorted, and binary nodes of 40 bytes,
 * in practice 0.7 n of them and never more than 2 n. What stays is written when the second array of items is gone:
 * about 256 / 40 n of nodes and 320 / 6.5 n of blocks, 55 n bytes. All in all 120 n bytes (`make bench-build`).
 */
#include "bvh_bins.h"
#include "parallel.h"
#include "platform.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>

/* Wider than the exact bounds, for three reasons that add up (see cl/traverse.h):
 *  - the triangle test rounds vertices relative to the ray's origin, which moves them by a few 2^-24 of the triangle's
 *    largest extent besides a few 2^-24 of the distance, which the box test's own margin covers;
 *  - a box without thickness must hold rays that run within it;
 *  - the sums here round, too. */
static void set_bounds(brume_bvh_item *item, const double lo[3], const double hi[3]) {
    double extent = hi[0] - lo[0];
    for (int a = 1; a < 3; a++) extent = hi[a] - lo[a] > extent ? hi[a] - lo[a] : extent;
    for (int a = 0; a < 3; a++) {
        double magnitude = -lo[a] > hi[a] ? -lo[a] : hi[a]; /* of the two the larger, as lo <= hi */
        double margin = extent * 0x1p-22 + magnitude * 0x1p-23 + FLT_MIN;
        item->lo[a] = (float)(lo[a] - margin);
        item->hi[a] = (float)(hi[a] + margin);
    }
}

static void set_triangle(brume_bvh_item *item, const float *positions, const b_triangle *t) {
    const float *p = positions + 3 * (size_t)t->v[0], *q = positions + 3 * (size_t)t->v[1];
    const float *r = positions + 3 * (size_t)t->v[2];
    double lo[3], hi[3];
    for (int a = 0; a < 3; a++) {
        float low = p[a] < q[a] ? p[a] : q[a], high = p[a] > q[a] ? p[a] : q[a];
        lo[a] = low < r[a] ? low : r[a];
        hi[a] = high > r[a] ? high : r[a];
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

/* ---- the items, in pieces --------------------------------------------------------------------------------------- */

enum { PIECE = 16384 };

typedef struct items_job {
    brume_bvh_tree *tree;
    const float *positions;
    const b_triangle *triangles;
    const b_quadric *quadrics;
    brume_bounds *bounds; /* of each piece its boxes and its centres */
} items_job;

static void make_items(void *user, uint32_t piece) {
    const items_job *j = user;
    uint32_t first = piece * PIECE, left = j->tree->item_count - first, count = left < PIECE ? left : PIECE;
    brume_bvh_item *items = j->tree->items + first;
    for (uint32_t k = 0; k < count; k++) {
        uint32_t i = first + k;
        items[k].prim = i;
        items[k].pad = 0;
        if (i < j->tree->triangle_count)
            set_triangle(&items[k], j->positions, &j->triangles[i]);
        else
            set_quadric(&items[k], &j->quadrics[i - j->tree->triangle_count]);
    }
    j->bounds[2 * piece] = j->bounds[2 * piece + 1] = brume_bounds_empty();
    brume_bvh_bound(items, count, &j->bounds[2 * piece], &j->bounds[2 * piece + 1]);
}

/* 0 when memory ran out. */
static int all_items(items_job *j) {
    brume_bvh_tree *tree = j->tree;
    uint32_t pieces = (tree->item_count + PIECE - 1) / PIECE;
    tree->items = malloc(tree->item_count * sizeof *tree->items + 1);
    j->bounds = malloc(2 * pieces * sizeof *j->bounds + 1);
    if (!tree->items || !j->bounds) return 0;
    brume_parallel(tree->threads, pieces, make_items, j);
    tree->box = tree->centers = brume_bounds_empty();
    for (uint32_t i = 0; i < pieces; i++) {
        brume_bounds_join(&tree->box, &j->bounds[2 * i]);
        brume_bounds_join(&tree->centers, &j->bounds[2 * i + 1]);
    }
    return 1;
}

/* ---- all of it -------------------------------------------------------------------------------------------------- */

/* Below so many primitives for each thread another one isn't worth its start. */
enum { WORTH_A_THREAD = 16384 };

brume_result brume_bvh_build_threaded(brume_context *context, uint32_t threads, const float *positions,
                                      const b_triangle *triangles, uint32_t triangle_count, const b_quadric *quadrics,
                                      uint32_t quadric_count, brume_bvh *out) {
    brume_bvh_tree tree = {0};
    items_job job = {&tree, positions, triangles, quadrics, NULL};
    brume_result result = BRUME_OK;

    /* Leaf codes keep 27 bits for the first block; a block holds at least one primitive. */
    if ((uint64_t)triangle_count + quadric_count > UINT32_C(1) << 27)
        return brume_fail(context, BRUME_ERROR_SCENE, "%u triangles and %u quadrics are more than %u primitives",
                          triangle_count, quadric_count, 1u << 27);
    tree.triangle_count = triangle_count;
    tree.item_count = triangle_count + quadric_count;
    uint32_t most = tree.item_count / WORTH_A_THREAD;
    most = most < BRUME_PARALLEL_MOST ? most : BRUME_PARALLEL_MOST;
    tree.threads = threads < most ? threads : most;
    if (!all_items(&job))
        result = brume_fail(context, BRUME_ERROR_MEMORY, "no memory for %u primitives", tree.item_count);
    if (result == BRUME_OK && tree.item_count) result = brume_bvh_split(context, &tree);
    if (result == BRUME_OK) result = brume_bvh_collapse(context, &tree, positions, triangles, out);
    free(job.bounds);
    free(tree.items);
    brume_bvh_tree_free(&tree);
    return result;
}

brume_result brume_bvh_build(brume_context *context, const float *positions, const b_triangle *triangles,
                             uint32_t triangle_count, const b_quadric *quadrics, uint32_t quadric_count,
                             brume_bvh *out) {
    return brume_bvh_build_threaded(context, brume_processors(), positions, triangles, triangle_count, quadrics,
                                    quadric_count, out);
}

void brume_bvh_free(brume_bvh *bvh) {
    free(bvh->nodes);
    free(bvh->blocks);
    free(bvh->quadric_ids);
    bvh->nodes = NULL;
    bvh->blocks = NULL;
    bvh->quadric_ids = NULL;
}

/* light_tree.c -- the tree over lamps (Conty Estevez & Kulla 2018, "Importance sampling of many lights with adaptive
 * tree splitting"): clusters of lamps that are close to each other and shine the same way.
 *
 * A block's set of lamps is split in two, then the costliest part again, until there are sixteen or all are leaves.
 * Splits are binned as in lib/bvh_split.c, along the three coordinates of the place and the three of the axis: among
 * narrow spots that hang side by side, the axis decides which of them meets a ray. Below DEPTH_BINNED levels halves are
 * taken without looking, which bounds the depth and the recursion. One thread, no hashing: the same lamps give the same
 * tree.
 */
#include "light_tree.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "affine.h"

#define PI 3.14159265358979323846

enum { BINS = 16, AXES = 6, DEPTH_BINNED = 40 };

/* A leaf is as large as a ray meets so many of its lamps: 16 to 32 points, hundreds of narrow spots. What a choice
 * costs grows with it, and its variance falls, by about as much; a path costs more than its choices, so it is large. */
#define LEAF_MET 32

/* How far a cone's light is taken to go when splits are judged, of the extent of all lamps; from 0.02 to 2 the same
 * variance results, as with the product of area and solid angle of the authors. */
#define CONE_REACH 0.4

/* All that lamps of a set do: they stand in the box and shine within the cone. */
typedef struct {
    double lo[3], hi[3], axis[3], spread, flux, met;
    uint32_t count;
} cluster;

typedef struct {
    double key[AXES]; /* place, axis */
    double cutoff, flux, met;
    uint32_t light;
} lamp;

typedef struct {
    lamp *lamps;
    b_light_block *blocks;
    uint32_t block_count, capacity, leaves;
    double flux, reach;
} builder;

/* What lies in front of a lamp: it sends this solid angle times its intensity along the axis. */
static double solid_angle(const b_light *light) {
    double c = light->cutoff, b = light->beam < light->cutoff ? light->beam : light->cutoff;
    if (light->kind == LIGHT_POINT) return 4 * PI;
    /* 1 - cos b, and the integral of (c - x) / (c - b) sin x from b to c; straight between them where that has no
     * digits */
    double s = sin(b / 2);
    if (c - b < 1e-4 * c) return 4 * PI * s * s;
    return 2 * PI * (1 + (sin(b) - sin(c)) / (c - b));
}

static double angle_between(const double a[3], const double b[3]) {
    double off[3], sum[3];
    for (int i = 0; i < 3; i++) off[i] = a[i] - b[i], sum[i] = a[i] + b[i];
    return 2 * atan2(sqrt(brume_dot(off, off)), sqrt(brume_dot(sum, sum)));
}

static cluster of_lamp(const lamp *l) {
    cluster c;
    memcpy(c.lo, l->key, sizeof c.lo);
    memcpy(c.hi, l->key, sizeof c.hi);
    memcpy(c.axis, l->key + 3, sizeof c.axis);
    c.spread = l->cutoff;
    c.flux = l->flux;
    c.met = l->met;
    c.count = 1;
    return c;
}

/* The narrowest cone around both (Conty Estevez & Kulla 2018, listing 1). */
static void join_cones(cluster *a, const cluster *b) {
    const cluster *wide = a->spread >= b->spread ? a : b, *narrow = wide == a ? b : a;
    double between = angle_between(wide->axis, narrow->axis), axis[3];
    if (wide->spread >= PI || between + narrow->spread <= wide->spread) {
        memcpy(axis, wide->axis, sizeof axis);
        a->spread = wide->spread;
    } else {
        double spread = 0.5 * (wide->spread + between + narrow->spread), turn = spread - wide->spread;
        /* Opposite axes leave the direction to turn open; any will do, as the whole sphere is near. */
        double along = sin(between) > 1e-9 ? sin(turn) / sin(between) : 0;
        for (int i = 0; i < 3; i++)
            axis[i] = (cos(turn) - along * cos(between)) * wide->axis[i] + along * narrow->axis[i];
        if (!(brume_normalize(axis) > 0) || sin(between) <= 1e-9) spread = PI;
        a->spread = fmin(spread, PI);
    }
    memcpy(a->axis, axis, sizeof axis);
}

static void join(cluster *a, const cluster *b) {
    if (b->count == 0) return;
    if (a->count == 0) {
        *a = *b;
        return;
    }
    for (int i = 0; i < 3; i++) {
        a->lo[i] = fmin(a->lo[i], b->lo[i]);
        a->hi[i] = fmax(a->hi[i], b->hi[i]);
    }
    join_cones(a, b);
    a->flux += b->flux;
    a->met += b->met;
    a->count += b->count;
}

/* How often, or with how much light, a ray finds that it may meet the cluster's and doesn't: as often as it meets their
 * hull, as wide as the box and what the cone opens to on the way. */
static double cost(const builder *b, const cluster *c) {
    double diagonal2 = 0;
    for (int i = 0; i < 3; i++) diagonal2 += (c->hi[i] - c->lo[i]) * (c->hi[i] - c->lo[i]);
    return c->flux * (0.5 * sqrt(diagonal2) + CONE_REACH * b->reach * sin(0.5 * fmin(c->spread, PI)));
}

static cluster of_lamps(const builder *b, uint32_t first, uint32_t count) {
    cluster c = {.count = 0};
    for (uint32_t i = first; i < first + count; i++) {
        cluster one = of_lamp(&b->lamps[i]);
        join(&c, &one);
    }
    return c;
}

/* ---- splits ------------------------------------------------------------------------------------------------------ */

typedef struct {
    double origin[AXES], scale[AXES]; /* scale 0: all are equal */
} binning;

static int bin_of(const binning *b, const lamp *l, int axis) {
    int bin = (int)((l->key[axis] - b->origin[axis]) * b->scale[axis]);
    return bin < BINS - 1 ? bin : BINS - 1;
}

static binning bins_of(const builder *b, uint32_t first, uint32_t count) {
    binning bins;
    for (int a = 0; a < AXES; a++) {
        double low = INFINITY, high = -INFINITY;
        for (uint32_t i = first; i < first + count; i++) {
            low = fmin(low, b->lamps[i].key[a]);
            high = fmax(high, b->lamps[i].key[a]);
        }
        double scale = BINS * 0.999999 / (high - low);
        bins.origin[a] = low;
        bins.scale[a] = high > low && scale <= DBL_MAX ? scale : 0;
    }
    return bins;
}

/* How many of the lamps, sorted so that they come first, go to the left half; half of them where nothing parts them. */
static uint32_t split(builder *b, uint32_t first, uint32_t count, uint32_t depth) {
    binning bins = bins_of(b, first, count);
    double best = INFINITY;
    int best_axis = -1, best_bin = 0;
    for (int a = 0; a < AXES && depth < DEPTH_BINNED; a++) {
        cluster bin[BINS], left = {.count = 0}, right[BINS];
        if (bins.scale[a] == 0) continue;
        memset(bin, 0, sizeof bin);
        for (uint32_t i = first; i < first + count; i++) {
            cluster one = of_lamp(&b->lamps[i]);
            join(&bin[bin_of(&bins, &b->lamps[i], a)], &one);
        }
        right[BINS - 1] = bin[BINS - 1];
        for (int k = BINS - 2; k > 0; k--) {
            right[k] = right[k + 1];
            join(&right[k], &bin[k]);
        }
        for (int k = 0; k < BINS - 1; k++) {
            join(&left, &bin[k]);
            if (left.count == 0 || left.count == count) continue;
            double sum = cost(b, &left) + cost(b, &right[k + 1]);
            if (sum < best) best = sum, best_axis = a, best_bin = k;
        }
    }
    if (best_axis < 0) return count / 2;
    uint32_t i = first, j = first + count;
    while (i < j) {
        if (bin_of(&bins, &b->lamps[i], best_axis) <= best_bin) {
            i++;
        } else {
            lamp t = b->lamps[i];
            b->lamps[i] = b->lamps[--j];
            b->lamps[j] = t;
        }
    }
    return i - first;
}

/* ---- blocks ------------------------------------------------------------------------------------------------------ */

/* Around the lamps as kernels see them, and no tighter than float's rounding of the cluster's own numbers. */
static void store_cluster(const builder *b, b_light_block *block, uint32_t k, uint32_t first, const cluster *c) {
    double radius = 0, spread = 0, extent = 0, unit[3];
    float center[3], axis[3];
    for (int i = 0; i < 3; i++) {
        center[i] = (float)(0.5 * (c->lo[i] + c->hi[i]));
        axis[i] = (float)c->axis[i];
        unit[i] = axis[i];
    }
    brume_normalize(unit);
    for (uint32_t i = first; i < first + c->count; i++) {
        const lamp *l = &b->lamps[i];
        double off[3];
        for (int a = 0; a < 3; a++) {
            off[a] = l->key[a] - center[a];
            extent = fmax(extent, fabs(l->key[a]));
        }
        radius = fmax(radius, sqrt(brume_dot(off, off)));
        spread = fmax(spread, angle_between(unit, l->key + 3) + l->cutoff);
    }
    spread = fmin(spread * 1.000001 + 1e-6, PI);
    double s = sin(spread / 2);
    block->x[k] = center[0], block->y[k] = center[1], block->z[k] = center[2];
    block->axis_x[k] = axis[0], block->axis_y[k] = axis[1], block->axis_z[k] = axis[2];
    block->radius[k] = (float)(radius * 1.000001 + extent * 0x1p-20);
    block->versine[k] = (float)fmin(2 * s * s * 1.000001, 2);
    block->flux[k] = (float)(c->flux / b->flux);
    /* Lamps that are nothing beside the others can be all that there is close by. */
    if (c->flux > 0) block->flux[k] = fmaxf(block->flux[k], 1e-30f);
}

/* The first of `count` new ones, -1 where memory is short. */
static int add_blocks(builder *b, uint32_t count) {
    if (b->block_count + count > b->capacity) {
        uint32_t capacity = 2 * b->capacity + count;
        b_light_block *more = realloc(b->blocks, capacity * sizeof *more);
        if (!more) return -1;
        b->blocks = more;
        b->capacity = capacity;
    }
    memset(b->blocks + b->block_count, 0, count * sizeof *b->blocks);
    b->block_count += count;
    return (int)(b->block_count - count);
}

static int is_leaf(const cluster *c) {
    return c->count <= LIGHT_BLOCK || (c->count <= LIGHT_LEAF_BLOCKS * LIGHT_BLOCK && c->met <= LEAF_MET);
}

/* What the parent's child says of the leaf; 0 where memory is short. */
static int build_leaf(builder *b, uint32_t first, uint32_t count) {
    uint32_t blocks = (count + LIGHT_BLOCK - 1) / LIGHT_BLOCK;
    int at = add_blocks(b, blocks);
    if (at < 0) return 0;
    b->leaves++;
    for (uint32_t i = 0; i < count; i++) {
        b_light_block *block = &b->blocks[(uint32_t)at + i / LIGHT_BLOCK];
        cluster one = of_lamp(&b->lamps[first + i]);
        store_cluster(b, block, i % LIGHT_BLOCK, first + i, &one);
        block->child[i % LIGHT_BLOCK] = (int)(first + i);
    }
    return ~(at * LIGHT_LEAF_BLOCKS + (int)blocks - 1);
}

/* Returns its number, -1 where memory is short. */
static int build_block(builder *b, uint32_t first, uint32_t count, uint32_t depth) {
    uint32_t firsts[LIGHT_BLOCK] = {first}, used = 1;
    cluster parts[LIGHT_BLOCK];
    parts[0] = of_lamps(b, first, count);
    while (used < LIGHT_BLOCK) {
        int widest = -1;
        for (uint32_t k = 0; k < used; k++)
            if (!is_leaf(&parts[k]) && (widest < 0 || cost(b, &parts[k]) > cost(b, &parts[widest]))) widest = (int)k;
        if (widest < 0) break;
        uint32_t whole = parts[widest].count, left = split(b, firsts[widest], whole, depth);
        firsts[used] = firsts[widest] + left;
        parts[widest] = of_lamps(b, firsts[widest], left);
        parts[used] = of_lamps(b, firsts[used], whole - left);
        used++;
    }
    int at = add_blocks(b, 1);
    if (at < 0) return -1;
    for (uint32_t k = 0; k < used; k++) {
        int leaf = is_leaf(&parts[k]);
        uint32_t n = parts[k].count;
        int child = leaf ? build_leaf(b, firsts[k], n) : build_block(b, firsts[k], n, depth + 1);
        if (leaf ? child == 0 : child < 0) return -1;
        store_cluster(b, &b->blocks[at], k, firsts[k], &parts[k]);
        b->blocks[at].child[k] = child;
    }
    return at;
}

/* `placed` lamps of `lights`, those without a place left out. */
static void take_lamps(builder *b, const b_light *lights, uint32_t count) {
    uint32_t n = 0;
    double lo[3] = {INFINITY, INFINITY, INFINITY}, hi[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (uint32_t i = 0; i < count; i++) {
        const b_light *light = &lights[i];
        if (light->kind == LIGHT_DIRECTIONAL) continue;
        lamp *l = &b->lamps[n++];
        double axis[3] = {light->axis[0], light->axis[1], light->axis[2]};
        if (light->kind == LIGHT_POINT || !(brume_normalize(axis) > 0)) axis[0] = axis[1] = 0, axis[2] = 1;
        for (int a = 0; a < 3; a++) {
            l->key[a] = light->position[a];
            l->key[3 + a] = axis[a];
            lo[a] = fmin(lo[a], l->key[a]);
            hi[a] = fmax(hi[a], l->key[a]);
        }
        double luminance = 0.2126 * light->intensity[0] + 0.7152 * light->intensity[1] + 0.0722 * light->intensity[2];
        l->cutoff = light->kind == LIGHT_POINT ? PI : light->cutoff;
        l->flux = luminance * solid_angle(light);
        /* A line sees a lamp turn by half a circle: what passes a cone of a random axis. */
        l->met = l->cutoff < PI / 2 ? 0.5 * sin(l->cutoff) : 1;
        l->light = i;
        b->flux += l->flux;
    }
    for (int a = 0; a < 3; a++) b->reach = fmax(b->reach, hi[a] - lo[a]);
    if (!(b->flux > 0)) b->flux = 1;
}

/* Those of the tree in its order, then the others in theirs. */
static void sort_lights(const lamp *lamps, uint32_t placed, b_light *lights, uint32_t count, b_light *sorted) {
    for (uint32_t i = 0; i < placed; i++) sorted[i] = lights[lamps[i].light];
    for (uint32_t i = 0, n = placed; i < count; i++)
        if (lights[i].kind == LIGHT_DIRECTIONAL) sorted[n++] = lights[i];
    memcpy(lights, sorted, count * sizeof *lights);
}

brume_result brume_light_tree_build(brume_context *context, b_light *lights, uint32_t count, brume_light_tree *out) {
    builder b = {.capacity = 16 + count / 4};
    uint32_t placed = 0;
    memset(out, 0, sizeof *out);
    for (uint32_t i = 0; i < count; i++) placed += lights[i].kind != LIGHT_DIRECTIONAL;
    if (placed == 0) return BRUME_OK;
    if (placed > INT32_MAX / LIGHT_LEAF_BLOCKS)
        return brume_fail(context, BRUME_ERROR_SCENE, "%u lamps are more than a tree can hold", (unsigned)placed);
    b.lamps = malloc(placed * sizeof *b.lamps);
    b.blocks = malloc(b.capacity * sizeof *b.blocks);
    b_light *sorted = malloc(count * sizeof *sorted);
    int root = -1;
    if (b.lamps && b.blocks && sorted) {
        take_lamps(&b, lights, count);
        root = build_block(&b, 0, placed, 0);
    }
    if (root == 0) {
        sort_lights(b.lamps, placed, lights, count, sorted);
        out->blocks = b.blocks;
        out->block_count = b.block_count;
        out->leaves = b.leaves;
        out->placed = placed;
        out->flux = b.flux;
    } else {
        free(b.blocks);
    }
    free(b.lamps);
    free(sorted);
    return root == 0 ? BRUME_OK
                     : brume_fail(context, BRUME_ERROR_MEMORY, "no memory for the tree of %u lamps", (unsigned)placed);
}

float brume_light_tree_scale(const brume_light_tree *tree) {
    return (float)fmin(fmax(1 / tree->flux, 1e-30), 1e30);
}

void brume_light_tree_free(brume_light_tree *tree) {
    free(tree->blocks);
    memset(tree, 0, sizeof *tree);
}

/* bvh_top.c -- the binary tree by several threads: the same as by one.
 *
 * Ranges of many items are parted level by level, all threads on each, in pieces, whose bins are joined; then the
 * threads take the smaller ranges for themselves. Parting keeps the items' order and joining is exact, so neither the
 * number of threads nor where the pieces end changes anything.
 */
#include "bvh_bins.h"
#include "bvh_split.h"
#include "parallel.h"

#include <stdlib.h>
#include <string.h>

enum { PIECE = 16384, LEAST = 8192 };

/* A range: parted already, to be grown by one thread, or to be parted. */
typedef struct part {
    brume_bvh_range range;
    brume_bvh_forest forest;
    uint32_t left;          /* where in the list its left part is, the right one is next; 0: it has none */
    int parted, whole;      /* it has pieces; it has none, because nothing parts it */
    brume_binning binning;
    brume_split split;
} part;

typedef struct piece {
    uint32_t part, first, count;
    uint32_t to[2];         /* where its items go, left and right: places in the other array */
    uint32_t left_quadrics;
    brume_bounds centers[2];
    brume_bins bins;
} piece;

typedef struct top {
    brume_bvh_splitter *s;
    part *parts;
    uint32_t count, room;
    piece *pieces;
    uint32_t piece_count, piece_room;
    uint32_t most; /* items that a thread takes for itself */
} top;

/* Makes room for `more` after `count`; 0 when memory ran out. */
static int reserve(void **list, uint32_t *room, uint32_t count, uint32_t more, size_t size) {
    if (more <= *room - count) return 1;
    uint32_t wanted = 2 * (count + more);
    void *grown = realloc(*list, wanted * size);
    if (!grown) return 0;
    *list = grown;
    *room = wanted;
    return 1;
}

static int add_pieces(top *t, uint32_t number) {
    const part *p = &t->parts[number];
    uint32_t count = (p->range.count + PIECE - 1) / PIECE;
    if (!reserve((void **)&t->pieces, &t->piece_room, t->piece_count, count, sizeof *t->pieces)) return 0;
    for (uint32_t k = 0; k < count; k++) {
        piece *q = &t->pieces[t->piece_count++];
        uint32_t left = p->range.count - k * PIECE;
        q->part = number;
        q->first = p->range.first + k * PIECE;
        q->count = left < PIECE ? left : PIECE;
    }
    return 1;
}

static void bin_piece(void *user, uint32_t i) {
    top *t = user;
    piece *q = &t->pieces[i];
    const part *p = &t->parts[q->part];
    brume_bins_clear(&q->bins, &p->binning);
    brume_bins_add(&q->bins, &p->binning, t->s->items[p->range.side] + q->first, q->count);
}

static void part_piece(void *user, uint32_t i) {
    top *t = user;
    piece *q = &t->pieces[i];
    const part *p = &t->parts[q->part];
    if (p->whole) return;
    brume_bvh_item *to = t->s->items[!p->range.side];
    q->centers[0] = q->centers[1] = brume_bounds_empty();
    brume_bvh_partition(t->s->items[p->range.side] + q->first, q->count, &p->binning, &p->split, to + q->to[0],
                        to + q->to[1], q->centers);
    uint32_t left = brume_bins_left(&q->bins, &p->split);
    q->left_quadrics = p->range.quadrics ? brume_bvh_quadrics(t->s->tree, to + q->to[0], left) : 0;
}

/* From the first of its pieces on: where to part the range, and where the pieces' items go. Returns the next part's
 * first piece. */
static uint32_t choose(top *t, uint32_t first) {
    part *p = &t->parts[t->pieces[first].part];
    brume_bins all = t->pieces[first].bins;
    uint32_t end = first + 1;
    while (end < t->piece_count && t->pieces[end].part == t->pieces[first].part)
        brume_bins_join(&all, &t->pieces[end++].bins);
    p->parted = 1;
    p->whole = !brume_bins_split(&all, &p->split);
    if (p->whole) return end;
    uint32_t to[2] = {p->range.first, p->range.first + p->split.left};
    for (uint32_t k = first; k < end; k++) {
        piece *q = &t->pieces[k];
        uint32_t left = brume_bins_left(&q->bins, &p->split);
        q->to[0] = to[0], q->to[1] = to[1];
        to[0] += left, to[1] += q->count - left;
    }
    return end;
}

/* Adds the two parts of a range; 0 when memory ran out. */
static int add_parts(top *t, brume_bvh_arena *arena, uint32_t first, uint32_t end) {
    uint32_t number = t->pieces[first].part, quadrics = 0;
    brume_bounds centers[2] = {brume_bounds_empty(), brume_bounds_empty()};
    brume_bvh_range child[2];
    if (t->parts[number].whole) return 1;
    if (!reserve((void **)&t->parts, &t->room, t->count, 2, sizeof *t->parts)) return 0;
    part *p = &t->parts[number];
    for (uint32_t k = first; k < end; k++) {
        for (int c = 0; c < 2; c++) brume_bounds_join(&centers[c], &t->pieces[k].centers[c]);
        quadrics += t->pieces[k].left_quadrics;
    }
    uint32_t pair = brume_bvh_take_pair(t->s, arena);
    if (pair == 0) return 0;
    brume_bvh_at(t->s->tree, p->range.node)->children = pair;
    brume_bvh_children_of(&p->range, p->split.left, quadrics, child);
    p->left = t->count;
    for (uint32_t c = 0; c < 2; c++) {
        part *q = &t->parts[t->count++];
        memset(q, 0, sizeof *q);
        q->range = child[c];
        q->range.node = pair + c;
        q->range.side = !p->range.side;
        q->range.centers = centers[c];
        brume_bvh_start_node(t->s, &q->range, &p->split.box[c]);
    }
    return 1;
}

/* Parts ranges until all are small, or can't be parted; 0 when memory ran out. */
static int part_all(top *t, brume_bvh_arena *arena) {
    uint32_t threads = t->s->tree->threads;
    for (uint32_t from = 0, to = t->count; from < to; from = to, to = t->count) {
        t->piece_count = 0;
        for (uint32_t i = from; i < to; i++) {
            part *p = &t->parts[i];
            if (p->range.count <= t->most || p->range.depth >= BVH_DEPTH_SAH) continue;
            p->binning = brume_bvh_binning(&p->range.centers, p->range.count);
            if (!add_pieces(t, i)) return 0;
        }
        brume_parallel(threads, t->piece_count, bin_piece, t);
        for (uint32_t k = 0; k < t->piece_count;) k = choose(t, k);
        brume_parallel(threads, t->piece_count, part_piece, t);
        for (uint32_t k = 0, end; k < t->piece_count; k = end) {
            for (end = k + 1; end < t->piece_count && t->pieces[end].part == t->pieces[k].part;) end++;
            if (!add_parts(t, arena, k, end)) return 0;
        }
    }
    return 1;
}

static void grow_part(void *user, uint32_t i) {
    top *t = user;
    part *p = &t->parts[i];
    brume_bvh_arena arena = {0, 0, 2 * p->range.count};
    if (p->left == 0) brume_bvh_grow(t->s, &arena, &p->range, &p->forest);
}

int brume_bvh_grow_threaded(brume_bvh_splitter *s, brume_bvh_arena *arena, const brume_bvh_range *root) {
    brume_bvh_tree *tree = s->tree;
    top t = {.s = s};
    int done = 0;
    t.most = tree->item_count / (8 * tree->threads);
    t.most = t.most > LEAST ? t.most : LEAST;
    if (!reserve((void **)&t.parts, &t.room, 0, 64, sizeof *t.parts)) return 0;
    memset(&t.parts[0], 0, sizeof t.parts[0]);
    t.parts[0].range = *root;
    t.count = 1;
    if (!part_all(&t, arena)) goto cleanup;
    /* A chunk more for each, which may stay unfilled. */
    uint32_t room = tree->chunk_room + t.count;
    brume_bvh_binary **chunks = realloc(tree->chunks, room * sizeof *chunks);
    if (!chunks) goto cleanup;
    memset(chunks + tree->chunk_room, 0, t.count * sizeof *chunks);
    tree->chunks = chunks;
    tree->chunk_room = room;
    brume_parallel(tree->threads, t.count, grow_part, &t);
    if (s->failed) goto cleanup;
    for (uint32_t i = t.count; i-- > 0;) {
        part *p = &t.parts[i];
        if (p->left)
            brume_bvh_plan(brume_bvh_at(tree, p->range.node), &t.parts[p->left].forest, &t.parts[p->left + 1].forest,
                           s->unit, &p->forest);
    }
    done = 1;

cleanup:
    free(t.parts);
    free(t.pieces);
    return done;
}

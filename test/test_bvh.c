/* test_bvh.c -- the hierarchy's structure: nothing lost or doubled, boxes that contain, bounds of depth and stack. */
#include <float.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "bvh.h"
#include "meshes.h"

/* A box's child must lie in it; a leaf's vertices too. Returns the stack that a walk below needs. */
typedef struct checker {
    const brume_bvh *bvh;
    const test_mesh *mesh;
    uint8_t *seen;         /* per primitive */
    uint8_t *visited;      /* per node */
    uint32_t depth;
} checker;

static void assert_inside(const b_node *n, int k, const double lo[3], const double hi[3]) {
    assert_true(n->lo_x[k] <= lo[0] && n->lo_y[k] <= lo[1] && n->lo_z[k] <= lo[2]);
    assert_true(n->hi_x[k] >= hi[0] && n->hi_y[k] >= hi[1] && n->hi_z[k] >= hi[2]);
}

static void check_prim(const checker *c, const b_node *n, int k, uint32_t prim) {
    double lo[3], hi[3];
    assert_true(prim < c->mesh->triangle_count + c->mesh->quadric_count);
    assert_false(c->seen[prim]);
    c->seen[prim] = 1;
    for (int a = 0; a < 3; a++) {
        lo[a] = INFINITY, hi[a] = -INFINITY;
        if (prim < c->mesh->triangle_count) {
            for (int i = 0; i < 3; i++) {
                double x = c->mesh->positions[3 * c->mesh->triangles[prim].v[i] + a];
                lo[a] = fmin(lo[a], x), hi[a] = fmax(hi[a], x);
            }
        } else { /* points of the surface, not the builder's formula */
            const b_quadric *q = &c->mesh->quadrics[prim - c->mesh->triangle_count];
            for (int i = 0; i < 1000; i++) {
                double s = i * (6.283185307179586 / 1000);
                double x = q->kind == QUADRIC_DISK ? q->center[a] + cos(s) * q->du[a] + sin(s) * q->dv[a]
                                                   : q->center[a] + cos(s) * (double)q->radius;
                lo[a] = fmin(lo[a], x), hi[a] = fmax(hi[a], x);
            }
        }
    }
    assert_inside(n, k, lo, hi);
}

static void check_leaf(const checker *c, const b_node *n, int k) {
    uint32_t code = ~(uint32_t)n->child[k], first = code >> 4, count = (code & 7) + 1;
    int ended = 0;
    if (code & 8) {
        assert_true(first + count <= c->bvh->quadric_block_count);
        for (uint32_t i = 8 * first; i < 8 * (first + count); i++) {
            int32_t id = c->bvh->quadric_ids[i];
            assert_true(i > 8 * first || id >= 0);
            ended |= id < 0;
            if (ended) assert_int_equal(id, -1);
            else check_prim(c, n, k, c->mesh->triangle_count + (uint32_t)id);
        }
        return;
    }
    assert_true(first + count <= c->bvh->block_count);
    assert_true(count <= 4);
    for (uint32_t i = 8 * first; i < 8 * (first + count); i++) {
        const b_triangle_block *b = &c->bvh->blocks[i / 8];
        int32_t prim = b->prim[i % 8];
        ended |= prim < 0;
        for (int a = 0; a < 3; a++) {
            if (ended) {
                assert_int_equal(prim, -1);
                assert_true(isnan(b->v0[a][i % 8]) && isnan(b->v1[a][i % 8]) && isnan(b->v2[a][i % 8]));
            } else {
                const int *v = c->mesh->triangles[prim].v;
                assert_true(b->v0[a][i % 8] == c->mesh->positions[3 * v[0] + a]);
                assert_true(b->v1[a][i % 8] == c->mesh->positions[3 * v[1] + a]);
                assert_true(b->v2[a][i % 8] == c->mesh->positions[3 * v[2] + a]);
            }
        }
        if (!ended) check_prim(c, n, k, (uint32_t)prim);
    }
}

static uint32_t check_node(checker *c, uint32_t number, uint32_t level) {
    const b_node *n = &c->bvh->nodes[number];
    uint32_t children = 0, below = 0;
    assert_true(number < c->bvh->node_count);
    assert_false(c->visited[number]);
    c->visited[number] = 1;
    c->depth = level > c->depth ? level : c->depth;
    for (int k = 0; k < 8; k++) {
        if (n->lo_x[k] > n->hi_x[k]) {
            assert_true(n->lo_x[k] == 1e30f && n->hi_z[k] == -1e30f);
            continue;
        }
        assert_true(children == (uint32_t)k);
        children++;
        if (n->child[k] < 0) {
            check_leaf(c, n, k);
            continue;
        }
        const b_node *m = &c->bvh->nodes[n->child[k]];
        for (int i = 0; i < 8 && m->lo_x[i] <= m->hi_x[i]; i++) {
            double lo[3] = {m->lo_x[i], m->lo_y[i], m->lo_z[i]}, hi[3] = {m->hi_x[i], m->hi_y[i], m->hi_z[i]};
            assert_inside(n, k, lo, hi);
        }
        uint32_t need = check_node(c, (uint32_t)n->child[k], level + 1);
        below = need > below ? need : below;
    }
    return below + children - (below > 0);
}

static void check(const test_mesh *mesh) {
    brume_bvh bvh, again;
    uint32_t prims = mesh->triangle_count + mesh->quadric_count;
    assert_int_equal(brume_bvh_build(NULL, mesh->positions, mesh->triangles, mesh->triangle_count, mesh->quadrics,
                                     mesh->quadric_count, &bvh), BRUME_OK);
    checker c = {&bvh, mesh, calloc(prims + 1, 1), calloc(bvh.node_count, 1), 0};
    uint32_t stack = check_node(&c, 0, 1);
    for (uint32_t i = 0; i < prims; i++) assert_true(c.seen[i]);
    for (uint32_t i = 0; i < bvh.node_count; i++) assert_true(c.visited[i]);
    assert_int_equal(c.depth, bvh.depth);
    assert_true(bvh.depth <= 98);
    assert_int_equal(bvh.stack_size, stack > 0 ? stack : 1);
    assert_true(bvh.stack_size <= 7 * bvh.depth + 1);

    assert_int_equal(brume_bvh_build(NULL, mesh->positions, mesh->triangles, mesh->triangle_count, mesh->quadrics,
                                     mesh->quadric_count, &again), BRUME_OK);
    assert_int_equal(bvh.node_count, again.node_count);
    assert_int_equal(bvh.block_count, again.block_count);
    assert_memory_equal(bvh.nodes, again.nodes, bvh.node_count * sizeof *bvh.nodes);
    if (bvh.block_count) assert_memory_equal(bvh.blocks, again.blocks, bvh.block_count * sizeof *bvh.blocks);
    if (bvh.quadric_block_count)
        assert_memory_equal(bvh.quadric_ids, again.quadric_ids, bvh.quadric_block_count * 8 * sizeof *bvh.quadric_ids);
    free(c.seen);
    free(c.visited);
    brume_bvh_free(&bvh);
    brume_bvh_free(&again);
}

static void check_and_free(test_mesh mesh) {
    check(&mesh);
    test_mesh_free(&mesh);
}

static void test_ordinary(void **state) {
    (void)state;
    check_and_free(test_mesh_soup(20000, 1, 0.05, 1));
    check_and_free(test_mesh_sphere(64, 64, 0.3));
    check_and_free(test_mesh_terrain(64));
    check_and_free(test_mesh_slivers(5000));
}

static void test_small(void **state) {
    (void)state;
    for (uint32_t n = 0; n <= 40; n++) check_and_free(test_mesh_soup(n, 1, 0.3, n));
}

static void test_identical(void **state) {
    (void)state;
    test_mesh m = test_mesh_soup(1, 1, 1, 5);
    b_triangle t = m.triangles[0];
    free(m.triangles);
    m.triangle_count = 1000000;
    m.triangles = malloc(m.triangle_count * sizeof t);
    for (uint32_t i = 0; i < m.triangle_count; i++) m.triangles[i] = t;
    check_and_free(m);
}

/* Concentric triangles of growing size: all centres equal. */
static void test_equal_centers(void **state) {
    (void)state;
    test_mesh m = test_mesh_soup(3000, 1, 1, 6);
    for (uint32_t i = 0; i < 3000; i++) {
        float r = 1 + (float)i;
        float p[9] = {-r, -r, 0, r, -r, 0, 0, r, 0};
        memcpy(m.positions + 9 * i, p, sizeof p);
    }
    check_and_free(m);
}

static void test_scales(void **state) {
    (void)state;
    for (int e = -20; e <= 20; e += 5) {
        check_and_free(test_mesh_soup(3000, pow(10, e), 0.1 * pow(10, e), 7));
        test_mesh m = test_mesh_soup(3000, 1, 0.001, 8);
        for (uint32_t i = 0; i < 9 * 3000; i++) m.positions[i] += (float)pow(10, e);
        check_and_free(m);
    }
    /* All scales in one scene: the heuristic peels off one size after the other, which makes the deepest trees. */
    test_mesh m = test_mesh_soup(20000, 1, 0.1, 9);
    for (uint32_t i = 0; i < 20000; i++)
        for (int k = 0; k < 9; k++) m.positions[9 * i + k] *= (float)pow(10, -20 + 40.0 * i / 20000);
    check_and_free(m);
}

static void test_flat(void **state) {
    (void)state;
    for (int axis = 0; axis < 3; axis++) {
        test_mesh m = test_mesh_soup(3000, 1, 0.1, 10);
        for (uint32_t i = 0; i < 9000; i++) m.positions[3 * i + axis] = 0.25f;
        check_and_free(m);
    }
    test_mesh m = test_mesh_soup(100, 0, 0, 11); /* points at 0 */
    check_and_free(m);
}

static void test_quadrics(void **state) {
    (void)state;
    check_and_free(test_mesh_quadrics(1, 12));
    check_and_free(test_mesh_quadrics(700, 13));
    for (uint32_t n = 1; n < 40; n += 3) {
        test_mesh m = test_mesh_quadrics(n, 14), soup = test_mesh_soup(2 * n, 1, 0.2, 15);
        free(m.positions);
        free(m.triangles);
        m.positions = soup.positions, m.triangles = soup.triangles, m.triangle_count = soup.triangle_count;
        check(&m);
        for (uint32_t i = 0; i < n; i++) /* kinds mixed at one place */
            for (int a = 0; a < 3; a++) m.quadrics[i].center[a] = 0;
        for (uint32_t i = 0; i < 2 * n; i++) {
            float p[9] = {-1, -1, 0, 1, -1, 0, 0, 1, 0};
            memcpy(m.positions + 9 * i, p, sizeof p);
        }
        check_and_free(m);
    }
}

/* ---- how good it is --------------------------------------------------------------------------------------------- */

static double slot_area(const b_node *n, int k) {
    double x = (double)n->hi_x[k] - n->lo_x[k], y = (double)n->hi_y[k] - n->lo_y[k];
    double z = (double)n->hi_z[k] - n->lo_z[k];
    return x * y + y * z + z * x;
}

/* Nodes and blocks that a ray through the scene visits, by the surface area heuristic. */
static double expected_cost(const brume_bvh *bvh, double area) {
    double sum = 1;
    for (uint32_t n = 0; n < bvh->node_count; n++)
        for (int k = 0; k < 8 && bvh->nodes[n].lo_x[k] <= bvh->nodes[n].hi_x[k]; k++)
            sum += slot_area(&bvh->nodes[n], k) / area *
                   (bvh->nodes[n].child[k] < 0 ? (~bvh->nodes[n].child[k] & 7) + 1 : 1);
    return sum;
}

/* A flat square, which each level of a perfect hierarchy tiles once: log8 of the number of blocks are its levels of
 * nodes, and the blocks come on top. */
static void test_cost_of_a_square(void **state) {
    (void)state;
    for (uint32_t cells = 16; cells <= 256; cells *= 2) {
        test_mesh m = test_mesh_terrain(cells);
        brume_bvh bvh;
        uint64_t seed = cells;
        for (uint32_t i = 0; i < m.vertex_count; i++) m.positions[3 * i + 2] = 0;
        for (uint32_t i = m.triangle_count - 1; i > 0; i--) { /* in no order */
            uint32_t k = (uint32_t)(test_uniform(&seed) * (i + 1));
            b_triangle t = m.triangles[i];
            m.triangles[i] = m.triangles[k];
            m.triangles[k] = t;
        }
        assert_int_equal(brume_bvh_build(NULL, m.positions, m.triangles, m.triangle_count, NULL, 0, &bvh), BRUME_OK);
        double perfect = 1 + log(m.triangle_count / 8.0) / log(8), cost = expected_cost(&bvh, 4);
        print_message("%u triangles: cost %.3f, perfect %.3f\n", m.triangle_count, cost, perfect);
        assert_true(cost > 0.99 * perfect);
        assert_true(cost < 1.07 * perfect);
        brume_bvh_free(&bvh);
        test_mesh_free(&m);
    }
}

static void test_too_many(void **state) {
    (void)state;
    brume_bvh bvh;
    assert_int_equal(brume_bvh_build(NULL, NULL, NULL, (1u << 27) + 1, NULL, 0, &bvh), BRUME_ERROR_SCENE);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_ordinary),      cmocka_unit_test(test_small),   cmocka_unit_test(test_identical),
        cmocka_unit_test(test_equal_centers), cmocka_unit_test(test_scales),  cmocka_unit_test(test_flat),
        cmocka_unit_test(test_quadrics),      cmocka_unit_test(test_too_many),
        cmocka_unit_test(test_cost_of_a_square),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

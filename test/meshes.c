/* meshes.c -- see meshes.h. */
#include "meshes.h"

#include <math.h>
#include <stdlib.h>

double test_uniform(uint64_t *state) {
    uint64_t z = (*state += UINT64_C(0x9e3779b97f4a7c15)); /* splitmix64 */
    z = (z ^ (z >> 30)) * UINT64_C(0xbf58476d1ce4e5b9);
    z = (z ^ (z >> 27)) * UINT64_C(0x94d049bb133111eb);
    return (double)((z ^ (z >> 31)) >> 11) * 0x1p-53;
}

static double symmetric(uint64_t *state) {
    return 2 * test_uniform(state) - 1;
}

static test_mesh allocate(uint32_t vertices, uint32_t triangles) {
    test_mesh m = {0};
    m.positions = calloc(3 * (size_t)vertices + 1, sizeof *m.positions);
    m.triangles = calloc((size_t)triangles + 1, sizeof *m.triangles);
    m.vertex_count = vertices;
    m.triangle_count = triangles;
    if (!m.positions || !m.triangles) abort();
    return m;
}

static void set_triangle(test_mesh *m, uint32_t at, uint32_t a, uint32_t b, uint32_t c) {
    m->triangles[at].v[0] = (int)a;
    m->triangles[at].v[1] = (int)b;
    m->triangles[at].v[2] = (int)c;
}

test_mesh test_mesh_soup(uint32_t count, double spread, double size, uint64_t seed) {
    test_mesh m = allocate(3 * count, count);
    for (uint32_t i = 0; i < count; i++) {
        double center[3];
        for (int a = 0; a < 3; a++) center[a] = spread * symmetric(&seed);
        for (int k = 0; k < 9; k++) m.positions[9 * (size_t)i + k] = (float)(center[k % 3] + size * symmetric(&seed));
        set_triangle(&m, i, 3 * i, 3 * i + 1, 3 * i + 2);
    }
    return m;
}

test_mesh test_mesh_sphere(uint32_t rings, uint32_t sectors, double bumps) {
    test_mesh m = allocate((rings - 1) * sectors + 2, 2 * sectors * (rings - 1));
    uint32_t south = m.vertex_count - 1, used = 0, n = 1;
    m.positions[2] = 1;
    for (uint32_t i = 1; i < rings; i++)
        for (uint32_t j = 0; j < sectors; j++, n++) {
            double theta = 3.141592653589793 * i / rings, phi = 6.283185307179586 * j / sectors;
            double r = 1 + bumps * sin(5 * theta) * cos(7 * phi);
            m.positions[3 * n] = (float)(r * sin(theta) * cos(phi));
            m.positions[3 * n + 1] = (float)(r * sin(theta) * sin(phi));
            m.positions[3 * n + 2] = (float)(r * cos(theta));
        }
    m.positions[3 * south + 2] = -1;
    for (uint32_t j = 0; j < sectors; j++) {
        uint32_t next = (j + 1) % sectors, last = 1 + (rings - 2) * sectors;
        set_triangle(&m, used++, 0, 1 + j, 1 + next);
        set_triangle(&m, used++, south, last + next, last + j);
        for (uint32_t i = 0; i + 2 < rings; i++) {
            uint32_t a = 1 + i * sectors + j, b = 1 + i * sectors + next, c = a + sectors, d = b + sectors;
            set_triangle(&m, used++, a, c, b);
            set_triangle(&m, used++, b, c, d);
        }
    }
    return m;
}

/* The middle of an edge, pushed out onto the sphere: the same vertex for both of its triangles. */
static uint32_t middle_of(test_mesh *m, uint32_t (*edges)[3], uint32_t *edge_count, uint32_t a, uint32_t b) {
    uint32_t low = a < b ? a : b, high = a < b ? b : a;
    for (uint32_t i = 0; i < *edge_count; i++)
        if (edges[i][0] == low && edges[i][1] == high) return edges[i][2];
    double p[3], r2 = 0;
    for (int k = 0; k < 3; k++) {
        p[k] = (double)m->positions[3 * a + k] + m->positions[3 * b + k];
        r2 += p[k] * p[k];
    }
    for (int k = 0; k < 3; k++) m->positions[3 * m->vertex_count + k] = (float)(p[k] / sqrt(r2));
    edges[*edge_count][0] = low;
    edges[*edge_count][1] = high;
    return edges[(*edge_count)++][2] = m->vertex_count++;
}

test_mesh test_mesh_icosphere(uint32_t levels) {
    static const int faces[20][3] = {{0, 11, 5}, {0, 5, 1}, {0, 1, 7}, {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
                                     {11, 10, 2}, {10, 7, 6}, {7, 1, 8}, {3, 9, 4}, {3, 4, 2}, {3, 2, 6}, {3, 6, 8},
                                     {3, 8, 9}, {4, 9, 5}, {2, 4, 11}, {6, 2, 10}, {8, 6, 7}, {9, 8, 1}};
    const double one = 0.5257311121191336, golden = 0.8506508083520399;
    uint32_t most = 20u << (2 * levels);
    test_mesh m = allocate(most / 2 + 2, most);
    uint32_t(*edges)[3] = malloc((3 * (size_t)most / 8 + 1) * sizeof *edges);
    if (!edges) abort();
    for (int i = 0; i < 12; i++) { /* (+-one, +-golden, 0) and its rotations */
        int turn = i / 4;
        m.positions[3 * i + turn] = (float)(i % 2 ? one : -one);
        m.positions[3 * i + (turn + 1) % 3] = (float)(i % 4 < 2 ? golden : -golden);
    }
    for (uint32_t i = 0; i < 20; i++)
        set_triangle(&m, i, (uint32_t)faces[i][0], (uint32_t)faces[i][1], (uint32_t)faces[i][2]);
    m.vertex_count = 12;
    m.triangle_count = 20;
    for (uint32_t level = 0; level < levels; level++) {
        uint32_t edge_count = 0, count = m.triangle_count;
        for (uint32_t i = 0; i < count; i++) {
            const int *v = m.triangles[i].v;
            uint32_t a = (uint32_t)v[0], b = (uint32_t)v[1], c = (uint32_t)v[2];
            uint32_t ab = middle_of(&m, edges, &edge_count, a, b), bc = middle_of(&m, edges, &edge_count, b, c);
            uint32_t ca = middle_of(&m, edges, &edge_count, c, a), at = m.triangle_count;
            set_triangle(&m, i, ab, bc, ca);
            set_triangle(&m, at, a, ab, ca);
            set_triangle(&m, at + 1, b, bc, ab);
            set_triangle(&m, at + 2, c, ca, bc);
            m.triangle_count += 3;
        }
    }
    free(edges);
    return m;
}

test_mesh test_mesh_terrain(uint32_t cells) {
    test_mesh m = allocate((cells + 1) * (cells + 1), 2 * cells * cells);
    uint64_t seed = 77;
    uint32_t used = 0;
    for (uint32_t i = 0; i < m.vertex_count; i++) {
        m.positions[3 * i] = -1 + 2 * (float)(i % (cells + 1)) / (float)cells;
        m.positions[3 * i + 1] = -1 + 2 * (float)(i / (cells + 1)) / (float)cells;
        m.positions[3 * i + 2] = (float)(0.1 * symmetric(&seed));
    }
    for (uint32_t y = 0; y < cells; y++)
        for (uint32_t x = 0; x < cells; x++) {
            uint32_t a = y * (cells + 1) + x, b = a + 1, c = a + cells + 1, d = c + 1;
            set_triangle(&m, used++, a, b, c);
            set_triangle(&m, used++, b, d, c);
        }
    return m;
}

test_mesh test_mesh_slivers(uint32_t count) {
    test_mesh m = test_mesh_soup(count, 1, 0.5, 21);
    uint64_t seed = 22;
    for (uint32_t i = 0; i < count; i++) {
        float *p = m.positions + 9 * (size_t)i;
        double aspect = pow(10, -6 * test_uniform(&seed)), along = symmetric(&seed);
        for (int a = 0; a < 3; a++) /* the third corner near the line through the others */
            p[6 + a] = (float)(p[a] + along * (p[3 + a] - p[a]) + aspect * (p[6 + a] - p[a]));
    }
    return m;
}

/* The squares of a side lie alike, so the triangles' edges meet across all sides. */
test_mesh test_mesh_cube(uint32_t cells) {
    test_mesh m = allocate(36 * cells * cells, 12 * cells * cells);
    static const int corners[6][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 0}, {1, 1}, {0, 1}};
    uint32_t n = 0;
    for (int side = 0; side < 6; side++)
        for (uint32_t i = 0; i < cells * cells; i++)
            for (int k = 0; k < 6; k++, n++) {
                int axis = side / 2, u = (axis + 1) % 3, v = (axis + 2) % 3;
                uint32_t a = i % cells + (uint32_t)corners[k][0], b = i / cells + (uint32_t)corners[k][1];
                m.positions[3 * n + axis] = side % 2 ? 1 : -1;
                m.positions[3 * n + u] = -1 + 2 * (float)a / (float)cells;
                m.positions[3 * n + v] = -1 + 2 * (float)b / (float)cells;
            }
    for (uint32_t i = 0; i < m.triangle_count; i++) set_triangle(&m, i, 3 * i, 3 * i + 1, 3 * i + 2);
    return m;
}

test_mesh test_mesh_slats(uint32_t count) {
    test_mesh m = allocate(4 * count, 2 * count);
    for (uint32_t i = 0; i < count; i++) {
        double x = -1 + 2 * (i + 0.5) / count, width = 0.4 / count;
        for (uint32_t k = 0; k < 4; k++) {
            m.positions[3 * (4 * i + k)] = (float)(x + (k % 2 ? width : -width));
            m.positions[3 * (4 * i + k) + 1] = k < 2 ? -1 : 1;
            m.positions[3 * (4 * i + k) + 2] = (float)(0.3 * (k % 2 ? width : -width));
        }
        set_triangle(&m, 2 * i, 4 * i, 4 * i + 1, 4 * i + 2);
        set_triangle(&m, 2 * i + 1, 4 * i + 1, 4 * i + 3, 4 * i + 2);
    }
    return m;
}

test_mesh test_mesh_cones(uint32_t count, uint64_t seed) {
    enum { SIDES = 12 };
    test_mesh m = allocate((SIDES + 2) * count, 2 * SIDES * count);
    for (uint32_t i = 0; i < count; i++) {
        uint32_t foot = (SIDES + 2) * i, top = foot + 1;
        double x = symmetric(&seed), z = symmetric(&seed), height = 0.5 + test_uniform(&seed), r = 0.2 * height;
        float *p = m.positions + 3 * (size_t)foot;
        p[0] = p[3] = (float)x;
        p[1] = -1;
        p[4] = (float)(height - 1);
        p[2] = p[5] = (float)z;
        for (uint32_t k = 0; k < SIDES; k++) {
            double phi = 6.283185307179586 * k / SIDES;
            p[6 + 3 * k] = (float)(x + r * cos(phi));
            p[7 + 3 * k] = -1;
            p[8 + 3 * k] = (float)(z + r * sin(phi));
            set_triangle(&m, 2 * SIDES * i + 2 * k, top, top + 1 + (k + 1) % SIDES, top + 1 + k);
            set_triangle(&m, 2 * SIDES * i + 2 * k + 1, foot, top + 1 + k, top + 1 + (k + 1) % SIDES);
        }
    }
    return m;
}

test_mesh test_mesh_quadrics(uint32_t count, uint64_t seed) {
    test_mesh m = allocate(0, 0);
    m.quadrics = calloc((size_t)count + 1, sizeof *m.quadrics);
    if (!m.quadrics) abort();
    m.quadric_count = count;
    for (uint32_t i = 0; i < count; i++) {
        b_quadric *q = &m.quadrics[i];
        double x[3], y[3], xx = 0, xy = 0, yy = 0, size = 0.5 * pow(10, -3 * test_uniform(&seed));
        double stretch = 0.1 + test_uniform(&seed);
        for (int a = 0; a < 3; a++) {
            q->center[a] = (float)symmetric(&seed);
            x[a] = symmetric(&seed);
            y[a] = symmetric(&seed);
            xx += x[a] * x[a];
        }
        for (int a = 0; a < 3; a++) xy += x[a] * y[a] / xx;
        for (int a = 0; a < 3; a++) y[a] -= xy * x[a], yy += y[a] * y[a];
        q->kind = i % 2 ? QUADRIC_DISK : QUADRIC_SPHERE;
        q->radius = (float)size;
        for (int a = 0; a < 3; a++) {
            int j = (a + 1) % 3, k = (a + 2) % 3;
            double unit = q->kind == QUADRIC_DISK ? size : 1;
            q->du[a] = (float)(x[a] / sqrt(xx) * unit);
            q->dv[a] = (float)(y[a] / sqrt(yy) * unit * (q->kind == QUADRIC_DISK ? stretch : 1));
            q->n[a] = (float)((x[j] * y[k] - x[k] * y[j]) / sqrt(xx * yy));
        }
    }
    return m;
}

void test_mesh_free(test_mesh *mesh) {
    free(mesh->positions);
    free(mesh->triangles);
    free(mesh->quadrics);
}

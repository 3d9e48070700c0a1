/* traversal_meshes.c -- see traversal_meshes.h. */
#include "traversal_meshes.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { RINGS = 16, SECTORS = 32, WALL = 40 };

#define TAU 6.283185307179586

double traversal_uniform(uint64_t *state) {
    uint64_t z = *state += 0x9e3779b97f4a7c15u;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return (double)((z ^ (z >> 31)) >> 11) * 0x1p-53;
}

static traversal_mesh allocate(const char *name, size_t vertices, size_t triangles) {
    traversal_mesh m = {.name = name};
    m.positions = malloc((vertices * 3 + 1) * sizeof *m.positions); /* Embree reads the last with 16 bytes */
    m.triangles = malloc(triangles * sizeof *m.triangles);
    if (!m.positions || !m.triangles) traversal_mesh_free(&m);
    return m;
}

void traversal_mesh_free(traversal_mesh *mesh) {
    free(mesh->positions);
    free(mesh->triangles);
    mesh->positions = NULL;
    mesh->triangles = NULL;
}

static void vertex(traversal_mesh *m, double x, double y, double z) {
    float *p = m->positions + 3 * (size_t)m->vertex_count++;
    p[0] = (float)x, p[1] = (float)y, p[2] = (float)z;
}

/* A net of columns x rows squares, whose first vertex is `first`. */
static void net(traversal_mesh *m, uint32_t first, uint32_t columns, uint32_t rows) {
    for (uint32_t y = 0; y < rows; y++)
        for (uint32_t x = 0; x < columns; x++) {
            int a = (int)(first + y * (columns + 1) + x), b = a + 1, c = a + (int)columns + 1, d = c + 1;
            m->triangles[m->triangle_count++] = (b_triangle){{a, b, c}, 0};
            m->triangles[m->triangle_count++] = (b_triangle){{b, d, c}, 0};
        }
}

static void look(traversal_mesh *m, const double eye[3], const double target[3]) {
    double f[3], size = 0;
    for (int a = 0; a < 3; a++) f[a] = target[a] - eye[a], size += f[a] * f[a];
    for (int a = 0; a < 3; a++) f[a] /= sqrt(size), m->eye[a] = (float)eye[a], m->forward[a] = (float)f[a];
    double across = hypot(f[0], f[2]), r[3] = {-f[2] / across, 0, f[0] / across};
    for (int a = 0; a < 3; a++) m->right[a] = (float)r[a];
    m->up[0] = (float)(r[1] * f[2] - r[2] * f[1]);
    m->up[1] = (float)(r[2] * f[0] - r[0] * f[2]);
    m->up[2] = (float)(r[0] * f[1] - r[1] * f[0]);
}

static void wall(traversal_mesh *m, int axis, double at) {
    static const double half[3] = {5, 3, 5}, centre[3] = {0, 3, 0};
    uint32_t first = m->vertex_count;
    int u = (axis + 1) % 3, v = (axis + 2) % 3;
    for (int j = 0; j <= WALL; j++)
        for (int i = 0; i <= WALL; i++) {
            double p[3];
            p[axis] = centre[axis] + at * half[axis];
            p[u] = centre[u] + half[u] * (2.0 * i / WALL - 1);
            p[v] = centre[v] + half[v] * (2.0 * j / WALL - 1);
            vertex(m, p[0], p[1], p[2]);
        }
    net(m, first, WALL, WALL);
}

static void ball(traversal_mesh *m, double x, double y, double z, double radius) {
    uint32_t first = m->vertex_count;
    for (int j = 0; j <= RINGS; j++)
        for (int i = 0; i <= SECTORS; i++) {
            double theta = 0.5 * TAU * j / RINGS, phi = TAU * (i % SECTORS) / SECTORS;
            double s = j == RINGS ? 0 : sin(theta);
            vertex(m, x + radius * s * cos(phi), y + radius * cos(theta), z + radius * s * sin(phi));
        }
    net(m, first, SECTORS, RINGS);
}

traversal_mesh traversal_room(uint32_t parts) {
    uint32_t walls = 6 * 2 * WALL * WALL, each = 2 * RINGS * SECTORS;
    uint32_t balls = parts * 1000 > walls ? (parts * 1000 - walls) / each : 0;
    traversal_mesh m = allocate("room", 6 * (WALL + 1) * (WALL + 1) + (size_t)balls * (RINGS + 1) * (SECTORS + 1),
                                (size_t)walls + (size_t)balls * each);
    uint64_t seed = 3;
    if (!m.positions) return m;
    for (int axis = 0; axis < 3; axis++) wall(&m, axis, -1), wall(&m, axis, 1);
    for (uint32_t i = 0; i < balls; i++) {
        double radius = 0.15 + 0.35 * traversal_uniform(&seed), x = 9 * traversal_uniform(&seed) - 4.5;
        double y = 0.5 + 4.5 * traversal_uniform(&seed), z = 7 * traversal_uniform(&seed) - 4.5;
        ball(&m, x, y, z, radius);
    }
    look(&m, (const double[]){0, 2.3, 4.8}, (const double[]){0, 2.3, 0});
    m.panel[1] = 5.9f;
    return m;
}

/* Waves upon waves, each shorter and lower by 2 and turned. */
static double height(double x, double z) {
    double h = 0, size = 1;
    for (int k = 0; k < 9; k++) {
        h += size * sin(x / size * 0.9 + 1.3 * k) * sin(z / size * 1.1 + 0.7 * k);
        double turned = 0.8 * x - 0.6 * z;
        z = 0.6 * x + 0.8 * z;
        x = turned;
        size /= 2;
    }
    return h;
}

traversal_mesh traversal_terrain(uint32_t cells) {
    size_t vertices = (size_t)(cells + 1) * (cells + 1);
    traversal_mesh m = allocate("terrain", vertices, 2 * (size_t)cells * cells);
    if (!m.positions) return m;
    for (uint32_t j = 0; j <= cells; j++)
        for (uint32_t i = 0; i <= cells; i++) {
            double x = 20.0 * i / cells - 10, z = 20.0 * j / cells - 10;
            vertex(&m, x, height(x, z), z);
        }
    net(&m, 0, cells, cells);
    look(&m, (const double[]){0, 5, 11}, (const double[]){0, 0, 1});
    m.panel[0] = -6, m.panel[1] = 8, m.panel[2] = -4;
    return m;
}

void traversal_normal(const traversal_mesh *mesh, int i, double out[3]) {
    const b_triangle *t = &mesh->triangles[i];
    double e[2][3];
    for (int k = 0; k < 2; k++)
        for (int a = 0; a < 3; a++)
            e[k][a] = (double)mesh->positions[3 * (size_t)t->v[k + 1] + (size_t)a] -
                      mesh->positions[3 * (size_t)t->v[0] + (size_t)a];
    for (int a = 0; a < 3; a++)
        out[a] = e[0][(a + 1) % 3] * e[1][(a + 2) % 3] - e[0][(a + 2) % 3] * e[1][(a + 1) % 3];
    double size = sqrt(out[0] * out[0] + out[1] * out[1] + out[2] * out[2]);
    for (int a = 0; a < 3; a++) out[a] = size > 0 ? out[a] / size : 0;
}

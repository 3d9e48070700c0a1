/* make-forest TREES.ply GROUND.ply -- grows a small wood of conifers on uneven ground: about 900 000 triangles, the
 * same ones every time, in two binary PLY files (trees and ground: a scene can give them different colours).
 *
 * A tree is a branch that grows upwards; a branch is a tapering tube along a wandering line, from which thinner
 * branches grow, and at the last level twigs carry flat sprays of needles. Unit: metres; y is up; the ground is 80 by
 * 80 about the origin and between -1 and 1 high; a clearing about (0, 0, 8) is left free for a camera. */
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979323846

typedef struct vec { double x, y, z; } vec;

static vec make(double x, double y, double z) { vec v = {x, y, z}; return v; }
static vec madd(vec a, double s, vec b) { return make(a.x + s * b.x, a.y + s * b.y, a.z + s * b.z); }
static double dot(vec a, vec b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
static vec cross(vec a, vec b) { return make(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x); }
static vec unit(vec a) { return madd(make(0, 0, 0), 1 / sqrt(dot(a, a)), a); }

/* ---- random numbers: splitmix64 (Steele, Lea & Flood 2014) ---- */

typedef struct random_state { uint64_t state; } random_state;

static double uniform(random_state *random, double low, double high)
{
    uint64_t z = random->state += 0x9e3779b97f4a7c15u;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    z ^= z >> 31;
    return low + (high - low) * (double)(z >> 11) * 0x1p-53;
}

/* ---- a mesh that grows ---- */

typedef struct mesh {
    float *vertices;     /* position and normal: 6 floats each */
    uint32_t *triangles; /* 3 each */
    size_t vertex_count, vertex_room, triangle_count, triangle_room;
    int failed; /* memory ran out: nothing more is added */
} mesh;

static uint32_t add_vertex(mesh *m, vec p, vec n)
{
    if (m->vertex_count == m->vertex_room && !m->failed) {
        size_t room = m->vertex_room ? 2 * m->vertex_room : 1 << 16;
        float *grown = realloc(m->vertices, room * 6 * sizeof *grown);
        if (grown) {
            m->vertices = grown;
            m->vertex_room = room;
        } else {
            m->failed = 1;
        }
    }
    if (m->failed)
        return 0;
    float *v = m->vertices + 6 * m->vertex_count;
    v[0] = (float)p.x, v[1] = (float)p.y, v[2] = (float)p.z;
    v[3] = (float)n.x, v[4] = (float)n.y, v[5] = (float)n.z;
    return (uint32_t)m->vertex_count++;
}

static void add_triangle(mesh *m, uint32_t a, uint32_t b, uint32_t c)
{
    if (m->triangle_count == m->triangle_room && !m->failed) {
        size_t room = m->triangle_room ? 2 * m->triangle_room : 1 << 16;
        uint32_t *grown = realloc(m->triangles, room * 3 * sizeof *grown);
        if (grown) {
            m->triangles = grown;
            m->triangle_room = room;
        } else {
            m->failed = 1;
        }
    }
    if (m->failed)
        return;
    uint32_t *t = m->triangles + 3 * m->triangle_count++;
    t[0] = a, t[1] = b, t[2] = c;
}

/* Binary PLY is little-endian by declaration; bytes are put one by one so that any host writes the same file. */
static void put_u32(FILE *file, uint32_t value)
{
    unsigned char bytes[4] = {value & 255, value >> 8 & 255, value >> 16 & 255, value >> 24};
    fwrite(bytes, 1, 4, file);
}

static int write_ply(const mesh *m, const char *path)
{
    FILE *file = fopen(path, "wb");
    if (!file) {
        perror(path);
        return 1;
    }
    fprintf(file, "ply\nformat binary_little_endian 1.0\ncomment made by apps/make-forest.c\nelement vertex %zu\n"
                  "property float x\nproperty float y\nproperty float z\n"
                  "property float nx\nproperty float ny\nproperty float nz\n"
                  "element face %zu\nproperty list uchar int vertex_indices\nend_header\n",
            m->vertex_count, m->triangle_count);
    for (size_t i = 0; i < 6 * m->vertex_count; i++) {
        uint32_t bits;
        memcpy(&bits, &m->vertices[i], sizeof bits);
        put_u32(file, bits);
    }
    for (size_t i = 0; i < m->triangle_count; i++) {
        fputc(3, file);
        for (int k = 0; k < 3; k++)
            put_u32(file, m->triangles[3 * i + (size_t)k]);
    }
    int failed = ferror(file);
    failed |= fclose(file) != 0;
    if (failed)
        fprintf(stderr, "make-forest: %s could not be written\n", path);
    else
        printf("%s: %zu vertices, %zu triangles\n", path, m->vertex_count, m->triangle_count);
    return failed;
}

/* ---- ground ---- */

static double lattice(int x, int z)
{
    random_state hash = {((uint64_t)(uint32_t)x << 32 | (uint32_t)z) * 0xd6e8feb86659fd93u};
    return uniform(&hash, -1, 1);
}

/* Smooth noise of period 1 in [-1, 1]. */
static double noise(double x, double z)
{
    int i = (int)floor(x), j = (int)floor(z);
    double u = x - i, v = z - j;
    u = u * u * (3 - 2 * u);
    v = v * v * (3 - 2 * v);
    return (1 - v) * ((1 - u) * lattice(i, j) + u * lattice(i + 1, j)) +
           v * ((1 - u) * lattice(i, j + 1) + u * lattice(i + 1, j + 1));
}

static double ground_height(double x, double z)
{
    return 0.55 * noise(x / 11, z / 11) + 0.16 * noise(x / 2.3 + 40, z / 2.3) + 0.05 * noise(x / 0.5, z / 0.5 + 70);
}

static void grow_ground(mesh *m)
{
    enum { CELLS = 200 };
    const double size = 80, step = size / CELLS, h = 0.05;
    for (int j = 0; j <= CELLS; j++)
        for (int i = 0; i <= CELLS; i++) {
            double x = i * step - size / 2, z = j * step - size / 2;
            vec n = make(ground_height(x - h, z) - ground_height(x + h, z), 2 * h,
                         ground_height(x, z - h) - ground_height(x, z + h));
            add_vertex(m, make(x, ground_height(x, z), z), unit(n));
        }
    for (int j = 0; j < CELLS; j++)
        for (int i = 0; i < CELLS; i++) {
            uint32_t a = (uint32_t)(j * (CELLS + 1) + i), b = a + CELLS + 1;
            add_triangle(m, a, b, a + 1);
            add_triangle(m, a + 1, b, b + 1);
        }
}

/* ---- trees ---- */

/* What differs between the levels: 0 is the trunk, 1 a branch, 2 a twig. */
typedef struct level {
    int segments, sides;
    double wander;    /* radians by which the direction strays per segment */
    double lift;      /* how much it bends upwards per segment; < 0: it droops */
    double bare;      /* share of the length, from the root, without children */
    double spacing;   /* length between children */
} level;

static const level levels[3] = {
    {18, 9, 0.02, 0.05, 0.30, 0.21},
    {6, 4, 0.10, 0.04, 0.15, 0.22},
    {2, 3, 0.12, 0.00, 0.00, 0.00},
};

static void add_ring(mesh *m, vec center, vec direction, double radius, int sides)
{
    vec u = unit(fabs(direction.y) < 0.9 ? cross(direction, make(0, 1, 0)) : cross(direction, make(1, 0, 0)));
    vec v = cross(direction, u);
    for (int i = 0; i < sides; i++) {
        double a = 2 * PI * i / sides;
        vec out = madd(madd(make(0, 0, 0), cos(a), u), sin(a), v);
        add_vertex(m, madd(center, radius, out), out);
    }
}

/* A flat spray of needles along a twig: a narrow kite. */
static void add_spray(mesh *m, random_state *random, vec base, vec direction, double length)
{
    vec around = unit(make(uniform(random, -1, 1), uniform(random, -0.3, 0.3), uniform(random, -1, 1)));
    vec side = cross(direction, around);
    if (dot(side, side) < 1e-4)
        return;
    side = unit(side);
    vec normal = unit(cross(side, direction));
    vec middle = madd(base, 0.4 * length, direction);
    uint32_t a = add_vertex(m, base, normal);
    uint32_t b = add_vertex(m, madd(middle, 0.16 * length, side), normal);
    uint32_t c = add_vertex(m, madd(base, length, direction), normal);
    uint32_t d = add_vertex(m, madd(middle, -0.16 * length, side), normal);
    add_triangle(m, a, b, c);
    add_triangle(m, a, c, d);
}

static void grow_branch(mesh *m, random_state *random, int depth, vec base, vec direction, double length, double radius)
{
    const level *l = &levels[depth];
    double step = length / l->segments;
    double next_child = l->bare * length;
    vec p = base;
    uint32_t ring = 0;
    for (int s = 0; s <= l->segments; s++) {
        double along = (double)s / l->segments;
        /* roots flare where the trunk meets the ground */
        double flare = depth == 0 ? 0.5 * exp(-along * 30) : 0;
        double here = radius * (1 - 0.93 * along + flare);
        uint32_t new_ring = (uint32_t)m->vertex_count;
        add_ring(m, p, direction, here, l->sides);
        for (int i = 0; s > 0 && i < l->sides; i++) {
            uint32_t j = (uint32_t)((i + 1) % l->sides), k = (uint32_t)i;
            add_triangle(m, ring + k, ring + j, new_ring + j);
            add_triangle(m, ring + k, new_ring + j, new_ring + k);
        }
        ring = new_ring;
        if (s == l->segments)
            break;
        direction.x += l->wander * uniform(random, -1, 1);
        direction.z += l->wander * uniform(random, -1, 1);
        direction.y += l->wander * uniform(random, -1, 1) + l->lift;
        direction = unit(direction);

        for (; depth < 2 && next_child < (s + 1) * step; next_child += l->spacing * uniform(random, 0.6, 1.4)) {
            double t = next_child / length, offset = next_child - s * step;
            vec root = madd(p, offset, direction);
            double angle = uniform(random, 0, 2 * PI);
            if (depth == 0) {
                /* long and drooping low in the crown, short and rising at the top; dead stubs at its lower edge */
                double share = (t - l->bare) / (1 - l->bare);
                double reach = length * 0.21 * (1 - share) * uniform(random, 0.6, 1.1) + 0.15;
                if (share < 0.08)
                    reach *= uniform(random, 0.1, 0.6);
                vec out = unit(make(cos(angle), -0.35 + 0.9 * share, sin(angle)));
                grow_branch(m, random, 1, root, out, reach, radius * 0.13 * (1.15 - share));
            } else {
                /* twigs to the left and right of their branch */
                vec side = cross(direction, make(0, 1, 0));
                double sign = angle < PI ? 1 : -1;
                vec out = madd(madd(direction, sign * uniform(random, 0.6, 1.1), unit(side)), 1,
                               make(0, uniform(random, -0.35, 0.1), 0));
                grow_branch(m, random, 2, root, unit(out), 0.12 + 0.45 * length * (1 - t) * uniform(random, 0.5, 1),
                            radius * 0.35 * (1 - 0.8 * t));
            }
        }
        vec middle = madd(p, 0.5 * step, direction);
        p = madd(p, step, direction);
        if (depth == 2)
            for (int i = 0; i < 3; i++) {
                vec stray = make(uniform(random, -1, 1), uniform(random, -0.7, 0.3), uniform(random, -1, 1));
                vec out = unit(madd(stray, 0.7, direction));
                add_spray(m, random, i == 0 ? middle : p, out, uniform(random, 0.10, 0.24));
            }
    }
}

static void grow_trees(mesh *m)
{
    enum { TREES = 120, TRIES = 20000 };
    double place[TREES][2];
    random_state random = {20};
    int count = 0;
    for (int i = 0; i < TRIES && count < TREES; i++) {
        double x = uniform(&random, -20, 20), z = uniform(&random, -30, 10);
        /* the camera's clearing */
        if (z > 3 && fabs(x) < 1 + 0.8 * (z - 3))
            continue;
        int crowded = 0;
        for (int k = 0; k < count; k++)
            crowded |= hypot(place[k][0] - x, place[k][1] - z) < 1.9;
        if (crowded)
            continue;
        place[count][0] = x;
        place[count++][1] = z;
        double height = uniform(&random, 9, 15);
        vec up = unit(make(uniform(&random, -0.04, 0.04), 1, uniform(&random, -0.04, 0.04)));
        double radius = height * uniform(&random, 0.014, 0.020);
        grow_branch(m, &random, 0, make(x, ground_height(x, z) - 0.15, z), up, height, radius);
    }
}

int main(int argc, char **argv)
{
    if (argc != 3) {
        fprintf(stderr, "usage: make-forest TREES.ply GROUND.ply\n");
        return 2;
    }
    mesh trees = {0}, ground = {0};
    int code = 1;
    grow_trees(&trees);
    grow_ground(&ground);
    if (trees.failed || ground.failed)
        fprintf(stderr, "make-forest: out of memory\n");
    else
        code = write_ply(&trees, argv[1]) || write_ply(&ground, argv[2]);
    free(trees.vertices);
    free(trees.triangles);
    free(ground.vertices);
    free(ground.triangles);
    return code;
}

/* make-bunny OUT.obj -- models a bunny as an implicit surface and writes it as a closed triangle mesh with normals.
 *
 * The size, place and direction are those of the well-known scanned bunny (about 0.15 units high, standing on
 * y = 0.033, looking towards -x), so that either can take the other's place in a scene.
 *
 * The surface is a union of ellipsoids and capsules blended by a smooth minimum; it is polygonised by surface nets
 * (Gibson 1998, "Constrained elastic surface nets"): one vertex in every grid cell that the surface passes through, and
 * one quadrilateral for every grid edge that it crosses. The vertices are then moved onto the surface along its
 * gradient. */
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

typedef struct vec { double x, y, z; } vec;

static vec make(double x, double y, double z) { vec v = {x, y, z}; return v; }
static vec sub(vec a, vec b) { return make(a.x - b.x, a.y - b.y, a.z - b.z); }
static vec madd(vec a, double s, vec b) { return make(a.x + s * b.x, a.y + s * b.y, a.z + s * b.z); }
static double dot(vec a, vec b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
static double length(vec a) { return sqrt(dot(a, a)); }

/* ---- the shape: negative inside; near the surface about the distance. Unit: a tenth of the final one ---- */

/* Distance to an ellipsoid, to first order. */
static double ellipsoid(vec p, vec center, vec radii)
{
    vec q = sub(p, center);
    q = make(q.x / radii.x, q.y / radii.y, q.z / radii.z);
    double scaled = length(q);
    double slope = length(make(q.x / radii.x, q.y / radii.y, q.z / radii.z));
    return slope > 1e-9 ? scaled * (scaled - 1) / slope : -fmin(radii.x, fmin(radii.y, radii.z));
}

/* A rod from a to b whose radius goes from ra to rb. */
static double rod(vec p, vec a, vec b, double ra, double rb)
{
    vec axis = sub(b, a), q = sub(p, a);
    double t = fmax(0, fmin(1, dot(q, axis) / dot(axis, axis)));
    return length(madd(q, -t, axis)) - (ra + t * (rb - ra));
}

/* Minimum whose crease is rounded over a width of about k. */
static double blend(double a, double b, double k)
{
    double h = fmax(k - fabs(a - b), 0) / k;
    return fmin(a, b) - h * h * k * 0.25;
}

static double carve(double body, double hole, double k)
{
    return -blend(-body, hole, k);
}

static vec rotate_z(vec p, vec center, double degrees)
{
    double a = degrees * 3.14159265358979323846 / 180, c = cos(a), s = sin(a);
    vec q = sub(p, center);
    return make(center.x + c * q.x + s * q.y, center.y - s * q.x + c * q.y, p.z);
}

/* One ear: a long flattened ellipsoid leaning back and outwards, hollowed on its front. */
static double ear(vec p)
{
    vec root = make(-0.47, 1.05, 0.10);
    vec q = rotate_z(p, root, -20);
    q.z -= 0.16 * (q.y - root.y);
    double shell = ellipsoid(q, make(-0.47, 1.29, 0.10), make(0.055, 0.29, 0.105));
    double hollow = ellipsoid(q, make(-0.535, 1.30, 0.115), make(0.060, 0.22, 0.060));
    return carve(shell, hollow, 0.03);
}

/* Both halves are the same but for the tilt of the head, so everything is modelled at z >= 0. */
static double bunny(vec p)
{
    double side = fabs(p.z);
    vec m = make(p.x, p.y, side);

    double body = ellipsoid(rotate_z(p, make(0.05, 0.46, 0), -8), make(0.05, 0.47, 0), make(0.50, 0.43, 0.40));
    body = blend(body, ellipsoid(p, make(-0.30, 0.50, 0), make(0.26, 0.34, 0.28)), 0.16);
    vec thigh = rotate_z(m, make(0.20, 0.3, 0), 12);
    body = blend(body, ellipsoid(thigh, make(0.20, 0.31, 0.30), make(0.30, 0.27, 0.16)), 0.07);
    body = blend(body, ellipsoid(m, make(0.00, 0.060, 0.34), make(0.25, 0.068, 0.095)), 0.05);
    body = blend(body, rod(m, make(-0.36, 0.42, 0.15), make(-0.47, 0.09, 0.16), 0.115, 0.075), 0.08);
    body = blend(body, ellipsoid(m, make(-0.52, 0.060, 0.165), make(0.135, 0.065, 0.085)), 0.05);
    /* toes: furrows in all four feet, no finer than the grid resolves */
    for (int i = -1; i <= 1; i += 2) {
        double front = 0.165 + i * 0.03, hind = 0.34 + i * 0.034;
        body = carve(body, rod(m, make(-0.68, 0.06, front), make(-0.58, 0.135, front), 0.02, 0.012), 0.03);
        body = carve(body, rod(m, make(-0.27, 0.06, hind), make(-0.15, 0.14, hind), 0.02, 0.012), 0.03);
    }
    body = blend(body, ellipsoid(p, make(0.53, 0.40, 0), make(0.14, 0.135, 0.13)), 0.04);

    double head = ellipsoid(rotate_z(p, make(-0.52, 0.92, 0), 18), make(-0.52, 0.92, 0), make(0.27, 0.225, 0.215));
    head = blend(head, ellipsoid(m, make(-0.655, 0.825, 0.075), make(0.135, 0.105, 0.105)), 0.08);
    head = blend(head, ellipsoid(m, make(-0.50, 0.85, 0.14), make(0.13, 0.12, 0.09)), 0.10);
    head = blend(head, ear(m), 0.06);
    /* eyes lie in sockets */
    head = carve(head, ellipsoid(m, make(-0.655, 0.985, 0.195), make(0.055, 0.05, 0.04)), 0.03);
    head = blend(head, ellipsoid(m, make(-0.645, 0.985, 0.165), make(0.042, 0.042, 0.040)), 0.008);
    head = blend(head, ellipsoid(p, make(-0.788, 0.868, 0), make(0.028, 0.025, 0.038)), 0.015);

    double all = blend(body, head, 0.14);
    /* it stands flat, with a rounded edge */
    return carve(all, p.y, 0.02);
}

static vec gradient(vec p)
{
    const double h = 1e-5;
    return make((bunny(make(p.x + h, p.y, p.z)) - bunny(make(p.x - h, p.y, p.z))) / (2 * h),
                (bunny(make(p.x, p.y + h, p.z)) - bunny(make(p.x, p.y - h, p.z))) / (2 * h),
                (bunny(make(p.x, p.y, p.z + h)) - bunny(make(p.x, p.y, p.z - h))) / (2 * h));
}

/* ---- surface nets ---- */

/* Grid points, i along x fastest. The box holds the shape with a cell to spare. The spacing doesn't divide the offsets,
 * so that no grid point lies on the plane of symmetry or on the ground. */
#define SPACING 0.0159
static const double low[3] = {-0.9571, -0.0413, -0.5573};
enum { NX = 106, NY = 106, NZ = 72 };

static size_t at(int i, int j, int k) { return ((size_t)k * NY + (size_t)j) * NX + (size_t)i; }
static vec grid_point(double i, double j, double k)
{
    return make(low[0] + SPACING * i, low[1] + SPACING * j, low[2] + SPACING * k);
}

/* The mean of the points where the cell's edges cross the surface; 0 if none does. */
static int cell_vertex(const double *field, int i, int j, int k, vec *out)
{
    static const int edges[12][2] = {{0, 1}, {2, 3}, {4, 5}, {6, 7}, {0, 2}, {1, 3},
                                     {4, 6}, {5, 7}, {0, 4}, {1, 5}, {2, 6}, {3, 7}};
    vec sum = {0, 0, 0};
    int crossings = 0;
    for (int e = 0; e < 12; e++) {
        int a = edges[e][0], b = edges[e][1];
        double fa = field[at(i + (a & 1), j + (a >> 1 & 1), k + (a >> 2))];
        double fb = field[at(i + (b & 1), j + (b >> 1 & 1), k + (b >> 2))];
        if ((fa < 0) == (fb < 0))
            continue;
        double t = fa / (fa - fb);
        sum = madd(sum, 1, grid_point(i + (a & 1) + t * ((b & 1) - (a & 1)),
                                      j + (a >> 1 & 1) + t * ((b >> 1 & 1) - (a >> 1 & 1)),
                                      k + (a >> 2) + t * ((b >> 2) - (a >> 2))));
        crossings++;
    }
    if (crossings == 0)
        return 0;
    *out = madd(make(0, 0, 0), 1.0 / crossings, sum);
    return 1;
}

/* Moves a vertex onto the surface by Newton steps, but not out of the neighbourhood of its cell. */
static vec project(vec p)
{
    for (int step = 0; step < 4; step++) {
        vec g = gradient(p);
        double f = bunny(p), square = dot(g, g);
        if (square < 1e-6)
            break;
        double distance = f / square;
        double most = 0.3 * SPACING / sqrt(square);
        p = madd(p, -fmax(-most, fmin(most, distance)), g);
    }
    return p;
}

static void write_quad(FILE *file, const vec *vertices, const uint32_t corner[4])
{
    /* OBJ counts from 1. The shorter diagonal gives the better shaped triangles. */
    uint32_t c[4] = {corner[0] + 1, corner[1] + 1, corner[2] + 1, corner[3] + 1};
    double diagonal[2] = {length(sub(vertices[corner[0]], vertices[corner[2]])),
                          length(sub(vertices[corner[1]], vertices[corner[3]]))};
    int turn = diagonal[1] < diagonal[0];
    uint32_t a = c[turn], b = c[turn + 1], d = c[turn + 2], e = c[(turn + 3) % 4];
    fprintf(file, "f %u//%u %u//%u %u//%u\nf %u//%u %u//%u %u//%u\n", a, a, b, b, d, d, a, a, d, d, e, e);
}

int main(int argc, char **argv)
{
    double *field = NULL;
    uint32_t *cell = NULL;
    vec *vertices = NULL;
    FILE *file = NULL;
    int code = 1;
    if (argc != 2) {
        fprintf(stderr, "usage: make-bunny OUT.obj\n");
        return 2;
    }
    size_t points = (size_t)NX * NY * NZ;
    field = malloc(points * sizeof *field);
    cell = malloc(points * sizeof *cell);
    vertices = malloc(points * sizeof *vertices);
    if (!field || !cell || !vertices) {
        fprintf(stderr, "make-bunny: out of memory\n");
        goto cleanup;
    }
    for (int k = 0; k < NZ; k++)
        for (int j = 0; j < NY; j++)
            for (int i = 0; i < NX; i++) {
                double f = bunny(grid_point(i, j, k));
                field[at(i, j, k)] = f;
                /* A surface that left the box would leave a hole. */
                if (f < 0 && (i == 0 || j == 0 || k == 0 || i == NX - 1 || j == NY - 1 || k == NZ - 1)) {
                    fprintf(stderr, "make-bunny: the shape leaves its box at %d %d %d\n", i, j, k);
                    goto cleanup;
                }
            }

    file = fopen(argv[1], "w");
    if (!file) {
        perror(argv[1]);
        goto cleanup;
    }
    fprintf(file, "# A bunny, made by apps/make-bunny.c\n");
    uint32_t vertex_count = 0, quad_count = 0;
    for (int k = 0; k + 1 < NZ; k++)
        for (int j = 0; j + 1 < NY; j++)
            for (int i = 0; i + 1 < NX; i++) {
                vec p;
                if (!cell_vertex(field, i, j, k, &p))
                    continue;
                p = project(p);
                vec n = gradient(p);
                double scale = 1 / length(n);
                fprintf(file, "v %.7f %.7f %.7f\nvn %.5f %.5f %.5f\n", 0.1 * p.x, 0.033 + 0.1 * p.y, 0.1 * p.z,
                        n.x * scale, n.y * scale, n.z * scale);
                cell[at(i, j, k)] = vertex_count;
                vertices[vertex_count++] = p;
            }
    /* The four cells around a grid edge along axis x, y or z, in the order that faces the edge's positive end. */
    for (int k = 1; k + 1 < NZ; k++)
        for (int j = 1; j + 1 < NY; j++)
            for (int i = 1; i + 1 < NX; i++)
                for (int axis = 0; axis < 3; axis++) {
                    int step[3] = {axis == 0, axis == 1, axis == 2};
                    int from_inside = field[at(i, j, k)] < 0;
                    if (from_inside == (field[at(i + step[0], j + step[1], k + step[2])] < 0))
                        continue;
                    int u[3] = {axis == 2, axis == 0, axis == 1}, v[3] = {axis == 1, axis == 2, axis == 0};
                    uint32_t corner[4] = {cell[at(i - u[0] - v[0], j - u[1] - v[1], k - u[2] - v[2])],
                                          cell[at(i - v[0], j - v[1], k - v[2])], cell[at(i, j, k)],
                                          cell[at(i - u[0], j - u[1], k - u[2])]};
                    if (!from_inside) {
                        uint32_t swap = corner[1];
                        corner[1] = corner[3];
                        corner[3] = swap;
                    }
                    write_quad(file, vertices, corner);
                    quad_count++;
                }
    int failed = ferror(file);
    failed |= fclose(file) != 0;
    file = NULL;
    if (failed) {
        fprintf(stderr, "make-bunny: %s could not be written\n", argv[1]);
        goto cleanup;
    }
    printf("%s: %u vertices, %u triangles\n", argv[1], vertex_count, 2 * quad_count);
    code = 0;
cleanup:
    if (file)
        fclose(file);
    free(vertices);
    free(cell);
    free(field);
    return code;
}

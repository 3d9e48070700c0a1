/* mesh_polygon.c -- see mesh_polygon.h. */
#include "mesh_polygon.h"

#include <math.h>
#include <string.h>

/* The corners in the plane that the polygon's normal stands on: counter-clockwise. */
typedef struct flat { double x, y; } flat;

static double turn(flat a, flat b, flat c) { return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x); }

static void flatten(const uint32_t *corners, size_t count, const float *positions, flat *out) {
    double n[3] = {0, 0, 0}; /* Newell's: twice the area */
    for (size_t i = 0; i < count; i++) {
        const float *a = positions + 3 * (size_t)corners[i], *b = positions + 3 * (size_t)corners[(i + 1) % count];
        for (int c = 0; c < 3; c++) {
            int u = (c + 1) % 3, v = (c + 2) % 3;
            n[c] += ((double)a[u] - b[u]) * ((double)a[v] + b[v]);
        }
    }
    int axis = fabs(n[0]) > fabs(n[1]) ? 0 : 1;
    if (fabs(n[2]) > fabs(n[axis])) axis = 2;
    int u = (axis + 1) % 3, v = (axis + 2) % 3;
    for (size_t i = 0; i < count; i++) {
        const float *p = positions + 3 * (size_t)corners[i];
        out[i].x = n[axis] < 0 ? p[v] : p[u];
        out[i].y = n[axis] < 0 ? p[u] : p[v];
    }
}

static int fan_fills(const flat *p, size_t count) {
    for (size_t k = 2; k < count; k++)
        if (turn(p[0], p[k - 1], p[k]) < 0) return 0;
    return 1;
}

/* Whether the triangle at left[k] can be cut off: it turns the right way and no other corner lies in it. */
static int is_ear(const flat *p, const size_t *left, size_t count, size_t k) {
    flat a = p[left[(k + count - 1) % count]], b = p[left[k]], c = p[left[(k + 1) % count]];
    if (!(turn(a, b, c) > 0)) return 0;
    for (size_t i = 2; i < count - 1; i++) {
        flat q = p[left[(k + i) % count]];
        if (turn(a, b, q) >= 0 && turn(b, c, q) >= 0 && turn(c, a, q) >= 0 &&
            !((q.x == a.x && q.y == a.y) || (q.x == b.x && q.y == b.y) || (q.x == c.x && q.y == c.y)))
            return 0;
    }
    return 1;
}

uint32_t brume_polygon_cut(const uint32_t *corners, size_t count, const float *positions, uint32_t *out) {
    flat p[BRUME_POLYGON_CORNERS];
    size_t left[BRUME_POLYGON_CORNERS];
    if (count < 3 || count > BRUME_POLYGON_CORNERS) return 0;
    for (size_t i = 0; i < count; i++) left[i] = i;
    size_t first = 0;
    flatten(corners, count, positions, p);
    int fan = count == 3 || fan_fills(p, count);
    for (size_t n = count; n >= 3; n--, out += 3) {
        size_t k = 1;
        /* What crosses itself may have none: then the next corner goes. */
        if (!fan)
            for (size_t i = 0; i < n; i++)
                if (is_ear(p, left, n, (first + i) % n)) {
                    k = (first + i) % n;
                    break;
                }
        if (fan) {
            out[0] = corners[0], out[1] = corners[left[1]], out[2] = corners[left[2]];
        } else {
            out[0] = corners[left[(k + n - 1) % n]], out[1] = corners[left[k]], out[2] = corners[left[(k + 1) % n]];
        }
        memmove(left + k, left + k + 1, (n - k - 1) * sizeof *left);
        first = k;
    }
    return (uint32_t)(count - 2);
}

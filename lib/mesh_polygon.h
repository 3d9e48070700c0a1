/* mesh_polygon.h -- polygons to triangles. */
#ifndef BRUME_MESH_POLYGON_H
#define BRUME_MESH_POLYGON_H

#include <stddef.h>
#include <stdint.h>

enum { BRUME_POLYGON_CORNERS = 255 }; /* at most */

/* Cuts a polygon of 3 or more corners, numbers of `positions`' vertices, into count - 2 triangles. A fan about the
 * first corner where that fills it, as in Mitsuba 3, since another diagonal bends texture coordinates another way; ears
 * (Meisters 1975) where it doesn't. out_triangles: room for 3 (count - 2). Returns how many. */
uint32_t brume_polygon_cut(const uint32_t *corners, size_t count, const float *positions, uint32_t *out_triangles);

#endif

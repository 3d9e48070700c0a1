/* light_queries.h -- scenes of many lamps, queries for which the device chooses one, and what is known of the choices:
 * what test_light_tree and measure_light_tree share.
 *
 * Every cluster's weight, every lamp's own and which lamps a leaf looks at are read from the device for all queries;
 * from them follows, in double, with what probability each lamp is chosen. What lamps contribute is computed in double
 * on the host, by a rule over the angle that the lamp sees the segment under.
 */
#ifndef LIGHT_QUERIES_H
#define LIGHT_QUERIES_H

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "arrays.h"
#include "device_test.h"

enum { QUERIES = 32, SAMPLES = 1 << 14, PLANES = 11 };

/* A scene, its tree, and all that is known of one set of queries. */
typedef struct light_queries {
    b_params params;
    b_light *lights;
    brume_light_tree tree;
    uint32_t count;
    int is_point;
    double query[PLANES][QUERIES];
    double *contribution, *probability; /* of lamp k for query q: [q * count + k] */
    double *choice, *share;             /* of sample i for query q: [q * SAMPLES + i] */
    double *out;
} light_queries;

extern light_queries now;

/* Zeros. */
void *room(size_t count, size_t size);

double luminance_of(const b_light *light);
b_light make_spot(const double position[3], const double axis[3], double cutoff, double beam, double intensity);

/* Scenes: even ones hold lamps of every kind, odd ones narrow spots over a stage, 3 points. */
void make_scene(int scene, uint32_t count);
void make_queries(int scene, int is_point);

/* Fills in `contribution`. */
void contribute(void);
/* Fills in `choice` and `share`: `samples` for each query, at most SAMPLES. */
void choose(uint32_t lanes, int samples);
/* Fills in `probability`: of the tree, or of one reservoir for all. */
void weigh(int by_tree);

#endif

/* stage.h -- a small scene with nearly everything in it, told again in other words: moved, turned, scaled, brightened,
 * in another order, in other pieces. What must not change the picture, test_invariance asks.
 *
 * The camera stands at the origin of the untold scene, in fog or not, and looks along +z. All that is at a place has
 * coordinates that are multiples of 1/16, so that they stay exact where the whole is moved by a million units.
 */
#ifndef STAGE_H
#define STAGE_H

#include "known_answer.h"

typedef struct stage {
    int fog;               /* multiple scattering, lamps and surfaces; else surfaces, an emitter, a lamp and a sky */
    double scale;          /* of lengths: extinctions and powers follow, radiances stay. 0: 1 */
    double brightness;     /* of all light. 0: 1 */
    double move[3];        /* after scaling and turning */
    double turn[3];        /* degrees about x, then y, then z */
    int reversed;          /* objects and lights added last to first */
    int split;             /* the floor and the emitter in many triangles instead of two each */
    int twice;             /* a lamp as two of half its power in its place */
    int cut;               /* a null surface across the fog */
    int bake;              /* vertices in world space, rounded to float there: what a renderer in world space sees */
    double sigma_factor;   /* the fog's extinction is off by this, to be found. 0: 1 */
} stage;

brume_scene *stage_scene(const stage *told, uint32_t samples);

#endif

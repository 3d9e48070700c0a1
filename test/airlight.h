/* airlight.h -- light that lamps scatter once towards the eye along one ray, as a scene and as a number: the scene is
 * built by the public interface, the number by adaptive quadrature in double, with shadows found by brute force. What
 * the tests of the strategies share.
 *
 * The ray runs along +x from `eye`. All that goes into a scene is float here already, so that both sides compute with
 * the same numbers.
 */
#ifndef AIRLIGHT_H
#define AIRLIGHT_H

#include "brume.h"

enum { AIR_LAMPS = 12, AIR_BALLS = 4 };

typedef struct air_lamp {
    brume_light_kind kind; /* point, spot or directional */
    float position[3];
    float toward[3];       /* spot, directional: direction of the axis; along a coordinate axis, to be exact in float */
    float intensity;
    float cutoff, beam;    /* degrees */
} air_lamp;

/* A sphere, or with `disk` a disk across the y axis. */
typedef struct air_ball {
    int disk;
    float center[3], radius;
} air_ball;

/* What lies before a spot, over the square about its cone: u grows along the x of its frame, v along the y. */
typedef struct air_gobo {
    int size, nearest;   /* else bilinear, going round at the rim */
    const float *texels; /* size x size x 3. Copied. */
} air_gobo;

typedef struct airlight {
    const char *name;
    float eye[3];
    float length;               /* to a black wall; 0: there is none */
    float sigma_t[3], albedo, g;
    air_lamp lamps[AIR_LAMPS];  /* up to the first of intensity 0 */
    const air_gobo *gobo;       /* of all spots, or NULL */
    air_ball balls[AIR_BALLS];  /* up to the first of radius 0 */
    const float *triangles;     /* black, 9 floats each; copied */
    int triangle_count;
    int bounded;                /* fog in the box only, behind a null boundary */
    float box[6];               /* low x, y, z, high x, y, z */
} airlight;

/* For initializers. Spots shine along +z. */
#define GREY(s) {s, s, s}
#define POINT(x, y, z, i) {BRUME_LIGHT_POINT, {x, y, z}, {0, 0, 1}, i, 0, 0}
#define SPOT(x, y, z, i, cutoff, beam) {BRUME_LIGHT_SPOT, {x, y, z}, {0, 0, 1}, i, cutoff, beam}

/* With camera, film, integrator and all; the samples are independent. Destroyed by the caller. */
brume_scene *airlight_scene(const airlight *a, uint32_t samples);

/* Radiance of a channel, to 1e-9 relative or better. */
double airlight_expected(const airlight *a, int channel);

/* The same over the part of the ray between the two distances. */
double airlight_between(const airlight *a, int channel, double from, double to);

#endif

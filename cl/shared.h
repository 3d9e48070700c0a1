/* shared.h -- the arrays that the host uploads, as both sides see them. The only file that host and device include.
 *
 * Structs hold 4-byte scalars and arrays of them only (no vector types, pointers, bool, enum or size_t), and their
 * sizes are multiples of 16, so that every compiler lays them out alike; SIZE_IS makes each of them prove it. The side
 * is declared (-DBRUME_DEVICE), not sniffed.
 *
 * Ids are indices into these arrays, -1 for none. Distances are scene units, radiometric quantities are linear RGB
 * (Rec. 709 primaries), angles are radians.
 */
#ifndef BRUME_SHARED_H
#define BRUME_SHARED_H

#ifdef BRUME_DEVICE
typedef uint b_uint;
#else
#include <stdint.h>
typedef uint32_t b_uint;
#endif

/* Fails to compile where the size is another. */
#define SIZE_IS(type, bytes) typedef char type##_size[sizeof(type) == (bytes) ? 1 : -1]

/* What the scene calls for: code that a scene doesn't need is not compiled (-DFEATURES=...). */
#define FEATURE_MEDIA 1        /* any participating medium */
#define FEATURE_NULL 2         /* null surfaces: shadow rays walk through medium boundaries */
#define FEATURE_QUADRICS 4     /* spheres and disks next to triangles */
#define FEATURE_DELTA_LIGHTS 8 /* point, spot, directional */
#define FEATURE_AREA_LIGHTS 16 /* emitting surfaces */
#define FEATURE_ENVIRONMENT 32 /* constant or envmap */
#define FEATURE_SPECULAR 64    /* any BSDF besides diffuse and null */
#define FEATURE_TEXTURES 128
#define FEATURE_GUIDES 256     /* first-hit albedo, normal and depth are recorded */
#define FEATURE_MANY_LIGHTS 512 /* a light tree */
#define FEATURE_FLIGHTS 1024   /* paths scatter in media, and go on from there */
#define FEATURE_CHROMATIC 2048 /* extinction that differs between colours */
#define FEATURE_ANISOTROPY 4096 /* media with a mean cosine other than 0 */
#define FEATURE_SCATTERING 8192 /* media that scatter: else they only absorb and glow, exactly */
#define FEATURE_LIGHT_LAYERS 16384 /* light in parts (light_layers.h); only together with GUIDES */
#define FEATURE_ALL 32767

/* Which estimators are compiled (-DSTRATEGY=..., -DINDIRECT=...): the numbers of brume.h. */
#define STRATEGY_AUTO 0
#define STRATEGY_SPHERICAL 1
#define STRATEGY_DISTANCE 2
#define STRATEGY_EQUIANGULAR 3
#define STRATEGY_EQUIANGULAR_CONE 4
#define STRATEGY_MIS 5
#define STRATEGY_PRODUCT 6
#define STRATEGY_SYSTEMATIC 7
#define STRATEGY_RASTER 8
#define INDIRECT_AUTO 0
#define INDIRECT_PHASE 1
#define INDIRECT_MIXTURE 2
#define INDIRECT_RAY_LIGHTS 3

/* ---- geometry ------------------------------------------------------------------------------------------------- */

/* BVH8 node, 256 bytes. Empty slots have lo = 1e30, hi = -1e30 and follow the used ones. child >= 0 is a node;
 * child < 0 is a leaf of (code & 7) + 1 blocks from block code >> 4 on, where code = ~child. With code & 8 they are
 * blocks of quadrics, eight places of quadric_ids[] each (from place 8 * (code >> 4), -1 where unused), else blocks of
 * triangles. Used places of a leaf come first. A leaf never mixes the two. */
typedef struct {
    float lo_x[8], hi_x[8], lo_y[8], hi_y[8], lo_z[8], hi_z[8];
    int child[8];
    int pad[8];
} b_node;
SIZE_IS(b_node, 256);

/* Eight triangles as rows of floats. Padding lanes have prim = -1 and NaN vertices, which no test accepts. */
typedef struct {
    float v0[3][8], v1[3][8], v2[3][8];
    int prim[8]; /* index into b_triangle[] */
} b_triangle_block;
SIZE_IS(b_triangle_block, 320);

/* Shading data of a triangle: global vertex numbers and its shape. */
typedef struct {
    int v[3];
    int shape;
} b_triangle;
SIZE_IS(b_triangle, 16);

#define QUADRIC_SPHERE 0
#define QUADRIC_DISK 1

/* Sphere: centre, radius; flipped normals are the shape's flag. Disk: centre, the two half axes du, dv, unit normal n.
 * Spheres use du, dv, n as the unit object axes x, y, z (for texture coordinates). A prim id >= the triangle count is
 * quadric (prim - triangle_count). */
typedef struct {
    float center[3];
    float radius;
    float du[3];
    int kind;
    float dv[3];
    int shape;
    float n[3];
    int pad;
} b_quadric;
SIZE_IS(b_quadric, 64);

#define SHAPE_FLIP_NORMALS 1 /* the normal points the other way */
#define SHAPE_BOUNDARY 2     /* crossing it changes the medium: interior behind the normal, exterior before it */

typedef struct {
    int bsdf;
    int flags;
    int interior, exterior; /* medium ids */
    float radiance[3];      /* emitted on the normal's side; 0 for none */
    int emits;
    int normal_base;        /* add to a vertex number to index normals[]; INT_MIN: no vertex normals */
    int uv_base;            /* the same for uvs[]; INT_MIN: none */
    int pad[2];
} b_shape;
SIZE_IS(b_shape, 48);
#define NO_BASE (-2147483647 - 1)

/* ---- surfaces ------------------------------------------------------------------------------------------------- */

#define BSDF_DIFFUSE 0
#define BSDF_DIELECTRIC 1
#define BSDF_CONDUCTOR 2
#define BSDF_ROUGH_CONDUCTOR 3
#define BSDF_NULL 4
#define BSDF_THIN_DIELECTRIC 5

#define BSDF_TWO_SIDED 1    /* seen from behind it is bsdf `back`, mirrored */
#define BSDF_BECKMANN 2     /* else GGX */
#define BSDF_SAMPLE_ALL 4   /* sample all normals instead of the visible ones */

typedef struct {
    int kind, flags;
    int back;               /* bsdf id for the back side of a two-sided one (may be itself) */
    int texture;            /* of reflectance, or -1 */
    float reflectance[3];   /* diffuse reflectance or specular_reflectance */
    float alpha_u;
    float transmittance[3]; /* specular_transmittance */
    float alpha_v;
    float eta[3];           /* conductor */
    float ior;              /* dielectrics: interior / exterior */
    float k[3];
    int pad;
} b_bsdf;
SIZE_IS(b_bsdf, 80);

#define TEXTURE_BITMAP 0
#define TEXTURE_CHECKERBOARD 1
#define TEXTURE_NEAREST 1    /* else bilinear */
#define TEXTURE_WRAP_REPEAT 0
#define TEXTURE_WRAP_CLAMP 1
#define TEXTURE_WRAP_MIRROR 2

/* uv' = to_uv [u v 1]; v' = 0 is the first texel row. Texels: float RGB triples from texels[3 * first], row-major. */
typedef struct {
    int kind, filter, wrap;
    int width, height;
    int first;
    int pad[2];
    float to_uv[6];
    float color0[3], color1[3];
} b_texture;
SIZE_IS(b_texture, 80);

/* ---- media ---------------------------------------------------------------------------------------------------- */

typedef struct {
    float sigma_t[3]; /* extinction per unit length */
    float g;          /* Henyey-Greenstein mean cosine; 0 is isotropic */
    float albedo[3];  /* single-scattering albedo sigma_s / sigma_t */
    int pad0;
    float emission[3]; /* radiance per unit length */
    int pad1;
} b_medium;
SIZE_IS(b_medium, 48);

/* ---- lights --------------------------------------------------------------------------------------------------- */

#define LIGHT_POINT 0
#define LIGHT_SPOT 1
#define LIGHT_DIRECTIONAL 2

/* A light without extent. Spot: 1 inside the half angle `beam`, falling linearly in the angle to 0 at `cutoff`. */
typedef struct {
    float position[3];
    int kind;
    float intensity[3];   /* W/sr; directional: irradiance on a surface that faces it */
    int texture;          /* spot: gobo, or -1 */
    float axis[3];        /* unit: where a spot points, where directional light travels */
    float cutoff, beam;   /* half angles */
    float inv_fade;       /* 1 / (cutoff - beam), or a huge number where they are equal */
    float v_cutoff;       /* 2 sin^2(cutoff / 2) = 1 - cos cutoff, rounded once from double */
    float v_beam;
    float frame_x[3];     /* the light's own x and y axes in the world, for the gobo */
    float tan_cutoff;
    float frame_y[3];
    float solid_angle;    /* integral of the falloff: power / intensity; directional: 0 */
    int medium;           /* that it stands in, -1 none; with null surfaces */
    int pad[3];
} b_light;
SIZE_IS(b_light, 112);

/* Where lamps are many, those with a place stand in the order of a tree's leaves, directional ones after them. The tree
 * is blocks of up to sixteen clusters of lamps, as rows; unused places have flux 0. The root is block 0. child > 0: the
 * block with the cluster's parts. child < 0: a leaf of code % LIGHT_LEAF_BLOCKS + 1 blocks from block
 * code / LIGHT_LEAF_BLOCKS on, where code = ~child. In a leaf's blocks each cluster is a lamp, and child its number. */
#define LIGHT_BLOCK 16
#define LIGHT_LEAF_BLOCKS 64
typedef struct {
    float x[LIGHT_BLOCK], y[LIGHT_BLOCK], z[LIGHT_BLOCK];
    float radius[LIGHT_BLOCK];    /* the lamps stand within it of the place */
    float axis_x[LIGHT_BLOCK], axis_y[LIGHT_BLOCK], axis_z[LIGHT_BLOCK];
    float versine[LIGHT_BLOCK];   /* they shine within an angle of the axis: 1 - cos of it, 2 for everywhere */
    float flux[LIGHT_BLOCK];      /* luminance of intensity times solid angle; of all lamps together: 1 */
    int child[LIGHT_BLOCK];
} b_light_block;
SIZE_IS(b_light_block, 640);

#define EMITTER_TRIANGLE 0
#define EMITTER_SPHERE 1
#define EMITTER_DISK 2

/* A piece of an emitting surface. Chosen with probability p = cdf[i+1] - cdf[i], proportional to area * radiance. */
typedef struct {
    int kind;
    int prim;  /* as in hits: a triangle, or triangle_count + quadric */
    int shape;
    float area;
} b_emitter;
SIZE_IS(b_emitter, 16);

#define ENVIRONMENT_NONE 0
#define ENVIRONMENT_CONSTANT 1
#define ENVIRONMENT_MAP 2

/* ---- the rest: one struct of uniform values --------------------------------------------------------------------- */

#define SAMPLER_SOBOL 0       /* Owen-scrambled */
#define SAMPLER_INDEPENDENT 1

typedef struct {
    /* sensor: to_world as rows x, y, z of the axes (left, up, forward) and the origin */
    float camera_x[3], camera_y[3], camera_z[3], camera_o[3];
    float tan_x, tan_y;          /* half extents of the full image plane at distance 1 */
    float near_clip, far_clip;   /* along the axis; rays start at the one and end at the other */
    float aperture_radius;       /* 0: pinhole */
    float focus_distance;
    int sensor_medium;
    int sampler;

    /* film: full size, and the crop that is rendered */
    int width, height;
    int crop_x, crop_y, crop_width, crop_height;
    float filter_radius;         /* pixels; 0.5 with a box */
    int filter_size;             /* entries of filter[] - 1, 0: box */
    float filter_weight;         /* (integral of |f| / integral of f)^2, both axes: what a sample of sign 1 counts */

    /* integrator */
    int max_depth;               /* path edges; 2^30 for no limit */
    int rr_depth;
    int hide_emitters;
    int ignore_media;
    b_uint seed;

    /* counts */
    int triangle_count, quadric_count;
    int light_count, emitter_count, medium_count;
    float emitter_weight;        /* sum over emitters of area * luminance of radiance */

    /* environment */
    int environment;
    float environment_radiance[3];
    int environment_width, environment_height; /* texels; the map's row 0 is its top (+y) */
    int environment_first;       /* first texel, in triples, in texels[] */
    int environment_cdf;         /* marginal of height + 1 entries, then height conditionals of width + 1, in cdf[] */
    float environment_to_local[9]; /* world to map, row-major */
    float environment_to_world[9];

    /* scene scale, for offsets and epsilons */
    float scene_center[3];
    float scene_radius;
    int emitter_cdf;             /* first of emitter_count + 1 entries in cdf[] */
    int surfaces_emit;           /* any light that a scattered ray can meet: emitter, environment or emitting medium */

    int positions;               /* on a segment, for STRATEGY_SYSTEMATIC and RASTER; 1 to 64 */
    int lamp_cdf;                /* first of light_count + 1 entries in cdf[]: lamps by power, directional ones never */
    int has_null, has_specular;  /* FEATURE_NULL, FEATURE_SPECULAR of the scene: a program may be built for more */
    int light_tree_blocks;       /* 0: lamps are few, and all are looked at */
    int light_tree_lamps;        /* the first ones, which the tree has */
    float light_tree_scale;      /* 1 / luminous flux of those */
    float clamp;                 /* most radiance that a sample counts, per channel; infinite: no clamp */
    int single_scattering;       /* media scatter only what comes straight from a light */
    int rays_share;              /* with paths what a medium sends into a medium: rays of light don't find all of it */
    float survival;              /* in roulette, of a path of throughput 1 */
    int pad;
} b_params;
SIZE_IS(b_params, 336);

/* ---- film ------------------------------------------------------------------------------------------------------- */

/* Planes of one float per pixel slot. A pixel's slot: tile by tile as laid out by lib/film.c. Sums of radiance are
 * pairs of floats (film.h), so that any number of samples adds up and splitting a render never changes the result. */
#define FILM_SUM_R 0
#define FILM_SUM_G 1
#define FILM_SUM_B 2
#define FILM_REST_R 3
#define FILM_REST_G 4
#define FILM_REST_B 5
#define FILM_SQUARE_R 6
#define FILM_SQUARE_G 7
#define FILM_SQUARE_B 8
#define FILM_COUNT 9       /* samples added */
#define FILM_PLANES 10
#define FILM_ALBEDO_R 10   /* from here on with FEATURE_GUIDES only; one plane each */
#define FILM_ALBEDO_G 11
#define FILM_ALBEDO_B 12
#define FILM_NORMAL_X 13
#define FILM_NORMAL_Y 14
#define FILM_NORMAL_Z 15
#define FILM_DEPTH 16
#define FILM_HIT_COUNT 17  /* samples with a first hit, for the mean depth */
#define FILM_ALPHA 18      /* samples that met a surface, a scatterer or an environment */
#define FILM_GUIDE_PLANES 19
#define FILM_SURFACE_DIRECT 19 /* from here on with FEATURE_LIGHT_LAYERS only: three planes each */
#define FILM_SURFACE_INDIRECT 22
#define FILM_VOLUME_DIRECT 25
#define FILM_VOLUME_INDIRECT 28
#define FILM_SEGMENTS 31       /* of paths, traced */
#define FILM_LAYER_PLANES 32

/* How a lamp's visibility along a pixel's camera rays is found (STRATEGY_AUTO): one byte per lamp, up to EVERY_LAMP,
 * and pixel slot, lamp by lamp. Written by a pilot sample that adds nothing to the film. */
#define EVERY_LAMP 8     /* so few lamps are all looked at along a camera ray */
#define PLAN_UNKNOWN 0  /* the pilot's ray did not cross its light: a walk finds out whether anything hides it */
#define PLAN_INTEGRAL 1 /* nothing is near to hide the lamp: the integral, less what one ray finds hidden after all */
#define PLAN_RASTER 2   /* several points, one walk for all of them */
#define PLAN_RAYS_2 3   /* some points, a shadow ray each */
#define PLAN_RAYS_4 4
#define PLAN_RAYS_8 5
#define PLAN_ONE 6      /* one point: all is hidden; four where samples were placed for what the pilot overlooked */
#define PILOT_SAMPLE 0xfffffff0u /* its index: no other sample has it */

/* What a launch of the kernel does besides rendering the same samples of every pixel of some tiles: bits. */
#define LAUNCH_PILOT 1
#define LAUNCH_ADAPTIVE 2
#define LAUNCH_CHOSEN 4 /* the pixels were chosen for their error */

/* What a path did on one segment and at its end, written by a program built with -DTRACE (trace.h). */
#define TRACE_ROOM 4096  /* vertices: MAX_SEGMENTS of path.h */
#define TRACE_ALONG 0    /* radiance has what the medium gave along the segment: emission, light of lamps */
#define TRACE_MET 1      /* and the emission of the surface or sky that was met */
#define TRACE_LIT 2      /* and the light sampled at the vertex */
#define TRACE_STAGES 3
#define TRACE_NOTHING 0  /* event: there is no such vertex */
#define TRACE_ESCAPED 1
#define TRACE_SCATTERED 2
#define TRACE_SURFACE 3
#define TRACE_PASSED 4   /* a null surface */
#define TRACE_ABSORBED 5 /* nothing gets through the segment */
typedef struct {
    float position[3];
    int event;
    float direction[3];  /* of the segment */
    float length;
    float before[3];     /* throughput at its start, and beyond the vertex */
    int medium;          /* that it runs through, -1 none */
    float after[3];
    int shape;           /* at a surface, else -1 */
    float radiance[TRACE_STAGES][3]; /* sums so far */
    float pdf;           /* of the direction, per steradian; negative where no light sampling competes */
    int ends;            /* the path ends here */
    int pad;
} b_trace_vertex;
SIZE_IS(b_trace_vertex, 112);

/* Samples that came out NaN or infinite are dropped and counted: [0] how many, [1] pixel y * width + x of one of them,
 * [2] its sample index. */
#define BAD_COUNT 0
#define BAD_PIXEL 1
#define BAD_SAMPLE 2
#define BAD_SIZE 4

#endif

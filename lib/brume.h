/* brume.h -- a renderer for light in fog: the C interface, and its reference manual.
 *
 * The way data goes: a scene description (built call by call, or read from a Mitsuba 3 XML file) -> a render (the
 * scene's arrays uploaded to an OpenCL device, the kernels built for what the scene calls for) -> samples -> the
 * film's channels, or a picture file.
 *
 *     brume_context *context;  brume_device *device;  brume_scene *scene;  brume_render *render;
 *     brume_context_create(&context);
 *     brume_device_open(context, BRUME_DEVICE_ANY, &device);
 *     brume_scene_load(context, "fog.xml", NULL, 0, &scene);
 *     brume_render_desc desc = brume_render_desc_default();
 *     brume_render_create(device, scene, &desc, &render);
 *     brume_render_run(render, NULL, NULL);
 *     brume_render_write(render, "fog.exr", NULL);
 *
 * Rules for every call:
 *  - A call that can fail returns a brume_result; anything but BRUME_OK leaves its out-parameters untouched and puts
 *    one line of detail in brume_context_message(). The library never exits, prints, or asserts on what it is given.
 *  - Any of them may fail with BRUME_ERROR_ARGUMENT (a NULL that isn't said to be allowed, a value out of the range
 *    that is stated, an id that the scene doesn't have) and BRUME_ERROR_MEMORY. What else stands with the call.
 *  - Every pointer passed in is copied from during the call and belongs to the caller, unless said otherwise.
 *  - Descriptors come from brume_..._default(); one that doesn't (all zero, say) is refused with BRUME_ERROR_ARGUMENT.
 *  - destroy accepts NULL, and objects may be destroyed in any order: each keeps alive what it was made from.
 *  - One context, and what is made from it, is used by one thread at a time; several contexts are independent.
 *    brume_render_cancel() is the exception: any thread, or a signal handler, may call it.
 *
 * Units: scene units for lengths, degrees for angles, seconds for times, linear RGB (Rec. 709 primaries) for colours;
 * radiance in W / (m^2 sr), or whatever the lamps are given in; matrices are 4x4, row-major, and act on column vectors.
 * Conventions are Mitsuba 3's: sensors and spots look along +z, a sensor's +x is to the left of the picture, y is up.
 */
#ifndef BRUME_H
#define BRUME_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#if defined(_WIN32) && defined(BRUME_BUILD_DLL)
#define BRUME_API __declspec(dllexport)
#elif defined(__GNUC__) && !defined(_WIN32)
#define BRUME_API __attribute__((visibility("default")))
#else
#define BRUME_API
#endif

#define BRUME_VERSION "0.1.0"

/* What brume_result values mean; brume_result_name() names them. */
typedef enum brume_result {
    BRUME_OK = 0,
    BRUME_ERROR_ARGUMENT = 1,  /* a NULL, a value out of range, a call out of order: the caller's mistake */
    BRUME_ERROR_MEMORY = 2,    /* host or device memory ran out */
    BRUME_ERROR_SCENE = 3,     /* a scene file, or a file it names, is missing or wrong */
    BRUME_ERROR_NO_DEVICE = 4, /* no OpenCL platform or device, or not the one asked for */
    BRUME_ERROR_DEVICE = 5,    /* an OpenCL call failed */
    BRUME_ERROR_BUILD = 6,     /* the kernels did not compile; the whole log is in the message */
    BRUME_ERROR_OUTPUT = 7,    /* a file could not be written */
    BRUME_CANCELLED = 8,       /* stopped by brume_render_cancel or a progress callback; the film is valid */
    BRUME_ERROR_CHECKPOINT = 9, /* a checkpoint is missing or damaged, or of another render */
    BRUME_ERROR_DENOISER = 10  /* Open Image Denoise is not installed, or failed */
} brume_result;

/* "out of memory" and so on: a constant; "unknown result" for other numbers. */
BRUME_API const char *brume_result_name(brume_result result);

/* The id of nothing: no texture, no medium, no back side. */
#define BRUME_NONE UINT32_MAX

/* ---- context --------------------------------------------------------------------------------------------------- */

typedef struct brume_context brume_context;

typedef enum brume_log_level { BRUME_LOG_ERROR = 0, BRUME_LOG_WARNING = 1, BRUME_LOG_INFO = 2 } brume_log_level;

/* `message` is one line without a newline (a build log may hold several), valid during the call. `user` is what
 * brume_context_set_log was given. Called by the thread that uses the context, from within the library's calls. */
typedef void (*brume_log_callback)(void *user, brume_log_level level, const char *message);

/* *out is the caller's to destroy; what is made from it may outlive that. */
BRUME_API brume_result brume_context_create(brume_context **out);
BRUME_API void brume_context_destroy(brume_context *context);

/* Where errors, warnings and information go; NULL (the default) for nowhere. `user` is kept, not copied. */
BRUME_API void brume_context_set_log(brume_context *context, brume_log_callback callback, void *user);

/* Detail of the last failed call on this context or anything made from it; "" before the first. Valid until the next
 * failed call. */
BRUME_API const char *brume_context_message(const brume_context *context);

/* ---- devices --------------------------------------------------------------------------------------------------- */

typedef struct brume_device brume_device;

typedef struct brume_device_info {
    char name[128];
    char platform[128];
    char driver[64];
    uint32_t is_gpu;     /* 0 or 1 */
    uint32_t compute_units;
    uint64_t memory_bytes; /* global memory */
    uint32_t has_double; /* cl_khr_fp64: 0 or 1 */
    uint32_t lanes;      /* paths per work-item that suit the device: 1 on GPUs, else 8 or 16 */
} brume_device_info;

/* The first GPU, else PoCL, else the first CPU device. */
#define BRUME_DEVICE_ANY UINT32_MAX

/* How many OpenCL devices there are; 0 without a platform. Indices are stable while drivers don't change. A driver that
 * fails is passed over with a warning, unless there is no other: BRUME_ERROR_DEVICE. */
BRUME_API brume_result brume_device_count(brume_context *context, uint32_t *out);
/* index: from 0 on, or BRUME_DEVICE_ANY. Fails with BRUME_ERROR_NO_DEVICE if there is none, BRUME_ERROR_DEVICE if it
 * can't be asked. */
BRUME_API brume_result brume_device_describe(brume_context *context, uint32_t index, brume_device_info *out);
/* The same, and makes it ready for renders. *out is the caller's to destroy. */
BRUME_API brume_result brume_device_open(brume_context *context, uint32_t index, brume_device **out);
/* The same of a part of its cores: `part`, from 0 on, of `parts` that are as even as can be. Fails with
 * BRUME_ERROR_ARGUMENT if there are fewer cores than parts (up to 64), BRUME_ERROR_DEVICE if the driver cannot split it:
 * CPUs, mostly, can be. */
BRUME_API brume_result brume_device_open_part(brume_context *context, uint32_t index, uint32_t part, uint32_t parts,
                                              brume_device **out);
/* Several open devices of one context, up to 64, as one: they share each render, the faster ones doing more of it. Each
 * needs room for the whole scene and its picture, and gets a program of its own. The film is the same bits as that of
 * one device of their kind; where kinds differ, so may the last bits, by who rendered which pixel when. One that fails
 * is left out with a warning, until the next call of run; what it was at, the others do. *out keeps the devices open,
 * and is the caller's to destroy. A sample trace takes the first of them. */
BRUME_API brume_result brume_device_join(brume_device *const *devices, size_t count, brume_device **out);
/* As brume_device_describe, of an open device. Of several: all of their names, compute units in all, the least memory,
 * and what else all of them have. */
BRUME_API brume_result brume_device_get_info(const brume_device *device, brume_device_info *out);
BRUME_API void brume_device_destroy(brume_device *device);

/* ---- scene description ----------------------------------------------------------------------------------------- */

typedef struct brume_scene brume_scene;

/* An empty scene, to be filled by the calls below; *out is the caller's to destroy. */
BRUME_API brume_result brume_scene_create(brume_context *context, brume_scene **out);
BRUME_API void brume_scene_destroy(brume_scene *scene);

/* A scene-file parameter, <default name="..."> or $name in the file. */
typedef struct brume_parameter {
    const char *name;
    const char *value;
} brume_parameter;

/* Reads a Mitsuba 3 XML scene and the files that it names. `parameters` override the file's defaults; NULL with a count
 * of 0. Errors are BRUME_ERROR_SCENE with "file:line:column: what was expected"; a parameter that the file never uses
 * is one. *out is the caller's to destroy, and to go on describing. */
BRUME_API brume_result brume_scene_load(brume_context *context, const char *path, const brume_parameter *parameters,
                                        size_t parameter_count, brume_scene **out);

typedef struct brume_load_progress {
    const char *path; /* of the mesh that is being read */
    double fraction;  /* of it, 0 to 1 */
} brume_load_progress;

/* Called from within brume_scene_load a few times a second, while it reads a mesh that takes longer than that; `user` is
 * what brume_context_set_load_progress was given, `progress` is valid during the call. Non-zero ends the reading:
 * brume_scene_load returns BRUME_CANCELLED. */
typedef int (*brume_load_callback)(void *user, const brume_load_progress *progress);

/* NULL (the default): nobody is told. `user` is kept, not copied. */
BRUME_API void brume_context_set_load_progress(brume_context *context, brume_load_callback callback, void *user);

/* Every descriptor starts with a cookie that only its default function sets; what a field's comment ends with is its
 * default. Ids count from 0 in the order of the calls, each kind for itself; an out_id may be NULL where the id isn't
 * wanted. A description that is refused leaves the scene as it was. */

typedef enum brume_texture_kind { BRUME_TEXTURE_BITMAP = 0, BRUME_TEXTURE_CHECKERBOARD = 1 } brume_texture_kind;
typedef enum brume_texture_filter { BRUME_FILTER_BILINEAR = 0, BRUME_FILTER_NEAREST = 1 } brume_texture_filter;
typedef enum brume_texture_wrap {
    BRUME_WRAP_REPEAT = 0,
    BRUME_WRAP_CLAMP = 1,
    BRUME_WRAP_MIRROR = 2
} brume_texture_wrap;

/* A picture or pattern over texture coordinates (u, v). */
typedef struct brume_texture_desc {
    uint32_t cookie;
    brume_texture_kind kind;     /* BITMAP */
    uint32_t width, height;      /* of texels */
    const float *texels;         /* height x width x 3, linear, row 0 first; v = 0 is the top of row 0. Copied. */
    brume_texture_filter filter; /* BILINEAR */
    brume_texture_wrap wrap;     /* REPEAT */
    float color0[3], color1[3];  /* checkerboard: 0.4 where both fractions are on the same side of 1/2, else 0.2 */
    float to_uv[6];              /* rows of a 2x3 matrix on (u, v, 1); identity */
} brume_texture_desc;

BRUME_API brume_texture_desc brume_texture_desc_default(void);
BRUME_API brume_result brume_scene_add_texture(brume_scene *scene, const brume_texture_desc *desc, uint32_t *out_id);

typedef enum brume_bsdf_kind {
    BRUME_BSDF_DIFFUSE = 0,
    BRUME_BSDF_DIELECTRIC = 1,      /* smooth refracting boundary */
    BRUME_BSDF_CONDUCTOR = 2,       /* smooth metal */
    BRUME_BSDF_ROUGH_CONDUCTOR = 3, /* microfacet metal (Walter et al. 2007) */
    BRUME_BSDF_NULL = 4,            /* invisible: the boundary of a medium */
    BRUME_BSDF_THIN_DIELECTRIC = 5  /* a pane: reflects, and lets through without a bend */
} brume_bsdf_kind;

typedef enum brume_distribution { BRUME_DISTRIBUTION_BECKMANN = 0, BRUME_DISTRIBUTION_GGX = 1 } brume_distribution;

typedef struct brume_bsdf_desc {
    uint32_t cookie;
    brume_bsdf_kind kind;            /* DIFFUSE */
    float reflectance[3];            /* diffuse: 0.5; others: specular_reflectance, 1 */
    uint32_t reflectance_texture;    /* overrides reflectance unless BRUME_NONE */
    float transmittance[3];          /* dielectrics: specular_transmittance, 1 */
    float int_ior, ext_ior;          /* dielectrics: 1.5046 (BK7 glass), 1.000277 (air) */
    float eta[3], k[3];              /* conductors: complex index eta - i k; 0, 1 (a perfect mirror) */
    brume_distribution distribution; /* BECKMANN */
    float alpha_u, alpha_v;          /* rough: RMS microfacet slope along the tangents, > 0; 0.1 */
    uint32_t sample_visible;         /* rough: sample visible normals; 1 */
    uint32_t two_sided;              /* reflect on both sides; 0: black from behind */
    uint32_t back;                   /* two-sided: the bsdf seen from behind; BRUME_NONE: this one */
} brume_bsdf_desc;

BRUME_API brume_bsdf_desc brume_bsdf_desc_default(brume_bsdf_kind kind);
BRUME_API brume_result brume_scene_add_bsdf(brume_scene *scene, const brume_bsdf_desc *desc, uint32_t *out_id);

/* A homogeneous participating medium. Phase function: Henyey & Greenstein 1941. */
typedef struct brume_medium_desc {
    uint32_t cookie;
    float sigma_t[3];  /* extinction per scene unit, >= 0; 1 */
    float albedo[3];   /* sigma_s / sigma_t, in [0, 1]; 0.75 */
    float emission[3]; /* radiance emitted per scene unit, >= 0; 0 */
    float g;           /* mean cosine, in (-1, 1); > 0 is forward; 0 is isotropic */
} brume_medium_desc;

BRUME_API brume_medium_desc brume_medium_desc_default(void);
BRUME_API brume_result brume_scene_add_medium(brume_scene *scene, const brume_medium_desc *desc, uint32_t *out_id);

typedef enum brume_light_kind {
    BRUME_LIGHT_POINT = 0,
    BRUME_LIGHT_SPOT = 1,
    BRUME_LIGHT_DIRECTIONAL = 2,
    BRUME_LIGHT_CONSTANT = 3, /* environment: the same radiance from everywhere */
    BRUME_LIGHT_ENVMAP = 4    /* environment: a latitude-longitude map */
} brume_light_kind;

/* A light that is not a surface. A scene has at most one environment. */
typedef struct brume_light_desc {
    uint32_t cookie;
    brume_light_kind kind;  /* as given to the default function */
    float to_world[16];     /* identity; spot and directional light travels along +z; a point sits at the origin */
    float intensity[3];     /* point, spot: W/sr; directional: irradiance on a facing surface; constant: radiance; 1 */
    float cutoff_angle;     /* spot: half angle beyond which there is no light, in (0, 180]; 20 */
    float beam_width;       /* spot: half angle inside which light is full, in [0, cutoff]; 0.75 cutoff if < 0: -1 */
    uint32_t texture;       /* spot: gobo over the square that circumscribes the cone; BRUME_NONE */
    uint32_t width, height; /* envmap */
    const float *texels;    /* envmap: height x width x 3, row 0 is +y. Copied. */
    float scale;            /* envmap: factor on the texels, which then are radiance; 1 */
} brume_light_desc;

BRUME_API brume_light_desc brume_light_desc_default(brume_light_kind kind);
BRUME_API brume_result brume_scene_add_light(brume_scene *scene, const brume_light_desc *desc, uint32_t *out_id);

typedef enum brume_shape_kind {
    BRUME_SHAPE_MESH = 0,
    BRUME_SHAPE_RECTANGLE = 1, /* [-1, 1]^2 in the plane z = 0, normal +z */
    BRUME_SHAPE_CUBE = 2,      /* [-1, 1]^3, normals outwards */
    BRUME_SHAPE_SPHERE = 3,    /* `radius` about `center` (then to_world, which must scale evenly) */
    BRUME_SHAPE_DISK = 4       /* unit disk in z = 0, normal +z */
} brume_shape_kind;

/* A surface. With media it should be closed: interior lies behind its normal, exterior before it. */
typedef struct brume_shape_desc {
    uint32_t cookie;
    brume_shape_kind kind;     /* MESH */
    float to_world[16];        /* identity */
    uint32_t vertex_count;     /* mesh */
    const float *positions;    /* mesh: vertex_count x 3. Copied. */
    const float *normals;      /* mesh: vertex_count x 3, or NULL for face normals. Copied. */
    const float *uvs;          /* mesh: vertex_count x 2, or NULL. Copied. */
    uint32_t triangle_count;   /* mesh */
    const uint32_t *triangles; /* mesh: triangle_count x 3 vertex numbers, counter-clockwise from outside. Copied. */
    float center[3];           /* sphere; 0 */
    float radius;              /* sphere; 1 */
    uint32_t flip_normals;     /* 0 */
    uint32_t bsdf;             /* BRUME_NONE: diffuse 0.5, or black if it emits */
    uint32_t interior;         /* medium behind the normal; BRUME_NONE */
    uint32_t exterior;         /* medium before the normal; BRUME_NONE */
    uint32_t is_boundary;      /* crossing it sets the medium even if both are BRUME_NONE; set when either is given */
    float radiance[3];         /* emitted to the normal's side, >= 0; 0 */
} brume_shape_desc;

BRUME_API brume_shape_desc brume_shape_desc_default(brume_shape_kind kind);
BRUME_API brume_result brume_scene_add_shape(brume_scene *scene, const brume_shape_desc *desc, uint32_t *out_id);

typedef enum brume_fov_axis {
    BRUME_FOV_X = 0, BRUME_FOV_Y = 1, BRUME_FOV_DIAGONAL = 2, BRUME_FOV_SMALLER = 3, BRUME_FOV_LARGER = 4
} brume_fov_axis;

/* The camera: a pinhole, or a thin lens if aperture_radius > 0. */
typedef struct brume_sensor_desc {
    uint32_t cookie;
    float to_world[16];         /* identity; no scale */
    float fov;                  /* full angle along fov_axis, in (0, 180); 39.3077 (50 mm on 35 mm film) */
    brume_fov_axis fov_axis;    /* X */
    float near_clip, far_clip;  /* depths between which anything is seen, 0 < near < far; 0.01, 10000 */
    float aperture_radius;      /* 0 */
    float focus_distance;       /* depth of the plane in focus; used with a lens only; 1 */
    uint32_t medium;            /* that the camera stands in; BRUME_NONE */
} brume_sensor_desc;

BRUME_API brume_sensor_desc brume_sensor_desc_default(void);
BRUME_API brume_result brume_scene_set_sensor(brume_scene *scene, const brume_sensor_desc *desc);

typedef enum brume_rfilter {
    BRUME_RFILTER_BOX = 0,
    BRUME_RFILTER_TENT = 1,
    BRUME_RFILTER_GAUSSIAN = 2,
    BRUME_RFILTER_MITCHELL = 3,
    BRUME_RFILTER_CATMULLROM = 4,
    BRUME_RFILTER_LANCZOS = 5
} brume_rfilter;

typedef struct brume_film_desc {
    uint32_t cookie;
    uint32_t width, height;               /* full size in pixels, 1 to 65536; 768 x 576 */
    uint32_t crop_x, crop_y;              /* of the top left pixel; 0, 0 */
    uint32_t crop_width, crop_height;     /* 0: to the edge */
    brume_rfilter rfilter;                /* GAUSSIAN */
    float filter_radius;                  /* in pixels, up to 64; 0: the filter's own */
    float filter_stddev;                  /* gaussian: in pixels, 0.001 to 16, cut at 4 of them; 0.5 */
    float filter_b, filter_c;             /* mitchell: in [0, 1]; 1/3, 1/3 */
    uint32_t filter_lobes;                /* lanczos: 1 to 16; 3 */
    uint32_t half;                        /* EXR radiance in 16 bits; 1 */
    uint32_t alpha;                       /* write an alpha channel (BRUME_CHANNEL_ALPHA; needs guides); 0 */
} brume_film_desc;

BRUME_API brume_film_desc brume_film_desc_default(void);
BRUME_API brume_result brume_scene_set_film(brume_scene *scene, const brume_film_desc *desc);

typedef enum brume_sampler { BRUME_SAMPLER_SOBOL = 0, BRUME_SAMPLER_INDEPENDENT = 1 } brume_sampler;

/* How light that point-like lamps scatter towards the eye is estimated along a ray through a medium: a ladder from the
 * plainest way to the least noise. All are unbiased; they differ in error for a time. Numbers are stable. */
typedef enum brume_strategy {
    BRUME_STRATEGY_AUTO = 0,             /* per segment what suits it best; the default. At few samples a pixel at a
                                            shadow's edge can come out below 0: what is hidden is taken off the whole */
    BRUME_STRATEGY_SPHERICAL = 1,        /* uniform points, uniform directions; finds no lamp without extent at all */
    BRUME_STRATEGY_DISTANCE = 2,         /* a point in proportion to transmittance, light sampled there */
    BRUME_STRATEGY_EQUIANGULAR = 3,      /* a point equiangularly about the lamp (Kulla & Fajardo 2012) */
    BRUME_STRATEGY_EQUIANGULAR_CONE = 4, /* clipped to the spot's cone */
    BRUME_STRATEGY_MIS = 5,              /* and combined with truncated transmittance */
    BRUME_STRATEGY_PRODUCT = 6,          /* a point in proportion to all but visibility; no occluder: an integral */
    BRUME_STRATEGY_SYSTEMATIC = 7,       /* several evenly spaced such points with one common offset */
    BRUME_STRATEGY_RASTER = 8            /* the visibility of all of them found by one walk through the hierarchy */
} brume_strategy;

/* How light that scatters more than once in a medium is looked for. */
typedef enum brume_indirect {
    BRUME_INDIRECT_AUTO = 0,      /* RAY_LIGHTS; PHASE if the camera is in no fog and nothing is a spot; the default */
    BRUME_INDIRECT_PHASE = 1,     /* by paths that follow the phase function */
    BRUME_INDIRECT_MIXTURE = 2,   /* or turn towards a lamp now and then */
    BRUME_INDIRECT_RAY_LIGHTS = 3 /* by connections to rays of light from the lamps (Novak et al. 2012); PHASE where
                                     there are none: nothing but directional lamps */
} brume_indirect;

/* "equiangular-cone" and so on, as in scene files and on the command line; NULL for other numbers. */
BRUME_API const char *brume_strategy_name(brume_strategy strategy);
BRUME_API const char *brume_indirect_name(brume_indirect indirect);

typedef struct brume_integrator_desc {
    uint32_t cookie;
    int32_t max_depth;       /* path edges: 1 sees lights only, 2 adds one scattering event; -1 for no limit */
    int32_t rr_depth;        /* Russian roulette from this depth on; 5 */
    uint32_t hide_emitters;  /* camera rays go through emitting surfaces and see no environment; 0 */
    uint32_t ignore_media;   /* surfaces only; 0 */
    brume_sampler sampler;   /* SOBOL, and so from scene files, whatever they say */
    uint32_t sample_count;   /* per pixel; 16 */
    uint32_t seed;           /* 0 */
    brume_strategy strategy; /* AUTO */
    uint32_t positions;      /* of SYSTEMATIC and RASTER on a segment, a power of two up to 64; 0: what suits each */
    brume_indirect indirect; /* AUTO */
    uint32_t single_scattering; /* media scatter only what comes straight from a light; 0 */
} brume_integrator_desc;

BRUME_API brume_integrator_desc brume_integrator_desc_default(void);
BRUME_API brume_result brume_scene_set_integrator(brume_scene *scene, const brume_integrator_desc *desc);

/* What a scene file or the calls above have set so far, or the defaults. */
BRUME_API brume_result brume_scene_get_film(const brume_scene *scene, brume_film_desc *out);
BRUME_API brume_result brume_scene_get_integrator(const brume_scene *scene, brume_integrator_desc *out);

/* ---- effects: what a scene calls for ----------------------------------------------------------------------------- */

/* The kernels are built for what a scene calls for, and for nothing else: what it doesn't use costs neither time nor
 * memory nor compilation, and leaving its code out never changes a picture. Numbers are stable; a set of effects has
 * bit 1 << number.
 *
 * Some can be taken away from a scene that has them (brume_render_desc.without), which does change the picture. What
 * is left then is said with each; code that nothing else needs is not built either. The others are part of what the
 * scene is made of. */
typedef enum brume_effect {
    /* Any medium that does something. Without: all is clear, as with ignore_media. */
    BRUME_EFFECT_MEDIA = 0,
    /* A medium takes light away for good. Without: of its extinction only scattering is left, sigma_t albedo, and its
     * albedo is 1. */
    BRUME_EFFECT_ABSORPTION = 1,
    /* A medium glows. Without: its emission is 0. */
    BRUME_EFFECT_EMISSION = 2,
    /* A medium scatters light. Without: its albedo is 0; what it would scatter is lost. */
    BRUME_EFFECT_SCATTERING = 3,
    /* A medium scatters light that has been scattered or reflected before. Without: media scatter only what comes
     * straight from a lamp, an emitting surface, the environment or a glowing medium; surfaces reflect that, and all
     * else, as ever. The same as brume_integrator_desc.single_scattering. */
    BRUME_EFFECT_MULTIPLE_SCATTERING = 4,
    /* A medium scatters into some directions more than into others. Without: g is 0. */
    BRUME_EFFECT_ANISOTROPY = 5,
    /* A medium's extinction differs between colours. Without: sigma_t is its mean; albedo stays. */
    BRUME_EFFECT_CHROMATIC_EXTINCTION = 6,
    BRUME_EFFECT_BOUNDED_MEDIA = 7, /* a medium lies before or behind a surface */
    /* A surface stands in what a lamp's light reaches, and may hide the lamp from a scattering medium. */
    BRUME_EFFECT_BEAM_SHADOWS = 8,
    /* Lights. Without: they are removed. Surfaces that emitted keep what they reflect, and are black if they name no
     * bsdf. */
    BRUME_EFFECT_POINT_LIGHTS = 9,
    BRUME_EFFECT_SPOT_LIGHTS = 10,
    BRUME_EFFECT_DIRECTIONAL_LIGHTS = 11,
    BRUME_EFFECT_AREA_LIGHTS = 12,
    BRUME_EFFECT_ENVIRONMENT = 13,     /* constant or a map */
    BRUME_EFFECT_ENVIRONMENT_MAP = 14, /* part of the environment: goes with it */
    BRUME_EFFECT_MANY_LIGHTS = 15,     /* so many lamps that a tree chooses among them */
    /* Kinds of surfaces. */
    BRUME_EFFECT_DIFFUSE = 16,
    BRUME_EFFECT_DIELECTRIC = 17,
    BRUME_EFFECT_CONDUCTOR = 18,
    BRUME_EFFECT_ROUGH_CONDUCTOR = 19,
    BRUME_EFFECT_NULL_SURFACES = 20,
    /* Of surfaces, and gobos of spots. Without: the mean colour of the texels, or of a checkerboard's two colours. */
    BRUME_EFFECT_TEXTURES = 21,
    BRUME_EFFECT_QUADRICS = 22, /* spheres and disks */
    BRUME_EFFECT_LENS = 23      /* Without: a pinhole */
} brume_effect;

enum { BRUME_EFFECT_COUNT = 24 };

/* "multiple-scattering" and so on; NULL for other numbers. */
BRUME_API const char *brume_effect_name(brume_effect effect);
/* Whether brume_render_desc.without takes it. */
BRUME_API int brume_effect_removable(brume_effect effect);

typedef enum brume_object {
    BRUME_OBJECT_INTEGRATOR = 0,
    BRUME_OBJECT_SENSOR = 1,
    BRUME_OBJECT_MEDIUM = 2,
    BRUME_OBJECT_TEXTURE = 3,
    BRUME_OBJECT_BSDF = 4,
    BRUME_OBJECT_LIGHT = 5,
    BRUME_OBJECT_SHAPE = 6
} brume_object;

/* "medium" and so on; NULL for other numbers. */
BRUME_API const char *brume_object_name(brume_object object);

/* What is known of one effect in a scene. */
typedef struct brume_effect_report {
    uint32_t present;    /* the scene calls for it, after what `without` takes away */
    uint32_t taken_away; /* it would, if nothing had been taken away */
    uint32_t count;      /* of objects that call for it; 0 if absent, as the rest */
    brume_object object; /* the first of these: its kind, */
    uint32_t index;      /* its number, 0 for sensor and integrator, */
    char id[64];         /* the id that the scene file gives it, "" for none, */
    char where[192];     /* "file:line", "" if it doesn't come from a file, */
    char why[96];        /* and what it is that calls for it, as "sigma_t 0.1, 0.12, 0.15" */
} brume_effect_report;

/* What a scene calls for: a function of its description and of what `without` (a set of effects) takes away from it,
 * and of nothing else. *out_effects is the set; out_reports, the caller's, is filled with one for each effect in the
 * order of their numbers; NULL if they aren't wanted. */
BRUME_API brume_result brume_scene_effects(const brume_scene *scene, uint32_t without, uint32_t *out_effects,
                                           brume_effect_report out_reports[BRUME_EFFECT_COUNT]);

/* The parts of the kernels that are built or left out (brume_render_stats.features), by number: "media" and so on; NULL
 * from the first number that has none. A version of the library may number them otherwise than the one before; the
 * names stay. */
BRUME_API const char *brume_feature_name(uint32_t number);

/* ---- render ------------------------------------------------------------------------------------------------------ */

typedef struct brume_render brume_render;

typedef enum brume_precision { BRUME_PRECISION_FLOAT = 0, BRUME_PRECISION_DOUBLE = 1 } brume_precision;

/* Whether pixels get samples by their need, so that the picture's error falls fastest. How many a pixel gets is decided
 * by the errors around it and not by its own, so that its mean has no bias that could be measured. */
typedef enum brume_adaptive {
    BRUME_ADAPTIVE_AUTO = 0, /* with a noise threshold or a time limit, where it pays; the default */
    BRUME_ADAPTIVE_OFF = 1,  /* all pixels alike */
    BRUME_ADAPTIVE_ON = 2    /* with a sample count, too, which then is the mean over the pixels */
} brume_adaptive;

typedef struct brume_render_desc {
    uint32_t cookie;
    brume_precision precision; /* FLOAT */
    uint32_t lanes;            /* paths per work-item: 1, 4, 8, 16; 0: what suits the device */
    uint32_t guides;           /* record albedo, normal and depth; 1 */
    uint32_t light_layers;     /* record direct, indirect, surface and volume light, and segments: 13 floats a pixel on
                                  the device; then guides, too; 0 */
    uint32_t sample_count;     /* per pixel, up to 2^24; 0: the scene's, with a noise threshold or time limit as many as
                                  it takes */
    uint32_t first_sample;     /* index of the first: ranges [first, first + count) of several renders add up; 0 */
    uint32_t use_seed, seed;   /* override the scene's seed; 0, 0 */
    uint32_t use_crop;         /* override the scene's crop; 0 */
    uint32_t crop_x, crop_y, crop_width, crop_height;
    uint32_t generic;          /* compile everything, whatever the scene calls for; 0 */
    uint32_t use_strategy;     /* override the scene's strategy and positions; 0 */
    brume_strategy strategy;
    uint32_t positions;
    uint32_t use_indirect;     /* override the scene's; 0 */
    brume_indirect indirect;
    uint32_t quick_start;      /* where lanes is 0 and the program is not in the cache: begin with a narrower one, which
                                  compiles sooner, and go over to it once it is built. The same picture, sooner begun,
                                  at the price of two compilations; 0 */
    uint32_t error_estimate;   /* tell the picture's error while it renders: 9 floats a pixel of host memory; 1 */
    double noise_threshold;    /* stop when the picture's relMSE is estimated to be at most this; 0: none */
    double time_limit;         /* stop when brume_render_create and _run have taken so many seconds; 0: none */
    brume_adaptive adaptive;   /* AUTO */
    float clamp;               /* most radiance that a sample counts, per channel: less noise, but too dark; 0: none */
    uint32_t without;          /* set of effects to take away from the scene, 1 << brume_effect each; 0 */
    uint32_t extra_features;   /* code to build in although the scene doesn't call for it, bits as in
                                  brume_render_stats.features: never changes the picture; for measurements; 0 */
    uint32_t program_size;     /* tell how large the program is, for which PoCL generates its code once more; 0 */
} brume_render_desc;

BRUME_API brume_render_desc brume_render_desc_default(void);

/* Builds the BVH, uploads the scene and builds the program, or takes it from the cache: a folder of programs compiled
 * before, $BRUME_CACHE_DIR where that is set (empty: no cache), else $XDG_CACHE_HOME/brume, else ~/.cache/brume. It
 * holds up to 256 MiB; what was used least recently goes first. The scene may be changed or destroyed afterwards: the
 * render has its own copy. Fails with BRUME_ERROR_SCENE if the scene has no sensor, with BRUME_ERROR_MEMORY, and how
 * much is needed, if the device has no room for it, with BRUME_ERROR_BUILD and BRUME_ERROR_DEVICE (as where double
 * precision is asked for and there is none). desc may be NULL: the defaults. *out is the caller's to destroy. Building
 * the hierarchy takes some 120 bytes of the host's memory a triangle or quadric for a while, and from 32768 of them on
 * as many threads as there are processors, which have ended on return. */
BRUME_API brume_result brume_render_create(brume_device *device, const brume_scene *scene,
                                           const brume_render_desc *desc, brume_render **out);
/* Waits for a program that a quick start is still building, and puts the program of a complete render into the cache if
 * it is not there: about a second with PoCL, once. */
BRUME_API void brume_render_destroy(brume_render *render);

typedef struct brume_progress {
    double seconds;          /* since run began */
    double fraction;         /* of the work, 0 to 1 */
    double seconds_left;     /* estimate */
    uint64_t samples;        /* done so far, over all pixels */
    double work;             /* done so far, as time goes by it: samples per pixel, lanes that wait for others
                                counted, too */
    double relmse;           /* estimated error of the picture as it is (see brume_render_stats); < 0: not known yet */
    double relmse_low, relmse_high; /* 95 % confidence */
    /* When the goal (noise threshold, time limit, adaptive sample count) will be reached, in seconds of
     * brume_render_run altogether, with an interval that is to hold nine in ten; and the relMSE then. < 0: not known
     * yet */
    double predicted_seconds, predicted_low, predicted_high, predicted_relmse;
    double predicted_work;   /* then */
} brume_progress;

/* Called from within brume_render_run by its thread, a few times a second and with every new prediction; `user` is what
 * that was given, `progress` is valid during the call. Non-zero cancels. */
typedef int (*brume_progress_callback)(void *user, const brume_progress *progress);

/* Renders what is left of the sample range; BRUME_CANCELLED leaves a film with whole samples, to be read, written, or
 * continued by calling run again. `progress` may be NULL.
 *
 * So does a failure, of the device or for want of memory: what has been rendered stays, and a further call goes on from
 * there to the film that it would have been. Launches that fail for want of resources are tried smaller first. Only
 * where a device broke off between two samples of a pixel does going on fail, too. */
BRUME_API brume_result brume_render_run(brume_render *render, brume_progress_callback progress, void *user);

/* Changes how many samples per pixel are asked for, from what is begun already upwards: run then renders what is
 * missing. Where all pixels get as many, the film is the same as if it had been asked for at once, so that one render
 * passes through every picture of fewer samples; adaptive sampling plans by what is asked for. At most 2^24. */
BRUME_API brume_result brume_render_set_sample_count(brume_render *render, uint32_t sample_count);

/* Makes a run in progress, or the next one, return BRUME_CANCELLED soon (a launch lasts about 50 ms, of several
 * devices 100). Any thread, any signal handler. */
BRUME_API void brume_render_cancel(brume_render *render);

/* Keeps the render's state in a file, from which another render of the same scene and settings goes on, in this
 * process or another: the film, how far it has come, what is known of its error and where samples are to go. Between
 * two calls of run or from within the progress callback, as often as wanted. The file appears under its name when all
 * of it is on the disk, and replaces the one before at once: whenever the process or the machine stops, `path` holds
 * a whole state, the new one or the one before. It takes 40 to 190 bytes a pixel: 40 without guides, error
 * estimate and lamps in a medium, 121 with them, and the rest for the layers of light and for adaptive sampling. Fails
 * with BRUME_ERROR_OUTPUT, and with BRUME_ERROR_DEVICE if the film can't be read. */
BRUME_API brume_result brume_render_save(brume_render *render, const char *path);

/* Goes on from such a file: run then renders what is missing, and the film comes out the same bits as without the
 * break, on the same device; with a time limit it can't, but the seconds rendered before count. The file has to come
 * from the same scene, settings and version of the library, which is checked to the last vertex and texel. Different
 * may be: the sample count, if there is no goal, as in brume_render_set_sample_count; the time limit, if both have one:
 * what had all of its time goes on with a longer one; the device, which gets a warning where its name is another one,
 * since its arithmetic may differ in the last bits; and the lanes, unless the file was written in the middle of a pass,
 * which the same width has to complete. A file that is none, damaged or of something else is a BRUME_ERROR_CHECKPOINT.
 * On failure the render is as before, but for BRUME_ERROR_DEVICE, after which nothing is left to do but destroy it. */
BRUME_API brume_result brume_render_load(brume_render *render, const char *path);

typedef struct brume_render_stats {
    uint32_t width, height;         /* of the crop: the size of every channel */
    uint32_t full_width, full_height, crop_x, crop_y;
    uint32_t lanes;
    uint32_t features;              /* what was compiled in: 1 << number of brume_feature_name, which may be another one
                                       in another version */
    uint32_t triangles, quadrics, bvh_nodes, bvh_depth, dropped_triangles;
    uint32_t lights, emitters, media;
    uint32_t first_sample, sample_count; /* the range asked for */
    uint32_t seed;
    brume_strategy strategy;
    uint32_t positions;             /* as asked for */
    brume_indirect indirect;        /* what it came to: never AUTO */
    uint32_t complete;              /* every sample of it is in the film, or the goal is reached */
    uint64_t samples;               /* in the film, over all pixels */
    uint64_t bad_samples;           /* dropped because they came out NaN or infinite: a defect to report */
    uint32_t bad_pixel_x, bad_pixel_y, bad_sample; /* one of them, for brume_sample_trace */
    uint64_t device_bytes;          /* of the device's memory that the render takes */
    double bvh_seconds, upload_seconds, build_seconds, render_seconds;
    double pilot_seconds;           /* of render_seconds: a sample that found out how to look at each lamp */
    uint32_t program_cached;        /* the program came from the cache, not from source */
    uint32_t quick_lanes;           /* width of the program that a quick start began with; 0: there was none */
    uint32_t swapped_at_sample;     /* per pixel, in whole passes, when the wide one took over; 0 if it did not */
    double swap_seconds;            /* from the start of the build until then; 0 if it did not */
    /* The picture's error as estimated from itself, during a run when pixels last held a power of two samples: the mean
     * over pixels and channels of (I - R)^2 / (R^2 + 0.01 mean(R)^2), R being what the picture I converges to; < 0: not
     * known. Needs brume_render_desc.error_estimate. */
    double relmse, relmse_low, relmse_high; /* the last two: 95 % confidence */
    double order;                   /* the error falls as samples^-order */
    uint32_t adaptive;              /* pixels have got samples by their need */
    uint32_t effects, without;      /* what the scene calls for; what of it was taken away: sets of brume_effect */
    uint64_t program_bytes;         /* of the program as the driver keeps it, if it came from the cache or
                                       brume_render_desc.program_size asked for it; else 0 */
} brume_render_stats;

/* As of now: between two calls of run, or from within the progress callback. */
BRUME_API brume_result brume_render_get_stats(const brume_render *render, brume_render_stats *out);

typedef enum brume_channel {
    BRUME_CHANNEL_RADIANCE = 0,     /* 3 floats: mean over the samples */
    BRUME_CHANNEL_VARIANCE = 1,     /* 3 floats: of the mean, as if samples were independent; 0 below 2 samples */
    BRUME_CHANNEL_ALBEDO = 2,       /* 3 floats: at the first non-specular hit, in [0, 1] */
    BRUME_CHANNEL_NORMAL = 3,       /* 3 floats: there, world space, towards the viewer */
    BRUME_CHANNEL_DEPTH = 4,        /* 1 float: distance to the first visible surface, mean over the samples that hit */
    BRUME_CHANNEL_SAMPLE_COUNT = 5, /* 1 float */
    BRUME_CHANNEL_ALPHA = 6,        /* 1 float: share of samples that met a surface, a scatterer or an environment */
    BRUME_CHANNEL_ERROR = 7,        /* 3 floats: of the mean, the variance that the error estimate knows of, from the
                                       5 x 5 pixels around: with Sobol' points far below VARIANCE, which it is while the
                                       estimate knows nothing */
    BRUME_CHANNEL_BAD_SAMPLES = 8,  /* 1 float: samples dropped because they came out NaN or infinite */
    /* With brume_render_desc.light_layers, 3 floats: the radiance in two parts, by how often light was scattered, */
    BRUME_CHANNEL_DIRECT = 9,       /* not at all or once (by a surface of any kind or a medium): as with max_depth 2 */
    BRUME_CHANNEL_INDIRECT = 10,    /* more often; direct + indirect = radiance, to the rounding of float sums */
    /* and in two others, by where it is seen: the first place from the eye that scatters or emits it, specular and null
     * surfaces left out, */
    BRUME_CHANNEL_SURFACE = 11,     /* is a surface, or beyond the scene */
    BRUME_CHANNEL_VOLUME = 12,      /* lies in a medium; surface + volume = radiance */
    BRUME_CHANNEL_SEGMENTS = 13     /* 1 float: segments of paths per sample. What a pixel cost, as far as it can be
                                       told: times sampleCount; shadow rays not counted. Paths share the lanes of vector
                                       units, so that no pixel has a time of its own */
} brume_channel;

/* What the channel is called as a layer of an EXR: "albedo", "N", "Z", "variance" (BRUME_CHANNEL_ERROR), "sampleCount",
 * "badSamples", "direct", "indirect", "surface", "volume", "segments". NULL where it is no layer: the radiance and
 * alpha, which an EXR has anyway, VARIANCE, other numbers. */
BRUME_API const char *brume_channel_name(brume_channel channel);

/* `out` receives height x width x (3 or 1) floats, rows from the top; `count` is its size in floats and must match.
 * Alpha, albedo, normal and depth need brume_render_desc.guides, parts of the light and segments light_layers. Fails
 * with BRUME_ERROR_DEVICE if the film can't be read. */
BRUME_API brume_result brume_render_read(brume_render *render, brume_channel channel, float *out, size_t count);

/* ---- one sample, explained --------------------------------------------------------------------------------------- */

typedef enum brume_trace_event {
    BRUME_TRACE_ESCAPED = 1,   /* it left the scene */
    BRUME_TRACE_SCATTERED = 2, /* in the medium */
    BRUME_TRACE_SURFACE = 3,   /* it met a surface, which reflects or refracts it, if anything */
    BRUME_TRACE_PASSED = 4,    /* straight on through a null surface */
    BRUME_TRACE_ABSORBED = 5   /* nothing comes through the segment's medium */
} brume_trace_event;

/* A segment of a path and the vertex at its end. */
typedef struct brume_trace_vertex {
    double position[3];
    float direction[3];         /* of the segment, away from the camera */
    float length;               /* of the segment */
    brume_trace_event event;
    uint32_t medium;            /* that the segment runs through, BRUME_NONE */
    uint32_t shape;             /* met, BRUME_NONE */
    float pdf;                  /* of the direction, per steradian; negative where no light sampling competes with it */
    float throughput_before[3]; /* at the segment's start */
    float throughput_after[3];  /* beyond the vertex: transmittance, albedo or BSDF over pdf, roulette */
    float along[3];             /* light that the medium brings along the segment: its emission, what it scatters */
    float met[3];               /* emission of what the segment meets */
    float lit[3];               /* light sampled at the vertex */
    float radiance[3];          /* all up to here */
    uint32_t ends;              /* the path ends here */
} brume_trace_vertex;

typedef struct brume_trace {
    size_t count;                 /* of vertices, 4096 at most */
    brume_trace_vertex *vertices; /* in the order of the path, from the camera; brume_trace_free releases them */
    float radiance[3];            /* what the film gets: after clamp, sign and weight of the filter; 0 if bad */
    uint32_t bad;                 /* it came out NaN or infinite, and a picture drops it */
} brume_trace;

/* Renders sample `sample` of pixel (x, y) of the full picture once more, alone, as a render by `desc` would (NULL: the
 * defaults; its counts, crop, goals and lanes don't matter), and tells what its path does. Builds a program for it, and
 * fails as brume_render_create and brume_render_run do. */
BRUME_API brume_result brume_sample_trace(brume_device *device, const brume_scene *scene, const brume_render_desc *desc,
                                          uint32_t x, uint32_t y, uint32_t sample, brume_trace *out);
BRUME_API void brume_trace_free(brume_trace *trace);

/* ---- pictures ---------------------------------------------------------------------------------------------------- */

#define BRUME_LAYERS_RECORDED UINT32_MAX

typedef enum brume_tonemap {
    BRUME_TONEMAP_NONE = 0,  /* cut off at 1 */
    BRUME_TONEMAP_FILMIC = 1 /* per channel x (2.51 x + 0.03) / (x (2.43 x + 0.59) + 0.14), cut to [0, 1]: Narkowicz
                                2015, "ACES Filmic Tone Mapping Curve" */
} brume_tonemap;

/* Open Image Denoise on the CPU, with albedo and normals as guides: it takes noise away, and can take detail with it or
 * invent some. Needs the library at run time: $BRUME_OIDN (its file or folder), else where the system finds it. */
typedef enum brume_denoise {
    BRUME_DENOISE_NONE = 0,
    BRUME_DENOISE_BEAUTY = 1, /* the radiance; needs guides */
    BRUME_DENOISE_LAYERS = 2  /* surface and volume light apart, the latter without guides, which know nothing of fog;
                                 and their sum; needs brume_render_desc.light_layers */
} brume_denoise;

/* Whether there is one to be loaded; BRUME_ERROR_DENOISER says what is missing. */
BRUME_API brume_result brume_denoiser_find(brume_context *context);

typedef struct brume_picture_desc {
    uint32_t cookie;
    float exposure;       /* PNG: stops, applied before the sRGB curve; 0 */
    brume_tonemap tonemap; /* PNG: curve behind the exposure; NONE */
    brume_denoise denoise; /* EXR: also write `denoised`; PNG: of that. NONE. If it fails, the picture is written
                              without, and the failure returned */
    uint32_t layers;      /* EXR: set of layers to write, 1 << brume_channel each, of channels that the render records;
                             BRUME_LAYERS_RECORDED, the default: all of those, badSamples if there are any */
    uint32_t half;        /* EXR radiance in 16 bits: 0, 1, or 2 for the film's choice; 2 */
} brume_picture_desc;

BRUME_API brume_picture_desc brume_picture_desc_default(void);

/* Writes a picture by the path's extension, .exr or .png, atomically (a temporary name, then renamed). NULL desc: the
 * defaults. The EXR's attributes name the seed, sample range, device, software, and `incomplete` if the run was cut
 * short. Fails with BRUME_ERROR_OUTPUT, BRUME_ERROR_DEVICE if the film can't be read, and BRUME_ERROR_DENOISER. */
BRUME_API brume_result brume_render_write(brume_render *render, const char *path, const brume_picture_desc *desc);

/* Reads a picture: EXR (channels R, G, B, or Y), PNG, JPEG (not CMYK), HDR. *out_rgb receives height x width x 3 floats
 * of linear RGB, rows from the top, which brume_picture_free releases. A file that can't be read is a
 * BRUME_ERROR_SCENE. */
BRUME_API brume_result brume_picture_read(brume_context *context, const char *path, uint32_t *out_width,
                                          uint32_t *out_height, float **out_rgb);
BRUME_API void brume_picture_free(float *rgb);

/* ---- several renders, one picture -------------------------------------------------------------------------------- */

/* Parts of one picture, rendered as ranges of samples (brume_render_desc.first_sample, sample_count), by any
 * processes on any machines, and saved by brume_render_save, add up to what one render of all of them would have come
 * to. */
typedef struct brume_merged brume_merged;

typedef struct brume_merge_desc {
    uint32_t cookie;
    uint32_t first_sample; /* the range that has to be there; 0 */
    uint32_t sample_count; /* 0: up to the last that any of the files is for */
    uint32_t partial;      /* samples that are missing are said (a warning) and not an error; 0 */
} brume_merge_desc;

BRUME_API brume_merge_desc brume_merge_desc_default(void);

/* Adds up the files at `paths`, `count` of them in any order: the same bits in any order. Against one render of all
 * samples radiance differs by one unit in the last place, now and then; what is summed in single floats (variance, guides,
 * parts of the light) by their rounding, of a standard error of at most sqrt(n) 2^-24 for n samples. Fails with
 * BRUME_ERROR_CHECKPOINT, naming the files, if they are of different scenes or settings, hold the same sample twice,
 * or leave some out: files that are missing, or were not rendered to their end; and for what is no such file, as what
 * brume_merged_write has written. desc may be NULL: the defaults. *out is the caller's to destroy. */
BRUME_API brume_result brume_merge(brume_context *context, const char *const *paths, size_t count,
                                   const brume_merge_desc *desc, brume_merged **out);
BRUME_API void brume_merged_destroy(brume_merged *merged);

/* As brume_render_read, brume_render_write and brume_render_get_stats; seconds are added up, too. The error estimate of
 * parts says nothing of the whole: relmse is not known, and BRUME_CHANNEL_ERROR is BRUME_CHANNEL_VARIANCE. What was
 * added up is not denoised. */
BRUME_API brume_result brume_merged_read(brume_merged *merged, brume_channel channel, float *out, size_t count);
BRUME_API brume_result brume_merged_write(brume_merged *merged, const char *path, const brume_picture_desc *desc);
BRUME_API brume_result brume_merged_get_stats(const brume_merged *merged, brume_render_stats *out);

#ifdef __cplusplus
}
#endif
#endif

/* mitsuba.h -- reading a Mitsuba 3 scene: what the readers of the single plugins (lib/mitsuba_*.c) share.
 *
 * A plugin's reader opens the element as an object, asks it for each property it knows, and closes it; what nobody
 * asked for is then an error, so nothing in a scene is silently ignored. Errors stick: the first one is kept in the
 * reader, and everything after it does nothing and returns defaults, so that readers are written without error
 * handling and check once before they add to the scene.
 */
#ifndef BRUME_MITSUBA_H
#define BRUME_MITSUBA_H

#include "context.h"
#include "image.h"
#include "platform.h"
#include "xml_tree.h"

typedef struct mitsuba_reader {
    brume_context *context;
    brume_scene *scene;
    xml_tree *tree;
    brume_result result; /* the first error */
    brume_c_locale *locale; /* numbers in files have a point whatever the user's language */
    struct mitsuba_ids *ids;
    brume_integrator_desc integrator; /* from <integrator> and <sampler> */
    int has_integrator, has_sensor, has_environment, has_media, ignores_media;
} mitsuba_reader;

/* A value or a nested object of an object. */
typedef struct mitsuba_property {
    const char *name; /* NULL if it has none */
    xml_node *node;   /* as written; a <ref> for a reference */
    xml_node *object; /* the object meant; NULL for a value */
    int used;
} mitsuba_property;

#define MITSUBA_MAX_ASKED 32

typedef struct mitsuba_object {
    mitsuba_reader *reader;
    xml_node *node;
    const char *type; /* the plugin's name */
    mitsuba_property *properties;
    uint32_t count;
    const char *asked[MITSUBA_MAX_ASKED]; /* names asked for so far: the known ones */
    uint32_t asked_count;
} mitsuba_object;

typedef enum mitsuba_color {
    MITSUBA_REFLECTANCE, /* in [0, 1] */
    MITSUBA_COEFFICIENT, /* >= 0: refractive indices, extinction */
    MITSUBA_EMISSION     /* >= 0 */
} mitsuba_color;

/* ---- reports (mitsuba_report.c) --------------------------------------------------------------------------------- */

/* BRUME_ERROR_SCENE, "file:line:column: ..." at the element. */
void mitsuba_fail(mitsuba_reader *reader, const xml_node *node, const char *format, ...)
    __attribute__((format(printf, 3, 4)));
void mitsuba_fail_memory(mitsuba_reader *reader);
void mitsuba_warn(mitsuba_reader *reader, const xml_node *node, const char *format, ...)
    __attribute__((format(printf, 3, 4)));
/* Keeps the result of a brume_scene_... call or of a reader of another file format; what is wrong with the description
 * is wrong with the element. */
void mitsuba_keep(mitsuba_reader *reader, const xml_node *node, brume_result result);
/* Remembers in the scene where its object `index` was written, unless there was an error. */
void mitsuba_note(mitsuba_reader *reader, const xml_node *node, brume_object kind, uint32_t index);
/* "file:line:column" of the element, or NULL without memory. */
const char *mitsuba_where(mitsuba_reader *reader, const xml_node *node);

/* ---- objects (mitsuba_query.c) ---------------------------------------------------------------------------------- */

/* Where the file of that name is (xml_tree_resolve), and what the messages of its reader begin with; NULL after an
 * error. */
const char *mitsuba_path(mitsuba_object *object, const char *filename, const char **out_where);

/* Checks that the plugin exists. */
mitsuba_object mitsuba_open(mitsuba_reader *reader, xml_node *node);
/* What was not used is an error. */
void mitsuba_close(mitsuba_object *object);
int mitsuba_is(const mitsuba_object *object, const char *type);

/* NULL if there is none. Marks it as used. */
mitsuba_property *mitsuba_find(mitsuba_object *object, const char *name);
/* The next unused nested object of that element name, whatever it is called; NULL if there is none. */
mitsuba_property *mitsuba_child(mitsuba_object *object, const char *tag);
/* A property that must be an object of that element name, nested or referenced; NULL if it is not there. */
xml_node *mitsuba_object_of(mitsuba_object *object, const char *name, const char *tag);
/* Objects may be referenced from many places and are read once: whether this is the time. It ends with mitsuba_end. */
int mitsuba_begin(mitsuba_reader *reader, xml_node *node);
void mitsuba_end(xml_node *node, uint32_t id);
/* An error at the property, or at the object if it is not there. */
void mitsuba_require(mitsuba_object *object, const char *name, int condition, const char *must);

/* ---- values (mitsuba_values.c) ---------------------------------------------------------------------------------- */

float mitsuba_float(mitsuba_object *object, const char *name, double otherwise);
int64_t mitsuba_integer(mitsuba_object *object, const char *name, int64_t otherwise);
int mitsuba_boolean(mitsuba_object *object, const char *name, int otherwise);
const char *mitsuba_string(mitsuba_object *object, const char *name, const char *otherwise);
/* Whether it is there; out is untouched otherwise. */
int mitsuba_vector(mitsuba_object *object, const char *name, double out[3]);
/* Linear RGB of a number, <rgb> or <spectrum>. Whether it is there; out is untouched otherwise. */
int mitsuba_rgb(mitsuba_object *object, const char *name, mitsuba_color kind, float out[3]);
/* A finite number and nothing else. */
int mitsuba_parse_number(const mitsuba_reader *reader, const char *text, double *out);
/* Numbers between commas and spaces: how many there are, -1 if something else is there, max + 1 if too many. */
int mitsuba_parse_numbers(const mitsuba_reader *reader, const char *text, double *out, int max);

/* ---- transforms (mitsuba_transform.c): 4x4, row-major, double --------------------------------------------------- */

/* Whether it is there; identity otherwise. */
int mitsuba_transform(mitsuba_object *object, const char *name, double out[16]);
/* One that takes surfaces and directions along: affine and not singular. */
int mitsuba_to_world(mitsuba_object *object, float out[16]);
/* From a look-at; up may be 0. Zero if the directions don't span a frame. */
int mitsuba_look_at(const double origin[3], const double target[3], const double up[3], double out[16]);

/* ---- plugins and names ------------------------------------------------------------------------------------------ */

/* mitsuba_plugins.c: an error that names the plugin and the nearest known one, unless the type is supported. */
void mitsuba_check_plugin(mitsuba_object *object);
int mitsuba_is_object_tag(const char *tag);
/* mitsuba_ids.c */
brume_result mitsuba_ids_build(mitsuba_reader *reader);
void mitsuba_ids_free(mitsuba_reader *reader);
xml_node *mitsuba_ids_find(mitsuba_reader *reader, const char *id);
const char *mitsuba_ids_nearest(mitsuba_reader *reader, const char *id);
/* mitsuba_materials.c: whether the name is known. */
int mitsuba_dielectric(const char *name, float *out_ior);
int mitsuba_conductor(const char *name, float out_eta[3], float out_k[3]);
const char *mitsuba_nearest_dielectric(const char *name);
const char *mitsuba_nearest_conductor(const char *name);

/* ---- readers: each adds to the scene and returns the id there, BRUME_NONE after an error ------------------------ */

/* The texels of a picture, to be freed; untouched after an error. */
void mitsuba_read_picture(mitsuba_object *object, const char *filename, int raw, brume_image *out);
/* mitsuba_rgb, or a texture. */
int mitsuba_rgb_or_texture(mitsuba_object *object, const char *name, mitsuba_color kind, float out[3],
                           uint32_t *out_texture);
uint32_t mitsuba_read_texture(mitsuba_reader *reader, xml_node *node);
uint32_t mitsuba_read_bsdf(mitsuba_reader *reader, xml_node *node);
uint32_t mitsuba_read_medium(mitsuba_reader *reader, xml_node *node);
void mitsuba_read_phase(mitsuba_reader *reader, xml_node *node, float *out_g);
void mitsuba_read_shape(mitsuba_reader *reader, xml_node *node);
void mitsuba_read_emitter(mitsuba_reader *reader, xml_node *node);
/* The emitter of a shape. */
void mitsuba_read_area(mitsuba_reader *reader, xml_node *node, float out_radiance[3]);
/* A medium nested in a sensor or emitter; BRUME_NONE if there is none. */
uint32_t mitsuba_read_endpoint_medium(mitsuba_object *object);
/* With its film and sampler. */
void mitsuba_read_sensor(mitsuba_reader *reader, xml_node *node);
void mitsuba_read_film(mitsuba_reader *reader, xml_node *node, brume_film_desc *out);
void mitsuba_read_sampler(mitsuba_reader *reader, xml_node *node);
void mitsuba_read_integrator(mitsuba_reader *reader, xml_node *node);

#endif

/* mitsuba_scene.c -- brume_scene_load: the top level of a Mitsuba 3 scene.
 *
 * The file becomes a tree (xml_parse.c); each object of it is handed to its reader, which adds to the scene through the
 * calls that an embedder uses.
 */
#include "mitsuba.h"
#include "scene.h"

#include <string.h>

/* Objects that stand by themselves only to be referenced; those nobody referenced are read to be checked. */
static void read_definition(mitsuba_reader *reader, xml_node *node) {
    float g;
    if (strcmp(node->tag, "bsdf") == 0)
        mitsuba_read_bsdf(reader, node);
    else if (strcmp(node->tag, "texture") == 0)
        mitsuba_read_texture(reader, node);
    else if (strcmp(node->tag, "medium") == 0)
        mitsuba_read_medium(reader, node);
    else if (strcmp(node->tag, "phase") == 0)
        mitsuba_read_phase(reader, node, &g);
    else if (strcmp(node->tag, "volume") == 0)
        mitsuba_open(reader, node); /* says what is not supported */
    else if (node->mark == XML_UNREAD)
        mitsuba_fail(reader, node, "this <%s> is not used: it belongs into a sensor, or needs a reference from one",
                     node->tag);
}

static int is_tag(const mitsuba_property *p, const char *tag) { return strcmp(p->node->tag, tag) == 0; }

static void read_object(mitsuba_reader *reader, mitsuba_property *p) {
    if (is_tag(p, "shape"))
        mitsuba_read_shape(reader, p->object);
    else if (is_tag(p, "emitter"))
        mitsuba_read_emitter(reader, p->object);
    else if (is_tag(p, "sensor"))
        mitsuba_read_sensor(reader, p->object);
    else if (is_tag(p, "integrator"))
        mitsuba_read_integrator(reader, p->object);
    else if (is_tag(p, "ref"))
        mitsuba_fail(reader, p->node, "a <ref> at the top level has no effect");
    else
        return;
    p->used = 1;
}

static void read_scene(mitsuba_reader *reader) {
    xml_node *root = reader->tree->root;
    if (strcmp(root->tag, "scene") != 0) {
        mitsuba_fail(reader, root, "the root element must be <scene>, not <%s>", root->tag);
        return;
    }
    if (root->attribute_count) {
        mitsuba_fail(reader, root, "unexpected attribute '%s' in <scene>", root->attributes[0].name);
        return;
    }
    if (mitsuba_ids_build(reader) != BRUME_OK) return;
    mitsuba_object scene = mitsuba_open(reader, root);
    for (uint32_t i = 0; i < scene.count && reader->result == BRUME_OK; i++)
        if (scene.properties[i].object) read_object(reader, &scene.properties[i]);
    for (uint32_t i = 0; i < scene.count && reader->result == BRUME_OK; i++) {
        mitsuba_property *p = &scene.properties[i];
        if (!p->object || p->used) continue;
        p->used = 1;
        read_definition(reader, p->object);
    }
    mitsuba_close(&scene);
    if (reader->result != BRUME_OK) return;
    if (!reader->has_integrator)
        mitsuba_warn(reader, root, "the scene has no <integrator>: volpath without a limit of depth is used");
    if (reader->has_media && reader->ignores_media)
        mitsuba_warn(reader, root, "the scene has media, which its integrator ignores; volpath does not");
    mitsuba_keep(reader, root, brume_scene_set_integrator(reader->scene, &reader->integrator));
}

brume_result brume_scene_load(brume_context *context, const char *path, const brume_parameter *parameters,
                              size_t parameter_count, brume_scene **out) {
    if (!context) return BRUME_ERROR_ARGUMENT;
    if (!path || !out || (parameter_count && !parameters))
        return brume_fail(context, BRUME_ERROR_ARGUMENT, "scene: %s is NULL",
                          !path  ? "the path"
                          : !out ? "the out-parameter"
                                 : "the parameters");
    xml_tree tree = {NULL, 0, NULL};
    mitsuba_reader reader = {.context = context, .tree = &tree, .integrator = brume_integrator_desc_default()};
    brume_result result = xml_tree_read(context, path, parameters, parameter_count, &tree);
    if (result != BRUME_OK) return result;
    result = brume_scene_create(context, &reader.scene);
    if (result != BRUME_OK) goto cleanup;
    reader.locale = brume_c_locale_create();
    if (reader.locale)
        read_scene(&reader);
    else
        mitsuba_fail_memory(&reader);
    result = reader.result;

cleanup:
    brume_c_locale_destroy(reader.locale);
    mitsuba_ids_free(&reader);
    xml_tree_free(&tree);
    if (result == BRUME_OK)
        *out = reader.scene;
    else
        brume_scene_destroy(reader.scene);
    return result;
}

/* mitsuba_query.c -- objects as sets of properties that know whether they were used. */
#include "mitsuba.h"
#include "mitsuba_spelling.h"

#include <string.h>

static const char *const value_tags[] = {"boolean", "integer", "float",    "string",   "point",
                                         "vector",  "rgb",     "spectrum", "transform"};
enum { VALUE_TAG_COUNT = sizeof value_tags / sizeof value_tags[0] };

const char *mitsuba_path(mitsuba_object *object, const char *filename, const char **out_where) {
    mitsuba_reader *reader = object->reader;
    *out_where = mitsuba_where(reader, object->node);
    if (reader->result != BRUME_OK) return NULL;
    const char *path = xml_tree_resolve(reader->tree, object->node->file, filename);
    if (!path) mitsuba_fail_memory(reader);
    return path;
}

/* ---- opening ---------------------------------------------------------------------------------------------------- */

/* Only attributes from the list, which is "|name|value|". */
static void check_attributes(mitsuba_reader *reader, const xml_node *node, const char *allowed) {
    for (uint32_t i = 0; i < node->attribute_count; i++) {
        const char *name = node->attributes[i].name;
        const char *found = allowed;
        size_t length = strlen(name);
        while ((found = strstr(found, name)) && !(found[-1] == '|' && found[length] == '|')) found++;
        if (!found) {
            mitsuba_fail(reader, node, "unexpected attribute '%s' in <%s>", name, node->tag);
            return;
        }
    }
}

static const char *required(mitsuba_reader *reader, const xml_node *node, const char *name) {
    const char *value = xml_attribute_value(node, name);
    if (!value) mitsuba_fail(reader, node, "<%s> needs the attribute '%s'", node->tag, name);
    return value;
}

static void check_value(mitsuba_reader *reader, const xml_node *node) {
    const char *tag = node->tag;
    if (!required(reader, node, "name")) return;
    if (strcmp(tag, "transform") == 0) {
        check_attributes(reader, node, "|name|");
        return;
    }
    if (node->first) {
        mitsuba_fail(reader, node->first, "<%s> can't be inside <%s>", node->first->tag, tag);
        return;
    }
    int is_vector = strcmp(tag, "point") == 0 || strcmp(tag, "vector") == 0;
    if (strcmp(tag, "spectrum") == 0 && xml_attribute_value(node, "filename"))
        mitsuba_fail(reader, node, "<spectrum> files are not supported yet; write the values into 'value'");
    if (is_vector && !xml_attribute_value(node, "value")) {
        check_attributes(reader, node, "|name|x|y|z|");
        required(reader, node, "x");
        required(reader, node, "y");
        required(reader, node, "z");
    } else {
        check_attributes(reader, node, "|name|value|");
        required(reader, node, "value");
    }
}

/* The reference's target. */
static xml_node *resolve(mitsuba_reader *reader, const xml_node *node) {
    check_attributes(reader, node, "|id|name|");
    const char *id = required(reader, node, "id");
    if (!id) return NULL;
    xml_node *target = mitsuba_ids_find(reader, id);
    const char *near = target ? NULL : mitsuba_ids_nearest(reader, id);
    if (!target && near)
        mitsuba_fail(reader, node, "there is no object with the id '%s'; did you mean '%s'?", id, near);
    else if (!target)
        mitsuba_fail(reader, node, "there is no object with the id '%s'", id);
    return target;
}

static int is_value_tag(const char *tag) {
    for (int i = 0; i < VALUE_TAG_COUNT; i++)
        if (strcmp(tag, value_tags[i]) == 0) return 1;
    return 0;
}

static void fail_unknown_tag(mitsuba_reader *reader, const xml_node *node) {
    static const char *const tags[] = {"boolean",  "integer",   "float",   "string",  "point",     "vector",  "rgb",
                                       "spectrum", "transform", "ref",     "include", "alias",     "default", "path",
                                       "bsdf",     "shape",     "emitter", "sensor",  "film",      "sampler", "rfilter",
                                       "medium",   "phase",     "volume",  "texture", "integrator"};
    const char *near = mitsuba_nearest(node->tag, tags, sizeof tags / sizeof tags[0]);
    if (near)
        mitsuba_fail(reader, node, "unknown element <%s>; did you mean <%s>?", node->tag, near);
    else
        mitsuba_fail(reader, node, "unknown element <%s>", node->tag);
}

static int is_lower(char c) { return c >= 'a' && c <= 'z'; }
static int is_upper(char c) { return c >= 'A' && c <= 'Z'; }

/* Names were in camelCase before version 2. */
static const char *upgraded_name(mitsuba_reader *reader, const xml_node *node, const char *type, const char *name) {
    if (!name || node->file->major >= 2) return name;
    size_t length = strlen(name), n = 0;
    char *out = xml_tree_alloc(reader->tree, 2 * length + 1);
    if (!out) {
        mitsuba_fail_memory(reader);
        return name;
    }
    for (size_t i = 0; i < length; i++) {
        out[n++] = name[i];
        if (!is_lower(name[i]) || !is_upper(name[i + 1])) continue;
        out[n++] = '_';
        while (is_upper(name[i + 1])) out[n++] = (char)(name[++i] - 'A' + 'a'); /* intIOR is int_ior */
    }
    out[n] = '\0';
    if (strcmp(type, "diffuse") == 0 && strcmp(out, "diffuse_reflectance") == 0) return "reflectance";
    return out;
}

static void add_property(mitsuba_object *o, xml_node *node) {
    mitsuba_reader *reader = o->reader;
    mitsuba_property property = {NULL, node, NULL, 0};
    if (strcmp(node->tag, "alias") == 0) return; /* mitsuba_ids.c has it */
    if (strcmp(node->tag, "spectrum") == 0 && xml_attribute_value(node, "type")) {
        mitsuba_fail(reader, node, "the spectrum plugin '%s' is not supported yet", xml_attribute_value(node, "type"));
    } else if (is_value_tag(node->tag)) {
        check_value(reader, node);
    } else if (strcmp(node->tag, "ref") == 0) {
        property.object = resolve(reader, node);
        if (node->first) mitsuba_fail(reader, node->first, "<%s> can't be inside <ref>", node->first->tag);
    } else if (mitsuba_is_object_tag(node->tag)) {
        check_attributes(reader, node, "|type|id|name|");
        required(reader, node, "type");
        property.object = node;
    } else {
        fail_unknown_tag(reader, node);
    }
    if (reader->result != BRUME_OK) return;
    property.name = upgraded_name(reader, node, o->type, xml_attribute_value(node, "name"));
    o->properties[o->count++] = property;
}

/* Two of the same name: a scan over all pairs suits the few properties of a plugin; a <scene> has unnamed children. */
static void check_twins(mitsuba_object *o) {
    for (uint32_t i = 0; i < o->count; i++) {
        const char *name = o->properties[i].name;
        for (uint32_t j = 0; name && j < i; j++)
            if (o->properties[j].name && strcmp(o->properties[j].name, name) == 0) {
                mitsuba_fail(o->reader, o->properties[i].node, "property '%s' is given twice", name);
                return;
            }
    }
}

mitsuba_object mitsuba_open(mitsuba_reader *reader, xml_node *node) {
    mitsuba_object o = {.reader = reader, .node = node, .type = xml_attribute_value(node, "type")};
    if (!o.type) o.type = node->tag; /* the <scene> */
    if (reader->result != BRUME_OK) return o;
    mitsuba_check_plugin(&o);
    size_t count = 0;
    for (xml_node *child = node->first; child; child = child->next) count++;
    o.properties = xml_tree_alloc(reader->tree, (count + 1) * sizeof *o.properties);
    if (!o.properties) mitsuba_fail_memory(reader);
    for (xml_node *child = node->first; child && reader->result == BRUME_OK; child = child->next)
        add_property(&o, child);
    if (strcmp(node->tag, "scene") != 0) check_twins(&o);
    return o;
}

void mitsuba_close(mitsuba_object *o) {
    for (uint32_t i = 0; i < o->count && o->reader->result == BRUME_OK; i++) {
        const mitsuba_property *p = &o->properties[i];
        if (p->used) continue;
        const char *near = p->name ? mitsuba_nearest(p->name, o->asked, o->asked_count) : NULL;
        if (near)
            mitsuba_fail(o->reader, p->node, "unknown property '%s' of %s; did you mean '%s'?", p->name, o->type, near);
        else if (p->name)
            mitsuba_fail(o->reader, p->node, "unknown property '%s' of %s", p->name, o->type);
        else
            mitsuba_fail(o->reader, p->node, "a <%s> has no place in %s", p->object->tag, o->type);
    }
}

int mitsuba_is(const mitsuba_object *o, const char *type) { return strcmp(o->type, type) == 0; }

/* ---- asking ----------------------------------------------------------------------------------------------------- */

mitsuba_property *mitsuba_find(mitsuba_object *o, const char *name) {
    if (o->asked_count < MITSUBA_MAX_ASKED) o->asked[o->asked_count++] = name;
    if (o->reader->result != BRUME_OK) return NULL;
    for (uint32_t i = 0; i < o->count; i++)
        if (o->properties[i].name && strcmp(o->properties[i].name, name) == 0) {
            o->properties[i].used = 1;
            return &o->properties[i];
        }
    return NULL;
}

mitsuba_property *mitsuba_child(mitsuba_object *o, const char *tag) {
    if (o->reader->result != BRUME_OK) return NULL;
    for (uint32_t i = 0; i < o->count; i++) {
        mitsuba_property *p = &o->properties[i];
        if (p->object && !p->used && strcmp(p->object->tag, tag) == 0) {
            p->used = 1;
            return p;
        }
    }
    return NULL;
}

void mitsuba_require(mitsuba_object *o, const char *name, int condition, const char *must) {
    if (condition || o->reader->result != BRUME_OK) return;
    const xml_node *node = o->node;
    for (uint32_t i = 0; i < o->count; i++)
        if (o->properties[i].name && strcmp(o->properties[i].name, name) == 0) node = o->properties[i].node;
    mitsuba_fail(o->reader, node, "property '%s' of %s must %s", name, o->type, must);
}

xml_node *mitsuba_object_of(mitsuba_object *o, const char *name, const char *tag) {
    const mitsuba_property *p = mitsuba_find(o, name);
    if (!p) return NULL;
    if (p->object && strcmp(p->object->tag, tag) == 0) return p->object;
    mitsuba_fail(o->reader, p->node, "property '%s' of %s must be a <%s>, not a <%s>", name, o->type, tag,
                 p->object ? p->object->tag : p->node->tag);
    return NULL;
}

int mitsuba_begin(mitsuba_reader *reader, xml_node *node) {
    if (node->mark == XML_READING) mitsuba_fail(reader, node, "this <%s> contains a reference to itself", node->tag);
    if (reader->result != BRUME_OK || node->mark == XML_READ) return 0;
    node->mark = XML_READING;
    return 1;
}

void mitsuba_end(xml_node *node, uint32_t id) {
    node->mark = XML_READ;
    node->id = id;
}

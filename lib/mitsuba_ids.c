/* mitsuba_ids.c -- which object an id means. A hash table over the whole tree, so that references may point forward. */
#include "mitsuba.h"
#include "mitsuba_spelling.h"

#include <stdlib.h>
#include <string.h>

typedef struct mitsuba_id {
    const char *name;
    xml_node *node;
} mitsuba_id;

struct mitsuba_ids {
    size_t capacity; /* a power of two, more than there are ids */
    mitsuba_id slots[];
};

static mitsuba_id *slot_of(struct mitsuba_ids *ids, const char *name) {
    uint64_t hash = 14695981039346656037u; /* FNV-1a */
    for (const char *c = name; *c; c++) hash = (hash ^ (unsigned char)*c) * 1099511628211u;
    size_t i = (size_t)(hash ^ hash >> 32) & (ids->capacity - 1);
    while (ids->slots[i].name && strcmp(ids->slots[i].name, name) != 0) i = (i + 1) & (ids->capacity - 1);
    return &ids->slots[i];
}

xml_node *mitsuba_ids_find(mitsuba_reader *reader, const char *id) { return slot_of(reader->ids, id)->node; }

const char *mitsuba_ids_nearest(mitsuba_reader *reader, const char *id) {
    const char *names[256];
    size_t count = 0;
    for (size_t i = 0; i < reader->ids->capacity && count < 256; i++)
        if (reader->ids->slots[i].name) names[count++] = reader->ids->slots[i].name;
    return mitsuba_nearest(id, names, count);
}

static size_t count_nodes(const xml_node *node) {
    size_t count = 1;
    for (const xml_node *child = node->first; child; child = child->next) count += count_nodes(child);
    return count;
}

static void add(mitsuba_reader *reader, const xml_node *where, const char *id, xml_node *node) {
    mitsuba_id *slot = slot_of(reader->ids, id);
    if (!*id)
        mitsuba_fail(reader, where, "an id must not be empty");
    else if (slot->name)
        mitsuba_fail(reader, where, "the id '%s' is already taken (%s:%d:%d)", id, slot->node->file->name,
                     slot->node->line, slot->node->column);
    else
        *slot = (mitsuba_id){id, node};
}

static void add_alias(mitsuba_reader *reader, xml_node *node) {
    const char *id = xml_attribute_value(node, "id"), *as = xml_attribute_value(node, "as");
    if (!id || !as || node->attribute_count != 2) {
        mitsuba_fail(reader, node, "<alias> needs the attributes 'id' and 'as', and no others");
        return;
    }
    xml_node *target = mitsuba_ids_find(reader, id);
    if (!target)
        mitsuba_fail(reader, node, "there is no object with the id '%s' before this alias", id);
    else
        add(reader, node, as, target);
}

static void collect(mitsuba_reader *reader, xml_node *node) {
    const char *id = xml_attribute_value(node, "id");
    if (strcmp(node->tag, "alias") == 0)
        add_alias(reader, node);
    else if (id && mitsuba_is_object_tag(node->tag))
        add(reader, node, id, node);
    for (xml_node *child = node->first; child && reader->result == BRUME_OK; child = child->next)
        collect(reader, child);
}

brume_result mitsuba_ids_build(mitsuba_reader *reader) {
    size_t capacity = 16, wanted = 2 * count_nodes(reader->tree->root);
    while (capacity < wanted) capacity *= 2;
    reader->ids = calloc(1, sizeof *reader->ids + capacity * sizeof reader->ids->slots[0]);
    if (!reader->ids) {
        mitsuba_fail_memory(reader);
        return reader->result;
    }
    reader->ids->capacity = capacity;
    collect(reader, reader->tree->root);
    return reader->result;
}

void mitsuba_ids_free(mitsuba_reader *reader) {
    free(reader->ids);
    reader->ids = NULL;
}

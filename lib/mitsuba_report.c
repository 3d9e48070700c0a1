/* mitsuba_report.c -- errors and warnings at the element that they are about, and where objects were written. */
#include "mitsuba.h"
#include "scene.h"

#include <stdarg.h>
#include <stdio.h>

void mitsuba_fail(mitsuba_reader *reader, const xml_node *node, const char *format, ...) {
    if (reader->result != BRUME_OK) return;
    char text[2048];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    reader->result = brume_fail(reader->context, BRUME_ERROR_SCENE, "%s:%d:%d: %s", node->file->name, node->line,
                                node->column, text);
}

void mitsuba_fail_memory(mitsuba_reader *reader) {
    if (reader->result != BRUME_OK) return;
    reader->result = brume_fail(reader->context, BRUME_ERROR_MEMORY, "no memory for the scene");
}

void mitsuba_warn(mitsuba_reader *reader, const xml_node *node, const char *format, ...) {
    if (reader->result != BRUME_OK) return;
    char text[1024];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    brume_warn(reader->context, "%s:%d:%d: %s", node->file->name, node->line, node->column, text);
}

void mitsuba_keep(mitsuba_reader *reader, const xml_node *node, brume_result result) {
    if (reader->result != BRUME_OK || result == BRUME_OK) return;
    if (result == BRUME_ERROR_ARGUMENT)
        mitsuba_fail(reader, node, "%s", brume_context_message(reader->context));
    else
        reader->result = result;
}

void mitsuba_note(mitsuba_reader *reader, const xml_node *node, brume_object kind, uint32_t index) {
    if (reader->result != BRUME_OK) return;
    mitsuba_keep(reader, node, brume_scene_set_origin(reader->scene, kind, index, xml_attribute_value(node, "id"),
                                                      node->file->name, (uint32_t)node->line));
}

const char *mitsuba_where(mitsuba_reader *reader, const xml_node *node) {
    int length = snprintf(NULL, 0, "%s:%d:%d", node->file->name, node->line, node->column);
    char *where = length < 0 ? NULL : xml_tree_alloc(reader->tree, (size_t)length + 1);
    if (where)
        snprintf(where, (size_t)length + 1, "%s:%d:%d", node->file->name, node->line, node->column);
    else
        mitsuba_fail_memory(reader);
    return where;
}

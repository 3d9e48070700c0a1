/* xml_parse.c -- expat events to the tree of xml_tree.h.
 *
 * Scene files come from anywhere, so everything that could grow without bound is bounded: nesting, includes, the
 * memory of the tree. A document type declaration is refused altogether: scenes need none, and it is where external
 * entities and entities that expand exponentially come from.
 */
#include "xml_parse.h"

#include "mitsuba_spelling.h"
#include "platform.h"
#include "text.h"

#include <errno.h>
#include <limits.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_INCLUDE_DEPTH = 15, MAX_FILES = 1000 };

void xml_fail_at(xml_parse *parse, int line, int column, const char *format, ...) {
    if (parse->result != BRUME_OK) return;
    char text[1024];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    parse->result =
        brume_fail(parse->reader->context, BRUME_ERROR_SCENE, "%s:%d:%d: %s", parse->file->name, line, column, text);
    XML_StopParser(parse->expat, XML_FALSE);
}

void xml_fail_memory(xml_parse *parse) {
    if (parse->result != BRUME_OK) return;
    if (parse->reader->tree->bytes + XML_BLOCK_BYTES > XML_MAX_BYTES)
        parse->result =
            brume_fail(parse->reader->context, BRUME_ERROR_SCENE, "%s:1:1: the scene file is larger than %d MiB",
                       parse->file->name, (int)(XML_MAX_BYTES >> 20));
    else
        parse->result = brume_fail(parse->reader->context, BRUME_ERROR_MEMORY, "%s: no memory for the scene file",
                                   parse->file->name);
    XML_StopParser(parse->expat, XML_FALSE);
}

static int current_line(const xml_parse *parse) {
    XML_Size line = XML_GetCurrentLineNumber(parse->expat);
    return line > INT_MAX ? INT_MAX : (int)line;
}

static int current_column(const xml_parse *parse) {
    XML_Size column = XML_GetCurrentColumnNumber(parse->expat);
    return column >= INT_MAX ? INT_MAX : (int)column + 1;
}

/* The element with its attributes, substituted. NULL after an error. */
static xml_node *new_node(xml_parse *parse, const char *tag, const char **attributes) {
    xml_tree *tree = parse->reader->tree;
    int line = current_line(parse), column = current_column(parse);
    uint32_t count = 0;
    while (attributes[2 * count]) count++;
    xml_node *node = xml_tree_alloc(tree, sizeof *node);
    xml_attribute *list = xml_tree_alloc(tree, (count + 1) * sizeof *list); /* room for an <include>'s name */
    char *tag_copy = xml_tree_copy(tree, tag, strlen(tag));
    if (!node || !list || !tag_copy) return xml_fail_memory(parse), NULL;
    for (uint32_t i = 0; i < count; i++) {
        const char *name = attributes[2 * i], *text = attributes[2 * i + 1], *value = NULL, *unknown = NULL;
        int length = 0;
        if (strchr(text, '$')) {
            brume_result result =
                xml_parameters_substitute(&parse->reader->parameters, tree, text, &value, &unknown, &length);
            if (result == BRUME_ERROR_SCENE && unknown) {
                xml_fail_at(parse, line, column, "undefined parameter: $%.*s", length, unknown);
                return NULL;
            }
            if (result == BRUME_ERROR_SCENE) {
                xml_fail_at(parse, line, column, "attribute '%s' is too long after substitution", name);
                return NULL;
            }
        } else {
            value = xml_tree_copy(tree, text, strlen(text));
        }
        list[i] = (xml_attribute){xml_tree_copy(tree, name, strlen(name)), value};
        if (!list[i].name || !value) return xml_fail_memory(parse), NULL;
    }
    *node = (xml_node){.tag = tag_copy,
                       .file = parse->file,
                       .line = line,
                       .column = column,
                       .attribute_count = count,
                       .attributes = list,
                       .id = BRUME_NONE};
    return node;
}

void xml_append(xml_node *parent, xml_node *node) {
    if (parent->last)
        parent->last->next = node;
    else
        parent->first = node;
    parent->last = node;
}

static void XMLCALL on_start(void *data, const char *tag, const char **attributes) {
    xml_parse *parse = data;
    if (parse->result != BRUME_OK) return;
    int line = current_line(parse), column = current_column(parse);
    if (parse->closed_only) {
        xml_fail_at(parse, line, column, "<%s> can't be inside <%s>", tag, parse->closed_tag);
        return;
    }
    if (parse->outer_depth + parse->depth + 1 >= XML_MAX_DEPTH) {
        xml_fail_at(parse, line, column, "elements are nested more than %d deep", XML_MAX_DEPTH - 1);
        return;
    }
    xml_node *node = new_node(parse, tag, attributes);
    if (!node) return;
    if (parse->depth == 0) {
        xml_start_root(parse, node);
        return;
    }
    int is_default = strcmp(tag, "default") == 0, is_path = strcmp(tag, "path") == 0;
    if (is_default || is_path || strcmp(tag, "include") == 0) {
        parse->closed_only = 1;
        parse->closed_tag = node->tag;
        if (is_default)
            xml_start_default(parse, node);
        else if (is_path)
            xml_start_path(parse, node);
        else
            xml_start_include(parse, node);
        return;
    }
    xml_append(parse->parent, node);
    parse->stack[parse->depth++] = node;
    parse->parent = node;
}

static void XMLCALL on_end(void *data, const char *tag) {
    xml_parse *parse = data;
    (void)tag;
    if (parse->result != BRUME_OK) return;
    if (parse->closed_only) {
        parse->closed_only = 0;
        return;
    }
    parse->depth--;
    if (parse->depth > 0) parse->parent = parse->stack[parse->depth - 1];
}

static void XMLCALL on_text(void *data, const char *text, int length) {
    xml_parse *parse = data;
    if (parse->result != BRUME_OK) return;
    for (int i = 0; i < length; i++)
        if (text[i] != ' ' && text[i] != '\t' && text[i] != '\n' && text[i] != '\r') {
            xml_fail_at(parse, current_line(parse), current_column(parse),
                        "text outside of elements' attributes has no meaning here");
            return;
        }
}

static void XMLCALL on_doctype(void *data, const char *name, const char *system, const char *public_id, int subset) {
    xml_parse *parse = data;
    (void)name, (void)system, (void)public_id, (void)subset;
    xml_fail_at(parse, current_line(parse), current_column(parse), "a document type declaration is not allowed");
}

/* Feeds the whole file to expat. */
static void pump(xml_parse *parse, FILE *file) {
    for (;;) {
        void *buffer = XML_GetBuffer(parse->expat, 1 << 16);
        if (!buffer) {
            xml_fail_memory(parse);
            return;
        }
        size_t count = fread(buffer, 1, 1 << 16, file);
        if (ferror(file)) {
            xml_fail_at(parse, 1, 1, "cannot be read: %s", strerror(errno));
            return;
        }
        if (XML_ParseBuffer(parse->expat, (int)count, count == 0) != XML_STATUS_OK) {
            if (parse->result != BRUME_OK) return;
            enum XML_Error code = XML_GetErrorCode(parse->expat);
            if (code == XML_ERROR_NO_MEMORY)
                xml_fail_memory(parse);
            else
                xml_fail_at(parse, current_line(parse), current_column(parse), "%s", XML_ErrorString(code));
            return;
        }
        if (count == 0 || parse->result != BRUME_OK) return;
    }
}

brume_result xml_parse_file(xml_reader *reader, const char *path, const xml_file *includer, int include_depth,
                            xml_node *parent, int outer_depth, const char *include_name, const xml_node *where) {
    brume_context *context = reader->context;
    const char *at = where ? where->file->name : path;
    int line = where ? where->line : 1, column = where ? where->column : 1;
    for (const xml_file *f = includer; f; f = f->includer)
        if (strcmp(f->name, path) == 0)
            return brume_fail(context, BRUME_ERROR_SCENE, "%s:%d:%d: '%s' includes itself", at, line, column, path);
    if (include_depth > MAX_INCLUDE_DEPTH)
        return brume_fail(context, BRUME_ERROR_SCENE, "%s:%d:%d: includes are nested more than %d deep", at, line,
                          column, MAX_INCLUDE_DEPTH);
    if (++reader->files > MAX_FILES)
        return brume_fail(context, BRUME_ERROR_SCENE, "%s:%d:%d: more than %d files are included", at, line, column,
                          MAX_FILES);
    /* The scene itself may come from a pipe: whoever started the tool knows what is at the other end. */
    FILE *stream = includer ? brume_file_open_named(path) : fopen(path, "rb");
    if (!stream)
        return brume_fail(context, brume_read_error(errno), "%s:%d:%d: cannot open '%s': %s", at, line, column, path,
                          strerror(errno));

    brume_result result = BRUME_ERROR_MEMORY;
    int reported = 0;
    xml_parse *parse = calloc(1, sizeof *parse);
    xml_file *file = xml_tree_alloc(reader->tree, sizeof *file);
    if (!parse || !file) goto cleanup;
    *file = (xml_file){.name = xml_tree_copy(reader->tree, path, strlen(path)),
                       .folder = xml_tree_copy(reader->tree, path, brume_path_folder(path)),
                       .includer = includer};
    parse->expat = XML_ParserCreate(NULL);
    if (!file->name || !file->folder || !parse->expat) goto cleanup;
    parse->reader = reader;
    parse->file = file;
    parse->parent = parent;
    parse->outer_depth = outer_depth;
    parse->include_depth = include_depth;
    parse->include_name = include_name;
    XML_SetUserData(parse->expat, parse);
    XML_SetElementHandler(parse->expat, on_start, on_end);
    XML_SetCharacterDataHandler(parse->expat, on_text);
    XML_SetStartDoctypeDeclHandler(parse->expat, on_doctype);
    pump(parse, stream);
    result = parse->result;
    reported = 1;

cleanup:
    if (!reported) brume_fail(context, result, "%s: no memory for the scene file", path);
    if (parse && parse->expat) XML_ParserFree(parse->expat);
    free(parse);
    fclose(stream);
    return result;
}

static brume_result check_parameters(brume_context *context, const char *path, const xml_parameters *parameters) {
    for (size_t i = 0; i < parameters->count; i++) {
        const xml_parameter *p = &parameters->items[i];
        if (!p->given || p->used) continue;
        const char *names[64];
        size_t count = 0;
        for (size_t j = 0; j < parameters->count && count < 64; j++)
            if (!parameters->items[j].given) names[count++] = parameters->items[j].name;
        const char *near = mitsuba_nearest(p->name, names, count);
        if (near)
            return brume_fail(context, BRUME_ERROR_SCENE, "%s:1:1: the parameter '%s' is not used; did you mean '%s'?",
                              path, p->name, near);
        return brume_fail(context, BRUME_ERROR_SCENE, "%s:1:1: the parameter '%s' is not used", path, p->name);
    }
    return BRUME_OK;
}

brume_result xml_tree_read(brume_context *context, const char *path, const brume_parameter *parameters,
                           size_t parameter_count, xml_tree *out) {
    xml_tree tree = {NULL, 0, NULL};
    xml_reader reader = {context, &tree, {NULL, 0, 0}, 0};
    brume_result result = BRUME_OK;
    for (size_t i = 0; i < parameter_count && result == BRUME_OK; i++) {
        const brume_parameter *p = &parameters[i];
        if (!p->name || !p->name[0] || !p->value)
            result = brume_fail(context, BRUME_ERROR_ARGUMENT, "scene parameter %d has no name or no value", (int)i);
        else if (xml_parameters_find(&reader.parameters, p->name))
            result = brume_fail(context, BRUME_ERROR_ARGUMENT, "the scene parameter '%s' is given twice", p->name);
        else if (xml_parameters_add(&reader.parameters, p->name, p->value, 1) != BRUME_OK)
            result = brume_fail(context, BRUME_ERROR_MEMORY, "no memory for the scene's parameters");
    }
    if (result == BRUME_OK) result = xml_parse_file(&reader, path, NULL, 0, NULL, 0, NULL, NULL);
    if (result == BRUME_OK) result = check_parameters(context, path, &reader.parameters);
    xml_parameters_free(&reader.parameters);
    if (result == BRUME_OK)
        *out = tree;
    else
        xml_tree_free(&tree);
    return result;
}

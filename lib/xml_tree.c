/* xml_tree.c -- expat events to the tree of xml_tree.h.
 *
 * Scene files come from anywhere, so everything that could grow without bound is bounded: nesting, includes, the
 * memory of the tree. A document type declaration is refused altogether: scenes need none, and it is where external
 * entities and entities that expand exponentially come from.
 */
#include "xml_tree.h"

#include "mitsuba_spelling.h"
#include "platform.h"
#include "xml_parameters.h"

#include <errno.h>
#include <expat.h>
#include <limits.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define MAX_DEPTH 100
#define MAX_INCLUDE_DEPTH 15
#define MAX_FILES 1000
#define MAX_BYTES ((size_t)1 << 29)
#define BLOCK_BYTES ((size_t)1 << 16)

/* ---- memory ----------------------------------------------------------------------------------------------------- */

typedef struct xml_block {
    struct xml_block *next;
    size_t used, size;
} xml_block;

static size_t align_up(size_t size) { return (size + 15) & ~(size_t)15; }

void *xml_tree_alloc(xml_tree *tree, size_t size) {
    size_t header = align_up(sizeof(xml_block));
    if (size > MAX_BYTES) return NULL;
    size = align_up(size ? size : 1);
    xml_block *block = tree->blocks;
    if (!block || block->size - block->used < size) {
        size_t bytes = size + header > BLOCK_BYTES ? size + header : BLOCK_BYTES;
        if (tree->bytes + bytes > MAX_BYTES) return NULL;
        block = malloc(bytes);
        if (!block) return NULL;
        tree->bytes += bytes;
        *block = (xml_block){tree->blocks, header, bytes};
        tree->blocks = block;
    }
    void *out = (char *)block + block->used;
    block->used += size;
    return out;
}

char *xml_tree_copy(xml_tree *tree, const char *text, size_t length) {
    char *copy = xml_tree_alloc(tree, length + 1);
    if (!copy) return NULL;
    memcpy(copy, text, length);
    copy[length] = '\0';
    return copy;
}

void xml_tree_free(xml_tree *tree) {
    for (xml_block *block = tree->blocks; block;) {
        xml_block *next = block->next;
        free(block);
        block = next;
    }
    *tree = (xml_tree){NULL, 0, NULL};
}

const char *xml_attribute_value(const xml_node *node, const char *name) {
    for (uint32_t i = 0; i < node->attribute_count; i++)
        if (strcmp(node->attributes[i].name, name) == 0) return node->attributes[i].value;
    return NULL;
}

/* ---- places ----------------------------------------------------------------------------------------------------- */

static char *join(xml_tree *tree, const char *folder, const char *name) {
    size_t a = strlen(folder), b = strlen(name);
    char *path = xml_tree_alloc(tree, a + b + 1);
    if (!path) return NULL;
    memcpy(path, folder, a);
    memcpy(path + a, name, b + 1);
    return path;
}

const char *xml_tree_resolve(xml_tree *tree, const xml_file *file, const char *name) {
    if (brume_path_is_absolute(name)) return xml_tree_copy(tree, name, strlen(name));
    const char *beside = join(tree, file->folder, name);
    if (!beside) return NULL;
    for (const xml_file *f = file; f; f = f->includer) {
        for (const xml_search *s = f->search; s; s = s->next) {
            const char *path = join(tree, s->folder, name);
            if (!path || brume_path_exists(path)) return path;
        }
        const char *path = f == file ? beside : join(tree, f->folder, name);
        if (!path || brume_path_exists(path)) return path;
    }
    return brume_path_exists(name) ? xml_tree_copy(tree, name, strlen(name)) : beside;
}

static const char *folder_of(xml_tree *tree, const char *path) {
    return xml_tree_copy(tree, path, brume_path_folder(path));
}

/* ---- reading ---------------------------------------------------------------------------------------------------- */

typedef struct xml_reader {
    brume_context *context;
    xml_tree *tree;
    xml_parameters parameters;
    int files;
} xml_reader;

/* One file being parsed. */
typedef struct xml_parse {
    xml_reader *reader;
    XML_Parser expat;
    xml_file *file;
    xml_node *parent; /* of the element to come; NULL before a scene file's root */
    xml_node *stack[MAX_DEPTH];
    int depth;       /* open elements of this file */
    int outer_depth; /* open elements of the files that include it */
    int include_depth;
    int closed_only; /* inside <include>, <default> or <path>, which have no content: their depth */
    const char *closed_tag;
    const char *include_name; /* what <include name="..."> calls the included object */
    brume_result result;
} xml_parse;

static brume_result read_file(xml_reader *reader, const char *path, const xml_file *includer, int include_depth,
                              xml_node *parent, int outer_depth, const char *include_name, const xml_node *where);

static void fail_at(xml_parse *parse, int line, int column, const char *format, ...)
    __attribute__((format(printf, 4, 5)));

/* Keeps the first error and stops expat. */
static void fail_at(xml_parse *parse, int line, int column, const char *format, ...) {
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

static void fail_memory(xml_parse *parse) {
    if (parse->result != BRUME_OK) return;
    if (parse->reader->tree->bytes + BLOCK_BYTES > MAX_BYTES)
        parse->result =
            brume_fail(parse->reader->context, BRUME_ERROR_SCENE, "%s:1:1: the scene file is larger than %d MiB",
                       parse->file->name, (int)(MAX_BYTES >> 20));
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
    if (!node || !list || !tag_copy) return fail_memory(parse), NULL;
    for (uint32_t i = 0; i < count; i++) {
        const char *name = attributes[2 * i], *text = attributes[2 * i + 1], *value = NULL, *unknown = NULL;
        int length = 0;
        if (strchr(text, '$')) {
            brume_result result =
                xml_parameters_substitute(&parse->reader->parameters, tree, text, &value, &unknown, &length);
            if (result == BRUME_ERROR_SCENE && unknown) {
                fail_at(parse, line, column, "undefined parameter: $%.*s", length, unknown);
                return NULL;
            }
            if (result == BRUME_ERROR_SCENE) {
                fail_at(parse, line, column, "attribute '%s' is too long after substitution", name);
                return NULL;
            }
        } else {
            value = xml_tree_copy(tree, text, strlen(text));
        }
        list[i] = (xml_attribute){xml_tree_copy(tree, name, strlen(name)), value};
        if (!list[i].name || !value) return fail_memory(parse), NULL;
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

static void append(xml_node *parent, xml_node *node) {
    if (parent->last)
        parent->last->next = node;
    else
        parent->first = node;
    parent->last = node;
}

/* Only the attributes named, and all that are required. */
static int check_attributes(xml_parse *parse, const xml_node *node, const char *required, const char *other) {
    for (uint32_t i = 0; i < node->attribute_count; i++) {
        const char *name = node->attributes[i].name;
        if (strcmp(name, required) != 0 && (!other || strcmp(name, other) != 0)) {
            fail_at(parse, node->line, node->column, "unexpected attribute '%s' in <%s>", name, node->tag);
            return 0;
        }
    }
    if (!xml_attribute_value(node, required)) {
        fail_at(parse, node->line, node->column, "<%s> needs the attribute '%s'", node->tag, required);
        return 0;
    }
    return 1;
}

static void start_default(xml_parse *parse, const xml_node *node) {
    if (!check_attributes(parse, node, "name", "value")) return;
    const char *name = xml_attribute_value(node, "name"), *value = xml_attribute_value(node, "value");
    if (!value)
        fail_at(parse, node->line, node->column, "<default> needs the attribute 'value'");
    else if (!*name)
        fail_at(parse, node->line, node->column, "the name of a <default> must not be empty");
    else if (!xml_parameters_find(&parse->reader->parameters, name) &&
             xml_parameters_add(&parse->reader->parameters, name, value, 0) != BRUME_OK)
        fail_memory(parse);
}

static void start_path(xml_parse *parse, const xml_node *node) {
    if (!check_attributes(parse, node, "value", NULL)) return;
    if (parse->depth != 1) {
        fail_at(parse, node->line, node->column, "<path> must be a child of the root element");
        return;
    }
    xml_tree *tree = parse->reader->tree;
    const char *folder = xml_tree_resolve(tree, parse->file, xml_attribute_value(node, "value"));
    if (!folder) {
        fail_memory(parse);
        return;
    }
    if (!brume_path_is_folder(folder)) {
        fail_at(parse, node->line, node->column, "the folder '%s' does not exist", folder);
        return;
    }
    xml_search *search = xml_tree_alloc(tree, sizeof *search);
    const char *with_slash = join(tree, folder, "/");
    if (!search || !with_slash) {
        fail_memory(parse);
        return;
    }
    *search = (xml_search){with_slash, parse->file->search};
    parse->file->search = search;
}

static void start_include(xml_parse *parse, const xml_node *node) {
    if (!check_attributes(parse, node, "filename", "name")) return;
    const char *path = xml_tree_resolve(parse->reader->tree, parse->file, xml_attribute_value(node, "filename"));
    if (!path) {
        fail_memory(parse);
        return;
    }
    brume_result result = read_file(parse->reader, path, parse->file, parse->include_depth + 1, parse->parent,
                                    parse->outer_depth + parse->depth, xml_attribute_value(node, "name"), node);
    if (result != BRUME_OK && parse->result == BRUME_OK) {
        parse->result = result; /* the message is the included file's */
        XML_StopParser(parse->expat, XML_FALSE);
    }
}

/* Takes the root's version off its attributes. */
static int read_version(xml_parse *parse, xml_node *node) {
    const char *version = xml_attribute_value(node, "version");
    if (!version) {
        fail_at(parse, node->line, node->column, "the root element <%s> needs the attribute 'version'", node->tag);
        return 0;
    }
    int length = -1;
    int patch;
    char digits_only = 1;
    for (const char *c = version; *c; c++)
        if ((*c < '0' || *c > '9') && *c != '.') digits_only = 0;
    if (!digits_only || strlen(version) > 11 ||
        sscanf(version, "%d.%d.%d%n", &parse->file->major, &parse->file->minor, &patch, &length) != 3 ||
        version[length]) {
        fail_at(parse, node->line, node->column, "the version '%s' is not of the form 3.0.0", version);
        return 0;
    }
    if (parse->file->major > 3) {
        fail_at(parse, node->line, node->column, "version %s is newer than this reader, which knows 3.x", version);
        return 0;
    }
    uint32_t kept = 0;
    for (uint32_t i = 0; i < node->attribute_count; i++)
        if (strcmp(node->attributes[i].name, "version") != 0) node->attributes[kept++] = node->attributes[i];
    node->attribute_count = kept;
    return 1;
}

/* Makes the root of an included file a child of the including element, or, if it is a <scene>, only its children. */
static void start_root(xml_parse *parse, xml_node *node) {
    if (!read_version(parse, node)) return;
    int included = parse->parent != NULL;
    if (included && strcmp(node->tag, "scene") == 0) {
        if (node->attribute_count)
            fail_at(parse, node->line, node->column, "unexpected attribute '%s' in <scene>", node->attributes[0].name);
        if (parse->include_name)
            fail_at(parse, node->line, node->column, "a <scene> can't be included under the name '%s'",
                    parse->include_name);
        parse->stack[parse->depth++] = parse->parent;
        return;
    }
    if (included && parse->include_name) {
        uint32_t i = 0;
        while (i < node->attribute_count && strcmp(node->attributes[i].name, "name") != 0) i++;
        node->attributes[i] = (xml_attribute){"name", parse->include_name};
        if (i == node->attribute_count) node->attribute_count++;
    }
    if (included)
        append(parse->parent, node);
    else
        parse->reader->tree->root = node;
    parse->stack[parse->depth++] = node;
    parse->parent = node;
}

static void XMLCALL on_start(void *data, const char *tag, const char **attributes) {
    xml_parse *parse = data;
    if (parse->result != BRUME_OK) return;
    int line = current_line(parse), column = current_column(parse);
    if (parse->closed_only) {
        fail_at(parse, line, column, "<%s> can't be inside <%s>", tag, parse->closed_tag);
        return;
    }
    if (parse->outer_depth + parse->depth + 1 >= MAX_DEPTH) {
        fail_at(parse, line, column, "elements are nested more than %d deep", MAX_DEPTH - 1);
        return;
    }
    xml_node *node = new_node(parse, tag, attributes);
    if (!node) return;
    if (parse->depth == 0) {
        start_root(parse, node);
        return;
    }
    int is_default = strcmp(tag, "default") == 0, is_path = strcmp(tag, "path") == 0;
    if (is_default || is_path || strcmp(tag, "include") == 0) {
        parse->closed_only = 1;
        parse->closed_tag = node->tag;
        if (is_default)
            start_default(parse, node);
        else if (is_path)
            start_path(parse, node);
        else
            start_include(parse, node);
        return;
    }
    append(parse->parent, node);
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
            fail_at(parse, current_line(parse), current_column(parse),
                    "text outside of elements' attributes has no meaning here");
            return;
        }
}

static void XMLCALL on_doctype(void *data, const char *name, const char *system, const char *public_id, int subset) {
    xml_parse *parse = data;
    (void)name, (void)system, (void)public_id, (void)subset;
    fail_at(parse, current_line(parse), current_column(parse), "a document type declaration is not allowed");
}

/* Feeds the whole file to expat. */
static void pump(xml_parse *parse, FILE *file) {
    for (;;) {
        void *buffer = XML_GetBuffer(parse->expat, 1 << 16);
        if (!buffer) {
            fail_memory(parse);
            return;
        }
        size_t count = fread(buffer, 1, 1 << 16, file);
        if (ferror(file)) {
            fail_at(parse, 1, 1, "cannot be read: %s", strerror(errno));
            return;
        }
        if (XML_ParseBuffer(parse->expat, (int)count, count == 0) != XML_STATUS_OK) {
            if (parse->result != BRUME_OK) return;
            enum XML_Error code = XML_GetErrorCode(parse->expat);
            if (code == XML_ERROR_NO_MEMORY)
                fail_memory(parse);
            else
                fail_at(parse, current_line(parse), current_column(parse), "%s", XML_ErrorString(code));
            return;
        }
        if (count == 0 || parse->result != BRUME_OK) return;
    }
}

static brume_result read_file(xml_reader *reader, const char *path, const xml_file *includer, int include_depth,
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
    FILE *stream = fopen(path, "rb");
    if (!stream)
        return brume_fail(context, brume_read_error(errno), "%s:%d:%d: cannot open '%s': %s", at, line, column, path,
                          strerror(errno));

    brume_result result = BRUME_ERROR_MEMORY;
    int reported = 0;
    xml_parse *parse = calloc(1, sizeof *parse);
    xml_file *file = xml_tree_alloc(reader->tree, sizeof *file);
    if (!parse || !file) goto cleanup;
    *file = (xml_file){.name = xml_tree_copy(reader->tree, path, strlen(path)),
                       .folder = folder_of(reader->tree, path),
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
    if (result == BRUME_OK) result = read_file(&reader, path, NULL, 0, NULL, 0, NULL, NULL);
    if (result == BRUME_OK) result = check_parameters(context, path, &reader.parameters);
    xml_parameters_free(&reader.parameters);
    if (result == BRUME_OK)
        *out = tree;
    else
        xml_tree_free(&tree);
    return result;
}

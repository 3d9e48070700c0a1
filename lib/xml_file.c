/* xml_file.c -- what belongs to the file rather than to the scene: its version, <default>, <path> and <include>. */
#include "xml_parse.h"

#include "platform.h"

#include <stdio.h>
#include <string.h>

/* Only the attributes named, and all that are required. */
static int check_attributes(xml_parse *parse, const xml_node *node, const char *required, const char *other) {
    for (uint32_t i = 0; i < node->attribute_count; i++) {
        const char *name = node->attributes[i].name;
        if (strcmp(name, required) != 0 && (!other || strcmp(name, other) != 0)) {
            xml_fail_at(parse, node->line, node->column, "unexpected attribute '%s' in <%s>", name, node->tag);
            return 0;
        }
    }
    if (!xml_attribute_value(node, required)) {
        xml_fail_at(parse, node->line, node->column, "<%s> needs the attribute '%s'", node->tag, required);
        return 0;
    }
    return 1;
}

void xml_start_default(xml_parse *parse, const xml_node *node) {
    if (!check_attributes(parse, node, "name", "value")) return;
    const char *name = xml_attribute_value(node, "name"), *value = xml_attribute_value(node, "value");
    if (!value)
        xml_fail_at(parse, node->line, node->column, "<default> needs the attribute 'value'");
    else if (!*name)
        xml_fail_at(parse, node->line, node->column, "the name of a <default> must not be empty");
    else if (!xml_parameters_find(&parse->reader->parameters, name) &&
             xml_parameters_add(&parse->reader->parameters, name, value, 0) != BRUME_OK)
        xml_fail_memory(parse);
}

void xml_start_path(xml_parse *parse, const xml_node *node) {
    if (!check_attributes(parse, node, "value", NULL)) return;
    if (parse->depth != 1) {
        xml_fail_at(parse, node->line, node->column, "<path> must be a child of the root element");
        return;
    }
    xml_tree *tree = parse->reader->tree;
    const char *folder = xml_tree_resolve(tree, parse->file, xml_attribute_value(node, "value"));
    if (!folder) {
        xml_fail_memory(parse);
        return;
    }
    if (!brume_path_is_folder(folder)) {
        xml_fail_at(parse, node->line, node->column, "the folder '%s' does not exist", folder);
        return;
    }
    xml_search *search = xml_tree_alloc(tree, sizeof *search);
    const char *with_slash = xml_tree_join(tree, folder, "/");
    if (!search || !with_slash) {
        xml_fail_memory(parse);
        return;
    }
    *search = (xml_search){with_slash, parse->file->search};
    parse->file->search = search;
}

void xml_start_include(xml_parse *parse, const xml_node *node) {
    if (!check_attributes(parse, node, "filename", "name")) return;
    const char *path = xml_tree_resolve(parse->reader->tree, parse->file, xml_attribute_value(node, "filename"));
    if (!path) {
        xml_fail_memory(parse);
        return;
    }
    brume_result result = xml_parse_file(parse->reader, path, parse->file, parse->include_depth + 1, parse->parent,
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
        xml_fail_at(parse, node->line, node->column, "the root element <%s> needs the attribute 'version'", node->tag);
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
        xml_fail_at(parse, node->line, node->column, "the version '%s' is not of the form 3.0.0", version);
        return 0;
    }
    if (parse->file->major > 3) {
        xml_fail_at(parse, node->line, node->column, "version %s is newer than this reader, which knows 3.x", version);
        return 0;
    }
    uint32_t kept = 0;
    for (uint32_t i = 0; i < node->attribute_count; i++)
        if (strcmp(node->attributes[i].name, "version") != 0) node->attributes[kept++] = node->attributes[i];
    node->attribute_count = kept;
    return 1;
}

/* Makes the root of an included file a child of the including element, or, if it is a <scene>, only its children. */
void xml_start_root(xml_parse *parse, xml_node *node) {
    if (!read_version(parse, node)) return;
    int included = parse->parent != NULL;
    if (included && strcmp(node->tag, "scene") == 0) {
        if (node->attribute_count)
            xml_fail_at(parse, node->line, node->column, "unexpected attribute '%s' in <scene>",
                        node->attributes[0].name);
        if (parse->include_name)
            xml_fail_at(parse, node->line, node->column, "a <scene> can't be included under the name '%s'",
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
        xml_append(parse->parent, node);
    else
        parse->reader->tree->root = node;
    parse->stack[parse->depth++] = node;
    parse->parent = node;
}

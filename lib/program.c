/* program.c -- kernels from source: see program.h. */
#include "program.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "text.h"

enum { MAX_INCLUDE_DEPTH = 16, MAX_INCLUDED = 64 };

typedef struct expansion {
    brume_context *context;
    brume_text text;
    char *included[MAX_INCLUDED]; /* names of the files that are in the text already */
    int included_count;
} expansion;

/* malloc'ed text of a file of cl/; NULL with errno set, 0 if there is none. */
static char *read_source(const char *name) {
    const char *folder = getenv("BRUME_CL_DIR");
    if (folder && *folder) {
        brume_text path = {0};
        brume_text_format(&path, "%s/%s", folder, name);
        errno = ENOMEM;
        char *text = path.failed ? NULL : brume_text_read_file(path.data, NULL);
        int error = errno;
        free(path.data);
        errno = error;
        return text;
    }
    for (const brume_source *s = brume_sources; s->name; s++) {
        if (strcmp(s->name, name) != 0) continue;
        size_t size = strlen(s->text) + 1;
        char *copy = malloc(size);
        if (copy) memcpy(copy, s->text, size);
        return copy;
    }
    errno = 0;
    return NULL;
}

static brume_result expand_file(expansion *e, const char *name, int depth);

/* `#include "name"` at the start of a line: copies name and returns 1. */
static int parse_include(const char *line, size_t length, char name[64]) {
    static const char word[] = "#include \"";
    size_t start = sizeof word - 1;
    if (length <= start || strncmp(line, word, start) != 0) return 0;
    const char *end = memchr(line + start, '"', length - start);
    if (!end) return 0;
    size_t size = (size_t)(end - line) - start;
    const char *slash = NULL; /* only the last part of a path counts: cl/ is flat */
    for (const char *c = line + start; c < end; c++)
        if (*c == '/') slash = c;
    const char *from = slash ? slash + 1 : line + start;
    size = (size_t)(end - from);
    if (size == 0 || size >= 64) return 0;
    memcpy(name, from, size);
    name[size] = 0;
    return 1;
}

static brume_result expand_text(expansion *e, const char *file, const char *text, int depth) {
    if (depth > MAX_INCLUDE_DEPTH)
        return brume_fail(e->context, BRUME_ERROR_BUILD, "%s: includes nest deeper than %d", file, MAX_INCLUDE_DEPTH);
    int line_number = 1;
    brume_text_format(&e->text, "#line 1 \"%s\"\n", file);
    for (const char *line = text; *line; line_number++) {
        const char *end = strchr(line, '\n');
        size_t length = end ? (size_t)(end - line) : strlen(line);
        char name[64];
        if (parse_include(line, length, name)) {
            brume_result result = expand_file(e, name, depth + 1);
            if (result != BRUME_OK) return result;
            brume_text_format(&e->text, "#line %d \"%s\"\n", line_number + 1, file);
        } else {
            brume_text_add(&e->text, line, length);
            brume_text_add(&e->text, "\n", 1);
        }
        line += length + (end != NULL);
    }
    return BRUME_OK;
}

static brume_result expand_file(expansion *e, const char *name, int depth) {
    for (int i = 0; i < e->included_count; i++)
        if (strcmp(e->included[i], name) == 0) return BRUME_OK;
    if (e->included_count == MAX_INCLUDED)
        return brume_fail(e->context, BRUME_ERROR_BUILD, "more than %d kernel files", MAX_INCLUDED);
    char *text = read_source(name);
    if (!text && errno == ENOMEM)
        return brume_fail(e->context, BRUME_ERROR_MEMORY, "expanding kernel sources: out of memory");
    if (!text) return brume_fail(e->context, BRUME_ERROR_BUILD, "kernel source %s: not found", name);
    size_t size = strlen(name) + 1;
    char *copy = malloc(size);
    if (!copy) {
        free(text);
        return brume_fail(e->context, BRUME_ERROR_MEMORY, "expanding kernel sources: out of memory");
    }
    memcpy(copy, name, size);
    e->included[e->included_count++] = copy;
    brume_result result = expand_text(e, name, text, depth);
    free(text);
    return result;
}

static brume_result finish_expansion(expansion *e, brume_result result, char **out) {
    for (int i = 0; i < e->included_count; i++) free(e->included[i]);
    if (result == BRUME_OK && e->text.failed)
        result = brume_fail(e->context, BRUME_ERROR_MEMORY, "expanding kernel sources: out of memory");
    if (result == BRUME_OK)
        *out = e->text.data;
    else
        free(e->text.data);
    return result;
}

brume_result brume_program_expand(brume_context *context, const char *entry, char **out) {
    expansion e = {.context = context};
    return finish_expansion(&e, expand_file(&e, entry, 0), out);
}

/* The compiler's whole log, as the message of a failed build. */
static brume_result fail_build(brume_device *device, cl_program program, const char *entry, cl_int code) {
    if (code == CL_OUT_OF_HOST_MEMORY || code == CL_OUT_OF_RESOURCES)
        return brume_fail_cl(device->context, code, "building kernels");
    size_t size = 0;
    if (clGetProgramBuildInfo(program, device->id, CL_PROGRAM_BUILD_LOG, 0, NULL, &size) != CL_SUCCESS) size = 0;
    char *log = calloc(size + 1, 1);
    if (log && size &&
        clGetProgramBuildInfo(program, device->id, CL_PROGRAM_BUILD_LOG, size, log, NULL) != CL_SUCCESS)
        log[0] = 0;
    brume_result result = brume_fail(device->context, BRUME_ERROR_BUILD, "%s does not build on %s: %s (%d)\n%s", entry,
                                     device->info.name, brume_cl_error_name(code), (int)code, log ? log : "");
    free(log);
    return result;
}

/* Everything but the text that the compiler is told. */
static brume_result all_options(brume_device *device, uint32_t lanes, brume_precision precision, const char *options,
                                char **out) {
    cl_device_fp_config config = 0;
    cl_int code = clGetDeviceInfo(device->id, CL_DEVICE_SINGLE_FP_CONFIG, sizeof config, &config, NULL);
    if (code != CL_SUCCESS) return brume_fail_cl(device->context, code, "asking the device how it rounds");
    brume_text all = {0};
    /* -w: PoCL prints warnings to stderr, where a library has no business; make check-cl shows them to us. */
    brume_text_format(&all, "-cl-std=CL1.2 -w -DBRUME_DEVICE=1 -DLANES=%u%s%s ", lanes,
                      precision == BRUME_PRECISION_DOUBLE ? " -DBRUME_DOUBLE" : "",
                      config & CL_FP_CORRECTLY_ROUNDED_DIVIDE_SQRT ? " -cl-fp32-correctly-rounded-divide-sqrt" : "");
    if (options) brume_text_add(&all, options, strlen(options));
    if (all.failed) {
        free(all.data);
        return brume_fail(device->context, BRUME_ERROR_MEMORY, "building kernels: out of memory");
    }
    *out = all.data;
    return BRUME_OK;
}

/* Takes over `text`. */
static brume_result source_of(brume_device *device, const char *entry, char *text, uint32_t lanes,
                              brume_precision precision, const char *options, brume_program_source *out) {
    brume_program_source source = {entry, text, NULL};
    brume_result result = all_options(device, lanes, precision, options, &source.options);
    if (result == BRUME_OK)
        *out = source;
    else
        brume_program_source_free(&source);
    return result;
}

brume_result brume_program_source_make(brume_device *device, const char *entry, uint32_t lanes,
                                       brume_precision precision, const char *options, brume_program_source *out) {
    char *text = NULL;
    BRUME_TRY(brume_program_expand(device->context, entry, &text));
    return source_of(device, entry, text, lanes, precision, options, out);
}

void brume_program_source_free(brume_program_source *source) {
    free(source->text);
    free(source->options);
    memset(source, 0, sizeof *source);
}

brume_result brume_program_compile(brume_device *device, const brume_program_source *source, cl_program *out) {
    cl_int code;
    const char *text = source->text;
    cl_program program = clCreateProgramWithSource(device->cl, 1, &text, NULL, &code);
    if (code != CL_SUCCESS) return brume_fail_cl(device->context, code, "creating a program");
    code = clBuildProgram(program, 1, &device->id, source->options, NULL, NULL);
    if (code != CL_SUCCESS) {
        brume_result result = fail_build(device, program, source->entry, code);
        clReleaseProgram(program);
        return result;
    }
    *out = program;
    return BRUME_OK;
}

brume_result brume_program_build_text(brume_device *device, const char *text, uint32_t lanes, brume_precision precision,
                                      const char *options, cl_program *out) {
    expansion e = {.context = device->context};
    brume_program_source source = {0};
    char *expanded = NULL;
    BRUME_TRY(finish_expansion(&e, expand_text(&e, "text", text, 0), &expanded));
    BRUME_TRY(source_of(device, "text", expanded, lanes, precision, options, &source));
    brume_result result = brume_program_compile(device, &source, out);
    brume_program_source_free(&source);
    return result;
}

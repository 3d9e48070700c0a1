/* device_test.c -- see device_test.h. */
#include "device_test.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "device.h"
#include "program.h"

enum { MAX_ARRAYS = 32, MAX_PROGRAMS = 16 };

static brume_context *test_context;
static brume_device *test_device;

/* Programs built so far, as tests run the same text many times. */
static struct built {
    char *text, *options;
    uint32_t lanes;
    brume_precision precision;
    cl_program program;
} built[MAX_PROGRAMS];
static size_t built_count;

static const char prelude[] =
    "#include \"lane.h\"\n"
    "#define AT (get_global_id(0) * LANES)\n"
    "#if LANES == 1\n"
    "#define LOAD(p) (*(p))\n"
    "#define STORE(p, x) (*(p) = (x))\n"
    "#define LOAD_BITS(p) (*(p))\n"
    "#define STORE_BITS(p, x) (*(p) = (x))\n"
    "#else\n"
    "#define LOAD(p) LANE_PASTE(vload, LANES)(0, p)\n"
    "#define STORE(p, x) LANE_PASTE(vstore, LANES)(x, 0, p)\n"
    "#define LOAD_BITS(p) LANE_PASTE(vload, LANES)(0, p)\n"
    "#define STORE_BITS(p, x) LANE_PASTE(vstore, LANES)(x, 0, p)\n"
    "#endif\n"
    "#define STORE_MASK(p, m) STORE_BITS(p, to_ureal32((m) ? I(1) : I(0)))\n";

int device_test_setup(void **state) {
    (void)state;
    if (brume_context_create(&test_context) != BRUME_OK) return -1;
    brume_result result = brume_device_open(test_context, BRUME_DEVICE_ANY, &test_device);
    if (result != BRUME_OK && result != BRUME_ERROR_NO_DEVICE) {
        fprintf(stderr, "%s\n", brume_context_message(test_context));
        return -1;
    }
    return 0;
}

int device_test_teardown(void **state) {
    (void)state;
    for (; built_count > 0; built_count--) {
        struct built *b = &built[built_count - 1];
        clReleaseProgram(b->program);
        free(b->text);
        free(b->options);
    }
    brume_device_destroy(test_device);
    brume_context_destroy(test_context);
    test_device = NULL;
    test_context = NULL;
    return 0;
}

int device_test_offers(brume_precision precision) {
    return test_device && (precision == BRUME_PRECISION_FLOAT || test_device->info.has_double);
}

static void must_build(brume_result result) {
    if (result != BRUME_OK) fail_msg("%s", brume_context_message(test_context));
}

static void must_cl(cl_int code, const char *what) {
    if (code != CL_SUCCESS) fail_msg("%s: OpenCL error %d", what, (int)code);
}

static size_t element_size(device_array_kind kind, brume_precision precision) {
    if (kind == READ_RAW) return 1;
    if (kind == READ_BITS || kind == WRITE_BITS) return sizeof(uint32_t);
    return precision == BRUME_PRECISION_DOUBLE ? sizeof(double) : sizeof(float);
}

static cl_mem upload(const device_array *a, brume_precision precision) {
    size_t bytes = a->count * element_size(a->kind, precision);
    void *staged = NULL;
    const void *from = a->data;
    if (a->kind == READ_REAL && precision == BRUME_PRECISION_FLOAT) {
        float *floats = staged = malloc(bytes + 1);
        assert_non_null(staged);
        for (size_t i = 0; i < a->count; i++) floats[i] = (float)((const double *)a->data)[i];
        from = staged;
    } else if (a->kind == WRITE_REAL || a->kind == WRITE_BITS) {
        from = staged = calloc(1, bytes + 1); /* what a kernel forgets to write is 0 */
        assert_non_null(staged);
    }
    cl_int code;
    cl_mem buffer = clCreateBuffer(test_device->cl, CL_MEM_READ_WRITE | CL_MEM_COPY_HOST_PTR, bytes ? bytes : 1,
                                   (void *)(uintptr_t)from, &code);
    free(staged);
    must_cl(code, "creating a buffer");
    return buffer;
}

static void download(const device_array *a, brume_precision precision, cl_mem buffer) {
    if (a->kind != WRITE_REAL && a->kind != WRITE_BITS) return;
    size_t bytes = a->count * element_size(a->kind, precision);
    int widen = a->kind == WRITE_REAL && precision == BRUME_PRECISION_FLOAT;
    float *floats = widen ? malloc(bytes + 1) : NULL;
    assert_true(!widen || floats);
    void *to = widen ? (void *)floats : a->data;
    must_cl(clEnqueueReadBuffer(test_device->queue, buffer, CL_TRUE, 0, bytes, to, 0, NULL, NULL), "reading a buffer");
    for (size_t i = 0; widen && i < a->count; i++) ((double *)a->data)[i] = floats[i];
    free(floats);
}

static char *copy_of(const char *text) {
    char *copy = malloc(strlen(text) + 1);
    assert_non_null(copy);
    return strcpy(copy, text);
}

static cl_program program_of(const char *text, const char *options, uint32_t lanes, brume_precision precision) {
    for (size_t i = 0; i < built_count; i++) {
        const struct built *b = &built[i];
        if (b->lanes == lanes && b->precision == precision && !strcmp(b->text, text) && !strcmp(b->options, options))
            return b->program;
    }
    char *whole = malloc(sizeof prelude + strlen(text));
    assert_non_null(whole);
    strcpy(whole, prelude);
    strcat(whole, text);
    cl_program program = NULL;
    brume_result result = brume_program_build_text(test_device, whole, lanes, precision, options, &program);
    free(whole);
    must_build(result);
    if (built_count == MAX_PROGRAMS) { /* the oldest makes room */
        clReleaseProgram(built[0].program);
        free(built[0].text);
        free(built[0].options);
        memmove(built, built + 1, --built_count * sizeof *built);
    }
    struct built fresh = {copy_of(text), copy_of(options), lanes, precision, program};
    built[built_count++] = fresh;
    return program;
}

void device_test_run(const char *text, const char *options, uint32_t lanes, brume_precision precision, size_t elements,
                     const device_array *arrays, size_t array_count) {
    assert_true(array_count <= MAX_ARRAYS && elements % 16 == 0);
    cl_program program = program_of(text, options ? options : "", lanes, precision);
    cl_int code;
    cl_kernel kernel = clCreateKernel(program, "test", &code);
    must_cl(code, "creating the kernel");
    cl_mem buffers[MAX_ARRAYS];
    for (size_t i = 0; i < array_count; i++) {
        buffers[i] = upload(&arrays[i], precision);
        must_cl(clSetKernelArg(kernel, (cl_uint)i, sizeof buffers[i], &buffers[i]), "setting a kernel argument");
    }
    /* PoCL keeps a whole group's variables on one thread's stack, and would choose groups of thousands. */
    size_t items = elements / lanes, group = items % 16 == 0 ? 16 : 1;
    must_cl(clEnqueueNDRangeKernel(test_device->queue, kernel, 1, NULL, &items, &group, 0, NULL, NULL), "running");
    for (size_t i = 0; i < array_count; i++) {
        download(&arrays[i], precision, buffers[i]);
        clReleaseMemObject(buffers[i]);
    }
    clReleaseKernel(kernel);
}

const char *device_test_plant(const char *header, const char *from, const char *to, const char *kernel) {
    static char text[96 * 1024];
    const brume_source *source = brume_sources;
    while (source->name && strcmp(source->name, header) != 0) source++;
    const char *at = source->name ? strstr(source->text, from) : NULL;
    if (!at) fail_msg("there is no '%s' in %s to plant a bug in", from, header);
    int size = snprintf(text, sizeof text, "%.*s%s%s%s", (int)(at - source->text), source->text, to, at + strlen(from),
                        kernel);
    assert_true(size > 0 && size < (int)sizeof text);
    return text;
}

uint64_t test_random_bits(uint64_t *state) {
    uint64_t z = *state += 0x9e3779b97f4a7c15u;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
}

double test_random_unit(uint64_t *state) { return (double)(test_random_bits(state) >> 40) * 0x1p-24; }

double test_random_in(uint64_t *state, double low, double high) {
    return low + (high - low) * test_random_unit(state);
}

double ulp_error(long double x, long double y, brume_precision precision) {
    int wide = precision == BRUME_PRECISION_DOUBLE, digits = wide ? 53 : 24, smallest = wide ? -1074 : -149, exponent;
    (void)frexpl(y, &exponent);
    exponent -= digits;
    if (exponent < smallest || y == 0) exponent = smallest;
    return (double)(fabsl(x - y) / ldexpl(1, exponent));
}

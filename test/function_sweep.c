/* function_sweep.c -- see function_sweep.h. */
#include "function_sweep.h"

#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "program.h"
#include "text.h"

enum { BATCH = 1 << 22, GROUP = 16, MAX_CASES = 128, MAX_THREADS = 64 };

struct function_sweep {
    brume_context *context;
    brume_device *device;
    cl_program program;
    cl_kernel kernels[MAX_CASES]; /* in the order of function_case_at; NULL: not asked for */
    cl_mem list, out, table;
    const float *table_of; /* whose table is up there */
    float *y;
    uint32_t *bits;
    uint32_t lanes;
};

/* ---- kernels ----------------------------------------------------------------------------------------------------- */

static const char prelude[] =
    "#include \"scatter_segment.h\"\n"
    "#include \"path_light.h\"\n"
    "#include \"path_indirect.h\"\n"
    "#include \"light_ray.h\"\n"
    "#include \"camera.h\"\n"
    "#include \"film.h\"\n"
    "#include \"filter.h\"\n"
    "#include \"random.h\"\n"
    "#include \"texture.h\"\n"
    "#define AT (get_global_id(0) * LANES)\n"
    "#if LANES == 1\n"
    "#define LOAD_BITS(p) (*(p))\n"
    "#else\n"
    "#define LOAD_BITS(p) LANE_PASTE(vload, LANES)(0, p)\n"
    "#endif\n"
    "FN ureal32 bits_of(__global const uint *list, uint first, int listed) {\n"
    "    return listed ? LOAD_BITS(list + AT) : U32(first + (uint)AT) + to_ureal32(lane_index());\n"
    "}\n";

static const char *const inputs_text[] = {
    "    real x = as_real(bits), z = R(0);\n",
    "    real x = to_real(bits) * R(0x1p-24f), z = R(0);\n",
    "    real x = to_real(bits), z = R(0);\n",
    "    real x = gather(table, as_ireal(bits / U32(n))), z = gather(table, as_ireal(bits % U32(n)));\n",
};

static void add_kernel(brume_text *text, const function_case *c, uint32_t index) {
    brume_text_format(text,
                      "__kernel void f%u(__global const uint *list, uint first, int listed, float4 p,\n"
                      "                  __global const float *table, uint n, __global float *out) {\n"
                      "    ureal32 bits = bits_of(list, first, listed);\n"
                      "    real p0 = R(p.x), p1 = R(p.y), p2 = R(p.z), p3 = R(p.w), y;\n",
                      index);
    brume_text_add(text, inputs_text[c->inputs], strlen(inputs_text[c->inputs]));
    brume_text_add(text, c->body, strlen(c->body));
    brume_text_format(text, "    store_lanes(y, out + AT);\n}\n");
}

static brume_result create_buffers(function_sweep *s) {
    static const struct { cl_mem_flags flags; size_t size; } wanted[2] = {
        {CL_MEM_READ_ONLY, BATCH * sizeof(uint32_t)}, {CL_MEM_WRITE_ONLY, BATCH * sizeof(float)}};
    cl_mem *buffers[2] = {&s->list, &s->out};
    for (int i = 0; i < 2; i++) {
        cl_int code;
        *buffers[i] = clCreateBuffer(s->device->cl, wanted[i].flags, wanted[i].size, NULL, &code);
        if (code != CL_SUCCESS) return brume_fail_cl(s->context, code, "creating a buffer");
    }
    s->y = malloc(BATCH * sizeof *s->y);
    s->bits = malloc(BATCH * sizeof *s->bits);
    if (!s->y || !s->bits) return brume_fail(s->context, BRUME_ERROR_MEMORY, "comparing functions: out of memory");
    return BRUME_OK;
}

static brume_result build(function_sweep *s, const char *only) {
    brume_text text = {0};
    brume_text_add(&text, prelude, sizeof prelude - 1);
    for (uint32_t i = 0; function_case_at(i); i++)
        if (!only || strstr(function_case_at(i)->name, only)) add_kernel(&text, function_case_at(i), i);
    brume_result result = brume_program_build_text(s->device, text.data, s->lanes, BRUME_PRECISION_FLOAT,
                                                   "-DBVH_STACK=32", &s->program);
    free(text.data);
    if (result != BRUME_OK) return result;
    for (uint32_t i = 0; function_case_at(i) && i < MAX_CASES; i++) {
        if (only && !strstr(function_case_at(i)->name, only)) continue;
        char name[16];
        cl_int code;
        snprintf(name, sizeof name, "f%u", i);
        s->kernels[i] = clCreateKernel(s->program, name, &code);
        if (code != CL_SUCCESS) return brume_fail_cl(s->context, code, function_case_at(i)->name);
    }
    return create_buffers(s);
}

brume_result function_sweep_create(brume_context *context, brume_device *device, const char *only,
                                   function_sweep **out) {
    function_sweep *s = calloc(1, sizeof *s);
    if (!s) return brume_fail(context, BRUME_ERROR_MEMORY, "comparing functions: out of memory");
    s->context = context;
    s->device = device;
    s->lanes = device->info.lanes;
    brume_result result = build(s, only);
    if (result == BRUME_OK)
        *out = s;
    else
        function_sweep_destroy(s);
    return result;
}

void function_sweep_destroy(function_sweep *s) {
    if (!s) return;
    for (int i = 0; i < MAX_CASES; i++)
        if (s->kernels[i]) clReleaseKernel(s->kernels[i]);
    cl_mem buffers[3] = {s->list, s->out, s->table};
    for (int i = 0; i < 3; i++)
        if (buffers[i]) clReleaseMemObject(buffers[i]);
    if (s->program) clReleaseProgram(s->program);
    free(s->y);
    free(s->bits);
    free(s);
}

/* ---- running ----------------------------------------------------------------------------------------------------- */

static brume_result use_table(function_sweep *s, const float *table, size_t count) {
    static const float nothing[16];
    cl_int code;
    if (!table) table = nothing, count = 16;
    if (s->table && s->table_of == table) return BRUME_OK;
    if (s->table) clReleaseMemObject(s->table);
    s->table = clCreateBuffer(s->device->cl, CL_MEM_READ_ONLY | CL_MEM_COPY_HOST_PTR, count * sizeof *table,
                              (void *)(uintptr_t)table, &code);
    s->table_of = table;
    return code == CL_SUCCESS ? BRUME_OK : brume_fail_cl(s->context, code, "creating a buffer");
}

/* y of `count` inputs: s->bits if `listed`, else those from `first` on. */
static brume_result run(function_sweep *s, uint32_t index, uint32_t first, int listed, uint32_t count, const float *p) {
    const function_case *c = function_case_at(index);
    cl_kernel kernel = s->kernels[index];
    size_t n = 0, group = GROUP, unit = (size_t)GROUP * s->lanes, items = (count + unit - 1) / unit * GROUP;
    const float *table = c->table ? c->table(&n) : NULL;
    static const float none[FUNCTION_PARAMETERS];
    BRUME_TRY(use_table(s, table, n));
    cl_uint length = (cl_uint)n;
    if (listed) {
        for (size_t i = count; i < items * s->lanes; i++) s->bits[i] = s->bits[0];
        clEnqueueWriteBuffer(s->device->queue, s->list, CL_FALSE, 0, items * s->lanes * sizeof *s->bits, s->bits, 0,
                             NULL, NULL);
    }
    clSetKernelArg(kernel, 0, sizeof s->list, &s->list);
    clSetKernelArg(kernel, 1, sizeof first, &first);
    clSetKernelArg(kernel, 2, sizeof listed, &listed);
    clSetKernelArg(kernel, 3, FUNCTION_PARAMETERS * sizeof *p, p ? p : none);
    clSetKernelArg(kernel, 4, sizeof s->table, &s->table);
    clSetKernelArg(kernel, 5, sizeof length, &length);
    clSetKernelArg(kernel, 6, sizeof s->out, &s->out);
    cl_int code = clEnqueueNDRangeKernel(s->device->queue, kernel, 1, NULL, &items, &group, 0, NULL, NULL);
    if (code == CL_SUCCESS)
        code = clEnqueueReadBuffer(s->device->queue, s->out, CL_TRUE, 0, count * sizeof *s->y, s->y, 0, NULL, NULL);
    return code == CL_SUCCESS ? BRUME_OK : brume_fail_cl(s->context, code, c->name);
}

/* ---- comparing --------------------------------------------------------------------------------------------------- */

typedef struct slice {
    const function_case *c;
    const float *y, *p, *grid;
    const uint32_t *list; /* or NULL: from `first` on */
    size_t grid_size;
    uint32_t first, begin, end, row;
    function_worst worst;
} slice;

static void *compare(void *user) {
    slice *s = user;
    const function_case *c = s->c;
    s->worst.error = -1;
    for (uint32_t i = s->begin; i < s->end; i++) {
        function_result r = {.bits = s->list ? s->list[i] : s->first + i, .y = s->y[i], .p = s->p};
        switch (c->inputs) {
        case EVERY_FLOAT: r.x = function_float(r.bits); break;
        case EVERY_VARIATE: r.x = r.bits * 0x1p-24; break;
        case EVERY_WORD: r.x = r.bits; break;
        case EVERY_PAIR:
            r.x = s->grid[r.bits / s->grid_size];
            r.z = s->grid[r.bits % s->grid_size];
            break;
        }
        double error = c->error(&r);
        if (error <= s->worst.error) continue;
        s->worst.error = isnan(error) ? (double)INFINITY : error;
        s->worst.bits = r.bits;
        s->worst.parameters = s->row;
        s->worst.at = r;
    }
    return NULL;
}

static int thread_count(void) {
    long cores = sysconf(_SC_NPROCESSORS_ONLN);
    return cores < 1 ? 1 : cores > MAX_THREADS ? MAX_THREADS : (int)cores;
}

/* Adds what s->y holds to the worst so far. The same whatever the number of threads. */
static void compare_all(const function_sweep *s, slice whole, uint32_t count, function_worst *worst) {
    slice slices[MAX_THREADS];
    pthread_t threads[MAX_THREADS];
    int n = thread_count(), started[MAX_THREADS];
    whole.y = s->y;
    for (int t = 0; t < n; t++) {
        slices[t] = whole;
        slices[t].begin = (uint32_t)((uint64_t)count * (uint64_t)t / (uint64_t)n);
        slices[t].end = (uint32_t)((uint64_t)count * (uint64_t)(t + 1) / (uint64_t)n);
        started[t] = pthread_create(&threads[t], NULL, compare, &slices[t]) == 0;
        if (!started[t]) compare(&slices[t]);
    }
    for (int t = 0; t < n; t++) {
        if (started[t]) pthread_join(threads[t], NULL);
        uint64_t compared = worst->compared;
        if (slices[t].worst.error > worst->error) *worst = slices[t].worst;
        worst->compared = compared + (slices[t].end - slices[t].begin);
    }
}

static uint32_t index_of(const function_case *c) {
    uint32_t i = 0;
    while (function_case_at(i) != c) i++;
    return i;
}

static slice slice_of(const function_case *c, uint32_t row) {
    slice s = {.c = c, .row = row, .p = c->parameters ? c->parameters[row] : NULL};
    if (c->inputs == EVERY_PAIR) s.grid = c->table(&s.grid_size);
    return s;
}

static uint32_t rows_of(const function_case *c) { return c->parameters ? c->parameter_count : 1; }

brume_result function_sweep_all(function_sweep *s, const function_case *c, void (*progress)(double share),
                                function_worst *out) {
    uint64_t inputs = function_case_inputs(c), first = c->inputs == EVERY_FLOAT ? c->first : 0;
    memset(out, 0, sizeof *out);
    out->error = -1;
    for (uint32_t row = 0; row < rows_of(c); row++) {
        slice whole = slice_of(c, row);
        for (uint64_t done = 0; done < inputs; done += BATCH) {
            uint32_t count = inputs - done < BATCH ? (uint32_t)(inputs - done) : BATCH;
            whole.first = (uint32_t)(first + done);
            BRUME_TRY(run(s, index_of(c), whole.first, 0, count, whole.p));
            compare_all(s, whole, count, out);
            if (progress) progress((row + (double)(done + count) / (double)inputs) / rows_of(c));
        }
    }
    return BRUME_OK;
}

/* ---- a sample ---------------------------------------------------------------------------------------------------- */

/* `count` at most; what lies outside of the inputs is left out. */
static uint32_t add_around(const function_case *c, uint64_t middle, uint32_t reach, uint32_t *bits, uint32_t count) {
    uint64_t first = c->inputs == EVERY_FLOAT ? c->first : 0, inputs = function_case_inputs(c);
    for (int64_t i = (int64_t)middle - reach; i <= (int64_t)middle + reach; i++)
        if (i >= (int64_t)first && (uint64_t)i - first < inputs && count < BATCH) bits[count++] = (uint32_t)i;
    return count;
}

static uint32_t sample(const function_case *c, uint32_t count, uint32_t *bits) {
    uint64_t first = c->inputs == EVERY_FLOAT ? c->first : 0, inputs = function_case_inputs(c);
    uint32_t n = 0;
    uint64_t step = inputs / count;
    for (uint32_t i = 0; i < count && i < inputs; i++) {
        /* somewhere in the i-th of equal parts, by a Weyl sequence */
        uint64_t part = inputs * i / count;
        bits[n++] = (uint32_t)(first + part + (step > 1 ? (uint64_t)(i * 0x9e3779b9u) * step >> 32 : 0));
    }
    if (c->inputs == EVERY_FLOAT)
        for (uint32_t binade = 0; binade < 512; binade++) n = add_around(c, (uint64_t)binade << 23, 3, bits, n);
    for (uint64_t power = 1; c->inputs != EVERY_FLOAT && power < inputs; power <<= 1) {
        n = add_around(c, power, 3, bits, n);
        n = add_around(c, inputs - power, 3, bits, n);
    }
    for (uint32_t i = 0; i < c->edge_count; i++) {
        float edge = c->edges[i];
        if (c->inputs == EVERY_FLOAT) n = add_around(c, function_bits(edge), 64, bits, n);
        if (c->inputs == EVERY_VARIATE) n = add_around(c, (uint64_t)(edge * 0x1p24f), 64, bits, n);
    }
    return add_around(c, c->worst, 64, bits, n);
}

brume_result function_sweep_some(function_sweep *s, const function_case *c, uint32_t count, function_worst *out) {
    if (c->inputs == EVERY_PAIR) return function_sweep_all(s, c, NULL, out); /* few enough */
    memset(out, 0, sizeof *out);
    out->error = -1;
    uint32_t n = sample(c, count, s->bits);
    for (uint32_t row = 0; row < rows_of(c); row++) {
        slice whole = slice_of(c, row);
        whole.list = s->bits;
        BRUME_TRY(run(s, index_of(c), 0, 1, n, whole.p));
        compare_all(s, whole, n, out);
    }
    return BRUME_OK;
}

void function_worst_place(const function_case *c, const function_worst *worst, char *text, size_t size) {
    int n = 0;
    switch (c->inputs) {
    case EVERY_FLOAT: n = snprintf(text, size, "%.9g (0x%08x)", worst->at.x, (unsigned)worst->bits); break;
    case EVERY_VARIATE: n = snprintf(text, size, "0x%x 2^-24", (unsigned)worst->bits); break;
    case EVERY_WORD: n = snprintf(text, size, "0x%08x", (unsigned)worst->bits); break;
    case EVERY_PAIR: n = snprintf(text, size, "%.9g, %.9g", worst->at.x, worst->at.z); break;
    }
    for (int i = 0; c->parameters && i < FUNCTION_PARAMETERS && n >= 0 && (size_t)n < size; i++)
        n += snprintf(text + n, size - (size_t)n, "%s%.6g", i ? ", " : "; ", c->parameters[worst->parameters][i]);
}

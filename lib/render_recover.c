/* render_recover.c -- a launch that failed, and how far it came.
 *
 * When a driver reports an error, all of the launch may have run, or nothing, or some of its groups. The film knows: it
 * holds for each pixel how many samples have been added. So what is missing is launched once more, and the film is the
 * one that it would have been. Samples that were dropped (cl/path.cl) are missing from these counts: those of before
 * the pass are known by its pixels' counts then, and of those in the pass there is the number.
 */
#include <stdlib.h>

#include "render.h"

/* What the film says of a pixel or a work-item. */
enum { ABSENT = 1, PRESENT = 2, TORN = ABSENT | PRESENT, EITHER = 4 };

typedef struct survey {
    brume_render *r;
    float *count;     /* of samples, by slot */
    cl_int *schedule; /* NULL while all pixels are alike */
    double dropped;   /* samples, since the pass began: so much may be missing from a count */
    size_t units;     /* work-items that a tile of the film takes of the program that left them in doubt */
} survey;

static int is_inside(const brume_film_layout *l, size_t slot) {
    size_t lanes = l->tile_width * l->tile_height, tile = slot / lanes, place = slot % lanes;
    return tile % l->tiles_x * l->tile_width + place % l->tile_width < l->width &&
           tile / l->tiles_x * l->tile_height + place / l->tile_width < l->height;
}

static int look_at_slot(const survey *s, size_t slot) {
    const brume_render *r = s->r;
    if (!is_inside(&r->layout, slot)) return 0;
    double added = s->count[slot] - brume_render_count_before(r, slot);
    if (added <= 0) return s->dropped < r->pass.samples ? ABSENT : EITHER;
    return added + s->dropped >= r->pass.samples ? PRESENT : TORN;
}

/* A work-item adds its samples at its end. If all may have been dropped, they may as well be rendered once more. */
static int look_at_unit(const survey *s, size_t unit) {
    size_t lanes = s->r->pass.doubtful_lanes;
    int state = 0;
    for (size_t i = unit * lanes; i < (unit + 1) * lanes; i++) {
        if (s->schedule && s->schedule[i] < 0) continue;
        state |= look_at_slot(s, s->schedule ? (size_t)s->schedule[i] : i);
    }
    return state == EITHER ? ABSENT : state & TORN;
}

/* The film after everything that is under way has ended. */
static brume_result begin_survey(survey *s) {
    brume_render *r = s->r;
    brume_context *context = r->device->context;
    size_t slots = brume_film_slot_count(&r->layout), unused;
    cl_uint bad[BAD_SIZE];
    s->count = malloc(slots * sizeof *s->count);
    if (r->ends) s->schedule = brume_render_make_schedule(r, &unused);
    if (!s->count || (r->ends && !s->schedule))
        return brume_fail(context, BRUME_ERROR_MEMORY, "going on after a failure: out of memory");
    cl_int code = r->crew ? CL_SUCCESS : clFinish(r->device->queue);
    if (code == CL_SUCCESS)
        code = brume_render_get(r, BRUME_FILM_PLANES, FILM_COUNT * slots * sizeof *s->count, slots * sizeof *s->count,
                                s->count);
    if (code == CL_SUCCESS)
        code = brume_render_get(r, BRUME_FILM_BAD, 0, sizeof bad, bad);
    if (code != CL_SUCCESS) return brume_fail_cl(context, code, "going on after a failure");
    s->dropped = (double)bad[BAD_COUNT] - r->pass.bad_before;
    return BRUME_OK;
}

/* The slots of the work-items that are missing, in work-items of the program that runs, the last filled up with -1.
 * malloc'ed; NULL: no memory. */
static cl_int *list_missing(const survey *s, size_t begin, size_t end, size_t *units) {
    const brume_render *r = s->r;
    size_t lanes = r->pass.doubtful_lanes, wide = r->program.lanes, count = 0;
    cl_int *slots = malloc(((end - begin) * lanes + wide) * sizeof *slots);
    if (!slots) return NULL;
    for (size_t unit = begin; unit < end; unit++) {
        if (look_at_unit(s, unit) != ABSENT) continue;
        for (size_t i = unit * lanes; i < (unit + 1) * lanes; i++)
            slots[count++] = s->schedule ? s->schedule[i] : is_inside(&r->layout, i) ? (cl_int)i : -1;
    }
    while (count % wide) slots[count++] = -1;
    *units = count / wide;
    return slots;
}

/* By a program of another width than the one that left them in doubt, after a state was loaded: what is missing need
 * not be whole work-items of its own, so it gets a schedule. */
static cl_int launch_listed(const survey *s, const cl_int *slots, size_t units, size_t most, size_t *failed) {
    brume_render *r = s->r;
    cl_int code = CL_SUCCESS;
    if (units == 0) return code;
    cl_mem list = clCreateBuffer(r->device->cl, CL_MEM_READ_ONLY | CL_MEM_COPY_HOST_PTR,
                                 units * r->program.lanes * sizeof *slots, (void *)(uintptr_t)slots, &code);
    if (code != CL_SUCCESS) return code;
    code = clSetKernelArg(r->program.kernel, BRUME_KERNEL_BUFFERS - 1, sizeof list, &list);
    for (size_t unit = 0; unit < units && code == CL_SUCCESS; unit += *failed) {
        *failed = units - unit < most ? units - unit : most;
        code = brume_render_launch_units(r, unit, *failed, r->desc.first_sample + r->samples_done, r->pass.samples,
                                         LAUNCH_ADAPTIVE | brume_render_chosen(r));
    }
    cl_int restored = clSetKernelArg(r->program.kernel, BRUME_KERNEL_BUFFERS - 1, sizeof r->schedule, &r->schedule);
    clReleaseMemObject(list);
    return code != CL_SUCCESS ? code : restored;
}

static brume_result launch_in_other_width(const survey *s, size_t begin, size_t end) {
    brume_render *r = s->r;
    size_t scale = r->stats.lanes / r->program.lanes, units = 0, tried = 0;
    cl_int *slots = list_missing(s, begin, end, &units);
    if (!slots)
        return brume_fail(r->device->context, BRUME_ERROR_MEMORY, "going on after a failure: out of memory");
    cl_int code = launch_listed(s, slots, units, r->most_groups ? r->most_groups * scale : units, &tried);
    free(slots);
    if (code == CL_SUCCESS) {
        r->pass.groups_done += r->pass.doubtful;
        r->work += (double)r->pass.doubtful * r->pass.samples;
        r->pass.doubtful = 0;
        return BRUME_OK;
    }
    if (brume_render_shrink_launches(r, (uint32_t)(tried / scale), code)) return BRUME_OK;
    return brume_fail_cl(r->device->context, code, "going on after a failure");
}

static brume_result launch_missing(const survey *s) {
    brume_render *r = s->r;
    const size_t begin = r->pass.groups_done * s->units, end = begin + r->pass.doubtful * s->units;
    const size_t most = (r->most_groups ? r->most_groups : r->pass.doubtful) * s->units;
    for (size_t unit = begin; unit < end; unit++)
        if (look_at_unit(s, unit) == TORN)
            return brume_fail(r->device->context, BRUME_ERROR_DEVICE,
                              "a launch broke off in the middle of a pixel's samples: the film can be read, but not "
                              "continued");
    if (r->pass.doubtful_lanes != r->program.lanes && r->crew)
        return brume_fail(r->device->context, BRUME_ERROR_DEVICE,
                          "a launch of a program %u lanes wide is in doubt: one device can go on from there, not several",
                          r->pass.doubtful_lanes);
    if (r->pass.doubtful_lanes != r->program.lanes) return launch_in_other_width(s, begin, end);
    for (size_t unit = begin, next; unit < end; unit = next) {
        int missing = look_at_unit(s, unit) == ABSENT;
        for (next = unit + 1; next < end && next - unit < most && (look_at_unit(s, next) == ABSENT) == missing;) next++;
        if (!missing) continue;
        cl_int code = brume_render_launch_units(r, unit, next - unit, r->desc.first_sample + r->samples_done,
                                                r->pass.samples,
                                                (r->ends ? LAUNCH_ADAPTIVE : 0) | brume_render_chosen(r));
        if (code == CL_SUCCESS) continue;
        if (brume_render_shrink_launches(r, (uint32_t)((next - unit) / s->units), code)) return BRUME_OK;
        return brume_fail_cl(r->device->context, code, "going on after a failure");
    }
    r->pass.groups_done += r->pass.doubtful;
    r->work += (double)r->pass.doubtful * r->pass.samples;
    r->pass.doubtful = 0;
    return BRUME_OK;
}

int brume_render_shrink_launches(brume_render *render, uint32_t groups, cl_int code) {
    int want = code == CL_OUT_OF_RESOURCES || code == CL_MEM_OBJECT_ALLOCATION_FAILURE || code == CL_OUT_OF_HOST_MEMORY;
    if (!want || groups < 2 || groups <= render->local_size || render->crew) return 0; /* whose members do so */
    render->most_groups = groups / 2;
    brume_warn(render->device->context, "a launch of %u groups failed with %s: %u at most from now on", groups,
               brume_cl_error_name(code), render->most_groups);
    return 1;
}

brume_result brume_render_note_counts(brume_render *r) {
    brume_context *context = r->device->context;
    size_t size = brume_film_slot_count(&r->layout) * sizeof *r->pass.counts;
    cl_uint bad[BAD_SIZE];
    free(r->pass.counts);
    r->pass.counts = NULL;
    cl_int code = brume_render_get(r, BRUME_FILM_BAD, 0, sizeof bad, bad);
    if (code == CL_SUCCESS && bad[BAD_COUNT]) {
        r->pass.counts = malloc(size);
        if (!r->pass.counts) return brume_fail(context, BRUME_ERROR_MEMORY, "counting samples: out of memory");
        code = brume_render_get(r, BRUME_FILM_PLANES, FILM_COUNT * size, size, r->pass.counts);
    }
    if (code != CL_SUCCESS) return brume_fail_cl(context, code, "counting samples");
    r->pass.bad_before = bad[BAD_COUNT];
    r->pass.counts_unknown = bad[BAD_COUNT] && r->pass.doubtful;
    return BRUME_OK;
}

double brume_render_count_before(const brume_render *r, size_t slot) {
    return r->pass.counts ? r->pass.counts[slot] : r->samples_done;
}

brume_result brume_render_settle(brume_render *render) {
    if (render->pass.counts_unknown)
        return brume_fail(render->device->context, BRUME_ERROR_DEVICE,
                          "after a launch that failed, among samples that came out NaN or infinite, it is unknown "
                          "which pixels have run: the film can be read, but not continued");
    survey s = {.r = render, .units = render->stats.lanes / render->pass.doubtful_lanes};
    brume_result result = begin_survey(&s);
    if (result == BRUME_OK) result = launch_missing(&s);
    free(s.count);
    free(s.schedule);
    return result;
}

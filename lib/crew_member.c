/* crew_member.c -- what one device of a crew does: a chunk of the film uploaded, rendered on, and handed back. */
#include "crew_member.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "platform.h"

/* How much of a chunk's speed goes into what is known of a device's. */
#define SPEED_LEARNT 0.5

static void keep_note(void *user, brume_log_level level, const char *message) {
    brume_crew_member *m = user;
    if (level == BRUME_LOG_WARNING) snprintf(m->note, sizeof m->note, "%s", message);
}

brume_result brume_crew_member_create(brume_crew_member *m, const brume_render *r, brume_device *device,
                                      const brume_arrays *arrays) {
    memset(m, 0, sizeof *m);
    m->original = brume_device_retain(device);
    m->device = *device;
    m->device.references = 2; /* never the render's to free */
    m->device.context = NULL;
    BRUME_TRY(brume_context_create(&m->device.context));
    brume_context_set_log(m->device.context, keep_note, m);
    m->render = calloc(1, sizeof *m->render);
    if (!m->render) return brume_fail(m->device.context, BRUME_ERROR_MEMORY, "sharing a render: out of memory");
    m->render->device = &m->device;
    m->render->desc = r->desc;
    m->render->params = r->params;
    m->render->layout = r->layout;
    m->render->needs_pilot = r->needs_pilot;
    m->render->stats.lanes = r->stats.lanes;
    return brume_render_equip(m->render, arrays);
}

void brume_crew_member_destroy(brume_crew_member *m) {
    brume_render_destroy(m->render);
    brume_context_destroy(m->device.context);
    brume_device_destroy(m->original);
    free(m->chunk);
    memset(m, 0, sizeof *m);
}

size_t brume_crew_member_least(const brume_crew_member *m) {
    size_t narrow = m->render->stats.lanes / m->render->own_lanes; /* its work-items in a group */
    return (m->device.info.compute_units * m->render->local_size + narrow - 1) / narrow;
}

/* ---- a chunk --------------------------------------------------------------------------------------------------- */

/* Slots of the film: what groups begin ... end - 1 of a launch touch lies between them. Schedules are sorted. */
typedef struct span { size_t begin, end; } span;

static span span_of(const brume_crew *crew, const brume_render *r, uint32_t begin, uint32_t end) {
    size_t lanes = r->stats.lanes, first = begin * lanes, last = end * lanes - 1;
    if (!(crew->job.mode & LAUNCH_ADAPTIVE)) return (span){first, last + 1};
    while (last > first && crew->schedule[last] < 0) last--;
    return (span){(size_t)crew->schedule[first], (size_t)crew->schedule[last] + 1};
}

/* What comes back of a chunk: `rows` planes of the film, or of the plan, of values of so many bytes. */
typedef struct block { cl_mem buffer; char *film; size_t rows, value; } block;

static block block_of(const brume_crew *crew, const brume_render *r) {
    if (crew->job.mode & LAUNCH_PILOT) return (block){r->plan, (char *)crew->plan, EVERY_LAMP, 1};
    return (block){r->planes, (char *)crew->planes, brume_film_plane_count(brume_render_recorded(r)), sizeof(float)};
}

/* Of what the launch reads besides its slots, what has changed since it was sent the last time. */
static cl_int send_whole(brume_crew_member *m, const brume_crew *crew) {
    brume_render *r = m->render;
    size_t slots = brume_film_slot_count(&r->layout);
    cl_int code = CL_SUCCESS;
    if (r->needs_pilot && !(crew->job.mode & LAUNCH_PILOT) && m->plan_stamp != crew->plan_stamp) {
        code = brume_render_put(r, BRUME_FILM_PLAN, 0, EVERY_LAMP * slots, crew->plan);
        if (code == CL_SUCCESS) m->plan_stamp = crew->plan_stamp;
    }
    if (code == CL_SUCCESS && (crew->job.mode & LAUNCH_ADAPTIVE) && m->schedule_stamp != crew->schedule_stamp) {
        code = brume_render_put(r, BRUME_FILM_SCHEDULE, 0, slots * sizeof(cl_int), crew->schedule);
        if (code == CL_SUCCESS) m->schedule_stamp = crew->schedule_stamp;
    }
    return code;
}

/* The film's slots to the device, unless it is the pilot, which reads nothing. */
static cl_int send_slots(brume_crew_member *m, const brume_crew *crew, const block *b, span s) {
    static const cl_uint none[BAD_SIZE];
    brume_render *r = m->render;
    size_t pitch = brume_film_slot_count(&r->layout) * b->value;
    size_t at[3] = {s.begin * b->value, 0, 0}, size[3] = {(s.end - s.begin) * b->value, b->rows, 1};
    cl_int code = brume_render_put(r, BRUME_FILM_BAD, 0, sizeof none, none);
    if (code == CL_SUCCESS && !(crew->job.mode & LAUNCH_PILOT))
        code = clEnqueueWriteBufferRect(r->device->queue, b->buffer, CL_TRUE, at, at, size, pitch, 0, pitch, 0,
                                        b->film, 0, NULL, NULL);
    return code;
}

/* And back, to the film in one go once all of them are here. */
static cl_int fetch_slots(brume_crew_member *m, const block *b, span s) {
    brume_render *r = m->render;
    size_t pitch = brume_film_slot_count(&r->layout) * b->value, row = (s.end - s.begin) * b->value;
    size_t at[3] = {s.begin * b->value, 0, 0}, here[3] = {0, 0, 0}, size[3] = {row, b->rows, 1};
    cl_uint bad[BAD_SIZE];
    if (m->chunk_size < row * b->rows) {
        free(m->chunk);
        m->chunk_size = row * b->rows;
        m->chunk = malloc(m->chunk_size);
        if (!m->chunk) m->chunk_size = 0;
    }
    if (!m->chunk) return CL_OUT_OF_HOST_MEMORY;
    cl_int code = clEnqueueReadBufferRect(r->device->queue, b->buffer, CL_TRUE, at, here, size, pitch, 0, row, 0,
                                          m->chunk, 0, NULL, NULL);
    if (code == CL_SUCCESS) code = brume_render_get(r, BRUME_FILM_BAD, 0, sizeof bad, bad);
    if (code != CL_SUCCESS) return code;
    for (size_t i = 0; i < b->rows; i++)
        memcpy(b->film + i * pitch + at[0], (const char *)m->chunk + i * row, row);
    if (bad[BAD_COUNT]) {
        m->bad[BAD_PIXEL] = bad[BAD_PIXEL];
        m->bad[BAD_SAMPLE] = bad[BAD_SAMPLE];
        m->bad[BAD_COUNT] += bad[BAD_COUNT];
    }
    return CL_SUCCESS;
}

static cl_int render_chunk(brume_crew_member *m, brume_crew *crew, uint32_t begin, uint32_t end) {
    brume_render *r = m->render;
    block b = block_of(crew, r);
    span s = span_of(crew, r, begin, end);
    cl_int code = send_whole(m, crew);
    if (code == CL_SUCCESS) code = send_slots(m, crew, &b, s);
    if (code == CL_SUCCESS)
        code = brume_render_launch(r, begin, end - begin, crew->job.first, crew->job.samples, crew->job.mode);
    if (code == CL_SUCCESS) code = fetch_slots(m, &b, s);
    return code;
}

static void note_speed(brume_crew_member *m, double done, double seconds) {
    double speed = seconds > 0 ? done / seconds : 0;
    if (!(m->speed > 0) || (seconds < BRUME_CREW_LEAST_SECONDS && speed > m->speed)) m->speed = speed;
    if (seconds >= BRUME_CREW_LEAST_SECONDS) m->speed += SPEED_LEARNT * (speed - m->speed);
}

void brume_crew_member_render(brume_crew_member *m, brume_crew *crew) {
    while (m->left_begin < m->left_end) {
        uint32_t groups = m->left_end - m->left_begin;
        if (m->most && groups > m->most) groups = m->most;
        double start = brume_seconds();
        cl_int code = render_chunk(m, crew, m->left_begin, m->left_begin + groups);
        double seconds = brume_seconds() - start, done = (double)groups * crew->job.samples;
        if (code == CL_SUCCESS) {
            m->left_begin += groups;
            if (!(crew->job.mode & LAUNCH_PILOT)) m->work += done;
            note_speed(m, done, seconds);
        } else if (brume_render_shrink_launches(m->render, groups, code)) {
            m->most = m->render->most_groups;
        } else {
            m->code = code;
            return;
        }
    }
}

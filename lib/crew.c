/* crew.c -- see crew.h: its members, and who renders what. crew_member.c is about what one of them does. */
#include "crew_member.h"

#include <stdlib.h>
#include <string.h>

#include "parallel.h"

/* A member takes so much of what would be its share of what is left: the last chunks are small, and all end together. */
#define CHUNK_SHARE 0.5
/* And nothing where all together would do what is left in so much less time. Whether that is still so is seen after so
 * many launches, after twice as many if it is, and so on. */
#define TOO_SLOW 2.0
/* Nobody is too slow for a whole launch who is done with something in less: that may as well be chance. */
#define LAUNCH_SECONDS 0.05
enum { LEAST_PATIENCE = 8, MOST_PATIENCE = 1 << 20 };

/* ---- members --------------------------------------------------------------------------------------------------- */

/* The film's own memory. The schedule has room for all slots, as on a device. */
static int make_film(brume_crew *crew, const brume_render *r) {
    size_t slots = brume_film_slot_count(&r->layout);
    crew->planes = calloc(brume_film_plane_count(brume_render_recorded(r)) * slots, sizeof *crew->planes);
    crew->plan = calloc(r->needs_pilot ? EVERY_LAMP * slots : 1, 1);
    crew->schedule = calloc(brume_goal_exists(r) ? slots : 1, sizeof *crew->schedule);
    return crew->planes && crew->plan && crew->schedule;
}

brume_result brume_crew_create(brume_render *r, const brume_arrays *arrays) {
    brume_context *context = r->device->context;
    uint32_t count = r->device->member_count;
    brume_crew *crew = calloc(1, sizeof *crew);
    brume_crew_member *members = calloc(count, sizeof *members);
    brume_result first_failure = BRUME_OK;
    if (!crew || !members) {
        free(crew);
        free(members);
        return brume_fail(context, BRUME_ERROR_MEMORY, "sharing a render: out of memory");
    }
    crew->members = members;
    r->crew = crew;
    brume_info(context, "Uploading the scene and building kernels for %u devices", count);
    for (uint32_t i = 0; i < count; i++) {
        brume_crew_member *m = &members[crew->count];
        brume_result result = brume_crew_member_create(m, r, r->device->members[i], arrays);
        if (result == BRUME_OK) {
            crew->count++;
            continue;
        }
        const char *said = brume_context_message(m->device.context), *why = *said ? said : brume_result_name(result);
        if (first_failure == BRUME_OK) first_failure = brume_fail(context, result, "%s", why);
        if (count > 1) brume_warn(context, "%s takes no part: %s", r->device->members[i]->info.name, why);
        brume_crew_member_destroy(m);
    }
    if (crew->count == 0) return first_failure;
    /* Once all have something to begin with: the wide ones take the compiler for long. */
    for (uint32_t i = 0; i < crew->count; i++) brume_render_program_go_on(members[i].render);
    if (!make_film(crew, r)) return brume_fail(context, BRUME_ERROR_MEMORY, "sharing a render: out of memory");
    r->program.lanes = r->stats.lanes; /* what groups are counted in */
    brume_crew_add_stats(r);
    return BRUME_OK;
}

void brume_crew_destroy(brume_render *r) {
    brume_crew *crew = r->crew;
    if (!crew) return;
    for (uint32_t i = 0; i < crew->count; i++) {
        int is_known = 0;
        for (uint32_t k = 0; k < i; k++)
            is_known |= strcmp(crew->members[k].device.info.name, crew->members[i].device.info.name) == 0;
        /* The cache keeps the program of a complete render: one for each kind of device. */
        crew->members[i].render->stats.complete = r->stats.complete && !is_known;
    }
    for (uint32_t i = 0; i < crew->count; i++) brume_crew_member_destroy(&crew->members[i]);
    free(crew->members);
    free(crew->planes);
    free(crew->plan);
    free(crew->schedule);
    free(crew);
    r->crew = NULL;
}

void *brume_crew_film(brume_crew *crew, brume_film_part part) {
    switch (part) {
    case BRUME_FILM_PLANES: return crew->planes;
    case BRUME_FILM_BAD: return crew->bad;
    case BRUME_FILM_PLAN: return crew->plan;
    case BRUME_FILM_SCHEDULE: return crew->schedule;
    }
    return NULL;
}

void brume_crew_changed(brume_crew *crew, brume_film_part part) {
    if (part == BRUME_FILM_PLAN) crew->plan_stamp++;
    if (part == BRUME_FILM_SCHEDULE) crew->schedule_stamp++;
}

void brume_crew_revive(brume_crew *crew) {
    for (uint32_t i = 0; i < crew->count; i++) crew->members[i].code = CL_SUCCESS;
}

size_t brume_crew_least_groups(const brume_crew *crew) {
    size_t sum = 0;
    for (uint32_t i = 0; i < crew->count; i++)
        if (crew->members[i].code == CL_SUCCESS) sum += brume_crew_member_least(&crew->members[i]);
    return sum > 0 ? sum : 1;
}

const brume_render *brume_crew_any(const brume_crew *crew) {
    for (uint32_t i = 0; i < crew->count; i++)
        if (crew->members[i].code == CL_SUCCESS) return crew->members[i].render;
    return crew->members[0].render;
}

void brume_crew_add_stats(brume_render *r) {
    const brume_crew *crew = r->crew;
    const brume_render_stats *first = &crew->members[0].render->stats;
    r->stats.features = first->features;
    r->stats.program_cached = first->program_cached;
    r->stats.program_bytes = first->program_bytes;
    r->stats.quick_lanes = first->quick_lanes;
    r->stats.swapped_at_sample = first->swapped_at_sample;
    r->stats.swap_seconds = first->swap_seconds;
    r->stats.device_bytes = 0;
    r->stats.upload_seconds = r->stats.build_seconds = 0;
    for (uint32_t i = 0; i < crew->count; i++) {
        const brume_render_stats *one = &crew->members[i].render->stats;
        r->stats.device_bytes += one->device_bytes;
        r->stats.upload_seconds += one->upload_seconds;
        r->stats.build_seconds += one->build_seconds;
    }
}

void brume_crew_report(const brume_render *r) {
    const brume_crew *crew = r->crew;
    double all = 0;
    for (uint32_t i = 0; i < crew->count; i++) all += crew->members[i].work;
    for (uint32_t i = 0; i < crew->count && all > 0; i++)
        brume_info(r->device->context, "%s (units: %u): %.1f %% of the work", crew->members[i].device.info.name,
                   crew->members[i].device.info.compute_units, 100 * crew->members[i].work / all);
}

double brume_crew_work(const brume_crew *crew, uint32_t member) { return crew->members[member].work; }

/* ---- chunks ---------------------------------------------------------------------------------------------------- */

/* Whether the others are done with the groups that are left before a member is with as few as keep it busy. */
static int is_too_slow(const brume_crew_member *m, uint32_t left) {
    return !m->is_fastest && m->speed > 0 && (double)brume_crew_member_least(m) > TOO_SLOW * left * m->share;
}

/* How many of them a member takes at once. */
static uint32_t chunk_size(const brume_crew *crew, const brume_crew_member *m, uint32_t left, double most) {
    double least = (double)brume_crew_member_least(m), speed = m->speed / crew->job.samples;
    double wanted = CHUNK_SHARE * left * m->share;
    if (wanted < BRUME_CREW_LEAST_SECONDS * speed) wanted = BRUME_CREW_LEAST_SECONDS * speed;
    if (wanted > most) wanted = most;
    if (wanted < least || !(speed > 0)) wanted = least;
    if (m->most && wanted > m->most) wanted = m->most;
    return wanted < left ? (uint32_t)wanted : left;
}

/* From the queue, into left_begin and left_end. Returns whether there was something for it. */
static int take_chunk(brume_crew *crew, brume_crew_member *m) {
    uint32_t next = __atomic_load_n(&crew->job.next, __ATOMIC_RELAXED), take;
    do {
        uint32_t left = crew->job.end - next;
        if (left == 0 || is_too_slow(m, left)) return 0;
        take = chunk_size(crew, m, left, left);
    } while (!__atomic_compare_exchange_n(&crew->job.next, &next, next + take, 1, __ATOMIC_RELAXED, __ATOMIC_RELAXED));
    m->left_begin = next;
    m->left_end = next + take;
    return 1;
}

/* The first chunks are set aside, of at most each one's share: nobody goes without because a thread is late. */
static void set_aside(brume_crew *crew, uint32_t groups) {
    for (uint32_t i = 0; i < crew->count; i++) {
        brume_crew_member *m = &crew->members[i];
        uint32_t left = crew->job.end - crew->job.next;
        int slow = is_too_slow(m, groups) &&
                   (double)brume_crew_member_least(m) * crew->job.samples > LAUNCH_SECONDS * m->speed;
        if (m->code != CL_SUCCESS || (slow && m->declined++ < m->patience)) continue;
        m->declined = 0;
        m->patience = slow ? 2 * m->patience : LEAST_PATIENCE;
        if (m->patience > MOST_PATIENCE) m->patience = MOST_PATIENCE;
        uint32_t take = chunk_size(crew, m, groups, m->share * groups);
        m->left_begin = crew->job.next;
        m->left_end = crew->job.next += take < left ? take : left;
    }
}

/* What is set aside for it first, and then from the queue. */
static void take_part(void *user, uint32_t i) {
    brume_crew *crew = user;
    brume_crew_member *m = &crew->members[i];
    if (m->code != CL_SUCCESS) return;
    do brume_crew_member_render(m, crew); /* moves left_begin */
    while (m->code == CL_SUCCESS && take_chunk(crew, m));
}

/* Shares by the speeds that are known. Returns how many take part. */
static uint32_t share_out(brume_crew *crew) {
    double all = 0;
    brume_crew_member *fastest = NULL;
    uint32_t count = 0;
    for (uint32_t i = 0; i < crew->count; i++) {
        brume_crew_member *m = &crew->members[i];
        m->left_begin = m->left_end = 0;
        m->is_fastest = 0;
        if (m->code != CL_SUCCESS) continue;
        all += m->speed;
        count++;
        if (!fastest || m->speed > fastest->speed) fastest = m;
    }
    for (uint32_t i = 0; i < crew->count; i++)
        crew->members[i].share = all > 0 ? crew->members[i].speed / all : 0;
    if (fastest) fastest->is_fastest = 1;
    return count;
}

/* What a member has to say comes from its own context. */
static void pass_on(brume_render *r, brume_crew_member *m, int was_there, uint32_t others) {
    brume_context *context = r->device->context;
    if (m->note[0]) brume_warn(context, "%s", m->note);
    m->note[0] = 0;
    if (was_there && m->code != CL_SUCCESS && others > 0)
        brume_warn(context, "%s failed with %s (%d): the other%s on without it", m->device.info.name,
                   brume_cl_error_name(m->code), (int)m->code, others > 1 ? "s go" : " goes");
}

/* Groups begin ... end - 1 by all that take part, as far as they come; what is left is added to `left`, at most one
 * range for each member, and one. */
static void launch_range(brume_render *r, uint32_t begin, uint32_t end, brume_crew_range *left, uint32_t *left_count) {
    brume_crew *crew = r->crew;
    uint32_t there = share_out(crew), after = 0;
    crew->job.next = begin;
    crew->job.end = end;
    for (uint32_t i = 0; i < crew->count; i++) {
        brume_crew_member *m = &crew->members[i];
        m->was_there = m->code == CL_SUCCESS;
        m->render->samples_done = r->samples_done; /* for the statistics of a quick start */
    }
    set_aside(crew, end - begin);
    if (there > 0) brume_parallel(crew->count, crew->count, take_part, crew);
    for (uint32_t i = 0; i < crew->count; i++) after += crew->members[i].code == CL_SUCCESS;
    for (uint32_t i = 0; i < crew->count; i++) {
        brume_crew_member *m = &crew->members[i];
        pass_on(r, m, m->was_there, after);
        if (m->left_begin < m->left_end) left[(*left_count)++] = (brume_crew_range){m->left_begin, m->left_end};
    }
    if (crew->job.next < end) left[(*left_count)++] = (brume_crew_range){crew->job.next, end};
}

/* The bad samples that the members have met, all together. */
static void add_bad(brume_crew *crew) {
    for (uint32_t i = 0; i < crew->count; i++) {
        cl_uint *bad = crew->members[i].bad;
        if (bad[BAD_COUNT] && crew->bad[BAD_COUNT] == 0) {
            crew->bad[BAD_PIXEL] = bad[BAD_PIXEL];
            crew->bad[BAD_SAMPLE] = bad[BAD_SAMPLE];
        }
        crew->bad[BAD_COUNT] += bad[BAD_COUNT];
        bad[BAD_COUNT] = 0;
    }
}

cl_int brume_crew_launch(brume_render *r, uint32_t group, uint32_t groups, uint32_t first, uint32_t samples,
                         cl_uint mode) {
    brume_crew *crew = r->crew;
    brume_crew_range *left = malloc((crew->count + 1) * 2 * sizeof *left);
    uint32_t count = 1;
    if (!left) return CL_OUT_OF_HOST_MEMORY;
    left[0] = (brume_crew_range){group, group + groups};
    crew->job.first = first;
    crew->job.samples = samples;
    crew->job.mode = mode;
    while (count > 0) {
        brume_crew_range now = left[--count];
        launch_range(r, now.begin, now.end, left, &count);
        if (share_out(crew) == 0) break;
    }
    add_bad(crew);
    if (mode & LAUNCH_PILOT) brume_crew_changed(crew, BRUME_FILM_PLAN);
    free(left);
    cl_int code = CL_SUCCESS;
    for (uint32_t i = 0; i < crew->count && count > 0; i++)
        if (crew->members[i].code != CL_SUCCESS) code = crew->members[i].code;
    return code;
}

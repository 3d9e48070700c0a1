/* trace.h -- what one path does, vertex by vertex, for people who look for a defect: with -DTRACE and at one lane the
 * path kernel writes it down; else there is no such code. Nothing that it computes depends on it. */
#ifndef BRUME_TRACE_CL_H
#define BRUME_TRACE_CL_H

#include "path_state.h"

#ifdef TRACE
#if LANES != 1
#error "TRACE is for one lane"
#endif

#define TRACE_PARAMETER , __global b_trace_vertex *trace
#define TRACE_ARGUMENT , trace
#define TRACE_INTO(s) s.trace = trace

FN void trace_vec(__global float *out, vec v) {
    out[0] = (float)v.x;
    out[1] = (float)v.y;
    out[2] = (float)v.z;
}

FN void trace_rgb(__global float *out, rgb c) {
    out[0] = (float)c.r;
    out[1] = (float)c.g;
    out[2] = (float)c.b;
}

/* The one that the path is under way to: `segments` counts on when it turns. */
FN __global b_trace_vertex *trace_vertex(const scene *s, const path *p) {
    return &s->trace[p->segments < TRACE_ROOM ? p->segments : TRACE_ROOM - 1];
}

FN void trace_segment(const scene *s, const path *p) {
    if (s->is_pilot) return;
    __global b_trace_vertex *v = trace_vertex(s, p);
    trace_vec(v->direction, p->d);
    trace_rgb(v->before, p->throughput);
    v->medium = (int)p->medium;
    v->pdf = (float)p->pdf;
}

/* The sum so far, behind stage TRACE_ALONG, MET or LIT. */
FN void trace_radiance(const scene *s, const path *p, int stage) {
    if (s->is_pilot) return;
    for (int i = stage; i < TRACE_STAGES; i++) trace_rgb(trace_vertex(s, p)->radiance[i], p->radiance);
}

FN void trace_place(const scene *s, const path *p, vec at, real length, int event, int shape) {
    if (s->is_pilot) return;
    __global b_trace_vertex *v = trace_vertex(s, p);
    trace_vec(v->position, at);
    trace_rgb(v->after, p->throughput);
    v->length = (float)length;
    v->event = event;
    v->shape = shape;
    v->ends = 1;
}

/* Behind the turn. */
FN void trace_turn(const scene *s, const path *p) {
    if (s->is_pilot) return;
    __global b_trace_vertex *v = trace_vertex(s, p) - 1;
    trace_rgb(v->after, p->throughput);
    v->ends = !p->alive;
}

#else
#define TRACE_PARAMETER
#define TRACE_ARGUMENT
#define TRACE_INTO(s)
#define trace_segment(s, p)
#define trace_radiance(s, p, stage)
#define trace_place(s, p, at, length, event, shape)
#define trace_turn(s, p)
#endif

#endif

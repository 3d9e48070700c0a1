/* render_predict.c -- how the error will fall from here on, and when the goal will be reached, by that.
 *
 * Tried and refused: to learn, stage by stage, a factor from what the allocation had promised and what came true. Both
 * are as uncertain as the estimates that they compare, and predictions became worse by it (the logarithm of the work off
 * by 0.41 to 0.47 instead of 0.38, in ten scenes with eight seeds).
 */
#include <math.h>

#include "render.h"

/* An order that few samples tell is drawn halfway to what is usual: what is smooth has converged as samples grow, and
 * what was noise begins to. */
#define ORDER_KEPT 0.5

/* The logarithm of the work ahead has this standard deviation, in parts of itself, for an error that is known (measured
 * with recorded renders of ten scenes). The interval is to hold nine in ten. */
#define WORK_SPREAD 0.25
#define NORMAL_90 1.645
#define NORMAL_95 1.960

double brume_run_limit(const brume_render *r) { return r->desc.time_limit - r->create_seconds; }

double brume_mean_samples(const brume_render *r) { return r->work / r->layout.group_count; }

double brume_predict_order(const brume_render *r) {
    if (r->estimate.independent) return r->error.order;
    return BRUME_USUAL_ORDER + ORDER_KEPT * (r->error.order - BRUME_USUAL_ORDER);
}

double brume_predict_uniform(const brume_render *r, double relmse) {
    return brume_mean_samples(r) * fmax(1, pow(r->error.relmse / relmse, 1 / brume_predict_order(r)));
}

/* The picture's error over what its pixels' surroundings add up to. */
static double calibration(const brume_render *r) {
    double samples, relmse;
    brume_allocation_predict(r->allocation, 0, &samples, &relmse);
    return relmse > 0 ? r->error.relmse / relmse : 1;
}

double brume_predict_samples(const brume_render *r, double relmse) {
    double uniform = brume_predict_uniform(r, relmse), samples, reached, off;
    if (!r->allocation) return uniform;
    off = calibration(r);
    brume_allocation_predict(r->allocation, brume_allocation_for_error(r->allocation, relmse / off), &samples,
                             &reached);
    return !r->ends && (reached * off > relmse || samples * BRUME_WORTHWHILE > uniform) ? uniform : samples;
}

double brume_predict_relmse(const brume_render *r, double samples) {
    double ratio = samples / brume_mean_samples(r), used, adapted;
    double uniform = r->error.relmse * pow(ratio > 1 ? ratio : 1, -brume_predict_order(r));
    if (!r->allocation) return uniform;
    brume_allocation_predict(r->allocation, brume_allocation_for_samples(r->allocation, samples), &used, &adapted);
    adapted *= calibration(r);
    return r->ends || adapted < uniform ? adapted : uniform;
}

/* The standard deviation of the logarithm of the samples to come to: by what is unknown of the way there, and of where
 * it begins. */
static double spread(const brume_render *r, double samples) {
    double error = r->error.low > 0 ? log(r->error.high / r->error.low) / (2 * NORMAL_95) : 0;
    return hypot(WORK_SPREAD * log(samples / brume_mean_samples(r)), error / brume_predict_order(r));
}

/* When so many samples per pixel will be there, in seconds of the run. */
static double time_of(const brume_render *r, double seconds, double samples) {
    return seconds + fmax(0, samples - brume_mean_samples(r)) / r->rate;
}

void brume_predict(brume_render *r, double seconds) {
    const brume_render_desc *d = &r->desc;
    brume_prediction *p = &r->prediction;
    double work = brume_mean_samples(r);
    if (!r->error.known || !(r->rate > 0) || !(work > 0)) return;
    p->known = p->fresh = 1;
    if (d->noise_threshold > 0) {
        double e = d->noise_threshold, samples = brume_predict_samples(r, e);
        double off = samples > work ? exp(NORMAL_90 * spread(r, samples)) : 1;
        p->seconds = time_of(r, seconds, samples);
        p->low = time_of(r, seconds, samples / off);
        p->high = time_of(r, seconds, samples * off);
        p->relmse = fmin(e, r->error.relmse);
        p->work = fmax(work, samples);
        if (samples <= d->sample_count && (!(d->time_limit > 0) || p->seconds <= brume_run_limit(r))) return;
    }
    double samples = d->sample_count;
    if (d->time_limit > 0) samples = fmin(work + r->rate * fmax(0, brume_run_limit(r) - seconds), samples);
    p->seconds = p->low = p->high = time_of(r, seconds, samples);
    p->relmse = brume_predict_relmse(r, samples);
    p->work = samples;
}

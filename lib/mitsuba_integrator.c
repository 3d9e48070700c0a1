/* mitsuba_integrator.c -- path, volpath, volpathmis, direct: all are the one path tracer of this library.
 *
 * path and direct ignore media, as in Mitsuba; direct is a path of two edges. What changes only how many samples are
 * taken where is accepted; since the samples per pixel are then not those of Mitsuba, with a warning. Four properties
 * are extensions: strategy, positions and indirect choose estimators, single_scattering leaves out what media scatter
 * more than once (brume.h).
 */
#include "mitsuba.h"

#include "strategy.h"

static void warn_samples(mitsuba_object *o, const char *name) {
    const mitsuba_property *p = mitsuba_find(o, name);
    if (!p) return;
    int64_t count = mitsuba_integer(o, name, 1);
    mitsuba_require(o, name, count >= 1 && count <= INT32_MAX, "be at least 1");
    if (count != 1)
        mitsuba_warn(o->reader, p->node, "%s is ignored: one sample of each kind is taken; it changes noise only",
                     name);
}

/* Ours, not Mitsuba's: how light in media is estimated. */
static void read_estimators(mitsuba_object *o, brume_integrator_desc *desc) {
    int64_t positions = mitsuba_integer(o, "positions", 0);
    mitsuba_require(o, "strategy", brume_strategy_find(mitsuba_string(o, "strategy", "auto"), &desc->strategy),
                    "be auto, spherical, distance, equiangular, equiangular-cone, mis, product, systematic or raster");
    mitsuba_require(o, "positions", positions >= 0 && positions <= 64 && brume_positions_valid((uint32_t)positions),
                    "be a power of two up to 64, or 0");
    mitsuba_require(o, "indirect", brume_indirect_find(mitsuba_string(o, "indirect", "auto"), &desc->indirect),
                    "be auto, phase, mixture or ray-lights");
    desc->positions = (uint32_t)positions;
}

void mitsuba_read_integrator(mitsuba_reader *reader, xml_node *node) {
    mitsuba_object o = mitsuba_open(reader, node);
    brume_integrator_desc *desc = &reader->integrator;
    int is_direct = mitsuba_is(&o, "direct");
    int64_t max_depth = 2, rr_depth = desc->rr_depth;
    if (is_direct) {
        warn_samples(&o, "shading_samples");
        warn_samples(&o, "emitter_samples");
        warn_samples(&o, "bsdf_samples");
    } else {
        max_depth = mitsuba_integer(&o, "max_depth", -1);
        rr_depth = mitsuba_integer(&o, "rr_depth", 5);
        mitsuba_require(&o, "max_depth", max_depth >= -1 && max_depth <= INT32_MAX, "be -1 (no limit) or not negative");
        mitsuba_require(&o, "rr_depth", rr_depth >= 1 && rr_depth <= INT32_MAX, "be positive");
    }
    read_estimators(&o, desc);
    desc->single_scattering = (uint32_t)mitsuba_boolean(&o, "single_scattering", 0);
    desc->hide_emitters = (uint32_t)mitsuba_boolean(&o, "hide_emitters", 0);
    reader->ignores_media = is_direct || mitsuba_is(&o, "path");
    desc->ignore_media = (uint32_t)reader->ignores_media;
    if (mitsuba_is(&o, "volpathmis")) mitsuba_boolean(&o, "use_spectral_mis", 1); /* how Mitsuba samples */
    if (mitsuba_float(&o, "timeout", -1.0) > 0.0f)
        mitsuba_warn(reader, node, "timeout is ignored: whoever renders the scene limits its time");
    mitsuba_integer(&o, "samples_per_pass", 0); /* how Mitsuba divides its work */
    mitsuba_integer(&o, "block_size", 0);
    mitsuba_close(&o);
    if (reader->has_integrator) mitsuba_fail(reader, node, "a scene has at most one <integrator>");
    reader->has_integrator = 1;
    mitsuba_note(reader, node, BRUME_OBJECT_INTEGRATOR, 0);
    if (reader->result != BRUME_OK) return;
    desc->max_depth = (int32_t)max_depth;
    desc->rr_depth = (int32_t)rr_depth;
}

/* light_layers.h -- a path's light in parts: by where the eye sees it, and by how often it was scattered.
 *
 * Where: at the first place, from the eye, that is neither a null nor a specular surface and scatters or emits the
 * light. It lies in a medium, or is a surface, to which what comes from beyond the scene is counted.
 *
 * How often: direct light comes straight from its source or was scattered once, by a surface of any kind or a medium,
 * as all of it is with max_depth 2; the rest is indirect. Null surfaces don't count.
 *
 */
#ifndef BRUME_LIGHT_LAYERS_H
#define BRUME_LIGHT_LAYERS_H

#include "features.h"
#include "vec.h"

typedef struct {
    rgb surface_direct, surface_indirect, volume_direct, volume_indirect;
    ireal events;   /* scattering events of the path so far */
    mask placed;    /* one of them was not specular: */
    mask in_volume; /* the first such one lay in a medium */
    real segments;  /* traced */
} light_layers;

FN light_layers light_layers_none(void) {
    light_layers l;
    l.surface_direct = l.surface_indirect = l.volume_direct = l.volume_indirect = cgrey(R(0));
    l.events = I(0);
    l.placed = l.in_volume = FALSE_MASK;
    l.segments = R(0);
    return l;
}

FN light_layers light_layers_select(mask m, light_layers a, light_layers b) {
    light_layers l;
    l.surface_direct = cselect(m, a.surface_direct, b.surface_direct);
    l.surface_indirect = cselect(m, a.surface_indirect, b.surface_indirect);
    l.volume_direct = cselect(m, a.volume_direct, b.volume_direct);
    l.volume_indirect = cselect(m, a.volume_indirect, b.volume_indirect);
    l.events = m ? a.events : b.events;
    l.placed = m ? a.placed : b.placed;
    l.in_volume = m ? a.in_volume : b.in_volume;
    l.segments = m ? a.segments : b.segments;
    return l;
}

/* Light that the path finds behind `more` scattering events beyond its own, the first of them (or the source, where
 * there are none) in a medium or not. */
FN void light_layers_add(light_layers *l, mask m, rgb throughput, rgb value, mask in_medium, int more) {
    mask volume = (l->placed & l->in_volume) | (in_medium & !l->placed);
    mask direct = l->events + I(more) <= I(1);
    l->surface_direct = cselect(m & direct & !volume, cmad(throughput, value, l->surface_direct), l->surface_direct);
    l->surface_indirect =
        cselect(m & !(direct | volume), cmad(throughput, value, l->surface_indirect), l->surface_indirect);
    l->volume_direct = cselect(m & direct & volume, cmad(throughput, value, l->volume_direct), l->volume_direct);
    l->volume_indirect =
        cselect(m & volume & !direct, cmad(throughput, value, l->volume_indirect), l->volume_indirect);
}

/* The path scatters, at a specular surface or not. */
FN void light_layers_turn(light_layers *l, mask turns, mask specular, mask in_medium) {
    mask settles = turns & !l->placed & !specular;
    l->in_volume = l->in_volume | (settles & in_medium);
    l->placed = l->placed | settles;
    l->events = turns ? l->events + I(1) : l->events;
}

#endif

/* strategy.c -- the names of estimators: see strategy.h. */
#include "strategy.h"

#include <stddef.h>
#include <string.h>

static const char *const strategies[] = {"auto", "spherical",  "distance", "equiangular", "equiangular-cone",
                                         "mis",  "product", "systematic", "raster"};
static const char *const indirects[] = {"auto", "phase", "mixture", "ray-lights"};
enum {
    STRATEGY_COUNT = sizeof strategies / sizeof strategies[0],
    INDIRECT_COUNT = sizeof indirects / sizeof indirects[0]
};

const char *brume_strategy_name(brume_strategy strategy) {
    return (unsigned)strategy < STRATEGY_COUNT ? strategies[strategy] : NULL;
}

const char *brume_indirect_name(brume_indirect indirect) {
    return (unsigned)indirect < INDIRECT_COUNT ? indirects[indirect] : NULL;
}

static int find(const char *const *names, int count, const char *name) {
    for (int i = 0; i < count; i++)
        if (strcmp(names[i], name) == 0) return i;
    return -1;
}

int brume_strategy_find(const char *name, brume_strategy *out) {
    int i = find(strategies, STRATEGY_COUNT, name);
    if (i >= 0) *out = (brume_strategy)i;
    return i >= 0;
}

int brume_indirect_find(const char *name, brume_indirect *out) {
    int i = find(indirects, INDIRECT_COUNT, name);
    if (i >= 0) *out = (brume_indirect)i;
    return i >= 0;
}

int brume_positions_valid(uint32_t positions) {
    return positions <= 64 && (positions & (positions - 1)) == 0;
}

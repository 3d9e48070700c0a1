/* features.h -- which code is compiled: what the scene calls for, and which estimators (shared.h has the numbers). */
#ifndef BRUME_FEATURES_H
#define BRUME_FEATURES_H

#include "shared.h"

#ifndef FEATURES
#define FEATURES FEATURE_ALL
#endif
#define HAS(feature) ((FEATURES & FEATURE_##feature) != 0)
#ifndef STRATEGY
#define STRATEGY STRATEGY_AUTO
#endif
#ifndef INDIRECT
#define INDIRECT INDIRECT_AUTO
#endif

#define STRATEGY_IS_PRODUCT (STRATEGY == STRATEGY_AUTO || STRATEGY >= STRATEGY_PRODUCT)
/* Whether lamps are gathered along segments; else where a path scatters, or never. */
#define STRATEGY_GATHERS (STRATEGY != STRATEGY_SPHERICAL && STRATEGY != STRATEGY_DISTANCE)

/* Whether a path may scatter in a medium and go on from there. */
#define FLIES (HAS(MEDIA) && HAS(SCATTERING) && (HAS(FLIGHTS) || !STRATEGY_GATHERS))

/* Whether a path carries a ray of light from a lamp. */
#define INDIRECT_IS_RAYS (INDIRECT == INDIRECT_RAY_LIGHTS && (FLIES || !HAS(MEDIA)) && HAS(DELTA_LIGHTS))

#endif

/* channel.c -- what a film's channels are called, how large they are, and which a render records. */
#include "channel.h"

#include <stddef.h>

/* By number; what has no name is no layer of an EXR. */
static const struct { const char *name; int size; } channels[] = {
    [BRUME_CHANNEL_RADIANCE] = {NULL, 3},
    [BRUME_CHANNEL_VARIANCE] = {NULL, 3},
    [BRUME_CHANNEL_ALBEDO] = {"albedo", 3},
    [BRUME_CHANNEL_NORMAL] = {"N", 3},
    [BRUME_CHANNEL_DEPTH] = {"Z", 1},
    [BRUME_CHANNEL_SAMPLE_COUNT] = {"sampleCount", 1},
    [BRUME_CHANNEL_ALPHA] = {NULL, 1},
    [BRUME_CHANNEL_ERROR] = {"variance", 3},
    [BRUME_CHANNEL_BAD_SAMPLES] = {"badSamples", 1},
    [BRUME_CHANNEL_DIRECT] = {"direct", 3},
    [BRUME_CHANNEL_INDIRECT] = {"indirect", 3},
    [BRUME_CHANNEL_SURFACE] = {"surface", 3},
    [BRUME_CHANNEL_VOLUME] = {"volume", 3},
    [BRUME_CHANNEL_SEGMENTS] = {"segments", 1},
};

static int is_known(brume_channel channel) { return (unsigned)channel < sizeof channels / sizeof channels[0]; }

const char *brume_channel_name(brume_channel channel) { return is_known(channel) ? channels[channel].name : NULL; }

int brume_channel_size(brume_channel channel) { return is_known(channel) ? channels[channel].size : 0; }

int brume_channel_is_recorded(uint32_t recorded, brume_channel channel) {
    switch (channel) {
    case BRUME_CHANNEL_ALBEDO:
    case BRUME_CHANNEL_NORMAL:
    case BRUME_CHANNEL_DEPTH:
    case BRUME_CHANNEL_ALPHA: return recorded > 0;
    case BRUME_CHANNEL_DIRECT:
    case BRUME_CHANNEL_INDIRECT:
    case BRUME_CHANNEL_SURFACE:
    case BRUME_CHANNEL_VOLUME:
    case BRUME_CHANNEL_SEGMENTS: return recorded > 1;
    default: return 1;
    }
}

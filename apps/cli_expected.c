/* cli_expected.c -- what an option's value has to be, in words, for who gave another. */
#include <stdio.h>
#include <string.h>

#include "cli_options.h"

typedef const char *(*name_of)(int i);
static const char *strategy_name(int i) { return brume_strategy_name((brume_strategy)i); }
static const char *indirect_name(int i) { return brume_indirect_name((brume_indirect)i); }

/* "a, b or c": every name there is. */
static const char *one_of(name_of name, char *out, size_t size)
{
    size_t used = 0;
    out[0] = 0;
    for (int i = 0; name(i) && used < size; i++)
        used += (size_t)snprintf(out + used, size - used, "%s%s", !i ? "" : name(i + 1) ? ", " : " or ", name(i));
    return out;
}

int cli_wrong_value(option_id id, const char *value)
{
    const char *expected = cli_option_table[id].argument;
    char names[256];
    switch (id) {
    case OPTION_SPP: expected = "a whole number above 0"; break;
    case OPTION_SEED: expected = "a whole number below 2^32"; break;
    case OPTION_WIDTH: expected = "a whole number from 1 to 65536"; break;
    case OPTION_LANES: expected = "1, 4, 8 or 16"; break;
    case OPTION_NOISE_THRESHOLD:
    case OPTION_TIME_LIMIT:
    case OPTION_CLAMP:
    case OPTION_CHECKPOINT_INTERVAL:
    case OPTION_BUDGET:
    case OPTION_TARGET:
    case OPTION_TIME_TARGET: expected = "a number above 0"; break;
    case OPTION_EXPOSURE: expected = "a number"; break;
    case OPTION_SAMPLE_RANGE: expected = "A:B, two whole numbers, A below B"; break;
    case OPTION_CROP: expected = "X0,X1,Y0,Y1, whole numbers, X0 below X1, Y0 below Y1"; break;
    case OPTION_DEBUG_SAMPLE: expected = "X,Y,I, three whole numbers"; break;
    case OPTION_STRATEGY:
        expected = strchr(value, ':') ? "systematic:N or raster:N, N a power of two up to 64"
                                      : one_of(strategy_name, names, sizeof names);
        break;
    case OPTION_INDIRECT: expected = one_of(indirect_name, names, sizeof names); break;
    default: break;
    }
    cli_error("--%s: expected %s, not \"%s\"", cli_option_table[id].name, expected, value);
    return CLI_EXIT_USAGE;
}

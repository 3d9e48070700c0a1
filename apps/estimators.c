/* estimators.c -- see estimators.h. */
#include "estimators.h"

#include <string.h>

static int is(const char *name, const char *text, size_t length)
{
    return strlen(name) == length && strncmp(name, text, length) == 0;
}

/* A power of two from 1 to 64; 0 for anything else. */
static uint32_t read_positions(const char *text, size_t length)
{
    uint32_t value = 0;
    for (size_t i = 0; i < length; i++) {
        if (text[i] < '0' || text[i] > '9' || value > 64)
            return 0;
        value = 10 * value + (uint32_t)(text[i] - '0');
    }
    return value > 64 || (value & (value - 1)) != 0 ? 0 : value;
}

int estimators_strategy(const char *text, size_t length, brume_strategy *strategy, uint32_t *positions)
{
    const char *colon = memchr(text, ':', length), *name;
    size_t name_length = colon ? (size_t)(colon - text) : length;
    uint32_t asked = colon ? read_positions(colon + 1, length - name_length - 1) : 0;
    if (colon && asked == 0)
        return 0;
    for (int i = 0; (name = brume_strategy_name((brume_strategy)i)) != NULL; i++)
        if (is(name, text, name_length)) {
            *strategy = (brume_strategy)i;
            *positions = asked;
            return 1;
        }
    return 0;
}

int estimators_indirect(const char *text, size_t length, brume_indirect *indirect)
{
    const char *name;
    for (int i = 0; (name = brume_indirect_name((brume_indirect)i)) != NULL; i++)
        if (is(name, text, length)) {
            *indirect = (brume_indirect)i;
            return 1;
        }
    return 0;
}

/* json_text.c -- what programs print as JSON, checked. */
#include "json_text.h"

#include <ctype.h>
#include <stdio.h>
#include <string.h>

/* Each function moves *s behind what it accepts, and returns whether it did. */

static int json_value(const char **s, int depth);

static void json_space(const char **s)
{
    while (**s && strchr(" \t\r\n", **s))
        ++*s;
}

static int json_string(const char **s)
{
    if (*(*s)++ != '"')
        return 0;
    for (; **s != '"'; ++*s) {
        if ((unsigned char)**s < 0x20)
            return 0;
        if (**s != '\\')
            continue;
        ++*s;
        if (**s == 'u') {
            for (int i = 0; i < 4; i++)
                if (!isxdigit((unsigned char)*++*s))
                    return 0;
        } else if (!**s || !strchr("\"\\/bfnrt", **s)) {
            return 0;
        }
    }
    ++*s;
    return 1;
}

static int json_digits(const char **s)
{
    const char *begin = *s;
    while (isdigit((unsigned char)**s))
        ++*s;
    return *s > begin;
}

static int json_number(const char **s)
{
    *s += **s == '-';
    if (**s == '0')
        ++*s;
    else if (!json_digits(s))
        return 0;
    if (**s == '.' && (++*s, !json_digits(s)))
        return 0;
    if (**s == 'e' || **s == 'E') {
        ++*s;
        *s += **s == '+' || **s == '-';
        return json_digits(s);
    }
    return 1;
}

/* The rest of an object or array, whose opening bracket has been read. */
static int json_list(const char **s, char close, int depth)
{
    json_space(s);
    if (**s == close)
        return ++*s, 1;
    for (;;) {
        json_space(s);
        if (close == '}') {
            if (!json_string(s))
                return 0;
            json_space(s);
            if (*(*s)++ != ':')
                return 0;
        }
        if (!json_value(s, depth + 1))
            return 0;
        json_space(s);
        if (**s == close)
            return ++*s, 1;
        if (*(*s)++ != ',')
            return 0;
    }
}

static int json_value(const char **s, int depth)
{
    static const char *const words[] = {"true", "false", "null"};
    if (depth > 32)
        return 0;
    json_space(s);
    if (**s == '{' || **s == '[') {
        char close = **s == '{' ? '}' : ']';
        ++*s;
        return json_list(s, close, depth);
    }
    if (**s == '"')
        return json_string(s);
    for (int i = 0; i < 3; i++)
        if (strncmp(*s, words[i], strlen(words[i])) == 0)
            return *s += strlen(words[i]), 1;
    return json_number(s);
}

int json_valid(const char *text)
{
    int valid = json_value(&text, 0);
    if (valid)
        json_space(&text);
    return valid && !*text;
}

const char *json_member(const char *json, const char *name)
{
    char key[64];
    snprintf(key, sizeof key, "\"%s\":", name);
    const char *found = strstr(json, key);
    return found ? found + strlen(key) : NULL;
}

/* The devices: what there are, and those that --device names. */
#include <ctype.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "cli.h"

enum { MOST_DEVICES = 64 };

int cli_list_devices(brume_context *context)
{
    uint32_t count;
    brume_result result = brume_device_count(context, &count);
    if (result)
        return cli_report(context, result);
    brume_device_info info;
    if (count == 0) /* fails, and says what to install */
        return cli_report(context, brume_device_describe(context, BRUME_DEVICE_ANY, &info));
    for (uint32_t i = 0; i < count; i++) {
        result = brume_device_describe(context, i, &info);
        if (result)
            return cli_report(context, result);
        printf("%u: %s, %s, driver %s, %.1f GiB, %s\n", i, info.name, info.platform, info.driver,
               (double)info.memory_bytes / (1 << 30), info.is_gpu ? "GPU" : "CPU");
    }
    return CLI_EXIT_OK;
}

/* Whether `part` occurs in `text`, whatever the case of the letters. */
static int contains(const char *text, const char *part)
{
    for (; *text; text++) {
        size_t i = 0;
        while (part[i] && tolower((unsigned char)text[i]) == tolower((unsigned char)part[i]))
            i++;
        if (!part[i])
            return 1;
    }
    return 0;
}

/* The index of the device that a text of `length` bytes names: its number or a part of its name or its platform's. */
static int find_device(brume_context *context, const char *text, size_t length, uint32_t count, uint32_t *out_index)
{
    char wanted[128], *end = wanted;
    snprintf(wanted, sizeof wanted, "%.*s", (int)length, text);
    unsigned long number = isdigit((unsigned char)*wanted) ? strtoul(wanted, &end, 10) : ULONG_MAX;
    if (number != ULONG_MAX && *end == 0) {
        *out_index = (uint32_t)number;
        if (number < count)
            return CLI_EXIT_OK;
        cli_error("no device %s; there %s %u: --list-devices names them", wanted, count == 1 ? "is" : "are", count);
        return CLI_EXIT_DEVICE;
    }
    for (uint32_t i = 0; i < count && *wanted; i++) {
        brume_device_info info;
        brume_result result = brume_device_describe(context, i, &info);
        if (result)
            return cli_report(context, result);
        *out_index = i;
        if (contains(info.name, wanted) || contains(info.platform, wanted))
            return CLI_EXIT_OK;
    }
    cli_error("no device is called \"%s\"; --list-devices names those there are", wanted);
    return CLI_EXIT_DEVICE;
}

/* What --device names, opened. */
typedef struct device_list {
    brume_device *devices[MOST_DEVICES];
    uint32_t indices[MOST_DEVICES], count;
} device_list;

/* A device, or its parts. */
static int add_device(brume_context *context, device_list *list, uint32_t index, uint32_t parts)
{
    for (uint32_t i = 0; i < list->count; i++)
        if (list->indices[i] == index) {
            cli_error("--device names device %u twice", index);
            return CLI_EXIT_USAGE;
        }
    if (parts > MOST_DEVICES - list->count) {
        cli_error("--device names more than %d devices", MOST_DEVICES);
        return CLI_EXIT_USAGE;
    }
    for (uint32_t i = 0; i < parts; i++) {
        brume_result result = brume_device_open_part(context, index, i, parts, &list->devices[list->count]);
        if (result)
            return cli_report(context, result);
        list->indices[list->count++] = index;
    }
    return CLI_EXIT_OK;
}

/* One of the names between commas: a device, or "device/parts". */
static int add_named(brume_context *context, device_list *list, const char *text, size_t length, uint32_t count)
{
    uint32_t index = 0, parts = 1;
    size_t digits = 0;
    while (digits < length && isdigit((unsigned char)text[length - 1 - digits]))
        digits++;
    if (digits > 0 && digits < 4 && digits + 1 < length && text[length - 1 - digits] == '/') {
        parts = (uint32_t)strtoul(text + length - digits, NULL, 10);
        length -= digits + 1;
        if (parts == 0) {
            cli_error("--device: a device makes no 0 parts");
            return CLI_EXIT_USAGE;
        }
    }
    int code = find_device(context, text, length, count, &index);
    return code ? code : add_device(context, list, index, parts);
}

static int add_wanted(brume_context *context, device_list *list, const char *wanted)
{
    uint32_t count;
    int code = CLI_EXIT_OK;
    brume_result result = brume_device_count(context, &count);
    if (result)
        return cli_report(context, result);
    if (!wanted || count == 0) /* without one: fails, and says what to install */
        return add_device(context, list, BRUME_DEVICE_ANY, 1);
    if (strcmp(wanted, "all") == 0) {
        for (uint32_t i = 0; i < count && code == CLI_EXIT_OK; i++)
            code = add_device(context, list, i, 1);
        return code;
    }
    for (const char *at = wanted; code == CLI_EXIT_OK; at++) {
        size_t length = strcspn(at, ",");
        code = add_named(context, list, at, length, count);
        at += length;
        if (!*at)
            break;
    }
    return code;
}

int cli_open_device(brume_context *context, const char *wanted, brume_device **out_device,
                    brume_device_info *out_info)
{
    device_list list;
    memset(&list, 0, sizeof list);
    int code = add_wanted(context, &list, wanted);
    if (code == CLI_EXIT_OK && list.count > 1) {
        brume_result result = brume_device_join(list.devices, list.count, out_device);
        code = result ? cli_report(context, result) : CLI_EXIT_OK;
    } else if (code == CLI_EXIT_OK) {
        *out_device = list.devices[--list.count];
    }
    for (uint32_t i = 0; i < list.count; i++)
        brume_device_destroy(list.devices[i]);
    if (code == CLI_EXIT_OK)
        brume_device_get_info(*out_device, out_info);
    return code;
}

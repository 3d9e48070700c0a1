/* device_several.c -- parts of a device, and several devices as one. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "device.h"

enum { MOST_DEVICES = 64 };

/* ---- parts ----------------------------------------------------------------------------------------------------- */

/* The sub-devices by their counts of cores: those left over go to the first. */
static cl_int split(cl_device_id id, cl_uint cores, uint32_t parts, cl_device_id out[MOST_DEVICES]) {
    cl_device_partition_property how[MOST_DEVICES + 3];
    cl_uint made = 0, n = 0;
    how[n++] = CL_DEVICE_PARTITION_BY_COUNTS;
    for (uint32_t i = 0; i < parts; i++) how[n++] = (cl_device_partition_property)(cores / parts + (i < cores % parts));
    how[n++] = CL_DEVICE_PARTITION_BY_COUNTS_LIST_END;
    how[n] = 0;
    cl_int code = clCreateSubDevices(id, how, parts, out, &made);
    return code == CL_SUCCESS && made != parts ? CL_INVALID_VALUE : code;
}

brume_result brume_device_open_part(brume_context *context, uint32_t index, uint32_t part, uint32_t parts,
                                    brume_device **out) {
    if (!context || !out) return brume_fail(context, BRUME_ERROR_ARGUMENT, "brume_device_open_part: NULL argument");
    if (part >= parts || parts > MOST_DEVICES)
        return brume_fail(context, BRUME_ERROR_ARGUMENT, "brume_device_open_part: part %u of %u; expected one of up to %u",
                          part, parts, (unsigned)MOST_DEVICES);
    cl_device_id id, subs[MOST_DEVICES];
    brume_device_info info;
    BRUME_TRY(brume_device_find(context, index, &id));
    if (parts == 1) return brume_device_open_id(context, id, 0, out);
    BRUME_TRY(brume_device_describe(context, index, &info));
    if (parts > info.compute_units)
        return brume_fail(context, BRUME_ERROR_ARGUMENT, "%s has %u cores, which make no %u parts", info.name,
                          info.compute_units, parts);
    cl_int code = split(id, info.compute_units, parts, subs);
    if (code != CL_SUCCESS)
        return brume_fail(context, BRUME_ERROR_DEVICE, "%s can't be split: %s (%d)", info.name,
                          brume_cl_error_name(code), (int)code);
    for (uint32_t i = 0; i < parts; i++)
        if (i != part) clReleaseDevice(subs[i]);
    return brume_device_open_id(context, subs[part], 1, out);
}

/* ---- several --------------------------------------------------------------------------------------------------- */

/* Devices of one name are not named twice: what they render is the same. */
static void add_name(brume_device_info *all, const brume_device *const *devices, size_t i) {
    size_t length = strlen(all->name);
    for (size_t k = 0; k < i; k++)
        if (strcmp(devices[k]->info.name, devices[i]->info.name) == 0) return;
    snprintf(all->name + length, sizeof all->name - length, "%s%s", i ? " + " : "", devices[i]->info.name);
}

static brume_device_info describe_all(const brume_device *const *devices, size_t count) {
    brume_device_info all = devices[0]->info;
    all.name[0] = 0;
    all.compute_units = 0;
    for (size_t i = 0; i < count; i++) {
        const brume_device_info *one = &devices[i]->info;
        add_name(&all, devices, i);
        all.is_gpu &= one->is_gpu;
        all.compute_units += one->compute_units;
        all.has_double &= one->has_double;
        if (one->memory_bytes < all.memory_bytes) all.memory_bytes = one->memory_bytes;
        if (one->lanes > all.lanes) all.lanes = one->lanes;
    }
    return all;
}

brume_result brume_device_join(brume_device *const *devices, size_t count, brume_device **out) {
    if (!devices || count == 0 || !devices[0]) return BRUME_ERROR_ARGUMENT;
    brume_context *context = devices[0]->context;
    if (!out) return brume_fail(context, BRUME_ERROR_ARGUMENT, "brume_device_join: NULL argument");
    if (count > MOST_DEVICES)
        return brume_fail(context, BRUME_ERROR_ARGUMENT, "brume_device_join: %zu devices; expected up to %u", count,
                          (unsigned)MOST_DEVICES);
    for (size_t i = 0; i < count; i++) {
        if (!devices[i] || devices[i]->context != context || devices[i]->member_count)
            return brume_fail(context, BRUME_ERROR_ARGUMENT,
                              "brume_device_join: expected devices of one context that are not joined themselves");
        for (size_t k = 0; k < i; k++)
            if (devices[k] == devices[i])
                return brume_fail(context, BRUME_ERROR_ARGUMENT, "brume_device_join: the same device twice");
    }
    brume_device *joined = calloc(1, sizeof *joined);
    brume_device **members = malloc(count * sizeof *members);
    if (!joined || !members) {
        free(joined);
        free(members);
        return brume_fail(context, BRUME_ERROR_MEMORY, "joining devices: out of memory");
    }
    joined->references = 1;
    joined->context = brume_context_retain(context);
    joined->info = describe_all((const brume_device *const *)devices, count);
    joined->members = members;
    joined->member_count = (uint32_t)count;
    for (size_t i = 0; i < count; i++) members[i] = brume_device_retain(devices[i]);
    *out = joined;
    return BRUME_OK;
}

brume_result brume_device_get_info(const brume_device *device, brume_device_info *out) {
    if (!device) return BRUME_ERROR_ARGUMENT;
    if (!out) return brume_fail(device->context, BRUME_ERROR_ARGUMENT, "brume_device_get_info: NULL argument");
    *out = device->info;
    return BRUME_OK;
}

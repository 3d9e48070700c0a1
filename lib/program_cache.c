/* program_cache.c -- see program_cache.h.
 *
 * An entry, in the machine's own byte order: a header, the facts, the binary, and the SHA-256 of all of it. The digest
 * guards against damage, not against an enemy: whoever can write to the folder can write what they like.
 */
#include "program_cache.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "platform.h"
#include "sha256.h"
#include "text.h"

enum {
    FORMAT = 1,
    NAME_DIGITS = 32,             /* 128 bits: with a million entries two meet with probability 1e-27 */
    ABANDONED_SECONDS = 60 * 60,  /* a temporary file so old is one that a process died over */
    MAX_ENTRIES = 65536           /* of a folder are looked at when room is made */
};

typedef struct entry_header {
    char magic[8];
    uint32_t format, facts_size;
    uint64_t binary_size;
} entry_header;

static const char magic[8] = "brumePG";

/* ---- names ----------------------------------------------------------------------------------------------------- */

static char *finish_text(brume_text *text) {
    if (!text->failed) return text->data;
    free(text->data);
    return NULL;
}

static void add_string(brume_text *text, const char *string) { brume_text_add(text, string, strlen(string)); }

char *brume_program_cache_folder(void) {
    const char *own = getenv("BRUME_CACHE_DIR");
    brume_text path = {0};
    if (own) {
        if (!*own) return NULL;
        add_string(&path, own);
    } else {
        char *shared = brume_path_user_cache();
        if (!shared) return NULL;
        add_string(&path, shared);
        add_string(&path, "/brume");
        free(shared);
    }
    return finish_text(&path);
}

static void add_hex(brume_text *text, const uint8_t *digest, int digits) {
    for (int i = 0; i < digits / 2; i++) brume_text_format(text, "%02x", digest[i]);
}

static int add_device_fact(brume_text *text, brume_device *device, const char *label, cl_device_info what) {
    char value[512] = "";
    cl_int code = clGetDeviceInfo(device->id, what, sizeof value - 1, value, NULL);
    brume_text_format(text, "%s: %s\n", label, value);
    return code == CL_SUCCESS;
}

char *brume_program_cache_facts(brume_device *device, const brume_program_source *source) {
    brume_text text = {0};
    char version[512] = "";
    cl_platform_id platform = NULL;
    int known =
        clGetDeviceInfo(device->id, CL_DEVICE_PLATFORM, sizeof platform, &platform, NULL) == CL_SUCCESS &&
        clGetPlatformInfo(platform, CL_PLATFORM_VERSION, sizeof version - 1, version, NULL) == CL_SUCCESS;
    brume_text_format(&text, "brume: " BRUME_VERSION "\nplatform: %s\nplatform version: %s\n", device->info.platform,
                      version);
    known = known && add_device_fact(&text, device, "device", CL_DEVICE_NAME) &&
            add_device_fact(&text, device, "device version", CL_DEVICE_VERSION) &&
            add_device_fact(&text, device, "driver", CL_DRIVER_VERSION);
    add_string(&text, "options: ");
    add_string(&text, source->options);
    uint8_t digest[SHA256_SIZE];
    brume_sha256(source->text, strlen(source->text), digest);
    add_string(&text, "\nsource: ");
    add_hex(&text, digest, 2 * SHA256_SIZE);
    add_string(&text, "\n");
    /* An entry under a name that lacks the driver's version, say, would be the next version's, too. */
    text.failed = text.failed || !known;
    return finish_text(&text);
}

char *brume_program_cache_path(const char *folder, const char *facts) {
    uint8_t digest[SHA256_SIZE];
    brume_sha256(facts, strlen(facts), digest);
    brume_text path = {0};
    add_string(&path, folder);
    add_string(&path, "/");
    add_hex(&path, digest, NAME_DIGITS);
    add_string(&path, ".program");
    return finish_text(&path);
}

/* Of ours: an entry, or with `suffix` a temporary name of one. */
static int is_entry_name(const char *name, int *is_temporary) {
    for (int i = 0; i < NAME_DIGITS; i++)
        if (!strchr("0123456789abcdef", name[i]) || !name[i]) return 0;
    *is_temporary = strncmp(name + NAME_DIGITS, ".program.", 9) == 0;
    return *is_temporary || strcmp(name + NAME_DIGITS, ".program") == 0;
}

/* ---- reading --------------------------------------------------------------------------------------------------- */

unsigned char *brume_program_cache_load(const char *folder, const char *facts, size_t *out_size) {
    char *path = brume_program_cache_path(folder, facts);
    size_t size = 0;
    unsigned char *data = NULL, *binary = NULL;
    if (path) data = brume_file_read_used(path, sizeof(entry_header) + 1, PROGRAM_CACHE_LIMIT, &size);
    free(path);
    if (!data) return NULL;
    entry_header header;
    uint8_t digest[SHA256_SIZE];
    memcpy(&header, data, sizeof header);
    uint64_t facts_size = strlen(facts), overhead = sizeof header + SHA256_SIZE;
    int right = memcmp(header.magic, magic, sizeof magic) == 0 && header.format == FORMAT &&
                header.facts_size == facts_size && header.binary_size > 0 && size > overhead + facts_size &&
                header.binary_size == size - overhead - facts_size &&
                memcmp(data + sizeof header, facts, facts_size) == 0;
    if (right) {
        brume_sha256(data, size - SHA256_SIZE, digest);
        right = memcmp(data + size - SHA256_SIZE, digest, SHA256_SIZE) == 0;
    }
    if (right) binary = malloc((size_t)header.binary_size);
    if (binary) {
        memcpy(binary, data + sizeof header + facts_size, (size_t)header.binary_size);
        *out_size = (size_t)header.binary_size;
    }
    free(data);
    return binary;
}

/* ---- writing --------------------------------------------------------------------------------------------------- */

typedef struct entry_file { char name[NAME_DIGITS + 64]; double age; uint64_t size; } entry_file;

typedef struct entry_list {
    const char *folder;
    entry_file *files;
    size_t count, capacity;
    uint64_t total;
} entry_list;

static int older_first(const void *a, const void *b) {
    double x = ((const entry_file *)a)->age, y = ((const entry_file *)b)->age;
    return (x < y) - (x > y);
}

/* Takes note of an entry; removes what a process that died left behind. */
static int list_entry(void *user, const brume_folder_entry *file) {
    entry_list *list = user;
    int is_temporary;
    if (!is_entry_name(file->name, &is_temporary) || strlen(file->name) >= sizeof list->files->name) return 1;
    if (is_temporary) {
        if (file->age > ABANDONED_SECONDS) brume_folder_remove(list->folder, file->name);
        return 1;
    }
    if (list->count == list->capacity) {
        size_t larger = list->capacity ? 2 * list->capacity : 64;
        entry_file *moved = realloc(list->files, larger * sizeof *moved);
        if (!moved) return 0;
        list->files = moved;
        list->capacity = larger;
    }
    entry_file *entry = &list->files[list->count++];
    strcpy(entry->name, file->name);
    entry->age = file->age;
    entry->size = file->size;
    list->total += file->size;
    return list->count < MAX_ENTRIES;
}

/* Removes entries until the rest fits. */
static void make_room(const char *folder, uint64_t limit) {
    entry_list list = {.folder = folder};
    brume_folder_visit(folder, list_entry, &list);
    if (list.count > 0) qsort(list.files, list.count, sizeof *list.files, older_first);
    for (size_t i = 0; i < list.count && list.total > limit; i++) {
        brume_folder_remove(folder, list.files[i].name); /* another process may have been faster: gone all the same */
        list.total -= list.files[i].size;
    }
    free(list.files);
}

/* malloc'ed bytes of an entry. */
static unsigned char *make_entry(const char *facts, const unsigned char *binary, size_t binary_size, size_t *size) {
    entry_header header = {.format = FORMAT, .facts_size = (uint32_t)strlen(facts), .binary_size = binary_size};
    memcpy(header.magic, magic, sizeof magic);
    *size = sizeof header + header.facts_size + binary_size + SHA256_SIZE;
    unsigned char *data = malloc(*size);
    if (!data) return NULL;
    memcpy(data, &header, sizeof header);
    memcpy(data + sizeof header, facts, header.facts_size);
    memcpy(data + sizeof header + header.facts_size, binary, binary_size);
    brume_sha256(data, *size - SHA256_SIZE, data + *size - SHA256_SIZE);
    return data;
}

int brume_program_cache_store(const char *folder, const char *facts, const unsigned char *binary, size_t binary_size,
                              uint64_t limit) {
    if (binary_size == 0 || binary_size > limit / 2) return 0;
    size_t size = 0;
    int kept = 0;
    char *path = brume_program_cache_path(folder, facts);
    unsigned char *entry = make_entry(facts, binary, binary_size, &size);
    if (path && entry) {
        brume_folder_make(folder);
        kept = brume_file_replace(path, entry, size, 1) == 0;
        make_room(folder, limit);
    }
    free(path);
    free(entry);
    return kept;
}

/* ---- programs -------------------------------------------------------------------------------------------------- */

static cl_program program_of(brume_device *device, const char *options, const unsigned char *binary, size_t size) {
    cl_int code, status = CL_SUCCESS;
    cl_uint kernels = 0;
    cl_program program = clCreateProgramWithBinary(device->cl, 1, &device->id, &size, &binary, &status, &code);
    if (code != CL_SUCCESS) return NULL;
    if (status == CL_SUCCESS && clBuildProgram(program, 1, &device->id, options, NULL, NULL) == CL_SUCCESS &&
        clCreateKernelsInProgram(program, 0, NULL, &kernels) == CL_SUCCESS && kernels > 0)
        return program;
    clReleaseProgram(program);
    return NULL;
}

cl_program brume_program_cache_open(brume_device *device, const char *folder, const brume_program_source *source,
                                    uint64_t *bytes) {
    size_t size = 0;
    char *facts = brume_program_cache_facts(device, source);
    unsigned char *binary = facts ? brume_program_cache_load(folder, facts, &size) : NULL;
    cl_program program = binary ? program_of(device, source->options, binary, size) : NULL;
    if (program) *bytes = size;
    free(binary);
    free(facts);
    return program;
}

int brume_program_cache_keep(brume_device *device, const char *folder, const brume_program_source *source,
                             cl_program program) {
    size_t size = 0;
    int kept = 0;
    if (clGetProgramInfo(program, CL_PROGRAM_BINARY_SIZES, sizeof size, &size, NULL) != CL_SUCCESS || size == 0 ||
        size > PROGRAM_CACHE_LIMIT)
        return 0;
    char *facts = brume_program_cache_facts(device, source);
    unsigned char *binary = malloc(size);
    if (facts && binary && clGetProgramInfo(program, CL_PROGRAM_BINARIES, sizeof binary, &binary, NULL) == CL_SUCCESS)
        kept = brume_program_cache_store(folder, facts, binary, size, PROGRAM_CACHE_LIMIT);
    free(binary);
    free(facts);
    return kept;
}

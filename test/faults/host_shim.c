/* host_shim.c -- see host_shim.h. */
#define _GNU_SOURCE
#include "host_shim.h"

#include <dlfcn.h>
#include <errno.h>
#include <malloc.h>
#include <pthread.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "cl_shim.h"

#if defined(__has_feature)
#if __has_feature(address_sanitizer)
#define SANITIZED 1
#endif
#endif
#if defined(__SANITIZE_ADDRESS__)
#define SANITIZED 1
#endif

enum { BOOK = 1 << 20 }; /* a power of two, far more than what is ever allocated at once */

typedef struct entry { void *at, *caller; } entry;

static entry book[BOOK]; /* open addressing; (void *)1 marks what has been freed */
static size_t booked;
static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
static unsigned calls, fail_at;
static int fail_forever, fired, counting, of_others;
static __thread int mine; /* the test's thread */

#ifndef SANITIZED
#define GONE ((void *)1)

/* glibc's own, below the names that programs may take. */
extern void *__libc_malloc(size_t), *__libc_calloc(size_t, size_t), *__libc_realloc(void *, size_t);
extern void *__libc_memalign(size_t, size_t);
extern void __libc_free(void *);

static size_t place_of(const void *at) { return (size_t)(((uintptr_t)at >> 4) * UINT64_C(0x9e3779b97f4a7c15) >> 44); }

static void note(void *at, void *caller) {
    size_t i = place_of(at);
    pthread_mutex_lock(&lock);
    while (book[i].at && book[i].at != GONE) i = (i + 1) % BOOK;
    book[i] = (entry){at, caller};
    booked++;
    pthread_mutex_unlock(&lock);
}

static void strike(const void *at) {
    if (!at || !booked) return;
    pthread_mutex_lock(&lock);
    for (size_t i = place_of(at); book[i].at; i = (i + 1) % BOOK)
        if (book[i].at == at) {
            book[i].at = GONE;
            booked--;
            break;
        }
    pthread_mutex_unlock(&lock);
}

static int counts(void) { return counting && mine != of_others && !cl_shim_inside(); }

/* Whether the allocation is to fail. */
static int runs_out(void) {
    unsigned call = __atomic_add_fetch(&calls, 1, __ATOMIC_RELAXED);
    int fails = fail_at && (call == fail_at || (fail_forever && call > fail_at));
    if (fails) {
        __atomic_store_n(&fired, 1, __ATOMIC_RELAXED);
        errno = ENOMEM;
    }
    return fails;
}

#define PASS_ON(request)                                       \
    do {                                                       \
        if (!counts()) return request;                         \
        if (runs_out()) return NULL;                           \
        void *made = request;                                  \
        if (made) note(made, __builtin_return_address(0));     \
        return made;                                           \
    } while (0)

__attribute__((visibility("default"))) void *malloc(size_t size) { PASS_ON(__libc_malloc(size)); }
__attribute__((visibility("default"))) void *calloc(size_t n, size_t size) { PASS_ON(__libc_calloc(n, size)); }
__attribute__((visibility("default"))) void *memalign(size_t to, size_t size) { PASS_ON(__libc_memalign(to, size)); }
__attribute__((visibility("default"))) void *aligned_alloc(size_t to, size_t size) {
    PASS_ON(__libc_memalign(to, size));
}

__attribute__((visibility("default"))) int posix_memalign(void **out, size_t to, size_t size) {
    if (counts() && runs_out()) return ENOMEM;
    void *made = __libc_memalign(to, size);
    if (!made) return ENOMEM;
    if (counts()) note(made, __builtin_return_address(0));
    *out = made;
    return 0;
}

__attribute__((visibility("default"))) void *realloc(void *old, size_t size) {
    if (counts() && runs_out()) return NULL;
    strike(old);
    void *made = __libc_realloc(old, size);
    if (made && counts()) note(made, __builtin_return_address(0));
    return made;
}

__attribute__((visibility("default"))) void free(void *at) {
    strike(at);
    __libc_free(at);
}

int host_shim_works(void) { return 1; }
#else
int host_shim_works(void) { return 0; }
#endif

void host_shim_begin(unsigned n, int forever) {
    pthread_mutex_lock(&lock);
    memset(book, 0, sizeof book);
    booked = 0;
    calls = 0;
    fired = 0;
    pthread_mutex_unlock(&lock);
    fail_at = n;
    fail_forever = forever;
    mine = 1;
    of_others = 0;
    counting = 1;
}

void host_shim_of_others(int others) { of_others = others; }

void host_shim_relent(void) { fail_at = 0; }

void host_shim_end(void) {
    counting = 0;
    fail_at = 0;
}

unsigned host_shim_count(void) { return calls; }
int host_shim_fired(void) { return fired; }

size_t host_shim_left(char who[256]) {
    size_t left = 0;
    who[0] = 0;
    for (size_t i = 0; i < BOOK; i++) {
        if ((uintptr_t)book[i].at <= 1) continue;
        left++;
        Dl_info info;
        if (!who[0] && dladdr(book[i].caller, &info) && info.dli_fname)
            snprintf(who, 256, "%s%s%s +%#zx", info.dli_fname, info.dli_sname ? ", " : "",
                     info.dli_sname ? info.dli_sname : "",
                     (size_t)((char *)book[i].caller - (char *)info.dli_fbase));
    }
    return left;
}

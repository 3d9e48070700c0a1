/* test_display.c -- --display-server: what a viewer is sent is tev's protocol and the picture; one that leaves, hangs
 * or isn't there harms nothing. The viewer is a thread here that keeps all bytes. */
#include <arpa/inet.h>
#include <netinet/in.h>
#include <pthread.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <limits.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <cmocka.h>

#include "brume.h"
#include "render_cli.h"

enum { WIDTH = 300, HEIGHT = 20, ROOM = 1 << 24 }; /* more than one tile */

static const char scene[] =
    "<scene version='3.0.0'><integrator type='volpath'/>\n"
    "<default name='width' value='300'/><default name='height' value='20'/>\n"
    "<sensor type='perspective'><transform name='to_world'><lookat origin='0,1,5' target='0,1,0' up='0,1,0'/>\n"
    "</transform><sampler type='independent'><integer name='sample_count' value='64'/></sampler>\n"
    "<film type='hdrfilm'><integer name='width' value='$width'/><integer name='height' value='$height'/>\n"
    "<string name='component_format' value='float32'/></film></sensor>\n"
    "<emitter type='constant'><rgb name='radiance' value='0.25, 0.5, 1'/></emitter>\n"
    "<shape type='sphere'><point name='center' x='0' y='1' z='0'/></shape></scene>\n";

/* ---- a viewer ---------------------------------------------------------------------------------------------------- */

typedef struct viewer {
    int listening, port;
    size_t most; /* bytes after which it leaves; 0: it accepts and never reads */
    unsigned char *bytes;
    size_t size;
    pthread_t thread;
} viewer;

static void *watch(void *user) {
    viewer *v = user;
    int connection = accept(v->listening, NULL, NULL);
    if (connection < 0) return NULL;
    ssize_t got = 1;
    while (v->size < v->most && got > 0) {
        got = read(connection, v->bytes + v->size, v->most - v->size);
        if (got > 0) v->size += (size_t)got;
    }
    if (v->most == 0) sleep(6);
    close(connection);
    return NULL;
}

static void open_viewer(viewer *v, size_t most) {
    struct sockaddr_in address = {.sin_family = AF_INET, .sin_addr.s_addr = htonl(INADDR_LOOPBACK)};
    socklen_t length = sizeof address;
    int small = 2048;
    v->listening = socket(AF_INET, SOCK_STREAM, 0);
    v->most = most;
    v->size = 0;
    v->bytes = malloc(ROOM);
    assert_non_null(v->bytes);
    assert_int_equal(setsockopt(v->listening, SOL_SOCKET, SO_RCVBUF, &small, sizeof small), 0);
    assert_int_equal(bind(v->listening, (struct sockaddr *)&address, sizeof address), 0);
    assert_int_equal(getsockname(v->listening, (struct sockaddr *)&address, &length), 0);
    v->port = ntohs(address.sin_port);
    assert_int_equal(listen(v->listening, 1), 0);
    assert_int_equal(pthread_create(&v->thread, NULL, watch, v), 0);
}

static void close_viewer(viewer *v) {
    pthread_join(v->thread, NULL);
    close(v->listening);
}

/* Renders to NAME.exr and shows it. */
static void show_to(int port, const char *name, const char *more) {
    char line[200];
    snprintf(line, sizeof line, "scene.xml -o %s.exr --layers none --display-server 127.0.0.1:%d%s", name, port, more);
    assert_int_equal(cli_run(line), 0);
}

static float *picture(const char *name) {
    char path[PATH_MAX];
    brume_context *context;
    uint32_t width, height;
    float *rgb;
    snprintf(path, sizeof path, "%s/%s.exr", cli_folder, name);
    assert_int_equal(brume_context_create(&context), BRUME_OK);
    assert_int_equal(brume_picture_read(context, path, &width, &height, &rgb), BRUME_OK);
    assert_true(width == WIDTH && height == HEIGHT);
    brume_context_destroy(context);
    return rgb;
}

/* ---- the protocol ------------------------------------------------------------------------------------------------ */

static uint32_t number_at(const unsigned char *b) {
    return (uint32_t)b[0] | (uint32_t)b[1] << 8 | (uint32_t)b[2] << 16 | (uint32_t)b[3] << 24;
}

/* Puts the picture together from what was sent. The number of updates, or -1 if that is not tev's protocol: a picture
 * made once, then channels of tiles inside it, each packet as long as it says. */
static int updates_in(const unsigned char *bytes, size_t size, float *out) {
    static const unsigned char channels[6] = {'R', 0, 'G', 0, 'B', 0};
    int updates = 0, created = 0;
    for (size_t at = 0; at < size;) {
        if (size - at < 6) return -1;
        const unsigned char *b = bytes + at;
        uint32_t length = number_at(b);
        if (length < 6 || length > size - at || b[5] > 1) return -1;
        const unsigned char *end = b + length, *name = b + 6, *rest = memchr(name, 0, (size_t)(end - name));
        if (!rest || strcmp((const char *)name, "scene.xml") != 0) return -1;
        rest++;
        if (b[4] == 4) {
            if (created++ || end - rest != 12 + 6 || number_at(rest) != WIDTH || number_at(rest + 4) != HEIGHT ||
                number_at(rest + 8) != 3 || memcmp(rest + 12, channels, 6) != 0)
                return -1;
        } else if (b[4] == 3) {
            if (!created || end - rest < 18 || rest[1] != 0 || !strchr("RGB", rest[0])) return -1;
            int c = rest[0] == 'R' ? 0 : rest[0] == 'G' ? 1 : 2;
            uint32_t x = number_at(rest + 2), y = number_at(rest + 6);
            uint32_t w = number_at(rest + 10), h = number_at(rest + 14);
            if (x >= WIDTH || y >= HEIGHT || w > WIDTH - x || h > HEIGHT - y ||
                (size_t)(end - rest) != 18 + 4ul * w * h)
                return -1;
            for (uint32_t i = 0; i < w * h; i++) {
                uint32_t bits = number_at(rest + 18 + 4 * i);
                memcpy(&out[3 * ((y + i / w) * WIDTH + x + i % w) + (uint32_t)c], &bits, sizeof bits);
            }
            updates++;
        } else {
            return -1;
        }
        at += length;
    }
    return updates;
}

static void a_viewer_gets_the_picture(void **state) {
    (void)state;
    if (!cli_has_device()) skip();
    static float shown[WIDTH * HEIGHT * 3];
    viewer v;
    open_viewer(&v, ROOM);
    show_to(v.port, "a", "");
    close_viewer(&v);
    assert_null(strstr(cli.err, "warning"));
    int updates = updates_in(v.bytes, v.size, shown);
    assert_true(updates >= 6 && updates % 6 == 0);
    float *written = picture("a");
    assert_memory_equal(shown, written, sizeof shown);
    /* What the check is good for: a byte too few, another kind, another width are no protocol. */
    static const size_t places[] = {0, 4, 16, 24};
    assert_int_equal(updates_in(v.bytes, v.size - 1, shown), -1);
    for (size_t i = 0; i < sizeof places / sizeof places[0]; i++) {
        v.bytes[places[i]] ^= 1;
        assert_int_equal(updates_in(v.bytes, v.size, shown), -1);
        v.bytes[places[i]] ^= 1;
    }
    free(v.bytes);
    brume_picture_free(written);
}

/* At once, in the middle of a picture, by not reading on, or by not being there. */
static void a_viewer_that_leaves_harms_nothing(void **state) {
    (void)state;
    if (!cli_has_device()) skip();
    static const size_t most[] = {1, 20000};
    viewer v;
    float *alone = picture("a");
    for (size_t i = 0; i < sizeof most / sizeof most[0]; i++) {
        open_viewer(&v, most[i]);
        show_to(v.port, "b", "");
        close_viewer(&v);
        free(v.bytes);
        float *left = picture("b");
        assert_memory_equal(left, alone, sizeof(float) * WIDTH * HEIGHT * 3);
        brume_picture_free(left);
    }
    show_to(1, "b", ""); /* nobody listens on port 1 */
    assert_non_null(strstr(cli.err, "warning: --display-server 127.0.0.1:1 does not answer"));
    float *left = picture("b");
    assert_memory_equal(left, alone, sizeof(float) * WIDTH * HEIGHT * 3);
    brume_picture_free(left);
    brume_picture_free(alone);
    /* Of so large a picture no system's buffers hold the whole: it is noticed after a while. */
    open_viewer(&v, 0);
    show_to(v.port, "b", " -D width=4000 -D height=1000 --spp 1");
    assert_non_null(strstr(cli.err, "has gone; the render goes on without it"));
    close_viewer(&v);
    free(v.bytes);
}

static int setup(void **state) {
    (void)state;
    return cli_open(scene);
}

static int teardown(void **state) {
    (void)state;
    static const char *const names[] = {"scene.xml", "a.exr", "b.exr"};
    return cli_close(names, 3);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_viewer_gets_the_picture),
        cmocka_unit_test(a_viewer_that_leaves_harms_nothing),
    };
    return cmocka_run_group_tests(tests, setup, teardown);
}

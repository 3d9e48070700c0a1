/* The picture while it renders, shown by tev (https://github.com/Tom94/tev): its protocol over TCP, little-endian
 * packets of uint32 size, itself included, uint8 kind, and what the kind has. */
#include <stdlib.h>
#include <string.h>

#include "cli.h"
#include "platform.h"

enum { CREATE_IMAGE = 4, UPDATE_IMAGE = 3, DEFAULT_PORT = 14158, TILE = 256 };

/* Showing takes at most this share of the time, and not more than so many pictures a second. */
#define SHARE 0.05
#define MOST_PER_SECOND 5

/* Seconds that a viewer may take to read on: then it is left alone. */
#define PATIENCE 2.0

typedef struct packet {
    unsigned char *bytes;
    size_t size;
} packet;

static void put(packet *p, const void *bytes, size_t size)
{
    memcpy(p->bytes + p->size, bytes, size);
    p->size += size;
}

static void put_byte(packet *p, int value)
{
    p->bytes[p->size++] = (unsigned char)value;
}

static void put_number(packet *p, uint32_t value)
{
    for (int i = 0; i < 4; i++)
        put_byte(p, (int)(value >> (8 * i) & 255));
}

static void put_text(packet *p, const char *text)
{
    put(p, text, strlen(text) + 1);
}

static void start(packet *p, int kind, int grabs_focus)
{
    p->size = 4; /* for the size */
    put_byte(p, kind);
    put_byte(p, grabs_focus);
}

/* Non-zero if the viewer took it. */
static int deliver(cli_display *display, packet *p)
{
    size_t size = p->size;
    p->size = 0;
    put_number(p, (uint32_t)size);
    return platform_send(display->socket, p->bytes, size, PATIENCE) == 0;
}

static void leave(cli_display *display, const char *why)
{
    if (display->verbosity >= 0)
        fprintf(stderr, "render-cli: warning: --display-server %s %s; the render goes on without it\n",
                display->server, why);
    platform_disconnect(display->socket);
    display->socket = -1;
}

/* Splits HOST[:PORT] and connects. An IPv6 address stands in brackets. */
static int connect_to(const char *server)
{
    char host[256], port[16];
    const char *end = server[0] == '[' ? strchr(server, ']') : server + strcspn(server, ":");
    const char *colon = end && *end == ']' ? end + 1 : end;
    snprintf(port, sizeof port, "%d", DEFAULT_PORT);
    if (!end)
        return -1;
    if (*colon == ':' && colon[1])
        snprintf(port, sizeof port, "%s", colon + 1);
    snprintf(host, sizeof host, "%.*s", (int)(end - server) - (server[0] == '['), server + (server[0] == '['));
    return platform_connect(*host ? host : "127.0.0.1", port, PATIENCE);
}

static int create_image(cli_display *display)
{
    unsigned char bytes[1200];
    packet p = {bytes, 0};
    static const char *const channels[3] = {"R", "G", "B"};
    start(&p, CREATE_IMAGE, 1);
    put_text(&p, display->name);
    put_number(&p, display->width);
    put_number(&p, display->height);
    put_number(&p, 3);
    for (int c = 0; c < 3; c++)
        put_text(&p, channels[c]);
    return deliver(display, &p);
}

void cli_display_start(cli_display *display, brume_render *render, const cli_options *options)
{
    brume_render_stats stats;
    memset(display, 0, sizeof *display);
    display->socket = -1;
    display->server = options->display_server;
    display->verbosity = options->verbosity;
    if (!display->server || brume_render_get_stats(render, &stats))
        return;
    display->render = render;
    display->width = stats.width;
    display->height = stats.height;
    snprintf(display->name, sizeof display->name, "%s", options->scene);
    display->socket = connect_to(display->server);
    if (display->socket < 0)
        leave(display, "does not answer");
    else if (!create_image(display))
        leave(display, "has gone");
}

/* One channel of a tile. */
static int send_tile(cli_display *display, packet *p, const float *rgb, int channel, uint32_t x, uint32_t y)
{
    static const char *const names[3] = {"R", "G", "B"};
    uint32_t width = display->width - x < TILE ? display->width - x : TILE;
    uint32_t height = display->height - y < TILE ? display->height - y : TILE;
    start(p, UPDATE_IMAGE, 0);
    put_text(p, display->name);
    put_text(p, names[channel]);
    put_number(p, x);
    put_number(p, y);
    put_number(p, width);
    put_number(p, height);
    for (uint32_t j = 0; j < height; j++)
        for (uint32_t i = 0; i < width; i++) {
            uint32_t bits;
            memcpy(&bits, &rgb[3 * ((size_t)(y + j) * display->width + x + i) + (size_t)channel], sizeof bits);
            put_number(p, bits);
        }
    return deliver(display, p);
}

static void show(cli_display *display)
{
    size_t count = (size_t)display->width * display->height * 3;
    packet p = {malloc(4 * TILE * TILE + sizeof display->name + 64), 0};
    float *rgb = malloc(count * sizeof *rgb);
    int taken = p.bytes && rgb && brume_render_read(display->render, BRUME_CHANNEL_RADIANCE, rgb, count) == BRUME_OK;
    for (uint32_t y = 0; y < display->height && taken; y += TILE)
        for (uint32_t x = 0; x < display->width && taken; x += TILE)
            for (int c = 0; c < 3 && taken; c++)
                taken = send_tile(display, &p, rgb, c, x, y);
    free(rgb);
    free(p.bytes);
    if (!taken)
        leave(display, "has gone");
}

void cli_display_update(cli_display *display)
{
    double begin = cli_now();
    if (display->socket < 0 || begin < display->next)
        return;
    show(display);
    double end = cli_now(), pause = (end - begin) / SHARE;
    display->next = end + (pause > 1.0 / MOST_PER_SECOND ? pause : 1.0 / MOST_PER_SECOND);
}

void cli_display_finish(cli_display *display)
{
    if (display->socket >= 0)
        show(display);
    if (display->socket >= 0)
        platform_disconnect(display->socket);
    display->socket = -1;
}

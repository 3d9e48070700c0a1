/* render-cli --debug-sample: what the path of one sample does, for people; and the command line that asks for it. */
#include <ctype.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "cli.h"

/* ---- the command ---- */

/* `text` as one word of a POSIX shell. */
static int append_word(char **to, const char *text)
{
    size_t used = *to ? strlen(*to) : 0, plain = 0;
    while (isalnum((unsigned char)text[plain]) || (text[plain] && strchr("_-+=.,:/@%", text[plain])))
        plain++;
    int quoted = text[plain] || !*text;
    char *grown = realloc(*to, used + 4 * strlen(text) + 4);
    if (!grown)
        return 0;
    char *at = grown + used;
    *to = grown;
    if (used)
        *at++ = ' ';
    if (quoted)
        *at++ = '\'';
    for (; *text; text++) {
        if (*text == '\'') {
            memcpy(at, "'\\'", 3);
            at += 3;
        }
        *at++ = *text;
    }
    if (quoted)
        *at++ = '\'';
    *at = 0;
    return 1;
}

int cli_replay_add(cli_options *options, const char *name, const char *value)
{
    size_t size = (name ? strlen(name) : 0) + strlen(value) + 4;
    char *word = malloc(size);
    int done = word != NULL;
    if (done) {
        snprintf(word, size, "%s%s%s%s", name ? "--" : "", name ? name : "", name ? "=" : "", value);
        done = append_word(&options->replay, word);
    }
    free(word);
    if (!done)
        cli_error("out of memory");
    return done ? 0 : CLI_EXIT_RUNTIME;
}

/* ---- what it prints ---- */

static int is_bad(const float *x, int count)
{
    int bad = 0;
    for (int i = 0; i < count; i++)
        bad |= !isfinite(x[i]);
    return bad;
}

static void print_triple(const char *name, const float x[3])
{
    printf("%s(%.6g, %.6g, %.6g)", name, (double)x[0], (double)x[1], (double)x[2]);
}

static void print_light(const char *name, const float x[3], int known)
{
    if (!known || (x[0] == 0 && x[1] == 0 && x[2] == 0))
        return;
    printf("     + ");
    print_triple("", x);
    printf(" %s%s\n", name, is_bad(x, 3) ? "   <- here" : "");
}

static void print_vertex(size_t number, const brume_trace_vertex *v, const float before[3])
{
    static const char *const events[] = {"", "leaves the scene", "scatters in medium", "meets shape", "passes shape",
                                         "is absorbed in medium"};
    printf("%2zu  %s", number, events[v->event]);
    if (v->event == BRUME_TRACE_SURFACE || v->event == BRUME_TRACE_PASSED)
        printf(" %u", v->shape);
    if (v->event == BRUME_TRACE_SCATTERED || v->event == BRUME_TRACE_ABSORBED)
        printf(" %u", v->medium);
    if (v->event != BRUME_TRACE_ESCAPED)
        printf(" at (%.9g, %.9g, %.9g), %.6g away", v->position[0], v->position[1], v->position[2], (double)v->length);
    int is_somewhere = isfinite(v->position[0]) && isfinite(v->position[1]) && isfinite(v->position[2]);
    printf(is_somewhere ? "\n" : "   <- here\n");
    print_triple("     direction ", v->direction);
    if (v->pdf >= 0)
        printf(", pdf %.6g per steradian", (double)v->pdf);
    if (!(v->pdf >= 0) && !(v->pdf < 0))
        printf(", pdf %g", (double)v->pdf);
    if (v->medium != BRUME_NONE)
        printf(", through medium %u", v->medium);
    printf(is_bad(v->direction, 3) || !isfinite(v->pdf) ? "   <- here\n" : "\n");
    print_triple("     throughput ", v->throughput_before);
    print_triple(" -> ", v->throughput_after);
    printf(is_bad(v->throughput_before, 3) || is_bad(v->throughput_after, 3) ? "   <- here\n" : "\n");
    /* What is added to a NaN can't be told. */
    int known = !is_bad(before, 3);
    print_light("from the medium along the way", v->along, known);
    known &= !is_bad(v->along, 3);
    print_light("emitted by what it meets", v->met, known);
    known &= !is_bad(v->met, 3);
    print_light("sampled from lights", v->lit, known);
    print_triple("     = ", v->radiance);
    printf("%s\n", v->ends ? ", and ends" : "");
}

int cli_debug_sample(brume_context *context, const cli_options *options, cli_progress *progress)
{
    cli_session session;
    brume_trace trace;
    const float nothing[3] = {0, 0, 0};
    const uint32_t *at = options->debug_sample;
    int code = cli_session_open(&session, context, options, progress);
    brume_result result = BRUME_OK;
    if (!code)
        result = brume_sample_trace(session.device, session.scene, &options->render, at[0], at[1], at[2], &trace);
    cli_progress_finish(progress);
    if (result)
        code = cli_report(context, result);
    if (!code) {
        printf("sample %u of pixel %u, %u, in %s\n", at[2], at[0], at[1],
               options->render.precision == BRUME_PRECISION_DOUBLE ? "double" : "float");
        for (size_t i = 0; i < trace.count; i++)
            print_vertex(i, &trace.vertices[i], i ? trace.vertices[i - 1].radiance : nothing);
        if (trace.bad)
            puts("radiance: not finite; a picture drops this sample");
        else
            print_triple("radiance, as the film gets it: ", trace.radiance);
        if (!trace.bad)
            putchar('\n');
        brume_trace_free(&trace);
    }
    cli_session_close(&session);
    return code;
}

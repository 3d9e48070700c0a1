/* render-cli info: what is in a scene, without rendering it. */
#include <string.h>

#include "cli.h"

int cli_info(brume_context *context, const cli_options *options, cli_progress *progress)
{
    cli_session session;
    brume_render *render = NULL;
    brume_render_stats stats;
    int code = cli_session_open(&session, context, options, progress);
    if (code)
        goto cleanup;
    brume_result result = brume_render_create(session.device, session.scene, &options->render, &render);
    if (!result)
        result = brume_render_get_stats(render, &stats);
    if (result) {
        code = cli_report(context, result);
        goto cleanup;
    }
    printf("picture        %u x %u pixels of %u x %u\n", stats.width, stats.height, stats.full_width,
           stats.full_height);
    printf("surfaces       %u triangles, %u quadrics\n", stats.triangles, stats.quadrics);
    printf("lights         %u lamps, %u emitting surfaces, %u media\n", stats.lights, stats.emitters, stats.media);
    printf("on the device  %.1f MiB\n", (double)stats.device_bytes / (1 << 20));
cleanup:
    cli_progress_finish(progress);
    brume_render_destroy(render);
    cli_session_close(&session);
    return code;
}

/* break_off.c -- see break_off.h. */
#include "break_off.h"

static int stop_after(void *reports, const brume_progress *progress) {
    (void)progress;
    return --*(int *)reports == 0;
}

brume_result break_off_after(brume_render *render, uint32_t groups, int reports) {
    render->launch_groups = groups;
    render->report_seconds = -1; /* after each launch */
    return brume_render_run(render, stop_after, &reports);
}

brume_result break_off_in_a_pass(brume_render *render, uint32_t groups) {
    while (!render->ends || !render->pass.groups_done) {
        brume_result result = break_off_after(render, groups, 1);
        if (result != BRUME_CANCELLED) return result == BRUME_OK ? BRUME_ERROR_ARGUMENT : result;
    }
    return BRUME_OK;
}

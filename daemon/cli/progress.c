// SPDX-License-Identifier: Apache-2.0
#include "daemon/cli/progress.h"

#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "core/invariant.h"
#include "daemon/base/monotonic.h"
#include "daemon/cli/screen.h"

enum {
    BAR_CELLS = 40,
    BAR_CELLS_MIN = 4,
    BAR_FRAME = 24,  // the text around the cells, with the longest stage name
    REDRAW_US = 100000,
};

void progress_begin(struct progress *progress, bool quiet) {
    *progress = (struct progress){.shown = !quiet && isatty(STDERR_FILENO) == 1};
}

void progress_expect(struct progress *progress, const double *work, int stages) {
    INVARIANT(stages >= 1 && stages <= PROGRESS_STAGES_MAX);
    progress->stages = stages;
    progress->before[0] = 0;
    for (int i = 0; i < stages; i++) {
        INVARIANT(work[i] >= 0);
        progress->before[i + 1] = progress->before[i] + work[i];
    }
}

// As many as fit: a bar that reached the last column would wrap and be drawn repeatedly.
static int cells_of_window(void) {
    const size_t columns = screen_columns(STDERR_FILENO);
    return columns > BAR_CELLS + BAR_FRAME       ? BAR_CELLS
           : columns > BAR_CELLS_MIN + BAR_FRAME ? (int)columns - 1 - BAR_FRAME
                                                 : BAR_CELLS_MIN;
}

// Updates the share of the whole run; it never decreases.
static void record(struct progress *progress, int stage, int done, int total) {
    if (stage >= progress->stages || progress->before[progress->stages] <= 0) {
        return;
    }
    INVARIANT(stage >= 0 && done >= 0 && done <= total);
    const double begin = progress->before[stage];
    const double work = begin + (progress->before[stage + 1] - begin) * done / total;
    const double share = work / progress->before[progress->stages];
    progress->done = share > progress->done ? share : progress->done;
}

void progress_show(struct progress *progress, int stage, const char *name, int done, int total) {
    if (!progress->shown || total <= 0) {
        return;
    }
    record(progress, stage, done, total);
    const uint64_t now_us = monotonic_now_us();
    const bool begins = progress->stage == NULL || strcmp(progress->stage, name) != 0;
    if (!begins && now_us - progress->last_us < REDRAW_US && done < total) {
        return;
    }
    progress->stage = name;
    progress->last_us = now_us;
    progress->cells = cells_of_window();
    const int filled = (int)(progress->cells * progress->done);
    char bar[BAR_CELLS + 1];
    memset(bar, '.', BAR_CELLS);
    memset(bar, '#', (size_t)filled);
    bar[progress->cells] = '\0';
    fprintf(stderr, "\r%-12s [%s] %3d %%", name, bar, (int)(100 * progress->done));
    fflush(stderr);
}

void progress_end(struct progress *progress) {
    if (progress->cells > 0) {
        fprintf(stderr, "\r%*s\r", progress->cells + BAR_FRAME, "");
        fflush(stderr);
        progress->cells = 0;
    }
}

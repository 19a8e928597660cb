// SPDX-License-Identifier: Apache-2.0
#include "daemon/cli/progress.h"

#include <stdbool.h>
#include <stdio.h>
#include <string.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include "core/invariant.h"
#include "daemon/base/monotonic.h"

enum {
    STAGE_TEXT = 14,  // the longest name of a stage
    PARTS = 1000,     // resolution of the bar of a whole run
    REDRAW_US = 100000,
};

size_t screen_columns(int fd) {
    struct winsize size;
    const bool known = ioctl(fd, TIOCGWINSZ, &size) == 0 && size.ws_col > 0;
    return known ? size.ws_col : SCREEN_COLUMNS;
}

int progress_draw(int text_columns, const char *what, uint64_t done, uint64_t total) {
    char bar[PROGRESS_BAR_BYTES];
    const size_t columns = screen_columns(STDERR_FILENO);
    const int width = progress_bar_draw(bar, columns, text_columns, what, done, total);
    fputs(bar, stderr);
    fflush(stderr);
    return width;
}

void progress_erase(int width) {
    char blank[PROGRESS_BAR_BYTES];
    progress_bar_erase(blank, width);
    fputs(blank, stderr);
    fflush(stderr);
}

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
    progress->width = progress_draw(STAGE_TEXT, name, (uint64_t)(PARTS * progress->done), PARTS);
}

void progress_end(struct progress *progress) {
    progress_erase(progress->width);
    progress->width = 0;
}

// SPDX-License-Identifier: Apache-2.0
#include "daemon/cli/progress.h"

#include <stdbool.h>
#include <stdio.h>
#include <string.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include "core/invariant.h"
#include "daemon/base/message.h"
#include "daemon/base/monotonic.h"

enum {
    CELLS_MAX = 40,
    FRAME = 9,        // columns of a bar besides its text and cells
    STAGE_TEXT = 14,  // the longest name of a stage
    PARTS = 1000,     // resolution of the bar of a whole run
    REDRAW_US = 100000,
};

size_t screen_columns(int fd) {
    struct winsize size;
    const bool known = ioctl(fd, TIOCGWINSZ, &size) == 0 && size.ws_col > 0;
    return known ? size.ws_col : SCREEN_COLUMNS;
}

int progress_draw(FILE *file, size_t columns, int text, const char *what, uint64_t done,
                  uint64_t total) {
    INVARIANT(total > 0 && text > 0 && text <= PROGRESS_TEXT_MAX);
    // A bar that reached the last column would wrap and be drawn repeatedly.
    const int room = columns > FRAME + 4 ? (int)columns - 1 - FRAME : 3;
    const int shown = text < room * 3 / 4 ? text : room * 3 / 4;
    const int cells = room - shown < CELLS_MAX ? room - shown : CELLS_MAX;
    const uint64_t reached = done < total ? done : total;
    char name[PROGRESS_TEXT_MAX + 1];
    char bar[CELLS_MAX + 1];
    printable_copy(what, name, sizeof name);
    memset(bar, '.', sizeof bar);
    memset(bar, '#', (size_t)(reached * (uint64_t)cells / total));
    fprintf(file, "\r%-*.*s [%.*s] %3d %%", shown, shown, name, cells, bar,
            (int)(reached * 100 / total));
    fflush(file);
    return shown + cells + FRAME;
}

void progress_erase(FILE *file, int width) {
    if (width > 0) {
        fprintf(file, "\r%*s\r", width, "");
        fflush(file);
    }
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
    progress->width = progress_draw(stderr, screen_columns(STDERR_FILENO), STAGE_TEXT, name,
                                    (uint64_t)(PARTS * progress->done), PARTS);
}

void progress_end(struct progress *progress) {
    progress_erase(stderr, progress->width);
    progress->width = 0;
}

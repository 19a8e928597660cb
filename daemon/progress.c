// SPDX-License-Identifier: Apache-2.0
#include "daemon/progress.h"

#include <stdio.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

enum { BAR_CELLS = 40, REDRAW_US = 100000 };

uint64_t progress_now_us(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint64_t)now.tv_sec * 1000000u + (uint64_t)now.tv_nsec / 1000u;
}

void progress_begin(struct progress *progress, bool quiet) {
    *progress = (struct progress){.shown = !quiet && isatty(STDERR_FILENO) == 1};
}

void progress_show(struct progress *progress, const char *stage, int done, int total) {
    if (!progress->shown || total <= 0) {
        return;
    }
    const uint64_t now_us = progress_now_us();
    const bool begins = progress->stage == NULL || strcmp(progress->stage, stage) != 0;
    if (!begins && now_us - progress->last_us < REDRAW_US && done < total) {
        return;
    }
    progress->stage = stage;
    progress->last_us = now_us;
    progress->drawn = true;
    const int filled = (int)((int64_t)BAR_CELLS * done / total);
    char bar[BAR_CELLS + 1];
    memset(bar, '.', BAR_CELLS);
    memset(bar, '#', (size_t)filled);
    bar[BAR_CELLS] = '\0';
    fprintf(stderr, "\r%-12s [%s] %3d %%", stage, bar, (int)((int64_t)100 * done / total));
    fflush(stderr);
}

void progress_end(struct progress *progress) {
    if (progress->drawn) {
        fprintf(stderr, "\r%*s\r", BAR_CELLS + 24, "");
        fflush(stderr);
        progress->drawn = false;
    }
}

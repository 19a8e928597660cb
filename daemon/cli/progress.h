// SPDX-License-Identifier: Apache-2.0
/// Progress bars on the terminal of a program: one for a whole run of several stages.
#ifndef VERGENCE_DAEMON_CLI_PROGRESS_H
#define VERGENCE_DAEMON_CLI_PROGRESS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include "console/line/progress_bar.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Current width in columns of the terminal `fd`; SCREEN_COLUMNS if unknown.
size_t screen_columns(int fd);

enum { PROGRESS_STAGES_MAX = 16 };

/// Draws a bar on standard error. Returns the columns used, for progress_erase.
int progress_draw(int text_columns, const char *what, uint64_t done, uint64_t total);

/// Erases a bar of `width` columns; 0: nothing.
void progress_erase(int width);

/// A run, shown on standard error if that is a terminal. The bar never goes back.
struct progress {
    bool shown;                              // standard error is a terminal and `quiet` was not set
    int width;                               // width of the bar to be erased; 0: none
    const char *stage;                       // stage of the bar drawn last
    uint64_t last_us;                        // time at which the bar was drawn last
    double before[PROGRESS_STAGES_MAX + 1];  // work before each stage; the last: total work
    int stages;
    double done;  // share of the whole run, 0 to 1
};

/// Begins; nothing is drawn when `quiet`.
void progress_begin(struct progress *progress, bool quiet);

/// Sets how much work the stages 0 to `stages` - 1 are, in any unit. Until then the bar is empty.
void progress_expect(struct progress *progress, const double *work, int stages);

/// Draws the progress: `done` of `total` parts of stage `stage`, called `name` (static storage). At
/// most ten times a second, and at once when a stage begins.
void progress_show(struct progress *progress, int stage, const char *name, int done, int total);

/// Erases the bar.
void progress_end(struct progress *progress);

#ifdef __cplusplus
}
#endif

#endif

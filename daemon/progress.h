// SPDX-License-Identifier: Apache-2.0
/// A progress bar on standard error, when that is a terminal.
#ifndef VERGENCE_DAEMON_PROGRESS_H
#define VERGENCE_DAEMON_PROGRESS_H

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

struct progress {
    bool shown;         // standard error is a terminal and nobody asked for quiet
    bool drawn;         // there is a bar to be wiped
    const char *stage;  // drawn last
    uint64_t last_us;   // when it was drawn last
};

/// Begins; nothing is drawn when `quiet`.
void progress_begin(struct progress *progress, bool quiet);

/// Draws the bar of a stage, at most ten times a second, and at once when a stage begins.
/// `stage` must live until the next call.
void progress_show(struct progress *progress, const char *stage, int done, int total);

/// Wipes the bar.
void progress_end(struct progress *progress);

/// Microseconds of the monotonic clock.
uint64_t progress_now_us(void);

#ifdef __cplusplus
}
#endif

#endif

// SPDX-License-Identifier: Apache-2.0
/// `zoom` with density=, fit=, distance= or sharp=: what needs the calibration of all zooms. All
/// else is the rig's own zoom.
#ifndef VERGENCE_CONSOLE_PAIR_ZOOM_QUERY_H
#define VERGENCE_CONSOLE_PAIR_ZOOM_QUERY_H

#include <stdbool.h>
#include <stddef.h>

#include "console/command.h"
#include "console/pair/calibration_match.h"
#include "core/arena.h"
#include "measure/measure_types.h"
#include "stereo/zoom/zoom_calibration.h"

#ifdef __cplusplus
extern "C" {
#endif

/// What the instrument does for a command that consists of commands of the rig, and computes.
struct command_host {
    /// Runs a command of the rig, without its answer.
    int (*give)(const struct command_call *call, const char *line);
    /// Where the instrument is now.
    void (*read_state)(const struct command_call *call, struct calibration_match_state *state);
    /// Runs a job that takes a second of a processor with floating point, with an arena of `bytes`,
    /// smaller if memory is short.
    void (*compute)(const struct command_call *call, size_t bytes,
                    void (*job)(void *cookie, struct arena *arena), void *cookie);
    /// Looks after the rig; such a job calls it again and again. It takes minutes then, so `zoom`
    /// does without. NULL: another thread looks after the rig.
    void (*serve)(const struct command_call *call);
};

/// Whether the arguments of `zoom` ask for it.
bool zoom_query_is_given(const struct command_value *values);

int zoom_query_run(const struct command_call *call, const struct command_host *host,
                   const struct zoom_calibration *calibration);

/// Completes the event of a surface: what a pair at another zoom, or a board, would make of the
/// error that all points share.
void zoom_query_expect(const struct command_call *call, const struct command_host *host,
                       const struct measure *measure, struct measure_event *event);

#ifdef __cplusplus
}
#endif

#endif

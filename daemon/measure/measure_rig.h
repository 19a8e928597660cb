// SPDX-License-Identifier: Apache-2.0
/// The rig for a measurement: what it is, where it is, and each step as commands of the console, so
/// that a recording has nothing else.
#ifndef VERGENCE_DAEMON_MEASURE_MEASURE_RIG_H
#define VERGENCE_DAEMON_MEASURE_MEASURE_RIG_H

#include "daemon/session/calibration_match.h"
#include "measure/measure_types.h"
#include "rig/rig.h"

#ifdef __cplusplus
extern "C" {
#endif

/// The instrument as it is `now`; `zoom`: its calibration of all zooms, NULL: none.
void measure_rig_instrument(const struct rig *rig, const struct calibration_match_state *now,
                            const struct zoom_calibration *zoom,
                            struct measure_instrument *instrument);

/// Where the motors are; NAN: not known.
void measure_rig_axes(const struct calibration_match_state *now, struct zoom_state *axes);

/// Of the left iris as it was read last; 0: not known.
double measure_rig_f_number(const struct rig *rig);

enum { MEASURE_RIG_LINES_MAX = 2, MEASURE_RIG_LINE_BYTES = 160 };
struct measure_rig_lines {
    int count;
    char line[MEASURE_RIG_LINES_MAX][MEASURE_RIG_LINE_BYTES];
};

/// The commands of a step, one after the other; none for a step that computes. `session` gets the
/// pairs; NULL: a recording gets them. `size_px`: of the subject, for searches.
void measure_rig_lines_of(const struct rig *rig, const struct measure_step *step,
                          const char *session, double size_px, struct measure_rig_lines *lines);

#ifdef __cplusplus
}
#endif

#endif

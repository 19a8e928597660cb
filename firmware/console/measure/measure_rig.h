// SPDX-License-Identifier: Apache-2.0
/// The rig for a measurement: what it is, where it is, and each step as commands of the console, so
/// that a recording has nothing else.
#ifndef VERGENCE_CONSOLE_MEASURE_MEASURE_RIG_H
#define VERGENCE_CONSOLE_MEASURE_MEASURE_RIG_H

#include "console/command.h"
#include "console/pair/calibration_match.h"
#include "measure/measure.h"
#include "rig/pair_frame.h"
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

/// Part of the subject, `size_px` wide on the sensor (0: the whole frame), that is too dark in a
/// left frame.
double measure_rig_dark_part(const struct pair_frame *left, const struct measure_step *step,
                             double size_px);

/// Width of the subject on the left sensor, px; 0: not known.
double measure_rig_subject_px(const struct measure *machine);

/// What the answer of `autoexpose` shows. Zeroed before.
struct measure_rig_light {
    double mean_percent;  ///< of the darker side
    bool too_dark;
};
struct command_reply measure_rig_light_reply(struct measure_rig_light *self);

/// Fills in what a search of light or focus found. `why`: of its error.
void measure_rig_read_search(const struct rig *rig, const struct measure_step *step,
                             const struct measure_rig_light *light, const char *why,
                             struct measure_event *event);

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

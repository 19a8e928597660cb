// SPDX-License-Identifier: Apache-2.0
/// The calibration of a pair from a text: of one state, which is it, or of a rig at any zoom, focus
/// and pan, from which it follows by the pair's axes.
#ifndef VERGENCE_CONSOLE_PAIR_CALIBRATION_AT_H
#define VERGENCE_CONSOLE_PAIR_CALIBRATION_AT_H

#include <stddef.h>

#include "console/pair/calibration_match.h"
#include "core/message.h"
#include "core/parallel.h"
#include "stereo/zoom/zoom_calibration.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Longest text, of either kind, and what a check of the covariance takes.
enum {
    CALIBRATION_AT_TEXT_BYTES = ZOOM_TEXT_MAX_BYTES,
    CALIBRATION_AT_MATRIX_BYTES = ZOOM_PARAMETERS_MAX * ZOOM_PARAMETERS_MAX * sizeof(double),
};

/// Sets the message of a refused calibration: `name`, then line, field and reason where `fault` has
/// them. Returns `error`.
int calibration_at_refused(const char *name, int error, const struct calibration_fault *fault,
                           struct message *message);

/// A zoom calibration from its text; `matrix` is of CALIBRATION_AT_MATRIX_BYTES. Errors of the
/// text, with `name`, line and field in the message.
int calibration_at_parse_zoom(const char *name, const char *text, size_t length,
                              const struct watch *watch, double *matrix,
                              struct zoom_calibration *zoom, struct message *message);

/// The axes of a pair as a state. ERROR_MISMATCH if an axis is not known, such as a servo that was
/// not set since bring-up.
int calibration_at_axes(const struct calibration_match_state *axes, struct zoom_state *state,
                        struct message *message);

/// The calibration of one state that a text states. `name` is the text's, for messages.
/// ERROR_MISSING: it is of all zooms; else errors of the text.
int calibration_at(const char *name, const char *text, size_t length,
                   struct calibration *calibration, struct message *message);

/// A zoom calibration for a pair with these axes. ERROR_MISMATCH: an axis is not known, or outside
/// the calibrated range.
int calibration_at_zoom(const struct zoom_calibration *zoom,
                        const struct calibration_match_state *axes, struct calibration *calibration,
                        struct message *message);

/// A zoom calibration at a state. `advice` (may be "") ends the message of an axis
/// that is outside its range.
int calibration_at_state(const struct zoom_calibration *zoom, const struct zoom_state *state,
                         const char *advice, struct calibration *calibration,
                         struct message *message);

#ifdef __cplusplus
}
#endif

#endif

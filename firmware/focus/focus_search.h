// SPDX-License-Identifier: Apache-2.0
/// Autofocus as a state machine: measurements in, steps out. It moves nothing and reads no clock;
/// rig/auto/autofocus.h carries out its steps with a motor and a camera.
///
///     struct focus_step step = focus_search_begin(&search, &options, position);
///     while (step.kind != FOCUS_STEP_END) {
///         ... carry it out; focus_search_add for each frame ...
///         step = focus_search_next(&search, &event);
///     }
///
/// Without knowledge the ring goes to the nearer end of its range and sweeps to the other while
/// frames arrive: every peak is seen, and the highest is known to be the highest. Then it passes
/// through that peak once more, from the side of approach and with all frames that come, if the
/// sweep had too few on it; approaches the peak from that side; and is judged at rest by position
/// and picture. Up to FOCUS_TRIES approaches are made. Where the peak is expected, only its
/// neighbourhood is swept; if there is none, everything. Where the noise of a shorter exposure
/// nearly hides a peak, the ring stops at several positions around it for frames of the full
/// exposure.
///
/// Sources: the variance as measure: Liu, Willis and Sui, "Stereoscopic 3D Reconstruction using
/// Motorized Zoom Lenses within an Embedded System"; success only where a real peak was seen:
/// libcamera's contrast detection (src/ipa/rpi/controller/rpi/af.cpp).
#ifndef VERGENCE_FOCUS_FOCUS_SEARCH_H
#define VERGENCE_FOCUS_FOCUS_SEARCH_H

#include "focus/focus_search_types.h"

#ifdef __cplusplus
extern "C" {
#endif

/// "focused", and what to do ("" if nothing). Static storage; `verdict` must be valid.
const char *focus_verdict_text(enum focus_verdict verdict);

/// What to do, which depends on where the peak is; "" if nothing. Static storage.
const char *focus_search_help(const struct focus_search *self);

/// What was found, in words; of a curve only, "one peak" instead of "focused". Static storage.
const char *focus_search_text(const struct focus_search *self);

/// Starts a search from a position. The options must be within their ranges.
struct focus_step focus_search_begin(struct focus_search *self,
                                     const struct focus_search_options *options, double position);

/// Adds the window of a frame of the present step. Ignored when the curve is full.
void focus_search_add(struct focus_search *self, const struct focus_sample *sample);

/// The next step after one was carried out. At FOCUS_STEP_END `result` is complete.
struct focus_step focus_search_next(struct focus_search *self, const struct focus_event *event);

#ifdef __cplusplus
}
#endif

#endif

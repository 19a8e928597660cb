// SPDX-License-Identifier: Apache-2.0
/// The decisions of a measurement, from a cold instrument to a surface: measurements in, steps out.
/// No rig, no waiting, no memory of its own.
///
///     struct measure_step step = measure_begin(&measure, &request, &instrument);
///     while (step.kind != MEASURE_STEP_END) {
///         ... carry out the step, fill in the event ...
///         step = measure_next(&measure, &event);
///     }
///     ... measure.result ...
///
/// The order: wide view; light, focus; a coarse surface, which gives the distance and the depth of
/// the subject; aim; the wide pair again, from which on pan rests; a pair at a longer zoom if that
/// helps more than the wide one; zoom; iris for the depth; focus; light; a pair, merged from
/// several exposures where parts are dark; the surface, its cameras adjusted by both pairs. A step
/// that the instrument or the request does not need is left out. After a step that failed the
/// measurement continues with less where that is honest, and `result.losses` has what it lost.
///
/// Lengths are mm, pixels are those of the whole sensor, points are in the instrument's frame
/// (stereo/zoom/zoom_calibration.h).
#ifndef VERGENCE_MEASURE_MEASURE_H
#define VERGENCE_MEASURE_MEASURE_H

#include "measure/measure_types.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Starts a measurement. The calibration must have passed zoom_calibration_validate. The first step
/// is MEASURE_STEP_END with ERROR_ARGUMENT if the request is not finite, negative or has near >
/// far, with ERROR_MISSING if a wish needs the calibration of all zooms, and with ERROR_OVERLAP if
/// the depths that are stated are in no view of both cameras.
struct measure_step measure_begin(struct measure *self, const struct measure_request *request,
                                  const struct measure_instrument *instrument);

/// Replaces what is known of the instrument: the bring-up, as a step, may have changed it.
void measure_refresh(struct measure *self, const struct measure_instrument *instrument);

/// The next step after one was carried out. At MEASURE_STEP_END `result` is complete.
struct measure_step measure_next(struct measure *self, const struct measure_event *event);

/// The step after the last one if it did not happen, for a plan: an event as it is expected. A plan
/// is measure_begin, then measure_expect and measure_next in turn; `distance_mm` is what the wide
/// view will show.
struct measure_event measure_expect(const struct measure *self, const struct measure_step *step,
                                    double distance_mm);

#ifdef __cplusplus
}
#endif

#endif

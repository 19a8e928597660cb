// SPDX-License-Identifier: Apache-2.0
// What a step that is not carried out would show.
#include <math.h>
#include <string.h>

#include "core/error.h"
#include "measure/measure.h"

static bool moves_axes(enum measure_step_kind kind) {
    return kind == MEASURE_STEP_ZOOM || kind == MEASURE_STEP_FOCUS || kind == MEASURE_STEP_AIM;
}

struct measure_event measure_expect(const struct measure *self, const struct measure_step *step,
                                    double distance_mm) {
    struct measure_event event;
    struct zoom_field field;
    double point_mm[3];
    memset(&event, 0, sizeof event);
    const bool moves = moves_axes(step->kind);
    event.axes = moves ? step->axes : self->axes;
    if (!moves && !self->pan_known) {  // bring-up leaves the servos anywhere
        event.axes.side[0].pan_rad = event.axes.side[1].pan_rad = (double)NAN;
    }
    event.f_number = step->kind == MEASURE_STEP_IRIS ? step->f_number : self->f_number;
    event.light.exposure_us = self->instrument.exposure_max_us / 4;
    event.light.gain = 1;
    event.light.reached = 1;
    event.focus_mm = distance_mm;
    event.pair.number = self->result.pair + self->other_pair + 1;
    event.surface.with_used = true;
    event.surface.depth_mm = distance_mm;
    if (step->kind != MEASURE_STEP_LOOK) {
        return event;
    }
    event.subject.left_mm[2] = distance_mm;
    event.subject.near_mm = self->near_mm > 0 ? self->near_mm : 0.95 * distance_mm;
    event.subject.far_mm = self->near_mm > 0 ? self->far_mm : 1.05 * distance_mm;
    event.subject.width_mm = self->request.wish == MEASURE_WISH_FIT ? self->request.value : 300;
    struct zoom_pair pair;
    zoom_pair_at(self->instrument.calibration->camera, &self->axes, &pair);
    for (int i = 0; i < 3; i++) {
        point_mm[i] =
            pair.side[0].position_mm[i] + pair.side[0].R_instrument_camera[3 * i + 2] * distance_mm;
    }
    if (zoom_field_at(self->instrument.calibration, &self->instrument.frames, &self->axes, point_mm,
                      &field) == ERROR_OK) {
        memcpy(event.subject.right_px, field.pixel_px[1], sizeof event.subject.right_px);
    }
    return event;
}

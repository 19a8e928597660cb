// SPDX-License-Identifier: Apache-2.0
#include "measure/measure.h"

#include <math.h>
#include <string.h>

#include "core/error.h"
#include "core/invariant.h"
#include "core/math.h"
#include "measure/measure_events.h"
#include "measure/measure_steps.h"

// ---- what comes from outside

static double clamped(double value, const struct zoom_range *range) {
    return math_clamp(value, range->min, range->max);
}

// Takes over where the motors are, within the calibrated ranges, in whose middle they are if that
// is not known.
static void take_axes(struct measure *self, const struct zoom_state *axes) {
    const struct zoom_calibration *model = self->instrument.calibration;
    if (model == NULL) {
        return;
    }
    self->pan_known = true;
    for (int side = 0; side < 2; side++) {
        const struct zoom_camera *camera = &model->camera[side];
        const struct zoom_camera_state *from = &axes->side[side];
        struct zoom_camera_state *to = &self->axes.side[side];
        const bool zoom = fabs(from->zoom_counts) < INFINITY;
        const bool focus = fabs(from->focus_counts) < INFINITY;
        const bool pan = fabs(from->pan_rad) < MATH_PI;
        to->zoom_counts = clamped(
            zoom ? from->zoom_counts : (camera->zoom.min + camera->zoom.max) / 2, &camera->zoom);
        to->focus_counts =
            clamped(focus ? from->focus_counts : (camera->focus.min + camera->focus.max) / 2,
                    &camera->focus);
        to->pan_rad = (pan ? from->pan_rad : 0) + self->pan_offset_rad[side];
        self->pan_known = self->pan_known && pan;
    }
}

static int check_request(const struct measure_request *request,
                         const struct measure_instrument *instrument) {
    const bool valued = request->wish != MEASURE_WISH_SUBJECT;
    if ((unsigned)request->wish > MEASURE_WISH_ZOOM || !measure_is_length(request->near_mm) ||
        !measure_is_length(request->far_mm) ||
        (request->far_mm > 0 && request->near_mm > request->far_mm) ||
        (valued && !(request->value > 0 && measure_is_length(request->value)))) {
        return ERROR_ARGUMENT;
    }
    const bool zooms = instrument->calibration != NULL && instrument->zoom;
    return valued && !zooms ? ERROR_MISSING : ERROR_OK;
}

// ---- the sequence

static struct measure_step end(struct measure *self, int error) {
    struct measure_step step;
    memset(&step, 0, sizeof step);
    step.kind = MEASURE_STEP_END;
    step.phase = self->phase;
    self->result.error = error;
    self->result.phase = self->phase;
    return step;
}

static double seconds_of(enum measure_phase phase) {
    static const double seconds[MEASURE_PHASES] = {
#define SECONDS(name, seconds, text) seconds,
        MEASURE_PHASE_LIST(SECONDS)
#undef SECONDS
    };
    INVARIANT((unsigned)phase < MEASURE_PHASES);
    return seconds[phase];
}

// The first step from a phase on.
static struct measure_step step_from(struct measure *self, unsigned phase) {
    struct measure_step step;
    for (; phase < MEASURE_PHASES; phase++) {
        if (phase != (unsigned)self->phase) {
            self->tries = 0;
        }
        self->phase = (enum measure_phase)phase;
        memset(&step, 0, sizeof step);
        if (measure_needs(self, self->phase) && measure_prepare(self, self->phase, &step)) {
            break;
        }
    }
    INVARIANT(phase < MEASURE_PHASES);  // the surface is always needed
    step.phase = self->phase;
    step.seconds = math_max(step.seconds, seconds_of(step.phase));
    for (unsigned later = phase + 1; later < MEASURE_PHASES; later++) {
        if (measure_needs(self, (enum measure_phase)later)) {
            step.seconds_left += seconds_of((enum measure_phase)later);
        }
    }
    return step;
}

struct measure_step measure_begin(struct measure *self, const struct measure_request *request,
                                  const struct measure_instrument *instrument) {
    memset(self, 0, sizeof *self);
    self->request = *request;
    self->instrument = *instrument;
    self->result.common_mm = -1;
    const int error = check_request(request, instrument);
    if (error != ERROR_OK) {
        return end(self, error);
    }
    struct zoom_state unknown;
    memset(&unknown, 0, sizeof unknown);
    for (int side = 0; side < 2; side++) {
        unknown.side[side].zoom_counts = unknown.side[side].focus_counts =
            unknown.side[side].pan_rad = NAN;
    }
    take_axes(self, instrument->ready ? &instrument->axes : &unknown);
    if (request->near_mm > 0 && request->far_mm > 0) {
        self->near_mm = request->near_mm;
        self->far_mm = request->far_mm;
    }
    return self->near_mm > 0 && measure_may_zoom(self) && !measure_sees_stated(self)
               ? end(self, ERROR_OVERLAP)
               : step_from(self, 0);
}

void measure_refresh(struct measure *self, const struct measure_instrument *instrument) {
    self->instrument = *instrument;
}

static bool is_result_pair(enum measure_phase phase) {
    return phase == MEASURE_PAIR || phase == MEASURE_MERGED;
}

// The instrument stopped: a pair that was taken needs it no longer.
static struct measure_step step_after_loss(struct measure *self,
                                           const struct measure_event *event) {
    if (event->error == ERROR_OK && is_result_pair(self->phase)) {
        (void)measure_take(self, event);
    }
    if (self->result.pair == 0) {
        return end(self, event->error != ERROR_OK ? event->error : ERROR_NOT_READY);
    }
    measure_lose(self, MEASURE_LOSS_STOPPED);
    return step_from(self, MEASURE_SURFACE);
}

static bool is_computed(enum measure_phase phase) {
    return phase == MEASURE_WIDE_SURFACE || phase == MEASURE_AIMED_SURFACE ||
           phase == MEASURE_SURFACE;
}

struct measure_step measure_next(struct measure *self, const struct measure_event *event) {
    const enum measure_phase phase = self->phase;
    INVARIANT(event != NULL && (unsigned)phase < MEASURE_PHASES);
    if (event->error == ERROR_CANCELLED) {
        return end(self, ERROR_CANCELLED);
    }
    self->jammed = self->jammed || event->error == ERROR_JAMMED;
    if (event->lost && !is_computed(phase)) {
        return step_after_loss(self, event);
    }
    if (!is_computed(phase)) {
        self->instrument.ready = true;
        if (phase == MEASURE_AHEAD || phase == MEASURE_AIM) {
            memset(self->pan_offset_rad, 0, sizeof self->pan_offset_rad);  // they rest elsewhere
        }
        take_axes(self, &event->axes);
    }
    switch (measure_take(self, event)) {
        case MEASURE_FAILED:
            return end(self, event->error != ERROR_OK ? event->error : ERROR_NO_SURFACE);
        case MEASURE_REPEAT:
            return step_from(self, self->phase);
        case MEASURE_DONE:
            break;
    }
    return phase == MEASURE_SURFACE ? end(self, ERROR_OK) : step_from(self, phase + 1U);
}

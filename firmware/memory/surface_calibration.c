// SPDX-License-Identifier: Apache-2.0
#include "memory/surface_calibration.h"

#include <string.h>

#include "console/command_text.h"
#include "console/pair/calibration_at.h"
#include "console/pair/calibration_fit.h"
#include "core/error.h"
#include "memory/calibration.h"

static void match_pair(const struct rig *rig, const struct pair *pair,
                       struct calibration_match_state *state) {
    const struct pair_instrument instrument = calibration_match_instrument(&rig->profile);
    calibration_match_pair(rig->profile.name, &instrument, pair, state);
}

/// The calibration of the pair's state, unless the pair was taken with another one.
static int choose(const struct surface_calibration_request *request,
                  struct surface_calibration *self, struct message *message) {
    match_pair(request->rig, request->pair, &self->state);
    const int error = memory_calibration_for(&self->state, &self->calibration, message);
    if (error == ERROR_OK) {
        self->axes_compared =
            !calibration_match_is_partial(&self->calibration, &self->state.origin);
    }
    if (error != ERROR_MISMATCH || !request->accept_mismatch) {
        return error;
    }
    self->mismatch = *message;
    return ERROR_OK;
}

static int fit(const struct pair *pair, struct calibration *calibration, struct message *message) {
    bool cut = false;
    for (int side = 0; side < RIG_SIDES; side++) {
        const enum calibration_fit found =
            calibration_fit_side(calibration, side, &pair->frame[side]);
        if (found == CALIBRATION_OTHER) {
            return command_text_message(
                message, ERROR_SIZE_MISMATCH,
                "the calibration is for images of another size (set \"window\" to it)");
        }
        cut |= found == CALIBRATION_CUT;
    }
    const int error = cut ? calibration_round(calibration) : ERROR_OK;
    return error == ERROR_OK && calibration_validate(calibration, NULL) == ERROR_OK
               ? ERROR_OK
               : command_text_message(message, ERROR_SIZE_MISMATCH,
                                      "the calibration cannot be cut to the frames' part of the "
                                      "sensor (choose a larger window)");
}

/// Corrects it by what the pictures show.
static int adjust(const struct surface_calibration_request *request,
                  const struct zoom_calibration *zoom, struct arena *arena,
                  struct surface_calibration *self, struct message *message) {
    const struct pair *const pairs[2] = {request->pair, request->with_pair};
    const int count = pairs[1] != NULL ? 2 : 1;
    const struct pair_adjust_scene scene = {.near_mm = request->near_mm, .watch = request->watch};
    struct zoom_state states[2];
    for (int i = 0; i < count; i++) {
        struct calibration_match_state axes;
        match_pair(request->rig, pairs[i], &axes);
        const int error = calibration_at_axes(&axes, &states[i], message);
        if (error != ERROR_OK) {
            return error;
        }
    }
    self->adjusted = true;
    return pair_adjust(zoom, pairs, states, count, &scene, arena, &self->calibration, &self->report,
                       message);
}

int surface_calibration_make(const struct surface_calibration_request *request, struct arena *arena,
                             struct surface_calibration *self, struct message *message) {
    const struct zoom_calibration *zoom = memory_calibration_zoom();
    memset(self, 0, sizeof *self);
    const int error = choose(request, self, message);
    if (error != ERROR_OK) {
        return error;
    }
    return request->adjust && zoom != NULL ? adjust(request, zoom, arena, self, message)
                                           : fit(request->pair, &self->calibration, message);
}

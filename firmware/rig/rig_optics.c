// SPDX-License-Identifier: Apache-2.0
#include "rig/rig_optics.h"

#include <math.h>

#include "core/error.h"
#include "core/invariant.h"
#include "core/math.h"
#include "rig/base/rig_clock.h"
#include "rig/lens_mover.h"

enum {
    Q4 = 16,
    // The potentiometer's drift since the table was learned, in counts.
    DRIFT_COUNTS = 3,
    PREDICTION_SIGMAS = 3,
    BOUNDS_SIGMAS = 2,
};

#define UM_PER_MM 1000.0
#define NM_PER_MM 1e6
#define F_NUMBER_ONE 1000.0
// A focus is found no better than this blur.
#define FOUND_PX 0.3
// No focus is nearer than this part of the nominal one; rig_profile_check keeps it beyond two focal
// lengths.
#define NEAREST_PART 0.75
// No lens opens further.
#define LEAST_F_NUMBER 0.5

const char *rig_optics_missing(const struct rig *self, enum rig_optics_relation relation) {
    const struct rig_profile_optics *optics = &self->profile.optics;
    const bool zoom = optics->focal_length_wide_um > 0, focus = optics->focus_nearest_um > 0;
    const bool iris = optics->f_number_open > 0;
    switch (relation) {
        case RIG_OPTICS_FOCAL_LENGTH:
            return zoom ? NULL : "rig.focal_length_wide and rig.focal_length_tele";
        case RIG_OPTICS_DISTANCE:
            return focus ? NULL : "rig.focus_nearest";
        case RIG_OPTICS_F_NUMBER:
            return iris ? NULL : "rig.f_number_open and rig.f_number_closed";
        case RIG_OPTICS_BLUR:
            return zoom && focus && iris && optics->pixel_nm > 0
                       ? NULL
                       : "rig.focal_length_wide, rig.focal_length_tele, rig.focus_nearest, "
                         "rig.f_number_open, rig.f_number_closed and rig.pixel_pitch";
    }
    INVARIANT(false);
    return NULL;
}

static struct lens_ring ring_of(const struct rig *self, enum lens_axis axis) {
    const struct lens_axis_settings *settings = &self->profile.lens.axis[axis];
    return (struct lens_ring){settings->min, settings->max};
}

static struct lens_optics optics_of(const struct rig *self) {
    const struct rig_profile_optics *optics = &self->profile.optics;
    return (struct lens_optics){
        .zoom = ring_of(self, LENS_ZOOM),
        .focus = ring_of(self, LENS_FOCUS),
        .iris = ring_of(self, LENS_IRIS),
        .focal_length_wide_mm = optics->focal_length_wide_um / UM_PER_MM,
        .focal_length_tele_mm = optics->focal_length_tele_um / UM_PER_MM,
        .focus_nearest_mm = optics->focus_nearest_um / UM_PER_MM,
        .f_number_open = optics->f_number_open / F_NUMBER_ONE,
        .f_number_closed = optics->f_number_closed / F_NUMBER_ONE,
    };
}

// Whether a side has an axis, and its relation is known.
static int check(const struct rig *self, unsigned side, enum lens_axis axis,
                 enum rig_optics_relation relation) {
    if (!rig_has_axis(&self->profile, side, axis)) {
        return ERROR_NOT_CONNECTED;
    }
    return rig_optics_missing(self, relation) == NULL ? ERROR_OK : ERROR_MISSING;
}

// Readings may lie a little outside of the range.
static int32_t within(const struct lens_ring *ring, int32_t position) {
    return math_clamp_int(position, ring->min, ring->max);
}

int rig_optics_position(const struct rig *self, unsigned side, enum lens_axis axis,
                        int32_t *position) {
    if (!rig_has_axis(&self->profile, side, axis)) {
        return ERROR_NOT_CONNECTED;
    }
    const struct rig_lens *lens = &self->camera[side].lens;
    const int32_t present = lens->commanded[axis] != INT32_MIN
                                ? lens->commanded[axis]
                                : lens_mean_counts(&lens->measured[axis]);
    if (present == INT32_MIN) {
        return ERROR_NOT_READY;
    }
    const struct lens_ring ring = ring_of(self, axis);
    *position = within(&ring, present);
    return ERROR_OK;
}

// The nearest position, which must be in the ring's range but for rounding.
static int position_in(const struct lens_ring *ring, double exact, int32_t *position) {
    if (!(exact > ring->min - 0.5 && exact < ring->max + 0.5)) {
        return ERROR_RANGE;
    }
    *position = (int32_t)(exact + 0.5);
    INVARIANT(*position >= ring->min && *position <= ring->max);
    return ERROR_OK;
}

// ---- zoom

int rig_optics_focal_length(const struct rig *self, unsigned side, int32_t zoom, double *focal_mm) {
    const int error = check(self, side, LENS_ZOOM, RIG_OPTICS_FOCAL_LENGTH);
    if (error == ERROR_OK) {
        const struct lens_optics optics = optics_of(self);
        *focal_mm = lens_optics_focal_length(&optics, within(&optics.zoom, zoom));
    }
    return error;
}

int rig_optics_zoom_for(const struct rig *self, unsigned side, double focal_mm, int32_t *zoom) {
    const int error = check(self, side, LENS_ZOOM, RIG_OPTICS_FOCAL_LENGTH);
    if (error != ERROR_OK) {
        return error;
    }
    const struct lens_optics optics = optics_of(self);
    return position_in(&optics.zoom, lens_optics_zoom_for(&optics, focal_mm), zoom);
}

int rig_optics_wide(const struct rig *self, unsigned side, double *focal_mm) {
    return rig_optics_focal_length(self, side, self->profile.lens.axis[LENS_ZOOM].min, focal_mm);
}

// ---- focus

// What was learned about the focus at the present zoom; 0 if the zoom is not known.
static void deviation_of(const struct rig *self, unsigned side, double *deviation, double *sigma) {
    const struct lens_ring ring = ring_of(self, LENS_ZOOM);
    int32_t zoom = ring.min;
    rig_optics_position(self, side, LENS_ZOOM, &zoom);
    lens_learned_deviation(&self->camera[side].lens.learned.focus, zoom, ring.max - ring.min,
                           deviation, sigma);
    *deviation /= Q4;
    *sigma /= Q4;
}

int rig_optics_distance_at(const struct rig *self, unsigned side, int32_t focus,
                           double *distance_mm) {
    const int error = check(self, side, LENS_FOCUS, RIG_OPTICS_DISTANCE);
    if (error == ERROR_OK) {
        const struct lens_optics optics = optics_of(self);
        double deviation = 0, sigma = 0;
        deviation_of(self, side, &deviation, &sigma);
        // The deviation may lead beyond the near end, but not to where the thin lens ends.
        const double distance =
            lens_optics_distance(&optics, within(&optics.focus, focus) - deviation);
        *distance_mm = math_max(distance, optics.focus_nearest_mm * NEAREST_PART);
    }
    return error;
}

int rig_optics_distance_bounds(const struct rig *self, unsigned side, double focus,
                               double sigma_counts, double *near_mm, double *far_mm) {
    const int error = check(self, side, LENS_FOCUS, RIG_OPTICS_DISTANCE);
    if (error == ERROR_OK) {
        const struct lens_optics optics = optics_of(self);
        // The table's entries are known relative to the first one only.
        const double prior = (double)LENS_PRIOR_Q4 / Q4;
        const double reach = BOUNDS_SIGMAS * sqrt(sigma_counts * sigma_counts + prior * prior);
        double deviation = 0, sigma = 0;
        deviation_of(self, side, &deviation, &sigma);
        *near_mm = math_max(lens_optics_distance(&optics, focus - deviation + reach),
                            optics.focus_nearest_mm * NEAREST_PART);
        *far_mm = math_max(lens_optics_distance(&optics, focus - deviation - reach), *near_mm);
    }
    return error;
}

int rig_optics_focus_for(const struct rig *self, unsigned side, double distance_mm,
                         int32_t *focus) {
    const int error = check(self, side, LENS_FOCUS, RIG_OPTICS_DISTANCE);
    if (error != ERROR_OK) {
        return error;
    }
    if (!(distance_mm > 0)) {
        return ERROR_RANGE;
    }
    const struct lens_optics optics = optics_of(self);
    double deviation = 0, sigma = 0;
    deviation_of(self, side, &deviation, &sigma);
    double exact = lens_optics_focus_for(&optics, distance_mm) + deviation;
    // Infinity may be just outside: the nearest position then is the best there is.
    exact = exact < optics.focus.min ? optics.focus.min : exact;
    return position_in(&optics.focus, exact, focus);
}

// ---- iris

int rig_optics_f_number(const struct rig *self, unsigned side, int32_t iris, double *f_number) {
    const int error = check(self, side, LENS_IRIS, RIG_OPTICS_F_NUMBER);
    if (error == ERROR_OK) {
        const struct lens_optics optics = optics_of(self);
        double ratio = 0;
        *f_number = lens_table_value(&self->camera[side].lens.learned.iris, iris, &ratio)
                        ? optics.f_number_open * ratio / LENS_RATIO_ONE
                        : lens_optics_f_number(&optics, iris);
    }
    return error;
}

int rig_optics_iris_for(const struct rig *self, unsigned side, double f_number, int32_t *iris) {
    const int error = check(self, side, LENS_IRIS, RIG_OPTICS_F_NUMBER);
    if (error != ERROR_OK) {
        return error;
    }
    if (!(f_number > 0)) {
        return ERROR_RANGE;
    }
    const struct lens_optics optics = optics_of(self);
    const struct lens_table *learned = &self->camera[side].lens.learned.iris;
    double exact = 0;
    if (learned->count == 0) {
        exact = lens_optics_iris_for(&optics, f_number);
    } else if (!lens_table_position(learned, f_number / optics.f_number_open * LENS_RATIO_ONE,
                                    &exact)) {
        return ERROR_RANGE;
    }
    return position_in(&optics.iris, exact, iris);
}

// ---- blur

static double pixel_mm(const struct rig *self) {
    return self->profile.optics.pixel_nm / NM_PER_MM;
}

// The lens at its present positions.
static int state_of(const struct rig *self, unsigned side, struct lens_state *state) {
    int32_t zoom = 0, focus = 0, iris = 0;
    struct lens_state found = {.f_number = self->profile.optics.f_number_open / F_NUMBER_ONE};
    int error = check(self, side, LENS_FOCUS, RIG_OPTICS_BLUR);
    error = error == ERROR_OK ? rig_optics_position(self, side, LENS_ZOOM, &zoom) : error;
    error = error == ERROR_OK ? rig_optics_position(self, side, LENS_FOCUS, &focus) : error;
    if (error == ERROR_OK && rig_has_axis(&self->profile, side, LENS_IRIS)) {
        error = rig_optics_position(self, side, LENS_IRIS, &iris);
        error = error == ERROR_OK ? rig_optics_f_number(self, side, iris, &found.f_number) : error;
    }
    error = error == ERROR_OK ? rig_optics_focal_length(self, side, zoom, &found.focal_length_mm)
                              : error;
    error = error == ERROR_OK ? rig_optics_distance_at(self, side, focus, &found.focus_distance_mm)
                              : error;
    if (error == ERROR_OK) {
        *state = found;
    }
    return error;
}

int rig_optics_blur_per_count(const struct rig *self, unsigned side, double *px) {
    struct lens_state state;
    const int error = state_of(self, side, &state);
    if (error == ERROR_OK) {
        const struct lens_optics optics = optics_of(self);
        *px = lens_blur_per_count(&optics, &state) / pixel_mm(self);
    }
    return error;
}

int rig_optics_blur_at(const struct rig *self, unsigned side, double distance_mm, double *px,
                       double *diffraction_px) {
    struct lens_state state;
    const int error = state_of(self, side, &state);
    if (error == ERROR_OK) {
        *px = lens_blur(&state, distance_mm) / pixel_mm(self);
        *diffraction_px = lens_diffraction(state.f_number) / pixel_mm(self);
    }
    return error;
}

int rig_optics_sharp_range(const struct rig *self, unsigned side, double distance_mm,
                           double blur_px, double *near_mm, double *far_mm) {
    struct lens_state state;
    const int error = state_of(self, side, &state);
    if (error == ERROR_OK) {
        state.focus_distance_mm = distance_mm;
        lens_sharp_range(&state, blur_px * pixel_mm(self), near_mm, far_mm);
    }
    return error;
}

// ---- iris for depth of field

int rig_optics_iris_ends(const struct rig *self, unsigned side, double *open, double *closed) {
    const struct lens_ring ring = ring_of(self, LENS_IRIS);
    double ends[2] = {0, 0};
    int error = rig_optics_f_number(self, side, ring.max, &ends[0]);
    error = error == ERROR_OK ? rig_optics_f_number(self, side, ring.min, &ends[1]) : error;
    // A table that was typed may have any values.
    *open = math_max(LEAST_F_NUMBER, math_min(ends[0], ends[1]));
    *closed = math_max(*open, math_max(ends[0], ends[1]));
    return error;
}

// What a call for a range needs: the state, and the f-numbers at the ends of the iris.
static int range_state(const struct rig *self, unsigned side, struct lens_state *state,
                       double *open, double *closed) {
    int error = check(self, side, LENS_IRIS, RIG_OPTICS_BLUR);
    if (error != ERROR_OK) {
        return error;
    }
    error = state_of(self, side, state);
    if (error != ERROR_OK) {
        return error;
    }
    return rig_optics_iris_ends(self, side, open, closed);
}

// The iris for an f-number. As far as `needed`: rounded to the closed side.
static int round_iris(const struct rig *self, unsigned side, double f_number, bool needed,
                      struct rig_optics_iris *found) {
    int error = rig_optics_iris_for(self, side, f_number, &found->iris);
    error =
        error == ERROR_OK ? rig_optics_f_number(self, side, found->iris, &found->f_number) : error;
    if (error == ERROR_OK && needed && found->f_number < f_number &&
        found->iris > ring_of(self, LENS_IRIS).min) {
        found->iris--;
        error = rig_optics_f_number(self, side, found->iris, &found->f_number);
    }
    return error;
}

int rig_optics_iris_for_range(const struct rig *self, unsigned side, double near_mm, double far_mm,
                              struct rig_optics_iris *found) {
    struct lens_state state;
    struct rig_optics_iris result = {.iris = 0};
    double open = 0, closed = 0;
    int error = range_state(self, side, &state, &open, &closed);
    if (error != ERROR_OK) {
        return error;
    }
    if (!(near_mm > 2 * state.focal_length_mm && near_mm <= far_mm)) {
        return ERROR_RANGE;
    }
    const struct depth_iris_limits limits = {open, closed, (double)INFINITY, 0};
    const struct depth_iris exact =
        depth_iris_for(&state, near_mm, far_mm, RIG_OPTICS_SHARP_PX * pixel_mm(self), &limits);
    result.limit = exact.limit;
    error = round_iris(self, side, exact.f_number, exact.limit == DEPTH_IRIS_NEEDED, &result);
    result.focus_mm = lens_range_middle(near_mm, far_mm);
    if (error != ERROR_OK) {
        return error;
    }
    error = rig_optics_focus_for(self, side, result.focus_mm, &result.focus);
    if (error != ERROR_OK) {
        return error;
    }
    state.f_number = result.f_number;
    result.blur_px =
        math_max(lens_blur(&state, near_mm), lens_blur(&state, far_mm)) / pixel_mm(self);
    result.diffraction_px = lens_diffraction(state.f_number) / pixel_mm(self);
    state.focus_distance_mm = result.focus_mm;
    result.best_px = lens_blur(&state, near_mm) / pixel_mm(self);
    *found = result;
    return ERROR_OK;
}

int rig_optics_iris_for_reach(const struct rig *self, unsigned side, double distance_mm,
                              double reach_mm, int32_t *iris, double *diffraction_px) {
    struct lens_state state;
    double open = 0, closed = 0;
    int error = range_state(self, side, &state, &open, &closed);
    if (error != ERROR_OK) {
        return error;
    }
    if (!(distance_mm - reach_mm > 2 * state.focal_length_mm) || !(reach_mm > 0)) {
        return ERROR_RANGE;
    }
    state.focus_distance_mm = distance_mm;
    const double f_number =
        lens_f_number_for_blur(&state, distance_mm - reach_mm, distance_mm + reach_mm,
                               RIG_OPTICS_SHARP_PX * pixel_mm(self));
    if (f_number > closed) {
        return ERROR_RANGE;
    }
    struct rig_optics_iris found;
    error = round_iris(self, side, math_max(f_number, open), true, &found);
    if (error == ERROR_OK) {
        *iris = found.iris;
        *diffraction_px = lens_diffraction(found.f_number) / pixel_mm(self);
    }
    return error;
}

// ---- the zoom-to-focus table

// Where a nominal lens's focus position is this lens's, and within how much.
static void predict(const struct rig *self, unsigned side, double object, double object_sigma,
                    int32_t *position, int32_t *half_range) {
    const struct lens_axis_settings *settings = &self->profile.lens.axis[LENS_FOCUS];
    double deviation = 0, sigma = 0;
    deviation_of(self, side, &deviation, &sigma);
    const double exact = math_max(settings->min, math_min(settings->max, object + deviation));
    const int32_t middle = (int32_t)(exact + 0.5);
    const double spread = PREDICTION_SIGMAS * sqrt(sigma * sigma + object_sigma * object_sigma);
    *half_range = (int32_t)(spread + 0.999) + DRIFT_COUNTS +
                  (lens_move_has_room(settings, middle) ? 0 : settings->backlash_counts);
    *position = middle;
    INVARIANT(*half_range > 0);
}

int rig_optics_focus_prediction(const struct rig *self, unsigned side, int32_t *position,
                                int32_t *half_range) {
    if (!rig_has_axis(&self->profile, side, LENS_FOCUS)) {
        return ERROR_NOT_CONNECTED;
    }
    if (!self->object.known) {
        return ERROR_MISSING;
    }
    predict(self, side, self->object.position_q4 / (double)Q4, self->object.sigma_q4 / (double)Q4,
            position, half_range);
    return ERROR_OK;
}

int rig_optics_focus_from_other(const struct rig *self, unsigned side, double other,
                                double sigma_counts, int32_t *position, int32_t *half_range) {
    INVARIANT(side < RIG_SIDES);
    const unsigned from = RIG_SIDES - 1 - side;
    double deviation = 0, sigma = 0;
    if (!rig_has_axis(&self->profile, side, LENS_FOCUS) ||
        !rig_has_axis(&self->profile, from, LENS_FOCUS)) {
        return ERROR_NOT_CONNECTED;
    }
    deviation_of(self, from, &deviation, &sigma);
    // The first lens of all is nominal by definition.
    if (!self->object.known && self->camera[from].lens.learned.focus.count == 0) {
        sigma = 0;
    }
    predict(self, side, other - deviation, sqrt(sigma_counts * sigma_counts + sigma * sigma),
            position, half_range);
    return ERROR_OK;
}

int rig_optics_learn_focus(struct rig *self, unsigned side, int32_t position_q4, uint16_t sigma_q4,
                           double distance_mm) {
    int32_t zoom = 0, distance_q4 = INT32_MIN;
    const int error = rig_optics_position(self, side, LENS_ZOOM, &zoom);
    if (error != ERROR_OK || !rig_has_axis(&self->profile, side, LENS_FOCUS)) {
        return error != ERROR_OK ? error : ERROR_NOT_CONNECTED;
    }
    if (distance_mm > 0 && rig_optics_missing(self, RIG_OPTICS_DISTANCE) == NULL) {
        const struct lens_optics optics = optics_of(self);
        distance_q4 = (int32_t)(lens_optics_focus_for(&optics, distance_mm) * Q4 + 0.5);
    }
    const struct lens_ring ring = ring_of(self, LENS_ZOOM);
    double px = 0;
    const double sigma = rig_optics_blur_per_count(self, side, &px) == ERROR_OK && px > 0
                             ? math_max(sigma_q4, FOUND_PX / px * Q4)
                             : sigma_q4;
    lens_learned_focus(&self->camera[side].lens.learned.focus, (uint8_t)side, &self->object, zoom,
                       ring.max - ring.min, position_q4, (uint16_t)math_min(sigma, UINT16_MAX),
                       distance_q4);
    self->camera[side].lens.focused_q4 = position_q4;
    self->camera[side].lens.focused_us = rig_now_us(self);
    return ERROR_OK;
}

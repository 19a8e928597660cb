// SPDX-License-Identifier: Apache-2.0
#include "measure/measure_steps.h"

#include <math.h>
#include <string.h>

#include "core/error.h"
#include "core/invariant.h"
#include "core/math.h"
#include "measure/measure_tuning.h"
#include "stereo/zoom/zoom_aim.h"

// ---- the steps

void measure_explain(struct measure_step *step, enum measure_why why, double first, double second,
                     double third, double fourth) {
    step->reason = (struct measure_reason){why, {first, second, third, fourth}};
}

// Where the cameras have the subject, for searches.
static void place(const struct measure *self, struct measure_step *step) {
    struct zoom_field field;
    step->has_place = self->subject_known && measure_may_move(self) &&
                      zoom_field_at(measure_model(self), &self->instrument.frames, &self->axes,
                                    self->point_mm, &field) == ERROR_OK;
    if (step->has_place) {
        memcpy(step->place_px, field.pixel_px, sizeof step->place_px);
    }
}

static bool prepare_bringup(struct measure *self, struct measure_step *step) {
    (void)self;
    step->kind = MEASURE_STEP_BRINGUP;
    measure_explain(step, MEASURE_WHY_NOT_READY, 0, 0, 0, 0);
    return true;
}

static bool prepare_ahead(struct measure *self, struct measure_step *step) {
    step->kind = MEASURE_STEP_AIM;
    step->axes = self->axes;  // straight ahead
    measure_explain(step, MEASURE_WHY_AHEAD, measure_look_ahead(self, &step->axes), 0, 0, 0);
    return true;
}

// To a factor of the smallest focal length, as far as the lenses reach.
static bool go_to_factor(struct measure *self, double factor, struct measure_step *step) {
    struct zoom_state state = self->axes;
    struct zoom_range reach;
    double point_mm[3];
    struct zoom_wish wish = {ZOOM_WISH_FACTOR, factor};
    measure_point(self, point_mm);
    if (zoom_for_wish(measure_model(self), &self->instrument.frames, &wish, point_mm, &state,
                      &reach) != ERROR_OK) {
        wish.value = math_min(reach.max, factor);
        if (zoom_for_wish(measure_model(self), &self->instrument.frames, &wish, point_mm, &state,
                          &reach) != ERROR_OK) {
            return false;
        }
    }
    step->kind = MEASURE_STEP_ZOOM;
    step->axes = state;
    return true;
}

static bool prepare_wide_zoom(struct measure *self, struct measure_step *step) {
    measure_explain(step, MEASURE_WHY_FIND, 0, 0, 0, 0);
    return go_to_factor(self, 1, step);
}

static bool prepare_wide_iris(struct measure *self, struct measure_step *step) {
    step->kind = MEASURE_STEP_IRIS;
    step->f_number = MEASURE_WIDE_F_NUMBER;
    if (self->instrument.f_number_open > 0) {
        step->f_number =
            math_max(self->instrument.f_number_open,
                     math_min(self->instrument.f_number_closed, MEASURE_WIDE_F_NUMBER));
    }
    measure_explain(step, MEASURE_WHY_WIDE_SHARP, step->f_number, 0, 0, 0);
    return true;
}

static bool prepare_light(struct measure *self, struct measure_step *step) {
    step->kind = MEASURE_STEP_LIGHT;
    place(self, step);
    const bool for_depth = self->phase == MEASURE_LIGHT && measure_may_move(self) &&
                           self->near_mm > 0 && !self->iris_opens;
    step->keep_iris = for_depth || !measure_may_move(self);
    enum measure_why why = self->iris_opens ? MEASURE_WHY_LIGHT_OPENS_IRIS : MEASURE_WHY_SEE;
    if (for_depth) {
        why = MEASURE_WHY_LIGHT_KEEPS_IRIS;
    }
    measure_explain(step, why, self->f_number, 0, 0, 0);
    return true;
}

// By the calibration: at the widest zoom that is enough for a coarse surface. If it was not, by a
// search, which also gives a distance.
static bool prepare_wide_focus(struct measure *self, struct measure_step *step) {
    double point_mm[3];
    if (self->wide_searched) {
        step->kind = MEASURE_STEP_AUTOFOCUS;
        place(self, step);
        measure_explain(step, MEASURE_WHY_FOCUS_LOST, 0, 0, 0, 0);
        return true;
    }
    const double stated_mm = (self->request.near_mm + self->request.far_mm) / 2;
    const double distance_mm = stated_mm > 0 ? stated_mm : MEASURE_ANY_DISTANCE_MM;
    zoom_point_ahead(measure_model(self), distance_mm, 0, point_mm);
    step->kind = MEASURE_STEP_FOCUS;
    step->axes = self->axes;
    measure_explain(step, MEASURE_WHY_FOCUS_WIDE, distance_mm, 0, 0, 0);
    (void)zoom_focus_at(measure_model(self), point_mm, &step->axes);  // as near as it can
    return true;
}

static bool prepare_focus(struct measure *self, struct measure_step *step) {
    step->kind = MEASURE_STEP_AUTOFOCUS;
    place(self, step);
    measure_explain(step, self->distance_mm > 0 ? MEASURE_WHY_FOCUS_NEAR : MEASURE_WHY_FOCUS_COLD,
                    self->distance_mm, 0, 0, 0);
    return true;
}

static enum measure_why choose_pair_reason(const struct measure *self) {
    if (self->tries > 0) {
        return MEASURE_WHY_AGAIN;
    }
    switch (self->phase) {
        case MEASURE_WIDE_PAIR:
            return MEASURE_WHY_DISTANCE;
        case MEASURE_AIMED_PAIR:
            return MEASURE_WHY_PAN_RESTS;
        case MEASURE_OTHER_PAIR:
            return MEASURE_WHY_OTHER_ZOOM;
        default:
            return MEASURE_WHY_TAKE;
    }
}

static bool prepare_pair(struct measure *self, struct measure_step *step) {
    step->kind = MEASURE_STEP_PAIR;
    place(self, step);
    measure_explain(step, choose_pair_reason(self), self->other_factor, 0, 0, 0);
    return true;
}

static bool prepare_look(struct measure *self, struct measure_step *step) {
    step->kind = MEASURE_STEP_LOOK;
    step->near_mm = self->request.near_mm;
    step->far_mm = self->request.far_mm;
    measure_explain(step, MEASURE_WHY_DISTANCE, 0, 0, 0, 0);
    return true;
}

static bool prepare_aim(struct measure *self, struct measure_step *step) {
    struct zoom_state state = self->axes;
    double middle_mm[3];
    if (!self->subject_known ||
        zoom_aim(measure_model(self), self->point_mm, &state, NULL) != ERROR_OK) {
        measure_lose(self, MEASURE_LOSS_NOT_AIMED);
        return false;
    }
    zoom_point_ahead(measure_model(self), self->distance_mm, 0, middle_mm);
    step->kind = MEASURE_STEP_AIM;
    step->axes = state;
    if (self->aims == 0) {
        measure_explain(step, MEASURE_WHY_AIM, self->distance_mm, self->point_mm[0] - middle_mm[0],
                        0, 0);
    } else {
        measure_explain(step, MEASURE_WHY_AIM_AGAIN, 100 * measure_centred(self), 0, 0, 0);
    }
    return true;
}

static bool prepare_zoom(struct measure *self, struct measure_step *step) {
    struct zoom_field field = {.width_mm = 0};
    struct zoom_wish wish;
    double point_mm[3];
    bool nearest = false;
    if (!measure_wish_of(self, &wish)) {
        return false;  // its size is not known: as wide as it is
    }
    if (!measure_state_for(self, &step->axes, &nearest)) {
        measure_lose(self, MEASURE_LOSS_OUT_OF_REACH);
        return false;
    }
    measure_point(self, point_mm);
    step->kind = MEASURE_STEP_ZOOM;
    (void)zoom_field_at(measure_model(self), &self->instrument.frames, &step->axes, point_mm,
                        &field);  // zeros: not seen
    const double distance_mm = field.distance_mm[0];
    if (nearest) {
        measure_lose(self, MEASURE_LOSS_OUT_OF_REACH);
        measure_explain(step, MEASURE_WHY_ZOOM_NEAREST, field.width_mm, distance_mm,
                        field.density_per_mm2, 0);
    } else if (wish.kind == ZOOM_WISH_WIDTH) {
        measure_explain(step, MEASURE_WHY_ZOOM_FIT, field.width_mm, distance_mm,
                        field.density_per_mm2, field.depth_per_px_mm);
    } else if (wish.kind == ZOOM_WISH_DENSITY) {
        measure_explain(step, MEASURE_WHY_ZOOM_DENSITY, field.density_per_mm2, distance_mm,
                        field.width_mm, field.depth_per_px_mm);
    } else {
        measure_explain(step, MEASURE_WHY_ZOOM_FACTOR, wish.value, field.width_mm,
                        field.density_per_mm2, 0);
    }
    return true;
}

// ---- more exposures, the other zoom, the surface

static bool prepare_merged(struct measure *self, struct measure_step *step) {
    static const double s_per_us = 1e-6;
    const double exposure_s = self->light_exposure_us * s_per_us;
    step->kind = MEASURE_STEP_PAIR;
    if (self->instrument.brackets && self->dark_part > MEASURE_DARK_PART_MIN) {
        step->bracket = MEASURE_BRACKET_FRAMES;
        step->seconds = MEASURE_BRACKET_EXPOSURES * exposure_s;
        measure_explain(step, MEASURE_WHY_BRACKET, 100 * self->dark_part, MEASURE_BRACKET_FRAMES, 0,
                        0);
    } else {
        step->average = MEASURE_AVERAGE_FRAMES;
        step->seconds = MEASURE_AVERAGE_EXPOSURES * exposure_s;
        measure_explain(step, MEASURE_WHY_AVERAGE, MEASURE_AVERAGE_FRAMES, 0, 0, 0);
    }
    return true;
}

static bool prepare_other_zoom(struct measure *self, struct measure_step *step) {
    measure_explain(step, MEASURE_WHY_OTHER_ZOOM, self->other_factor, 0, 0, 0);
    return go_to_factor(self, self->other_factor, step);
}

// By the calibration alone: the pair at the other zoom needs corners, not the last bit of
// sharpness.
static bool prepare_other_focus(struct measure *self, struct measure_step *step) {
    double point_mm[3];
    measure_point(self, point_mm);
    step->axes = self->axes;
    step->kind = MEASURE_STEP_FOCUS;
    measure_explain(step, MEASURE_WHY_FOCUS_NEAR, self->distance_mm, 0, 0, 0);
    return zoom_focus_at(measure_model(self), point_mm, &step->axes) == ERROR_OK;
}

// The far end of the search: what lies behind the subject is measured as well as far as the matcher
// can search: a small subject alone has too few pixels to count as a surface.
static double search_far_mm(const struct measure *self, double near_mm, double scale) {
    struct zoom_field field;
    double point_mm[3];
    const double far_mm = self->far_mm + MEASURE_SEARCH_MARGIN * self->distance_mm;
    measure_point(self, point_mm);
    if (zoom_field_at(measure_model(self), &self->instrument.frames, &self->axes, point_mm,
                      &field) != ERROR_OK ||
        !(field.depth_per_px_mm > 0)) {
        return far_mm;
    }
    // 1 / depth changes by this much with each disparity.
    const double per_px =
        field.depth_per_px_mm / (field.distance_mm[0] * field.distance_mm[0] * scale);
    const double farthest = 1 / near_mm - MEASURE_SEARCH_PX * per_px;
    return math_max(far_mm, 1 / math_max(farthest, 1 / MEASURE_SEARCH_FAR_MM));
}

static bool prepare_surface(struct measure *self, struct measure_step *step) {
    step->kind = MEASURE_STEP_SURFACE;
    step->scale = self->instrument.mosaic ? MEASURE_MOSAIC_SCALE : 1;
    step->pair = self->result.pair;
    self->result.with_pair = !self->alone && measure_has_other(self) ? self->other_pair : 0;
    step->with_pair = self->result.with_pair;
    if (measure_may_zoom(self) && step->with_pair == 0) {
        measure_lose(self, MEASURE_LOSS_ONE_ZOOM);
    }
    if (self->request.near_mm > 0 || self->request.far_mm > 0) {
        step->near_mm = self->request.near_mm;
        step->far_mm = self->request.far_mm;
    } else if (self->near_mm > 0) {
        step->near_mm = math_max(0.5 * self->near_mm,
                                 self->near_mm - MEASURE_SEARCH_MARGIN * self->distance_mm);
        step->far_mm = search_far_mm(self, step->near_mm, step->scale);
    }
    enum measure_why why = step->near_mm > 0 ? MEASURE_WHY_COMPUTE : MEASURE_WHY_COMPUTE_ALL;
    if (self->alone) {
        why = MEASURE_WHY_COMPUTE_ALONE;
    }
    measure_explain(step, why, step->near_mm, step->far_mm, 0, 0);
    return true;
}

bool measure_prepare(struct measure *self, enum measure_phase phase, struct measure_step *step) {
    static bool (*const prepare[MEASURE_PHASES])(struct measure *, struct measure_step *) = {
        [MEASURE_BRINGUP] = prepare_bringup,
        [MEASURE_AHEAD] = prepare_ahead,
        [MEASURE_WIDE_ZOOM] = prepare_wide_zoom,
        [MEASURE_WIDE_IRIS] = prepare_wide_iris,
        [MEASURE_WIDE_LIGHT] = prepare_light,
        [MEASURE_WIDE_FOCUS] = prepare_wide_focus,
        [MEASURE_WIDE_PAIR] = prepare_pair,
        [MEASURE_WIDE_SURFACE] = prepare_look,
        [MEASURE_AIM] = prepare_aim,
        [MEASURE_AIMED_PAIR] = prepare_pair,
        [MEASURE_AIMED_SURFACE] = prepare_look,
        [MEASURE_OTHER_ZOOM] = prepare_other_zoom,
        [MEASURE_OTHER_FOCUS] = prepare_other_focus,
        [MEASURE_OTHER_LIGHT] = prepare_light,
        [MEASURE_OTHER_PAIR] = prepare_pair,
        [MEASURE_ZOOM] = prepare_zoom,
        [MEASURE_IRIS] = measure_prepare_iris,
        [MEASURE_FOCUS] = prepare_focus,
        [MEASURE_MIDDLE] = measure_prepare_middle,
        [MEASURE_LIGHT] = prepare_light,
        [MEASURE_PAIR] = prepare_pair,
        [MEASURE_MERGED] = prepare_merged,
        [MEASURE_SURFACE] = prepare_surface,
    };
    INVARIANT((unsigned)phase < MEASURE_PHASES && prepare[phase] != NULL);
    return prepare[phase](self, step);
}

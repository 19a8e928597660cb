// SPDX-License-Identifier: Apache-2.0
#include <math.h>
#include <string.h>

#include "core/error.h"
#include "core/invariant.h"
#include "core/math.h"
#include "measure/measure_steps.h"
#include "measure/measure_tuning.h"
#include "measure/zoom_expect.h"
#include "stereo/geometry/geometry.h"
#include "stereo/zoom/zoom_aim.h"

// ---- what is known

void measure_lose(struct measure *self, enum measure_loss loss) {
    INVARIANT((unsigned)loss < MEASURE_LOSSES);
    self->result.losses |= UINT32_C(1) << loss;
}

const struct zoom_calibration *measure_model(const struct measure *self) {
    return self->instrument.calibration;
}

// Whether parts may move: a calibration of one state does not survive it.
bool measure_may_move(const struct measure *self) {
    return measure_model(self) != NULL;
}

bool measure_may_zoom(const struct measure *self) {
    return measure_may_move(self) && self->instrument.zoom;
}

// The subject, or a point ahead at its distance as far as that is known.
void measure_point(const struct measure *self, double point_mm[3]) {
    if (self->subject_known) {
        memcpy(point_mm, self->point_mm, sizeof self->point_mm);
        return;
    }
    zoom_point_ahead(measure_model(self),
                     self->distance_mm > 0 ? self->distance_mm : MEASURE_ANY_DISTANCE_MM, 0,
                     point_mm);
}

double measure_look_ahead(const struct measure *self, struct zoom_state *state) {
    const double stated_mm = (self->request.near_mm + self->request.far_mm) / 2;
    const double distance_mm = stated_mm > 0 ? stated_mm : MEASURE_ANY_DISTANCE_MM;
    double point_mm[3];
    zoom_point_ahead(measure_model(self), distance_mm, 0, point_mm);
    (void)zoom_aim(measure_model(self), point_mm, state, NULL);
    return distance_mm;
}

// Where the right camera has a point at a depth along a ray of the left one: the tangent of the
// angle to the right of its axis.
static double tangent_at(const struct zoom_pair *pair, const double ray[3], double depth_mm) {
    double turned[3], arm_mm[3], in_right_mm[3];
    geometry_rotate(pair->side[0].R_instrument_camera, ray, turned);
    for (int i = 0; i < 3; i++) {
        arm_mm[i] = pair->side[0].position_mm[i] + turned[i] * depth_mm / ray[2] -
                    pair->side[1].position_mm[i];
    }
    geometry_rotate_back(pair->side[1].R_instrument_camera, arm_mm, in_right_mm);
    return in_right_mm[2] > 0 ? in_right_mm[0] / in_right_mm[2] : -(double)INFINITY;  // too near
}

bool measure_sees_stated(const struct measure *self) {
    enum { COLUMNS = 9 };
    const struct zoom_calibration *model = measure_model(self);
    const struct zoom_frames frames = zoom_frames_or_whole(model, &self->instrument.frames);
    const struct zoom_range *left = frames.edge_px[0], *right = frames.edge_px[1];
    struct zoom_state state = self->axes;
    struct zoom_pair pair;
    double from[3], to[3], ray[3];
    if (!self->pan_known) {
        (void)measure_look_ahead(self, &state);
    }
    for (int side = 0; side < 2; side++) {
        state.side[side].zoom_counts = model->camera[side].zoom.min;
    }
    zoom_pair_at(model->camera, &state, &pair);
    const double row_px = (right[1].min + right[1].max) / 2;
    bool seen = !lens_ray(&pair.side[1].lens, (const double[2]){right[0].min, row_px}, from) ||
                !lens_ray(&pair.side[1].lens, (const double[2]){right[0].max, row_px}, to);
    for (int i = 0; i < COLUMNS && !seen; i++) {
        const double pixel_px[2] = {
            left[0].min + (i + 0.5) / COLUMNS * (left[0].max - left[0].min),
            (left[1].min + left[1].max) / 2,
        };
        if (lens_ray(&pair.side[0].lens, pixel_px, ray) && ray[2] > 0) {
            // Nearer is farther to the left.
            seen = tangent_at(&pair, ray, self->request.near_mm) <= to[0] / to[2] &&
                   tangent_at(&pair, ray, self->request.far_mm) >= from[0] / from[2];
        }
    }
    return seen;
}

double measure_focal_px(const struct measure *self) {
    return measure_may_move(self) ? zoom_function_value(&measure_model(self)->camera[0], ZOOM_FOCAL,
                                                        self->axes.side[0].zoom_counts)
                                  : 0;
}

// The request's wish; false: none that the subject's size is needed for and not known.
bool measure_wish_of(const struct measure *self, struct zoom_wish *wish) {
    static const enum zoom_wish_kind kinds[] = {[MEASURE_WISH_SUBJECT] = ZOOM_WISH_WIDTH,
                                                [MEASURE_WISH_FIT] = ZOOM_WISH_WIDTH,
                                                [MEASURE_WISH_DENSITY] = ZOOM_WISH_DENSITY,
                                                [MEASURE_WISH_ZOOM] = ZOOM_WISH_FACTOR};
    const bool by_subject = self->request.wish == MEASURE_WISH_SUBJECT;
    *wish = (struct zoom_wish){
        kinds[self->request.wish],
        by_subject ? MEASURE_SUBJECT_MARGIN * self->width_mm : self->request.value,
    };
    return wish->value > 0;
}

// The state for the wish, and `*nearest`: it is out of reach, and this is the nearest to it. False:
// none, or the cameras do not see the subject.
bool measure_state_for(const struct measure *self, struct zoom_state *state, bool *nearest) {
    struct zoom_wish wish;
    struct zoom_range reach;
    double point_mm[3];
    *nearest = false;
    *state = self->axes;
    if (!measure_may_zoom(self) || !measure_wish_of(self, &wish)) {
        return false;
    }
    measure_point(self, point_mm);
    if (zoom_for_wish(measure_model(self), &self->instrument.frames, &wish, point_mm, state,
                      &reach) == ERROR_OK) {
        return true;
    }
    if (!(reach.max > 0 && reach.min <= reach.max)) {
        return false;
    }
    // Something smaller than the tele end shows is not a wish out of reach, if it was not stated.
    *nearest = self->request.wish != MEASURE_WISH_SUBJECT;
    wish.value = math_min(reach.max, math_max(reach.min, wish.value));
    return zoom_for_wish(measure_model(self), &self->instrument.frames, &wish, point_mm, state,
                         &reach) == ERROR_OK;
}

double measure_centred(const struct measure *self) {
    struct zoom_state state;
    struct zoom_field field;
    bool nearest;
    if (!self->subject_known) {
        return 1;
    }
    if (measure_state_for(self, &state, &nearest) &&
        zoom_field_at(measure_model(self), &self->instrument.frames, &state, self->point_mm,
                      &field) == ERROR_OK) {
        return zoom_field_centred(measure_model(self), &self->instrument.frames, &state, &field);
    }
    return measure_may_zoom(self) ? 0 : 1;
}

// ---- which phases are needed

static bool needs_look(const struct measure *self) {
    return measure_may_zoom(self) && (!self->request.quick || self->request.has_place ||
                                      self->request.wish != MEASURE_WISH_ZOOM);
}

bool measure_has_other(const struct measure *self) {
    const double f_px = self->pair_f_px, other_px = self->other_f_px;
    return self->other_pair != 0 && other_px > 0 &&
           (f_px >= MEASURE_RATIO_MIN * other_px || other_px >= MEASURE_RATIO_MIN * f_px);
}

double measure_other_factor(const struct measure *self) {
    struct zoom_state state;
    bool nearest;
    return measure_state_for(self, &state, &nearest)
               ? zoom_expect_other_factor(measure_model(self), &state)
               : 1;
}

// The wide pair is the other one unless it failed, or a longer one helps more. A subject that it
// did not show cannot be focused on at a longer zoom.
static bool needs_other(const struct measure *self) {
    if (self->request.quick || !measure_may_zoom(self) || self->other_missed) {
        return false;
    }
    if (!self->subject_known) {
        return self->phase < MEASURE_OTHER_ZOOM && self->request.wish == MEASURE_WISH_ZOOM &&
               self->request.value < MEASURE_LONGER_BELOW;
    }
    return self->other_pair == 0 || self->other_factor > 1;
}

// Servos that were not set since the bring-up are anywhere.
static bool needs_ahead(const struct measure *self) {
    return measure_may_move(self) && self->instrument.servos && !self->pan_known;
}

static bool needs_aim(const struct measure *self) {
    return needs_look(self) && self->instrument.servos && self->aims < MEASURE_AIMS_MAX &&
           (self->phase < MEASURE_AIM ? !self->subject_known
                                      : measure_centred(self) < MEASURE_CENTRED_MIN);
}

static bool needs_aimed_pair(const struct measure *self) {
    return needs_look(self) && !self->request.quick && self->aims > 0 && self->other_pair == 0;
}

static bool needs_aimed_surface(const struct measure *self) {
    return needs_look(self) && !self->request.quick && self->aims > 0 && self->other_pair != 0;
}

// Not to focus again: the merged pair is what is measured.
static bool needs_pair(const struct measure *self) {
    return !self->refocused;
}

static bool needs_merged(const struct measure *self) {
    return !self->request.quick && self->result.pair != 0;
}

static bool needs_bringup(const struct measure *self) {
    return !self->instrument.ready;
}

// Without a look, too: the iris is where the last measurement left it.
static bool needs_wide_iris(const struct measure *self) {
    return measure_may_move(self) && self->instrument.iris &&
           (needs_look(self) || !(self->near_mm > 0));
}

static bool needs_wide_light(const struct measure *self) {
    return needs_look(self) && self->instrument.exposure;
}

static bool needs_wide_focus(const struct measure *self) {
    return needs_look(self) && self->instrument.focus;
}

static bool needs_iris(const struct measure *self) {
    return measure_may_move(self) && self->instrument.iris && self->near_mm > 0;
}

static bool needs_focus(const struct measure *self) {
    return measure_may_move(self) && self->instrument.focus && !self->subject_known;
}

static bool needs_middle(const struct measure *self) {
    return measure_may_move(self) && self->instrument.focus &&
           (self->subject_known || self->focus_missed);
}

static bool needs_light(const struct measure *self) {
    return self->instrument.exposure;
}

static bool needs_other_focus(const struct measure *self) {
    return needs_other(self) && self->instrument.focus;
}

static bool needs_other_light(const struct measure *self) {
    return needs_other(self) && self->instrument.exposure;
}

bool measure_needs(const struct measure *self, enum measure_phase phase) {
    // Without a function: always.
    static bool (*const needs[MEASURE_PHASES])(const struct measure *) = {
        [MEASURE_BRINGUP] = needs_bringup,
        [MEASURE_AHEAD] = needs_ahead,
        [MEASURE_WIDE_ZOOM] = needs_look,
        [MEASURE_WIDE_IRIS] = needs_wide_iris,
        [MEASURE_WIDE_LIGHT] = needs_wide_light,
        [MEASURE_WIDE_FOCUS] = needs_wide_focus,
        [MEASURE_WIDE_PAIR] = needs_look,
        [MEASURE_WIDE_SURFACE] = needs_look,
        [MEASURE_AIM] = needs_aim,
        [MEASURE_AIMED_PAIR] = needs_aimed_pair,
        [MEASURE_AIMED_SURFACE] = needs_aimed_surface,
        [MEASURE_OTHER_ZOOM] = needs_other,
        [MEASURE_OTHER_FOCUS] = needs_other_focus,
        [MEASURE_OTHER_LIGHT] = needs_other_light,
        [MEASURE_OTHER_PAIR] = needs_other,
        [MEASURE_ZOOM] = measure_may_zoom,
        [MEASURE_IRIS] = needs_iris,
        [MEASURE_FOCUS] = needs_focus,
        [MEASURE_MIDDLE] = needs_middle,
        [MEASURE_LIGHT] = needs_light,
        [MEASURE_PAIR] = needs_pair,
        [MEASURE_MERGED] = needs_merged,
    };
    INVARIANT((unsigned)phase < MEASURE_PHASES);
    return needs[phase] == NULL || needs[phase](self);
}

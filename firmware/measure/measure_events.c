// SPDX-License-Identifier: Apache-2.0
#include "measure/measure_events.h"

#include <math.h>
#include <string.h>

#include "core/error.h"
#include "core/invariant.h"
#include "core/math.h"
#include "measure/measure_steps.h"
#include "measure/measure_tuning.h"
#include "stereo/geometry/geometry.h"

// Largest length that a measurement of this instrument has, mm: that of stereo/geometry/
// triangulate.h.
static const double length_max_mm = 2e6;
bool measure_is_length(double value_mm) {
    return value_mm >= 0 && value_mm <= length_max_mm;  // not of a NaN
}

static bool is_finite3(const double value[3]) {
    return fabs(value[0]) <= length_max_mm && fabs(value[1]) <= length_max_mm &&
           fabs(value[2]) <= length_max_mm;
}

// Where the right camera points, by where it has the subject: the left one's pan is what counts.
static void correct_pan(struct measure *self, const double right_px[2]) {
    const struct zoom_calibration *model = self->instrument.calibration;
    struct zoom_pair pair;
    double arm_mm[3], expected[3], seen[3];
    zoom_pair_at(model->camera, &self->axes, &pair);
    for (int i = 0; i < 3; i++) {
        arm_mm[i] = self->point_mm[i] - pair.side[1].position_mm[i];
    }
    geometry_rotate_back(pair.side[1].R_instrument_camera, arm_mm, expected);
    if (!(expected[2] > 0) || !lens_ray(&pair.side[1].lens, right_px, seen) || !(seen[2] > 0)) {
        return;
    }
    // A camera that is turned further to the right has objects further to the left.
    const double off_rad = math_atan2(expected[0], expected[2]) - math_atan2(seen[0], seen[2]);
    const double off_pan_rad = off_rad / (1 + model->camera[1].mount[ZOOM_PAN_SCALE]);
    self->pan_offset_rad[1] += off_pan_rad;
    self->axes.side[1].pan_rad += off_pan_rad;
}

// Whether the coarse surface shows a subject, with values that can be.
static bool shows_subject(const struct measure_event *event) {
    const double *left_mm = event->subject.left_mm, *right_px = event->subject.right_px;
    return event->error == ERROR_OK && is_finite3(left_mm) && left_mm[2] > 0 &&
           fabs(right_px[0]) < LENS_CENTRE_MAX_PX && fabs(right_px[1]) < LENS_CENTRE_MAX_PX;
}

static bool is_range(double near_mm, double far_mm) {
    return near_mm > 0 && far_mm >= near_mm && measure_is_length(far_mm);
}

static bool shows_depth(const struct measure_event *event) {
    return is_range(event->subject.near_mm, event->subject.far_mm) &&
           measure_is_length(event->subject.width_mm);
}

static bool shows_surface(const struct measure_event *event) {
    return is_range(event->surface.near_mm, event->surface.far_mm) &&
           event->surface.depth_mm >= event->surface.near_mm &&
           event->surface.depth_mm <= event->surface.far_mm;
}

// The subject that the coarse surface shows. False: it shows none.
static bool take_subject(struct measure *self, const struct measure_event *event) {
    const double *left_mm = event->subject.left_mm;
    struct zoom_pair pair;
    double turned_mm[3];
    if (!shows_subject(event) || !shows_depth(event)) {
        return false;
    }
    zoom_pair_at(self->instrument.calibration->camera, &self->axes, &pair);
    geometry_rotate(pair.side[0].R_instrument_camera, left_mm, turned_mm);
    for (int i = 0; i < 3; i++) {
        self->point_mm[i] = pair.side[0].position_mm[i] + turned_mm[i];
    }
    self->subject_known = true;
    self->distance_mm = left_mm[2];
    self->width_mm = event->subject.width_mm;
    if (self->request.near_mm == 0 || self->request.far_mm == 0) {
        self->near_mm = event->subject.near_mm;
        self->middle_mm = event->subject.left_mm[2];
        self->far_mm = event->subject.far_mm;
    }
    correct_pan(self, event->subject.right_px);
    self->other_factor = measure_other_factor(self);
    return true;
}

static enum measure_outcome take_or_fail(struct measure *self, const struct measure_event *event) {
    (void)self;
    return event->error == ERROR_OK ? MEASURE_DONE : MEASURE_FAILED;
}

static enum measure_outcome take_any(struct measure *self, const struct measure_event *event) {
    self->f_number = event->f_number > 0 ? event->f_number : self->f_number;
    return MEASURE_DONE;
}

static enum measure_outcome take_light(struct measure *self, const struct measure_event *event) {
    take_any(self, event);
    const double reached = event->light.reached;
    if (event->error == ERROR_OK && event->light.exposure_us > 0 && event->light.gain > 0 &&
        reached > 0) {
        self->light_exposure_us = event->light.exposure_us;
        self->light_gain = event->light.gain;
        self->light_reached = reached;
        self->light_f_number = self->f_number;
    }
    const bool dark = reached < MEASURE_DARK_REACHED;
    self->dark = dark;
    if (self->phase != MEASURE_LIGHT) {
        return MEASURE_DONE;
    }
    if (!dark) {
        if (event->error != ERROR_OK) {
            measure_lose(self, MEASURE_LOSS_NOT_EXPOSED);
        }
        return MEASURE_DONE;
    }
    if (!self->iris_opens && self->near_mm > 0 && self->instrument.iris) {
        self->iris_opens = true;
        measure_lose(self, MEASURE_LOSS_NOT_SHARP);
        return MEASURE_REPEAT;
    }
    measure_lose(self, MEASURE_LOSS_DARK);
    return MEASURE_DONE;
}

static void take_distance(struct measure *self, const struct measure_event *event) {
    if (event->focus_mm > 0 && measure_is_length(event->focus_mm)) {
        self->distance_mm = event->focus_mm;
    }
}

static enum measure_outcome take_wide_focus(struct measure *self,
                                            const struct measure_event *event) {
    if (self->wide_searched && event->error == ERROR_OK) {
        take_distance(self, event);
    }
    return MEASURE_DONE;
}

static enum measure_outcome take_focus(struct measure *self, const struct measure_event *event) {
    self->focus_missed = event->error != ERROR_OK;
    if (self->focus_missed) {
        measure_lose(self, MEASURE_LOSS_FOCUS_CALIBRATED);
    } else if (self->distance_mm == 0) {
        take_distance(self, event);
    }
    return MEASURE_DONE;
}

// A move of a lens ends within its tolerance, and what it was off by is known.
static enum measure_outcome take_middle(struct measure *self, const struct measure_event *event) {
    double most_counts = 0;
    for (int side = 0; side < 2; side++) {
        const double off = self->axes.side[side].focus_counts - self->focus_wanted[side];
        self->focus_off[side] += off;
        most_counts = math_max(most_counts, fabs(off));
    }
    if (event->error != ERROR_OK) {
        measure_lose(self, MEASURE_LOSS_NOT_SHARP);
        return MEASURE_DONE;
    }
    if (self->tries == MEASURE_FOCUS_TRIES || !(most_counts > MEASURE_FOCUS_COUNTS)) {
        return MEASURE_DONE;
    }
    self->tries++;
    return MEASURE_REPEAT;
}

static enum measure_outcome moved_or_failed(struct measure *self, int error) {
    if (error == ERROR_MOVED && self->tries < MEASURE_MOVED_TRIES) {
        self->tries++;
        return MEASURE_REPEAT;
    }
    self->result.advice = error == ERROR_MOVED ? MEASURE_ADVICE_STILL : MEASURE_ADVICE_NOTHING;
    return MEASURE_FAILED;
}

static enum measure_outcome take_wide_pair(struct measure *self,
                                           const struct measure_event *event) {
    if (event->error != ERROR_OK) {
        return moved_or_failed(self, event->error);
    }
    self->other_pair = event->pair.number;
    self->other_f_px = measure_focal_px(self);
    return MEASURE_DONE;
}

// Texture does not show in the dark.
static enum measure_advice advice_without_surface(const struct measure *self) {
    return self->dark ? MEASURE_ADVICE_LIGHT : MEASURE_ADVICE_TEXTURE;
}

static enum measure_outcome take_wide_surface(struct measure *self,
                                              const struct measure_event *event) {
    if (take_subject(self, event)) {
        return MEASURE_DONE;
    }
    if (!self->wide_searched && self->instrument.focus) {
        self->wide_searched = true;
        self->phase = MEASURE_WIDE_FOCUS;
        return MEASURE_REPEAT;
    }
    const double stated_mm = (self->request.near_mm + self->request.far_mm) / 2;
    self->distance_mm = self->near_mm > 0 ? stated_mm : self->distance_mm;
    if (self->distance_mm > 0) {
        measure_lose(self, MEASURE_LOSS_COARSE);
    } else {
        self->result.advice = event->error == ERROR_OK || event->error == ERROR_NO_SURFACE
                                  ? advice_without_surface(self)
                                  : MEASURE_ADVICE_NOTHING;
        return self->request.wish == MEASURE_WISH_ZOOM ? MEASURE_DONE : MEASURE_FAILED;
    }
    return MEASURE_DONE;
}

static enum measure_outcome take_aim(struct measure *self, const struct measure_event *event) {
    self->aims++;
    self->other_pair = 0;
    if (event->error != ERROR_OK) {
        measure_lose(self, MEASURE_LOSS_NOT_AIMED);
        self->aims = MEASURE_AIMS_MAX;
    }
    self->other_factor = measure_other_factor(self);
    return MEASURE_DONE;
}

static enum measure_outcome take_aimed_pair(struct measure *self,
                                            const struct measure_event *event) {
    const enum measure_outcome outcome = take_wide_pair(self, event);
    return outcome == MEASURE_FAILED ? MEASURE_DONE : outcome;
}

// Aims once more where the servos came to rest too far off.
static enum measure_outcome take_aimed_surface(struct measure *self,
                                               const struct measure_event *event) {
    if (!take_subject(self, event) || measure_centred(self) >= MEASURE_CENTRED_MIN) {
        return MEASURE_DONE;
    }
    if (self->aims < MEASURE_AIMS_MAX) {
        self->phase = MEASURE_AIM;
        return MEASURE_REPEAT;
    }
    measure_lose(self, MEASURE_LOSS_OFF_CENTRE);
    return MEASURE_DONE;
}

static enum measure_outcome take_zoom(struct measure *self, const struct measure_event *event) {
    if (event->error != ERROR_OK) {
        measure_lose(self, MEASURE_LOSS_NOT_ZOOMED);
    }
    return MEASURE_DONE;
}

static enum measure_outcome take_iris(struct measure *self, const struct measure_event *event) {
    take_any(self, event);
    if (event->error != ERROR_OK) {
        measure_lose(self, MEASURE_LOSS_NOT_SHARP);
    }
    return MEASURE_DONE;
}

// What the cameras see of the subject at its distance, as far as that is known.
static void take_field(struct measure *self) {
    struct zoom_field field;
    if (self->subject_known &&
        zoom_field_at(self->instrument.calibration, &self->instrument.frames, &self->pair_axes,
                      self->point_mm, &field) == ERROR_OK) {
        self->result.density_per_mm2 = field.density_per_mm2;
        self->result.width_mm = field.width_mm;
    }
}

static enum measure_outcome take_pair(struct measure *self, const struct measure_event *event) {
    if (event->error != ERROR_OK) {
        return moved_or_failed(self, event->error);
    }
    self->result.pair = event->pair.number;
    self->pair_f_px = measure_focal_px(self);
    self->pair_axes = self->axes;
    take_field(self);
    self->dark_part =
        event->pair.dark_part >= 0 && event->pair.dark_part <= 1 ? event->pair.dark_part : 0;
    return MEASURE_DONE;
}

static enum measure_outcome take_merged(struct measure *self, const struct measure_event *event) {
    if (event->error == ERROR_OK) {
        self->result.pair = event->pair.number;
    } else if (self->refocused) {
        self->result = self->unfocused;  // its pair is still the best
    } else {
        measure_lose(self, MEASURE_LOSS_ONE_EXPOSURE);
    }
    return MEASURE_DONE;
}

static enum measure_outcome take_other(struct measure *self, const struct measure_event *event) {
    self->other_missed = self->other_missed || event->error != ERROR_OK;
    return MEASURE_DONE;
}

static enum measure_outcome take_other_pair(struct measure *self,
                                            const struct measure_event *event) {
    const enum measure_outcome outcome = take_wide_pair(self, event);
    self->other_missed = outcome == MEASURE_FAILED;
    return outcome == MEASURE_FAILED ? MEASURE_DONE : outcome;
}

static bool has_lost(const struct measure_result *result, enum measure_loss loss) {
    return (result->losses >> loss & 1) != 0;
}

static bool wants_light(const struct measure *self) {
    const bool dark_parts = self->dark_part > MEASURE_DARK_PART_MIN &&
                            has_lost(&self->result, MEASURE_LOSS_ONE_EXPOSURE);
    return dark_parts || has_lost(&self->result, MEASURE_LOSS_DARK);
}

static enum measure_advice advice_for(const struct measure *self) {
    static const uint32_t of_lens =
        UINT32_C(1) << MEASURE_LOSS_NOT_ZOOMED | UINT32_C(1) << MEASURE_LOSS_NOT_SHARP;
    const struct measure_result *result = &self->result;
    // A calibration does not fit two cameras of which one did not zoom.
    if (self->jammed && (result->losses & of_lens) != 0) {
        return MEASURE_ADVICE_FREE;
    }
    if (has_lost(result, MEASURE_LOSS_MISFIT)) {
        return MEASURE_ADVICE_CALIBRATE;
    }
    if (wants_light(self)) {
        return MEASURE_ADVICE_LIGHT;
    }
    if (has_lost(result, MEASURE_LOSS_UNLIKE)) {
        return MEASURE_ADVICE_AIM;
    }
    if (result->sigma_mm > MEASURE_FAR_PART * result->depth_mm) {
        return MEASURE_ADVICE_NEARER;
    }
    if (result->share < MEASURE_SHARE_MIN) {
        return MEASURE_ADVICE_TEXTURE;
    }
    if (result->common_mm > MEASURE_COMMON_FACTOR * result->sigma_mm) {
        return result->with_pair == 0 && self->request.quick ? MEASURE_ADVICE_SECOND_ZOOM
                                                             : MEASURE_ADVICE_BOARD;
    }
    return MEASURE_ADVICE_NOTHING;
}

// What is advised against the common error, and what it is worth; nothing if that is little.
static void advise(struct measure *self, const struct measure_event *event) {
    struct measure_result *result = &self->result;
    result->advice = advice_for(self);
    result->advised_mm = 0;
    if (result->advice == MEASURE_ADVICE_BOARD) {
        result->advised_mm = event->surface.board_mm;
    } else if (result->advice == MEASURE_ADVICE_SECOND_ZOOM) {
        result->advised_mm = event->surface.other_mm;
    }
    if (result->advised_mm > MEASURE_ADVICE_GAIN * result->common_mm) {
        result->advice = MEASURE_ADVICE_NOTHING;
        result->advised_mm = 0;
    }
}

// The surface's figures, and what they say was lost.
static void take_figures(struct measure *self, const struct measure_event *event) {
    struct measure_result *result = &self->result;
    if (result->with_pair != 0 && !event->surface.with_used) {
        measure_lose(self, MEASURE_LOSS_ONE_ZOOM);
        result->with_pair = 0;
    }
    if (event->unlike) {
        measure_lose(self, MEASURE_LOSS_UNLIKE);
    }
    if (event->misfit) {
        measure_lose(self, MEASURE_LOSS_MISFIT);
    }
    result->depth_mm = event->surface.depth_mm;
    result->distance_mm = self->distance_mm > 0 ? self->distance_mm : result->depth_mm;
    result->sigma_mm = event->surface.sigma_mm;
    result->common_mm = event->surface.common_mm;
    result->share = event->surface.share;
    result->hole = event->surface.hole;
}

enum measure_advice measure_advice_after(const struct measure *self,
                                         const struct measure_event *event) {
    struct measure after = *self;
    take_figures(&after, event);
    return advice_for(&after);
}

// Whether the subject's middle is blurred by less than what a result loses something by. Blur grows
// with the distance from the focus in dioptres.
static bool is_sharp(const struct measure_result *result) {
    if (!(result->sharp_near_mm > 0)) {
        return true;
    }
    const double near = 1 / result->sharp_near_mm, far = 1 / result->sharp_far_mm;
    const double blur = fabs(1 / result->depth_mm - (near + far) / 2) / ((near - far) / 2);
    return !(blur > MEASURE_BLURRED_PX / MEASURE_SHARP_PX);
}

// The widest view shows a distance to 2 %, or something behind a smooth subject: too little for the
// sharp depth of a long lens. The surface knows better, and may be taken again by it, once.
static bool refocus(struct measure *self, const struct measure_event *event) {
    struct zoom_pair pair;
    if (is_sharp(&self->result)) {
        return false;
    }
    const bool stated = self->request.near_mm > 0 && self->request.far_mm > 0;
    if (self->request.quick || self->refocused || stated || event->lost || !self->subject_known ||
        !shows_surface(event)) {
        measure_lose(self, MEASURE_LOSS_NOT_SHARP);
        return false;
    }
    zoom_pair_at(self->instrument.calibration->camera, &self->axes, &pair);
    for (int i = 0; i < 3; i++) {
        const double from_mm = pair.side[0].position_mm[i];
        self->point_mm[i] =
            from_mm + (self->point_mm[i] - from_mm) * event->surface.depth_mm / self->distance_mm;
    }
    self->distance_mm = self->middle_mm = event->surface.depth_mm;
    self->near_mm = event->surface.near_mm;
    self->far_mm = event->surface.far_mm;
    self->unfocused = self->result;
    take_field(self);
    self->result.losses &= ~(UINT32_C(1) << MEASURE_LOSS_NOT_SHARP);
    self->refocused = true;
    self->iris_opens = false;
    self->phase = MEASURE_IRIS;
    return true;
}

static enum measure_outcome take_surface(struct measure *self, const struct measure_event *event) {
    struct measure_result *result = &self->result;
    if (event->error != ERROR_OK) {
        const bool no_room = event->error == ERROR_FULL || event->error == ERROR_IO;
        if (result->with_pair != 0 && !self->alone && !no_room) {
            self->alone = true;
            return MEASURE_REPEAT;
        }
        // Texture does not help against a full disk.
        result->advice = event->error == ERROR_NO_SURFACE ? advice_without_surface(self)
                                                          : MEASURE_ADVICE_NOTHING;
        return MEASURE_FAILED;
    }
    take_figures(self, event);
    if (refocus(self, event)) {
        return MEASURE_REPEAT;
    }
    advise(self, event);
    return MEASURE_DONE;
}

enum measure_outcome measure_take(struct measure *self, const struct measure_event *event) {
    static enum measure_outcome (*const takes[MEASURE_PHASES])(struct measure *,
                                                               const struct measure_event *) = {
        [MEASURE_BRINGUP] = take_or_fail,
        [MEASURE_AHEAD] = take_or_fail,
        [MEASURE_WIDE_ZOOM] = take_any,
        [MEASURE_WIDE_IRIS] = take_any,
        [MEASURE_WIDE_LIGHT] = take_light,
        [MEASURE_WIDE_FOCUS] = take_wide_focus,
        [MEASURE_WIDE_PAIR] = take_wide_pair,
        [MEASURE_WIDE_SURFACE] = take_wide_surface,
        [MEASURE_AIM] = take_aim,
        [MEASURE_AIMED_PAIR] = take_aimed_pair,
        [MEASURE_AIMED_SURFACE] = take_aimed_surface,
        [MEASURE_OTHER_ZOOM] = take_other,
        [MEASURE_OTHER_FOCUS] = take_any,
        [MEASURE_OTHER_LIGHT] = take_any,
        [MEASURE_OTHER_PAIR] = take_other_pair,
        [MEASURE_ZOOM] = take_zoom,
        [MEASURE_IRIS] = take_iris,
        [MEASURE_FOCUS] = take_focus,
        [MEASURE_MIDDLE] = take_middle,
        [MEASURE_LIGHT] = take_light,
        [MEASURE_PAIR] = take_pair,
        [MEASURE_MERGED] = take_merged,
        [MEASURE_SURFACE] = take_surface,
    };
    INVARIANT((unsigned)self->phase < MEASURE_PHASES && takes[self->phase] != NULL);
    return takes[self->phase](self, event);
}

// SPDX-License-Identifier: Apache-2.0
// Iris and focus for the depth of the subject.
#include <math.h>
#include <string.h>

#include "core/error.h"
#include "core/math.h"
#include "focus/depth_iris.h"
#include "measure/measure_steps.h"
#include "measure/measure_tuning.h"
#include "measure/zoom_field.h"

struct sharp_range {
    double near_mm, far_mm;
};

// The depths to be sharp. A table under the subject may reach from before it to far behind, so that
// they are as far before its middle, in dioptres, as behind it, and there no farther than half of
// the width that both see. Depths that the request states are taken as they are.
static struct sharp_range to_be_sharp(const struct measure *self) {
    struct sharp_range range = {self->near_mm, self->far_mm};
    struct zoom_field field;
    double point_mm[3];
    if (!(self->middle_mm > 0)) {
        return range;
    }
    measure_point(self, point_mm);
    if (zoom_field_at(measure_model(self), &self->instrument.frames, &self->axes, point_mm,
                      &field) == ERROR_OK) {
        range.far_mm = math_min(range.far_mm, self->middle_mm + field.width_mm / 2);
    }
    const double middle = 1 / self->middle_mm;
    const double behind = math_max(middle - 1 / range.far_mm, MEASURE_BEHIND_MIN * middle);
    range.near_mm = 1 / (middle + behind);
    range.far_mm = 1 / (middle - behind);
    return range;
}

// The lens with the longer focal length, focused on the middle of the subject; false: too near.
static bool lens_of(const struct measure *self, struct lens_state *state) {
    const struct zoom_calibration *model = measure_model(self);
    const struct sharp_range range = to_be_sharp(self);
    double focal_mm = 0;
    for (int side = 0; side < 2; side++) {
        const struct zoom_camera *camera = &model->camera[side];
        focal_mm = math_max(
            focal_mm, camera->pixel_mm * zoom_function_value(camera, ZOOM_FOCAL,
                                                             self->axes.side[side].zoom_counts));
    }
    *state = (struct lens_state){
        .focal_length_mm = focal_mm,
        .f_number = self->f_number > 0 ? self->f_number : MEASURE_WIDE_F_NUMBER,
        .focus_distance_mm = range.near_mm > 0 ? lens_range_middle(range.near_mm, range.far_mm) : 0,
    };
    return focal_mm > 0 && range.near_mm > 2 * focal_mm;
}

static double sharp_mm(const struct measure *self) {
    return MEASURE_SHARP_PX * measure_model(self)->camera[0].pixel_mm;
}

// The f-number at which the light asks for this exposure times gain; INFINITY: not known.
static double f_number_for_light(const struct measure *self, double exposure_us) {
    const double product = self->light_exposure_us * self->light_gain;
    return product > 0 && exposure_us > 0 && self->light_f_number > 0
               ? self->light_f_number *
                     sqrt(exposure_us / product * math_min(1, self->light_reached))
               : (double)INFINITY;
}

// The f-number from which on exposures are so long that lamps on the mains do not flicker, as far
// as diffraction does not show; 0: any.
static double f_number_for_steady_light(const struct measure *self) {
    const double f_number = f_number_for_light(self, self->instrument.steady_us);
    return f_number < (double)INFINITY
               ? math_min(MEASURE_WIDE_F_NUMBER, MEASURE_STEADY_MARGIN * f_number)
               : 0;
}

bool measure_prepare_iris(struct measure *self, struct measure_step *step) {
    const struct measure_instrument *parts = &self->instrument;
    struct lens_state lens;
    if (!(parts->f_number_open > 0 && parts->f_number_closed >= parts->f_number_open) ||
        !lens_of(self, &lens)) {
        measure_lose(self, MEASURE_LOSS_NOT_SHARP);
        return false;
    }
    const struct depth_iris_limits limits = {
        .open = parts->f_number_open,
        .closed = parts->f_number_closed,
        .dark = f_number_for_light(self, parts->exposure_max_us * parts->gain_max),
        .steady = f_number_for_steady_light(self),
    };
    static const enum measure_why whys[] = {
        [DEPTH_IRIS_NEEDED] = MEASURE_WHY_IRIS_NEEDED,
        [DEPTH_IRIS_STEADY] = MEASURE_WHY_IRIS_STEADY,
        [DEPTH_IRIS_OPEN] = MEASURE_WHY_IRIS_OPEN,
        [DEPTH_IRIS_DIFFRACTION] = MEASURE_WHY_IRIS_DIFFRACTION,
        [DEPTH_IRIS_CLOSED] = MEASURE_WHY_IRIS_CLOSED,
        [DEPTH_IRIS_DARK] = MEASURE_WHY_IRIS_LIGHT,
    };
    const struct sharp_range range = to_be_sharp(self);
    const struct depth_iris iris =
        depth_iris_for(&lens, range.near_mm, range.far_mm, sharp_mm(self), &limits);
    if (iris.blur_mm > MEASURE_BLURRED_PX / MEASURE_SHARP_PX * sharp_mm(self)) {
        measure_lose(self, MEASURE_LOSS_NOT_SHARP);
    }
    step->kind = MEASURE_STEP_IRIS;
    step->f_number = iris.f_number;
    self->result.sharp_near_mm = iris.sharp_near_mm;
    self->result.sharp_far_mm = iris.sharp_far_mm;
    measure_explain(step, whys[iris.limit], iris.f_number, iris.sharp_near_mm, iris.sharp_far_mm,
                    0);
    return true;
}

static enum measure_why choose_focus_reason(const struct measure *self) {
    if (self->tries > 0) {
        return MEASURE_WHY_FOCUS_AGAIN;
    }
    if (self->refocused) {
        return MEASURE_WHY_FOCUS_SURFACE;
    }
    return self->focus_missed ? MEASURE_WHY_FOCUS_CALIBRATED : MEASURE_WHY_FOCUS_KNOWN;
}

// To the middle of the depth, or of what is known of it: the calibration was focused by pictures,
// so that it places a lens better than a search does in which a table may be sharper than the
// subject.
bool measure_prepare_middle(struct measure *self, struct measure_step *step) {
    struct zoom_state to = self->axes;
    struct lens_state lens;
    double middle_mm[3];
    const bool has_depth = lens_of(self, &lens);
    const double distance_mm = has_depth ? lens.focus_distance_mm : self->distance_mm;
    measure_point(self, middle_mm);
    middle_mm[2] += distance_mm - self->distance_mm;
    if (zoom_focus_at(measure_model(self), middle_mm, &to) != ERROR_OK) {
        measure_lose(self, MEASURE_LOSS_NOT_SHARP);  // as near as it can
    }
    for (int side = 0; side < 2; side++) {
        self->focus_wanted[side] = to.side[side].focus_counts;
        to.side[side].focus_counts -= self->focus_off[side];
    }
    step->kind = MEASURE_STEP_FOCUS;
    step->axes = to;
    const double shown_mm = distance_mm > 0 ? distance_mm : middle_mm[2];
    measure_explain(step, choose_focus_reason(self), shown_mm, 0, 0, 0);
    return true;
}

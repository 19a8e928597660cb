// SPDX-License-Identifier: Apache-2.0
#include "stereo/zoom/refine_pair.h"

#include <math.h>
#include <string.h>

#include "core/error.h"
#include "core/invariant.h"

static struct refine_sigma sigma_of(const struct self_calibration *self, const double *gradient) {
    return (struct refine_sigma){self_prior_sigma(self, gradient),
                                 self_posterior_sigma(self, gradient)};
}

// The largest correction, in sigmas of the prior.
static double surprise_of(const struct self_calibration *self) {
    double gradient[SELF_TERMS_MAX] = {0}, largest = 0;
    for (int i = 0; i < self->terms; i++) {
        gradient[i] = 1;
        const double sigma = self_prior_sigma(self, gradient);
        const double part = sigma > 0 ? self->correction[i] / sigma : 0;
        const double size = part < 0 ? -part : part;
        largest = size > largest ? size : largest;
        gradient[i] = 0;
    }
    return largest;
}

void refine_assess(const struct refine_picture *picture, const struct self_calibration *self,
                   struct refine_report *report) {
    const int left = VIEW_TERMS * self_view(picture->state, 0);
    const int right = VIEW_TERMS * self_view(picture->state, 1);
    double gradient[SELF_TERMS_MAX] = {0};
    INVARIANT(right + VIEW_TERMS <= self->terms && picture->depth_near_mm > 0);
    gradient[left + VIEW_FOCAL] = gradient[right + VIEW_FOCAL] = 0.5;
    report->focal = sigma_of(self, gradient);
    gradient[left + VIEW_FOCAL] = -1;
    gradient[right + VIEW_FOCAL] = 1;
    report->ratio = sigma_of(self, gradient);
    memset(gradient, 0, sizeof gradient);
    gradient[left + VIEW_ROTATION_Y] = -1;
    gradient[right + VIEW_ROTATION_Y] = 1;
    report->vergence_rad = sigma_of(self, gradient);
    report->depth_mm = report->used > 0 ? report->depth_mm : 2 * picture->depth_near_mm;
    double px[2] = {0.5 * picture->grey[0].width, 0.5 * picture->grey[0].height};
    refine_to_sensor(&picture->window[0], px);
    if (self_depth_gradient(self, picture->state, px, report->depth_mm, gradient)) {
        report->depth = sigma_of(self, gradient);
    }
    report->surprise = surprise_of(self);
    // Rows may fit while the depth does not: the word considers both.
    report->health =
        report->used > 0 && (report->surprise > 4 || report->rows_px > 0.6)    ? REFINE_CALIBRATE
        : report->used == 0 || report->depth.after > 2.5e-3 * report->depth_mm ? REFINE_TOUCH_UP
                                                                               : REFINE_GOOD;
}

int refine_pair(const struct refine_picture *picture, struct arena *arena,
                struct self_calibration *self, struct refine_report *report) {
    const size_t mark = arena_mark(arena);
    struct refine_tracks tracks = {arena_take(arena, SPARSE_LEFT_MAX, sizeof *tracks.track), 0,
                                   SPARSE_LEFT_MAX};
    const int error =
        tracks.track == NULL ? ERROR_MEMORY : refine_match(picture, arena, self, &tracks, report);
    if (error == ERROR_OK) {
        refine_assess(picture, self, report);
    }
    arena_release(arena, mark);
    return error;
}

size_t refine_pair_need_bytes(int width, int height) {
    return arena_need_bytes(SPARSE_LEFT_MAX, sizeof(struct self_track)) +
           refine_match_need_bytes(width, height);
}

// The lens of a window of the sensor.
static void to_window(const struct calibration_window *window, const struct image_u8 *grey,
                      struct lens *lens) {
    double centre[2] = {lens->cx_px, lens->cy_px};
    refine_from_sensor(window, centre);
    lens->cx_px = centre[0];
    lens->cy_px = centre[1];
    lens->fx_px /= window->skip;
    lens->fy_px /= window->skip;
    lens->width_px = grey->width;
    lens->height_px = grey->height;
}

int refine_calibration(const struct zoom_calibration *calibration,
                       const struct refine_picture *picture, struct arena *arena,
                       struct calibration *result, struct refine_report *report,
                       struct calibration_fault *fault) {
    const size_t mark = arena_mark(arena);
    struct calibration refined;
    struct self_calibration self;
    int error = zoom_calibration_at(calibration, &picture->axes, &refined, fault);
    if (error == ERROR_OK) {
        error = self_calibration_begin(calibration, &picture->axes, 1, arena, &self);
    }
    if (error == ERROR_OK) {
        error = refine_pair(picture, arena, &self, report);
    }
    if (error == ERROR_OK) {
        camera_view_pair(&self.view[0], &self.view[1], &refined);
        to_window(&picture->window[0], &picture->grey[0], &refined.left);
        to_window(&picture->window[1], &picture->grey[1], &refined.right);
        refined.origin.side[0].window = picture->window[0];
        refined.origin.side[1].window = picture->window[1];
        // What remains unknown, at the depth of the scene: as an angle, beside the scale.
        refined.scale_sigma = calibration->scale_sigma;
        refined.yaw_sigma_rad = report->depth.after * calibration_baseline_mm(&refined) /
                                (report->depth_mm * report->depth_mm);
        error = calibration_round(&refined);
    }
    if (error == ERROR_OK) {
        error = calibration_validate(&refined, fault);
    }
    if (error == ERROR_OK) {
        *result = refined;
    }
    arena_release(arena, mark);
    return error;
}

size_t refine_calibration_need_bytes(int width, int height) {
    return self_calibration_need_bytes(1) + refine_pair_need_bytes(width, height);
}

// SPDX-License-Identifier: Apache-2.0
#include "measure/zoom_field.h"

#include <math.h>

#include "core/error.h"
#include "core/invariant.h"
#include "core/math.h"
#include "stereo/geometry/geometry.h"
#include "stereo/zoom/zoom_aim.h"

enum {
    FOCUS_ROUNDS = 3,     // the pupil moves by little with zoom
    COUNTS_BITS_MAX = 24  // rounds of a bisection: more than any range of counts has bits
};

// How far beyond its calibrated range a focus may lie, in standard deviations of the motors.
static const double margin_sigmas = 4;

struct zoom_frames zoom_frames_of(const struct calibration_window window[2], int width_px,
                                  int height_px) {
    struct zoom_frames frames = {.skip = window[0].skip};
    const int size_px[2] = {width_px, height_px};
    for (int side = 0; side < 2; side++) {
        const int first_px[2] = {window[side].column_px, window[side].row_px};
        for (int axis = 0; axis < 2; axis++) {
            const double begin_px = first_px[axis] - 0.5;
            frames.edge_px[side][axis] =
                (struct zoom_range){begin_px, begin_px + (double)size_px[axis] * frames.skip};
        }
    }
    return frames;
}

struct zoom_frames zoom_frames_or_whole(const struct zoom_calibration *calibration,
                                        const struct zoom_frames *frames) {
    struct calibration_window whole[2] = {{0, 0, 1}, {0, 0, 1}};
    return frames != NULL && frames->skip > 0
               ? *frames
               : zoom_frames_of(whole, calibration->camera[0].width_px,
                                calibration->camera[0].height_px);
}

// A point in a camera's frame.
static void to_camera(const struct zoom_pair *pair, int side, const double point_mm[3],
                      double in_camera_mm[3]) {
    double arm_mm[3];
    for (int i = 0; i < 3; i++) {
        arm_mm[i] = point_mm[i] - pair->side[side].position_mm[i];
    }
    geometry_rotate_back(pair->side[side].R_instrument_camera, arm_mm, in_camera_mm);
}

// Where the ray of a pixel meets the plane through the point, relative to the point, along the
// plane's `axis`. 0: it does not.
static double reach_of(const struct zoom_pair *pair, int side, const double pixel_px[2],
                       const double point_mm[3], int axis) {
    const double *position_mm = pair->side[side].position_mm;
    double ray[3], direction[3];
    if (!lens_ray(&pair->side[side].lens, pixel_px, ray)) {
        return 0;
    }
    geometry_rotate(pair->side[side].R_instrument_camera, ray, direction);
    const double ahead_mm = point_mm[2] - position_mm[2];
    if (!(direction[2] > 0 && ahead_mm > 0)) {
        return 0;
    }
    return position_mm[axis] + direction[axis] / direction[2] * ahead_mm - point_mm[axis];
}

// Half of the field of one camera along an axis of the plane: to the nearer edge of its image.
static double half_of(const struct zoom_pair *pair, const struct zoom_frames *frames, int side,
                      const double pixel_px[2], const double point_mm[3], int axis) {
    double low_px[2] = {pixel_px[0], pixel_px[1]}, high_px[2] = {pixel_px[0], pixel_px[1]};
    low_px[axis] = frames->edge_px[side][axis].min;
    high_px[axis] = frames->edge_px[side][axis].max;
    if (!(pixel_px[axis] > low_px[axis] && pixel_px[axis] < high_px[axis])) {
        return 0;
    }
    return math_max(0, math_min(-reach_of(pair, side, low_px, point_mm, axis),
                                reach_of(pair, side, high_px, point_mm, axis)));
}

// What one camera sees of the plane.
struct side_field {
    double half_mm[2], density_per_mm2, distance_mm, pixel_px[2];
};

static int side_field_at(const struct zoom_pair *pair, const struct zoom_frames *frames, int side,
                         const double point_mm[3], struct side_field *field) {
    const struct lens *lens = &pair->side[side].lens;
    double in_camera_mm[3];
    to_camera(pair, side, point_mm, in_camera_mm);
    if (!(in_camera_mm[2] > 0) || !lens_project(lens, in_camera_mm, field->pixel_px)) {
        return ERROR_RANGE;
    }
    const double x_per_mm = lens->fx_px / in_camera_mm[2], y_per_mm = lens->fy_px / in_camera_mm[2];
    field->distance_mm = in_camera_mm[2];
    field->density_per_mm2 = x_per_mm * y_per_mm / (frames->skip * frames->skip);
    for (int axis = 0; axis < 2; axis++) {
        field->half_mm[axis] = half_of(pair, frames, side, field->pixel_px, point_mm, axis);
    }
    return ERROR_OK;
}

// Distance of a point from the line through both cameras.
static double distance_from_baseline(const struct zoom_pair *pair, const double point_mm[3],
                                     double *baseline_mm) {
    double baseline[3], arm[3], across[3];
    for (int i = 0; i < 3; i++) {
        baseline[i] = pair->side[1].position_mm[i] - pair->side[0].position_mm[i];
        arm[i] = point_mm[i] - pair->side[0].position_mm[i];
    }
    *baseline_mm = geometry_norm(baseline);
    geometry_cross(baseline, arm, across);
    return *baseline_mm > 0 ? geometry_norm(across) / *baseline_mm : 0;
}

int zoom_field_at(const struct zoom_calibration *calibration, const struct zoom_frames *frames,
                  const struct zoom_state *state, const double point_mm[3],
                  struct zoom_field *field) {
    const struct zoom_frames shown = zoom_frames_or_whole(calibration, frames);
    struct zoom_pair pair;
    struct side_field seen[2];
    INVARIANT(calibration != NULL && point_mm != NULL);
    zoom_pair_at(calibration->camera, state, &pair);
    for (int side = 0; side < 2; side++) {
        const int error = side_field_at(&pair, &shown, side, point_mm, &seen[side]);
        if (error != ERROR_OK) {
            return error;
        }
    }
    struct zoom_field found = {
        .width_mm = 2 * math_min(seen[0].half_mm[0], seen[1].half_mm[0]),
        .height_mm = 2 * math_min(seen[0].half_mm[1], seen[1].half_mm[1]),
        .density_per_mm2 = math_min(seen[0].density_per_mm2, seen[1].density_per_mm2)};
    for (int side = 0; side < 2; side++) {
        found.distance_mm[side] = seen[side].distance_mm;
        found.pixel_px[side][0] = seen[side].pixel_px[0];
        found.pixel_px[side][1] = seen[side].pixel_px[1];
    }
    const double away_mm = distance_from_baseline(&pair, point_mm, &found.baseline_mm);
    const double f_px = (pair.side[0].lens.fx_px + pair.side[1].lens.fx_px) / 2;
    if (!(found.baseline_mm > 0 && f_px > 0)) {
        return ERROR_RANGE;
    }
    found.depth_per_px_mm = shown.skip * away_mm * away_mm / (f_px * found.baseline_mm);
    *field = found;
    return ERROR_OK;
}

double zoom_field_centred(const struct zoom_calibration *calibration,
                          const struct zoom_frames *frames, const struct zoom_state *state,
                          const struct zoom_field *field) {
    const struct zoom_frames shown = zoom_frames_or_whole(calibration, frames);
    struct zoom_pair pair;
    double whole_mm = INFINITY;
    zoom_pair_at(calibration->camera, state, &pair);
    for (int side = 0; side < 2; side++) {
        const struct lens *lens = &pair.side[side].lens;
        INVARIANT(lens->fx_px > 0);
        const struct zoom_range *columns = &shown.edge_px[side][0];
        whole_mm = math_min(whole_mm,
                            field->distance_mm[side] * (columns->max - columns->min) / lens->fx_px);
    }
    return math_min(1, field->width_mm / whole_mm);
}

// ---- focus and zoom for a point

static double motor_sigma(const struct zoom_camera *camera) {
    return sqrt(camera->reading_sigma_counts * camera->reading_sigma_counts +
                camera->drift_sigma_counts * camera->drift_sigma_counts);
}

static int focus_side(const struct zoom_calibration *calibration, int side,
                      const double point_mm[3], struct zoom_state *state) {
    const struct zoom_camera *camera = &calibration->camera[side];
    double exact = 0;
    for (int i = 0; i < FOCUS_ROUNDS; i++) {
        struct zoom_pair pair;
        double in_camera_mm[3];
        zoom_pair_at(calibration->camera, state, &pair);
        to_camera(&pair, side, point_mm, in_camera_mm);
        if (!(in_camera_mm[2] > 0)) {
            return ERROR_RANGE;
        }
        exact = zoom_focus_counts(camera, state->side[side].zoom_counts, in_camera_mm[2]);
        state->side[side].focus_counts =
            math_min(camera->focus.max, math_max(camera->focus.min, exact));
    }
    const double margin = margin_sigmas * motor_sigma(camera);
    return exact >= camera->focus.min - margin && exact <= camera->focus.max + margin ? ERROR_OK
                                                                                      : ERROR_RANGE;
}

int zoom_focus_at(const struct zoom_calibration *calibration, const double point_mm[3],
                  struct zoom_state *state) {
    struct zoom_state found = *state;
    const int left = focus_side(calibration, 0, point_mm, &found);
    const int right = focus_side(calibration, 1, point_mm, &found);
    *state = found;
    return left != ERROR_OK ? left : right;
}

static double factor_at(const struct zoom_camera *camera, double zoom_counts) {
    const double least =
        math_min(zoom_function_value(camera, ZOOM_FOCAL, math_ceil(camera->zoom.min)),
                 zoom_function_value(camera, ZOOM_FOCAL, math_floor(camera->zoom.max)));
    INVARIANT(least > 0);
    return zoom_function_value(camera, ZOOM_FOCAL, zoom_counts) / least;
}

// What one side offers of a wish at a zoom, focused on the point; 0: it does not see the point.
static double offer_at(const struct zoom_calibration *calibration, const struct zoom_frames *frames,
                       enum zoom_wish_kind kind, int side, double zoom_counts,
                       const double point_mm[3], struct zoom_state *state) {
    struct zoom_pair pair;
    struct side_field field;
    if (kind == ZOOM_WISH_FACTOR) {
        return factor_at(&calibration->camera[side], zoom_counts);
    }
    state->side[side].zoom_counts = zoom_counts;
    (void)focus_side(calibration, side, point_mm, state);  // at the end of its range if need be
    zoom_pair_at(calibration->camera, state, &pair);
    if (side_field_at(&pair, frames, side, point_mm, &field) != ERROR_OK || field.half_mm[0] <= 0) {
        return 0;
    }
    return kind == ZOOM_WISH_DENSITY ? field.density_per_mm2 : 2 * field.half_mm[0];
}

// The whole counts within the calibrated zoom of a side that offer at least the wish and as little
// more as possible. `grows`: the offer grows with the counts.
static double counts_for(const struct zoom_calibration *calibration,
                         const struct zoom_frames *frames, const struct zoom_wish *wish, int side,
                         const struct zoom_range *counts, bool grows, const double point_mm[3],
                         struct zoom_state *state) {
    double low = counts->min, high = counts->max;
    for (int i = 0; i < COUNTS_BITS_MAX && high - low > 1; i++) {
        const double middle = math_floor((low + high) / 2);
        const bool enough =
            offer_at(calibration, frames, wish->kind, side, middle, point_mm, state) >= wish->value;
        *(enough == grows ? &high : &low) = middle;
    }
    const double sparing = grows ? low : high, generous = grows ? high : low;
    return offer_at(calibration, frames, wish->kind, side, sparing, point_mm, state) >= wish->value
               ? sparing
               : generous;
}

int zoom_for_wish(const struct zoom_calibration *calibration, const struct zoom_frames *frames,
                  const struct zoom_wish *wish, const double point_mm[3], struct zoom_state *state,
                  struct zoom_range *reach) {
    const struct zoom_frames shown = zoom_frames_or_whole(calibration, frames);
    struct zoom_state found = *state;
    struct zoom_range both = {0, INFINITY}, counts[2];
    bool grows[2];
    INVARIANT((unsigned)wish->kind <= ZOOM_WISH_FACTOR);
    for (int side = 0; side < 2; side++) {
        const struct zoom_range *zoom = &calibration->camera[side].zoom;
        counts[side] = (struct zoom_range){math_ceil(zoom->min), math_floor(zoom->max)};
        const double first =
            offer_at(calibration, &shown, wish->kind, side, counts[side].min, point_mm, &found);
        const double last =
            offer_at(calibration, &shown, wish->kind, side, counts[side].max, point_mm, &found);
        grows[side] = last > first;
        both.min = math_max(both.min, math_min(first, last));
        both.max = math_min(both.max, math_max(first, last));
    }
    // A camera that sees the point at no zoom offers nothing, whatever the other does.
    *reach = both.max > 0 ? both : (struct zoom_range){0, 0};
    if (!(wish->value >= both.min && wish->value <= both.max)) {
        return ERROR_RANGE;
    }
    for (int side = 0; side < 2; side++) {
        found.side[side].zoom_counts = counts_for(calibration, &shown, wish, side, &counts[side],
                                                  grows[side], point_mm, &found);
    }
    if (zoom_focus_at(calibration, point_mm, &found) != ERROR_OK) {
        *reach = (struct zoom_range){1, 0};
        return ERROR_RANGE;
    }
    *state = found;
    return ERROR_OK;
}

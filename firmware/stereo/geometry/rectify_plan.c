// SPDX-License-Identifier: Apache-2.0
// The rectified frames and windows of a pair. Lengths on the plane z = 1 of the rect frame are
// called "slopes" here (x/z, y/z); the parallax of a point is baseline / depth, in slopes too.
#include <math.h>

#include "core/error.h"
#include "core/invariant.h"
#include "core/math.h"
#include "stereo/geometry/geometry.h"
#include "stereo/geometry/rectify.h"
#include "stereo/geometry/rectify_window.h"

enum {
    COUNT_STEP = 16,       // disparities are searched in vectors of this many
    ASSUMED_MAX_PX = 960,  // disparities searched if no depth range was stated
};

// A rectified plane at a larger angle to the cameras would be stretched beyond use.
static const double FACING_MIN = 0.2;

// Parallax of the working range.
struct parallax {
    double far, near;  // far >= 0: 0 is infinity
    double verged;     // parallax of the vergence point; 0 for a parallel pair
    double margin_px;  // searched in addition to a stated range, so that its ends can be refined
    bool assumed;
};

static bool is_stated(double near_mm, double far_mm) {
    return near_mm != 0 || far_mm != 0;
}

// Orientation: x along the baseline, z the mean of both optical axes made orthogonal to it.
static int orient(const struct calibration *calibration, struct rectify_plan *plan) {
    double R_right_left[9], axis_x[3], axis_y[3], right_axis[3];
    geometry_rotation_from_vector(calibration->rotation_right_left_rad, R_right_left);
    geometry_rotate_back(R_right_left, calibration->translation_right_left_mm, axis_x);
    const double baseline_mm = geometry_norm(axis_x);
    if (!(baseline_mm > 0)) {
        return ERROR_BASELINE;
    }
    for (int i = 0; i < 3; i++) {
        axis_x[i] /= -baseline_mm;
        right_axis[i] = R_right_left[6 + i];
    }
    double axis_z[3] = {right_axis[0], right_axis[1], right_axis[2] + 1.0};
    const double along = geometry_dot(axis_z, axis_x);
    const double length = geometry_norm(axis_z);
    for (int i = 0; i < 3; i++) {
        axis_z[i] -= along * axis_x[i];
    }
    const double across = geometry_norm(axis_z);
    if (!(length > FACING_MIN) || !(across > FACING_MIN * length)) {
        return ERROR_OVERLAP;  // opposite views, or one camera behind the other
    }
    for (int i = 0; i < 3; i++) {
        axis_z[i] /= across;
    }
    geometry_cross(axis_z, axis_x, axis_y);
    for (int i = 0; i < 3; i++) {
        plan->R_rect_left[i] = axis_x[i];
        plan->R_rect_left[3 + i] = axis_y[i];
        plan->R_rect_left[6 + i] = axis_z[i];
    }
    for (int row = 0; row < 3; row++) {  // R_rect_right = R_rect_left R_left_right
        geometry_rotate(R_right_left, plan->R_rect_left + 3 * row, plan->R_rect_right + 3 * row);
    }
    INVARIANT(geometry_dot(axis_x, axis_z) < 1e-9 && geometry_dot(axis_x, axis_z) > -1e-9);
    plan->baseline_mm = baseline_mm;
    return ERROR_OK;
}

// Raw pixels per slope around a point of the rectified plane: root of the area's magnification.
static double raw_resolution_px(const struct lens *lens, const double R_rect_camera[9], double x,
                                double y) {
    const double step = 1e-4;
    const double away[4][2] = {{-step, 0}, {step, 0}, {0, -step}, {0, step}};
    double seen_px[4][2];
    for (int i = 0; i < 4; i++) {
        const double ray_rect[3] = {x + away[i][0], y + away[i][1], 1.0};
        double ray_camera[3];
        geometry_rotate_back(R_rect_camera, ray_rect, ray_camera);
        if (!lens_project(lens, ray_camera, seen_px[i])) {
            return 0;
        }
    }
    const double determinant = (seen_px[1][0] - seen_px[0][0]) * (seen_px[3][1] - seen_px[2][1]) -
                               (seen_px[1][1] - seen_px[0][1]) * (seen_px[3][0] - seen_px[2][0]);
    return sqrt(determinant < 0 ? -determinant : determinant) / (2.0 * step);
}

// The working range: stated by the options, else by the calibration, else a default.
static int choose_parallax(const struct calibration *calibration,
                           const struct rectify_options *options, const struct rectify_plan *plan,
                           const struct rectify_depth_ratio *ratio, struct parallax *parallax) {
    double near_mm = options->depth_near_mm, far_mm = options->depth_far_mm;
    if (!is_stated(near_mm, far_mm)) {
        near_mm = calibration->depth_near_mm;
        far_mm = calibration->depth_far_mm;
    }
    *parallax = (struct parallax){.assumed = !is_stated(near_mm, far_mm)};
    if (!parallax->assumed) {
        if (!(near_mm > 0 && far_mm > near_mm)) {
            return ERROR_DEPTH_RANGE;
        }
        parallax->margin_px = 1.0;
        // Stated along the left axis, but needed along the rectified one.
        parallax->near = plan->baseline_mm / (near_mm * ratio->min);
        parallax->far = plan->baseline_mm / (far_mm * ratio->max);
        // Depths that differ only in their last digits may have equal parallax.
        return parallax->near > parallax->far ? ERROR_OK : ERROR_DEPTH_RANGE;
    }
    const struct lens *lens = &calibration->left;
    const double verged_mm = calibration_vergence_depth_mm(calibration);
    const double verged_px = lens->fx_px * plan->baseline_mm / verged_mm;
    if (!calibration->rectified && verged_mm > 0 && verged_px >= lens->width_px / 16.0) {
        parallax->verged = plan->baseline_mm / (verged_mm * plan->R_rect_left[8]);
        parallax->near = 1.5 * parallax->verged;
        parallax->far = 0.5 * parallax->verged;
    } else {
        parallax->near = 0.25 * lens->width_px / lens->fx_px;
    }
    INVARIANT(parallax->near > parallax->far);
    return ERROR_OK;
}

// A default range is limited to what can be searched; a stated one is not. Returns whether that
// changed it.
static bool limit_assumed(struct parallax *parallax, double f_px) {
    const double span = ASSUMED_MAX_PX / f_px;
    INVARIANT(f_px > 0);
    if (!parallax->assumed || parallax->near - parallax->far <= span) {
        return false;
    }
    if (parallax->verged > 0) {
        parallax->far = parallax->verged - 0.5 * span;
    }
    parallax->near = parallax->far + span;
    return true;
}

// Frames of a pair that has to be rectified.
static int frame_rotated(const struct calibration *calibration,
                         const struct rectify_options *options, struct rectify_plan *plan,
                         struct parallax *parallax) {
    struct rectify_outline left, right;
    int error = orient(calibration, plan);
    if (error == ERROR_OK) {
        error = rectify_window_trace(&calibration->left, plan->R_rect_left, &left);
    }
    if (error == ERROR_OK) {
        error = rectify_window_trace(&calibration->right, plan->R_rect_right, &right);
    }
    if (error == ERROR_OK) {
        error = choose_parallax(calibration, options, plan, &left.depth_ratio, parallax);
    }
    if (error != ERROR_OK) {
        return error;
    }
    struct rectify_window window;
    double f_px = 0;
    bool moved = true;
    for (int pass = 0; pass < 2 && moved; pass++) {  // limiting the range moves the window slightly
        if (!rectify_window_find(&left, &right, parallax->far, parallax->near, &window)) {
            return ERROR_OVERLAP;
        }
        const double y = 0.5 * (window.top + window.bottom);
        const double left_px = raw_resolution_px(&calibration->left, plan->R_rect_left,
                                                 0.5 * (window.left_low + window.left_high), y);
        const double right_px = raw_resolution_px(&calibration->right, plan->R_rect_right,
                                                  0.5 * (window.right_low + window.right_high), y);
        f_px = 0.5 * (left_px + right_px) * options->scale;
        if (!(f_px > 0)) {
            return ERROR_OVERLAP;
        }
        moved = limit_assumed(parallax, f_px);
    }
    INVARIANT(parallax->near > parallax->far && parallax->far >= 0);
    const double width = f_px * (window.left_high - window.left_low);
    const double height = f_px * (window.bottom - window.top);
    if (!(width < 8.0 * IMAGE_MAX_SIDE_PX && height < 8.0 * IMAGE_MAX_SIDE_PX)) {
        return ERROR_TOO_LARGE;
    }
    plan->width_px = (int)(width + 1e-6) + 1;
    plan->height_px = (int)(height + 1e-6) + 1;
    plan->f_px = plan->fy_px = f_px;
    plan->cx_left_px = -f_px * window.left_low;
    plan->cy_px = -f_px * window.top;
    // Puts the middle of the needed part of the right view in the middle of its image.
    plan->cx_right_px =
        0.5 * (plan->width_px - 1) - f_px * 0.5 * (window.right_low + window.right_high);
    return ERROR_OK;
}

// Frames of a pair whose rows already correspond: the images, times scale.
static int frame_rectified(const struct calibration *calibration,
                           const struct rectify_options *options, struct rectify_plan *plan,
                           struct parallax *parallax) {
    static const double UNIT[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    static const struct rectify_depth_ratio UNROTATED = {1.0, 1.0};
    for (int i = 0; i < 9; i++) {
        plan->R_rect_left[i] = plan->R_rect_right[i] = UNIT[i];
    }
    plan->baseline_mm = calibration_baseline_mm(calibration);
    const int error = choose_parallax(calibration, options, plan, &UNROTATED, parallax);
    if (error != ERROR_OK) {
        return error;
    }
    const struct lens *lens = &calibration->left;
    const double scale = options->scale;
    if (parallax->assumed) {  // published rectified pairs count from disparity 0
        const double offset = (lens->cx_px - calibration->right.cx_px) / lens->fx_px;
        parallax->far = math_max(0, -offset);
        parallax->near = math_max(parallax->far, parallax->near - offset);
        limit_assumed(parallax, lens->fx_px * scale);
    }
    INVARIANT(plan->baseline_mm > 0);
    plan->identity = scale == 1.0;
    plan->width_px = (int)(lens->width_px * scale + 0.5);
    plan->height_px = (int)(lens->height_px * scale + 0.5);
    if (plan->width_px < 1 || plan->height_px < 1) {
        return ERROR_TOO_SMALL;
    }
    plan->f_px = lens->fx_px * scale;
    plan->fy_px = lens->fy_px * scale;
    // Pixel centres: x' = (x + 1/2) scale - 1/2, exactly x at scale 1.
    const double shift = 0.5 * scale - 0.5;
    plan->cx_left_px = lens->cx_px * scale + shift;
    plan->cx_right_px = calibration->right.cx_px * scale + shift;
    plan->cy_px = lens->cy_px * scale + shift;
    return ERROR_OK;
}

static int floor_int(double x) {
    INVARIANT(x > -1e9 && x < 1e9);
    const int towards_zero = (int)x;
    return towards_zero - (x < towards_zero);
}

// The disparities of the full image for this parallax.
static int choose_disparities(const struct rectify_options *options,
                              const struct parallax *parallax, struct rectify_plan *plan) {
    if (options->disparity_count != 0) {
        plan->disparity_min = options->disparity_min;
        plan->disparity_count = options->disparity_count;
        return options->disparity_count > 0 ? ERROR_OK : ERROR_DISPARITY_RANGE;
    }
    const double offset_px = plan->cx_left_px - plan->cx_right_px;
    const double far_px = plan->f_px * parallax->far + offset_px;
    const double near_px = plan->f_px * parallax->near + offset_px;
    // Beyond the width no pixel has a partner.
    const double limit_px = plan->width_px - 1;
    if (!(far_px <= limit_px && near_px >= -limit_px)) {
        return ERROR_OVERLAP;
    }
    const int low = floor_int(math_max(far_px - parallax->margin_px, -limit_px));
    const int high = -floor_int(-math_min(near_px + parallax->margin_px, limit_px));
    const int count = high - low + 1;
    INVARIANT(count > 0);
    const int rounded = (count + COUNT_STEP - 1) / COUNT_STEP * COUNT_STEP;
    plan->disparity_min = low;
    plan->disparity_count = count <= MATCH_MAX_DISPARITIES ? rounded : count;
    return ERROR_OK;
}

static bool region_is_inside(const struct rectify_options *options,
                             const struct rectify_plan *plan) {
    const int x = options->region_x_px, y = options->region_y_px;
    const int width = options->region_width_px, height = options->region_height_px;
    return x >= 0 && y >= 0 && width >= 0 && height > 0 && x <= plan->width_px - width &&
           y <= plan->height_px - height;
}

// Crops both images to the region. The right crop is moved by whole pixels to where the region's
// matches lie, and the disparities with it.
static int crop(const struct rectify_options *options, struct rectify_plan *plan) {
    const int x = options->region_x_px, y = options->region_y_px;
    const int width = options->region_width_px, height = options->region_height_px;
    if (width == 0) {
        return ERROR_OK;
    }
    if (!region_is_inside(options, plan)) {
        return ERROR_ARGUMENT;
    }
    const int64_t last = plan->width_px - 1;
    int64_t low = (int64_t)x - plan->disparity_min - plan->disparity_count + 1;
    int64_t high = (int64_t)x + width - 1 - plan->disparity_min;
    low = low > 0 ? low : 0;
    high = high < last ? high : last;
    if (low > high) {
        return ERROR_OVERLAP;
    }
    int64_t start = (low + high - width + 1) / 2;
    start = start < 0 ? 0 : start;
    start = start > plan->width_px - width ? plan->width_px - width : start;
    INVARIANT(start >= 0 && start + width <= plan->width_px);
    plan->cx_left_px -= x;
    plan->cx_right_px -= (double)start;
    plan->cy_px -= y;
    plan->disparity_min -= x - (int)start;
    plan->width_px = width;
    plan->height_px = height;
    return ERROR_OK;
}

static bool is_too_small(const struct lens *lens, double scale) {
    return lens->width_px * scale < MATCH_MIN_WIDTH_PX ||
           lens->height_px * scale < MATCH_MIN_HEIGHT_PX;
}

// The rest must be large enough to be matched.
static int check_limits(const struct calibration *calibration,
                        const struct rectify_options *options, const struct rectify_plan *plan) {
    if (plan->width_px > IMAGE_MAX_SIDE_PX || plan->height_px > IMAGE_MAX_SIDE_PX) {
        return ERROR_TOO_LARGE;
    }
    if (plan->width_px < MATCH_MIN_WIDTH_PX || plan->height_px < MATCH_MIN_HEIGHT_PX) {
        const bool was_small = is_too_small(&calibration->left, options->scale) ||
                               is_too_small(&calibration->right, options->scale);
        return was_small || options->region_width_px != 0 ? ERROR_TOO_SMALL : ERROR_OVERLAP;
    }
    if (plan->disparity_count > MATCH_MAX_DISPARITIES ||
        plan->disparity_min < -MATCH_DISPARITY_LIMIT ||
        plan->disparity_min > MATCH_DISPARITY_LIMIT - plan->disparity_count) {
        return ERROR_DISPARITY_RANGE;
    }
    return ERROR_OK;
}

static int check_arguments(const struct calibration *calibration,
                           const struct rectify_options *options) {
    if (!(options->scale > 0 && options->scale <= 4)) {
        return ERROR_ARGUMENT;
    }
    if (options->disparity_count != 0 &&
        (options->disparity_count < 0 || options->disparity_count > MATCH_MAX_DISPARITIES ||
         options->disparity_min < -4 * IMAGE_MAX_SIDE_PX ||
         options->disparity_min > 4 * IMAGE_MAX_SIDE_PX)) {
        return ERROR_DISPARITY_RANGE;
    }
    if (calibration->left.width_px > IMAGE_MAX_SIDE_PX ||
        calibration->left.height_px > IMAGE_MAX_SIDE_PX ||
        calibration->right.width_px > IMAGE_MAX_SIDE_PX ||
        calibration->right.height_px > IMAGE_MAX_SIDE_PX) {
        return ERROR_TOO_LARGE;
    }
    return ERROR_OK;
}

// The depths that the disparities of the plan cover.
static int find_depths(const struct rectify_options *options, struct rectify_plan *plan) {
    const double offset_px = plan->cx_left_px - plan->cx_right_px;
    const double f_baseline = plan->f_px * plan->baseline_mm;
    const double nearest_px = plan->disparity_min + plan->disparity_count - 1 - offset_px;
    const double farthest_px = plan->disparity_min - offset_px;
    if (!(nearest_px > 0) && !options->allow_beyond) {
        return ERROR_DISPARITY_RANGE;  // all of it is beyond infinity
    }
    plan->depth_near_mm = nearest_px > 0 ? f_baseline / nearest_px : INFINITY;
    plan->depth_far_mm = farthest_px > 0 ? f_baseline / farthest_px : INFINITY;
    INVARIANT(plan->depth_near_mm > 0 && plan->depth_near_mm <= plan->depth_far_mm);
    return ERROR_OK;
}

int rectify_plan_make(const struct calibration *calibration, const struct rectify_options *options,
                      struct rectify_plan *plan) {
    int error = check_arguments(calibration, options);
    if (error != ERROR_OK) {
        return error;
    }
    struct rectify_plan made = {.width_px = 0};
    struct parallax parallax;
    error = calibration->rectified ? frame_rectified(calibration, options, &made, &parallax)
                                   : frame_rotated(calibration, options, &made, &parallax);
    if (error == ERROR_OK) {
        error = choose_disparities(options, &parallax, &made);
    }
    if (error == ERROR_OK) {
        error = crop(options, &made);
    }
    if (error == ERROR_OK) {
        error = check_limits(calibration, options, &made);
    }
    if (error == ERROR_OK) {
        error = find_depths(options, &made);
    }
    if (error != ERROR_OK) {
        return error;
    }
    made.depth_range_assumed = parallax.assumed && options->disparity_count == 0;
    INVARIANT(made.f_px > 0 && made.fy_px > 0);
    *plan = made;
    return ERROR_OK;
}

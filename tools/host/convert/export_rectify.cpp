// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstring>

#include "core/error.h"
#include "stereo/geometry/geometry.h"
#include "stereo/geometry/rectify.h"
#include "stereo/image/image.h"
#include "tools/host/convert/export.hpp"

namespace {

/// The same lens in front of a sensor with `shrink` times fewer pixels along each side.
lens shrunk(lens camera, int shrink) {
    camera.width_px = std::max(1, camera.width_px / shrink);
    camera.height_px = std::max(1, camera.height_px / shrink);
    camera.fx_px /= shrink;
    camera.fy_px /= shrink;
    camera.cx_px = (camera.cx_px + 0.5) / shrink - 0.5;
    camera.cy_px = (camera.cy_px + 0.5) / shrink - 0.5;
    return camera;
}

/// x/z in the rect frame of the ray through the middle of a raw image.
double middle_slope(const lens &camera, const double R_rect_camera[9]) {
    const double middle_px[2] = {(camera.width_px - 1) / 2.0, (camera.height_px - 1) / 2.0};
    double ray[3] = {0, 0, 1}, turned[3];
    if (!lens_ray(&camera, middle_px, ray)) {
        ray[0] = ray[1] = 0;
    }
    geometry_rotate(R_rect_camera, ray, turned);
    return turned[0] / turned[2];
}

/// Our own plan of the frames. Matching has limits (image size, disparities) that do not apply to
/// an export: large images are planned at a fraction of their size, and the disparities of a stated
/// depth range are ignored. `*shrink` receives the denominator of the fraction.
int plan_frames(const calibration &value, rectify_plan *plan, int *shrink) {
    calibration small = value;
    const int side_px = std::max(
        {value.left.width_px, value.left.height_px, value.right.width_px, value.right.height_px});
    *shrink = (side_px + IMAGE_MAX_SIDE_PX - 1) / IMAGE_MAX_SIDE_PX;
    if (*shrink > 1) {
        small.left = shrunk(value.left, *shrink);
        small.right = shrunk(value.right, *shrink);
    }
    rectify_options options{};
    options.scale = 1;
    const int code = rectify_plan_make(&small, &options, plan);
    if (code != ERROR_DISPARITY_RANGE) {
        return code;
    }
    small.depth_near_mm = small.depth_far_mm = 0;
    return rectify_plan_make(&small, &options, plan);
}

}  // namespace

int export_rectify(const calibration &value, export_rectified *result) {
    rectify_plan plan;
    int shrink = 1;
    const int code = plan_frames(value, &plan, &shrink);
    if (code != ERROR_OK) {
        return code;
    }
    std::memcpy(result->R_rect_left, plan.R_rect_left, sizeof plan.R_rect_left);
    std::memcpy(result->R_rect_right, plan.R_rect_right, sizeof plan.R_rect_right);
    result->baseline_mm = plan.baseline_mm;
    if (value.rectified) {
        result->f_px = value.left.fx_px;
        result->fy_px = value.left.fy_px;
        result->cx_left_px = value.left.cx_px;
        result->cx_right_px = value.right.cx_px;
        result->cy_px = value.left.cy_px;
        return ERROR_OK;
    }
    // The plan's image, scaled and centred in one of the raw size.
    const int width_px = value.left.width_px, height_px = value.left.height_px;
    const double scale = std::min(static_cast<double>(width_px) / plan.width_px,
                                  static_cast<double>(height_px) / plan.height_px);
    const auto moved = [&](double centre_px, int planned_px, int size_px) {
        return (centre_px - (planned_px - 1) / 2.0) * scale + (size_px - 1) / 2.0;
    };
    result->f_px = plan.f_px * scale;
    result->fy_px = plan.fy_px * scale;
    result->cy_px = moved(plan.cy_px, plan.height_px, height_px);
    result->cx_left_px = moved(plan.cx_left_px, plan.width_px, width_px);
    result->cx_right_px = moved(plan.cx_right_px, plan.width_px, width_px);
    if (!std::isfinite(plan.depth_far_mm)) {
        const double slope = 0.5 * (middle_slope(value.left, plan.R_rect_left) +
                                    middle_slope(value.right, plan.R_rect_right));
        result->cx_left_px = result->cx_right_px = (width_px - 1) / 2.0 - result->f_px * slope;
    }
    return ERROR_OK;
}

export_rectified export_rectify_or_fail(const calibration &value) {
    export_rectified result;
    const int code = export_rectify(value, &result);
    if (code != ERROR_OK) {
        throw export_failure{
            code, std::string("the pair cannot be rectified, and this format holds rectified "
                              "cameras: ") +
                      error_text(code)};
    }
    return result;
}

void export_projections(const export_rectified &rectified, double unit_mm, double P_left[12],
                        double P_right[12]) {
    for (int side = 0; side < 2; side++) {
        double *P = side == 0 ? P_left : P_right;
        std::fill(P, P + 12, 0.0);
        P[0] = rectified.f_px;
        P[2] = side == 0 ? rectified.cx_left_px : rectified.cx_right_px;
        P[3] = side == 0 ? 0 : -rectified.f_px * rectified.baseline_mm / unit_mm;
        P[5] = rectified.fy_px;
        P[6] = rectified.cy_px;
        P[10] = 1;
    }
}

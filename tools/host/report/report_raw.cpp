// SPDX-License-Identifier: Apache-2.0
#include "tools/host/report/report_raw.hpp"

#include "stereo/geometry/geometry.h"
#include "stereo/geometry/lens.h"
#include "stereo/reconstruct.h"
#include "tools/host/formats/report_text.hpp"

namespace {

const int cells_across = 40;

struct raw_side {
    const double *R_rect_camera;
    const lens *camera;
    double cx_px;
};

/// The pixel of the image as it was taken, of a place in the rectified one, as JSON.
std::string raw_text(const reconstruct_context &context, const raw_side &side, double x_px,
                     double y_px) {
    const rectify_plan &plan = context.result->plan;
    const double point[3] = {(x_px - side.cx_px) / plan.f_px, (y_px - plan.cy_px) / plan.fy_px, 1};
    double ray[3], raw_px[2];
    geometry_rotate_back(side.R_rect_camera, point, ray);
    if (!lens_project(side.camera, ray, raw_px)) {
        return "null,null";
    }
    const double shrunk_by = context.shrink;
    return report_text_format("%.1f,%.1f", (raw_px[0] + 0.5) * shrunk_by - 0.5,
                              (raw_px[1] + 0.5) * shrunk_by - 0.5);
}

}  // namespace

std::string report_raw_grid(const reconstruct_context &context) {
    if (context.calibration == nullptr) {
        return "null";
    }
    const rectify_plan &plan = context.result->plan;
    const int width = context.result->left.width, height = context.result->left.height;
    const int step = (width + cells_across - 1) / cells_across;
    const int columns = (width - 1 + step - 1) / step + 1,
              rows = (height - 1 + step - 1) / step + 1;
    const raw_side sides[2] = {{plan.R_rect_left, &context.calibration->left, plan.cx_left_px},
                               {plan.R_rect_right, &context.calibration->right, plan.cx_right_px}};
    std::string json =
        report_text_format("{\"step\":%d,\"columns\":%d,\"rows\":%d", step, columns, rows);
    for (int i = 0; i < 2; i++) {
        json += i == 0 ? ",\"left\":[" : ",\"right\":[";
        for (int node = 0; node < columns * rows; node++) {
            json += (node > 0 ? "," : "") +
                    raw_text(context, sides[i], node % columns * step, node / columns * step);
        }
        json += "]";
    }
    return json + "}";
}

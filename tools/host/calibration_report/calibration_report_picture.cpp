// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "core/invariant.h"
#include "stereo/geometry/geometry.h"
#include "tools/host/calibration_report/calibration_report_sections.hpp"
#include "tools/host/report/report_layers.hpp"

namespace {

/// Bilinear; false outside the picture.
bool sample(const calibration_picture &picture, const double at_px[2], double *value) {
    const double x = at_px[0], y = at_px[1];
    if (!(x >= 0 && y >= 0 && x <= picture.width_px - 1 && y <= picture.height_px - 1)) {
        return false;
    }
    const int i = std::min(static_cast<int>(x), std::max(0, picture.width_px - 2));
    const int j = std::min(static_cast<int>(y), std::max(0, picture.height_px - 2));
    const double u = x - i, v = y - j;
    const auto at = [&](int column, int row) {
        column = std::min(column, picture.width_px - 1);
        row = std::min(row, picture.height_px - 1);
        return static_cast<double>(picture.grey[static_cast<std::size_t>(row) *
                                                    static_cast<std::size_t>(picture.width_px) +
                                                static_cast<std::size_t>(column)]);
    };
    *value = (1 - v) * ((1 - u) * at(i, j) + u * at(i + 1, j)) +
             v * ((1 - u) * at(i, j + 1) + u * at(i + 1, j + 1));
    return true;
}

/// Raw pixel of a pixel of the rectified image in its full size. `view_radius` is
/// `lens_view_radius(&camera)`, which is slow to compute.
bool raw_pixel(const lens &camera, double view_radius, const export_rectified &rectified, int side,
               double x_px, double y_px, double pixel_px[2]) {
    const double cx_px = side == 0 ? rectified.cx_left_px : rectified.cx_right_px;
    const double rect[3] = {(x_px - cx_px) / rectified.f_px,
                            (y_px - rectified.cy_px) / rectified.fy_px, 1};
    double ray[3];
    geometry_rotate_back(side == 0 ? rectified.R_rect_left : rectified.R_rect_right, rect, ray);
    if (!(ray[2] > 0) || std::hypot(ray[0], ray[1]) > ray[2] * view_radius) {
        return false;
    }
    return lens_project(&camera, ray, pixel_px);
}

}  // namespace

bool calibration_picture_load(const calibration_page &page, std::size_t capture, int camera,
                              calibration_picture *picture) {
    if (!page.load ||
        !page.load(capture, camera, &picture->grey, &picture->width_px, &picture->height_px)) {
        return false;
    }
    return picture->width_px > 0 && picture->height_px > 0 &&
           picture->grey.size() == static_cast<std::size_t>(picture->width_px) *
                                       static_cast<std::size_t>(picture->height_px);
}

calibration_picture calibration_picture_shrink(const calibration_picture &picture, int width_px) {
    calibration_picture small;
    small.width_px = std::min(width_px, picture.width_px);
    small.height_px =
        std::max(1, static_cast<int>(std::lround(static_cast<double>(picture.height_px) *
                                                 small.width_px / picture.width_px)));
    const auto begin = [](int i, int from, int to) {  // first source pixel of a new one
        return static_cast<int>(static_cast<long long>(i) * from / to);
    };
    for (int y = 0; y < small.height_px; y++) {
        const int top = begin(y, picture.height_px, small.height_px);
        const int bottom = std::max(top + 1, begin(y + 1, picture.height_px, small.height_px));
        for (int x = 0; x < small.width_px; x++) {
            const int left = begin(x, picture.width_px, small.width_px);
            const int right = std::max(left + 1, begin(x + 1, picture.width_px, small.width_px));
            unsigned sum = 0;
            for (int j = top; j < bottom; j++) {
                for (int i = left; i < right; i++) {
                    sum += picture.grey[static_cast<std::size_t>(j) *
                                            static_cast<std::size_t>(picture.width_px) +
                                        static_cast<std::size_t>(i)];
                }
            }
            const unsigned count = static_cast<unsigned>((bottom - top) * (right - left));
            small.grey.push_back(static_cast<std::uint8_t>((sum + count / 2) / count));
        }
    }
    return small;
}

calibration_picture calibration_picture_rectify(const calibration_picture &raw,
                                                const calibration &rig,
                                                const export_rectified &rectified, int side,
                                                double scale) {
    INVARIANT(scale > 0 && scale <= 1);
    const lens &camera = side == 0 ? rig.left : rig.right;
    const double view_radius = lens_view_radius(&camera);
    calibration_picture made;
    made.width_px = std::max(1, static_cast<int>(rig.left.width_px * scale));
    made.height_px = std::max(1, static_cast<int>(rig.left.height_px * scale));
    const int parts = scale < 0.75 ? 2 : 1;  // samples along each side of a pixel
    for (int y = 0; y < made.height_px; y++) {
        for (int x = 0; x < made.width_px; x++) {
            double sum = 0;
            int inside = 0;
            for (int part = 0; part < parts * parts; part++) {
                const double across = (part % parts + 0.5) / parts;
                const double down = (part / parts + 0.5) / parts;
                double pixel_px[2], value;
                if (raw_pixel(camera, view_radius, rectified, side, (x + across) / scale - 0.5,
                              (y + down) / scale - 0.5, pixel_px) &&
                    sample(raw, pixel_px, &value)) {
                    sum += value;
                    inside++;
                }
            }
            made.grey.push_back(
                static_cast<std::uint8_t>(inside > 0 ? std::lround(sum / inside) : 0));
        }
    }
    return made;
}

std::string calibration_picture_jpeg(const calibration_picture &picture) {
    std::vector<std::uint8_t> colour;
    colour.reserve(3 * picture.grey.size());
    for (const std::uint8_t grey : picture.grey) {
        colour.insert(colour.end(), 3, grey);
    }
    const image_rgb8 view = {colour.data(), picture.width_px, picture.height_px,
                             3 * static_cast<std::ptrdiff_t>(picture.width_px)};
    return report_encode_jpeg(view, 85);
}

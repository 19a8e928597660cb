// SPDX-License-Identifier: Apache-2.0
#include "tools/host/report/report_still.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "tools/host/report/report_layers.hpp"

namespace {

using vector3 = std::array<double, 3>;

constexpr int width_px = 960, height_px = 540, quality = 82;
constexpr unsigned char background = 0xee;
constexpr double tan_half_fov = 0.3;                 // half the picture's height at distance 1
constexpr double yaw_rad = 0.36, pitch_rad = -0.18;  // angles of "Oblique" in view.js
constexpr std::size_t samples = 20000;               // enough for quantiles
constexpr double outliers = 0.02;  // share of the points that is ignored at each end

/// A point in the frame of drawing: x right, y up, z towards the viewer.
vector3 place_of(const triangulate_point &point) {
    return {1e-3 * point.x_um, -1e-3 * point.y_um, -1e-3 * point.z_um};
}

double dot(const vector3 &a, const vector3 &b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/// An orbit about the middle of most points, from where these fit into the picture.
struct camera {
    vector3 right{}, up{}, back{}, target{};
    double distance_mm = 0, pixels = 0;  // distance from `target`; pixels per unit at distance 1
};

camera camera_of(const reconstruct_result &result) {
    camera view;
    const double cy = std::cos(yaw_rad), sy = std::sin(yaw_rad);
    const double cp = std::cos(pitch_rad), sp = std::sin(pitch_rad);
    view.right = {cy, 0, -sy};
    view.up = {sy * sp, cp, cy * sp};
    view.back = {sy * cp, -sp, cy * cp};
    view.pixels = 0.5 * height_px / tan_half_fov;
    const std::size_t stride = std::max<std::size_t>(1, result.vertex_count / samples);
    vector3 low{}, high{};
    for (std::size_t axis = 0; axis < 3; axis++) {
        std::vector<double> values;
        for (std::size_t i = 0; i < result.vertex_count; i += stride) {
            values.push_back(place_of(result.points[i])[axis]);
        }
        std::sort(values.begin(), values.end());
        const std::size_t skip =
            static_cast<std::size_t>(outliers * static_cast<double>(values.size()));
        low[axis] = values[skip];
        high[axis] = values[values.size() - 1 - skip];
        view.target[axis] = 0.5 * (low[axis] + high[axis]);
    }
    const double wide = tan_half_fov * width_px / height_px;
    for (std::size_t i = 0; i < result.vertex_count; i += stride) {
        vector3 q = place_of(result.points[i]);
        bool central = true;
        for (std::size_t axis = 0; axis < 3; axis++) {
            central = central && q[axis] >= low[axis] && q[axis] <= high[axis];
            q[axis] -= view.target[axis];
        }
        const double reach = std::max(std::fabs(dot(view.right, q)) / wide,
                                      std::fabs(dot(view.up, q)) / tan_half_fov);
        if (central) {
            view.distance_mm = std::max(view.distance_mm, dot(view.back, q) + reach);
        }
    }
    view.distance_mm = 1.05 * std::max(view.distance_mm, 1e-6);
    return view;
}

/// A picture with a depth for each pixel.
struct canvas {
    report_bytes pixels = report_bytes(3 * std::size_t{width_px} * height_px, background);
    std::vector<float> depth_mm = std::vector<float>(std::size_t{width_px} * height_px, INFINITY);

    void put(double x, double y, double size, double depth, const std::uint8_t *colour) {
        const double half = 0.5 * std::clamp(size, 1.0, 12.0);
        if (!(x > -half && x < width_px + half && y > -half && y < height_px + half)) {
            return;
        }
        const int left = std::max(0, static_cast<int>(std::lround(x - half)));
        const int top = std::max(0, static_cast<int>(std::lround(y - half)));
        const int right = std::min<int>(width_px, static_cast<int>(std::lround(x + half)));
        const int bottom = std::min<int>(height_px, static_cast<int>(std::lround(y + half)));
        for (int v = top; v < bottom; v++) {
            for (int u = left; u < right; u++) {
                const std::size_t at =
                    static_cast<std::size_t>(v) * width_px + static_cast<std::size_t>(u);
                if (depth < static_cast<double>(depth_mm[at])) {
                    depth_mm[at] = static_cast<float>(depth);
                    std::copy_n(colour, 3, &pixels[3 * at]);
                }
            }
        }
    }
};

}  // namespace

std::string report_still(const reconstruct_result &result) {
    if (result.vertex_count == 0) {
        return "";
    }
    const camera view = camera_of(result);
    canvas picture;
    const std::uint32_t columns = static_cast<std::uint32_t>(result.plan.width_px);
    for (std::uint32_t i = 0; i < result.vertex_count; i++) {
        vector3 q = place_of(result.points[i]);
        const double spacing_mm = -q[2] / result.plan.f_px;
        for (std::size_t axis = 0; axis < 3; axis++) {
            q[axis] -= view.target[axis];
        }
        const double depth_mm = view.distance_mm - dot(view.back, q);
        if (depth_mm < 0.01 * view.distance_mm) {
            continue;
        }
        const double scale = view.pixels / depth_mm;
        const std::uint32_t pixel = result.vertex_pixel[i];
        const std::uint8_t *row =
            image_rgb8_row(&result.left_colour, static_cast<int>(pixel / columns));
        // Each point covers somewhat more than its share, so that no gaps show.
        picture.put(0.5 * width_px + scale * dot(view.right, q),
                    0.5 * height_px - scale * dot(view.up, q), 1.4 * scale * spacing_mm, depth_mm,
                    row + 3 * (pixel % columns));
    }
    const image_rgb8 image = {picture.pixels.data(), width_px, height_px, 3 * width_px};
    return report_encode_jpeg(image, quality);
}

// SPDX-License-Identifier: Apache-2.0
#include "tools/simrig/render/sampler.hpp"

namespace world {

Aperture::Aperture(double spot_rms_px) {
    // The distribution's integral on a fine grid, then its inverse.
    constexpr int kCells = 8192;
    const double reach = 0.5 + 3.5 * spot_rms_px;
    std::vector<double> integral(kCells + 1, 0.0);
    for (int i = 0; i < kCells; i++) {
        const double x = reach * ((2.0 * i + 1) / kCells - 1);
        double density = std::fabs(x) <= 0.5 ? 1 : 0;
        if (spot_rms_px > 0) {
            const double scale = 1 / (spot_rms_px * std::sqrt(2.0));
            density = 0.5 * (std::erf((x + 0.5) * scale) - std::erf((x - 0.5) * scale));
        }
        integral[static_cast<std::size_t>(i) + 1] = integral[static_cast<std::size_t>(i)] + density;
    }
    std::size_t cell = 0;
    for (std::size_t n = 0; n < quantile_.size(); n++) {
        const double share = (static_cast<double>(n) + 0.5) /
                             static_cast<double>(quantile_.size()) * integral[kCells];
        while (integral[cell + 1] < share) {
            cell++;
        }
        const double part = (share - integral[cell]) / (integral[cell + 1] - integral[cell]);
        quantile_[n] = reach * (2 * (static_cast<double>(cell) + part) / kCells - 1);
    }
    for (std::size_t level = 0; level < 4; level++) {
        const std::size_t strata = std::size_t{1} << level;
        const std::size_t width = quantile_.size() / strata;
        variance_[level] = 0;
        for (std::size_t s = 0; s < strata; s++) {
            double mean = 0;
            double square = 0;
            for (std::size_t n = s * width; n < (s + 1) * width; n++) {
                mean += quantile_[n];
                square += quantile_[n] * quantile_[n];
            }
            mean /= static_cast<double>(width);
            middle_[level][s] = mean;
            variance_[level] +=
                (square / static_cast<double>(width) - mean * mean) / static_cast<double>(strata);
        }
    }
}

PixelView pixel_view(const Camera &camera, Vec2 pixel, Vec2 guess) {
    PixelView view;
    view.slopes = camera.slopes_of(pixel, guess, view.step);
    view.pixel_slope = std::fabs(view.step[0]);
    view.pupil_radius_mm = 0.5 * camera.optics.pupil_diameter_mm;
    view.focus_mm = camera.optics.focus_distance_mm;
    return view;
}

}  // namespace world

// SPDX-License-Identifier: Apache-2.0
#include "tools/simrig/world/raster.hpp"

#include <algorithm>

namespace world {
namespace {

constexpr int kLevels = 7;
constexpr int kColumnStep = 1 << (kLevels - 1);

}  // namespace

Raster::Raster(double width_mm, double height_mm, double texel_mm, const Colour &ground)
    : width_mm_(width_mm), height_mm_(height_mm) {
    Level level;
    // So many columns that every copy has half of them exactly.
    level.columns = kColumnStep * static_cast<int>(std::ceil(width_mm / texel_mm / kColumnStep));
    per_mm_ = level.columns / width_mm;
    level.rows = static_cast<int>(std::ceil(height_mm * per_mm_));
    level.texels.resize(3 * static_cast<std::size_t>(level.columns * level.rows));
    for (std::size_t i = 0; i < level.texels.size(); i++) {
        level.texels[i] =
            static_cast<std::uint8_t>(std::lround(255 * std::sqrt(ground.channel[i % 3])));
    }
    levels_.push_back(std::move(level));
}

void Raster::finish() {
    while (levels_.size() < kLevels) {
        const Level &fine = levels_.back();
        Level coarse;
        coarse.columns = fine.columns / 2;
        coarse.rows = (fine.rows + 1) / 2;
        coarse.texels.resize(3 * static_cast<std::size_t>(coarse.columns * coarse.rows));
        for (int y = 0; y < coarse.rows; y++) {
            const int y1 = std::min(2 * y + 1, fine.rows - 1);
            for (int x = 0; x < coarse.columns; x++) {
                const int x1 = 2 * x + 1;
                const auto texel = [&fine](int row, int col, int c) {
                    const double v =
                        fine.texels[static_cast<std::size_t>(3 * (row * fine.columns + col) + c)];
                    return v * v;
                };
                for (int c = 0; c < 3; c++) {
                    const double mean = 0.25 * (texel(2 * y, 2 * x, c) + texel(2 * y, x1, c) +
                                                texel(y1, 2 * x, c) + texel(y1, x1, c));
                    coarse.texels[static_cast<std::size_t>(3 * (y * coarse.columns + x) + c)] =
                        static_cast<std::uint8_t>(std::lround(std::sqrt(mean)));
                }
            }
        }
        levels_.push_back(std::move(coarse));
    }
}

double Raster::at_level(const Level &level, double scale, int channel, double x, double y) const {
    const double xs = x * scale - 0.5;
    const double ys = y * scale - 0.5;
    int xi = static_cast<int>(xs);
    xi -= xs < xi;
    int yi = static_cast<int>(ys);
    yi -= ys < yi;
    const double fx = xs - xi;
    const double fy = ys - yi;
    const auto wrap = [&level](int c) {
        return c < 0 ? c + level.columns : c >= level.columns ? c - level.columns : c;
    };
    const auto bound = [&level](int r) { return r < 0 ? 0 : r >= level.rows ? level.rows - 1 : r; };
    const int x0 = 3 * wrap(xi) + channel;
    const int x1 = 3 * wrap(xi + 1) + channel;
    const std::uint8_t *upper =
        &level.texels[static_cast<std::size_t>(3 * bound(yi) * level.columns)];
    const std::uint8_t *lower =
        &level.texels[static_cast<std::size_t>(3 * bound(yi + 1) * level.columns)];
    const double a = upper[x0] + fx * (upper[x1] - upper[x0]);
    const double b = lower[x0] + fx * (lower[x1] - lower[x0]);
    const double v = (a + fy * (b - a)) * (1 / 255.0);
    return v * v;
}

double Raster::at(int channel, double x_mm, double y_mm, double rms_mm) const {
    x_mm -= width_mm_ * std::floor(x_mm / width_mm_);
    // A level's texel of width w is a filter of rms 0.4 w with its interpolation.
    double rms = rms_mm * per_mm_ * 2.4;
    double scale = per_mm_;
    std::size_t level = 0;
    while (rms > 2 && level + 1 < levels_.size()) {
        rms *= 0.5;
        scale *= 0.5;
        level++;
    }
    const double fine = at_level(levels_[level], scale, channel, x_mm, y_mm);
    if (rms <= 1 || level + 1 >= levels_.size()) {
        return fine;
    }
    return fine +
           (rms - 1) * (at_level(levels_[level + 1], 0.5 * scale, channel, x_mm, y_mm) - fine);
}

}  // namespace world

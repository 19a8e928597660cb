// SPDX-License-Identifier: Apache-2.0
#include "tools/simrig/scene/raster.hpp"

#include <png.h>

#include <algorithm>
#include <array>

#include "tools/simrig/world/document.hpp"

namespace world {
namespace {

constexpr int kLevels = 7;
constexpr int kColumnStep = 1 << (kLevels - 1);
constexpr unsigned kMaxSide = 16384;

// Places all over the unit disk, each of the same share: Vogel's spiral. Their variance a dimension
// is that of the disk, 1 / 4.
constexpr int kDiskPlaces = 64;

std::array<Vec2, kDiskPlaces> disk_places() {
    std::array<Vec2, kDiskPlaces> places{};
    for (int i = 0; i < kDiskPlaces; i++) {
        const double r = std::sqrt((i + 0.5) / kDiskPlaces);
        const double turn = kPi * (3 - std::sqrt(5.0)) * i;
        places[static_cast<std::size_t>(i)] = {r * std::cos(turn), r * std::sin(turn)};
    }
    return places;
}

const std::array<Vec2, kDiskPlaces> kDisk = disk_places();

}  // namespace

Raster::Raster(const std::string &path, Vec2 size_mm)
    : width_mm_(size_mm.x), height_mm_(size_mm.y) {
    png_image image{};
    image.version = PNG_IMAGE_VERSION;
    if (png_image_begin_read_from_file(&image, path.c_str()) == 0) {
        throw BadFile(path, image.message);
    }
    image.format = PNG_FORMAT_RGB;
    Level level;
    level.columns = static_cast<int>(image.width);
    level.rows = static_cast<int>(image.height);
    // Every copy has half of the columns exactly.
    if (image.width % kColumnStep != 0 || image.width > kMaxSide || image.height > kMaxSide) {
        png_image_free(&image);
        throw BadFile(path,
                      "an image must be 64 to 16384 pixels wide in steps of 64, and at most "
                      "16384 high");
    }
    level.texels.resize(PNG_IMAGE_SIZE(image));
    if (png_image_finish_read(&image, nullptr, level.texels.data(), 0, nullptr) == 0) {
        throw BadFile(path, image.message);
    }
    per_mm_ = level.columns / width_mm_;
    levels_.push_back(std::move(level));
    make_copies();
}

void Raster::make_copies() {
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
                        static_cast<std::uint8_t>(std::sqrt(mean) + 0.5);
                }
            }
        }
        levels_.push_back(std::move(coarse));
    }
}

template <class Value>
double Raster::at_level(const Level &level, double scale, int channel, double x, double y,
                        Value value) const {
    const double xs = x * scale - 0.5;
    const double ys = y * scale - 0.5;
    int xi = static_cast<int>(xs);
    xi -= xs < xi;
    int yi = static_cast<int>(ys);
    yi -= ys < yi;
    const double fx = xs - xi;
    const double fy = ys - yi;
    const auto wrap = [&level](int c) {
        if (c < 0) {
            return c + level.columns;
        }
        return c >= level.columns ? c - level.columns : c;
    };
    const auto bound = [&level](int r) { return std::clamp(r, 0, level.rows - 1); };
    const int x0 = 3 * wrap(xi) + channel;
    const int x1 = 3 * wrap(xi + 1) + channel;
    const std::uint8_t *upper =
        &level.texels[static_cast<std::size_t>(3 * bound(yi) * level.columns)];
    const std::uint8_t *lower =
        &level.texels[static_cast<std::size_t>(3 * bound(yi + 1) * level.columns)];
    const double a = value(upper[x0]) + fx * (value(upper[x1]) - value(upper[x0]));
    const double b = value(lower[x0]) + fx * (value(lower[x1]) - value(lower[x0]));
    return a + fy * (b - a);
}

double Raster::at(int channel, double x_mm, double y_mm, double rms_mm) const {
    const auto looked_up = [&](const Level &level, double scale) {
        const double v =
            at_level(level, scale, channel, x_mm, y_mm, [](int root) { return root; }) *
            (1 / 255.0);
        return v * v;
    };
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
    const double fine = looked_up(levels_[level], scale);
    if (rms <= 1 || level + 1 >= levels_.size()) {
        return fine;
    }
    return fine + (rms - 1) * (looked_up(levels_[level + 1], 0.5 * scale) - fine);
}

double Raster::under_disk(int channel, Vec2 middle_mm, const Vec2 (&axes_mm)[2]) const {
    const Vec2 &a = axes_mm[0];
    const Vec2 &b = axes_mm[1];
    // In texels^2: a uniform disk's variance is a quarter of its radius squared.
    const double quarter = 0.25 * per_mm_ * per_mm_;
    const double xx = quarter * (a.x * a.x + b.x * b.x);
    const double yy = quarter * (a.y * a.y + b.y * b.y);
    const double xy = quarter * (a.x * a.y + b.x * b.y);
    const double min = 0.5 * (xx + yy) - std::sqrt(0.25 * (xx - yy) * (xx - yy) + xy * xy);
    // A texel is a sixteenth to an eighth of the disk's radius wide, and the places are a quarter
    // apart. A copy adds width^2 / 4 to the variance, and the finest nothing: it is the picture
    // itself.
    std::size_t level = 0;
    double width2 = 1;
    while (level + 1 < levels_.size() && 16 * width2 <= min) {
        width2 *= 4;
        level++;
    }
    // The rest is left to the places: any square root of the matrix will do.
    const double filter2 = 0.25 * (width2 - 1);
    const double x_x = 2 * std::sqrt(xx - filter2);
    const double y_x = 4 * xy / x_x;
    const double y_y = std::sqrt(std::max(4 * (yy - filter2) - y_x * y_x, 0.0));
    const double per_texel = 1 / per_mm_;
    const Vec2 middle = {middle_mm.x - width_mm_ * std::floor(middle_mm.x / width_mm_),
                         middle_mm.y};
    const Level &copy = levels_[level];
    const double scale = per_mm_ / (1 << level);
    double sum = 0;
    for (const Vec2 &place : kDisk) {
        const double x = middle.x + per_texel * x_x * place.x;
        const double y = middle.y + per_texel * (y_x * place.x + y_y * place.y);
        if (level == 0) {
            const double v = at_level(copy, scale, channel, x, y, [](int root) { return root; });
            sum += v * v;
        } else {
            // Squares before they are joined: the mean is then that of the picture.
            sum += at_level(copy, scale, channel, x, y,
                            [](int root) { return static_cast<double>(root * root); });
        }
    }
    return sum / (255.0 * 255.0 * kDiskPlaces);
}

}  // namespace world

// SPDX-License-Identifier: Apache-2.0
#include "tools/host/formats/colormap.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "core/math.h"

namespace {

struct lab {
    double lightness, a, b;
};

struct linear_rgb {
    double red, green, blue;
};

linear_rgb rgb_of_lab(const lab &colour) {
    const double l = colour.lightness + 0.3963377774 * colour.a + 0.2158037573 * colour.b;
    const double m = colour.lightness - 0.1055613458 * colour.a - 0.0638541728 * colour.b;
    const double s = colour.lightness - 0.0894841775 * colour.a - 1.2914855480 * colour.b;
    const double l3 = l * l * l, m3 = m * m * m, s3 = s * s * s;
    return {4.0767416621 * l3 - 3.3077115913 * m3 + 0.2309699292 * s3,
            -1.2684380046 * l3 + 2.6097574011 * m3 - 0.3413193965 * s3,
            -0.0041960863 * l3 - 0.7034186147 * m3 + 1.7076147010 * s3};
}

bool in_gamut(const linear_rgb &c) {
    return c.red >= 0 && c.red <= 1 && c.green >= 0 && c.green <= 1 && c.blue >= 0 && c.blue <= 1;
}

std::uint8_t srgb_byte(double linear) {
    const double clipped = std::clamp(linear, 0.0, 1.0);
    const double encoded =
        clipped <= 0.0031308 ? 12.92 * clipped : 1.055 * std::pow(clipped, 1 / 2.4) - 0.055;
    return static_cast<std::uint8_t>(std::lround(255 * encoded));
}

lab polar(double lightness, double chroma, double hue_degrees) {
    return {lightness, chroma * std::cos(hue_degrees * MATH_RAD_PER_DEGREE),
            chroma * std::sin(hue_degrees * MATH_RAD_PER_DEGREE)};
}

/// A point of a path before its chroma is limited to the sRGB gamut.
struct target {
    double lightness, chroma, hue_degrees;
};

double chroma_in_gamut(const target &target_colour) {
    double chroma = target_colour.chroma;
    while (chroma > 0 && !in_gamut(rgb_of_lab(
                             polar(target_colour.lightness, chroma, target_colour.hue_degrees)))) {
        chroma -= 0.001;
    }
    return chroma > 0 ? chroma : 0;
}

/// Minimum or mean of each window of 2 half + 1 values, truncated at the ends.
std::vector<double> over_windows(const std::vector<double> &values, std::size_t half, bool mean) {
    std::vector<double> result(values.size());
    for (std::size_t i = 0; i < values.size(); i++) {
        const std::size_t begin = i < half ? 0 : i - half;
        const std::size_t end = i + half < values.size() ? i + half + 1 : values.size();
        double sum = 0, min = values[i];
        for (std::size_t k = begin; k < end; k++) {
            sum += values[k];
            min = values[k] < min ? values[k] : min;
        }
        result[i] = mean ? sum / static_cast<double>(end - begin) : min;
    }
    return result;
}

/// Limits the chroma smoothly: following the corners of the gamut would show as false edges. The
/// mean of window minima never exceeds the limit itself.
std::vector<lab> fit_gamut(const std::vector<target> &targets, std::size_t half_window) {
    std::vector<double> chroma;
    for (const target &target_colour : targets) {
        chroma.push_back(chroma_in_gamut(target_colour));
    }
    chroma = over_windows(over_windows(chroma, half_window, false), half_window, true);
    std::vector<lab> path;
    for (std::size_t i = 0; i < targets.size(); i++) {
        path.push_back(polar(targets[i].lightness, chroma[i], targets[i].hue_degrees));
    }
    return path;
}

double distance(const lab &p, const lab &q) {
    return std::sqrt((p.lightness - q.lightness) * (p.lightness - q.lightness) +
                     (p.a - q.a) * (p.a - q.a) + (p.b - q.b) * (p.b - q.b));
}

/// 256 colours at equal distances along a finely sampled path.
colormap_table walk(const std::vector<lab> &path) {
    std::vector<double> length(path.size(), 0.0);
    for (std::size_t i = 1; i < path.size(); i++) {
        length[i] = length[i - 1] + distance(path[i - 1], path[i]);
    }
    colormap_table table{};
    std::size_t at = 0;
    for (std::size_t i = 0; i < table.size(); i++) {
        const double wanted = length.back() * static_cast<double>(i) / 255.0;
        while (at + 1 < path.size() && length[at + 1] < wanted) {
            at++;
        }
        const linear_rgb c = rgb_of_lab(path[at]);
        table[i] = {srgb_byte(c.red), srgb_byte(c.green), srgb_byte(c.blue)};
    }
    return table;
}

constexpr int path_steps = 1000;

}  // namespace

colormap_table colormap_sequential() {
    std::vector<target> targets;
    for (int i = 0; i <= path_steps; i++) {
        const double t = static_cast<double>(i) / path_steps;
        targets.push_back({0.24 + 0.68 * t, 0.17, 312 - 207 * t});
    }
    return walk(fit_gamut(targets, path_steps / 8));
}

colormap_table colormap_diverging() {
    std::vector<target> targets;
    for (int i = -path_steps; i <= path_steps; i++) {
        const double size = std::fabs(static_cast<double>(i) / path_steps);
        targets.push_back({0.94 - 0.5 * size, 0.17 * size, i < 0 ? 255.0 : 30.0});
    }
    return walk(fit_gamut(targets, path_steps / 16));
}

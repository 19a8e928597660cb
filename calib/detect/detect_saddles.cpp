// SPDX-License-Identifier: Apache-2.0
#include "calib/detect/detect_saddles.hpp"

#include <algorithm>
#include <cmath>

#include "calib/detect/detect_response.hpp"
#include "core/invariant.h"
#include "core/math.h"

namespace calib::detect {

namespace {

constexpr int half_circle = 16;  // samples in half a turn
constexpr double circle_radius_px = 4;
constexpr double min_contrast = 8 * pixel_scale;
// Maximum ratio of the unmirrored to the mirrored energy of the circle: perspective and noise cause
// some.
constexpr double unmirrored_share = 0.3;
constexpr double min_angle_rad = 0.26;  // smallest angle between two edges: 15 degrees

struct circle {
    std::array<direction, half_circle> towards;
    circle() {
        for (int i = 0; i < half_circle; i++) {
            const double angle = MATH_PI * i / half_circle;
            towards[static_cast<size_t>(i)] = {std::cos(angle), std::sin(angle)};
        }
    }
};

const circle unit_circle;

using half_turn = std::array<double, half_circle>;

// The component of the circle's grey levels that is invariant under a half turn. False when the
// rest is too large, as at the end of a line or on an edge.
bool mirrored_part(const plane &level, double x, double y, double radius, half_turn *even) {
    double odd_energy = 0, sum = 0;
    for (size_t i = 0; i < half_circle; i++) {
        const direction &d = unit_circle.towards[i];
        const double ahead = level.between(x + radius * d.x, y + radius * d.y);
        const double behind = level.between(x - radius * d.x, y - radius * d.y);
        (*even)[i] = (ahead + behind) / 2;
        odd_energy += (ahead - behind) * (ahead - behind) / 4;
        sum += (*even)[i];
    }
    const double mean = sum / half_circle;
    double even_energy = 0;
    for (const double value : *even) {
        even_energy += (value - mean) * (value - mean);
    }
    return odd_energy <= unmirrored_share * even_energy;
}

// Angles at which the half turn rises and falls through its middle level; false unless it does each
// exactly once.
bool crossings(const half_turn &even, double middle, double *rising_rad, double *falling_rad) {
    int rises = 0, falls = 0;
    for (size_t i = 0; i < half_circle; i++) {
        const double here = even[i] - middle;
        const double next = even[(i + 1) % half_circle] - middle;
        if ((here < 0) == (next < 0)) {
            continue;
        }
        const double angle =
            (static_cast<double>(i) + here / (here - next)) * MATH_PI / half_circle;
        if (here < 0) {
            rises++;
            *rising_rad = angle;
        } else {
            falls++;
            *falling_rad = angle;
        }
    }
    return rises == 1 && falls == 1;
}

half_turn smoothed(const half_turn &values) {
    half_turn made;
    for (size_t i = 0; i < half_circle; i++) {
        const double before = values[(i + half_circle - 1) % half_circle];
        const double after = values[(i + 1) % half_circle];
        made[i] = (before + 2 * values[i] + after) / 4;
    }
    return made;
}

// The first `max` of those without an earlier one within `nearest_px`: noise can make two peaks of
// one corner.
std::vector<saddle> apart(const plane &level, const std::vector<saddle> &all, size_t max) {
    constexpr double nearest_px = 2.5;
    constexpr int cell_px = 4;
    const int columns = level.width / cell_px + 3;
    std::vector<std::vector<size_t>> cells(static_cast<size_t>(columns) *
                                           static_cast<size_t>(level.height / cell_px + 3));
    std::vector<saddle> kept;
    for (const saddle &next : all) {
        const int column = static_cast<int>(next.x) / cell_px + 1;
        const int row = static_cast<int>(next.y) / cell_px + 1;
        INVARIANT(column >= 1 && column < columns - 1 && row >= 1);
        bool alone = true;
        for (int v = row - 1; v <= row + 1; v++) {
            for (int u = column - 1; u <= column + 1; u++) {
                for (const size_t other : cells[static_cast<size_t>(v * columns + u)]) {
                    alone = alone &&
                            std::hypot(kept[other].x - next.x, kept[other].y - next.y) > nearest_px;
                }
            }
        }
        if (alone && kept.size() < max) {
            cells[static_cast<size_t>(row * columns + column)].push_back(kept.size());
            kept.push_back(next);
        }
    }
    return kept;
}

}  // namespace

std::optional<saddle> saddle_at(const plane &level, double x, double y, double radius) {
    if (!level.holds(x, y, radius + 1)) {
        return std::nullopt;
    }
    half_turn even;
    if (!mirrored_part(level, x, y, radius, &even)) {
        return std::nullopt;
    }
    const half_turn smooth = smoothed(even);
    const auto [darkest, lightest] = std::minmax_element(smooth.begin(), smooth.end());
    saddle found;
    found.x = x;
    found.y = y;
    found.contrast = *lightest - *darkest;
    double rising_rad = 0, falling_rad = 0;
    if (found.contrast < min_contrast ||
        !crossings(smooth, (*lightest + *darkest) / 2, &rising_rad, &falling_rad)) {
        return std::nullopt;
    }
    if (falling_rad < rising_rad) {
        falling_rad += MATH_PI;
    }
    const double opening_rad = falling_rad - rising_rad;
    if (opening_rad < min_angle_rad || opening_rad > MATH_PI - min_angle_rad) {
        return std::nullopt;
    }
    const std::array<double, 4> angles_rad = {rising_rad, falling_rad, rising_rad + MATH_PI,
                                              falling_rad + MATH_PI};
    for (size_t k = 0; k < 4; k++) {
        found.rays[k] = {std::cos(angles_rad[k]), std::sin(angles_rad[k])};
    }
    return found;
}

std::vector<saddle> saddles_of(const plane &level, size_t max) {
    std::vector<saddle> found;
    for (const peak &candidate : saddle_peaks(level)) {
        const std::optional<saddle> checked =
            saddle_at(level, candidate.x, candidate.y, circle_radius_px);
        if (checked) {
            found.push_back(*checked);
        }
    }
    std::stable_sort(found.begin(), found.end(),
                     [](const saddle &a, const saddle &b) { return a.contrast > b.contrast; });
    return apart(level, found, max);
}

}  // namespace calib::detect

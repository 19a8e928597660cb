// SPDX-License-Identifier: Apache-2.0
// Half a turn about a corner maps the image onto itself, whatever its edges look like:
//     grey(centre + d) = grey(centre - d) + 2 slope d
// The centre and the slope of the light are those with the least squares of the difference.
#include "calib/detect/detect_symmetry.hpp"

#include <algorithm>
#include <cmath>

#include "calib/base/linear.hpp"
#include "core/invariant.h"

namespace calib::detect {

namespace {

enum parameter { X, Y, SLOPE_X, SLOPE_Y, COUNT };

using parameters = Eigen::Matrix<double, COUNT, 1>;
using normal_matrix = Eigen::Matrix<double, COUNT, COUNT>;

constexpr int max_rounds = 12;
constexpr int samples_each_way = 12;  // samples along a radius
constexpr double settled_px = 2e-3;
constexpr double farthest_share = 0.5;  // share of the radius that the corner may move
// Largest RMS of what a half turn inverts, over that of what it keeps.
constexpr double max_odd_share = 0.2;
constexpr double min_even = 3;              // grey levels
constexpr double per_steepest = 1 / 2.507;  // blur of a step of height 1, from its steepest slope
constexpr double min_noise = 0.3;           // grey levels
constexpr double min_sigma_px = 0.001;

struct offset {
    double x, y;
};

struct sums {
    normal_matrix A = normal_matrix::Zero();
    parameters gradient = parameters::Zero();
    double odd = 0, even = 0, mean = 0;  // squares of the two parts; sum of the even one
    double steepest = 0;
};

// One of each two opposite offsets within the window.
std::vector<offset> half_window(const corner_guess &guess) {
    std::vector<offset> made;
    const double step = std::max(1.0, guess.radius_px / samples_each_way);
    const int reach = static_cast<int>(guess.radius_px / step);
    for (int v = 0; v <= reach; v++) {
        for (int u = v == 0 ? 1 : -reach; u <= reach; u++) {
            const double x = u * step, y = v * step;
            if (x * x + y * y <= guess.radius_px * guess.radius_px) {
                made.push_back({x, y});
            }
        }
    }
    return made;
}

offset slope_at(const plane &level, double x, double y) {
    return {(level.between(x + 1, y) - level.between(x - 1, y)) / (2.0 * pixel_scale),
            (level.between(x, y + 1) - level.between(x, y - 1)) / (2.0 * pixel_scale)};
}

// Needs the window and two pixels more inside the level.
sums sum_up(const plane &level, const std::vector<offset> &window, const parameters &p) {
    sums made;
    for (const offset &d : window) {
        const double x = p[X] + d.x, y = p[Y] + d.y, mirror_x = p[X] - d.x, mirror_y = p[Y] - d.y;
        const double ahead = level.between(x, y) / pixel_scale;
        const double behind = level.between(mirror_x, mirror_y) / pixel_scale;
        const offset slope = slope_at(level, x, y), back = slope_at(level, mirror_x, mirror_y);
        const double difference = ahead - behind - 2 * (p[SLOPE_X] * d.x + p[SLOPE_Y] * d.y);
        parameters j;
        j << back.x - slope.x, back.y - slope.y, 2 * d.x, 2 * d.y;
        made.A += j * j.transpose();
        made.gradient += j * difference;
        made.odd += difference * difference / 4;
        made.even += (ahead + behind) * (ahead + behind) / 4;
        made.mean += (ahead + behind) / 2;
        made.steepest =
            std::max({made.steepest, std::hypot(slope.x, slope.y), std::hypot(back.x, back.y)});
    }
    const double count = static_cast<double>(window.size());
    made.odd /= count;
    made.mean /= count;
    made.even = std::max(0.0, made.even / count - made.mean * made.mean);
    return made;
}

}  // namespace

std::optional<corner_fit> fit_symmetry(const plane &level, const corner_guess &guess) {
    const std::vector<offset> window = half_window(guess);
    const double farthest_px = farthest_share * guess.radius_px;
    if (window.size() <= 2 * COUNT ||
        !level.holds(guess.x, guess.y, guess.radius_px + farthest_px + 2)) {
        return std::nullopt;
    }
    parameters p = parameters::Zero();
    p[X] = guess.x;
    p[Y] = guess.y;
    sums at = sum_up(level, window, p);
    double last_px = HUGE_VAL;
    for (int round = 0; round < max_rounds && last_px > settled_px; round++) {
        const parameters step = solve_symmetric(at.A, at.gradient);
        p += step;
        if (!p.allFinite() || std::hypot(p[X] - guess.x, p[Y] - guess.y) > farthest_px) {
            return std::nullopt;
        }
        last_px = std::hypot(step[X], step[Y]);
        at = sum_up(level, window, p);
    }
    if (last_px > settled_px || at.even < min_even * min_even ||
        at.odd > max_odd_share * max_odd_share * at.even) {
        return std::nullopt;
    }
    const matrix inverse = inverse_symmetric(at.A);
    const double count = static_cast<double>(window.size());
    // The difference of two pixels has twice their variance.
    const double variance = std::max(4 * at.odd * count / (count - static_cast<double>(COUNT)),
                                     2 * min_noise * min_noise);
    corner_fit fit;
    fit.x = p[X];
    fit.y = p[Y];
    fit.sigma_px =
        std::hypot(std::sqrt(variance * (inverse(X, X) + inverse(Y, Y)) / 2), min_sigma_px);
    INVARIANT(fit.sigma_px > 0);
    fit.contrast = 2 * std::sqrt(at.even);
    fit.blur_px = fit.contrast * per_steepest / at.steepest;
    return fit;
}

}  // namespace calib::detect

// SPDX-License-Identifier: Apache-2.0
// The model, in coordinates (dx, dy) about the corner, with the signed distances d1 and d2 from the
// two edges:
//     grey = base + slope_x dx + slope_y dy + half_contrast E(d1 / blur) E(d2 / blur)
// where E(t) = erf(t / sqrt 2) is a step blurred by a Gaussian of standard deviation 1. The product
// is exact for perpendicular edges. At other angles it is still symmetric about the corner, as is
// the image, so the position is unbiased.
#include "calib/detect/detect_fit.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "calib/base/linear.hpp"
#include "core/invariant.h"
#include "core/math.h"

namespace calib::detect {

namespace {

enum parameter { X, Y, ANGLE_A, ANGLE_B, BLUR, BASE, SLOPE_X, SLOPE_Y, HALF_CONTRAST, COUNT };

using vector = Eigen::Matrix<double, COUNT, 1>;
using matrix = Eigen::Matrix<double, COUNT, COUNT>;

constexpr int max_rounds = 16;
constexpr double settled_px = 5e-4;
constexpr double nearly_settled_px = 0.02;
constexpr double settled_gain = 1e-3;
constexpr size_t fewest_pixels = 24;
constexpr double min_window_share = 0.6;  // share of the window that must be inside the image
constexpr double farthest_share = 0.5;    // share of the radius that the corner may move
constexpr double max_misfit = 0.3;
constexpr double small_misfit = 0.1;     // reported as 0: the noise need not be measured
constexpr double min_half_contrast = 3;  // grey levels
constexpr double min_blur_px = 0.289;    // blur of a sharp image, from the extent of a pixel
// Rounding to integer grey levels is not noise if it is the only error; no pixel grid is exact
// either.
constexpr double min_noise = 0.3;  // grey levels
constexpr double min_sigma_px = 0.001;

// E(t) and its derivative, linearly interpolated in steps of 1/256: accurate to 2e-6.
class step_table {
  public:
    step_table() {
        for (size_t i = 0; i < size; i++) {
            const double t = static_cast<double>(i) / per_unit;
            value_[i] = std::erf(t * std::sqrt(0.5));
            slope_[i] = std::sqrt(2 / MATH_PI) * std::exp(-t * t / 2);
        }
    }
    void at(double t, double *value, double *slope) const {
        const double place = std::min(std::fabs(t) * per_unit, size - 2.0);
        const size_t i = static_cast<size_t>(place);
        const double f = place - static_cast<double>(i);
        const double size_of = value_[i] + f * (value_[i + 1] - value_[i]);
        *value = t < 0 ? -size_of : size_of;
        *slope = slope_[i] + f * (slope_[i + 1] - slope_[i]);
    }

  private:
    static constexpr size_t size = 1282;  // covers arguments up to 5
    static constexpr double per_unit = 256;
    std::array<double, size> value_, slope_;
};

const step_table steps;

struct pixel {
    double dx, dy, grey;  // relative to the guess
};

struct window {
    std::vector<pixel> pixels;
    double inside_share = 0;
};

window pixels_near(const plane &level, const corner_guess &guess) {
    window made;
    const int reach = static_cast<int>(guess.radius_px);
    const int cx = static_cast<int>(std::lround(guess.x));
    const int cy = static_cast<int>(std::lround(guess.y));
    const double ax = std::cos(guess.a.angle_rad), ay = std::sin(guess.a.angle_rad);
    const double bx = std::cos(guess.b.angle_rad), by = std::sin(guess.b.angle_rad);
    int wanted = 0;
    for (int y = cy - reach; y <= cy + reach; y++) {
        for (int x = cx - reach; x <= cx + reach; x++) {
            const double dx = x - guess.x, dy = y - guess.y;
            if (dx * dx + dy * dy > guess.radius_px * guess.radius_px ||
                (std::fabs(ax * dy - ay * dx) > guess.band_px &&
                 std::fabs(bx * dy - by * dx) > guess.band_px)) {
                continue;
            }
            wanted++;
            if (x >= 0 && y >= 0 && x < level.width && y < level.height) {
                made.pixels.push_back({dx, dy, level.row(y)[x] / double{pixel_scale}});
            }
        }
    }
    made.inside_share =
        wanted == 0 ? 0 : static_cast<double>(made.pixels.size()) / static_cast<double>(wanted);
    return made;
}

struct normal_equations {
    matrix A = matrix::Zero();
    vector gradient = vector::Zero();
    double square_sum = 0;
};

// Sums over all pixels for the parameters `p`; X and Y are relative to the guess.
normal_equations sum_up(const window &from, const corner_guess &guess, const vector &p) {
    normal_equations sums;
    const double ax = std::cos(p[ANGLE_A]), ay = std::sin(p[ANGLE_A]);
    const double bx = std::cos(p[ANGLE_B]), by = std::sin(p[ANGLE_B]);
    const double per_blur = 1 / p[BLUR], c = p[HALF_CONTRAST];
    for (const pixel &at : from.pixels) {
        const double dx = at.dx - p[X], dy = at.dy - p[Y];
        const double along_a = ax * dx + ay * dy, along_b = bx * dx + by * dy;
        const double bend_a = guess.a.curvature_px * along_a;
        const double bend_b = guess.b.curvature_px * along_b;
        const double d1 = ax * dy - ay * dx - bend_a * along_a / 2;
        const double d2 = -(bx * dy - by * dx - bend_b * along_b / 2);
        double e1, e2, s1, s2;
        steps.at(d1 * per_blur, &e1, &s1);
        steps.at(d2 * per_blur, &e2, &s2);
        const double w1 = c * s1 * e2 * per_blur, w2 = c * e1 * s2 * per_blur;
        std::array<double, COUNT> j;
        j[X] = w1 * (ay + bend_a * ax) - w2 * (by + bend_b * bx) - p[SLOPE_X];
        j[Y] = -w1 * (ax - bend_a * ay) + w2 * (bx - bend_b * by) - p[SLOPE_Y];
        j[ANGLE_A] = -w1 * along_a;
        j[ANGLE_B] = w2 * along_b;
        j[BLUR] = -(w1 * d1 + w2 * d2) * per_blur;
        j[BASE] = 1;
        j[SLOPE_X] = dx;
        j[SLOPE_Y] = dy;
        j[HALF_CONTRAST] = e1 * e2;
        const double model = p[BASE] + p[SLOPE_X] * dx + p[SLOPE_Y] * dy + c * j[HALF_CONTRAST];
        const double residual = at.grey - model;
        sums.square_sum += residual * residual;
        for (int row = 0; row < COUNT; row++) {
            const double factor = j[static_cast<size_t>(row)];
            for (int column = 0; column <= row; column++) {
                sums.A(column, row) += factor * j[static_cast<size_t>(column)];
            }
            sums.gradient[row] += factor * residual;
        }
    }
    return sums;
}

double model_at(const pixel &at, const corner_guess &guess, const vector &p) {
    const double ax = std::cos(p[ANGLE_A]), ay = std::sin(p[ANGLE_A]);
    const double bx = std::cos(p[ANGLE_B]), by = std::sin(p[ANGLE_B]);
    const double dx = at.dx - p[X], dy = at.dy - p[Y];
    const double along_a = ax * dx + ay * dy, along_b = bx * dx + by * dy;
    double e1, e2, ignored;
    steps.at((ax * dy - ay * dx - guess.a.curvature_px * along_a * along_a / 2) / p[BLUR], &e1,
             &ignored);
    steps.at((by * dx - bx * dy + guess.b.curvature_px * along_b * along_b / 2) / p[BLUR], &e2,
             &ignored);
    return p[BASE] + p[SLOPE_X] * dx + p[SLOPE_Y] * dy + p[HALF_CONTRAST] * e1 * e2;
}

vector start_of(const window &from, const corner_guess &guess) {
    const auto darker = [](const pixel &a, const pixel &b) { return a.grey < b.grey; };
    const auto [dark, light] = std::minmax_element(from.pixels.begin(), from.pixels.end(), darker);
    vector p = vector::Zero();
    p[ANGLE_A] = guess.a.angle_rad;
    p[ANGLE_B] = guess.b.angle_rad;
    p[BLUR] = guess.blur_px;
    p[BASE] = (dark->grey + light->grey) / 2;
    p[HALF_CONTRAST] = (light->grey - dark->grey) / 2 * (guess.light_between ? 1 : -1);
    return p;
}

bool plausible(const vector &p, const corner_guess &guess) {
    return p.allFinite() && p[BLUR] >= min_blur_px && p[BLUR] <= guess.radius_px &&
           std::hypot(p[X], p[Y]) <= farthest_share * guess.radius_px &&
           (p[HALF_CONTRAST] > 0) == guess.light_between;
}

// Variance of the noise from the differences of neighbours in a row, in which a misfit, which is
// smooth, cancels.
double noise_variance(const window &from, const corner_guess &guess, const vector &p) {
    double squares = 0;
    int count = 0;
    for (size_t i = 1; i < from.pixels.size(); i++) {
        const pixel &before = from.pixels[i - 1], &at = from.pixels[i];
        if (at.dy == before.dy && at.dx - before.dx < 1.5) {
            const double change =
                at.grey - before.grey - (model_at(at, guess, p) - model_at(before, guess, p));
            squares += change * change;
            count++;
        }
    }
    return count == 0 ? 0 : squares / (2 * count);
}

// Levenberg's method; false when it leaves the plausible range.
bool solve(const window &from, const corner_guess &guess, vector *p, normal_equations *sums) {
    double damping = 1e-3, last_step_px = HUGE_VAL;
    INVARIANT(!from.pixels.empty() && (*p)[BLUR] > 0);
    *sums = sum_up(from, guess, *p);
    for (int round = 0; round < max_rounds; round++) {
        matrix damped = sums->A.selfadjointView<Eigen::Upper>();
        damped.diagonal() *= 1 + damping;
        vector step = solve_symmetric(damped, sums->gradient);
        step[BLUR] = std::clamp(step[BLUR], -0.4 * (*p)[BLUR], 0.8 * (*p)[BLUR]);
        // The gain of the step in units of the noise: below what could be measured.
        const double variance = sums->square_sum / static_cast<double>(from.pixels.size());
        if (std::fabs(step[X]) + std::fabs(step[Y]) < settled_px ||
            step.dot(sums->gradient) < settled_gain * variance) {
            return true;
        }
        vector tried = *p + step;
        tried[BLUR] = std::max(tried[BLUR], min_blur_px);
        if (!plausible(tried, guess)) {
            damping *= 10;
            continue;
        }
        const normal_equations next = sum_up(from, guess, tried);
        if (next.square_sum > sums->square_sum * (1 + 1e-9)) {
            damping *= 10;
            continue;
        }
        damping *= 0.1;
        last_step_px = std::hypot(step[X], step[Y]);
        *p = tried;
        *sums = next;
    }
    // Overexposed edges do not have the model's shape, so convergence is slow.
    return last_step_px < nearly_settled_px;
}

}  // namespace

std::optional<corner_fit> fit_corner(const plane &level, const corner_guess &guess) {
    const window from = pixels_near(level, guess);
    if (from.pixels.size() < fewest_pixels || from.inside_share < min_window_share) {
        return std::nullopt;
    }
    vector p = start_of(from, guess);
    normal_equations sums;
    if (!plausible(p, guess) || !solve(from, guess, &p, &sums)) {
        return std::nullopt;
    }
    const double freedom = static_cast<double>(from.pixels.size()) - static_cast<double>(COUNT);
    const double half_contrast = std::fabs(p[HALF_CONTRAST]);
    const double residual = std::sqrt(sums.square_sum / freedom);
    const matrix whole = sums.A.selfadjointView<Eigen::Upper>();
    const matrix inverse = inverse_square(whole);
    const double shape = (inverse(X, X) + inverse(Y, Y)) / 2;
    if (half_contrast < min_half_contrast || !(shape > 0)) {
        return std::nullopt;
    }
    corner_fit fit;
    // A corner in strong noise is a corner nevertheless.
    const double square = residual * residual;
    const double ignored = small_misfit * half_contrast;
    const double noise = square > ignored * ignored ? noise_variance(from, guess, p) : square;
    fit.misfit = std::sqrt(std::max(0.0, square - noise)) / half_contrast;
    if (fit.misfit > max_misfit) {
        return std::nullopt;
    }
    fit.x = guess.x + p[X];
    fit.y = guess.y + p[Y];
    fit.sigma_px = std::hypot(std::max(residual, min_noise) * std::sqrt(shape), min_sigma_px);
    INVARIANT(fit.sigma_px > 0);
    fit.blur_px = p[BLUR];
    fit.contrast = 2 * half_contrast;
    return fit;
}

}  // namespace calib::detect

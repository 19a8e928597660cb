// SPDX-License-Identifier: Apache-2.0
#include "tools/simrig/scene/board.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

namespace world {
namespace {

// Four rows of four modules, first row in the highest bits, 1 white: OpenCV's DICT_4X4_50.
constexpr std::uint16_t kMarkers[50] = {
    0xB532, 0x0F9A, 0x332D, 0x9946, 0x549E, 0x79CD, 0x9E2E, 0xC4F2, 0xFEDA, 0xCF56,
    0xF991, 0x11A7, 0x0EB7, 0x2A0F, 0x24B1, 0x263E, 0x4665, 0x6600, 0x6C5E, 0x76AF,
    0x868B, 0xB02B, 0xCCD5, 0xDD82, 0xFE47, 0x9471, 0xACE4, 0xA554, 0x2123, 0x346F,
    0x4415, 0x57B2, 0x9ECF, 0xF0CB, 0x08AE, 0x0929, 0x1875, 0x04FF, 0x0DF6, 0x1C5A,
    0x1718, 0x2A28, 0x328C, 0x38B2, 0x24E8, 0x2EEB, 0x2D3F, 0x4B64, 0x502E, 0x5013};

// A Gaussian as samples of equal distance up to kReach rms aside: weights of the middle one and of
// each on one side.
constexpr double kReach = 3;
constexpr int kMaxAside = 12;
using Weights = std::array<double, kMaxAside + 1>;

Weights sampled_gaussian(int aside) {
    Weights weights{};
    double sum = 0;
    for (int i = 0; i <= aside; i++) {
        const double off = kReach * i / aside;
        weights[static_cast<std::size_t>(i)] = std::exp(-0.5 * off * off);
        sum += (i == 0 ? 1 : 2) * weights[static_cast<std::size_t>(i)];
    }
    for (double &weight : weights) {
        weight /= sum;
    }
    return weights;
}

std::array<Weights, kMaxAside + 1> all_weights() {
    std::array<Weights, kMaxAside + 1> all{};
    all[0] = {1};
    // Three points of the quadrature: variance and fourth moment are right.
    all[1] = {4.0 / 6, 1.0 / 6};
    for (int aside = 2; aside <= kMaxAside; aside++) {
        all[static_cast<std::size_t>(aside)] = sampled_gaussian(aside);
    }
    return all;
}

const std::array<Weights, kMaxAside + 1> kWeights = all_weights();

// A box with a Gaussian around it, in squares or modules. Next to the box a narrow Gaussian is
// three points; a wide one is samples half a box apart: what such a comb adds lies beyond twice the
// frequency that the box lets through.
class Filter {
  public:
    Filter(double half, double spot) : half_(half) {
        if (spot <= 0) {
            return;
        }
        const bool wide = spot >= 0.7 * half;
        aside_ = wide ? int(std::min(std::ceil(kReach * spot / half), double(kMaxAside))) : 1;
        step_ = wide ? kReach * spot / aside_ : std::sqrt(3.0) * spot;
    }

    template <class Mean>
    double apply(double x, Mean mean) const {
        const Weights &weights = kWeights[static_cast<std::size_t>(aside_)];
        double sum = weights[0] * mean(x);
        for (int i = 1; i <= aside_; i++) {
            sum +=
                weights[static_cast<std::size_t>(i)] * (mean(x - step_ * i) + mean(x + step_ * i));
        }
        return sum;
    }
    double half() const { return half_; }
    double reach() const { return half_ + step_ * aside_; }
    Filter scaled(double factor) const {
        Filter other = *this;
        other.half_ *= factor;
        other.step_ *= factor;
        return other;
    }

  private:
    double half_, step_ = 0;
    int aside_ = 0;
};

// Part of the filter around x that lies in [low, high].
double covered(double x, const Filter &filter, double low, double high) {
    const double half = filter.half(), reach = filter.reach();
    if (x - reach >= low && x + reach <= high) {
        return 1;
    }
    if (x + reach <= low || x - reach >= high) {
        return 0;
    }
    return filter.apply(x, [=](double at) {
        const double part = std::min(at + half, high) - std::max(at - half, low);
        return std::clamp(part / (2 * half), 0.0, 1.0);
    });
}

// Integral of the wave that is +1 in [0, 1), -1 in [1, 2), and so on.
double wave_integral(double x) {
    const double m = x - 2 * std::floor(0.5 * x);
    return 1 - std::fabs(m - 1);
}

// Its mean under the filter, and 0 beyond 0 and `end`.
double wave_mean(double x, const Filter &filter, double end) {
    const double half = filter.half(), reach = filter.reach();
    const double square = std::floor(x - reach);
    if (square >= 0 && x + reach <= end && x + reach <= square + 1) {
        return std::fmod(square, 2) == 0 ? 1 : -1;
    }
    return filter.apply(x, [=](double at) {
        const double high = std::clamp(at + half, 0.0, end);
        const double low = std::clamp(at - half, 0.0, end);
        return (wave_integral(high) - wave_integral(low)) / (2 * half);
    });
}

// Whether a module of a marker is white; those of its border are not.
bool is_white(std::uint16_t bits, int column, int row) {
    const bool rim = column == 0 || row == 0 || column == 5 || row == 5;
    return !rim && ((bits >> (15 - 4 * (row - 1) - (column - 1))) & 1) != 0;
}

// Ink of the marker in the square around a place, if there is one there.
double marker_ink(const Board &board, double x, double y, const Filter &filter) {
    const int column = static_cast<int>(std::floor(x));
    const int row = static_cast<int>(std::floor(y));
    if (column < 0 || row < 0 || column >= board.columns || row >= board.rows ||
        column % 2 == row % 2) {
        return 0;
    }
    // White squares before this one, row by row.
    const int number = (row * board.columns + column) / 2;
    const double module = board.marker_mm / board.square_mm / 6;
    const double mx = (x - column - 0.5) / module + 3;
    const double my = (y - row - 0.5) / module + 3;
    const Filter h = filter.scaled(1 / module);
    const std::uint16_t bits = kMarkers[number % 50];
    double ink = 0;
    const auto bound = [](double v) { return std::clamp(static_cast<int>(std::floor(v)), 0, 5); };
    for (int j = bound(my - h.reach()); j <= bound(my + h.reach()); j++) {
        const double cover_y = covered(my, h, j, j + 1);
        for (int i = bound(mx - h.reach()); i <= bound(mx + h.reach()); i++) {
            ink += is_white(bits, i, j) ? 0 : cover_y * covered(mx, h, i, i + 1);
        }
    }
    return ink;
}

}  // namespace

double board_white(const Board &board, Vec2 place_mm, double half_mm, double spot_mm) {
    const double x = place_mm.x / board.square_mm + 0.5 * board.columns;
    const double y = place_mm.y / board.square_mm + 0.5 * board.rows;
    const Filter filter(std::max(half_mm / board.square_mm, 1e-9), spot_mm / board.square_mm);
    const double on = covered(x, filter, 0, board.columns) * covered(y, filter, 0, board.rows);
    if (on <= 0) {
        return 1;
    }
    const double black =
        0.5 * (on + wave_mean(x, filter, board.columns) * wave_mean(y, filter, board.rows));
    if (board.marker_mm <= 0) {
        return 1 - black;
    }
    return 1 - std::min(1.0, black + marker_ink(board, x, y, filter));
}

}  // namespace world

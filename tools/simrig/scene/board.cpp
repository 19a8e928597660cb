// SPDX-License-Identifier: Apache-2.0
#include "tools/simrig/scene/board.hpp"

#include <algorithm>
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

// A box with a Gaussian around it, in squares or modules. The Gaussian is three of its
// quadrature's points: its variance and fourth moment are right.
struct Filter {
    double half;
    double spot;

    template <class Mean>
    double apply(double x, Mean mean) const {
        if (spot <= 0) {
            return mean(x);
        }
        const double off = 1.7320508075688772 * spot;
        return (4 * mean(x) + mean(x - off) + mean(x + off)) / 6;
    }
    double reach() const { return half + 1.7320508075688772 * spot; }
};

// Part of the filter around x that lies in [low, high].
double covered(double x, const Filter &filter, double low, double high) {
    const double half = filter.half;
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
    const double half = filter.half;
    return filter.apply(x, [=](double at) {
        const double high = std::clamp(at + half, 0.0, end);
        const double low = std::clamp(at - half, 0.0, end);
        return (wave_integral(high) - wave_integral(low)) / (2 * half);
    });
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
    const Filter h = {filter.half / module, filter.spot / module};
    const std::uint16_t bits = kMarkers[number % 50];
    double ink = 0;
    const auto bound = [](double v) { return std::clamp(static_cast<int>(std::floor(v)), 0, 5); };
    for (int j = bound(my - h.reach()); j <= bound(my + h.reach()); j++) {
        const double cover_y = covered(my, h, j, j + 1);
        for (int i = bound(mx - h.reach()); i <= bound(mx + h.reach()); i++) {
            const bool rim = i == 0 || j == 0 || i == 5 || j == 5;
            const bool white = !rim && ((bits >> (15 - 4 * (j - 1) - (i - 1))) & 1) != 0;
            ink += white ? 0 : cover_y * covered(mx, h, i, i + 1);
        }
    }
    return ink;
}

}  // namespace

double board_white(const Board &board, Vec2 place_mm, double half_mm, double spot_mm) {
    const double x = place_mm.x / board.square_mm + 0.5 * board.columns;
    const double y = place_mm.y / board.square_mm + 0.5 * board.rows;
    const Filter filter = {std::max(half_mm / board.square_mm, 1e-9), spot_mm / board.square_mm};
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

// SPDX-License-Identifier: Apache-2.0
#include "calib/detect/detect_links.hpp"

#include <algorithm>
#include <cmath>

#include "core/invariant.h"

namespace calib::detect {

namespace {

// Larger squares are found on a smaller pyramid level.
constexpr double farthest_px = 72;
constexpr int cell_px = 24;
constexpr double sideways_share = 0.27;  // a ray may miss its neighbour by 15 degrees
constexpr double min_contrast_share = 0.2;
constexpr size_t max_tried = 6;  // neighbours along one ray
constexpr std::array<double, 5> places_along = {0.25, 0.38, 0.5, 0.62, 0.75};

struct neighbour {
    double distance_px = 0;
    int index = -1, ray = -1;
};

// Saddles bucketed by square cells of the level, for fast neighbour search.
class cell_index {
  public:
    cell_index(const plane &level, const std::vector<saddle> &saddles)
        : columns_(level.width / cell_px + 1), rows_(level.height / cell_px + 1) {
        cells_.resize(static_cast<size_t>(columns_) * static_cast<size_t>(rows_));
        for (size_t i = 0; i < saddles.size(); i++) {
            cells_[at(cell_of(saddles[i].x), cell_of(saddles[i].y))].push_back(static_cast<int>(i));
        }
    }

    template <class Visit>
    void near(const saddle &from, Visit visit) const {
        const int reach = static_cast<int>(farthest_px) / cell_px + 1;
        const int column = cell_of(from.x), row = cell_of(from.y);
        for (int v = std::max(0, row - reach); v <= std::min(rows_ - 1, row + reach); v++) {
            for (int u = std::max(0, column - reach); u <= std::min(columns_ - 1, column + reach);
                 u++) {
                for (const int index : cells_[at(u, v)]) {
                    visit(index);
                }
            }
        }
    }

  private:
    static int cell_of(double px) { return static_cast<int>(px) / cell_px; }
    size_t at(int column, int row) const {
        INVARIANT(column >= 0 && column < columns_ && row >= 0 && row < rows_);
        return static_cast<size_t>(row) * static_cast<size_t>(columns_) +
               static_cast<size_t>(column);
    }
    int columns_, rows_;
    std::vector<std::vector<int>> cells_;
};

bool along(const direction &ray, double dx, double dy) {
    const double forward = ray.x * dx + ray.y * dy;
    const double sideways = std::fabs(ray.x * dy - ray.y * dx);
    return forward > 0 && sideways <= sideways_share * forward;
}

std::array<std::vector<neighbour>, 4> neighbours_of(const std::vector<saddle> &saddles,
                                                    const cell_index &cells, size_t index,
                                                    double nearest_px) {
    std::array<std::vector<neighbour>, 4> by_ray;
    const saddle &from = saddles[index];
    INVARIANT(index < saddles.size());
    cells.near(from, [&](int other) {
        const saddle &to = saddles[static_cast<size_t>(other)];
        const double dx = to.x - from.x, dy = to.y - from.y;
        const double square = dx * dx + dy * dy;
        if (square < nearest_px * nearest_px || square > farthest_px * farthest_px) {
            return;
        }
        for (size_t ray = 0; ray < 4; ray++) {
            const int back = returning_ray(from, ray, to);
            if (back >= 0) {
                by_ray[ray].push_back({std::sqrt(square), other, back});
            }
        }
    });
    for (std::vector<neighbour> &list : by_ray) {
        std::sort(list.begin(), list.end(), [](const neighbour &a, const neighbour &b) {
            return a.distance_px != b.distance_px ? a.distance_px < b.distance_px
                                                  : a.index < b.index;
        });
        list.resize(std::min(list.size(), max_tried));
    }
    return by_ray;
}

}  // namespace

int returning_ray(const saddle &from, size_t ray, const saddle &to) {
    const double dx = to.x - from.x, dy = to.y - from.y;
    if (!along(from.rays[ray], dx, dy)) {
        return -1;
    }
    // Seen from the other end, light and dark are swapped.
    for (size_t back = 1 - ray % 2; back < 4; back += 2) {
        if (along(to.rays[back], -dx, -dy)) {
            return static_cast<int>(back);
        }
    }
    return -1;
}

bool edge_between(const plane &level, const saddle &from, size_t ray, const saddle &to) {
    const double dx = to.x - from.x, dy = to.y - from.y;
    const double length = std::hypot(dx, dy);
    const double aside = std::clamp(0.12 * length, 1.0, 3.0);
    const double across_x = -dy / length * aside, across_y = dx / length * aside;
    const double towards_light = ray % 2 == 0 ? 1 : -1;
    const double min = min_contrast_share * std::min(from.contrast, to.contrast);
    for (const double share : places_along) {
        const double x = from.x + share * dx, y = from.y + share * dy;
        if (!level.holds(x, y, aside + 1)) {
            return false;
        }
        const double step =
            level.between(x + across_x, y + across_y) - level.between(x - across_x, y - across_y);
        if (step * towards_light < min) {
            return false;
        }
    }
    return true;
}

std::vector<saddle_links> links_of(const plane &level, const std::vector<saddle> &saddles,
                                   double nearest_px) {
    const cell_index cells(level, saddles);
    std::vector<saddle_links> links(saddles.size());
    for (size_t i = 0; i < saddles.size(); i++) {
        const auto by_ray = neighbours_of(saddles, cells, i, nearest_px);
        for (size_t ray = 0; ray < 4; ray++) {
            for (const neighbour &near : by_ray[ray]) {
                if (edge_between(level, saddles[i], ray,
                                 saddles[static_cast<size_t>(near.index)])) {
                    links[i][ray] = {near.index, near.ray};
                    break;
                }
            }
        }
    }
    const std::vector<saddle_links> wishes = links;
    INVARIANT(wishes.size() == saddles.size());
    for (size_t i = 0; i < links.size(); i++) {
        for (size_t ray = 0; ray < 4; ray++) {
            link &own = links[i][ray];
            if (own.to < 0) {
                continue;
            }
            const link &other = wishes[static_cast<size_t>(own.to)][static_cast<size_t>(own.ray)];
            if (other.to != static_cast<int>(i) || other.ray != static_cast<int>(ray)) {
                own = link();
            }
        }
    }
    return links;
}

}  // namespace calib::detect

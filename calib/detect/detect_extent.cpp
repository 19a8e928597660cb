// SPDX-License-Identifier: Apache-2.0
#include "calib/detect/detect_extent.hpp"

#include <algorithm>
#include <optional>

namespace calib::detect {

namespace {

// Of the difference between two neighbours on the board: two squares beyond it that differ as much
// continue the pattern; and the share of such neighbours along a side.
constexpr double min_contrast_share = 0.4, min_side_share = 0.75;
// The same where a shadow begins: it darkens both colours by one factor, which keeps the ratio of
// difference and sum; a share of that ratio on the board.
constexpr double min_contrast_in_shadow = 0.1, min_ratio_in_shadow = 0.6;
constexpr int fewest_pairs = 3;

// A side of a grid. Line 0 is the outermost line of corners, line 1 the next one inside.
class side_of_grid {
  public:
    side_of_grid(const grid &found, const refined_grid &refined, int side)
        : found_(found), refined_(refined), side_(side) {}

    int length() const { return side_ % 2 == 0 ? found_.columns : found_.rows; }
    int lines() const { return side_ % 2 == 0 ? found_.rows : found_.columns; }
    const refined_corner &at(int along, int line) const {
        const int inside = side_ < 2 ? line : lines() - 1 - line;
        const int row = side_ % 2 == 0 ? inside : along, column = side_ % 2 == 0 ? along : inside;
        return refined_.corners[static_cast<size_t>(row * found_.columns + column)];
    }
    // Mean grey level in the middle of the square that begins at corner `along` and is centred
    // `beyond` squares outside line 0.
    std::optional<double> middle(const plane &image, int along, double beyond) const {
        double sum = 0;
        for (const double out : {beyond - reach, beyond, beyond + reach}) {
            const std::optional<point> first = outside(along, out), next = outside(along + 1, out);
            if (!first || !next) {
                return std::nullopt;
            }
            for (const double share : {0.5 - reach, 0.5, 0.5 + reach}) {
                const double x = first->x + share * (next->x - first->x);
                const double y = first->y + share * (next->y - first->y);
                if (!image.holds(x, y, 0)) {
                    return std::nullopt;
                }
                sum += image.between(x, y) / 9;
            }
        }
        return sum;
    }

  private:
    struct point {
        double x, y;
    };
    // Distance of the outer samples from the middle of a square, in squares.
    static constexpr double reach = 0.2;
    // The point on the line through corner `along`, `beyond` squares outside line 0. Where noise
    // hid the corner of line 0, the two next ones inside show it.
    std::optional<point> outside(int along, double beyond) const {
        const bool hidden = !at(along, 0).found && lines() > 2;
        return outside_of(along, hidden ? 1 : 0, beyond + (hidden ? 1 : 0));
    }
    // Distances shrink or grow in perspective: a third corner shows how much.
    std::optional<point> outside_of(int along, int line, double beyond) const {
        const refined_corner &a = at(along, line), &b = at(along, line + 1);
        const refined_corner &c = at(along, std::min(line + 2, lines() - 1));
        if (!a.found || !b.found) {
            return std::nullopt;
        }
        const double bend = lines() > line + 2 && c.found ? beyond * (beyond + 1) / 2 : 0;
        return point{a.x + beyond * (a.x - b.x) + bend * (a.x - 2 * b.x + c.x),
                     a.y + beyond * (a.y - b.y) + bend * (a.y - 2 * b.y + c.y)};
    }
    const grid &found_;
    const refined_grid &refined_;
    int side_;
};

bool continues(const plane &image, const side_of_grid &side) {
    int pairs = 0, alike = 0;
    for (int along = 0; along + 2 < side.length(); along++) {
        const auto last = side.middle(image, along, 0.5),
                   last_next = side.middle(image, along + 1, 0.5);
        const auto next = side.middle(image, along, 1.5),
                   next_next = side.middle(image, along + 1, 1.5);
        if (!last || !last_next || !next || !next_next) {
            continue;
        }
        // Colours alternate from line to line.
        const double known = *last - *last_next, expected = *next_next - *next;
        const double share = known != 0 ? expected / known : 0;
        const double ratio_share = share * (*last + *last_next) / (*next + *next_next + 1);
        pairs++;
        alike += share >= min_contrast_share ||
                 (share >= min_contrast_in_shadow && ratio_share >= min_ratio_in_shadow);
    }
    return pairs >= fewest_pairs && alike >= min_side_share * pairs;
}

}  // namespace

bool outer_lines_measured(const grid &found, const refined_grid &refined) {
    for (int number = 0; number < 4; number++) {
        const side_of_grid side(found, refined, number);
        int measured = 0;
        for (int along = 0; along < side.length(); along++) {
            measured += side.at(along, 0).found ? 1 : 0;
        }
        if (2 * measured < side.length()) {
            return false;
        }
    }
    return true;
}

bool squares_continue(const plane &image, const grid &found, const refined_grid &refined) {
    for (int side = 0; side < 4; side++) {
        if (continues(image, side_of_grid(found, refined, side))) {
            return true;
        }
    }
    return false;
}

}  // namespace calib::detect

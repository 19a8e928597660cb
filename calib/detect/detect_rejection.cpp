// SPDX-License-Identifier: Apache-2.0
#include "calib/detect/detect_rejection.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "calib/base/sentence.hpp"

namespace calib::detect {

namespace {

constexpr double max_blur_share = 0.35;  // largest blur, as a share of the side of a square
// From here on blur is the likely reason for missing corners.
constexpr double doubtful_blur_share = 0.25;
constexpr int white_grey = 252, dark_grey = 40;
constexpr double max_white_share = 0.4, max_dark_share = 0.995;
constexpr double blurred_px =
    4;  // the image is blurred when its sharpest edges are wider than this
constexpr int fewest_corners = 9;  // a smaller grid is assumed to be texture

// Where one more line of corners would begin, before the first or after the last corner of a row.
bool next_is_outside(const plane &level, const saddle &inner, const saddle &outer) {
    // The neighbourhood of a corner ends half a square farther.
    const double x = outer.x + 1.3 * (outer.x - inner.x);
    const double y = outer.y + 1.3 * (outer.y - inner.y);
    return x < 0 || y < 0 || x > level.width - 1 || y > level.height - 1;
}

bool touches_border(const plane &level, const grid &found) {
    for (int row = 0; row < found.rows; row++) {
        for (int column = 0; column < found.columns; column++) {
            for (const auto &[u, v] : {std::pair{1, 0}, {0, 1}, {-1, 0}, {0, -1}}) {
                if (found.has(column, row) && found.has(column - u, row - v) &&
                    !found.has(column + u, row + v) &&
                    next_is_outside(level, found.at(column - u, row - v).at,
                                    found.at(column, row).at)) {
                    return true;
                }
            }
        }
    }
    return false;
}

std::array<double, 256> shares_of_greys(const plane &image) {
    std::array<double, 256> shares{};
    for (const uint16_t pixel : image.pixels) {
        shares[pixel / pixel_scale] += 1.0 / static_cast<double>(image.pixels.size());
    }
    return shares;
}

// Standard deviation of the blur of the steepest edges, from their slope relative to the image's
// contrast; 0 when there is no contrast.
double steepest_edge_blur_px(const std::vector<plane> &levels) {
    const size_t level = std::min<size_t>(2, levels.size() - 1);
    const plane &image = levels[level];
    std::vector<int> slopes, greys;
    for (int y = 0; y < image.height; y++) {
        const uint16_t *row = image.row(y);
        for (int x = 1; x + 1 < image.width; x++) {
            slopes.push_back(std::abs(row[x + 1] - row[x - 1]));
            greys.push_back(row[x]);
        }
    }
    if (slopes.size() < 100) {
        return 0;
    }
    const auto quantile = [](std::vector<int> *values, double share) {
        const auto at = values->begin() +
                        static_cast<ptrdiff_t>(share * static_cast<double>(values->size() - 1));
        std::nth_element(values->begin(), at, values->end());
        return static_cast<double>(*at);
    };
    const double contrast = quantile(&greys, 0.98) - quantile(&greys, 0.02);
    const double slope = quantile(&slopes, 0.998) / 2;
    if (contrast < 16 * pixel_scale || slope <= 0) {
        return 0;
    }
    return contrast / (slope * 2.507) * static_cast<double>(1 << level);
}

std::string size_rejection(const board &board, const near_miss &nearest) {
    const bool wide = (nearest.columns >= nearest.rows) == (board.columns >= board.rows);
    return sentence("found %d x %d corners, not %d x %d", wide ? nearest.columns : nearest.rows,
                    wide ? nearest.rows : nearest.columns, board.columns, board.rows);
}

std::string coded_rejection(const board &board, const near_miss &nearest) {
    if (nearest.mirrored) {
        return "the board is mirrored: its markers read backwards";
    }
    if (nearest.markers_known >= 2) {
        return sentence("the markers do not fit a coded board of %d x %d corners", board.columns,
                        board.rows);
    }
    if (nearest.markers_seen >= 2) {
        return sentence("found %d markers, but not of dictionary %s", nearest.markers_seen,
                        board.dictionary.c_str());
    }
    return sentence("found %d corners, but too few readable markers to identify them",
                    nearest.corners);
}

std::string image_rejection(const std::vector<plane> &levels) {
    const std::array<double, 256> shares =
        shares_of_greys(levels[std::min<size_t>(1, levels.size() - 1)]);
    double white = 0, dark = 0;
    for (size_t grey = 0; grey < shares.size(); grey++) {
        white += grey >= white_grey ? shares[grey] : 0;
        dark += grey < dark_grey ? shares[grey] : 0;
    }
    if (white > max_white_share) {
        return sentence("no board found: overexposed (%.0f %% of the image is white)", 100 * white);
    }
    if (dark > max_dark_share) {
        return "no board found: too dark";
    }
    const double blur_px = steepest_edge_blur_px(levels);
    if (blur_px > blurred_px) {
        return sentence("no board found: blurred (the sharpest edges are about %.0f pixels wide)",
                        2.5 * blur_px);
    }
    return "no board found";
}

}  // namespace

bool too_blurred(double blur_px, double spacing_px) {
    return blur_px > max_blur_share * spacing_px;
}

near_miss near_miss_of(const plane &level, const grid &found) {
    near_miss miss;
    miss.columns = found.columns;
    miss.rows = found.rows;
    miss.corners = found.found_count();
    miss.cut = touches_border(level, found);
    return miss;
}

std::string rejection_of(const board &board, const std::vector<plane> &levels,
                         const near_miss &nearest) {
    const int wanted = board.corner_count();
    if (nearest.corners < std::min(fewest_corners, wanted)) {
        return image_rejection(levels);
    }
    if (nearest.blur_px > doubtful_blur_share * nearest.spacing_px) {
        return sentence("too blurred (edges are %.1f pixels wide, squares %.0f pixels)",
                        2.5 * nearest.blur_px, nearest.spacing_px);
    }
    if (board.coded()) {
        return coded_rejection(board, nearest);
    }
    if (nearest.continued) {
        return sentence("the squares go on beyond %d x %d corners: a larger board?", board.columns,
                        board.rows);
    }
    const int longer = std::max(nearest.columns, nearest.rows);
    const int shorter = std::min(nearest.columns, nearest.rows);
    const bool larger = longer > std::max(board.columns, board.rows) ||
                        shorter > std::min(board.columns, board.rows);
    const bool whole = nearest.corners == nearest.columns * nearest.rows;
    if (larger || (whole && !nearest.cut && nearest.corners < wanted)) {
        return size_rejection(board, nearest);
    }
    if (nearest.corners == wanted) {
        return "the board was found, but its corners are too blurred or overexposed to be measured";
    }
    if (nearest.cut) {
        return sentence("the board is cut off by the image border (%d of %d corners)",
                        nearest.corners, wanted);
    }
    return sentence("only %d of %d corners visible", nearest.corners, wanted);
}

}  // namespace calib::detect

// SPDX-License-Identifier: Apache-2.0
#include "calib/detect/detect_markers.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <tuple>

#include "calib/base/linear.hpp"
#include "calib/base/marker.hpp"

namespace calib::detect {

namespace {

constexpr double wanted_bit_px = 3.5;  // side of a bit on the level that is read
constexpr double sample_reach = 0.22;  // offset of the samples from the centre of a bit, in bits
constexpr double min_step = 8 * pixel_scale;

struct cell_code {
    int column, row;
    marker_code code;
};

// From a square's own coordinates (0..1 along its row and column) to the image.
class square_map {
  public:
    explicit square_map(const std::array<Eigen::Vector2d, 4> &corners) {
        matrix A = matrix::Zero(8, 8);
        vector b(8);
        for (int i = 0; i < 4; i++) {
            const double u = i & 1, v = i >> 1;
            const Eigen::Vector2d &p = corners[static_cast<size_t>(i)];
            A.row(2 * i) << u, v, 1, 0, 0, 0, -u * p.x(), -v * p.x();
            A.row(2 * i + 1) << 0, 0, 0, u, v, 1, -u * p.y(), -v * p.y();
            b[2 * i] = p.x();
            b[2 * i + 1] = p.y();
        }
        h_ = solve_square(A, b);
    }
    Eigen::Vector2d at(double u, double v) const {
        const double w = h_[6] * u + h_[7] * v + 1;
        return {(h_[0] * u + h_[1] * v + h_[2]) / w, (h_[3] * u + h_[4] * v + h_[5]) / w};
    }

  private:
    Eigen::Matrix<double, 8, 1> h_;
};

class square_reader {
  public:
    square_reader(const std::vector<plane> &levels, const square_map &map, int level)
        : plane_(levels[static_cast<size_t>(level)]), level_(level), map_(map) {}

    /// Mean grey level about (u, v), sampled `reach` to each side; none outside the image.
    std::optional<double> mean_at(double u, double v, double reach) const {
        double sum = 0;
        const double du[] = {0, reach, -reach, reach, -reach};
        const double dv[] = {0, -reach, reach, reach, -reach};
        for (int i = 0; i < 5; i++) {
            const Eigen::Vector2d p = map_.at(u + du[i], v + dv[i]);
            const double x = full_to_level(p.x(), level_), y = full_to_level(p.y(), level_);
            if (!plane_.holds(x, y, 0)) {
                return std::nullopt;
            }
            sum += plane_.between(x, y);
        }
        return sum / 5;
    }

  private:
    const plane &plane_;
    int level_;
    square_map map_;
};

// Grey levels of the marker's cells, border included, row by row.
std::optional<std::vector<double>> cells_of(const square_reader &square, double marker_share,
                                            int cells) {
    std::vector<double> grey;
    const double bit = marker_share / cells, first = (1 - marker_share) / 2;
    for (int row = 0; row < cells; row++) {
        for (int column = 0; column < cells; column++) {
            const std::optional<double> mean = square.mean_at(
                first + (column + 0.5) * bit, first + (row + 0.5) * bit, sample_reach * bit);
            if (!mean) {
                return std::nullopt;
            }
            grey.push_back(*mean);
        }
    }
    return grey;
}

// The paper's light level between marker and edges.
std::optional<double> margin_grey(const square_reader &square, double marker_share) {
    const double margin = (1 - marker_share) / 2, middle = margin / 2;
    double sum = 0;
    for (const double along : {0.3, 0.5, 0.7}) {
        for (const auto &[u, v] : {std::pair{along, middle},
                                   {along, 1 - middle},
                                   {middle, along},
                                   {1 - middle, along}}) {
            const std::optional<double> mean = square.mean_at(u, v, sample_reach * margin);
            if (!mean) {
                return std::nullopt;
            }
            sum += *mean;
        }
    }
    return sum / 12;
}

// The bits of a square whose marker has a black border.
std::optional<marker_code> code_in(const square_reader &square, double marker_share, int side) {
    const int cells = side + 2;
    const std::optional<double> light = margin_grey(square, marker_share);
    const auto grey = cells_of(square, marker_share, cells);
    if (!light || !grey) {
        return std::nullopt;
    }
    const auto border = [&](int i) {
        const int row = i / cells, column = i % cells;
        return row == 0 || column == 0 || row == cells - 1 || column == cells - 1;
    };
    double dark_sum = 0;
    for (int i = 0; i < cells * cells; i++) {
        dark_sum += border(i) ? (*grey)[static_cast<size_t>(i)] : 0;
    }
    const double dark = dark_sum / (4 * cells - 4);
    if (*light - dark < min_step) {
        return std::nullopt;
    }
    const double middle = (*light + dark) / 2;
    int light_border = 0;
    marker_code code = 0;
    for (int i = 0; i < cells * cells; i++) {
        const bool white = (*grey)[static_cast<size_t>(i)] > middle;
        if (border(i)) {
            light_border += white ? 1 : 0;
        } else {
            code = code << 1 | (white ? 1U : 0U);
        }
    }
    return light_border <= 1 ? std::optional<marker_code>(code) : std::nullopt;
}

// The level on which a bit is closest to the desired size.
int reading_level(const std::array<Eigen::Vector2d, 4> &corners, double marker_share, int side,
                  size_t level_count) {
    const double area = std::fabs((corners[3] - corners[0]).x() * (corners[2] - corners[1]).y() -
                                  (corners[3] - corners[0]).y() * (corners[2] - corners[1]).x()) /
                        2;
    double bit_px = std::sqrt(area) * marker_share / (side + 2);
    int level = 0;
    while (bit_px / 2 >= wanted_bit_px && level + 1 < static_cast<int>(level_count)) {
        bit_px /= 2;
        level++;
    }
    return level;
}

std::vector<cell_code> codes_in(const board &board, const marker_dictionary &dictionary,
                                const std::vector<plane> &levels, const grid &found,
                                const refined_grid &refined) {
    std::vector<cell_code> codes;
    const double share = board.marker_mm / board.square_mm;
    for (int row = 0; row + 1 < found.rows; row++) {
        for (int column = 0; column + 1 < found.columns; column++) {
            if (!found.light_square(column, row)) {
                continue;
            }
            std::array<Eigen::Vector2d, 4> corners;
            bool complete = true;
            for (int i = 0; i < 4; i++) {
                const size_t at =
                    static_cast<size_t>((row + (i >> 1)) * found.columns + column + (i & 1));
                const refined_corner &corner = refined.corners[at];
                complete = complete && corner.found;
                corners[static_cast<size_t>(i)] = {corner.x, corner.y};
            }
            if (!complete) {
                continue;
            }
            const int level = reading_level(corners, share, dictionary.side, levels.size());
            const square_reader square(levels, square_map(corners), level);
            const std::optional<marker_code> code = code_in(square, share, dictionary.side);
            if (code) {
                codes.push_back({column, row, *code});
            }
        }
    }
    return codes;
}

// The marker for a code, up to wrong bits; -1 if not found. `count`: markers on the board.
int marker_of(const marker_dictionary &dictionary, int count, marker_code code) {
    int best = -1, fewest = dictionary.correctable_bits + 1;
    for (int marker = 0; marker < std::min(count, dictionary.count); marker++) {
        marker_code wrong = dictionary.codes[marker] ^ code;
        int bits = 0;
        for (; wrong != 0 && bits < fewest; wrong &= wrong - 1) {
            bits++;
        }
        if (bits < fewest) {
            fewest = bits;
            best = marker;
        }
    }
    return best;
}

using place_key = std::tuple<bool, int, int, int>;  // mirrored, quarters, column, row
using place_votes = std::map<place_key, int>;

// Adds one vote for every place on the board where this square could be.
bool vote(const board &board, const marker_dictionary &dictionary, const grid &found,
          const cell_code &cell, bool white_first, place_votes *votes) {
    const int count = board_marker_count(board);
    bool known = false;
    for (const bool mirrored : {false, true}) {
        int columns = found.columns, rows = found.rows;
        int column = mirrored ? columns - 2 - cell.column : cell.column, row = cell.row;
        marker_code code = mirrored ? marker_mirrored(cell.code, dictionary.side) : cell.code;
        for (int quarters = 0; quarters < 4; quarters++) {
            const int marker = marker_of(dictionary, count, code);
            if (marker >= 0) {
                known = known || !mirrored;
                const square_place at = board_marker_square(board, marker, white_first);
                (*votes)[{mirrored, quarters, at.column - 1 - column, at.row - 1 - row}]++;
            }
            const int turned_row = columns - 2 - column;
            column = row;
            row = turned_row;
            std::swap(columns, rows);
            code = marker_turned(code, dictionary.side);
        }
    }
    return known;
}

struct election {
    board_place place;
    int second = 0;  // markers that agree on another place
};

election elect(const place_votes &votes) {
    election made;
    for (const auto &[key, count] : votes) {
        if (count > made.place.markers) {
            made.second = made.place.markers;
            const auto [mirrored, quarters, column, row] = key;
            made.place = {quarters, column, row, count, mirrored, false};
        } else {
            made.second = std::max(made.second, count);
        }
    }
    return made;
}

}  // namespace

marker_reading read_markers(const board &board, const std::vector<plane> &levels, const grid &found,
                            const refined_grid &refined) {
    marker_reading reading;
    const marker_dictionary *dictionary = marker_dictionary_named(board.dictionary);
    if (dictionary == nullptr) {
        return reading;
    }
    place_votes votes[2];  // index: `white_first`
    // With an odd number of squares in a row the markers fit both: see coded_layout.hpp.
    const bool two_layouts = board.rows % 2 != 0 && board.columns % 2 != 0;
    for (const cell_code &cell : codes_in(board, *dictionary, levels, found, refined)) {
        reading.seen++;
        reading.known += vote(board, *dictionary, found, cell, false, &votes[0]) ? 1 : 0;
        if (two_layouts) {
            vote(board, *dictionary, found, cell, true, &votes[1]);
        }
    }
    election best = elect(votes[0]), other = elect(votes[1]);
    if (other.place.markers > best.place.markers) {
        std::swap(best, other);
        best.place.white_first = true;
    }
    reading.place = best.place;
    const int max = best.place.markers;
    // One marker with few bits may be a coincidence; two markers that agree on the place are not.
    const bool enough = max >= 2 || (max == 1 && reading.seen == 1 && dictionary->side >= 5);
    // In the other layout markers of every other row agree.
    reading.placed = enough && max > 2 * best.second && 4 * max > 5 * other.place.markers;
    return reading;
}

}  // namespace calib::detect

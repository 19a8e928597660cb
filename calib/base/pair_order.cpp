// SPDX-License-Identifier: Apache-2.0
#include "calib/base/pair_order.hpp"

#include <algorithm>
#include <cmath>
#include <complex>

#include "calib/base/linear.hpp"
#include "core/invariant.h"
#include "core/math.h"

namespace calib {

namespace {

constexpr int max_rounds = 6;
constexpr size_t fewest_pairs = 3;  // one pair more than an epipolar geometry needs
// The other order must fit the epipolar geometry worse by this factor.
constexpr double clear_ratio = 3;
// How much a board may appear rotated in the right image relative to the other pairs.
constexpr double clear_turn_rad = MATH_PI / 4;

struct match {
    Eigen::Vector2d left, right;
};

struct pair_views {
    size_t number;                              // index of the caller's pair
    std::vector<std::vector<match>> by_option;  // one list for each way to number the right view
    double turn_rad = 0;  // rotation of the board's rows from the left to the right image
    size_t option = 0;    // chosen
};

std::vector<match> matches_of(const board_view &left, const board_view &right) {
    std::vector<match> found;
    auto r = right.corners.begin();
    for (const corner &l : left.corners) {
        while (r != right.corners.end() && r->index < l.index) {
            ++r;
        }
        if (r != right.corners.end() && r->index == l.index) {
            found.push_back({{l.x_px, l.y_px}, {r->x_px, r->y_px}});
        }
    }
    return found;
}

// Direction of increasing column, in the image.
std::complex<double> row_direction(const board &board, const board_view &view) {
    double mean_column = 0;
    for (const corner &c : view.corners) {
        mean_column += c.index % board.columns;
    }
    mean_column /= static_cast<double>(view.corners.size());
    std::complex<double> sum = 0;
    for (const corner &c : view.corners) {
        sum += (c.index % board.columns - mean_column) * std::complex<double>(c.x_px, c.y_px);
    }
    return sum;
}

vector3 homogeneous(const Eigen::Vector2d &point) {
    return {point.x(), point.y(), 1};
}

// Normalises points to mean 0 and mean distance sqrt 2 (Hartley, 1997).
matrix3 normalizing(const std::vector<const match *> &all, bool left) {
    INVARIANT(!all.empty());
    Eigen::Vector2d mean = Eigen::Vector2d::Zero();
    for (const match *m : all) {
        mean += left ? m->left : m->right;
    }
    mean /= static_cast<double>(all.size());
    double distance = 0;
    for (const match *m : all) {
        distance += ((left ? m->left : m->right) - mean).norm();
    }
    const double scale =
        std::sqrt(2.0) * static_cast<double>(all.size()) / std::max(distance, 1e-9);
    matrix3 T;
    T << scale, 0, -scale * mean.x(), 0, scale, -scale * mean.y(), 0, 0, 1;
    return T;
}

// The fundamental matrix of all pairs but `left_out`, by the eight-point algorithm.
matrix3 fundamental_of(const std::vector<pair_views> &pairs, const pair_views *left_out) {
    std::vector<const match *> all;
    for (const pair_views &pair : pairs) {
        if (&pair != left_out) {
            for (const match &m : pair.by_option[pair.option]) {
                all.push_back(&m);
            }
        }
    }
    const matrix3 T_left = normalizing(all, true), T_right = normalizing(all, false);
    matrix A = matrix::Zero(9, 9);
    for (const match *m : all) {
        const vector3 l = T_left * homogeneous(m->left);
        const vector3 r = T_right * homogeneous(m->right);
        vector row(9);
        row << r.x() * l, r.y() * l, l;
        A += row * row.transpose();
    }
    const vector f = decompose_symmetric(A).vectors.col(0);
    matrix3 F;
    F << f[0], f[1], f[2], f[3], f[4], f[5], f[6], f[7], f[8];
    return T_right.transpose() * nearest_of_rank_2(F) * T_left;
}

// Root mean square of the Sampson distance, in pixels.
double misfit_px(const matrix3 &F, const std::vector<match> &matches) {
    INVARIANT(!matches.empty());
    double sum = 0;
    for (const match &m : matches) {
        const vector3 l = homogeneous(m.left), r = homogeneous(m.right);
        const vector3 in_right = F * l, in_left = F.transpose() * r;
        const double error = r.dot(in_right);
        sum += error * error /
               (in_right.head<2>().squaredNorm() + in_left.head<2>().squaredNorm() + 1e-300);
    }
    return std::sqrt(sum / static_cast<double>(matches.size()));
}

double angle_between(double a_rad, double b_rad) {
    return std::fabs(std::remainder(a_rad - b_rad, 2 * MATH_PI));
}

// The rotation of the right image's rows when its view is numbered by option `option`.
double turn_of(const pair_views &pair, size_t option) {
    INVARIANT(option < pair.by_option.size());
    const double options = static_cast<double>(pair.by_option.size());
    return pair.turn_rad + 2 * MATH_PI * static_cast<double>(option) / options;
}

void choose_by_turn(std::vector<pair_views> *pairs, double roll_rad) {
    for (pair_views &pair : *pairs) {
        for (size_t option = 0; option < pair.by_option.size(); option++) {
            if (angle_between(turn_of(pair, option), roll_rad) <
                angle_between(turn_of(pair, pair.option), roll_rad)) {
                pair.option = option;
            }
        }
    }
}

struct fit {
    size_t best;
    double ratio;  // misfit of the second best option over that of the best
};

fit fit_of(const matrix3 &F, const pair_views &pair) {
    size_t best = 0;
    std::vector<double> misfits;
    INVARIANT(!pair.by_option.empty());
    for (size_t option = 0; option < pair.by_option.size(); option++) {
        misfits.push_back(misfit_px(F, pair.by_option[option]));
        best = misfits[option] < misfits[best] ? option : best;
    }
    double second = HUGE_VAL;
    for (size_t option = 0; option < misfits.size(); option++) {
        second = option != best ? std::min(second, misfits[option]) : second;
    }
    // Corners are never better than this; below it a ratio is meaningless.
    return {best, second / std::max(misfits[best], 0.2)};
}

// Chooses the options of all pairs so that one epipolar geometry fits; returns the remaining
// misfit.
double choose_by_geometry(std::vector<pair_views> *pairs) {
    double misfit = 0;
    for (int round = 0; round < max_rounds; round++) {
        const matrix3 F = fundamental_of(*pairs, nullptr);
        bool changed = false;
        misfit = 0;
        for (pair_views &pair : *pairs) {
            const size_t best = fit_of(F, pair).best;
            changed = changed || best != pair.option;
            pair.option = best;
            misfit += misfit_px(F, pair.by_option[best]) / static_cast<double>(pairs->size());
        }
        if (!changed) {
            break;
        }
    }
    return misfit;
}

// The rotation common to all pairs, up to the board's symmetry: the cameras' roll.
double common_roll(const std::vector<pair_views> &pairs) {
    std::complex<double> sum = 0;
    double options = 1;
    for (const pair_views &pair : pairs) {
        options = static_cast<double>(pair.by_option.size());
        sum += std::polar(1.0, options * pair.turn_rad);
    }
    return std::arg(sum) / options;
}

// With three pairs or more the geometry decides; start at each roll that the rotations allow.
void decide_together(std::vector<pair_views> *pairs) {
    const double roll_rad = common_roll(*pairs);
    const size_t options = pairs->front().by_option.size();
    std::vector<pair_views> best;
    double min = HUGE_VAL;
    for (size_t option = 0; option < options; option++) {
        std::vector<pair_views> tried = *pairs;
        choose_by_turn(&tried, roll_rad + 2 * MATH_PI * static_cast<double>(option) /
                                              static_cast<double>(options));
        const double misfit = choose_by_geometry(&tried);
        // The first is the smallest roll: another one must be clearly better.
        if (best.empty() || misfit * clear_ratio < min) {
            best = tried;
            min = misfit;
        }
    }
    *pairs = best;
}

bool decided(const std::vector<pair_views> &pairs, const pair_views &pair) {
    if (pairs.size() >= fewest_pairs) {
        const fit others = fit_of(fundamental_of(pairs, &pair), pair);
        if (others.ratio >= clear_ratio) {
            return others.best == pair.option;
        }
        double sum_x = 0, sum_y = 0;
        for (const pair_views &other : pairs) {
            sum_x += std::cos(turn_of(other, other.option));
            sum_y += std::sin(turn_of(other, other.option));
        }
        return angle_between(turn_of(pair, pair.option), std::atan2(sum_y, sum_x)) < clear_turn_rad;
    }
    return angle_between(turn_of(pair, pair.option), 0) < clear_turn_rad;
}

}  // namespace

board_view turned_view(const board &board, const board_view &view, int quarters) {
    board_view made = view;
    for (corner &c : made.corners) {
        for (int turn = 0; turn < quarters; turn++) {
            const int column = c.index % board.columns, row = c.index / board.columns;
            if (quarters % 2 == 0) {
                c.index = turn == 0 ? board.corner_count() - 1 - c.index : c.index;
            } else {
                c.index = (board.columns - 1 - column) * board.columns + row;
            }
        }
    }
    std::sort(made.corners.begin(), made.corners.end(),
              [](const corner &a, const corner &b) { return a.index < b.index; });
    return made;
}

std::vector<pair_turn> pair_order(const board &board, const std::vector<board_view> &left,
                                  const std::vector<board_view> &right) {
    std::vector<pair_turn> answer(left.size(), {0, true});
    if (!board.looks_same_turned()) {
        return answer;
    }
    const bool four = board.columns == board.rows && board.columns % 2 == 0;
    const int step = four ? 1 : 2;
    std::vector<pair_views> pairs;
    for (size_t i = 0; i < left.size(); i++) {
        if (left[i].corners.empty() || right[i].corners.empty()) {
            continue;
        }
        pair_views pair;
        pair.number = i;
        for (int quarters = 0; quarters < 4; quarters += step) {
            pair.by_option.push_back(matches_of(left[i], turned_view(board, right[i], quarters)));
        }
        pair.turn_rad =
            std::arg(row_direction(board, right[i]) * std::conj(row_direction(board, left[i])));
        pairs.push_back(std::move(pair));
    }
    if (pairs.size() >= fewest_pairs) {
        decide_together(&pairs);
    } else {
        choose_by_turn(&pairs, 0);
    }
    for (const pair_views &pair : pairs) {
        answer[pair.number].quarters = static_cast<int>(pair.option) * step;
        answer[pair.number].decided = decided(pairs, pair);
    }
    return answer;
}

}  // namespace calib

// SPDX-License-Identifier: Apache-2.0
/// Why an image shows no usable board, in one line for the user.
#ifndef VERGENCE_CALIB_DETECT_DETECT_REJECTION_HPP
#define VERGENCE_CALIB_DETECT_DETECT_REJECTION_HPP

#include <string>
#include <vector>

#include "calib/base/board.hpp"
#include "calib/detect/detect_grid.hpp"

namespace calib::detect {

/// The best candidate grid; `corners` is 0 if there is none.
struct near_miss {
    int columns = 0, rows = 0, corners = 0;
    bool cut = false;        // its next line of corners would be beyond the image's border
    bool continued = false;  // squares go on beyond it
    double blur_px = 0, spacing_px = 0;  // 0: not measured
    int markers_seen = 0, markers_known = 0;
    bool mirrored = false;
};

/// What is known of a grid before its corners are measured.
near_miss near_miss_of(const plane &level, const grid &found);

/// Whether the squares' edges blend into each other, so that no corner can be measured.
bool too_blurred(double blur_px, double spacing_px);

std::string rejection_of(const board &board, const std::vector<plane> &levels,
                         const near_miss &nearest);

}  // namespace calib::detect

#endif

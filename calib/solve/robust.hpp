// SPDX-License-Identifier: Apache-2.0
/// Outlier rejection: corners and views that contradict the others, each with a reason for the
/// user.
#ifndef VERGENCE_CALIB_SOLVE_ROBUST_HPP
#define VERGENCE_CALIB_SOLVE_ROBUST_HPP

#include <array>
#include <string>
#include <vector>

#include "calib/bundle/bundle.hpp"
#include "calib/solve/seed.hpp"

namespace calib {

/// What is known of one view besides its corners.
struct view_record {
    bool assessed = false;  // false: unusable regardless of the other views (reason below)
    bool turned = false;    // was numbered from the other end and has been renumbered
    std::string reason;     // why it is not used, or that it was renumbered; "" when all is well
    homography seen;        // homography of the view at its assessment
};

using view_records = std::vector<std::array<view_record, CAMERAS>>;

/// Checks every view separately: too few corners, corners on one line, mirrored order, not a flat
/// board. Sets `used` for usable views.
view_records inspect_views(bundle *data);

/// Where losses of the fits bend, in robust scales.
constexpr double LOSS = 3;

/// Standard deviation of the used corners' residuals over their own sigmas, from the median of
/// their lengths, so that a few outliers do no harm.
double robust_scale(const bundle &data, const bundle_state &state);

/// Length of a residual, in standard deviations, beyond which a corner is an outlier: among `count`
/// corners with gaussian noise one exceeds it in one of 100,000 data sets.
double blunder_limit(size_t count);

/// Judges every view and corner again, used or not, with the lenses and the rig of `state`; sets
/// their `used`, the poses of `state`, and the reasons. A corner's limit is `blunder_limit` times
/// `scale` and at least 0.001 px. A view is wrong when more than a quarter of its corners are; a
/// pair, when each view fits a board but not the same one. Where the board looks the same after
/// half a turn, such a right view is renumbered if that helps. Returns true when any `used` has
/// changed.
bool assess(bundle *data, bundle_state *state, const board &target, double scale,
            view_records *records);

}  // namespace calib

#endif

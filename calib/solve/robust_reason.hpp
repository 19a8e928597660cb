// SPDX-License-Identifier: Apache-2.0
/// Describes how corners and views are wrong.
#ifndef VERGENCE_CALIB_SOLVE_ROBUST_REASON_HPP
#define VERGENCE_CALIB_SOLVE_ROBUST_REASON_HPP

#include <string>

#include "calib/bundle/bundle.hpp"

namespace calib {

/// Why a corner of a board at a known pose is an outlier: it may be at the place of another corner,
/// or simply off.
std::string corner_reason(const bundle &data, int camera, const bundle_corner &corner,
                          const bundle_state &state, const rigid &T_left_board, double off_px);

/// How two views that each show a board well disagree about it.
struct mismatch {
    bool half_turn = false;  // the right one is numbered from the other end
    std::string reason;
};

/// `left` and `right` are T_left_board from each view alone.
mismatch explain_mismatch(const bundle &data, const bundle_state &state, size_t capture,
                          const board &target, const rigid &left, const rigid &right);

}  // namespace calib

#endif

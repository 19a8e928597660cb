// SPDX-License-Identifier: Apache-2.0
/// Ground truth in the published formats.
#ifndef VERGENCE_TOOLS_HOST_EVALUATE_EVALUATE_TRUTH_HPP
#define VERGENCE_TOOLS_HOST_EVALUATE_EVALUATE_TRUTH_HPP

#include <cstdint>
#include <string>
#include <vector>

#include "daemon/surface/result/reconstruct_context.h"

struct evaluate_truth {
    int width_px = 0, height_px = 0;
    std::vector<float> disparity_px;  // +inf where unknown
    std::vector<std::uint8_t> mask;   // EVALUATE_UNKNOWN, _OCCLUDED or _VISIBLE; empty: not given
};

/// Loads disparities of the left view and, unless `mask_path` is empty, a mask of the same size.
/// Detected by content: PFM (not finite: unknown), KITTI's 16-bit grey PNG (256 = 1 px, 0 unknown),
/// 8-bit grey PNG (`scale` = 1 px, 0 unknown; `scale` <= 0: not stated, rejected). A `scale` > 0
/// also replaces KITTI's 256. On failure returns false with one line in `message` that names the
/// file, and leaves `truth` untouched.
bool evaluate_truth_load(const std::string &path, const std::string &mask_path, double scale,
                         evaluate_truth *truth, std::string *message);

/// Checks before `vergence reconstruct` starts whether the ground truth and the mask that `context`
/// names can be read, and their size. Returns 0, or ERROR_SYNTAX with `message` set.
int evaluate_truth_check(const reconstruct_context *context, int size_px[2],
                         struct message *message);

#endif

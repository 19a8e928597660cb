// SPDX-License-Identifier: Apache-2.0
/// The error of a disparity map against the ground truth. One set of rules for `vergence evaluate`,
/// the report and the benchmark, so that their figures are comparable.
///
/// A pixel counts when its truth is known. It is *bad-t* when |disparity - truth| > t px. "Filled"
/// requires a value everywhere, so that rejecting pixels gains nothing: see `evaluate_fill`. "Kept"
/// counts only the pixels that the method did not reject.
#ifndef VERGENCE_TOOLS_HOST_EVALUATE_EVALUATE_HPP
#define VERGENCE_TOOLS_HOST_EVALUATE_EVALUATE_HPP

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "daemon/surface/result/reconstruct_context.h"

/// Values of a mask of known pixels.
enum { EVALUATE_UNKNOWN = 0, EVALUATE_OCCLUDED = 128, EVALUATE_VISIBLE = 255 };

enum { EVALUATE_THRESHOLDS = 4 };
constexpr double evaluate_thresholds_px[EVALUATE_THRESHOLDS] = {0.5, 1.0, 2.0, 4.0};

/// Maps of width x height, rows from the top, all of the same size; not owned.
struct evaluate_input {
    int width_px = 0, height_px = 0;
    const float *disparity_px = nullptr;  // x_left - x_right; not finite: rejected
    const float *truth_px = nullptr;      // not finite: unknown
    const std::uint8_t *mask =
        nullptr;                   // EVALUATE_* of each pixel; NULL: all known pixels are visible
    bool round_disparity = false;  // round to whole pixels, for a truth in whole pixels
};

/// Errors of one set of pixels. All are 0 when the set is empty.
struct evaluate_score {
    std::size_t pixels = 0;
    double bad_percent[EVALUATE_THRESHOLDS] = {0, 0, 0, 0};
    double average_px = 0;  // mean |error|
    double rms_px = 0;
};

struct evaluate_result {
    evaluate_score filled_all, filled_visible;  // every known pixel; those seen by both cameras
    evaluate_score saved_all, kept_visible;     // pixels not rejected: known ones; visible ones
    double density_all_percent = 0;             // share of kept among known pixels
    double density_visible_percent = 0;
};

/// Fills rejected pixels: the smaller of the nearest kept disparities to the left and to the right
/// in the same row (the farther surface continues behind the nearer one), the only one at the
/// borders, 0 in an empty row. `disparity_px` is modified in place and has width x height values.
void evaluate_fill(int width_px, int height_px, float *disparity_px);

/// Compares a map with the truth. A pixel is known when its truth is finite and its mask is not
/// EVALUATE_UNKNOWN; visible when it is known and its mask is EVALUATE_VISIBLE or there is no mask.
evaluate_result evaluate_disparity(const evaluate_input &input);

/// Ground truth in the published formats.

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

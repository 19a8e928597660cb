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
#include <vector>

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
        nullptr;                   // of the values above, or NULL: all known pixels are visible
    bool round_disparity = false;  // to whole pixels, for truth in whole pixels
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
    evaluate_score saved_all, kept_visible;     // of these, the ones not rejected
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

#endif

// SPDX-License-Identifier: Apache-2.0
#include "tools/host/evaluate/evaluate.hpp"

#include <cmath>

#include "core/invariant.h"

namespace {

/// Running sums of one set of pixels.
struct tally {
    std::size_t pixels = 0;
    std::size_t bad[EVALUATE_THRESHOLDS] = {0, 0, 0, 0};
    double sum_px = 0, sum_square_px2 = 0;

    void add(double error_px) {
        pixels++;
        for (int i = 0; i < EVALUATE_THRESHOLDS; i++) {
            bad[i] += error_px > evaluate_thresholds_px[i] ? 1 : 0;
        }
        sum_px += error_px;
        sum_square_px2 += error_px * error_px;
    }

    evaluate_score score() const {
        evaluate_score result;
        result.pixels = pixels;
        if (pixels == 0) {
            return result;
        }
        const double count = static_cast<double>(pixels);
        for (int i = 0; i < EVALUATE_THRESHOLDS; i++) {
            result.bad_percent[i] = 100.0 * static_cast<double>(bad[i]) / count;
        }
        result.average_px = sum_px / count;
        result.rms_px = std::sqrt(sum_square_px2 / count);
        return result;
    }
};

double percent(std::size_t part, std::size_t whole) {
    return whole == 0 ? 0.0 : 100.0 * static_cast<double>(part) / static_cast<double>(whole);
}

/// Fills row[begin, end), all rejected, from its kept neighbours.
void fill_gap(float *row, int width_px, int begin, int end) {
    float value = 0;
    if (begin > 0 && end < width_px) {
        value = row[begin - 1] < row[end] ? row[begin - 1] : row[end];
    } else if (begin > 0) {
        value = row[begin - 1];
    } else if (end < width_px) {
        value = row[end];
    }
    for (int x = begin; x < end; x++) {
        row[x] = value;
    }
}

}  // namespace

void evaluate_fill(int width_px, int height_px, float *disparity_px) {
    INVARIANT(width_px >= 0 && height_px >= 0);
    for (int y = 0; y < height_px; y++) {
        float *row =
            disparity_px + static_cast<std::size_t>(y) * static_cast<std::size_t>(width_px);
        for (int x = 0; x < width_px; x++) {
            if (std::isfinite(row[x])) {
                continue;
            }
            int end = x + 1;
            while (end < width_px && !std::isfinite(row[end])) {
                end++;
            }
            fill_gap(row, width_px, x, end);
            x = end - 1;
        }
    }
}

namespace {

bool is_known(const evaluate_input &input, std::size_t i) {
    return std::isfinite(input.truth_px[i]) &&
           (input.mask == nullptr || input.mask[i] != EVALUATE_UNKNOWN);
}

}  // namespace

evaluate_result evaluate_disparity(const evaluate_input &input) {
    INVARIANT(input.width_px > 0 && input.height_px > 0);
    INVARIANT(input.disparity_px != nullptr && input.truth_px != nullptr);
    const std::size_t pixels =
        static_cast<std::size_t>(input.width_px) * static_cast<std::size_t>(input.height_px);
    std::vector<float> filled(input.disparity_px, input.disparity_px + pixels);
    if (input.round_disparity) {
        for (float &value : filled) {
            value = std::floor(value + 0.5F);
        }
    }
    evaluate_fill(input.width_px, input.height_px, filled.data());

    tally filled_all, filled_visible, saved_all, kept_visible;
    for (std::size_t i = 0; i < pixels; i++) {
        if (!is_known(input, i)) {
            continue;
        }
        const bool visible = input.mask == nullptr || input.mask[i] == EVALUATE_VISIBLE;
        const bool kept = std::isfinite(input.disparity_px[i]);
        const double error_px =
            std::fabs(static_cast<double>(filled[i]) - static_cast<double>(input.truth_px[i]));
        filled_all.add(error_px);
        if (visible) {
            filled_visible.add(error_px);
        }
        if (kept) {
            saved_all.add(error_px);
        }
        if (kept && visible) {
            kept_visible.add(error_px);
        }
    }
    evaluate_result result;
    result.filled_all = filled_all.score();
    result.filled_visible = filled_visible.score();
    result.saved_all = saved_all.score();
    result.kept_visible = kept_visible.score();
    result.density_all_percent = percent(saved_all.pixels, filled_all.pixels);
    result.density_visible_percent = percent(kept_visible.pixels, filled_visible.pixels);
    return result;
}

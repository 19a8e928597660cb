// SPDX-License-Identifier: Apache-2.0
// The slow matcher's smoothing of noisy pairs.
#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "match_reference.hpp"
#include "stereo/match/tuning.h"

namespace reference {

namespace {

constexpr int kBlock = 8;

int second_derivative(const View &view, int x, int y) {
    const int weight[3] = {1, -2, 1};
    int sum = 0;
    for (int j = -1; j <= 1; j++) {
        for (int i = -1; i <= 1; i++) {
            sum += weight[j + 1] * weight[i + 1] * view.grey.at(x + i, y + j);
        }
    }
    return std::abs(sum);
}

// The columns that are valid in all rows of a block at y_begin, and in those around it.
Span valid_columns(const View &view, int y_begin) {
    Span valid = {0, view.grey.width};
    for (int y = y_begin - 1; y <= y_begin + kBlock; y++) {
        const Span own = view.spans[static_cast<size_t>(y)];
        valid = {std::max(valid.begin, own.begin), std::min(valid.end, own.end)};
    }
    return valid;
}

// In eighths, by block and sorted.
std::vector<int> roughnesses_of(const View &view) {
    const std::pair<int, int> limits = limits_of(view);
    std::vector<int> roughnesses;
    for (int y = 1; y + kBlock < view.grey.height; y += 16) {
        const Span valid = valid_columns(view, y);
        for (int x = valid.begin + 1; x + kBlock < valid.end; x += 16) {
            int sum = 0;
            for (int j = 0; j < kBlock; j++) {
                for (int i = 0; i < kBlock; i++) {
                    sum += second_derivative(view, x + i, y + j);
                }
            }
            if (!is_clipped(view, limits, x, y)) {
                roughnesses.push_back(std::min(sum / 8, 1023));
            }
        }
    }
    std::sort(roughnesses.begin(), roughnesses.end());
    return roughnesses;
}

// Squared slopes along the row over 2 `reach` pixels, of a block.
int slopes_over(const View &view, int x, int y, int reach) {
    int sum = 0;
    for (int j = 0; j < kBlock; j++) {
        for (int i = 0; i < kBlock; i++) {
            sum += static_cast<int>(std::pow(
                view.grey.at(x + i + reach, y + j) - view.grey.at(x + i - reach, y + j), 2));
        }
    }
    return sum;
}

// In 64ths, of half of the blocks: how much of the slopes over 8 pixels is in those over 2.
int fine_share(const View &view, int noise) {
    const double of_noise = std::floor(128.0 * noise * noise / (233 * 233));
    std::vector<int> shares;
    for (int y = 1; y + kBlock < view.grey.height; y += 16) {
        const Span valid = valid_columns(view, y);
        for (int x = valid.begin + 4; x + kBlock + 4 <= valid.end; x += 16) {
            const double far = slopes_over(view, x, y, 4) - of_noise;
            const double near = slopes_over(view, x, y, 1) - of_noise;
            if (far > int{TUNE_COARSE_SIGNAL} * of_noise) {
                shares.push_back(std::clamp(static_cast<int>(64 * near / far), 0, 64));
            }
        }
    }
    std::sort(shares.begin(), shares.end());
    return shares.size() < 8 ? 64 : shares[shares.size() / 2];
}

Grid<uint8_t> smoothed_image(const View &view, const Grid<uint8_t> &image, int side) {
    Grid<uint8_t> result(image.width, image.height);
    const int weight[3] = {side, 16 - 2 * side, side};
    for (int y = 0; y < image.height; y++) {
        for (int x = 0; x < image.width; x++) {
            int sum = 0;
            for (int j = -1; j <= 1; j++) {
                for (int i = -1; i <= 1; i++) {
                    sum += weight[j + 1] * weight[i + 1] * level_at(view, image, x + i, y + j);
                }
            }
            result.at(x, y) = static_cast<uint8_t>((sum + 128) / 256);
        }
    }
    return result;
}

}  // namespace

int smoothing_of(const View &left, const View &right) {
    int noise = 0, usual = 0, fine = 0;
    for (const View *view : {&left, &right}) {
        const std::vector<int> roughnesses = roughnesses_of(*view);
        const bool enough = roughnesses.size() >= 8;
        const int own = enough ? 8 * roughnesses[roughnesses.size() / TUNE_NOISE_FLOOR_SHARE] : 0;
        noise += own / 2;
        usual += enough ? 4 * roughnesses[roughnesses.size() / 2] : 0;
        fine += fine_share(*view, own);
    }
    if (noise < TUNE_NOISE_WEAK || usual > TUNE_FINE_TEXTURE * noise) {
        return 0;
    }
    if (noise >= TUNE_NOISE_STRONG) {
        return TUNE_SMOOTHING_STRONG;
    }
    return fine / 2 > TUNE_COARSE_SHARE ? TUNE_SMOOTHING_WEAK : TUNE_SMOOTHING_COARSE;
}

View smoothed(const View &view, int side) {
    View result = view;
    result.smoothing = side;
    result.grey = smoothed_image(view, view.grey, side);
    for (Grid<uint8_t> &channel : result.channels) {
        channel = smoothed_image(view, channel, side);
    }
    return result;
}

}  // namespace reference

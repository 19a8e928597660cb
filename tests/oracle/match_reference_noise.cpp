// SPDX-License-Identifier: Apache-2.0
// The slow matcher's smoothing of noisy pairs.
#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "match_reference.hpp"

namespace reference {

namespace {

constexpr int kBlock = 8;

bool is_valid(const View &view, int x, int y) {
    const Span span = view.spans[static_cast<size_t>(y)];
    return x >= span.begin && x < span.end;
}

bool is_valid_around(const View &view, int x_begin, int y_begin) {
    bool valid = x_begin > 0 && y_begin > 0 && x_begin + kBlock < view.grey.width &&
                 y_begin + kBlock < view.grey.height;
    for (int y = y_begin - 1; valid && y <= y_begin + kBlock; y++) {
        valid = is_valid(view, x_begin - 1, y) && is_valid(view, x_begin + kBlock, y);
    }
    return valid;
}

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

// The grey levels of all valid pixels, sorted.
std::vector<int> greys_of(const View &view) {
    std::vector<int> greys;
    for (int y = 0; y < view.grey.height; y++) {
        for (int x = 0; x < view.grey.width; x++) {
            if (is_valid(view, x, y)) {
                greys.push_back(view.grey.at(x, y));
            }
        }
    }
    std::sort(greys.begin(), greys.end());
    return greys;
}

// Blocks at every sixteenth column of what is valid in all of their rows.
int first_column(const View &view, int y_begin) {
    int first = 0;
    for (int y = y_begin - 1; y <= y_begin + kBlock; y++) {
        first = std::max(first, view.spans[static_cast<size_t>(y)].begin);
    }
    return first + 1;
}

// In eighths, by block and sorted.
std::vector<int> roughnesses_of(const View &view) {
    const std::vector<int> greys = greys_of(view);
    std::vector<int> roughnesses;
    for (int y = 1; y + kBlock < view.grey.height; y += 16) {
        for (int x = first_column(view, y); is_valid_around(view, x, y); x += 16) {
            int sum = 0;
            bool clipped = false;
            for (int j = -1; j <= kBlock; j++) {
                for (int i = 0; i < kBlock; i++) {
                    const int grey = view.grey.at(x + i, y + j);
                    clipped = clipped || grey == greys.front() || grey == greys.back();
                    sum += j >= 0 && j < kBlock ? second_derivative(view, x + i, y + j) : 0;
                }
            }
            if (!clipped) {
                roughnesses.push_back(std::min(sum / 8, 1023));
            }
        }
    }
    std::sort(roughnesses.begin(), roughnesses.end());
    return roughnesses;
}

}  // namespace

int smoothing_of(const View &left, const View &right) {
    int noise = 0, usual = 0;
    for (const View *view : {&left, &right}) {
        const std::vector<int> roughnesses = roughnesses_of(*view);
        if (roughnesses.size() >= 8) {
            noise += 4 * roughnesses[roughnesses.size() / 50];
            usual += 4 * roughnesses[roughnesses.size() / 2];
        }
    }
    if (noise < 160 || usual > 6 * noise) {
        return 0;
    }
    return noise < 696 ? 2 : 5;
}

View smoothed(const View &view, int side) {
    View result = view;
    const int weight[3] = {side, 16 - 2 * side, side};
    for (int y = 0; y < view.grey.height; y++) {
        for (int x = 0; x < view.grey.width; x++) {
            int sum = 0;
            for (int j = -1; j <= 1; j++) {
                for (int i = -1; i <= 1; i++) {
                    sum += weight[j + 1] * weight[i + 1] * grey_at(view, x + i, y + j);
                }
            }
            result.grey.at(x, y) = static_cast<uint8_t>((sum + 128) / 256);
        }
    }
    return result;
}

}  // namespace reference

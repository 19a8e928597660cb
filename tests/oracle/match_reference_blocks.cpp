// SPDX-License-Identifier: Apache-2.0
// The checks of the slow matcher that look around a pixel: texture along the row against
// noise, the share of accepted pixels around, and what an object hides.
#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "match_reference.hpp"
#include "stereo/image/reason.h"
#include "stereo/match/tuning.h"

namespace reference {

namespace {

constexpr int kBlock = 8;

}  // namespace

std::pair<int, int> limits_of(const View &view) {
    std::pair<int, int> limits = {255, 0};
    for (int y = 0; y < view.grey.height; y++) {
        const Span span = view.spans[static_cast<size_t>(y)];
        for (int x = span.begin; x < span.end; x++) {
            limits.first = std::min<int>(limits.first, view.grey.at(x, y));
            limits.second = std::max<int>(limits.second, view.grey.at(x, y));
        }
    }
    return limits;
}

bool is_clipped(const View &view, std::pair<int, int> limits, int x_begin, int y_begin) {
    bool clipped = false;
    for (int y = y_begin - 1; y <= y_begin + kBlock; y++) {
        for (int x = x_begin; x < x_begin + kBlock; x++) {
            const int grey = view.grey.at(x, y);
            clipped = clipped || grey == limits.first || grey == limits.second;
        }
    }
    return clipped;
}

namespace {

int whole_px(int disparity_q8) {
    return static_cast<int>(std::floor((disparity_q8 + 128) / 256.0));
}

// Second derivative, along row and column, of the difference between the images.
int difference(const View &left, const View &right, int x, int y, int disparity) {
    const int weight[3] = {1, -2, 1};
    int sum = 0;
    for (int j = -1; j <= 1; j++) {
        for (int i = -1; i <= 1; i++) {
            sum += weight[j + 1] * weight[i + 1] *
                   (left.grey.at(x + i, y + j) - right.grey.at(x + i - disparity, y + j));
        }
    }
    return sum;
}

// 256 times the variance of the noise.
double noise_of(const View &left, const View &right, const Answer &answer) {
    const std::pair<int, int> left_limits = limits_of(left);
    const std::pair<int, int> right_limits = limits_of(right);
    std::vector<int> bins;
    for (int y = 1; y + kBlock < answer.reason.height; y += 16) {
        for (int x = 1; x + kBlock < answer.reason.width; x += 16) {
            const int disparity = whole_px(answer.disparity_q8.at(x + 4, y + 4));
            if (answer.reason.at(x + 4, y + 4) != REASON_VALID || x - 1 - disparity < 0 ||
                x + kBlock - disparity >= answer.reason.width ||
                is_clipped(left, left_limits, x, y) ||
                is_clipped(right, right_limits, x - disparity, y)) {
                continue;
            }
            int sum = 0;
            for (int j = 0; j < kBlock; j++) {
                for (int i = 0; i < kBlock; i++) {
                    sum += std::abs(difference(left, right, x + i, y + j, disparity));
                }
            }
            bins.push_back(std::min(sum / 16, 1023));
        }
    }
    if (bins.empty()) {
        return 21;
    }
    std::sort(bins.begin(), bins.end());
    const double sum = bins[bins.size() / TUNE_PAIR_NOISE_SHARE] * 16 + 8;
    return std::max(std::floor(sum * sum / 530), 21.0);
}

}  // namespace

// The left image's row with its ends repeated beyond what is valid in it and its neighbours,
// smoothed by (1 2 1) both ways, times 16; column 0 is at index 2.
std::vector<int> smooth_row(const View &left, int y) {
    const int width = left.grey.width;
    int rows[3];
    Span span = {0, width};
    for (int j = 0; j < 3; j++) {
        rows[j] = std::clamp(y + j - 1, 0, left.grey.height - 1);
        const Span own = left.spans[static_cast<size_t>(rows[j])];
        span = {std::max(span.begin, own.begin), std::min(span.end, own.end)};
    }
    std::vector<int> smooth;
    for (int x = -2; x < width + 2; x++) {
        const auto column = [&](int from) {
            const int at = std::clamp(from, span.begin, span.end - 1);
            return left.grey.at(at, rows[0]) + 2 * left.grey.at(at, rows[1]) +
                   left.grey.at(at, rows[2]);
        };
        const int at = std::clamp(x, span.begin, std::max(span.end - 1, span.begin));
        smooth.push_back(
            span.end - span.begin < 3 ? 0 : column(at - 1) + 2 * column(at) + column(at + 1));
    }
    return smooth;
}

namespace {

// Squared slopes of the blocks along the rows, and along the columns, and their number.
struct Slopes {
    Grid<double> along, upright, count;
};

// Whether the disparity changes by a depth edge over four columns, a few columns away.
bool is_near_depth_edge(const Answer &answer, int x, int y) {
    bool near = false;
    for (int i = std::max(x - TUNE_DEPTH_EDGE_COLUMNS, 2);
         i <= std::min(x + TUNE_DEPTH_EDGE_COLUMNS, answer.reason.width - 3); i++) {
        near = near || std::abs(answer.disparity_q8.at(i + 2, y) -
                                answer.disparity_q8.at(i - 2, y)) > TUNE_DEPTH_EDGE_PX * 256;
    }
    return near;
}

Slopes slopes_of(const View &left, const Answer &answer) {
    const int width = left.grey.width;
    const int columns = (width + kBlock - 1) / kBlock;
    const int rows = (left.grey.height + kBlock - 1) / kBlock;
    Slopes slopes = {{columns, rows}, {columns, rows}, {columns, rows}};
    for (int y = 0; y < left.grey.height; y += 2) {
        const std::vector<int> above = smooth_row(left, y - 2);
        const std::vector<int> here = smooth_row(left, y);
        const std::vector<int> below = smooth_row(left, y + 2);
        for (int x = 0; x < width; x++) {
            if (is_near_depth_edge(answer, x, y)) {
                continue;
            }
            const auto at = static_cast<size_t>(x);
            slopes.count.at(x / kBlock, y / kBlock) += 1;
            slopes.along.at(x / kBlock, y / kBlock) += std::pow(here[at + 4] - here[at], 2);
            slopes.upright.at(x / kBlock, y / kBlock) += std::pow(below[at + 2] - above[at + 2], 2);
        }
    }
    return slopes;
}

// What the slopes of three blocks in a row show: whether there is texture, and whether slopes along
// the row are above noise, and strong.
struct Texture {
    Grid<int> textured, sloped, strong;
};

void classify_texture(const Slopes &slopes, double noise_q8, int column, int row,
                      Texture *texture) {
    double along = 0, upright = 0, count = 0;
    for (int i = column - 1; i <= column + 1; i++) {
        const int at = std::clamp(i, 0, slopes.along.width - 1);
        along += slopes.along.at(at, row);
        upright += slopes.upright.at(at, row);
        count += slopes.count.at(at, row);
    }
    // Slopes have 72 times the variance of a pixel.
    const double noise = std::floor(noise_q8 * count * 72 / 256);
    const double structure = std::floor(std::max(upright - noise, 0.0) / int{TUNE_UPRIGHT});
    const double signal_min = (TUNE_SIGNAL + 1) * noise;
    texture->textured.at(column, row) = count > 0 && along >= signal_min + structure;
    texture->sloped.at(column, row) = count > 0 && along >= signal_min;
    texture->strong.at(column, row) = count > 0 && along >= int{TUNE_STRONG_SIGNAL} * noise;
}

// Pixels that both cameras may see, and those that were accepted, by block.
struct Pixels {
    Grid<double> seen, accepted;
};

Pixels pixels_of(const Answer &answer) {
    const int columns = (answer.reason.width + kBlock - 1) / kBlock;
    const int rows = (answer.reason.height + kBlock - 1) / kBlock;
    Pixels pixels = {{columns, rows}, {columns, rows}};
    for (int y = 0; y < answer.reason.height; y++) {
        for (int x = 0; x < answer.reason.width; x++) {
            const int reason = answer.reason.at(x, y);
            pixels.seen.at(x / kBlock, y / kBlock) += reason != REASON_BORDER;
            pixels.accepted.at(x / kBlock, y / kBlock) += reason == REASON_VALID;
        }
    }
    return pixels;
}

// Calls a function with the position of each block that is at most `reach` away.
template <class Cell, class Function>
void around(const Grid<Cell> &blocks, int column, int row, int reach, Function function) {
    for (int r = std::max(row - reach, 0); r <= std::min(row + reach, blocks.height - 1); r++) {
        for (int c = std::max(column - reach, 0); c <= std::min(column + reach, blocks.width - 1);
             c++) {
            function(c, r);
        }
    }
}

// Accepted pixels of the blocks at most `reach` away, in 1/255 of those that both cameras may see.
int share_around(const Pixels &pixels, int column, int row, int reach) {
    double seen = 0, accepted = 0;
    around(pixels.seen, column, row, reach, [&](int c, int r) {
        seen += pixels.seen.at(c, r);
        accepted += pixels.accepted.at(c, r);
    });
    return seen > 0 ? static_cast<int>(255 * accepted / seen) : 0;
}

// Accepts winners that are only too expensive where many around are accepted.
void accept_costly(const Search &search, Answer *answer) {
    const Pixels pixels = pixels_of(*answer);
    const int beyond = search.disparity_count - search.extra_above;
    const int ends = beyond - search.extra_below > 2 ? 1 : 0;
    const int first = search.extra_below + (search.extra_below > 0 ? 0 : ends);
    const int last = beyond - 1 - (search.extra_above > 0 ? 0 : ends);
    for (int y = 0; y < answer->reason.height; y++) {
        for (int x = 0; x < answer->reason.width; x++) {
            const int lane = whole_px(answer->disparity_q8.at(x, y)) - search.disparity_min;
            int &reason = answer->reason.at(x, y);
            if (reason == match_rules[MATCH_COST].reason && lane >= first && lane <= last &&
                match_accepts(MATCH_MARGIN, answer->confidence.at(x, y)) &&
                share_around(pixels, x / kBlock, y / kBlock, 2) >= TUNE_SHARE_ANY_COST) {
                reason = REASON_VALID;
            }
        }
    }
}

// The reason of the first rule of the table that rejects a block.
int reason_of(const Texture &texture, const Pixels &pixels, bool coarse, int column, int row) {
    int near = 0, far = 0, strong = 0;
    around(texture.textured, column, row, 1,
           [&](int c, int r) { near += texture.textured.at(c, r); });
    around(texture.textured, column, row, 3,
           [&](int c, int r) { far += texture.textured.at(c, r); });
    around(texture.strong, column, row, 2,
           [&](int c, int r) { strong += texture.strong.at(c, r); });
    const int share = share_around(pixels, column, row, 2);
    const int own = share_around(pixels, column, row, 0);
    const bool near_texture = near >= TUNE_TEXTURED_NEAR;
    const bool sloped = texture.sloped.at(column, row) != 0;
    const int values[] = {far, near_texture || sloped ? 255 : share,
                          near_texture || !sloped ? 255 : std::max(own, share),
                          coarse && strong < TUNE_STRONG_COARSE ? share : 255};
    for (int i = 0; i < 4; i++) {
        const auto measured = static_cast<match_measure>(MATCH_TEXTURE + i);
        if (!match_accepts(measured, values[i])) {
            return match_rules[measured].reason;
        }
    }
    return REASON_VALID;
}

void reject_blocks(const View &left, double noise_q8, bool coarse, Answer *answer) {
    const Slopes slopes = slopes_of(left, *answer);
    const Pixels pixels = pixels_of(*answer);
    const Grid<int> blocks = {slopes.along.width, slopes.along.height};
    Texture texture = {blocks, blocks, blocks};
    for (int row = 0; row < blocks.height; row++) {
        for (int column = 0; column < blocks.width; column++) {
            classify_texture(slopes, noise_q8, column, row, &texture);
        }
    }
    for (int y = 0; y < answer->reason.height; y++) {
        for (int x = 0; x < answer->reason.width; x++) {
            int &reason = answer->reason.at(x, y);
            reason = reason == REASON_VALID
                         ? reason_of(texture, pixels, coarse, x / kBlock, y / kBlock)
                         : reason;
        }
    }
}

}  // namespace

// Some of the 16 pixels before must be called occluded. The pixels before, and all up to the
// outline, are plain.
void reject_hidden(const View &left, double noise_q8, Answer *answer) {
    const Grid<int> reason = answer->reason;
    const double noise = std::floor(72 * noise_q8 / 256);
    for (int y = 0; y < reason.height; y++) {
        const std::vector<int> smooth = smooth_row(left, y);
        const auto slope_at = [&](int x) {
            const auto at = static_cast<size_t>(x);
            return std::pow(smooth[at + 4] - smooth[at], 2) / noise;
        };
        const auto plain_end = [&](int x) {
            int at = std::max(x - TUNE_PLAIN_BEFORE_PX, 0);
            const int far = std::min(x + TUNE_HIDDEN_MAX_PX, reason.width);
            while (at < far && slope_at(at) <= int{TUNE_PLAIN_SLOPE}) {
                at++;
            }
            bool is_outline = false;
            for (int i = at; i < std::min(at + TUNE_OUTLINE_PX, far); i++) {
                is_outline = is_outline || slope_at(i) > int{TUNE_OUTLINE_SLOPE};
            }
            return is_outline ? at : x;
        };
        int end = 0;
        for (int x = 1; x < reason.width; x++) {
            if (reason.at(x, y) != REASON_VALID) {
                continue;
            }
            int occluded = 0;
            for (int i = std::max(x - 16, 0); i < x; i++) {
                occluded += reason.at(i, y) == REASON_OCCLUDED;
            }
            if (x >= end && occluded >= TUNE_HIDDEN_BEFORE && reason.at(x - 1, y) != REASON_VALID) {
                end = plain_end(x);
            }
            answer->reason.at(x, y) = match_accepts(MATCH_PLAIN, end - x)
                                          ? int{REASON_VALID}
                                          : match_rules[MATCH_PLAIN].reason;
        }
    }
}

void check_neighbourhood(const View &left, const View &right, const Search &search, bool coarse,
                         Answer *answer) {
    accept_costly(search, answer);
    const double noise_q8 = noise_of(left, right, *answer);
    reject_blocks(left, noise_q8, coarse, answer);
    reject_hidden(left, noise_q8, answer);
}

}  // namespace reference

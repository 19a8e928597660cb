// SPDX-License-Identifier: Apache-2.0
#include "synthetic/matched.hpp"

#include <algorithm>
#include <cmath>
#include <new>

namespace synthetic {

Memory::Memory(size_t size_bytes)
    : data_(::operator new (size_bytes, std::align_val_t{ARENA_ALIGNMENT})),
      size_bytes_(size_bytes) {}

Memory::~Memory() {
    ::operator delete (data_, std::align_val_t{ARENA_ALIGNMENT});
}

void Matched::bind() {
    input.left.data = left.data();
    input.right.data = right.data();
    output.disparity_q8.data = disparity_q8.data();
    output.reason.data = reason.data();
    output.confidence.data = confidence.data();
}

double Matched::share(int of_reason) const {
    const auto count = std::count(reason.begin(), reason.end(), static_cast<uint8_t>(of_reason));
    return static_cast<double>(count) / static_cast<double>(reason.size());
}

Matched run_match(const std::vector<uint8_t> &left, const std::vector<uint8_t> &right, int width,
                  int height, const match_options &options, const MatchSetting &setting) {
    Matched m;
    m.width = width;
    m.height = height;
    m.left = left;
    m.right = right;
    const int stride = width + setting.stride_extra;
    m.input.left = {m.left.data(), width, height, stride};
    m.input.right = {m.right.data(), width, height, stride};
    m.input.left_span = m.input.right_span = nullptr;
    const size_t pixels = static_cast<size_t>(width) * static_cast<size_t>(height);
    m.disparity_q8.assign(pixels, INT32_MIN);
    m.reason.assign(pixels, 255);
    m.confidence.assign(pixels, 0);
    m.output.disparity_q8 = {m.disparity_q8.data(), width, height, width};
    m.output.reason = {m.reason.data(), width, height, width};
    m.output.confidence = {m.confidence.data(), width, height, width};
    m.need_bytes = match_needs(width, height, &options, setting.parallel->threads).bytes;
    const Memory memory(setting.memory_bytes > 0 ? setting.memory_bytes : m.need_bytes);
    arena arena;
    arena_init(&arena, memory.data(), memory.size());
    auto progress = [](void *self, int rows_done, int rows) {
        return (*static_cast<const std::function<bool(int, int)> *>(self))(rows_done, rows);
    };
    std::function<bool(int, int)> called = setting.progress;
    m.status = match_run(&m.input, &options, setting.parallel, called ? +progress : nullptr,
                         &called, &arena, &m.output);
    m.peak_bytes = arena.peak_bytes;
    return m;
}

Matched run_match(const Pair &pair, const match_options &options, const MatchSetting &setting) {
    const int stride = pair.width + setting.stride_extra;
    return run_match(as_u8(pair.left, pair.width, pair.height, pair.bits, stride),
                     as_u8(pair.right, pair.width, pair.height, pair.bits, stride), pair.width,
                     pair.height, options, setting);
}

Comparison compare(const Matched &matched, const ViewTruth &truth,
                   const std::function<bool(int x, int y)> &counts) {
    Comparison result;
    double sum = 0;
    double squares = 0;
    int near = 0;
    for (int y = 0; y < matched.height; y++) {
        for (int x = 0; x < matched.width; x++) {
            if (!counts(x, y)) {
                continue;
            }
            const size_t i = matched.index(x, y);
            result.pixels++;
            if (!matched.valid(i)) {
                continue;
            }
            const double error = matched.disparity_px(i) - truth.disparity_px[i];
            result.valid++;
            result.bad_1px += std::abs(error) > 1;
            result.bad_2px += std::abs(error) > 2;
            if (std::abs(error) <= 1) {
                near++;
                sum += error;
                squares += error * error;
            }
        }
    }
    result.bias_px = near > 0 ? sum / near : 0;
    result.rms_px = near > 0 ? std::sqrt(squares / near) : 0;
    return result;
}

std::vector<bool> clear_pixels(const Pair &pair, int radius, int border) {
    std::vector<bool> clear = inner_pixels(pair, pair.left_truth, radius);
    for (int y = 0; y < pair.height; y++) {
        for (int x = 0; x < pair.width; x++) {
            const size_t i = pair.index(x, y);
            const bool central =
                x >= border && y >= border && x < pair.width - border && y < pair.height - border;
            clear[i] = clear[i] && central && pair.left_truth.visibility[i] == Visibility::Visible;
        }
    }
    return clear;
}

}  // namespace synthetic

// SPDX-License-Identifier: Apache-2.0
#include "bench/harness/bench_ours.hpp"

#include <algorithm>
#include <limits>
#include <map>
#include <new>
#include <stdexcept>

#include "bench/memory_count.hpp"
#include "core/error.h"
#include "daemon/base/workers.h"
#include "stereo/image/reason.h"
#include "stereo/match/match.h"
#include "stereo/subpixel.h"

namespace {

void check(int status) {
    if (status != ERROR_OK) {
        throw std::runtime_error(std::string("vergence: ") + error_text(status));
    }
}

// The columns of each row that the raw image covers: all but the black rims.
std::vector<rectify_span> spans_of(const cv::Mat &image) {
    std::vector<rectify_span> spans;
    for (int y = 0; y < image.rows; y++) {
        const uint8_t *row = image.ptr(y);
        const auto is_inside = [](uint8_t value) { return value != 0; };
        const uint8_t *begin = std::find_if(row, row + image.cols, is_inside);
        const uint8_t *end = row + image.cols;
        while (end > begin && !is_inside(end[-1])) {
            end--;
        }
        spans.push_back(begin == end ? rectify_span{0, 0}
                                     : rectify_span{static_cast<int16_t>(begin - row),
                                                    static_cast<int16_t>(end - row)});
    }
    return spans;
}

// Threads, and the memory that the core needs with that many.
class team {
  public:
    team(int threads, int width, int height, const match_options &options, bool refine)
        : workers_(workers_create(threads)) {
        if (workers_ == nullptr) {
            throw std::bad_alloc();
        }
        size_bytes_ = match_needs(width, height, &options, parallel()->threads).bytes;
        if (refine) {
            size_bytes_ = std::max(size_bytes_, subpixel_need_bytes(width, parallel()->threads));
        }
        memory_ = ::operator new (size_bytes_, std::align_val_t{ARENA_ALIGNMENT});
    }
    team(const team &) = delete;
    team &operator=(const team &) = delete;
    ~team() {
        ::operator delete (memory_, std::align_val_t{ARENA_ALIGNMENT});
        workers_destroy(workers_);
    }

    const struct parallel *parallel() const { return workers_parallel(workers_); }
    void init(arena *arena) const { arena_init(arena, memory_, size_bytes_); }

  private:
    workers *workers_;
    void *memory_;
    std::size_t size_bytes_;
};

class our_method : public bench_method {
  public:
    our_method(const bench_pair &pair, const match_options &options, bool refine)
        : pair_(pair),
          refine_(refine),
          options_(options),
          disparity_q8_(pixels()),
          reason_(pixels()),
          confidence_(pixels()),
          codes_(pixels()) {
        const int width = pair.left.cols;
        const int height = pair.left.rows;
        input_.left = {pair_.left.data, width, height, width};
        input_.right = {pair_.right.data, width, height, width};
        input_.left_colour = {pair_.left_colour.data, width, height, 3 * width};
        input_.right_colour = {pair_.right_colour.data, width, height, 3 * width};
        if (pair.is_rendered()) {  // rectified from raw images
            left_span_ = spans_of(pair.left);
            right_span_ = spans_of(pair.right);
            input_.left_span = left_span_.data();
            input_.right_span = right_span_.data();
            input_.resampled = true;
        }
        output_.disparity_q8 = {disparity_q8_.data(), width, height, width};
        output_.reason = {reason_.data(), width, height, width};
        output_.confidence = {confidence_.data(), width, height, width};
        sigma_ = {codes_.data(), width, height, width};
    }

    std::size_t first_run_bytes() override {
        const team &one = team_of(1);
        memory_count_begin();
        const std::size_t arena_bytes = run_on(one);
        return arena_bytes + memory_count_peak_bytes();
    }

    bench_time run(int threads) override {
        const team &chosen = team_of(threads);
        return bench_timed([&] { run_on(chosen); });
    }

    std::vector<float> disparity_px() override {
        std::vector<float> result(pixels(), std::numeric_limits<float>::quiet_NaN());
        for (size_t i = 0; i < result.size(); i++) {
            if (reason_[i] == REASON_VALID) {
                result[i] = static_cast<float>(disparity_q8_[i]) / 256;
            }
        }
        return result;
    }

    bench_planes planes() override {
        bench_planes result = {{}, reason_, confidence_, {}};
        for (std::size_t i = 0; i < pixels(); i++) {
            result.guess_px.push_back(static_cast<float>(disparity_q8_[i]) / 256);
            if (refine_) {
                result.sigma_px.push_back(static_cast<float>(subpixel_sigma_q8(codes_[i])) / 256);
            }
        }
        return result;
    }

  private:
    size_t pixels() const { return pair_.left.total(); }

    const team &team_of(int threads) {
        return teams_
            .try_emplace(threads, threads, pair_.left.cols, pair_.left.rows, options_, refine_)
            .first->second;
    }

    // Returns the peak use of the lent memory.
    std::size_t run_on(const team &team) {
        arena arena;
        team.init(&arena);
        check(match_run(&input_, &options_, team.parallel(), nullptr, nullptr, &arena, &output_));
        if (refine_) {
            arena_release(&arena, 0);
            subpixel fit;
            check(subpixel_begin(&fit, &input_, team.parallel(), &arena, &output_, &sigma_, false));
            subpixel_advance(&fit, input_.left.height);
        }
        return arena.peak_bytes;
    }

    bench_pair pair_;  // shares the pixels
    bool refine_;
    match_options options_;
    std::map<int, team> teams_;  // key: number of threads
    std::vector<int32_t> disparity_q8_;
    std::vector<uint8_t> reason_, confidence_;
    std::vector<uint8_t> codes_;
    std::vector<rectify_span> left_span_, right_span_;
    match_input input_{};
    match_output output_;
    image_u8 sigma_;
};

}  // namespace

std::function<std::unique_ptr<bench_method>(const bench_pair &pair)> bench_ours(match_preset preset,
                                                                                bool refine) {
    return [preset, refine](const bench_pair &pair) {
        match_options options = match_default_options(pair.disparity_min, pair.disparity_count);
        options.preset = preset;
        return std::make_unique<our_method>(pair, options, refine);
    };
}

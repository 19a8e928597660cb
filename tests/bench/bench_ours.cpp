// SPDX-License-Identifier: Apache-2.0
#include "bench/bench_ours.hpp"

#include <algorithm>
#include <limits>
#include <new>
#include <stdexcept>

#include "core/error.h"
#include "core/match.h"
#include "core/reason.h"
#include "core/refine.h"
#include "daemon/workers.h"

namespace {

class our_method : public bench_method {
  public:
    our_method(const bench_pair &pair, const bench_setting &setting, bool refine)
        : pair_(pair),
          refine_(refine),
          options_(match_default_options(pair.disparity_min, pair.disparity_count)),
          workers_(workers_create(setting.threads)),
          disparity_q8_(pixels()),
          reason_(pixels()),
          confidence_(pixels()),
          sigma_q8_(pixels()) {
        const int width = pair.left.cols;
        const int height = pair.left.rows;
        if (workers_ == nullptr) {
            throw std::bad_alloc();
        }
        parallel_ = workers_parallel(workers_);
        size_bytes_ = match_need_bytes(width, &options_, parallel_->threads);
        if (refine) {
            size_bytes_ =
                std::max(size_bytes_, refine_need_bytes(width, height, parallel_->threads));
        }
        memory_ = ::operator new (size_bytes_, std::align_val_t{ARENA_ALIGNMENT});
        input_.left = {pair_.left.data, width, height, width};
        input_.right = {pair_.right.data, width, height, width};
        input_.left_span = input_.right_span = nullptr;
        output_.disparity_q8 = {disparity_q8_.data(), width, height, width};
        output_.reason = {reason_.data(), width, height, width};
        output_.confidence = {confidence_.data(), width, height, width};
        sigma_ = {sigma_q8_.data(), width, height, width};
    }
    our_method(const our_method &) = delete;
    our_method &operator=(const our_method &) = delete;
    ~our_method() override { ::operator delete (memory_, std::align_val_t{ARENA_ALIGNMENT}); }

    void run() override {
        arena arena;
        arena_init(&arena, memory_, size_bytes_);
        check(match_run(&input_, &options_, parallel_, nullptr, nullptr, &arena, &output_));
        if (refine_) {
            arena_release(&arena, 0);
            check(refine_disparities(&input_, parallel_, &arena, &output_, &sigma_));
        }
        peak_bytes_ = arena.peak_bytes;
    }

    std::vector<float> disparity_px() const override {
        std::vector<float> result(pixels(), std::numeric_limits<float>::quiet_NaN());
        for (size_t i = 0; i < result.size(); i++) {
            if (reason_[i] == REASON_VALID) {
                result[i] = static_cast<float>(disparity_q8_[i]) / 256;
            }
        }
        return result;
    }

    std::size_t known_memory_bytes() const override { return peak_bytes_; }

  private:
    size_t pixels() const { return pair_.left.total(); }

    static void check(int status) {
        if (status != ERROR_OK) {
            throw std::runtime_error(std::string("vergence: ") + error_text(status));
        }
    }

    bench_pair pair_;  // shares the pixels
    bool refine_;
    match_options options_;
    workers *workers_;
    const struct parallel *parallel_;
    std::vector<int32_t> disparity_q8_;
    std::vector<uint8_t> reason_, confidence_;
    std::vector<uint16_t> sigma_q8_;
    match_input input_{};
    match_output output_;
    image_u16 sigma_;
    void *memory_;
    std::size_t size_bytes_, peak_bytes_ = 0;
};

}  // namespace

std::unique_ptr<bench_method> bench_make_match(const bench_pair &pair,
                                               const bench_setting &setting) {
    return std::make_unique<our_method>(pair, setting, false);
}

std::unique_ptr<bench_method> bench_make_refined(const bench_pair &pair,
                                                 const bench_setting &setting) {
    return std::make_unique<our_method>(pair, setting, true);
}
